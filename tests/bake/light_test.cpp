// Rays, light and textures against facts known in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "bake/light.h"
#include "bake/texture.h"
#include "tests/bake/made_scene.h"

namespace texel {
namespace {

using test::add_quad;
using test::empty_scene;

constexpr Light kSunDown{Light::Kind::kSun, V3d(0, 0, -1), V3f(2, 1, 0.5f)};

TEST(Irradiance, FollowsTheCosineAndTheSquareOfTheDistance) {
  const Light ambient{Light::Kind::kAmbient, V3d(0, 0, 0), V3f(0.25f, 0.5f, 0.125f)};
  const Light point{Light::Kind::kPoint, V3d(0, 0, 3), V3f(9, 9, 9)};
  for (const double angle : {0.0, 30.0, 60.0, 89.0}) {
    const double a = angle * std::numbers::pi / 180;
    const V3d n(std::sin(a), 0, std::cos(a));
    const Light both[] = {ambient, kSunDown};
    const V3f got = irradiance(both, nullptr, V3d(0, 0, 0), n, false);
    // Scaled rounding: a float sum of two terms below 3.
    EXPECT_NEAR(got.x, 0.25 + 2 * std::cos(a), 1e-6);
    EXPECT_NEAR(got.y, 0.5 + std::cos(a), 1e-6);
    const V3f near = irradiance({&point, 1}, nullptr, V3d(0, 0, 0), n, false);
    EXPECT_NEAR(near.x, std::cos(a), 1e-6);  // 9 at distance 1 is 1 at distance 3
  }
}

TEST(Irradiance, LightsBacksOnlyOfTwoSidedSurfaces) {
  const V3d down(0, 0, -1);
  EXPECT_EQ(irradiance({&kSunDown, 1}, nullptr, V3d(0, 0, 0), down, false), V3f(0, 0, 0));       // exact
  EXPECT_EQ(irradiance({&kSunDown, 1}, nullptr, V3d(0, 0, 0), down, true), V3f(2, 1, 0.5f));     // exact
}

TEST(RayScene, ShadowsWithoutShadingItself) {
  Scene scene = empty_scene();
  add_quad(scene, V3d(-10, -10, 0), V3d(20, 0, 0), V3d(0, 20, 0));
  add_quad(scene, V3d(-1, -1, 5), V3d(2, 0, 0), V3d(0, 2, 0));
  const RayScene rays(scene);
  const V3d up(0, 0, 1);
  EXPECT_EQ(irradiance({&kSunDown, 1}, &rays, V3d(0, 0, 0), up, false), V3f(0, 0, 0));           // exact: under the small one
  EXPECT_EQ(irradiance({&kSunDown, 1}, &rays, V3d(2, 0, 0), up, false), V3f(2, 1, 0.5f));        // exact: beside it
  const Light grazing{Light::Kind::kSun, V3d(-1, 0, -0.01), V3f(1, 1, 1)};
  for (int i = 0; i < 100; ++i) EXPECT_EQ(rays.visibility(grazing, V3d(3 + 0.05 * i, 0.03 * i - 1, 0), up), 1.0f);
}

TEST(RayScene, BlockedCountsTransparencyAndDistance) {
  Scene scene = empty_scene();
  scene.materials[0].opacity = 0.75f;
  for (const double z : {1.0, 2.0, 3.0}) add_quad(scene, V3d(-1.1, -1.2, z), V3d(2, 0, 0), V3d(0, 2, 0));
  const RayScene rays(scene);
  EXPECT_FLOAT_EQ(rays.blocked(V3d(0, 0, 0), V3d(0, 0, 0.5)), 0.0f);
  EXPECT_FLOAT_EQ(rays.blocked(V3d(0, 0, 0), V3d(0, 0, 1.5)), 0.75f);
  EXPECT_FLOAT_EQ(rays.blocked(V3d(0, 0, 0), V3d(0, 0, 9)), 1 - 0.25f * 0.25f * 0.25f);
  EXPECT_FLOAT_EQ(rays.blocked(V3d(0, 0, 1), V3d(0, 0, 2)), 0.0f);  // the open segment: both ends lie on surfaces
  EXPECT_FLOAT_EQ(rays.blocked(V3d(5, 0, 0), V3d(5, 0, 9)), 0.0f);
}

TEST(RayScene, IsAsExactFarFromTheOriginAndAtAnySize) {
  for (const double size : {1e-20, 1.0, 1e20})
    for (const double offset : {0.0, 1e6}) {
      Scene scene = empty_scene();
      const V3d o(offset * size, offset * size, -offset * size);
      add_quad(scene, o + V3d(-1, -1, 0) * size, V3d(2, 0, 0) * size, V3d(0, 2, 0) * size);
      const RayScene rays(scene);
      const RayScene::Hit hit = rays.first_hit(o + V3d(0.25, 0.5, 700) * size, V3d(0, 0, -1));
      ASSERT_NE(hit.triangle, kNoIndex) << size << " " << offset;
      EXPECT_TRUE(hit.front);
      // Scaled rounding: float steps at the scene's own size, and those of the double coordinates at its offset.
      EXPECT_NEAR(hit.distance / size, 700.0, 1e-6 + 1e-15 * offset);
      EXPECT_EQ(rays.first_hit(o + V3d(1.5, 0, 700) * size, V3d(0, 0, -1)).triangle, kNoIndex);
    }
}

TEST(RayScene, SurvivesNothingAndDegenerateInput) {
  Scene scene = empty_scene();
  EXPECT_EQ(RayScene(scene).first_hit(V3d(0, 0, 0), V3d(0, 0, 1)).triangle, kNoIndex);
  EXPECT_EQ(RayScene(scene).blocked(V3d(0, 0, 0), V3d(0, 0, 1)), 0.0f);
  add_quad(scene, V3d(1, 1, 1), V3d(0, 0, 0), V3d(0, 0, 0));
  add_quad(scene, V3d(1, 1, 1), V3d(1, 0, 0), V3d(2, 0, 0));
  const RayScene points(scene);
  EXPECT_EQ(points.first_hit(V3d(1, 1, 5), V3d(0, 0, 0)).triangle, kNoIndex);
  EXPECT_EQ(points.blocked(V3d(1, 1, 5), V3d(1, 1, 5)), 0.0f);
  const double bad = std::nan("");
  EXPECT_EQ(points.first_hit(V3d(bad, 1, 5), V3d(0, 0, 1)).triangle, kNoIndex);
}

TEST(RayScene, PrefersTheFrontOfCoincidentFaces) {
  for (const bool swapped : {false, true}) {
    Scene scene = empty_scene();
    const V3d a(0, 2, 0), b(2, 0, 0);
    add_quad(scene, V3d(-1, -1, 0), swapped ? a : b, swapped ? b : a);
    add_quad(scene, V3d(-1, -1, 0), swapped ? b : a, swapped ? a : b);
    const RayScene rays(scene);
    EXPECT_TRUE(rays.first_hit(V3d(0.3, 0.1, 4), V3d(0, 0, -1)).front);
    EXPECT_TRUE(rays.first_hit(V3d(0.3, 0.1, -4), V3d(0, 0, 1)).front);
  }
}

// A card whose picture has every other column cut out.
Scene striped_card() {
  Scene scene = empty_scene();
  add_quad(scene, V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0));
  scene.textures.push_back({"stripes.png", "stripes.png"});
  scene.materials[0].map_kd.texture = 0;
  scene.materials[0].kd = V3f(1, 1, 1);
  scene.load_texture = [](int) {
    Image image{8, 2, 4, {}};
    for (int i = 0; i < 16; ++i)
      for (const float v : {0.5f, i % 2 ? 9.0f : 0.25f, 0.125f, i % 2 ? 0.0f : 1.0f}) image.pixels.push_back(v);
    return image;
  };
  return scene;
}

TEST(TextureSet, AveragesStraightColourByAlpha) {
  const Scene scene = striped_card();
  Report report;
  const TextureSet textures(scene, TextureSet::Need::kColor, report);
  EXPECT_TRUE(textures.has_cutouts(0));
  for (const float footprint : {0.5f, 1.0f, 50.0f}) {
    const SurfaceSample s = textures.sample(0, V2f(0.3f, 0.6f), footprint);
    // Exact: means of powers of two; the colour under alpha 0 (9) counts nothing.
    EXPECT_FLOAT_EQ(s.coverage, 0.5f);
    EXPECT_EQ(s.color, V3f(0.5f, 0.25f, 0.125f));
  }
  const SurfaceSample texel = textures.sample(0, V2f(2.5f / 8, 0.25f), 0);
  EXPECT_FLOAT_EQ(texel.coverage, 1.0f);
  EXPECT_FLOAT_EQ(textures.coverage(0, V2f(3.5f / 8, 0.25f), 0), 0.0f);
  EXPECT_FLOAT_EQ(textures.coverage(0, V2f(3.0f / 8, 0.25f), 0), 0.5f);  // between two texel centres
}

TEST(TextureSet, PutsTheBottomRowAtZeroAndWrapsOrClamps) {
  Scene scene = striped_card();
  scene.load_texture = [](int) { return Image{2, 2, 3, {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1}}; };  // top: red green, bottom: blue white
  Report report;
  const TextureSet plain(scene, TextureSet::Need::kColor, report);
  EXPECT_FALSE(plain.has_cutouts(0));
  EXPECT_EQ(plain.sample(0, V2f(0.25f, 0.25f), 0).color, V3f(0, 0, 1));
  EXPECT_EQ(plain.sample(0, V2f(0.25f, 0.75f), 0).color, V3f(1, 0, 0));
  EXPECT_EQ(plain.sample(0, V2f(-3.75f, 5.75f), 0).color, V3f(1, 0, 0));
  EXPECT_EQ(plain.sample(0, V2f(0.0f, 0.75f), 0).color, V3f(0.5f, 0.5f, 0));  // half red, half green from the other side
  scene.materials[0].map_kd.wrap.fill(Wrap::kClamp);
  const TextureSet clamped(scene, TextureSet::Need::kColor, report);
  EXPECT_EQ(clamped.sample(0, V2f(-7.0f, 5.0f), 0).color, V3f(1, 0, 0));
  scene.materials[0].map_kd.wrap.fill(Wrap::kRepeat);
  scene.materials[0].map_kd.scale = V2f(2, 1);
  scene.materials[0].map_kd.offset = V2f(0.25f, 0);
  const TextureSet moved(scene, TextureSet::Need::kColor, report);
  EXPECT_EQ(moved.sample(0, V2f(0.25f, 0.25f), 0).color, V3f(1, 1, 1));  // 2·0.25 + 0.25 = 0.75: the right texel
}

TEST(TextureSet, LeavesOutWhatItCannotDecode) {
  Scene scene = striped_card();
  scene.textures.push_back({"unused.png", "unused.png"});
  scene.load_texture = [](int) { return Image{4, 4, 3, {1, 2}}; };  // fewer values than pixels
  Report report;
  const TextureSet textures(scene, TextureSet::Need::kColor, report);
  ASSERT_EQ(report.issues.size(), 1u);
  EXPECT_EQ(report.issues[0].id, "texture-unreadable");
  EXPECT_EQ(report.issues[0].where, "stripes.png");
  ASSERT_EQ(report.skipped.size(), 1u);
  EXPECT_EQ(report.skipped[0].what, "texture unused.png");
  EXPECT_EQ(textures.sample(0, V2f(0.5f, 0.5f), 0).color, V3f(1, 1, 1));
  const V2f wild(std::nanf(""), 3e38f);
  EXPECT_FLOAT_EQ(textures.sample(0, wild, 0).coverage, 1.0f);
}

TEST(TextureSet, OddSizesKeepTheMean) {
  Scene scene = striped_card();
  scene.load_texture = [](int) {
    Image image{7, 5, 3, std::vector<float>(105, 0.0f)};
    image.at(6, 4)[0] = 35;  // one texel of 35: its mean is 1
    return image;
  };
  Report report;
  const TextureSet textures(scene, TextureSet::Need::kColor, report);
  EXPECT_NEAR(textures.sample(0, V2f(0.1f, 0.1f), 100).color.x, 1.0, 1e-5);  // scaled rounding of four halvings in float
}

TEST(RayScene, SeesThroughCutOuts) {
  const Scene scene = striped_card();
  const RayScene rays(scene);
  for (int column = 0; column < 8; ++column) {
    const double x = (column + 0.5) / 8;
    EXPECT_FLOAT_EQ(rays.blocked(V3d(x, 0.3, 1), V3d(x, 0.3, -1)), column % 2 ? 0.0f : 1.0f);
    EXPECT_EQ(rays.first_hit(V3d(x, 0.3, 1), V3d(0, 0, -1)).triangle == kNoIndex, false);
    EXPECT_EQ(rays.first_covered_hit(V3d(x, 0.3, 1), V3d(0, 0, -1), 0, 0, 0).triangle == kNoIndex, column % 2 == 1);
  }
}

}  // namespace
}  // namespace texel
