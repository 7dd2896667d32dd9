// Scenes at the edge of what there can be: no crash, nothing that is not a number, sums that still hold.
#include "formats/error.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

Recipe everything(int resolution) {
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.want.preview = false;
  return recipe;
}
// Area over every level against the mesh: 1e-6 for floats, as in Area.EveryModelAtEveryLevel.
void expect_whole_area(const Pack& pack, double truth) {
  for (const Level& level : pack.levels) {
    const double h2 = level.grid.h * level.grid.h;
    EXPECT_NEAR(sum_of(level, "area") * (h2 / truth), 1, 1e-6) << "h " << level.grid.h;
  }
}
Scene one_triangle(const V3d& a, const V3d& b, const V3d& c) {
  Scene s = empty_scene();
  add_triangle(s, a, b, c);
  return s;
}

TEST(Degenerate, SingleTriangles) {
  Random random(1);
  for (int i = 0; i < 30; ++i) {
    const Scene s = one_triangle(random.direction(), random.direction(), random.direction());
    Recipe recipe = everything(i % 12 + 1);
    recipe.margin = i % 12 > 1 ? 1 : 0;
    const Pack pack = bake_quietly(s, recipe);
    check_invariants(pack);
    expect_whole_area(pack, mesh_area(s.mesh));
    EXPECT_TRUE(has_issue(pack, "mesh-open"));
  }
}
TEST(Degenerate, Needle) {
  const Scene s = one_triangle(V3d(0), V3d(1, 1, 1), V3d(1, 1, 1 + 1e-9));
  const Pack pack = bake_quietly(s, everything(20));
  check_invariants(pack);
  expect_whole_area(pack, mesh_area(s.mesh));
}
TEST(Degenerate, FlatAxisAlignedSquares) {
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {1, -1}) {
      Scene s = empty_scene();
      V3d u(0), v(0);
      u[(axis + 1) % 3] = 1;
      v[(axis + 2) % 3] = side;
      add_quad(s, V3d(0), u, v);
      for (const int n : {1, 2, 3, 8, 17}) {
        Recipe recipe = everything(n);
        recipe.margin = n > 2 ? 1 : 0;
        const Pack pack = bake_quietly(s, recipe);
        check_invariants(pack);
        expect_whole_area(pack, 1);
        const Layer* layer = nullptr;
        for (const float z : pack.levels[0].find("normal", &layer)->values) EXPECT_TRUE(z == 0 || z == static_cast<float>(side));
      }
      // Open surface in a wall belongs to the cell in front of it, on the side it faces, and to no other.
      Recipe recipe = everything(4);
      recipe.box = Box3d(V3d(-2), V3d(2));
      const Dense area = dense(bake_quietly(s, recipe).levels[0], "area");
      for_each_cell(area.n, [&](const V3i& x) {
        if (area.state(x)) {
          EXPECT_EQ(x[axis], side > 0 ? 2 : 1);
        }
      });
    }
}
TEST(Degenerate, NoArea) {
  EXPECT_THROW((void)bake_quietly(one_triangle(V3d(1), V3d(2), V3d(3)), everything(8)), Error);
  EXPECT_THROW((void)bake_quietly(one_triangle(V3d(1), V3d(1), V3d(1)), everything(8)), Error);
  try {
    (void)bake_quietly(one_triangle(V3d(1), V3d(1), V3d(1)), everything(8));
  } catch (const Error& e) {
    EXPECT_EQ(e.code, Code::kBadInput);
  }
  try {
    (void)bake_quietly(empty_scene(), everything(8));
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.code, Code::kBadInput);
  }
}
TEST(Degenerate, SomeTrianglesWithoutArea) {
  Scene s = empty_scene();
  add_box(s, V3d(0), V3d(1));
  add_triangle(s, V3d(0.2), V3d(0.2), V3d(0.5));
  add_triangle(s, V3d(0.2), V3d(0.3), V3d(0.4));
  const Pack pack = bake_quietly(s, everything(12));
  check_invariants(pack);
  EXPECT_TRUE(has_issue(pack, "degenerate-triangles"));
  EXPECT_NEAR(filled_volume(pack), 1, 1e-5);
}
TEST(Degenerate, TriangleAcrossAndBeyondTheBox) {
  for (const double far : {1.0, 1e3, 1e6, 1e12, 1e14}) {
    Scene s = one_triangle(V3d(-far, -far, 0.3), V3d(3 * far, -far, 0.3), V3d(-far, 3 * far, 0.3));
    Recipe recipe = everything(8);
    recipe.box = Box3d(V3d(0), V3d(1));
    const Pack pack = bake_quietly(s, recipe);
    check_invariants(pack);
    // The whole cross-section of the box, 1; clipping interpolates along edges `far` long, so 1e-16·far and float.
    EXPECT_NEAR(sum_of(pack.levels[0], "area") / 64, 1, 1e-6 + 1e-15 * far) << far;
    EXPECT_EQ(pack.slices.size(), 3u);
    const Dense alpha = dense(pack.levels[0], "alpha");
    for_each_cell(alpha.n, [&](const V3i& v) {
      if (v.z == 2) {
        EXPECT_EQ(alpha.at(v, 2), 1) << far;
      }
    });
  }
}
TEST(Degenerate, BoxCutsASolid) {
  Scene s = empty_scene();
  add_ball(s, 1, 32);
  Recipe recipe = everything(16);
  recipe.box = Box3d(V3d(0), V3d(1));  // an eighth
  const Pack pack = bake_quietly(s, recipe);
  check_invariants(pack);
  EXPECT_NEAR(filled_volume(pack) / (mesh_volume(s.mesh) / 8), 1, 3e-3);  // chords, an eighth of the surface's statistics
  EXPECT_NEAR(sum_of(pack.levels[0], "area") / 256 / (mesh_area(s.mesh) / 8), 1, 1e-6);
  // Wholly within: every voxel is inside and no surface is there.
  recipe.box = Box3d(V3d(-0.3), V3d(0.3));
  try {
    const Pack inner = bake_quietly(s, recipe);
    check_invariants(inner);
  } catch (const Error& e) {
    EXPECT_EQ(e.code, Code::kBadInput);  // "no surface lies in the box"
  }
  recipe.box = Box3d(V3d(5), V3d(6));
  EXPECT_THROW((void)bake_quietly(s, recipe), Error);
  recipe.box = Box3d(V3d(0), V3d(1, 0, 1));
  EXPECT_THROW((void)bake_quietly(s, recipe), Error);
}
// A solid that reaches out of the box on every side: what is within is filled from the first voxel to the last.
TEST(Degenerate, SolidReachesThroughTheBox) {
  Scene s = empty_scene();
  add_box(s, V3d(-3, -0.25, -3), V3d(3, 0.25, 3));
  Recipe recipe = everything(8);
  recipe.box = Box3d(V3d(-0.5), V3d(0.5));
  const Pack pack = bake_quietly(s, recipe);
  check_invariants(pack);
  EXPECT_NEAR(filled_volume(pack), 0.5, 1e-6);  // walls: exact
  const Dense solid = dense(pack.levels[0], "solid");
  for_each_cell(solid.n, [&](const V3i& v) { EXPECT_EQ(solid.at(v), v.y >= 2 && v.y < 6 ? 1.f : 0.f); });
}
// A solid whose lower side leaves the box by hundred-millionths half-way through a voxel, exactly where its only ray is: half of the voxel is entered, of the other half the rays come from within.
TEST(Degenerate, SideThatLeavesTheBoxAtARay) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double slope : {1e-8, -1e-8, 0.02}) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      Scene s = empty_scene();
      V3d lo(0), hi(8);
      lo[u] = lo[v] = 0.25;
      hi[axis] = hi[u] = hi[v] = 7.75;
      add_box(s, lo, hi);
      for (V3d& p : s.mesh.points)
        if (p[axis] == 0) p[axis] = slope * (p[u] - 3.5);
      Recipe recipe = everything(8);
      recipe.box = Box3d(V3d(0), V3d(8));
      recipe.samples = 1;
      const Pack pack = bake_quietly(s, recipe);
      check_invariants(pack);
      const Dense alpha = dense(pack.levels[0], "alpha");
      for (int w = 1; w < 7; ++w) {
        V3i voxel(0);
        voxel[u] = 3;
        voxel[v] = w;
        EXPECT_NEAR(alpha.at(voxel, axis), 1, 2e-7) << "axis " << axis << ", slope " << slope << ", " << w;
      }
    }
}
// A box whose upper side stands above a wall by billionths, in columns that have surface in all their voxels and matter below the first: no ray may be stopped by more than there is.
TEST(Degenerate, LayerThinnerThanItCanBeTold) {
  Scene s = empty_scene();
  add_box(s, V3d(0.5, 0, 0.375), V3d(2, 1, 1.375));
  for (V3d& p : s.mesh.points) p.y += 8e-9 * (p.z - 1);
  Recipe recipe = everything(2);
  recipe.box = Box3d(V3d(0), V3d(2));
  const Pack pack = bake_quietly(s, recipe);
  check_invariants(pack);
  const Dense alpha = dense(pack.levels[0], "alpha"), solid = dense(pack.levels[0], "solid"), crossings = dense(pack.levels[0], "crossings");
  EXPECT_GT(solid.at(V3i(1, 1, 1)), 0);
  for_each_cell(alpha.n, [&](const V3i& v) {
    for (int k = 0; k < 3; ++k) EXPECT_LE(alpha.at(v, k), crossings.at(v, k) + solid.at(v) + 1e-7f) << v.x << " " << v.y << " " << v.z << " axis " << k;
  });
}
TEST(Degenerate, Resolutions) {
  Scene s = empty_scene();
  add_ball(s, 1, 12);
  for (const V3i& n : {V3i(1, 0, 0), V3i(2, 0, 0), V3i(3, 0, 0), V3i(7, 5, 3), V3i(1, 1, 1), V3i(3, 64, 3), V3i(65, 9, 33)}) {
    Recipe recipe = everything(1);
    recipe.resolution = n;
    recipe.margin = n.x > 2 && n.y != 1 ? 1 : 0;
    const Pack pack = bake_quietly(s, recipe);
    check_invariants(pack);
    expect_whole_area(pack, mesh_area(s.mesh));
    if (n.y > 0) {
      EXPECT_EQ(pack.grid.n, n);
    }
    else {
      EXPECT_EQ(std::max({pack.grid.n.x, pack.grid.n.y, pack.grid.n.z}), std::max(n.x, 1));
    }
    EXPECT_EQ(pack.levels.back().grid.n, V3i(1, 1, 1));
  }
  Recipe recipe = everything(1);
  recipe.voxel_size = 0.3;
  const Pack pack = bake_quietly(s, recipe);
  EXPECT_EQ(pack.grid.h, 0.3);
  check_invariants(pack);
  expect_whole_area(pack, mesh_area(s.mesh));
  check_invariants(bake_quietly(s, everything(2)));  // both voxels are margin
  recipe.voxel_size = 1e-9;
  EXPECT_THROW((void)bake_quietly(s, recipe), Error);
  recipe.voxel_size = 50;  // a voxel larger than all of it
  expect_whole_area(bake_quietly(s, recipe), mesh_area(s.mesh));
  for (const V3i& n : {V3i(5000, 0, 0), V3i(8, 8, 5000)}) {
    Recipe large = everything(1);
    large.resolution = n;
    EXPECT_THROW((void)bake_quietly(s, large), Error);
  }
}
// The same volume at any scale: voxel space does not know it. Scales that are powers of two would be bit for bit the same.
TEST(Degenerate, Scales) {
  Scene s = empty_scene();
  add_ball(s, 1, 12);
  add_box(s, V3d(0.5, 0.2, 0.1), V3d(1.4, 1.1, 0.9));
  const Pack straight = bake_quietly(s, everything(20));
  for (const double scale : {1e-20, 1e-12, 1e-6, 1e-3, 1e3, 1e6, 1e12, 1e20, 0x1p-40, 0x1p40}) {
    SCOPED_TRACE(scale);
    const Scene scaled = transformed(s, [&](const V3d& p) { return p * scale; });
    const Pack pack = bake_quietly(scaled, everything(20));
    check_invariants(pack);
    EXPECT_EQ(pack.grid.n, straight.grid.n);
    expect_whole_area(pack, mesh_area(scaled.mesh));
    for (const char* name : {"alpha", "solid", "area", "normal", "Cd", "crossings"}) {
      const Channel *a = straight.levels[0].find(name), *b = pack.levels[0].find(name);
      ASSERT_EQ(a->values.size(), b->values.size()) << name;
      double worst = 0;
      for (std::size_t i = 0; i < a->values.size(); ++i) worst = std::max(worst, std::abs(static_cast<double>(a->values[i]) - static_cast<double>(b->values[i])));
      // Coordinates rounded otherwise in their last digit may put a ray on the other side of an edge: one of 16.
      EXPECT_LE(worst, std::string(name) == "area" || std::string(name) == "Cd" || std::string(name) == "normal" ? 1e-5 : 2.0 / 16) << name;
      if (std::abs(scale) == 0x1p40 || scale == 0x1p-40) {
        EXPECT_EQ(worst, 0) << name;
      }
    }
  }
}
// density is depth/h in a float: exact to rounding as far as the limits, and refused beyond them.
TEST(Degenerate, VoxelsThatFloatsCannotHold) {
  Scene s = empty_scene();
  add_ball(s, 1, 12);
  Recipe recipe = everything(20);
  const Pack straight = bake_quietly(s, recipe);
  for (const double edge : {1.001e-30, 0.999e30}) {
    SCOPED_TRACE(edge);
    const double scale = edge / straight.grid.h;
    const Pack pack = bake_quietly(transformed(s, [&](const V3d& p) { return p * scale; }), recipe);
    const Channel *a = straight.levels[0].find("density"), *b = pack.levels[0].find("density");
    ASSERT_EQ(a->values.size(), b->values.size());
    double ours = 0, theirs = 0;
    for (std::size_t i = 0; i < a->values.size(); ++i) {
      ours += static_cast<double>(a->values[i]);
      theirs += static_cast<double>(b->values[i]) * scale;
    }
    // Each value is rounded to 2^-24 of itself; a ray on an edge may change sides (Scales above), which moves a sum of 3000 voxels little.
    EXPECT_NEAR(theirs / ours, 1, 1e-4);
  }
  for (const double scale : {1e-300, 1e-40, 1e-30, 1e32, 1e90}) {
    SCOPED_TRACE(scale);
    try {
      (void)bake_quietly(transformed(s, [&](const V3d& p) { return p * scale; }), recipe);
      ADD_FAILURE() << "was baked";
    } catch (const Error& error) {
      EXPECT_EQ(error.code, Code::kBadInput);
      EXPECT_NE(std::string(error.what()).find("units wide"), std::string::npos) << error.what();
    }
  }
}
TEST(Degenerate, TooFarFromTheOrigin) {  // double cannot tell the voxels apart: an error or a pack without nonsense, no crash
  Scene s = empty_scene();
  add_ball(s, 1, 8);
  for (const double offset : {1e6, 1e12, 1e15, 1e16, 1e17, 1e300}) {
    SCOPED_TRACE(offset);
    const Scene moved = transformed(s, [&](const V3d& p) { return p + V3d(offset); });
    try {
      check_invariants(bake_quietly(moved, everything(16)));
    } catch (const Error&) {
      EXPECT_GE(offset, 1e12);
    }
  }
}
TEST(Degenerate, RecipesThatCannotBe) {
  Scene s = empty_scene();
  add_box(s, V3d(0), V3d(1));
  Recipe recipe = everything(8);
  recipe.samples = -1;
  EXPECT_THROW((void)bake_quietly(s, recipe), Error);
  recipe.samples = 65;
  EXPECT_THROW((void)bake_quietly(s, recipe), Error);
}
TEST(Degenerate, EverySampleCountAndPattern) {
  Scene s = empty_scene();
  add_ball(s, 1, 8);
  for (const Pattern pattern : {Pattern::kLattice, Pattern::kGrid})
    for (const int samples : {1, 2, 3, 5, 7, 16, 64}) {
      Recipe recipe = everything(9);
      recipe.samples = samples;
      recipe.pattern = pattern;
      const Pack pack = bake_quietly(s, recipe);
      check_invariants(pack);
      EXPECT_NEAR(filled_volume(pack) / mesh_volume(s.mesh), 1, 0.1 / samples);  // order 1/samples at 9³ voxels, with room
    }
}

}  // namespace
}  // namespace texel::test
