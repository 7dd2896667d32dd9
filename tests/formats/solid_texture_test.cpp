#include "formats/solid_textures.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <random>

namespace texel {
namespace {

V3d random_point(std::mt19937_64& random, double reach) {
  const auto next = [&] { return (static_cast<double>(random() >> 11) * 0x1p-53 * 2 - 1) * reach; };
  const double x = next(), y = next(), z = next();
  return {x, y, z};
}

TEST(SolidNoise, IsAColourAndFadesToOne) {
  std::mt19937_64 random(1);
  for (const char* name : {"marble", "wood", "granite"}) {
    SolidKind kind{};
    ASSERT_TRUE(find_solid_texture(name, &kind));
    const auto texture = make_solid_texture(kind, 0.5, 3);
    V3f low(1, 1, 1), high(0, 0, 0), low_wide(1, 1, 1), high_wide(0, 0, 0);
    for (int i = 0; i < 3000; ++i) {
      const V3d p = random_point(random, 5);
      const V3f sharp = texture->color(p, V3d(0, 0, 1), 0), wide = texture->color(p, V3d(0, 0, 1), 100);
      for (int c = 0; c < 3; ++c) {
        ASSERT_GE(sharp[c], 0);
        ASSERT_LE(sharp[c], 1);
        low[c] = std::min(low[c], sharp[c]);
        high[c] = std::max(high[c], sharp[c]);
        low_wide[c] = std::min(low_wide[c], wide[c]);
        high_wide[c] = std::max(high_wide[c], wide[c]);
      }
    }
    EXPECT_GT(high.x - low.x, 0.15) << name;
    EXPECT_LT(high_wide.x - low_wide.x, 1e-6) << name;  // seen from afar it has one colour
  }
  SolidKind kind{};
  EXPECT_FALSE(find_solid_texture("cheese", &kind));
}

std::shared_ptr<Image> gradient_picture(int w, int h, float blue) {
  auto picture = std::make_shared<Image>();
  picture->width = w;
  picture->height = h;
  picture->channels = 3;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x)
      for (const float c : {static_cast<float>(x) / static_cast<float>(w), static_cast<float>(h - 1 - y) / static_cast<float>(h), blue}) picture->pixels.push_back(c);
  return picture;
}

// Where the surface faces an axis the colour is that plane's pixel, at the place and with the sense that the header states.
TEST(PlaneTexture, FacingAnAxisItIsThatPicture) {
  const int n = 16;
  const double size = 4;
  const auto texture = make_plane_texture({gradient_picture(n, n, 0.1f), gradient_picture(n, n, 0.2f), gradient_picture(n, n, 0.3f)}, size, PlaneBlend::kNormal);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double u = (i + 0.5) / n * size, v = (j + 0.5) / n * size;
      const V3f expected(static_cast<float>(i) / n, static_cast<float>(j) / n, 0);
      const V3f x = texture->color(V3d(7, u, v), V3d(1, 0, 0), 0), y = texture->color(V3d(u, -3, v), V3d(0, -1, 0), 0), z = texture->color(V3d(u, v, 9), V3d(0, 0, 1), 0);
      EXPECT_TRUE(x.equalWithAbsError(expected + V3f(0, 0, 0.1f), 1e-6f));
      EXPECT_TRUE(y.equalWithAbsError(expected + V3f(0, 0, 0.2f), 1e-6f));
      EXPECT_TRUE(z.equalWithAbsError(expected + V3f(0, 0, 0.3f), 1e-6f));
      EXPECT_TRUE(z.equalWithAbsError(texture->color(V3d(u + size, v - 2 * size, 9), V3d(0, 0, 1), 0), 1e-6f));
    }
  // Between two axes: both planes alike.
  const V3f edge = texture->color(V3d(1, 1, 1), V3d(1, 1, 0) / std::sqrt(2.0), 0);
  EXPECT_NEAR(edge.z, 0.15f, 1e-6f);
  // From afar: the pictures' mean, (n − 1)/2n in red and green.
  EXPECT_NEAR(texture->color(V3d(1.3, 2.1, 0.7), V3d(0, 0, 1), 1000).x, 7.5 / 16, 1e-6);
}

TEST(PlaneTexture, SumKeepsMeanAndContrast) {
  auto noise = [](unsigned seed) {
    std::mt19937 random(seed);
    auto picture = std::make_shared<Image>();
    picture->width = picture->height = 64;
    picture->channels = 1;
    for (int i = 0; i < 64 * 64; ++i) picture->pixels.push_back(0.35f + 0.3f * static_cast<float>(random() % 1000) / 1000.0f);
    return picture;
  };
  const auto texture = make_plane_texture({noise(1), noise(2), noise(3)}, 1, PlaneBlend::kSum);
  std::mt19937_64 random(5);
  double mean = 0, square = 0;
  constexpr int kCount = 100000;
  for (int i = 0; i < kCount; ++i) {
    V3d p = random_point(random, 10);
    for (int a = 0; a < 3; ++a) p[a] = (std::floor(p[a] * 64) + 0.5) / 64;  // on pixels: no bilinear smoothing
    const double v = static_cast<double>(texture->color(p, V3d(0, 0, 0), 0).x);
    mean += v / kCount;
    square += v * v / kCount;
  }
  // Uniform over 0.3: variance 0.0075. The pictures' own 4096 pixels leave 0.3/√12/64·5 on the mean and 3 % on the variance.
  EXPECT_NEAR(mean, 0.5, 0.007);
  EXPECT_NEAR(square - mean * mean, 0.0075, 0.0003);
}

TEST(WrapStep, TellsWhatTiles) {
  EXPECT_LT(wrap_step(*gradient_picture(1, 1, 0)).x, kSeam);
  EXPECT_GT(wrap_step(*gradient_picture(64, 64, 0)).x, 20);  // a ramp: the border jumps by all of it
  Image wave;
  wave.width = wave.height = 64;
  wave.channels = 1;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) wave.pixels.push_back(0.5f + 0.4f * static_cast<float>(std::sin(2 * M_PI * x / 64) * std::cos(2 * M_PI * y / 64)));
  EXPECT_NEAR(wrap_step(wave).x, 1, 0.6);  // the step at the border is that of the sine's steepest place, π/2 of the mean
  EXPECT_NEAR(wrap_step(wave).y, 1, 1);
  const std::string folder = TEXEL_SHARED_DATA "/textures/";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "not there: " << folder;
  const WrapStep brick = wrap_step(read_image(folder + "brick.png")), wood = wrap_step(read_image(folder + "wood_color.jpg")), pattern = wrap_step(read_image(folder + "PeriodicPattern.exr"));
  std::printf("wrap step over inner step: brick %.1f %.1f, wood %.1f %.1f, pattern %.1f %.1f\n", brick.x, brick.y, wood.x, wood.y, pattern.x, pattern.y);
  EXPECT_GT(std::max(brick.x, brick.y), kSeam);
  EXPECT_LT(std::max(wood.x, wood.y), kSeam);
  EXPECT_LT(std::max(pattern.x, pattern.y), kSeam);
}

TEST(Zoom, WeightsSumToOneAndCyclesMeet) {
  for (int i = 0; i <= 1000; ++i) {
    double sum = 0;
    for (const double w : zoom_weights(i / 1000.0)) {
      EXPECT_GE(w, 0);
      sum += w;
    }
    EXPECT_NEAR(sum, 1, 3e-16);
  }
  const auto start = zoom_weights(0), end = zoom_weights(1);
  EXPECT_EQ(start[0], 0);
  EXPECT_EQ(end[3], 0);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(end[i], start[i + 1]);
}

TEST(Zoom, SourceRepeatsAndTheCycleDoesNotJump) {
  const auto texture = make_octave_source(8, 4);
  const auto source = [&](const V3d& p) { return static_cast<double>(texture->color(p, V3d(0, 0, 0), 0).x); };
  std::mt19937_64 random(8);
  double mean = 0, square = 0;
  for (int i = 0; i < 20000; ++i) {
    // Multiples of 2⁻²⁰: adding a period to them is exact.
    V3d p = random_point(random, 1);
    for (int a = 0; a < 3; ++a) p[a] = std::floor(p[a] * 0x1p20) * 0x1p-20;
    const float v = static_cast<float>(source(p));
    for (const V3d& period : {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1), V3d(-3, 2, 5)})
      ASSERT_EQ(std::bit_cast<std::uint32_t>(v), std::bit_cast<std::uint32_t>(static_cast<float>(source(p + period))));
    ASSERT_GT(v, 0);
    ASSERT_LT(v, 1);
    mean += static_cast<double>(v) / 20000;
    square += static_cast<double>(v) * static_cast<double>(v) / 20000;
    if (i > 2000) continue;
    EXPECT_EQ(zoom_value(source, p, 1), zoom_value(source, p, 2));
    EXPECT_EQ(zoom_value(source, p, 1), zoom_value(source, p, 0.25));
    // Just before the end of a cycle: as near to its end as the step, times the slopes of the four octaves.
    EXPECT_NEAR(zoom_value(source, p, 2 - 1e-7), zoom_value(source, p, 2), 1e-7 * 200);
  }
  EXPECT_NEAR(mean, 0.5, 0.01);
  EXPECT_NEAR(std::sqrt(square - mean * mean), 0.19094 * 0.5 / 0.866026, 0.005);
}

}  // namespace
}  // namespace texel
