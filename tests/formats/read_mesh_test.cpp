// PLY, STL and OFF from bytes; dispatch and joining.
#include <cmath>
#include <cstring>

#include "formats/read.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

// Bytes of numbers in either order.
struct Bytes {
  std::string text;
  bool big = false;
  template <class T>
  Bytes& put(T value) {
    char b[sizeof(T)];
    std::memcpy(b, &value, sizeof(T));
    if (big) std::reverse(b, b + sizeof(T));
    text.append(b, sizeof(T));
    return *this;
  }
};

template <class Reader>
std::string reader_error(Reader reader, const std::string& text) {
  return error_of([&] {
    Report report;
    (void)reader({text, "f"}, report);
  });
}

Scene ply(const std::string& text) {
  Report report;
  return read_ply({text, "f.ply"}, report);
}
Scene off(const std::string& text) {
  Report report;
  return read_off({text, "f.off"}, report);
}
Scene stl(const std::string& text) {
  Report report;
  return read_stl({text, "f.stl"}, report);
}

const char* kPlyHead = "element vertex 3\nproperty double y\nproperty uchar red\nproperty list uint16 short extra\nproperty uchar green\nproperty uchar blue\n"
                       "property float x\nproperty int z\nproperty float s\nproperty float t\nelement odd 2\nproperty list char float q\nproperty ushort w\n"
                       "element face 2\nproperty char flag\nproperty list uchar uint vertex_index\nend_header\n";

void check_ply(const Scene& s) {
  ASSERT_EQ(s.mesh.points, (std::vector<V3d>{{0, 0, -7}, {1, 0, 0}, {0, 1.5, 0}}));
  EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 0}}));
  EXPECT_EQ(s.mesh.colors[1], V3f(1, 0, srgb_to_linear(0.2f)));
  EXPECT_EQ(s.mesh.uvs[2], V2f(0.5f, 0.25f));
  EXPECT_EQ(s.mesh.uv_corners, s.mesh.triangles);
}

TEST(Ply, AnyOrderAndTypesInThreeCodings) {
  check_ply(ply(std::string("ply\r\nformat ascii 1.0\r\ncomment element\r\nobj_info x\r\n") + kPlyHead +
                "0 0 1 9 0 0 0 -7 0 0\n0 255 0 0 51 1 0 0 0\n1.5 0 0 0 0 0 0 .5 .25\n2 1 2 3\n0 4\n-1 3 0 1 2\n\n5 3 2 1 0"));
  for (const bool big : {false, true}) {
    Bytes b{std::string("ply\nformat binary_") + (big ? "big" : "little") + "_endian 1.0\n" + kPlyHead, big};
    const double y[] = {0, 0, 1.5};
    const float x[] = {0, 1, 0};
    for (int i = 0; i < 3; ++i) {
      b.put(y[i]).put<std::uint8_t>(i == 1 ? 255 : 0).put<std::uint16_t>(static_cast<std::uint16_t>(i));
      for (int k = 0; k < i; ++k) b.put<std::int16_t>(-3);
      b.put<std::uint8_t>(0).put<std::uint8_t>(i == 1 ? 51 : 0).put(x[i]).put<std::int32_t>(i == 0 ? -7 : 0).put(i == 2 ? 0.5f : 0.f).put(i == 2 ? 0.25f : 0.f);
    }
    b.put<std::int8_t>(2).put(1.f).put(2.f).put<std::uint16_t>(3).put<std::int8_t>(0).put<std::uint16_t>(4);
    b.put<std::int8_t>(-1).put<std::uint8_t>(3).put(0u).put(1u).put(2u);
    b.put<std::int8_t>(5).put<std::uint8_t>(3).put(2u).put(1u).put(0u);
    check_ply(ply(b.text));
    // Cut anywhere it is an error, never less than all.
    for (std::size_t cut = 0; cut < b.text.size(); ++cut) EXPECT_FALSE(reader_error(read_ply, b.text.substr(0, cut)).empty()) << cut;
  }
}

const std::string kPlyTriangle = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";

TEST(Ply, FaceColorsBecomeMaterials) {
  const Scene s = ply(kPlyTriangle + "element face 3\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
                                     "0 0 0 1 0 0 0 1 0 3 0 1 2 255 0 0 3 0 1 2 0 0 255 3 0 1 2 255 0 0\n");
  ASSERT_EQ(s.materials.size(), 2u);
  EXPECT_EQ(s.materials[0].kd, V3f(1, 0, 0));
  EXPECT_EQ(s.materials[1].name, "color_0000ff");
  EXPECT_EQ(s.mesh.materials, (std::vector<std::uint32_t>{0, 1, 0}));
}

TEST(Ply, TexturePerCorner) {
  const TestFolder folder;
  folder.write("a b.png", "");
  std::string text = kPlyTriangle + "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
                                    "0 0 0 1 0 0 0 1 0\n3 0 1 2 6 0 0 1 0 1 1\n3 0 1 2 0\n";
  text.insert(4, "comment TextureFile a b.png\n");
  Report report;
  const Scene s = read_scene(folder.write("a.ply", text), report);
  ASSERT_EQ(s.textures.size(), 1u);
  EXPECT_EQ(s.materials.at(0).map_kd.texture, 0);
  EXPECT_EQ(s.materials[0].kd, V3f(1, 1, 1));
  EXPECT_EQ(s.mesh.uv_corners, (std::vector<Triangle>{{0, 1, 2}, {kNoIndex, kNoIndex, kNoIndex}}));
  EXPECT_EQ(s.mesh.uvs[2], V2f(1, 1));
}

TEST(Ply, Refusals) {
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  EXPECT_EQ(reader_error(read_ply, "plx\n"), "3: f:1: is not a PLY file");
  EXPECT_EQ(reader_error(read_ply, kPlyTriangle + faces + "0 0 0 1 0 0 0 1 0\n3 0 1 7\n"), "3: f:11: no face can be used: a vertex index is 7 of 3 vertices; give a file with faces");
  EXPECT_EQ(reader_error(read_ply, kPlyTriangle + faces + "0 0 0\n1 0 x\n0 1 0\n3 0 1 7\n"), "3: f:11: value is not a number (\"x\")");
  EXPECT_NE(reader_error(read_ply, "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\n" + faces).find("more than the rest"), std::string::npos);
  EXPECT_EQ(reader_error(read_ply, kPlyTriangle + "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0 1 0 0 0 1 0 3 0 1 2\n").substr(0, 2), "5:");
  EXPECT_NE(reader_error(read_ply, kPlyTriangle + "end_header\n0 0 0\n1 0 0\n0 1 0\n").find("has no face element"), std::string::npos);
  EXPECT_NE(reader_error(read_ply, kPlyTriangle + faces + "0 0 0 1 0 0 0 1 0\n-1\n").find("impossible"), std::string::npos);
}

const std::string kFacet = "facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1 -0 0\n vertex 0 1e0 -0.0\n endloop\nendfacet\n";

TEST(Stl, AsciiOfSeveralSolids) {
  for (const std::string& text : {"solid facet vertex\n" + kFacet + "endsolid facet\nsolid\n" + kFacet + "endsolid\n",
                                  "SOLID X\r" + kFacet + "ENDSOLID\r  solid y\r" + kFacet}) {
    const Scene s = stl(text);
    EXPECT_EQ(s.mesh.points, (std::vector<V3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})) << "welded, -0 being 0";
    EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 2}}));
  }
}

std::string binary_stl(const std::string& head, std::uint32_t stated, int held) {
  Bytes b{head};
  b.text.resize(80, ' ');
  b.put(stated);
  for (int i = 0; i < held; ++i) {
    for (int k = 0; k < 3; ++k) b.put(0.f);
    for (const float v : {0.f, 0.f, 0.f, 1.f, -0.f, 0.f, 0.f, static_cast<float>(i + 1), 0.f}) b.put(v);
    b.put<std::uint16_t>(0xffff);
  }
  return b.text;
}

TEST(Stl, BinaryWhateverItsHeader) {
  for (const char* head : {"", "solid facet normal", "COLOR="}) {
    const Scene s = stl(binary_stl(head, 2, 2));
    EXPECT_EQ(s.mesh.points, (std::vector<V3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 2, 0}})) << head;
    EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 1, 3}}));
  }
  Report report;
  EXPECT_EQ(read_stl({binary_stl("x", 1, 2), "f"}, report).mesh.triangles.size(), 1u);
  EXPECT_TRUE(find_issue(report, "stl-trailing-bytes"));
  EXPECT_EQ(reader_error(read_stl, binary_stl("x", 3000000000u, 2)), "3: f: states 3000000000 facets and holds 2; copy or export the file again");
  EXPECT_EQ(reader_error(read_stl, "abc"), "3: f: is no STL file: neither ASCII nor long enough for binary (3 bytes)");
}

TEST(Stl, BadFacets) {
  Report report;
  EXPECT_EQ(read_stl({"solid\n" + kFacet + "facet\nvertex 0 0 0\nendfacet\nendsolid", "f"}, report).mesh.triangles.size(), 1u);
  ASSERT_TRUE(find_issue(report, "bad-index"));
  EXPECT_EQ(find_issue(report, "bad-index")->where, "f:9");
  EXPECT_EQ(reader_error(read_stl, "solid a\nfacet\nvertex 0 0 b"), "3: f:3: vertex coordinate is not a number (\"b\")");
  EXPECT_EQ(reader_error(read_stl, "solid a\nendsolid"), "3: f: holds no facet; give a file with faces");
}

TEST(Off, HeadersAndComments) {
  const std::string body = "3 1 0\n0 0 0\n1 0 0 # c\n\n0 1 0\n3 0 1 2\n";
  for (const std::string& text : std::vector<std::string>{"OFF\n" + body, "OFF " + body, "# a\n\nOFF # b\n" + body, body, "OFF\r\n3 1\r\n0 0 0 1 0 0 0 1 0 3 0 1 2"}) {
    const Scene s = off(text);
    EXPECT_EQ(s.mesh.points, (std::vector<V3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}})) << text;
    EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  }
  const Scene n = off("NOFF\n3 1 0\n0 0 0 9 9 9\n1 0 0 9 9 9\n0 1 0 9 9 9\n3 0 1 2\n");
  EXPECT_EQ(n.mesh.points[2], V3d(0, 1, 0));
  const Scene all = off("STCNOFF\n3 1 0\n0 0 0 0 0 1 255 0 51 1 0 0\n1 0 0 0 0 1 0 0 0 1 1 0\n0 1 0 0 0 1 0 0 0 1 0 0.5\n3 0 1 2\n");
  EXPECT_EQ(all.mesh.colors[0].x, 1);
  EXPECT_EQ(all.mesh.uvs, (std::vector<V2f>{{0, 0}, {1, 0}, {0, 0.5f}}));
  EXPECT_EQ(all.mesh.uv_corners, all.mesh.triangles);
}

TEST(Off, Colors) {
  for (const char* color : {"255 0 51", "255 0 51 255", "1.0 0.0 0.2", "1.0 0.0 0.2 1.0"}) {
    const std::string c = std::string(" ") + color;
    const Scene v = off("COFF\n3 1 0\n0 0 0" + c + "\n1 0 0" + c + "\n0 1 0" + c + "\n3 0 1 2\n");
    EXPECT_EQ(v.mesh.colors, std::vector<V3f>(3, V3f(1, 0, srgb_to_linear(0.2f)))) << color;
    EXPECT_EQ(v.materials[0].kd, V3f(1, 1, 1));
    const Scene f = off("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2" + c + "\n3 2 1 0 7\n");
    EXPECT_EQ(f.materials.at(f.mesh.materials[0]).kd, V3f(1, 0, srgb_to_linear(0.2f))) << color;
    EXPECT_EQ(f.materials.at(f.mesh.materials[1]).name, "default") << "an index into a palette that isn't there";
  }
}

TEST(Off, Binary) {
  Bytes b{"COFF BINARY\n", true};
  b.put(3).put(1).put(0);
  for (const float v : {0.f, 0.f, 0.f, 1.f, 0.f, 0.2f, 1.f, 1.f, 0.f, 0.f, 0.f, 0.f, 0.f, 1.f, 0.f, 1.f, 0.f, 0.f, 0.f, 0.f, 1.f}) b.put(v);
  b.put(3).put(0).put(1).put(2).put(0);
  const Scene s = off(b.text);
  EXPECT_EQ(s.mesh.points[1], V3d(1, 0, 0));
  EXPECT_EQ(s.mesh.colors[0], V3f(1, 0, srgb_to_linear(0.2f)));
  EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  for (std::size_t cut = 0; cut < b.text.size(); ++cut) EXPECT_FALSE(reader_error(read_off, b.text.substr(0, cut)).empty()) << cut;
}

TEST(Off, Refusals) {
  EXPECT_EQ(reader_error(read_off, "OFF\n3 1 0\n0 0 0\n1 0 0\n"), "3: f:5: ends where a coordinate is expected");
  EXPECT_EQ(reader_error(read_off, "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"), "3: f:6: no face can be used: a vertex index is 3 of 3 vertices; give a file with faces");
  EXPECT_EQ(reader_error(read_off, "4OFF\n1 0 0\n").substr(0, 2), "5:");
  EXPECT_NE(reader_error(read_off, "OFF\n2000000000 1 0\n0 0 0\n").find("more than the file can hold"), std::string::npos);
  EXPECT_EQ(reader_error(read_off, "hello"), "3: f:1: is not an OFF file: begins with \"hello\"");
}

TEST(Read, ByExtensionAndContent) {
  const TestFolder folder;
  const std::string text = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  Report report;
  EXPECT_EQ(read_scene(folder.write("a.OFF", text), report).mesh.triangles.size(), 1u);
  EXPECT_TRUE(report.issues.empty());
  EXPECT_EQ(read_scene(folder.write("a.obj", text), report).mesh.triangles.size(), 1u);
  EXPECT_TRUE(find_issue(report, "wrong-extension"));
  report = {};
  EXPECT_EQ(read_scene(folder.write("b.obj", binary_stl("solid", 2, 2)), report).mesh.triangles.size(), 2u);
  EXPECT_EQ(read_scene(folder.write("c.stl", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), report = {}).mesh.triangles.size(), 1u);
  for (const char* name : {"a.fbx", "a.xyz", "a"}) {
    const std::string path = folder.write(name, "x");
    const std::string error = error_of([&] { (void)read_scene(path, report); });
    EXPECT_EQ(error.substr(0, 3 + path.size()), "5: " + path);
    EXPECT_NE(error.find(".obj, .ply, .stl, .off"), std::string::npos) << error;
  }
  EXPECT_EQ(error_of([&] { (void)read_scene(folder.file("none.obj"), report); }).substr(0, 2), "2:");
}

TEST(Read, SeveralInputsJoined) {
  const TestFolder folder;
  folder.write("t.png", "");
  folder.write("m.mtl", "newmtl m\nmap_Kd t.png\n");
  const std::vector<std::string> paths = {
      folder.write("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
      folder.write("b.obj", "mtllib m.mtl\nv 5 0 0 1 0 0\nv 6 0 0 1 0 0\nv 5 1 0 1 0 0\nvt 0 1\nusemtl m\nf 1/1 2/1 3/1\n"),
      folder.write("c.obj", "mtllib m.mtl\nv 8 0 0\nv 9 0 0\nv 8 1 0\nvt 1 1\nf 3 2 1\nusemtl m\nf 1/1 2/1 3/1\n")};
  Report report;
  const Scene s = read_scene(paths, report);
  EXPECT_EQ(s.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}, {8, 7, 6}, {6, 7, 8}}));
  EXPECT_EQ(s.mesh.uv_corners, (std::vector<Triangle>{{kNoIndex, kNoIndex, kNoIndex}, {0, 0, 0}, {kNoIndex, kNoIndex, kNoIndex}, {1, 1, 1}}));
  ASSERT_EQ(s.mesh.colors.size(), 9u);
  EXPECT_EQ(s.mesh.colors[0], V3f(1, 1, 1));
  EXPECT_EQ(s.mesh.colors[3], V3f(1, 0, 0));
  EXPECT_EQ(s.mesh.materials, (std::vector<std::uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(s.materials.size(), 4u);
  ASSERT_EQ(s.textures.size(), 1u) << "the same picture is entered once";
  EXPECT_EQ(s.materials[3].map_kd.texture, 0);
  EXPECT_EQ(s.sources.size(), 5u);
}

}  // namespace
}  // namespace texel
