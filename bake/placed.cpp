#include "bake/placed.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "bake/plan.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr std::uint32_t kLeaf = 8;  // triangles

V3d corner(const Mesh& mesh, std::uint32_t triangle, int i) { return mesh.points[mesh.triangles[triangle][static_cast<std::size_t>(i)]]; }

// Halves by the middle triangle along the longest side of the triangles' middles, so that the depth is known.
void build_tree(const Mesh& mesh, ShapeTree& tree) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  if (count == 0) return;
  std::vector<V3f> middle(count);
  for (std::uint32_t t = 0; t < count; ++t) middle[t] = V3f((corner(mesh, t, 0) + corner(mesh, t, 1) + corner(mesh, t, 2)) / 3.0);
  tree.order.resize(count);
  std::iota(tree.order.begin(), tree.order.end(), 0u);
  struct Part { std::uint32_t first, count, parent; };
  std::vector<Part> waiting{{0, count, kNoIndex}};
  while (!waiting.empty()) {
    const Part part = waiting.back();
    waiting.pop_back();
    const auto at = static_cast<std::uint32_t>(tree.nodes.size());
    ShapeNode& node = tree.nodes.emplace_back();
    node.first = part.first;
    node.count = part.count;
    Imath::Box3f spread;
    for (std::uint32_t i = part.first; i < part.first + part.count; ++i) {
      for (int c = 0; c < 3; ++c) node.box.extendBy(corner(mesh, tree.order[i], c));
      spread.extendBy(middle[tree.order[i]]);
    }
    // The first half is made next; the second tells its parent where it came to be.
    if (part.parent != kNoIndex && at != part.parent + 1) tree.nodes[part.parent].second = at;
    if (part.count <= kLeaf) continue;
    const int axis = static_cast<int>(spread.majorAxis());
    const std::uint32_t half = part.count / 2;
    const auto begin = tree.order.begin() + part.first;
    std::nth_element(begin, begin + half, begin + part.count,
                     [&](std::uint32_t a, std::uint32_t b) { return middle[a][axis] != middle[b][axis] ? middle[a][axis] < middle[b][axis] : a < b; });
    waiting.push_back({part.first + half, part.count - half, at});
    waiting.push_back({part.first, half, at});
  }
}

double area_of(const V3d& a, const V3d& b, const V3d& c) { return (b - a).cross(c - a).length() / 2; }

// Rotation, mirroring and one scale: areas all grow by its square.
bool keeps_shape(const std::array<double, 9>& m) {
  const V3d x(m[0], m[3], m[6]), y(m[1], m[4], m[7]), z(m[2], m[5], m[8]);
  const double s = x.length2(), slack = 1e-12 * s;
  return std::abs(y.length2() - s) <= slack && std::abs(z.length2() - s) <= slack && std::abs(x.dot(y)) <= slack && std::abs(y.dot(z)) <= slack && std::abs(z.dot(x)) <= slack;
}

struct ShapeSums { double area = 0; std::int64_t degenerate = 0; };

ShapeSums measure_shape(const Mesh& mesh) {
  ShapeSums sums;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const double area = area_of(corner(mesh, t, 0), corner(mesh, t, 1), corner(mesh, t, 2));
    sums.area += area;
    sums.degenerate += !(area > 0);
  }
  return sums;
}

Placed make_placed(const Instance& instance, const Grid& grid) {
  Placed placed;
  placed.shape = instance.shape;
  placed.place = instance.place;
  placed.mirrors = instance.place.determinant() < 0;
  const auto& m = instance.place.m;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) placed.turn[3 * r + c] = m[4 * r + c] / grid.h;
  placed.move = grid.to_voxel(V3d(m[3], m[7], m[11]));
  if (keeps_shape(placed.turn)) placed.scale = std::cbrt(std::abs(instance.place.determinant())) / grid.h;
  return placed;
}

}  // namespace

Box3d placed_box(const Placed& placed, const Box3d& box) {
  const V3d middle = (box.min + box.max) / 2.0, half = (box.max - box.min) / 2.0;
  const std::array<double, 9>& m = placed.turn;
  Box3d moved;
  for (int r = 0; r < 3; ++r) {
    const std::size_t k = static_cast<std::size_t>(r) * 3;
    const double at = m[k] * middle.x + m[k + 1] * middle.y + m[k + 2] * middle.z + placed.move[r];
    const double reach = std::abs(m[k]) * half.x + std::abs(m[k + 1]) * half.y + std::abs(m[k + 2]) * half.z;
    const double slack = 1e-12 * (std::abs(m[k] * middle.x) + std::abs(m[k + 1] * middle.y) + std::abs(m[k + 2] * middle.z) + std::abs(placed.move[r]) + reach) + 0x1p-20;
    moved.min[r] = at - reach - slack;
    moved.max[r] = at + reach + slack;
  }
  return moved;
}

void plan_instances(const Scene& scene, const Recipe& recipe, Plan& plan, Report& report) {
  if (scene.instances.empty()) return;
  Statistics& s = plan.statistics;
  std::vector<ShapeSums> sums;
  std::vector<Statistics> parts;
  for (const Mesh& shape : scene.shapes) {
    ShapeTree& tree = plan.shapes.emplace_back();
    build_tree(shape, tree);
    sums.push_back(measure_shape(shape));
    parts.push_back(find_shape_solids(shape, scene.materials, recipe, tree.turn, tree.winding, report));
  }
  for (const Instance& instance : scene.instances) {
    Placed placed = make_placed(instance, plan.grid);
    const Mesh& shape = scene.shapes[placed.shape];
    const ShapeTree& tree = plan.shapes[placed.shape];
    if (tree.nodes.empty()) continue;
    placed.box = placed_box(placed, tree.nodes[0].box);
    placed.first = plan.placed_triangles;
    plan.placed_triangles += shape.triangles.size();
    if (placed.scale > 0) {
      const double grown = placed.scale * plan.grid.h;
      s.area += sums[placed.shape].area * grown * grown;
      s.degenerate += sums[placed.shape].degenerate;
    } else {
      for (std::uint32_t t = 0; t < shape.triangles.size(); ++t) {
        const double area = area_of(placed.place * corner(shape, t, 0), placed.place * corner(shape, t, 1), placed.place * corner(shape, t, 2));
        s.area += area;
        s.degenerate += !(area > 0);
      }
    }
    const Statistics& part = parts[placed.shape];
    s.components += part.components;
    s.closed += part.closed;
    s.volume += part.volume * std::abs(placed.place.determinant());
    plan.fill = plan.fill || part.volume != 0;
    plan.placed.push_back(placed);
  }
  if (plan.placed_triangles >> 48 != 0) throw Error(Code::kUnsupported, "", "its instances have more than 2^48 triangles together", "bake the scene in parts");
  s.triangles += static_cast<std::int64_t>(plan.placed_triangles);
  report.count("instances", static_cast<double>(plan.placed.size()));
}

Face mesh_face(const Scene& scene, const Plan& plan, std::uint32_t triangle) {
  const auto& t = scene.mesh.triangles[triangle];
  return {.p = {plan.points[t[0]], plan.points[t[1]], plan.points[t[2]]}, .mesh = &scene.mesh, .triangle = triangle, .material = scene.mesh.materials[triangle],
          .turn = plan.turn[triangle], .winding = plan.winding[triangle], .uv_width = plan.uv_width.empty() ? 0 : plan.uv_width[triangle]};
}

Face placed_face(const Scene& scene, const Plan& plan, const Placed& placed, std::uint32_t triangle) {
  const Mesh& mesh = scene.shapes[placed.shape];
  const ShapeTree& tree = plan.shapes[placed.shape];
  Face face{.p = {}, .mesh = &mesh, .triangle = triangle, .material = mesh.materials[triangle],
            .turn = placed.mirrors ? static_cast<std::int8_t>(-tree.turn[triangle]) : tree.turn[triangle], .winding = tree.winding[triangle], .uv_width = 0};
  for (int i = 0; i < 3; ++i) face.p[static_cast<std::size_t>(i)] = plan_point(plan.grid, placed.place * corner(mesh, triangle, i));
  if (!tree.uv_width.empty() && tree.uv_width[triangle] > 0) {
    const double before = area_of(corner(mesh, triangle, 0), corner(mesh, triangle, 1), corner(mesh, triangle, 2));
    const double after = area_of(face.p[0], face.p[1], face.p[2]) * plan.grid.h * plan.grid.h;
    face.uv_width = after > 0 ? tree.uv_width[triangle] * static_cast<float>(std::sqrt(before / after)) : 0;
  }
  return face;
}

const Placed& find_placed(const Plan& plan, std::uint64_t number, std::uint32_t* triangle) {
  const auto after = std::upper_bound(plan.placed.begin(), plan.placed.end(), number, [](std::uint64_t n, const Placed& p) { return n < p.first; });
  const Placed& placed = *(after - 1);
  *triangle = static_cast<std::uint32_t>(number - placed.first);
  return placed;
}

PlacedLayers layer_placed(const Plan& plan, int axis, int thick, int layers) {
  PlacedLayers result;
  if (plan.placed.empty()) return result;
  const auto for_each_layer = [&](auto&& call) {
    for (std::uint32_t i = 0; i < plan.placed.size(); ++i) {
      // One cell more on either side than the rule of walls can ask for.
      const double top = static_cast<double>(layers) * thick;
      const double lo = plan.placed[i].box.min[axis] - 1, hi = plan.placed[i].box.max[axis] + 1;
      if (hi < 0 || lo > top) continue;
      const int l0 = static_cast<int>(std::max(lo, 0.0)) / thick, l1 = std::min(layers - 1, static_cast<int>(std::min(hi, top)) / thick);
      for (int l = l0; l <= l1; ++l) call(static_cast<std::size_t>(l), i);
    }
  };
  result.first.assign(static_cast<std::size_t>(layers) + 1, 0);
  for_each_layer([&](std::size_t l, std::uint32_t) { ++result.first[l + 1]; });
  for (std::size_t l = 0; l < static_cast<std::size_t>(layers); ++l) result.first[l + 1] += result.first[l];
  result.numbers.resize(result.first.back());
  std::vector<std::size_t> at(result.first.begin(), result.first.end() - 1);
  for_each_layer([&](std::size_t l, std::uint32_t i) { result.numbers[at[l]++] = i; });
  return result;
}

}  // namespace texel
