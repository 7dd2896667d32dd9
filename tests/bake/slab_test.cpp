// A grid baked in slabs is the grid baked in one.
#include <gtest/gtest.h>

#include <random>

#include "bake/bake.h"
#include "bake/slabs.h"
#include "tests/bake/bake_util.h"
#include "tests/bake/made_scene.h"

namespace texel::test {
namespace {

double count_of(const Report& report, const std::string& name) {
  for (const auto& [what, value] : report.counts)
    if (what == name) return value;
  return 0;
}

void expect_same_set(const VoxelSet& a, const VoxelSet& b) {
  ASSERT_EQ(a.count, b.count);
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (std::size_t i = 0; i < a.blocks.size(); ++i) {
    ASSERT_EQ(a.blocks[i].at, b.blocks[i].at);
    ASSERT_EQ(a.blocks[i].mask, b.blocks[i].mask);
    ASSERT_EQ(a.blocks[i].first, b.blocks[i].first);
  }
}

// Every grid of every level, every picture and every figure, to the bit.
void expect_same_packs(const Pack& a, const Pack& b) {
  ASSERT_EQ(a.levels.size(), b.levels.size());
  for (std::size_t l = 0; l < a.levels.size(); ++l) {
    SCOPED_TRACE("level " + std::to_string(l));
    ASSERT_EQ(a.levels[l].layers.size(), b.levels[l].layers.size());
    for (std::size_t i = 0; i < a.levels[l].layers.size(); ++i) {
      const Layer &p = a.levels[l].layers[i], &q = b.levels[l].layers[i];
      expect_same_set(p.set, q.set);
      EXPECT_EQ(p.tiles, q.tiles);
      ASSERT_EQ(p.channels.size(), q.channels.size());
      for (std::size_t c = 0; c < p.channels.size(); ++c) {
        EXPECT_EQ(p.channels[c].name, q.channels[c].name);
        EXPECT_EQ(p.channels[c].full_float, q.channels[c].full_float);
        EXPECT_EQ(p.channels[c].values, q.channels[c].values) << p.channels[c].name;
        EXPECT_EQ(p.channels[c].tiles, q.channels[c].tiles) << p.channels[c].name;
      }
    }
  }
  ASSERT_EQ(a.slices.size(), b.slices.size());
  for (std::size_t s = 0; s < a.slices.size(); ++s) {
    ASSERT_EQ(a.slices[s].count, b.slices[s].count);
    for (int k = 0; k < a.slices[s].count; ++k) EXPECT_EQ(a.slices[s].image(k).pixels, b.slices[s].image(k).pixels) << "slice " << k << " along axis " << a.slices[s].axis;
  }
  ASSERT_EQ(a.errors.size(), b.errors.size());
  for (std::size_t e = 0; e < a.errors.size(); ++e) EXPECT_EQ(a.errors[e].value, b.errors[e].value) << a.errors[e].measure;
  EXPECT_EQ(a.statistics.border_voxels, b.statistics.border_voxels);
  EXPECT_EQ(a.statistics.inside_voxels, b.statistics.inside_voxels);
  EXPECT_EQ(a.statistics.covered_area, b.statistics.covered_area);
  EXPECT_EQ(a.statistics.mean_color, b.statistics.mean_color);
  EXPECT_EQ(a.skipped.size(), b.skipped.size());
}

// A red ball that holds a blue one, and a green sheet through both: matter, matter within matter, open surface, three colours.
Scene balls_and_sheet() {
  Scene scene = empty_scene();
  scene.materials[0].kd = V3f(0.8f, 0.1f, 0.1f);
  for (const V3f& kd : {V3f(0.1f, 0.2f, 0.9f), V3f(0.2f, 0.7f, 0.1f)}) scene.materials.emplace_back().kd = kd;
  add_ball(scene, 1, 48);
  add_ball(scene, 0.6, 24, 1);
  add_quad(scene, V3d(-1.1, -1.0, -0.9), V3d(2.2, 0.1, 0.3), V3d(0.2, 2.0, 1.5), 2);
  return scene;
}

Recipe whole_recipe(int resolution) {
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.want.preview = false;
  return recipe;
}

// At the least memory a slab holds 2^16 voxels: 150 voxels are cut into two or three.
void expect_slabs_change_nothing(const Scene& scene, Recipe recipe) {
  Report one, many;
  recipe.memory = std::int64_t{64} << 30;
  const Pack whole = bake(scene, recipe, one);
  recipe.memory = 1;
  const Pack cut = bake(scene, recipe, many);
  EXPECT_EQ(count_of(one, "slabs"), 0);
  EXPECT_GT(count_of(many, "slabs"), 1);
  for (const char* axis : {"x", "y", "z"}) EXPECT_EQ(count_of(one, std::string("crossings along ") + axis), count_of(many, std::string("crossings along ") + axis));
  expect_same_packs(whole, cut);
}

TEST(Slabs, ChangeNothing) { expect_slabs_change_nothing(balls_and_sheet(), whole_recipe(150)); }

TEST(Slabs, ChangeNothingWhereLevelsAreFiltered) {
  Recipe recipe = whole_recipe(150);
  recipe.level_mode = LevelMode::kFilter;
  expect_slabs_change_nothing(balls_and_sheet(), recipe);
}

TEST(Slabs, ChangeNothingOfVisibleNormals) {
  Recipe recipe = whole_recipe(150);
  recipe.normals = Normals::kVisible;
  recipe.want.slices = false;
  expect_slabs_change_nothing(balls_and_sheet(), recipe);
}

TEST(Slabs, ChangeNothingOfLobes) {
  Recipe recipe = whole_recipe(150);
  recipe.lobes = 2;
  recipe.want.slices = false;
  expect_slabs_change_nothing(balls_and_sheet(), recipe);
}

TEST(Slabs, ChangeNothingOfVisibleMaterial) {
  for (const LevelMode mode : {LevelMode::kRecompute, LevelMode::kFilter}) {
    Recipe recipe = whole_recipe(150);
    recipe.material = MaterialOf::kVisible;
    recipe.level_mode = mode;
    recipe.want.slices = false;
    Scene scene = balls_and_sheet();
    scene.materials[1].ks = V3f(0.5f);
    scene.materials[1].roughness = 0.2f;
    expect_slabs_change_nothing(scene, recipe);
  }
}

// The rays enter the box inside matter, and their share of it is handed from slab to slab.
TEST(Slabs, ChangeNothingOfCutMatter) {
  Recipe recipe = whole_recipe(170);
  recipe.box = Box3d(V3d(-0.9, -0.9, -0.8), V3d(0.95, 0.95, 1.05));
  expect_slabs_change_nothing(balls_and_sheet(), recipe);
}

TEST(Slabs, ChangeNothingOfThickAndThinSlices) {
  for (const int count : {37, 311}) {
    Recipe recipe = whole_recipe(150);
    recipe.slice_count = count;
    recipe.want = {.slices = true, .density = false, .color = false, .ndf = false, .visibility = false, .material = false, .normal = false, .levels = false, .preview = false};
    expect_slabs_change_nothing(balls_and_sheet(), recipe);
  }
}

// Slabs may have no surface at all.
TEST(Slabs, ChangeNothingWhereThereIsNothing) {
  Scene scene = empty_scene();
  add_ball(scene, 1, 48);
  const std::size_t points = scene.mesh.points.size();
  add_ball(scene, 1, 48);
  for (std::size_t i = points; i < scene.mesh.points.size(); ++i) scene.mesh.points[i].z += 6;
  Recipe recipe = whole_recipe(700);
  recipe.want.slices = false;
  recipe.levels = 6;
  expect_slabs_change_nothing(scene, recipe);
}

// Vol(K ⊕ cube) is the mean number of voxels that a convex piece at a random place meets.
TEST(Slabs, ExpectedVoxels) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(0, 1);
  const auto point = [&] { return V3d(any(random), any(random), any(random)); };
  const V3d a = point() * 5, b = point() * 5, c = point() * 5;
  double met = 0, square = 0, expected = 0;
  constexpr int kTimes = 4000;
  for (int i = 0; i < kTimes; ++i) {
    Scene scene = empty_scene();
    const V3d shift = V3d(4, 4, 4) + point();
    scene.mesh.points = {a + shift, b + shift, c + shift};
    scene.mesh.triangles = {{0, 1, 2}};
    scene.mesh.uv_corners = {{kNoIndex, kNoIndex, kNoIndex}};
    scene.mesh.materials = {0};
    Recipe recipe;
    recipe.resolution = V3i(16, 16, 16);
    recipe.box = Box3d(V3d(0, 0, 0), V3d(16, 16, 16));
    const auto stages = run_stages(scene, recipe, false, 1);
    const auto count = static_cast<double>(stages->surfaces[0].set.count);
    met += count / kTimes;
    square += count * count / kTimes;
    expected = expected_voxels(stages->scene, stages->plan);
  }
  const double error = std::sqrt((square - met * met) / kTimes);
  EXPECT_NEAR(met, expected, 4 * error);  // four standard errors of the mean: one seed in 16 000 would fail
  EXPECT_LT(error, 0.02 * expected);
}

}  // namespace
}  // namespace texel::test
