#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include "bake/found.h"
#include "bake/light.h"
#include "bake/repeat.h"
#include "bake/slabs.h"
#include "bake/slice_shader.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr int kUsualSamples = 4;  // where rays are chosen: what colours of slices are filtered for

// The diffuse colour of all the surface there is, where it is the same.
std::optional<V3f> one_color(const Scene& scene, const TextureSet& textures) {
  if (!scene.mesh.colors.empty() || !scene.fibres.colors.empty()) return {};
  for (const Mesh& shape : scene.shapes)
    if (!shape.colors.empty()) return {};
  const std::vector<bool> used = used_materials(scene);
  const Material* first = nullptr;
  for (std::uint32_t m = 0; m < used.size(); ++m) {
    if (!used[m]) continue;
    const Material& material = scene.materials[m];
    if (textures.textured(m) || material.solid || (first && first->kd != material.kd)) return {};
    first = &material;
  }
  return first->kd;
}

// Whether all the surface there is has one material, but for colour.
bool one_material(const Scene& scene) {
  const std::vector<bool> used = used_materials(scene);
  const Material* first = nullptr;
  for (std::uint32_t m = 0; m < used.size(); ++m) {
    if (!used[m]) continue;
    const Material& material = scene.materials[m];
    if (first && (first->ks != material.ks || first->ke != material.ke || first->roughness != material.roughness || first->opacity != material.opacity)) return false;
    first = &material;
  }
  return true;
}

// What a bake of surfaces knows besides its job.
struct Work {
  const Job& job;
  SurfaceWant want;
  VisibilityOptions options;
  std::unique_ptr<RayScene> rays;   // what casts shadows in slices
  bool chooses = false;             // rays for an error asked for
  bool traces = false;              // any rays at all
};

Work plan_work(const Job& job, Found& found, Report& report) {
  const Recipe& recipe = job.recipe;
  const Want& want = recipe.want;
  const Scene& scene = job.scene();
  const Plan& plan = job.plan;
  const MaterialKinds& kinds = job.kinds;
  const std::optional<V3f> one = one_color(scene, *job.textures);
  if (job.colors) found.one_color = one;
  Work work{.job = job, .want = {}, .options = {}, .rays = {}};
  const bool more = kinds.ks || kinds.roughness || kinds.transparency || kinds.emission;
  work.want = {.color = job.colors && !one, .normals = want.ndf || want.normal || (want.slices && !recipe.lights.empty()),
               .material = (want.material && more) || (job.opacity && kinds.transparency), .lobes = want.ndf && recipe.lobes == 2,
               .finest_cut = recipe.max_error > 0 ? finest_cut_for(recipe.max_error) : SurfaceWant{}.finest_cut};
  VisibilityOptions& options = work.options;
  options.recompute = recipe.level_mode == LevelMode::kRecompute;
  options.visible_normals = recipe.normals == Normals::kVisible && (want.ndf || want.normal);
  if (recipe.material == MaterialOf::kVisible) {
    options.seen_material = {.color = want.color && !found.one_color, .material = want.material && work.want.material && !one_material(scene)};
    if (!options.seen_material.any() && (want.color || want.material)) report.skip("visible material", "all of the surface has the same");
  }
  found.widths.fill(kOpenThickness * plan.grid.h);
  {
    const StageTimer timer(report, "crossings");
    if (want.slices) {
      const V3d thickness = measure_thickness(scene, plan, *job.textures) * plan.grid.h;
      for (int axis = 0; axis < 3; ++axis) found.widths[static_cast<std::size_t>(axis)] = std::min(thickness[(axis + 1) % 3], thickness[(axis + 2) % 3]);
      if (report.progress) report.progress("crossings", 0);
    }
    if (want.slices && recipe.shadows && !recipe.lights.empty())
      work.rays = job.repeated ? std::make_unique<RayScene>(without_curtains(scene, plan), job.textures.get(), ScenePeriod{plan.grid.box(), recipe.cyclic})
                               : std::make_unique<RayScene>(scene, job.textures.get());
  }
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    options.slice_axes[a] = want.slices && recipe.slice_axes[a];
    // Colour of the inside needs the inside flags, which the rays along z find.
    options.volume_axes[a] = job.opacity || (want.color && plan.fill && axis == 2) || options.visible_normals || options.seen_material.any();
    options.slice_counts[a] = slice_count(recipe, plan.grid, found.widths[a], axis);
  }
  if (job.cyclic() && std::any_of(recipe.lights.begin(), recipe.lights.end(), [](const Light& l) { return l.kind == Light::Kind::kPoint; }))
    report.issue("cyclic-light", "a point light does not repeat with the scene: the slices' light has a seam");
  work.chooses = recipe.max_error > 0 && (job.opacity || want.slices);
  work.traces = options.slice_axes[0] || options.slice_axes[1] || options.slice_axes[2] || options.volume_axes[2];
  return work;
}

// 3. to 5.: three bundles of axis-parallel rays: opacity at every level of `surfaces`, inside, slices.
VisibilityResult see(Work& work, const std::vector<Surface>& surfaces, Found& found, Report& report, const Report& bar) {
  const Job& job = work.job;
  Recipe recipe = job.recipe;
  SampleChoice choice;
  Report own;
  own.progress = bar.progress;
  work.options.chosen = nullptr;
  if (work.chooses) {
    const bool beyond = work.options.first_level > 0;
    work.options.coarse_rays = coarse_rays_for(recipe.max_error, beyond);
    recipe.samples = kUsualSamples;
    if (!beyond) {
      const StageTimer timer(report, "choosing rays");
      choice = choose_samples(job.scene(), job.plan, *job.textures, surfaces[0], job.recipe, work.options, found.sums, job.kinds.cutouts, own);
      found.reached.add(choice);
      work.options.chosen = &choice.chosen;
    }
  }
  const StageTimer timer(report, "crossings");
  VisibilityResult seen;
  if (work.traces) seen = see_voxels(job.scene(), job.plan, *job.textures, surfaces, recipe, work.options, make_shader(job, surfaces[0], work.rays.get()), found.sums, own);
  else seen.levels.resize(surfaces.size());
  work.options.chosen = nullptr;
  return seen;
}

// What has to wait for the last slab: levels whose blocks reach over several.
struct Tops {
  std::vector<Surface> surfaces;
  std::vector<Visibility> seen;
};

// A report whose bar is that of a slab [from, z1), where [z0, z1) is being clipped: with several slabs one bar for all of them.
Report slab_bar(const Report& report, int from, int z0, int z1, int nz) {
  Report part;
  if (report.progress && from == 0 && z0 == 0 && z1 == nz) part.progress = report.progress;
  else if (report.progress)
    part.progress = [&report, from, z0, z1, nz](const std::string& stage, double done) {
      const double clipped = (z0 + 0.5 * (z1 - z0) * done) / nz, traced = (from + (z1 - from) * (0.5 + 0.5 * done)) / nz;
      report.progress("slabs", stage == "surface" ? clipped : traced);
    };
  return part;
}

Tops bake_slabs(Work& work, const SlabPlan& slabs, Found& found, Report& report) {
  const Job& job = work.job;
  const Plan& plan = job.plan;
  const int nz = plan.grid.n.z;
  Tops tops;
  std::vector<Surface> waiting;             // of the slab that is growing
  std::int64_t held = 0;                    // their voxels
  int count = 0;
  for (int z0 = 0, z1 = 0, from = 0; z1 < nz; z0 = z1) {
    z1 = std::min(nz, z0 + slabs.thickness);
    Report bar = slab_bar(report, from, z0, z1, nz);
    {
      const StageTimer timer(report, "surface");
      waiting.push_back(clip_surface(job.scene(), plan, *job.textures, work.want, bar, {z0, z1}));
      waiting.back().one_color = found.one_color;
      held += waiting.back().set.count;
    }
    if (z1 < nz && held + waiting.back().set.count <= slabs.voxels) continue;
    const bool only = from == 0 && z1 == nz;
    const bool whole = only && !work.chooses;    // chosen rays differ from tile to tile, so coarser levels have rays of their own
    std::vector<Surface> surfaces;
    {
      const StageTimer timer(report, "surface");
      surfaces.push_back(join_surfaces(waiting));
      if (only && surfaces[0].set.count == 0) throw Error(Code::kBadInput, "--box", "no surface lies in the box", "choose a box that meets the scene");
      const int levels = whole ? job.levels : std::min(job.levels, slabs.levels);
      while (static_cast<int>(surfaces.size()) < levels) surfaces.push_back(coarser(surfaces.back()));
    }
    waiting.clear();
    held = 0;
    work.options.slab = {from, z1};
    VisibilityResult seen = see(work, surfaces, found, report, bar);
    found.totals.add(surfaces[0], seen.levels[0]);
    if (job.recipe.want.volume()) add_parts(job, work.options.seen_material, surfaces, seen, 0, found, report, bar);
    if (!only) ++count;
    if (!whole && slabs.levels < job.levels) {
      tops.surfaces.push_back(std::move(surfaces.back()));
      tops.seen.push_back(std::move(seen.levels.back()));
    }
    from = z1;
  }
  if (found.totals.border == 0) throw Error(Code::kBadInput, "--box", "no surface lies in the box", "choose a box that meets the scene");
  if (count > 0) report.count("slabs", count);
  return tops;
}

// The levels from slabs.levels on.
void bake_tops(Work& work, const SlabPlan& slabs, Tops& tops, Found& found, Report& report) {
  std::vector<Surface> surfaces(static_cast<std::size_t>(slabs.levels) - 1);
  surfaces.push_back(join_surfaces(tops.surfaces));
  while (static_cast<int>(surfaces.size()) < work.job.levels) surfaces.push_back(coarser(surfaces.back()));
  VisibilityOptions& options = work.options;
  options.slab = {};
  options.slice_axes = {false, false, false};
  options.first_level = slabs.levels;
  VisibilityResult seen;
  if (options.recompute && work.traces) seen = see(work, surfaces, found, report, report);
  else seen.levels.resize(surfaces.size());
  seen.levels[static_cast<std::size_t>(slabs.levels) - 1] = join_visibility(tops.seen);
  add_parts(work.job, options.seen_material, surfaces, seen, slabs.levels, found, report, report);
}

}  // namespace

Found find_surfaces(const Job& job, Report& report) {
  Found found;
  found.statistics = job.plan.statistics;
  found.parts.resize(static_cast<std::size_t>(job.levels));
  Work work = plan_work(job, found, report);
  const SlabPlan slabs = plan_slabs(job.scene(), job.plan, work.want, work.options, job.recipe);
  Tops tops = bake_slabs(work, slabs, found, report);
  if (!tops.surfaces.empty()) bake_tops(work, slabs, tops, found, report);
  work.options.slice_axes = job.recipe.want.slices ? job.recipe.slice_axes : std::array<bool, 3>{};
  const StageTimer timer(report, "crossings");
  found.stacks = gather_stacks(job.plan.grid, work.options, found.sums);
  return found;
}

}  // namespace texel
