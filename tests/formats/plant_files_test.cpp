// Line trees and scenes of plants.
#include "formats/plant_files.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "formats/instances.h"
#include "formats/read.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

const std::string kShared = std::string(TEXEL_SHARED_DATA) + "/amap/";

// Needs ../shared, whose files may not be part of this repository.
bool shared_is_there() { return std::filesystem::exists(kShared + "scenes/scene.ops"); }

void expect_box(const Box3d& got, const Box3d& want) {
  const double bound = 1e-3 * want.size().length();  // the README's
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(got.min[a], want.min[a], bound);
    EXPECT_NEAR(got.max[a], want.max[a], bound);
  }
}

TEST(Ops, HasTheSharedFigures) {
  if (!shared_is_there()) GTEST_SKIP() << "needs ../shared/data/amap";
  struct Expected {
    const char* file;
    bool radians;
    std::size_t triangles;
    Box3d box;    // metres
    double area;  // m²
  };
  const std::vector<Expected> scenes = {
      {"scene.ops", false, 119418, {{-0.8513, -0.9762, 0}, {2.2908, 1.1060, 1.6047}}, 6.83237},
      {"scene.ops", true, 119418, {{-0.8513, -0.9762, 0}, {2.2908, 1.2908, 1.6047}}, 6.83237},
      {"scene_mix.ops", false, 118800, {{-0.8513, -0.9762, 0}, {1.0100, 1.1060, 1.6047}}, 6.65089},
      {"scene_legacy.ops", false, 118800, {{-0.8513, -0.9762, 0}, {1.0100, 1.1060, 1.6047}}, 6.65089},
      {"scene_gwa.ops", false, 2, {{0, 0, 0}, {0.01, 0.01, 0}}, 0.0001},
      {"scene_no_archimed.ops", false, 124, {{-0.1939, -0.0225, 0}, {0.1939, 0.0225, 0.2814}}, 0.0242103},
      {"two-plates.ops", false, 4, {{0, 0, 1}, {1, 1, 2}}, 2},
  };
  for (const Expected& e : scenes) {
    SCOPED_TRACE(e.file);
    Report report;
    ReadOptions options;
    options.plants.radians = e.radians;
    const std::string path = kShared + "scenes/" + e.file;
    const Scene scene = flatten_instances(read_scene(std::span(&path, 1), options, report));
    const Measures m = measure(scene.mesh);
    EXPECT_EQ(scene.mesh.triangles.size(), e.triangles);
    expect_box(m.box, e.box);
    EXPECT_NEAR(m.area, e.area, 1e-4 * e.area);
    if (std::string_view(e.file) == "scene.ops") {
      EXPECT_EQ(scene.sources.size(), 3u);  // a plant named five times is one file
    }
  }
}

const std::string kQuad = "<gwa><mesh><points>0 0 0 100 0 0 100 50 0 0 50 0</points><faces><face>0 1 2 3</face></faces></mesh></gwa>";

struct Placed {
  TestFolder folder;
  Report report;
  Scene read(const std::string& rows) {
    folder.write("a b/quad.gwa", kQuad);
    return read_scene(folder.write("s.ops", rows), report);
  }
  std::string refusal(const std::string& rows) {
    std::string text = error_of([&] { (void)read(rows); });
    const std::string here = folder.file("");
    for (std::size_t at = 0; (at = text.find(here)) != std::string::npos;) text.erase(at, here.size());
    return text;
  }
};

TEST(Ops, PlacesInMetresAndDegrees) {
  Placed p;
  // Turned a quarter, doubled, moved; the name has a blank, the row two tabs; then the old form of nine fields and a scale of 0.
  const Scene placed = p.read("#[Archimed] x\nT 0 0 0 1 1 flat\n1\t1\ta b/quad.gwa\t10\t\t0\t5\t2\t0\t0\t90\r\n-1 1 1\n1\t2\ta b\\quad.gwa\t0\t0\t0\t0\t0\t0\n1\t3\ta b/quad.gwa\t0\t0\t0\t0\t0\t0\t0\n");
  const Scene scene = flatten_instances(placed);
  ASSERT_EQ(scene.mesh.triangles.size(), 6u);
  EXPECT_EQ(placed.shapes.size(), 1u);
  EXPECT_EQ(placed.instances.size(), 3u);
  EXPECT_EQ(scene.materials.size(), 1u);
  Box3d box;
  for (std::size_t i = 0; i < 4; ++i) box.extendBy(scene.mesh.points[i]);
  expect_box(box, {{9, 0, 5}, {10, 2, 5}});
  box = {};
  for (std::size_t i = 4; i < 12; ++i) box.extendBy(scene.mesh.points[i]);
  expect_box(box, {{0, 0, 0}, {1, 0.5, 0}});
  EXPECT_TRUE(p.report.issues.empty());
}

TEST(Ops, InclinesTowardsTheAzimuth) {
  Placed p;
  // Inclined by 90 degrees towards +x: what pointed along x points down, what pointed up points along x.
  const Scene scene = p.read("1\t1\ta b/quad.gwa\t0\t0\t0\t1\t0\t90\t0\n");
  expect_box(measure(scene.mesh).box, {{0, 0, -1}, {0, 0.5, 0}});
}

TEST(Ops, SkipsWhatItCannotPlaceAndSaysSo) {
  Placed p;
  const Scene scene = p.read("1\t1\ta b/quad.gwa\t0\t0\t0\t1\t0\t0\t0\n1\t1\tbench.obj\t0\t0\t0\t1\t0\t0\t0\n2\t1\ta b/quad.gwa\t0\t0\t0\t1\t0\t0\t0\npolyline 1 2 3\n");
  EXPECT_EQ(scene.mesh.triangles.size(), 2u);
  for (const char* id : {"plant-part", "plant-scenes", "plant-rows"}) {
    ASSERT_TRUE(find_issue(p.report, id)) << id;
    EXPECT_EQ(find_issue(p.report, id)->count, 1);
  }
}

TEST(Ops, OnePlantIsTrianglesSeveralAreInstances) {
  Placed p;
  const std::string one = "1\t1\ta b/quad.gwa\t2\t3\t0\t1\t0\t0\t0\n";
  const Scene single = p.read(one);
  EXPECT_EQ(single.mesh.triangles.size(), 2u);
  EXPECT_TRUE(single.shapes.empty() && single.instances.empty());
  std::string rows = one;
  for (int i = 0; i < 999; ++i) rows += "1\t1\ta b/quad.gwa\t" + std::to_string(i) + "\t0\t0\t2\t30\t10\t40\n";
  const Scene many = p.read(rows);
  EXPECT_TRUE(many.mesh.triangles.empty());
  ASSERT_EQ(many.shapes.size(), 1u);
  EXPECT_EQ(many.shapes[0].points.size(), 4u);
  EXPECT_EQ(many.instances.size(), 1000u);
  EXPECT_NEAR(measure(flatten_instances(many).mesh).area, 0.5 + 999 * 2, 1e-9);  // roundings of coordinates up to 1000, a thousand times
}

TEST(Ops, MeshesArePlacedToo) {
  Placed p;
  p.folder.write("bench.obj", "mtllib b.mtl\nusemtl wood\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
  p.folder.write("b.mtl", "newmtl wood\nKd 1 0 0\n");
  const std::string plant = "1\t1\ta b/quad.gwa\t0\t0\t0\t1\t0\t0\t0\n", bench = "1\t2\tbench.obj\t7\t0\t0\t2\t0\t0\t90\n";
  const Scene scene = p.read(plant + bench);
  ASSERT_EQ(scene.mesh.triangles.size(), 3u);
  EXPECT_EQ(scene.mesh.uv_corners.size(), 3u);
  EXPECT_LE((scene.mesh.points[5] - V3d(7, 2, 0)).length(), 1e-15 * 8);  // a rounding
  EXPECT_EQ(scene.materials[scene.mesh.materials[2]].name, "wood");
  EXPECT_EQ(scene.sources.size(), 4u);
  EXPECT_FALSE(find_issue(p.report, "plant-part"));
  // Before the plant, and twice.
  const Scene other = p.read(bench + plant);
  EXPECT_EQ(other.mesh.uv_corners.size(), 3u);
  EXPECT_EQ(other.mesh.uv_corners[1][0], kNoIndex);
  const Scene twice = p.read(bench + bench + plant);
  EXPECT_EQ(twice.mesh.triangles.size(), 2u);
  ASSERT_EQ(twice.shapes.size(), 1u);
  EXPECT_EQ(twice.instances.size(), 2u);
  EXPECT_EQ(twice.materials[twice.shapes[0].materials[0]].name, "wood");
}

TEST(Ops, RefusalsNameThePlace) {
  Placed p;
  EXPECT_EQ(p.refusal("1\t1\t../x.opf\t0\t0\t0\t1\t0\t0\t0"), "3: s.ops:1: \"../x.opf\" leads out of the scene's folder; put the plant beside the scene or below it");
  EXPECT_EQ(p.refusal("1\t1\t/x.opf\t0\t0\t0\t1\t0\t0\t0"), "3: s.ops:1: \"/x.opf\" leads out of the scene's folder; put the plant beside the scene or below it");
  EXPECT_EQ(p.refusal("#\n1\t1\tx.opf\t0\t0\t0\t1\t0\t0\t0"), "2: x.opf: named at s.ops:2, is not there; put it beside the scene");
  EXPECT_EQ(p.refusal("1\t1\tx.opf\t0\t0,5\t0\t1\t0\t0\t0"), "3: s.ops:1: is not a finite number (\"0,5\")");
  EXPECT_EQ(p.refusal("1\t1\tx.opf\tnan\t0\t0\t1\t0\t0\t0"), "3: s.ops:1: is not a finite number (\"nan\")");
  EXPECT_EQ(p.refusal("1\t1\ta b/quad.gwa\t0\t0\t0\t1e-40\t0\t0\t0"), "3: s.ops:1: is a transform that makes things flat or infinite; leave the row out");
  EXPECT_EQ(p.refusal(""), "3: s.ops: places no plant with drawable geometry; give a file with faces");
}

// --- symbols ------------------------------------------------------------------------------------------------------------------

TEST(Smb, HasTheSharedFigures) {
  if (!shared_is_there()) GTEST_SKIP() << "needs ../shared/data/amap";
  struct Expected {
    const char* file;
    std::size_t triangles;
    Box3d box;
    double area;
    bool concave = false;  // cut by ears rather than as a fan, so that the area is the true one
  };
  const std::vector<Expected> symbols = {
      {"nentn105", 10, {{0, -0.4755, -0.4045}, {1, 0.4755, 0.5}}, 2.93896},
      {"entn105", 10, {{0, -0.9511, -0.8090}, {1, 0.9511, 1}}, 5.87793},
      {"feui101", 2, {{0, -0.2, 0}, {1, 0.2, 0}}, 0.2},
      {"feui126", 12, {{0.1016, -0.2245, -0.2147}, {0.9997, 0.1227, 0.1325}}, 0.296652},
      {"fchene", 86, {{0, -0.5676, 0}, {1, 0.4505, 0}}, 0.569292, true},
      {"feuijugl7", 49, {{-0.0021, -0.3764, 0}, {1.4302, 0.3707, 0.0156}}, 0.315055},
      {"lvpecher", 48, {{0.0010, -0.1314, -0.1334}, {1.0001, 0.0521, 0.0764}}, 0.133961},
      {"limbcoton1", 159, {{-0.1293, -0.5274, -0.0004}, {0.9926, 0.5274, 0.1010}}, 0.780653},
      {"stipisum", 1218, {{-0.4282, -0.5112, -0.0340}, {0.9400, 0.5112, 0.0722}}, 0.982514},
  };
  for (const Expected& e : symbols) {
    SCOPED_TRACE(e.file);
    Report report;
    const Measures m = measure(read_scene(kShared + "smb/" + e.file + ".smb", report).mesh);
    EXPECT_EQ(read_scene(kShared + "smb/" + e.file + ".smb", report).mesh.triangles.size(), e.triangles);
    expect_box(m.box, e.box);
    EXPECT_NEAR(m.area, e.area, 1e-4 * e.area);
  }
}

TEST(Smb, TheOlderLayoutIsRefused) {
  if (!shared_is_there()) GTEST_SKIP() << "needs ../shared/data/amap";
  Report report;
  const std::string error = error_of([&] { (void)read_scene(kShared + "smb/feu106.smb", report); });
  EXPECT_NE(error.find("feu106.smb: is not an AMAP symbol: its counts do not lead to its end of 168 bytes in either byte order"), std::string::npos) << error;
  EXPECT_EQ(error.front(), '3');
}

// Bytes in either order.
struct Bytes {
  bool big;
  std::string all{};
  Bytes& word(std::uint32_t v) {
    if (big) v = __builtin_bswap32(v);
    all.append(reinterpret_cast<const char*>(&v), 4);
    return *this;
  }
  Bytes& half(std::uint16_t v) {
    if (big) v = static_cast<std::uint16_t>(v << 8 | v >> 8);
    all.append(reinterpret_cast<const char*>(&v), 2);
    return *this;
  }
  Bytes& real(float v) { return word(std::bit_cast<std::uint32_t>(v)); }
};

// A square pipe along x, as in plant_test.cpp.
std::string pipe(bool big, std::uint32_t last_index = 7) {
  Bytes b{big};
  b.word(4).word(8);
  const std::uint32_t faces[4][4] = {{3, 2, 1, 0}, {4, 5, 6, last_index}, {0, 1, 5, 4}, {2, 3, 7, 6}};
  for (const auto& face : faces) {
    b.word(4).half(1).half(3);
    for (const std::uint32_t corner : face) b.word(0).word(corner).half(0);
  }
  for (int i = 0; i < 8; ++i) {
    const int k = i % 4;
    b.real(NAN).real(0).real(0).real(k == 1 || k == 2 ? 1.0f : 0.0f).real(k < 2 ? -0.5f : 0.5f).real(i < 4 ? -0.5f : 0.5f).real(0).real(0).real(NAN);
  }
  return b.all;
}

std::string record(bool big, std::uint32_t symbol, std::array<float, 12> m, float base, float top) {
  Bytes b{big};
  b.word(symbol).word(1).word(1).word(1);
  for (const float v : m) b.real(v);
  return b.real(base).real(top).word(5).all;
}

const std::array<float, 12> kUp = {0, 0, -1, 0, 0, 1, 0, 0, 4, 0, 0, 10};
const std::string kTable = "2 symbole(s)\nwood 1 pipe_T_bark 1 x\nleaf 2 pipe.smb 1\nSymbole 1\nDIFFUSE 0.5 0.25 0\nSHININESS 10\nSymbole 2\nINTERPOLATION 60\n"
                           "EMISSION 0 0 0\nDIFFUSE 0 1 0\nEMISSION 0 0 0\nAMBIENT 1 1 1\nDIFFUSE 1 0 0\n";

TEST(Lig, BothByteOrdersAreTheSame) {
  for (const bool big : {false, true})
    for (const bool symbol_big : {false, true}) {
      TestFolder folder;
      folder.write("pipe.smb", pipe(symbol_big));
      folder.write("tree.dta", kTable);
      const std::string header(80, 'h');
      const std::string path = folder.write("tree12.lig", header + record(big, 1, kUp, 2, 1) + record(big, 2, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0}, 1, 1) + record(big, 9, kUp, 1, 1));
      Report report;
      const Scene scene = read_scene(path, report);
      ASSERT_EQ(scene.mesh.triangles.size(), 16u);
      Measures m;
      for (std::size_t i = 0; i < 8; ++i) m.box.extendBy(scene.mesh.points[i]);
      expect_box(m.box, {{-0.01, -0.01, 0.10}, {0.01, 0.01, 0.14}});
      EXPECT_FLOAT_EQ(scene.materials[0].kd.x, srgb_to_linear(0.5f));
      EXPECT_FLOAT_EQ(scene.materials[1].kd.x, srgb_to_linear(0.4f));
      EXPECT_FLOAT_EQ(scene.materials[1].kd.y, srgb_to_linear(0.6f));
      ASSERT_TRUE(find_issue(report, "plant-symbol"));
      EXPECT_EQ(find_issue(report, "plant-symbol")->text, "organs whose symbol number 9 is not in the table; left out");
      EXPECT_EQ(scene.sources.size(), 3u);
      Mesh second;  // the mirrored one still has its outside outside
      second.points = scene.mesh.points;
      second.triangles.assign(scene.mesh.triangles.begin() + 8, scene.mesh.triangles.end());
      EXPECT_GT(measure(second).volume, 0);
    }
}

TEST(Lig, GreenLabTableAndFolderOfSymbols) {
  TestFolder folder;
  folder.write("symbols/pipe.smb", pipe(true));
  folder.write("t.dsp", "# a remark\norgan 1 1 pipe.smb 1 0.5 0\n");
  folder.write("t.cfg", "X = 1\nSYMBOLES = symbols\n");
  const std::string path = folder.write("t.lig", std::string(80, ' ') + record(false, 1, kUp, 1, 1));
  Report report;
  const Scene scene = read_scene(path, report);
  EXPECT_EQ(scene.mesh.triangles.size(), 8u);
  EXPECT_FLOAT_EQ(scene.materials[0].kd.y, srgb_to_linear(0.5f));
}

TEST(Lig, RefusalsNameThePlace) {
  Report report;
  const auto lig = [&](const std::string& bytes) { return error_of([&] { (void)read_lig({bytes, "t.lig"}, {}, {}, report); }); };
  EXPECT_EQ(lig("abc"), "3: t.lig: is not a line tree: 3 bytes are no header of 80 and records of 76");
  EXPECT_EQ(lig(std::string(156, '\x7f')), "3: t.lig: is not a line tree: in neither byte order do records have a symbol's number and a finite matrix");
  const auto dta = [&](const std::string& text) { return error_of([&] { (void)read_dta({text, "t.dta"}, report); }); };
  EXPECT_EQ(dta(""), "3: t.dta:1: ends where a number of symbols is expected");
  EXPECT_EQ(dta("x"), "3: t.dta:1: number of symbols is not a number (\"x\")");
  EXPECT_EQ(dta("3\na 1 f\n"), "3: t.dta:3: ends after 1 of 3 symbols");
  EXPECT_EQ(dta("1e9"), "3: t.dta:1: states an impossible number of symbols");
  EXPECT_EQ(dta("1\na 1 f\nSymbole 1\nDIFFUSE 1 x 0\n"), "3: t.dta:4: colour is not a number (\"x\")");
  const auto dsp = [&](const std::string& text) { return error_of([&] { (void)read_dsp({text, "t.dsp"}, report); }); };
  EXPECT_EQ(dsp("a b"), "3: t.dsp:1: a symbol's number is not a whole number (\"b\"); its lines are `organtype NUMBER IS_BRANCH FILE R G B`");
  const auto smb = [&](const std::string& bytes) { return error_of([&] { (void)read_smb({bytes, "t.smb"}, report); }); };
  EXPECT_EQ(smb("abc").substr(0, 40), "3: t.smb: is not an AMAP symbol: its cou");
  EXPECT_EQ(smb(std::string(8, '\xff')).substr(0, 40), "3: t.smb: is not an AMAP symbol: its cou");
  TestFolder folder;
  const std::string path = folder.write("t.lig", std::string(80, ' ') + record(false, 1, kUp, 1, 1));
  EXPECT_EQ(error_of([&] { (void)read_scene(path, report); }), "2: " + path + ": has no table of symbols: t.dta or .dsp; put it beside the line tree");
}

TEST(Lig, BadIndicesAndMatricesAreLeftOut) {
  Report report;
  const PlantMesh mesh = read_smb({pipe(true, 8), "p.smb"}, report);
  EXPECT_EQ(mesh.triangles.size(), 6u);
  ASSERT_TRUE(find_issue(report, "bad-index"));
  std::array<float, 12> broken = kUp;
  broken[3] = NAN;
  const std::vector<PlantSymbol> table = {{1, "p.smb", {}}};
  const Plant plant = read_lig({std::string(80, ' ') + record(true, 1, kUp, 1, 1) + record(true, 1, broken, 1, 1), "t.lig"}, table,
                               [&](const std::string&, PlantMesh& to) { to = mesh; return true; }, report);
  EXPECT_EQ(plant.organs.size(), 1u);
  EXPECT_EQ(find_issue(report, "plant-matrix")->count, 1);
}

TEST(Lig, HasTheSharedFigures) {
  if (!shared_is_there()) GTEST_SKIP() << "needs ../shared/data/amap";
  for (const char* name : {"made_be", "made_le"}) {
    SCOPED_TRACE(name);
    TestFolder folder;  // the symbols lie elsewhere: a .cfg says where
    std::filesystem::copy(kShared + "line_tree_made/" + name + ".lig", folder.file("made.lig"));
    std::filesystem::copy(kShared + "line_tree_made/made.dta", folder.file("made.dta"));
    folder.write("made.cfg", "SYMBOLES = " + std::filesystem::absolute(kShared + "smb").string() + "\n");
    Report report;
    ReadOptions options;
    options.plants.unit = 1;
    const std::string path = folder.file("made.lig");
    const Scene scene = read_scene(std::span(&path, 1), options, report);
    EXPECT_EQ(scene.mesh.triangles.size(), 42u);
    EXPECT_EQ(std::count(scene.mesh.materials.begin(), scene.mesh.materials.end(), 0u), 30);
    std::size_t flat = 0;
    for (const auto& t : scene.mesh.triangles)
      flat += (scene.mesh.points[t[1]] - scene.mesh.points[t[0]]).cross(scene.mesh.points[t[2]] - scene.mesh.points[t[0]]).length() / 2 < 1e-12;
    EXPECT_EQ(flat, 10u);
    const Measures m = measure(scene.mesh);
    expect_box(m.box, {{-0.9511, -0.9511, 0}, {6.3236, 1.0000, 18.3000}});
    EXPECT_NEAR(m.area, 108.788, 1e-4 * 108.788);
    EXPECT_EQ(find_issue(report, "plant-symbol")->count, 1);
  }
}

}  // namespace
}  // namespace texel
