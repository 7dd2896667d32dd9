// Stage 2 and the pack's sums against the mesh itself: area at every level, filled volume.
#include <algorithm>
#include <numbers>

#include "formats/read_pack.h"
#include "formats/write.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

std::vector<std::string> all_models() {
  std::vector<std::string> found;
  const std::filesystem::path root = std::string(TEXEL_SHARED_DATA) + "/models";
  if (!std::filesystem::exists(root)) return found;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    const std::string extension = entry.path().extension();
    if (extension == ".obj" || extension == ".off" || extension == ".ply" || extension == ".stl") found.push_back(std::filesystem::relative(entry.path(), root));
  }
  std::sort(found.begin(), found.end());
  return found;
}

TEST(Area, EveryModelAtEveryLevel) {
  const auto models = all_models();
  if (models.empty()) GTEST_SKIP() << "not there: " << TEXEL_SHARED_DATA << "/models";
  double worst_pack = 0, worst_exact = 0, worst_world = 0;
  int levels = 0;
  for (const std::string& name : models) {
    SCOPED_TRACE(name);
    Scene scene;
    std::string reason;
    ASSERT_TRUE(load_model(name, scene, reason)) << reason;
    Recipe recipe = volume_recipe(64);
    recipe.want = {};
    recipe.want.slices = recipe.want.density = recipe.want.color = recipe.want.ndf = recipe.want.visibility = recipe.want.material = recipe.want.preview = false;
    const double truth = mesh_area(scene.mesh);
    const Pack pack = bake_quietly(scene, recipe);
    ASSERT_GE(pack.levels.size(), 7u);
    EXPECT_EQ(pack.levels.back().grid.n, V3i(1, 1, 1));
    for (const Level& level : pack.levels) {
      const double error = sum_of(level, "area") * level.grid.h * level.grid.h / truth - 1;
      // Each voxel's area is rounded to float, relative 2⁻²⁴; their signs differ, so a sum is off by far less than this.
      EXPECT_LE(std::abs(error), 1e-6) << "voxel edge " << level.grid.h;
      worst_pack = std::max(worst_pack, std::abs(error));
      ++levels;
    }
    // The moments before rounding: scaled rounding of some 10⁵ additions of doubles.
    const auto stages = run_stages(scene, recipe, false);
    Mesh placed = scene.mesh;
    placed.points = stages->plan.points;
    for (const Surface& surface : stages->surfaces) {
      double sum = 0;
      for (const Areas& a : surface.areas) sum += a.area;
      const double error = sum / mesh_area(placed) - 1, world = sum * std::pow(stages->plan.grid.h, 2) / truth - 1;
      EXPECT_LE(std::abs(error), 1e-12);
      // Points within 2⁻³⁰ voxel of a wall were put on it.
      EXPECT_LE(std::abs(world), 1e-9);
      worst_exact = std::max(worst_exact, std::abs(error));
      worst_world = std::max(worst_world, std::abs(world));
    }
  }
  std::printf("area: %zu models, %d levels: worst relative error %.2g in the pack, %.2g before rounding (%.2g against the file's own points)\n", models.size(), levels,
              worst_pack, worst_exact, worst_world);
}

TEST(Area, SurvivesWritingAndReading) {
  double worst = 0;
  for (const char* name : {"spot/spot_triangulated.obj", "bunny_closed.off", "fuze/fuze.obj", "stanford_bunny.obj"}) {
    SCOPED_TRACE(name);
    Scene scene;
    std::string reason;
    if (!load_model(name, scene, reason)) GTEST_SKIP() << reason;
    Recipe recipe = volume_recipe(64);
    recipe.write.full_float = true;
    const double truth = mesh_area(scene.mesh);
    const std::string folder = ::testing::TempDir() + "texel_area_test.pack";
    Report report;
    write_pack(bake(scene, recipe, report), folder, recipe.write, report);
    const Pack pack = read_pack(folder);
    std::filesystem::remove_all(folder);
    ASSERT_GE(pack.levels.size(), 7u);
    for (const Level& level : pack.levels) {
      const double error = sum_of(level, "area") * level.grid.h * level.grid.h / truth - 1;
      EXPECT_LE(std::abs(error), 1e-6);  // as above: the file holds the same floats
      worst = std::max(worst, std::abs(error));
    }
  }
  std::printf("area read back from files: worst relative error %.2g\n", worst);
}

// Σ of the moments over a closed surface: ∫ n dA = 0, and trace ∫ n nᵀ dA = A.
TEST(Area, MomentsIdentities) {
  double worst_m = 0, worst_trace = 0;
  for (const std::string& name : closed_models()) {
    SCOPED_TRACE(name);
    Scene scene;
    std::string reason;
    if (!load_model(name, scene, reason)) GTEST_SKIP() << reason;
    const auto s = run_stages(scene, volume_recipe(64), false);
    Moments all;
    for (const Moments& m : s->surfaces[0].moments) {
      EXPECT_LE(std::abs(m.xx + m.yy + m.zz - m.covered), 1e-12 * m.covered + 1e-300);  // rounding of unit normals
      EXPECT_LE(m.m.length(), m.covered * (1 + 1e-12));
      all += m;
    }
    EXPECT_LE(all.m.length() / all.covered, 1e-12);  // rounding of the sum
    worst_m = std::max(worst_m, all.m.length() / all.covered);
    worst_trace = std::max(worst_trace, std::abs(all.xx + all.yy + all.zz - all.covered) / all.covered);
  }
  std::printf("closed models: |sum of A n| / A at most %.2g, |trace - A| / A at most %.2g\n", worst_m, worst_trace);
}

TEST(Volume, FilledVolumeIsTheMeshes) {
  double worst = 0;
  for (const std::string& name : closed_models()) {
    SCOPED_TRACE(name);
    Scene scene;
    std::string reason;
    if (!load_model(name, scene, reason)) GTEST_SKIP() << reason;
    Recipe recipe = volume_recipe(128);
    recipe.want.color = recipe.want.ndf = recipe.want.material = recipe.want.normal = recipe.want.levels = false;
    const Pack pack = bake_quietly(scene, recipe);
    const double truth = mesh_volume(scene.mesh), error = filled_volume(pack) / truth - 1;
    // 48 chords a voxel over some 10⁴ border voxels: statistical, measured below 5e-5.
    EXPECT_LE(std::abs(error), 1e-4);
    EXPECT_NEAR(pack.statistics.volume / truth, 1, 1e-9);  // rounding, and points put on walls
    std::printf("volume %-28s relative error %+.2e\n", name.c_str(), error);
    worst = std::max(worst, std::abs(error));
  }
  std::printf("volume: worst relative error %.2g\n", worst);
}

}  // namespace
}  // namespace texel::test
