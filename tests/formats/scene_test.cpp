// Texel scenes: transforms, instances, groups, tables of places, overrides, nesting, refusals.
#include "formats/read_scene_file.h"

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "formats/instances.h"
#include "formats/read.h"
#include "formats/read_placements.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

// A tetrahedron with legs 1, 2 and 3 along the axes: no map but the identity leaves it as it is. Volume 1.
constexpr const char* kTetrahedron = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nusemtl bark\nf 1 3 2\nf 1 2 4\nusemtl leaf\nf 1 4 3\nf 2 3 4\nmtllib t.mtl\n";
constexpr const char* kMaterials = "newmtl bark\nKd 0.2 0.2 0.2\nnewmtl leaf\nKd 0.1 0.6 0.1\n";

struct Files {
  TestFolder folder;
  Report report;
  Files() {
    (void)folder.write("t.obj", kTetrahedron);
    (void)folder.write("t.mtl", kMaterials);
  }
  Scene read(const std::string& json, const std::string& texel = {}) {
    ReadOptions options;
    options.texel = texel;
    const std::string path = folder.write("s.json", json);
    return read_scene(std::span(&path, 1), options, report);
  }
  // "objects" over one input "t".
  Scene place(const std::string& objects, const std::string& input = R"("t.obj")") {
    return read(R"({"format": "texel-scene", "inputs": {"t": )" + input + R"(}, "objects": )" + objects + "}");
  }
  std::string fault(const std::string& json, const std::string& texel = {}) {
    std::string text = error_of([&] { (void)read(json, texel); });
    const std::string home = folder.file("");
    for (std::size_t at; (at = text.find(home)) != std::string::npos;) text.erase(at, home.size());
    return text;
  }
  std::string place_fault(const std::string& objects, const std::string& input = R"("t.obj")") {
    return fault(R"({"format": "texel-scene", "inputs": {"t": )" + input + R"(}, "objects": )" + objects + "}");
  }
  // What the transform makes of (1, 0, 0), (0, 2, 0) and (0, 0, 3).
  std::vector<V3d> corners(const std::string& transform) {
    const Scene scene = place(R"([{"input": "t", "transform": )" + transform + "}]");
    return {scene.mesh.points.begin() + 1, scene.mesh.points.end()};
  }
};

void expect_points(const std::vector<V3d>& got, const std::vector<V3d>& want, double bound) {
  ASSERT_EQ(got.size(), want.size());
  for (std::size_t i = 0; i < got.size(); ++i) EXPECT_LE((got[i] - want[i]).length(), bound) << i << ": " << got[i] << " is not " << want[i];
}

TEST(SceneFile, OnePlacementIsTrianglesSeveralAreInstances) {
  Files f;
  const Scene once = f.place(R"([{"input": "t", "transform": {"translate": [1, 2, 3]}}])");
  EXPECT_EQ(once.mesh.triangles.size(), 4u);
  EXPECT_TRUE(once.shapes.empty() && once.instances.empty());
  const Scene twice = f.place(R"([{"input": "t", "transform": {"translate": [1, 2, 3]}}, {"input": "t"}])");
  EXPECT_TRUE(twice.mesh.triangles.empty());
  ASSERT_EQ(twice.shapes.size(), 1u);
  EXPECT_EQ(twice.shapes[0].triangles.size(), 4u);
  ASSERT_EQ(twice.instances.size(), 2u);
  EXPECT_EQ(twice.instances[0].place.m, (Affine::translation({1, 2, 3}).m));
  EXPECT_EQ(twice.instances[1].place.m, Affine().m);
  EXPECT_EQ(twice.materials.size(), 2u);
  // Exact: whole numbers. The same points whichever way.
  const Scene flat = flatten_instances(twice);
  EXPECT_EQ(once.mesh.points, std::vector<V3d>(flat.mesh.points.begin(), flat.mesh.points.begin() + 4));
  EXPECT_EQ(twice.sources.size(), 3u);  // the scene, the mesh, its materials
  EXPECT_TRUE(twice.sources[0].input && !twice.sources[1].input);
}

TEST(SceneFile, TransformsAreScaledTurnedMoved) {
  Files f;
  // Exact: quarter turns have whole sines.
  expect_points(f.corners(R"({"scale": 2})"), {{2, 0, 0}, {0, 4, 0}, {0, 0, 6}}, 0);
  expect_points(f.corners(R"({"scale": [2, 3, 5]})"), {{2, 0, 0}, {0, 6, 0}, {0, 0, 15}}, 0);
  expect_points(f.corners(R"({"rotate": [90, 0, 0]})"), {{1, 0, 0}, {0, 0, 2}, {0, -3, 0}}, 0);
  expect_points(f.corners(R"({"rotate": [90, 0, 90]})"), {{0, 1, 0}, {0, 0, 2}, {3, 0, 0}}, 0);  // x first, then z
  expect_points(f.corners(R"({"rotate": {"axis": [0, 0, 2], "angle": -270}})"), {{0, 1, 0}, {-2, 0, 0}, {0, 0, 3}}, 0);
  expect_points(f.corners(R"({"translate": [10, 0, 0], "rotate": [0, 0, 90], "scale": [2, 1, 1]})"), {{10, 2, 0}, {8, 0, 0}, {10, 0, 3}}, 0);
  expect_points(f.corners(R"({"matrix": [0, 0, 1, 7,  1, 0, 0, 8,  0, 1, 0, 9]})"), {{7, 9, 9}, {7, 8, 11}, {10, 8, 9}}, 0);
  expect_points(f.corners(R"({"matrix": [0, 0, 1, 7,  1, 0, 0, 8,  0, 1, 0, 9, 0, 0, 0, 1]})"), {{7, 9, 9}, {7, 8, 11}, {10, 8, 9}}, 0);
  // Scaled rounding: a third of a turn about the diagonal exchanges the axes; a few roundings of coordinates up to 3.
  expect_points(f.corners(R"({"rotate": {"axis": [1, 1, 1], "angle": 120}})"), {{0, 1, 0}, {0, 0, 2}, {3, 0, 0}}, 4e-15);
  const double c = std::cos(0.5), s = std::sin(0.5);
  expect_points(f.corners(R"({"rotate": [0, 28.64788975654116, 0]})"), {{c, 0, -s}, {0, 2, 0}, {3 * s, 0, 3 * c}}, 4e-15);
}

TEST(SceneFile, MirrorsKeepTheOutside) {
  Files f;
  EXPECT_NEAR(measure(f.place(R"([{"input": "t", "transform": {"scale": [-1, 1, 1]}}])").mesh).volume, 1, 1e-15);
  const Scene both = f.place(R"([{"input": "t", "transform": {"scale": -2}}, {"input": "t", "transform": {"scale": [1, -1, 1], "translate": [9, 0, 0]}}])");
  EXPECT_NEAR(measure(flatten_instances(both).mesh).volume, 9, 1e-13);  // a few roundings of terms up to 100
}

TEST(SceneFile, UnitsAndUp) {
  Files f;
  EXPECT_EQ(f.place(R"([{"input": "t"}])", R"({"file": "t.obj", "unit": "cm"})").mesh.points[2], V3d(0, 0.02, 0));
  EXPECT_EQ(f.place(R"([{"input": "t"}])", R"({"file": "t.obj", "unit": 0.5})").mesh.points[2], V3d(0, 1, 0));
  EXPECT_EQ(f.place(R"([{"input": "t"}])", R"({"file": "t.obj", "unit": "ft"})").mesh.points[1], V3d(0.3048, 0, 0));
  expect_points(f.place(R"([{"input": "t"}])", R"({"file": "t.obj", "up": "y"})").mesh.points, {{0, 0, 0}, {1, 0, 0}, {0, 0, 2}, {0, -3, 0}}, 0);
  EXPECT_EQ(f.place(R"([{"input": "t"}])", R"({"file": "t.obj", "up": "z"})").mesh.points[2], V3d(0, 2, 0));
  // A unit belongs to the input, a transform to the scene.
  EXPECT_EQ(f.place(R"([{"input": "t", "transform": {"translate": [5, 0, 0]}}])", R"({"file": "t.obj", "unit": "cm"})").mesh.points[1], V3d(5.01, 0, 0));
}

TEST(SceneFile, GroupsMultiply) {
  Files f;
  const Scene scene = f.place(R"([{"objects": [{"input": "t", "transform": {"translate": [1, 0, 0]}}, {"input": "t", "transform": {"translate": [2, 0, 0]}}],
    "transform": {"rotate": [0, 0, 90]}, "instances": [{}, {"scale": 10}]}])");
  ASSERT_EQ(scene.instances.size(), 4u);
  std::vector<V3d> origins;
  for (const Instance& i : scene.instances) origins.push_back(i.place * V3d(0, 0, 0));
  expect_points(origins, {{0, 1, 0}, {0, 10, 0}, {0, 2, 0}, {0, 20, 0}}, 0);
  EXPECT_EQ(scene.instances[1].place * V3d(1, 0, 0), V3d(0, 20, 0));
}

TEST(SceneFile, MaterialsAreOverridden) {
  Files f;
  const Scene scene = f.place(R"([{"input": "t"}])", R"({"file": "t.obj", "materials": {"leaf": {"kd": "#ff8000", "roughness": 0.25, "ks": [0.1, 0.2, 0.3]}, "*": {"opacity": 0.5, "kd": [1, 0, 0], "ke": [0, 0, 3]}}})");
  ASSERT_EQ(scene.materials.size(), 2u);
  EXPECT_EQ(scene.materials[0].kd, V3f(1, 0, 0));  // * alone
  EXPECT_EQ(scene.materials[1].name, "leaf");
  EXPECT_EQ(scene.materials[1].kd.x, 1);
  EXPECT_NEAR(scene.materials[1].kd.y, std::pow((128 / 255.0 + 0.055) / 1.055, 2.4), 1e-6);  // half a storage step of a float below 1, and its powers
  EXPECT_EQ(scene.materials[1].roughness, 0.25f);
  EXPECT_EQ(scene.materials[1].ks, V3f(0.1f, 0.2f, 0.3f));
  for (const Material& m : scene.materials) {
    EXPECT_EQ(m.opacity, 0.5f);
    EXPECT_EQ(m.ke, V3f(0, 0, 3));
  }
  // Inputs of one file with colours of their own are shapes of their own.
  const Scene two = f.read(R"({"format": "texel-scene", "inputs": {"a": "t.obj", "b": {"file": "t.obj", "materials": {"bark": {"kd": [0, 0, 1]}}}},
    "objects": [{"input": "a", "instances": [{}, {}]}, {"input": "b", "instances": [{}, {}]}]})");
  EXPECT_EQ(two.shapes.size(), 2u);
  EXPECT_EQ(two.materials[two.shapes[1].materials[0]].kd, V3f(0, 0, 1));
  EXPECT_EQ(two.materials[two.shapes[0].materials[0]].kd, V3f(0.2f, 0.2f, 0.2f));
}

TEST(SceneFile, PicturesAreOverridden) {
  Files f;
  (void)f.folder.write("p.png", "not looked into here");
  const Scene with = f.place(R"([{"input": "t"}])", R"({"file": "t.obj", "materials": {"leaf": {"map_kd": "p.png"}}})");
  ASSERT_TRUE(with.materials[1].map_kd.used());
  EXPECT_FALSE(with.materials[0].map_kd.used());
  EXPECT_EQ(with.materials[1].kd, V3f(1, 1, 1));
  EXPECT_EQ(with.textures[static_cast<std::size_t>(with.materials[1].map_kd.texture)].path, f.folder.file("p.png"));
  EXPECT_EQ(with.sources.back().path, f.folder.file("p.png"));
  (void)f.folder.write("t.mtl", "newmtl leaf\nmap_Kd p.png\n");
  EXPECT_FALSE(f.place(R"([{"input": "t"}])", R"({"file": "t.obj", "materials": {"leaf": {"map_kd": null, "kd": [1, 0, 0]}}})").materials[1].map_kd.used());
  EXPECT_EQ(f.place_fault(R"([{"input": "t"}])", R"({"file": "t.obj", "materials": {"leaf": {"map_kd": "q.png"}}})"),
            "2: q.png: named at s.json: /inputs/t/materials/leaf/map_kd, is not there; names are relative to the scene's folder");
}

TEST(SceneFile, TablesPlace) {
  Files f;
  (void)f.folder.write("p.csv", "# trees\nx,y,z,scale,rx,ry,rz\n1, 2, 3, 2, 0, 0, 90\n4,5,6,1,90,0,90\n");
  const Scene scene = f.place(R"([{"input": "t", "instances_file": "p.csv", "transform": {"translate": [0, 0, 100]}}])");
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.instances[0].place * V3d(1, 0, 0), V3d(1, 4, 103));
  EXPECT_EQ(scene.instances[1].place * V3d(0, 1, 0), V3d(4, 5, 107));
  EXPECT_EQ(scene.instances[1].place * V3d(1, 0, 0), V3d(4, 6, 106));
  EXPECT_EQ(scene.sources.back().path, f.folder.file("p.csv"));  // so that a change is noticed
  // In a group that stands twice.
  const Scene group = f.place(R"([{"objects": [{"input": "t", "instances_file": "p.csv"}], "instances": [{}, {"translate": [0, 0, 50]}]}])");
  ASSERT_EQ(group.instances.size(), 4u);
  EXPECT_EQ(group.instances[3].place * V3d(0, 0, 0), V3d(4, 5, 56));
  // One row is one placement: triangles.
  (void)f.folder.write("p.csv", "1 2 3");
  EXPECT_EQ(f.place(R"([{"input": "t", "instances_file": "p.csv"}])").mesh.points[0], V3d(1, 2, 3));
}

std::string table(const std::string& text) {
  std::string out;
  Report report;
  out = error_of([&] {
    std::string rows;
    read_placements({text, "p.csv"}, report, [&](const Affine& a) {
      const V3d o = a * V3d(0, 0, 0), x = a * V3d(1, 0, 0) - o;
      for (const double v : {o.x, o.y, o.z, x.x, x.y, x.z}) rows += std::to_string(std::lround(v)) + " ";
    });
    throw Error(Code::kOk, "", rows);
  });
  return out.substr(out.starts_with("0: ") ? 3 : 0);
}

TEST(Placements, HaveSeveralForms) {
  EXPECT_EQ(table("1 2 3\n4 5 6\n"), "1 2 3 1 0 0 4 5 6 1 0 0 ");
  EXPECT_EQ(table("1;2;3;7\r\n\r\n4\t5\t6\t8"), "1 2 3 7 0 0 4 5 6 8 0 0 ");
  EXPECT_EQ(table("\xEF\xBB\xBF" "1 , 2 ,3 , 1, 0, 0, 180 # turned\r"), "1 2 3 -1 0 0 ");
  EXPECT_EQ(table("2 0 0 1 0 2 0 5 0 0 2 9"), "1 5 9 2 0 0 ");
  EXPECT_EQ(table("\"scale\" z y x\n3 2 1 0\n"), "0 1 2 3 0 0 ");
  EXPECT_EQ(table("m03,m13,m23,m00,m01,m02,m10,m11,m12,m20,m21,m22\n1,2,3, 0,-1,0, 1,0,0, 0,0,1\n"), "1 2 3 0 1 0 ");
  EXPECT_EQ(table(""), "");
}

TEST(Placements, RefusalsNameTheLine) {
  EXPECT_EQ(table("1 2 3\n1 2\n"), "3: p.csv:2: has 2 fields; the rows before have 3");
  EXPECT_EQ(table("1 2\n"), "3: p.csv:1: has 2 fields; expected x y z, x y z scale, x y z scale rx ry rz, or twelve of a matrix");
  EXPECT_EQ(table("1 2 3 4 5 6 7 8 9 0 1 2 3\n"), "3: p.csv:1: has more than 12 fields; expected x y z, x y z scale, x y z scale rx ry rz, or twelve of a matrix");
  EXPECT_EQ(table("1 2 3\n\n1 nan 3\n"), "3: p.csv:3: is no number up to 1e30 (\"nan\"); export the table again");
  EXPECT_EQ(table("1,5,,3\n"), "3: p.csv:1: is no number up to 1e30 (\"\"); export the table again");
  EXPECT_EQ(table("1,5,\n"), "3: p.csv:1: is no number up to 1e30 (\"\"); export the table again");
  EXPECT_EQ(table("1 2 1e31\n"), "3: p.csv:1: is no number up to 1e30 (\"1e31\"); export the table again");
  EXPECT_EQ(table("1 2 3 0\n"), "3: p.csv:1: is a transform that makes things flat or infinite; leave the row out");
  EXPECT_EQ(table("x y z size\n"), "3: p.csv:1: has a column \"size\"; known: x, y, z, scale, rx, ry, rz, or m00, m01 ... m23");
  EXPECT_EQ(table("x y x\n"), "3: p.csv:1: has two columns \"x\"; leave one out");
  EXPECT_EQ(table("x y scale\n"), "3: p.csv:1: has no column z; a place has x, y and z");
  EXPECT_EQ(table("1 2 3\nx y z\n"), "3: p.csv:2: is no number up to 1e30 (\"x\"); export the table again");
}

TEST(SceneFile, ScenesInScenes) {
  Files f;
  (void)f.folder.write("in/pair.json", R"({"format": "texel-scene", "inputs": {"t": "../t.obj"}, "texels": [
    {"name": "two", "objects": [{"input": "t"}, {"input": "t", "transform": {"translate": [1, 0, 0]}}]}, {"name": "one", "objects": [{"input": "t"}]}]})");
  const std::string input = R"({"file": "in/pair.json", "texel": "two", "unit": 2})";
  const Scene once = f.place(R"([{"input": "t", "transform": {"translate": [10, 0, 0]}}])", input);
  EXPECT_EQ(once.shapes.size(), 1u);
  ASSERT_EQ(once.instances.size(), 2u);
  EXPECT_EQ(once.instances[1].place * V3d(1, 0, 0), V3d(14, 0, 0));
  const Scene often = f.place(R"([{"input": "t", "instances": [{}, {"translate": [0, 5, 0]}, {"scale": -1}]}])", input);
  EXPECT_EQ(often.shapes.size(), 1u);
  ASSERT_EQ(often.instances.size(), 6u);
  EXPECT_EQ(often.instances[3].place * V3d(0, 0, 0), V3d(2, 5, 0));
  EXPECT_NEAR(measure(flatten_instances(often).mesh).volume, 6 * 8, 1e-12);
  EXPECT_EQ(often.sources.size(), 4u);
  EXPECT_EQ(f.place_fault(R"([{"input": "t"}])", R"("in/pair.json")"), "3: in/pair.json: holds 2 texels; choose one by --texel, in a scene by \"texel\": two, one; `texel batch` bakes all");
  EXPECT_EQ(f.place_fault(R"([{"input": "t"}])", R"({"file": "in/pair.json", "texel": "six"})"), "3: in/pair.json: has no texel \"six\"; it has two, one");
  EXPECT_EQ(f.place_fault(R"([{"input": "t"}])", R"({"file": "t.obj", "texel": "six"})"), "3: t.obj: is no scene and has no texels; leave \"texel\" out");
}

TEST(SceneFile, ScenesDoNotHoldThemselves) {
  Files f;
  EXPECT_EQ(f.place_fault(R"([{"input": "t"}])", R"("s.json")"), "3: s.json: is an input of itself, through its own name; a scene may not hold itself");
  (void)f.folder.write("b.json", R"({"format": "texel-scene", "inputs": {"s": "s.json"}, "objects": [{"input": "s"}]})");
  EXPECT_EQ(f.place_fault(R"([{"input": "t"}])", R"("b.json")"), "3: s.json: is an input of itself, through b.json; a scene may not hold itself");
  for (int i = 0; i < 20; ++i)
    (void)f.folder.write("n" + std::to_string(i) + ".json", R"({"format": "texel-scene", "inputs": {"s": "n)" + std::to_string(i + 1) + R"(.json"}, "objects": [{"input": "s"}]})");
  EXPECT_EQ(f.place_fault(R"([{"input": "t"}])", R"("n0.json")"), "3: n15.json: is nested 16 scenes deep; make it flatter");
  // Twice the scene before, twelve times: 4096 readings of one file, and no more than are allowed.
  for (int i = 0; i < 15; ++i) {
    const std::string next = i == 14 ? "t.obj" : "d" + std::to_string(i + 1) + ".json";
    (void)f.folder.write("d" + std::to_string(i) + ".json", R"({"format": "texel-scene", "inputs": {"a": ")" + next + R"(", "b": ")" + next + R"("}, "objects": [{"input": "a"}, {"input": "b"}]})");
  }
  EXPECT_NE(f.place_fault(R"([{"input": "t"}])", R"("d0.json")").find("is one input too many"), std::string::npos);
}

TEST(SceneFile, FunctionsStandOnce) {
  Files f;
  (void)f.folder.write("ball.json", R"({"format": "texel-shape", "shape": {"sphere": {"radius": 1}}})");
  const Scene scene = f.read(R"({"format": "texel-scene", "inputs": {"t": "t.obj", "ball": {"file": "ball.json", "materials": {"*": {"kd": [1, 0, 0]}}}}, "objects": [{"input": "t"}, {"input": "ball"}]})");
  ASSERT_EQ(scene.implicits.size(), 1u);
  EXPECT_EQ(scene.materials[scene.implicits[0].material].kd, V3f(1, 0, 0));
  EXPECT_EQ(scene.mesh.triangles.size(), 4u);
  const std::string refusal = "3: s.json: /inputs/t is a function or a height field (ball.json), which can stand only once, without a transform, unit or up; bake it by itself, or give a mesh";
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "transform": {"scale": 2}}])", R"("ball.json")"), refusal);
  EXPECT_EQ(f.place_fault(R"([{"input": "t"}, {"input": "t"}])", R"("ball.json")"), refusal);
  EXPECT_EQ(f.place_fault(R"([{"input": "t"}])", R"({"file": "ball.json", "unit": "cm"})"), refusal);
}

TEST(SceneFile, TexelsHaveNamesAndRecipes) {
  const std::string text = R"({"format": "texel-scene", "inputs": {"t": "t.obj"}, "recipe": {"resolution": 32}, "texels": [
    {"name": "a", "objects": [{"input": "t"}], "recipe": {"resolution": 64}}, {"name": "b", "objects": [{"input": "t"}, {"input": "t"}]}]})";
  const std::vector<SceneTexel> texels = list_texels(Input{text, "s.json"});
  ASSERT_EQ(texels.size(), 2u);
  ASSERT_EQ(texels[0].recipes.size(), 2u);
  EXPECT_EQ(texels[0].recipes[1].json, R"({"resolution":64})");
  EXPECT_EQ(texels[0].recipes[1].where, "s.json: /texels/0/recipe");
  ASSERT_EQ(texels[1].recipes.size(), 1u);
  EXPECT_EQ(texels[1].recipes[0].where, "s.json: /recipe");
  Files f;
  EXPECT_EQ(f.read(text, "a").mesh.triangles.size(), 4u);
  EXPECT_EQ(f.read(text, "b").instances.size(), 2u);
  EXPECT_EQ(f.fault(text), "3: s.json: holds 2 texels; choose one by --texel, in a scene by \"texel\": a, b; `texel batch` bakes all");
}

TEST(SceneFile, IsToldFromOtherJson) {
  const auto is = [](const std::string& text, bool first = false) { return is_scene_file(text, first); };
  EXPECT_TRUE(is(R"({"format": "texel-scene"})"));
  EXPECT_TRUE(is(R"({"format": "texel-scene", broken)"));  // refused later, with the line
  EXPECT_TRUE(is(R"({"inputs": {"format": "x", "a": [{"format": 1}]}, "format": "texel-scene"})"));
  EXPECT_FALSE(is(R"({"inputs": {}, "format": "texel-scene"})", true));
  EXPECT_TRUE(is(" \n{ \"format\" : \"texel-scene\"", true));
  for (const char* other : {"", "[", "3", "{\"a\": {\"format\": \"texel-scene\"}}", "[{\"format\": \"texel-scene\"}]", "{\"format\": [\"texel-scene\"]}", "{\"format\": \"texel-shape\"}"})
    EXPECT_FALSE(is(other)) << other;
}

TEST(SceneFile, RefusalsNameThePath) {
  Files f;
  const std::string at = "3: s.json: ", one = R"([{"input": "t"}])";
  EXPECT_EQ(f.fault("{\"format\": \"texel-scene\",\n}"), at.substr(0, at.size() - 2) + ":2: is not JSON; a scene is {\"format\": \"texel-scene\", \"inputs\": {...}, \"objects\": [...]}");
  EXPECT_EQ(f.fault(R"({"format": "texel-scene"})"), at + "has neither \"objects\" nor \"texels\"; give objects for one texel, or texels with objects of their own");
  EXPECT_EQ(f.fault(R"({"format": "texel-scene", "version": 2, "objects": []})"), at + "/version is 2; this program reads version 1");
  EXPECT_EQ(f.fault(R"({"format": "texel-scene", "objects": []})"), at + "has no \"inputs\"; see docs/scenes.md");
  EXPECT_EQ(f.fault(R"({"format": "texel-scene", "objets": [], "objects": []})"), at + "/\"objets\" is an unknown key; known: format, version, name, inputs, objects, texels, recipe");
  EXPECT_EQ(f.place_fault("[]"), at + "/objects is []; expected a list of objects");
  EXPECT_EQ(f.place_fault(R"([{"input": "u"}])"), at + "/objects/0/input is \"u\", which is not among the inputs; known: \"t\"");
  EXPECT_EQ(f.place_fault(R"([{"objects": [{"input": "t", "colour": 1}]}])"), at + "/objects/0/objects/0/\"colour\" is an unknown key; known: name, input, objects, transform, instances, instances_file");
  EXPECT_EQ(f.place_fault(R"([{"transform": {}}])"), at + "/objects/0 has neither \"input\" nor \"objects\"; give one of them");
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "instances": [{"scale": 0}]}])"), at + "/objects/0/instances/0 makes things flat or infinite: {\"scale\":0}; scale by numbers other than 0, and move by no more than 1e30");
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "transform": {"matrix": [1,2,3,0, 2,4,6,0, 1,0,0,0]}}])").substr(0, 60), (at + "/objects/0/transform makes things flat or infinite").substr(0, 60));
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "transform": {"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,1,1]}}])"), at + "/objects/0/transform/matrix does not end with 0, 0, 0, 1; give the rows of an affine matrix, the translation at the end of each");
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "transform": {"matrix": [1], "scale": 1}}])"), at + "/objects/0/transform has a matrix and other keys; give one of them");
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "transform": {"translate": [1, 2]}}])"), at + "/objects/0/transform/translate is [1,2]; expected 3 numbers");
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "transform": {"rotate": {"axis": [0, 0, 0], "angle": 1}}}])"), at + "/objects/0/transform/rotate/axis is [0,0,0]; expected a direction other than 0");
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "instances_file": "none.csv"}])"), "2: none.csv: named at s.json: /objects/0/instances_file, is not there; names are relative to the scene's folder");
  (void)f.folder.write("none.csv", "# nothing\n");
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "instances_file": "none.csv"}])"), "3: none.csv: places nothing; give a row of x, y, z for each placement");
  EXPECT_EQ(f.place_fault(one, R"("u.obj")"), "2: u.obj: named at s.json: /inputs/t/file, is not there; names are relative to the scene's folder");
  EXPECT_EQ(f.place_fault(one, R"({"file": "t.obj", "unit": "parsec"})"), at + "/inputs/t/unit is \"parsec\"; expected mm, cm, m, km, in, ft or a number of metres");
  EXPECT_EQ(f.place_fault(one, R"({"file": "t.obj", "up": "x"})"), at + "/inputs/t/up is \"x\"; expected \"y\" or \"z\"");
  EXPECT_EQ(f.place_fault(one, R"({"file": "t.obj", "materials": {"bork": {}}})"), at + "/inputs/t/materials/bork is no material of t.obj; it has \"bark\", \"leaf\"");
  EXPECT_EQ(f.place_fault(one, R"({"file": "t.obj", "materials": {"bark": {"kd": "red"}}})"), at + "/inputs/t/materials/bark/kd is \"red\"; expected \"#rrggbb\" (sRGB) or three linear numbers");
  EXPECT_EQ(f.fault(R"({"format": "texel-scene", "inputs": {"t": "t.obj"}, "texels": [{"name": "../a", "objects": []}]})"),
            at + "/texels/0/name is \"../a\"; expected a name for a folder: no slash, no dot at its start, at most 100 bytes");
  EXPECT_EQ(f.fault(R"({"format": "texel-scene", "inputs": {"t": "t.obj"}, "texels": [{"name": "a", "objects": []}, {"name": "a", "objects": []}]})"), at + "/texels/1/name is that of /texels/0; give each texel a name of its own");
  EXPECT_EQ(f.fault(R"({"format": "texel-scene", "inputs": {"t": "t.obj"}, "texels": [{"name": "a", "objects": [{"input": "t"}], "recipe": {"texel": "a"}}]})"), at + "/texels/0/recipe/texel chooses among texels, and this is one; leave it out");
  std::string deep = R"([{"input": "t"}])";
  for (int i = 0; i < 40; ++i) deep = R"([{"objects": )" + deep + "}]";
  EXPECT_NE(f.place_fault(deep).find("is nested more than 32 groups deep"), std::string::npos);
  EXPECT_NE(f.place_fault(std::string(1000000, '[') + std::string(1000000, ']')).find("is nested more than 500 deep"), std::string::npos);
}

TEST(SceneFile, GrowthIsBounded) {
  Files f;
  // 100 places within 100 within 100 …: more than any machine holds.
  std::string hundred;
  for (int i = 0; i < 100; ++i) hundred += (i ? ", " : "") + std::string("{}");
  std::string objects = R"([{"input": "t"}])";
  for (int i = 0; i < 6; ++i) objects = R"([{"objects": )" + objects + R"(, "instances": [)" + hundred + "]}]";
  EXPECT_NE(f.place_fault(objects).find("is one placement too many"), std::string::npos);
  // Scales that multiply beyond what can be computed with.
  objects = R"([{"input": "t"}])";
  for (int i = 0; i < 20; ++i) objects = R"([{"objects": )" + objects + R"(, "transform": {"scale": 1e20}}])";
  EXPECT_NE(f.place_fault(objects).find("makes things flat or infinite together with the groups it is in"), std::string::npos);
}

TEST(SceneFile, AHundredThousandTakeTheMemoryOfTheirTransforms) {
  Files f;
  std::string rows;
  for (int i = 0; i < 100000; ++i) rows += std::to_string(i % 317) + "," + std::to_string(i / 317) + ",0,1,0,0," + std::to_string(i % 360) + "\n";
  (void)f.folder.write("p.csv", rows);
  const Scene scene = f.place(R"([{"input": "t", "instances_file": "p.csv"}])");
  EXPECT_EQ(scene.instances.size(), 100000u);
  EXPECT_EQ(sizeof(Instance), 104u);
  EXPECT_LE(scene.instances.capacity(), 100001u);  // exact: the rows are counted before they are read
  EXPECT_EQ(scene.shapes.size(), 1u);
  EXPECT_EQ(count_triangles(scene), 400000u);
}

TEST(SceneFile, TheSchemaHasTheReadersKeys) {
  std::ifstream in(std::string(TEXEL_SAMPLES) + "/../docs/scene.schema.json");
  const nlohmann::json schema = nlohmann::json::parse(in);
  ASSERT_EQ(schema.at("$defs").size(), scene_keys().size());
  for (const SceneKeys& object : scene_keys()) {
    SCOPED_TRACE(object.object);
    const nlohmann::json& stated = schema.at("$defs").at(object.object);
    EXPECT_EQ(stated.at("additionalProperties"), false);
    std::vector<std::string> theirs, ours(object.keys.begin(), object.keys.end());
    for (const auto& [key, value] : stated.at("properties").items()) theirs.push_back(key);
    std::sort(ours.begin(), ours.end());
    EXPECT_EQ(ours, theirs);
  }
}

TEST(SceneFile, TheSampleIsWhole) {
  ReadOptions options;
  options.texel = "grove";
  const std::string path = std::string(TEXEL_SAMPLES) + "/grove/grove.json";
  Report report;
  const Scene scene = read_scene(std::span(&path, 1), options, report);
  EXPECT_EQ(scene.instances.size(), 300u);
  EXPECT_EQ(scene.shapes.size(), 1u);
  EXPECT_TRUE(report.issues.empty());
  const Scene shrub = read_scene(std::string(TEXEL_SAMPLES) + "/plant/plant.opf", report);
  EXPECT_EQ(scene.shapes[0].points, shrub.mesh.points);  // exact: the shape is the shrub
}

// --- fibres ---

// A scene of curves, each a straight piece of two radii: x y z radius.
std::string wires(const std::string& numbers) {
  return R"(<scene><Curves type="round" basis="linear"><material><parameters><float3 name="Kd">0.25 0.5 1</float3></parameters></material><positions>)" + numbers + "</positions><indices>0 1</indices></Curves></scene>";
}

// Two places of a hair are two files: the second one holds the numbers that the transform makes, all of them exact.
TEST(SceneFibres, TwoPlacesAreTwoFiles) {
  Files f;
  const std::string a = f.folder.write("a.xml", wires("0 0 0 .25  1 0 0 .5  1 2 0 .125"));
  const std::string b = f.folder.write("b.xml", wires("10 0 4 .5  10 2 4 1  6 2 4 .25"));  // twice as large, turned by 90 degrees about z, moved
  const std::vector<std::string> paths{a, b};
  const Scene two = read_scene(paths, f.report);
  const Scene placed = f.place(R"([{"input": "t"}, {"input": "t", "transform": {"scale": 2, "rotate": [0, 0, 90], "translate": [10, 0, 4]}}])", R"("a.xml")");
  EXPECT_EQ(placed.fibres.points, two.fibres.points);
  EXPECT_EQ(placed.fibres.radii, two.fibres.radii);
  EXPECT_EQ(placed.fibres.first, two.fibres.first);
  EXPECT_EQ(placed.fibres.colors, two.fibres.colors);
  EXPECT_EQ(placed.fibres.materials, (std::vector<std::uint32_t>{0, 0}));
  EXPECT_EQ(placed.materials[0].kd, two.materials[0].kd);
  EXPECT_TRUE(placed.instances.empty() && placed.mesh.triangles.empty());
  // Mirrored ones keep their radius; stretched ones stay round, by the mean scale, once or several times.
  for (const std::string second : {"", R"(, {"translate": [0, 0, 9]})"}) {
    const Scene stretched = f.place(R"([{"input": "t", "instances": [{"scale": [-1, 2, 4]})" + second + "]}]", R"("a.xml")");
    EXPECT_EQ(stretched.fibres.points[2], V3d(-1, 4, 0));
    EXPECT_EQ(stretched.fibres.radii[0], 0.5);
    EXPECT_EQ(stretched.fibres.strands(), second.empty() ? 1u : 2u);
  }
}

TEST(SceneFibres, BesideTrianglesWithTheirOwnMaterials) {
  Files f;
  (void)f.folder.write("both.obj", "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl bark\nf 1 2 3\nusemtl leaf\nl 1 2 3\n");
  (void)f.folder.write("hair.xml", wires("0 0 0 .25  1 0 0 .5  1 2 0 .125"));
  const Scene scene = f.read(R"({"format": "texel-scene", "inputs": {"t": "t.obj", "both": "both.obj", "hair": "hair.xml"},
    "objects": [{"input": "t"}, {"input": "hair", "instances": [{}, {"translate": [0, 5, 0]}]}, {"input": "both", "instances": [{}, {"translate": [3, 0, 0]}, {"scale": 2}]}]})");
  EXPECT_EQ(scene.instances.size(), 3u);
  ASSERT_EQ(scene.fibres.strands(), 5u);
  EXPECT_EQ(scene.fibres.points[3], V3d(0, 5, 0)) << "in the order of the placements";
  EXPECT_EQ(scene.materials[scene.fibres.materials[0]].kd, V3f(0.25f, 0.5f, 1));
  for (std::size_t s = 2; s < 5; ++s) EXPECT_EQ(scene.materials[scene.fibres.materials[s]].name, "leaf");
  for (const std::uint32_t m : scene.shapes.at(0).materials) EXPECT_EQ(scene.materials[m].name, "bark");
  // A scene that holds them may be placed several times, too.
  (void)f.folder.write("inner.json", R"({"format": "texel-scene", "inputs": {"both": "both.obj"}, "objects": [{"input": "both", "instances": [{}, {"translate": [3, 0, 0]}]}]})");
  const Scene nested = f.place(R"([{"input": "t", "instances": [{}, {"translate": [0, 0, 7]}]}])", R"("inner.json")");
  EXPECT_EQ(nested.instances.size(), 4u);
  ASSERT_EQ(nested.fibres.strands(), 4u);
  EXPECT_EQ(nested.fibres.points[9], V3d(3, 0, 7));
}

TEST(SceneFibres, CopiesHaveALimit) {
  Files f;
  std::string points, line = "l";
  for (int i = 0; i < 1024; ++i) {
    points += "v " + std::to_string(i) + " 0 0\n";
    line += " " + std::to_string(i + 1);
  }
  (void)f.folder.write("long.obj", points + line + "\n");
  std::string rows;
  for (int i = 0; i < 32769; ++i) rows += "0 " + std::to_string(i) + " 0\n";
  (void)f.folder.write("p.csv", rows);
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "instances_file": "p.csv"}])", R"("long.obj")"),
            "3: s.json: /inputs/t holds fibres or lines (long.obj), which are copied, and the 1024 points of this one would stand 32769 times: together more than 2^25; place it less often (--fibre-radius 0 leaves out the lines of .obj files)");
}

TEST(SceneFibres, WhatAPlacementMakesUnusableIsLeftOut) {
  Files f;
  (void)f.folder.write("hair.xml", wires("0 0 0 .25  1 0 0 .5  1 2 0 .125"));
  // So far that its points fall together: one of two is left.
  const Scene scene = f.place(R"([{"input": "t"}, {"input": "t", "transform": {"translate": [1e20, 1e20, 0]}}])", R"("hair.xml")");
  EXPECT_EQ(scene.fibres.strands(), 1u);
  EXPECT_EQ(find_issue(f.report, "fibre-degenerate")->count, 1);
  EXPECT_EQ(f.place_fault(R"([{"input": "t", "transform": {"translate": [1e20, 1e20, 0]}}])", R"("hair.xml")"),
            "3: s.json: has no fibre left that can be used where it is placed: no fibre has two different points; move it less far, or scale by more");
}

}  // namespace
}  // namespace texel
