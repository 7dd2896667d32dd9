#include "formats/noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace texel {
namespace {

struct Points {
  std::vector<double> x, y, z;
  Points(std::size_t n, double low, double high, unsigned seed = 1) {
    std::mt19937_64 random(seed);
    const auto next = [&] { return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53); };
    for (std::size_t i = 0; i < n; ++i) { x.push_back(next()); y.push_back(next()); z.push_back(next()); }
  }
  [[nodiscard]] std::size_t size() const { return x.size(); }
};

std::vector<double> values(const Noise& noise, const Points& p) {
  std::vector<double> v(p.size());
  noise_values(noise, p.size(), p.x.data(), p.y.data(), p.z.data(), v.data());
  return v;
}

double value(const Noise& noise, double x, double y, double z) {
  double v = 0;
  noise_values(noise, 1, &x, &y, &z, &v);
  return v;
}

std::uint64_t bits(double v) { return std::bit_cast<std::uint64_t>(v); }

TEST(Noise, IsNothingAtLatticePoints) {
  for (int x = -3; x <= 3; ++x)
    for (int y = -3; y <= 3; ++y) EXPECT_EQ(value({7, {0, 0, 0}}, x, y, x * y), 0.0);
}

// Points in cells of their own are independent, so a mean over n of them deviates by sd/√n; five of those deviations are allowed.
TEST(Noise, HasTheStatedMoments) {
  constexpr std::size_t kCount = 2'000'000;
  const std::vector<double> v = values({3, {0, 0, 0}}, Points(kCount, -1e6, 1e6));
  double mean = 0, square = 0, absolute = 0, fourth = 0;
  for (const double x : v) { mean += x; square += x * x; absolute += std::abs(x); fourth += x * x * x * x; }
  mean /= kCount; square /= kCount; absolute /= kCount; fourth /= kCount;
  const double root = std::sqrt(static_cast<double>(kCount));
  EXPECT_NEAR(mean, 0, 5 * std::sqrt(kNoiseVariance) / root);
  EXPECT_NEAR(square, kNoiseVariance, 5 * std::sqrt(fourth - square * square) / root);
  EXPECT_NEAR(absolute, kNoiseMeanAbs, 5 * std::sqrt(square - absolute * absolute) / root);
  EXPECT_LE(*std::max_element(v.begin(), v.end()), kNoiseBound);
  EXPECT_GE(*std::min_element(v.begin(), v.end()), -kNoiseBound);
}

// Correlation of n independent pairs deviates by 1/√n.
TEST(Noise, SeedsAreIndependent) {
  constexpr std::size_t kCount = 400'000;
  const Points p(kCount, -1e5, 1e5);
  const std::array<std::uint32_t, 5> seeds{0, 1, 2, 0x80000000u, 0xffffffffu};
  std::vector<std::vector<double>> all;
  for (const std::uint32_t seed : seeds) all.push_back(values({seed, {0, 0, 0}}, p));
  for (std::size_t a = 0; a < all.size(); ++a)
    for (std::size_t b = a + 1; b < all.size(); ++b) {
      double sum = 0;
      for (std::size_t i = 0; i < kCount; ++i) sum += all[a][i] * all[b][i];
      EXPECT_NEAR(sum / kCount / kNoiseVariance, 0, 5 / std::sqrt(static_cast<double>(kCount))) << seeds[a] << " " << seeds[b];
    }
}

// The three axes and both senses look alike: second moments of the gradient, isotropic for gradients uniform over the sphere.
TEST(Noise, PrefersNoAxis) {
  constexpr std::size_t kCount = 400'000;
  const Points p(kCount, -1e5, 1e5);
  std::vector<double> v(kCount), g[3];
  for (auto& a : g) a.assign(kCount, 0.0);
  noise_gradients({}, kCount, p.x.data(), p.y.data(), p.z.data(), v.data(), g[0].data(), g[1].data(), g[2].data());
  std::array<double, 3> square{}, fourth{};
  for (std::size_t a = 0; a < 3; ++a)
    for (const double s : g[a]) { square[a] += s * s / kCount; fourth[a] += s * s * s * s / kCount; }
  const double mean = (square[0] + square[1] + square[2]) / 3;
  for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(square[a], mean, 5 * std::sqrt((fourth[a] - mean * mean) / kCount));
}

// Central differences of step s: truncation s²/6·|f‴| with |f‴| < 200 for this blend, rounding 2⁻⁵²·1/s; s = 1e-5 leaves 4e-9 of both.
TEST(Noise, DerivativeIsThatOfTheValue) {
  const Points p(20'000, -50, 50);
  for (const Noise& noise : {Noise{5, {0, 0, 0}}, Noise{5, {4, 7, 1}}}) {
    std::vector<double> v(p.size()), g[3];
    for (auto& a : g) a.assign(p.size(), 0.0);
    noise_gradients(noise, p.size(), p.x.data(), p.y.data(), p.z.data(), v.data(), g[0].data(), g[1].data(), g[2].data());
    const std::vector<double> alone = values(noise, p);
    constexpr double kStep = 1e-5;
    double worst = 0;
    for (std::size_t i = 0; i < p.size(); ++i) {
      EXPECT_EQ(bits(alone[i]), bits(v[i]));
      const double dx = (value(noise, p.x[i] + kStep, p.y[i], p.z[i]) - value(noise, p.x[i] - kStep, p.y[i], p.z[i])) / (2 * kStep);
      const double dy = (value(noise, p.x[i], p.y[i] + kStep, p.z[i]) - value(noise, p.x[i], p.y[i] - kStep, p.z[i])) / (2 * kStep);
      const double dz = (value(noise, p.x[i], p.y[i], p.z[i] + kStep) - value(noise, p.x[i], p.y[i], p.z[i] - kStep)) / (2 * kStep);
      worst = std::max({worst, std::abs(dx - g[0][i]), std::abs(dy - g[1][i]), std::abs(dz - g[2][i])});
    }
    EXPECT_LT(worst, 4e-9);
  }
}

TEST(Noise, RepeatsBitForBit) {
  const Noise noise{11, {5, 8, 1}};
  std::mt19937 random(4);
  for (int i = 0; i < 5000; ++i) {
    // Multiples of 2⁻¹⁶: adding a period to them is exact.
    const double x = static_cast<int>(random() % 4000000) / 65536.0 - 30, y = static_cast<int>(random() % 4000000) / 65536.0 - 30, z = static_cast<int>(random() % 4000000) / 65536.0 - 30;
    const double v = value(noise, x, y, z);
    EXPECT_EQ(bits(v), bits(value(noise, x + 5, y, z)));
    EXPECT_EQ(bits(v), bits(value(noise, x, y - 16, z)));
    EXPECT_EQ(bits(v), bits(value(noise, x, y, z + 1)));
    EXPECT_EQ(bits(v), bits(value(noise, x - 500, y + 80, z - 7)));
  }
  EXPECT_NE(value(noise, 0.5, 0.5, 0.5), value(noise, 1.5, 0.5, 0.5));
}

TEST(Noise, DoesNotDependOnTheBatch) {
  const Points p(1000, -20, 20);
  const std::vector<double> all = values({1, {0, 0, 0}}, p);
  for (std::size_t i = 0; i < p.size(); ++i) EXPECT_EQ(bits(all[i]), bits(value({1, {0, 0, 0}}, p.x[i], p.y[i], p.z[i])));
}

// What this program has once made stays what it makes: hash of 64 values' bits.
TEST(Noise, GivesTheSameBytesEverywhere) {
  const Points p(4096, -1000, 1000, 9);
  const std::vector<double> v = values({42, {0, 0, 0}}, p);
  std::uint64_t hash = 1469598103934665603ull;
  for (const double x : v) hash = (hash ^ bits(x)) * 1099511628211ull;
  EXPECT_EQ(hash, 6607717733846962039ull);
}

TEST(Noise, SaysNaNWhereAPointIsNotFinite) {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {inf, -inf, nan}) {
    EXPECT_TRUE(std::isnan(value({}, bad, 0.5, 0.5)));
    EXPECT_TRUE(std::isnan(value({}, 0.5, bad, 0.5)));
    EXPECT_TRUE(std::isnan(value({0, {3, 3, 3}}, 0.5, 0.5, bad)));
  }
  EXPECT_TRUE(std::isfinite(value({}, 1e300, -1e300, 0x1p51)));
  EXPECT_TRUE(std::isfinite(value({0, {7, 7, 7}}, 1e300, -1e300, 0x1p50)));
}

TEST(Noise, RangeHoldsEveryValue) {
  std::mt19937_64 random(2);
  const auto next = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  double widest_small = 0;
  for (int b = 0; b < 2000; ++b) {
    const double size = std::pow(10, -6 * next()) * 2;
    const V3d at(next() * 40 - 20, next() * 40 - 20, next() * 40 - 20);
    const Box3d box(at, at + V3d(size * next(), size * next(), size));
    const Noise noise{static_cast<std::uint32_t>(b), b % 2 ? V3i(3, 4, 5) : V3i(0, 0, 0)};
    const Interval range = noise_range(noise, box);
    if (size < 1e-4) widest_small = std::max(widest_small, (range.high - range.low) / size);
    for (int i = 0; i < 60; ++i) {
      const V3d t(i == 0 ? 0 : i == 1 ? 1 : next(), i == 0 ? 0 : i == 1 ? 1 : next(), i == 0 ? 0 : i == 1 ? 1 : next());
      const double v = value(noise, box.min.x + t.x * (box.max.x - box.min.x), box.min.y + t.y * (box.max.y - box.min.y), box.min.z + t.z * (box.max.z - box.min.z));
      ASSERT_GE(v, range.low);
      ASSERT_LE(v, range.high);
    }
  }
  EXPECT_LT(widest_small, 20);  // closes in: width <= slope · size, slopes being a few cells⁻¹ for each of three axes
  EXPECT_EQ(noise_range({}, Box3d(V3d(0, 0, 0), V3d(100, 1, 1))).high, kNoiseBound);
}

TEST(Octaves, FadeBetweenFourAndTwoVoxels) {
  EXPECT_EQ(octave_weight(4.0, 1.0), 1.0);
  EXPECT_EQ(octave_weight(2.0, 1.0), 0.0);
  EXPECT_EQ(octave_weight(1.0, 1.0), 0.0);
  EXPECT_EQ(octave_weight(3.0, 1.0), 0.5);
  EXPECT_EQ(octave_weight(1.0, 0.0), 1.0);
  // No jump: slope at most 1.5/2 per voxel of cell size.
  for (double c = 1.5; c < 4.5; c += 0.01) EXPECT_LE(std::abs(octave_weight(c + 0.01, 1) - octave_weight(c, 1)), 0.0076);
}

double octaves_at(const Octaves& o, const V3d& p) {
  double v = 0;
  octave_values(o, 1, &p.x, &p.y, &p.z, &v);
  return v;
}

TEST(Octaves, TooFineOnesAreTheirMean) {
  Octaves o;
  o.count = 6;
  o.filter = 0.1;  // cells 1, ½, ¼ voxels of 0.1 wide: 10, 5, 2.5, then below two
  Octaves three = o;
  three.count = 3;
  for (int i = 0; i < 100; ++i) {
    const V3d p(i * 0.137, i * 0.071 - 3, i * 0.053);
    EXPECT_EQ(octaves_at(o, p), octaves_at(three, p));
  }
  o.turbulence = three.turbulence = true;
  const double missing = kNoiseMeanAbs * (1.0 / 8 + 1.0 / 16 + 1.0 / 32);
  for (int i = 0; i < 100; ++i) {
    const V3d p(i * 0.137, i * 0.071 - 3, i * 0.053);
    EXPECT_NEAR(octaves_at(o, p), octaves_at(three, p) + missing, 1e-15);
  }
  o.filter = 100;
  EXPECT_NEAR(octaves_at(o, V3d(0.3, 0.4, 0.5)), octave_mean(o), 1e-15);
}

TEST(Octaves, TurbulenceHasItsMean) {
  Octaves o;
  o.turbulence = true;
  o.frequency = 3;
  constexpr std::size_t kCount = 300'000;
  const Points p(kCount, -1e4, 1e4);
  std::vector<double> v(kCount);
  octave_values(o, kCount, p.x.data(), p.y.data(), p.z.data(), v.data());
  double mean = 0, square = 0;
  for (const double x : v) { mean += x / kCount; square += x * x / kCount; }
  EXPECT_NEAR(mean, octave_mean(o), 5 * std::sqrt((square - mean * mean) / kCount));
}

TEST(Octaves, DerivativeAndRange) {
  std::mt19937_64 random(3);
  const auto next = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (int kind = 0; kind < 3; ++kind) {
    Octaves o;
    o.turbulence = kind == 1;
    o.frequency = 1.7;
    o.count = 5;
    o.filter = kind == 2 ? 0.03 : 0;
    o.period = kind == 2 ? V3i(3, 3, 3) : V3i(0, 0, 0);
    const double step = 1e-6;
    for (int i = 0; i < 400; ++i) {
      const V3d p(next() * 8 - 4, next() * 8 - 4, next() * 8 - 4);
      double v = 0;
      V3d g;
      octave_gradients(o, 1, &p.x, &p.y, &p.z, &v, &g.x, &g.y, &g.z);
      EXPECT_EQ(bits(v), bits(octaves_at(o, p)));
      for (int a = 0; a < 3; ++a) {
        V3d q = p, r = p;
        q[a] += step;
        r[a] -= step;
        const double slope = (octaves_at(o, q) - octaves_at(o, r)) / (2 * step);
        // Truncation: step²/6·Σ gainⁱ·(2ⁱ·1.7)³·200 = 2e-7. A crease between the two points is allowed for by leaving it out.
        const bool crease = o.turbulence && std::abs(octaves_at(o, q) + octaves_at(o, r) - 2 * v) > 1e-8;
        EXPECT_NEAR(slope, crease ? slope : g[a], 1e-6) << kind;
      }
      const Box3d box(p, p + V3d(next(), next(), next()) * std::pow(10, -4 * next()));
      const Interval range = octave_range(o, box);
      for (int k = 0; k < 30; ++k) {
        const double w = octaves_at(o, V3d(box.min.x + next() * box.size().x, box.min.y + next() * box.size().y, box.min.z + next() * box.size().z));
        ASSERT_GE(w, range.low);
        ASSERT_LE(w, range.high);
      }
    }
  }
}

}  // namespace
}  // namespace texel
