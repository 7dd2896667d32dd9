// Boxes that cut the mesh, lie in it or only touch it; resolution 1; grids as flat as a voxel.
#include "tests/stress/shapes.h"

namespace texel::stress {
namespace {

Case cut(std::uint64_t seed) {
  Random random(seed * 160481183 + 41);
  Case made;
  made.scene = test::empty_scene();
  const V3i n(1 + below(random, 14), 1 + below(random, 14), 1 + below(random, 14));
  made.recipe = unit_recipe(n);
  vary(made.recipe, random);
  const double far = decade(random, -1, below(random, 4) == 0 ? 8 : 1.5) * std::max({n.x, n.y, n.z});
  const V3d middle = point_in(random, V3d(n));
  switch (below(random, 4)) {
    case 0:
      made.what = "a box cut by the grid";
      test::add_box(made.scene, middle - V3d(far * random.uniform(), far * random.uniform(), far * random.uniform()) - V3d(0.1), middle + V3d(far * random.uniform(), far * random.uniform(), far * random.uniform()));
      break;
    case 1:
      made.what = "a ball cut by the grid";
      add_lump(made.scene, middle, far, 3 + below(random, 12), [](const V3d& p) { return p; });
      break;
    case 2:
      made.what = "a tetrahedron about the grid";
      add_tetrahedron(made.scene, middle + random.direction() * far, middle + random.direction() * far, middle + random.direction() * far, middle + random.direction() * far);
      break;
    default: {
      made.what = "a box with faces in the grid's walls";
      V3d lo(0), hi(n);
      for (int k = 0; k < 3; ++k) {
        if (below(random, 3) == 0) lo[k] = -far;
        if (below(random, 3) == 0) hi[k] += far;
        if (below(random, 3) == 0) hi[k] = n[k] * 0.5;
      }
      test::add_box(made.scene, lo, hi);
    }
  }
  made.solid = made.scene.mesh;
  made.may_be_refused = true;  // no surface lies in the box
  return made;
}
TEST(Boxes, CutTheMesh) { run_family("boxes", 1200, cut); }

Case flat_grids(std::uint64_t seed) {
  Random random(seed * 179424673 + 43);
  Case made;
  made.what = "few voxels";
  made.scene = test::empty_scene();
  vary(made.recipe, random);
  made.recipe.want.preview = false;
  made.recipe.resolution = V3i(1 + below(random, 3), 0, 0);
  if (below(random, 2)) made.recipe.resolution = V3i(1 + below(random, 2), 1 + below(random, 20), 1 + below(random, 3));
  made.recipe.margin = below(random, 3);
  const V3d size(decade(random, -6, 2), decade(random, -6, 2), decade(random, -6, 2));
  if (below(random, 2)) add_lump(made.scene, V3d(0), 1, 3 + below(random, 8), [&](const V3d& p) { return p * size; });
  else test::add_box(made.scene, V3d(0), size);
  made.solid = made.scene.mesh;
  made.disjoint = true;
  made.may_be_refused = true;  // more voxels along a side than given
  return made;
}
TEST(Boxes, FewVoxels) { run_family("few voxels", 500, flat_grids); }

}  // namespace
}  // namespace texel::stress
