// Duplicates and near-duplicates: of triangles, turned or not, of whole solids; shared and split vertices; −0.
#include "tests/stress/shapes.h"

namespace texel::stress {
namespace {

Case duplicates(std::uint64_t seed) {
  Random random(seed * 6700417 + 11);
  Case made;
  made.what = "duplicates";
  made.scene = test::empty_scene();
  const int n = 1 + below(random, 16);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  const V3d size(n);
  const int count = 1 + below(random, 4);
  for (int i = 0; i < count; ++i) {
    V3d p[3] = {point_in(random, size), point_in(random, size), point_in(random, size)};
    if (below(random, 3) == 0)
      for (V3d& q : p) q = V3d(std::round(q.x), std::round(q.y), std::round(q.z));  // all corners on walls
    test::add_triangle(made.scene, p[0], p[1], p[2]);
    for (int copy = below(random, 5); copy > 0; --copy) {
      const double off = below(random, 2) ? 0 : decade(random, -17, -1);
      const int kind = below(random, 3);
      V3d q[3];
      for (int k = 0; k < 3; ++k) q[k] = p[(k + kind) % 3] + random.direction() * off;
      if (below(random, 2)) std::swap(q[0], q[1]);  // facing the other way
      test::add_triangle(made.scene, q[0], q[1], q[2]);
    }
  }
  made.may_be_refused = true;
  return made;
}
TEST(Coincident, Triangles) { run_family("duplicates", 900, duplicates); }

Case solids(std::uint64_t seed) {
  Random random(seed * 2097593 + 13);
  Case made;
  made.what = "coincident solids";
  made.scene = test::empty_scene();
  const int n = 2 + below(random, 14);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  const bool walls = below(random, 2);
  V3d lo = point_in(random, V3d(n * 0.4)), hi = lo + V3d(n * 0.1) + point_in(random, V3d(n * 0.4));
  if (walls)
    for (int k = 0; k < 3; ++k) { lo[k] = std::floor(lo[k]); hi[k] = std::max(lo[k] + 1, std::round(hi[k])); }
  test::add_box(made.scene, lo, hi);
  for (int copy = 1 + below(random, 3); copy > 0; --copy) {
    const double off = below(random, 2) ? 0 : decade(random, -17, -2);
    const V3d moved = random.direction() * off;
    test::add_box(made.scene, lo + moved, hi + moved);
  }
  // One vertex as −0, which is the same place as 0.
  for (V3d& p : made.scene.mesh.points)
    for (int k = 0; k < 3; ++k)
      if (p[k] == 0 && below(random, 2)) p[k] = -0.0;
  made.solid = made.scene.mesh;
  return made;
}
TEST(Coincident, Solids) { run_family("coincident", 700, solids); }

}  // namespace
}  // namespace texel::stress
