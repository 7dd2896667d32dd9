// glTF files made here, feature by feature, against exact areas, bounds and colours. Tolerances: positions and colours are exact unless a
// rotation or a float's rounding is said to be in between.
#include "tests/formats/gltf_builder.h"

#include <cmath>
#include <numbers>

#include "formats/image.h"
#include "formats/read.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

Scene read(const std::string& bytes, Report& report, const std::string& path = "nowhere/model.glb") { return read_gltf({bytes, path}, {}, report); }
Scene read(const std::string& bytes) {
  Report report;
  Scene scene = read(bytes, report);
  EXPECT_TRUE(report.issues.empty()) << report.issues.front().id << ": " << report.issues.front().text;
  return scene;
}

TEST(Gltf, BinaryJsonAndExternalFilesAreTheSame) {
  GltfBuilder file;
  file.show(file.square());
  const TestFolder folder;
  folder.write("a part.bin", file.bin);
  Report report;
  const Scene scenes[] = {read(file.glb()), read(file.gltf()), read(file.gltf("a%20part.bin"), report, folder.file("model.gltf")),
                          read("\xEF\xBB\xBF" + file.gltf("a part.bin"), report, folder.file("model.gltf"))};
  for (const Scene& scene : scenes) {
    ASSERT_EQ(scene.mesh.triangles.size(), 2u);
    EXPECT_EQ(scene.mesh.points, scenes[0].mesh.points);
    EXPECT_EQ(measure(scene.mesh).area, 1);
    EXPECT_TRUE(scene.mesh.uvs.empty()) << "nothing is textured";
  }
  EXPECT_TRUE(report.issues.empty());
  ASSERT_EQ(scenes[2].sources.size(), 1u);
  EXPECT_EQ(scenes[2].sources[0].path, folder.file("a part.bin"));
}

TEST(Gltf, NodesMoveTurnAndScale) {
  GltfBuilder file;
  const double half = std::numbers::sqrt2 / 2;
  // Scaled to 1 x 2 x 3, turned by 90 degrees about z (x -> y, y -> −x), moved by (10, 0, 0); a parent scales by 2.
  file.show(file.cube());
  file.json["nodes"][0].update({{"scale", {1, 2, 3}}, {"rotation", {0, 0, half, half}}, {"translation", {10, 0, 0}}});
  const std::size_t parent = file.add("nodes", {{"children", {0}}, {"matrix", {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 5, 1}}});
  file.json["scenes"][0]["nodes"] = {parent};
  const Measures m = measure(read(file.glb()).mesh);
  // The quaternion's rounding, 1e-16, times the size.
  EXPECT_NEAR((m.box.min - V3d(16, 0, 5)).length(), 0, 1e-14);
  EXPECT_NEAR((m.box.max - V3d(20, 2, 11)).length(), 0, 1e-14);
  EXPECT_NEAR(m.volume, 8 * 6, 1e-12);
  EXPECT_NEAR(m.area, 4 * 2 * (2 + 3 + 6), 1e-12);
}

TEST(Gltf, MirroredNodesStayOutsideOut) {
  for (const bool matrix : {false, true}) {
    GltfBuilder file;
    file.show(file.cube(), matrix ? Json{{"matrix", {0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}}} : Json{{"scale", {-1, 1, 1}}});
    EXPECT_EQ(measure(read(file.glb()).mesh).volume, 1);
  }
  GltfBuilder twice;
  twice.show(twice.cube(), {{"scale", {-1, -1, 1}}});
  EXPECT_EQ(measure(read(twice.glb()).mesh).volume, 1);
}

TEST(Gltf, OneMeshMayBeShownManyTimes) {
  GltfBuilder file;
  file.show(file.cube());
  for (const int x : {2, 4}) file.root(file.add("nodes", {{"mesh", 0}, {"translation", {x, 0, 0}}}));
  const Scene scene = read(file.glb());
  EXPECT_EQ(scene.mesh.triangles.size(), 36u);
  EXPECT_EQ(scene.mesh.points.size(), 24u);
  EXPECT_EQ(measure(scene.mesh).box.max, V3d(5, 1, 1));
  EXPECT_EQ(measure(scene.mesh).volume, 3);
}

TEST(Gltf, InstancesOfAllTypes) {
  GltfBuilder file;
  const std::size_t moved = file.floats({0, 0, 0, 4, 0, 0, 8, 0, 0}, "VEC3"), scaled = file.floats({1, 1, 1, 2, 1, 1, -1, 1, 1}, "VEC3");
  const std::size_t turned = file.accessor<std::int16_t>({0, 0, 0, 32767, 0, 0, 32767, 0, 0, 0, 0, 32767}, 5122, "VEC4", true);
  Json attributes = {{"TRANSLATION", moved}, {"ROTATION", turned}, {"SCALE", scaled}};
  file.show(file.cube(), {{"translation", {0, 100, 0}}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", attributes}}}}}});
  file.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const Scene scene = read(file.glb());
  ASSERT_EQ(scene.mesh.points.size(), 24u);
  const auto box = [&](std::size_t instance) {
    Box3d b;
    for (std::size_t i = 0; i < 8; ++i) b.extendBy(scene.mesh.points[8 * instance + i]);
    return b;
  };
  EXPECT_EQ(box(0), Box3d(V3d(0, 100, 0), V3d(1, 101, 1)));
  EXPECT_EQ(box(1), Box3d(V3d(2, 99, 0), V3d(4, 100, 1))) << "scaled, then turned half about z, then moved";
  EXPECT_EQ(box(2), Box3d(V3d(7, 100, 0), V3d(8, 101, 1)));
  EXPECT_NEAR(measure(scene.mesh).volume, 4, 1e-12) << "the mirrored one is outside out, too; sums of products of tens";
}

TEST(Gltf, StripsFansAndWhatIsNoTriangle) {
  GltfBuilder file;
  const std::size_t strip = file.floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0}, "VEC3");
  file.show({{"attributes", {{"POSITION", strip}}}, {"mode", 5}});
  Scene scene = read(file.glb());
  EXPECT_EQ(scene.mesh.triangles.size(), 3u);
  EXPECT_EQ(measure(scene.mesh).area, 1.5);
  for (const auto& t : scene.mesh.triangles) {  // all face +z
    const auto& p = scene.mesh.points;
    EXPECT_GT((p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).z, 0);
  }
  GltfBuilder fan;
  fan.show({{"attributes", {{"POSITION", fan.floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, "VEC3")}}}, {"mode", 6}});
  scene = read(fan.glb());
  EXPECT_EQ(scene.mesh.triangles.size(), 2u);
  EXPECT_EQ(measure(scene.mesh).area, 1);
  // Lines, a primitive without positions and an incomplete triangle are left out and named.
  for (const int mode : {0, 1, 2, 3}) fan.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", mode}});
  fan.json["meshes"][0]["primitives"].push_back({{"attributes", Json::object()}});
  fan.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}});
  Report report;
  EXPECT_EQ(read(fan.glb(), report).mesh.triangles.size(), 3u);
  ASSERT_TRUE(find_issue(report, "gltf-lines") && find_issue(report, "gltf-no-positions") && find_issue(report, "gltf-incomplete"));
  EXPECT_EQ(find_issue(report, "gltf-lines")->count, 4);
  EXPECT_EQ(find_issue(report, "gltf-lines")->where, "nowhere/model.glb: meshes[0].primitives[1]");
}

TEST(Gltf, IndicesOfAllTypes) {
  for (const int kind : {5121, 5123, 5125}) {
    GltfBuilder file;
    const std::size_t points = file.floats({9, 9, 9, 0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    const std::size_t indices = kind == 5121   ? file.accessor<std::uint8_t>({1, 2, 3}, kind, "SCALAR")
                                : kind == 5123 ? file.accessor<std::uint16_t>({1, 2, 3}, kind, "SCALAR")
                                               : file.accessor<std::uint32_t>({1, 2, 3}, kind, "SCALAR");
    file.show({{"attributes", {{"POSITION", points}}}, {"indices", indices}});
    const Scene scene = read(file.glb());
    EXPECT_EQ(measure(scene.mesh).area, 0.5);
    EXPECT_EQ(scene.mesh.points.size(), 3u) << "the unused vertex is dropped";
  }
}

TEST(Gltf, QuantizedInterleavedAndShifted) {
  // Normalized shorts: −32768 and −32767 are both −1. With a stride of 8 and an offset of 2.
  GltfBuilder file;
  const std::size_t view = file.view(raw_bytes(std::vector<std::int16_t>{7, -32767, 0, 0, 7, 32767, 0, 0, 7, -32768, 32767, 0}), 8);
  file.show({{"attributes", {{"POSITION", file.add("accessors", {{"bufferView", view}, {"byteOffset", 2}, {"componentType", 5122}, {"normalized", true}, {"count", 3}, {"type", "VEC3"}})}}}});
  EXPECT_EQ(measure(read(file.glb()).mesh).box, Box3d(V3d(-1, 0, 0), V3d(1, 1, 0)));
  GltfBuilder plain;
  plain.show({{"attributes", {{"POSITION", plain.accessor<std::uint8_t>({0, 0, 0, 255, 0, 0, 0, 254, 0}, 5121, "VEC3")}}}});
  plain.json["accessors"][0]["count"] = 3;
  EXPECT_EQ(measure(read(plain.glb()).mesh).box, Box3d(V3d(0, 0, 0), V3d(255, 254, 0)));
}

TEST(Gltf, SparseWithAndWithoutABase) {
  for (const bool base : {false, true}) {
    GltfBuilder file;
    Json accessor = {{"componentType", 5126}, {"count", 3}, {"type", "VEC3"}};
    if (base) accessor["bufferView"] = file.view(raw_bytes(std::vector<float>{0, 0, 5, 1, 0, 5, 0, 0, 5}));
    const std::size_t indices = file.view(raw_bytes(std::vector<std::uint8_t>{1, 2})), values = file.view(raw_bytes(std::vector<float>{2, 0, 0, 0, 2, 0}));
    accessor["sparse"] = {{"count", 2}, {"indices", {{"bufferView", indices}, {"componentType", 5121}}}, {"values", {{"bufferView", values}}}};
    file.show({{"attributes", {{"POSITION", file.add("accessors", accessor)}}}});
    const Scene scene = read(file.glb());
    EXPECT_EQ(scene.mesh.points[0], V3d(0, 0, base ? 5 : 0));
    EXPECT_EQ(scene.mesh.points[1], V3d(2, 0, 0));
    EXPECT_EQ(scene.mesh.points[2], V3d(0, 2, 0));
  }
}

TEST(Gltf, ColorsAreLinearOfAllTypes) {
  const auto color = [](auto make) {
    GltfBuilder file;
    Json p = file.square();
    p["attributes"]["COLOR_0"] = make(file);
    file.show(p);
    const Scene scene = read(file.glb());
    EXPECT_EQ(scene.materials[0].kd, V3f(1, 1, 1)) << "no material: white, so that the colours are themselves";
    return scene.mesh.colors.at(3);
  };
  EXPECT_EQ(color([](GltfBuilder& f) { return f.floats({1, 1, 1, 1, 1, 1, 1, 1, 1, 0.25f, 0.5f, 2}, "VEC3"); }), V3f(0.25f, 0.5f, 1));
  EXPECT_EQ(color([](GltfBuilder& f) { return f.accessor<std::uint8_t>({0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9, 51, 102, 255, 9}, 5121, "VEC4", true); }), V3f(0.2f, 0.4f, 1));
  EXPECT_EQ(color([](GltfBuilder& f) { return f.accessor<std::uint16_t>({0, 0, 0, 9, 0, 0, 0, 9, 0, 0, 0, 9, 13107, 26214, 65535, 9}, 5123, "VEC4", true); }), V3f(0.2f, 0.4f, 1));
  // Joined to a primitive without colours: white there.
  GltfBuilder file;
  Json p = file.square();
  p["attributes"]["COLOR_0"] = file.floats(std::vector<float>(12, 0.5f), "VEC3");
  file.show(p);
  file.show(file.square());
  const Scene scene = read(file.glb());
  ASSERT_EQ(scene.mesh.colors.size(), 8u);
  EXPECT_EQ(scene.mesh.colors[0], V3f(0.5f, 0.5f, 0.5f));
  EXPECT_EQ(scene.mesh.colors[7], V3f(1, 1, 1));
}

Material material_of(const Json& material, Report* report = nullptr) {
  GltfBuilder file;
  Json p = file.square();
  p["material"] = file.add("materials", material);
  file.show(p);
  Report own;
  return read(file.glb(), report ? *report : own).materials.at(0);
}

void expect_color(const V3f& is, const V3d& should) {
  for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(is[c], static_cast<float>(should[c]));
}

TEST(Gltf, MetallicRoughnessBecomesDiffuseAndSpecular) {
  Material m = material_of({{"name", "paint"}, {"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.4, 0.2, 0.5}}, {"metallicFactor", 0.25}, {"roughnessFactor", 0.5}}}});
  EXPECT_EQ(m.name, "paint");
  expect_color(m.kd, V3d(0.6, 0.3, 0.15));
  expect_color(m.ks, V3d(0.04 * 0.75 + 0.2, 0.04 * 0.75 + 0.1, 0.04 * 0.75 + 0.05));
  EXPECT_FLOAT_EQ(m.roughness, 0.25f) << "alpha is the square of the roughness";
  EXPECT_EQ(m.opacity, 1) << "alphaMode is OPAQUE";
  EXPECT_FALSE(m.two_sided);
  m = material_of({{"pbrMetallicRoughness", {{"metallicFactor", 0}}}, {"emissiveFactor", {0, 0.5, 1}}, {"doubleSided", true}, {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 4}}}}}});
  EXPECT_EQ(m.name, "materials[0]");
  expect_color(m.kd, V3d(1, 1, 1));
  expect_color(m.ke, V3d(0, 2, 4));
  EXPECT_TRUE(m.two_sided);
  Report report;
  m = material_of({{"pbrMetallicRoughness", {{"baseColorFactor", {1, 0.5, 0, 1}}}}}, &report);
  expect_color(m.kd, V3d(0, 0, 0));
  expect_color(m.ks, V3d(1, 0.5, 0));
  EXPECT_TRUE(find_issue(report, "gltf-metal"));
}

TEST(Gltf, MaterialExtensions) {
  const Json base = {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"metallicFactor", 0}};
  Material m = material_of({{"pbrMetallicRoughness", base}, {"extensions", {{"KHR_materials_unlit", Json::object()}}}});
  expect_color(m.kd, V3d(0.5, 0.5, 0.5));
  expect_color(m.ks, V3d(0, 0, 0));
  m = material_of({{"pbrMetallicRoughness", base}, {"extensions", {{"KHR_materials_ior", {{"ior", 3}}}, {"KHR_materials_specular", {{"specularFactor", 0.5}, {"specularColorFactor", {1, 2, 8}}}}}}});
  expect_color(m.ks, V3d(0.125, 0.25, 0.5));  // F0 = 1/4
  m = material_of({{"extensions", {{"KHR_materials_pbrSpecularGlossiness", {{"diffuseFactor", {0.1, 0.2, 0.3, 1}}, {"specularFactor", {0.5, 0.25, 0.125}}, {"glossinessFactor", 0.5}}}}}});
  expect_color(m.kd, V3d(0.1, 0.2, 0.3));
  expect_color(m.ks, V3d(0.5, 0.25, 0.125));
  EXPECT_FLOAT_EQ(m.roughness, 0.25f);
  Report report;
  (void)material_of({{"normalTexture", {{"index", 0}}}, {"pbrMetallicRoughness", {{"baseColorFactor", {2, 0, 0, 1}}, {"metallicFactor", 0}}}, {"extensions", {{"KHR_materials_sheen", Json::object()}}}}, &report);
  EXPECT_TRUE(find_issue(report, "gltf-normal-map") && find_issue(report, "gltf-extension") && find_issue(report, "gltf-out-of-range"));
}

TEST(Gltf, AlphaModes) {
  const auto with = [](const char* mode, double alpha, std::optional<double> cutoff) {
    Json m = {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, alpha}}, {"metallicFactor", 0}}}, {"alphaMode", mode}};
    if (cutoff) m["alphaCutoff"] = *cutoff;
    return m;
  };
  EXPECT_EQ(material_of(with("BLEND", 0.25, {})).opacity, 0.25f);
  EXPECT_EQ(material_of(with("MASK", 0.5, {})).opacity, 1);
  // Below the cutoff nothing is there, and here nothing else is.
  EXPECT_NE(error_of([&] { (void)material_of(with("MASK", 0.49, {})); }).find("shows no triangle"), std::string::npos);
  EXPECT_EQ(material_of(with("MASK", 0.49, 0.25)).opacity, 1);
}

// A PNG of 2 x 2 texels: red, green; blue, grey, whose alphas are 1, 0.8, 0.4, 0.
std::string picture() {
  Image image{2, 2, 4, {1, 0, 0, 1, 0, 1, 0, 0.8f, 0, 0, 1, 0.4f, 0.5f, 0.5f, 0.5f, 0}};
  const std::string path = (std::filesystem::temp_directory_path() / (std::string("texel_gltf_") + ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".png")).string();
  write_png(image, path);
  std::ifstream in(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  std::filesystem::remove(path);
  return bytes;
}

Json textured(GltfBuilder& file, Json texture_info = {{"index", 0}}, Json material = Json::object()) {
  Json p = file.square();
  material["pbrMetallicRoughness"]["baseColorTexture"] = std::move(texture_info);
  material["pbrMetallicRoughness"]["metallicFactor"] = 0;
  p["material"] = file.add("materials", material);
  return p;
}

TEST(Gltf, PicturesInTheFileInTextAndBesideIt) {
  const TestFolder folder;
  folder.write("pics/my leaf.png", picture());
  for (int way = 0; way < 3; ++way) {
    GltfBuilder file;
    file.show(textured(file));
    file.add("textures", {{"source", 0}});
    if (way == 0) file.add("images", {{"bufferView", file.view(picture())}, {"mimeType", "image/png"}});
    else file.add("images", {{"uri", way == 1 ? "data:image/png;base64," + base64(picture()) : "pics/my%20leaf.png"}});
    const std::string path = folder.write("model" + std::to_string(way) + ".glb", file.glb());
    Report report;
    const Scene scene = read_scene(path, report);
    EXPECT_TRUE(report.issues.empty());
    ASSERT_EQ(scene.textures.size(), 1u);
    const Image image = scene.load_texture(scene.materials[0].map_kd.texture);
    EXPECT_EQ(image.channels, 3) << "OPAQUE: alpha is left out";
    EXPECT_EQ(image.at(0, 1)[2], 1) << "blue at the lower left";
    EXPECT_NEAR(image.at(1, 1)[0], 0.5f, 0.01) << "decoded from sRGB once (8 bits)";
    ASSERT_EQ(scene.sources.size(), way == 2 ? 2u : 1u);
    EXPECT_EQ(scene.sources.back().path, way == 2 ? folder.file("pics/my leaf.png") : path);
    // The first point of the square lies at the picture's lower left corner: uv (0, 0) here.
    EXPECT_EQ(scene.mesh.uvs[scene.mesh.uv_corners[0][0]], V2f(0, 0));
    EXPECT_EQ(scene.mesh.uvs[scene.mesh.uv_corners[0][2]], V2f(1, 1));
  }
}

TEST(Gltf, MaskedAndBlendedPictures) {
  GltfBuilder file;
  const std::size_t view = file.view(picture());
  file.add("images", {{"bufferView", view}});
  file.add("textures", {{"source", 0}});
  // The same picture opaque, masked at 0.5, masked at 0.25 with a factor of 0.5 (the same cutoff), blended.
  file.show(textured(file));
  file.show(textured(file, {{"index", 0}}, {{"alphaMode", "MASK"}}));
  file.show(textured(file, {{"index", 0}}, {{"alphaMode", "MASK"}, {"alphaCutoff", 0.25}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.5}}}}}));
  file.show(textured(file, {{"index", 0}}, {{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.5}}}}}));
  const TestFolder folder;
  Report report;
  const Scene scene = read_scene(folder.write("model.glb", file.glb()), report);
  ASSERT_EQ(scene.textures.size(), 3u);
  EXPECT_EQ(scene.materials[1].map_kd.texture, scene.materials[2].map_kd.texture);
  EXPECT_TRUE(scene.textures[0].opaque);
  EXPECT_EQ(scene.textures[1].cutoff, 0.5f);
  EXPECT_EQ(scene.textures[2].cutoff, -1);
  EXPECT_EQ(scene.materials[3].opacity, 0.5f);
  EXPECT_NEAR(scene.load_texture(2).at(0, 1)[3], 0.4f, 0.5 / 255);
  // Between alphas of 1 and 0.8 over 0.4 and 0: the upper row is there but for a little below its right half, the lower is not but for a little.
  const Image masked = scene.load_texture(1);
  EXPECT_EQ(masked.at(0, 0)[3], 1);
  EXPECT_LT(masked.at(1, 1)[3], 0.01f);
}

TEST(Image, ThresholdIsTheShareOfTheAreaAboveIt) {
  // A ramp from 0 to 1 over 64 texels: the share at or above c is 1 − c, to the quarter of a texel at which alpha is looked at.
  for (const float cutoff : {0.1f, 0.3f, 0.5f, 0.77f}) {
    Image ramp{64, 3, 2, {}};
    for (int i = 0; i < 64 * 3; ++i) {
      ramp.pixels.push_back(0.5f);
      ramp.pixels.push_back((static_cast<float>(i % 64) + 0.5f) / 64);
    }
    threshold_alpha(ramp, cutoff);
    double there = 0;
    for (int i = 0; i < 64 * 3; ++i) there += static_cast<double>(ramp.pixels[static_cast<std::size_t>(i) * 2 + 1]) / (64 * 3);
    EXPECT_NEAR(there, 1 - static_cast<double>(cutoff), 0.5 / (4 * 64) + 1e-6);
  }
  Image solid{2, 1, 3, {0, 0, 0, 1, 1, 1}};
  const std::vector<float> before = solid.pixels;
  threshold_alpha(solid, 0.5f);
  EXPECT_EQ(solid.pixels, before);
}

TEST(Gltf, TextureTransformsAndSets) {
  GltfBuilder file;
  // The specification's example: the lower left quarter of the picture, turned clockwise by 90 degrees.
  Json info = {{"index", 0}, {"texCoord", 7}, {"extensions", {{"KHR_texture_transform", {{"offset", {0, 1}}, {"rotation", std::numbers::pi / 2}, {"scale", {0.5, 0.5}}, {"texCoord", 0}}}}}};
  file.show(textured(file, info));
  file.add("textures", {{"source", 0}, {"sampler", 0}});
  file.add("samplers", {{"wrapS", 33071}, {"wrapT", 33648}});
  file.add("images", {{"bufferView", file.view(picture())}});
  Scene scene = read(file.glb());
  EXPECT_EQ(scene.materials[0].map_kd.wrap, (std::array{Wrap::kClamp, Wrap::kMirror}));
  // uv of the file (0, 1), (1, 1), (1, 0), (0, 0) -> u' = v/2, v' = 1 − u/2; here v = 0 is at the bottom: (v/2, u/2).
  const V2f should[] = {{0.5f, 0}, {0.5f, 0.5f}, {0, 0.5f}, {0, 0}};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(scene.mesh.uvs[i].x, should[i].x, 1e-7);
    EXPECT_NEAR(scene.mesh.uvs[i].y, should[i].y, 1e-7);
  }
  // The second set, as normalized bytes.
  GltfBuilder second;
  Json p = textured(second, {{"index", 0}, {"texCoord", 1}});
  p["attributes"]["TEXCOORD_1"] = second.accessor<std::uint16_t>({0, 0, 65535, 0, 65535, 65535, 0, 65535}, 5123, "VEC2", true);
  second.show(p);
  second.add("textures", {{"source", 0}});
  second.add("images", {{"bufferView", second.view(picture())}});
  scene = read(second.glb());
  EXPECT_EQ(scene.mesh.uvs[0], V2f(0, 1));
  EXPECT_EQ(scene.mesh.uvs[2], V2f(1, 0));
  second.json["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_1");
  Report report;
  (void)read(second.glb(), report);
  EXPECT_TRUE(find_issue(report, "gltf-no-uv"));
}

TEST(Gltf, PicturesOfMetalnessAndEmissionStandForTheirMeans) {
  GltfBuilder file;
  Json m = {{"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", 0}}}, {"roughnessFactor", 0.8}}}, {"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", 0}}}};
  Json p = file.square();
  p["material"] = file.add("materials", m);
  file.show(p);
  file.add("textures", {{"source", 0}});
  file.add("images", {{"bufferView", file.view(picture())}});
  Report report;
  const Scene scene = read(file.glb(), report);
  ASSERT_TRUE(find_issue(report, "gltf-mean-texture"));
  // Stored values, 188 of 255 being 0.5 in linear light: metalness (1 + s)/4, roughness as much times 0.8.
  const double s = 188.0 / 255, metal = (1 + s) / 4, linear = static_cast<double>(srgb_to_linear(188.0f / 255));
  EXPECT_NEAR(scene.materials[0].kd.x, 1 - metal, 1e-6);
  EXPECT_NEAR(scene.materials[0].roughness, 0.64 * metal * metal, 1e-6);
  EXPECT_NEAR(scene.materials[0].ke.x, (1 + linear) / 4, 1e-6);
}

TEST(Gltf, MissingPicturesAreIssues) {
  for (const char* uri : {"gone.png", "../up.png", "/etc/passwd", "https://example.org/a.png", "file:///a.png", "a%00b", "%2e%2e/up.png", "..\\up.png"}) {
    GltfBuilder file;
    file.show(textured(file));
    file.add("textures", {{"source", 0}});
    file.add("images", {{"uri", uri}});
    Report report;
    const Scene scene = read(file.glb(), report);
    ASSERT_TRUE(find_issue(report, "texture-missing")) << uri;
    EXPECT_FALSE(scene.materials[0].map_kd.used());
  }
  // Forms that are not read: the core picture is taken where there is one.
  GltfBuilder basis;
  basis.show(textured(basis));
  basis.add("textures", {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}});
  basis.json["extensionsRequired"] = {"KHR_texture_basisu"};
  Report report;
  (void)read(basis.glb(), report);
  EXPECT_TRUE(find_issue(report, "gltf-texture-format"));
}

TEST(Gltf, ScenesAndHiddenNodes) {
  GltfBuilder file;
  file.show(file.cube());
  file.add("nodes", {{"mesh", 0}, {"translation", {9, 0, 0}}});
  file.add("scenes", {{"nodes", {1}}, {"name", "other"}});
  file.json["scene"] = 1;
  Report report;
  EXPECT_EQ(measure(read(file.glb(), report).mesh).box.min.x, 9);
  EXPECT_TRUE(find_issue(report, "gltf-scenes"));
  file.json.erase("scene");
  EXPECT_EQ(measure(read(file.glb(), report).mesh).box.min.x, 0);
  // Chosen, which needs no warning; out of range.
  Report chosen;
  const auto choose = [&](int scene) { return measure(read_gltf({file.glb(), "a.glb"}, {.scene = scene}, chosen).mesh).box.min.x; };
  EXPECT_EQ(choose(0), 0);
  EXPECT_EQ(choose(1), 9);
  file.json["scene"] = 1;
  EXPECT_EQ(choose(0), 0);
  EXPECT_TRUE(chosen.issues.empty());
  EXPECT_EQ(error_of([&] { (void)choose(2); }), "3: a.glb: has no scene 2; it has 0, 1 \"other\"");
  GltfBuilder empty = file;
  empty.add("scenes", {{"name", "empty"}});
  EXPECT_EQ(error_of([&] { (void)read_gltf({empty.glb(), "a.glb"}, {.scene = 2}, chosen); }),
            "3: a.glb: shows nothing: no node of this scene has a mesh; choose by --scene among 0, 1 \"other\", 2 \"empty\"");
  file.json.erase("scene");
  file.json.erase("scenes");  // all that is there
  EXPECT_EQ(error_of([&] { (void)choose(0); }), "3: a.glb: has no scene 0: its nodes are in none; leave --scene out");
  EXPECT_EQ(read(file.glb(), report).mesh.triangles.size(), 24u);
  file.json["nodes"][1]["extensions"]["KHR_node_visibility"]["visible"] = false;
  EXPECT_EQ(read(file.glb(), report).mesh.triangles.size(), 12u);
}

TEST(Gltf, RestPoseIsSaid) {
  GltfBuilder file;
  file.show(file.cube(), {{"skin", 0}})["targets"] = {{{"POSITION", 0}}};
  file.add("animations", Json::object());
  Report report;
  EXPECT_EQ(measure(read(file.glb(), report).mesh).volume, 1);
  ASSERT_TRUE(find_issue(report, "gltf-rest-pose"));
  EXPECT_EQ(find_issue(report, "gltf-rest-pose")->count, 3);
}

TEST(Gltf, DeepHierarchiesCostNoStack) {
  GltfBuilder file;
  file.show(file.cube());
  constexpr int kDeep = 200000;
  Json& nodes = file.json["nodes"];
  for (int i = 1; i < kDeep; ++i) nodes.push_back({{"children", {i - 1}}, {"translation", {1, 0, 0}}});
  file.json["scenes"][0]["nodes"] = {kDeep - 1};
  EXPECT_EQ(measure(read(file.glb()).mesh).box.min.x, kDeep - 1);
}

TEST(Gltf, DeepTextAndManyMissingPicturesCostLittle) {
  GltfBuilder file;
  file.show(file.cube());
  std::string text = file.gltf();
  text.insert(text.size() - 1, ",\"extras\":" + std::string(3000000, '[') + std::string(3000000, ']'));
  EXPECT_EQ(read(text).mesh.triangles.size(), 12u);
  GltfBuilder many;
  many.show(textured(many));
  many.add("textures", {{"source", 0}});
  many.add("images", {{"uri", "gone0.png"}});
  for (std::size_t i = 1; i < 20000; ++i) {
    many.add("images", {{"uri", "gone" + std::to_string(i) + ".png"}});
    many.add("textures", {{"source", i}});
    Json m = many.json["materials"][0];
    m["pbrMetallicRoughness"]["baseColorTexture"]["index"] = i;
    Json p = many.json["meshes"][0]["primitives"][0];
    p["material"] = many.add("materials", m);
    many.json["meshes"][0]["primitives"].push_back(p);
  }
  Report report;
  EXPECT_EQ(read(many.glb(), report).materials.size(), 20000u);
  EXPECT_EQ(report.issues.size(), 51u);
}

TEST(Gltf, InstancesAreBoundedBeforeTheyAreMade) {
  GltfBuilder file;
  file.show(file.cube());
  for (int i = 0; i < 9; ++i) file.root(file.add("nodes", {{"mesh", 0}}));
  Report report;
  EXPECT_EQ(read_gltf({file.glb(), "a.glb"}, {.most_triangles = 120}, report).mesh.triangles.size(), 120u);
  EXPECT_NE(error_of([&] { (void)read_gltf({file.glb(), "a.glb"}, {.most_triangles = 119}, report); }).find("5: a.glb: its meshes and their copies have more than 119 triangles together"), std::string::npos);
  // Stated by an accessor without data: refused by the count alone.
  const std::size_t many = file.add("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", 4294967295u}});
  file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = many;
  EXPECT_NE(error_of([&] { (void)read(file.glb(), report); }).find("5: nowhere/model.glb: its meshes have more than 16777216 instances together"), std::string::npos);
}

TEST(Gltf, NumbersThatAreNoneAreReported) {
  GltfBuilder file;
  Json p = textured(file);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  p["attributes"]["POSITION"] = file.floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, nan, 0}, "VEC3");
  p["attributes"]["TEXCOORD_0"] = file.floats({0, 0, nan, 0, 0, 0, 0, 0}, "VEC2");
  p["attributes"]["COLOR_0"] = file.floats({nan, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}, "VEC3");
  file.show(p);
  file.add("textures", {{"source", 0}});
  file.add("images", {{"bufferView", file.view(picture())}});
  Report report;
  EXPECT_EQ(read(file.glb(), report).mesh.triangles.size(), 1u);
  EXPECT_TRUE(find_issue(report, "non-finite") && find_issue(report, "bad-uv") && find_issue(report, "non-finite-color"));
}

// --- refusals: what is changed in a good file, and what the message says ---

struct Refusal {
  const char* pointer;  // into the JSON
  Json value;           // null: erased
  const char* message;
};

TEST(Gltf, RefusesWithPathAndReason) {
  const Refusal refusals[] = {
      {"/asset", nullptr, "3: nowhere/model.glb: is no glTF 2.0 file"},
      {"/asset/version", "1.0", "5: nowhere/model.glb: is glTF \"1.0\", not 2.0"},
      {"/asset/minVersion", "2.1", "5: nowhere/model.glb: needs glTF"},
      {"/extensionsRequired", {"EXT_unheard_of"}, "5: nowhere/model.glb: requires the extension \"EXT_unheard_of\", which is not read"},
      {"/scene", 3, "scene: is 3 where the file has 1 scene"},
      {"/scenes/0/nodes/0", 1, "scenes[0].nodes[0]: is 1 where the file has 1 nodes"},
      {"/scenes/0/nodes", {0, 0}, "nodes[0]: is met twice: it has two parents or is its own ancestor"},
      {"/nodes/0/children", {0}, "nodes[0]: is met twice"},
      {"/nodes/0/mesh", -1, "nodes[0].mesh: is -1, not a whole number from 0"},
      {"/nodes/0/mesh", 1, "nodes[0].mesh: is 1 where the file has 1 mesh"},
      {"/nodes/0/mesh", "a", "nodes[0].mesh: is \"a\", not a number"},
      {"/nodes/0/matrix", {1, 2}, "nodes[0].matrix: has 2 numbers, not 16"},
      {"/nodes/0/rotation", {0, 0, 0, 0}, "nodes[0].rotation: is a quaternion of length 0"},
      {"/nodes/0/scale", {1e200, 1, 1}, "nodes[0].scale[0]: is 1e+200, too large to compute with"},
      {"/nodes/0", 5, "nodes[0]: is 5, not an object"},
      {"/meshes/0/primitives", nullptr, "meshes[0]: has no \"primitives\""},
      {"/meshes/0/primitives/0/mode", 7, "meshes[0].primitives[0].mode: is 7, not 0 to 6"},
      {"/meshes/0/primitives/0/attributes", 1, "meshes[0].primitives[0].attributes: is 1, not an object"},
      {"/meshes/0/primitives/0/attributes/POSITION", 9, "attributes.POSITION: is 9 where the file has 3 accessors"},
      {"/meshes/0/primitives/0/attributes/COLOR_0", 2, "accessors[2].type: is \"SCALAR\", which does not fit its use; expected VEC4"},
      {"/meshes/0/primitives/0/indices", 0, "accessors[0].type: is \"VEC3\""},
      {"/meshes/0/primitives/0/material", 0, "material: is 0 where the file has 0 materials"},
      {"/accessors/0/count", 0, "accessors[0].count: is 0, not from 1"},
      {"/accessors/0/count", 5, "accessors[0]: ends at byte 60 of bufferViews[0], which has 48"},
      {"/accessors/0/count", 1e30, "accessors[0].count: is 1e+30, not a whole number"},
      {"/accessors/0/count", 4.5, "accessors[0].count: is 4.5, not a whole number"},
      {"/accessors/0/byteOffset", 9007199254740992, "accessors[0]: ends at byte 9007199254741040 of bufferViews[0]"},
      {"/accessors/0/byteOffset", -4, "accessors[0].byteOffset: is -4, not a whole number"},
      {"/accessors/0/componentType", 5124, "accessors[0].componentType: is 5124, not 5120 to 5123, 5125 or 5126"},
      {"/accessors/0/componentType", 5125, "attributes.POSITION: its accessor's componentType is 5125"},
      {"/accessors/0/type", "VEC9", "accessors[0].type: is \"VEC9\""},
      {"/accessors/0/bufferView", 7, "accessors[0].bufferView: is 7 where the file has 3 bufferViews"},
      {"/accessors/0/normalized", 1, "accessors[0].normalized: is 1, not true or false"},
      {"/accessors/2/componentType", 5126, "accessors[2]: ends at byte 24"},
      {"/accessors/2/componentType", 5120, "indices: its accessor's componentType is 5120"},
      {"/accessors/0/count", 3, "indices: index 5 is 3 where there are 3 vertices"},
      {"/bufferViews/0/byteLength", 1000000, "bufferViews[0]: ends at byte 1000000 of buffers[0], which has 92"},
      {"/bufferViews/0/byteOffset", 9007199254740992, "bufferViews[0]: ends at byte 9007199254741040 of buffers[0], which has 92"},
      {"/bufferViews/0/byteStride", 4, "bufferViews[0].byteStride: is 4 where an element has 12 bytes"},
      {"/bufferViews/0/byteStride", 1e9, "bufferViews[0].byteStride: is 1000000000"},
      {"/bufferViews/0/buffer", 1, "bufferViews[0].buffer: is 1 where the file has 1 buffer"},
      {"/buffers/0/byteLength", 1000, "buffers[0].byteLength: states 1000 bytes where there are 92"},
      {"/buffers/0/uri", "gone.bin", "2: nowhere/model.glb: buffers[0].uri: \"gone.bin\" is not there"},
      {"/buffers/0/uri", "../a.bin", "3: nowhere/model.glb: buffers[0].uri: \"../a.bin\" leads out of the file's folder"},
      {"/buffers/0/uri", "a/../../b.bin", "leads out of the file's folder"},
      {"/buffers/0/uri", "http://a/b", "is not beside the file, and nothing is fetched"},
      {"/buffers/0/uri", "C:\\a.bin", "is not beside the file"},
      {"/buffers/0/uri", "data:,abc", "buffers[0].uri: is a data URI without \";base64,\""},
      {"/buffers/0/uri", "data:;base64,A*", "buffers[0].uri: holds a character that is not base64"},
      {"/nodes/0/extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", 0}, {"SCALE", 2}}}}}}, "its accessors have 4 and 6 elements"},
  };
  for (const Refusal& refusal : refusals) {
    GltfBuilder file;
    file.show(file.square());
    Json all = file.json;
    all["buffers"] = {{{"byteLength", file.bin.size()}}};
    ASSERT_EQ(file.bin.size(), 92u);
    const Json::json_pointer at(refusal.pointer);
    if (refusal.value.is_null()) all.at(at.parent_pointer()).erase(at.back());
    else all[at] = refusal.value;
    const std::string said = error_of([&] {
      Report report;
      (void)read(glb_of(all, file.bin), report);
    });
    EXPECT_NE(said.find(refusal.message), std::string::npos) << refusal.pointer << " = " << refusal.value << "\n  said: " << said << "\n  not:  " << refusal.message;
    EXPECT_EQ(said.find('\n'), std::string::npos);
  }
}

TEST(Gltf, RefusesDamagedContainers) {
  GltfBuilder file;
  file.show(file.square());
  const std::string good = file.glb();
  const auto said = [](const std::string& bytes) {
    return error_of([&] {
      Report report;
      (void)read(bytes, report);
    });
  };
  // Cut off anywhere it is one line, never a crash.
  for (std::size_t n = 0; n < good.size(); ++n) {
    const std::string message = said(good.substr(0, n));
    ASSERT_FALSE(message.empty()) << n;
    ASSERT_EQ(message.find("3: nowhere/model.glb"), 0u) << n << message;
  }
  EXPECT_NE(said(good.substr(0, 100)).find("is cut off: states"), std::string::npos);
  std::string bytes = good;
  bytes[4] = 1;
  EXPECT_EQ(said(bytes), "5: nowhere/model.glb: is GLB version 1, not 2; export it as glTF 2.0");
  bytes = good;
  bytes[15] = '\x7f';
  EXPECT_NE(said(bytes).find("a chunk at byte 12 states"), std::string::npos);
  bytes = good;
  bytes[16] = 'X';
  EXPECT_NE(said(bytes).find("its first chunk is not JSON"), std::string::npos);
  EXPECT_NE(said("{\n\"asset\": ]").find("nowhere/model.glb:2: is not JSON at byte 12"), std::string::npos);
  EXPECT_NE(said("{\"asset\": 1e999}").find("holds a number that is too large"), std::string::npos);
  EXPECT_NE(said("[]").find("is no glTF file"), std::string::npos);
  EXPECT_NE(said(std::string(3000000, '[')).find("is not JSON"), std::string::npos);
  Report report;
  EXPECT_EQ(read(good + "more", report).mesh.triangles.size(), 2u);
  EXPECT_TRUE(find_issue(report, "gltf-trailing-bytes"));
}

TEST(Gltf, MemoryIsBoundedByTheFile) {
  // Four billion vertices that are zero but for one; and a hundred thousand primitives that each unpack a megabyte.
  GltfBuilder file;
  const std::size_t one = file.view(std::string(16, '\0'));
  const Json sparse = {{"count", 1}, {"indices", {{"bufferView", one}, {"componentType", 5125}}}, {"values", {{"bufferView", one}}}};
  file.show({{"attributes", {{"POSITION", file.add("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", 300000000}, {"sparse", sparse}})}}}});
  Report report;
  EXPECT_NE(error_of([&] { (void)read(file.glb(), report); }).find("accessors[0]: unpacks to 3600000000 bytes"), std::string::npos);
  file.json["accessors"][0]["count"] = 30000;
  for (int i = 0; i < 10000; ++i) file.json["meshes"][0]["primitives"].push_back(file.json["meshes"][0]["primitives"][0]);
  EXPECT_NE(error_of([&] { (void)read(file.glb(), report); }).find("out of proportion"), std::string::npos);
}

TEST(Gltf, SparseIsChecked) {
  const auto said = [](Json sparse) {
    GltfBuilder file;
    const std::size_t indices = file.view(raw_bytes(std::vector<std::uint32_t>{1, 2, 1, 3}));
    const std::size_t values = file.view(std::string(36, '\0'));
    Json all = {{"count", 2}, {"indices", {{"bufferView", indices}, {"componentType", 5125}}}, {"values", {{"bufferView", values}}}};
    all.merge_patch(sparse);
    file.show({{"attributes", {{"POSITION", file.add("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", 3}, {"sparse", all}})}}}});
    return error_of([&] {
      Report report;
      (void)read(file.glb(), report);
    });
  };
  EXPECT_EQ(said(Json::object()), "");
  EXPECT_NE(said({{"count", 4}}).find("accessors[0].sparse.count: is 4 where the accessor has 3 elements"), std::string::npos);
  EXPECT_NE(said({{"count", 3}}).find("accessors[0].sparse.indices: element 2 is 1 after 2, not ascending"), std::string::npos);
  EXPECT_NE(said({{"indices", {{"byteOffset", 8}}}}).find("element 1 is 3 where the accessor has 3 elements"), std::string::npos);
  EXPECT_NE(said({{"values", {{"byteOffset", 16}}}}).find("accessors[0].sparse.values: ends at byte 40"), std::string::npos);
  EXPECT_NE(said({{"indices", {{"componentType", 5126}}}}).find("is 5126, not 5121, 5123 or 5125"), std::string::npos);
}

}  // namespace
}  // namespace texel
