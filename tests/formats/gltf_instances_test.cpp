// What a glTF file shows often: a shape and where it stands, rather than copies.
#include <gtest/gtest.h>

#include <cmath>

#include "formats/instances.h"
#include "formats/read.h"
#include "tests/formats/gltf_builder.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

Scene read(const GltfBuilder& file, Report& report, const GltfOptions& options = {}) { return read_gltf({file.glb(), "nowhere/model.glb"}, options, report); }

// A row of `count` things, `mesh` each, 2 apart along x, by EXT_mesh_gpu_instancing.
GltfBuilder row(int count, const Json& scale = nullptr) {
  GltfBuilder file;
  std::vector<float> at;
  for (int i = 0; i < count; ++i) at.insert(at.end(), {2.0f * static_cast<float>(i), 0, 0});
  Json attributes = {{"TRANSLATION", file.floats(at, "VEC3")}};
  file.show(file.cube(), {{"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", attributes}}}}}});
  if (!scale.is_null()) file.json["nodes"][0]["scale"] = scale;
  return file;
}

// A row whose instances have the scales given, three numbers each.
GltfBuilder scaled(const std::vector<float>& scales) {
  GltfBuilder file;
  file.show(file.cube(), {{"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"SCALE", file.floats(scales, "VEC3")}}}}}}}});
  return file;
}

TEST(GltfInstances, MoreThanSixteenAreNotCopied) {
  Report report;
  const Scene few = read(row(16), report);
  EXPECT_EQ(few.mesh.triangles.size(), 16 * 12u);
  EXPECT_TRUE(few.instances.empty() && few.shapes.empty());
  const Scene many = read(row(17), report);
  EXPECT_TRUE(many.mesh.triangles.empty());
  ASSERT_EQ(many.shapes.size(), 1u);
  EXPECT_EQ(many.shapes[0].triangles.size(), 12u);
  ASSERT_EQ(many.instances.size(), 17u);
  EXPECT_EQ(many.instances[16].place.m, Affine::translation(V3d(32, 0, 0)).m);
  EXPECT_TRUE(report.issues.empty());
}

// Nodes that share a mesh count with their instances; a mesh shown once beside them stays part of the scene's mesh.
TEST(GltfInstances, NodesCountToo) {
  GltfBuilder file = row(10);
  for (int i = 0; i < 7; ++i) file.root(file.add("nodes", {{"mesh", 0}, {"translation", {0, 2 * i, 5}}}));
  file.show(file.square());
  Report report;
  const Scene scene = read(file, report);
  EXPECT_EQ(scene.mesh.triangles.size(), 2u);
  EXPECT_EQ(scene.instances.size(), 17u);
  EXPECT_EQ(surface_bounds(scene).max, V3d(19, 13, 6));
}

TEST(GltfInstances, TheSameAsCopiesToTheBit) {
  GltfBuilder file = row(20, {2, -1, 1});  // mirrored
  file.show(file.square(), {{"translation", {0, 0, 3}}});
  Json second = file.square();
  second["attributes"]["COLOR_0"] = file.floats({1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1}, "VEC3");
  second["material"] = file.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", file.add("textures", {{"source", file.add("images", {{"uri", "data:image/png;base64,AA=="}})}})}}}}}, {"doubleSided", true}});
  file.json["meshes"][0]["primitives"].push_back(second);
  Report report, other;
  const Scene placed = read(file, report), copied = read(file, other, {.most_copies = 1000});
  ASSERT_EQ(placed.instances.size(), 20u);
  ASSERT_TRUE(copied.instances.empty());
  EXPECT_EQ(placed.materials.size(), copied.materials.size());
  EXPECT_EQ(report.issues.size(), other.issues.size());
  EXPECT_FALSE(placed.shapes[0].uv_corners.empty());
  // Triangle by triangle, wherever they lie in the mesh: the square of the mesh comes behind the copies there.
  const Mesh flat = flatten_instances(placed).mesh;
  ASSERT_EQ(flat.triangles.size(), copied.mesh.triangles.size());
  const std::size_t own = placed.mesh.triangles.size(), n = flat.triangles.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t k = (i + own) % n;
    EXPECT_EQ(flat.materials[k], copied.mesh.materials[i]);
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t a = flat.triangles[k][c], b = copied.mesh.triangles[i][c];
      EXPECT_EQ(flat.points[a], copied.mesh.points[b]);
      EXPECT_EQ(flat.colors[a], copied.mesh.colors[b]);
      const std::uint32_t u = flat.uv_corners[k][c], v = copied.mesh.uv_corners[i][c];
      ASSERT_EQ(u == kNoIndex, v == kNoIndex);
      if (u != kNoIndex) {
        EXPECT_EQ(flat.uvs[u], copied.mesh.uvs[v]);
      }
    }
  }
}

TEST(GltfInstances, FlatOnesAreCopiedAndPointsLeftOut) {
  std::vector<float> scales;
  for (int i = 0; i < 20; ++i) scales.insert(scales.end(), {1, 1, i == 3 ? 0.0f : 1.0f});
  for (int i = 0; i < 3; ++i) scales[static_cast<std::size_t>(3 * 7 + i)] = 0;  // hidden: a point
  scales[3 * 8] = scales[3 * 8 + 1] = 0;                                        // a line
  Report report;
  const Scene scene = read(scaled(scales), report);
  EXPECT_EQ(scene.instances.size(), 17u);
  EXPECT_EQ(scene.mesh.triangles.size(), 12u);
  EXPECT_NEAR(measure(scene.mesh).area, 2, 0) << "both faces of the flat one";
  EXPECT_TRUE(report.issues.empty());
  ASSERT_EQ(report.skipped.size(), 1u);
  EXPECT_EQ(report.skipped[0].what, "nowhere/model.glb: 2 instances");
  // Flat ones count as triangles.
  Report again;
  EXPECT_NE(error_of([&] { (void)read(scaled(scales), again, {.most_triangles = 23}); }).find("5: nowhere/model.glb: its meshes and their copies have more than 23 triangles together"), std::string::npos);
  EXPECT_EQ(read(scaled(scales), again, {.most_triangles = 24}).instances.size(), 17u);
}

TEST(GltfInstances, WhatCannotBePlacedIsReported) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> scales(60, 1);
  scales[0] = nan;
  scales[30] = std::numeric_limits<float>::infinity();
  Report report;
  const Scene scene = read(scaled(scales), report);
  EXPECT_EQ(scene.instances.size(), 18u);
  ASSERT_TRUE(find_issue(report, "non-finite"));
  EXPECT_EQ(find_issue(report, "non-finite")->count, 16) << "8 vertices each";
  EXPECT_NE(find_issue(report, "non-finite")->text.find("24 triangles"), std::string::npos);
  // Beyond 1e100 by two nodes' matrices.
  GltfBuilder far = scaled(std::vector<float>(60, 1));
  far.json["nodes"][0]["matrix"] = {1e60, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  far.add("nodes", {{"children", {0}}, {"matrix", far.json["nodes"][0]["matrix"]}});
  far.json["scenes"][0]["nodes"] = {1};
  EXPECT_EQ(error_of([&] { (void)read(far, report); }), "3: nowhere/model.glb: every instance stands where coordinates are no finite numbers or beyond 1e100; export the mesh again");
}

TEST(GltfInstances, PointsOfAShapeThatAreNone) {
  GltfBuilder file;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Json p = file.square();
  p["attributes"]["POSITION"] = file.floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, nan, 0}, "VEC3");
  file.show(p);
  for (int i = 0; i < 16; ++i) file.root(file.add("nodes", {{"mesh", 0}, {"translation", {i, 0, 0}}}));
  Report report;
  const Scene scene = read(file, report);
  EXPECT_EQ(scene.shapes.at(0).triangles.size(), 1u);
  EXPECT_EQ(scene.instances.size(), 17u);
  ASSERT_TRUE(find_issue(report, "non-finite"));
  EXPECT_EQ(find_issue(report, "non-finite")->count, 1);
  // None left: an error, not an empty scene.
  file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = file.floats(std::vector<float>(12, nan), "VEC3");
  EXPECT_NE(error_of([&] { (void)read(file, report); }).find("3: nowhere/model.glb: every face has a vertex that is not a finite number"), std::string::npos);
}

TEST(GltfInstances, AHundredThousandTakeTheMemoryOfTheirTransforms) {
  Report report;
  const Scene scene = read(row(100000), report);
  EXPECT_EQ(scene.instances.size(), 100000u);
  EXPECT_EQ(scene.instances.capacity(), 100000u);
  EXPECT_EQ(sizeof(Instance), 104u);
  ASSERT_EQ(scene.shapes.size(), 1u);
  EXPECT_EQ(scene.shapes[0].triangles.size(), 12u);
  EXPECT_EQ(count_triangles(scene), 1200000u);
}

TEST(GltfInstances, LargeCopiesBecomeInstances) {
  GltfBuilder file;
  constexpr int kSide = 1100;  // 2·1099² triangles, twice 2^22 is exceeded by 2 copies
  std::vector<float> points;
  std::vector<std::uint32_t> corners;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) points.insert(points.end(), {static_cast<float>(x), static_cast<float>(y), 0});
  for (std::uint32_t y = 0; y + 1 < kSide; ++y)
    for (std::uint32_t x = 0; x + 1 < kSide; ++x) {
      const std::uint32_t a = y * kSide + x, b = a + kSide;
      corners.insert(corners.end(), {a, a + 1, b, a + 1, b + 1, b});
    }
  file.show({{"attributes", {{"POSITION", file.floats(points, "VEC3")}}}, {"indices", file.accessor(corners, 5125, "SCALAR")}});
  Report report;
  EXPECT_TRUE(read(file, report).instances.empty()) << "once: part of the mesh";
  file.root(file.add("nodes", {{"mesh", 0}, {"translation", {0, 0, 1}}}));
  const Scene scene = read(file, report);
  EXPECT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(count_triangles(scene), 4u * 1099 * 1099);
}

TEST(GltfInstances, UnitsScenesAndPlantScenesMoveThem) {
  const TestFolder folder;
  const std::string path = folder.write("row.glb", row(20).glb());
  Report report;
  ReadOptions centimetres;
  centimetres.plants.unit = 0.01;
  const Box3d box = surface_bounds(read_scene(std::span(&path, 1), centimetres, report));
  EXPECT_NEAR(box.max.x, 0.39, 1e-15);
  EXPECT_NEAR(box.max.y, 0.01, 1e-15);
  const std::string scene = folder.write("scene.json", R"({"format": "texel-scene", "inputs": {"row": {"file": "row.glb", "up": "y"}},
    "objects": [{"input": "row", "instances": [{"translate": [0, 0, 10]}, {"scale": 2}]}]})");
  const Scene twice = read_scene(scene, report);
  EXPECT_EQ(twice.instances.size(), 40u);
  EXPECT_EQ(surface_bounds(twice), Box3d(V3d(0, -2, 0), V3d(78, 0, 11)));
  // A plant scene that places it once, or twice.
  for (const std::string rows : {"1\t1\trow.glb\t0\t0\t5\t1\t0\t0\t0\n", "1\t1\trow.glb\t0\t0\t5\t1\t0\t0\t0\n1\t2\trow.glb\t0\t3\t5\t2\t0\t0\t0\n"}) {
    const std::string ops = folder.write("stand.ops", rows);
    const Scene stand = read_scene(ops, report);
    const bool one = rows.size() < 40;
    EXPECT_EQ(stand.instances.size(), one ? 20u : 40u);
    EXPECT_EQ(surface_bounds(stand), one ? Box3d(V3d(0, 0, 5), V3d(39, 1, 6)) : Box3d(V3d(0, 0, 5), V3d(78, 5, 7)));
  }
  EXPECT_TRUE(report.issues.empty());
}

TEST(GltfInstances, ScenesChooseAmongScenes) {
  GltfBuilder file;
  file.show(file.cube());
  file.add("nodes", {{"mesh", 0}, {"translation", {9, 0, 0}}});
  file.add("scenes", {{"nodes", {1}}});
  const TestFolder folder;
  (void)folder.write("two.glb", file.glb());
  (void)folder.write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  Report report;
  const auto reach = [&](const std::string& input, int option) {
    const std::string path = folder.write("s.json", R"({"format": "texel-scene", "inputs": {"a": )" + input + R"(}, "objects": [{"input": "a"}]})");
    ReadOptions options;
    options.scene = option;
    return surface_bounds(read_scene(std::span(&path, 1), options, report)).min.x;
  };
  EXPECT_EQ(reach(R"({"file": "two.glb", "scene": 1})", -1), 9);
  EXPECT_EQ(reach(R"({"file": "two.glb", "scene": 0})", 1), 0) << "the input's own beats --scene";
  EXPECT_EQ(reach(R"({"file": "two.glb"})", 1), 9);
  EXPECT_TRUE(report.issues.empty());
  EXPECT_NE(error_of([&] { (void)reach(R"({"file": "two.glb", "scene": 1.5})", -1); }).find("s.json: /inputs/a/scene is 1.5; expected a whole number from 0 on"), std::string::npos);
  EXPECT_NE(error_of([&] { (void)reach(R"({"file": "t.obj", "scene": 0})", -1); }).find("t.obj: is no glTF file and has no scenes by number; leave \"scene\" out"), std::string::npos);
}

}  // namespace
}  // namespace texel
