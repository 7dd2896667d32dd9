// Stage 7, textures integrated over voxels, cut-outs.
#include "bake/color.h"

#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

// A texture made in memory: `value(x, y)` per texel, row 0 on top.
void add_texture(Scene& scene, std::uint32_t material, int width, int height, int channels, const std::function<std::array<float, 4>(int, int)>& value) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto v = value(x, y);
      image.pixels.insert(image.pixels.end(), v.begin(), v.begin() + channels);
    }
  const int number = static_cast<int>(scene.textures.size());
  scene.textures.push_back({"made", "made"});
  scene.materials[material].map_kd.texture = number;
  const auto before = scene.load_texture;
  scene.load_texture = [image, number, before](int t) { return t == number ? image : before(t); };
}
Recipe color_recipe(int resolution) {
  Recipe recipe = volume_recipe(resolution);
  recipe.want.slices = true;
  return recipe;
}

TEST(Color, PlainMaterialIsExact) {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(0.1f, 0.7f, 0.3f);
  add_ball(s, 1, 16);
  const Pack pack = bake_quietly(s, color_recipe(40));
  for (const Level& level : pack.levels) {
    const Layer* layer = nullptr;
    const Channel* c = level.find("Cd", &layer);
    ASSERT_TRUE(c);
    for (const auto* list : {&c->values, &c->tiles})
      for (std::size_t i = 0; i < list->size(); ++i) ASSERT_NEAR((*list)[i], s.materials[0].kd[static_cast<int>(i % 3)], 5e-6);  // float: means of means of equals
    const Dense cd = dense(level, "Cd"), area = dense(level, "area");
    for_each_cell(cd.n, [&](const V3i& v) {
      for (int k = 0; k < 3 && area.state(v); ++k) EXPECT_NEAR(cd.at(v, k), s.materials[0].kd[k], 1.2e-7f * s.materials[0].kd[k]);  // one step of float
    });
  }
  for (const SliceStack& stack : pack.slices)
    for (int k = 0; k < stack.count; ++k) {
      const Image image = stack.image(k);
      bool any = false;
      for (std::size_t i = 3; i < image.pixels.size(); i += 4) any = any || image.pixels[i] > 0;
      if (!any) continue;
      for (std::size_t i = 0; i < image.pixels.size(); ++i)
        if (i % 4 < 3) {
          ASSERT_NEAR(image.pixels[i], s.materials[0].kd[static_cast<int>(i % 4)], 1e-6) << "colour runs on under alpha 0";
        }
    }
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(pack.statistics.mean_color[k], s.materials[0].kd[k], 1e-6);
}
// Two materials in one voxel weigh by their areas.
TEST(Color, WeighsByArea) {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(1, 0, 0);
  s.materials.push_back(s.materials[0]);
  s.materials[1].kd = V3f(0, 1, 0);
  add_quad(s, V3d(0.1, 0.1, 0.3), V3d(0.4, 0, 0), V3d(0, 0.4, 0), 0);
  add_quad(s, V3d(0.1, 0.1, 0.6), V3d(0.2, 0, 0), V3d(0, 0.2, 0), 1);
  Recipe recipe = color_recipe(1);
  recipe.box = Box3d(V3d(0), V3d(1));
  const Pack pack = bake_quietly(s, recipe);
  ASSERT_EQ(pack.grid.n, V3i(1, 1, 1));
  const V3f c = dense(pack.levels[0], "Cd").at3(V3i(0));
  EXPECT_NEAR(c.x, 0.8, 1e-6);  // 0.16 : 0.04
  EXPECT_NEAR(c.y, 0.2, 1e-6);
}
TEST(Color, TwoColouredBoxHasThemOnTheRightSides) {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(1, 0, 0);
  s.materials.push_back(s.materials[0]);
  s.materials[1].kd = V3f(0, 0, 1);
  // Closed box, red where x < 0, blue beyond.
  add_box(s, V3d(-1, -1, -1), V3d(0, 1, 1), false, 63 & ~2u, 0);
  add_box(s, V3d(0, -1, -1), V3d(1, 1, 1), false, 63 & ~1u, 1);
  const Pack pack = bake_quietly(s, color_recipe(34));
  const Dense c = dense(pack.levels[0], "Cd"), area = dense(pack.levels[0], "area");
  ASSERT_EQ(pack.grid.n, V3i(34, 34, 34));
  for_each_cell(c.n, [&](const V3i& v) {
    if (!area.state(v)) return;
    const V3f color = c.at3(v);
    EXPECT_EQ(color, v.x < 17 ? V3f(1, 0, 0) : V3f(0, 0, 1)) << v.x;
  });
  const SliceStack& z = pack.slices[2];
  for (int k = 1; k < 33; ++k) {
    const Image image = z.image(k);
    for (int y = 0; y < 34; ++y)
      for (int x = 0; x < 34; ++x) {
        if (image.at(x, y)[3] <= 0) continue;
        EXPECT_GT(image.at(x, y)[x < 17 ? 0 : 2], 0.49f) << "slice " << k << " column " << x;  // nearest colour: red and blue sides, never swapped
      }
  }
}
// Colour runs kColorReach voxels beyond matter, and is everywhere where there is matter; never negative or not a number.
TEST(Color, RunsOn) {
  Scene s = empty_scene();
  add_ball(s, 1, 16);
  add_quad(s, V3d(-2, -2, -1), V3d(1, 0.2, 0.1), V3d(0, 1, 0.4));
  Recipe recipe = color_recipe(50);
  recipe.margin = 4;
  const Pack pack = bake_quietly(s, recipe);
  check_invariants(pack);
  for (const Level& level : pack.levels) {
    const Dense cd = dense(level, "Cd"), area = dense(level, "area"), solid = dense(level, "solid");
    for_each_cell(cd.n, [&](const V3i& v) {
      int near = 99;
      for (int dz = -3; dz <= 3; ++dz)
        for (int dy = -3; dy <= 3; ++dy)
          for (int dx = -3; dx <= 3; ++dx)
            if (area.state(v + V3i(dx, dy, dz))) near = std::min(near, std::max({std::abs(dx), std::abs(dy), std::abs(dz)}));
      if (near <= kColorReach || solid.state(v)) {
        EXPECT_TRUE(cd.state(v)) << "no colour " << near << " voxels from surface";
      }
      if (near > kColorReach && !solid.state(v)) {
        EXPECT_FALSE(cd.state(v));
      }
    });
  }
}

// A checkerboard of black and white squares, four to a voxel's edge: every voxel is grey. In the mip chain one texel of the level chosen
// covers a piece of the surface, and pieces are as large as voxels or smaller.
TEST(Texture, CheckerboardFinerThanAVoxelAveragesOut) {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(1, 1, 1);
  add_quad(s, V3d(0, 0, 0.4), V3d(1, 0, 0), V3d(0, 1, 0.2));
  add_texture(s, 0, 128, 128, 3, [](int x, int y) { const float v = static_cast<float>((x + y) % 2); return std::array<float, 4>{v, v, v, 1}; });
  const Pack pack = bake_quietly(s, color_recipe(34));  // 32 voxels across, 4 texels a voxel
  const Layer* layer = nullptr;
  const Channel* area = pack.levels[0].find("area", &layer);
  const Dense cd = dense(pack.levels[0], "Cd");
  double sum = 0, total = 0, worst = 0;
  for_each_voxel(layer->set, [&](const V3i& v, std::int64_t i) {
    const double a = static_cast<double>(area->values[static_cast<std::size_t>(i)]), c = static_cast<double>(cd.at(v));
    sum += a * c;
    total += a;
    if (a > 0.25) worst = std::max(worst, std::abs(c - 0.5));
  });
  EXPECT_NEAR(sum / total, 0.5, 0.01);
  EXPECT_LE(worst, 0.1);  // a voxel of 16 texels cut at any place: at most 1.6 texels more of one colour
  std::printf("checkerboard: mean %.5f, worst voxel off by %.3g\n", sum / total, worst);
}
// A gradient is linear, so sampling each piece at its centroid is exact: the voxel's colour is that of its surface's centroid.
TEST(Texture, GradientIsThePiecesMean) {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(1, 1, 1);
  add_quad(s, V3d(0, 0, 0.5), V3d(1, 0, 0), V3d(0, 1, 0));
  add_texture(s, 0, 1024, 4, 3, [](int x, int) { const float v = (static_cast<float>(x) + 0.5f) / 1024; return std::array<float, 4>{v, v, v, 1}; });
  s.materials[0].map_kd.wrap.fill(Wrap::kClamp);
  Recipe recipe = color_recipe(8);
  recipe.box = Box3d(V3d(0), V3d(1));
  const Pack pack = bake_quietly(s, recipe);
  const Dense cd = dense(pack.levels[0], "Cd"), area = dense(pack.levels[0], "area");
  double worst = 0;
  for_each_cell(cd.n, [&](const V3i& v) {
    if (area.state(v) && v.x > 0 && v.x < 7) worst = std::max(worst, std::abs(static_cast<double>(cd.at(v)) - (v.x + 0.5) / 8));
  });
  EXPECT_LE(worst, 1e-6);  // float: filtering keeps what is linear
  std::printf("gradient: worst voxel off by %.3g\n", worst);
}
// v = 0 is the bottom row of the picture.
TEST(Texture, BottomRowIsVZero) {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(1, 1, 1);
  add_quad(s, V3d(0, 0, 0.5), V3d(1, 0, 0), V3d(0, 1, 0));
  add_texture(s, 0, 16, 16, 3, [](int x, int y) { return std::array<float, 4>{y >= 8 ? 1.f : 0.f, x >= 8 ? 1.f : 0.f, 0, 1}; });
  Recipe recipe = color_recipe(8);
  recipe.box = Box3d(V3d(0), V3d(1));
  const Dense cd = dense(bake_quietly(s, recipe).levels[0], "Cd"), area = dense(bake_quietly(s, recipe).levels[0], "area");
  for_each_cell(cd.n, [&](const V3i& v) {
    if (!area.state(v) || v.x % 7 == 0 || v.y % 7 == 0 || v.x == 3 || v.x == 4 || v.y == 3 || v.y == 4) return;  // not where rows meet or wrap
    EXPECT_NEAR(cd.at(v, 0), v.y < 4 ? 1 : 0, 1e-3);
    EXPECT_NEAR(cd.at(v, 1), v.x < 4 ? 0 : 1, 1e-3);
  });
}
// Beyond its border a picture repeats, goes on with its last texel, or comes back: along each axis by itself.
TEST(Texture, WrapsAlongEachAxis) {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(1, 1, 1);
  add_quad(s, V3d(0, 0, 0.5), V3d(1, 0, 0), V3d(0, 1, 0));
  add_texture(s, 0, 8, 8, 3, [](int x, int y) { return std::array<float, 4>{(static_cast<float>(x) + 0.5f) / 8, (static_cast<float>(y) + 0.5f) / 8, 0, 1}; });
  const auto sampled = [&](const std::array<Wrap, 2>& wrap, float u, float v, float footprint) {
    s.materials[0].map_kd.wrap = wrap;
    Report report;
    return TextureSet(s, TextureSet::Need::kColor, report).sample(0, {u, v}, footprint).color;
  };
  const std::array mirror_repeat{Wrap::kMirror, Wrap::kRepeat}, repeat_clamp{Wrap::kRepeat, Wrap::kClamp};
  for (const float footprint : {0.0f, 0.3f})
    for (const float u : {0.0625f, 0.25f, 0.6875f, 0.96875f}) {  // exact in floats, and so are their copies
      const V3f here = sampled(mirror_repeat, u, 0.375f, footprint);
      for (const float there : {-u, 2 - u, u + 2, u - 2, 6 - u}) EXPECT_EQ(sampled(mirror_repeat, there, 0.375f, footprint), here) << u << " " << there;
      EXPECT_EQ(sampled(mirror_repeat, u, 2.375f, footprint), here);
      EXPECT_EQ(sampled(repeat_clamp, u + 3, 5, 0), sampled(repeat_clamp, u, 1, 0));
    }
  EXPECT_FLOAT_EQ(sampled(mirror_repeat, 1, 0.5f, 0).x, 7.5f / 8) << "a mirror's border is its last texel, not a mean with the first";
  EXPECT_FLOAT_EQ(sampled(repeat_clamp, 0, 5, 0).y, 0.5f / 8) << "above the picture: its top row";
}
// A material may say that it is seen from both sides. Where it is the surface of a solid that changes nothing.
TEST(Sides, DoubleSidedMaterialsOfSheetsOnly) {
  Scene sheet = empty_scene(), solid = empty_scene();
  add_quad(sheet, V3d(0, 0, 0.5), V3d(1, 0, 0), V3d(0, 1, 0));
  add_box(solid, V3d(0.25, 0.25, 0.25), V3d(0.75, 0.75, 0.75));
  const auto longest_normal = [](Scene& scene, bool two_sided, Sidedness sidedness) {
    scene.materials[0].two_sided = two_sided;
    Recipe recipe = color_recipe(8);
    recipe.box = Box3d(V3d(0), V3d(1));
    recipe.two_sided = sidedness;
    const Dense normal = dense(bake_quietly(scene, recipe).levels[0], "normal");
    double longest = 0;
    for_each_cell(normal.n, [&](const V3i& v) {
      for (int c = 0; c < 3; ++c) longest = std::max(longest, std::abs(static_cast<double>(normal.at(v, c))));
    });
    return longest;
  };
  EXPECT_NEAR(longest_normal(sheet, false, Sidedness::kAuto), 1, 1e-6);
  EXPECT_EQ(longest_normal(sheet, true, Sidedness::kAuto), 0);
  EXPECT_NEAR(longest_normal(sheet, true, Sidedness::kNever), 1, 1e-6);
  EXPECT_NEAR(longest_normal(solid, true, Sidedness::kAuto), 1, 1e-6);
  EXPECT_EQ(longest_normal(solid, false, Sidedness::kAlways), 0);
}
// The left half is cut away: coverage 0 there, no colour, no opacity, area counted before cut-outs.
TEST(CutOuts, Weigh) {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(1, 1, 1);
  add_quad(s, V3d(0, 0, 0.5), V3d(1, 0, 0), V3d(0, 1, 0.001));
  add_texture(s, 0, 64, 64, 4, [](int x, int) { return std::array<float, 4>{x < 32 ? 1.f : 0.25f, 0, x < 32 ? 1.f : 0.f, x < 32 ? 0.f : 1.f}; });
  s.materials[0].map_kd.wrap.fill(Wrap::kClamp);
  Recipe recipe = color_recipe(16);
  recipe.box = Box3d(V3d(0), V3d(1));
  const Pack pack = bake_quietly(s, recipe);
  check_invariants(pack);
  const Dense area = dense(pack.levels[0], "area"), coverage = dense(pack.levels[0], "coverage"), alpha = dense(pack.levels[0], "alpha"),
              cd = dense(pack.levels[0], "Cd"), normal = dense(pack.levels[0], "normal"), crossings = dense(pack.levels[0], "crossings");
  double covered = 0;
  for_each_cell(area.n, [&](const V3i& v) {
    if (!area.state(v)) return;
    covered += static_cast<double>(area.at(v) * coverage.at(v)) / 256;
    EXPECT_EQ(normal.at3(v), V3f(0, 0, 0)) << "two-sided";
    if (v.x < 7) {
      EXPECT_NEAR(coverage.at(v), 0, 1e-6);
      EXPECT_NEAR(alpha.at(v, 2), 0, 1e-6);
      EXPECT_NEAR(crossings.at(v, 2), 0, 1e-6);
    }
    if (v.x > 8) {
      EXPECT_NEAR(coverage.at(v), 1, 1e-6);
      EXPECT_NEAR(crossings.at(v, 2), area.at(v), 1e-3);  // all rays cross it; tilt 0.001
      EXPECT_NEAR(cd.at(v, 0), 0.25, 1e-5);
      EXPECT_NEAR(cd.at(v, 2), 0, 1e-5);  // the cut-away blue does not bleed in: straight colour is weighed by alpha
    }
  });
  EXPECT_NEAR(pack.statistics.area, 1, 1e-5);
  EXPECT_NEAR(pack.statistics.covered_area, 0.5, 2.0 / 64);  // two texels of filtering along the edge
  EXPECT_NEAR(covered, pack.statistics.covered_area, 1e-5);
}
// A wave of holes across voxels of 16 texels, against the mask's own bilinear values at 64 × 64 points a voxel. What is left is the outline within a sample's
// square of three texels (half a voxel, 11 texels wide, is cut into 4²): an outline through 6 of the 32 squares of a voxel, each off by 0.05 of itself with either sign,
// comes to 0.004. One square for each half was off by 0.0385.
TEST(CutOuts, CoverageOfOutlines) {
  constexpr int kTexels = 256, kVoxels = 16, kPoints = 64;
  const auto mask = [](int x, int y) {
    const int at = std::clamp(x, 0, kTexels - 1), row = std::clamp(y, 0, kTexels - 1);
    return std::sin(0.11 * at + 0.4 * std::sin(0.05 * row)) + std::sin(0.07 * row + 0.3) > 0.2 ? 1.0 : 0.0;
  };
  Scene s = empty_scene();
  add_quad(s, V3d(0, 0, 0.5), V3d(1, 0, 0), V3d(0, 1, 0.001));
  add_texture(s, 0, kTexels, kTexels, 4, [&](int x, int y) { return std::array<float, 4>{1, 1, 1, static_cast<float>(mask(x, y))}; });
  s.materials[0].map_kd.wrap.fill(Wrap::kClamp);
  Recipe recipe = color_recipe(kVoxels);
  recipe.box = Box3d(V3d(0), V3d(1));
  recipe.want.slices = false;
  const Pack pack = bake_quietly(s, recipe);
  const Dense coverage = dense(pack.levels[0], "coverage");
  double square = 0, bias = 0, worst = 0;
  int voxels = 0;
  for_each_cell(coverage.n, [&](const V3i& v) {
    if (!coverage.state(v)) return;
    double truth = 0;
    for (int i = 0; i < kPoints; ++i)
      for (int j = 0; j < kPoints; ++j) {
        const double x = (v.x + (i + 0.5) / kPoints) / kVoxels * kTexels - 0.5, y = (1 - (v.y + (j + 0.5) / kPoints) / kVoxels) * kTexels - 0.5;
        const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
        const double fx = x - x0, fy = y - y0;
        truth += ((mask(x0, y0) * (1 - fx) + mask(x0 + 1, y0) * fx) * (1 - fy) + (mask(x0, y0 + 1) * (1 - fx) + mask(x0 + 1, y0 + 1) * fx) * fy) / (kPoints * kPoints);
      }
    const double error = static_cast<double>(coverage.at(v)) - truth;
    square += error * error;
    bias += error;
    worst = std::max(worst, std::abs(error));
    ++voxels;
  });
  ASSERT_EQ(voxels, kVoxels * kVoxels);
  RecordProperty("rms", std::to_string(std::sqrt(square / voxels)));
  std::printf("coverage: rms %.5f, worst %.5f, mean %.6f\n", std::sqrt(square / voxels), worst, bias / voxels);
  EXPECT_LT(std::sqrt(square / voxels), 0.005);
  EXPECT_LT(worst, 0.02);
  EXPECT_LT(std::abs(bias / voxels), 0.0005);
}
TEST(CutOuts, AllCutAway) {
  Scene s = empty_scene();
  add_box(s, V3d(0), V3d(1));
  add_texture(s, 0, 4, 4, 4, [](int, int) { return std::array<float, 4>{1, 1, 1, 0}; });
  const Pack pack = bake_quietly(s, color_recipe(16));
  check_invariants(pack);
}
// A solid cut away on all sides, and farther off than colour runs something that has one: `Cd` is there wherever matter is, on every level, and has the nearest colour.
TEST(CutOuts, MatterFarFromAnyColourHasOne) {
  Scene s = empty_scene();
  add_box(s, V3d(0.03), V3d(0.97));
  add_texture(s, 0, 4, 4, 4, [](int, int) { return std::array<float, 4>{1, 1, 1, 0}; });
  s.materials.push_back({});
  s.materials[1].kd = V3f(0.25f, 0.5f, 0.75f);
  add_triangle(s, V3d(1.9, 0.1, 0.1), V3d(1.9, 0.2, 0.1), V3d(1.9, 0.1, 0.2), 1);
  Recipe recipe = color_recipe(32);
  recipe.want.visibility = recipe.want.levels = true;
  const Pack pack = bake_quietly(s, recipe);
  check_invariants(pack);
  ASSERT_GT(pack.levels.size(), 3u);
  for (const Level& level : pack.levels) {
    const Dense solid = dense(level, "solid"), cd = dense(level, "Cd");
    for_each_cell(solid.n, [&](const V3i& v) {
      if (!solid.state(v)) return;
      EXPECT_NE(cd.state(v), 0);
      EXPECT_NEAR(cd.at(v, 1), 0.5, 1e-6) << v.x << " " << v.y << " " << v.z << " of " << solid.n.x;
    });
  }
}
// Vertex colours multiply kd and are integrated exactly: linear over a triangle.
TEST(Color, VertexColours) {
  Scene s = empty_scene();
  s.materials[0].kd = V3f(0.5f, 1, 1);
  add_quad(s, V3d(0, 0, 0.5), V3d(1, 0, 0), V3d(0, 1, 0));
  for (const V3d& p : s.mesh.points) s.mesh.colors.push_back(V3f(static_cast<float>(p.x), static_cast<float>(p.y), 1));
  Recipe recipe = color_recipe(8);
  recipe.box = Box3d(V3d(0), V3d(1));
  const Pack pack = bake_quietly(s, recipe);
  const Dense cd = dense(pack.levels[0], "Cd"), area = dense(pack.levels[0], "area");
  for_each_cell(cd.n, [&](const V3i& v) {
    if (!area.state(v)) return;
    EXPECT_NEAR(cd.at(v, 0), 0.5 * (v.x + 0.5) / 8, 1e-6);  // float
    EXPECT_NEAR(cd.at(v, 1), (v.y + 0.5) / 8, 1e-6);
    EXPECT_NEAR(cd.at(v, 2), 1, 1e-6);
  });
}

}  // namespace
}  // namespace texel::test
