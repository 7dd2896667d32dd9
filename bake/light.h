#pragma once
// Stage 3b: Scene -> oblique rays: baked light, shadows, ground truth (Embree)
#include <array>
#include <memory>
#include <span>

#include "bake/recipe.h"
#include "bake/texture.h"
#include "formats/scene.h"

namespace texel {

// One period of a scene that repeats (world): shadow rays that leave it on these axes come in again on the other side, up to `most` periods in all. With 1
// the period stands alone.
struct ScenePeriod {
  Box3d box;
  std::array<bool, 3> axes{false, false, false};
  int most = 1000;
};

// The scene as Embree sees it: centred and scaled to unit size in double before it becomes float, ROBUST, MEDIUM build.
class RayScene {
 public:
  // Keeps copies of what it needs of `scene`. `textures` (must outlive this; kCoverage is enough) may be null: it decodes its own then.
  // Fibres are chains of round cones with balls at their points (Embree's round linear curves).
  // Of a scene that repeats: `scene` is all that reaches into the period (repeat.h, without curtains).
  explicit RayScene(const Scene& scene, const TextureSet* textures = nullptr, const ScenePeriod& period = {});
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  // Whether the open segment from `from` towards `to` (world) is blocked, cut-outs and transparency let through (returns the share
  // blocked, 0…1). `from` and `to` are moved off the surface by about 1e-6 of the scene's size. Thread-safe.
  [[nodiscard]] float blocked(const V3d& from, const V3d& to) const;

  // Barycentrics u, v of corners 1 and 2; `front`: the ray comes from the side the triangle's normal points to. Of several hits at one
  // distance a front one comes first, then the lower index, so that the answer does not depend on how the tree was built.
  // Fibres' pieces are numbered behind the triangles in the order of their strands; u is then the place along the piece and `normal` the wall's.
  // Of an instance `triangle` is one of its shape's, and `front` is as if the shape stood there unmirrored.
  struct Hit {
    std::uint32_t triangle = kNoIndex;
    double distance = 0;
    float u = 0, v = 0;
    bool front = true;
    V3d normal{0, 0, 0};
    std::uint32_t instance = kNoIndex;  // into Scene::instances; kNoIndex: of the mesh or a fibre
  };
  // First hit along the ray (world); no triangle where it misses. Cut-outs are not applied. Thread-safe.
  [[nodiscard]] Hit first_hit(const V3d& origin, const V3d& direction, double from = 0) const;
  // The same; surface that is not there is passed through: coverage below 1/512 in a footprint `width` + `spread`·distance about it.
  [[nodiscard]] Hit first_covered_hit(const V3d& origin, const V3d& direction, double from, double width, double spread) const;

  // Distance (world) that a ray must be moved on to leave a hit behind: about 1e-6 of the scene's size.
  [[nodiscard]] double skin() const;

  // Share of light (0…1) from the given light that reaches `point` on a surface with unit normal `normal`, which faces the light. Lights do not
  // repeat with the scene.
  [[nodiscard]] float visibility(const Light& light, const V3d& point, const V3d& normal) const;

  struct Impl;

 private:
  [[nodiscard]] float through_periods(const V3d& start, const V3d& direction, double length) const;

  std::unique_ptr<Impl> impl_;
};

// Direction (unit) from `point` to a sun or point light and the light's colour there, falling off as 1/d². False for ambient light,
// a sun without direction and a point light at the point itself.
[[nodiscard]] bool light_at(const Light& light, const V3d& point, V3d* direction, V3f* color);

// Light arriving at a point with unit normal n (world): Σ ambient + sun·max(0, n·l)·visibility + point·max(0, n·l)/d²·visibility,
// to be multiplied by the albedo. `rays` null: no shadows. `two_sided` takes |n·l| … of the side facing the light. Thread-safe.
[[nodiscard]] V3f irradiance(std::span<const Light> lights, const RayScene* rays, const V3d& point, const V3d& normal, bool two_sided);

// The mean over the wall of a round fibre (unit direction `t`, `radius` about `axis`, world) of the light that arrives: Σ ambient + sun·(sin θ)/π·visibility …, with
// shadows looked for from the fibre's side that faces the light. Thread-safe.
[[nodiscard]] V3f fibre_irradiance(std::span<const Light> lights, const RayScene* rays, const V3d& axis, const V3d& t, double radius);

}  // namespace texel
