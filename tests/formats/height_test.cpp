// Pictures as heights: what is stored arrives exactly, what is no data does not arrive.
#include <png.h>

#include <cmath>
#include <limits>

#include "formats/read.h"
#include "tests/formats/made_tiff.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::string write_png_bytes(const std::string& path, int color_type, int depth, int width, int height, const std::vector<unsigned char>& bytes) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), depth, color_type, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  const std::size_t row = bytes.size() / static_cast<std::size_t>(height);
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) png_write_row(png, bytes.data() + y * row);
  png_write_end(png, nullptr);
  png_destroy_write_struct(&png, &info);
  std::fclose(file);
  return path;
}

HeightField read_field(const std::string& path, const HeightOptions& options = {}, Report* report = nullptr) {
  Report own;
  const Scene scene = read_scene(std::span(&path, 1), {.implicit = {}, .iso = {}, .heights = options}, report ? *report : own);
  EXPECT_EQ(scene.heights.size(), 1u);
  return scene.heights.front();
}

TEST(Samples, EverySixteenBitValueIsExact) {
  const TestFolder folder;
  std::vector<unsigned char> bytes;
  for (int i = 0; i < 65536; ++i) {
    bytes.push_back(static_cast<unsigned char>(i >> 8));
    bytes.push_back(static_cast<unsigned char>(i & 255));
  }
  const Samples samples = read_samples(write_png_bytes(folder.file("all.png"), PNG_COLOR_TYPE_GRAY, 16, 256, 256, bytes));
  EXPECT_EQ(samples.full, 65535);
  ASSERT_EQ(samples.values.size(), 65536u);
  for (int i = 0; i < 65536; ++i) ASSERT_EQ(samples.values[static_cast<std::size_t>(i)], i);
}

TEST(Samples, EightBitsAreNotDecoded) {
  const TestFolder folder;
  const Samples samples = read_samples(write_png_bytes(folder.file("a.png"), PNG_COLOR_TYPE_GRAY, 8, 2, 2, {0, 1, 128, 255}));
  EXPECT_EQ(samples.full, 255);
  EXPECT_EQ(samples.values, (std::vector<double>{0, 1, 128, 255}));
}

TEST(Samples, LuminanceOfColorAndExactlyTheGrey) {
  const TestFolder folder;
  const Samples samples = read_samples(write_png_bytes(folder.file("a.png"), PNG_COLOR_TYPE_RGB, 8, 3, 1, {255, 0, 0, 0, 100, 50, 77, 77, 77}));
  EXPECT_NEAR(samples.values[0], 0.2126 * 255, 1e-12);
  EXPECT_NEAR(samples.values[1], 0.7152 * 100 + 0.0722 * 50, 1e-12);
  EXPECT_EQ(samples.values[2], 77);
}

TEST(Samples, AlphaNothingIsNoDataAndAlphaSomethingChangesNothing) {
  const TestFolder folder;
  const Samples samples = read_samples(write_png_bytes(folder.file("a.png"), PNG_COLOR_TYPE_RGB_ALPHA, 8, 3, 1, {9, 9, 9, 0, 200, 200, 200, 1, 30, 30, 30, 255}));
  EXPECT_TRUE(std::isnan(samples.values[0]));
  EXPECT_EQ(samples.values[1], 200);
  EXPECT_EQ(samples.values[2], 30);
}

TEST(Samples, FloatsAreExactBelowNothingAndAboveOne) {
  const TestFolder folder;
  const std::vector<float> values{-1.5f, 0, 2.25f, 1e-30f, 3.4e38f, 0.1f};
  for (const bool big : {false, true}) {
    const Samples samples = read_samples(folder.write("f.tif", tiff_bytes({.width = 3, .height = 2, .samples = stored(values, big), .big_endian = big})));
    EXPECT_EQ(samples.full, 1);
    ASSERT_EQ(samples.values.size(), values.size());
    for (std::size_t i = 0; i < values.size(); ++i) EXPECT_EQ(samples.values[i], static_cast<double>(values[i]));
  }
}

TEST(Samples, WideIntegersAreExactAndDoublesRefused) {
  const TestFolder folder;
  const std::string real = folder.write("d.tif", tiff_bytes({.width = 2, .bits = 64, .samples = stored<double>({0.1, -1e300})}));
  EXPECT_EQ(error_of([&] { (void)read_samples(real); }), "2: " + real + ": has 64-bit floats, which are not read reliably; save the picture again, as 16-bit PNG or 32-bit float TIFF");
  const Samples whole = read_samples(folder.write("u.tif", tiff_bytes({.width = 2, .kind = 1, .samples = stored<std::uint32_t>({4294967295u, 16777217u})})));
  EXPECT_EQ(whole.values, (std::vector<double>{4294967295.0, 16777217.0}));
  EXPECT_EQ(whole.full, 4294967295.0);
}

TEST(Samples, SignedIntegersKeepTheirSign) {
  const TestFolder folder;
  const Samples samples = read_samples(folder.write("s.tif", tiff_bytes({.width = 2, .bits = 16, .kind = 2, .samples = stored<std::int16_t>({-32768, 1234})})));
  EXPECT_EQ(samples.full, 32767);
  EXPECT_EQ(samples.values, (std::vector<double>{-32768, 1234}));
}

TEST(HeightField, ScaleAndExtent) {
  const TestFolder folder;
  const std::string png = write_png_bytes(folder.file("a.png"), PNG_COLOR_TYPE_GRAY, 8, 5, 3, {0, 255, 51, 0, 0, 0, 0, 0, 0, 0, 102, 0, 0, 0, 255});
  const HeightField plain = read_field(png);
  EXPECT_EQ(plain.size, V2d(1, 0.5));  // four steps by two
  EXPECT_EQ(plain.z[1], 0.25);
  EXPECT_DOUBLE_EQ(plain.z[2], 0.05);
  EXPECT_EQ(plain.base, -1.0 / 32);
  EXPECT_EQ(plain.low, 0);
  EXPECT_EQ(plain.high, 0.25);
  HeightOptions options;
  options.height = 7;
  options.extent = V2d(40, 10);
  options.base = -3;
  const HeightField asked = read_field(png, options);
  EXPECT_EQ(asked.size, V2d(40, 10));
  EXPECT_EQ(asked.z[1], 7);
  EXPECT_EQ(asked.z[10], 7 * 102.0 / 255);
  EXPECT_EQ(asked.base, -3);
}

TEST(HeightField, GeoTiffStatesItsScale) {
  const TestFolder folder;
  const std::string path = folder.write("dem.tif", tiff_bytes({.width = 3, .height = 2, .samples = stored<float>({-1, 0, 3, 5, 88, 2}), .scale_x = 90, .scale_y = 30}));
  const HeightField field = read_field(path);
  EXPECT_EQ(field.size, V2d(180, 30));
  EXPECT_EQ(field.z[4], 88);  // metres stay metres
  EXPECT_EQ(field.low, -1);
  HeightOptions half;
  half.extent = V2d(90, 15);
  EXPECT_EQ(read_field(path, half).z[4], 44);  // in proportion
}

TEST(HeightField, NoDataByTagByOptionByNan) {
  const TestFolder folder;
  const std::vector<float> values{1, 2, 3, -9999, 5, 6, 7, static_cast<float>(kNan), 9, 10, 11, 3.4e38f};
  const std::string path = folder.write("dem.tif", tiff_bytes({.width = 4, .height = 3, .samples = stored(values), .no_data = " -9999"}));
  HeightOptions options;
  options.no_data = 3.3999999521443642e38;  // the double that prints the float
  options.height = 1;
  Report report;
  const HeightField field = read_field(path, options, &report);
  for (const std::size_t i : {3u, 7u, 11u}) EXPECT_TRUE(std::isnan(field.z[i])) << i;
  EXPECT_EQ(field.z[0], 1);
  EXPECT_EQ(field.low, 1);   // of squares with four corners only: the last column has none
  EXPECT_EQ(field.high, 11);
  ASSERT_EQ(report.skipped.size(), 1u);
  EXPECT_NE(report.skipped[0].what.find("3 heights of"), std::string::npos);
}

TEST(HeightField, InfiniteHeightsAreHolesWithAWarning) {
  const TestFolder folder;
  const float inf = std::numeric_limits<float>::infinity();
  Report report;
  const HeightField field = read_field(folder.write("i.tif", tiff_bytes({.width = 3, .height = 2, .samples = stored<float>({0, 1, inf, 0, 1, 0})})), {}, &report);
  EXPECT_TRUE(std::isnan(field.z[2]));
  const Issue* issue = find_issue(report, "height-infinite");
  ASSERT_TRUE(issue);
  EXPECT_EQ(issue->count, 1);
}

TEST(HeightField, TooSteepIsSaid) {
  const TestFolder folder;
  Report report;
  (void)read_field(folder.write("i.tif", tiff_bytes({.width = 2, .height = 2, .samples = stored<float>({0, 1, 2, 88})})), {}, &report);
  EXPECT_TRUE(find_issue(report, "height-steep"));
}

TEST(HeightField, JoinsMeshesAndKeepsItsColor) {
  const TestFolder folder;
  const std::string png = write_png_bytes(folder.file("h.png"), PNG_COLOR_TYPE_GRAY, 8, 2, 2, {0, 1, 2, 3});
  const std::string color = write_png_bytes(folder.file("c.png"), PNG_COLOR_TYPE_RGB_ALPHA, 8, 1, 1, {255, 0, 0, 9});
  const std::string obj = folder.write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  HeightOptions options;
  options.color = color;
  Report report;
  const std::vector<std::string> paths{obj, png};
  const Scene scene = read_scene(paths, {.implicit = {}, .iso = {}, .heights = options}, report);
  ASSERT_EQ(scene.heights.size(), 1u);
  EXPECT_EQ(scene.heights[0].material, 1u);
  const Image image = scene.load_texture(scene.materials[1].map_kd.texture);
  EXPECT_EQ(image.channels, 3) << "its alpha would cut holes";
  EXPECT_EQ(image.pixels, (std::vector<float>{1, 0, 0}));
  ASSERT_EQ(scene.sources.size(), 3u);
  EXPECT_TRUE(scene.sources[0].input && scene.sources[1].input && !scene.sources[2].input);
}

TEST(HeightField, RefusalsNameTheFileAndTheValue) {
  const TestFolder folder;
  const std::string one = write_png_bytes(folder.file("one.png"), PNG_COLOR_TYPE_GRAY, 8, 3, 1, {1, 2, 3});
  EXPECT_EQ(error_of([&] { (void)read_field(one); }), "3: " + one + ": is no height field (3 x 1 pixels); give a picture of at least 2 x 2");
  const std::string text = folder.write("text.png", "no picture");
  EXPECT_EQ(error_of([&] { (void)read_field(text); }).substr(0, 3), "2: ");
  const std::string gone = folder.file("gone.png");
  EXPECT_EQ(error_of([&] { (void)read_field(gone); }).substr(0, 3), "2: ");
  const std::string empty = write_png_bytes(folder.file("empty.png"), PNG_COLOR_TYPE_GRAY_ALPHA, 8, 2, 2, {1, 0, 2, 9, 3, 9, 4, 9});
  EXPECT_EQ(error_of([&] { (void)read_field(empty); }), "3: " + empty + ": no four neighbouring pixels have data; check --no-data and the picture's alpha");
  const std::string good = write_png_bytes(folder.file("good.png"), PNG_COLOR_TYPE_GRAY, 8, 2, 2, {51, 51, 51, 255});
  HeightOptions options;
  options.height = 1;
  options.base = 0.25;
  EXPECT_EQ(error_of([&] { (void)read_field(good, options); }), "1: --base: 0.25 is above the lowest height of " + good + " (0.2); give a lower plane");
  options.base = 0;
  options.color = folder.file("gone.jpg");
  EXPECT_EQ(error_of([&] { (void)read_field(good, options); }), "2: " + options.color + ": picture not found; give --height-color a picture");
  const std::string huge = folder.write("huge.tif", tiff_bytes({.width = 2, .height = 2, .samples = stored<float>({0, 1, 2, 1e38f})}));
  options = {};
  options.height = 1e30;
  options.extent = V2d(1e30, 1e30);
  options.no_data = 7;
  EXPECT_EQ(read_field(huge, options).high, 1e38f * 1e30);
}

TEST(TiffTags, EveryLayout) {
  for (const bool big : {false, true})
    for (const bool wide : {false, true}) {
      const std::string bytes = tiff_bytes({.samples = stored<float>({1}), .no_data = "-32768", .scale_x = 2.5, .scale_y = 4, .big_endian = big, .wide = wide});
      const TiffTags tags = read_tiff_tags(bytes);
      ASSERT_TRUE(tags.no_data) << big << wide;
      EXPECT_EQ(*tags.no_data, -32768);
      EXPECT_EQ(tags.pixel_scale, V2d(2.5, 4));
    }
}

TEST(TiffTags, DamagedFilesHaveNone) {
  EXPECT_TRUE(std::isnan(*read_tiff_tags(tiff_bytes({.samples = stored<float>({1}), .no_data = "nan"})).no_data));
  const std::string bytes = tiff_bytes({.samples = stored<float>({1}), .no_data = "-32768.25", .scale_x = 2.5, .scale_y = 4});
  ASSERT_TRUE(read_tiff_tags(bytes).no_data);
  for (std::size_t length = 0; length < bytes.size(); ++length) EXPECT_FALSE(read_tiff_tags(std::span(bytes).first(length)).no_data) << length;
  for (std::size_t at = 0; at < bytes.size(); ++at)
    for (const char damage : {'\0', '\xff'}) {
      std::string other = bytes;
      other[at] = damage;
      (void)read_tiff_tags(other);  // must only not fall
    }
  EXPECT_FALSE(read_tiff_tags(std::string("II*\0", 4)).no_data);
}

TEST(PerlinField, RepeatsBitForBitAndReachesItsHeight) {
  HeightOptions options;
  options.perlin = {3, 4, 7};
  options.extent = V2d(3, 2);
  options.height = 0.7;
  Report report;
  const Scene scene = read_scene({}, {.implicit = {}, .iso = {}, .heights = options}, report);
  const HeightField& field = scene.heights.at(0);
  std::vector<double> x, y, z;
  double low = 1e9, high = -1e9;
  for (int i = 0; i <= 600; ++i) {
    const double t = i / 600.0;
    x.assign({0, 3, 3 * t, 3 * t});
    y.assign({2 * t, 2 * t, 0, 2});
    z.resize(4);
    field.function(4, x.data(), y.data(), z.data(), nullptr, nullptr);
    ASSERT_EQ(z[0], z[1]) << i;
    ASSERT_EQ(z[2], z[3]) << i;
    x.assign(601, 3 * t);
    y.clear();
    for (int j = 0; j <= 600; ++j) y.push_back(2 * j / 600.0);
    z.resize(601);
    field.function(601, x.data(), y.data(), z.data(), nullptr, nullptr);
    low = std::min(low, *std::min_element(z.begin(), z.end()));
    high = std::max(high, *std::max_element(z.begin(), z.end()));
  }
  EXPECT_EQ(field.low, 0);
  EXPECT_EQ(field.high, 0.7);
  // 25 samples a cell of the finest octave, whose curvature is below 0.7·(2π)²·½ a cell²: within 1 % of the height.
  EXPECT_LT(low, 0.007);
  EXPECT_GT(high, 0.693);
  EXPECT_GE(low, 0);
  EXPECT_LE(high, 0.7);
}

}  // namespace
}  // namespace texel
