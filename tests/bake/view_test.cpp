// The three view modes against facts known in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "bake/bake.h"
#include "bake/view.h"
#include "formats/error.h"
#include "tests/bake/made_scene.h"
#include "tests/formats/pack_builder.h"

namespace texel {
namespace {

using test::add_ball;
using test::add_channel;
using test::add_quad;
using test::empty_scene;
using test::make_layer;

// Looks along -z at the origin; `height` world units high.
ViewOptions from_above(double height, int pixels, int samples = 16) {
  ViewOptions o;
  o.camera = {V3d(0, 0, 10), V3d(0, 0, 0), V3d(0, 1, 0), 0, height};
  o.width = o.height = pixels;
  o.samples = samples;
  return o;
}

Light sun(const V3d& travels) { return {Light::Kind::kSun, travels, V3f(1, 1, 1)}; }

double mean_alpha(const Image& image) {
  double sum = 0;
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) sum += static_cast<double>(image.pixels[i]);
  return sum / (image.width * image.height);
}

double premultiplied_sum(const Image& image) {
  double sum = 0;
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) sum += static_cast<double>(image.pixels[i]) * static_cast<double>(image.pixels[i - 3]);
  return sum;
}

// A pack of one level of n³ voxels of edge 1/n about the origin, all of them active, with one layer to add channels to.
struct CubePack {
  Pack pack;
  explicit CubePack(int n, int levels = 1) {
    pack.grid = {V3d(-0.5, -0.5, -0.5), 1.0 / n, V3i(n, n, n)};
    for (int l = 0; l < levels; ++l) pack.levels.push_back({pack.grid.level(l), {}});
  }
  Layer& layer(int level, const test::CellTest& active) {
    Level& at = pack.levels[static_cast<std::size_t>(level)];
    at.layers.push_back(make_layer(at.grid.n, active));
    return at.layers.back();
  }
};

bool everywhere(int, int, int) { return true; }

TEST(Camera, FramesTheBox) {
  const Box3d box(V3d(-1, 2, 30), V3d(5, 4, 31));
  for (const double fov : {0.0, 20.0, 90.0})
    for (const double elevation : {-90.0, -30.0, 0.0, 45.0, 90.0})
      for (const double azimuth : {0.0, 77.0, -90.0}) {
        const Camera c = orbit_camera(box, azimuth, elevation, fov);
        const V3d f = (c.target - c.eye).normalized(), r = f.cross(c.up).normalized(), u = r.cross(f);
        EXPECT_NEAR(c.up.length(), 1, 1e-12);
        for (int k = 0; k < 8; ++k) {
          const V3d p(k & 1 ? box.max.x : box.min.x, k & 2 ? box.max.y : box.min.y, k & 4 ? box.max.z : box.min.z);
          const V3d v = p - c.eye;
          const double limit = fov > 0 ? v.dot(f) * std::tan(fov * std::numbers::pi / 360) : c.height / 2;
          EXPECT_LE(std::abs(v.dot(r)), limit * (1 + 1e-12));
          EXPECT_LE(std::abs(v.dot(u)), limit * (1 + 1e-12));
          EXPECT_GT(v.dot(f), 0);
        }
      }
  const Camera x = orbit_camera(box, 0, 0), front = orbit_camera(box, -90, 0), top = orbit_camera(box, 0, 90);
  EXPECT_GT(x.eye.x, 5);
  EXPECT_NEAR(x.eye.y, 3, 1e-9);
  EXPECT_LT(front.eye.y, 2);
  EXPECT_GT(top.eye.z, 31);
}

TEST(Camera, FillsThePicture) {
  // Whatever axis is up, the box touches the border of 4 % on two opposite sides and reaches over none; wide pictures and high ones too.
  const Box3d box(V3d(-1, 2, 30), V3d(5, 4, 31));
  for (const int up : {0, 1, 2})
    for (const double aspect : {0.5, 1.0, 2.0})
      for (const double fov : {0.0, 30.0}) {
        const Camera c = orbit_camera(box, -60, 20, fov, up, aspect);
        const V3d f = (c.target - c.eye).normalized(), r = f.cross(c.up).normalized(), u = r.cross(f);
        EXPECT_GT(c.up[up], 0.5);
        V3d low(1e9), high(-1e9);
        for (int k = 0; k < 8; ++k) {
          const V3d v = V3d(k & 1 ? box.max.x : box.min.x, k & 2 ? box.max.y : box.min.y, k & 4 ? box.max.z : box.min.z) - c.eye;
          const double limit = fov > 0 ? v.dot(f) * std::tan(fov * std::numbers::pi / 360) : c.height / 2;
          const V3d place(v.dot(r) / (limit * aspect), v.dot(u) / limit, 0);
          for (int i = 0; i < 2; ++i) {
            low[i] = std::min(low[i], place[i]);
            high[i] = std::max(high[i], place[i]);
          }
        }
        const int tight = high.x > high.y ? 0 : 1;
        EXPECT_NEAR(high[tight], 0.96, 1e-9);
        EXPECT_NEAR(low[tight], -0.96, 1e-9);
        EXPECT_LE(high[1 - tight], 0.96);
        EXPECT_GE(low[1 - tight], -0.96);
      }
  // The front of a model whose +Y is up is its +Z, as in glTF.
  const Camera front = orbit_camera(box, -90, 0, 30, 1);
  EXPECT_NEAR(front.up.y, 1, 1e-12);
  EXPECT_GT(front.eye.z, 31);
}

TEST(Camera, KnowsWhatIsUpByTheFormat) {
  const auto of = [](const char* path) { return up_axis(-1, {{"a/b.c/skin.MTL", "", 0}, {path, "", 0}}); };
  EXPECT_EQ(of("tree.OBJ"), 1);
  EXPECT_EQ(of("scan.ply"), 1);
  EXPECT_EQ(of("bunny.off"), 1);
  EXPECT_EQ(of("part.stl"), 2);
  for (const char* plant : {"tree.opf", "stand.ops", "soil.gwa", "old.lig"}) EXPECT_EQ(up_axis(-1, {{plant, "", 0}, {"part.obj", "", 0}}), 2);
  EXPECT_EQ(of("a.obj/none"), 2);
  EXPECT_EQ(up_axis(-1, {}), 2);
  EXPECT_EQ(up_axis(0, {{"tree.obj", "", 0}}), 0);
}

TEST(Truth, SphereCoversItsDisc) {
  Scene scene = empty_scene();
  add_ball(scene, 1, 128);
  Report report;
  const Image image = view_truth(scene, from_above(2.5, 100), report);
  // Statistical: about 250 pixels on the rim, each off by at most 0.5/sqrt(16): 2 pixels in 5027, so 4 sigma is 1.6e-3. The facets lose
  // less than (pi/128)^2/6 = 1e-4 of the disc.
  EXPECT_NEAR(mean_alpha(image) * 2.5 * 2.5, std::numbers::pi, 2e-3 * std::numbers::pi);
  EXPECT_FLOAT_EQ(image.at(50, 50)[3], 1.0f);
  EXPECT_FLOAT_EQ(image.at(1, 1)[3], 0.0f);
}

TEST(Truth, LambertSphereSendsTheIntegralOfTheCosine) {
  Scene scene = empty_scene();
  scene.materials[0].kd = V3f(0.5f, 0.5f, 0.5f);
  add_ball(scene, 1, 128);
  Report report;
  ViewOptions o = from_above(2.5, 100);
  const double disc = std::numbers::pi * (100 / 2.5) * (100 / 2.5);  // pixels
  o.lights = {sun(V3d(0, 0, -1))};
  // Mean of the cosine over the disc: 2/3 with the light at the eye, 2/(3 pi) from the side. Faceting at 128 rings: below 1e-3.
  EXPECT_NEAR(premultiplied_sum(view_truth(scene, o, report)) / disc, 0.5 * 2 / 3, 1e-3);
  o.lights = {sun(V3d(-1, 0, 0))};
  EXPECT_NEAR(premultiplied_sum(view_truth(scene, o, report)) / disc, 0.5 * 2 / (3 * std::numbers::pi), 1e-3);
  o.lights = {{Light::Kind::kAmbient, V3d(0, 0, 0), V3f(0.5f, 0.5f, 0.5f)}};
  EXPECT_FLOAT_EQ(view_truth(scene, o, report).at(50, 50)[0], 0.25f);
  o.lights.clear();
  const Image standard = view_truth(scene, o, report);
  const auto brightest = std::max_element(standard.pixels.begin(), standard.pixels.end());
  EXPECT_LE(*brightest, 1.0f);
}

TEST(Truth, UnseenBacksOfAnInsideOutBallAreTurned) {
  Scene scene = empty_scene();
  add_ball(scene, 1, 32);
  for (auto& t : scene.mesh.triangles) std::swap(t[1], t[2]);
  ViewOptions o = from_above(2.5, 40);
  o.lights = {sun(V3d(0, 0, -1))};
  Report report;
  EXPECT_NEAR(view_truth(scene, o, report).at(20, 20)[0], 0.5, 0.01);  // faceting: cosine of 5.6 degrees
}

// A card of one unit whose picture has half its texels cut out, in a pattern no pixel grid follows.
Scene cut_card() {
  Scene scene = empty_scene();
  add_quad(scene, V3d(-0.5, -0.5, 0), V3d(1, 0, 0), V3d(0, 1, 0));
  scene.textures.push_back({"card.png", "card.png"});
  scene.materials[0].map_d.texture = 0;
  scene.materials[0].map_d.alpha_channel = true;
  scene.load_texture = [](int) {
    Image image{32, 32, 2, {}};
    for (int i = 0; i < 32 * 32; ++i) {
      image.pixels.push_back(1.0f);
      image.pixels.push_back((i * 7 + i / 32 * 3) % 2 ? 0.0f : 1.0f);
    }
    return image;
  };
  return scene;
}

TEST(Truth, CutOutsAreHolesSeenFromBothSides) {
  const Scene scene = cut_card();
  Report report;
  ViewOptions o = from_above(1, 50);  // the card fills the picture
  o.lights = {sun(V3d(0, 0, -1)), sun(V3d(0, 0, 1))};
  const Image front = view_truth(scene, o, report);
  // Statistical: 2500 pixels of 16 samples that are each half there: 4·0.5/sqrt(40000) = 0.01.
  EXPECT_NEAR(mean_alpha(front), 0.5, 0.01);
  EXPECT_NEAR(premultiplied_sum(front) / 2500, 0.5 * 0.5, 0.006);
  o.camera.eye = V3d(0, 0, -10);
  EXPECT_NEAR(premultiplied_sum(view_truth(scene, o, report)) / 2500, 0.5 * 0.5, 0.006);  // two-sided
}

TEST(Truth, TransparencyIsPartial) {
  Scene scene = empty_scene();
  scene.materials[0].opacity = 0.25f;
  scene.materials.push_back({});
  scene.materials[1].kd = V3f(1, 1, 1);
  add_quad(scene, V3d(-1, -1, 1), V3d(2, 0, 0), V3d(0, 2, 0));
  add_quad(scene, V3d(-1, -1, 0), V3d(2, 0, 0), V3d(0, 2, 0), 1);
  Report report;
  ViewOptions o = from_above(1, 4, 4);
  o.lights = {{Light::Kind::kAmbient, V3d(0, 0, 0), V3f(1, 1, 1)}};
  const Image image = view_truth(scene, o, report);
  EXPECT_FLOAT_EQ(image.at(1, 1)[3], 1.0f);
  EXPECT_FLOAT_EQ(image.at(1, 1)[0], 0.25f * 0.5f + 0.75f * 1.0f);  // exact: front to back
}

TEST(Truth, OfTwoOppositePolygonsOneStaysDark) {
  Scene scene = empty_scene();
  add_quad(scene, V3d(-1, -0.4, 0), V3d(0.8, 0, 0), V3d(0, 0.8, 0));      // faces the eye
  add_quad(scene, V3d(0.2, -0.4, 0), V3d(0, 0.8, 0), V3d(0.8, 0, 0));     // turned away
  ViewOptions o = from_above(2, 40, 4);
  o.lights = {sun(V3d(0, 0, -1))};
  Report report;
  const Image image = view_truth(scene, o, report);
  EXPECT_FLOAT_EQ(image.at(8, 20)[0], 0.5f);
  EXPECT_FLOAT_EQ(image.at(32, 20)[3], 1.0f);
  EXPECT_FLOAT_EQ(image.at(32, 20)[0], 0.0f);
}

TEST(Volume, OfTwoOppositePolygonsOneStaysDark) {
  CubePack cube(32);
  // One plane of voxels: normals up in the left half, down in the right, a gap between.
  const auto active = [](int x, int y, int z) { return z == 15 && y > 4 && y < 27 && ((x > 3 && x < 13) || (x > 18 && x < 28)); };
  Layer& layer = cube.layer(0, active);
  add_channel(layer, "alpha", 3, [](int, int, int) { return V3f(0, 0, 1); });
  add_channel(layer, "normal", 3, [](int x, int, int) { return V3f(0, 0, x < 16 ? 1.0f : -1.0f); });
  add_channel(layer, "S_diag", 3, [](int, int, int) { return V3f(0, 0, 1); });
  add_channel(layer, "S_off", 3, [](int, int, int) { return V3f(0, 0, 0); });
  add_channel(layer, "Cd", 3, [](int, int, int) { return V3f(0.5f, 0.5f, 0.5f); });
  ViewOptions o = from_above(1, 64, 1);
  o.lights = {sun(V3d(0, 0, -1))};
  Report report;
  const Image image = view_volume(cube.pack, o, report);
  EXPECT_GT(image.at(16, 32)[3], 0.99f);
  EXPECT_GT(image.at(48, 32)[3], 0.99f);
  EXPECT_NEAR(image.at(16, 32)[0], 0.5, 0.005);  // the rounding of S that keeps it invertible costs 1 %
  EXPECT_LT(image.at(48, 32)[0], 0.005f);
}

TEST(Volume, UniformDensityAbsorbsExponentially) {
  for (const double tau : {0.02, 0.1, 1.0}) {  // per voxel
    CubePack cube(16);
    add_channel(cube.layer(0, everywhere), "density", 1, [&](int, int, int) { return V3f(static_cast<float>(tau * 16)); });
    ViewOptions o = from_above(0.5, 8, 1);
    Report report;
    const Image image = view_volume(cube.pack, o, report);
    // Scaled rounding of 34 float steps; a cone that has used up 1023/1024 of its light ends there.
    EXPECT_NEAR(image.at(4, 4)[3], 1 - std::exp(-16 * tau), tau < 0.5 ? 1e-5 : 1.0 / 1024) << tau;
  }
}

TEST(Volume, AxisAlphaIsSeenAlongItsAxis) {
  CubePack cube(16);
  add_channel(cube.layer(0, everywhere), "alpha", 3, [](int, int, int) { return V3f(0.01f, 0.03f, 0.05f); });
  Report report;
  ViewOptions o = from_above(0.5, 8, 1);
  for (int axis = 0; axis < 3; ++axis) {
    o.camera.eye = V3d(0, 0, 0);
    o.camera.eye[axis] = 10;
    o.camera.up = axis == 2 ? V3d(0, 1, 0) : V3d(0, 0, 1);
    const double a = std::vector<double>{0.01, 0.03, 0.05}[static_cast<std::size_t>(axis)];
    EXPECT_NEAR(view_volume(cube.pack, o, report).at(4, 4)[3], 1 - std::pow(1 - a, 16), 1e-5) << axis;  // scaled rounding, as above
  }
}

TEST(Volume, LevelsBlendWithoutAJump) {
  CubePack cube(16, 2);
  for (int l = 0; l < 2; ++l) add_channel(cube.layer(l, everywhere), "density", 1, [&](int, int, int) { return V3f(l == 0 ? 0.5f : 1.5f); });
  Report report;
  const auto alpha = [&](double footprint) {  // in voxels of level 0
    return static_cast<double>(view_volume(cube.pack, from_above(footprint / 16 * 5, 5, 1), report).at(2, 2)[3]);
  };
  EXPECT_NEAR(alpha(0.5), 1 - std::exp(-0.5), 1e-5);  // scaled rounding
  EXPECT_NEAR(alpha(1.0), 1 - std::exp(-0.5), 1e-5);
  EXPECT_NEAR(alpha(2.0), 1 - std::exp(-1.5), 1e-3);  // order: level 1 is marched in quarter-voxel steps before, half-voxel steps now
  // Half of each at every step: opacities blend, not depths, which differs by the square of a step's depth; and the coarse level's ends
  // reach half a coarse voxel out.
  EXPECT_NEAR(alpha(1.5), 1 - std::exp(-1.0), 2e-3);
  for (double r = 0.9; r < 2.2; r += 0.05) EXPECT_LT(std::abs(alpha(r + 0.05) - alpha(r)), 0.05 * std::exp(-0.5) + 1e-3) << r;  // steepest at r = 1
  ViewOptions forced = from_above(0.25, 4, 1);
  forced.level = 1;
  EXPECT_NEAR(view_volume(cube.pack, forced, report).at(2, 2)[3], 1 - std::exp(-1.5), 1e-3);
}

// A ball's pack and the same ball's mesh.
TEST(Volume, BallLooksLikeTheTruth) {
  test::BallOptions ball;
  ball.n = 64;
  ball.origin = V3d(-4, -4, -4);
  ball.h = 0.125;
  ball.color = V3f(0.5f, 0.5f, 0.5f);
  Pack pack = test::ball_pack(ball);
  for (Level& level : pack.levels)
    for (Layer& layer : level.layers)
      for (Channel& c : layer.channels)
        if (c.name == "Cd") std::fill(c.values.begin(), c.values.end(), 0.5f);
  Scene scene = empty_scene();
  add_ball(scene, 0.4 * 64 * 0.125, 64);
  const V3d centre = pack.grid.box().center();
  for (V3d& p : scene.mesh.points) p += centre;
  ViewOptions o;
  o.camera = orbit_camera(pack.grid.box(), -60, 20);
  o.width = o.height = 96;
  Report report;
  const Image truth = over_background(view_truth(scene, o, report), V3f(0.1f, 0.1f, 0.1f));
  const Image volume = over_background(view_volume(pack, o, report), V3f(0.1f, 0.1f, 0.1f));
  double sum = 0;
  for (std::size_t i = 0; i < truth.pixels.size(); ++i) sum += std::pow(static_cast<double>(truth.pixels[i] - volume.pixels[i]), 2);
  const double rmse = std::sqrt(sum / static_cast<double>(truth.pixels.size()));
  RecordProperty("rmse_1e4", static_cast<int>(rmse * 1e4));
  // Golden: one voxel is 0.9 pixels, the silhouette is about 2 voxels soft on 170 of 9216 pixels; 0.016 measured.
  EXPECT_LT(rmse, 0.025);
}

TEST(Shadows, FallInTruthAndVolume) {
  ViewOptions o = from_above(1, 32, 1);
  o.lights = {sun(V3d(1, 0, -1))};
  Report report;
  Scene scene = empty_scene();
  add_quad(scene, V3d(-0.5, -0.5, -0.4), V3d(1, 0, 0), V3d(0, 1, 0));
  add_quad(scene, V3d(-0.4, -0.25, 0), V3d(0.25, 0, 0), V3d(0, 0.5, 0));  // its shadow: x from 0 to 0.25
  // The volume: a floor of voxels and a small roof above it.
  CubePack cube(32);
  Layer& layer = cube.layer(0, [](int x, int y, int z) { return z == 3 || (z == 16 && x >= 3 && x < 11 && y >= 8 && y < 24); });
  add_channel(layer, "alpha", 3, [](int, int, int) { return V3f(0, 0, 1); });
  add_channel(layer, "density", 1, [](int, int, int) { return V3f(9.21f * 32); });
  add_channel(layer, "normal", 3, [](int, int, int) { return V3f(0, 0, 1); });
  add_channel(layer, "S_diag", 3, [](int, int, int) { return V3f(0, 0, 1); });
  add_channel(layer, "S_off", 3, [](int, int, int) { return V3f(0, 0, 0); });
  for (const bool shadows : {true, false}) {
    o.shadows = shadows;
    const Image truth = view_truth(scene, o, report), volume = view_volume(cube.pack, o, report);
    const double lit = 0.5 / std::sqrt(2.0);
    EXPECT_NEAR(truth.at(20, 16)[0], shadows ? 0 : lit, 1e-5);
    EXPECT_NEAR(volume.at(20, 16)[0], shadows ? 0 : lit, 0.01);  // the rounding of S
    EXPECT_NEAR(truth.at(28, 16)[0], lit, 1e-5);
    EXPECT_NEAR(volume.at(28, 16)[0], lit, 0.01);
  }
}

SliceStack plain_stack(int axis, int count, const V3f& color, float alpha) {
  SliceStack stack;
  stack.axis = axis;
  stack.count = count;
  stack.width = stack.height = 8;
  stack.thickness = 1.0 / count;
  stack.image = [color, alpha](int) {
    Image image{8, 8, 4, {}};
    for (int i = 0; i < 64; ++i)
      for (const float v : {color.x, color.y, color.z, alpha}) image.pixels.push_back(v);
    return image;
  };
  return stack;
}

TEST(Slices, UniformSlabCompositesToThePowerLaw) {
  CubePack cube(8);
  cube.pack.slices.push_back(plain_stack(2, 8, V3f(0.25f, 0.5f, 1.0f), 0.125f));
  Report report;
  for (const V3d& eye : {V3d(0, 0, 10), V3d(0, 0, -10), V3d(2, 1, 20)})
    for (const double fov : {0.0, 3.0}) {
      ViewOptions o = from_above(0.5, 8, 1);
      o.camera.eye = eye;
      o.camera.fov = fov;
      const Image image = view_slices(cube.pack, o, report);
      // Scaled rounding: eight float products.
      EXPECT_NEAR(image.at(4, 4)[3], 1 - std::pow(0.875, 8), 1e-6);
      EXPECT_NEAR(image.at(4, 4)[0], 0.25, 1e-6);
      EXPECT_NEAR(image.at(4, 4)[2], 1.0, 1e-6);
    }
}

TEST(Slices, AreOrderedPlacedAndChosenRight) {
  CubePack cube(8);
  SliceStack stack = plain_stack(2, 4, V3f(0, 0, 0), 1);
  stack.image = [](int k) {
    Image image{8, 8, 4, std::vector<float>(256, 0.0f)};
    for (int i = 0; i < 64; ++i) image.pixels[static_cast<std::size_t>(i) * 4 + 3] = 1;
    for (int i = 0; i < 64; ++i) image.pixels[static_cast<std::size_t>(i) * 4] = static_cast<float>(k);
    for (int i = 0; i < 8; ++i) image.at(i, 0)[1] = 1;  // top row: highest y
    return image;
  };
  cube.pack.slices = {stack, plain_stack(0, 4, V3f(9, 9, 9), 1)};
  Report report;
  ViewOptions o = from_above(1, 8, 1);
  const Image above = view_slices(cube.pack, o, report);
  EXPECT_FLOAT_EQ(above.at(4, 4)[0], 3.0f);  // exact: slice 3 is on top
  EXPECT_FLOAT_EQ(above.at(4, 0)[1], 1.0f);
  EXPECT_FLOAT_EQ(above.at(4, 7)[1], 0.0f);
  o.camera.eye = V3d(0, 0, -10);
  EXPECT_FLOAT_EQ(view_slices(cube.pack, o, report).at(4, 4)[0], 0.0f);
  o.camera.eye = V3d(10, 0, 1);
  EXPECT_FLOAT_EQ(view_slices(cube.pack, o, report).at(4, 4)[0], 9.0f);  // the stack along x faces the eye
  o.slice_axis = 1;
  EXPECT_THROW((void)view_slices(cube.pack, o, report), Error);
}

TEST(View, SameBytesForAnyThreadCount) {
  Scene scene = cut_card();
  add_ball(scene, 0.3, 16);
  test::BallOptions ball;
  ball.n = 24;
  const Pack pack = test::ball_pack(ball);
  Report report;
  std::vector<Image> truth, volume, slices;
  for (const int threads : {1, 2, 4}) {
    ViewOptions o;
    o.width = 40;
    o.height = 30;
    o.threads = threads;
    o.samples = 32;
    o.camera = orbit_camera(pack.grid.box(), 30, 30);
    volume.push_back(view_volume(pack, o, report));
    slices.push_back(view_slices(pack, o, report));
    o.camera = orbit_camera(Box3d(V3d(-0.5), V3d(0.5)), 30, 30);
    truth.push_back(view_truth(scene, o, report));
  }
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(truth[i].pixels, truth[0].pixels);
    EXPECT_EQ(volume[i].pixels, volume[0].pixels);
    EXPECT_EQ(slices[i].pixels, slices[0].pixels);
  }
  EXPECT_GT(mean_alpha(truth[0]), 0.05);
  EXPECT_GT(mean_alpha(volume[0]), 0.05);
  EXPECT_GT(mean_alpha(slices[0]), 0.05);
}

TEST(View, SaysWhatIsMissing) {
  Report report;
  const ViewOptions o = from_above(1, 4);
  Pack nothing;
  EXPECT_THROW((void)view_volume(nothing, o, report), Error);
  EXPECT_THROW((void)view_slices(nothing, o, report), Error);
  CubePack bare(8);
  add_channel(bare.layer(0, everywhere), "area", 1, [](int, int, int) { return V3f(1); });
  try {
    (void)view_volume(bare.pack, o, report);
    FAIL() << "a pack without opacity was rendered";
  } catch (const Error& e) {
    EXPECT_EQ(e.code, Code::kBadInput);
    EXPECT_NE(e.message.find("density"), std::string::npos);
  }
  CubePack damaged(8);
  add_channel(damaged.layer(0, everywhere), "density", 1, [](int, int, int) { return V3f(1); });
  damaged.pack.levels[0].layers[0].channels[0].values.resize(100);
  EXPECT_THROW((void)view_volume(damaged.pack, o, report), Error);
  damaged.pack.levels[0].layers[0].set.blocks[0].at = V3i(1 << 30, -5, 0);
  EXPECT_THROW((void)view_volume(damaged.pack, o, report), Error);
  const Scene empty = empty_scene();
  EXPECT_EQ(mean_alpha(view_truth(empty, o, report)), 0);
  ViewOptions wrong = o;
  wrong.width = 0;
  EXPECT_THROW((void)view_truth(empty, wrong, report), Error);
  wrong = o;
  wrong.camera.eye.x = std::nan("");
  EXPECT_THROW((void)view_truth(empty, wrong, report), Error);
}

// Ratib's two opposite polygons (fig. 3.4), baked: what faces away from the light is not lit, whether they lie in one voxel or apart.
struct Opposite {
  const char* name;
  double up_at, down_at;  // heights of the polygon that faces up and of the one that faces down, in voxels
};

class OppositePolygons : public testing::TestWithParam<Opposite> {};

TEST_P(OppositePolygons, AreLitOnTheLightsSideOnly) {
  constexpr double kVoxel = 1.0 / 16;
  const auto [name, up_at, down_at] = GetParam();
  Scene scene = empty_scene();
  scene.materials[0].kd = V3f(0.5f, 0.5f, 0.5f);
  add_quad(scene, V3d(-0.4, -0.4, up_at * kVoxel), V3d(0.8, 0, 0), V3d(0, 0.8, 0));
  add_quad(scene, V3d(-0.4, -0.4, down_at * kVoxel), V3d(0, 0.8, 0), V3d(0.8, 0, 0));
  Recipe recipe;
  recipe.resolution = V3i(16, 0, 0);
  recipe.box = Box3d(V3d(-0.5), V3d(0.5));
  Report report;
  const Pack pack = bake(scene, recipe, report);
  ASSERT_GE(pack.levels.size(), 2u);
  const bool outwards = up_at >= down_at;  // else each is seen from its back, with the other behind it
  for (const bool lit_above : {true, false})
    for (const bool seen_above : {true, false}) {
      ViewOptions o;
      o.camera = {V3d(0, 0, seen_above ? 10 : -10), V3d(0, 0, 0), V3d(0, 1, 0), 0, 0.2};  // well within the polygons
      o.width = o.height = 8;
      o.lights = {sun(V3d(0, 0, lit_above ? -1 : 1))};
      const float lit = outwards && lit_above == seen_above ? 0.5f : 0.0f;
      const Image truth = view_truth(scene, o, report);
      o.level = 0;
      const Image volume = view_volume(pack, o, report);
      SCOPED_TRACE(std::string(lit_above ? "lit from above" : "lit from below") + (seen_above ? ", seen from above" : ", seen from below"));
      // Truth: exact but for rounding. Volume: grids are halves, and S is rounded off by 5e-4, so that its normals spread by about
      // sqrt(5e-4) = 0.022: the mean cosine is within that of 1, and what is stored as |m| within 5e-4 of 1.
      for (int y = 2; y < 6; ++y)
        for (int x = 2; x < 6; ++x) {
          EXPECT_NEAR(truth.at(x, y)[0], lit, 1e-5);
          EXPECT_NEAR(volume.at(x, y)[0], lit, 0.022 * 0.5);
          EXPECT_NEAR(volume.at(x, y)[3], 1, 2e-3);  // opacity of a voxel is capped at 0.9999 and stored as a half
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Placed, OppositePolygons,
                         testing::Values(Opposite{"InAWall", 0, 0}, Opposite{"InOneVoxel", 0.4, 0.4}, Opposite{"NearAWall", 0.9, 0.9}, Opposite{"Apart", 3.3, -2.6},
                                         Opposite{"FacingEachOther", -2.6, 3.3}),
                         [](const auto& suite) { return std::string(suite.param.name); });

// A ball of 16 voxels, made as a pack and as a mesh.
std::pair<Pack, Scene> ball_both_ways() {
  test::BallOptions ball;
  ball.n = 16;
  Scene scene = empty_scene();
  add_ball(scene, 1, 8);
  return {test::ball_pack(ball), std::move(scene)};
}

// Whoever hears of the progress may stop a picture by throwing.
TEST(View, CanBeStopped) {
  const auto [pack, scene] = ball_both_ways();
  Report report;
  report.progress = [](const std::string&, double) { throw Error(Code::kRunning, "", "interrupted"); };
  const ViewOptions o = from_above(4, 8);
  EXPECT_THROW((void)view_truth(scene, o, report), Error);
  EXPECT_THROW((void)view_volume(pack, o, report), Error);
  EXPECT_THROW((void)view_slices(pack, o, report), Error);
}

TEST(ContactSheet, HasATileForEachThingThereIs) {
  const auto [pack, scene] = ball_both_ways();
  Report report;
  const SheetOptions sheet{.tile = 48, .lights = {}};
  const Image with = contact_sheet(pack, &scene, sheet, report), without = contact_sheet(pack, nullptr, sheet, report);
  EXPECT_EQ(with.width, 4 * 49 + 1);
  EXPECT_EQ(without.width, 3 * 49 + 1);
  EXPECT_EQ(with.channels, 3);
  for (const float v : with.pixels) ASSERT_TRUE(v >= 0 && v <= 1);
  test::BallOptions slices_only;
  slices_only.n = 16;
  slices_only.levels = 0;
  EXPECT_EQ(contact_sheet(test::ball_pack(slices_only), nullptr, sheet, report).width, 49 + 1);
}

// Under ambient light alone what is matt sends albedo x light: truth and volume alike, as the slices do that were baked with it.
TEST(ContactSheet, ShowsTruthAndVolumeUnderTheLightOfTheSlices) {
  test::BallOptions ball;
  ball.n = 24;
  Pack pack = test::ball_pack(ball);
  for (Level& level : pack.levels)
    for (Layer& layer : level.layers)
      for (Channel& c : layer.channels)
        if (c.name == "Cd")
          for (std::size_t i = 0; i < c.values.size(); ++i) c.values[i] = ball.color[static_cast<int>(i % 3)];
  Scene scene = empty_scene();
  scene.materials[0].kd = ball.color;
  add_ball(scene, 0.4 * 24 * ball.h, 64);
  const V3d middle = pack.grid.to_world(V3d(pack.grid.n) / 2);
  for (V3d& p : scene.mesh.points) p += middle;
  Report report;
  const V3f light(0.5f, 0.25f, 1);
  const SheetOptions sheet{.tile = 64, .lights = {{Light::Kind::kAmbient, V3d(0, 0, 0), light}}};
  const Image image = contact_sheet(pack, &scene, sheet, report);
  for (const int tile : {0, 1})
    for (int c = 0; c < 3; ++c)  // halves: 2^-11; a voxel's opacity is capped at 0.9999 and what shines through is grey 0.18
      EXPECT_NEAR(image.at(tile * 65 + 1 + 32, 1 + 32)[c], ball.color[c] * light[c], 1e-3) << "tile " << tile << " channel " << c;
}

}  // namespace
}  // namespace texel
