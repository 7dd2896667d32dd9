// Pack against the geometry it was made from.
#include <algorithm>
#include <cmath>
#include <string>

#include "bake/block_index.h"
#include "bake/compare_columns.h"
#include "bake/compare_voxels.h"
#include "bake/light.h"
#include "bake/repeat.h"
#include "bake/truth_voxels.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr int kDirections = 64;

// Voxels in which the pack has surface.
std::vector<V3i> surface_voxels(const Level& level) {
  std::vector<V3i> voxels;
  for (const char* name : {"area", "normal", "S_diag", "axis_1", "crossings"}) {
    const Layer* layer = nullptr;
    if (!level.find(name, &layer)) continue;
    for_each_voxel(layer->set, [&](const V3i& v, std::int64_t) { voxels.push_back(v); });
    std::sort(voxels.begin(), voxels.end(), voxel_before);
    return voxels;
  }
  const VoxelField alpha(level, "alpha", 3);
  for_each_active(alpha, level.grid.n, [&](const V3i& v, const float* a) {
    if (a[0] < 1 || a[1] < 1 || a[2] < 1) voxels.push_back(v);
  });
  std::sort(voxels.begin(), voxels.end(), voxel_before);
  return voxels;
}

struct Fields {
  NdfField ndf;
  VoxelField alpha, solid, area, coverage, normal, color, ks, roughness, transparency, emission;
  Fields(const Level& level, NdfKind kind)
      : ndf(level, kind), alpha(level, "alpha", 3), solid(level, "solid", 1), area(level, "area", 1), coverage(level, "coverage", 1), normal(level, "normal", 3), color(level, "Cd", 3), ks(level, "ks", 3), roughness(level, "roughness", 1), transparency(level, "transparency", 1), emission(level, "emission", 3) {}
  [[nodiscard]] bool material() const { return ks.present() || roughness.present() || transparency.present() || emission.present(); }
};

struct Sums {
  std::array<ErrorSums, 3> alpha, noise;
  ErrorSums solid, area, coverage, sigma, normal, angle, color, ks, roughness, transparency, emission;
  double true_area = 0, covered = 0;  // covered: of the voxels in sigma
  std::int64_t indefinite = 0;
};

// What the recipe averages over: all surface, or what is seen of it.
void add_material(const VoxelTruth& t, const Fields& f, bool seen, Sums& to) {
  seen = seen && t.seen.area > 0;
  const double area = seen ? t.seen.area : t.moments.covered;
  const MaterialSums& sums = seen ? t.seen.material : t.material;
  add_vector(f.color.at(t.at), seen ? t.seen.color / area : t.color, to.color);
  add_vector(f.ks.at(t.at), sums.ks / area, to.ks);
  add_vector(f.emission.at(t.at), sums.emission / area, to.emission);
  if (const float* r = f.roughness.at(t.at)) to.roughness.add(static_cast<double>(*r) - mean_roughness(sums, area));
  if (const float* c = f.transparency.at(t.at)) to.transparency.add(static_cast<double>(*c) - sums.transparency / area);
}

void add_voxel(const VoxelTruth& t, const Fields& f, bool visible, std::span<const V3d> directions, std::span<double> sigma, Sums& to) {
  const float* alpha = f.alpha.at(t.at);
  for (std::size_t k = 0; k < 3; ++k) {
    to.alpha[k].add((alpha ? static_cast<double>(alpha[k]) : 0) - t.alpha[k]);
    to.noise[k].add(std::sqrt(t.noise[k]));
  }
  to.solid.add(static_cast<double>(f.solid.value(t.at, 0)) - t.solid);
  const auto area = static_cast<double>(f.area.value(t.at, 0));
  to.area.add(area - t.area);
  to.true_area += t.area;
  const Moments& moments = visible && t.visible.covered > 0 ? t.visible : t.moments;
  if (!(t.moments.covered > 0)) return;
  const auto covered = area * static_cast<double>(f.coverage.value(t.at, 1));
  to.coverage.add(static_cast<double>(f.coverage.value(t.at, 1)) - t.moments.covered / t.area);
  if (const float* m = f.normal.at(t.at)) to.normal.add((V3d(V3f(m[0], m[1], m[2])) - moments.m / moments.covered).length());
  const auto ndf = f.ndf.at(t.at);
  const auto lobes = f.ndf.lobes(t.at);
  if (!ndf || !lobes) return;
  to.indefinite += is_indefinite(*ndf) || is_indefinite(lobes->ndf[0]) || is_indefinite(lobes->ndf[1]);
  if (!visible) {
    projected_areas(*lobes, covered, directions, sigma);
    add_sigma(sigma, t.sigma, to.sigma);
    to.covered += t.moments.covered;
  }
  if (const auto axis = principal_axis(Symmetric{moments.xx, moments.yy, moments.zz, moments.xy, moments.xz, moments.yz})) to.angle.add(axis_angle(axis_of(*ndf, axis->fibre), axis->axis));
}

struct Work {
  const Pack& pack;
  const TruthScene& truth;
  const Recipe& baked;
  const CompareOptions& options;
  Comparison& out;
  Report& report;
};

void compare_level(const Work& work, int number, const Surface& surface) {
  const Level& level = work.pack.levels[static_cast<std::size_t>(number)];
  std::vector<Measure>& rows = work.out.measures;
  const Fields f(level, work.options.ndf_a);

  std::vector<V3i> there, here = surface_voxels(level), all;
  for_each_voxel(surface.set, [&](const V3i& v, std::int64_t) { there.push_back(v); });
  std::sort(there.begin(), there.end(), voxel_before);
  std::set_union(there.begin(), there.end(), here.begin(), here.end(), std::back_inserter(all), voxel_before);
  const auto missing = static_cast<std::int64_t>(all.size() - here.size()), extra = static_cast<std::int64_t>(all.size() - there.size()), of = static_cast<std::int64_t>(all.size());
  rows.push_back(at_level(exactly("voxels_missing", static_cast<double>(missing), of), number));
  rows.push_back(at_level(exactly("voxels_extra", static_cast<double>(extra), of), number));

  // Sums over everything.
  if (f.area.present()) {
    double area = 0;
    for (const Areas& a : surface.areas) area += a.area;
    if (work.truth.whole) area = work.truth.plan.statistics.area / (work.pack.grid.h * work.pack.grid.h);
    area /= std::pow(4.0, number);
    if (area > 0) rows.push_back(at_level(exactly("area_relative", sum_of(f.area, level.grid.n) / area - 1, of), number));
  }
  const double volume = work.truth.plan.statistics.volume / std::pow(level.grid.h, 3);
  if (f.solid.present() && work.truth.plan.fill && work.truth.whole && volume > 0)
    rows.push_back(at_level(exactly("volume_relative", sum_of(f.solid, level.grid.n) / volume - 1, of), number));

  const std::vector<V3d> directions = half_sphere(kDirections);
  const bool seen = work.baked.material == MaterialOf::kVisible && (f.color.present() || f.material());
  TruthOptions what{.rays = f.alpha.present() || work.baked.normals == Normals::kVisible || seen ? 64 : 0, .directions = directions, .bins = false, .color = f.color.present(), .visible_material = seen, .seed = work.options.seed};
  const std::vector<V3i> chosen = sample_voxels(std::move(all), work.options.voxels, work.options.seed);
  const std::vector<VoxelTruth> voxels = true_voxels(work.truth, number, chosen, what, work.report);
  if (voxels.empty()) return;
  Sums sums;
  std::vector<double> sigma(directions.size());
  for (const VoxelTruth& t : voxels) add_voxel(t, f, work.baked.normals == Normals::kVisible, directions, sigma, sums);
  for (const VoxelTruth& t : voxels)
    if (t.moments.covered > 0) add_material(t, f, seen, sums);

  // Of measures that only some voxels have, the population is not known better than by their share.
  const auto population = [&](const ErrorSums& s) {
    return static_cast<std::int64_t>(chosen.size()) == of ? s.count : std::max(s.count, static_cast<std::int64_t>(std::llround(static_cast<double>(of) * static_cast<double>(s.count) / static_cast<double>(chosen.size()))));
  };
  if (f.alpha.present())
    for (int k = 0; k < 3; ++k) {
      const auto a = static_cast<std::size_t>(k);
      rows.push_back(at_level(sums.alpha[a].bias("alpha_bias", of), number, k));
      rows.push_back(at_level(sums.alpha[a].rms("alpha_rms", of), number, k));
      rows.push_back(at_level(sums.alpha[a].max("alpha_max", of), number, k));
      rows.push_back(at_level(sums.noise[a].rms("alpha_truth_noise", of), number, k));
    }
  if (f.solid.present() && what.rays > 0) rows.push_back(at_level(sums.solid.rms("solid_rms", of), number));
  if (f.area.present()) {
    rows.push_back(at_level(in_units(sums.area.rms("area_rms", of), sums.true_area / static_cast<double>(voxels.size())), number));
  }
  if (f.coverage.present()) rows.push_back(at_level(sums.coverage.rms("coverage_rms", population(sums.coverage)), number));
  if (f.normal.present()) rows.push_back(at_level(sums.normal.rms("normal_rms", population(sums.normal)), number));
  if (f.ndf.present()) {
    if (f.area.present() && work.baked.normals == Normals::kAll) {
      const double mean = sums.covered / 2 / static_cast<double>(std::max<std::int64_t>(sums.sigma.count, 1));
      rows.push_back(at_level(in_units(sums.sigma.rms("sigma_rms", population(sums.sigma)), mean), number));
      rows.push_back(at_level(in_units(sums.sigma.max("sigma_max", population(sums.sigma)), mean), number));
    }
    if (sums.angle.count > 0) {
      rows.push_back(at_level(sums.angle.rms("axis_angle_rms", population(sums.angle)), number));
      rows.push_back(at_level(sums.angle.max("axis_angle_max", population(sums.angle)), number));
    }
    rows.push_back(at_level(exactly("indefinite", static_cast<double>(sums.indefinite), static_cast<std::int64_t>(voxels.size())), number));
  }
  if (f.color.present() && sums.color.count > 0) {
    rows.push_back(at_level(sums.color.rms("color_rms", population(sums.color)), number));
    rows.push_back(at_level(sums.color.max("color_max", population(sums.color)), number));
  }
  const auto add_rms = [&](const ErrorSums& s, const char* name) {
    if (s.count > 0) rows.push_back(at_level(s.rms(name, population(s)), number));
  };
  add_rms(sums.ks, "ks_rms");
  add_rms(sums.roughness, "roughness_rms");
  add_rms(sums.transparency, "transparency_rms");
  add_rms(sums.emission, "emission_rms");
}

}  // namespace

Comparison compare_truth(const Pack& pack, const Scene& scene, const Recipe& baked, const CompareOptions& options, Report& report) {
  if (scene.hypertexture) return compare_density(pack, scene, baked, options, report);
  Comparison out;
  if (pack.levels.empty()) {
    out.skipped.push_back({"voxels", "the pack has no volume"});
    return out;
  }
  const auto truth = make_truth_scene(scene, baked, pack.grid, report);
  std::vector<Surface> surfaces;
  surfaces.push_back(clip_surface(truth->scene, truth->plan, truth->textures, {.color = false, .normals = false, .material = false}, report));
  if (surfaces[0].set.count == 0) throw Error(Code::kBadInput, "", "the scene has no surface in the pack's box", "name the scene the pack was baked from");
  if (baked.normals == Normals::kVisible) out.skipped.push_back({"sigma_rms, sigma_max", "the pack holds visible normals alone, which have no projected area of all surface"});
  const Work work{pack, *truth, baked, options, out, report};
  const bool cut = truth->plan.fill && !truth->whole;
  if (cut) out.skipped.push_back({"columns and directions", "the box cuts filled matter: rays that begin in it meet nothing"});
  const RayScene rays(truth->scene, &truth->textures);
  for (std::size_t l = 0; l < pack.levels.size(); ++l) {
    if (l > 0) {
      surfaces.push_back(coarser(surfaces.back()));
      surfaces.erase(surfaces.begin());
    }
    if (options.level >= 0 && l != static_cast<std::size_t>(options.level)) continue;
    const int number = static_cast<int>(l);
    compare_level(work, number, surfaces.back());
    const auto passed = [&rays, &g = pack.levels[l].grid](const ColumnRay& ray) {
      constexpr double kRoom = 1e-3;  // voxels: surface in the box's own wall is met
      return 1 - static_cast<double>(rays.blocked(g.to_world(ray.start - ray.along * kRoom), g.to_world(ray.start + ray.along * (ray.length + kRoom))));
    };
    if (!cut) compare_columns(pack.levels[l], number, passed, {options.columns, options.seed}, out.measures, report);
  }
  for (const Skip& s : report.skipped)
    if (s.what.starts_with("truth of level")) out.skipped.push_back(s);
  return out;
}

}  // namespace texel
