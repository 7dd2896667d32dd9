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

// Voxel by voxel against the sums of 8³ finer ones, that is, against the integrals of n and n nᵀ over the surface in the voxel. The normal
// at a point is no truth for a voxel: it turns by the curvature in cells within it, which is first order.
struct NormalErrors {
  double rms = 0, largest = 0;            // radians; rms by area, the largest where at least 0.1 h² of surface is
  double second = 0;                      // of n nᵀ, rms by area
  double spread = 0, spread_truth = 0;    // 1 − uᵀMu
  double missed = 0;                      // share of the area in voxels where the bake has none
};
Surface summed_surface(const Scene& scene, const Box3d& box, int resolution, int levels) {
  const Recipe recipe = boxed_recipe(resolution, box);
  Report report;
  auto stages = run_stages(polygonize(scene, recipe, report), recipe, false, levels + 1);
  return std::move(stages->surfaces[static_cast<std::size_t>(levels)]);
}
NormalErrors normal_errors(const Surface& made, const Surface& finer) {
  std::map<std::tuple<int, int, int>, const Moments*> truth;
  double whole = 0, met = 0, total = 0;
  for_each_voxel(finer.set, [&](const V3i& v, std::int64_t at) {
    const Moments& w = finer.moments[static_cast<std::size_t>(at)];
    truth[{v.x, v.y, v.z}] = &w;
    whole += w.covered;
  });
  const auto spread_of = [](const Moments& q) {
    const V3d u = q.m.normalized();
    return 1 - (q.xx * u.x * u.x + q.yy * u.y * u.y + q.zz * u.z * u.z + 2 * (q.xy * u.x * u.y + q.xz * u.x * u.z + q.yz * u.y * u.z)) / q.covered;
  };
  NormalErrors e;
  for_each_voxel(made.set, [&](const V3i& v, std::int64_t at) {
    const Moments& m = made.moments[static_cast<std::size_t>(at)];
    const auto t = truth.find({v.x, v.y, v.z});
    if (t == truth.end()) return;  // slivers of voxels
    const Moments& w = *t->second;
    const double d[6] = {m.xx / m.covered - w.xx / w.covered, m.yy / m.covered - w.yy / w.covered, m.zz / m.covered - w.zz / w.covered,
                         m.xy / m.covered - w.xy / w.covered, m.xz / m.covered - w.xz / w.covered, m.yz / m.covered - w.yz / w.covered};
    for (int k = 0; k < 6; ++k) e.second += m.covered * d[k] * d[k] * (k < 3 ? 1 : 2);
    const double angle = 2 * std::asin(std::min(1.0, (m.m.normalized() - w.m.normalized()).length() / 2));
    e.rms += m.covered * angle * angle;
    if (w.covered >= 0.1) e.largest = std::max(e.largest, angle);
    e.spread += m.covered * spread_of(m);
    e.spread_truth += m.covered * spread_of(w);
    total += m.covered;
    met += w.covered;
  });
  e.rms = std::sqrt(e.rms / total);
  e.second = std::sqrt(e.second / total);
  e.spread /= total;
  e.spread_truth /= total;
  e.missed = 1 - met / whole;
  return e;
}

TEST(Implicit, NormalsOfVoxels) {
  const Box3d box(V3d(-1.25, -1.25, -1.25), V3d(1.25, 1.25, 1.25)), wide(V3d(-1.5, -1.5, -1.5), V3d(1.5, 1.5, 1.5));
  struct Shape { const char* name; std::string expression; Box3d box; double curvature; };  // the largest there is
  // Gyroid: √3/2, the largest at 40 000 random points. Blobs: 1/r about the neck, r² = 3/4 − 0.15^(1/3).
  for (const Shape& s : {Shape{"sphere", "1 - length(x, y, z)", box, 1}, Shape{"torus", "0.25 - length(length(x, y) - 0.75, z)", box, 4},
                         Shape{"gyroid", kGyroid, kGyroidCell, std::sqrt(0.75)}, Shape{"blobs", kBlobs, wide, 1 / std::sqrt(0.75 - std::cbrt(0.15))}}) {
    SCOPED_TRACE(s.name);
    constexpr int kFirst = 16;
    // Off the shapes' own planes of symmetry, where a few voxels alike would decide.
    const V3d shift = V3d(0.37, 0.61, 0.19) * ((s.box.max.x - s.box.min.x) / kFirst);
    const Box3d moved(s.box.min + shift, s.box.max + shift);
    const Scene scene = implicit_scene(s.expression, moved);
    NormalErrors e[3];
    double turn = 0;  // of the normal within a cell, radians
    for (int i = 0; i < 3; ++i) {
      const int n = kFirst << i;
      turn = s.curvature * (s.box.max.x - s.box.min.x) / n;
      e[i] = normal_errors(summed_surface(scene, moved, n, 0), summed_surface(scene, moved, 8 * n, 3));
      // A voxel that a bulge pokes into, or out of, loses some of its surface, whose normals differ from the rest's by the turn: order 1, in a
      // share of the voxels as large as the turn's square, for a wall's curve has to touch an edge from within the bulge.
      EXPECT_LT(e[i].largest, 0.5 * turn) << n;
      EXPECT_LT(e[i].missed, 2e-3) << n;
    }
    // Normals are the surface's own at the triangles' corners and linear between: off by the turn's square over 8 along an edge of the lattice,
    // over 4 along a cell's diagonal.
    EXPECT_LT(e[2].rms, turn * turn / 4);
    const double slope = std::log2(e[0].rms / e[2].rms) / 2, slope_second = std::log2(e[0].second / e[2].second) / 2;
    EXPECT_NEAR(slope, 2, 0.3);  // at 16 a cell is up to 0.6 of a radius of curvature: higher orders show
    EXPECT_NEAR(slope_second, 2, 0.3);
    EXPECT_NEAR(e[2].spread / e[2].spread_truth, 1, 0.02);
    std::printf("%s at 16, 32, 64: voxels' normals rms %.1e %.1e %.1e rad (slope %.2f), largest %.1e %.1e %.1e, second moments %.1e %.1e %.1e (slope %.2f), spread %.3g of %.3g, "
                "area missed %.1e %.1e %.1e\n", s.name, e[0].rms, e[1].rms, e[2].rms, slope, e[0].largest, e[1].largest, e[2].largest, e[0].second, e[1].second, e[2].second,
                slope_second, e[2].spread, e[2].spread_truth, e[0].missed, e[1].missed, e[2].missed);
  }
}

}  // namespace
}  // namespace texel::test
