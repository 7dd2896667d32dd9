#include "formats/image.h"

#include <png.h>

#include <cmath>

#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

// Colours and alphas of all sizes, the first row transparent with colour under it.
Image sample(int channels, int width = 67, int height = 31) {
  Image image{width, height, channels, {}};
  std::uint32_t state = 1;
  for (int i = 0; i < width * height * channels; ++i) {
    state = state * 1664525u + 1013904223u;
    image.pixels.push_back(static_cast<float>(state >> 8) / 16777216.0f);
  }
  if (image.has_alpha())
    for (int x = 0; x < width; ++x) image.at(x, 0)[channels - 1] = 0;
  return image;
}

std::string bytes_of(const std::string& path) {
  const FileBytes file(path);
  return {file.bytes().data(), file.bytes().size()};
}

// An 8- or 16-bit PNG of any kind, by libpng's own writer.
void write_with_libpng(const std::string& path, int color_type, int depth, png_uint_32 width, const std::vector<unsigned char>& bytes, bool palette = false) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, width, 1, depth, color_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  const png_color colors[2] = {{255, 0, 0}, {0, 51, 255}};
  const png_byte alphas[2] = {255, 128};
  if (palette) {
    png_set_PLTE(png, info, colors, 2);
    png_set_tRNS(png, info, alphas, 2, nullptr);
  }
  png_write_info(png, info);
  png_write_row(png, bytes.data());
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
}

TEST(Srgb, TransferFunction) {
  EXPECT_EQ(srgb_to_linear(0), 0);
  EXPECT_EQ(srgb_to_linear(1), 1);
  EXPECT_EQ(linear_to_srgb(1), 1);
  EXPECT_EQ(linear_to_srgb(7), 1);
  EXPECT_EQ(linear_to_srgb(-1), 0);
  EXPECT_EQ(linear_to_srgb(std::nanf("")), 0);
  // IEC 61966-2-1: ((0.5 + 0.055)/1.055)^2.4; half a step of a float.
  EXPECT_NEAR(srgb_to_linear(0.5f), 0.2140411405, 1e-8);
  // Scaled rounding: each direction rounds once to float; the curve's slope is 12.92 at most.
  for (int i = 0; i <= 1000; ++i) EXPECT_NEAR(linear_to_srgb(srgb_to_linear(static_cast<float>(i) / 1000)), static_cast<float>(i) / 1000, 13 * 0x1p-24);
}

class PngRoundTrip : public ::testing::TestWithParam<int> {};

TEST_P(PngRoundTrip, WithinHalfAStep) {
  const TestFolder folder;
  const Image image = sample(GetParam());
  write_png(image, folder.file("a.png"));
  const Image back = read_image(folder.file("a.png"));
  ASSERT_EQ(back.width, image.width);
  ASSERT_EQ(back.height, image.height);
  ASSERT_EQ(back.channels, image.channels);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const bool alpha = image.has_alpha() && i % static_cast<std::size_t>(image.channels) == static_cast<std::size_t>(image.channels) - 1;
    const double a = alpha ? image.pixels[i] : linear_to_srgb(image.pixels[i]), b = alpha ? back.pixels[i] : linear_to_srgb(back.pixels[i]);
    ASSERT_NEAR(a, b, 0.501 / 255) << i;  // half a storage step, in the encoding stored
  }
  // What is stored comes back as the same bytes.
  write_png(back, folder.file("b.png"));
  EXPECT_EQ(bytes_of(folder.file("a.png")), bytes_of(folder.file("b.png")));
  const std::string bytes = bytes_of(folder.file("a.png"));
  EXPECT_NE(bytes.find("sRGB"), std::string::npos);
  EXPECT_EQ(bytes.find("tIME"), std::string::npos);
}
INSTANTIATE_TEST_SUITE_P(Channels, PngRoundTrip, ::testing::Values(1, 2, 3, 4));

TEST(Png, OddValuesAndPlaces) {
  const TestFolder folder;
  Image image{3, 1, 4, {std::nanf(""), -1, 2, std::nanf(""), 0, 0.5f, 1, -1, 1, 1, 1, 9}};
  write_png(image, folder.file("a.png"));
  const Image back = read_image(folder.file("a.png"), true);
  const std::vector<float> bytes = {0, 0, 255, 0, 0, 188, 255, 0, 255, 255, 255, 255};
  for (std::size_t i = 0; i < bytes.size(); ++i) EXPECT_EQ(back.pixels[i], bytes[i] / 255) << i;
  EXPECT_EQ(error_of([&] { write_png(image, folder.file("no/a.png")); }).substr(0, 2), "2:");
  EXPECT_EQ(error_of([&] { write_png(Image{}, folder.file("b.png")); }).substr(0, 2), "2:");
  image.pixels.pop_back();
  EXPECT_EQ(error_of([&] { write_png(image, folder.file("b.png")); }).substr(0, 2), "2:");
}

TEST(Png, CountsWhatItCannotHold) {
  const TestFolder folder;
  PixelCount count;
  // The last one repeats the one before it, which takes another way through the encoder.
  write_png({5, 1, 4, {1, 1, 1, 1, 0, 1.01f, 0, 1, 9, 9, 9, 0, 2, 2, 2, 0.5f, 2, 2, 2, 0.5f}}, folder.file("a.png"), &count);
  EXPECT_EQ(count.seen, 4);
  EXPECT_EQ(count.clipped, 3);
  write_png({2, 1, 3, {1, 1, 1, 1, 1, 2}}, folder.file("a.png"), &count);
  EXPECT_EQ(count.seen, 2);
  EXPECT_EQ(count.clipped, 1);
  write_png({1, 3, 3, {2, 1, 1, 2, 1, 1, 1, 1, 1}}, folder.file("a.png"), &count);  // so does a row like the one above it
  EXPECT_EQ(count.seen, 3);
  EXPECT_EQ(count.clipped, 2);
  EXPECT_EQ(read_image(folder.file("a.png")).pixels, std::vector<float>(9, 1.0f));
}

TEST(Png, FullDiskIsAnError) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "/dev/full is not there";
  EXPECT_EQ(error_of([] { write_png(sample(4, 300, 300), "/dev/full"); }).substr(0, 2), "2:");
  EXPECT_EQ(error_of([] { write_png(sample(1, 2, 2), "/dev/full"); }).substr(0, 2), "2:");
}

TEST(ReadImage, PngOfAllKinds) {
  const TestFolder folder;
  const std::string path = folder.file("a.png");
  // Alpha stays out of the colours, and is not decoded.
  write_with_libpng(path, PNG_COLOR_TYPE_RGB_ALPHA, 8, 2, {200, 100, 50, 64, 255, 128, 0, 0});
  Image image = read_image(path);
  ASSERT_EQ(image.channels, 4);
  EXPECT_EQ(image.pixels[0], srgb_to_linear(200.0f / 255));
  EXPECT_EQ(image.pixels[3], 64.0f / 255);
  EXPECT_EQ(image.pixels[5], srgb_to_linear(128.0f / 255)) << "colour under alpha 0 is kept";
  EXPECT_EQ(read_image(path, true).pixels[0], 200.0f / 255);
  write_with_libpng(path, PNG_COLOR_TYPE_GRAY_ALPHA, 8, 1, {51, 102});
  image = read_image(path);
  ASSERT_EQ(image.channels, 2);
  EXPECT_EQ(image.pixels, (std::vector<float>{srgb_to_linear(0.2f), 0.4f}));
  write_with_libpng(path, PNG_COLOR_TYPE_PALETTE, 8, 3, {1, 0, 1}, true);
  image = read_image(path);
  ASSERT_EQ(image.channels, 4);
  EXPECT_EQ(image.pixels[0], 0);
  EXPECT_EQ(image.pixels[1], srgb_to_linear(0.2f));
  EXPECT_EQ(image.pixels[3], 128.0f / 255);
  EXPECT_EQ(image.pixels[7], 1);
  // 16 bits stay 16 bits: neighbouring values differ by one step.
  write_with_libpng(path, PNG_COLOR_TYPE_GRAY, 16, 3, {0x12, 0x34, 0x12, 0x35, 0xff, 0xff});
  image = read_image(path, true);
  ASSERT_EQ(image.channels, 1);
  EXPECT_FLOAT_EQ(image.pixels[0], 0x1234 / 65535.0f);
  EXPECT_FLOAT_EQ(image.pixels[1], 0x1235 / 65535.0f);
  EXPECT_EQ(image.pixels[2], 1);
  EXPECT_FLOAT_EQ(read_image(path).pixels[0], srgb_to_linear(0x1234 / 65535.0f));
}

TEST(Exr, PremultipliedHalvesComeBackStraight) {
  const TestFolder folder;
  const std::string path = folder.file("a.exr");
  for (const int channels : {1, 3, 4}) {
    const Image image = sample(channels);
    write_exr(image, path);
    const Image back = read_image(path);
    ASSERT_EQ(back.channels, channels);
    for (int i = 0; i < image.width * image.height; ++i) {
      const float* a = image.pixels.data() + i * channels;
      const float* b = back.pixels.data() + i * channels;
      const bool has_alpha = image.has_alpha();
      if (has_alpha) {
        ASSERT_NEAR(a[3], b[3], a[3] * 0x1p-11);
      }
      // Half a step of a half (2^-11) for the colour and, where it is divided again, for alpha; below 2^-14 halves are coarser.
      if (has_alpha && a[3] < 0.01f) continue;
      for (int c = 0; c < (has_alpha ? 3 : channels); ++c)
        if (a[c] > 0.01f) {
          ASSERT_NEAR(a[c], b[c], a[c] * (has_alpha ? 1.01 * 0x1p-10 : 0x1p-11));
        }
    }
    write_exr(image, folder.file("b.exr"));
    EXPECT_EQ(bytes_of(path), bytes_of(folder.file("b.exr")));
  }
}

TEST(ReadImage, SharedTextures) {
  const std::string data = std::string(TEXEL_SHARED_DATA) + "/";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << data << " is not there";
  struct Row {
    const char* file;
    int width, height, channels;
  };
  for (const Row& row : {Row{"models/spot/spot_texture.png", 1024, 1024, 3}, Row{"models/bonsai/branches.png", 337, 150, 4}, Row{"models/bicycle/bicycle-texture.png", 512, 512, 4},
                         Row{"models/lily_vase/Leaf_rose_plain.png", 110, 182, 4}}) {
    const Image image = read_image(data + row.file);
    EXPECT_EQ(image.width, row.width) << row.file;
    EXPECT_EQ(image.height, row.height) << row.file;
    EXPECT_EQ(image.channels, row.channels) << row.file;
  }
  for (const char* file : {"textures/PeriodicPattern.exr", "textures/brick.png", "textures/bush.png", "textures/grass-sprite.png", "textures/wood_color.jpg"}) {
    const Image image = read_image(data + file);
    EXPECT_EQ(image.pixels.size(), static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * static_cast<std::size_t>(image.channels)) << file;
    for (const float v : image.pixels) ASSERT_TRUE(std::isfinite(v)) << file;
  }
}

TEST(ReadImage, MissingOrDamaged) {
  const TestFolder folder;
  EXPECT_EQ(error_of([&] { (void)read_image(folder.file("none.png")); }), "2: " + folder.file("none.png") + ": picture not found");
  EXPECT_EQ(error_of([&] { (void)read_image(folder.write("text.png", "hello")); }).substr(0, 2), "2:");
  EXPECT_EQ(error_of([&] { (void)read_image(folder.write("empty.jpg", "")); }).substr(0, 2), "2:");
  write_png(sample(3, 200, 200), folder.file("a.png"));
  const std::string bytes = bytes_of(folder.file("a.png"));
  EXPECT_EQ(error_of([&] { (void)read_image(folder.write("cut.png", bytes.substr(0, bytes.size() / 2))); }).substr(0, 2), "2:");
}

}  // namespace
}  // namespace texel
