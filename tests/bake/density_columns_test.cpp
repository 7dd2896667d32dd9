// Light through columns and beams of densities, their volume: what compare_density says of packs that err by a known amount.
#include <tbb/global_control.h>

#include <numbers>

#include "bake/density_light.h"
#include "formats/expression.h"
#include "formats/random.h"
#include "tests/bake/density_util.h"

namespace texel::test {
namespace {

Recipe boxed(int n, const Box3d& box = Box3d(V3d(0), V3d(1))) {
  Recipe recipe = volume_recipe(n);
  recipe.box = box;
  return recipe;
}

Comparison columns_of(const Pack& pack, const Scene& scene, const Recipe& recipe, int columns, std::uint32_t seed = 0, int level = -1) {
  Report report;
  return compare_density(pack, scene, recipe, {.level = level, .voxels = 1, .columns = columns, .seed = seed}, report);
}

void set_alpha(Pack& pack, std::size_t level, const std::function<float(float)>& change) {
  for (Layer& layer : pack.levels[level].layers)
    for (Channel& channel : layer.channels)
      if (channel.name == "alpha")
        for (std::vector<float>* all : {&channel.values, &channel.tiles})
          for (float& v : *all) v = change(v);
}

// Fog of one density: the law of exponentials along columns and in all directions; then packs that are wrong by a known amount.
TEST(DensityColumns, ConstantFog) {
  const Scene scene = fog(read_expression("0.3"), 8);
  const Recipe recipe = boxed(8);
  Pack pack = bake_quietly(scene, recipe);
  const Comparison c = columns_of(pack, scene, recipe, 150);
  for (int level = 0; level < static_cast<int>(pack.levels.size()); ++level) {
    for (int axis = 0; axis < 3; ++axis) {
      const Measure m = measure_of(c, "column_rms", level, axis);
      EXPECT_LT(m.value, 1e-6) << level;  // floats: 8 of relative error 6e-8/0.7
      EXPECT_EQ(m.count, m.of);
    }
    EXPECT_LT(figure(c, "direction_rms", level), 1e-6) << level;
  }
  set_alpha(pack, 1, [](float a) { return a + 0.03f; });
  const Comparison changed = columns_of(pack, scene, recipe, 150);
  const double less = std::pow(0.49 - 0.03, 4) - std::pow(0.49, 4);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(figure(changed, "column_bias", 1, axis), less, 1e-6);  // floats
    EXPECT_NEAR(figure(changed, "column_rms", 1, axis), -less, 1e-6);
    EXPECT_LT(figure(changed, "column_rms", 0, axis), 1e-6);
  }
  // Another density is told to be another.
  const Comparison other = columns_of(bake_quietly(scene, recipe), fog(read_expression("0.5"), 8), recipe, 150);
  EXPECT_NEAR(figure(other, "column_bias", 0, 1), std::pow(0.7, 8) - std::pow(0.5, 8), 1e-6);
  EXPECT_GT(figure(other, "direction_bias", 0), 0.05);
}

// Coarse voxels that reach beyond the box: nothing is there on either side, and what the product makes of half-filled voxels is known.
TEST(DensityColumns, OuterVoxelsReachBeyondTheBox) {
  const Scene scene = fog(read_expression("0.3"), 8);
  const Recipe recipe = boxed(12, Box3d(V3d(0), V3d(1.5)));
  const Pack pack = bake_quietly(scene, recipe);
  ASSERT_EQ(pack.levels[3].grid.n, V3i(2));
  const Comparison c = columns_of(pack, scene, recipe, 150);
  const auto t = [](double voxels) { return std::pow(0.7, voxels); };
  double bias = 0;  // columns of 8 voxels and 4, of which one, a half or a quarter is in the box
  for (const double share : {1.0, 0.5, 0.5, 0.25}) bias += ((1 - share * (1 - t(8))) * (1 - share * (1 - t(4))) - (1 - share * (1 - t(12)))) / 4;
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(figure(c, "column_bias", 3, axis), bias, 1e-6);  // floats; of 16 × 16 rays half of each row are in the box
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(figure(c, "column_rms", 2, axis), 1e-6);
  // Single voxels likewise: a half and a quarter of the rays are in the box, for a half of their way.
  Report report;
  const Comparison voxels = compare_density(pack, scene, recipe, {.voxels = 1000, .columns = 1}, report);
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(figure(voxels, "alpha_max", 3, axis), 1e-6);  // floats
}

TEST(DensityColumns, LinearRamp) {
  // Scale 2: light along y at x is (0.9 − 0.6x)². Along x every column has the closed form, and the bake has it, too.
  const Scene scene = fog(read_expression("0.1 + 0.6*x"), 2);
  const Recipe recipe = boxed(8);
  const Pack pack = bake_quietly(scene, recipe);
  const Comparison c = columns_of(pack, scene, recipe, 1000, 0, 0);
  // A ray's depth has a variance of at most 64·(4/64/64)²/12, light at most e^-1 of it; 256 rays a column; half the variance is the bias.
  const double variance = 64 * std::pow(4.0 / 64 / 64, 2) / 12;
  EXPECT_LT(figure(c, "column_rms", 0, 0), 1.2 * std::sqrt(variance / 256 + variance * variance / 4));
  const Dense alpha = dense(pack.levels[0], "alpha");
  double bias = 0;
  for (int x = 0; x < 8; ++x) {
    double product = 1;
    for (int y = 0; y < 8; ++y) product *= 1 - static_cast<double>(alpha.at(V3i(x, y, 3), 1));
    const auto cube = [](double at) { return -std::pow(0.9 - 0.6 * at, 3) / 1.8; };  // ∫ (0.9 − 0.6x)²
    bias += (product - (cube((x + 1) / 8.0) - cube(x / 8.0)) * 8) / 8;
  }
  EXPECT_LT(bias, -2e-5);  // what neighbours hide alike; it has to be found, not 0
  // A ray's place in its sixteenth of a voxel changes its light by at most 1.08/128; 256 rays, 64 columns: four deviations.
  EXPECT_NEAR(figure(c, "column_bias", 0, 1), bias, 4 * 1.08 / 128 / std::sqrt(12.0 * 256 * 64));
}

// Beams through a ball of one density, of a pack that lets all light through: what is said to be missing is the mean light of lines through random places of the pack's voxels,
// worked out by chords. The interval of 95 % holds it in 95 % of the samples, and that of columns likewise.
TEST(DensityColumns, IntervalsHoldForABall) {
  const double radius = 0.8, c = 3, mu = c * std::numbers::ln2;
  const Scene scene = fog(read_expression("0.5*step(x^2 + y^2 + z^2, 0.64)"), c);
  const Recipe recipe = boxed(16, Box3d(V3d(-1), V3d(1)));
  Pack pack = bake_quietly(scene, recipe);
  set_alpha(pack, 0, [](float) { return 0.0f; });
  std::vector<V3i> matter;
  const Dense alpha = dense(pack.levels[0], "alpha");
  for_each_cell(alpha.n, [&](const V3i& v) {
    if (alpha.state(v)) matter.push_back(v);
  });
  RandomSequence random(5);
  constexpr int kLines = 400000;
  double beams = 0;
  for (int i = 0; i < kLines; ++i) {
    const V3i v = matter[static_cast<std::size_t>(random.next() * static_cast<double>(matter.size()))];
    const V3d along = random_direction(random), side = along.cross(std::abs(along.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized();
    const double x = random.next(), y = random.next(), z = random.next(), u = random.next() - 0.5, w = random.next() - 0.5;
    // A beam is square about a random axis; which way it is turned about it does not matter to a ball.
    const V3d at = pack.grid.to_world(V3d(v) + V3d(x, y, z) + side * u + along.cross(side) * w);
    beams += std::exp(-mu * chord(at, along, radius)) / kLines;
  }
  std::vector<char> columns(256, 0);
  for (const V3i& v : matter) columns[static_cast<std::size_t>(v.z * 16 + v.y)] = 1;
  double along_x = 0, count = 0;
  for (int k = 0; k < 256; ++k) {
    if (!columns[static_cast<std::size_t>(k)]) continue;
    constexpr int kEdge = 32;
    for (int p = 0; p < kEdge * kEdge; ++p) {
      const V3d at = pack.grid.to_world(V3d(0, k % 16 + (p % kEdge + 0.5) / kEdge, k / 16 + (p / kEdge + 0.5) / kEdge));  // NOLINT: whole rows
      along_x += std::exp(-mu * chord(at, V3d(1, 0, 0), radius)) / (kEdge * kEdge);
    }
    ++count;
  }
  along_x /= count;
  int beams_held = 0, columns_held = 0;
  constexpr std::uint32_t kSeeds = 40;
  for (std::uint32_t seed = 0; seed < kSeeds; ++seed) {
    const Comparison found = columns_of(pack, scene, recipe, 60, seed, 0);
    const Measure d = measure_of(found, "direction_bias", 0), x = measure_of(found, "column_bias", 0, 0);
    beams_held += d.low <= 1 - beams && 1 - beams <= d.high;
    columns_held += x.low <= 1 - along_x && 1 - along_x <= x.high;
    EXPECT_EQ(d.count, 60);
    EXPECT_EQ(x.count, 60);
    EXPECT_EQ(x.of, static_cast<std::int64_t>(count));
  }
  std::printf("ball: beams pass %.4f, columns %.4f; held by %d and %d of %u intervals\n", beams, along_x, beams_held, columns_held, kSeeds);
  EXPECT_GE(beams_held, 34);  // fewer of 40 at 95 %: in one of 700 runs
  EXPECT_GE(columns_held, 34);
}

// The product of opacities is the pack's own; what columns say is its error against the ball's chords, whichever columns are drawn.
TEST(DensityColumns, ErrorOfTheBallItself) {
  const double radius = 0.8, c = 3, mu = c * std::numbers::ln2;
  const Scene scene = fog(read_expression("0.5*step(x^2 + y^2 + z^2, 0.64)"), c);
  const Recipe recipe = boxed(16, Box3d(V3d(-1), V3d(1)));
  const Pack pack = bake_quietly(scene, recipe);
  const Comparison all = columns_of(pack, scene, recipe, 1000, 0, 0);
  const Dense alpha = dense(pack.levels[0], "alpha");
  double square = 0, sum = 0, count = 0;
  for (int z = 0; z < 16; ++z)
    for (int y = 0; y < 16; ++y) {
      double product = 1, truth = 0;
      bool any = false;
      for (int x = 0; x < 16; ++x) {
        any = any || alpha.state(V3i(x, y, z));
        product *= 1 - static_cast<double>(alpha.at(V3i(x, y, z), 0));
      }
      if (!any) continue;
      constexpr int kEdge = 64;
      for (int p = 0; p < kEdge * kEdge; ++p)
        truth += std::exp(-mu * chord(pack.grid.to_world(V3d(0, y + (p % kEdge + 0.5) / kEdge, z + (p / kEdge + 0.5) / kEdge)), V3d(1, 0, 0), radius)) / (kEdge * kEdge);  // NOLINT: whole rows
      sum += product - truth;
      square += (product - truth) * (product - truth);
      ++count;
    }
  // A ray ends within a step of the ball's surface on either side: a variance of depth of 2·(step·μ)²/12 at most, over 256 rays; their places in the column add less.
  const double ray = 2 * mu / 8 / kLightSteps / std::sqrt(6.0), column = ray / 16;
  EXPECT_EQ(measure_of(all, "column_rms", 0, 0).of, static_cast<std::int64_t>(count));
  EXPECT_NEAR(figure(all, "column_bias", 0, 0), sum / count, 4 * column / std::sqrt(count) + ray * ray / 2);
  EXPECT_NEAR(std::pow(figure(all, "column_rms", 0, 0), 2), square / count, 4 * column * std::sqrt(square / count / count) + 2 * column * column);
}

// The box cuts opaque matter at a wall of voxels: columns are all or nothing, and nothing is left out.
TEST(DensityColumns, CutMatter) {
  const Scene scene = fog(read_expression("step(z, 0.5)"), 1);
  const Recipe recipe = boxed(8);
  const Pack pack = bake_quietly(scene, recipe);
  const Comparison c = columns_of(pack, scene, recipe, 200);
  for (const Skip& s : c.skipped) ADD_FAILURE() << s.what;
  for (int axis = 0; axis < 3; ++axis) EXPECT_LT(figure(c, "column_rms", 0, axis), 1e-15);  // depths end at 40
  // Full voxels are opaque in all directions. Left are the ramp of half a sample that the bake makes of a step, and beams through a corner of the slab shorter than the truth's places are apart
  // (an eighth of an edge): over 2000 beams -0.0009 of 2 samples an edge, -0.0007 of 16. Were the corner's voxels opaque along the axes alone it would be +0.011.
  EXPECT_NEAR(figure(c, "direction_bias", 0), 0, 0.003);
  for (int level = 0; level < static_cast<int>(pack.levels.size()); ++level) EXPECT_NEAR(figure(c, "volume_relative", level), 0, 0.005) << level;
}

// Half a period on, the same ball is cut into eight by the box. Columns and volume are those of the whole one.
TEST(DensityColumns, CyclicIsTheSameMatter) {
  const char* ball = "1.6*(1 - 8*(x^2 + y^2 + z^2))";
  std::vector<Comparison> found;
  for (const double low : {-0.5, 0.0}) {
    Recipe recipe = boxed(16, Box3d(V3d(low), V3d(low + 1)));
    recipe.cyclic = {true, true, true};
    const Scene scene = fog(read_expression(ball), 6);
    found.push_back(columns_of(bake_quietly(scene, recipe), scene, recipe, 256));
  }
  for (const int level : {0, 1, 2}) {
    for (int axis = 0; axis < 3; ++axis) {
      // The same columns in another order, with other rays: their 256 leave an error of about 0.005 each, of which 60 and more have the mean.
      EXPECT_NEAR(figure(found[0], "column_bias", level, axis), figure(found[1], "column_bias", level, axis), 0.002) << level;
      EXPECT_NEAR(figure(found[0], "column_rms", level, axis), figure(found[1], "column_rms", level, axis), 0.002) << level;
    }
    EXPECT_LT(figure(found[1], "column_rms", 0, 0), 0.05);
    const Measure whole = measure_of(found[0], "volume_relative", level), cut = measure_of(found[1], "volume_relative", level);
    EXPECT_LT(std::max(whole.low, cut.low), std::min(whole.high, cut.high)) << level;  // the same solid, two samples of its volume
  }
}

TEST(DensityColumns, SameFiguresOnAnyNumberOfThreads) {
  const Scene scene = density_preset("fur");
  const Recipe recipe = volume_recipe(16);
  const Pack pack = bake_quietly(scene, recipe);
  const Comparison many = columns_of(pack, scene, recipe, 20);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Comparison alone = columns_of(pack, scene, recipe, 20);
  expect_same_figures(many, alone);
  EXPECT_NE(figure(columns_of(pack, scene, recipe, 20, 1), "direction_bias", 0), figure(many, "direction_bias", 0));  // the seed draws others
}

}  // namespace
}  // namespace texel::test
