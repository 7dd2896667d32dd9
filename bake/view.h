#pragma once
// Pack or Scene -> picture: the reference renderer, slice compositing, ground truth (method: docs/view.md)
#include <array>
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

// Looks at `points` (world) from azimuth (degrees about the up axis) and elevation (degrees) so that they just fit into a picture
// `aspect` times as wide as high, with a border of 4 %. `up`: 0 x, 1 y, 2 z; azimuth 0 is from +Y, +X, +X and azimuth −90, the front,
// from −Z, +Z, −Y. Nothing finite to look at: the unit ball.
[[nodiscard]] Camera frame_points(std::span<const V3d> points, double azimuth, double elevation, double fov, int up, double aspect = 1);

// The same for a box's corners.
[[nodiscard]] Camera orbit_camera(const Box3d& box, double azimuth, double elevation, double fov = 30, int up = 2, double aspect = 1);

// The up axis (0…2): `up` where it is one, else the habit of the first mesh's format: y for .obj, .ply and .off, z for all others (scenes, too).
[[nodiscard]] int up_axis(int up, const std::vector<SourceFile>& sources);

struct ViewOptions {
  Camera camera;
  int width = 512, height = 512;
  int samples = 16;                    // per pixel: truth; volume and slices use 1…4
  std::vector<Light> lights;           // empty: the default key light and ambient
  bool shadows = true;
  int level = -1;                      // volume: use this level only; −1: by the cone's aperture, two levels blended
  int slice_axis = -1;                 // slices: −1 chooses the axis by the rule of docs/view.md
  int threads = 0;
  Sidedness two_sided = Sidedness::kAuto;  // truth: as the pack was baked
  // Truth of a pack that repeats: one period of the scene repeated along these axes, as far as it lies within the pack's grid.
  std::array<bool, 3> cyclic{false, false, false};
  Grid grid;
};

enum class ViewMode { kVolume, kSlices, kTruth };

// Straight linear RGBA pictures, alpha = what the ray met. The same camera and light give pictures that can be laid side by side.
// Deterministic for any thread count. Throws Error{kBadInput} when the pack lacks what the mode needs (names the grid).
[[nodiscard]] Image view_volume(const Pack& pack, const ViewOptions& options, Report& report);  // cone tracing
[[nodiscard]] Image view_slices(const Pack& pack, const ViewOptions& options, Report& report);  // back-to-front compositing
[[nodiscard]] Image view_truth(const Scene& scene, const ViewOptions& options, Report& report); // Embree, the geometry itself

struct SheetOptions {
  int tile = 320;                      // pixels a side, 16…4096
  int up = 2;
  std::vector<Light> lights;           // what was baked into the slices; empty: they are albedo
  bool shadows = false;                // whether those lights cast shadows
  int threads = 0;
  Sidedness two_sided = Sidedness::kAuto;
};

// The pack's preview.png: truth (where `scene` is given), volume, slices from a grazing angle and a coarser level, side by side from one
// camera, labelled. All under the same light: `lights`, which the slices already hold, or, without any, the default light with shadows,
// by which the slices are lit here with the volume's normals where it has them. Throws Error{kCommandLine} for the tile's size.
[[nodiscard]] Image contact_sheet(const Pack& pack, const Scene* scene, const SheetOptions& sheet, Report& report);

// `image` over a plain background (straight linear RGBA -> opaque RGB).
[[nodiscard]] Image over_background(const Image& image, V3f background);

}  // namespace texel
