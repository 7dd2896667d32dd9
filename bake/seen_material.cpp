#include "bake/seen_material.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace texel {
namespace {

// Of what a ray crosses.
struct Shade {
  double area = 0;              // that the ray stands for
  double sides = 1;             // that an eye may see, over those that count in the area: of a fibre its whole wall does
  V3f color{0, 0, 0};
  const Material* material = nullptr;
};

Shade fibre_shade(const Bundle& bundle, const FibreSegment& fibre, const SeenRay& ray, bool color) {
  const Scene& scene = *bundle.scene;
  const FibreShape shape = fibre_shape(fibre);
  const double shadows = shape.shadow.x + shape.shadow.y + shape.shadow.z;  // a piece's whole wall goes with the rays they get
  Shade shade{.area = shadows > 0 ? shape.area / shadows : 0, .sides = 0.5, .color = scene.materials[fibre.material].kd, .material = &scene.materials[fibre.material]};
  if (!color || !(shape.area > 0)) return shade;
  const double s = fibre_place(bundle, fibre, ray.u, ray.v);
  if (shade.material->solid) shade.color = shade.material->solid->color(bundle.plan->grid.to_world(fibre.a + (fibre.b - fibre.a) * s), V3d(0, 0, 1), bundle.plan->grid.h * ray.width);
  if (const auto& colors = scene.fibres.colors; !colors.empty()) shade.color *= colors[fibre.point] * static_cast<float>(1 - s) + colors[fibre.point + 1] * static_cast<float>(s);
  return shade;
}

Shade shade_of(const Bundle& bundle, const Crossing& c, const SeenRay& ray, bool color) {
  if (const FibreSegment* fibre = crossed_fibre(bundle, c)) return fibre_shade(bundle, *fibre, ray, color);
  const Face face = crossed_face(bundle, c);
  const auto& [p0, p1, p2] = face.p;
  const V3d normal = triangle_normal(p0, p1, p2) * static_cast<double>(face.turn);
  const double sum = std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z);
  const Material& material = bundle.scene->materials[face.material];
  Shade shade{.area = sum > 0 ? 1 / sum : 0, .color = material.kd, .material = &material};
  if (!color || !(sum > 0) || (!material.solid && !bundle.textures->textured(face.material) && face.mesh->colors.empty())) return shade;
  const Barycentrics b = face_barycentrics(bundle.axes, p0, p1, p2, ray.u, ray.v);
  if (material.solid) shade.color = material.solid->color(bundle.plan->grid.to_world(p0 + (p1 - p0) * b.b1 + (p2 - p0) * b.b2), normal, bundle.plan->grid.h * ray.width);
  else shade.color = footprint_sample(*bundle.textures, *face.mesh, face.triangle, b.b1, b.b2, face.uv_width * static_cast<float>(bundle.plan->grid.h * ray.width)).color;
  return shade;
}

void add_shade(const Shade& shade, double weight, const SeenWant& want, ShadeSums& to) {
  const double area = weight * shade.area;
  if (!(area > 0)) return;
  to.area += area;
  if (want.color) to.color += V3d(shade.color) * area;
  if (want.material) to.material.add(*shade.material, area);
}

}  // namespace

void add_seen(const Bundle& bundle, const SeenRay& ray, const SeenWant& want, SeenMaterial& to) {
  const std::size_t n = ray.list.size();
  if (n == 0) return;
  int winding = ray.winding;
  for (const Crossing& c : ray.list) winding += c.winding;
  const auto passes = [&](const Crossing& c) {
    return 1 - static_cast<double>(c.coverage) * static_cast<double>(bundle.scene->materials[crossed_material(bundle, c)].opacity);
  };
  // What reaches each crossing from the far end, last first; few rays meet more than a handful in a voxel.
  constexpr std::size_t kUsual = 16;
  double few[kUsual];
  std::vector<double> many(n > kUsual ? n : 0);
  double* const back = n > kUsual ? many.data() : few;
  double open = winding == 0 ? 1 : 0;
  int inside = winding;
  for (std::size_t i = n; i-- > 0;) {
    back[i] = open;
    inside -= ray.list[i].winding;
    open = inside != 0 ? 0 : open * passes(ray.list[i]);
  }
  open = ray.winding == 0 ? 1 : 0;
  inside = ray.winding;
  for (std::size_t i = 0; i < n; ++i) {
    const Crossing& c = ray.list[i];
    const double there = static_cast<double>(c.coverage) / ray.rays;
    const double seen = there * ((open + back[i]) / 2);
    inside += c.winding;
    open = inside != 0 ? 0 : open * passes(c);
    if (!(there > 0)) continue;
    const Shade shade = shade_of(bundle, c, ray, want.color);
    add_shade(shade, there, want, to.met);
    add_shade(shade, seen * shade.sides, want, to.seen);
  }
}

SeenSurface seen_surface(const Surface& surface, const std::vector<SeenMaterial>& seen, const SeenWant& want) {
  SeenSurface out;
  if (seen.empty()) return out;
  if (want.color) out.color = surface.color;
  if (want.material) out.material = surface.material;
  // Few rays may say more than there is: no mean becomes negative, none grows above 1 and what was met.
  const auto moved = [](double sum, double covered, double seen_mean, double met_mean) {
    const double mean = sum / covered;
    return covered * std::clamp(mean + (seen_mean - met_mean), 0.0, std::max({1.0, mean, seen_mean}));
  };
  tbb::parallel_for(std::size_t{0}, (seen.size() + 4095) / 4096, [&](std::size_t chunk) {
    for (std::size_t i = chunk * 4096; i < std::min(seen.size(), (chunk + 1) * 4096); ++i) {
      const ShadeSums &s = seen[i].seen, &m = seen[i].met;
      const double covered = surface.areas[i].covered;
      if (!(s.area > 0) || !(m.area > 0) || !(covered > 0)) continue;
      const auto move = [&](double& sum, double seen_sum, double met_sum) { sum = moved(sum, covered, seen_sum / s.area, met_sum / m.area); };
      for (int k = 0; k < 3; ++k) {
        if (want.color) move(out.color[i][k], s.color[k], m.color[k]);
        if (!want.material) continue;
        move(out.material[i].ks[k], s.material.ks[k], m.material.ks[k]);
        move(out.material[i].emission[k], s.material.emission[k], m.material.emission[k]);
      }
      if (!want.material) continue;
      move(out.material[i].sharpness, s.material.sharpness, m.material.sharpness);
      move(out.material[i].roughness2, s.material.roughness2, m.material.roughness2);
      move(out.material[i].transparency, s.material.transparency, m.material.transparency);
    }
  });
  return out;
}

}  // namespace texel
