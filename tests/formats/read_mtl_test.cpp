#include <cmath>

#include "formats/read.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

std::vector<MtlMaterial> mtl(const std::string& text, Report& report) { return read_mtl({text, "nowhere/a.mtl"}, report); }

MtlMaterial one(const std::string& lines) {
  Report report;
  const auto all = mtl("newmtl m\n" + lines, report);
  EXPECT_EQ(all.size(), 1u);
  return all.at(0);
}

TEST(Mtl, Values) {
  const Material m = one("Ka 1 1 1\nKd 0.25 0.5 1\nKs 0.1 0 0\nNs 198\nKe 2 3 4\nd 0.75\nillum 4\nNi 1.5\nsharpness 60\n").material;
  EXPECT_EQ(m.name, "m");
  EXPECT_EQ(m.kd, V3f(0.25f, 0.5f, 1)) << "linear, as stored";
  EXPECT_EQ(m.ks, V3f(0.1f, 0, 0));
  EXPECT_EQ(m.ke, V3f(2, 3, 4));
  EXPECT_EQ(m.opacity, 0.75f);
  EXPECT_EQ(m.roughness, 0.1f) << "sqrt(2/(198+2))";
  EXPECT_EQ(one("Ns 198\n").material.roughness, 1.0f) << "nothing shines";
  EXPECT_EQ(one("Kd 0.3\n").material.kd, V3f(0.3f, 0.3f, 0.3f));
}

TEST(Mtl, NamesAreTrimmed) {
  Report report;
  const auto all = mtl("newmtl\ta long  name\t \r\nKd 1 0 0\rnewmtl b\\c\n", report);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].material.name, "a long  name");
  EXPECT_EQ(all[0].material.kd, V3f(1, 0, 0));
  EXPECT_EQ(all[1].material.name, "b\\c");
  EXPECT_EQ(all[1].where, "nowhere/a.mtl:3");
}

TEST(Mtl, TransparencyBothWays) {
  EXPECT_EQ(one("Tr 0.25\n").material.opacity, 0.75f);
  EXPECT_EQ(one("d -halo 0.25\n").material.opacity, 0.25f);
  Report report;
  EXPECT_EQ(mtl("newmtl a\nd 0.9\nTr 0.1\n", report)[0].material.opacity, 0.9f);
  EXPECT_TRUE(report.issues.empty()) << "they agree";
  EXPECT_EQ(mtl("newmtl a\nd 1\nTr 1\n", report)[0].material.opacity, 0.0f) << "the later one";
  EXPECT_TRUE(find_issue(report, "d-tr-contradict"));
  EXPECT_EQ(mtl("newmtl a\nTr 1\nd 1\n", report)[0].material.opacity, 1.0f);
  EXPECT_FALSE(find_issue(report, "tr-one"));
  EXPECT_EQ(mtl("newmtl a\nTr 1.000\n", report)[0].material.opacity, 1.0f) << "what MeshLab writes for opaque";
  EXPECT_TRUE(find_issue(report, "tr-one"));
}

TEST(Mtl, UnusableValuesKeepTheirDefaults) {
  Report report;
  const auto all = mtl("Kd 1 1 1\nnewmtl a\nKd\nKd 1 2\nKd spectral x.rfl\nKd nan 0 0\nd x\nNs inf\nmap_Kd\n", report);
  EXPECT_EQ(all[0].material.kd, Material().kd);
  EXPECT_EQ(all[0].material.opacity, 1.0f);
  EXPECT_TRUE(find_issue(report, "mtl-unreadable"));
  EXPECT_EQ(mtl("newmtl a\nKd 2 -1 0.5\n", report)[0].material.kd, V3f(1, 0, 0.5f));
  EXPECT_TRUE(find_issue(report, "mtl-out-of-range"));
}

TEST(Mtl, MapOptions) {
  const MtlMaterial m = one("map_Kd -blendu on -blendv off -cc on -clamp on -bm 2 -mm 0 1 -texres 512 -boost 1.5 -type sphere -t 1 2 3 "
                            "-s 2 3 1 -o 0.5 -imfchan r leaf color 2.png \n");
  EXPECT_EQ(m.map_kd.name, "leaf color 2.png");
  EXPECT_EQ(m.map_kd.use.scale, V2f(2, 3));
  EXPECT_EQ(m.map_kd.use.offset, V2f(0.5f, 0));
  EXPECT_EQ(m.map_kd.use.wrap, (std::array{Wrap::kClamp, Wrap::kClamp}));
  EXPECT_EQ(one("map_Kd plain.png\n").map_kd.use.scale, V2f(1, 1));
  EXPECT_EQ(one("map_Kd plain.png\n").map_kd.use.wrap, (std::array{Wrap::kRepeat, Wrap::kRepeat}));
  EXPECT_EQ(one("map_Kd -s 2 3d.png\n").map_kd.name, "3d.png") << "a word that only begins like a number";
  EXPECT_EQ(one("map_Kd -s 2 3d.png\n").map_kd.use.scale, V2f(2, 1));
  EXPECT_EQ(one("map_Kd -wet-leaf.png\n").map_kd.name, "-wet-leaf.png");
  EXPECT_EQ(one("map_Kd \"a b.png\"\n").map_kd.name, "a b.png");
  EXPECT_EQ(one("map_Kd C:\\tex\\a.png\n").map_kd.name, "C:\\tex\\a.png");
  EXPECT_TRUE(one("map_d -imfchan m a.png\n").map_d.use.alpha_channel);
  EXPECT_FALSE(one("map_d -imfchan l a.png\n").map_d.use.alpha_channel);
  EXPECT_TRUE(one("map_Bump -bm 2 b.png\nbump c.png\nmap_Ks d.png\nrefl e.png\n").map_kd.name.empty());
}

// Textures are looked for, not opened: any file will do.
class MtlTextures : public ::testing::Test {
 protected:
  Scene read(const std::string& lines) {
    folder_.write("a.mtl", "newmtl m\n" + lines);
    report_ = {};
    return read_scene(folder_.write("a.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m\nf 1 2 3\n"), report_);
  }
  TestFolder folder_;
  Report report_;
};

TEST_F(MtlTextures, FoundBesideWhateverThePath) {
  folder_.write("leaf one.png", "");
  folder_.write("tex/Bark.PNG", "");
  for (const char* name : {"leaf one.png", ".\\leaf one.png", "/home/somebody/leaf one.png", "D:\\maps\\leaf one.png", "other/LEAF one.PNG"}) {
    const Scene s = read("map_Kd " + std::string(name) + "\n");
    ASSERT_EQ(s.textures.size(), 1u) << name;
    EXPECT_EQ(s.textures[0].path, folder_.file("leaf one.png"));
    EXPECT_EQ(s.textures[0].name, name);
    EXPECT_EQ(s.sources.back().path, folder_.file("leaf one.png"));
    EXPECT_EQ(s.materials[0].map_kd.texture, 0);
    EXPECT_TRUE(report_.issues.empty());
  }
  EXPECT_EQ(read("map_Kd tex\\bark.png\n").textures.at(0).path, folder_.file("tex/Bark.PNG"));
}

TEST_F(MtlTextures, MissingKeepsTheColor) {
  const Scene s = read("Kd 0.2 0.2 0.2\nmap_Kd none.png\nmap_d none2.png\n");
  EXPECT_FALSE(s.materials[0].map_kd.used());
  EXPECT_FALSE(s.materials[0].map_d.used());
  EXPECT_EQ(s.materials[0].kd, V3f(0.2f, 0.2f, 0.2f));
  const Issue* issue = find_issue(report_, "texture-missing");
  ASSERT_TRUE(issue);
  EXPECT_EQ(issue->where, folder_.file("a.mtl") + ":3");
  EXPECT_NE(issue->text.find("none.png"), std::string::npos);
  EXPECT_EQ(read("map_Kd none.png\n").materials[0].kd, Material().kd);
}

TEST_F(MtlTextures, BlackOrNoKdUnderAPicture) {
  folder_.write("a.png", "");
  EXPECT_EQ(read("map_Kd a.png\n").materials[0].kd, V3f(1, 1, 1));
  EXPECT_TRUE(report_.issues.empty());
  EXPECT_EQ(read("Kd 0 0 0\nmap_Kd a.png\n").materials[0].kd, V3f(1, 1, 1));
  EXPECT_TRUE(find_issue(report_, "kd-black-with-texture"));
  EXPECT_EQ(read("Kd 0 0 0\n").materials[0].kd, V3f(0, 0, 0)) << "black without a picture is meant";
}

TEST_F(MtlTextures, MasksByLuminanceAreEntriesOfTheirOwn) {
  folder_.write("a.png", "");
  folder_.write("m.png", "");
  Scene s = read("map_Kd a.png\nmap_d m.png\n");
  EXPECT_FALSE(s.materials[0].map_d.alpha_channel);
  EXPECT_EQ(raw_textures(s), (std::vector<bool>{false, true}));
  s = read("map_Kd a.png\nmap_d a.png\n");
  EXPECT_TRUE(s.materials[0].map_d.alpha_channel) << "the colour picture named again means its alpha";
  EXPECT_EQ(s.textures.size(), 1u);
  s = read("map_Kd a.png\nmap_d -imfchan l a.png\n");
  EXPECT_FALSE(s.materials[0].map_d.alpha_channel);
  EXPECT_EQ(raw_textures(s), (std::vector<bool>{false, true}));
  EXPECT_EQ(s.sources.size(), 3u);
}

}  // namespace
}  // namespace texel
