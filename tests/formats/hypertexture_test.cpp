#include "formats/hypertexture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace texel {
namespace {

double density_at(const Field& field, const V3d& p) {
  double d = 0;
  field.values(1, &p.x, &p.y, &p.z, &d);
  return d;
}

TEST(Curves, BiasAndGainKeepTheEnds) {
  for (const double k : {0.01, 0.3, 0.5, 0.9, 0.99}) {
    EXPECT_EQ(bias_curve(0, k), 0);
    EXPECT_EQ(bias_curve(1, k), 1);
    EXPECT_EQ(gain_curve(0, k), 0);
    EXPECT_EQ(gain_curve(1, k), 1);
    EXPECT_NEAR(bias_curve(0.5, k), k, 1e-15);
    EXPECT_NEAR(gain_curve(0.5, k), 0.5, 1e-15);
    for (double t = 0.01; t < 1; t += 0.01) {
      EXPECT_GT(bias_curve(t, k), bias_curve(t - 0.01, k));
      EXPECT_GT(gain_curve(t, k), gain_curve(t - 0.01, k));
      EXPECT_NEAR(gain_curve(t, k) + gain_curve(1 - t, k), 1, 1e-14);
    }
  }
  for (double t = 0; t <= 1; t += 0.125) EXPECT_EQ(bias_curve(t, 0.5), t);
}

class Presets : public ::testing::TestWithParam<const char*> {};

// Gradients of all but fur are analytic: central differences of step 1e-6 agree but for their own truncation (step²·|f‴|, here below 1e-4 of the
// slopes, which go up to some hundreds) and at the ends of the soft region, where the derivative jumps: at most a few points of 3000.
TEST_P(Presets, GradientIsThatOfTheDensity) {
  Hypertexture h;
  ASSERT_TRUE(find_hypertexture(GetParam(), &h));
  h.bias = 0.4;
  h.gain = 0.6;
  for (const double filter : {0.0, 0.05}) {
    const std::shared_ptr<const Field> density = make_density(h, filter);
    std::mt19937_64 random(1);
    const auto next = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 * 3 - 1.5; };
    int off = 0, sloped = 0;
    for (int i = 0; i < 3000; ++i) {
      const V3d p(next(), next(), next());
      double d = 0;
      V3d g;
      density->gradients(1, &p.x, &p.y, &p.z, &d, &g.x, &g.y, &g.z);
      ASSERT_EQ(d, density_at(*density, p));
      ASSERT_GE(d, 0);
      ASSERT_LE(d, 1);
      sloped += g.length() > 0;
      for (int a = 0; a < 3; ++a) {
        V3d q = p, r = p;
        q[a] += 1e-6;
        r[a] -= 1e-6;
        const double slope = (density_at(*density, q) - density_at(*density, r)) / 2e-6;
        off += std::abs(slope - g[a]) > 1e-3 * (1 + std::abs(slope));
      }
    }
    EXPECT_GT(sloped, 15);
    EXPECT_LE(off, h.preset == HypertexturePreset::kFur ? 60 : 6) << filter;  // fur's own differences are of 5e-6: creases weigh more
  }
}

TEST_P(Presets, RangeAndBoundsHoldTheDensity) {
  Hypertexture h;
  ASSERT_TRUE(find_hypertexture(GetParam(), &h));
  const std::shared_ptr<const Field> density = make_density(h, 0.02);
  const Box3d bounds = density->bounds(0);
  ASSERT_FALSE(bounds.isEmpty());
  std::mt19937_64 random(2);
  const auto next = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  int empty = 0, full = 0;
  for (int b = 0; b < 3000; ++b) {
    const V3d at(next() * 6 - 3, next() * 6 - 3, next() * 6 - 3);
    const Box3d box(at, at + V3d(next(), next(), next()) * std::pow(10, -3 * next()));
    const Interval range = density->range(box);
    empty += range.high <= 0;
    full += range.low >= 1;
    for (int i = 0; i < 20; ++i) {
      const V3d p(box.min.x + next() * box.size().x, box.min.y + next() * box.size().y, box.min.z + next() * box.size().z);
      const double d = density_at(*density, p);
      ASSERT_GE(d, range.low);
      ASSERT_LE(d, range.high);
      ASSERT_TRUE(d == 0 || bounds.intersects(p));
    }
  }
  EXPECT_GT(empty, 300);
  EXPECT_GE(full, h.preset == HypertexturePreset::kMarble ? 0 : 1);
}

// Seen through voxels as large as the shape, no noise is left: nothing of the value depends on the seed.
TEST_P(Presets, FadesToItsMean) {
  Hypertexture h, other;
  ASSERT_TRUE(find_hypertexture(GetParam(), &h));
  other = h;
  other.seed = 99;
  const std::shared_ptr<const Field> a = make_density(h, 10), b = make_density(other, 10), fine = make_density(h, 0);
  double difference = 0;
  for (int i = 0; i < 200; ++i) {
    const V3d p(std::sin(i) * 0.99, std::cos(i * 1.7) * 0.6, std::sin(i * 0.3) * 0.5);
    // Fur's mean is taken over 4096 values of its own noise: 0.5/√4096 of deviation, five of them.
    EXPECT_NEAR(density_at(*a, p), density_at(*b, p), 0.04);
    difference += std::abs(density_at(*a, p) - density_at(*fine, p));
  }
  EXPECT_GT(difference, 0.1);
}

TEST_P(Presets, ColoursAreColours) {
  Hypertexture h;
  ASSERT_TRUE(find_hypertexture(GetParam(), &h));
  const std::shared_ptr<const SolidTexture> color = hypertexture_color(h);
  for (int i = 0; i < 200; ++i) {
    const V3f c = color->color(V3d(std::sin(i), std::cos(i * 1.7), std::sin(i * 0.3)), V3d(0, 0, 1), 0.01);
    for (int k = 0; k < 3; ++k) {
      EXPECT_GE(c[k], 0);
      EXPECT_LE(c[k], 1);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Presets, ::testing::Values("eroded", "fire", "marble", "fur"), [](const auto& preset) { return std::string(preset.param); });

TEST(Hypertexture, KnowsItsPresets) {
  Hypertexture h;
  EXPECT_FALSE(find_hypertexture("cloud", &h));
  for (const char* name : {"fog", "eroded", "fire", "marble", "fur"}) {
    ASSERT_TRUE(find_hypertexture(name, &h));
    EXPECT_STREQ(hypertexture_name(h.preset), name);
  }
}

}  // namespace
}  // namespace texel
