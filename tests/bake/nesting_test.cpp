// Which closed component lies in which: trees of boxes on a lattice, where edges and corners of most lie exactly behind one another, and turned ones.
#include "bake/nesting.h"

#include <functional>
#include <numeric>

#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

struct Nest {
  Scene scene = empty_scene();
  std::vector<std::uint32_t> root;  // of each box, in the order of their triangles
};

// Boxes side by side in boxes, `side`³ in each, down to `depth`; the child fills what the walls of one unit leave. Every other depth is inside out.
void add_nest(Nest& nest, const V3i& lo, int size, int side, int depth, std::uint32_t root) {
  const auto self = static_cast<std::uint32_t>(nest.root.size());
  if (root == kNoIndex) root = self;
  nest.root.push_back(root);
  add_box(nest.scene, V3d(lo), V3d(lo + V3i(size)), depth % 2 == 1);
  if (depth == 0) return;
  const int step = (size - 1) / side;
  for_each_cell(V3i(side), [&](const V3i& c) { add_nest(nest, lo + V3i(1) + c * step, step - 1, side, depth - 1, root); });
}

std::vector<std::uint32_t> outermost_of(const Nest& nest, const V3i& period = V3i(0)) {
  const Mesh& mesh = nest.scene.mesh;
  const Topology topology = find_topology(mesh.points, mesh.triangles);
  EXPECT_EQ(topology.components.size(), nest.root.size());
  std::vector<Box3d> boxes(topology.components.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t v : mesh.triangles[t]) boxes[topology.component[t]].extendBy(mesh.points[v]);
  const Nesting found = find_nesting(mesh.points, mesh.triangles, topology, boxes, std::vector<bool>(boxes.size(), true), period);
  EXPECT_EQ(found.order.size(), boxes.size());
  std::vector<std::uint32_t> outermost(boxes.size());
  for (const std::uint32_t c : found.order) outermost[c] = found.container[c] == kNoIndex ? c : outermost[found.container[c]];
  return outermost;
}

TEST(Nesting, BoxesOnALattice) {
  Nest nest;
  for_each_cell(V3i(3), [&](const V3i& c) { add_nest(nest, c * 64, 60, 2, 3, kNoIndex); });
  ASSERT_EQ(nest.root.size(), 27u * (1 + 8 + 64 + 512));
  EXPECT_EQ(outermost_of(nest), nest.root);
}
TEST(Nesting, TurnedAndScaled) {
  Random random(7);
  for (int k = 0; k < 20; ++k) {
    Nest nest;
    for_each_cell(V3i(2), [&](const V3i& c) { add_nest(nest, c * 40, 36, 2, 2, kNoIndex); });
    const Rotation turn = random_rotation(random);
    const double scale = std::exp2(random.uniform(-60, 60));
    for (V3d& p : nest.scene.mesh.points) p = turn(p) * scale + V3d(scale * 10);
    EXPECT_EQ(outermost_of(nest), nest.root) << k;
  }
}
// Shell in shell in shell: each lies in all larger ones.
TEST(Nesting, AThousandShells) {
  Nest nest;
  for (int i = 0; i < 1000; ++i) {
    add_box(nest.scene, V3d(i), V3d(4000 - i), i % 2 == 1);
    nest.root.push_back(0);
  }
  EXPECT_EQ(outermost_of(nest), nest.root);
}
// Neighbours whose outlines along z are the same hold nothing of each other, above or below.
TEST(Nesting, StackedBoxes) {
  Nest nest;
  for (int i = 0; i < 300; ++i) {
    add_box(nest.scene, V3d(0, 0, 3 * i), V3d(2, 2, 3 * i + 1 + i % 2), true);
    nest.root.push_back(static_cast<std::uint32_t>(i));
  }
  EXPECT_EQ(outermost_of(nest), nest.root);
}

}  // namespace
}  // namespace texel::test
