#pragma once
// Stage 1d: Scene::shapes, Scene::instances -> a tree of each shape's triangles, and where each instance stands in voxel space
#include <cstdint>
#include <span>
#include <vector>

#include "bake/recipe.h"
#include "formats/pack.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

struct Plan;
class TextureSet;

// A tree of boxes about a shape's triangles, in the shape's space. Children follow their parent: the first at once, the second at `second`.
struct ShapeNode {
  Box3d box;
  std::uint32_t first = 0, count = 0;  // into ShapeTree::order
  std::uint32_t second = 0;            // 0: a leaf
};

// What is the same wherever a shape stands.
struct ShapeTree {
  std::vector<ShapeNode> nodes;        // [0]: all of it; empty: no triangles
  std::vector<std::uint32_t> order;    // triangles, a node's one after the other
  std::vector<std::int8_t> turn, winding;  // per triangle, as Plan's
  std::vector<float> uv_width;         // per triangle: width in uv of a length in the shape's space; empty where nothing is textured
};

// An instance in voxel space.
struct Placed {
  std::uint32_t shape = 0;
  bool mirrors = false;
  Affine place;                        // shape -> world
  std::array<double, 9> turn{};        // shape -> voxel directions, row by row
  V3d move{0, 0, 0};                   // and the shape's origin, voxel space
  double scale = 0;                    // what all lengths grow by, to voxels; 0: they grow unevenly
  Box3d box;                           // of the moved box of the shape; voxel space
  std::uint64_t first = 0;             // number of its first triangle among those of all instances
};

// A triangle of the scene wherever it is kept: of the mesh, or of a shape where an instance has it.
struct Face {
  std::array<V3d, 3> p;                // voxel space, put on walls as Plan::points are
  const Mesh* mesh = nullptr;
  std::uint32_t triangle = 0;          // into *mesh
  std::uint32_t material = 0;
  std::int8_t turn = 1, winding = 0;   // as Plan's
  float uv_width = 0;                  // in uv of a world length
};

// Sets the plan's shapes, instances, and what they add to its statistics and fill. The plan's grid is known.
// Components are found once a shape; one that an instance mirrors stays outside in. Cost: O(t log t) for the shapes' triangles, O(1) an instance;
// of one that is stretched unevenly O(t), for its area.
void plan_instances(const Scene& scene, const Recipe& recipe, Plan& plan, Report& report);

[[nodiscard]] Face mesh_face(const Scene& scene, const Plan& plan, std::uint32_t triangle);
[[nodiscard]] Face placed_face(const Scene& scene, const Plan& plan, const Placed& placed, std::uint32_t triangle);
// The instance that has the triangle of this number, which becomes that in its shape.
[[nodiscard]] const Placed& find_placed(const Plan& plan, std::uint64_t number, std::uint32_t* triangle);

// A box of a tree where an instance has it: what holds it in voxel space, a little larger than rounding needs.
[[nodiscard]] Box3d placed_box(const Placed& placed, const Box3d& box);

// Instances by the layers of `thick` voxels that their boxes meet along an axis: of layer l, numbers[first[l] … first[l + 1]), ascending.
struct PlacedLayers {
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> numbers;
  [[nodiscard]] std::span<const std::uint32_t> of(int layer) const {
    if (first.empty()) return {};
    const auto l = static_cast<std::size_t>(layer);
    return {numbers.data() + first[l], numbers.data() + first[l + 1]};
  }
};
[[nodiscard]] PlacedLayers layer_placed(const Plan& plan, int axis, int thick, int layers);

// Goes down a tree: where descend(node) says so, and calls leaf(triangle) for the triangles of the leaves it comes to.
template <class Descend, class Leaf>
void walk_shape(const ShapeTree& tree, Descend&& descend, Leaf&& leaf) {
  if (tree.nodes.empty()) return;
  std::uint32_t waiting[64];  // halves of halves: a tree of 2³² triangles is 32 deep
  int count = 0;
  waiting[count++] = 0;
  while (count > 0) {
    const std::uint32_t at = waiting[--count];
    const ShapeNode& node = tree.nodes[at];
    if (!descend(node)) continue;
    if (node.second == 0) {
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) leaf(tree.order[i]);
      continue;
    }
    waiting[count++] = node.second;
    waiting[count++] = at + 1;
  }
}

}  // namespace texel
