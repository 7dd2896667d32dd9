// The pipeline on one page: Scene -> Pack.
#include "bake/bake.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "bake/block_index.h"
#include "bake/color.h"
#include "bake/density_samples.h"
#include "bake/fibre_tubes.h"
#include "bake/height_mesh.h"
#include "bake/hypertexture.h"
#include "bake/levels.h"
#include "bake/light.h"
#include "bake/plan.h"
#include "bake/polygonize.h"
#include "bake/prune.h"
#include "bake/quantize.h"
#include "bake/repeat.h"
#include "bake/repeat_functions.h"
#include "bake/round_values.h"
#include "bake/samples.h"
#include "bake/slabs.h"
#include "bake/slice.h"
#include "bake/surface.h"
#include "bake/texture.h"
#include "bake/visibility.h"
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

// How often what repeats can be halved: a voxel must never hold the end of one period and the beginning of the next.
int periods_halve(const V3i& counts, const Recipe& recipe) {
  int most = 31;
  for (int a = 0; a < 3; ++a)
    if (recipe.cyclic[static_cast<std::size_t>(a)]) most = std::min(most, std::countr_zero(static_cast<unsigned>(counts[a])));
  return most;
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

// Slices along an axis when the eye may look see_in of the width across it, world units, into the object.
int slice_count(const Recipe& recipe, const Grid& grid, double width, int axis) {
  if (recipe.slice_count > 0) return recipe.slice_count;
  if (recipe.slice_count == 0) return grid.n[axis];
  return slices_for_angle(grid.n[axis] * grid.h, recipe.see_in * width, recipe.max_angle);
}

// Colour of a fibre where a sub-ray meets it, lit where lights are given. It is round, and a stack is seen from both sides: light counts as the mean over its
// wall, (sin θ)/π of what a facing surface gets, θ between fibre and light.
V3f fibre_color(const Scene& scene, const Plan& plan, std::span<const Light> lights, const RayScene* rays, const FibreSegment& fibre, double s, V3f color) {
  const std::vector<V3f>& colors = scene.fibres.colors;
  if (!colors.empty()) color *= colors[fibre.point] * static_cast<float>(1 - s) + colors[fibre.point + 1] * static_cast<float>(s);
  if (lights.empty()) return color;
  const V3d t = (fibre.b - fibre.a).normalized(), axis = plan.grid.to_world(fibre.a + (fibre.b - fibre.a) * s);
  const double radius = (fibre.ra + (fibre.rb - fibre.ra) * s) * plan.grid.h;
  return color * fibre_irradiance(lights, rays, axis, t, radius);
}

// Lives as long as the tracing: colours of slices, lit where lights are given.
SliceShader make_shader(const Scene& scene, const Plan& plan, const TextureSet& textures, const Surface& surface, const Recipe& recipe, const RayScene* rays) {
  const auto width = static_cast<float>(plan.grid.h / recipe.samples);
  const auto light = [&plan, &recipe, rays](V3f color, const V3d& voxel_point, const V3d& normal, bool two_sided) {
    if (recipe.lights.empty()) return color;
    const V3d point = plan.grid.to_world(voxel_point);
    return color * irradiance(recipe.lights, rays, point, normal, two_sided);
  };
  // A solid texture's colours are known already, averaged over each voxel: as much as a slice can show, at no cost a ray.
  std::shared_ptr<const BlockIndex> blocks;
  for (const Material& material : scene.materials)
    if (material.solid && !blocks && !surface.color.empty()) blocks = std::make_shared<const BlockIndex>(surface.set, plan.grid.n);
  const auto solid_color = [&surface, blocks](const Bundle& bundle, const Crossing& c, double u, double v, V3f* color) {
    V3i voxel;
    voxel[bundle.axes.u] = static_cast<int>(u);
    voxel[bundle.axes.v] = static_cast<int>(v);
    voxel[bundle.axes.w] = c.cell;
    if (c.cell < 0) return;
    const std::int32_t slot = (*blocks)(V3i(voxel.x >> 3, voxel.y >> 3, voxel.z >> 3));
    if (slot < 0) return;
    const Block& block = surface.set.blocks[static_cast<std::size_t>(slot)];
    if (!block.has(voxel.x & 7, voxel.y & 7, voxel.z & 7)) return;
    const auto i = static_cast<std::size_t>(block.index(voxel.x & 7, voxel.y & 7, voxel.z & 7));
    if (surface.areas[i].covered > 0) *color = surface.mean_color(i);
  };
  SliceShader shader;
  shader.crossing = [blocks, solid_color, &scene, &plan, &textures, &recipe, width, light, rays](const Bundle& bundle, const Crossing& c, double u, double v) {
    if (const FibreSegment* fibre = crossed_fibre(bundle, c)) {
      V3f color = scene.materials[fibre->material].kd;
      if (blocks && scene.materials[fibre->material].solid) solid_color(bundle, c, u, v, &color);
      return fibre_color(scene, plan, recipe.lights, rays, *fibre, fibre_place(bundle, *fibre, u, v), color);
    }
    if (recipe.lights.empty() && c.page == 0 && scene.mesh.colors.empty() && !textures.textured(scene.mesh.materials[c.triangle]) && !scene.materials[scene.mesh.materials[c.triangle]].solid)
      return scene.materials[scene.mesh.materials[c.triangle]].kd;  // most surface: nothing to look up
    const Face face = crossed_face(bundle, c);
    const std::uint32_t material = face.material;
    V3f color = scene.materials[material].kd;
    const auto& [p0, p1, p2] = face.p;
    if (blocks && scene.materials[material].solid) solid_color(bundle, c, u, v, &color);
    else if (textures.textured(material) || !face.mesh->colors.empty()) {
      const Barycentrics b = face_barycentrics(bundle.axes, p0, p1, p2, u, v);
      color = footprint_sample(textures, *face.mesh, face.triangle, b.b1, b.b2, face.uv_width * width).color;
    }
    if (recipe.lights.empty()) return color;
    // On the triangle's own plane: the crossing's depth belongs to the fixed-point outline, and where the surface is steep along the
    // ray that is far enough off to lie in its own shadow.
    const Barycentrics b = face_barycentrics(bundle.axes, p0, p1, p2, u, v);
    const V3d point = p0 + (p1 - p0) * b.b1 + (p2 - p0) * b.b2;
    const V3d normal = triangle_normal(p0, p1, p2) * static_cast<double>(face.turn);
    return light(color, point, normal, plan.is_two_sided(face.winding, material));
  };
  shader.voxel = [&surface, light](const V3i& voxel, std::int64_t index) {
    const auto i = static_cast<std::size_t>(index);
    if (!(surface.areas[i].covered > 0)) return V3f(-1, -1, -1);
    const V3f color = surface.mean_color(i);
    if (surface.moments.empty()) return color;  // unlit
    const Moments& m = surface.moments[i];
    const double length = m.m.length();
    const V3d normal = length > 0 ? m.m / length : V3d(0, 0, 1);
    // Half a voxel's diagonal off its middle, so that the voxel's own surface casts no shadow on it.
    return light(color, V3d(voxel.x + 0.5, voxel.y + 0.5, voxel.z + 0.5) + normal * 0.87, normal, !(length > 0));
  };
  return shader;
}

void make_stacks(const Recipe& recipe, const Plan& plan, const std::array<double, 3>& widths, std::array<SliceRecords, 3> stacks, Pack& pack, Report& report) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (!recipe.want.slices || !recipe.slice_axes[a]) continue;
    const auto records = std::make_shared<const SliceRecords>(std::move(stacks[a]));
    // Coarser pictures of what repeats are whole periods too.
    V3i counts = plan.grid.n;
    counts[axis] = records->count;
    const int halves = std::min(recipe.slice_levels, periods_halve(counts, recipe));
    if (halves < recipe.slice_levels)
      report.issue("cyclic-slice-levels", "coarser stacks end early: their pixels would not fill the period (periods of a power of two voxels have all levels)");
    for (int level = 0; level <= halves; ++level) {
      SliceStack stack = make_stack(records, plan.grid, recipe.cyclic, level);
      stack.max_angle = angle_for_slices(stack.thickness, recipe.see_in * widths[a]);
      pack.slices.push_back(std::move(stack));
      if (pack.slices.back().count == 1) break;
    }
  }
}

// What choose_samples expects of all slabs together.
struct Reached {
  std::array<double, 3> square{0, 0, 0}, variance{0, 0, 0}, rays{0, 0, 0};
  double voxels = 0;
  bool met = true;
  void add(const SampleChoice& c) {
    for (std::size_t a = 0; a < 3; ++a) {
      square[a] += c.square[a];
      variance[a] += c.variance[a];
      rays[a] += c.rays[a] * c.voxels;
    }
    voxels += c.voxels;
    met = met && c.met;
  }
};

constexpr double kOpenThickness = 2;  // voxels: what measure_thickness says of matter that is not solid

// Stages 1 to 5 of a density. Sets the plan's statistics.
DensityBake bake_scene_density(const Scene& scene, Plan& plan, Recipe recipe, int levels, Reached& reached, Report& report) {
  const auto unsupported = [](const char* option, const char* what) { throw Error(Code::kUnsupported, option, what, "leave it out"); };
  if (recipe.shadows) unsupported("--shadows", "a density casts no shadows in this version");
  if (recipe.material == MaterialOf::kVisible) unsupported("--material visible", "a density has no one surface to see");
  if (recipe.normals == Normals::kVisible) unsupported("--normals visible", "a density has no one surface to see");
  if (recipe.lobes == 2) unsupported("--lobes 2", "a density's normals go all ways between its surfaces and have one lobe in this version");
  if (recipe.fill == Fill::kOn) unsupported("--fill on", "a density is solid where it is 1 and has nothing to fill");
  DensityOptions options;
  options.levels = levels;
  options.color = recipe.want.color || recipe.want.slices || recipe.want.material;
  options.opacity = recipe.want.density || recipe.want.visibility || recipe.want.slices;
  options.recompute = recipe.level_mode == LevelMode::kRecompute;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    options.slice_axes[a] = recipe.want.slices && recipe.slice_axes[a];
    options.slice_counts[a] = slice_count(recipe, plan.grid, kOpenThickness * plan.grid.h, axis);
  }
  if (recipe.max_error > 0 && !options.opacity) recipe.samples = kDensitySamples;
  if (recipe.max_error > 0 && options.opacity) {
    const StageTimer timer(report, "choosing points");
    const DensityChoice choice = choose_density_samples(*make_density(*scene.hypertexture, 0), plan.grid, recipe, scene.hypertexture->scale, report);
    recipe.samples = choice.samples;
    reached = {.square = choice.square, .variance = choice.variance, .met = choice.met};
  }
  report.count("samples", recipe.samples);
  const StageTimer timer(report, "density");
  DensityBake baked = bake_density(scene, plan.grid, recipe, options, report);
  reached.voxels = static_cast<double>(baked.surfaces[0].set.count);
  if (recipe.max_error > 0 && options.opacity) reached.rays.fill(reached.voxels * recipe.samples * recipe.samples);
  plan.statistics.area = baked.area;
  plan.statistics.volume = baked.mass;
  return baked;
}

// What is summed over all voxels of level 0.
struct Totals {
  double area = 0, covered = 0;  // voxel faces
  V3d color{0, 0, 0};
  std::int64_t border = 0, blocks = 0, tiles = 0;
  void add(const Surface& surface, const Visibility& seen) {
    for (const Areas& a : surface.areas) { area += a.area; covered += a.covered; }
    for (const V3d& c : surface.color) color += c;
    border += surface.set.count;
    blocks += static_cast<std::int64_t>(surface.set.blocks.size());
    tiles += static_cast<std::int64_t>(seen.inside_blocks.size());
  }
};

constexpr int kUsualSamples = 4;  // where rays are chosen: what colours of slices are filtered for

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

void measure(const Plan& plan, const Totals& totals, const std::optional<V3f>& one_color, const SlabSums& sums, bool volume, Pack& pack) {
  const V3d color = one_color ? V3d(*one_color) * totals.covered : totals.color;
  const double face = plan.grid.h * plan.grid.h;
  pack.statistics = plan.statistics;
  pack.statistics.covered_area = totals.covered * face;
  if (totals.covered > 0) pack.statistics.mean_color = V3f(color / totals.covered);
  pack.statistics.border_voxels = totals.border;
  if (plan.statistics.area > 0)
    pack.errors.push_back({"area_relative", totals.area * face / plan.statistics.area - 1, "sum over the level-0 voxels against the triangles' areas, before rounding to stored types; a box that cuts the scene counts as missing"});
  if (!volume) return;
  pack.statistics.inside_voxels = sums.inside_count;
  if (plan.fill && plan.statistics.volume > 0)
    pack.errors.push_back({"volume_relative", (sums.volume + static_cast<double>(sums.inside_count)) * face * plan.grid.h / plan.statistics.volume - 1,
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

}  // namespace

Pack bake(const Scene& unplaced_scene, const Recipe& given, Report& report) {
  check_recipe(given);
  Recipe recipe = given;
  std::unique_ptr<tbb::global_control> limit;
  if (recipe.threads > 0) limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(recipe.threads));

  // What repeats is cut at the box and closed there, which takes triangles of its own.
  std::optional<Scene> flat;
  if (!unplaced_scene.instances.empty() && recipe.cyclic != std::array<bool, 3>{}) flat = flatten_instances(unplaced_scene);
  const Scene& given_scene = flat ? *flat : unplaced_scene;

  // Patterns are given their period, then height fields and implicit surfaces become triangles, unless the caller has seen to it.
  std::optional<Scene> made;
  if (recipe.cyclic != std::array<bool, 3>{} && has_patterns(given_scene)) made = repeat_patterns(given_scene, plan_grid(given_scene, recipe), recipe, report);
  if (!given_scene.heights.empty() || (!given_scene.implicits.empty() && given_scene.mesh.made == 0))
    made = polygonize(mesh_heights(made ? *std::move(made) : given_scene, recipe, report), recipe, report);
  if (given_scene.fibres.strands() > 0) made = mesh_thick_fibres(made ? *std::move(made) : given_scene, recipe, report);
  const Scene& source = made ? *made : given_scene;

  const Want& want = recipe.want;
  const bool opacity = want.density || want.visibility;
  const bool colors = want.color || want.slices;
  Pack pack;

  // 0. Textures, as far as colour or cut-outs need them.
  std::unique_ptr<TextureSet> textures;
  {
    StageTimer timer(report, "textures");
    textures = std::make_unique<TextureSet>(source, colors ? TextureSet::Need::kColor : TextureSet::Need::kCoverage, report);
  }
  MaterialKinds kinds = find_kinds(source, *textures);
  // Of a density all three axes share samples³ points a voxel.
  if (recipe.samples == 0) recipe.samples = source.hypertexture ? kDensitySamples : kinds.cutouts || source.fibres.strands() > 0 ? 6 : 4;
  if (!source.hypertexture) report.count("samples", recipe.samples);

  // 1. The grid, the components and what takes part in the fill.
  Plan plan;
  std::optional<Scene> repeated;
  const bool cyclic = recipe.cyclic[0] || recipe.cyclic[1] || recipe.cyclic[2];
  const bool density = source.hypertexture.has_value();
  if (density) {
    plan.grid = plan_grid(given_scene, recipe);  // of one copy, where it repeats
    kinds.emission = source.materials.front().solid == nullptr && hypertexture_glow(*source.hypertexture) > 0;
  } else {
    StageTimer timer(report, "plan");
    std::vector<bool> cutouts;
    for (std::uint32_t m = 0; m < source.materials.size(); ++m) cutouts.push_back(textures->has_cutouts(m));
    plan = make_plan(source, recipe, cutouts, report);
    bool textured = false;
    for (std::uint32_t m = 0; m < source.materials.size(); ++m) textured = textured || textures->textured(m);
    if (cyclic) {
      repeated = repeat_scene(source, recipe.cyclic, plan, report);
      if (!plan.fibres.empty()) {
        repeated->fibres = repeat_fibres(source.fibres, plan.grid, recipe.cyclic);
        plan.fibres = fibre_segments(*repeated, plan.grid);
      }
    }
    if (textured) plan.uv_width = uv_widths(*textures, repeated ? repeated->mesh : source.mesh);
    for (std::size_t i = 0; textured && i < plan.shapes.size(); ++i) plan.shapes[i].uv_width = uv_widths(*textures, source.shapes[i]);
  }
  const Scene& scene = repeated ? *repeated : source;
  pack.grid = plan.grid;
  pack.cyclic = recipe.cyclic;
  // Told also where there is no share to tell: whoever listens may want to stop the bake.
  const auto progress = [&report](const char* stage, double done) { if (report.progress) report.progress(stage, done); };
  progress("plan", 1);

  const int level_total = want.volume() ? level_count(plan.grid, recipe, report) : 1;
  std::vector<std::vector<LevelPart>> parts(static_cast<std::size_t>(level_total));  // per level and slab
  Totals totals;
  SlabSums sums;
  std::optional<V3f> one;  // of all the surface there is

  VisibilityOptions options;
  // 6.–8. From level to level, what needs no geometry comes from the one below; then everything becomes grids. `first`: of the slab's levels.
  const auto finish = [&](std::vector<Surface>& surfaces, VisibilityResult& seen, int first, const Report& to) {
    const StageTimer timer(report, "levels");
    const int last = static_cast<int>(surfaces.size());
    for (int level = first; level < last; ++level) {
      const auto l = static_cast<std::size_t>(level);
      const Grid grid = plan.grid.level(level);
      if (level > 0) {
        filter_visibility(surfaces[l - 1], seen.levels[l - 1], surfaces[l], level, grid.n, opacity && recipe.level_mode == LevelMode::kFilter, seen.levels[l]);
        surfaces[l - 1] = {};  // the finest level is most of the memory
        seen.levels[l - 1] = {};
      }
      SeenSurface shown = seen_surface(surfaces[l], seen.levels[l].seen_material, options.seen_material);
      const auto exchange = [&] {  // the level above is made of all surface's sums
        if (!shown.color.empty()) std::swap(surfaces[l].color, shown.color);
        if (!shown.material.empty()) std::swap(surfaces[l].material, shown.material);
      };
      exchange();
      parts[l].push_back(make_part(surfaces[l], seen.levels[l], grid, level, recipe, kinds));
      exchange();
      if (to.progress) to.progress("levels", static_cast<double>(level + 1 - first) / static_cast<double>(last - first));
    }
  };

  std::array<double, 3> widths{};
  widths.fill(kOpenThickness * plan.grid.h);
  if (density) {
    DensityBake baked;
    Reached reached;
    baked = bake_scene_density(scene, plan, recipe, level_total, reached, report);
    if (reached.rays[0] > 0) tell_reached(reached, recipe, true, pack, report);
    totals.add(baked.surfaces[0], baked.seen.levels[0]);
    sums.volume = baked.filled;
    sums.inside_count = baked.seen.levels[0].inside_count;
    std::array<SliceRecords, 3> stacks = std::move(baked.stacks);
    make_stacks(recipe, plan, widths, std::move(stacks), pack, report);
    if (want.volume()) finish(baked.surfaces, baked.seen, 0, report);
  } else {
    const bool more = kinds.ks || kinds.roughness || kinds.transparency || kinds.emission;
    one = one_color(scene, *textures);
    const SurfaceWant what{.color = colors && !one, .normals = want.ndf || want.normal || (want.slices && !recipe.lights.empty()),
                           .material = (want.material && more) || (opacity && kinds.transparency), .lobes = want.ndf && recipe.lobes == 2,
                           .finest_cut = recipe.max_error > 0 ? finest_cut_for(recipe.max_error) : SurfaceWant{}.finest_cut};
    if (!colors) one = {};
    options.recompute = recipe.level_mode == LevelMode::kRecompute;
    options.visible_normals = recipe.normals == Normals::kVisible && (want.ndf || want.normal);
    if (recipe.material == MaterialOf::kVisible) {
      options.seen_material = {.color = want.color && !one, .material = want.material && what.material && !one_material(scene)};
      if (!options.seen_material.any() && (want.color || want.material)) report.skip("visible material", "all of the surface has the same");
    }
    std::unique_ptr<RayScene> rays;
    {
      const StageTimer timer(report, "crossings");
      if (want.slices) {
        const V3d thickness = measure_thickness(scene, plan, *textures) * plan.grid.h;
        for (int axis = 0; axis < 3; ++axis) widths[static_cast<std::size_t>(axis)] = std::min(thickness[(axis + 1) % 3], thickness[(axis + 2) % 3]);
        progress("crossings", 0);
      }
      if (want.slices && recipe.shadows && !recipe.lights.empty())
        rays = repeated ? std::make_unique<RayScene>(without_curtains(scene, plan), textures.get(), ScenePeriod{plan.grid.box(), recipe.cyclic})
                        : std::make_unique<RayScene>(scene, textures.get());
    }
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      options.slice_axes[a] = want.slices && recipe.slice_axes[a];
      // Colour of the inside needs the inside flags, which the rays along z find.
      options.volume_axes[a] = opacity || (want.color && plan.fill && axis == 2) || options.visible_normals || options.seen_material.any();
      options.slice_counts[a] = slice_count(recipe, plan.grid, widths[a], axis);
    }
    if (cyclic && std::any_of(recipe.lights.begin(), recipe.lights.end(), [](const Light& l) { return l.kind == Light::Kind::kPoint; }))
      report.issue("cyclic-light", "a point light does not repeat with the scene: the slices' light has a seam");
    const bool chooses = recipe.max_error > 0 && (opacity || want.slices);
    Reached reached;
    const bool traces = options.slice_axes[0] || options.slice_axes[1] || options.slice_axes[2] || options.volume_axes[2];

    // 2.–5. Exact moments of the surface in each voxel it meets, their sums up the levels, and three bundles of axis-parallel rays: opacity at
    // every level, inside, slices.
    const auto see = [&](const std::vector<Surface>& surfaces, const Report& to) {
      Recipe its = recipe;
      SampleChoice choice;
      options.chosen = nullptr;
      if (chooses) {
        const bool beyond = options.first_level > 0;
        options.coarse_rays = coarse_rays_for(recipe.max_error, beyond);
        its.samples = kUsualSamples;
        if (!beyond) {
          const StageTimer timer(report, "choosing rays");
          Report own;
          own.progress = to.progress;
          choice = choose_samples(scene, plan, *textures, surfaces[0], recipe, options, sums, kinds.cutouts, own);
          reached.add(choice);
          options.chosen = &choice.chosen;
        }
      }
      const StageTimer timer(report, "crossings");
      VisibilityResult seen;
      Report own;
      own.progress = to.progress;
      const SliceShader shader = make_shader(scene, plan, *textures, surfaces[0], recipe, rays.get());
      if (traces) seen = see_voxels(scene, plan, *textures, surfaces, its, options, shader, sums, own);
      else seen.levels.resize(surfaces.size());
      return seen;
    };
    const SlabPlan slabs = plan_slabs(scene, plan, what, options, recipe);
    std::vector<Surface> waiting, tops;       // of the slab that is growing; of the finished slabs' coarsest levels
    std::vector<Visibility> seen_tops;
    std::int64_t held = 0;                    // voxels waiting
    int slab_count = 0;                       // where there is more than one
    for (int z0 = 0, z1 = 0, from = 0; z1 < plan.grid.n.z; z0 = z1) {
      z1 = std::min(plan.grid.n.z, z0 + slabs.thickness);
      // With several slabs, one bar for all of them.
      Report part;
      const int slab_begin = from;
      if (report.progress) part.progress = [&, slab_begin](const std::string& stage, double done) {
        if (slabs.thickness >= plan.grid.n.z) return report.progress(stage, done);
        const double share = stage == "surface" ? 0 : 0.5;
        report.progress("slabs", stage == "surface" ? (z0 + 0.5 * (z1 - z0) * done) / plan.grid.n.z : (slab_begin + (z1 - slab_begin) * (share + 0.5 * done)) / plan.grid.n.z);
      };
      {
        const StageTimer timer(report, "surface");
        waiting.push_back(clip_surface(scene, plan, *textures, what, part, {z0, z1}));
        waiting.back().one_color = one;
        held += waiting.back().set.count;
      }
      if (z1 < plan.grid.n.z && held + waiting.back().set.count <= slabs.voxels) continue;
      std::vector<Surface> surfaces;
      {
        const StageTimer timer(report, "surface");
        surfaces.push_back(join_surfaces(waiting));
      }
      waiting.clear();
      held = 0;
      options.slab = {from, z1};
      const bool only = from == 0 && z1 == plan.grid.n.z;
      const bool whole = only && !chooses;    // chosen rays differ from tile to tile, so coarser levels have rays of their own
      if (only && surfaces[0].set.count == 0) throw Error(Code::kBadInput, "--box", "no surface lies in the box", "choose a box that meets the scene");
      {
        const StageTimer timer(report, "surface");
        const int levels = whole ? level_total : std::min(level_total, slabs.levels);
        while (static_cast<int>(surfaces.size()) < levels) surfaces.push_back(coarser(surfaces.back()));
      }
      VisibilityResult seen = see(surfaces, part);
      totals.add(surfaces[0], seen.levels[0]);
      if (want.volume()) finish(surfaces, seen, 0, part);
      if (!only) ++slab_count;
      if (!whole && slabs.levels < level_total) {
        tops.push_back(std::move(surfaces.back()));
        seen_tops.push_back(std::move(seen.levels.back()));
      }
      from = z1;
    }
    if (totals.border == 0) throw Error(Code::kBadInput, "--box", "no surface lies in the box", "choose a box that meets the scene");
    if (slab_count > 0) report.count("slabs", slab_count);
    if (chooses) tell_reached(reached, recipe, false, pack, report);
    if (!tops.empty()) {
      // Levels whose blocks reach over several slabs.
      std::vector<Surface> surfaces(static_cast<std::size_t>(slabs.levels) - 1);
      surfaces.push_back(join_surfaces(tops));
      while (static_cast<int>(surfaces.size()) < level_total) surfaces.push_back(coarser(surfaces.back()));
      Visibility below = join_visibility(seen_tops);
      options.slab = {};
      options.slice_axes = {false, false, false};
      options.first_level = slabs.levels;
      VisibilityResult seen;
      if (options.recompute && traces) seen = see(surfaces, report);
      else seen.levels.resize(surfaces.size());
      seen.levels[static_cast<std::size_t>(slabs.levels) - 1] = std::move(below);
      finish(surfaces, seen, slabs.levels, report);
    }
    for (std::size_t a = 0; a < 3; ++a)
      if (sums.met[a] >= 0) report.count("crossings along " + std::string(1, "xyz"[a]), static_cast<double>(sums.met[a]));
    options.slice_axes = want.slices ? recipe.slice_axes : std::array<bool, 3>{};
    const StageTimer timer(report, "crossings");
    make_stacks(recipe, plan, widths, gather_stacks(plan.grid, options, sums), pack, report);
  }
  report.count("border voxels", static_cast<double>(totals.border));
  measure(plan, totals, one, sums, want.volume(), pack);

  // 9. Slabs' parts to levels, colour running on.
  if (want.volume()) {
    StageTimer timer(report, "levels");
    for (std::size_t l = 0; l < parts.size(); ++l) {
      pack.levels.push_back(join_parts(parts[l], plan.grid.level(static_cast<int>(l)), recipe));
      parts[l] = {};
      progress("levels", static_cast<double>(l + 1) / static_cast<double>(parts.size()));
    }
    if (totals.tiles > 0)
      report.skip(std::to_string(totals.tiles) + " blocks of 8x8x8 voxels", "wholly inside: stored as tiles");
    const std::int64_t blocks = std::int64_t{(plan.grid.n.x + 7) / 8} * ((plan.grid.n.y + 7) / 8) * ((plan.grid.n.z + 7) / 8);
    const std::int64_t empty = blocks - totals.blocks - totals.tiles;
    if (empty > 0) report.skip(std::to_string(empty) + " blocks of 8x8x8 voxels", "without surface: not stored unless partly inside");
    if (density && scene.hypertexture->preset == HypertexturePreset::kOctaves) describe_cube(*scene.hypertexture, pack);
  } else {
    report.skip("volume and levels", "not wanted");
    if (recipe.prune > 0 || recipe.quantize > 0) report.skip("--prune, --quantize", "they change the volume, which is not wanted; slices stay as they are");
    if (want.levels)
      report.issue("levels-without-volume", "levels were wanted but no grid: they belong to the volume; coarser stacks of slices are --slice-levels");
  }
  // 10., 11. What --prune and --quantize take out of finished levels: no level is computed from what they leave.
  if (want.volume() && recipe.prune > 0) prune_pack(recipe, pack, report);
  if (want.volume() && recipe.quantize > 0) round_pack(recipe, pack, report);
  if (recipe.lobes == 2 && !want.ndf) report.skip("--lobes 2", "they belong to the distribution of normals, ndf, which is not wanted");
  if (!want.slices) report.skip("slices", "not wanted");
  if (!want.slices && !recipe.lights.empty()) report.skip("baked light", "it colours slices, which are not wanted");
  if (recipe.shadows && recipe.lights.empty()) report.skip("shadows", "without --light there is nothing to cast them");

  pack.issues = report.issues;
  pack.skipped = report.skipped;
  pack.sources = scene.sources;
  return pack;
}

}  // namespace texel
