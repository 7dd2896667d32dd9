// Very many in one place, one over very many: a million triangles in a voxel, a triangle across the largest grid, a sphere far from the origin, thousands of shells.
#include <tbb/parallel_for.h>

#include <atomic>
#include <chrono>

#include "tests/stress/invariants.h"
#include "tests/stress/shapes.h"
#include "tests/stress/truth.h"

namespace texel::stress {
namespace {

double since(std::chrono::steady_clock::time_point begin) { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); }
void expect_none(const std::vector<std::string>& faults) {
  for (const std::string& f : faults) ADD_FAILURE() << f;
}

bool too_slow_here() { return case_count(10) < 10; }

TEST(Crowded, AMillionTrianglesInOneVoxel) {
  if (too_slow_here()) GTEST_SKIP() << "TEXEL_STRESS is below 1";
  Random random(20240611);
  Case made;
  made.scene = test::empty_scene();
  made.recipe = unit_recipe(V3i(4));
  for (int i = 0; i < 1000000; ++i) {
    V3d p[3];
    for (V3d& q : p) q = V3d(1, 2, 1) + point_in(random, V3d(1));
    test::add_triangle(made.scene, p[0], p[1], p[2]);
  }
  const auto begin = std::chrono::steady_clock::now();
  const Pack pack = test::bake_quietly(made.scene, made.recipe);
  const double seconds = since(begin);
  Tally tally;
  expect_none(faults_of(made, pack, tally));
  expect_none(faults_of_files(pack, made.recipe, ::testing::TempDir() + "texel_stress_crowded.texel"));
  EXPECT_GT(test::sum_of(pack.levels[0], "area"), 65504);  // more than a half float holds
  std::printf("stress crowded: a million triangles, %.0f voxel faces of surface in a voxel: %.1f s\n", test::sum_of(pack.levels[0], "area"), seconds);
}

// 17 million border voxels at 4096³ take 12 s and 2.4 GB with TEXEL_STRESS=5 or more; 1024³ else.
TEST(Crowded, OneTriangleAcrossTheGrid) {
  const int n = case_count(1) >= 5 ? 4096 : too_slow_here() ? 128 : 1024;
  Scene scene = test::empty_scene();
  test::add_triangle(scene, V3d(0.3, 0.2, 0.1) / 4096 * n, V3d(4095.6, 17.4, 31.9) / 4096 * n, V3d(2000.5, 4095.7, 4090.2) / 4096 * n);
  Case made;
  made.scene = scene;
  made.recipe = unit_recipe(V3i(n));
  // Border voxels alone: area and normals, no rays.
  made.recipe.want = {.slices = false, .density = false, .color = false, .ndf = false, .visibility = false, .material = false, .normal = true, .levels = false, .preview = false};
  const auto begin = std::chrono::steady_clock::now();
  const Pack pack = test::bake_quietly(scene, made.recipe);
  const double seconds = since(begin);
  const AreaTruth truth = area_within(scene.mesh, pack.grid);
  const double area = test::sum_of(pack.levels[0], "area");
  EXPECT_NEAR(area / static_cast<double>(truth.most), 1, 1e-7);  // floats
  std::printf("stress crowded: a triangle across %d^3: %lld border voxels, %.1f s\n", n, static_cast<long long>(pack.statistics.border_voxels), seconds);
}

// Three known voxelizers get 0, 408 and 656 voxels of this wrong at 256³.
TEST(Crowded, SphereAtAThousand) {
  if (too_slow_here()) GTEST_SKIP() << "TEXEL_STRESS is below 1";
  Scene scene = test::empty_scene();
  add_lump(scene, V3d(0), 1, 64, [](const V3d& p) {
    V3d q;
    for (int k = 0; k < 3; ++k) q[k] = std::nearbyint(p[k] * 0x1p30) * 0x1p-30;
    return q;
  });
  Recipe recipe;
  recipe.resolution = V3i(256, 256, 256);
  recipe.want = {.slices = false, .density = false, .color = false, .ndf = true, .visibility = true, .material = false, .normal = false, .levels = false, .preview = false};
  const auto with_box = [&](double at) {
    recipe.box = Box3d(V3d(at - 1), V3d(at + 1));
    return test::bake_quietly(test::transformed(scene, [&](const V3d& p) { return p + V3d(at); }), recipe);
  };
  const Pack here = with_box(0), there = with_box(1000);
  std::int64_t differ = 0, wrong = 0;
  const test::Dense a = test::dense(here.levels[0], "solid"), b = test::dense(there.levels[0], "solid"), area = test::dense(there.levels[0], "area");
  for (std::size_t i = 0; i < a.values.size(); ++i) differ += a.values[i] != b.values[i];
  for (const char* name : {"alpha", "area", "crossings"}) differ += test::dense(here.levels[0], name).values != test::dense(there.levels[0], name).values;
  EXPECT_EQ(differ, 0);
  const Scene moved = test::transformed(scene, [&](const V3d& p) { return p + V3d(1000); });
  // Every 7th row of voxels against the exact winding number.
  std::atomic<std::int64_t> asked{0}, bad{0};
  tbb::parallel_for(0, 256 * 256 / 7, [&](int row) {
    const int z = row * 7 / 256, y = row * 7 % 256;
    for (int x = 0; x < 256; x += 16) {
      const V3i v(x + z % 16, y, z);
      if (area.state(v)) continue;
      const std::optional<int> winding = winding_at(moved.mesh, there.grid.centre(v), 1e-9 * there.grid.h);
      if (!winding) continue;
      ++asked;
      bad += (*winding != 0) != (b.at(v) == 1);
    }
  });
  wrong = bad;
  EXPECT_EQ(wrong, 0);
  // And all of them against the sphere itself: a chord lies at most 1 - cos(pi/64) = 0.0012 below it, 0.16 voxel.
  std::int64_t against = 0;
  test::for_each_cell(there.grid.n, [&](const V3i& v) {
    if (!area.state(v)) against += ((there.grid.centre(v) - V3d(1000)).length() < 1) != (b.at(v) == 1);
  });
  EXPECT_EQ(against, 0);
  std::printf("stress sphere at (1000, 1000, 1000), 256^3: 0 of 16777216 voxels differ from the sphere at the origin; %lld asked, %lld wrong\n", static_cast<long long>(asked.load()), static_cast<long long>(wrong));
}

// Bubbles, each inside out as a cavity is, in a ball of many triangles: who lies in whom is asked for each.
TEST(Crowded, Foam) {
  Case made;
  made.scene = test::empty_scene();
  made.recipe = unit_recipe(V3i(32));
  add_lump(made.scene, V3d(16), 15.5, 100, [](const V3d& p) { return p; });
  const int side = 12;
  Random random(99);
  test::for_each_cell(V3i(side), [&](const V3i& c) {
    const V3d p = V3d(c) * 1.5 + V3d(7.5) + point_in(random, V3d(0.3));
    add_tetrahedron(made.scene, p, p + V3d(0.6, 0.1, 0), p + V3d(0.1, 0.7, 0.1), p + V3d(0.2, 0.1, 0.8), true);
  });
  made.solid = made.scene.mesh;
  made.disjoint = true;
  const auto begin = std::chrono::steady_clock::now();
  const Pack pack = test::bake_quietly(made.scene, made.recipe);
  const double seconds = since(begin);
  Tally tally;
  expect_none(faults_of(made, pack, tally));
  std::printf("stress crowded: %d bubbles in a ball of %zu triangles: %.1f s\n", side * side * side, made.scene.mesh.triangles.size(), seconds);
}

}  // namespace
}  // namespace texel::stress
