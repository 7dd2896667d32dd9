// Sampled functions and shape files: what is read, and what is refused.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "formats/error.h"
#include "formats/read.h"
#include "formats/read_volume.h"
#include "formats/readers.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

double value_of(const Field& field, const V3d& p) {
  double f = 0;
  field.values(1, &p.x, &p.y, &p.z, &f);
  return f;
}

// 19 × 11 × 9 samples of a linear function, which trilinear interpolation gives back exactly, on sheared axes.
SampleGrid linear_samples() {
  std::int64_t bad = 0;
  SampleGrid grid = make_samples(V3i(19, 11, 9), [](int y, int z, float* out) {
    for (int x = 0; x < 19; ++x) out[x] = static_cast<float>(x - 2 * y + 4 * z);
  }, &bad);
  grid.origin = V3d(5, -1, 2);
  grid.step[0] = V3d(0.5, 0, 0);
  grid.step[1] = V3d(0.1, 2, 0);
  grid.step[2] = V3d(0, 0.25, 1);
  return grid;
}

TEST(GridField, InterpolatesInTheGridsOwnAxes) {
  const SampleGrid grid = linear_samples();
  const auto field = make_grid_field(grid);
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const V3d at(random.uniform(0, 18), random.uniform(0, 10), random.uniform(0, 8));
    const V3d p = grid.origin + grid.step[0] * at.x + grid.step[1] * at.y + grid.step[2] * at.z;
    EXPECT_NEAR(value_of(*field, p), at.x - 2 * at.y + 4 * at.z, 1e-11);
    double f = 0;
    V3d g;
    field->gradients(1, &p.x, &p.y, &p.z, &f, &g.x, &g.y, &g.z);
    EXPECT_NEAR(g.dot(grid.step[0]), 1, 1e-11);
    EXPECT_NEAR(g.dot(grid.step[1]), -2, 1e-11);
    EXPECT_NEAR(g.dot(grid.step[2]), 4, 1e-11);
  }
  EXPECT_EQ(value_of(*field, V3d(100, 0, 0)), -20);  // the least value, x 0, y 10, z 0
  EXPECT_TRUE(std::isnan(value_of(*field, V3d(std::nan(""), 0, 0))));
}

TEST(GridField, RangesHoldEveryValueAndAreExact) {
  std::int64_t bad = 0;
  Random random(2);
  const V3i n(70, 33, 50);
  SampleGrid grid = make_samples(n, [&](int y, int z, float* out) {
    for (int x = 0; x < n.x; ++x) out[x] = x / 8 == 3 ? 0.25f : static_cast<float>(random.uniform(-1, 1) + 0.02 * (y + z));
  }, &bad);
  EXPECT_EQ(bad, 0);
  EXPECT_FALSE(grid.constants.empty());  // blocks of one value
  for (const double sign : {1.0, -1.0}) {
    const auto field = make_grid_field(grid, sign);
    for (int i = 0; i < 3000; ++i) {
      Box3d box;
      const double size = std::pow(10.0, random.uniform(-3, 2));
      for (int a = 0; a < 3; ++a) {
        box.min[a] = random.uniform(-4, n[a] + 3.0);
        box.max[a] = box.min[a] + size * random.uniform();
      }
      const Interval range = field->range(box);
      for (int k = 0; k < 20; ++k) {
        V3d p;
        for (int a = 0; a < 3; ++a) p[a] = random.uniform(box.min[a], box.max[a]);
        const double f = value_of(*field, p);
        ASSERT_TRUE(f >= range.low && f <= range.high) << f << " at " << p;
      }
    }
    // A box around one sample: nothing but its neighbours counts.
    const Interval one = field->range(Box3d(V3d(26.2, 10.2, 10.2), V3d(26.8, 10.8, 10.8)));
    EXPECT_NEAR(one.low, sign * 0.25, 1e-12);
    EXPECT_NEAR(one.high, sign * 0.25, 1e-12);
  }
}

TEST(GridField, BoundsAreTheCellsAroundWhatIsInside) {
  std::int64_t bad = 0;
  const auto field = make_grid_field(make_samples(V3i(20, 20, 20), [](int y, int z, float* out) {
    for (int x = 0; x < 20; ++x) out[x] = x == 9 && y == 17 && z >= 3 && z <= 5 ? 1.0f : 0.0f;
  }, &bad));
  EXPECT_EQ(field->bounds(0.5), Box3d(V3d(8, 16, 2), V3d(10, 18, 6)));
  EXPECT_TRUE(field->bounds(-1).isEmpty());  // everywhere
  EXPECT_TRUE(field->bounds(2).isEmpty());   // nowhere
}

TEST(GridField, SamplesThatAreNoNumbersBecomeTheLeast) {
  std::int64_t bad = 0;
  const SampleGrid grid = make_samples(V3i(9, 9, 9), [](int y, int z, float* out) {
    for (int x = 0; x < 9; ++x) out[x] = y == 0 && z == 0 && x < 2 ? std::nanf("") : x == 8 && y == 8 && z == 8 ? INFINITY : static_cast<float>(x + 3);
  }, &bad);
  EXPECT_EQ(bad, 3);
  EXPECT_EQ(sample_range(grid).low, 3);
  EXPECT_EQ(sample_range(grid).high, 11);
  EXPECT_EQ(value_of(*make_grid_field(grid), V3d(1, 0, 0)), 3);
}

// --- files ---

std::string text_of(std::initializer_list<int> bytes) { return {bytes.begin(), bytes.end()}; }

template <class Read>
std::string fault(Read read) {
  Report report;
  try {
    (void)read(report);
  } catch (const Error& e) {
    return std::to_string(static_cast<int>(e.code)) + " " + e.what();
  }
  return "no error";
}
Volume read_text(Volume (*reader)(const Input&, Report&), const std::string& bytes) {
  Report report;
  return reader({bytes, "v"}, report);
}
std::string fault_of(Volume (*reader)(const Input&, Report&), const std::string& bytes) {
  return fault([&](Report& report) { return reader({bytes, "v"}, report); });
}

TEST(RawVolumes, DensityFiles) {
  const std::string head = text_of({0, 2, 0, 1, 0, 1});
  const auto at = [](const Volume& v, double x) { return value_of(*make_grid_field(v.grid), V3d(x, 0.5, 0.5)); };
  const Volume bytes = read_text(read_df3, head + text_of({51, 255}));
  EXPECT_NEAR(at(bytes, 0.25), 0.2, 1e-7);  // samples in the middle of their half
  EXPECT_NEAR(at(bytes, 0.75), 1, 1e-7);
  EXPECT_NEAR(at(bytes, 0.5), 0.6, 1e-7);
  EXPECT_EQ(bytes.iso, 0.5);
  EXPECT_NEAR(at(read_text(read_df3, head + text_of({0x33, 0x33, 0, 0})), 0.25), 0.2, 1e-7);
  EXPECT_NEAR(at(read_text(read_df3, head + text_of({0x33, 0x33, 0x33, 0x33, 0, 0, 0, 0})), 0.25), 0.2, 1e-7);
  EXPECT_EQ(fault_of(read_df3, "abc"), "3 v: is too short for a density file (3 bytes); write the file again");
  EXPECT_EQ(fault_of(read_df3, text_of({0, 2, 0, 0, 0, 1, 9})), "3 v: the size is 2 x 0 x 1 samples; each must be 1 or more");
  EXPECT_EQ(fault_of(read_df3, text_of({0, 2, 0, 2, 0, 1, 9})), "3 v: ends after 1 bytes of samples; 2 x 2 x 1 of them take 4; write the file again");
}

std::string inr(const std::string& lines, const std::string& data) {
  std::string head = "#INRIMAGE-4#{\n" + lines;
  head.resize(252, '\n');
  return head + "##}\n" + data;
}

TEST(RawVolumes, Inrimage) {
  const std::string lines = "XDIM=2\nYDIM=1\nZDIM=1\nVDIM=1\nTYPE=signed fixed\nPIXSIZE=16 bits\nCPU=sun\nVX=0.5\nVY=2\nVZ=3\n";
  const Volume v = read_text(read_inr, inr(lines, text_of({0xff, 0xfe, 0, 7})));
  EXPECT_EQ(value_of(*make_grid_field(v.grid), V3d(0, 0, 0)), -2);
  EXPECT_EQ(value_of(*make_grid_field(v.grid), V3d(0.5, 0, 0)), 7);
  EXPECT_FALSE(v.iso);
  EXPECT_EQ(fault_of(read_inr, "hello"), "3 v: does not begin with #INRIMAGE-4#{; only INRIMAGE-4 is read");
  EXPECT_EQ(fault_of(read_inr, "#INRIMAGE-4#{\n"), "3 v: has no end of its header (##}); write the file again");
  EXPECT_EQ(fault_of(read_inr, inr("XDIM=2\n", "")), "3 v: has no YDIM; write the file again");
  EXPECT_EQ(fault_of(read_inr, inr("XDIM=two\n", "")), "3 v:2: XDIM is \"two\"; expected 1 number");
  EXPECT_EQ(fault_of(read_inr, inr("XDIM=2\nYDIM=1\nZDIM=1\nTYPE=packed\n", "")), "3 v:5: TYPE is \"packed\"; known: unsigned fixed, signed fixed, float");
  EXPECT_EQ(fault_of(read_inr, inr(lines, "ab")), "3 v: ends after 2 bytes of samples; 2 x 1 x 1 of them take 4; write the file again");
  EXPECT_EQ(fault_of(read_inr, inr("XDIM=2\nYDIM=1\nZDIM=1\nVDIM=3\n", "")), "3 v:5: VDIM is \"3\"; only one value a sample is read");
  EXPECT_EQ(fault_of(read_inr, text_of({0x1f, 0x8b, 8, 0, 1, 2})), "3 v: is damaged: gzip cannot unpack it; write the file again");
}

Volume read_meta(const std::string& head, const std::string& data, Report& report) {
  return read_mhd({head, "v.mhd"}, [&](const std::string&) { return std::span<const char>(data); }, report);
}
std::string meta_fault(const std::string& head, const std::string& data = "") {
  return fault([&](Report& report) { return read_meta(head, data, report); });
}

TEST(RawVolumes, MetaImages) {
  const std::string size = "NDims = 3\nDimSize = 2 1 1\n", file = "ElementDataFile = v.raw\n";
  const std::string type = "ElementType = MET_USHORT\n";
  Report report;
  const Volume v = read_meta(size + "ElementSpacing = 0.5 1 2\nOffset = 10 20 30\n" + type + "ElementByteOrderMSB = True\n" + file, text_of({1, 0, 0, 2}), report);
  EXPECT_EQ(value_of(*make_grid_field(v.grid), V3d(10, 20, 30)), 256);
  EXPECT_EQ(value_of(*make_grid_field(v.grid), V3d(10.5, 20, 30)), 2);
  const Volume local = read_meta(size + type + "ElementDataFile = LOCAL\n" + text_of({1, 0, 0, 2}), "", report);
  EXPECT_EQ(value_of(*make_grid_field(local.grid), V3d(0, 0, 0)), 1);
  const Volume turned = read_meta(size + "TransformMatrix = 0 1 0 1 0 0 0 0 1\n" + type + file, text_of({1, 0, 3, 0}), report);
  EXPECT_EQ(value_of(*make_grid_field(turned.grid), V3d(0, 1, 0)), 3);
  const float real[2] = {0.5f, -1};
  const Volume floats = read_meta(size + "ElementType = MET_FLOAT\n" + file, std::string(reinterpret_cast<const char*>(real), 8), report);
  EXPECT_EQ(value_of(*make_grid_field(floats.grid), V3d(0.5, 0, 0)), -0.25);

  EXPECT_EQ(meta_fault("NDims = 3\n"), "3 v.mhd: has no DimSize; a MetaImage header has NDims, DimSize, ElementType, ElementDataFile");
  EXPECT_EQ(meta_fault("NDims = 2\n"), "3 v.mhd:1: NDims is \"2\"; only volumes, of 3 dimensions, are read");
  EXPECT_EQ(meta_fault("NDims = 3\nDimSize = 2 0 1\n"), "3 v.mhd:2: DimSize is \"2 0 1\"; expected three whole numbers from 1 to 1000000");
  EXPECT_EQ(meta_fault("NDims = 3\nDimSize = 2 1\n"), "3 v.mhd:2: DimSize is \"2 1\"; expected 3 numbers");
  EXPECT_EQ(meta_fault(size + "ElementType = MET_STRING\n"),
            "3 v.mhd:3: ElementType is \"MET_STRING\"; known: MET_UCHAR, MET_CHAR, MET_USHORT, MET_SHORT, MET_UINT, MET_INT, MET_FLOAT, MET_DOUBLE");
  EXPECT_EQ(meta_fault(size + type + "ElementDataFile = LIST\n"), "3 v.mhd:4: ElementDataFile is \"LIST\"; one data file, or LOCAL, is read");
  EXPECT_EQ(meta_fault(size + type + file, "abc"), "3 v.mhd: ends after 3 bytes of samples; 2 x 1 x 1 of them take 4; write the file again");
  EXPECT_EQ(meta_fault(size + type + "CompressedData = True\n" + file, "abcd"), "3 v.mhd: its data are damaged: they unpack to 0 of 4 bytes; write the file again");
  EXPECT_EQ(meta_fault(size + type + "ElementSpacing = 1 0 1\n" + file, "abcd"), "3 v.mhd: the spacing of samples is 0.000000; give numbers other than 0");
  EXPECT_EQ(meta_fault("NDims = 3\nDimSize = 1000000 1000000 1000\n" + type + file),
            "5 v.mhd: holds 1000000 x 1000000 x 1000 samples, more than 17179869184; make it coarser");
}

TEST(RawVolumes, IsoMustPartTheValues) {
  const Volume v = read_text(read_inr, inr("XDIM=2\nYDIM=1\nZDIM=1\nTYPE=unsigned fixed\nPIXSIZE=8 bits\n", text_of({3, 9})));
  const auto with = [&](std::optional<double> iso) { return fault([&](Report&) { return volume_scene(v, iso, "v"); }); };
  EXPECT_EQ(with(5), "no error");
  EXPECT_EQ(with({}), "1 --iso: missing: v holds values from 3 to 9 and does not say where its surface is; give --iso V");
  EXPECT_EQ(with(10), "3 v: no value is >= 10 (they run from 3 to 9); change --iso");
  EXPECT_EQ(with(2), "3 v: every value is >= 2 (they run from 3 to 9); change --iso");
}

TEST(RawVolumes, FilesOfTheDataFolder) {
  const std::string folder = std::string(TEXEL_SHARED_DATA) + "/volumes/";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "not there: " << folder;
  const auto read = [&](const char* name, double iso) {
    Report report;
    const std::string path = folder + name;
    const Scene scene = read_scene(std::span(&path, 1), {.implicit = "", .iso = iso, .heights = {}}, report);
    EXPECT_EQ(scene.implicits.size(), 1u);
    EXPECT_TRUE(report.issues.empty()) << name;
    return scene;
  };
  const Scene spiral = read("spiral.df3", 0.5);
  EXPECT_GE(spiral.implicits[0].box.max.x, 0.5);
  EXPECT_LE(spiral.implicits[0].box.max.x, 1.02);
  const Scene liver = read("liver.inr.gz", 0.5);
  const Box3d& box = liver.implicits[0].box;
  EXPECT_LE(box.max.x, 438 * 0.617188 + 1);
  EXPECT_LE(box.max.z, 165 * 1.33333 + 2);
  EXPECT_GT(box.size().z, 50);
  const Scene head = read("HeadMRVolume.mhd", 40);
  EXPECT_EQ(head.sources.size(), 2u);  // the header and its data
  const Scene ball = read("sphere.vdb", 0);
  // "ls_sphere": narrow band, voxel 0.05, index box ±62: a radius of some 3. Its distances are exact to half floats.
  const Field& f = *ball.implicits[0].field;
  const double radius = value_of(f, V3d(3, 0, 0)) + 3;
  for (const V3d& p : {V3d(radius, 0, 0), V3d(0, -radius, 0), V3d(0, 0, radius), V3d(1, 1, 1).normalized() * radius}) EXPECT_NEAR(value_of(f, p), 0, 0.002) << p;
  EXPECT_LT(value_of(f, V3d(4, 0, 0)), 0);
  EXPECT_GT(value_of(f, V3d(0, 0, 0)), 0);
  (void)read("smoke.vdb", 0.5);
  const std::string points = folder + "points.vdb";
  EXPECT_EQ(fault([&](Report& report) { return read_scene(points, report); }),
            "5 " + points + ": grid \"points\" holds points, which cannot be baked; give a level set or a fog volume");
}

// --- shapes ---

Scene shape(const std::string& text) {
  Report report;
  return read_shape({text, "s.json"}, {}, report);
}
std::string shape_fault(const std::string& text) {
  return fault([&](Report& report) { return read_shape({text, "s.json"}, {}, report); });
}
std::string around(const std::string& node) { return "{\"format\": \"texel-shape\", \"shape\": " + node + "}"; }

TEST(Shapes, PrimitivesAreDistances) {
  struct Case {
    const char* node;
    V3d point;
    double distance;  // positive inside
  };
  const Case cases[] = {
      {R"({"sphere": {"center": [1, 0, 0], "radius": 2}})", V3d(1, 5, 0), -3},
      {R"({"box": {"min": [-1, -2, -3], "max": [1, 2, 3]}})", V3d(0, 0, 0), 1},
      {R"({"box": {"min": [-1, -2, -3], "max": [1, 2, 3]}})", V3d(4, 6, 0), -5},
      {R"({"box": {"min": [-1, -1, -1], "max": [1, 1, 1], "rounding": 0.5}})", V3d(3.5, 4.5, 0), 0.5 - 5},
      {R"({"torus": {"major": 3, "minor": 1}})", V3d(0, 3, 0.5), 0.5},
      {R"({"torus": {"axis": [1, 0, 0], "major": 3, "minor": 1}})", V3d(0, 0, 7), -3},
      {R"({"cylinder": {"from": [0, 0, 0], "to": [0, 0, 4], "radius": 1}})", V3d(0, 4, 8), -5},
      {R"({"cylinder": {"from": [0, 0, 0], "to": [0, 0, 4], "radius": 1}})", V3d(0.5, 0, 2), 0.5},
      {R"({"capsule": {"from": [0, 0, 0], "to": [0, 3, 4], "radius": 1}})", V3d(0, 6, 8), -4},
      {R"({"plane": {"point": [0, 0, 1], "normal": [0, 0, 2]}})", V3d(7, 7, 3), -2},
      {R"({"expression": "1 - x"})", V3d(3, 0, 0), -2},
      {R"({"sphere": {"radius": 1}, "transform": {"scale": 2, "translate": [10, 0, 0]}})", V3d(10, 0, 5), -3},
      {R"({"plane": {"normal": [1, 0, 0]}, "transform": {"rotate": [0, 0, 90]}})", V3d(5, 3, 1), -3},
      {R"({"plane": {"normal": [0, 0, 1]}, "transform": {"rotate": [90, 0, 90]}})", V3d(5, 3, 1), -5},  // z to −y about x, then to x about z
      {R"({"union": [{"sphere": {"radius": 1}}, {"sphere": {"center": [4, 0, 0], "radius": 2}}]})", V3d(7, 0, 0), -1},
      {R"({"intersection": [{"sphere": {"radius": 2}}, {"plane": {"normal": [1, 0, 0]}}]})", V3d(0.5, 0, 0), -0.5},
      {R"({"difference": [{"sphere": {"radius": 2}}, {"sphere": {"radius": 1}}]})", V3d(0, 0, 0), -1},
      {R"({"union": [{"plane": {"normal": [1, 0, 0]}}, {"plane": {"normal": [1, 0, 0]}}], "smooth": 0.4})", V3d(0, 0, 0), 0.1},
      {R"({"blobs": {"threshold": 0.5, "items": [{"point": [0, 0, 0], "radius": 2}]}})", V3d(0, 0, 1), 0.75 * 0.75 * 0.75 - 0.5},
      {R"({"blobs": {"falloff": "cubic", "items": [{"point": [0, 0, 0], "radius": 2, "weight": 3}]}})", V3d(0, 0, 1), 3 * 0.5 - 0.5},
      {R"({"blobs": {"items": [{"segment": [[0, 0, 0], [2, 0, 0]], "radius": [1, 3]}]}})", V3d(1, 1, 0), 0.75 * 0.75 * 0.75 - 0.5},
  };
  // Roundings of some tens of operations.
  for (const Case& c : cases) EXPECT_NEAR(value_of(*shape(around(c.node)).implicits[0].field, c.point), c.distance, 1e-13) << c.node;
}

TEST(Shapes, BoundsAndMaterial) {
  const Scene s = shape(R"({"format": "texel-shape", "iso": 0.25, "material": {"kd": [0.1, 0.2, 0.3], "ks": [0.5, 0.5, 0.5], "roughness": 0.4},
                            "shape": {"sphere": {"center": [3, 0, 0], "radius": 2}}})");
  EXPECT_EQ(s.implicits[0].iso, 0.25);
  EXPECT_NEAR(s.implicits[0].box.min.x, 1.25, 1e-6);
  EXPECT_NEAR(s.implicits[0].box.max.z, 1.75, 1e-6);
  EXPECT_EQ(s.materials[0].kd, V3f(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(s.materials[0].roughness, 0.4f);
  EXPECT_EQ(shape(R"({"format": "texel-shape", "box": [0, 0, 0, 1, 2, 3], "shape": {"plane": {"normal": [0, 0, 1]}}})").implicits[0].box, Box3d(V3d(0, 0, 0), V3d(1, 2, 3)));
  EXPECT_TRUE(shape(around(R"({"plane": {"normal": [0, 0, 1]}})")).implicits[0].box.isEmpty());
  const Box3d limbs = shape(around(R"({"blobs": {"items": [{"segment": [[0, 0, 0], [4, 0, 0]], "radius": 1}, {"point": [0, 3, 0], "radius": 2}]}})")).implicits[0].box;
  EXPECT_GT(limbs.max.x, 4);
  EXPECT_LT(limbs.max.x, 5);
  EXPECT_LT(limbs.max.y, 5);
}

TEST(Shapes, SaysWhatIsWrongAndWhere) {
  EXPECT_EQ(shape_fault("{\n\n,"), "3 s.json:3: is not JSON; a shape is {\"format\": \"texel-shape\", \"shape\": {...}}");
  EXPECT_EQ(shape_fault("[]"), "3 s.json: is not a shape: its \"format\" is not \"texel-shape\"; a recipe is given by --recipe");
  EXPECT_EQ(shape_fault("{\"iso\": 1e999}"), "3 s.json: holds a number too large to compute with; the largest is about 1e100");
  EXPECT_EQ(shape_fault("{}"), "3 s.json: is not a shape: its \"format\" is not \"texel-shape\"; a recipe is given by --recipe");
  EXPECT_EQ(shape_fault(R"({"format": "texel-shape"})"), "3 s.json: has no \"shape\"; see docs/inputs.md");
  EXPECT_EQ(shape_fault(R"({"format": "texel-shape", "version": 2})"), "3 s.json: /version is 2; this program reads version 1");
  EXPECT_EQ(shape_fault(R"({"format": "texel-shape", "colour": 1})"), "3 s.json: /\"colour\" is an unknown key; known: format, version, iso, box, material, shape");
  EXPECT_EQ(shape_fault(around("{}")), "3 s.json: /shape has no shape in it; see docs/inputs.md");
  EXPECT_TRUE(shape_fault(around(R"({"spere": {}})")).starts_with("3 s.json: /shape/\"spere\" is an unknown key; known: sphere, box, "));
  EXPECT_EQ(shape_fault(around(R"({"sphere": {"radius": -1}})")), "3 s.json: /shape/sphere/radius is -1; expected a number > 0");
  EXPECT_EQ(shape_fault(around(R"({"sphere": {}})")), "3 s.json: /shape/sphere has no \"radius\"; see docs/inputs.md");
  EXPECT_EQ(shape_fault(around(R"({"sphere": {"radius": 1, "size": 2}})")), "3 s.json: /shape/sphere/\"size\" is an unknown key; known: center, radius");
  EXPECT_EQ(shape_fault(around(R"({"sphere": {"radius": 1, "center": [1, 2]}})")), "3 s.json: /shape/sphere/center is [1,2]; expected 3 numbers");
  EXPECT_EQ(shape_fault(around(R"({"sphere": {"radius": 1}, "box": {}})")), "3 s.json: /shape has both \"box\" and \"sphere\"; join shapes by union, intersection or difference");
  EXPECT_EQ(shape_fault(around(R"({"union": []})")), "3 s.json: /shape/union is []; expected a list of shapes");
  EXPECT_EQ(shape_fault(around(R"({"union": [{"sphere": {"radius": 1}}, 7]})")), "3 s.json: /shape/union/1 is 7; expected an object with one shape in it");
  EXPECT_EQ(shape_fault(around(R"({"sphere": {"radius": 1}, "smooth": 1})")), "3 s.json: /shape/smooth belongs to union, intersection and difference; leave it out");
  EXPECT_EQ(shape_fault(around(R"({"blobs": {"falloff": "gauss", "items": [1]}})")), "3 s.json: /shape/blobs/falloff is \"gauss\"; known: wyvill, cubic");
  EXPECT_EQ(shape_fault(around(R"({"blobs": {"items": [{"radius": 1}]}})")), "3 s.json: /shape/blobs/items/0 needs a point or a segment; give one of them");
  EXPECT_EQ(shape_fault(around(R"({"expression": "x +"})")), "3 s.json: /shape/expression:4: ends too early; expected a number, a name or \"(\"");
  EXPECT_EQ(shape_fault(around(R"({"box": {"min": [0, 0, 0], "max": [1, 0, 1]}})")), "3 s.json: /shape/box has no volume; give \"min\" below \"max\" along every axis");
  EXPECT_EQ(shape_fault(around(R"({"capsule": {"from": [0, 0, 0], "to": [0, 0, 0], "radius": 1}})")), "3 s.json: /shape/capsule \"from\" and \"to\" are the same point; a ball is a sphere");
  EXPECT_EQ(shape_fault(R"({"format": "texel-shape", "material": {"kd": [2, 0, 0]}, "shape": {"sphere": {"radius": 1}}})"), "3 s.json: /material/kd/0 is 2; expected a number from 0 to 1");
  std::string deep = R"({"sphere": {"radius": 1}})";
  for (int i = 0; i < 100; ++i) deep = "{\"union\": [" + deep + "]}";
  EXPECT_NE(shape_fault(around(deep)).find("is nested more than 64 deep"), std::string::npos);
  EXPECT_EQ(shape_fault(std::string(100000, '[')).substr(0, 24), "3 s.json:1: is not JSON;");
}

}  // namespace
}  // namespace texel::test
