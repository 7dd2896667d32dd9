// Opacity along the axes against 64×64 sub-rays a voxel, and those against a ray caster of their own.
#include <numbers>

#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

constexpr int kTruthSamples = 64, kResolution = 64;
struct Figures { double rms = 0, bias = 0, worst = 0; std::int64_t count = 0; };

Recipe alpha_recipe(int samples, Pattern pattern) {
  Recipe recipe = volume_recipe(kResolution);
  recipe.samples = samples;
  recipe.pattern = pattern;
  recipe.want.color = recipe.want.ndf = recipe.want.material = recipe.want.density = false;
  return recipe;
}
// Over the border voxels of a level, one axis or (−1) all.
Figures compare(const Pack& pack, const Pack& truth, std::size_t level, int axis) {
  Figures f;
  const Layer* surface = nullptr;
  (void)truth.levels[level].find("area", &surface);
  const Dense a = dense(pack.levels[level], "alpha"), b = dense(truth.levels[level], "alpha");
  double sum = 0, square = 0;
  for_each_voxel(surface->set, [&](const V3i& v, std::int64_t) {
    for (int k = 0; k < 3; ++k) {
      if (axis >= 0 && k != axis) continue;
      const double e = static_cast<double>(a.at(v, k)) - static_cast<double>(b.at(v, k));
      sum += e;
      square += e * e;
      f.worst = std::max(f.worst, std::abs(e));
      ++f.count;
    }
  });
  f.rms = std::sqrt(square / static_cast<double>(f.count));
  f.bias = sum / static_cast<double>(f.count);
  return f;
}

// Of the rms error over border voxels, all three models.
double bound_of(int samples) {
  const std::map<int, double> bounds{{1, 0.2}, {2, 0.1}, {3, 0.05}, {4, 0.03}, {5, 0.02}, {6, 0.016}, {8, 0.01}, {16, 0.004}};
  return bounds.at(samples);
}

TEST(Alpha, AgainstManySubRays) {
  for (const char* name : {"bunny_closed.off", "armadillo.off", "bonsai/bonsai-tree.obj"}) {
    SCOPED_TRACE(name);
    Scene scene;
    std::string reason;
    if (!load_model(name, scene, reason)) GTEST_SKIP() << reason;
    const Pack truth = bake_quietly(scene, alpha_recipe(kTruthSamples, Pattern::kGrid));
    std::printf("alpha %s at %d^3 against %d x %d sub-rays\n  pattern samples   rms      bias      worst   rms x, y, z\n", name, kResolution, kTruthSamples, kTruthSamples);
    for (const Pattern pattern : {Pattern::kLattice, Pattern::kGrid})
      for (const int samples : {1, 2, 3, 4, 5, 6, 8, 16}) {
        const Pack pack = bake_quietly(scene, alpha_recipe(samples, pattern));
        const Figures all = compare(pack, truth, 0, -1);
        std::printf("  %-7s %3d      %.5f  %+.5f  %.3f  ", pattern == Pattern::kLattice ? "lattice" : "grid", samples, all.rms, all.bias, all.worst);
        for (int axis = 0; axis < 3; ++axis) {
          const Figures f = compare(pack, truth, 0, axis);
          std::printf(" %.5f", f.rms);
          // Statistical: about a fifth more than the worst of the three models.
          EXPECT_LE(f.rms, bound_of(samples)) << "axis " << axis << ", " << samples << " samples";
        }
        std::printf("\n");
      }
    // What is wanted of the default.
    const Pack pack = bake_quietly(scene, alpha_recipe(Recipe{}.samples, Recipe{}.pattern));
    for (int axis = -1; axis < 3; ++axis) {
      const Figures f = compare(pack, truth, 0, axis);
      std::printf("  default, axis %d: rms %.5f bias %+.5f\n", axis, f.rms, f.bias);
      EXPECT_LE(f.rms, 0.02) << "axis " << axis;
      // Statistical: of one axis a third of the voxels speaks, and the bias of each is itself uncertain by rms/√voxels.
      EXPECT_LE(std::abs(f.bias), 0.001 + (axis < 0 ? 0 : 2 * f.rms / std::sqrt(static_cast<double>(f.count)))) << "axis " << axis;
    }
    for (std::size_t level = 1; level < pack.levels.size(); ++level) {
      const Figures f = compare(pack, truth, level, -1);
      std::printf("  level %zu (%lld voxels): rms %.5f bias %+.5f worst %.3f\n", level, static_cast<long long>(f.count / 3), f.rms, f.bias, f.worst);
      // All rays at level 1, as many to a voxel above: half of what independent rays would give, and few voxels at the end.
      EXPECT_LE(f.rms, level <= 3 ? 0.025 : 0.06) << "level " << level;
    }
  }
}

// One ray through the grid along an axis, every triangle tested in double: depths where it crosses, in voxel space.
struct Hit { double w; int sign; };
std::vector<Hit> cast(const std::vector<V3d>& points, const Mesh& mesh, const std::vector<std::uint32_t>& candidates, int axis, double u, double v) {
  const int ua = (axis + 1) % 3, va = (axis + 2) % 3;
  std::vector<Hit> hits;
  for (const std::uint32_t t : candidates) {
    const auto& tri = mesh.triangles[t];
    const V3d &a = points[tri[0]], &b = points[tri[1]], &c = points[tri[2]];
    const double e0 = (b[ua] - a[ua]) * (v - a[va]) - (b[va] - a[va]) * (u - a[ua]);
    const double e1 = (c[ua] - b[ua]) * (v - b[va]) - (c[va] - b[va]) * (u - b[ua]);
    const double e2 = (a[ua] - c[ua]) * (v - c[va]) - (a[va] - c[va]) * (u - c[ua]);
    if (!((e0 > 0 && e1 > 0 && e2 > 0) || (e0 < 0 && e1 < 0 && e2 < 0))) continue;
    const double area = e0 + e1 + e2;
    hits.push_back({(e1 * a[axis] + e2 * b[axis] + e0 * c[axis]) / area, area > 0 ? -1 : 1});
  }
  std::sort(hits.begin(), hits.end(), [](const Hit& x, const Hit& y) { return x.w < y.w; });
  return hits;
}
TEST(Alpha, TruthAgainstItsOwnRayCaster) {
  for (const char* name : {"bunny_closed.off", "armadillo.off"}) {
    SCOPED_TRACE(name);
    Scene scene;
    std::string reason;
    if (!load_model(name, scene, reason)) GTEST_SKIP() << reason;
    const Pack truth = bake_quietly(scene, alpha_recipe(kTruthSamples, Pattern::kGrid));
    const Dense alpha = dense(truth.levels[0], "alpha"), solid = dense(truth.levels[0], "solid"), area = dense(truth.levels[0], "area");
    std::vector<V3d> points;
    for (const V3d& p : scene.mesh.points) points.push_back(truth.grid.to_voxel(p));
    Random random(3);
    std::int64_t voxels = 0, rays_differ = 0, rays = 0;
    double worst = 0, square = 0, sum = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int column = 0; column < 220; ++column) {
        const int ua = (axis + 1) % 3, va = (axis + 2) % 3;
        const int cu = static_cast<int>(random.uniform() * alpha.n[ua]), cv = static_cast<int>(random.uniform() * alpha.n[va]);
        std::vector<std::uint32_t> candidates;
        for (std::uint32_t t = 0; t < scene.mesh.triangles.size(); ++t) {
          const auto& tri = scene.mesh.triangles[t];
          const auto beyond = [&](int k, double lo, double hi) {
            const double x = points[tri[0]][k], y = points[tri[1]][k], z = points[tri[2]][k];
            return std::max({x, y, z}) < lo || std::min({x, y, z}) > hi;
          };
          if (!beyond(ua, cu, cu + 1) && !beyond(va, cv, cv + 1)) candidates.push_back(t);
        }
        if (candidates.empty()) continue;
        const int n = alpha.n[axis];
        std::vector<int> stopped(static_cast<std::size_t>(n), 0);
        for (int i = 0; i < kTruthSamples; ++i)
          for (int j = 0; j < kTruthSamples; ++j) {
            const auto hits = cast(points, scene.mesh, candidates, axis, cu + (i + 0.5) / kTruthSamples, cv + (j + 0.5) / kTruthSamples);
            std::size_t h = 0;
            int winding = 0;
            for (int k = 0; k < n; ++k) {
              bool meets = winding != 0;
              for (; h < hits.size() && hits[h].w < k + 1; ++h) { winding += hits[h].sign; meets = true; }
              stopped[static_cast<std::size_t>(k)] += meets;
            }
          }
        for (int k = 0; k < n; ++k) {
          V3i v;
          v[axis] = k;
          v[ua] = cu;
          v[va] = cv;
          if (!area.state(v)) continue;
          const double mine = stopped[static_cast<std::size_t>(k)] / static_cast<double>(kTruthSamples * kTruthSamples);
          const double e = static_cast<double>(alpha.at(v, axis)) - mine;
          // The brute force's own error: a plain mean of 64 × 64 rays may count an edge along a row one row wrong.
          EXPECT_LE(std::abs(e), 1.0 / 64) << v.x << " " << v.y << " " << v.z;
          worst = std::max(worst, std::abs(e));
          sum += e;
          square += e * e;
          ++voxels;
          rays_differ += static_cast<std::int64_t>(std::lround(std::abs(e) * 4096));
          rays += 4096;
        }
      }
    EXPECT_GE(voxels, 500);
    EXPECT_LE(std::sqrt(square / static_cast<double>(voxels)), 1e-3);
    std::printf("truth %s: %lld voxels against brute force: worst %.2g, rms %.2g, mean %+.2g; %lld of %lld rays differ\n", name, static_cast<long long>(voxels), worst,
                std::sqrt(square / static_cast<double>(voxels)), sum / static_cast<double>(voxels), static_cast<long long>(rays_differ), static_cast<long long>(rays));
  }
}

// A straight edge of an opaque half plane, analytic: the share of each voxel it covers, seen along its normal.
TEST(Alpha, StraightEdges) {
  Random random(9);
  double square = 0, worst = 0;
  std::int64_t count = 0;
  for (int i = 0; i < 60; ++i) {
    const double angle = random.uniform(0, 2 * std::numbers::pi), shift = random.uniform(-0.5, 0.5);
    Scene s = empty_scene();
    const V3d along(std::cos(angle), std::sin(angle), 0), across(-along.y, along.x, 0);
    add_quad(s, V3d(4, 4, 0.5) + across * shift - along * 100.0, along * 200.0, across * 200.0);
    Recipe recipe = alpha_recipe(4, Pattern::kLattice);
    recipe.box = Box3d(V3d(0), V3d(8, 8, 1));
    recipe.resolution = V3i(8, 8, 1);
    recipe.want.levels = false;
    const Pack pack = bake_quietly(s, recipe);
    const Dense alpha = dense(pack.levels[0], "alpha"), area = dense(pack.levels[0], "area");
    for_each_cell(alpha.n, [&](const V3i& v) {
      const double exact = area.state(v) ? static_cast<double>(area.at(v)) : 0;  // flat across the rays: its area is its shadow
      if (exact <= 0 || exact >= 1) return;
      const double e = static_cast<double>(alpha.at(v, 2)) - exact;
      worst = std::max(worst, std::abs(e));
      square += e * e;
      ++count;
    });
  }
  const double rms = std::sqrt(square / static_cast<double>(count));
  EXPECT_LE(worst, 1e-5);  // one layer: exact but for floats
  std::printf("straight edges, 16 rays: %lld voxels, rms %.2g, worst %.2g\n", static_cast<long long>(count), rms, worst);
}

}  // namespace
}  // namespace texel::test
