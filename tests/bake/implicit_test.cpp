// Implicit surfaces against analytic and high-precision values: area, volume, normals; closedness; skipping; what is wrong with functions.
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bake/polygonize.h"
#include "bake/topology.h"
#include "formats/expression.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

constexpr double kPi = std::numbers::pi;

Scene implicit_scene(const std::string& expression, const Box3d& box = {}, double iso = 0) {
  Scene scene = empty_scene();
  auto field = read_expression(expression);
  scene.implicits.push_back({field, iso, box.isEmpty() ? field->bounds(iso) : box, 0, "--implicit"});
  return scene;
}

Recipe boxed_recipe(int resolution, const Box3d& box) {
  Recipe recipe = volume_recipe(resolution);
  recipe.box = box;
  return recipe;
}


struct Made {
  Scene scene;
  Plan plan;
  Report report;
};
Made make(const Scene& scene, const Recipe& recipe) {
  Made made;
  made.scene = polygonize(scene, recipe, made.report);
  made.plan = make_plan(made.scene, recipe, std::vector<bool>(made.scene.materials.size(), false), made.report);
  return made;
}
double count_of(const Report& report, const std::string& what) {
  for (const auto& [name, value] : report.counts)
    if (name == what) return value;
  ADD_FAILURE() << "no count " << what;
  return 0;
}
std::int64_t issue_count(const Report& report, const std::string& id) {
  for (const Issue& i : report.issues)
    if (i.id == id) return i.count;
  return 0;
}
// Every edge's triangles cancel, and none had to be turned for it.
void expect_closed(const Mesh& mesh) {
  ASSERT_FALSE(mesh.triangles.empty());
  const Topology topology = find_topology(mesh.points, mesh.triangles);
  for (const Topology::Component& c : topology.components) {
    EXPECT_TRUE(c.closed) << c.open_edges << " open edges";
    EXPECT_EQ(c.turned, 0);
  }
}

// ∫ over [a, b] by the tanh-sinh rule (Takahasi & Mori 1974), whose nodes crowd at the ends: roots there cost no digits.
double integrate(double a, double b, const std::function<double(double)>& f) {
  constexpr double kStep = 1.0 / 32;
  double sum = 0;
  for (int i = -128; i <= 128; ++i) {
    const double t = i * kStep, u = kPi / 2 * std::sinh(t), x = std::tanh(u), w = kPi / 2 * std::cosh(t) / std::pow(std::cosh(u), 2);
    if (w > 1e-18) sum += w * f((a + b) / 2 + (b - a) / 2 * x);
  }
  return sum * kStep * (b - a) / 2;
}

const std::string kGyroid = "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)";
const Box3d kGyroidCell(V3d(0, 0, 0), V3d(2 * kPi, 2 * kPi, 2 * kPi));

// ∫ n_z² dA = ∫∫ Σ |n_z| dx dy over the roots z, and by the function's symmetry the area is three times that.
double gyroid_area() {
  const auto column = [](double x, double y) {
    const double a = std::sin(y), b = std::cos(x), c = std::sin(x) * std::cos(y), r = std::hypot(a, b);
    if (!(std::abs(c) < r)) return 0.0;
    double sum = 0;
    for (const double side : {-1.0, 1.0}) {
      const double z = std::atan2(b, a) + side * std::acos(-c / r);  // a cos z + b sin z = −c
      const V3d g(std::cos(x) * std::cos(y) - std::sin(z) * std::sin(x), std::cos(y) * std::cos(z) - std::sin(x) * std::sin(y), std::cos(z) * std::cos(x) - std::sin(y) * std::sin(z));
      sum += std::abs(g.z) / g.length();
    }
    return sum;
  };
  // Without roots where cos²y > (1 + cos²x)/(1 + sin²x), which happens for cos²x < sin²x only. By symmetry x and y in the first quarter.
  const auto row = [&](double x) {
    const double square = (1 + std::pow(std::cos(x), 2)) / (1 + std::pow(std::sin(x), 2));
    const double from = square < 1 ? std::acos(std::sqrt(square)) : 0;
    double sum = 0;
    for (const double sx : {-1.0, 1.0})  // f changes with the signs of sin and cos: all sixteen quarters, as four by periods
      for (const double cy : {-1.0, 1.0})
        for (const double ox : {0.0, kPi})
          for (const double oy : {0.0, kPi}) sum += integrate(from, kPi / 2, [&](double y) { return column(ox + sx * x, oy + cy * y); });
    return sum;
  };
  return 3 * (integrate(0, kPi / 4, row) + integrate(kPi / 4, kPi / 2, row));
}

// Two of Wyvill's blobs of radius 1 at x = ±0.5, where their sum is 0.3: a body of revolution about x.
const std::string kBlobs = "a = max(1 - ((x - 0.5)^2 + y*y + z*z), 0); b = max(1 - ((x + 0.5)^2 + y*y + z*z), 0); a^3 + b^3 - 0.3";
struct Revolved { double area = 0, volume = 0; };
Revolved blobs_truth() {
  const auto value = [](double x, double q) {  // q: squared distance from the axis
    const double a = std::max(1 - ((x - 0.5) * (x - 0.5) + q), 0.0), b = std::max(1 - ((x + 0.5) * (x + 0.5) + q), 0.0);
    return a * a * a + b * b * b - 0.3;
  };
  const auto root = [](auto f, double in, double out) {
    for (int i = 0; i < 200; ++i) (f((in + out) / 2) >= 0 ? in : out) = (in + out) / 2;
    return in;
  };
  const double end = root([&](double x) { return value(x, 0); }, 0.5, 1.6);
  const auto squared_radius = [&](double x) { return value(x, 0) >= 0 ? root([&](double q) { return value(x, q); }, 0.0, 1.0) : 0.0; };
  Revolved r;
  r.volume = 2 * integrate(0, end, [&](double x) { return kPi * squared_radius(x); });
  // 2π r √(1 + r'²) = 2π √(r² + (r r')²), and q = r² has the derivative −f_x/f_q.
  r.area = 2 * integrate(0, end, [&](double x) {
    const double q = squared_radius(x), a = std::max(1 - ((x - 0.5) * (x - 0.5) + q), 0.0), b = std::max(1 - ((x + 0.5) * (x + 0.5) + q), 0.0);
    const double fx = -6 * a * a * (x - 0.5) - 6 * b * b * (x + 0.5), fq = -3 * a * a - 3 * b * b;
    return 2 * kPi * std::sqrt(q + std::pow(-fx / fq / 2, 2));
  });
  return r;
}

struct Case {
  const char* name;
  std::string expression;
  Box3d box;
  double area, volume;
  double area_bound, volume_bound;  // relative, at 128
};

TEST(Implicit, AreaAndVolumeConvergeAsTheSquareOfTheCell) {
  const Box3d box(V3d(-1.25, -1.25, -1.25), V3d(1.25, 1.25, 1.25)), wide(V3d(-1.5, -1.5, -1.5), V3d(1.5, 1.5, 1.5));
  const Revolved blobs = blobs_truth();
  // Chords of a surface with curvature 1/R miss it by 1/(8R) cells: relative 1/(8R)·(1/R + 1/R') of area and volume per unit thickness,
  // and a few times that for diagonals. R is in cells: sphere 51, torus tube 12.8, gyroid about 20, blobs about 30.
  const Case cases[] = {
      {"sphere", "1 - length(x, y, z)", box, 4 * kPi, 4 * kPi / 3, 1.2e-4, 2.4e-4},
      {"torus", "0.25 - length(length(x, y) - 0.75, z)", box, 4 * kPi * kPi * 0.75 * 0.25, 2 * kPi * kPi * 0.75 * 0.0625, 3e-4, 1.2e-3},
      {"gyroid", kGyroid, kGyroidCell, gyroid_area(), 4 * kPi * kPi * kPi, 1.5e-4, 1e-12},  // both halves are alike: its volume has no error
      {"blobs", kBlobs, wide, blobs.area, blobs.volume, 3e-4, 6e-4}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    double area[3], volume[3];
    for (int i = 0; i < 3; ++i) {
      const Made made = make(implicit_scene(c.expression, c.box), boxed_recipe(32 << i, c.box));
      area[i] = made.plan.statistics.area / c.area - 1;
      volume[i] = made.plan.statistics.volume / c.volume - 1;
    }
    EXPECT_LE(std::abs(area[2]), c.area_bound);
    EXPECT_LE(std::abs(volume[2]), c.volume_bound);
    const double slope_a = std::log2(area[0] / area[2]) / 2, slope_v = std::log2(volume[0] / volume[2]) / 2;
    EXPECT_NEAR(slope_a, 2, 0.15);
    if (c.volume_bound > 1e-9) { EXPECT_NEAR(slope_v, 2, 0.15); }
    std::printf("%s at 32, 64, 128: area %+.2e %+.2e %+.2e (slope %.2f), volume %+.2e %+.2e %+.2e (slope %.2f)\n", c.name, area[0], area[1], area[2], slope_a, volume[0],
                volume[1], volume[2], slope_v);
  }
}

// Planes are what cells hold exactly, whatever their direction, and what a box cuts off is not missed.
TEST(Implicit, PlanesAreExact) {
  const Box3d box(V3d(-1, -1, -1), V3d(1, 1, 1));
  const Made flat = make(implicit_scene("0.3 - z", box), boxed_recipe(16, box));
  EXPECT_NEAR(flat.plan.statistics.area, 4, 1e-12);
  EXPECT_NEAR(flat.plan.statistics.volume, 4 * 1.3, 1e-12);
  const Made tilted = make(implicit_scene("0.1*x + 0.2*y - z", box), boxed_recipe(16, box));
  EXPECT_NEAR(tilted.plan.statistics.area, 4 * std::sqrt(1.05), 1e-11);
  EXPECT_NEAR(tilted.plan.statistics.volume, 4, 1e-11);
  expect_closed(tilted.scene.mesh);
  // The pack fills to the box's walls and has no surface in them.
  Report report;
  const Pack pack = bake(implicit_scene("0.1*x + 0.2*y - z", box), boxed_recipe(16, box), report);
  EXPECT_NEAR(filled_volume(pack), 4, 1e-6);
  EXPECT_NEAR(sum_of(pack.levels[0], "area") * std::pow(pack.grid.h, 2), 4 * std::sqrt(1.05), 1e-5);
  check_invariants(pack);
}

// Trilinear over random values at the lattice's own points: every pattern of corners comes.
class RandomField final : public Field {
 public:
  explicit RandomField(double not_numbers) : not_numbers_(not_numbers) {}
  [[nodiscard]] double corner(int i, int j, int k) const {
    Random random(static_cast<std::uint64_t>((k * 1000 + j) * 1000 + i));
    if (random.uniform() < not_numbers_) return std::nan("");
    const double v = random.uniform(-1, 1);
    return std::abs(v) < 0.1 ? 0 : v;  // some exactly on the surface
  }
  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override {
    for (std::size_t p = 0; p < n; ++p) {
      const double cx = std::floor(x[p]), cy = std::floor(y[p]), cz = std::floor(z[p]);
      f[p] = 0;
      for (int c = 0; c < 8; ++c) {
        const double w = (c & 1 ? x[p] - cx : 1 - x[p] + cx) * (c & 2 ? y[p] - cy : 1 - y[p] + cy) * (c & 4 ? z[p] - cz : 1 - z[p] + cz);
        if (w > 0) f[p] += w * corner(static_cast<int>(cx) + (c & 1), static_cast<int>(cy) + (c >> 1 & 1), static_cast<int>(cz) + (c >> 2));
      }
    }
  }
  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    values(n, x, y, z, f);
    std::fill_n(gx, n, 0.0);
    std::fill_n(gy, n, 0.0);
    std::fill_n(gz, n, std::nan(""));
  }
  [[nodiscard]] Interval range(const Box3d&) const override { return {std::nan(""), std::nan("")}; }
  [[nodiscard]] Box3d bounds(double) const override { return {}; }

 private:
  double not_numbers_;
};

TEST(Implicit, ClosedForEveryPatternOfCorners) {
  for (const double not_numbers : {0.0, 0.2}) {
    const auto field = std::make_shared<RandomField>(not_numbers);
    const int n = 24;
    bool seen[256] = {};
    for_each_cell(V3i(n - 1, n - 1, n - 1), [&](const V3i& c) {
      int pattern = 0;
      for (int i = 0; i < 8; ++i) pattern |= (field->corner(c.x + (i & 1), c.y + (i >> 1 & 1), c.z + (i >> 2)) >= 0) << i;
      seen[pattern] = true;
    });
    EXPECT_EQ(std::count(seen, seen + 256, true), 256);
    Scene scene = empty_scene();
    const Box3d box(V3d(0, 0, 0), V3d(n, n, n));
    scene.implicits.push_back({field, 0, box, 0, "random"});
    const Made made = make(scene, boxed_recipe(n, box));
    expect_closed(made.scene.mesh);
    EXPECT_EQ(issue_count(made.report, "implicit-nan") > 0, not_numbers > 0);
    EXPECT_EQ(issue_count(made.report, "implicit-jump"), 0);
    EXPECT_EQ(issue_count(made.report, "degenerate-triangles"), 0);
    Report report;
    check_invariants(bake(scene, boxed_recipe(n, box), report));
  }
}

TEST(Implicit, TheSameForEveryNumberOfThreads) {
  Recipe recipe = boxed_recipe(48, kGyroidCell);
  const Scene scene = implicit_scene(kGyroid, kGyroidCell);
  Report report;
  std::unique_ptr<tbb::global_control> one = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, 1);
  const Mesh a = polygonize(scene, recipe, report).mesh;
  one.reset();
  for (int i = 0; i < 3; ++i) {
    const Mesh b = polygonize(scene, recipe, report).mesh;
    EXPECT_EQ(a.points, b.points);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.normals, b.normals);
  }
}

TEST(Implicit, MostBricksAreNotSampled) {
  Report report;
  (void)polygonize(implicit_scene(kGyroid, kGyroidCell), boxed_recipe(512, kGyroidCell), report);
  const double share = count_of(report, "bricks sampled") / count_of(report, "bricks");
  EXPECT_LT(share, 0.15);
  std::printf("gyroid 512^3, one period: %.2f %% of the bricks sampled\n", 100 * share);
}

// A range that is wrong: says "empty" of everything but one corner of space.
class Liar final : public Field {
 public:
  explicit Liar(std::shared_ptr<const Field> truth) : truth_(std::move(truth)) {}
  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override { truth_->values(n, x, y, z, f); }
  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    truth_->gradients(n, x, y, z, f, gx, gy, gz);
  }
  [[nodiscard]] Interval range(const Box3d& box) const override { return box.min.x > -0.5 ? Interval{-2, -1} : Interval{-1, 1}; }
  [[nodiscard]] Box3d bounds(double iso) const override { return truth_->bounds(iso); }

 private:
  std::shared_ptr<const Field> truth_;
};

TEST(Implicit, AWrongRangeLeavesNoHole) {
  const Box3d box(V3d(-1.2, -1.2, -1.2), V3d(1.2, 1.2, 1.2));
  Scene scene = implicit_scene("1 - length(x, y, z)", box);
  const Made honest = make(scene, boxed_recipe(40, box));
  scene.implicits[0].field = std::make_shared<Liar>(scene.implicits[0].field);
  const Made lied = make(scene, boxed_recipe(40, box));
  expect_closed(lied.scene.mesh);
  EXPECT_EQ(lied.scene.mesh.triangles.size(), honest.scene.mesh.triangles.size());
}

TEST(Implicit, NotANumberCountsAsOutside) {
  // Half a ball: the function ends at x = 0.2 with the root's argument.
  const Box3d box(V3d(-1.25, -1.25, -1.25), V3d(1.25, 1.25, 1.25));
  const Made made = make(implicit_scene("1 - length(x, y, z) + 0*sqrt(0.2 - x)", box), boxed_recipe(64, box));
  expect_closed(made.scene.mesh);
  EXPECT_GT(issue_count(made.report, "implicit-nan"), 0);
  const double height = 1.2;  // a ball's cap
  EXPECT_NEAR(made.plan.statistics.volume, kPi * height * height * (3 - height) / 3, 0.01);
}

TEST(Implicit, JumpsAreSurface) {
  // Stairs: sign jumps from -1 to 1 where its argument changes sign.
  const Box3d box(V3d(-1.25, -1.25, -1.25), V3d(1.25, 1.25, 1.25));
  const Made made = make(implicit_scene("sign(1 - length(x, y, z))", box), boxed_recipe(64, box));
  expect_closed(made.scene.mesh);
  EXPECT_GT(issue_count(made.report, "implicit-jump"), 0);
  EXPECT_NEAR(made.plan.statistics.volume, 4 * kPi / 3, 0.01);
  const Made steep = make(implicit_scene("atan(1e6*(1 - length(x, y, z)))", box), boxed_recipe(64, box));
  EXPECT_EQ(issue_count(steep.report, "implicit-jump"), 0);
  EXPECT_NEAR(steep.plan.statistics.volume, made.plan.statistics.volume, 1e-9);
}

TEST(Implicit, NothingToBake) {
  const Box3d box(V3d(0, 0, 0), V3d(1, 1, 1));
  const auto message = [&](const std::string& expression, const Box3d& given) {
    Report report;
    Recipe recipe = volume_recipe(16);
    if (!given.isEmpty()) recipe.box = given;
    try {
      (void)bake(implicit_scene(expression, given), recipe, report);
    } catch (const Error& e) {
      return std::to_string(static_cast<int>(e.code)) + " " + e.what();
    }
    return std::string("no error");
  };
  EXPECT_EQ(message("-1", box), "3 --implicit: the function is nowhere >= 0 in the box; change --iso or --box");
  EXPECT_EQ(message("1", box), "3 --implicit: the function is >= 0 all over the box, so that no surface is in it; change --iso or --box");
  EXPECT_EQ(message("x", {}), "1 --box: missing: nothing says where --implicit ends; give X0,Y0,Z0,X1,Y1,Z1");
}

TEST(Implicit, JoinsMeshes) {
  // A ball of triangles and one by expression, apart: twice the volume of one.
  Scene scene = implicit_scene("0.5 - length(x - 2, y, z)");
  add_ball(scene, 0.5, 64);
  Report report;
  const Pack pack = bake(scene, volume_recipe(96), report);
  EXPECT_NEAR(filled_volume(pack), 2 * kPi / 6, 0.005);
  EXPECT_EQ(pack.statistics.components, 2);
  EXPECT_EQ(pack.statistics.closed, 2);
  check_invariants(pack);
}

// Voxel by voxel against the sums of 8³ finer ones: the mean normals, and how much the normals of a voxel spread, as the
// surface's own normals at the triangles' corners tell.
TEST(Implicit, NormalsOfVoxels) {
  const Box3d box(V3d(-1.25, -1.25, -1.25), V3d(1.25, 1.25, 1.25));
  const Scene scene = implicit_scene("1 - length(x, y, z)", box);
  const auto surface = [&](int resolution, int levels) {
    const Recipe r = boxed_recipe(resolution, box);
    Report report;
    auto stages = run_stages(polygonize(scene, r, report), r, false, levels + 1);
    return std::move(stages->surfaces[static_cast<std::size_t>(levels)]);
  };
  double rms[2], second[2];
  for (int i = 0; i < 2; ++i) {
    const int n = 24 << i;
    const Surface a = surface(n, 0), b = surface(8 * n, 3);
    std::map<std::tuple<int, int, int>, Moments> truth;
    for_each_voxel(b.set, [&](const V3i& v, std::int64_t at) { truth[{v.x, v.y, v.z}] = b.moments[static_cast<std::size_t>(at)]; });
    double angle = 0, square = 0, total = 0, spread = 0, spread_truth = 0;
    for_each_voxel(a.set, [&](const V3i& v, std::int64_t at) {
      const Moments& m = a.moments[static_cast<std::size_t>(at)];
      const auto t = truth.find({v.x, v.y, v.z});
      if (t == truth.end()) return;  // slivers of voxels
      const Moments& w = t->second;
      const auto spread_of = [](const Moments& q) {
        const V3d u = q.m.normalized();
        return 1 - (q.xx * u.x * u.x + q.yy * u.y * u.y + q.zz * u.z * u.z + 2 * (q.xy * u.x * u.y + q.xz * u.x * u.z + q.yz * u.y * u.z)) / q.covered;
      };
      const double e[6] = {m.xx / m.covered - w.xx / w.covered, m.yy / m.covered - w.yy / w.covered, m.zz / m.covered - w.zz / w.covered,
                           m.xy / m.covered - w.xy / w.covered, m.xz / m.covered - w.xz / w.covered, m.yz / m.covered - w.yz / w.covered};
      for (int k = 0; k < 6; ++k) square += m.covered * e[k] * e[k] * (k < 3 ? 1 : 2);
      total += m.covered;
      angle += m.covered * (m.m.normalized() - w.m.normalized()).length2();
      spread += m.covered * spread_of(m);
      spread_truth += m.covered * spread_of(w);
    });
    rms[i] = std::sqrt(angle / total);
    second[i] = std::sqrt(square / total);
    EXPECT_NEAR(spread / spread_truth, 1, 0.02) << "at " << n;
    std::printf("sphere at %d: voxels' normals rms %.2e rad, second moments %.2e, spread %.3g of %.3g\n", n, rms[i], second[i], spread / total, spread_truth / total);
  }
  // Order 2 where the surface passes a voxel from wall to wall. What pokes through one wall alone is missed: a share of voxels as large as
  // the curvature in cells, each off by as much, which makes order 1.5 in the root of the mean square. Halved cells: below the half.
  EXPECT_LT(rms[1], 3e-4);
  EXPECT_LT(rms[1], rms[0] / 2);
  EXPECT_LT(second[1], second[0] / 2);
}

}  // namespace
}  // namespace texel::test
