// A pack as a texel repeated over surfaces, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bake/bake.h"
#include "bake/facets.h"
#include "bake/height_mesh.h"
#include "bake/view_over.h"
#include "formats/error.h"
#include "formats/readers.h"
#include "tests/bake/bake_util.h"
#include "tests/formats/pack_builder.h"

namespace texel {
namespace {

using test::add_channel;
using test::make_layer;

Light sun(const V3d& travels) { return {Light::Kind::kSun, travels, V3f(1, 1, 1)}; }

// Orthographic along `from` -> origin.
ViewOptions looking(const V3d& eye, const V3d& target, double height, int pixels) {
  ViewOptions o;
  o.camera = {eye, target, std::abs((eye - target).normalized().z) > 0.9 ? V3d(0, 1, 0) : V3d(0, 0, 1), 0, height};
  o.width = o.height = pixels;
  o.samples = 1;
  return o;
}

double mean_alpha(const Image& image) {
  double sum = 0;
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) sum += static_cast<double>(image.pixels[i]);
  return sum / (image.width * image.height);
}

// A pack of n.x × n.y × n.z voxels of edge 1/n.x from the origin, filled with `density` per world unit; of coarser levels' voxels only the part in the box is.
Pack slab_pack(const V3i& n, double density, int levels = 1) {
  Pack pack;
  pack.grid = {V3d(0, 0, 0), 1.0 / n.x, n};
  for (int l = 0; l < levels; ++l) {
    const Grid g = pack.grid.level(l);
    pack.levels.push_back({g, {}});
    Layer layer = make_layer(g.n, [](int, int, int) { return true; });
    add_channel(layer, "density", 1, [&](int x, int y, int z) {
      double share = 1;
      const std::array<int, 3> at{x, y, z};
      for (int k = 0; k < 3; ++k) share *= std::min(1.0, static_cast<double>(n[k]) / (1 << l) - at[static_cast<std::size_t>(k)]);
      return V3f(static_cast<float>(density * share));
    });
    pack.levels.back().layers.push_back(std::move(layer));
  }
  return pack;
}

// One texel on the parallelogram from the origin along a and b, its height vectors all `up`.
TexelSurface patch(const V3d& a, const V3d& b, const V3d& up) {
  TexelSurface s;
  s.points = {V3d(0, 0, 0), a, a + b, b};
  for (const V3d& p : s.points) s.tips.push_back(p + up);
  s.triangles = {{0, 1, 2}, {0, 2, 3}};
  s.uvs = {{{{0, 0}, {1, 0}, {1, 1}}}, {{{0, 0}, {1, 1}, {0, 1}}}};
  return s;
}

TEST(Over, OnceOnAPlaneIsThePackItself) {
  test::BallOptions ball;
  ball.n = 64;
  ball.h = 0.0625;
  const Pack pack = test::ball_pack(ball);
  const TexelAxes axes = texel_axes(2);
  const TexelSurface plane = plane_surface(pack.grid.box(), axes, 1, 1, pack.grid.box().size().z);
  ViewOptions o;
  o.camera = orbit_camera(pack.grid.box(), -60, 20);
  o.width = o.height = 96;
  o.samples = 1;
  Report report;
  for (const double times : {1.0, 3.0}) {  // level 0 alone, and levels blended
    o.camera.eye = o.camera.target + (o.camera.eye - o.camera.target) * times;
    const Image plain = over_background(view_volume(pack, o, report), V3f(0.1f)), over = over_background(view_over(pack, plane, {axes, V3f(-1)}, o, report), V3f(0.1f));
    double sum = 0;
    for (std::size_t i = 0; i < plain.pixels.size(); ++i) sum += std::pow(static_cast<double>(plain.pixels[i] - over.pixels[i]), 2);
    const double rmse = std::sqrt(sum / static_cast<double>(plain.pixels.size()));
    RecordProperty("rmse_1e5", static_cast<int>(rmse * 1e5));
    // Golden: light is worked out between voxels here and interpolated there, shadows are directional here. A voxel's light differs by a cosine's change over a voxel, 1/26 of a
    // radian on this ball; about half of the picture is ball.
    EXPECT_LT(rmse, 0.02) << times;
    EXPECT_NEAR(mean_alpha(view_volume(pack, o, report)), mean_alpha(view_over(pack, plane, {axes, V3f(-1)}, o, report)), 2e-3);  // the same march, steps begin elsewhere
  }
}

TEST(Over, StretchedAndShearedSlabsFollowBeerAndLambert) {
  const double density = 2;  // per unit of the pack
  const Pack pack = slab_pack(V3i(16, 16, 8), density);  // 1 × 1 × 0.5
  Report report;
  for (const V3d& up : {V3d(0, 0, 0.5), V3d(0, 0, 2), V3d(0.7, 0, 0.5), V3d(-0.4, 0.3, 0.25)})
    for (const V3d& way : {V3d(0, 0, -1), V3d(0.3, 0.1, -1)}) {
      const V3d a(3, 0, 0), b(0.5, 2, 0), middle = (a + b + up) / 2;
      const ViewOptions o = looking(middle - way.normalized() * 20, middle, 0.01, 2);
      const Image image = view_over(pack, patch(a, b, up), {texel_axes(2), V3f(-1)}, o, report);
      // From floor to roof: world = a X + b Y + up (2 Z); the ray crosses up.z, and drifts by the rest. Its length in the pack:
      const V3d drift = way * (up.z / -way.z) + up;  // world, within the base plane
      const double y = drift.y / b.y, x = (drift.x - y * b.x) / a.x;
      const double depth = density * V3d(x, y, 0.5).length();
      EXPECT_NEAR(image.at(1, 1)[3], 1 - std::exp(-depth), 2e-5) << up << way;  // scaled rounding: some 40 float steps
    }
}

TEST(Over, VoxelsBeyondTheBoxCountAsWhatIsWithin) {
  const Pack pack = slab_pack(V3i(12, 12, 3), 3.0, 5);  // the coarsest levels' voxels are 16 high and wide, the box 12 and 3
  Report report;
  const TexelAxes axes = texel_axes(2);
  const TexelSurface plane = plane_surface(pack.grid.box(), axes, 4, 4, 0.25);
  for (int level = 0; level < 5; ++level) {
    ViewOptions o = looking(V3d(2, 2, 20), V3d(2, 2, 0), 1, 8);
    o.level = level;
    EXPECT_NEAR(mean_alpha(view_over(pack, plane, {axes, V3f(-1)}, o, report)), 1 - std::exp(-3 * 0.25), 2e-5) << level;  // scaled rounding
  }
}

// One sheet of voxels across `axis`, its normals along it.
Pack sheet_pack(int axis) {
  Pack pack;
  pack.grid = {V3d(0, 0, 0), 1.0 / 16, V3i(16, 16, 16)};
  pack.levels.push_back({pack.grid, {}});
  Layer layer = make_layer(pack.grid.n, [axis](int x, int y, int z) { return (axis == 0 ? x : axis == 1 ? y : z) == 8; });
  V3f along(0.0f);
  along[axis] = 1;
  add_channel(layer, "alpha", 3, [&](int, int, int) { return along; });
  add_channel(layer, "normal", 3, [&](int, int, int) { return along; });
  add_channel(layer, "S_diag", 3, [&](int, int, int) { return along; });
  add_channel(layer, "S_off", 3, [](int, int, int) { return V3f(0.0f); });
  add_channel(layer, "Cd", 3, [](int, int, int) { return V3f(0.5f); });
  pack.levels.back().layers.push_back(std::move(layer));
  return pack;
}

TEST(Over, NormalsGoByTheInverseTranspose) {
  Report report;
  const V3d a(2, 0, 0), b(0, 1, 0);
  for (const double shear : {0.0, 0.5, 1.5}) {
    const V3d up(shear, 0, 1);
    // A sheet that stands: spanned by b and up, and so its normal leans back by the shear.
    const V3d standing = b.cross(up).normalized();
    // One that lies stays as it is, however the height vectors lean.
    const std::pair<int, V3d> sheets[] = {{0, standing}, {2, V3d(0, 0, 1)}};
    for (const auto& [axis, normal] : sheets) {
      const V3d light = V3d(axis == 0 ? -1 : -0.6, 0, axis == 0 ? 0.1 : -1).normalized();
      const V3d middle = (a + b + up) / 2;
      ViewOptions o = looking(middle + normal * 10, middle + (axis == 0 ? a : up) / 32, 0.02, 2);
      o.lights = {sun(light)};
      o.shadows = false;
      const Image image = view_over(sheet_pack(axis), patch(a, b, up), {texel_axes(2), V3f(-1)}, o, report);
      EXPECT_GT(image.at(1, 1)[3], 0.9f) << shear;
      // The rounding of S that keeps it invertible costs up to 1 %.
      EXPECT_NEAR(image.at(1, 1)[0], 0.5 * -light.dot(normal), 0.006) << shear << " " << axis;
    }
  }
}

TEST(Over, CarriedFacetsKeepTheirProjectedAreas) {
  // σ'(ω) ∝ σ(M ω), and a sheet stays one.
  Facets f;
  f.s = {1, 0.3, 0.2, 0.1, -0.05, 0.08};
  const std::array<V3d, 3> back{V3d(1, 0.5, 0), V3d(0, 2, 0.1), V3d(0.3, 0, 0.7)};
  const Facets g = carried(f, back);
  const auto sigma = [](const Form& s, const V3d& w) { return std::sqrt(s.form(w, w)); };
  const auto expected = [&](const V3d& w) { return sigma(f.s, V3d(back[0].dot(w), back[1].dot(w), back[2].dot(w))); };
  const double scale = sigma(g.s, V3d(0, 0, 1)) / expected(V3d(0, 0, 1));
  for (const V3d& w : {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0.6, 0, 0.8), V3d(-0.48, 0.64, 0.6)}) EXPECT_NEAR(sigma(g.s, w), scale * expected(w), 1e-12);  // scaled rounding
  Facets sheet;
  sheet.s = {0, 0, 1, 0, 0, 0};
  sheet.mean = V3d(0, 0, 1);
  const Facets leaning = carried(sheet, back);
  EXPECT_NEAR(leaning.mean.length(), 1, 1e-9);
  EXPECT_NEAR(leaning.mean.dot(back[2].normalized()), 1, 1e-9);
}

Pack perlin_pack(bool cyclic) {
  HeightOptions heights;
  heights.perlin = PerlinField{3, 3, 1};
  Scene scene = make_perlin_field(heights);
  Recipe recipe;
  recipe.resolution = V3i(32, 0, 0);
  recipe.margin = 0;
  recipe.want.slices = recipe.want.preview = false;
  if (cyclic) recipe.cyclic = {true, true, false};
  Report report;
  if (!cyclic) recipe.box = Box3d(V3d(0.1, 0.1, -0.1), V3d(0.6, 0.6, 0.5));  // opposite sides have nothing to do with each other
  return bake(scene, recipe, report);
}

TEST(Over, CyclicPacksShowNoSeam) {
  for (const bool cyclic : {true, false}) {
    const Pack pack = perlin_pack(cyclic);
    const TexelAxes axes = texel_axes(2);
    const V3d size = pack.grid.box().size();
    Report report;
    const TexelSurface plane = plane_surface(pack.grid.box(), axes, 3, 3, size.z);
    const V3d middle = pack.grid.box().min + V3d(size.x, size.y, 0) * 1.5;
    const int per = 24;
    ViewOptions o = looking(middle + V3d(0, 0, 10), middle, 3 * size.y, 3 * per);
    o.lights = {sun(V3d(1, -0.5, -0.8))};
    const Image image = view_over(pack, plane, {axes, V3f(-1)}, o, report);
    std::vector<double> jump(per, 0.0);  // mean step between columns x − 1 and x of a texel, and between rows
    for (int y = 0; y < 3 * per; ++y)
      for (int x = per; x < 3 * per; ++x) {
        jump[static_cast<std::size_t>(x % per)] += static_cast<double>(std::abs(image.at(x, y)[0] - image.at(x - 1, y)[0]));
        jump[static_cast<std::size_t>(x % per)] += static_cast<double>(std::abs(image.at(y, x)[0] - image.at(y, x - 1)[0]));
      }
    const double inner = *std::max_element(jump.begin() + 1, jump.end());
    if (cyclic) EXPECT_LE(jump[0], inner);
    else EXPECT_GT(jump[0], 1.5 * inner);  // the test can see a seam
    // A field hides all that is behind it; how much of a tilted sheet the march lets through is the pack's own view's affair, and the same here.
    const V3d own = pack.grid.box().center();
    const ViewOptions near_own = looking(own + V3d(0, 0, 10), own, 0.5 * size.y, 48), near_copy = looking(middle + V3d(0, 0, 10 + own.z - middle.z), V3d(middle.x, middle.y, own.z), 0.5 * size.y, 48);
    const double plain = mean_alpha(view_volume(pack, near_own, report)), copy = mean_alpha(view_over(pack, plane, {axes, V3f(-1)}, near_copy, report));
    std::printf("the field's middle covers %.4f, its copy %.4f\n", plain, copy);
    EXPECT_GT(plain, 0.95);
    EXPECT_NEAR(copy, plain, 2e-3);
  }
}

TEST(Over, ABallOfOpaqueTexelsHasNoCracks) {
  const Pack pack = slab_pack(V3i(16, 16, 4), 400);  // 25 a voxel
  const TexelAxes axes = texel_axes(2);
  Report report;
  const TexelSurface ball = sphere_surface(pack.grid.box(), axes, 12, 6, 0.25);
  EXPECT_TRUE(report.issues.empty());
  const double outer = 12 / (2 * std::numbers::pi) + 0.25;
  for (const V3d& eye : {V3d(10, 0, 0), V3d(3, -7, 2), V3d(0, 0, 10)}) {
    const ViewOptions o = looking(eye, V3d(0, 0, 0), 2.2 * outer, 112);
    const Image image = view_over(pack, ball, {axes, V3f(-1)}, o, report);
    // 290 pixels on the rim, each off by at most a half where one ray decides: 4 sigma = 4·0.29·sqrt(290) = 20 of 8100 pixels; facets of 2π/132 lose 4e-4.
    EXPECT_NEAR(mean_alpha(image) * std::pow(2.2 * outer, 2), std::numbers::pi * outer * outer, 2.5e-3 * std::numbers::pi * outer * outer);
    int holes = 0;
    for (int y = 0; y < 112; ++y)
      for (int x = 0; x < 112; ++x) {
        const double r = std::hypot(x + 0.5 - 56, y + 0.5 - 56) / 112 * 2.2 * outer;
        holes += r < outer * 0.995 && image.at(x, y)[3] < 0.998f;
      }
    EXPECT_EQ(holes, 0);
  }
}

TEST(Over, RaysAtVerticesAndEdgesMeetNoGapAndNoOverlap) {
  const Pack pack = slab_pack(V3i(8, 8, 8), 1);
  Report report;
  const TexelSurface ball = sphere_surface(pack.grid.box(), texel_axes(2), 6, 3, 1);
  const TexelShell shell(ball, pack.grid.box(), texel_axes(2), report);
  std::vector<V3d> targets = ball.tips;
  for (std::size_t i = 0; i < ball.triangles.size(); i += 5) targets.push_back((ball.tips[ball.triangles[i][0]] + ball.tips[ball.triangles[i][1]]) / 2);
  std::vector<ShellPiece> buffer, pieces;
  for (const V3d& eye : {V3d(9, 0, 0), V3d(0, 0, 9), V3d(2, -7, 3)})
    for (const V3d& target : targets) {
      const V3d way = (target - eye).normalized();
      pieces.clear();
      shell.along(eye, way, 1e300, &buffer, [&](const ShellPiece& p) { pieces.push_back(p); return true; });
      // In, out into the hollow ball at most, in and out again. Rounding: 1e-12 of the distance.
      int gaps = 0;
      double reach = pieces.empty() ? 0 : pieces[0].from, covered = 0, sum = 0;
      for (const ShellPiece& p : pieces) {
        gaps += p.from > reach + 1e-10;
        covered += std::max(p.to - std::max(p.from, reach), 0.0);
        sum += p.to - p.from;
        reach = std::max(reach, p.to);
      }
      EXPECT_LE(gaps, 1);
      if (std::hypot(eye.x, eye.y) + std::hypot(target.x, target.y) > 0) { EXPECT_NEAR(sum, covered, 1e-10); }  // along an edge itself its tetrahedra may count twice
      if ((target - eye).dot(target) < -1) { EXPECT_GT(pieces.size(), 2u); }
    }
}

TEST(Over, MeshesBringTheirOwnCoordinates) {
  const Pack pack = slab_pack(V3i(8, 8, 4), 3);
  const TexelAxes axes = texel_axes(2);
  Report report;
  Scene scene = test::empty_scene();
  EXPECT_THROW((void)mesh_surface(scene, nullptr, pack.grid.box(), axes, 1, 1, 0, "m.obj", report), Error);
  test::add_quad(scene, V3d(0, 0, 0), V3d(3, 0, 0), V3d(0, 3, 0));
  const TexelSurface own = mesh_surface(scene, nullptr, pack.grid.box(), axes, 3, 3, 0, "m.obj", report);
  for (std::size_t i = 0; i < own.points.size(); ++i) EXPECT_LT((own.tips[i] - own.points[i] - V3d(0, 0, 0.5)).length(), 1e-12);  // in proportion: a texel is its box
  Scene moved = scene;
  for (V3d& p : moved.mesh.points) p += V3d(1, 0, 2);
  EXPECT_EQ(mesh_surface(scene, &moved, pack.grid.box(), axes, 3, 3, 0, "m.obj", report).tips[2], V3d(4, 3, 2));
  moved.mesh.triangles.pop_back();
  EXPECT_THROW((void)mesh_surface(scene, &moved, pack.grid.box(), axes, 3, 3, 0, "m.obj", report), Error);
  scene.mesh.uv_corners[1][2] = kNoIndex;
  EXPECT_THROW((void)mesh_surface(scene, nullptr, pack.grid.box(), axes, 3, 3, 0, "m.obj", report), Error);
  // A sharp valley with high texels folds them; a plane does not.
  TexelSurface valley = patch(V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 0.5));
  std::swap(valley.tips[0], valley.tips[1]);
  std::swap(valley.tips[2], valley.tips[3]);
  const TexelShell shell(valley, pack.grid.box(), axes, report);
  ASSERT_EQ(report.issues.size(), 1u);
  EXPECT_EQ(report.issues[0].id, "over-folded");
}

TEST(Over, GroundIsSeenAndShaded) {
  // A box of matter over the middle of the texel; its shadow falls beside it.
  Pack pack = slab_pack(V3i(16, 16, 8), 0);
  Layer layer = make_layer(pack.grid.n, [](int x, int y, int z) { return x >= 6 && x < 10 && y >= 2 && y < 14 && z >= 4 && z < 6; });
  add_channel(layer, "density", 1, [](int, int, int) { return V3f(1000.0f); });
  pack.levels[0].layers = {layer};
  Report report;
  const TexelAxes axes = texel_axes(2);
  const TexelSurface plane = plane_surface(pack.grid.box(), axes, 1, 1, 0.5);
  ViewOptions o = looking(V3d(0.5, 0.5, 10), V3d(0.5, 0.5, 0), 1, 32);
  o.lights = {sun(V3d(1, 0, -1))};
  const double lit = 0.4 / std::sqrt(2.0);
  for (const bool shadows : {true, false}) {
    o.shadows = shadows;
    const Image image = view_over(pack, plane, {axes, V3f(0.4f)}, o, report);
    EXPECT_FLOAT_EQ(image.at(3, 16)[3], 1.0f);
    EXPECT_NEAR(image.at(3, 16)[0], lit, 1e-6);                  // exact: no matter on the way
    EXPECT_NEAR(image.at(27, 16)[0], shadows ? 0 : lit, 1e-4);   // x = 0.86; the shadow lies from 0.625 to 1
  }
}

TEST(Over, SameBytesForAnyThreadCount) {
  const Pack pack = perlin_pack(true);
  const TexelAxes axes = texel_axes(2);
  Report report;
  const TexelSurface ball = sphere_surface(pack.grid.box(), axes, 6, 3, 0.25);
  std::vector<Image> images;
  for (const int threads : {1, 2, 4}) {
    ViewOptions o;
    o.camera = {V3d(3, 1, 1), V3d(0, 0, 0), V3d(0, 0, 1), 50, 1};
    o.width = o.height = 24;
    o.threads = threads;
    images.push_back(view_over(pack, ball, {axes, V3f(0.2f)}, o, report));
  }
  EXPECT_EQ(images[0].pixels, images[1].pixels);
  EXPECT_EQ(images[0].pixels, images[2].pixels);
}

}  // namespace
}  // namespace texel
