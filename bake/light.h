#pragma once
// Stage 3b: Scene -> oblique rays: baked light, shadows, ground truth (Embree)
#include <memory>
#include <span>

#include "bake/recipe.h"
#include "formats/scene.h"

namespace texel {

// The scene as Embree sees it: centred and scaled to unit size in double before it becomes float, ROBUST, MEDIUM build.
class RayScene {
 public:
  explicit RayScene(const Scene& scene);  // keeps a reference to nothing
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  // Whether the open segment from `from` towards `to` (world) is blocked, cut-outs and transparency let through (returns the share
  // blocked, 0…1). `from` and `to` are moved off the surface by about 1e-6 of the scene's size. Thread-safe.
  [[nodiscard]] float blocked(const V3d& from, const V3d& to) const;

  struct Hit { std::uint32_t triangle = kNoIndex; double distance = 0; float u = 0, v = 0; };  // barycentrics of corners 1 and 2
  // First hit along the ray (world); no triangle where it misses. Cut-outs are not applied. Thread-safe.
  [[nodiscard]] Hit first_hit(const V3d& origin, const V3d& direction, double from = 0) const;

  struct Impl;
  std::unique_ptr<Impl> impl;
};

// Light arriving at a point with unit normal n (world): Σ ambient + sun·max(0, n·l)·visibility + point·max(0, n·l)/d²·visibility,
// to be multiplied by the albedo. `rays` null: no shadows. `two_sided` takes |n·l| … of the side facing the light. Thread-safe.
[[nodiscard]] V3f irradiance(std::span<const Light> lights, const RayScene* rays, const V3d& point, const V3d& normal, bool two_sided);

}  // namespace texel
