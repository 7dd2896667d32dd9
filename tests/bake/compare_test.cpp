// What `texel compare` measures: packs changed by a known amount, and geometry whose truth is known on paper.
#include <tbb/global_control.h>

#include <numbers>

#include "bake/compare_columns.h"
#include "bake/compare_sums.h"
#include "bake/compare_views.h"
#include "bake/truth_voxels.h"
#include "formats/error.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

constexpr double kPi = std::numbers::pi;

Scene ball_scene(double radius, int rings) {
  Scene scene = empty_scene();
  add_ball(scene, radius, rings);
  return scene;
}
Recipe boxed(const Box3d& box, int n) {
  Recipe recipe = volume_recipe(n);
  recipe.box = box;
  return recipe;
}
// The one figure of that name, level and axis.
double figure(const Comparison& c, const std::string& name, int level = 0, int axis = -1, int view = -1) {
  const Measure* found = nullptr;
  for (const Measure& m : c.measures)
    if (m.name == name && m.level == level && m.axis == axis && m.view == view) {
      EXPECT_EQ(found, nullptr) << name << " twice";
      found = &m;
    }
  if (!found) {
    ADD_FAILURE() << "no " << name << " at level " << level << ", axis " << axis;
    return std::nan("");
  }
  EXPECT_LE(found->low, found->value) << name;
  EXPECT_GE(found->high, found->value) << name;
  return found->value;
}
Comparison against(const Pack& a, const Pack& b) {
  Report report;
  return compare_packs(a, b, {}, report);
}
Channel& channel(Pack& pack, std::size_t level, const std::string& name) {
  for (Layer& l : pack.levels[level].layers)
    for (Channel& c : l.channels)
      if (c.name == name) return c;
  ADD_FAILURE() << "no grid " << name;
  static Channel none;
  return none;
}

TEST(ComparePacks, ItselfIsTheSame) {
  Scene scene = ball_scene(1, 12);
  Recipe recipe = volume_recipe(24);
  recipe.want.slices = true;
  const Pack pack = bake_quietly(scene, recipe);
  const Comparison same = against(pack, pack);
  EXPECT_TRUE(same.skipped.empty());
  EXPECT_GT(same.measures.size(), 100u);
  for (const Measure& m : same.measures) {
    ASSERT_NE(find_measure(m.name), nullptr) << m.name;
    EXPECT_LE(std::abs(m.value), m.name.starts_with("axis_angle") ? 1e-12 : 0.0) << m.name << " at level " << m.level;  // scaled rounding; exact
  }
}

TEST(ComparePacks, KnownChanges) {
  const Scene scene = ball_scene(1, 12);
  const Pack old = bake_quietly(scene, volume_recipe(24));
  {
    SCOPED_TRACE("alpha along z less by 1/16 wherever it is at least that");
    Pack pack = old;
    Channel& alpha = channel(pack, 0, "alpha");
    std::int64_t count = 0, border = 0;
    for (std::size_t i = 0; i < alpha.values.size(); i += 3) {
      const bool inside = alpha.values[i] == 1 && alpha.values[i + 1] == 1 && alpha.values[i + 2] == 1;
      border += !inside;
      if (inside || alpha.values[i + 2] < 0.0625f) continue;
      alpha.values[i + 2] -= 0.0625f;
      ++count;
    }
    const Comparison c = against(pack, old);
    const double share = static_cast<double>(count) / static_cast<double>(border);
    EXPECT_NEAR(figure(c, "alpha_bias", 0, 2), -0.0625 * share, 1e-7);  // float
    EXPECT_NEAR(figure(c, "alpha_rms", 0, 2), 0.0625 * std::sqrt(share), 1e-7);
    EXPECT_NEAR(figure(c, "alpha_max", 0, 2), 0.0625, 1e-7);
    EXPECT_EQ(figure(c, "alpha_rms", 0, 0), 0);
    EXPECT_EQ(figure(c, "alpha_rms", 1, 2), 0);
    EXPECT_GT(figure(c, "column_rms", 0, 2), 0);
    EXPECT_EQ(figure(c, "column_rms", 0, 0), 0);
    EXPECT_EQ(figure(c, "sigma_rms"), 0);
  }
  {
    SCOPED_TRACE("half as much again of area, colours, density");
    Pack pack = old;
    for (float& v : channel(pack, 0, "area").values) v *= 1.5f;
    for (float& v : channel(pack, 0, "Cd").values) v += 0.25f;
    for (float& v : channel(pack, 0, "Cd").tiles) v += 0.25f;
    for (float& v : channel(pack, 0, "density").values) v += 0.5f;
    for (float& v : channel(pack, 0, "density").tiles) v += 0.5f;
    double mean = 0, square = 0;
    for (const float v : channel(pack, 0, "area").values) {
      const double was = static_cast<double>(v) / 1.5, n = static_cast<double>(channel(pack, 0, "area").values.size());
      mean += was / n;
      square += was * was / n;
    }
    const Comparison c = against(pack, old);
    EXPECT_NEAR(figure(c, "area_relative"), 0.5, 1e-6);
    EXPECT_NEAR(figure(c, "area_rms"), 0.5 * std::sqrt(square) / mean, 1e-6);
    // σ = A/2 · shape: half as much again in every direction, and its mean square over directions for a given shape at least the mean's.
    EXPECT_GE(figure(c, "sigma_rms"), 0.5 * std::sqrt(square) / mean - 1e-3);
    EXPECT_NEAR(figure(c, "color_rms"), 0.25, 1e-6);
    EXPECT_NEAR(figure(c, "color_max"), 0.25, 1e-6);
    EXPECT_NEAR(figure(c, "depth_rms"), 0.5 * old.grid.h, 1e-5);
    EXPECT_EQ(figure(c, "area_relative", 1), 0);
  }
  {
    SCOPED_TRACE("one block less");
    Pack pack = old;
    Layer* matter = nullptr;
    for (Layer& l : pack.levels[0].layers)
      if (l.channels[0].name == "density") matter = &l;
    ASSERT_NE(matter, nullptr);
    const Block block = matter->set.blocks.back();
    matter->set.blocks.pop_back();
    const int lost = count_voxels(block.mask);
    matter->set.count -= lost;
    for (Channel& c : matter->channels) c.values.resize(static_cast<std::size_t>(matter->set.count * c.components));
    EXPECT_EQ(figure(against(pack, old), "voxels_missing"), lost);
    EXPECT_EQ(figure(against(pack, old), "voxels_extra"), 0);
    EXPECT_EQ(figure(against(old, pack), "voxels_extra"), lost);
  }
}

TEST(ComparePacks, TurnedSheet) {
  // A sheet whose normal is turned by 10 degrees in the pack alone.
  Scene scene = empty_scene();
  add_quad(scene, {-1, -1, 0.03}, {2, 0, 0}, {0, 2, 0});
  const Recipe recipe = boxed(Box3d(V3d(-1.01, -1.01, -1.01), V3d(1.01, 1.01, 1.01)), 16);
  const Pack old = bake_quietly(scene, recipe);
  Pack pack = old;
  const double a = 10 * kPi / 180;
  for (std::size_t i = 0; i < channel(pack, 0, "S_diag").values.size(); i += 3) {
    float *d = &channel(pack, 0, "S_diag").values[i], *o = &channel(pack, 0, "S_off").values[i], *n = &channel(pack, 0, "normal").values[i];
    d[0] = static_cast<float>(std::sin(a) * std::sin(a));
    d[1] = 0;
    d[2] = static_cast<float>(std::cos(a) * std::cos(a));
    o[0] = o[2] = 0;
    o[1] = static_cast<float>(std::sin(a) * std::cos(a));
    n[0] = static_cast<float>(std::sin(a));
    n[1] = 0;
    n[2] = static_cast<float>(std::cos(a));
  }
  const Comparison c = against(pack, old);
  EXPECT_NEAR(figure(c, "axis_angle_rms"), 10, 1e-5);  // float
  EXPECT_NEAR(figure(c, "axis_angle_max"), 10, 1e-5);
  EXPECT_NEAR(figure(c, "normal_rms"), 2 * std::sin(a / 2), 1e-6);
  EXPECT_EQ(figure(c, "alpha_rms", 0, 2), 0);
}

TEST(ComparePacks, SlicesAndWhatIsMissing) {
  Scene scene = ball_scene(1, 8);
  Recipe recipe = volume_recipe(12);
  recipe.want.slices = true;
  const Pack old = bake_quietly(scene, recipe);
  Pack pack = old;
  const SliceStack stack = old.slices[2];
  pack.slices[2].image = [stack](int k) {
    Image image = stack.image(k);
    for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = k == 0 ? 1.0f - image.pixels[i] : image.pixels[i];
    return image;
  };
  const Comparison c = against(pack, old);
  const Image first = old.slices[2].image(0);
  double square = 0;
  for (std::size_t i = 3; i < first.pixels.size(); i += 4) square += std::pow(1 - 2 * static_cast<double>(first.pixels[i]), 2);
  EXPECT_NEAR(figure(c, "slice_alpha_rms", 0, stack.axis), std::sqrt(square / (static_cast<double>(first.pixels.size()) / 4 * stack.count)), 1e-6);
  EXPECT_EQ(figure(c, "slice_alpha_rms", 0, old.slices[0].axis), 0);

  pack.slices.pop_back();
  pack.levels.pop_back();
  EXPECT_EQ(against(pack, old).skipped.size(), 2u);
  Pack moved = old;
  moved.grid.origin.x += 0.5 * moved.grid.h;
  EXPECT_THROW((void)against(moved, old), Error);
}

TEST(CompareSums, IntervalsHold) {
  // 300 of 3000 errors, 400 times: the interval of 95 % holds the truth about 380 times; below 360 has a chance under 1e-5 for a right interval.
  Random random(7);
  std::vector<double> all(3000);
  double sum = 0, square = 0;
  for (double& e : all) {
    e = random.uniform() < 0.3 ? random.uniform(-0.1, 0.2) : random.uniform(-0.01, 0.01);
    sum += e;
    square += e * e;
  }
  const double bias = sum / 3000, rms = std::sqrt(square / 3000);
  int bias_held = 0, rms_held = 0;
  double width = 0;
  for (int trial = 0; trial < 400; ++trial) {
    ErrorSums s;
    std::vector<double> left = all;
    for (int i = 0; i < 300; ++i) {
      const auto at = static_cast<std::size_t>(random.uniform() * static_cast<double>(left.size()));
      s.add(left[at]);
      left[at] = left.back();
      left.pop_back();
    }
    const Measure b = s.bias("alpha_bias", 3000), r = s.rms("alpha_rms", 3000);
    bias_held += b.low <= bias && bias <= b.high;
    rms_held += r.low <= rms && rms <= r.high;
    width += (r.high - r.low) / 400;
    EXPECT_TRUE(std::isinf(s.max("alpha_max", 3000).high));
  }
  EXPECT_GE(bias_held, 360);
  EXPECT_GE(rms_held, 360);
  EXPECT_LE(width, 0.5 * rms);  // and is of use
  ErrorSums everything;
  for (const double e : all) everything.add(e);
  EXPECT_EQ(everything.rms("alpha_rms").low, everything.rms("alpha_rms").high);
}

TEST(CompareSums, DistributionsHaveTheirOwnMeans) {
  // The mean projected area is A/2, and densities have the integral 1, whatever stands for the normals; half_sphere's quadrature 1e-3.
  const std::vector<V3d> directions = half_sphere(2000);
  std::vector<double> sigma(directions.size()), density(directions.size());
  std::vector<VoxelNdf> all;
  Symmetric s;  // two alike: Ratib's of three different ones spreads along a plane and has another axis
  add_outer(s, V3d(0.6, 0.8, 0), 1);
  add_outer(s, V3d(0.8, -0.6, 0), 0.1);
  add_outer(s, V3d(0, 0, 1), 0.1);
  all.push_back(ndf_from_sggx(s));
  const StoredAxes neyret = neyret_axes(s), ratib = ratib_axes(s);
  all.push_back(*ndf_from_axes(NdfKind::kNeyret, neyret.axis_1, neyret.axis_2));
  all.push_back(*ndf_from_axes(NdfKind::kRatib, ratib.axis_1, ratib.axis_2));
  for (const VoxelNdf& ndf : all) {
    projected_areas(ndf, 3, directions, sigma);
    normal_density(ndf, directions, density);
    double mean = 0, integral = 0;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      mean += sigma[i] / static_cast<double>(directions.size());
      integral += density[i] * 2 * kPi / static_cast<double>(directions.size());
    }
    EXPECT_NEAR(mean, 1.5, 3e-3);
    EXPECT_NEAR(integral, 1, 3e-3);
    const auto axis = principal_axis(ndf);
    ASSERT_TRUE(axis);
    EXPECT_FALSE(axis->fibre);
    EXPECT_LT(axis_angle(axis->axis, V3d(0.6, 0.8, 0)), 0.1);  // degrees; floats, and for Ratib's the quadrature of 1024 directions
  }
  // Neyret's ellipsoid is the same distribution: shadows agree to floats.
  std::vector<double> first(directions.size());
  projected_areas(all[0], 3, directions, first);
  projected_areas(all[1], 3, directions, sigma);
  for (std::size_t i = 0; i < sigma.size(); ++i) EXPECT_NEAR(sigma[i], first[i], 1e-5);
  EXPECT_FALSE(principal_axis(Symmetric{1, 1, 1, 0, 0, 0}));
  EXPECT_TRUE(principal_axis(Symmetric{1, 1, 0.1, 0, 0, 0})->fibre);
}

std::vector<V3i> all_cells(const V3i& n) {
  std::vector<V3i> cells;
  for_each_cell(n, [&](const V3i& v) { cells.push_back(v); });
  return cells;
}

TEST(Truth, TiltedPlane) {
  // A plane through all of a 4³ grid: area, moments and σ are A, A n nᵀ, A|n·ω| in every voxel; of one layer alpha is A|n_k|.
  const V3d n = V3d(0.3, -0.5, 0.8).normalized();
  V3d u = n.cross(V3d(1, 0, 0)).normalized();
  const V3d v = n.cross(u), middle(2.1, 1.9, 2.03);
  Scene scene = empty_scene();
  add_quad(scene, middle - u * 10.0 - v * 10.0, u * 20.0, v * 20.0);
  const Recipe recipe = boxed(Box3d(V3d(0, 0, 0), V3d(4, 4, 4)), 4);
  Report report;
  const Grid grid{V3d(0, 0, 0), 1, V3i(4, 4, 4)};
  const auto truth = make_truth_scene(scene, recipe, grid, report);
  const std::vector<V3d> directions = half_sphere(32);
  double noise = 0, square = 0;
  for (int level = 0; level < 3; ++level) {
    const auto cells = all_cells(grid.level(level).n);
    const auto voxels = true_voxels(*truth, level, cells, {.rays = 32, .directions = directions, .bins = true, .color = true, .seed = 5}, report);
    ASSERT_EQ(voxels.size(), cells.size());
    for (const VoxelTruth& t : voxels) {
      EXPECT_NEAR(t.moments.xx, t.area * n.x * n.x, 1e-12);
      EXPECT_NEAR(t.moments.yz, t.area * n.y * n.z, 1e-12);
      EXPECT_NEAR((t.moments.m - n * t.area).length(), 0, 1e-12);
      for (std::size_t i = 0; i < directions.size(); ++i) EXPECT_NEAR(t.sigma[i], t.area * std::abs(n.dot(directions[i])), 1e-12);
      for (std::size_t k = 0; k < 3; ++k) {
        const double e = t.alpha[k] - t.area * std::abs(n[static_cast<int>(k)]);
        square += e * e;
        noise += t.noise[k];
        EXPECT_NEAR(e, 0, 6 * std::sqrt(t.noise[k]) + 2e-3);  // statistical; where hardly a ray differs the estimate is coarse
      }
      double binned = 0;
      for (const double b : t.bins) binned += b;
      EXPECT_NEAR(binned, t.area, 1e-12);
      EXPECT_NEAR((t.color - (t.area > 0 ? V3d(0.5) : V3d(0))).length(), 0, 1e-12);
      EXPECT_EQ(t.solid, 0);
    }
  }
  EXPECT_LE(square, noise);  // the estimate is one from above
  EXPECT_GT(square, noise / 20);
}

TEST(Truth, BallHasItsAreaAndVolume) {
  const Scene scene = ball_scene(1, 40);
  const Box3d box(V3d(-1.05, -1.07, -1.02), V3d(1.07, 1.05, 1.1));
  const Recipe recipe = boxed(box, 12);
  const Pack pack = bake_quietly(scene, recipe);
  Report report;
  const auto truth = make_truth_scene(scene, recipe, pack.grid, report);
  EXPECT_TRUE(truth->whole);
  for (int level = 0; level < static_cast<int>(pack.levels.size()); ++level) {
    SCOPED_TRACE(level);
    const Grid g = pack.grid.level(level);
    const auto voxels = true_voxels(*truth, level, all_cells(g.n), {.rays = 32, .directions = {}, .bins = false, .color = true, .seed = 1}, report);
    double area = 0, solid = 0, visible = 0, covered = 0;
    V3d m(0, 0, 0);
    for (const VoxelTruth& t : voxels) {
      area += t.area * g.h * g.h;
      solid += t.solid * std::pow(g.h, 3);
      m += t.moments.m;
      visible += t.visible.covered;
      covered += t.moments.covered;
    }
    EXPECT_NEAR(area, mesh_area(scene.mesh), 1e-12 * area);  // scaled rounding
    EXPECT_LE(m.length(), 1e-12 * covered);                  // closed
    // Statistical: chords of 1024 jittered rays a voxel. A ball in one voxel has its outline in about 100 of the strata, whose chords vary by
    // about 0.3: 0.3·√100/1024 of a mean of 1 is 0.003 at one deviation; many voxels share it.
    EXPECT_NEAR(solid, mesh_volume(scene.mesh), (voxels.size() < 64 ? 6e-3 : 1e-3) * solid);
    EXPECT_NEAR(visible, covered, 0.02 * covered);           // convex: all of it is seen
    if (g.n == V3i(1, 1, 1)) {
      EXPECT_NEAR(voxels[0].alpha[2] * g.h * g.h, kPi, 0.03 * kPi);
    }
  }
}

TEST(Truth, CubeOnWalls) {
  // Everything in the walls themselves: surface belongs to the voxel behind it, and the bake is exact.
  Scene scene = empty_scene();
  add_box(scene, {1, 1, 1}, {5, 5, 5});
  const Recipe recipe = boxed(Box3d(V3d(0, 0, 0), V3d(8, 8, 8)), 8);
  const Pack pack = bake_quietly(scene, recipe);
  Report report;
  const Comparison c = compare_truth(pack, scene, recipe, {.columns = 20}, report);
  for (int level = 0; level < 4; ++level) {
    EXPECT_EQ(figure(c, "voxels_missing", level), 0);
    EXPECT_EQ(figure(c, "voxels_extra", level), 0);
    EXPECT_NEAR(figure(c, "area_relative", level), 0, 1e-7);
    EXPECT_NEAR(figure(c, "area_rms", level), 0, 1e-7);
    EXPECT_NEAR(figure(c, "volume_relative", level), 0, 1e-7);
    EXPECT_NEAR(figure(c, "normal_rms", level), 0, 1e-7);
    EXPECT_NEAR(figure(c, "color_max", level), 0, 1e-7);
    // A cube's corners: 7/8 of a coarse voxel's rays and the like are not met exactly by jittered ones.
    for (int axis = 0; axis < 3; ++axis) EXPECT_LE(figure(c, "alpha_max", level, axis), level == 0 ? 0 : 0.003);
    EXPECT_LE(figure(c, "solid_rms", level), level == 0 ? 0 : 0.003);
  }
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(figure(c, "column_rms", 0, axis), 0, 1e-15);  // opaque (depths end at 40) or empty
}

TEST(Truth, KnownErrorsAreFound) {
  // A plane across the grid: the pack is exact to floats; then its alpha is made wrong by a known amount.
  Scene scene = empty_scene();
  add_quad(scene, {-1, -1, 0.03}, {2, 0, 0.2}, {0, 2, 0.1});
  const Recipe recipe = boxed(Box3d(V3d(-1, -1, -1), V3d(1, 1, 1)), 16);
  Pack pack = bake_quietly(scene, recipe);
  Report report;
  const Comparison good = compare_truth(pack, scene, recipe, {}, report);
  EXPECT_NEAR(figure(good, "sigma_rms"), 0, 1e-5);
  EXPECT_NEAR(figure(good, "axis_angle_max"), 0, 1e-3);  // degrees; S in floats
  EXPECT_LE(figure(good, "alpha_rms", 0, 2), figure(good, "alpha_truth_noise", 0, 2));
  for (float& v : channel(pack, 0, "alpha").values) v += 0.125f;
  const Comparison bad = compare_truth(pack, scene, recipe, {}, report);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(figure(bad, "alpha_bias", 0, axis), 0.125 + figure(good, "alpha_bias", 0, axis), 1e-6);
    EXPECT_NEAR(figure(bad, "alpha_rms", 0, axis), 0.125, 0.002);
  }
  // Light through columns along z: one layer everywhere, so that the product is the truth but for the rays of 256 a column.
  EXPECT_LE(figure(good, "column_rms", 3, 2), 0.02);
  EXPECT_LE(std::abs(figure(good, "column_bias", 3, 2)), 0.02);
  EXPECT_LT(figure(bad, "column_bias", 0, 0), figure(good, "column_bias", 0, 0) - 0.05);  // a dozen voxels each let an eighth less through
}

TEST(Truth, SampleDoesNotDependOnThreadsOrOrder) {
  const Scene scene = ball_scene(1, 20);
  const Recipe recipe = volume_recipe(24);
  const Pack pack = bake_quietly(scene, recipe);
  const CompareOptions few{.voxels = 50, .columns = 20, .seed = 9};
  std::vector<Measure> first;
  for (const std::size_t threads : {std::size_t{1}, std::size_t{2}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    Report report;
    const Comparison c = compare_truth(pack, scene, recipe, few, report);
    if (first.empty()) first = c.measures;
    ASSERT_EQ(first.size(), c.measures.size());
    for (std::size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].value, c.measures[i].value) << first[i].name;
  }
  std::vector<V3i> cells = all_cells(V3i(9, 9, 9)), back(cells.rbegin(), cells.rend());
  EXPECT_EQ(sample_voxels(cells, 30, 4), sample_voxels(back, 30, 4));
  EXPECT_NE(sample_voxels(cells, 30, 4), sample_voxels(cells, 30, 5));
  EXPECT_EQ(sample_voxels(cells, 1000, 4).size(), cells.size());
}

TEST(Truth, AnotherSceneIsFarOff) {
  const Recipe recipe = boxed(Box3d(V3d(-1.1, -1.1, -1.1), V3d(1.1, 1.1, 1.1)), 16);
  const Pack pack = bake_quietly(ball_scene(1, 20), recipe);
  Report report;
  const Comparison c = compare_truth(pack, ball_scene(0.5, 20), recipe, {.voxels = 200, .columns = 100}, report);
  EXPECT_NEAR(figure(c, "area_relative"), 3, 0.05);    // (1/0.5)² − 1
  EXPECT_NEAR(figure(c, "volume_relative"), 7, 0.1);
  EXPECT_GT(figure(c, "voxels_missing"), 0);
  EXPECT_GT(figure(c, "voxels_extra"), 0);
  EXPECT_THROW((void)compare_truth(pack, transformed(ball_scene(1, 4), [](const V3d& p) { return p + V3d(100, 0, 0); }), recipe, {}, report), Error);
}

Image plain_image(int width, int height, float r, float g, float b, float a) {
  Image image{width, height, 4, {}};
  for (int i = 0; i < width * height; ++i) image.pixels.insert(image.pixels.end(), {r, g, b, a});
  return image;
}

TEST(CompareViews, KnownPictures) {
  const Image black = plain_image(20, 16, 0, 0, 0, 1), light = plain_image(20, 16, 0.25f, 0.25f, 0.25f, 1);
  const ImageErrors same = compare_images(black, black);
  EXPECT_EQ(same.rmse, 0);
  EXPECT_TRUE(std::isinf(same.psnr));
  EXPECT_NEAR(same.ssim, 1, 1e-12);
  const ImageErrors e = compare_images(light, black);
  EXPECT_NEAR(e.rmse, 0.25, 1e-7);
  const double y = static_cast<double>(linear_to_srgb(0.25f));
  EXPECT_NEAR(e.psnr, -20 * std::log10(y), 1e-4);
  EXPECT_NEAR(e.ssim, 1e-4 / (y * y + 1e-4), 1e-6);  // (2·0 + C1)/(y² + C1): no structure in either
  EXPECT_EQ(e.silhouette, 0);
  // Half the picture uncovered.
  Image half = light;
  for (int row = 0; row < 16; ++row)
    for (int x = 0; x < 10; ++x) half.at(x, row)[3] = 0;
  const ImageErrors s = compare_images(half, light);
  EXPECT_NEAR(s.silhouette, std::sqrt(0.5), 1e-7);
  EXPECT_NEAR(s.cover, -0.5, 1e-7);
  EXPECT_NEAR(s.rmse, 0.25 * std::sqrt(0.5), 1e-7);
  EXPECT_LT(s.ssim, 0.99);
  // Inverted structure correlates negatively.
  Image stripes = black, other = black;
  for (int row = 0; row < 16; ++row)
    for (int x = 0; x < 20; ++x)
      for (int c = 0; c < 3; ++c) {
        stripes.at(x, row)[c] = x % 4 < 2 ? 1.0f : 0.0f;
        other.at(x, row)[c] = x % 4 < 2 ? 0.0f : 1.0f;
      }
  EXPECT_LT(compare_images(stripes, other).ssim, -0.5);
  EXPECT_THROW((void)compare_images(black, plain_image(4, 4, 0, 0, 0, 1)), Error);
}

TEST(CompareViews, BallAgainstItself) {
  const Scene scene = ball_scene(1, 40);
  const Pack pack = bake_quietly(scene, volume_recipe(64));
  CompareViewsOptions options{.views = 3, .doublings = 3, .up = 2, .seed = 2, .view = {}};
  options.view.width = options.view.height = 96;
  Report report;
  const Comparison c = compare_views(pack, scene, options, report);
  double mean = 0;
  for (int view = 0; view < 3; ++view) mean += figure(c, "image_ssim", -1, -1, view) / 3;
  EXPECT_NEAR(figure(c, "image_ssim", -1), mean, 1e-12);
  // Bounds: what docs/view.md has for its four models, doubled; the ball is smoother than any.
  EXPECT_LE(figure(c, "image_rmse", -1), 0.03);
  EXPECT_GE(figure(c, "image_psnr", -1), 25);
  EXPECT_GE(figure(c, "image_ssim", -1), 0.85);
  EXPECT_LE(figure(c, "silhouette_rms", -1), 0.08);
  EXPECT_LE(std::abs(figure(c, "silhouette_cover", -1)), 0.03);
  for (int k = 1; k <= 3; ++k) {
    EXPECT_LE(std::abs(figure(c, "recede_brightness", -1, -1, k)), 0.05);
    EXPECT_LE(std::abs(figure(c, "recede_alpha", -1, -1, k)), 0.05);
  }
  // Another scene is seen to be another.
  EXPECT_GT(figure(compare_views(pack, ball_scene(0.7, 40), options, report), "silhouette_cover", -1), 0.5);
}

TEST(Compare, Verdicts) {
  EXPECT_FALSE(exceeds({.name = "alpha_bias", .value = -0.1}, 0.1));
  EXPECT_TRUE(exceeds({.name = "alpha_bias", .value = -0.11}, 0.1));
  EXPECT_TRUE(exceeds({.name = "alpha_rms", .value = std::nan("")}, 1));
  EXPECT_FALSE(exceeds({.name = "image_psnr", .value = 31}, 30));
  EXPECT_TRUE(exceeds({.name = "image_psnr", .value = 29}, 30));
  EXPECT_TRUE(exceeds({.name = "image_ssim", .value = std::nan("")}, 0.5));
}

}  // namespace
}  // namespace texel::test
