// Lines and curves: OBJ, HAIR, Embree's XML.
#include <cstring>

#include "formats/fibres.h"
#include "formats/read.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

template <class T>
void put(std::string& to, T value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct HairHead {
  std::uint32_t strands = 0, points = 0, flags = 2, segments = 0;
  float thickness = 1, transparency = 0, color[3] = {1, 1, 1};
};
std::string hair(const HairHead& head) {
  std::string s = "HAIR";
  for (const std::uint32_t v : {head.strands, head.points, head.flags, head.segments}) put(s, v);
  for (const float v : {head.thickness, head.transparency, head.color[0], head.color[1], head.color[2]}) put(s, v);
  s.resize(128, '\0');
  return s;
}
void put_points(std::string& s, int count) {
  for (int i = 0; i < count; ++i)
    for (const float v : {static_cast<float>(i), static_cast<float>(i * i), 0.5f}) put(s, v);
}

TEST(Hair, DefaultsAndOneLength) {
  std::string s = hair({.strands = 2, .points = 6, .flags = 2, .segments = 2, .thickness = 0.5f, .transparency = 0.25f, .color = {1, 0, 0}});
  put_points(s, 6);
  Report report;
  const Scene scene = read_hair({s, "a.hair"}, report);
  EXPECT_TRUE(report.issues.empty());
  ASSERT_EQ(scene.fibres.strands(), 2u);
  EXPECT_EQ(scene.fibres.first, (std::vector<std::size_t>{0, 3, 6}));
  EXPECT_EQ(scene.fibres.points[4], V3d(4, 16, 0.5));
  EXPECT_EQ(scene.fibres.radii, std::vector<double>(6, 0.25));  // thickness is a diameter
  EXPECT_TRUE(scene.fibres.colors.empty());
  ASSERT_EQ(scene.materials.size(), 1u);
  EXPECT_EQ(scene.materials[0].kd, V3f(1, 0, 0));
  EXPECT_FLOAT_EQ(scene.materials[0].opacity, 0.75f);
}

TEST(Hair, EveryArray) {
  std::string s = hair({.strands = 2, .points = 5, .flags = 31});
  put(s, std::uint16_t{2});
  put(s, std::uint16_t{1});
  put_points(s, 5);
  for (int i = 0; i < 5; ++i) put(s, 0.2f * static_cast<float>(i + 1));
  for (int i = 0; i < 5; ++i) put(s, 0.5f);
  for (int i = 0; i < 5; ++i)
    for (const float v : {0.0f, 1.0f, i == 2 ? std::nanf("") : 0.0f}) put(s, v);
  Report report;
  const Scene scene = read_hair({s, "a.hair"}, report);
  EXPECT_EQ(scene.fibres.first, (std::vector<std::size_t>{0, 3, 5}));
  EXPECT_FLOAT_EQ(static_cast<float>(scene.fibres.radii[4]), 0.5f);
  EXPECT_EQ(scene.fibres.colors[0], V3f(0, 1, 0));
  EXPECT_EQ(scene.fibres.colors[2], V3f(1, 1, 1));
  EXPECT_EQ(find_issue(report, "non-finite-color")->count, 1);
  EXPECT_TRUE(find_issue(report, "hair-transparency"));
  EXPECT_FLOAT_EQ(scene.materials[0].opacity, 0.5f);
}

TEST(Hair, BadFiles) {
  const auto error = [](const std::string& s) {
    Report report;
    return error_of([&] { (void)read_hair({s, "a.hair"}, report); });
  };
  EXPECT_EQ(error("HAIRY"), "3: a.hair: ends within its header, after 5 of 128 bytes; write the file again");
  EXPECT_EQ(error("no"), "3: a.hair: is no HAIR file: it does not begin with HAIR");
  EXPECT_EQ(error(hair({.flags = 1})), "3: a.hair: has no array of points; write the file again");
  EXPECT_EQ(error(hair({.strands = 0xffffffffu, .points = 0xffffffffu, .flags = 31, .segments = 0xffffffffu})),
            "3: a.hair: ends after 128 bytes; 4294967295 strands of 4294967295 points take 146028888158; write the file again");
  std::string s = hair({.strands = 0xffffffffu, .points = 2, .segments = 0xffffffffu});
  put_points(s, 2);
  EXPECT_EQ(error(s), "3: a.hair: its 4294967295 strands need 18446744069414584320 points, and it has 2; write the file again");
  s = hair({.strands = 1, .points = 2, .segments = 1, .thickness = 0});
  put_points(s, 2);
  EXPECT_EQ(error(s), "3: a.hair: every fibre's radius is 0; give a file with strands");
}

TEST(Lines, AreFibres) {
  Report report;
  const std::string text = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nusemtl a\nl 1 2 3\nl -1 -2/7\nl 4 4\nl 5 9\nl 1\n";
  const Scene scene = read_obj({text, "a.obj"}, {.radius = 0.125}, report);
  EXPECT_TRUE(scene.mesh.triangles.empty());
  ASSERT_EQ(scene.fibres.strands(), 2u);
  EXPECT_EQ(scene.fibres.first, (std::vector<std::size_t>{0, 3, 5}));
  EXPECT_EQ(scene.fibres.points[3], V3d(0, 1, 0));
  EXPECT_EQ(scene.fibres.radii[0], 0.125);
  EXPECT_EQ(scene.fibres.colors[1], V3f(0, 1, 0));
  EXPECT_EQ(find_issue(report, "fibre-degenerate")->count, 1);
  EXPECT_EQ(find_issue(report, "bad-index")->count, 2);
  EXPECT_FALSE(find_issue(report, "line-radius"));
}

TEST(Lines, HaveARadiusOfTheirOwnWhereNoneIsGiven) {
  Report report;
  const Scene scene = read_obj({std::string_view("v 0 0 0\nv 3 4 0\nl 1 2\n"), "a.obj"}, {}, report);
  EXPECT_DOUBLE_EQ(scene.fibres.radii[0], 5.0 / 2000);
  EXPECT_EQ(find_issue(report, "line-radius")->count, 1);
  Report left_out;
  EXPECT_EQ(error_of([&] { (void)read_obj({std::string_view("v 0 0 0\nv 3 4 0\nl 1 2\n"), "a.obj"}, {.radius = 0}, left_out); }),
            "3: a.obj:3: holds only points, curves or lines that are left out, no face; give a file with faces");
}

TEST(Lines, AloneInAFile) {
  const std::string path = std::string(TEXEL_SHARED_DATA) + "/dirty/obj_syntax/line-prim.obj";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "not there: " << path;
  Report report;
  const Scene scene = read_scene(path, report);
  EXPECT_TRUE(scene.mesh.triangles.empty());
  EXPECT_GT(scene.fibres.strands(), 0u);
  EXPECT_TRUE(find_issue(report, "line-radius"));
}

// Position and radius of a cubic within the stated error.
TEST(Curves, BezierWithinTheTolerance) {
  const std::array<FibrePoint, 4> c{{{V3d(0, 0, 0), 0.1}, {V3d(3, 1, 0), 0.4}, {V3d(-2, 1, 1), 0}, {V3d(1, 0, 2), 0.2}}};
  for (const double tolerance : {0.1, 1e-2, 1e-3}) {
    std::vector<FibrePoint> cut{c[0]};
    add_bezier(c, tolerance, cut);
    double worst = 0;
    const auto steps = static_cast<double>(cut.size() - 1);
    for (int k = 0; k <= 2000; ++k) {
      const double t = k / 2000.0, s = 1 - t, w[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
      V3d p(0, 0, 0);
      for (std::size_t i = 0; i < 4; ++i) p += c[i].at * w[i];
      const auto i = std::min(cut.size() - 2, static_cast<std::size_t>(t * steps));
      const double f = t * steps - static_cast<double>(i);
      worst = std::max(worst, (cut[i].at * (1 - f) + cut[i + 1].at * f - p).length());
    }
    EXPECT_LE(worst, tolerance);
    EXPECT_GE(worst, tolerance / 8);  // no more pieces than it takes
    EXPECT_EQ(cut.back().at, c[3].at);
  }
}

TEST(Curves, EmbreeScene) {
  Report report;
  const std::string text = R"(<?xml version="1.0"?><scene>
<assign type="material" id="m1"><material><code>"OBJ"</code><parameters><float3 name="Kd">0.25 0.5 1</float3></parameters></material></assign>
<Transform><AffineSpace>2 0 0 10 0 2 0 0 0 0 2 0</AffineSpace>
 <Curves type="round" basis="linear"><material id="m1"/><positions>0 0 0 .1  1 0 0 .2  1 1 0 .3 9 9 9 1</positions><indices>0 1 7</indices></Curves>
</Transform>
<BezierCurves><positions>0 0 0 .1  1 0 0 .1  2 0 0 .1  3 0 0 .1  4 1 0 .1 5 2 0 .1 6 2 0 .1</positions><indices>0 0 3 1</indices></BezierCurves>
<BSplineHair><positions>0 0 0 .1  1 0 0 .1  2 0 0 .1  3 0 0 .1</positions><indices>0</indices></BSplineHair>
<TriangleMesh/></scene>)";
  const Scene scene = read_curves({text, "a.xml"}, report);
  ASSERT_EQ(scene.fibres.strands(), 3u);
  EXPECT_EQ(scene.fibres.first[1], 3u);
  EXPECT_EQ(scene.fibres.points[2], V3d(12, 2, 0));
  EXPECT_DOUBLE_EQ(scene.fibres.radii[2], 0.6);
  EXPECT_EQ(scene.materials[scene.fibres.materials[0]].kd, V3f(0.25f, 0.5f, 1));
  EXPECT_EQ(scene.fibres.points[scene.fibres.first[2] - 1], V3d(6, 2, 0));  // two curves in one strand
  EXPECT_NEAR(scene.fibres.points[scene.fibres.first[2]].x, 1, 1e-15);      // a B-spline begins at its second point here
  EXPECT_NEAR(scene.fibres.points.back().x, 2, 1e-15);
  EXPECT_EQ(find_issue(report, "bad-index")->count, 1);
  EXPECT_EQ(find_issue(report, "curves-flat")->count, 1);
  EXPECT_EQ(find_issue(report, "xml-ignored")->count, 1);
}

// Every point that comes out lies on the curve as Embree evaluates it, at its parameter, with its radius: to rounding. The number of pieces is what the
// tolerance asks for, so the points' parameters are known.
TEST(Curves, HermiteAndCatmullRomAreExact) {
  // (x y z radius) of five points; tangents of the Hermite ones.
  const std::vector<std::array<double, 4>> p{{0, 0, 0, 0.125}, {1, 2, 0, 0.25}, {3, 1, 1, 0.5}, {4, 0, -1, 0.25}, {2, -1, 0, 0.375}};
  const std::vector<std::array<double, 4>> t{{1, 3, 0, 0.5}, {2, -1, 2, 0}, {-1, -2, 1, -0.25}, {0, 0, -3, 0.125}, {-2, 1, 0, 0}};
  const auto list = [](const std::vector<std::array<double, 4>>& rows) {
    std::string text;
    for (const auto& row : rows)
      for (const double v : row) text += std::to_string(v) + " ";
    return text;
  };
  // Of segment i at u. Hermite: the cubic with these ends and derivatives. Catmull-Rom: Embree's weights (CatmullRomBasis::eval).
  const auto hermite = [&](std::size_t i, double u, std::size_t k) {
    const double u2 = u * u, u3 = u2 * u;
    return p[i][k] * (2 * u3 - 3 * u2 + 1) + t[i][k] * (u3 - 2 * u2 + u) + p[i + 1][k] * (3 * u2 - 2 * u3) + t[i + 1][k] * (u3 - u2);
  };
  const auto catmull_rom = [&](std::size_t i, double u, std::size_t k) {
    const double s = 1 - u;
    return 0.5 * (-u * s * s * p[i][k] + (2 + u * u * (3 * u - 5)) * p[i + 1][k] + (2 + s * s * (3 * s - 5)) * p[i + 2][k] - s * u * u * p[i + 3][k]);
  };
  const auto check = [&](const std::string& basis, std::size_t segments, const auto& curve) {
    std::string indices;
    for (std::size_t i = 0; i < segments; ++i) indices += std::to_string(i) + " ";
    const std::string text = "<scene><Curves type=\"round\" basis=\"" + basis + "\"><positions>" + list(p) + "</positions><tangents>" + list(t) + "</tangents><indices>" + indices + "</indices></Curves></scene>";
    Report report;
    const Fibres f = read_curves({text, "a.xml"}, report).fibres;
    EXPECT_TRUE(report.issues.empty());
    ASSERT_EQ(f.strands(), 1u) << "neighbours go on from each other";
    // Segments begin where their curve does; between, the parameter goes in equal steps.
    std::size_t at = 0;
    for (std::size_t i = 0; i < segments; ++i) {
      std::size_t end = at + 1;
      const auto is_end = [&](std::size_t k) { return (f.points[k] - V3d(curve(i, 1, 0), curve(i, 1, 1), curve(i, 1, 2))).length() < 1e-12; };
      while (end < f.points.size() && !is_end(end)) ++end;
      ASSERT_LT(end, f.points.size());
      ASSERT_GT(end - at, 20u);
      for (std::size_t k = at; k <= end; ++k) {
        const double u = static_cast<double>(k - at) / static_cast<double>(end - at);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(f.points[k][c], curve(i, u, static_cast<std::size_t>(c)), 1e-14);  // a few roundings of numbers up to 8
        EXPECT_NEAR(f.radii[k], curve(i, u, 3), 1e-14);
      }
      at = end;
    }
    EXPECT_EQ(at + 1, f.points.size());
  };
  check("hermite", 4, hermite);
  check("catmull_rom", 2, catmull_rom);
}

TEST(Curves, SegmentsOfAllNames) {
  for (const std::string name : {"LineSegments", "RoundLineSegments", "ConeSegments"}) {
    Report report;
    const Scene scene = read_curves({"<scene><" + name + "><positions>0 0 0 1 1 0 0 1</positions><indices>0</indices></" + name + "></scene>", "a.xml"}, report);
    EXPECT_EQ(scene.fibres.points.size(), 2u);
    EXPECT_EQ(find_issue(report, "curves-flat") != nullptr, name == "LineSegments");
  }
}

TEST(Curves, BadFiles) {
  const auto error = [](const std::string& s) {
    Report report;
    return error_of([&] { (void)read_curves({s, "a.xml"}, report); });
  };
  EXPECT_EQ(error("<svg/>"), "3: a.xml:1: is no scene of curves: its outermost element is <svg> rather than <scene>");
  EXPECT_EQ(error("<scene/>"), "3: a.xml: holds no fibre; give a file with curves");
  EXPECT_EQ(error("<scene><Curves basis=\"nurbs\"/></scene>"), "5: a.xml:1: curves of the basis \"nurbs\" are not read; use linear, bezier, bspline, hermite or catmull_rom");
  EXPECT_EQ(error("<scene><BezierCurves><positions>1 2 x</positions></BezierCurves></scene>"), "3: a.xml:1: not a number (\"x\")");
  EXPECT_EQ(error("<scene><BezierCurves><positions>1 2 3</positions></BezierCurves></scene>"), "3: a.xml:1: its 3 positions are not x y z radius each");
  EXPECT_EQ(error("<scene><Curves basis=\"hermite\"><positions>0 0 0 1 1 0 0 1</positions><tangents>1 0 0 0</tangents><indices>0</indices></Curves></scene>"),
            "3: a.xml:1: curves of the basis \"hermite\" with 8 numbers for positions and 4 for tangents; give a tangent x y z radius for each position");
  EXPECT_EQ(error("<scene><Curves basis=\"linear\">\n<positions ofs=\"0\" size=\"9\"/></Curves></scene>"),
            "5: a.xml:2: the numbers of <positions> are in a .bin file, which is not read; write the scene with its numbers in the XML");
  EXPECT_EQ(error("<scene><FurBall radius=\"-1\"/></scene>"), "3: a.xml:1: a FurBall without a radius above 0");
  EXPECT_EQ(error("<scene><Transform><AffineSpace>1 2</AffineSpace></Transform></scene>"), "3: a.xml:1: an AffineSpace is not twelve finite numbers");
}

TEST(Curves, FurBalls) {
  const std::string path = std::string(TEXEL_SHARED_DATA) + "/models/hair/furball_bezier_round.xml";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "not there: " << path;
  Report report;
  const Scene scene = read_scene(path, report);
  EXPECT_EQ(find_issue(report, "furball-made")->count, 140);
  EXPECT_EQ(scene.fibres.strands(), 140u * 400);
}

TEST(Fibres, JoinAndScale) {
  const TestFolder folder;
  const std::string lines = folder.write("a.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"), mesh = folder.write("b.obj", "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\nl 1 3\n");
  Report report;
  ReadOptions options;
  options.fibres.radius = 0.5;
  options.plants.unit = 0.01;
  const std::vector<std::string> paths{lines, mesh};
  const Scene scene = read_scene(paths, options, report);
  EXPECT_EQ(scene.mesh.triangles.size(), 1u);
  ASSERT_EQ(scene.fibres.strands(), 2u);
  EXPECT_EQ(scene.fibres.radii[3], 0.005);
  EXPECT_EQ(scene.fibres.colors.size(), 4u);
  EXPECT_EQ(scene.fibres.materials[1], 1u);
}

}  // namespace
}  // namespace texel
