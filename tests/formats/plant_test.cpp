// Plants: OPF and GWA, their figures as the README of the shared data has them, and what can be wrong with them.
#include "formats/plant.h"

#include <cmath>
#include <fstream>
#include <map>

#include "formats/read.h"
#include "formats/xml.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

const std::string kShared = std::string(TEXEL_SHARED_DATA) + "/amap/";

// Needs ../shared, whose files may not be part of this repository.
bool shared_is_there() { return std::filesystem::exists(kShared + "scenes/coffee.opf"); }

struct Expected {
  const char* file;
  std::size_t triangles, flat;
  Box3d box;    // centimetres
  double area;  // cm²
};

const std::vector<Expected> kPlants = {
    {"coffee.opf", 118798, 850, {{-85.1331, -97.6182, 0}, {83.5350, 110.5956, 160.4674}}, 66507.9},
    {"simple_plant.opf", 124, 0, {{-19.3892, -2.2452, 0}, {19.3892, 2.2452, 28.1378}}, 242.103},
    {"simple_OPF_shapes.opf", 68, 4, {{-10.9731, -1.3471, 0}, {9.3019, 2.7432, 14.6967}}, 74.7258},
    {"quad_empty_material.opf", 2, 0, {{0, 0, 0}, {100, 100, 0}}, 10000},
    {"pavement.gwa", 2, 0, {{0, 0, 0.5}, {300, 490, 0.5}}, 147000},
    {"pave100x100.gwa", 2, 0, {{0, 0, 0}, {100, 100, 0}}, 10000},
    {"pave1x1.gwa", 2, 0, {{0, 0, 0}, {1, 1, 0}}, 1},
    {"turtle-step00000.gwa", 96, 0, {{31.1622, 30.2740, 1.4510}, {68.8378, 68.0815, 20}}, 415.692},
};

void expect_box(const Box3d& got, const Box3d& want) {
  const double bound = 1e-3 * want.size().length();  // the README's
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(got.min[a], want.min[a], bound);
    EXPECT_NEAR(got.max[a], want.max[a], bound);
  }
}

std::size_t flat_triangles(const Mesh& mesh, double least) {
  std::size_t flat = 0;
  for (const auto& t : mesh.triangles)
    flat += (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]).length() / 2 < least;
  return flat;
}

Scene read_in(const std::string& path, double unit, Report& report) {
  ReadOptions options;
  options.plants.unit = unit;
  return read_scene(std::span(&path, 1), options, report);
}

TEST(Plants, HaveTheSharedFigures) {
  if (!shared_is_there()) GTEST_SKIP() << "needs ../shared/data/amap";
  for (const Expected& e : kPlants) {
    SCOPED_TRACE(e.file);
    Report report;
    const Scene scene = read_in(kShared + "scenes/" + e.file, 1, report);
    const Measures m = measure(scene.mesh);
    EXPECT_EQ(scene.mesh.triangles.size(), e.triangles);
    EXPECT_EQ(flat_triangles(scene.mesh, 1e-12), e.flat);
    expect_box(m.box, e.box);
    EXPECT_NEAR(m.area, e.area, 1e-4 * e.area);
    // Centimetres unless told otherwise, metres in the scene: the same but for rounding.
    const Measures metres = measure(read_scene(kShared + "scenes/" + e.file, report).mesh);
    EXPECT_NEAR(metres.area, m.area * 1e-4, 1e-12 * m.area);
    EXPECT_NEAR(metres.box.max.x, m.box.max.x / 100, 1e-12);
  }
}

TEST(Plants, MaterialsAreTheSharedOnes) {
  if (!shared_is_there()) GTEST_SKIP() << "needs ../shared/data/amap";
  const auto check = [](const char* file, std::size_t first, std::size_t second, V3f a, V3f b) {
    SCOPED_TRACE(file);
    Report report;
    const Scene scene = read_in(kShared + "scenes/" + file, 0, report);
    std::size_t counts[2] = {};
    V3f kd[2];
    for (const std::uint32_t m : scene.mesh.materials) {
      const bool is_second = scene.materials[m].name == "material_1";
      ++counts[is_second];
      kd[is_second] = scene.materials[m].kd;
      EXPECT_EQ(scene.materials[m].opacity, 1);
    }
    EXPECT_EQ(counts[0], first);
    EXPECT_EQ(counts[1], second);
    for (int c = 0; c < 3; ++c) {
      EXPECT_FLOAT_EQ(kd[0][c], srgb_to_linear(a[c]));
      EXPECT_FLOAT_EQ(kd[1][c], srgb_to_linear(b[c]));
    }
  };
  check("coffee.opf", 92650, 26148, {0.35f, 0.3f, 0.0f}, {0.1f, 0.7f, 0.1f});
  check("simple_plant.opf", 100, 24, {0.5058824f, 0.38039216f, 0.24313726f}, {0, 0.5294118f, 0.24313726f});
  check("simple_OPF_shapes.opf", 44, 24, {1, 0.8901961f, 0}, {1, 0, 0});
}

// The areas of every organ, as another program computed them: taper, matrix and unit at once.
TEST(Plants, OrganAreasAgreeWithAnotherProgram) {
  if (!shared_is_there()) GTEST_SKIP() << "needs ../shared/data/amap";
  std::map<std::int64_t, double> expected;
  std::ifstream file(kShared + "scenes/coffee_organ_areas.csv");
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) expected[std::stoll(line)] = std::stod(line.substr(line.rfind(',') + 1));
  ASSERT_EQ(expected.size(), 4032u);
  Report report;
  const FileBytes bytes(kShared + "scenes/coffee.opf");
  const Plant plant = read_opf({bytes.bytes(), "coffee.opf"}, report);
  ASSERT_EQ(plant.organs.size(), 4032u);
  double worst = 0, sum = 0;
  for (const PlantOrgan& organ : plant.organs) {
    Scene scene;
    Plant alone;
    alone.meshes = plant.meshes;
    alone.organs = {organ};
    place_plant(alone, Affine::scale(0.01), 0, scene, report, "coffee.opf");
    const double area = measure(scene.mesh).area, want = expected.at(organ.id);
    sum += area;
    // Its single precision is the limit: 1e-4 relative, or 1e-10 m² absolute (both the README's).
    if (std::abs(area - want) > 1e-10) worst = std::max(worst, std::abs(area - want) / want);
  }
  EXPECT_LT(worst, 1e-4);
  EXPECT_NEAR(sum, 6.65079, 1e-4 * 6.65079);
  RecordProperty("worst_relative_difference", std::to_string(worst));
}

// --- made here ----------------------------------------------------------------------------------------------------------------

const std::string kBar =  // a square pipe along x of edge 1, open
    "<meshBDD><mesh Id='7'><points>0 -.5 -.5 1 -.5 -.5 1 .5 -.5 0 .5 -.5\n0 -.5 .5 1 -.5 .5 1 .5 .5 0 .5 .5</points>"
    "<faces><face Id='0'>3 2 1 0</face><face Id='1'>4 5 6 7</face><face Id='2'>0 1 5 4</face><face Id='3'>2 3 7 6</face></faces></mesh></meshBDD>";
const std::string kShape = "<shapeBDD><shape Id='3'><name> s</name><meshIndex>7</meshIndex><materialIndex>5</materialIndex></shape></shapeBDD>";
const std::string kWood = "<materialBDD><material Id='5'><diffuse>0.5 0.25 0 1</diffuse></material></materialBDD>";

std::string organ(const std::string& inside) { return "<geometry class='Mesh'><shapeIndex>3</shapeIndex>" + inside + "</geometry>"; }
std::string opf(const std::string& topology, const std::string& before = kBar + kWood + kShape) {
  return "<?xml version='1.0'?>\n<opf version='2.0'>\n" + before + "\n<topology class='P' id='1'>\n" + topology + "\n</topology></opf>";
}

Scene read_text(const std::string& text, Report& report) {
  return plant_scene(read_opf({text, "p.opf"}, report), {.unit = 1}, report, "p.opf");
}
Scene read_text(const std::string& text) {
  Report report;
  return read_text(text, report);
}
std::string refusal(const std::string& text) {
  return error_of([&] { (void)read_text(text); });
}

TEST(Opf, TapersThenMoves) {
  // A pyramid's frustum: 2 thick at the base, 1 at the tip, 4 long, upwards.
  const Scene scene = read_text(opf(organ("<mat>0 0 -1 0\n0 1 0 0\n4 0 0 10</mat><dUp>1.0</dUp><dDwn>2</dDwn>")));
  const Measures m = measure(scene.mesh);
  EXPECT_EQ(scene.mesh.triangles.size(), 8u);
  EXPECT_EQ(m.box.min, V3d(-1, -1, 10));
  EXPECT_EQ(m.box.max, V3d(1, 1, 14));
  EXPECT_NEAR(m.area, 4 * 1.5 * std::hypot(4, 0.5), 1e-12);
}

TEST(Opf, MatricesAreAbsolute) {
  const std::string move = "<mat>1 0 0 5 0 1 0 0 0 0 1 0</mat>";
  const Scene scene = read_text(opf(organ(move) + "<follow>" + organ(move) + "</follow>"));
  EXPECT_EQ(measure(scene.mesh).box.max.x, 6);
}

TEST(Opf, NoTaperWhereItIsNotANumberOrTurnedOff) {
  for (const char* taper : {"<dUp>NaN</dUp><dDwn>2</dDwn>", "<dUp>NA</dUp><dDwn>2</dDwn>", "<dDwn>2</dDwn>", "<dUp></dUp><dDwn>2</dDwn>", "<dUp>Infinity</dUp><dDwn>2</dDwn>"})
    EXPECT_EQ(measure(read_text(opf(organ(taper))).mesh).box.max.y, 0.5) << taper;
  std::string fixed = opf(organ("<dUp>3</dUp><dDwn>3</dDwn>"));
  EXPECT_EQ(measure(read_text(fixed).mesh).box.max.y, 1.5);
  fixed.replace(fixed.find("Id='7'"), 6, "Id='7' enableScale='FALSE'");
  EXPECT_EQ(measure(read_text(fixed).mesh).box.max.y, 0.5);
}

TEST(Opf, MirroredOrgansKeepTheirOutside) {
  const auto outside = [](const char* matrix) { return measure(read_text(opf(organ(std::string("<mat>") + matrix + "</mat>"))).mesh).volume; };
  const double straight = outside("1 0 0 0 0 1 0 0 0 0 1 0");
  EXPECT_GT(straight, 0.6);  // two thirds: the pipe has no ends
  EXPECT_NEAR(outside("1 0 0 0 0 -1 0 0 0 0 1 0"), straight, 1e-12);
  EXPECT_NEAR(outside("-1 0 0 0 0 -1 0 0 0 0 -1 0"), straight, 1e-12);
}

TEST(Opf, AlphaIsNoOpacity) {
  std::string text = opf(organ(""));
  text.replace(text.find("0.25 0 1<"), 9, "0.25 0 0<");
  Report report;
  const Scene scene = read_text(text, report);
  EXPECT_EQ(scene.materials[0].opacity, 1);
  EXPECT_FLOAT_EQ(scene.materials[0].kd.x, srgb_to_linear(0.5f));
  ASSERT_TRUE(find_issue(report, "plant-alpha"));
  EXPECT_EQ(scene.mesh.triangles.size(), 8u);
}

TEST(Opf, BlackIsAmbientAndNoneIsNeutral) {
  const auto kd = [](const std::string& materials) { return read_text(opf(organ(""), kBar + kShape + materials)).materials; };
  EXPECT_FLOAT_EQ(kd("<materialBDD><material Id='5'><ambient>0 1 0 1</ambient><diffuse>0 0 0 1</diffuse></material></materialBDD>")[0].kd.y, 1);
  EXPECT_FLOAT_EQ(kd("")[0].kd.x, srgb_to_linear(0.8f));
  EXPECT_FLOAT_EQ(kd("<materialBDD></materialBDD>")[0].kd.x, srgb_to_linear(0.8f));
}

TEST(Opf, OnlyChildrenOfNodesAreSpecial) {
  const Scene scene = read_text(opf("<attr><geometry><shapeIndex>3</shapeIndex></geometry><follow>" + organ("") + "</follow></attr><!-- c --><?pi x?><a><![CDATA[<follow>]]></a>" + organ("")));
  EXPECT_EQ(scene.mesh.triangles.size(), 8u);
}

TEST(Opf, DefectsAreCountedAndLeftOut) {
  Report report;
  const std::string broken = "<meshBDD><mesh Id='7'><points>0 0 0 1 0 0 0 1 0 NaN 0 0 9</points><faces><face>0 1 2</face><face>0 1 3</face><face>0 1</face><face/>"
                             "<face>0 1 4</face><face>0 1 -1</face>0 2 1 1 2</faces></mesh><mesh Id='8'/><mesh Id='8'/></meshBDD>";
  const Scene scene = read_text(opf(organ("") + "<follow><geometry><shapeIndex>9</shapeIndex></geometry></follow><branch>" + organ("<mat>1 2 3</mat>") +
                                        "</branch><branch>" + organ("<mat>1 0 0 0 0 Infinity 0 0 0 0 1 0</mat>") + "</branch>",
                                    broken + kShape + "<materialBDD><material Id='1'/></materialBDD>"),
                                report);
  EXPECT_EQ(scene.mesh.triangles.size(), 2u);
  const auto count = [&](const char* id) { return find_issue(report, id) ? find_issue(report, id)->count : 0; };
  EXPECT_EQ(count("non-finite"), 1);
  EXPECT_EQ(count("bad-index"), 5);
  EXPECT_EQ(count("plant-points"), 1);
  EXPECT_EQ(count("plant-reference"), 1);
  EXPECT_EQ(count("plant-matrix"), 2);
  EXPECT_EQ(count("plant-duplicate-id"), 1);
  EXPECT_EQ(count("material-missing"), 1);
  EXPECT_EQ(find_issue(report, "plant-points")->where, "p.opf:3");
}

TEST(Opf, RefusalsNameThePlace) {
  EXPECT_EQ(refusal("<package/>"), "3: p.opf:1: is not a plant: its outermost element is <package> rather than <opf> or <gwa>");
  EXPECT_EQ(refusal(""), "3: p.opf:1: is not well-formed XML (no element found)");
  EXPECT_EQ(refusal("<opf>\n<meshBDD>"), "3: p.opf:2: is not well-formed XML (no element found)");
  EXPECT_EQ(refusal("<opf>\n</meshBDD>"), "3: p.opf:2: is not well-formed XML (mismatched tag)");
  EXPECT_EQ(refusal("<opf/>"), "3: p.opf: holds no drawable geometry; give a file with faces");
  EXPECT_EQ(refusal(opf(organ("<mat>1 0 0 0\n0 1,5 0</mat>"))), "3: p.opf:7: is not a number (\"1,5\")");
  EXPECT_EQ(refusal(opf("<geometry><shapeIndex>0.5</shapeIndex></geometry>")), "3: p.opf:6: an index is not a whole number (\"0.5\")");
  EXPECT_EQ(refusal("<opf><meshBDD><mesh Id='x'/></meshBDD></opf>"), "3: p.opf:1: an Id is not a whole number (\"x\")");
  EXPECT_EQ(refusal("<!DOCTYPE opf [<!ENTITY a 'aaaa'>]>\n<opf>&a;</opf>"),
            "3: p.opf:1: declares a document type of its own ([...] after DOCTYPE), which is not read; take it out");
  EXPECT_EQ(refusal("<opf><meshBDD><mesh><points>" + std::string(5000, '1') + "</points></mesh></meshBDD></opf>").substr(0, 60),
            "3: p.opf:1: a number of more than 4096 characters (\"11111111");
}

TEST(Opf, NumbersMayBeCutAnywhere) {
  // The parser is fed a mebibyte at a time: the border falls on every place of this text once.
  const std::string plain = opf(organ("<mat>1 0 0 -1.25e1 0 1 0 2 0 0 1 3.5</mat>"));
  const Measures want = measure(read_text(plain).mesh);
  const std::size_t before = plain.find("<opf");
  for (std::size_t at = 0; at + before < plain.size(); at += 7) {
    const std::string text = plain.substr(0, before) + "<!--" + std::string((1 << 20) - before - 7 - at, ' ') + "-->" + plain.substr(before);
    const Measures got = measure(read_text(text).mesh);
    EXPECT_EQ(got.box.min, want.box.min);
    EXPECT_EQ(got.box.max, want.box.max);
  }
}

TEST(Opf, NestsAHundredThousandDeep) {
  std::string text;
  for (int i = 0; i < 100000; ++i) text += "<follow>";
  text += organ("");
  for (int i = 0; i < 100000; ++i) text += "</follow>";
  EXPECT_EQ(read_text(opf(text)).mesh.triangles.size(), 8u);
  std::string deeper;
  for (int i = 0; i < 1100000; ++i) deeper += "<follow>";
  EXPECT_EQ(refusal(opf(deeper)), "3: p.opf:6: elements are nested more than 1048576 deep");
}

TEST(Opf, OrgansThatExplodeAreRefused) {
  std::string faces, organs;
  for (int i = 0; i < 40000; ++i) faces += " 0 1 2";
  for (int i = 0; i < 4000; ++i) organs += "<follow>" + organ("") + "</follow>";
  EXPECT_EQ(refusal(opf(organs, "<meshBDD><mesh Id='7'><points>0 0 0 1 0 0 0 1 0</points><faces>" + faces + "</faces></mesh></meshBDD>" + kShape)),
            "5: p.opf: its organs have more than 2^27 triangles or points together; bake parts of it by themselves");
}

TEST(Opf, ATagWithoutEndIsRefused) {
  EXPECT_EQ(refusal("<opf><!--" + std::string(20 << 20, 'x')), "3: p.opf:1: a single tag or comment takes more than 16 MiB");
}

TEST(Gwa, ColoursAndUnits) {
  Report report;
  const std::string text = "<gwa version='1.0'><attributes><attribute name='Color' class='Color'/></attributes>"
                           "<mesh id='1'><points>0 0 0 100 0 0 0 100 0</points><faces><face>0 1 2</face></faces><Color>Color 255 0 51</Color></mesh>"
                           "<mesh id='2'><points>0 0 1 100 0 1 0 100 1</points><faces><face>0 1 2</face></faces></mesh>"
                           "<mesh id='3'><points>0 0 1 100 0 1 0 100 1</points><faces><face>0 1 2</face></faces><Color>Color 255 0 51</Color></mesh></gwa>";
  const Scene scene = plant_scene(read_opf({text, "g.gwa"}, report), {}, report, "g.gwa");
  EXPECT_EQ(scene.mesh.materials, (std::vector<std::uint32_t>{0, 1, 0}));
  EXPECT_EQ(scene.materials[0].name, "color_ff0033");
  EXPECT_FLOAT_EQ(scene.materials[0].kd.x, 1);
  EXPECT_FLOAT_EQ(scene.materials[0].kd.z, srgb_to_linear(0.2f));
  EXPECT_DOUBLE_EQ(measure(scene.mesh).box.max.x, 1);
}

TEST(Plants, TheSampleIsWhole) {
  Report report;
  const std::string path = std::string(TEXEL_SAMPLES) + "/plant/plant.opf";
  const Scene scene = read_scene(path, report);
  const FileBytes bytes(path);
  const Plant plant = read_opf({bytes.bytes(), path}, report);
  EXPECT_TRUE(report.issues.empty());
  const auto leaves = std::count_if(plant.organs.begin(), plant.organs.end(), [](const PlantOrgan& o) { return o.mesh == 1; });
  EXPECT_EQ(plant.organs.size(), 452u);  // what make.py grows
  EXPECT_EQ(scene.mesh.triangles.size(), 12 * (452 - static_cast<std::size_t>(leaves)) + 10 * static_cast<std::size_t>(leaves));
  Mesh trunk;  // turned outwards
  trunk.points = scene.mesh.points;
  trunk.triangles.assign(scene.mesh.triangles.begin(), scene.mesh.triangles.begin() + 12);
  EXPECT_GT(measure(trunk).volume, 0);
}

TEST(Plants, AUnitScalesMeshesToo) {
  TestFolder folder;
  const std::string path = folder.write("a.obj", "v 0 0 0\nv 100 0 0\nv 0 50 0\nf 1 2 3\n");
  Report report;
  EXPECT_DOUBLE_EQ(measure(read_in(path, 0.01, report).mesh).box.max.x, 1);
  EXPECT_DOUBLE_EQ(measure(read_in(path, 0, report).mesh).box.max.x, 100);
}

TEST(Plants, TheRootDecidesWhatAFileIs) {
  TestFolder folder;
  Report report;
  const std::string path = folder.write("soil.opf", "<gwa><mesh><points>0 0 0 1 0 0 0 1 0</points><faces>0 1 2</faces></mesh></gwa>");
  EXPECT_EQ(read_scene(path, report).mesh.triangles.size(), 1u);
  ASSERT_TRUE(find_issue(report, "wrong-extension"));
}

TEST(Plants, ReadingTellsHowFarItIs) {
  std::string organs;
  for (int i = 0; i < 40000; ++i) organs += "<follow>" + organ("") + "</follow>";
  Report report;
  double last = 0;
  int calls = 0;
  report.progress = [&](const std::string&, double done) {
    ++calls;
    last = done;
    if (calls > 1) throw Error(Code::kRunning, "", "stopped");  // as Ctrl-C does
  };
  EXPECT_EQ(error_of([&] { (void)read_text(opf(organs), report); }), "4: stopped");
  EXPECT_GT(last, 0);
  EXPECT_EQ(calls, 2);
}

TEST(Xml, RootIsFoundBehindWhatMayStandBeforeIt) {
  EXPECT_EQ(xml_root("\xEF\xBB\xBF <?xml version='1.0'?>\n<!-- <gwa> --><!DOCTYPE opf>\n<opf version='2.0'>"), "opf");
  EXPECT_EQ(xml_root("<gwa/>"), "gwa");
  for (const char* none : {"", "opf", "<!-- ", "<?", "< opf>", "v 0 0 0"}) EXPECT_EQ(xml_root(none), "") << none;
}

}  // namespace
}  // namespace texel
