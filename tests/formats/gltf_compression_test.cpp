// Draco and meshopt: geometry compressed by the libraries' own encoders, read back by our reader.
#include <draco/compression/expert_encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include <cmath>

#include "tests/formats/gltf_builder.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

Scene read(const std::string& bytes) {
  Report report;
  return read_gltf({bytes, "nowhere/model.glb"}, {}, report);
}
std::string said(const std::string& bytes) {
  return error_of([&] { (void)read(bytes); });
}

constexpr int kSide = 9;  // vertices of a square grid of height x·y; all coordinates are sixteenths, so that quantization is exact

std::vector<float> grid_points() {
  std::vector<float> p;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (const float v : {static_cast<float>(x), static_cast<float>(y), static_cast<float>(x * y)}) p.push_back(v / 8);
  return p;
}
std::vector<std::uint32_t> grid_indices() {
  std::vector<std::uint32_t> t;
  for (std::uint32_t y = 0; y + 1 < kSide; ++y)
    for (std::uint32_t x = 0; x + 1 < kSide; ++x)
      for (const std::uint32_t i : {0u, 1u, 10u, 0u, 10u, 9u}) t.push_back(y * kSide + x + i);
  return t;
}
Scene plain_grid() {
  GltfBuilder file;
  file.show({{"attributes", {{"POSITION", file.floats(grid_points(), "VEC3")}}}, {"indices", file.accessor(grid_indices(), 5125, "SCALAR")}});
  return read(file.glb());
}

// --- Draco ---

struct Encoded {
  std::string bytes;
  std::size_t points = 0, corners = 0;
};

Encoded draco_grid(int method) {
  const std::vector<float> p = grid_points();
  const std::vector<std::uint32_t> t = grid_indices();
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(t.size() / 3));
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int color = builder.AddAttribute(draco::GeometryAttribute::COLOR, 3, draco::DT_UINT8);
  for (std::uint32_t i = 0; i < t.size() / 3; ++i) {
    std::uint8_t rgb[3][3];
    for (std::uint32_t k = 0; k < 3; ++k)
      for (std::uint32_t c = 0; c < 3; ++c) rgb[k][c] = static_cast<std::uint8_t>(t[3 * i + k] + c);
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(i), &p[t[3 * i] * 3], &p[t[3 * i + 1] * 3], &p[t[3 * i + 2] * 3]);
    builder.SetAttributeValuesForFace(color, draco::FaceIndex(i), rgb[0], rgb[1], rgb[2]);
  }
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  draco::ExpertEncoder encoder(*mesh);
  encoder.SetEncodingMethod(method);
  encoder.SetAttributeQuantization(0, 16);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeToBuffer(&buffer).ok());
  return {std::string(buffer.data(), buffer.size()), mesh->num_points(), std::size_t{mesh->num_faces()} * 3};
}

GltfBuilder draco_file(const Encoded& mesh) {
  GltfBuilder file;
  const std::size_t position = file.add("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", mesh.points}});
  const std::size_t color = file.add("accessors", {{"componentType", 5121}, {"normalized", true}, {"type", "VEC3"}, {"count", mesh.points}});
  const std::size_t indices = file.add("accessors", {{"componentType", 5125}, {"type", "SCALAR"}, {"count", mesh.corners}});
  file.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  Json extension = {{"bufferView", file.view(mesh.bytes)}, {"attributes", {{"POSITION", 0}, {"COLOR_0", 1}}}};
  file.show({{"attributes", {{"POSITION", position}, {"COLOR_0", color}}}, {"indices", indices}, {"extensions", {{"KHR_draco_mesh_compression", extension}}}});
  return file;
}

TEST(GltfDraco, BothMethods) {
  const Measures should = measure(plain_grid().mesh);
  for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    const Scene scene = read(draco_file(draco_grid(method)).glb());
    ASSERT_EQ(scene.mesh.triangles.size(), 128u);
    ASSERT_EQ(scene.mesh.points.size(), 81u);
    const Measures is = measure(scene.mesh);
    // 16 bits over a range of 8: half a step of 8/65535 a coordinate.
    EXPECT_NEAR((is.box.min - should.box.min).length() + (is.box.max - should.box.max).length(), 0, 2 * 8 / 65535.0);
    EXPECT_NEAR(is.area, should.area, should.area * 1e-4);
    for (std::size_t i = 0; i < 81; ++i) {
      const V3d& p = scene.mesh.points[i];
      const double number = std::round(p.y * 8) * kSide + std::round(p.x * 8);
      EXPECT_NEAR(static_cast<double>(scene.mesh.colors[i].y), (number + 1) / 255, 1e-7) << "colours belong to their points";
    }
  }
}

TEST(GltfDraco, DamageIsOneLine) {
  for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    const Encoded good = draco_grid(method);
    for (std::size_t i = 0; i < good.bytes.size(); ++i) {
      Encoded bad = good;
      bad.bytes[i] = static_cast<char>(bad.bytes[i] ^ 0x55);
      const std::string message = said(draco_file(bad).glb());  // some damage only moves points
      ASSERT_TRUE(message.empty() || message.starts_with("3: nowhere/model.glb: ")) << i << ": " << message;
      if (i == 0) continue;  // a file without a buffer
      bad.bytes = good.bytes.substr(0, i);
      ASSERT_TRUE(said(draco_file(bad).glb()).starts_with("3: nowhere/model.glb: meshes[0].primitives[0].extensions.KHR_draco_mesh_compression: ")) << i;
    }
  }
  Encoded lie = draco_grid(draco::MESH_EDGEBREAKER_ENCODING);
  ++lie.points;
  EXPECT_NE(said(draco_file(lie).glb()).find("has 81 vertices where the accessor states 82"), std::string::npos);
  lie.points -= 2;
  EXPECT_NE(said(draco_file(lie).glb()).find("more than its accessors"), std::string::npos);
  GltfBuilder file = draco_file(draco_grid(draco::MESH_EDGEBREAKER_ENCODING));
  file.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 77;
  EXPECT_NE(said(file.glb()).find("its Draco data has no attribute 77"), std::string::npos);
}

// --- meshopt ---

struct MeshoptGrid {
  GltfBuilder file;
  std::string points, indices;  // compressed
};

MeshoptGrid meshopt_grid(bool sequence) {
  MeshoptGrid grid;
  const std::vector<float> p = grid_points();
  const std::vector<std::uint32_t> t = grid_indices();
  grid.points.resize(meshopt_encodeVertexBufferBound(81, 12));
  grid.points.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(grid.points.data()), grid.points.size(), p.data(), 81, 12));
  auto* to = reinterpret_cast<unsigned char*>((grid.indices.resize(2000), grid.indices.data()));
  grid.indices.resize(sequence ? meshopt_encodeIndexSequence(to, 2000, t.data(), t.size()) : meshopt_encodeIndexBuffer(to, 2000, t.data(), t.size()));
  GltfBuilder& file = grid.file;
  const auto add = [&](const std::string& bytes, std::size_t count, std::size_t stride, const char* mode, const char* filter = nullptr) {
    const std::size_t view = file.view(bytes);
    Json extension = file.json["bufferViews"][view];
    extension.update({{"byteStride", stride}, {"count", count}, {"mode", mode}});
    if (filter) extension["filter"] = filter;
    file.json["bufferViews"][view] = {{"buffer", 1}, {"byteLength", count * stride}, {"extensions", {{"EXT_meshopt_compression", extension}}}};
    return view;
  };
  const std::size_t a = add(grid.points, 81, 12, "ATTRIBUTES"), b = add(grid.indices, t.size(), 4, sequence ? "INDICES" : "TRIANGLES");
  file.show({{"attributes", {{"POSITION", file.add("accessors", {{"bufferView", a}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 81}})}}},
             {"indices", file.add("accessors", {{"bufferView", b}, {"componentType", 5125}, {"type", "SCALAR"}, {"count", t.size()}})}});
  file.json["extensionsRequired"] = {"EXT_meshopt_compression"};
  return grid;
}

std::string glb_with_fallback(const GltfBuilder& file) {
  Json all = file.json;
  all["buffers"] = {{{"byteLength", file.bin.size()}}, {{"byteLength", 4000}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}};
  return glb_of(all, file.bin);
}

TEST(GltfMeshopt, ExactToTheBit) {
  const Scene should = plain_grid();
  for (const bool sequence : {false, true}) {
    const Scene scene = read(glb_with_fallback(meshopt_grid(sequence).file));
    EXPECT_EQ(scene.mesh.points, should.mesh.points);
    EXPECT_EQ(measure(scene.mesh).area, measure(should.mesh).area);
  }
}

TEST(GltfMeshopt, ExponentialFilter) {
  // meshoptimizer's own encoder of the filter, 15 bits a value.
  MeshoptGrid grid = meshopt_grid(false);
  const std::vector<float> p = grid_points();
  std::vector<std::uint32_t> filtered(p.size());
  meshopt_encodeFilterExp(filtered.data(), 81, 12, 15, p.data());
  std::string bytes(meshopt_encodeVertexBufferBound(81, 12), '\0');
  bytes.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(bytes.data()), bytes.size(), filtered.data(), 81, 12));
  Json& extension = grid.file.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"];
  const Json at = grid.file.json["bufferViews"][grid.file.view(bytes)];
  grid.file.json["bufferViews"].erase(grid.file.json["bufferViews"].size() - 1);
  Json& again = grid.file.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"];
  again["byteOffset"] = at["byteOffset"];
  again["byteLength"] = at["byteLength"];
  again["filter"] = "EXPONENTIAL";
  (void)extension;
  const Scene scene = read(glb_with_fallback(grid.file));
  for (std::size_t i = 0; i < 81; ++i)
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(scene.mesh.points[i][c], static_cast<double>(p[3 * i + static_cast<std::size_t>(c)]), 8 * 0x1p-14);
}

TEST(GltfMeshopt, DamageIsOneLine) {
  for (const bool sequence : {false, true}) {
    const MeshoptGrid grid = meshopt_grid(sequence);
    for (std::size_t i = 0; i < grid.file.bin.size(); ++i) {
      GltfBuilder bad = grid.file;
      bad.bin[i] = static_cast<char>(bad.bin[i] ^ 0x55);
      const std::string message = said(glb_with_fallback(bad));
      ASSERT_TRUE(message.empty() || message.starts_with("3: nowhere/model.glb: ")) << i << ": " << message;
    }
  }
  const auto changed = [](const char* key, Json value) {
    MeshoptGrid grid = meshopt_grid(false);
    grid.file.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = std::move(value);
    return said(glb_with_fallback(grid.file));
  };
  EXPECT_NE(changed("byteStride", 13).find("its byteStride is 13, not a multiple of 4 up to 256"), std::string::npos);
  EXPECT_NE(changed("count", 4000000000u).find("bufferViews[0].extensions.EXT_meshopt_compression: states 4000000000 elements of 12 bytes, more than"), std::string::npos);
  EXPECT_NE(changed("count", 80).find("damaged"), std::string::npos);
  EXPECT_NE(changed("mode", "POINTS").find("mode: is \"POINTS\", not ATTRIBUTES"), std::string::npos);
  EXPECT_NE(changed("filter", "SEPIA").find("filter: is \"SEPIA\""), std::string::npos);
  EXPECT_NE(changed("filter", "QUATERNION").find("which its filter does not have"), std::string::npos);
  EXPECT_NE(changed("byteLength", 9).find("damaged"), std::string::npos);
}

}  // namespace
}  // namespace texel
