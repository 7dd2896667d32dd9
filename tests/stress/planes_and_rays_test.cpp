// Surface coplanar with voxel walls and slice planes of every level; vertices and edges exactly on sub-rays.
#include "tests/stress/shapes.h"

namespace texel::stress {
namespace {

double special(Random& random, int n, int samples, int kind) {
  switch (kind) {
    case 0: return on_lattice(random, n, 0);            // a wall
    case 1: return on_lattice(random, n, 1);            // a wall or a slice's middle
    case 2: return on_ray(random, n, samples);          // a ray
    case 3: return std::min<double>(n, 2.0 * on_lattice(random, (n + 1) / 2, 0));  // a wall of the next level
    case 4: return on_lattice(random, n, 16);           // a unit of the rasteriser
    default: return on_lattice(random, n, 17);          // half of one
  }
}
V3d special_point(Random& random, int n, int samples) {
  const int same = below(random, 8);
  V3d p;
  for (int k = 0; k < 3; ++k) p[k] = special(random, n, samples, same < 6 ? same : below(random, 6));
  return p;
}

Case triangles(std::uint64_t seed) {
  Random random(seed * 49979687 + 17);
  Case made;
  made.what = "triangles on planes and rays";
  made.scene = test::empty_scene();
  const int n = 1 + below(random, 17);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  made.recipe.samples = 1 << below(random, 4);
  const int count = 1 + below(random, 6);
  for (int i = 0; i < count; ++i) {
    V3d p[3];
    for (V3d& q : p) q = special_point(random, n, made.recipe.samples);
    if (below(random, 2)) {  // in a plane across an axis
      const int axis = below(random, 3);
      p[1][axis] = p[2][axis] = p[0][axis];
    }
    test::add_triangle(made.scene, p[0], p[1], p[2]);
  }
  made.may_be_refused = true;  // all in the box's walls and facing in, or without area
  return made;
}
TEST(PlanesAndRays, Triangles) { run_family("planes, rays", 1000, triangles); }

Case solids(std::uint64_t seed) {
  Random random(seed * 86028121 + 19);
  Case made;
  made.scene = test::empty_scene();
  const int n = 2 + below(random, 15);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  made.recipe.samples = 1 << below(random, 4);
  const int kind = below(random, 3);
  if (kind == 0) {
    made.what = "a box on planes and rays";
    V3d lo, hi;
    for (int k = 0; k < 3; ++k) {
      do {
        lo[k] = special(random, n, made.recipe.samples, below(random, 6));
        hi[k] = special(random, n, made.recipe.samples, below(random, 6));
      } while (lo[k] == hi[k]);
      if (lo[k] > hi[k]) std::swap(lo[k], hi[k]);
    }
    test::add_box(made.scene, lo, hi);
    made.disjoint = true;
  } else if (kind == 1) {
    made.what = "a tetrahedron on planes and rays";
    V3d p[4];
    double volume = 0;
    do {
      for (V3d& q : p) q = special_point(random, n, made.recipe.samples);
      volume = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]);
    } while (volume == 0);
    add_tetrahedron(made.scene, p[0], p[1], p[2], p[3]);
    made.disjoint = true;
  } else {
    made.what = "a lump put on planes and rays";  // rounding its points folds it here and there: closed, but matter may count twice
    const double step = std::ldexp(1.0, -below(random, 4)), shift = below(random, 2) ? 0 : 0.5 / made.recipe.samples;
    add_lump(made.scene, V3d(n * 0.5), n * 0.45, 3 + below(random, 6), [&](const V3d& p) {
      V3d q;
      for (int k = 0; k < 3; ++k) q[k] = std::clamp(std::round((p[k] - shift) / step) * step + shift, 0.0, static_cast<double>(n));
      return q;
    });
  }
  made.solid = made.scene.mesh;
  made.may_be_refused = true;
  return made;
}
TEST(PlanesAndRays, Solids) { run_family("plane solids", 1000, solids); }

}  // namespace
}  // namespace texel::stress
