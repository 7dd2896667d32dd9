#include "formats/instances.h"

#include <algorithm>
#include <string>

#include "formats/error.h"

namespace texel {
namespace {

constexpr std::uint64_t kMost = std::uint64_t{1} << 27;

Box3d mesh_bounds(const Mesh& mesh, const Affine* place) {
  Box3d box;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) box.extendBy(place ? *place * mesh.points[corner] : mesh.points[corner]);
  return box;
}

Box3d moved_box(const Box3d& box, const Affine& place) {
  Box3d moved;
  for (int corner = 0; corner < 8; ++corner)
    moved.extendBy(place * V3d(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y, corner & 4 ? box.max.z : box.min.z));
  return moved;
}

bool within(const Box3d& inner, const Box3d& outer) {
  return !outer.isEmpty() && outer.intersects(inner.min) && outer.intersects(inner.max);
}

}  // namespace

std::uint64_t count_triangles(const Scene& scene) {
  std::uint64_t count = scene.mesh.triangles.size();
  for (const Instance& instance : scene.instances) count += scene.shapes[instance.shape].triangles.size();
  return count;
}

Box3d surface_bounds(const Scene& scene) { return instance_bounds(scene, mesh_bounds(scene.mesh, nullptr)); }

Box3d instance_bounds(const Scene& scene, Box3d box) {
  std::vector<Box3d> shapes;
  for (const Mesh& shape : scene.shapes) shapes.push_back(mesh_bounds(shape, nullptr));
  for (const Instance& instance : scene.instances) {
    const Box3d& own = shapes[instance.shape];
    // The corners of a box lie no nearer the middle than what is in it.
    if (own.isEmpty() || within(moved_box(own, instance.place), box)) continue;
    const Box3d exact = mesh_bounds(scene.shapes[instance.shape], &instance.place);
    box.extendBy(exact.min);
    box.extendBy(exact.max);
  }
  return box;
}

void place_shape(const Mesh& shape, const Affine& place, Mesh& mesh) {
  const auto points = static_cast<std::uint32_t>(mesh.points.size()), uvs = static_cast<std::uint32_t>(mesh.uvs.size());
  const bool mirrors = place.determinant() < 0;
  // A shape without vertex colours multiplies by white, one without texture coordinates has none.
  if (!shape.colors.empty() && mesh.colors.empty()) mesh.colors.resize(points, V3f(1, 1, 1));
  if (!shape.uv_corners.empty() && mesh.uv_corners.empty()) mesh.uv_corners.resize(mesh.triangles.size(), {kNoIndex, kNoIndex, kNoIndex});
  for (const V3d& p : shape.points) mesh.points.push_back(place * p);
  mesh.uvs.insert(mesh.uvs.end(), shape.uvs.begin(), shape.uvs.end());
  if (!shape.colors.empty()) mesh.colors.insert(mesh.colors.end(), shape.colors.begin(), shape.colors.end());
  else if (!mesh.colors.empty()) mesh.colors.resize(mesh.points.size(), V3f(1, 1, 1));
  const std::size_t second = mirrors ? 2 : 1, third = mirrors ? 1 : 2;
  for (const auto& t : shape.triangles) mesh.triangles.push_back({points + t[0], points + t[second], points + t[third]});
  const auto moved_uv = [&](std::uint32_t uv) { return uv == kNoIndex ? kNoIndex : uv + uvs; };
  for (const auto& t : shape.uv_corners) mesh.uv_corners.push_back({moved_uv(t[0]), moved_uv(t[second]), moved_uv(t[third])});
  if (!mesh.uv_corners.empty()) mesh.uv_corners.resize(mesh.triangles.size(), {kNoIndex, kNoIndex, kNoIndex});
  mesh.materials.insert(mesh.materials.end(), shape.materials.begin(), shape.materials.end());
}

Scene flatten_instances(const Scene& scene) {
  std::uint64_t points = scene.mesh.points.size(), triangles = count_triangles(scene);
  for (const Instance& instance : scene.instances) points += scene.shapes[instance.shape].points.size();
  if (points > kMost || triangles > kMost)
    throw Error(Code::kUnsupported, "", "its instances have more than 2^27 triangles or points together (" + std::to_string(triangles) + " triangles)", "bake parts of it by themselves");
  Scene flat = scene;
  flat.shapes.clear();
  flat.instances.clear();
  flat.mesh.points.reserve(points);
  flat.mesh.triangles.reserve(triangles);
  flat.mesh.materials.reserve(triangles);
  for (const Instance& instance : scene.instances) place_shape(scene.shapes[instance.shape], instance.place, flat.mesh);
  return flat;
}

}  // namespace texel
