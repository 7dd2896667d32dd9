// The truth for whole densities, light along rays and the volume of D = 1, against closed forms.
#include "bake/density_light.h"

#include <algorithm>
#include <numbers>

#include "formats/expression.h"
#include "formats/random.h"
#include "tests/bake/density_util.h"

namespace texel::test {
namespace {

const Grid kUnitGrid{V3d(0), 1.0 / 8, V3i(8)};

// Another field without what it knows of ranges.
class Unbounded : public Field {
 public:
  explicit Unbounded(const Field& of) : of_(of) {}
  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override { of_.values(n, x, y, z, f); }
  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override { of_.gradients(n, x, y, z, f, gx, gy, gz); }
  [[nodiscard]] Interval range(const Box3d&) const override { return {std::nan(""), std::nan("")}; }
  [[nodiscard]] Box3d bounds(double iso) const override { return of_.bounds(iso); }

 private:
  const Field& of_;
};

TEST(DensityLight, ConstantIsExact) {
  const auto density = read_expression("0.3");
  const DensityLight light = make_density_light(*density, 8, kUnitGrid);
  // Steps are equal shares of the length in the box, whatever is outside: rounding of some hundred sums.
  EXPECT_NEAR(light_passed(light, {-3, 0.5, 0.5}, {5, 0.5, 0.5}, 1), std::pow(0.7, 8), 1e-14);
  EXPECT_NEAR(light_passed(light, {0.25, 0.5, 0.5}, {0.5, 0.5, 0.5}, 1), std::pow(0.7, 2), 1e-14);
  EXPECT_NEAR(light_passed(light, {-1, -1, -1}, {2, 2, 2}, 1), std::pow(0.7, 8 * std::sqrt(3.0)), 1e-14);
  EXPECT_EQ(light_passed(light, {-1, 0.5, 2}, {2, 0.5, 2}, 1), 1);
  EXPECT_EQ(light_passed(light, {2, 2, 2}, {3, 3, 3}, 1), 1);
}

TEST(DensityLight, OpaqueAndUndefined) {
  // D = 1 stops a ray whatever the scale: by its range, and, where the range does not say so, by being met. Where it is undefined it is empty.
  const auto slab = read_expression("step(0.5, x)"), hole = read_expression("0.3 + 0*sqrt(0.5 - x)");
  const Unbounded unsure(*slab);
  for (const Field* field : {slab.get(), static_cast<const Field*>(&unsure)}) {
    const DensityLight light = make_density_light(*field, 1e-3, kUnitGrid);
    EXPECT_EQ(light_passed(light, {0, 0.5, 0.5}, {1, 0.5, 0.5}, 1), 0);
    EXPECT_EQ(light_passed(light, {0.4, 0, 0.5}, {0.4, 1, 0.5}, 1), 1);
  }
  // What is nearly empty or nearly full is neither.
  for (const double d : {0.001, 0.999}) {
    const auto nearly = read_expression(std::to_string(d));
    EXPECT_NEAR(light_passed(make_density_light(*nearly, 1, kUnitGrid), {0, 0.5, 0.5}, {1, 0.5, 0.5}, 1), 1 - d, 1e-14);  // rounding
    EXPECT_EQ(full_volume(make_density_light(*nearly, 1, kUnitGrid), 1).value, 0);
  }
  // Undefined from the middle on, a place a step: exact but for rounding, since the wall of steps is there.
  EXPECT_NEAR(light_passed(make_density_light(*hole, 8, kUnitGrid), {0, 0.5, 0.5}, {1, 0.5, 0.5}, 1), std::pow(0.7, 4), 1e-14);
}

TEST(DensityLight, SkippingChangesNothing) {
  const Scene scene = density_preset("eroded");
  const auto density = make_density(*scene.hypertexture, 0);
  const Unbounded blind(*density);
  const Grid grid{V3d(-1.3), 2.6 / 24, V3i(24)};
  const DensityLight light = make_density_light(*density, scene.hypertexture->scale, grid), slow = make_density_light(blind, scene.hypertexture->scale, grid);
  EXPECT_GT(std::count(light.kinds.begin(), light.kinds.end(), DensityLight::Cell::kEmpty), 0);
  EXPECT_GT(std::count(light.kinds.begin(), light.kinds.end(), DensityLight::Cell::kFull), 0);
  RandomSequence random(3);
  int passed = 0;
  for (std::uint64_t i = 0; i < 600; ++i) {
    const V3d along = random_direction(random);
    const double x = random.next(), y = random.next(), z = random.next();  // one by one: the order of a call's arguments is the compiler's
    const V3d at = V3d(x, y, z) * 2.0 - V3d(1);
    const double a = light_passed(light, at - along * 4, at + along * 4, i), b = light_passed(slow, at - along * 4, at + along * 4, i);
    EXPECT_NEAR(a, b, 1e-13);  // the same places, added up in other groups: rounding
    passed += a > 0.01;
  }
  EXPECT_GT(passed, 30);
  const FullVolume fast = full_volume(light, 5), all = full_volume(slow, 5);
  EXPECT_NEAR(fast.value, all.value, 1e-12);  // rounding
  EXPECT_LT(fast.places, all.places);
}

TEST(DensityLight, RampIsItsIntegral) {
  // D = 0.1 + 0.6x: ∫ −ln(0.9 − 0.6x) from 0 to 1 = 1 + (0.3 ln 0.3 − 0.9 ln 0.9)/0.6.
  const auto density = read_expression("0.1 + 0.6*x");
  const double c = 3, depth = c * (1 + (0.3 * std::log(0.3) - 0.9 * std::log(0.9)) / 0.6);
  const DensityLight light = make_density_light(*density, c, kUnitGrid);
  constexpr int kRays = 2000;
  double mean = 0;
  for (std::uint64_t i = 0; i < kRays; ++i) mean += light_passed(light, {0, 0.5, 0.5}, {1, 0.5, 0.5}, mix_bits(i)) / kRays;
  // A place a step of 1/64, over which the integrand changes by at most c·0.6/0.3/64: the variance of the depth is at most 64·(that/64)²/12, and half of it the bias of exp(−depth).
  const double change = c * 2 / 64, variance = change * change / 64 / 12;
  EXPECT_NEAR(mean / std::exp(-depth), 1, 4 * std::sqrt(variance / kRays) + variance);  // statistical: four deviations
}

TEST(DensityLight, BallOfOneDensity) {
  // Lines spread evenly over all that meet a ball have chords of density l/(2R²): ∫ e^(−μl) l/(2R²) dl from 0 to 2R = 2(1 − (1 + t)e^(−t))/t², t = 2Rμ.
  const double radius = 0.8, c = 1.5, mu = c * std::numbers::ln2, t = 2 * radius * mu, truth = 2 * (1 - (1 + t) * std::exp(-t)) / (t * t);
  const auto density = read_expression("0.5*step(x^2 + y^2 + z^2, 0.64)");
  const DensityLight light = make_density_light(*density, c, {V3d(-1), 2.0 / 16, V3i(16)});
  constexpr int kLines = 40000;
  RandomSequence random(11);
  double mean = 0, square = 0, worst = 0;
  for (std::uint64_t i = 0; i < kLines; ++i) {
    const V3d along = random_direction(random), side = along.cross(std::abs(along.x) < 0.5 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized();
    const double phi = 2 * std::numbers::pi * random.next(), r = radius * std::sqrt(random.next());
    const V3d at = (side * std::cos(phi) + along.cross(side) * std::sin(phi)) * r;
    const double passed = light_passed(light, at - along * 2, at + along * 2, i);
    mean += passed / kLines;
    square += passed * passed / kLines;
    worst = std::max(worst, std::abs(std::log(passed) + mu * chord(at, along, radius)));
  }
  EXPECT_LT(worst, 2 * mu * 2.0 / 16 / kLightSteps);  // at most a step more or less at either end
  EXPECT_NEAR(mean, truth, 4 * std::sqrt((square - mean * mean) / kLines));  // statistical: four deviations
}

TEST(DensityLight, VolumeOfOne) {
  // A ball, and what the box leaves of it, with cells that reach beyond the box: 65 voxels in cells of two.
  const auto density = read_expression("20*(0.81 - x^2 - y^2 - z^2)");
  const double radius = std::sqrt(0.81 - 0.05), ball = 4 * std::numbers::pi / 3 * std::pow(radius, 3);
  for (const auto& [grid, truth] : {std::pair(Grid{V3d(-1), 2.0 / 16, V3i(16)}, ball), std::pair(Grid{V3d(-1), 2.0 / 65, V3i(65)}, ball), std::pair(Grid{V3d(-1, -1, 0), 2.0 / 65, V3i(65, 65, 65)}, ball / 2)}) {
    const DensityLight light = make_density_light(*density, 1, grid);
    int inside = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      const FullVolume v = full_volume(light, seed);
      EXPECT_LT(v.error, 0.003 * truth);
      inside += std::abs(v.value - truth) < 1.96 * v.error;
    }
    EXPECT_GE(inside, 16);  // of 20 at 95 %: fewer in one of 400 runs
  }
  EXPECT_EQ(full_volume(make_density_light(*read_expression("1"), 1, kUnitGrid), 0).error, 0);
  EXPECT_NEAR(full_volume(make_density_light(*read_expression("1"), 1, kUnitGrid), 0).value, 1, 1e-14);
}

}  // namespace
}  // namespace texel::test
