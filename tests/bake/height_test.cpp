// Height fields: volume and vector area of every voxel column against the analytic bilinear surface, closed whatever the holes.
#include "bake/height_mesh.h"

#include <tbb/global_control.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "bake/topology.h"
#include "formats/noise.h"
#include "formats/readers.h"
#include "tests/bake/bake_util.h"
#include "tests/formats/made_tiff.h"

namespace texel::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

HeightField make_field(int width, int height, V2d size, const std::function<double(int, int)>& z, double base) {
  HeightField field;
  field.name = "made";
  field.width = width;
  field.height = height;
  field.size = size;
  field.base = base;
  field.low = 1e300;
  field.high = -1e300;
  for (int row = 0; row < height; ++row)
    for (int x = 0; x < width; ++x) {
      const double v = z(x, height - 1 - row);  // y upwards
      field.z.push_back(v);
      if (std::isnan(v)) continue;
      field.low = std::min(field.low, v);
      field.high = std::max(field.high, v);
    }
  return field;
}

Scene scene_of(const HeightField& field) {
  Scene scene = empty_scene();
  scene.heights.push_back(field);
  return scene;
}
Scene meshed(const HeightField& field, const Recipe& recipe) {
  Report report;
  return mesh_heights(scene_of(field), recipe, report);
}

// The bilinear surface by its definition, cell by cell.
struct Bilinear {
  const HeightField& field;
  [[nodiscard]] double sample(int x, int y) const { return field.z[static_cast<std::size_t>((field.height - 1 - y) * field.width + x)]; }
  // Over [x0,x1] × [y0,y1]: ∫ (z − base), ∫ ∂z/∂x, ∫ ∂z/∂y, and the area covered. In a piece of a cell each is the value at its
  // middle times its area, for they are linear in x and in y.
  struct Integrals { double volume = 0, dx = 0, dy = 0, area = 0; };
  [[nodiscard]] Integrals over(double x0, double x1, double y0, double y1) const {
    Integrals sum;
    const int cx = field.width - 1, cy = field.height - 1;
    const double sx = field.size.x / cx, sy = field.size.y / cy;
    for (int j = 0; j < cy; ++j)
      for (int i = 0; i < cx; ++i) {
        const double a0 = std::max(x0, i * sx), a1 = std::min(x1, (i + 1) * sx), b0 = std::max(y0, j * sy), b1 = std::min(y1, (j + 1) * sy);
        const double z00 = sample(i, j), z10 = sample(i + 1, j), z01 = sample(i, j + 1), z11 = sample(i + 1, j + 1);
        if (a1 <= a0 || b1 <= b0 || std::isnan(z00 + z10 + z01 + z11)) continue;
        const double u = (0.5 * (a0 + a1) - i * sx) / sx, v = (0.5 * (b0 + b1) - j * sy) / sy, area = (a1 - a0) * (b1 - b0);
        sum.volume += area * (z00 * (1 - u) * (1 - v) + z10 * u * (1 - v) + z01 * (1 - u) * v + z11 * u * v - field.base);
        sum.dx += area * ((z10 - z00) * (1 - v) + (z11 - z01) * v) / sx;
        sum.dy += area * ((z01 - z00) * (1 - u) + (z11 - z10) * u) / sy;
        sum.area += area;
      }
    return sum;
  }
};

// Per column (x, y): Σ filled fraction, voxels; and Σ A n of border voxels, squared voxels.
struct Columns {
  V3i n;
  std::vector<double> filled;
  std::vector<V3d> vector_area;
  [[nodiscard]] std::size_t at(int x, int y) const { return static_cast<std::size_t>(y) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(x); }
};
Columns columns_of(const Stages& s) {
  Columns c{s.plan.grid.n, {}, {}};
  c.filled.assign(static_cast<std::size_t>(c.n.x) * static_cast<std::size_t>(c.n.y), 0);
  c.vector_area.assign(c.filled.size(), V3d(0, 0, 0));
  const Visibility& seen = s.seen.levels[0];
  // `solid` is a float: its own rounding is 2⁻²⁵ a voxel.
  for_each_voxel(s.surfaces[0].set, [&](const V3i& v, std::int64_t i) {
    c.filled[c.at(v.x, v.y)] += static_cast<double>(seen.solid[static_cast<std::size_t>(i)]);
    c.vector_area[c.at(v.x, v.y)] += s.surfaces[0].moments[static_cast<std::size_t>(i)].m;
  });
  for_each_voxel(seen.inside, [&](const V3i& v, std::int64_t) { c.filled[c.at(v.x, v.y)] += 1; });
  for (const V3i& b : seen.inside_blocks)
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y) c.filled[c.at(b.x * 8 + x, b.y * 8 + y)] += 8;
  return c;
}

struct ColumnError { double volume = 0, slope = 0, closed = 0; };  // largest; voxels, squared voxels
ColumnError column_error(const HeightField& field, const Stages& s) {
  const Bilinear truth{field};
  const Columns columns = columns_of(s);
  const Grid& g = s.plan.grid;
  ColumnError worst;
  for (int y = 0; y < g.n.y; ++y)
    for (int x = 0; x < g.n.x; ++x) {
      const double x0 = g.origin.x + x * g.h, y0 = g.origin.y + y * g.h;
      const auto exact = truth.over(x0, x0 + g.h, y0, y0 + g.h);
      worst.volume = std::max(worst.volume, std::abs(columns.filled[columns.at(x, y)] - exact.volume / (g.h * g.h * g.h)));
      const auto around = truth.over(x0 - 0.01 * g.h, x0 + 1.01 * g.h, y0 - 0.01 * g.h, y0 + 1.01 * g.h);
      if (around.area < 1.02 * 1.02 * g.h * g.h * (1 - 1e-9)) continue;  // walls stand in it or beside it
      const V3d m = columns.vector_area[columns.at(x, y)];
      worst.slope = std::max({worst.slope, std::abs(m.x + exact.dx / (g.h * g.h)), std::abs(m.y + exact.dy / (g.h * g.h))});
      worst.closed = std::max(worst.closed, std::abs(m.z));  // top and bottom cancel
    }
  return worst;
}

std::unique_ptr<Stages> baked(const HeightField& field, int resolution) {
  Recipe recipe = volume_recipe(resolution);
  recipe.samples = 4;
  return run_stages(meshed(field, recipe), recipe, true, 1);
}

TEST(HeightMesh, InclinedPlaneIsExact) {
  for (const int resolution : {9, 32, 77}) {
    const double a = 0.37, b = -0.21;
    const HeightField field = make_field(33, 17, V2d(2, 1), [&](int x, int y) { return 1 + a * (2.0 * x / 32) + b * (1.0 * y / 16); }, 0.3);
    const auto s = baked(field, resolution);
    const ColumnError error = column_error(field, *s);
    EXPECT_LT(error.volume, 40 * 0x1p-25) << "a float a voxel, " << resolution;
    EXPECT_LT(error.slope, 1e-12);
    const V3d n = V3d(-a, -b, 1).normalized();
    double area = 0;
    for (std::size_t t = 0; t < s->scene.mesh.triangles.size(); ++t) {
      const auto& c = s->scene.mesh.triangles[t];
      const V3d cross = (s->scene.mesh.points[c[1]] - s->scene.mesh.points[c[0]]).cross(s->scene.mesh.points[c[2]] - s->scene.mesh.points[c[0]]);
      if (!(cross.z > 0)) continue;  // walls and bottom
      area += cross.length() / 2;
      EXPECT_LT((cross.normalized() - n).length(), 1e-12);
    }
    EXPECT_NEAR(area / (2 * std::sqrt(1 + a * a + b * b)), 1, 1e-13);  // a sum of 1024 rounded areas
    EXPECT_LE(s->scene.mesh.triangles.size(), 2u * 32 * 16 + 4 * (32 + 16) + 2 * (32 + 16)) << "a plane needs no cutting";
  }
}

// Cells coarser than voxels, finer than voxels, and neither aligned nor square.
TEST(HeightMesh, VolumeAndVectorAreaOfEveryColumnAreExact) {
  Random random(5);
  struct Case { int w, h, resolution; V2d size; };
  for (const Case& c : {Case{5, 4, 64, V2d(1, 0.8)}, Case{90, 70, 24, V2d(1, 0.7)}, Case{31, 31, 30, V2d(3, 3)}, Case{2, 2, 20, V2d(1, 1)}}) {
    const HeightField field = make_field(c.w, c.h, c.size, [&](int, int) { return random.uniform(0, 0.4); }, -0.1);
    const auto s = baked(field, c.resolution);
    EXPECT_EQ(s->plan.statistics.components, 1);
    EXPECT_EQ(s->plan.statistics.closed, 1);
    const ColumnError error = column_error(field, *s);
    // A float a voxel, at most 30 border voxels a column; positions lose 1e-13 voxels where walls are put at integers.
    EXPECT_LT(error.volume, 30 * 0x1p-25) << c.w;
    EXPECT_LT(error.slope, 1e-11) << c.w;
    EXPECT_LT(error.closed, 1e-11) << c.w;
    EXPECT_NEAR(s->plan.statistics.volume / Bilinear{field}.over(-9, 9, -9, 9).volume, 1, 1e-12);
  }
}

// Mean normals of the voxels against the bilinear surface itself, taken at many points of every column.
TEST(HeightMesh, NormalsAreTheBilinearSurfaces) {
  Random random(8);
  const HeightField field = make_field(9, 9, V2d(1, 1), [&](int, int) { return random.uniform(0, 0.25); }, -0.1);  // slopes up to 2
  const auto s = baked(field, 34);
  const Grid& g = s->plan.grid;
  std::map<std::tuple<int, int, int>, V3d> truth;
  constexpr int kPoints = 100;
  const Bilinear surface{field};
  for (int y = 2; y + 2 < g.n.y; ++y)  // the columns before hold walls
    for (int x = 2; x + 2 < g.n.x; ++x)
      for (int k = 0; k < kPoints * kPoints; ++k) {
        const double px = (g.origin.x + (x + (k % kPoints + 0.5) / kPoints) * g.h) * 8, py = (g.origin.y + (y + (k / kPoints + 0.5) / kPoints) * g.h) * 8;
        const int i = std::clamp(static_cast<int>(px), 0, 7), j = std::clamp(static_cast<int>(py), 0, 7);
        const double u = px - i, v = py - j;
        const double z00 = surface.sample(i, j), z10 = surface.sample(i + 1, j), z01 = surface.sample(i, j + 1), z11 = surface.sample(i + 1, j + 1);
        const double z = z00 * (1 - u) * (1 - v) + z10 * u * (1 - v) + z01 * (1 - u) * v + z11 * u * v;
        const V3d n(-8 * ((z10 - z00) * (1 - v) + (z11 - z01) * v), -8 * ((z01 - z00) * (1 - u) + (z11 - z10) * u), 1);
        truth.try_emplace({x, y, static_cast<int>(std::floor((z - g.origin.z) / g.h))}, V3d(0, 0, 0)).first->second += n / (kPoints * kPoints);
      }
  double worst = 0, sum = 0, weight = 0;
  for_each_voxel(s->surfaces[0].set, [&](const V3i& v, std::int64_t i) {
    const Moments& m = s->surfaces[0].moments[static_cast<std::size_t>(i)];
    const auto found = truth.find({v.x, v.y, v.z});
    if (found == truth.end() || !(m.m.z > 0) || m.covered < 0.1) return;
    const double angle = std::acos(std::min(1.0, m.m.normalized().dot(found->second.normalized()))) * 180 / M_PI;
    worst = std::max(worst, angle);
    sum += angle * m.covered;
    weight += m.covered;
  });
  std::printf("normals of a rough field, voxels against the bilinear surface: mean %.4f degrees, largest %.3f\n", sum / weight, worst);
  // Pieces have a twist of at most a voxel, which keeps a fan within 1/16 voxel of the bilinear surface: so much of a voxel's surface may be
  // its neighbour's above or below, whose normals are up to a radian away here; most voxels have no such neighbour.
  EXPECT_LT(worst, 180 / M_PI / 16);
  EXPECT_LT(sum / weight, 180 / M_PI / 16 / 16);
  EXPECT_GT(weight, 1000);
}

TEST(HeightMesh, HolesAreClosed) {
  Random random(3);
  for (int round = 0; round < 20; ++round) {
    const double share = round * 0.03;
    const HeightField field = make_field(12, 9, V2d(1.2, 0.9), [&](int, int) { return random.uniform() < share ? kNan : random.uniform(0, 0.3); }, round % 2 ? 0 : -0.2);
    const auto s = baked(field, 26);
    EXPECT_EQ(s->plan.statistics.closed, s->plan.statistics.components) << round;
    EXPECT_TRUE(s->report.issues.empty()) << (s->report.issues.empty() ? "" : s->report.issues[0].text);
    EXPECT_NEAR(s->plan.statistics.volume / Bilinear{field}.over(-9, 9, -9, 9).volume, 1, 1e-12) << round;
    EXPECT_LT(column_error(field, *s).volume, 40 * 0x1p-25) << round;
  }
}

TEST(HeightMesh, TouchingTheBaseIsStillClosed) {
  const HeightField field = make_field(8, 8, V2d(1, 1), [](int x, int y) { return x < 3 || y == 7 || (x == 5 && y == 0) ? 0 : 0.2 + 0.01 * x * y; }, 0);
  const auto s = baked(field, 20);
  EXPECT_EQ(s->plan.statistics.closed, s->plan.statistics.components);
  EXPECT_EQ(s->plan.statistics.degenerate, 0);
  EXPECT_LT(column_error(field, *s).volume, 40 * 0x1p-25);
}

TEST(HeightMesh, SixteenBitsDifferFromEight) {
  // A ramp of a 16-bit picture is a plane; its 8-bit copy is 256 stairs.
  const auto fine = baked(make_field(1024, 4, V2d(1, 0.01), [](int x, int) { return x * 64 / 65535.0; }, -0.01), 64);
  const auto coarse = baked(make_field(1024, 4, V2d(1, 0.01), [](int x, int) { return (x * 64 / 257) / 255.0; }, -0.01), 64);
  const auto top = [](const Mesh& mesh) {
    double area = 0;
    for (const auto& t : mesh.triangles) {
      const V3d cross = (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]);
      if (cross.z > 0) area += cross.length() / 2;
    }
    return area;
  };
  // Of 1023 steps a quarter rise by 1/255, the others not: (3 + sqrt(1 + (1023/255)²))/4 of the ground against sqrt(2 - ...) of the plane.
  EXPECT_NEAR(top(fine->scene.mesh) / 0.01, std::sqrt(1 + std::pow(1023 * 64 / 65535.0, 2)), 1e-9);
  EXPECT_NEAR(top(coarse->scene.mesh) / 0.01, (3 + std::sqrt(1 + std::pow(1023 / 255.0, 2))) / 4, 0.02);
}

// Filled voxels of each column of a pack, x fastest.
std::vector<double> filled_columns(const Pack& pack) {
  const Dense solid = dense(pack.levels[0], "solid");
  std::vector<double> filled(static_cast<std::size_t>(solid.n.x) * static_cast<std::size_t>(solid.n.y), 0);
  for_each_cell(solid.n, [&](const V3i& v) { filled[static_cast<std::size_t>(v.y) * static_cast<std::size_t>(solid.n.x) + static_cast<std::size_t>(v.x)] += static_cast<double>(solid.at(v)); });
  return filled;
}

// The same picture with 16 and with 8 bits, from file to pack. A column is the mean height over it, and bilinear means of samples that are
// off by half a step at most are off by no more.
TEST(HeightPack, SixteenBitsAreExactAndEightAreOffByHalfAStep) {
  constexpr int kWidth = 61, kHeight = 46, kResolution = 96;
  constexpr double kTop = 0.9;
  const auto exact = [](int x, int row) {
    const double u = x / (kWidth - 1.0), v = row / (kHeight - 1.0);
    return 0.5 + 0.3 * std::sin(7 * u + 2) * std::cos(5 * v) + 0.12 * std::sin(23 * u * v + 11 * v);
  };
  std::vector<std::uint16_t> fine;
  std::vector<std::uint8_t> coarse;
  for (int row = 0; row < kHeight; ++row)
    for (int x = 0; x < kWidth; ++x) {
      fine.push_back(static_cast<std::uint16_t>(std::lround(65535 * exact(x, row))));
      coarse.push_back(static_cast<std::uint8_t>(std::lround(fine.back() / 257.0)));
    }
  Recipe recipe = volume_recipe(kResolution);
  recipe.box = Box3d(V3d(0, 0, -0.125), V3d(1, 0.75, 1));
  const auto bake_file = [&](int bits, const std::string& samples) {
    const std::string path = ::testing::TempDir() + "texel_height_pack_" + std::to_string(bits) + ".tif";
    std::ofstream(path, std::ios::binary) << tiff_bytes({.width = kWidth, .height = kHeight, .bits = bits, .kind = 1, .samples = samples});
    HeightOptions options;
    options.extent = V2d(1, 0.75);
    options.height = kTop;
    options.base = -0.1;
    Report report;
    const Scene scene = read_scene(std::span(&path, 1), {.implicit = "", .iso = {}, .heights = options}, report);
    const Pack pack = bake(scene, recipe, report);
    std::filesystem::remove(path);
    return pack;
  };
  const Pack fine_pack = bake_file(16, stored(fine)), coarse_pack = bake_file(8, stored(coarse));
  ASSERT_EQ(fine_pack.grid.n, coarse_pack.grid.n);
  const std::vector<double> sixteen = filled_columns(fine_pack), eight = filled_columns(coarse_pack);

  // The truth has heights that were never rounded.
  const HeightField field = make_field(kWidth, kHeight, V2d(1, 0.75), [&](int x, int y) { return kTop * exact(x, kHeight - 1 - y); }, -0.1);
  const Bilinear truth{field};
  const Grid& g = fine_pack.grid;
  const double step = kTop / 255 / g.h, fine_step = kTop / 65535 / g.h;  // voxels
  double worst_fine = 0, worst_coarse = 0, worst = 0, square = 0;
  for (int y = 0; y < g.n.y; ++y)
    for (int x = 0; x < g.n.x; ++x) {
      const double x0 = g.origin.x + x * g.h, y0 = g.origin.y + y * g.h;
      const double filled = truth.over(x0, x0 + g.h, y0, y0 + g.h).volume / (g.h * g.h * g.h);
      const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(g.n.x) + static_cast<std::size_t>(x);
      worst_fine = std::max(worst_fine, std::abs(sixteen[at] - filled));
      worst_coarse = std::max(worst_coarse, std::abs(eight[at] - filled));
      worst = std::max(worst, std::abs(sixteen[at] - eight[at]));
      square += std::pow(sixteen[at] - eight[at], 2);
    }
  const double rms = std::sqrt(square / static_cast<double>(sixteen.size()));
  std::printf("columns, voxels: 16 bits off by %.2e at most (half a step is %.2e), 8 bits by %.3f (%.3f); they differ by %.3f rms, %.3f at most\n", worst_fine,
              fine_step / 2, worst_coarse, step / 2, rms, worst);
  const double rounding = 30 * 0x1p-25;  // a float a border voxel
  EXPECT_LE(worst_fine, fine_step / 2 + rounding);
  EXPECT_LE(worst_coarse, (step + fine_step) / 2 + rounding);  // it was made from the 16 bits
  EXPECT_LE(worst, step / 2 + rounding);
  // The difference is there, and of the size chance gives: rounding is off by step/√12, and a place between four samples by 2/3 of it. That
  // is for points: columns of 0.6 squares average a little more.
  EXPECT_GT(worst, 0.4 * step);
  EXPECT_NEAR(rms / (step / std::sqrt(12.0) * 2 / 3), 0.95, 0.1);
}

TEST(HeightMesh, CyclicFieldsRepeatBitForBit) {
  Random random(9);
  Recipe recipe = volume_recipe(21);
  const HeightField field = make_field(7, 5, V2d(0.7, 0.5), [&](int, int) { return random.uniform(0, 0.2); }, -0.1);
  for (const std::array<bool, 3>& cyclic : {std::array<bool, 3>{true, true, false}, std::array<bool, 3>{true, false, false}}) {
    recipe.cyclic = cyclic;
    const Scene scene = meshed(field, recipe);
    // Every point of one end is there at the other end.
    for (int a = 0; a < 2; ++a) {
      std::vector<V3d> ends[2];
      for (const auto& t : scene.mesh.triangles)
        for (const std::uint32_t v : t) {
          V3d p = scene.mesh.points[v];
          if (p[a] != 0 && p[a] != field.size[a]) continue;
          const int end = p[a] == 0 ? 0 : 1;
          p[a] = 0;
          ends[end].push_back(p);
        }
      const auto less = [](const V3d& p, const V3d& q) { return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z); };
      for (auto& end : ends) {
        std::sort(end.begin(), end.end(), less);
        end.erase(std::unique(end.begin(), end.end()), end.end());
      }
      ASSERT_FALSE(ends[0].empty());
      if (cyclic[static_cast<std::size_t>(a)]) EXPECT_EQ(ends[0], ends[1]) << a;
      else EXPECT_NE(ends[0], ends[1]) << a;
    }
    // Beside the open ends nothing is open: shifted copies would close it.
    const Topology topology = find_topology(scene.mesh.points, scene.mesh.triangles);
    std::int64_t open = 0;
    for (const auto& part : topology.components) open += part.open_edges;
    EXPECT_GT(open, 0);
  }
}

TEST(HeightMesh, SameTrianglesAtAnyNumberOfThreads) {
  Random random(4);
  Recipe recipe = volume_recipe(50);
  const HeightField field = make_field(60, 40, V2d(3, 2), [&](int, int) { return random.uniform() < 0.01 ? kNan : random.uniform(0, 0.2); }, -0.1);
  Scene first;
  for (const std::size_t threads : {1u, 2u, 5u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    Scene scene = meshed(field, recipe);
    if (threads == 1) first = std::move(scene);
    else {
      EXPECT_EQ(scene.mesh.points, first.mesh.points);
      EXPECT_EQ(scene.mesh.triangles, first.mesh.triangles);
    }
  }
}

TEST(HeightMesh, BakeTakesFieldsByItself) {
  const HeightField field = make_field(6, 6, V2d(1, 1), [](int x, int y) { return 0.05 * ((x * y) % 4); }, -0.2);
  const Recipe recipe = volume_recipe(24);
  const Pack pack = bake_quietly(scene_of(field), recipe);
  check_invariants(pack);
  EXPECT_NEAR(filled_volume(pack) / Bilinear{field}.over(-9, 9, -9, 9).volume, 1, 1e-6);  // floats
  EXPECT_FALSE(has_issue(pack, "mesh-open"));
}

// Meyer & Neyret's cyclic field. The truth: the noise's own values and gradients.
TEST(PerlinMesh, ColumnsAndNormalsAreTheNoises) {
  HeightOptions options;
  options.perlin = {3, 3, 1};
  options.base = -0.05;
  const Scene made = make_perlin_field(options);
  const HeightField& field = made.heights[0];
  Recipe recipe = volume_recipe(64);
  recipe.samples = 4;
  const auto s = run_stages(meshed(field, recipe), recipe, true, 1);
  EXPECT_EQ(s->plan.statistics.closed, 1);
  const Columns columns = columns_of(*s);
  const Grid& g = s->plan.grid;
  constexpr int kPoints = 64;
  double worst_volume = 0, worst_slope = 0;
  for (int y = 2; y + 2 < g.n.y; y += 5)  // the columns before hold walls
    for (int x = 2; x + 2 < g.n.x; ++x) {
      double mean = 0, dx = 0, dy = 0;
      std::vector<double> px, py, z(kPoints * kPoints);
      for (int k = 0; k < kPoints * kPoints; ++k) {
        px.push_back(g.origin.x + (x + (k % kPoints + 0.5) / kPoints) * g.h);
        py.push_back(g.origin.y + (y + (k / kPoints + 0.5) / kPoints) * g.h);
      }
      field.function(z.size(), px.data(), py.data(), z.data(), nullptr, nullptr);
      for (const double v : z) mean += (v - field.base) / (g.h * kPoints * kPoints);
      // ∫ ∂z/∂x over the column is the difference of the line integrals at its ends.
      for (int end = 0; end < 2; ++end) {
        std::vector<double> along, across(kPoints), here(kPoints, g.origin.x + (x + end) * g.h), there(kPoints, g.origin.y + (y + end) * g.h);
        std::vector<double> own(kPoints), other(kPoints);
        for (int k = 0; k < kPoints; ++k) along.push_back((k + 0.5) / kPoints * g.h);
        for (int k = 0; k < kPoints; ++k) { own[static_cast<std::size_t>(k)] = g.origin.y + y * g.h + along[static_cast<std::size_t>(k)]; other[static_cast<std::size_t>(k)] = g.origin.x + x * g.h + along[static_cast<std::size_t>(k)]; }
        field.function(kPoints, here.data(), own.data(), across.data(), nullptr, nullptr);
        for (const double v : across) dx += (end ? v : -v) / (kPoints * g.h);
        field.function(kPoints, other.data(), there.data(), across.data(), nullptr, nullptr);
        for (const double v : across) dy += (end ? v : -v) / (kPoints * g.h);
      }
      worst_volume = std::max(worst_volume, std::abs(columns.filled[columns.at(x, y)] - mean));
      const V3d m = columns.vector_area[columns.at(x, y)];
      worst_slope = std::max({worst_slope, std::abs(m.x + dx), std::abs(m.y + dy)});
    }
  std::printf("cyclic noise at 64: largest error of a column's volume %.2g voxels, of its mean slope %.2g\n", worst_volume, worst_slope);
  EXPECT_LT(worst_volume, 5e-5);  // the midpoint rule's own error with 64 points; the field has 5 voxels a lattice cell
  EXPECT_LT(worst_slope, 2e-2);
}

}  // namespace
}  // namespace texel::test
