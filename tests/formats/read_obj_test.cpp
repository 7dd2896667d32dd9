#include <cmath>

#include "formats/read.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
const std::string kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

Scene obj(const std::string& text, Report& report, const std::string& path = "nowhere/a.obj") { return read_obj({text, path}, {}, report); }
Scene obj(const std::string& text) {
  Report report;
  return obj(text, report);
}
std::string obj_error(const std::string& text) {
  return error_of([&] { (void)obj(text); });
}

TEST(Obj, CornersInAllSpellings) {
  const std::string head = kSquare + "vt 0.25 0.5\nvt 1 0 0\nvn 0 0 1\n";
  for (const char* face : {"f 1/1/1 2/2/1 3/1/1\n", "f 1/1 2/2 3/1", "f -4/-2/-1 -3/-1/-1 -2/-2/-1 # note", "f\t1/1/\t2/2 \\\n 3/1\r\n", "  f 1/1 2/2 3/1  "}) {
    const Scene s = obj(head + face);
    EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}})) << face;
    EXPECT_EQ(s.mesh.uv_corners, (std::vector<Triangle>{{0, 1, 0}})) << face;
    EXPECT_EQ(s.mesh.uvs, (std::vector<V2f>{{0.25f, 0.5f}, {1, 0}})) << face;
  }
  for (const char* face : {"f 1 2 3", "f 1// 2// 3//", "f 1//1 2//1 3//1", "f +1 +2 +3", "fo 1 2 3"}) {
    const Scene s = obj(head + face);
    EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}})) << face;
    EXPECT_TRUE(s.mesh.uv_corners.empty()) << face;
  }
}

TEST(Obj, LineEndsDoNotMatter) {
  std::string lf = "o a\n" + kSquare + "g x\nf 1 2 \\\n 3 4\nf 1 2 3", crlf, cr;
  for (const char c : lf) {
    crlf += c == '\n' ? "\r\n" : std::string(1, c);
    cr += c == '\n' ? '\r' : c;
  }
  for (const std::string& text : {lf, crlf, cr}) {
    const Scene s = obj(text);
    EXPECT_EQ(s.mesh.points.size(), 4u);
    EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}}));
  }
}

TEST(Obj, UvsOfSomeFacesOnly) {
  const Scene s = obj(kSquare + "vt 0 0\nf 1 2 3\nf 1/1 2/1 3\nf 1 3 4\n");
  EXPECT_EQ(s.mesh.uv_corners, (std::vector<Triangle>{{kNoIndex, kNoIndex, kNoIndex}, {0, 0, kNoIndex}, {kNoIndex, kNoIndex, kNoIndex}}));
}

TEST(Obj, FacesBeforeTheirVertices) {
  Report report;
  const Scene s = obj("f 1/1 2/1 3/2\n" + kSquare + "vt 0 0\nf 1 3 4\nf 1 2 9\n", report);
  EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 2, 3}, {0, 1, 2}}));
  EXPECT_EQ(s.mesh.uv_corners[1], (Triangle{0, 0, kNoIndex}));
  ASSERT_TRUE(find_issue(report, "bad-index"));
  EXPECT_EQ(find_issue(report, "bad-index")->where, "nowhere/a.obj:8");
  EXPECT_TRUE(find_issue(report, "bad-uv-index"));
}

TEST(Obj, BadFacesAreDroppedAndNamed) {
  Report report;
  const Scene s = obj(kSquare + "f 1 2 3\nf 0 1 2\nf 1 2\nf 1 -9 2\nf 1 x 2\nf 1 2 99999999999999999999\n", report);
  EXPECT_EQ(s.mesh.triangles.size(), 1u);
  const Issue* issue = find_issue(report, "bad-index");
  ASSERT_TRUE(issue);
  EXPECT_EQ(issue->count, 5);
  EXPECT_EQ(issue->where, "nowhere/a.obj:6");
  EXPECT_NE(issue->text.find("a vertex index is 0"), std::string::npos) << issue->text;
}

TEST(Obj, NothingToReadSaysWhy) {
  EXPECT_EQ(obj_error(""), "3: nowhere/a.obj: holds no face; give a file with faces");
  EXPECT_EQ(obj_error("f -4 -3 -2"), "3: nowhere/a.obj:1: no face can be used: a vertex index is -4 after 0 vertices; give a file with faces");
  EXPECT_EQ(obj_error(kSquare + "f 1 2\n"), "3: nowhere/a.obj:5: no face can be used: a face has 2 corners; give a file with faces");
  EXPECT_EQ(obj_error(kSquare + "p 1 2\n"), "3: nowhere/a.obj:5: holds only points, curves or lines that are left out, no face; give a file with faces");
  EXPECT_EQ(obj_error("v 0 nan 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            "3: nowhere/a.obj: every face has a vertex that is not a finite number; export the mesh again");
  EXPECT_EQ(obj_error("v 0 0 0\nv 1 a 0\n"), "3: nowhere/a.obj:2: vertex coordinate is not a number (\"a\")");
  EXPECT_EQ(obj_error("v 0 0 0\nv 1 0\n"), "3: nowhere/a.obj:2: vertex coordinate has too few numbers");
}

TEST(Obj, LinesBesideFacesAreFibresUnlessLeftOut) {
  Report report;
  const std::string text = kSquare + "l 1 2\nf 1 2 3\np 1\n";
  const Scene both = obj(text, report);
  EXPECT_EQ(both.mesh.triangles.size(), 1u);
  EXPECT_EQ(both.fibres.strands(), 1u);
  ASSERT_TRUE(find_issue(report, "obj-lines-ignored"));
  EXPECT_EQ(find_issue(report, "obj-lines-ignored")->count, 1);
  Report without;
  EXPECT_EQ(read_obj({text, "a.obj"}, {.radius = 0}, without).fibres.strands(), 0u);
  EXPECT_EQ(find_issue(without, "obj-lines-ignored")->count, 2);
}

TEST(Obj, NonFiniteVerticesLoseTheirFacesOnly) {
  Report report;
  const Scene s = obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 1.#IND 1 0\nv 0 1e999 0\nv 1e200 0 0\nf 1 2 3\nf 2 3 4\nf 5 6 1 2\n", report);
  EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  EXPECT_EQ(s.mesh.materials.size(), 1u);
  for (const V3d& p : s.mesh.points) EXPECT_TRUE(p.x >= 0 && p.x <= 1 && p.y >= 0 && p.y <= 1);
  ASSERT_TRUE(find_issue(report, "non-finite"));
  EXPECT_EQ(find_issue(report, "non-finite")->count, 3);
}

TEST(Obj, VertexColorsBecomeLinearOnce) {
  Report report;
  const Scene s = obj("v 0 0 0 0.5 0 1\nv 1 0 0 1\nv 1 1 0 nan 0 0\nf 1 2 3\n", report);
  ASSERT_EQ(s.mesh.colors.size(), 3u);
  EXPECT_EQ(s.mesh.colors[0], V3f(srgb_to_linear(0.5f), 0, 1));
  EXPECT_NEAR(s.mesh.colors[0].x, 0.21404114, 1e-7);  // IEC 61966-2-1 at 0.5; half a step of a float
  EXPECT_EQ(s.mesh.colors[1], V3f(1, 1, 1));          // one number is a weight
  EXPECT_EQ(s.mesh.colors[2], V3f(1, 1, 1));
  EXPECT_TRUE(find_issue(report, "non-finite-color"));
  EXPECT_EQ(s.materials[0].kd, V3f(1, 1, 1));         // kd multiplies
}

TEST(Obj, VertexColorsOf255) {
  Report report;
  const Scene s = obj("v 0 0 0 255 0 51\nv 1 0 0 0 0 0\nv 1 1 0 1 1 1\nf 1 2 3\n", report);
  EXPECT_EQ(s.mesh.colors[0], V3f(1, 0, srgb_to_linear(0.2f)));
  EXPECT_EQ(s.mesh.colors[2].x, srgb_to_linear(1.0f / 255));
  EXPECT_TRUE(find_issue(report, "vertex-colors-255"));
}

TEST(Obj, MaterialsByFirstUse) {
  const TestFolder folder;
  folder.write("my lib.mtl", "newmtl never\nKd 0 0 0\nnewmtl red one\nKd 1 0 0\n");
  folder.write("b.mtl", "newmtl blue\nKd 0 0 1\nnewmtl red one\nKd 9 9 9\n");
  const std::string path = folder.write("a.obj", kSquare + "f 1 2 3\nusemtl blue\nf 1 2 3\nusemtl red one \nf 1 2 3\nusemtl none\nf 1 2 3\n"
                                                           "usemtl blue\nf 1 2 3\nmtllib my lib.mtl\nmtllib gone.mtl b.mtl\n");
  Report report;
  const Scene s = read_scene(path, report);
  ASSERT_EQ(s.materials.size(), 4u);
  EXPECT_EQ(s.materials[0].name, "default");
  EXPECT_EQ(s.materials[1].kd, V3f(0, 0, 1));
  EXPECT_EQ(s.materials[2].kd, V3f(1, 0, 0)) << "the first definition counts";
  EXPECT_EQ(s.materials[3].kd, V3f(0.5f, 0.5f, 0.5f));
  EXPECT_EQ(s.mesh.materials, (std::vector<std::uint32_t>{0, 1, 2, 3, 1}));
  EXPECT_TRUE(find_issue(report, "mtl-missing"));
  EXPECT_TRUE(find_issue(report, "material-missing"));
  ASSERT_EQ(s.sources.size(), 3u);
  EXPECT_EQ(s.sources[0].path, path);
  EXPECT_EQ(s.sources[1].path, folder.file("my lib.mtl"));
  EXPECT_EQ(s.sources[2].path, folder.file("b.mtl"));
}

TEST(Obj, LibraryNamesOfOtherSystems) {
  const TestFolder folder;
  folder.write("sub/A.MTL", "newmtl m\nKd 0 1 0\n");
  for (const char* name : {"sub\\A.MTL", "sub/a.mtl", "./sub\\a.Mtl", "C:\\work\\sub\\A.MTL", "\\\\host\\A.mtl"}) {
    const bool beside = std::string(name).find("sub") == std::string::npos || name[0] == 'C';
    const std::string path = folder.write(beside ? "sub/a.obj" : "a.obj", "mtllib " + std::string(name) + "\n" + kSquare + "usemtl m\nf 1 2 3\n");
    Report report;
    EXPECT_EQ(read_scene(path, report).materials[0].kd, V3f(0, 1, 0)) << name;
    EXPECT_TRUE(report.issues.empty()) << name;
  }
}

TEST(Obj, PolygonsAreCutInTheirPlane) {
  Report report;
  // Scaled rounding: areas of order 1.
  EXPECT_NEAR(measure(obj("v 0 0 5\nv 4 0 5\nv 1 1 5\nv 0 4 5\nf 2 3 4 1\n", report).mesh).area, 4, 1e-12);
  EXPECT_TRUE(report.issues.empty());
  EXPECT_EQ(obj(kSquare + "f 1 3 2 4\n", report).mesh.triangles, (std::vector<Triangle>{{0, 2, 1}, {0, 1, 3}}));
  EXPECT_TRUE(find_issue(report, "polygon-not-simple"));
}

}  // namespace
}  // namespace texel
