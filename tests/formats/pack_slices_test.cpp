// Slices and preview as written, and as read back.
#include <gtest/gtest.h>

#include <Imath/half.h>

#include <cmath>

#include "formats/read_pack.h"
#include "tests/formats/write_test_util.h"

namespace texel::test {
namespace {

// Half a step of 8-bit sRGB around a linear value, in linear light.
float half_step_8bit(float linear) {
  const float code = linear_to_srgb(linear);
  return std::max(srgb_to_linear(code + 0.5f / 255) - linear, linear - srgb_to_linear(std::max(0.0f, code - 0.5f / 255)));
}

Image slice_of(const Pack& pack, int axis, int level, int k) {
  for (const SliceStack& s : pack.slices)
    if (s.axis == axis && s.level == level) return s.image(k);
  ADD_FAILURE() << "no stack";
  return {};
}

TEST(PackSlices, PngComesBackWithinHalfAStep) {
  const TempFolder folder;
  const Pack pack = ball_pack({.n = 20, .slice_levels = 1});
  save(pack, folder / "ball");
  const Pack back = read_pack(folder / "ball");
  ASSERT_EQ(back.slices.size(), 6u);
  for (const SliceStack& s : pack.slices)
    for (int k = 0; k < s.count; ++k) {
      const Image a = s.image(k), b = slice_of(back, s.axis, s.level, k);
      ASSERT_EQ(a.pixels.size(), b.pixels.size());
      for (std::size_t i = 0; i < a.pixels.size(); ++i) {
        // 1e-6: the float arithmetic of the transfer function. Colour under alpha 0 counts too: it has to run on.
        const float slack = i % 4 == 3 ? 0.5f / 255 : half_step_8bit(a.pixels[i]);
        ASSERT_NEAR(a.pixels[i], b.pixels[i], slack + 1e-6f) << "axis " << s.axis << " slice " << k << " value " << i;
      }
    }
}

TEST(PackSlices, ExrComesBackWithinHalfAStep) {
  const TempFolder folder;
  const Pack pack = ball_pack({.n = 20, .levels = 0});
  save(pack, folder / "ball", {.slice_format = SliceFormat::kExr});
  EXPECT_TRUE(fs::exists(folder / "ball/slices/z/0000.exr"));
  const Pack back = read_pack(folder / "ball");
  for (const SliceStack& s : pack.slices)
    for (int k = 0; k < s.count; ++k) {
      const Image a = s.image(k), b = slice_of(back, s.axis, s.level, k);
      ASSERT_EQ(a.pixels.size(), b.pixels.size());
      for (std::size_t i = 0; i < a.pixels.size(); i += 4) {
        const float alpha = a.pixels[i + 3];
        ASSERT_NEAR(alpha, b.pixels[i + 3], alpha * 0x1p-11f + 1e-7f);
        if (alpha < 1e-3f) continue;  // premultiplied: nothing is left of the colour
        // Half a step each of colour·alpha and of alpha; the quotient adds both.
        for (std::size_t c = 0; c < 3; ++c) ASSERT_NEAR(a.pixels[i + c], b.pixels[i + c], a.pixels[i + c] * 2 * 0x1p-11f + 1e-6f);
      }
    }
}

TEST(PackSlices, LieAsTheContractSays) {
  // One opaque voxel at (1, 2, 3) in a 5×6×7 grid: slice number, column and row (from the top) of each axis.
  const TempFolder folder;
  Pack pack;
  pack.grid = {V3d(0), 1, V3i(5, 6, 7)};
  BallLevel box{pack.grid, std::vector<BallCell>(5 * 6 * 7)};
  box.cells[box.at(1, 2, 3)].solid = 1;
  for (int axis = 0; axis < 3; ++axis)
    pack.slices.push_back({.axis = axis, .count = pack.grid.n[axis], .width = pack.grid.n[axis == 0 ? 1 : 0], .height = pack.grid.n[axis == 2 ? 1 : 2],
                           .thickness = 1, .image = [box, axis](int k) { return ball_slice(box, axis, k, V3f(1, 0, 0)); }});
  save(pack, folder / "box");
  struct { const char* file; int width, height, column, row; } expected[] = {
      {"slices/x/0001.png", 6, 7, 2, 7 - 1 - 3}, {"slices/y/0002.png", 5, 7, 1, 7 - 1 - 3}, {"slices/z/0003.png", 5, 6, 1, 6 - 1 - 2}};
  for (const auto& e : expected) {
    const Image image = read_image(folder / "box" + "/" + e.file);
    EXPECT_EQ(image.width, e.width);
    EXPECT_EQ(image.height, e.height);
    EXPECT_EQ(image.at(e.column, e.row)[3], 1) << e.file;
  }
}

TEST(PackSlices, RefusesAPictureOfTheWrongSize) {
  const TempFolder folder;
  Pack pack = ball_pack({.n = 8, .levels = 0});
  pack.slices[1].image = [](int) { return Image{3, 3, 4, std::vector<float>(36)}; };
  EXPECT_THROW(save(pack, folder / "ball"), Error);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(PackSlices, AskedForASliceThatIsNotThere) {
  const TempFolder folder;
  save(ball_pack({.n = 8, .levels = 0}), folder / "ball");
  const Pack back = read_pack(folder / "ball");
  EXPECT_THROW((void)back.slices[0].image(-1), Error);
  EXPECT_THROW((void)back.slices[0].image(8), Error);
  fs::remove(folder / "ball/slices/x/0003.png");
  EXPECT_THROW((void)back.slices[0].image(3), Error);
}

TEST(PackSlices, PreviewComesBack) {
  const TempFolder folder;
  const Pack pack = ball_pack({.n = 8, .levels = 0, .slices = false});
  save(pack, folder / "ball");
  const Image back = read_pack(folder / "ball").preview;
  ASSERT_EQ(back.width, pack.preview.width);
  ASSERT_EQ(back.height, pack.preview.height);
  for (std::size_t i = 0; i < back.pixels.size(); ++i) EXPECT_NEAR(back.pixels[i], pack.preview.pixels[i], half_step_8bit(pack.preview.pixels[i]) + 1e-6f);
}

}  // namespace
}  // namespace texel::test
