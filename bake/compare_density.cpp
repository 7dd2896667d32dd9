// Pack against the density it was made from.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <string>

#include "bake/compare_columns.h"
#include "bake/compare_voxels.h"
#include "bake/density_light.h"
#include "bake/hypertexture.h"
#include "bake/repeat_functions.h"
#include "bake/truth_voxels.h"
#include "formats/error.h"
#include "formats/random.h"

namespace texel {
namespace {

constexpr int kDirections = 64;
constexpr int kEdgePlaces = 16;   // along a voxel's edge: where gradients and colours are taken, jittered

// What is there in a voxel, by code that shares nothing with the bake's sampler but the density itself.
struct DensityVoxel {
  V3i at;
  bool any = false, full = true;     // whether D is ever above 0; whether it is 1 everywhere
  std::array<double, 3> alpha{}, noise{}, depth{};
  double solid = 0;                  // share with D = 1
  Moments moments;                   // faces of the voxel's own level
  std::vector<double> sigma;
  V3d color{0, 0, 0};                // mean, weighted as Cd is; of a fire its light, too
};

struct Source {
  const Field& density;
  double reach;                      // world units, of the differences area and normals are of: the distance of the bake's samples
  bool reach_known;                  // else they are not compared
  const SolidTexture* color;
  V3f plain;
  double scale, cap;
  Grid grid;                         // of the level
  Box3d box;                         // of the pack, which outer voxels of coarse levels reach beyond: nothing is there
  int level;
  std::uint32_t seed;
  std::span<const V3d> directions;
};

struct Work {
  std::vector<double> x, y, z, d, gx, gy, gz, side;
  std::vector<V3f> colors;
  std::vector<V3d> normals;
  void resize(std::size_t n) {
    for (std::vector<double>* v : {&x, &y, &z, &d, &gx, &gy, &gz}) v->resize(n);
  }
};

double sane(double d) { return std::isnan(d) ? 0 : std::clamp(d, 0.0, 1.0); }

// Jittered rays, jittered steps: ∏ (1 − D)^(c·dt) by midpoints.
void trace(const Source& s, Work& w, RandomSequence& random, int axis, int rays, int steps, DensityVoxel& out) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const V3d corner = s.grid.origin + V3d(out.at) * s.grid.h;
  const double step = s.grid.h / steps;
  std::array<std::vector<double>*, 3> place{&w.x, &w.y, &w.z};
  w.resize(static_cast<std::size_t>(steps));
  double mean = 0, depth = 0, before = 0, pairs = 0, ones = 0;
  for (int j = 0; j < rays; ++j)
    for (int i = 0; i < rays; ++i) {
      const double at_u = corner[u] + s.grid.h * (i + random.next()) / rays, at_v = corner[v] + s.grid.h * (j + random.next()) / rays;
      for (int k = 0; k < steps; ++k) {
        const auto p = static_cast<std::size_t>(k);
        (*place[static_cast<std::size_t>(u)])[p] = at_u;
        (*place[static_cast<std::size_t>(v)])[p] = at_v;
        (*place[static_cast<std::size_t>(axis)])[p] = corner[axis] + step * (k + random.next());
      }
      s.density.values(static_cast<std::size_t>(steps), w.x.data(), w.y.data(), w.z.data(), w.d.data());
      double t = 0;
      for (int k = 0; k < steps; ++k) {
        const auto p = static_cast<std::size_t>(k);
        if (!s.box.intersects(V3d(w.x[p], w.y[p], w.z[p]))) continue;
        const double d = sane(w.d[p]);
        out.any = out.any || d > 0;
        out.full = out.full && d >= 1;
        ones += d >= 1;
        t -= std::log1p(-d);  // D = 1: infinite
      }
      t *= s.scale * step;
      const double passes = std::exp(-t);
      mean += passes;
      depth += std::min(t, s.cap);
      if (i % 2 == 1) pairs += (passes - before) * (passes - before);
      before = passes;
    }
  const auto a = static_cast<std::size_t>(axis);
  const double n = static_cast<double>(rays) * rays;
  out.alpha[a] = 1 - mean / n;
  out.depth[a] = depth / n;
  out.noise[a] = pairs / (n * n);  // n/2 strata of two, each of variance ½(a − b)², in a mean of n
  out.solid += ones / (3 * n * steps);
}

// Central differences of D, the values of which are there, into gx, gy, gz.
void differences(const Source& s, Work& w, std::size_t count) {
  w.side.resize(count);
  for (auto [along, to] : {std::pair(&w.x, &w.gx), std::pair(&w.y, &w.gy), std::pair(&w.z, &w.gz)}) {
    std::fill(to->begin(), to->end(), 0.0);
    for (const double sign : {1.0, -1.0}) {
      for (double& c : *along) c += sign * s.reach;
      s.density.values(count, w.x.data(), w.y.data(), w.z.data(), w.side.data());
      for (double& c : *along) c -= sign * s.reach;
      for (std::size_t p = 0; p < count; ++p) (*to)[p] += sign * sane(w.side[p]) / (2 * s.reach);
    }
  }
}

// Surface, normals and colour at jittered places.
void look(const Source& s, Work& w, RandomSequence& random, DensityVoxel& out) {
  constexpr int n = kEdgePlaces;
  constexpr std::size_t count = std::size_t{n} * n * n;
  const V3d corner = s.grid.origin + V3d(out.at) * s.grid.h;
  w.resize(count);
  std::size_t p = 0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i, ++p) {
        w.x[p] = corner.x + s.grid.h * (i + random.next()) / n;
        w.y[p] = corner.y + s.grid.h * (j + random.next()) / n;
        w.z[p] = corner.z + s.grid.h * (k + random.next()) / n;
      }
  s.density.values(count, w.x.data(), w.y.data(), w.z.data(), w.d.data());
  differences(s, w, count);
  w.normals.assign(count, V3d(0, 0, 0));
  std::vector<double> weight(count, 0.0);
  out.sigma.assign(s.directions.size(), 0.0);
  double dust = 0;
  for (p = 0; p < count; ++p) {
    if (!s.box.intersects(V3d(w.x[p], w.y[p], w.z[p]))) continue;
    const double d = sane(w.d[p]);
    dust += kDust * d;
    weight[p] = kDust * d;
    const V3d g = V3d(w.gx[p], w.gy[p], w.gz[p]) * (-s.grid.h / static_cast<double>(count));
    const double size = g.length();
    if (!(size > 0)) continue;
    w.normals[p] = g / size;
    weight[p] += size * static_cast<double>(count);
    out.moments.add(w.normals[p], size, true);
    for (std::size_t k = 0; k < s.directions.size(); ++k) out.sigma[k] += std::abs(g.dot(s.directions[k]));
  }
  const double flakes = dust / static_cast<double>(count);
  out.moments.covered += flakes;
  for (double* m : {&out.moments.xx, &out.moments.yy, &out.moments.zz}) *m += flakes / 3;
  for (double& v : out.sigma) v += flakes / 2;
  w.colors.assign(count, s.plain);
  if (s.color) s.color->colors(count, w.x.data(), w.y.data(), w.z.data(), w.normals.data(), 0, w.colors.data());
  double sum = 0;
  for (p = 0; p < count; ++p) {
    out.color += V3d(w.colors[p]) * weight[p];
    sum += weight[p];
  }
  if (sum > 0) out.color /= sum;
}

std::vector<DensityVoxel> true_densities(const Source& s, std::span<const V3i> cells, bool looks, Report& report) {
  std::vector<DensityVoxel> found(cells.size());
  std::atomic<std::size_t> done{0};
  // A coarse voxel holds more to be seen.
  const int rays = s.level == 0 ? 24 : 32, steps = std::min(16 << s.level, 64);
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t i) {
    thread_local Work work;
    DensityVoxel& out = found[i];
    out.at = cells[i];
    RandomSequence random(mix_bits(static_cast<std::uint64_t>(out.at.x) ^ mix_bits(static_cast<std::uint64_t>(out.at.y) ^ mix_bits(static_cast<std::uint64_t>(out.at.z) ^ mix_bits(s.seed + 64u * static_cast<unsigned>(s.level))))));
    for (int axis = 0; axis < 3; ++axis) trace(s, work, random, axis, rays, steps, out);
    if (looks && out.any && !out.full) look(s, work, random, out);
    if (report.progress) report.progress("truth of level " + std::to_string(s.level), static_cast<double>(++done) / static_cast<double>(cells.size()));
  });
  return found;
}

// Voxels the pack has surface in, and those around, in which it may have missed some.
std::vector<V3i> candidates(const Level& level, const VoxelField& crossings, const VoxelField& alpha, std::vector<V3i>& own) {
  const V3i n = level.grid.n;
  const VoxelField& field = crossings.present() ? crossings : alpha;
  for_each_active(field, n, [&](const V3i& v, const float* value) {
    if (crossings.present() || value[0] < 1 || value[1] < 1 || value[2] < 1) own.push_back(v);
  });
  std::sort(own.begin(), own.end(), voxel_before);
  std::vector<V3i> all;
  for (const V3i& v : own)
    for (int k = 0; k < 27; ++k) {
      const V3i near = v + V3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
      if (near.x >= 0 && near.y >= 0 && near.z >= 0 && near.x < n.x && near.y < n.y && near.z < n.z) all.push_back(near);
    }
  std::sort(all.begin(), all.end(), voxel_before);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

struct Sums {
  std::array<ErrorSums, 3> alpha, noise;
  ErrorSums missing, extra, solid, crossings, area, sigma, normal, angle, color;
  double here = 0, true_area = 0, area_error2 = 0, covered = 0;
};

void compare_level(const Pack& pack, int number, const Source& source, float glow, const CompareOptions& options, std::vector<Measure>& rows, Report& report) {
  const Level& level = pack.levels[static_cast<std::size_t>(number)];
  const bool surface = source.reach_known;
  const NdfField ndf(level, options.ndf_a);
  const VoxelField alpha(level, "alpha", 3), solid(level, "solid", 1), crossings(level, "crossings", 3), area(level, "area", 1), normal(level, "normal", 3), color(level, "Cd", 3);
  if (!alpha.present()) return;
  std::vector<V3i> own, all = candidates(level, crossings, alpha, own);
  const std::size_t population = all.size();
  const std::vector<V3i> chosen = sample_voxels(std::move(all), options.voxels, options.seed);
  const bool looks = (surface && (ndf.present() || normal.present() || area.present())) || color.present();
  const std::vector<DensityVoxel> truth = true_densities(source, chosen, looks, report);

  Sums sums;
  std::vector<double> sigma(source.directions.size());
  std::vector<std::pair<double, double>> areas;  // stored, true
  for (const DensityVoxel& t : truth) {
    const bool there = t.any && !t.full, here = std::binary_search(own.begin(), own.end(), t.at, voxel_before);
    sums.missing.add(there && !here);
    sums.extra.add(here && !t.any);
    if (!there && !here) continue;
    const float* a = alpha.at(t.at);
    for (std::size_t k = 0; k < 3; ++k) {
      sums.alpha[k].add((a ? static_cast<double>(a[k]) : 0) - t.alpha[k]);
      sums.noise[k].add(std::sqrt(t.noise[k]));
    }
    if (solid.present()) sums.solid.add(static_cast<double>(solid.value(t.at, 0)) - t.solid);
    add_vector(crossings.at(t.at), V3d(t.depth[0], t.depth[1], t.depth[2]), sums.crossings);
    if (surface && area.present()) {
      const auto stored = static_cast<double>(area.value(t.at, 0));
      sums.area.add(stored - t.moments.covered);
      sums.true_area += t.moments.covered;
      areas.emplace_back(stored, t.moments.covered);
    }
    if (!(t.moments.covered > 0)) continue;
    add_vector(color.at(t.at), t.color * static_cast<double>(1 - glow), sums.color);
    if (!surface) continue;
    if (const float* m = normal.at(t.at)) sums.normal.add((V3d(V3f(m[0], m[1], m[2])) - t.moments.m / t.moments.covered).length());
    const auto stored = ndf.at(t.at);
    if (!stored) continue;
    projected_areas(*stored, static_cast<double>(area.value(t.at, 0)), source.directions, sigma);
    add_sigma(sigma, t.sigma, sums.sigma);
    sums.covered += t.moments.covered;
    if (const auto axis = principal_axis(Symmetric{t.moments.xx, t.moments.yy, t.moments.zz, t.moments.xy, t.moments.xz, t.moments.yz})) sums.angle.add(axis_angle(axis_of(*stored, axis->fibre), axis->axis));
  }

  // How many there are of what only the truth tells is known by its share of the sample.
  const double share = static_cast<double>(population) / static_cast<double>(std::max<std::size_t>(chosen.size(), 1));
  const auto of = [&](const ErrorSums& s) { return std::max(s.count, static_cast<std::int64_t>(std::llround(static_cast<double>(s.count) * share))); };
  const auto counted = [&](const ErrorSums& s, const char* name) {
    Measure m = s.bias(name, static_cast<std::int64_t>(population));
    for (double* v : {&m.value, &m.low, &m.high}) *v = std::max(0.0, *v * static_cast<double>(population));
    rows.push_back(at_level(m, number));
  };
  counted(sums.missing, "voxels_missing");
  counted(sums.extra, "voxels_extra");
  if (area.present() && sums.true_area > 0) {
    // A ratio of sums over the sample (Cochran §6.4).
    double stored = 0, square = 0;
    for (const auto& [x, y] : areas) stored += x;
    const double ratio = stored / sums.true_area;
    for (const auto& [x, y] : areas) square += (x - ratio * y) * (x - ratio * y);
    const auto n = static_cast<double>(areas.size());
    const double spread = 1.96 * std::sqrt(std::max(0.0, 1 - 1 / share) * square * n / std::max(1.0, n - 1)) / sums.true_area;
    Measure m = exactly("area_relative", ratio - 1, sums.area.count);
    m.low -= spread;
    m.high += spread;
    m.of = of(sums.area);
    rows.push_back(at_level(m, number));
  }
  for (int k = 0; k < 3; ++k) {
    const auto a = static_cast<std::size_t>(k);
    const std::int64_t n = of(sums.alpha[a]);
    rows.push_back(at_level(sums.alpha[a].bias("alpha_bias", n), number, k));
    rows.push_back(at_level(sums.alpha[a].rms("alpha_rms", n), number, k));
    rows.push_back(at_level(sums.alpha[a].max("alpha_max", n), number, k));
    rows.push_back(at_level(sums.noise[a].rms("alpha_truth_noise", n), number, k));
  }
  if (sums.solid.count > 0) rows.push_back(at_level(sums.solid.rms("solid_rms", of(sums.solid)), number));
  if (sums.crossings.count > 0) rows.push_back(at_level(sums.crossings.rms("crossings_rms", of(sums.crossings)), number));
  if (sums.area.count > 0) rows.push_back(at_level(in_units(sums.area.rms("area_rms", of(sums.area)), sums.true_area / static_cast<double>(sums.area.count)), number));
  if (sums.normal.count > 0) rows.push_back(at_level(sums.normal.rms("normal_rms", of(sums.normal)), number));
  if (sums.sigma.count > 0 && area.present()) {
    const double mean = sums.covered / 2 / static_cast<double>(sums.sigma.count);
    rows.push_back(at_level(in_units(sums.sigma.rms("sigma_rms", of(sums.sigma)), mean), number));
    rows.push_back(at_level(in_units(sums.sigma.max("sigma_max", of(sums.sigma)), mean), number));
  }
  if (sums.angle.count > 0) rows.push_back(at_level(sums.angle.rms("axis_angle_rms", of(sums.angle)), number));
  if (sums.color.count > 0) {
    rows.push_back(at_level(sums.color.rms("color_rms", of(sums.color)), number));
    rows.push_back(at_level(sums.color.max("color_max", of(sums.color)), number));
  }
}

// Filled matter, of which only what lies in the box counts on either side.
void compare_volume(const Level& level, int number, const FullVolume& truth, std::vector<Measure>& rows) {
  constexpr double kSure = 1.959963984540054;  // 95 % of a normal distribution
  const VoxelField solid(level, "solid", 1);
  if (!solid.present() || !(truth.value > 0)) return;
  const double volume = sum_of(solid, level.grid.n) * std::pow(level.grid.h, 3), spread = kSure * truth.error;
  Measure m = exactly("volume_relative", volume / truth.value - 1, truth.places);
  m.low = volume / (truth.value + spread) - 1;
  m.high = spread < truth.value ? volume / (truth.value - spread) - 1 : std::numeric_limits<double>::infinity();
  m.of = kEndless;
  rows.push_back(at_level(m, number));
}

}  // namespace

Comparison compare_density(const Pack& pack, const Scene& given, const Recipe& baked, const CompareOptions& options, Report& report) {
  Comparison out;
  if (pack.levels.empty()) {
    out.skipped.push_back({"voxels", "the pack has no volume"});
    return out;
  }
  const Scene scene = baked.cyclic != std::array<bool, 3>{} && has_patterns(given) ? repeat_patterns(given, pack.grid, baked, report) : given;
  const Hypertexture& texture = *scene.hypertexture;
  const std::shared_ptr<const Field> density = make_density(texture, 0);
  const Material& material = scene.materials.front();
  const bool own = material.solid == nullptr;
  const std::shared_ptr<const SolidTexture> color = own ? hypertexture_color(texture) : material.solid;
  const std::vector<V3d> directions = half_sphere(kDirections);
  const DensityLight light = make_density_light(*density, texture.scale, pack.grid);
  const FullVolume full = full_volume(light, options.seed);
  if (!(full.value > 0)) out.skipped.push_back({"volume", "the density is 1 nowhere in the box"});
  if (!VoxelField(pack.levels[0], "alpha", 3).present()) out.skipped.push_back({"voxels", "the pack has no opacities; bake with --want visibility"});
  for (std::size_t l = 0; l < pack.levels.size(); ++l) {
    if (options.level >= 0 && l != static_cast<std::size_t>(options.level)) continue;
    const Source source{*density, pack.grid.h / (baked.samples > 0 ? baked.samples : kDensitySamples), !(baked.max_error > 0), color.get(), material.kd, texture.scale, std::max(1.0, baked.max_depth), pack.levels[l].grid, pack.grid.box(), static_cast<int>(l), options.seed, directions};
    const int number = static_cast<int>(l);
    compare_level(pack, number, source, own ? hypertexture_glow(texture) : 0, options, out.measures, report);
    compare_volume(pack.levels[l], number, full, out.measures);
    // Where the box cuts matter, too: unlike triangles, which a ray has to cross to be stopped, a density stops it from where the box begins, as its voxels do.
    const auto passed = [&light, &g = pack.levels[l].grid](const ColumnRay& ray) { return light_passed(light, g.to_world(ray.start), g.to_world(ray.start + ray.along * ray.length), ray.seed); };
    compare_columns(pack.levels[l], number, passed, {options.columns, options.seed}, out.measures, report);
  }
  if (baked.max_error > 0) out.skipped.push_back({"area and normals", "they are those of the samples' distance, which --max-error chose and the manifest does not hold"});
  return out;
}

}  // namespace texel
