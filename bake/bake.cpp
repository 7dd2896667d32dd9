// The pipeline on one page: Scene -> Pack.
#include "bake/bake.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "bake/density_samples.h"
#include "bake/found.h"
#include "bake/job.h"
#include "bake/prune.h"
#include "bake/quantize.h"
#include "bake/round_values.h"
#include "bake/slice.h"

namespace texel {
namespace {

void make_stacks(const Job& job, Found& found, Pack& pack, Report& report) {
  const Recipe& recipe = job.recipe;
  const Grid& grid = job.plan.grid;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (!recipe.want.slices || !recipe.slice_axes[a]) continue;
    const auto records = std::make_shared<const SliceRecords>(std::move(found.stacks[a]));
    // Coarser pictures of what repeats are whole periods too.
    V3i counts = grid.n;
    counts[axis] = records->count;
    const int halves = std::min(recipe.slice_levels, periods_halve(counts, recipe));
    if (halves < recipe.slice_levels)
      report.issue("cyclic-slice-levels", "coarser stacks end early: their pixels would not fill the period (periods of a power of two voxels have all levels)");
    for (int level = 0; level <= halves; ++level) {
      SliceStack stack = make_stack(records, grid, recipe.cyclic, level);
      stack.max_angle = angle_for_slices(stack.thickness, recipe.see_in * found.widths[a]);
      pack.slices.push_back(std::move(stack));
      if (pack.slices.back().count == 1) break;
    }
  }
}

// What an error asked for has come to.
void tell_reached(const Reached& reached, const Recipe& recipe, bool density, Pack& pack, Report& report) {
  const auto text = [](double x) {
    char digits[32];
    std::snprintf(digits, sizeof digits, "%.2g", x);
    return std::string(digits);
  };
  double worst = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(reached.rays[a] > 0)) continue;  // no rays are wanted along it
    const double spread = 1.96 * std::sqrt(reached.variance[a]), rms = std::sqrt(reached.square[a] / reached.voxels);
    const double low = std::sqrt(std::max(0.0, reached.square[a] - spread) / reached.voxels), high = std::sqrt((reached.square[a] + spread) / reached.voxels);
    worst = std::max(worst, high);
    const std::string axis(1, "xyz"[a]);
    pack.errors.push_back({"alpha_rms_" + axis, rms, "opacity along " + axis + " over the border voxels of level 0, estimated from " + (density ? "voxels drawn at random and sampled at many points" : "columns drawn at random and traced with many rays") + ", as --max-error " + text(recipe.max_error) +
                                                         " asks; 95 %: " + text(low) + " to " + text(high)});
    report.count("rays a column along " + axis, reached.rays[a] / reached.voxels);
    report.count("alpha rms error along " + axis, rms);
  }
  if (!reached.met)
    report.issue("max-error", "opacity may be off by " + text(worst) + " (rms) where " + text(recipe.max_error) + " was asked for, with " + (density ? std::to_string(kMostDensitySamples) + " points along a voxel's edge" : std::string("32 x 32 rays a voxel where it is worst")) + ": a finer --resolution helps");
}

// Statistics, and what sums over voxels are off by.
void measure(const Plan& plan, const Found& found, bool volume, Pack& pack) {
  const Statistics& statistics = found.statistics;
  const Totals& totals = found.totals;
  const V3d color = found.one_color ? V3d(*found.one_color) * totals.covered : totals.color;
  const double face = plan.grid.h * plan.grid.h;
  pack.statistics = statistics;
  pack.statistics.covered_area = totals.covered * face;
  if (totals.covered > 0) pack.statistics.mean_color = V3f(color / totals.covered);
  pack.statistics.border_voxels = totals.border;
  if (statistics.area > 0)
    pack.errors.push_back({"area_relative", totals.area * face / statistics.area - 1, "sum over the level-0 voxels against the triangles' areas, before rounding to stored types; a box that cuts the scene counts as missing"});
  if (!volume) return;
  pack.statistics.inside_voxels = found.sums.inside_count;
  if (plan.fill && statistics.volume > 0)
    pack.errors.push_back({"volume_relative", (found.sums.volume + static_cast<double>(found.sums.inside_count)) * face * plan.grid.h / statistics.volume - 1,
                           "sum of solid over the level-0 voxels against the closed components' signed volumes; overlapping components count once in the voxels and twice in the mesh"});
}

// Two passes, so that the deviation loses no digits.
void describe_cube(const Hypertexture& texture, Pack& pack) {
  const Channel* c = pack.levels.empty() ? nullptr : pack.levels[0].find("Cd");
  if (!c || c->values.empty()) return;
  SolidCube cube;
  cube.octaves = kZoomOctaves;
  cube.cells = std::max(1, static_cast<int>(std::lround(texture.frequency)));
  for (const double w : zoom_weights(0)) cube.weights_start.push_back(w);
  for (const double w : zoom_weights(1)) cube.weights_end.push_back(w);
  const double count = static_cast<double>(c->values.size()) / 3;
  for (std::size_t i = 0; i < c->values.size(); ++i) cube.mean[static_cast<int>(i % 3)] += static_cast<double>(c->values[i]) / count;
  for (std::size_t i = 0; i < c->values.size(); ++i) {
    const double d = static_cast<double>(c->values[i]) - cube.mean[static_cast<int>(i % 3)];
    cube.deviation[static_cast<int>(i % 3)] += d * d / count;
  }
  for (int k = 0; k < 3; ++k) cube.deviation[k] = std::sqrt(cube.deviation[k]);
  pack.cube = cube;
  pack.cyclic = {true, true, true};
}

void prune_pack(const Recipe& recipe, Pack& pack, Report& report) {
  const StageTimer timer(report, "pruning");
  const Pruned pruned = prune_levels(pack.levels, recipe.prune);
  report.count("faint voxels left out", static_cast<double>(pruned.voxels));
  report.count("blocks made tiles", static_cast<double>(pruned.tiles));
  report.count("values left to the background", static_cast<double>(pruned.background));
  if (!pruned.judged) report.skip("pruning of faint voxels", "neither visibility nor density is wanted, by which they would be judged");
  pack.errors.push_back({"prune_column", pruned.column, "opacities left out of one column of voxels, summed: the most of any axis and level; a bound of the light that passes it beside"});
  if (pruned.voxels > 0) {
    pack.errors.push_back({"prune_area", pruned.area, "share of a level's surface in voxels left out, the most of any level"});
    pack.errors.push_back({"prune_volume", pruned.volume, "share of a level's filled volume in voxels left out, the most of any level"});
  }
  tell_errors("prune", "blocks made tiles and values left to the background", pruned.errors, pack.errors);
}

void round_pack(const Recipe& recipe, Pack& pack, Report& report) {
  const StageTimer timer(report, "quantizing");
  tell_errors("quantize", "values against those before --quantize", round_levels(pack.levels, recipe.quantize), pack.errors);
}

// 9. Slabs' parts to levels, colour running on.
void make_levels(const Job& job, Found& found, Pack& pack, Report& report) {
  const StageTimer timer(report, "levels");
  const Grid& grid = job.plan.grid;
  for (std::size_t l = 0; l < found.parts.size(); ++l) {
    pack.levels.push_back(join_parts(found.parts[l], grid.level(static_cast<int>(l)), job.recipe));
    found.parts[l] = {};
    if (report.progress) report.progress("levels", static_cast<double>(l + 1) / static_cast<double>(found.parts.size()));
  }
  const Totals& totals = found.totals;
  if (totals.tiles > 0) report.skip(std::to_string(totals.tiles) + " blocks of 8x8x8 voxels", "wholly inside: stored as tiles");
  const std::int64_t blocks = std::int64_t{(grid.n.x + 7) / 8} * ((grid.n.y + 7) / 8) * ((grid.n.z + 7) / 8);
  const std::int64_t empty = blocks - totals.blocks - totals.tiles;
  if (empty > 0) report.skip(std::to_string(empty) + " blocks of 8x8x8 voxels", "without surface: not stored unless partly inside");
  if (job.density() && job.scene().hypertexture->preset == HypertexturePreset::kOctaves) describe_cube(*job.scene().hypertexture, pack);
}

void tell_unwanted_volume(const Recipe& recipe, Report& report) {
  report.skip("volume and levels", "not wanted");
  if (recipe.prune > 0 || recipe.quantize > 0) report.skip("--prune, --quantize", "they change the volume, which is not wanted; slices stay as they are");
  if (recipe.want.levels)
    report.issue("levels-without-volume", "levels were wanted but no grid: they belong to the volume; coarser stacks of slices are --slice-levels");
}

void tell_idle_options(const Recipe& recipe, Report& report) {
  const Want& want = recipe.want;
  if (recipe.lobes == 2 && !want.ndf) report.skip("--lobes 2", "they belong to the distribution of normals, ndf, which is not wanted");
  if (!want.slices) report.skip("slices", "not wanted");
  if (!want.slices && !recipe.lights.empty()) report.skip("baked light", "it colours slices, which are not wanted");
  if (recipe.shadows && recipe.lights.empty()) report.skip("shadows", "without --light there is nothing to cast them");
}

}  // namespace

Pack bake(const Scene& scene, const Recipe& recipe, Report& report) {
  std::unique_ptr<tbb::global_control> limit;
  if (recipe.threads > 0) limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(recipe.threads));

  // 0. Functions and heights to triangles, textures.  1. The grid, the components and what takes part in the fill.
  const Job job = prepare(scene, recipe, report);
  Pack pack;
  pack.grid = job.plan.grid;
  pack.cyclic = recipe.cyclic;
  pack.density = job.density();
  pack.sources = job.scene().sources;

  // 2. Exact moments of the surface in each voxel it meets, their sums up the levels.  3. to 5. Three bundles of axis-parallel rays: opacity at every level, inside, slices.
  // 6. to 8. Normals, colour, the coarser levels' grids, slab by slab.
  Found found = job.density() ? find_density(job, report) : find_surfaces(job, report);
  if (recipe.max_error > 0) tell_reached(found.reached, recipe, job.density(), pack, report);
  for (std::size_t a = 0; a < 3; ++a)
    if (found.sums.met[a] >= 0) report.count("crossings along " + std::string(1, "xyz"[a]), static_cast<double>(found.sums.met[a]));
  make_stacks(job, found, pack, report);
  report.count("border voxels", static_cast<double>(found.totals.border));
  measure(job.plan, found, recipe.want.volume(), pack);

  if (recipe.want.volume()) {
    make_levels(job, found, pack, report);
    // 10., 11. What --prune and --quantize take out of finished levels: no level is computed from what they leave.
    if (recipe.prune > 0) prune_pack(recipe, pack, report);
    if (recipe.quantize > 0) round_pack(recipe, pack, report);
  } else {
    tell_unwanted_volume(recipe, report);
  }
  tell_idle_options(recipe, report);
  pack.issues = report.issues;
  pack.skipped = report.skipped;
  return pack;
}

}  // namespace texel
