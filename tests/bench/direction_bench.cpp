// What a voxel alone hides of a ray in any direction: rules that know the opacity along the axes, against rays through the voxel (docs/accuracy.md).
//   direction_bench [--columns] [MODEL …]   64³ and all levels; without any, models of the shared data and the samples
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "bake/compare_sums.h"
#include "bake/compare_voxels.h"
#include "bake/direction_opacity.h"
#include "bake/light.h"
#include "formats/random.h"
#include "formats/read.h"
#include "tests/bench/bench_util.h"

namespace texel {
namespace {

constexpr int kDirections = 1000, kVoxels = 150, kRays = 32;  // kRays: in two halves, whose errors are independent
constexpr double kMostDepth = 40;

double unit(std::uint64_t x) { return unit_of(mix_bits(x)); }

// What a pack says of one voxel.
struct Voxel {
  V3d alpha, tau, crossings;           // along the axes
  double area = 0;                     // / h²
  VoxelNdf ndf;
  AxisOpacity axes;
  VoxelLobes lobes;
};

double share(const V3d& w) { return std::abs(w.x) + std::abs(w.y) + std::abs(w.z); }  // the cube's shadow / h²; 1 / its mean chord

// Mean of 1 − e^(−τ·chord) over the chords of the unit cube in direction w, by rays from a grid on its three faces.
double over_chords(double tau, const V3d& w) {
  constexpr int kGrid = 6;
  double sum = 0;
  const V3d a(std::abs(w.x), std::abs(w.y), std::abs(w.z));
  for (int face = 0; face < 3; ++face) {
    if (a[face] < 1e-9) continue;
    const int u = (face + 1) % 3, v = (face + 2) % 3;
    double part = 0;
    for (int i = 0; i < kGrid; ++i)
      for (int j = 0; j < kGrid; ++j) {
        const double x = (i + 0.5) / kGrid, y = (j + 0.5) / kGrid;
        const double chord = std::min({1 / a[face], a[u] > 0 ? (1 - x) / a[u] : 1e9, a[v] > 0 ? (1 - y) / a[v] : 1e9});
        part -= std::expm1(-tau * chord);
      }
    sum += a[face] * part / (kGrid * kGrid);
  }
  return sum / share(w);
}

// How far crossings hide apart from each other: g of 1 − α = g·e^(−N) + (1 − g)·max(0, 1 − N).
double strewn_share(double alpha, double n) {
  const double independent = std::exp(-n), linear = std::max(0.0, 1 - n);
  return independent - linear > 1e-6 ? std::clamp((1 - alpha - linear) / (independent - linear), 0.0, 4.0) : 1;
}

// Values along the axes joined by two lobes: σ of both, each stretched by what makes their sum along the axes `axes`.
double lobes_shadow(const V3f& axes, const VoxelLobes& lobes, const V3d& w) {
  std::array<double, 2> part{};
  V3d along(0, 0, 0);
  for (std::size_t g = 0; g < 2; ++g) {
    if (!(lobes.share[g] > 0)) continue;
    const Symmetric& s = lobes.ndf[g].s;
    part[g] = lobes.share[g] / (2 * mean_shadow(s));
    along += V3d(std::sqrt(std::max(s.xx, 0.0)), std::sqrt(std::max(s.yy, 0.0)), std::sqrt(std::max(s.zz, 0.0))) * part[g];
  }
  V3d p(0, 0, 0);
  for (int k = 0; k < 3; ++k) p[k] = along[k] > 1e-6 ? w[k] * static_cast<double>(axes[k]) / along[k] : 0;
  double sum = 0;
  for (std::size_t g = 0; g < 2; ++g) {
    const Symmetric& s = lobes.ndf[g].s;
    if (part[g] > 0) sum += part[g] * std::sqrt(std::max(0.0, s.xx * p.x * p.x + s.yy * p.y * p.y + s.zz * p.z * p.z + 2 * (s.xy * p.x * p.y + s.xz * p.x * p.z + s.yz * p.y * p.z)));
  }
  return sum;
}

struct Rule {
  const char* name;
  double (*opacity)(const Voxel&, const V3d& w);
};

double layers(const Voxel& v, const V3d& w) {
  double sigma = 0;
  projected_areas(v.ndf, v.area, std::span(&w, 1), std::span(&sigma, 1));
  return sigma / share(w);
}

const std::array kRules = {
    Rule{"Σ|ω_k|·α_k (Ratib)", [](const Voxel& v, const V3d& w) { return std::min(std::abs(w.x) * v.alpha.x + std::abs(w.y) * v.alpha.y + std::abs(w.z) * v.alpha.z, 1.0); }},
    Rule{"density", [](const Voxel& v, const V3d& w) { return -std::expm1(-(v.tau.x + v.tau.y + v.tau.z) / 3 / share(w)); }},
    Rule{"areas by S", [](const Voxel& v, const V3d& w) { return -std::expm1(-layers(v, w)); }},
    Rule{"depths joined by S", [](const Voxel& v, const V3d& w) { return -std::expm1(-ellipsoid_shadow(V3f(v.tau), v.axes.joined, w) / share(w)); }},
    Rule{"the same over chords", [](const Voxel& v, const V3d& w) { return over_chords(ellipsoid_shadow(V3f(v.tau), v.axes.joined, w), w); }},
    Rule{"layers, blended by g", [](const Voxel& v, const V3d& w) {
      double g = 0;
      for (int k = 0; k < 3; ++k) g += w[k] * w[k] * strewn_share(v.alpha[k], v.crossings[k]);
      const double n = ellipsoid_shadow(V3f(v.crossings), v.axes.joined, w) / share(w);
      return std::clamp(1 - g * std::exp(-n) - (1 - g) * std::max(0.0, 1 - n), 0.0, 1.0); }},
    Rule{"alpha joined by S", [](const Voxel& v, const V3d& w) { return std::min(ellipsoid_shadow(v.axes.alpha, v.axes.joined, w) / share(w), 1.0); }},
    Rule{"without crossings", [](const Voxel& v, const V3d& w) {
      AxisOpacity axes = v.axes;
      for (int k = 0; k < 3; ++k) axes.met[k] = axes.depth[k] = static_cast<float>(std::min(v.tau[k], 1.0));
      return opacity_along(axes, w); }},
    Rule{"opacity_along", [](const Voxel& v, const V3d& w) { return opacity_along(v.axes, w); }},
    Rule{"the same by two lobes", [](const Voxel& v, const V3d& w) {
      const double faces = share(w), apart = lobes_shadow(v.axes.alpha, v.lobes, w) / faces;
      const V3d square = w * w;
      const double met = square.dot(V3d(v.axes.met)), depth = square.dot(V3d(v.axes.depth));
      const double strewn = met > 0 ? -std::expm1(-lobes_shadow(v.axes.met, v.lobes, w) / faces * (depth / met)) : 0;
      return std::min(std::max(apart, strewn), 1.0); }},
};

struct Sums { double error = 0, square = 0; };

// Light through whole columns one voxel wide, were each voxel's opacity taken as a fog's (the product of 1 − α), and had it a mask of 4 × 4 or 8 × 8 places that are covered or
// not, joined along the column; truth: 32 × 32 rays.
void measure_columns(const std::string& name, const Level& level, std::size_t number, const RayScene& rays) {
  constexpr int kColumns = 200, kTruth = 32;
  const VoxelField alpha(level, "alpha", 3);
  const V3i n = level.grid.n;
  struct Column { std::uint64_t order; int axis; V3i at; };
  std::vector<Column> columns;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    std::vector<char> some(static_cast<std::size_t>(n[u]) * static_cast<std::size_t>(n[v]));
    for_each_active(alpha, n, [&](const V3i& at, const float*) { some[static_cast<std::size_t>(at[u]) * static_cast<std::size_t>(n[v]) + static_cast<std::size_t>(at[v])] = 1; });
    for (int i = 0; i < n[u]; ++i)
      for (int j = 0; j < n[v]; ++j) {
        if (!some[static_cast<std::size_t>(i) * static_cast<std::size_t>(n[v]) + static_cast<std::size_t>(j)]) continue;
        V3i at(0, 0, 0);
        at[u] = i;
        at[v] = j;
        columns.push_back({mix_bits(static_cast<std::uint64_t>(axis) << 60 | static_cast<std::uint64_t>(i) << 30 | static_cast<std::uint64_t>(j)), axis, at});
      }
  }
  std::sort(columns.begin(), columns.end(), [](const Column& a, const Column& b) { return a.order < b.order; });
  if (columns.size() > kColumns) columns.resize(kColumns);
  std::vector<std::array<double, 3>> errors(columns.size());
  tbb::parallel_for(std::size_t{0}, columns.size(), [&](std::size_t c) {
    const auto& [order, axis, at] = columns[c];
    const auto passed = [&, axis = axis, at = at](int edge, bool jitter, std::uint64_t seed) {
      double sum = 0;
      for (int i = 0; i < edge * edge; ++i) {
        V3d from(at);
        from[(axis + 1) % 3] += (i % edge + (jitter ? unit(seed + 2 * static_cast<std::uint64_t>(i)) : 0.5)) / edge;
        from[(axis + 2) % 3] += (i / edge + (jitter ? unit(seed + 2 * static_cast<std::uint64_t>(i) + 1) : 0.5)) / edge;  // NOLINT: whole rows
        V3d to = from;
        from[axis] = -0.01;
        to[axis] = n[axis] + 0.01;
        sum += 1 - static_cast<double>(rays.blocked(level.grid.to_world(from), level.grid.to_world(to)));
      }
      return sum / (edge * edge);
    };
    const double truth = passed(kTruth, true, order);
    double fog = 1;
    V3i v = at;
    for (v[axis] = 0; v[axis] < n[axis]; ++v[axis])
      if (const float* a = alpha.at(v)) fog *= 1 - static_cast<double>(a[axis]);
    errors[c] = {fog - truth, passed(4, false, 0) - truth, passed(8, false, 0) - truth};
  });
  std::printf("%s\t%zu\t%zu\tcolumns", name.c_str(), number, columns.size());
  for (std::size_t k = 0; k < 3; ++k) {
    double error = 0, square = 0;
    for (const auto& e : errors) {
      error += e[k] / static_cast<double>(errors.size());
      square += e[k] * e[k] / static_cast<double>(errors.size());
    }
    std::printf("\t%+.3f %.3f", error, std::sqrt(square));
  }
  std::printf("\n");
}

void measure(const std::string& path, bool columns) {
  Report report;
  Recipe recipe;
  recipe.resolution = V3i(64, 0, 0);
  recipe.want = {.slices = false, .density = true, .color = false, .ndf = true, .visibility = true, .material = false, .normal = true, .levels = true, .preview = false};
  recipe.samples = 16;
  recipe.fill = Fill::kOff;
  recipe.lobes = 2;
  const Scene scene = read_scene(path, report);
  const Pack pack = bake(scene, recipe, report);
  const RayScene rays(scene);
  std::vector<V3d> directions = half_sphere(kDirections);
  for (std::size_t l = 0; l < pack.levels.size(); ++l) {
    const Level& level = pack.levels[l];
    if (columns) {
      measure_columns(std::filesystem::path(path).stem(), level, l, rays);
      continue;
    }
    const VoxelField alpha(level, "alpha", 3), area(level, "area", 1), crossings(level, "crossings", 3), diagonal(level, "S_diag", 3), off(level, "S_off", 3);
    const NdfField ndf(level, NdfKind::kSggx);
    std::vector<std::pair<std::uint64_t, V3i>> order;
    for_each_active(area, level.grid.n, [&](const V3i& v, const float* a) {
      if (*a > 0) order.emplace_back(mix_bits(static_cast<std::uint64_t>(v.x) << 40 | static_cast<std::uint64_t>(v.y) << 20 | static_cast<std::uint64_t>(v.z)), v);
    });
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    if (order.size() > kVoxels) order.resize(kVoxels);
    std::vector<std::array<Sums, kRules.size()>> found(order.size());
    std::vector<double> truth(order.size());
    tbb::parallel_for(std::size_t{0}, order.size(), [&](std::size_t i) {
      const V3i at = order[i].second;
      const auto stored = ndf.at(at);
      const float *a = alpha.at(at), *n = crossings.at(at);
      if (!stored || !a || !n) return;
      const auto lobes = ndf.lobes(at);
      Voxel v{.alpha = V3d(a[0], a[1], a[2]), .tau = {}, .crossings = V3d(n[0], n[1], n[2]), .area = static_cast<double>(area.value(at, 0)), .ndf = *stored, .axes = axis_opacity(a, n, diagonal.at(at), off.at(at), 0), .lobes = *lobes};
      for (int k = 0; k < 3; ++k) v.tau[k] = std::min(-std::log1p(-std::min(v.alpha[k], 1.0)), kMostDepth);
      for (int d = 0; d < kDirections; ++d) {
        // All eight octants, so that a voxel is looked at from everywhere.
        V3d w = directions[static_cast<std::size_t>(d)];
        if (d & 1) w = -w;
        double half[2] = {0, 0};
        const double total = share(w);
        for (int r = 0; r < kRays; ++r) {
          const std::uint64_t seed = (order[i].first + static_cast<std::uint64_t>(d)) * 64 + static_cast<std::uint64_t>(r) * 3;
          double pick = (r / 2 + unit(seed)) / (kRays / 2) * total;
          int face = 0;
          while (face < 2 && pick > std::abs(w[face])) pick -= std::abs(w[face++]);
          V3d p(0, 0, 0);
          p[face] = w[face] > 0 ? 0 : 1;
          p[(face + 1) % 3] = unit(seed + 1);
          p[(face + 2) % 3] = unit(seed + 2);
          double length = 1e9;
          for (int k = 0; k < 3; ++k)
            if (w[k] != 0) length = std::min(length, ((w[k] > 0 ? 1 : 0) - p[k]) / w[k]);
          const V3d from = V3d(at) + p;
          half[r & 1] += static_cast<double>(rays.blocked(level.grid.to_world(from), level.grid.to_world(from + w * length))) / (kRays / 2);
        }
        truth[i] += (half[0] + half[1]) / 2 / kDirections;
        for (std::size_t rule = 0; rule < kRules.size(); ++rule) {
          const double said = kRules[rule].opacity(v, w);
          found[i][rule].error += said - (half[0] + half[1]) / 2;
          found[i][rule].square += (said - half[0]) * (said - half[1]);  // unbiased whatever the rays' own noise
        }
      }
    });
    const double count = static_cast<double>(order.size()) * kDirections;
    double mean = 0;
    for (const double t : truth) mean += t / static_cast<double>(order.size());
    std::printf("%s\t%zu\t%zu\t%.3f", std::filesystem::path(path).stem().c_str(), l, order.size(), mean);
    for (std::size_t rule = 0; rule < kRules.size(); ++rule) {
      Sums sum;
      for (const auto& f : found) {
        sum.error += f[rule].error;
        sum.square += f[rule].square;
      }
      std::printf("\t%+.3f %.3f", sum.error / count, std::sqrt(std::max(sum.square / count, 0.0)));
    }
    std::printf("\n");
    std::fflush(stdout);
  }
}

int run(int argc, char** argv) {
  std::vector<std::string> models(argv + 1, argv + argc);
  const bool columns = !models.empty() && models.front() == "--columns";
  if (columns) models.erase(models.begin());
  if (models.empty()) {
    models = bench::usual_models();
    models.push_back(TEXEL_SAMPLES "/hair/tuft.hair");
  }
  std::printf("model\tlevel\tvoxels\ttruth");
  if (columns) std::printf("\tfog\tmask 4x4\tmask 8x8");
  else
    for (const Rule& rule : kRules) std::printf("\t%s", rule.name);
  std::printf("\n");
  for (const std::string& model : models) measure(model, columns);
  return 0;
}

}  // namespace
}  // namespace texel

int main(int argc, char** argv) { return texel::bench::guarded("direction_bench", texel::run, argc, argv); }
