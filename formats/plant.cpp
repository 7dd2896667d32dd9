#include "formats/plant.h"

#include <algorithm>
#include <cmath>

#include "formats/error.h"
#include "formats/readers.h"

namespace texel {

void settle_points(PlantMesh& mesh) {
  mesh.low = std::numeric_limits<double>::infinity();
  mesh.high = -mesh.low;
  for (V3d& p : mesh.points) {
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) {
      mesh.low = std::min(mesh.low, p.x);
      mesh.high = std::max(mesh.high, p.x);
    } else {
      p = V3d(0, 0, 0);
    }
  }
}

void place_plant(const Plant& plant, const Affine& placement, std::uint32_t first_material, Scene& scene, Report& report, const std::string& where) {
  constexpr std::size_t kMost = std::size_t{1} << 27;
  Mesh& mesh = scene.mesh;
  std::size_t points = mesh.points.size(), triangles = mesh.triangles.size();
  for (const PlantOrgan& organ : plant.organs) {
    points += plant.meshes[organ.mesh].points.size();
    triangles += plant.meshes[organ.mesh].triangles.size();
    if (points > kMost || triangles > kMost)
      throw Error(Code::kUnsupported, where, "its organs have more than 2^27 triangles or points together", "bake parts of it by themselves");
  }
  // Grown as vectors grow: scenes place many plants one after another.
  if (points > mesh.points.capacity()) mesh.points.reserve(mesh.points.empty() ? points : std::max(points, mesh.points.size() + mesh.points.size() / 2));
  if (triangles > mesh.triangles.capacity()) {
    const std::size_t room = mesh.triangles.empty() ? triangles : std::max(triangles, mesh.triangles.size() + mesh.triangles.size() / 2);
    mesh.triangles.reserve(room);
    mesh.materials.reserve(room);
  }
  std::size_t done = 0;
  for (const PlantOrgan& organ : plant.organs) {
    const PlantMesh& shape = plant.meshes[organ.mesh];
    const Affine matrix = placement * organ.matrix;
    const bool taper = shape.tapers && shape.high > shape.low && std::isfinite(organ.base) && std::isfinite(organ.tip);
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    for (V3d p : shape.points) {
      if (taper) {
        const double w = organ.base + (organ.tip - organ.base) * ((p.x - shape.low) / (shape.high - shape.low));
        p.y *= w;
        p.z *= w;
      }
      mesh.points.push_back(matrix * p);
    }
    const bool mirrored = matrix.determinant() < 0;
    for (const auto& t : shape.triangles) {
      mesh.triangles.push_back({first + t[0], first + t[mirrored ? 2 : 1], first + t[mirrored ? 1 : 2]});
      mesh.materials.push_back(first_material + organ.material);
    }
    if (report.progress && ++done % 65536 == 0) report.progress("place organs", static_cast<double>(done) / static_cast<double>(plant.organs.size()));
  }
}

Scene plant_scene(const Plant& plant, const PlantOptions& options, Report& report, const std::string& where) {
  Scene scene;
  scene.materials = plant.materials;
  const double unit = options.unit > 0 ? options.unit : plant.unit;
  place_plant(plant, Affine::scale(unit > 0 ? unit : 1), 0, scene, report, where);
  report.count("organs", static_cast<double>(plant.organs.size()));
  finish_mesh(scene, report, where, "holds no drawable geometry");
  return scene;
}

Material plain_organ() {
  const double neutral[3] = {0.8, 0.8, 0.8};
  return plain_color("default", plant_color(neutral));
}

V3f plant_color(const double* rgb) {
  V3f linear;
  (void)decode_color(rgb, linear);
  return linear;
}

}  // namespace texel
