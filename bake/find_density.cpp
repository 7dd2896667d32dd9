#include <memory>
#include <utility>

#include "bake/density_samples.h"
#include "bake/found.h"
#include "bake/hypertexture.h"
#include "formats/error.h"

namespace texel {
namespace {

void refuse_options(const Recipe& recipe) {
  const auto unsupported = [](const char* option, const char* what) { throw Error(Code::kUnsupported, option, what, "leave it out"); };
  if (recipe.shadows) unsupported("--shadows", "a density casts no shadows in this version");
  if (recipe.material == MaterialOf::kVisible) unsupported("--material visible", "a density has no one surface to see");
  if (recipe.normals == Normals::kVisible) unsupported("--normals visible", "a density has no one surface to see");
  if (recipe.lobes == 2) unsupported("--lobes 2", "a density's normals go all ways between its surfaces and have one lobe in this version");
  if (recipe.fill == Fill::kOn) unsupported("--fill on", "a density is solid where it is 1 and has nothing to fill");
}

}  // namespace

Found find_density(const Job& job, Report& report) {
  Recipe recipe = job.recipe;
  const Scene& scene = job.scene();
  const Grid& grid = job.plan.grid;
  refuse_options(recipe);
  Found found;
  found.statistics = job.plan.statistics;
  found.widths.fill(kOpenThickness * grid.h);
  DensityOptions options;
  options.levels = job.levels;
  options.color = recipe.want.color || recipe.want.slices || recipe.want.material;
  options.opacity = recipe.want.density || recipe.want.visibility || recipe.want.slices;
  options.recompute = recipe.level_mode == LevelMode::kRecompute;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    options.slice_axes[a] = recipe.want.slices && recipe.slice_axes[a];
    options.slice_counts[a] = slice_count(recipe, grid, found.widths[a], axis);
  }
  if (recipe.max_error > 0 && !options.opacity) recipe.samples = kDensitySamples;
  if (recipe.max_error > 0 && options.opacity) {
    const StageTimer timer(report, "choosing points");
    const DensityChoice choice = choose_density_samples(*make_density(*scene.hypertexture, 0), grid, recipe, scene.hypertexture->scale, report);
    recipe.samples = choice.samples;
    found.reached = {.square = choice.square, .variance = choice.variance, .met = choice.met};
  }
  report.count("samples", recipe.samples);
  DensityBake baked;
  {
    const StageTimer timer(report, "density");
    baked = bake_density(scene, grid, recipe, options, report);
  }
  found.reached.voxels = static_cast<double>(baked.surfaces[0].set.count);
  if (recipe.max_error > 0 && options.opacity) found.reached.rays.fill(found.reached.voxels * recipe.samples * recipe.samples);
  found.statistics.area = baked.area;
  found.statistics.volume = baked.mass;
  found.totals.add(baked.surfaces[0], baked.seen.levels[0]);
  found.sums.volume = baked.filled;
  found.sums.inside_count = baked.seen.levels[0].inside_count;
  found.stacks = std::move(baked.stacks);
  found.parts.resize(static_cast<std::size_t>(job.levels));
  if (recipe.want.volume()) add_parts(job, {}, baked.surfaces, baked.seen, 0, found, report, report);
  return found;
}

}  // namespace texel
