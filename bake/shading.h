#pragma once
// What the three view modes share: the camera's rays, the lights and how a surface answers to them (docs/view.md)
#include <functional>
#include <string>
#include <vector>

#include "bake/light.h"
#include "bake/view.h"

namespace texel {

// A camera made ready for one picture size: pixel -> ray.
struct Rays {
  V3d eye, right, up, forward;   // orthonormal
  bool perspective = false;
  double half_height = 1;        // world units, or at distance 1
  int width = 1, height = 1;

  struct Ray { V3d origin, direction; };
  // Through (x,y) in pixels, (0,0) the picture's upper left corner; unit direction.
  [[nodiscard]] Ray at(double x, double y) const;
  // Width (world) of a pixel at distance t along its ray.
  [[nodiscard]] double footprint(double t) const {
    const double pixel = 2 * half_height / height;
    return perspective ? pixel * t : pixel;
  }
};

// Throws Error{kCommandLine} for a picture without pixels, of more than 2^28, or a camera that sees nothing (not finite).
[[nodiscard]] Rays make_rays(const Camera& camera, int width, int height);

// options.lights, or the default: a sun from the camera's upper left and ambient light, 1 in all on a facing white surface.
[[nodiscard]] std::vector<Light> view_lights(const ViewOptions& options, const Rays& rays);

// Where in its pixel (0…1 each way) the i-th of n samples lies: a rank-1 sequence turned by a hash of the pixel.
[[nodiscard]] V2f pixel_sample(int x, int y, int i, int n);

// Calls row(y) for each row, in parallel with at most `threads` threads (0: all). What row y writes must depend on y alone.
void for_rows(int height, int threads, const std::function<void(int)>& row);

// A picture of rays.width x rays.height straight RGBA pixels: `trace` adds what one ray sees, premultiplied, to colour and alpha; each pixel is the
// mean over `samples` of them. `stage` is what report.progress hears, row by row. `trace` must be thread-safe.
[[nodiscard]] Image trace_pixels(const Rays& rays, int samples, int threads, const std::string& stage, const Report& report,
                                 const std::function<void(const Rays::Ray& ray, V3f* color, float* alpha)>& trace);

// Local answer of a surface: diffuse albedo, GGX lobe of constant reflectance ks and width roughness, emission.
struct Look {
  V3f albedo{0.5f, 0.5f, 0.5f}, ks{0, 0, 0}, ke{0, 0, 0};
  float roughness = 1;
};

// Light sent by a facet with normal n towards v, lit from l by `color` (all unit, n·v and n·l > 0): albedo·color·n·l + the lobe.
[[nodiscard]] V3f lit_facet(const Look& look, const V3d& n, const V3d& v, const V3d& l, const V3f& color);

// Sum of the ambient lights.
[[nodiscard]] V3f ambient_of(const std::vector<Light>& lights);

inline constexpr float kMinRoughness = 0.02f;  // a narrower lobe would fall between samples

}  // namespace texel
