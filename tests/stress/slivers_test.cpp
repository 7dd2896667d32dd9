// Slivers, needles, zero-area and denormal triangles; flat and long solids. Aspect ratios to 1e8, and beyond.
#include "tests/stress/shapes.h"

namespace texel::stress {
namespace {

Case open_slivers(std::uint64_t seed) {
  Random random(seed * 7919 + 1);
  Case made;
  made.what = "open slivers";
  made.scene = test::empty_scene();
  const int n = 1 + below(random, 24);
  const V3d size(n);
  made.recipe = unit_recipe(V3i(n));
  if (below(random, 3) == 0) made.recipe.box.reset();
  vary(made.recipe, random);
  const int count = 1 + below(random, 12);
  for (int i = 0; i < count; ++i) add_thin(made.scene, random, size, n * random.uniform(0.01, 1.2), 8);
  // Without area: points, lines, and what is nearly one.
  for (int i = below(random, 3); i > 0; --i) {
    const V3d a = point_in(random, size), b = point_in(random, size);
    test::add_triangle(made.scene, a, b, below(random, 2) ? a : a + (b - a) * random.uniform());
  }
  made.may_be_refused = true;  // none of them lies in the box
  return made;
}
TEST(Slivers, Open) { run_family("slivers", 900, open_slivers); }

Case tiny(std::uint64_t seed) {
  Random random(seed * 104729 + 3);
  Case made;
  made.what = "triangles from a voxel down to denormals";
  made.scene = test::empty_scene();
  const int n = 1 + below(random, 12);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  for (int i = 0; i < 8; ++i) {
    const double length = decade(random, i < 4 ? -10 : -330, 0);
    const V3d at = below(random, 3) == 0 ? V3d(0) : point_in(random, V3d(n));
    test::add_triangle(made.scene, at, at + random.direction() * length, at + random.direction() * length);
  }
  made.may_be_refused = true;
  return made;
}
TEST(Slivers, Tiny) { run_family("tiny", 500, tiny); }

Case thin_solids(std::uint64_t seed) {
  Random random(seed * 15485863 + 5);
  Case made;
  made.what = "thin solids";
  made.scene = test::empty_scene();
  const int n = 2 + below(random, 20);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  // A tetrahedron or a plate, long by 1 to 1e8 times its thickness, along an axis or not.
  const V3d a = point_in(random, V3d(n * 0.2)) + V3d(n * 0.1);
  const double thin = n * decade(random, -8, -0.3);
  if (below(random, 2)) {
    add_tetrahedron(made.scene, a, point_in(random, V3d(n)), point_in(random, V3d(n)), a + random.direction() * thin);
  } else {
    const test::Rotation turn = below(random, 2) ? test::random_rotation(random) : test::Rotation{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
    const int flat = below(random, 3);
    V3d size(n * 0.5, n * 0.4, n * 0.3);
    size[flat] = thin;
    test::add_box(made.scene, -size / 2, size / 2);
    for (V3d& p : made.scene.mesh.points) p = turn(p) + V3d(n * 0.5);
  }
  made.solid = made.scene.mesh;
  made.disjoint = true;
  made.may_be_refused = true;
  return made;
}
TEST(Slivers, Solids) { run_family("thin solids", 700, thin_solids); }

}  // namespace
}  // namespace texel::stress
