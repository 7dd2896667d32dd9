#include "bake/job.h"

#include <algorithm>
#include <bit>
#include <optional>
#include <string>
#include <utility>

#include "bake/bake.h"
#include "bake/fibre_tubes.h"
#include "bake/height_mesh.h"
#include "bake/hypertexture.h"
#include "bake/nesting.h"
#include "bake/polygonize.h"
#include "bake/repeat.h"
#include "bake/repeat_functions.h"
#include "bake/slice.h"
#include "formats/error.h"
#include "formats/instances.h"

namespace texel {
namespace {

void check_recipe(const Recipe& recipe) {
  if (!(recipe.prune >= 0 && recipe.prune <= 0.25)) throw Error(Code::kCommandLine, "--prune", std::to_string(recipe.prune), "give 0 to 0.25");
  if (!(recipe.quantize >= 0 && recipe.quantize <= 0.0625)) throw Error(Code::kCommandLine, "--quantize", std::to_string(recipe.quantize), "give 0 to 0.0625");
  if (recipe.lobes < 1 || recipe.lobes > 2) throw Error(Code::kCommandLine, "--lobes", std::to_string(recipe.lobes), "give 1 or 2");
  if (recipe.lobes == 2 && recipe.ndf != NdfKind::kSggx) throw Error(Code::kCommandLine, "--lobes 2", "two lobes are SGGX matrices, --ndf neyret and ratib have one ellipsoid", "give --ndf sggx or --lobes 1");
  if (recipe.lobes == 2 && recipe.normals == Normals::kVisible) throw Error(Code::kUnsupported, "--lobes 2", "visible normals are counted for one lobe in this version", "give --normals all or --lobes 1");
  if (recipe.samples < 0 || recipe.samples > 64) throw Error(Code::kCommandLine, "--samples", std::to_string(recipe.samples), "give 1 to 64");
}

MaterialKinds find_kinds(const Scene& scene, const TextureSet& textures) {
  const std::vector<bool> used = used_materials(scene);
  MaterialKinds kinds;
  for (std::uint32_t m = 0; m < scene.materials.size(); ++m) {
    if (!used[m]) continue;
    const Material& material = scene.materials[m];
    kinds.ks = kinds.ks || material.ks != V3f(0, 0, 0);
    kinds.roughness = kinds.roughness || material.roughness < 1;
    kinds.transparency = kinds.transparency || material.opacity < 1;
    kinds.emission = kinds.emission || material.ke != V3f(0, 0, 0);
    kinds.cutouts = kinds.cutouts || textures.has_cutouts(m);
  }
  return kinds;
}

int level_count(const Grid& grid, const Recipe& recipe, Report& report) {
  if (!recipe.want.levels || recipe.levels == 1) return 1;
  int levels = 1;
  for (int longest = std::max({grid.n.x, grid.n.y, grid.n.z}); longest > 1; longest = (longest + 1) / 2) ++levels;
  if (recipe.levels > 0) levels = std::min(levels, recipe.levels);
  const int whole = periods_halve(grid.n, recipe) + 1;
  if (whole < levels)
    report.issue("cyclic-levels", std::to_string(levels - whole) + " levels fewer: the next one's voxels would not fill the period (periods of a power of two voxels have all levels)");
  return std::min(levels, whole);
}

constexpr std::size_t kMostCopied = 5'000'000;  // triangles: half a gigabyte

// Whether an instance of inside-out solids may lie in another solid: whether it is a cavity depends on what is around it, which a shape by itself does not know.
bool may_hold_cavities(const Scene& scene, const Recipe& recipe) {
  if (recipe.fill == Fill::kOff) return false;
  std::size_t triangles = 0;
  for (const Instance& instance : scene.instances) triangles += scene.shapes[instance.shape].triangles.size();
  if (triangles > kMostCopied) return false;
  std::vector<bool> inside_out;
  for (const Mesh& shape : scene.shapes) {
    std::vector<std::int8_t> turn, winding;
    Report found;
    (void)find_shape_solids(shape, scene.materials, recipe, turn, winding, found);
    inside_out.push_back(std::any_of(found.issues.begin(), found.issues.end(), [](const Issue& i) { return i.id == "mesh-inside-out"; }));
  }
  if (std::find(inside_out.begin(), inside_out.end(), true) == inside_out.end()) return false;
  std::vector<Box3d> boxes;
  std::vector<bool> asks;
  for (const Instance& instance : scene.instances) {
    const Mesh& shape = scene.shapes[instance.shape];
    Box3d box;
    for (const V3d& p : shape.points) box.extendBy(instance.place * p);
    boxes.push_back(box);
    asks.push_back(inside_out[instance.shape]);
  }
  Box3d mesh;
  for (const V3d& p : scene.mesh.points) mesh.extendBy(p);
  boxes.push_back(mesh);
  asks.push_back(false);
  return any_within_another(boxes, asks);
}

// Patterns are given their period, then height fields and implicit surfaces become triangles, unless the caller has seen to it.
void make_triangles(const Scene& given, Job& job, Report& report) {
  const Recipe& recipe = job.recipe;
  std::optional<Scene> made;
  if (job.cyclic() && has_patterns(given)) made = repeat_patterns(given, plan_grid(given, recipe), recipe, report);
  if (!given.heights.empty() || (!given.implicits.empty() && given.mesh.made == 0))
    made = polygonize(mesh_heights(made ? *std::move(made) : given, recipe, report), recipe, report);
  if (given.fibres.strands() > 0) made = mesh_thick_fibres(made ? *std::move(made) : given, recipe, report);
  if (made) job.made = std::make_unique<const Scene>(*std::move(made));
}

// The grid, the components and what takes part in the fill; what repeats gets its copies.
void plan_surfaces(Job& job, Report& report) {
  const StageTimer timer(report, "plan");
  const Scene& source = job.source();
  const Recipe& recipe = job.recipe;
  const TextureSet& textures = *job.textures;
  Plan& plan = job.plan;
  std::vector<bool> cutouts;
  bool textured = false;
  for (std::uint32_t m = 0; m < source.materials.size(); ++m) {
    cutouts.push_back(textures.has_cutouts(m));
    textured = textured || textures.textured(m);
  }
  plan = make_plan(source, recipe, cutouts, report);
  if (job.cyclic()) {
    Scene repeated = repeat_scene(source, recipe.cyclic, plan, report);
    if (!plan.fibres.empty()) {
      repeated.fibres = repeat_fibres(source.fibres, plan.grid, recipe.cyclic);
      plan.fibres = fibre_segments(repeated, plan.grid);
    }
    job.repeated = std::make_unique<const Scene>(std::move(repeated));
  }
  if (!textured) return;
  plan.uv_width = uv_widths(textures, job.scene().mesh);
  for (std::size_t i = 0; i < plan.shapes.size(); ++i) plan.shapes[i].uv_width = uv_widths(textures, source.shapes[i]);
}

}  // namespace

int periods_halve(const V3i& counts, const Recipe& recipe) {
  int most = 31;
  for (int a = 0; a < 3; ++a)
    if (recipe.cyclic[static_cast<std::size_t>(a)]) most = std::min(most, std::countr_zero(static_cast<unsigned>(counts[a])));
  return most;
}

int slice_count(const Recipe& recipe, const Grid& grid, double width, int axis) {
  if (recipe.slice_count > 0) return recipe.slice_count;
  if (recipe.slice_count == 0) return grid.n[axis];
  return slices_for_angle(grid.n[axis] * grid.h, recipe.see_in * width, recipe.max_angle);
}

Job prepare(const Scene& scene, const Recipe& recipe, Report& report) {
  check_recipe(recipe);
  Job job;
  job.recipe = recipe;
  job.given = &scene;
  job.opacity = recipe.want.density || recipe.want.visibility;
  job.colors = recipe.want.color || recipe.want.slices;
  // What repeats is cut at the box and closed there, which takes triangles of its own; and so do cavities that are instances.
  if (!scene.instances.empty() && (job.cyclic() || may_hold_cavities(scene, recipe))) job.flat = std::make_unique<const Scene>(flatten_instances(scene));
  const Scene& given = job.flat ? *job.flat : scene;
  make_triangles(given, job, report);
  {
    // As far as colour or cut-outs need them.
    const StageTimer timer(report, "textures");
    job.textures = std::make_unique<const TextureSet>(job.source(), job.colors ? TextureSet::Need::kColor : TextureSet::Need::kCoverage, report);
  }
  const Scene& source = job.source();
  job.kinds = find_kinds(source, *job.textures);
  // Of a density all three axes share samples³ points a voxel.
  if (job.recipe.samples == 0) job.recipe.samples = job.density() ? kDensitySamples : job.kinds.cutouts || source.fibres.strands() > 0 ? 6 : 4;
  if (job.density()) {
    job.plan.grid = plan_grid(given, job.recipe);  // of one copy, where it repeats
    job.kinds.emission = source.materials.front().solid == nullptr && hypertexture_glow(*source.hypertexture) > 0;
  } else {
    report.count("samples", job.recipe.samples);
    plan_surfaces(job, report);
  }
  // Told also where there is no share to tell: whoever listens may want to stop the bake.
  if (report.progress) report.progress("plan", 1);
  if (recipe.want.volume()) job.levels = level_count(job.plan.grid, recipe, report);
  return job;
}

}  // namespace texel
