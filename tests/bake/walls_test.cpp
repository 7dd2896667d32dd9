// Where voxel walls are: half-voxel position, surface lying in walls, turned cubes, slices' orientation and thickness.
#include <algorithm>

#include "bake/slice.h"
#include "formats/error.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

Scene cube(const V3d& lo, const V3d& hi) {
  Scene s = empty_scene();
  add_box(s, lo, hi);
  return s;
}
Recipe boxed(const Box3d& box, int resolution) {
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.box = box;
  recipe.want.preview = false;
  return recipe;
}

TEST(Walls, OneVoxelModel) {  // a cube of exactly one voxel: that voxel and no other
  Recipe recipe = boxed(Box3d(V3d(0), V3d(4)), 4);
  const Pack pack = bake_quietly(cube(V3d(1, 2, 3), V3d(2, 3, 4)), recipe);
  EXPECT_EQ(pack.grid.origin, V3d(0));
  EXPECT_EQ(pack.grid.h, 1);
  for (const char* name : {"alpha", "solid", "area", "density"}) {
    const Dense d = dense(pack.levels[0], name);
    for_each_cell(d.n, [&](const V3i& v) { EXPECT_EQ(d.state(v) != 0, v == V3i(1, 2, 3)) << name << " at " << v.x << v.y << v.z; });
  }
  const V3i v(1, 2, 3);
  EXPECT_EQ(dense(pack.levels[0], "alpha").at3(v), V3f(1, 1, 1));
  EXPECT_EQ(dense(pack.levels[0], "solid").at(v), 1);
  EXPECT_EQ(dense(pack.levels[0], "area").at(v), 6);
  EXPECT_EQ(dense(pack.levels[0], "normal").at3(v), V3f(0, 0, 0));
  EXPECT_EQ(dense(pack.levels[0], "crossings").at3(v), V3f(2, 2, 2));
}
TEST(Walls, HalfVoxelPosition) {  // a small model about a voxel's centre lands in that voxel, whichever it is
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Grid grid{V3d(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5)), random.uniform(0.1, 2), V3i(7, 7, 7)};
    const V3i v(static_cast<int>(random.uniform() * 7), static_cast<int>(random.uniform() * 7), static_cast<int>(random.uniform() * 7));
    const V3d c = grid.centre(v), half = V3d(grid.h * 0.49);
    Recipe recipe = boxed(grid.box(), 7);
    recipe.want.slices = false;
    const Pack pack = bake_quietly(cube(c - half, c + half), recipe);
    const Dense area = dense(pack.levels[0], "area");
    ASSERT_EQ(area.n, V3i(7, 7, 7));
    for_each_cell(area.n, [&](const V3i& x) { EXPECT_EQ(area.state(x) != 0, x == v); });
    EXPECT_NEAR(area.at(v), 6 * 0.98 * 0.98, 1e-5);  // float, and h of the box's edge divided by 7
    EXPECT_NEAR(dense(pack.levels[0], "alpha").at(v), 0.98 * 0.98, 1e-5);  // its shadow, exact but for h as above
  }
}

// A cube with faces on walls, its block of voxels full.
TEST(Walls, CubeOnWallsIsExact) {
  Recipe recipe = boxed(Box3d(V3d(0), V3d(24)), 24);
  const V3i lo(3, 5, 7), hi(13, 15, 17);
  const Pack pack = bake_quietly(cube(V3d(lo), V3d(hi)), recipe);
  const Dense alpha = dense(pack.levels[0], "alpha"), solid = dense(pack.levels[0], "solid"), area = dense(pack.levels[0], "area");
  for_each_cell(alpha.n, [&](const V3i& v) {
    bool in = true;
    int faces = 0;
    for (int a = 0; a < 3; ++a) { in = in && v[a] >= lo[a] && v[a] < hi[a]; faces += (v[a] == lo[a]) + (v[a] == hi[a] - 1); }
    EXPECT_EQ(solid.at(v), in ? 1.f : 0.f);
    for (int a = 0; a < 3; ++a) EXPECT_EQ(alpha.at(v, a), in ? 1.f : 0.f);
    EXPECT_EQ(area.at(v), in ? static_cast<float>(faces) : 0.f);
    EXPECT_EQ(alpha.state(v) != 0, in);
  });
  EXPECT_EQ(filled_volume(pack), 1000);
}

struct Turn { int axis[3]; int sign[3]; };
std::vector<Turn> cube_turns() {
  std::vector<Turn> all;
  int p[3] = {0, 1, 2};
  do
    for (int s = 0; s < 8; ++s) {
      Turn t{{p[0], p[1], p[2]}, {s & 1 ? -1 : 1, s & 2 ? -1 : 1, s & 4 ? -1 : 1}};
      int parity = (p[0] > p[1]) + (p[0] > p[2]) + (p[1] > p[2]) + (t.sign[0] < 0) + (t.sign[1] < 0) + (t.sign[2] < 0);
      if (parity % 2 == 0) all.push_back(t);
    }
  while (std::next_permutation(p, p + 3));
  return all;
}
// New coordinate k is ± old coordinate axis[k]; `top`: what mirrored coordinates count from.
template <class V, class T>
V apply(const Turn& t, const V& p, T top) {
  V out;
  for (int k = 0; k < 3; ++k) out[k] = t.sign[k] > 0 ? p[t.axis[k]] : top - p[t.axis[k]];
  return out;
}

// The 24 rotations of a scene within a cubic box, voxel by voxel against the unturned bake.
std::map<std::string, double> compare_turned(const Scene& scene, int n) {
  Recipe recipe = boxed(Box3d(V3d(0), V3d(n)), n);
  recipe.want.slices = false;
  recipe.want.levels = false;
  const Pack straight = bake_quietly(scene, recipe);
  std::map<std::string, double> worst;
  for (const Turn& t : cube_turns()) {
    const Pack turned = bake_quietly(transformed(scene, [&](const V3d& p) { return apply(t, p, static_cast<double>(n)); }), recipe);
    for (const char* name : {"alpha", "crossings", "solid", "area", "normal", "density"}) {
      const Dense a = dense(straight.levels[0], name), b = dense(turned.levels[0], name);
      double& w = worst[name];
      for_each_cell(a.n, [&](const V3i& v) {
        const V3i to = apply(t, v, n - 1);
        EXPECT_EQ(a.state(v), b.state(to)) << name;
        for (int k = 0; k < a.components; ++k) {
          const std::string grid = name;
          const float sign = grid == "normal" && t.sign[k] < 0 ? -1.f : 1.f;
          const float x = a.components == 1 ? a.at(v) : sign * a.at(v, t.axis[k]), y = b.at(to, k);
          w = std::max(w, static_cast<double>(std::abs(x - y)) / (grid == "density" ? 9.3 : 1));
        }
      });
    }
  }
  return worst;
}
TEST(Walls, TurnedCubeIsTheTurnedVolume) {
  const auto worst = compare_turned(cube(V3d(3, 5, 7), V3d(13, 15, 17)), 20);
  for (const auto& [name, error] : worst) EXPECT_EQ(error, 0) << name;  // exact, bit for bit
}
// Sub-rays are not the same along every axis, nor mirrored: what rests on rays may differ within its own error. One layer's alpha does not.
TEST(Walls, TurnedTiltedBox) {
  Scene s = cube(V3d(3.3, 5.1, 7.2), V3d(13.7, 15.4, 17.9));
  for (V3d& p : s.mesh.points) p = V3d(p.x + 0.05 * p.y, p.y - 0.03 * p.z, p.z + 0.02 * p.x) ;
  const auto worst = compare_turned(s, 20);
  for (const auto& [name, error] : worst) std::printf("turned by the cube's 24 rotations: %-9s differs by at most %.3g\n", name.c_str(), error);
  EXPECT_LE(worst.at("area"), 1e-5);     // rounding, and float
  EXPECT_LE(worst.at("normal"), 1e-4);   // likewise, of voxels with a sliver of surface
  EXPECT_LE(worst.at("alpha"), 1e-5);    // exact where no surface lies before another: float
  EXPECT_LE(worst.at("solid"), 0.1);     // chords: order of an edge's error
}

// Slices: a small cube near +x +y +z in a flat box with all counts different.
TEST(Slices, MarkerIsWhereDocumented) {
  Scene s = empty_scene();
  add_box(s, V3d(7, 8, 9), V3d(8, 9, 10));
  Recipe recipe;
  recipe.box = Box3d(V3d(0), V3d(9, 11, 13));
  recipe.resolution = V3i(9, 11, 13);
  recipe.want.preview = false;
  const Pack pack = bake_quietly(s, recipe);
  ASSERT_EQ(pack.grid.n, V3i(9, 11, 13));
  ASSERT_EQ(pack.slices.size(), 3u);
  // Pictures' columns and rows: x stack (y, z), y stack (x, z), z stack (x, y); the top row is the highest coordinate.
  const V3i at(7, 8, 9);
  const std::array<std::array<int, 2>, 3> axes{{{1, 2}, {0, 2}, {0, 1}}};
  for (const SliceStack& stack : pack.slices) {
    const int u = axes[static_cast<std::size_t>(stack.axis)][0], v = axes[static_cast<std::size_t>(stack.axis)][1];
    EXPECT_EQ(stack.count, pack.grid.n[stack.axis]);
    EXPECT_EQ(stack.width, pack.grid.n[u]);
    EXPECT_EQ(stack.height, pack.grid.n[v]);
    EXPECT_DOUBLE_EQ(stack.thickness, 1);
    for (int k = 0; k < stack.count; ++k) {
      const Image image = stack.image(k);
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
          const bool here = k == at[stack.axis] && x == at[u] && y == image.height - 1 - at[v];
          EXPECT_EQ(image.at(x, y)[3], here ? 1.f : 0.f) << "axis " << stack.axis << " slice " << k << " column " << x << " row " << y;
        }
    }
  }
}

Scene balls() {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(0.2f, 0.4f, 0.6f);
  add_ball(s, 1, 12);
  for (V3d& p : s.mesh.points) p += V3d(0.3, 0.1, -0.2);
  add_quad(s, V3d(-1.5, 0.2, 0.4), V3d(0.7, 0.2, 0.3), V3d(0.1, 0.6, -0.8));
  return s;
}
V3i voxel_of(const SliceStack& s, int k, int x, int y) {
  return s.axis == 2 ? V3i(x, s.height - 1 - y, k) : s.axis == 1 ? V3i(x, k, s.height - 1 - y) : V3i(k, x, s.height - 1 - y);
}
TEST(Slices, AlphaIsTheVolumesAtOneSliceAVoxel) {
  Recipe recipe;
  recipe.resolution = V3i(21, 0, 0);
  recipe.want.preview = false;
  const Pack pack = bake_quietly(balls(), recipe);
  const Dense alpha = dense(pack.levels[0], "alpha");
  for (const SliceStack& s : pack.slices)
    for (int k = 0; k < s.count; ++k) {
      const Image image = s.image(k);
      for (int y = 0; y < s.height; ++y)
        for (int x = 0; x < s.width; ++x) {
          const float volume = alpha.at(voxel_of(s, k, x, y), s.axis);
          if (image.at(x, y)[3] > 0) {
            EXPECT_NEAR(image.at(x, y)[3], volume, 1e-6);  // float
          } else {
            EXPECT_LE(volume, 3.0 / 16);  // surface between the rays, which slices have not seen: about the share of two rays
          }
        }
    }
}
// density: mean over the axes of −ln(1 − alpha)/h, each capped; transparency weighs alpha where there is no solid.
TEST(Density, FollowsFromAlpha) {
  Recipe recipe;
  recipe.resolution = V3i(21, 0, 0);
  recipe.want.slices = recipe.want.preview = false;
  for (const double cap : {Recipe{}.max_depth, 2.0}) {
    recipe.max_depth = cap;
    const Pack pack = bake_quietly(balls(), recipe);
    for (const Level& level : pack.levels) {
      const Dense alpha = dense(level, "alpha"), density = dense(level, "density");
      for_each_cell(alpha.n, [&](const V3i& v) {
        double depth = 0;
        for (int a = 0; a < 3; ++a) depth += alpha.at(v, a) < 1 ? std::min(cap, -std::log1p(-static_cast<double>(alpha.at(v, a)))) : cap;
        EXPECT_NEAR(density.at(v) * level.grid.h, depth / 3, 1e-3 * cap + 1e-7);  // −ln(1 − a) makes 2⁻²⁴/(1 − a) of a float's rounding, 1e-3 near the cap
        EXPECT_EQ(density.state(v), alpha.state(v));
      });
    }
  }
  Scene glass = empty_scene();
  glass.materials[0].opacity = 0.25f;
  add_quad(glass, V3d(-1, -1, 0.05), V3d(2, 0, 0), V3d(0, 2, 0));
  recipe.box = Box3d(V3d(0), V3d(0.5));
  recipe.resolution = V3i(5, 0, 0);
  const Pack pack = bake_quietly(glass, recipe);
  const Dense alpha = dense(pack.levels[0], "alpha"), density = dense(pack.levels[0], "density"), transparency = dense(pack.levels[0], "transparency");
  EXPECT_EQ(alpha.at3(V3i(2, 2, 0)), V3f(0, 0, 1));
  EXPECT_NEAR(transparency.at(V3i(2, 2, 0)), 0.75, 1e-6);
  EXPECT_NEAR(density.at(V3i(2, 2, 0)) * 0.1, -std::log(0.75) / 3, 1e-6);  // seen along z alone, a quarter opaque
}

// Two slices into one: each ray that the one stops, one of the two stops. And a quarter as many: at least what each of theirs stops.
TEST(Slices, OtherCounts) {
  Recipe recipe;
  recipe.resolution = V3i(20, 20, 20);
  recipe.want.preview = false;
  Recipe twice = recipe, half = recipe, odd = recipe;
  const Pack one = bake_quietly(balls(), recipe);
  const int nz = one.grid.n.z;
  // None of them the voxel count, whose opacity knows more than its rays.
  Recipe middle = recipe;
  middle.slice_axes = twice.slice_axes = half.slice_axes = odd.slice_axes = {false, false, true};
  middle.slice_count = 2 * nz;
  twice.slice_count = 4 * nz;
  half.slice_count = nz / 2;
  odd.slice_count = 7;
  const SliceStack s1 = bake_quietly(balls(), middle).slices.at(0), s2 = bake_quietly(balls(), twice).slices.at(0), sh = bake_quietly(balls(), half).slices.at(0);
  EXPECT_EQ(s2.count, 4 * nz);
  EXPECT_DOUBLE_EQ(s2.thickness, one.grid.h / 4);
  for (int k = 0; k < 2 * nz; ++k) {
    const Image a = s2.image(2 * k), b = s2.image(2 * k + 1), c = s1.image(k), d = sh.image(k / 4);
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        const float lo = a.at(x, y)[3], hi = b.at(x, y)[3], all = c.at(x, y)[3];
        EXPECT_GE(all, std::max(lo, hi) - 1e-6f);
        EXPECT_LE(all, std::min(1.f, lo + hi) + 1e-6f);
        EXPECT_GE(d.at(x, y)[3], all - 1e-6f);
      }
  }
  const SliceStack so = bake_quietly(balls(), odd).slices.at(0);
  EXPECT_EQ(so.count, 7);
  EXPECT_DOUBLE_EQ(so.thickness, one.grid.h * nz / 7);
  // A single slice: every ray that meets anything.
  Recipe single = twice;
  single.slice_count = 1;
  const Image flat = bake_quietly(balls(), single).slices.at(0).image(0);
  for (int y = 0; y < flat.height; ++y)
    for (int x = 0; x < flat.width; ++x) {
      float most = 0;
      for (int k = 0; k < 2 * nz; ++k) most = std::max(most, s1.image(k).at(x, y)[3]);
      EXPECT_GE(flat.at(x, y)[3], most - 1e-6f);
    }
}
// MIP: two slices composed along the stack, 2×2 pixels averaged, premultiplied; a missing partner is empty.
TEST(Slices, MipFormula) {
  Recipe recipe;
  recipe.resolution = V3i(19, 0, 0);
  recipe.want.preview = false;
  recipe.slice_levels = 2;
  const Pack pack = bake_quietly(balls(), recipe);
  ASSERT_EQ(pack.slices.size(), 9u);
  for (const SliceStack& coarse : pack.slices) {
    if (coarse.level == 0) continue;
    const SliceStack* fine = nullptr;
    for (const SliceStack& s : pack.slices)
      if (s.axis == coarse.axis && s.level == coarse.level - 1) fine = &s;
    ASSERT_TRUE(fine);
    EXPECT_EQ(coarse.count, (fine->count + 1) / 2);
    EXPECT_EQ(coarse.width, (fine->width + 1) / 2);
    EXPECT_EQ(coarse.height, (fine->height + 1) / 2);
    EXPECT_DOUBLE_EQ(coarse.thickness, 2 * fine->thickness);
    for (int k = 0; k < coarse.count; ++k) {
      const Image image = coarse.image(k);
      const Image low = fine->image(2 * k), high = 2 * k + 1 < fine->count ? fine->image(2 * k + 1) : Image{};
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
          double alpha = 0;
          for (int q = 0; q < 4; ++q) {
            const int fx = 2 * x + (q & 1), from_below = 2 * (image.height - 1 - y) + (q >> 1), fy = fine->height - 1 - from_below;
            if (fx >= fine->width || fy < 0) continue;
            const double a = static_cast<double>(low.at(fx, fy)[3]), b = high.empty() ? 0 : static_cast<double>(high.at(fx, fy)[3]);
            alpha += (1 - (1 - a) * (1 - b)) / 4;
          }
          EXPECT_NEAR(image.at(x, y)[3], alpha, 1e-6);  // float
        }
    }
  }
}
TEST(Slices, GrazingFunctions) {
  // h·tan a ≤ d: length 1, depth 0.1, 45° needs 10 slices.
  EXPECT_EQ(slices_for_angle(1, 0.1, 45), 10);
  EXPECT_EQ(slices_for_angle(1, 0.1, 0), 1);
  EXPECT_EQ(slices_for_angle(1, 0.1, 89.9999), 4096);
  EXPECT_EQ(slices_for_angle(1, 0.1, 60), 18);  // 17.3
  EXPECT_NEAR(angle_for_slices(0.1, 0.1), 45, 1e-12);
  for (int n = 1; n < 200; ++n) {
    const double angle = angle_for_slices(1.0 / n, 0.1);
    EXPECT_EQ(slices_for_angle(1, 0.1, angle), n);  // each other's inverse
  }
}

// Where two solids touch, a ray leaves one and enters the other, whichever the file names first: nothing depends on the order.
TEST(Walls, TouchingSolidsInAnyOrder) {
  Recipe recipe = volume_recipe(16);
  recipe.want.slices = true;
  recipe.box = Box3d(V3d(0, 0, 0), V3d(1, 1, 1));
  for (int axis = 0; axis < 3; ++axis) {
    V3d low(0.25, 0.25, 0.25), middle(0.75, 0.75, 0.75), half(0.25, 0.25, 0.25), high(0.75, 0.75, 0.75);
    middle[axis] = half[axis] = 0.5;
    Scene first = empty_scene(), second = empty_scene();
    add_box(first, low, middle);
    add_box(first, half, high);
    add_box(second, half, high);
    add_box(second, low, middle);
    const Pack a = bake_quietly(first, recipe), b = bake_quietly(second, recipe);
    EXPECT_NEAR(filled_volume(a), 0.125, 1e-9);
    for (const char* name : {"density", "alpha", "solid", "area", "crossings"}) EXPECT_EQ(dense(a.levels[0], name).values, dense(b.levels[0], name).values) << name;
    for (std::size_t s = 0; s < a.slices.size(); ++s)
      for (int k = 0; k < a.slices[s].count; ++k) {
        const Image p = a.slices[s].image(k), q = b.slices[s].image(k);
        ASSERT_EQ(p.pixels, q.pixels) << "slice " << k << " along " << s;
        for (int y = 0; y < 16; ++y)
          for (int x = 0; x < 16; ++x) {
            const bool inside = k >= 4 && k < 12 && x >= 4 && x < 12 && y >= 4 && y < 12;
            ASSERT_EQ(p.at(x, y)[3], inside ? 1 : 0) << "slice " << k << " along " << s << " at " << x << " " << y;
          }
      }
  }
}

}  // namespace
}  // namespace texel::test
