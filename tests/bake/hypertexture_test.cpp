// Densities: opacity against closed forms, moments against the coarea formula, levels, skipping, threads.
#include "bake/hypertexture.h"

#include <tbb/global_control.h>

#include <bit>

#include "formats/error.h"
#include "formats/expression.h"
#include "tests/bake/density_util.h"

namespace texel::test {
namespace {

// f = value + slope·p, wherever that is; NaN where x > undefined_from.
class Plane : public Field {
 public:
  Plane(double value, const V3d& slope, double undefined_from = 1e300) : value_(value), slope_(slope), undefined_(undefined_from) {}
  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override {
    for (std::size_t i = 0; i < n; ++i) f[i] = x[i] > undefined_ ? std::nan("") : value_ + slope_.x * x[i] + slope_.y * y[i] + slope_.z * z[i];
  }
  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    values(n, x, y, z, f);
    for (std::size_t i = 0; i < n; ++i) { gx[i] = slope_.x; gy[i] = slope_.y; gz[i] = slope_.z; }
  }
  [[nodiscard]] Interval range(const Box3d& box) const override {
    Interval r{value_ - 1e-12, value_ + 1e-12};
    for (int a = 0; a < 3; ++a) {
      r.low += std::min(slope_[a] * box.min[a], slope_[a] * box.max[a]);
      r.high += std::max(slope_[a] * box.min[a], slope_[a] * box.max[a]);
    }
    if (box.max.x > undefined_) return {std::nan(""), std::nan("")};
    return r;
  }
  [[nodiscard]] Box3d bounds(double) const override { return {}; }

 private:
  double value_;
  V3d slope_;
  double undefined_;
};

Recipe unit_box(int n) {
  Recipe recipe = volume_recipe(n);
  recipe.box = Box3d(V3d(0, 0, 0), V3d(1, 1, 1));
  return recipe;
}

// 1 − (1 − ρ)^(c·length) in every voxel of every level and in slices of any thickness. Rounding to float: 6e-8.
TEST(Density, ConstantIsExact) {
  Recipe recipe = unit_box(16);
  recipe.want.slices = true;
  const double rho = 0.3, c = 5;
  for (const int count : {0, 4, 5, 32}) {
    recipe.slice_count = count;
    const Pack pack = bake_quietly(fog(std::make_shared<Plane>(rho, V3d(0, 0, 0)), c), recipe);
    check_invariants(pack);
    ASSERT_EQ(pack.levels.size(), 5u);
    for (std::size_t l = 0; l < pack.levels.size(); ++l) {
      const double expected = 1 - std::pow(1 - rho, c * pack.levels[l].grid.h);
      const Dense alpha = dense(pack.levels[l], "alpha");
      for_each_cell(alpha.n, [&](const V3i& v) { for (int a = 0; a < 3; ++a) ASSERT_NEAR(alpha.at(v, a), expected, 1.2e-7) << l; });
    }
    for (const SliceStack& s : pack.slices) {
      const double expected = 1 - std::pow(1 - rho, c * s.thickness);
      for (int k = 0; k < s.count; ++k) {
        const Image image = s.image(k);
        for (std::size_t i = 3; i < image.pixels.size(); i += 4) ASSERT_NEAR(image.pixels[i], expected, 3e-7) << s.count;
      }
    }
  }
}

// D = 0.05 + 0.9x. Along x the depth is an integral in closed form, and every ray has the same: exact. Along y a ray at x has
// 1 − (1 − D(x))^(c·h); the voxel's mean is that over its rays, exact at their places and the midpoint rule's (Δ²/24·f″) off the true mean.
TEST(Density, RampIsExactAlongAndAcross) {
  const double c = 3, a = 0.05, b = 0.9;
  const auto depth_to = [&](double x) { const double u = 1 - a - b * x; return (u * std::log(u) - u) / b; };  // ∫ −ln(1 − D) dx
  for (const int samples : {1, 2, 4}) {
    Recipe recipe = unit_box(16);
    recipe.samples = samples;
    const Pack pack = bake_quietly(fog(std::make_shared<Plane>(a, V3d(b, 0, 0)), c), recipe);
    double worst = 0;
    for (const Level& level : pack.levels) {
      const Dense alpha = dense(level, "alpha");
      const double h = level.grid.h;
      for_each_cell(alpha.n, [&](const V3i& v) {
        const double x0 = v.x * h, x1 = x0 + h;
        ASSERT_NEAR(alpha.at(v, 0), 1 - std::exp(-c * (depth_to(x1) - depth_to(x0))), 1.2e-7) << h;
        const auto across = [&](double x) { return 1 - std::pow(1 - a - b * x, c * h); };
        const int rays = static_cast<int>(std::lround(h / pack.grid.h)) * samples;
        double mean = 0, fine = 0;
        for (int r = 0; r < rays; ++r) mean += across(x0 + h * (r + 0.5) / rays) / rays;
        for (int r = 0; r < 4096; ++r) fine += across(x0 + h * (r + 0.5) / 4096) / 4096;
        // From level 4 on a column's rays count with their mean before they are multiplied: short by the variance of what passes 8 voxels, (1 − D)^1.5,
        // over a column, (slope b·c/2)²·(1/16)²/12 = 6e-4.
        ASSERT_NEAR(alpha.at(v, 1), mean, level.grid.n.x > 1 ? 1.2e-7 : 6e-4) << h;
        worst = std::max(worst, std::abs(static_cast<double>(alpha.at(v, 1)) - fine));
      });
    }
    // |f″| <= b²·ch·(1−D)^(ch−2) <= 0.81·3h·(0.05)^(3h−2): with h = 1/16 below 30; Δ = h/samples.
    EXPECT_LT(worst, 30.0 / 24 / (256.0 * samples * samples) + 6e-4) << samples;
    std::printf("ramp, samples %d: largest error of alpha across %.2g\n", samples, worst);
  }
}

TEST(Density, MeanDepthOfAStep) {
  EXPECT_EQ(mean_depth(1, 1), 0);
  EXPECT_EQ(mean_depth(0, 0), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(mean_depth(1, 0), 1, 1e-15);              // ∫ −ln t over [0, 1]
  EXPECT_NEAR(mean_depth(0.5, 0.5), std::log(2), 1e-15);
  for (const double m : {1e-12, 1e-3, 0.5, 0.9}) {
    // Series and closed form meet: both within 2e-13 of the integral, by Simpson's rule on 2000 steps.
    for (const double r : {0.99e-3, 1.01e-3, 0.1, 1.0}) {
      const double u = m * (1 + r / 2), v = m * (1 - r / 2);
      double sum = 0;
      for (int i = 0; i <= 2000; ++i) sum += (i == 0 || i == 2000 ? 1 : i % 2 ? 4 : 2) * -std::log(v + (u - v) * i / 2000) / 6000;
      EXPECT_NEAR(mean_depth(u, v), sum, 2e-12 * (1 + sum));
      EXPECT_EQ(mean_depth(u, v), mean_depth(v, u));
    }
  }
}

// The soft ball: D goes from 0 to 1 in a straight line from the radius 1 inwards to 1 − w, R ± w/2, so that the mean area over all thresholds is 4π(R² + w²/12) and
// the mass 4π/3·(R³ + R·w²/4). The mass is of second order in the spacing.
TEST(Density, SoftBallHasItsAreaMassAndMoments) {
  const double w = 0.4;
  double before = 0;
  for (const int n : {24, 48, 96}) {
    Scene scene = density_preset("eroded");
    scene.hypertexture->amount = 0;
    scene.hypertexture->softness = w;
    Recipe recipe = volume_recipe(n);
    recipe.box = Box3d(V3d(-1.3, -1.3, -1.3), V3d(1.3, 1.3, 1.3));
    const Grid grid = plan_grid(scene, recipe);
    recipe.samples = 2;
    DensityOptions options;
    Report report;
    const DensityBake bake = bake_density(scene, grid, recipe, options, report);
    Moments sum;
    for (const Moments& m : bake.surfaces[0].moments) sum += m;
    double voxel_area = 0;
    for (const Areas& a : bake.surfaces[0].areas) voxel_area += a.area;
    const double face = grid.h * grid.h, area = voxel_area * face, radius = 1 - w / 2, expected = 4 * M_PI * (radius * radius + w * w / 12);
    const double mass = 4 * M_PI / 3 * (radius * radius * radius + radius * w * w / 4);
    const double error = std::abs(area / expected - 1);
    // Only in the two creases of the ramp, layers of two samples each, do the three axes' differences disagree: 4Δ/w of the area, Δ = h/2, where the mean
    // gradient is a percent too long.
    EXPECT_LT(error, 0.01 * 4 * grid.h / 2 / w) << n;
    EXPECT_NEAR(bake.mass, mass, mass * std::pow(grid.h / 2, 2));
    EXPECT_LT(sum.m.length(), 1e-9 * voxel_area);        // Σ −∫∇D = 0: the differences telescope
    for (const double diagonal : {sum.xx, sum.yy, sum.zz}) EXPECT_NEAR(diagonal, voxel_area / 3, 1e-3 * voxel_area);
    for (const double off : {sum.xy, sum.xz, sum.yz}) EXPECT_NEAR(off, 0, 1e-9 * voxel_area);
    std::printf("soft ball, %d voxels: area %.2g, mass %.2g relative\n", n, area / expected - 1, bake.mass / mass - 1);
    EXPECT_LT(error, before > 0 ? before / 1.4 : 1);  // of first order, small as it is
    before = error;
  }
}

// Density 1 is opaque whatever its scale; where all is 1 there are tiles.
TEST(Density, OneIsOpaque) {
  Scene scene = density_preset("eroded");
  scene.hypertexture->amount = 0;
  scene.hypertexture->scale = 1e-3;
  Report report;
  const Pack pack = bake(scene, volume_recipe(64), report);
  check_invariants(pack);
  const Layer* layer = nullptr;
  ASSERT_TRUE(pack.levels[0].find("alpha", &layer));
  EXPECT_GT(layer->tiles.size(), 20u);
  const Dense alpha = dense(pack.levels[0], "alpha"), solid = dense(pack.levels[0], "solid");
  const V3i middle = alpha.n / 2;
  EXPECT_EQ(alpha.at(middle), 1);
  EXPECT_EQ(solid.at(middle), 1);
  EXPECT_GT(pack.statistics.inside_voxels, 0);
}

// Levels against the rays themselves, taken one by one at the same places: levels 1 to 3 to rounding. From level 4 on the four rays of a column are
// taken as one where they pass from a brick of 8 voxels to the next, which is right where they agree or nothing lies behind: within 0.01.
TEST(Density, LevelsAreTheProductAlongEachRay) {
  Scene scene = density_preset("eroded");
  Recipe recipe = volume_recipe(32);
  const Pack pack = bake_quietly(scene, recipe);
  const std::shared_ptr<const Field> density = make_density(*scene.hypertexture, 0);
  constexpr int kSamples = 2;
  const auto at = [&](const V3i& sample) {
    const V3d p = pack.grid.to_world(V3d(sample.x + 0.5, sample.y + 0.5, sample.z + 0.5) / kSamples);
    double d = 0;
    density->values(1, &p.x, &p.y, &p.z, &d);
    return 1 - d;
  };
  int looked_at = 0;
  for (std::size_t l = 1; l < pack.levels.size(); ++l) {
    double worst = 0;
    const Dense alpha = dense(pack.levels[l], "alpha");
    const int width = kSamples << l;
    for_each_cell(alpha.n, [&](const V3i& v) {
      if (alpha.state(v) != 1 || (l < 3 && (v.x * 7 + v.y * 3 + v.z) % 5 != 0)) return;
      ++looked_at;
      for (int axis = 0; axis < 3; ++axis) {
        double passes = 0;
        for (int r = 0; r < width * width; ++r) {
          V3i s = v * width;
          s[(axis + 1) % 3] += r % width;
          s[(axis + 2) % 3] += r / width;
          double depth = 0;
          for (int k = 0; k <= width; ++k) {
            V3i low = s, high = s;
            low[axis] += k - 1;
            high[axis] += k;
            const double a = at(low), b = at(high), wall = (a + b) / 2;
            depth += k == 0 ? mean_depth(wall, b) / 2 : k == width ? mean_depth(a, wall) / 2 : mean_depth(a, b);
          }
          passes += std::exp(-depth * scene.hypertexture->scale * pack.grid.h / kSamples) / (width * width);
        }
        worst = std::max(worst, std::abs(static_cast<double>(alpha.at(v, axis)) - (1 - passes)));
      }
    });
    std::printf("level %zu: largest error of the recomputed alpha %.2g\n", l, worst);
    EXPECT_LT(worst, l <= 3 ? 1e-6 : 0.01) << l;
  }
  EXPECT_GT(looked_at, 20);
}

// Every level keeps the area. Opacity filtered takes voxels behind each other as if they had nothing to do with each other, 1 − (1 − α)², where they
// may cover the same part, α: at most ¼ apart, and there at the coarsest levels, whose voxels the shape fills in part.
TEST(Density, LevelsKeepAreaAndBothModesAgree) {
  Recipe recipe = volume_recipe(64);
  const Pack a = bake_quietly(density_preset("eroded"), recipe);
  recipe.level_mode = LevelMode::kFilter;
  const Pack b = bake_quietly(density_preset("eroded"), recipe);
  const double area = sum_of(a.levels[0], "area") * a.grid.h * a.grid.h;
  for (std::size_t l = 0; l < a.levels.size(); ++l) {
    EXPECT_NEAR(sum_of(a.levels[l], "area") * std::pow(a.levels[l].grid.h, 2), area, 1e-5 * area);
    const Dense x = dense(a.levels[l], "alpha"), y = dense(b.levels[l], "alpha");
    double square = 0;
    int count = 0;
    for_each_cell(x.n, [&](const V3i& v) {
      if (x.state(v) != 1) return;
      for (int k = 0; k < 3; ++k) square += std::pow(static_cast<double>(x.at(v, k)) - static_cast<double>(y.at(v, k)), 2);
      count += 3;
    });
    std::printf("level %zu: filtered less recomputed alpha, rms %.4f\n", l, std::sqrt(square / count));
    EXPECT_LT(std::sqrt(square / count), l < 6 ? 0.06 : 0.25);
  }
}

// A bake at half the resolution is level 1 of the fine one, whatever octaves there are, but for the noise of its samples.
TEST(Density, HalfTheResolutionIsLevelOne) {
  Scene scene = density_preset("eroded");
  scene.hypertexture->octaves = 8;
  Recipe recipe = volume_recipe(128);
  recipe.box = Box3d(V3d(-1.6, -1.6, -1.6), V3d(1.6, 1.6, 1.6));
  recipe.levels = 2;
  const Pack fine = bake_quietly(scene, recipe);
  recipe.resolution = V3i(64, 0, 0);
  recipe.levels = 1;
  const Pack half = bake_quietly(scene, recipe);
  const Dense a = dense(fine.levels[1], "alpha"), b = dense(half.levels[0], "alpha");
  EXPECT_EQ(a.n, b.n);
  double square = 0, sum_a = 0, sum_b = 0;
  int count = 0;
  for_each_cell(a.n, [&](const V3i& v) {
    if (a.state(v) == 0 && b.state(v) == 0) return;
    if (a.state(v) == 2 && b.state(v) == 2) return;
    square += std::pow(static_cast<double>(a.at(v)) - static_cast<double>(b.at(v)), 2);
    sum_a += static_cast<double>(a.at(v));
    sum_b += static_cast<double>(b.at(v));
    ++count;
  });
  const double coverage = sum_b / sum_a - 1, rms = std::sqrt(square / count);
  std::printf("half the resolution against level 1: alpha rms %.4f, mean %.4f relative\n", rms, coverage);
  // What eight samples a voxel leave of noise at this resolution; the mean has none of it. (Octaves faded to their means instead of sampled: 0.081 and 0.009.)
  EXPECT_LT(rms, 0.04);
  EXPECT_LT(std::abs(coverage), 0.005);
}

// The values of another field, of whose range nothing is known.
class Unbounded : public Field {
 public:
  explicit Unbounded(std::shared_ptr<const Field> field) : field_(std::move(field)) {}
  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override { field_->values(n, x, y, z, f); }
  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    field_->gradients(n, x, y, z, f, gx, gy, gz);
  }
  [[nodiscard]] Interval range(const Box3d&) const override { return {std::nan(""), std::nan("")}; }
  [[nodiscard]] Box3d bounds(double iso) const override { return field_->bounds(iso); }

 private:
  std::shared_ptr<const Field> field_;
};

void expect_same(const Pack& a, const Pack& b) {
  ASSERT_EQ(a.levels.size(), b.levels.size());
  for (std::size_t l = 0; l < a.levels.size(); ++l) {
    ASSERT_EQ(a.levels[l].layers.size(), b.levels[l].layers.size());
    for (std::size_t i = 0; i < a.levels[l].layers.size(); ++i) {
      const Layer &x = a.levels[l].layers[i], &y = b.levels[l].layers[i];
      ASSERT_EQ(x.set.count, y.set.count);
      EXPECT_EQ(x.tiles, y.tiles);
      for (std::size_t c = 0; c < x.channels.size(); ++c) {
        ASSERT_EQ(x.channels[c].values.size(), y.channels[c].values.size());
        for (std::size_t k = 0; k < x.channels[c].values.size(); ++k)
          ASSERT_EQ(std::bit_cast<std::uint32_t>(x.channels[c].values[k]), std::bit_cast<std::uint32_t>(y.channels[c].values[k])) << x.channels[c].name;
      }
    }
  }
  for (std::size_t s = 0; s < a.slices.size(); ++s)
    for (int k = 0; k < a.slices[s].count; k += 5) EXPECT_EQ(a.slices[s].image(k).pixels, b.slices[s].image(k).pixels);
}

// A brick proven empty or full is not sampled; sampled all the same it is found empty or full.
TEST(Density, BricksProvenEmptyOrFullAreNotSampled) {
  Scene scene = density_preset("fur");
  Recipe recipe = volume_recipe(96);
  recipe.box = Box3d(V3d(-1.2, -1.2, -1.2), V3d(1.2, 1.2, 1.2));
  const std::shared_ptr<const Field> field = make_density(*scene.hypertexture, 0);
  const auto bake_field = [&](std::shared_ptr<const Field> base, double* sampled) {
    Report report;
    Pack pack = bake(fog(std::move(base), 40), recipe, report);
    for (const auto& [name, value] : report.counts)
      if (name == "bricks sampled") *sampled = value;
    return pack;
  };
  double some = 0, all = 0;
  const Pack a = bake_field(field, &some), b = bake_field(std::make_shared<Unbounded>(field), &all);
  std::printf("fur at 96: %.0f of %.0f bricks sampled\n", some, all);
  EXPECT_EQ(all, 1728);
  EXPECT_LT(some, 0.65 * all);  // the ball is 30 % of the box and its shell of hairs 73 % of the ball; the rest are bricks it cuts
  expect_same(a, b);
}

TEST(Density, SameForAnyNumberOfThreads) {
  for (const char* name : {"eroded", "fire", "marble", "fur"}) {
    std::vector<Pack> packs;
    for (const int threads : {1, 2, 4}) {
      Recipe recipe = volume_recipe(48);
      recipe.want.slices = true;
      recipe.threads = threads;
      packs.push_back(bake_quietly(density_preset(name), recipe));
      check_invariants(packs.back());
    }
    for (std::size_t p = 1; p < packs.size(); ++p) expect_same(packs[0], packs[p]);
  }
}

// Points chosen for an error: the same, and as many as a bake that is given them.
TEST(Density, ChosenPointsAreTheSameForAnyNumberOfThreads) {
  for (const char* name : {"eroded", "marble"}) {
    Recipe recipe = volume_recipe(24);
    recipe.max_error = 0.02;
    std::vector<Pack> packs;
    for (const int threads : {1, 2, 4}) {
      recipe.threads = threads;
      recipe.memory = threads == 4 ? 1 : 0;
      packs.push_back(bake_quietly(density_preset(name), recipe));
      check_invariants(packs.back());
    }
    for (std::size_t p = 1; p < packs.size(); ++p) expect_same(packs[0], packs[p]);
    const auto says = std::count_if(packs[0].errors.begin(), packs[0].errors.end(), [](const ErrorFigure& e) { return e.measure.starts_with("alpha_rms_") && e.value > 0 && e.value <= 0.02; });
    EXPECT_EQ(says, 3) << name;
  }
}

// Where nothing varies one point a voxel is exact.
TEST(Density, NothingToChooseIsOnePoint) {
  Recipe recipe = unit_box(16);
  recipe.max_error = 0.001;
  Report report;
  (void)bake(fog(std::make_shared<Plane>(0.5, V3d(0, 0, 0)), 2), recipe, report);
  for (const auto& [what, value] : report.counts)
    if (what == "samples") {
      EXPECT_EQ(value, 1);
    }
  for (const Issue& issue : report.issues) EXPECT_NE(issue.id, "max-error");
}

// A colour by position reaches the volume and the slices.
TEST(Density, ColourOfItsOwn) {
  class Halves : public SolidTexture {
    void colors(std::size_t n, const double* x, const double*, const double*, const V3d*, double, V3f* color) const override {
      for (std::size_t i = 0; i < n; ++i) color[i] = x[i] < 0.5 ? V3f(1, 0, 0) : V3f(0, 0, 1);
    }
  };
  Scene scene = fog(std::make_shared<Plane>(0.5, V3d(0, 0, 0)), 2);
  scene.materials[0].solid = std::make_shared<Halves>();
  Recipe recipe = unit_box(16);
  recipe.want.slices = true;
  const Pack pack = bake_quietly(scene, recipe);
  const Dense color = dense(pack.levels[0], "Cd");
  EXPECT_EQ(color.at3(V3i(2, 8, 8)), V3f(1, 0, 0));
  EXPECT_EQ(color.at3(V3i(12, 8, 8)), V3f(0, 0, 1));
  const Dense top = dense(pack.levels[4], "Cd");
  EXPECT_NEAR(top.at(V3i(0, 0, 0), 0), 0.5, 1e-6);
  for (const SliceStack& s : pack.slices)
    if (s.axis == 2) {
      const Image image = s.image(3);
      EXPECT_EQ(image.at(2, 5)[0], 1);
      EXPECT_EQ(image.at(12, 5)[2], 1);
    }
}

// A fog volume's own values as the density: their integral does not depend on the voxels they are baked into.
TEST(Density, FogVolumeKeepsItsMass) {
  const std::string path = TEXEL_SHARED_DATA "/volumes/smoke.vdb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "not there: " << path;
  Report report;
  const Scene read = read_scene(path, report);
  ASSERT_EQ(read.implicits.size(), 1u);
  Scene scene = fog(read.implicits[0].field, 3);
  std::vector<double> mass;
  for (const int n : {48, 96}) {
    const Pack pack = bake_quietly(scene, volume_recipe(n));
    check_invariants(pack);
    mass.push_back(pack.statistics.volume);
    EXPECT_GT(pack.statistics.border_voxels, 1000);
  }
  std::printf("smoke: mass %.6g and %.6g\n", mass[0], mass[1]);
  // Sums over 1.3 and 0.65 million points of values that change from voxel to voxel of their own: a percent covers the sampling of one.
  EXPECT_NEAR(mass[1] / mass[0], 1, 0.01);
}

TEST(Density, UndefinedIsEmptyAndSaid) {
  Report report;
  const Pack pack = bake(fog(std::make_shared<Plane>(0.5, V3d(0, 0, 0), 0.5), 2), unit_box(16), report);
  EXPECT_TRUE(has_issue(pack, "field-undefined"));
  const Dense alpha = dense(pack.levels[0], "alpha");
  EXPECT_GT(alpha.at(V3i(3, 8, 8)), 0);
  EXPECT_EQ(alpha.state(V3i(13, 8, 8)), 0);
}

TEST(Density, RefusesWhatCannotBe) {
  const auto code = [](const Scene& scene, const Recipe& recipe) {
    try {
      (void)bake_quietly(scene, recipe);
    } catch (const Error& error) {
      return error.code;
    }
    return Code::kRunning;
  };
  EXPECT_EQ(code(fog(std::make_shared<Plane>(0.5, V3d(0, 0, 0)), 2), volume_recipe(16)), Code::kCommandLine);  // nothing says where it ends
  EXPECT_EQ(code(fog(std::make_shared<Plane>(-1, V3d(0, 0, 0)), 2), unit_box(16)), Code::kBadInput);           // nothing there
  Recipe shadows = unit_box(16);
  shadows.shadows = true;
  EXPECT_EQ(code(density_preset("eroded"), shadows), Code::kUnsupported);
}

// compare_density against what is known on paper, and against packs changed by a known amount.
Comparison against_source(const Pack& pack, const Scene& scene, const Recipe& recipe, int voxels = 150, int level = -1) {
  Report report;
  return compare_truth(pack, scene, recipe, {.level = level, .voxels = voxels, .columns = 20}, report);
}

TEST(DensityTruth, ConstantFog) {
  const Scene scene = fog(read_expression("0.3"), 8);
  Recipe recipe = volume_recipe(8);
  recipe.box = Box3d(V3d(0), V3d(1));
  Pack pack = bake_quietly(scene, recipe);
  const Comparison c = against_source(pack, scene, recipe);
  for (int level = 0; level < static_cast<int>(pack.levels.size()); ++level) {
    EXPECT_EQ(figure(c, "voxels_missing", level), 0);
    EXPECT_EQ(figure(c, "voxels_extra", level), 0);
    for (int axis = 0; axis < 3; ++axis) EXPECT_LT(figure(c, "alpha_rms", level, axis), 2e-7) << level;  // floats
    EXPECT_LT(figure(c, "alpha_truth_noise", level, 1), 1e-12);
    EXPECT_LT(figure(c, "crossings_rms", level), 1e-5);
    EXPECT_LT(figure(c, "solid_rms", level), 1e-12);
  }
  for (Layer& layer : pack.levels[1].layers)
    for (Channel& channel : layer.channels) {
      if (channel.name == "alpha")
        for (float& v : channel.values) v += 0.03f;
      if (channel.name == "Cd")
        for (float& v : channel.values) v += 0.0625f;
    }
  const Comparison changed = against_source(pack, scene, recipe);
  EXPECT_NEAR(figure(changed, "alpha_bias", 1, 0), 0.03, 1e-6);
  EXPECT_NEAR(figure(changed, "alpha_rms", 1, 2), 0.03, 1e-6);
  EXPECT_LT(figure(changed, "alpha_rms", 0, 2), 2e-7);
  EXPECT_NEAR(figure(changed, "color_rms", 1), 0.0625, 1e-6);
  // Another density is told to be another: 1 − 0.7^(8/8) a voxel is 0.3, of 0.5 it is 0.5.
  EXPECT_NEAR(figure(against_source(pack, fog(read_expression("0.5"), 8), recipe), "alpha_bias", 0, 0), -0.2, 1e-6);
}

TEST(DensityTruth, AVoxelTakenAwayIsMissed) {
  const Scene scene = fog(read_expression("0.6 - 2*(x^2 + y^2 + z^2)"), 8);
  Recipe recipe = volume_recipe(12);
  recipe.box = Box3d(V3d(-0.7), V3d(0.7));
  const Pack pack = bake_quietly(scene, recipe);
  const Comparison whole = against_source(pack, scene, recipe, 100000, 0);
  // A ball's outermost voxels may hold less than the bake's eight samples find.
  const double unseen = figure(whole, "voxels_missing", 0);
  EXPECT_LT(unseen, 0.06 * static_cast<double>(pack.statistics.border_voxels));
  Pack holed = pack;
  std::int64_t taken = 0;
  for (Layer& layer : holed.levels[0].layers) {
    const Channel* crossings = nullptr;
    for (const Channel& c : layer.channels)
      if (c.name == "crossings") crossings = &c;
    if (!crossings) continue;
    Layer kept;
    for (const Block& block : layer.set.blocks)
      if (block.at.z != layer.set.blocks.front().at.z) kept.set.add(block.at, block.mask);
    taken = layer.set.count - kept.set.count;
    const auto from = static_cast<std::ptrdiff_t>(taken);
    for (const Channel& c : layer.channels) kept.channels.push_back({c.name, c.components, {c.values.begin() + from * c.components, c.values.end()}, {}, c.full_float});
    layer = kept;
  }
  ASSERT_GT(taken, 0);
  // Only neighbours of what is left are looked at.
  const double missed = figure(against_source(holed, scene, recipe, 100000, 0), "voxels_missing", 0);
  EXPECT_GT(missed, unseen);
  EXPECT_LE(missed, unseen + static_cast<double>(taken));
}

// A few samples a voxel of a surface with octaves far finer than voxels. The error falls faster than by half from step to step.
TEST(DensityTruth, SamplesOfTheDensityItselfConverge) {
  const Scene scene = density_preset("eroded");
  Recipe recipe = volume_recipe(32);
  double last = 1;
  for (const int samples : {1, 2, 4}) {
    recipe.samples = samples;
    const Comparison c = against_source(bake_quietly(scene, recipe), scene, recipe, 100, 0);
    const double rms = (figure(c, "alpha_rms", 0, 0) + figure(c, "alpha_rms", 0, 1) + figure(c, "alpha_rms", 0, 2)) / 3;
    std::printf("eroded, %d samples: alpha rms %.4f, bias %.4f, colour %.4f, area %+.4f\n", samples, rms, figure(c, "alpha_bias", 0, 0), figure(c, "color_rms", 0), figure(c, "area_relative", 0));
    EXPECT_LT(rms, 0.6 * last);
    last = rms;
  }
  EXPECT_LT(last, 0.03);
}

TEST(DensityTruth, SameFiguresOnAnyNumberOfThreads) {
  const Scene scene = density_preset("fire");
  const Recipe recipe = volume_recipe(16);
  const Pack pack = bake_quietly(scene, recipe);
  const Comparison many = against_source(pack, scene, recipe, 10);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Comparison alone = against_source(pack, scene, recipe, 10);
  expect_same_figures(many, alone);
}

}  // namespace
}  // namespace texel::test
