// --cyclic: one period baked by itself is the period cut out of the scene repeated by hand, and its borders fit.
#include <algorithm>
#include <bit>
#include <numbers>

#include "formats/error.h"
#include "formats/readers.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

using Axes = std::array<bool, 3>;

// Corners on a lattice of 2⁻²⁰, so that moving by whole units rounds nothing.
void make_exact(Scene& scene) {
  for (V3d& p : scene.mesh.points)
    for (int a = 0; a < 3; ++a) p[a] = std::nearbyint(p[a] * 0x1p20) * 0x1p-20;
}

void append(Scene& scene, Scene part, const V3d& at) {
  make_exact(part);
  const auto points = static_cast<std::uint32_t>(scene.mesh.points.size()), uvs = static_cast<std::uint32_t>(scene.mesh.uvs.size());
  for (const V3d& p : part.mesh.points) scene.mesh.points.push_back(p + at);
  scene.mesh.uvs.insert(scene.mesh.uvs.end(), part.mesh.uvs.begin(), part.mesh.uvs.end());
  for (std::array<std::uint32_t, 3> t : part.mesh.triangles) {
    for (std::uint32_t& v : t) v += points;
    scene.mesh.triangles.push_back(t);
  }
  for (std::array<std::uint32_t, 3> t : part.mesh.uv_corners) {
    for (std::uint32_t& v : t) v = v == kNoIndex ? v : v + uvs;
    scene.mesh.uv_corners.push_back(t);
  }
  scene.mesh.materials.insert(scene.mesh.materials.end(), part.mesh.materials.begin(), part.mesh.materials.end());
}

Scene with_materials() {
  Scene scene;
  for (const V3f& kd : {V3f(0.8f, 0.1f, 0.1f), V3f(0.1f, 0.7f, 0.2f), V3f(0.1f, 0.2f, 0.9f)}) scene.materials.emplace_back().kd = kd;
  return scene;
}

// Balls, a slab's corner and an open sheet, all across the borders of the unit cube, the last over several periods.
Scene scattered() {
  Scene scene = with_materials();
  const auto ball = [](double radius, std::uint32_t material) { Scene s = with_materials(); add_ball(s, radius, 12, material); return s; };
  append(scene, ball(0.3, 0), V3d(0.125, 0.0625, 0.5));
  append(scene, ball(0.15, 1), V3d(0.9375, 0.5, 0.25));
  append(scene, ball(0.125, 2), V3d(0.5, 0.53125, 0.75));
  Scene box = with_materials();
  add_box(box, V3d(0, 0, 0), V3d(0.4, 0.3, 0.2), false, 63, 1);
  append(scene, box, V3d(0.75, 0.8125, 0.0625));
  Scene sheet = with_materials();
  add_quad(sheet, V3d(0, 0, 0), V3d(1.7, 0.3, 0.2), V3d(-0.2, 0.4, 0.1), 2);
  append(scene, sheet, V3d(-0.3125, 0.40625, 0.625));
  return scene;
}

Scene tiled(const Scene& scene, const Axes& axes, int from, int to) {
  Scene all = scene;
  all.mesh = {};
  for (int z = axes[2] ? from : 0; z <= (axes[2] ? to : 0); ++z)
    for (int y = axes[1] ? from : 0; y <= (axes[1] ? to : 0); ++y)
      for (int x = axes[0] ? from : 0; x <= (axes[0] ? to : 0); ++x) append(all, scene, V3d(x, y, z));
  return all;
}

Recipe unit_recipe(int n, const Axes& cyclic) {
  Recipe recipe = volume_recipe(n);
  recipe.box = Box3d(V3d(0, 0, 0), V3d(1, 1, 1));
  recipe.cyclic = cyclic;
  recipe.want.slices = true;
  return recipe;
}

// Every voxel, value and pixel of `period` against the part of `whole` that begins at voxel `at` of level 0.
void expect_cut(const Pack& period, const Pack& whole, const V3i& at, bool colors) {
  ASSERT_LE(period.levels.size(), whole.levels.size());
  for (std::size_t l = 0; l < period.levels.size(); ++l) {
    const V3i begin(at.x >> l, at.y >> l, at.z >> l);
    for (const Layer& layer : period.levels[l].layers)
      for (const Channel& channel : layer.channels) {
        if (!colors && channel.name == "Cd") continue;
        const Dense one = dense(period.levels[l], channel.name), all = dense(whole.levels[l], channel.name);
        std::int64_t states = 0, off = 0;
        double worst = 0;
        for_each_cell(one.n, [&](const V3i& v) {
          states += (one.state(v) != 0) != (all.state(v + begin) != 0);
          for (int c = 0; c < one.components; ++c) {
            const double x = static_cast<double>(one.at(v, c)), y = static_cast<double>(all.at(v + begin, c));
            worst = std::max(worst, std::abs(x - y) / std::max(1.0, std::abs(y)));
            off += x != y;
          }
        });
        EXPECT_EQ(states, 0) << channel.name << " level " << l;
        EXPECT_LE(worst, 1e-6) << channel.name << " level " << l << ", " << off << " values";
      }
  }
  ASSERT_EQ(period.slices.size(), whole.slices.size());
  for (std::size_t s = 0; s < period.slices.size(); ++s) {
    const SliceStack &one = period.slices[s], &all = whole.slices[s];
    const int axis = one.axis, u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
    double alpha = 0, color = 0;
    for (int k = 0; k < one.count; ++k) {
      const Image a = one.image(k), b = all.image(k + (at[axis] >> one.level));
      const int left = at[u] >> one.level, top = b.height - (at[v] >> one.level) - a.height;
      for (int y = 0; y < a.height; ++y)
        for (int x = 0; x < a.width; ++x) {
          const float *p = a.at(x, y), *q = b.at(x + left, y + top);
          alpha = std::max(alpha, static_cast<double>(std::abs(p[3] - q[3])));
          if (colors && q[3] > 0)
            for (int c = 0; c < 3; ++c) color = std::max(color, static_cast<double>(std::abs(p[c] - q[c])));
        }
    }
    EXPECT_LE(alpha, 1e-6) << "slices along " << axis << " level " << one.level;
    EXPECT_LE(color, 1e-6) << "slices along " << axis << " level " << one.level;
  }
}

// The period against the same box of a scene tiled far enough, and against the middle of a bake of 3 × 3 (× 3) periods, where colour has come
// from the neighbours too.
void expect_tiles(const Scene& scene, const Axes& cyclic, int n, int reach) {
  Recipe recipe = unit_recipe(n, cyclic);
  recipe.slice_levels = 2;
  const Pack period = bake_quietly(scene, recipe);
  EXPECT_EQ(period.cyclic, cyclic);
  recipe.cyclic = {false, false, false};
  const Scene tiles = tiled(scene, cyclic, -reach, reach);
  expect_cut(period, bake_quietly(tiles, recipe), V3i(0, 0, 0), false);
  recipe.resolution = V3i(0, 0, 0);
  for (int a = 0; a < 3; ++a) {
    const bool wide = cyclic[static_cast<std::size_t>(a)];
    recipe.resolution[a] = wide ? 3 * n : n;
    recipe.box->min[a] = wide ? -1 : 0;
    recipe.box->max[a] = wide ? 2 : 1;
  }
  expect_cut(period, bake_quietly(tiles, recipe), V3i(cyclic[0] ? n : 0, cyclic[1] ? n : 0, cyclic[2] ? n : 0), true);
}

TEST(Cyclic, OnePeriodIsTheOneCutFromTheTilingAlongX) { expect_tiles(scattered(), {true, false, false}, 32, 4); }
TEST(Cyclic, OnePeriodIsTheOneCutFromTheTilingAlongXY) { expect_tiles(scattered(), {true, true, false}, 32, 4); }
TEST(Cyclic, OnePeriodIsTheOneCutFromTheTilingAlongXYZ) { expect_tiles(scattered(), {true, true, true}, 16, 4); }

// z = height(x, y) over [from, to]², n cells a unit; one sheet, facing up or, `below`, down.
void add_sheet(Scene& scene, const std::function<double(double, double)>& height, int n, int from, int to, bool below) {
  const auto first = static_cast<std::uint32_t>(scene.mesh.points.size());
  const int side = (to - from) * n + 1;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const double x = from + static_cast<double>(i) / n, y = from + static_cast<double>(j) / n;
      scene.mesh.points.push_back(V3d(x, y, height(x, y)));
    }
  for (int j = 0; j + 1 < side; ++j)
    for (int i = 0; i + 1 < side; ++i) {
      const std::uint32_t a = first + static_cast<std::uint32_t>(j * side + i), b = a + 1, c = a + static_cast<std::uint32_t>(side), d = c + 1;
      for (const auto& t : {std::array{a, b, d}, std::array{a, d, c}}) {
        scene.mesh.triangles.push_back(below ? std::array{t[0], t[2], t[1]} : t);
        scene.mesh.uv_corners.push_back({kNoIndex, kNoIndex, kNoIndex});
        scene.mesh.materials.push_back(0);
      }
    }
}

// Hills of period 1, to 2⁻²⁰.
double hills(double x, double y) {
  const double f = 0.5 + 0.2 * std::sin(2 * std::numbers::pi * x) * std::cos(2 * std::numbers::pi * y) + 0.1 * std::sin(4 * std::numbers::pi * (x + y));
  return std::nearbyint(f * 0x1p20) * 0x1p-20;
}
double hills_of_one_period(double x, double y) { return hills(x - std::floor(x), y - std::floor(y)); }

// Ground without walls: an upper and a lower side that meet only their own repetitions. 13 cells a unit: not in step with the voxels.
Scene ground(int from, int to) {
  Scene scene = empty_scene();
  add_sheet(scene, hills_of_one_period, 16, from, to, false);
  add_sheet(scene, [](double, double) { return 0.125; }, 16, from, to, true);
  return scene;
}

TEST(Cyclic, GroundWithoutWallsIsSolid) {
  for (const bool turned : {false, true}) {
    Scene scene = ground(0, 1), tiles = ground(-3, 4);
    if (turned) turn_faces(scene, 0, scene.mesh.triangles.size());
    Recipe recipe = unit_recipe(32, {true, true, false});
    const Pack period = bake_quietly(scene, recipe);
    EXPECT_EQ(has_issue(period, "mesh-open"), false);
    EXPECT_EQ(has_issue(period, "mesh-inside-out"), turned);
    EXPECT_EQ(period.statistics.closed, 1);
    // The tiling is closed by walls far away.
    add_box(tiles, V3d(-3, -3, 0.125), V3d(4, 4, 0.125), false, 0);
    for (int side = 0; side < 4; ++side)
      for (int i = 0; i < 7 * 16; ++i) {
        const double p = -3 + i / 16.0, q = p + 1 / 16.0;
        const auto corner = [&](double t) { return side == 0 ? V3d(t, -3, 0) : side == 1 ? V3d(4, t, 0) : side == 2 ? V3d(1 - t, 4, 0) : V3d(-3, 1 - t, 0); };
        const V3d a = corner(p), b = corner(q);
        const V3d low(0, 0, 0.125), up_a(0, 0, hills_of_one_period(a.x, a.y)), up_b(0, 0, hills_of_one_period(b.x, b.y));
        add_triangle(tiles, a + low, b + low, b + up_b);
        add_triangle(tiles, a + low, b + up_b, a + up_a);
      }
    recipe.cyclic = {false, false, false};
    const Pack cut = bake_quietly(tiles, recipe);
    ASSERT_FALSE(has_issue(cut, "mesh-open"));
    expect_cut(period, cut, V3i(0, 0, 0), false);
    // Filled to the mean height less the floor.
    double mean = 0;
    for (int j = 0; j < 16; ++j)
      for (int i = 0; i < 16; ++i) mean += (hills(i / 16.0, j / 16.0) - 0.125) / 256;
    EXPECT_NEAR(filled_volume(period), mean, 1e-7);  // floats of solid: 2⁻²⁵ each
    EXPECT_NEAR(period.statistics.volume, mean, 1e-12);
    // Slices wholly inside have the ground's colour.
    const SliceStack& stack = period.slices[2];
    ASSERT_EQ(stack.axis, 2);
    const Image inside = stack.image(5);
    EXPECT_EQ(inside.at(7, 9)[3], 1);
    EXPECT_FLOAT_EQ(inside.at(7, 9)[0], 0.5f);
  }
}

// A pipe along x whose wall is `outer` less `inner`, its ends open, from `from` to `to` in cells of 1/8.
void add_pipe(Scene& scene, double outer, double inner, int from, int to) {
  for (const bool bore : {false, true}) {
    const double r = bore ? inner : outer;
    if (r <= 0) continue;
    for (int i = from; i < to; ++i)
      for (int k = 0; k < 24; ++k) {
        const auto at = [&](int j, int m) {
          const double phi = 2 * std::numbers::pi * (m % 24) / 24;
          return V3d(j / 8.0, std::nearbyint((0.5 + r * std::cos(phi)) * 0x1p20) * 0x1p-20, std::nearbyint((0.5 + r * std::sin(phi)) * 0x1p20) * 0x1p-20);
        };
        const V3d a = at(i, k), b = at(i + 1, k), c = at(i + 1, k + 1), d = at(i, k + 1);
        if (bore) { add_triangle(scene, a, b, c); add_triangle(scene, a, c, d); }
        else { add_triangle(scene, a, c, b); add_triangle(scene, a, d, c); }
      }
  }
}

double polygon(double r) { return 12 * r * r * std::sin(2 * std::numbers::pi / 24); }

TEST(Cyclic, PipesThatNeverEndAreSolidAndKeepTheirBore) {
  for (const int shift : {0, 3, -11}) {  // where the pipe is cut for modelling does not matter
    for (const double bore : {0.0, 0.25}) {
      Scene scene = empty_scene();
      add_pipe(scene, 0.375, bore, shift, shift + 8);
      const Pack pack = bake_quietly(scene, unit_recipe(32, {true, false, false}));
      EXPECT_FALSE(has_issue(pack, "mesh-open"));
      EXPECT_FALSE(has_issue(pack, "mesh-inside-out"));
      EXPECT_NEAR(filled_volume(pack), polygon(0.375) - polygon(bore), 2e-6) << shift << " " << bore;
      EXPECT_NEAR(pack.statistics.volume, polygon(0.375) - polygon(bore), 2e-6);
      const Dense solid = dense(pack.levels[0], "solid");
      for_each_cell(solid.n, [&](const V3i& v) { ASSERT_EQ(solid.at(v), solid.at(V3i((v.x + 4) % 32, v.y, v.z))); });  // the same all along
    }
  }
}

TEST(Cyclic, CornersThatNearlyMeetTheirRepetitionsDo) {
  Scene scene = empty_scene();
  add_pipe(scene, 0.375, 0.25, 0, 8);
  for (V3d& p : scene.mesh.points)
    if (p.x == 1) p += V3d(1e-5, -2e-5, 1e-5);  // as a file with five digits would have it: 6·10⁻⁴ voxel
  const Pack pack = bake_quietly(scene, unit_recipe(32, {true, false, false}));
  EXPECT_FALSE(has_issue(pack, "mesh-open"));
  EXPECT_NEAR(filled_volume(pack), polygon(0.375) - polygon(0.25), 1e-4);
}

TEST(Cyclic, BubblesInGroundStayEmpty) {
  Scene scene = ground(0, 1), bubble = empty_scene();
  add_ball(bubble, 0.0625, 12);
  turn_faces(bubble, 0, bubble.mesh.triangles.size());
  const double volume = -mesh_volume(bubble.mesh);
  append(scene, bubble, V3d(0.96875, 0.03125, 0.25));
  const Pack with = bake_quietly(scene, unit_recipe(64, {true, true, false})), without = bake_quietly(ground(0, 1), unit_recipe(64, {true, true, false}));
  EXPECT_FALSE(has_issue(with, "mesh-inside-out"));
  EXPECT_NEAR(filled_volume(without) - filled_volume(with), volume, 1e-6);
}

TEST(Cyclic, SheetsAndEndlessSolidsStaySurfaces) {
  Scene sheet = empty_scene();
  add_sheet(sheet, hills_of_one_period, 16, 0, 1, false);
  Pack pack = bake_quietly(sheet, unit_recipe(32, {true, true, false}));
  EXPECT_TRUE(has_issue(pack, "cyclic-sheet"));
  EXPECT_EQ(sum_of(pack.levels[0], "solid"), 0);
  // A wall with a hole, joined to its repetitions upwards and sideways: a lattice that has no end along any axis.
  Scene lattice = empty_scene();
  for (int axis = 0; axis < 3; ++axis)
    for (int face = 0; face < 4; ++face) {
      // four sides of three square tubes through the cube's centre, each in two halves that leave the middle cube open
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      for (const double from : {0.0, 0.625}) {
        V3d corner(0.375, 0.375, 0.375), along(0, 0, 0), across(0, 0, 0);
        corner[axis] = from;
        along[axis] = 0.375;
        if (face == 0) across[v] = 0.25;
        if (face == 1) { across[v] = 0.25; corner[u] = 0.625; }
        if (face == 2) across[u] = 0.25;
        if (face == 3) { across[u] = 0.25; corner[v] = 0.625; }
        const bool flip = face == 1 || face == 2;
        if (flip) add_quad(lattice, corner, across, along); else add_quad(lattice, corner, along, across);
      }
    }
  pack = bake_quietly(lattice, unit_recipe(32, {true, true, true}));
  EXPECT_TRUE(has_issue(pack, "cyclic-endless"));
  // Where it ends along z the same tubes are solid: cut at the top and bottom they are open, with caps they are not.
  for (const double z : {0.0, 1.0}) {
    const V3d x(0.25, 0, 0), y(0, 0.25, 0), at(0.375, 0.375, z);
    if (z == 0) add_quad(lattice, at, y, x); else add_quad(lattice, at, x, y);
  }
  pack = bake_quietly(lattice, unit_recipe(32, {true, true, false}));
  EXPECT_FALSE(has_issue(pack, "mesh-open"));
  EXPECT_NEAR(filled_volume(pack), 3 * 0.0625 - 2 * 0.015625, 1e-6);
}

// Mean step of a value from each plane of voxels to the next along an axis, the last one to the first.
struct Steps { double seam = 0, largest_inner = 0; };
Steps steps_of(const Dense& d, int axis) {
  std::vector<double> step(static_cast<std::size_t>(d.n[axis]), 0.0);
  for_each_cell(d.n, [&](const V3i& v) {
    V3i next = v;
    next[axis] = (v[axis] + 1) % d.n[axis];
    for (int c = 0; c < d.components; ++c) step[static_cast<std::size_t>(v[axis])] += static_cast<double>(std::abs(d.at(v, c) - d.at(next, c)));
  });
  return {step.back(), *std::max_element(step.begin(), step.end() - 1)};
}

// The scene with its borders at another place is the same pack turned round: the borders are nowhere. With that, no step across them can be larger
// than steps inside are; measured too.
TEST(Cyclic, BordersAreNowhere) {
  Scene scene = scattered();
  Recipe recipe = unit_recipe(32, {true, true, false});
  const Pack here = bake_quietly(scene, recipe);
  recipe.box = Box3d(V3d(0.25, -0.5, 0), V3d(1.25, 0.5, 1));
  const Pack there = bake_quietly(scene, recipe);
  const V3i turn(8, 16, 0);
  for (std::size_t l = 0; l < 4; ++l)
    for (const char* name : {"density", "alpha", "solid", "area", "normal", "crossings", "Cd"}) {
      const Dense a = dense(here.levels[l], name), b = dense(there.levels[l], name);
      double worst = 0;
      for_each_cell(b.n, [&](const V3i& v) {
        const V3i from((v.x + (turn.x >> l)) % a.n.x, (v.y + (turn.y >> l)) % a.n.y, v.z);
        ASSERT_EQ(a.state(from) != 0, b.state(v) != 0) << name << " " << l;
        for (int c = 0; c < a.components; ++c) worst = std::max(worst, static_cast<double>(std::abs(a.at(from, c) - b.at(v, c))));
      });
      EXPECT_LE(worst, 1e-6) << name << " level " << l;
      for (const int axis : {0, 1}) {
        const Steps s = steps_of(a, axis);
        EXPECT_LE(s.seam, s.largest_inner) << name << " level " << l << " axis " << axis;
      }
    }
  for (std::size_t s = 0; s < here.slices.size(); ++s)
    for (int k = 0; k < here.slices[s].count; ++k) {
      const int axis = here.slices[s].axis, u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
      const Image b = there.slices[s].image(k), a = here.slices[s].image((k + turn[axis]) % here.slices[s].count);
      for (int y = 0; y < b.height; ++y)
        for (int x = 0; x < b.width; ++x) {
          // Rows count from the top.
          const float *p = b.at(x, y), *q = a.at((x + turn[u]) % a.width, (y - turn[v] + a.height) % a.height);
          for (int c = 0; c < 4; ++c) ASSERT_NEAR(p[c], q[c], 1e-6) << "slice " << k << " along " << axis << " at " << x << " " << y << " channel " << c;
        }
    }
}

TEST(Cyclic, LightComesInFromTheNeighbours) {
  // A low sun along x: the post's shadow leaves the period and comes in again, several times over.
  Scene scene = with_materials();
  Scene post = with_materials(), floor = with_materials();
  add_box(post, V3d(0, 0, 0), V3d(0.125, 0.25, 0.5), false, 63, 0);
  add_box(floor, V3d(0, 0, 0), V3d(1, 1, 0.125), false, 63, 2);
  append(scene, post, V3d(0.5, 0.375, 0.125));
  append(scene, floor, V3d(0, 0, 0));
  Recipe recipe = unit_recipe(32, {true, true, false});
  recipe.lights = {{Light::Kind::kAmbient, V3d(0, 0, 0), V3f(0.1f, 0.1f, 0.1f)}, {Light::Kind::kSun, V3d(1, 0.03125, -0.21), V3f(1, 1, 1)}};
  recipe.shadows = true;
  const Pack period = bake_quietly(scene, recipe);
  recipe.cyclic = {false, false, false};
  const Pack cut = bake_quietly(tiled(scene, {true, true, false}, -5, 5), recipe);
  // Rays are single precision in scenes of different size: a shadow's edge may differ by a sub-ray, 1/16 of a pixel's light.
  std::int64_t pixels = 0, off = 0, lit = 0, dark = 0;
  for (std::size_t s = 0; s < period.slices.size(); ++s)
    for (int k = 0; k < period.slices[s].count; ++k) {
      const Image a = period.slices[s].image(k), b = cut.slices[s].image(k);
      for (std::size_t i = 0; i < a.pixels.size(); i += 4) {
        if (!(b.pixels[i + 3] > 0)) continue;
        ++pixels;
        double d = 0;
        for (std::size_t c = 0; c < 3; ++c) d = std::max(d, static_cast<double>(std::abs(a.pixels[i + c] - b.pixels[i + c])));
        off += d > 1e-4;
        ASSERT_LT(d, 0.2) << "slice " << k << " of " << s << " pixel " << i / 4;
        if (period.slices[s].axis == 2 && k == 3) (a.pixels[i + 2] > 0.2f ? lit : dark) += 1;
      }
    }
  EXPECT_LT(off, pixels / 200);
  EXPECT_GT(lit, 50);
  EXPECT_GT(dark, 50);
  recipe.cyclic = {true, true, false};
  recipe.lights = {{Light::Kind::kPoint, V3d(0.5, 0.5, 2), V3f(1, 1, 1)}};
  EXPECT_TRUE(has_issue(bake_quietly(scene, recipe), "cyclic-light"));
}

TEST(Cyclic, LevelsEndWhereThePeriodCannotBeHalved) {
  Recipe recipe = unit_recipe(24, {true, true, false});
  recipe.slice_levels = 5;
  const Pack pack = bake_quietly(scattered(), recipe);
  EXPECT_EQ(pack.levels.size(), 4U);  // 24, 12, 6, 3
  EXPECT_TRUE(has_issue(pack, "cyclic-levels"));
  EXPECT_TRUE(has_issue(pack, "cyclic-slice-levels"));
  for (const SliceStack& s : pack.slices) EXPECT_LE(s.level, 3);
  recipe.resolution.x = 32;
  const Pack whole = bake_quietly(scattered(), recipe);
  EXPECT_EQ(whole.levels.size(), 6U);
  EXPECT_FALSE(has_issue(whole, "cyclic-levels"));
}

TEST(Cyclic, PeriodsAreWholeNumbersOfVoxels) {
  Scene scene = empty_scene();
  add_box(scene, V3d(0, 0, 0), V3d(3, 1.5, 0.7));
  Recipe recipe = volume_recipe(64);
  recipe.cyclic = {true, true, false};
  Pack pack = bake_quietly(scene, recipe);
  EXPECT_EQ(pack.grid.n, V3i(64, 32, 17));  // 0.7 is 14.93 voxels, and the margin
  EXPECT_EQ(pack.grid.box().min.x, 0);
  EXPECT_EQ(pack.grid.box().max.y, 1.5);
  const auto message = [&] {
    try {
      (void)bake_quietly(scene, recipe);
    } catch (const Error& e) {
      EXPECT_EQ(e.code, Code::kCommandLine);
      return std::string(e.what());
    }
    return std::string("none");
  };
  recipe.resolution.x = 63;
  EXPECT_NE(message().find("the period along y, 1.5, is 31.5 voxels of 0.047619"), std::string::npos) << message();
  EXPECT_NE(message().find("--resolution 64 fits"), std::string::npos) << message();
  // What the message advises fits, also where the longest side does not repeat.
  scene = empty_scene();
  add_box(scene, V3d(0, 0, 0), V3d(1, 0.7, 4.1));
  recipe.resolution.x = 128;
  const std::string advice = message();
  ASSERT_NE(advice.find("--resolution "), std::string::npos) << advice;
  recipe.resolution.x = std::stoi(advice.substr(advice.find("--resolution ") + 13));
  EXPECT_NEAR(recipe.resolution.x, 128, 40);
  EXPECT_EQ(message(), "none");
  scene = empty_scene();
  add_box(scene, V3d(0, 0, 0), V3d(3, 1.5, 0.7));
  recipe.voxel_size = 0.4;
  EXPECT_NE(message().find("the period along x, 3, is 7.5 voxels"), std::string::npos) << message();
  EXPECT_NE(message().find("give a --box"), std::string::npos) << message();
  recipe.voxel_size = 0.25;
  EXPECT_EQ(bake_quietly(scene, recipe).grid.n, V3i(12, 6, 5));
  recipe.voxel_size = 0;
  recipe.resolution = V3i(64, 64, 64);
  EXPECT_NE(message().find("other proportions"), std::string::npos) << message();
  Scene flat = empty_scene();
  add_quad(flat, V3d(0, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1));
  scene = flat;
  recipe.resolution = V3i(32, 0, 0);
  EXPECT_NE(message().find("no extent along x"), std::string::npos) << message();
}

TEST(Cyclic, AScenePeriodsWideAndAPeriodOfOneVoxel) {
  Scene far = empty_scene();
  add_quad(far, V3d(0, 0, 0.25), V3d(1e12, 0, 0), V3d(0, 1e12, 0));
  Recipe recipe = unit_recipe(16, {true, true, false});
  EXPECT_THROW((void)bake_quietly(far, recipe), Error);
  // A plank 200 periods long: in each voxel of its layer 200 boards cross the border, one over the other.
  Scene plank = empty_scene();
  add_quad(plank, V3d(0.3125, 0, 0.53125), V3d(200, 0, 0), V3d(0, 1, 0));
  Pack pack = bake_quietly(plank, recipe);
  EXPECT_NEAR(sum_of(pack.levels[0], "area") / 256, 200, 1e-4);
  Scene ball = empty_scene();
  add_ball(ball, 0.4, 12);
  append(ball = empty_scene(), [] { Scene s = empty_scene(); add_ball(s, 0.4, 12); return s; }(), V3d(0.9375, 0.03125, 0.5));
  recipe.resolution.x = 1;
  recipe.box = Box3d(V3d(0, 0, 0), V3d(1, 1, 4));
  recipe.voxel_size = 1;
  pack = bake_quietly(ball, recipe);
  EXPECT_EQ(pack.grid.n, V3i(1, 1, 4));
  EXPECT_NEAR(sum_of(pack.levels[0], "area"), mesh_area(ball.mesh), 1e-6);
  EXPECT_NEAR(filled_volume(pack), mesh_volume(ball.mesh), 1e-6);
}

TEST(Cyclic, SameForAnyNumberOfThreads) {
  const Scene scene = scattered();
  Recipe recipe = unit_recipe(32, {true, true, true});
  std::vector<std::vector<float>> values;
  for (const int threads : {1, 2, 4}) {
    recipe.threads = threads;
    std::vector<float> all;
    for (const Level& level : bake_quietly(scene, recipe).levels)
      for (const Layer& layer : level.layers)
        for (const Channel& c : layer.channels) all.insert(all.end(), c.values.begin(), c.values.end());
    values.push_back(std::move(all));
  }
  EXPECT_EQ(values[0], values[1]);
  EXPECT_EQ(values[0], values[2]);
}

// 8 × 8 samples a period, given once or repeated 3 × 3; base −1/8.
Scene random_heights(int repeats) {
  Random random(3);
  std::vector<double> samples(64);
  for (double& z : samples) z = std::nearbyint(random.uniform(0, 0.25) * 0x1p20) * 0x1p-20;
  Scene scene = empty_scene();
  HeightField& field = scene.heights.emplace_back();
  field.name = "made";
  field.width = field.height = 8 * repeats;
  field.size = V2d(repeats, repeats);
  field.base = -0.125;
  field.low = *std::min_element(samples.begin(), samples.end());
  field.high = *std::max_element(samples.begin(), samples.end());
  for (int y = 0; y < field.height; ++y)
    for (int x = 0; x < field.width; ++x) field.z.push_back(samples[static_cast<std::size_t>(y % 8 * 8 + x % 8)]);
  return scene;
}

TEST(Cyclic, HeightFieldsTile) {
  Recipe recipe = volume_recipe(32);
  recipe.want.slices = true;
  recipe.cyclic = {true, true, false};
  recipe.box = Box3d(V3d(0, 0, -0.25), V3d(1, 1, 0.75));
  const Pack one = bake_quietly(random_heights(1), recipe);
  recipe.resolution = V3i(96, 96, 32);
  recipe.box = Box3d(V3d(0, 0, -0.25), V3d(3, 3, 0.75));
  const Pack nine = bake_quietly(random_heights(3), recipe);
  EXPECT_FALSE(has_issue(one, "mesh-open") || has_issue(one, "cyclic-sheet"));
  EXPECT_EQ(one.statistics.closed, 1);
  EXPECT_NEAR(filled_volume(one), filled_volume(nine) / 9, 1e-7);
  expect_cut(one, nine, V3i(32, 32, 0), true);
  // Cyclic along one axis only: walls stand along the other.
  recipe.cyclic = {true, false, false};
  recipe.resolution = V3i(32, 32, 32);
  recipe.box = Box3d(V3d(0, 0, -0.25), V3d(1, 1, 0.75));
  const Pack along_x = bake_quietly(random_heights(1), recipe);
  EXPECT_EQ(along_x.statistics.closed, 1);
  EXPECT_FALSE(has_issue(along_x, "mesh-open"));
}

TEST(Cyclic, NoiseHasNoSeam) {
  HeightOptions options;
  options.perlin = {4, 4, 1};
  options.extent = V2d(1, 1);
  options.height = 0.25;
  options.base = 0;
  Recipe recipe = volume_recipe(128);
  recipe.want.slices = true;
  recipe.cyclic = {true, true, false};
  const Pack pack = bake_quietly(make_perlin_field(options), recipe);
  EXPECT_EQ(pack.statistics.closed, 1);
  for (std::size_t l = 0; l < 5; ++l)
    for (const char* name : {"density", "alpha", "solid", "normal"})
      for (const int axis : {0, 1}) {
        const Steps s = steps_of(dense(pack.levels[l], name), axis);
        if (l == 0) std::printf("%s along %c: step across the border %.4g, largest within %.4g\n", name, "xy"[axis], s.seam, s.largest_inner);
        EXPECT_LE(s.seam, s.largest_inner) << name << " level " << l << " axis " << axis;
      }
  // The slices along z: rows and columns of their pictures.
  const SliceStack& stack = pack.slices[2];
  ASSERT_EQ(stack.axis, 2);
  std::array<std::vector<double>, 2> step{std::vector<double>(128, 0.0), std::vector<double>(128, 0.0)};
  for (int k = 0; k < stack.count; ++k) {
    const Image image = stack.image(k);
    for (int y = 0; y < 128; ++y)
      for (int x = 0; x < 128; ++x)
        for (int c = 0; c < 4; ++c) {
          step[0][static_cast<std::size_t>(x)] += static_cast<double>(std::abs(image.at(x, y)[c] - image.at((x + 1) % 128, y)[c]));
          step[1][static_cast<std::size_t>(y)] += static_cast<double>(std::abs(image.at(x, y)[c] - image.at(x, (y + 1) % 128)[c]));
        }
  }
  for (const auto& steps : step) EXPECT_LE(steps.back(), *std::max_element(steps.begin(), steps.end() - 1));
}

double figure(const Pack& pack, const std::string& measure) {
  for (const ErrorFigure& e : pack.errors)
    if (e.measure == measure) return e.value;
  ADD_FAILURE() << "no " << measure;
  return 1;
}

// A period as large as the solid, its borders anywhere through it: every piece comes in again, and area and volume are those of the mesh. Bound:
// rounding of some 10⁵ sums.
void expect_nothing_lost(const Scene& scene, int n, Random& random) {
  Box3d bounds;
  for (const V3d& p : scene.mesh.points) bounds.extendBy(p);
  const double side = std::max({bounds.size().x, bounds.size().y, bounds.size().z}) * 1.01;
  Recipe recipe = volume_recipe(n);
  recipe.cyclic = {true, true, true};
  recipe.want.normal = recipe.want.ndf = recipe.want.levels = false;
  const V3d corner = bounds.min + V3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)) * side;
  recipe.box = Box3d(corner, corner + V3d(side));
  const Pack pack = bake_quietly(scene, recipe);
  EXPECT_LT(std::abs(figure(pack, "area_relative")), 1e-12);
  EXPECT_LT(std::abs(figure(pack, "volume_relative")), 1e-12);
}

TEST(Cyclic, NothingIsLostWhereverTheBordersAre) {
  Random random(11);
  Scene ball = empty_scene();
  add_ball(ball, 0.4, 16);
  for (int i = 0; i < 40; ++i) {
    const Rotation turn = random_rotation(random);
    expect_nothing_lost(transformed(ball, turn), 8 + i, random);
  }
}

TEST(Cyclic, NothingIsLostOfModels) {
  Random random(12);
  int there = 0;
  for (const std::string& name : closed_models()) {
    Scene scene;
    std::string reason;
    if (!load_model(name, scene, reason)) continue;
    SCOPED_TRACE(name);
    expect_nothing_lost(scene, 64, random);
    ++there;
  }
  if (there == 0) GTEST_SKIP() << "the models are not there: " << model_path("");
}

}  // namespace
}  // namespace texel::test
