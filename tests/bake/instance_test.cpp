// Instances: the same pack as their triangles copied, without the copies.
#include <algorithm>
#include <cmath>

#include "bake/crossings.h"
#include "bake/light.h"
#include "bake/view.h"
#include "formats/error.h"
#include "formats/instances.h"
#include "formats/readers.h"
#include "tests/bake/bake_util.h"
#include "tests/formats/gltf_builder.h"

namespace texel::test {
namespace {

Affine placement(const Rotation& r, const V3d& scale, const V3d& at) {
  Affine a;
  for (int i = 0; i < 3; ++i) {
    const auto row = static_cast<std::size_t>(4 * i);
    a.m[row] = r.x[i] * scale.x;
    a.m[row + 1] = r.y[i] * scale.y;
    a.m[row + 2] = r.z[i] * scale.z;
    a.m[row + 3] = at[i];
  }
  return a;
}

Scene with_materials() {
  Scene scene;
  for (const V3f& kd : {V3f(0.8f, 0.1f, 0.1f), V3f(0.1f, 0.7f, 0.2f), V3f(0.1f, 0.2f, 0.9f)}) scene.materials.emplace_back().kd = kd;
  scene.materials[2].two_sided = true;
  return scene;
}

// A closed ball, a shape of an inside-out box with an open sheet, and one with vertex colours.
std::vector<Mesh> shapes(int rings) {
  std::vector<Mesh> all;
  Scene ball = with_materials();
  add_ball(ball, 1, rings, 0);
  all.push_back(ball.mesh);
  Scene mixed = with_materials();
  add_box(mixed, V3d(-0.5, -0.4, -0.3), V3d(0.5, 0.4, 0.3), true, 63, 1);
  add_quad(mixed, V3d(-1, -1, 0.6), V3d(2, 0, 0.3), V3d(0.1, 2, 0), 2);
  all.push_back(mixed.mesh);
  Scene colored = with_materials();
  add_quad(colored, V3d(-0.7, -0.7, 0), V3d(1.4, 0, 0), V3d(0, 1.4, 0), 1);
  colored.mesh.colors = {V3f(1, 0, 0), V3f(0, 1, 0), V3f(0, 0, 1), V3f(1, 1, 1)};
  all.push_back(colored.mesh);
  return all;
}

// `count` placements in the unit cube and a floor that is there once: turned, of any size, every third mirrored, every fifth stretched.
Scene scattered(int count, double size, int rings, std::uint64_t seed = 1) {
  Scene scene = with_materials();
  add_quad(scene, V3d(-0.1, -0.1, -0.05), V3d(1.2, 0, 0), V3d(0, 1.2, 0.1), 0);
  scene.shapes = shapes(rings);
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    const Rotation turn = random_rotation(random);
    V3d scale = V3d(1, 1, 1) * size * random.uniform(0.5, 1.5);
    if (i % 3 == 0) scale.x = -scale.x;
    if (i % 5 == 0) scale *= V3d(1, 0.6, 1.7);
    scene.instances.push_back({static_cast<std::uint32_t>(i % 3), placement(turn, scale, V3d(random.uniform(), random.uniform(), random.uniform()))});
  }
  return scene;
}

// Largest difference of a channel between packs of the same voxels, over the larger of 1 and the value.
double largest_difference(const Level& a, const Level& b, const std::string& name) {
  const Dense x = dense(a, name), y = dense(b, name);
  EXPECT_EQ(x.active, y.active) << name;
  double worst = 0;
  for (std::size_t i = 0; i < x.values.size() && i < y.values.size(); ++i)
    worst = std::max(worst, std::abs(static_cast<double>(x.values[i]) - static_cast<double>(y.values[i])) / std::max(1.0, std::abs(static_cast<double>(x.values[i]))));
  return worst;
}

Recipe everything(int resolution) {
  Recipe recipe = volume_recipe(resolution);
  recipe.want.slices = true;
  return recipe;
}

void expect_same(const Pack& a, const Pack& b, double bound, const std::vector<std::string>& leave_out = {}) {
  ASSERT_EQ(a.levels.size(), b.levels.size());
  EXPECT_EQ(a.grid.n, b.grid.n);
  for (std::size_t l = 0; l < a.levels.size(); ++l)
    for (const Layer& layer : a.levels[l].layers)
      for (const Channel& c : layer.channels)
        if (std::find(leave_out.begin(), leave_out.end(), c.name) == leave_out.end()) {
          EXPECT_LE(largest_difference(a.levels[l], b.levels[l], c.name), bound) << c.name << " at level " << l;
        }
  EXPECT_EQ(a.statistics.triangles, b.statistics.triangles);
  EXPECT_EQ(a.statistics.components, b.statistics.components);
  EXPECT_EQ(a.statistics.closed, b.statistics.closed);
  EXPECT_NEAR(a.statistics.area, b.statistics.area, 1e-12 * a.statistics.area);
  EXPECT_NEAR(a.statistics.volume, b.statistics.volume, 1e-12 * a.statistics.volume);
}

// Sums run in another order, which doubles show in the sixteenth digit and floats once in a while in their last.
constexpr double kOrder = 0x1p-22;

TEST(Instances, SamePackAsCopies) {
  const Scene scene = scattered(30, 0.12, 12);
  for (const int resolution : {40, 7}) {
    const Pack placed = bake_quietly(scene, everything(resolution)), copied = bake_quietly(flatten_instances(scene), everything(resolution));
    check_invariants(placed);
    expect_same(placed, copied, kOrder);
    ASSERT_EQ(placed.slices.size(), copied.slices.size());
    for (std::size_t s = 0; s < placed.slices.size(); ++s)
      for (int k = 0; k < placed.slices[s].count; ++k) {
        const Image a = placed.slices[s].image(k), b = copied.slices[s].image(k);
        double worst = 0;
        for (std::size_t i = 0; i < a.pixels.size(); ++i) worst = std::max(worst, std::abs(static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i])));
        EXPECT_LE(worst, kOrder) << "stack " << s << " slice " << k;
      }
  }
}

TEST(Instances, VisibleNormalsAndLitSlices) {
  const Scene scene = scattered(12, 0.2, 8, 2);
  Recipe recipe = everything(24);
  recipe.normals = Normals::kVisible;
  recipe.lights.push_back({.kind = Light::Kind::kSun, .vector = V3d(-0.3, -0.4, -0.8)});
  expect_same(bake_quietly(scene, recipe), bake_quietly(flatten_instances(scene), recipe), kOrder);
}

TEST(Instances, EveryRayMeetsTheSame) {
  const Scene scene = scattered(40, 0.1, 9, 3), flat = flatten_instances(scene);
  for (const Pattern pattern : {Pattern::kGrid, Pattern::kLattice}) {
    Recipe recipe = volume_recipe(33);
    recipe.samples = 3;
    recipe.pattern = pattern;
    const auto a = run_stages(scene, recipe, false, 1), b = run_stages(flat, recipe, false, 1);
    std::int64_t met = 0, different = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Bundle x = make_bundle(a->scene, a->plan, *a->textures, recipe, axis), y = make_bundle(b->scene, b->plan, *b->textures, recipe, axis);
      for (int band = 0; band < x.bands; ++band) {
        Band p, q;
        BandScratch scratch;
        trace_band(x, band, p, scratch);
        trace_band(y, band, q, scratch);
        ASSERT_EQ(p.first, q.first);
        for (std::size_t i = 0; i < p.first.back(); ++i, ++met)
          different += p.crossings[i].w != q.crossings[i].w || p.crossings[i].cell != q.crossings[i].cell || p.crossings[i].enters != q.crossings[i].enters ||
                       p.crossings[i].winding != q.crossings[i].winding || crossed_material(x, p.crossings[i]) != crossed_material(y, q.crossings[i]);
      }
    }
    EXPECT_GT(met, 10000);
    EXPECT_EQ(different, 0);
  }
}

// Nodes that lie in one voxel are added as a whole; those of more than kMostVectors triangles add up normals of about one direction first, to
// shadows that are short by at most 1.3e-4 (shape_sums.h).
TEST(Instances, SmallAgainstAVoxel) {
  Scene scene = with_materials();
  scene.shapes = shapes(60);
  ASSERT_GT(scene.shapes[0].triangles.size(), 8192u);
  Random random(7);
  for (int i = 0; i < 300; ++i) {
    V3d scale = V3d(1, 1, 1) * 0.02;
    if (i % 4 == 1) scale.y = -scale.y;
    scene.instances.push_back({static_cast<std::uint32_t>(i % 3), placement(random_rotation(random), scale, V3d(random.uniform(), random.uniform(), random.uniform()))});
  }
  const auto placed = run_stages(scene, volume_recipe(6), false, 3), copied = run_stages(flatten_instances(scene), volume_recipe(6), false, 3);
  for (std::size_t l = 0; l < 3; ++l) {
    const Surface &a = placed->surfaces[l], &b = copied->surfaces[l];
    ASSERT_EQ(a.areas.size(), b.areas.size());
    for (std::size_t i = 0; i < a.areas.size(); ++i) {
      const double area = b.areas[i].area, exact = 1e-12 * area;
      EXPECT_NEAR(a.areas[i].area, area, exact);
      EXPECT_NEAR(a.areas[i].covered, b.areas[i].covered, exact);
      EXPECT_NEAR(a.areas[i].lost, b.areas[i].lost, exact);
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(a.areas[i].outward[k], b.areas[i].outward[k], exact);
        EXPECT_NEAR(a.areas[i].crossings[k], b.areas[i].crossings[k], 1.3e-4 * b.areas[i].crossings[k] + exact);
        EXPECT_NEAR(a.areas[i].stopping[k], b.areas[i].stopping[k], 1.3e-4 * b.areas[i].stopping[k] + exact);
        EXPECT_NEAR(a.color[i][k], b.color[i][k], 1e-7 * area);  // albedo is a float
        EXPECT_NEAR(a.moments[i].m[k], b.moments[i].m[k], exact);
      }
      EXPECT_NEAR(a.moments[i].xx, b.moments[i].xx, exact);
      EXPECT_NEAR(a.moments[i].yz, b.moments[i].yz, exact);
    }
  }
}

TEST(Instances, ObliqueRaysMeetTheSame) {
  const Scene scene = scattered(40, 0.1, 12, 8), flat = flatten_instances(scene);
  const RayScene a(scene), b(flat);
  Random random(9);
  int met = 0, differ = 0;
  for (int i = 0; i < 4000; ++i) {
    const V3d from = V3d(0.5, 0.5, 0.5) + random.direction() * 3.0, to(random.uniform(), random.uniform(), random.uniform());
    const RayScene::Hit x = a.first_hit(from, to - from), y = b.first_hit(from, to - from);
    // A ray may pass an outline on either side, as floats hold the two scenes in different digits.
    differ += (x.triangle == kNoIndex) != (y.triangle == kNoIndex) || std::abs(x.distance - y.distance) > 1e-5;
    met += y.triangle != kNoIndex;
    differ += std::abs(a.blocked(from, to) - b.blocked(from, to)) > 0;
  }
  EXPECT_GT(met, 1000);
  EXPECT_LE(differ, 8);
}

TEST(Instances, TruthShowsTheSame) {
  const Scene scene = scattered(25, 0.15, 12, 10);
  ViewOptions options;
  options.camera.eye = V3d(2, 1.5, 1.4);
  options.camera.target = V3d(0.5, 0.5, 0.4);
  options.width = options.height = 64;
  options.samples = 4;
  Report report;
  const Image a = view_truth(scene, options, report), b = view_truth(flatten_instances(scene), options, report);
  double difference = 0, seen = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    difference += std::abs(static_cast<double>(a.pixels[i] - b.pixels[i]));
    seen += static_cast<double>(b.pixels[i]);
  }
  EXPECT_GT(seen, 1000);
  EXPECT_LT(difference, 1e-3 * seen);  // outlines, as above
}

TEST(Instances, AloneWithoutMesh) {
  Scene scene = scattered(9, 0.2, 10, 4);
  scene.mesh = {};
  expect_same(bake_quietly(scene, everything(20)), bake_quietly(flatten_instances(scene), everything(20)), kOrder);
  for (Mesh& shape : scene.shapes) shape = {};
  EXPECT_THROW((void)bake_quietly(scene, everything(20)), Error);
}

TEST(Instances, CyclicAsCopies) {
  const Scene scene = scattered(8, 0.2, 8, 5);
  Recipe recipe = everything(24);
  recipe.box = Box3d(V3d(0, 0, -0.5), V3d(1, 1, 1.5));
  recipe.cyclic = {true, true, false};
  expect_same(bake_quietly(scene, recipe), bake_quietly(flatten_instances(scene), recipe), 0);
}

// One file, read as instances and as copies: boxes (lit from one side, though their material says both) with a coloured card on each, turned, mirrored, stretched.
TEST(Instances, OfGltfSamePackAsCopies) {
  GltfBuilder file;
  Random random(11);
  std::vector<float> at, turned, scaled;
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 3; ++k) at.push_back(static_cast<float>(random.uniform()));
    for (int k = 0; k < 4; ++k) turned.push_back(static_cast<float>(random.uniform() - 0.5));
    const auto size = static_cast<float>(random.uniform(0.05, 0.15));
    scaled.insert(scaled.end(), {i % 3 == 0 ? -size : size, i % 5 == 0 ? 2 * size : size, size});
  }
  const Json attributes = {{"TRANSLATION", file.floats(at, "VEC3")}, {"ROTATION", file.floats(turned, "VEC4")}, {"SCALE", file.floats(scaled, "VEC3")}};
  Json box = file.cube(), card = file.square();
  box["material"] = file.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.1, 0.1, 1}}}}, {"doubleSided", true}});
  card["material"] = file.add("materials", {{"pbrMetallicRoughness", {{"baseColorFactor", {0.1, 0.7, 0.2, 1}}}}, {"doubleSided", true}});
  card["attributes"]["POSITION"] = file.floats({0, 0, 1.5f, 1, 0, 1.5f, 1, 1, 1.5f, 0, 1, 1.75f}, "VEC3");
  card["attributes"]["COLOR_0"] = file.floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1}, "VEC3");
  file.show(box, {{"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", attributes}}}}}});
  file.json["meshes"][0]["primitives"].push_back(card);
  file.show(file.square(), {{"scale", {1.2, 1.2, 1}}});
  const std::string bytes = file.glb();
  Report report;
  const Scene placed = read_gltf({bytes, "a.glb"}, {}, report), copied = read_gltf({bytes, "a.glb"}, {.most_copies = 1000}, report);
  ASSERT_EQ(placed.instances.size(), 40u);
  ASSERT_TRUE(copied.instances.empty());
  const Pack a = bake_quietly(placed, everything(40)), b = bake_quietly(copied, everything(40));
  check_invariants(a);
  EXPECT_GT(a.statistics.volume, 0);
  expect_same(a, b, kOrder);
}

TEST(Instances, BoundsAreExact) {
  const Scene scene = scattered(200, 0.05, 6, 6);
  const Box3d box = surface_bounds(scene), flat = surface_bounds(flatten_instances(scene));
  EXPECT_EQ(box.min, flat.min);
  EXPECT_EQ(box.max, flat.max);
}

// What faces inwards is a cavity in an instance, too, whichever of both is placed first; beside it, it is inside out and turned.
TEST(Instances, Cavities) {
  Scene scene = with_materials();
  Scene ball = with_materials(), hole = with_materials();
  add_ball(ball, 1, 20, 0);
  add_ball(hole, 1, 20, 0);
  turn_faces(hole, 0, hole.mesh.triangles.size());
  scene.shapes = {hole.mesh, ball.mesh};
  const Rotation straight{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
  for (int i = 0; i < 5; ++i) scene.instances.push_back({0, placement(straight, V3d(0.3), V3d(0.8 * (i - 2), 0.1, 0))});
  scene.instances.push_back({1, placement(straight, V3d(3), V3d(0))});
  Recipe recipe = volume_recipe(32);
  const double one = mesh_volume(ball.mesh);
  const Pack held = bake_quietly(scene, recipe);
  EXPECT_NEAR(held.statistics.volume / (one * (27 - 5 * 0.027)), 1, 1e-9);  // rounding
  EXPECT_NEAR(filled_volume(held) / (one * (27 - 5 * 0.027)), 1, 1e-4);
  EXPECT_FALSE(has_issue(held, "mesh-inside-out"));
  scene.instances.back().place = placement(straight, V3d(3), V3d(0, 0, 5));
  const Pack apart = bake_quietly(scene, recipe);
  EXPECT_NEAR(apart.statistics.volume / (one * (27 + 5 * 0.027)), 1, 1e-9);
  EXPECT_TRUE(has_issue(apart, "mesh-inside-out"));
}
TEST(Instances, FlatteningIsBounded) {
  Scene scene = scattered(1, 0.1, 200);
  scene.instances.assign(5000, scene.instances[0]);
  EXPECT_GT(count_triangles(scene), std::uint64_t{1} << 27);
  EXPECT_THROW((void)flatten_instances(scene), Error);
}

}  // namespace
}  // namespace texel::test
