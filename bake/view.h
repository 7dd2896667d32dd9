#pragma once
// Pack or Scene -> picture: the reference renderer, slice compositing, ground truth (method: docs/view.md)
#include <optional>
#include <span>
#include <vector>

#include "bake/recipe.h"
#include "formats/image.h"
#include "formats/pack.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// A camera in world space, right-handed. Perspective when fov > 0 (vertical, degrees), else orthographic with `height` world units.
struct Camera {
  V3d eye{0, 0, 0}, target{0, 0, 0}, up{0, 0, 1};
  double fov = 0;
  double height = 1;
};

// Looks at the middle of `box` from azimuth (degrees about +Z, 0 = from +X, −90 = from −Y) and elevation (degrees), far enough that
// the box's sphere fits.
[[nodiscard]] Camera orbit_camera(const Box3d& box, double azimuth, double elevation, double fov = 30);

struct ViewOptions {
  Camera camera;
  int width = 512, height = 512;
  int samples = 16;                    // per pixel: truth; volume and slices use 1…4
  std::vector<Light> lights;           // empty: the default key light and ambient
  bool shadows = true;
  int level = -1;                      // volume: use this level only; −1: by the cone's aperture, two levels blended
  int slice_axis = -1;                 // slices: −1 chooses the axis by the rule of docs/view.md
  int threads = 0;
};

enum class ViewMode { kVolume, kSlices, kTruth };

// Straight linear RGBA pictures, alpha = what the ray met. The same camera and light give pictures that can be laid side by side.
// Deterministic for any thread count. Throws Error{kBadInput} when the pack lacks what the mode needs (names the grid).
[[nodiscard]] Image view_volume(const Pack& pack, const ViewOptions& options, Report& report);  // cone tracing
[[nodiscard]] Image view_slices(const Pack& pack, const ViewOptions& options, Report& report);  // back-to-front compositing
[[nodiscard]] Image view_truth(const Scene& scene, const ViewOptions& options, Report& report); // Embree, the geometry itself

// The pack's preview.png: a sheet of truth (where `scene` is given), volume, slices from a grazing angle and a coarser level, labelled.
[[nodiscard]] Image contact_sheet(const Pack& pack, const Scene* scene, int tile_size, int threads, Report& report);

// `image` over a plain background (straight linear RGBA -> opaque RGB).
[[nodiscard]] Image over_background(const Image& image, V3f background);

}  // namespace texel
