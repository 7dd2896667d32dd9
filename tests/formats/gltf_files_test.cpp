// Files of Blender's exporter (tests/data/gltf/make.py), against what the script draws.
#include <cmath>

#include "formats/image.h"
#include "formats/read.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

const std::string kFiles = TEXEL_SAMPLES "/../tests/data/gltf/";

Scene read(const std::string& name, Report& report) { return read_scene(kFiles + name, report); }

TEST(GltfFiles, CardsCutOutByTheirPicture) {
  Report report;
  const Scene scene = read("cards.glb", report);
  EXPECT_TRUE(report.issues.empty());
  const Measures m = measure(scene.mesh);
  // Three unit cards, a prism of 12 sides; stored as floats.
  const double pi = std::acos(-1.0), stem = 12 * 2 * 0.04 * std::sin(pi / 12) + 12 * 0.04 * 0.04 * std::sin(pi / 6);
  EXPECT_NEAR(m.area, 3 + stem, 1e-6);
  EXPECT_NEAR(m.box.min.y, 0, 1e-7);
  EXPECT_NEAR(m.box.max.y, 1.4, 1e-6);
  ASSERT_EQ(scene.materials.size(), 2u);
  const Material& leaf = scene.materials[0];
  EXPECT_EQ(leaf.name, "leaf");
  EXPECT_TRUE(leaf.two_sided);
  EXPECT_NEAR(leaf.roughness, 0.36f, 1e-6);
  EXPECT_NEAR(scene.materials[1].kd.x, 0.2f, 1e-6);
  ASSERT_TRUE(leaf.map_kd.used());
  EXPECT_EQ(scene.textures[0].cutoff, 0.5f);
  // The picture's ellipse: alpha is at least a half within (1 − edge)·6 + 0.5 >= 0.5, an ellipse of half axes 0.6 and 0.95 of a square of side 2.
  const Image image = scene.load_texture(leaf.map_kd.texture);
  double there = 0;
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) there += static_cast<double>(image.pixels[i]) / (64 * 64);
  EXPECT_NEAR(there, pi * 0.6 * 0.95 / 4, 0.002) << "of sixteen places a texel along an outline of 150 texels";
}

// gltfpack -cc -noq: compressed, its floats kept but for their last bits.
TEST(GltfFiles, CompressedCardsAreTheSame) {
  Report report;
  const Measures plain = measure(read("cards.glb", report).mesh), packed = measure(read("cards_meshopt.glb", report).mesh);
  EXPECT_TRUE(report.issues.empty());
  EXPECT_NEAR(packed.area, plain.area, 1e-4);
  EXPECT_NEAR((packed.box.min - plain.box.min).length() + (packed.box.max - plain.box.max).length(), 0, 1e-4);
}

TEST(GltfFiles, NestedAndMirroredFrames) {
  Report report;
  const Scene scene = read("nested.gltf", report);
  EXPECT_TRUE(report.issues.empty());
  const Measures m = measure(scene.mesh);
  // The exporter's floats, 1e-6.
  EXPECT_NEAR((m.box.min - V3d(0, -1, -0.5)).length(), 0, 3e-6);
  EXPECT_NEAR((m.box.max - V3d(2, 3, 0.5)).length(), 0, 3e-6);
  EXPECT_NEAR(m.volume, 8, 2e-5);
  ASSERT_EQ(scene.materials.size(), 3u);
  const Material& gold = scene.materials[1];
  EXPECT_EQ(gold.name, "gold");
  EXPECT_NEAR(gold.kd.y, 0.7f * 0.25f, 1e-6);
  EXPECT_NEAR(gold.ks.y, 0.04f * 0.25f + 0.7f * 0.75f, 1e-6);
  EXPECT_NEAR(gold.roughness, 0.0625f, 1e-6);
}

TEST(GltfFiles, ColorsOfCorners) {
  Report report;
  const Scene scene = read("colors.gltf", report);
  EXPECT_TRUE(report.issues.empty());
  ASSERT_EQ(scene.mesh.colors.size(), scene.mesh.points.size());
  for (std::size_t i = 0; i < scene.mesh.points.size(); ++i) {  // y up: (x, z, −y)
    const V3d& p = scene.mesh.points[i];
    EXPECT_NEAR(scene.mesh.colors[i].x, (p.x + 1) / 2, 1e-4);   // stored in 16 bits
    EXPECT_NEAR(scene.mesh.colors[i].y, (1 - p.z) / 2, 1e-4);
    EXPECT_NEAR(scene.mesh.colors[i].z, (p.y + 1) / 4, 1e-4);
  }
  ASSERT_EQ(scene.sources.size(), 2u);
  EXPECT_TRUE(scene.sources[1].path.ends_with("colors.bin"));
}

}  // namespace
}  // namespace texel
