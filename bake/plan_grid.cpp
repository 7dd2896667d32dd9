// The grid: from the scene's bounds, the box and the resolution; whole voxels in every period.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "bake/bake.h"
#include "bake/height_mesh.h"
#include "bake/hypertexture.h"
#include "formats/error.h"
#include "formats/instances.h"

namespace texel {
namespace {

constexpr int kMaxVoxels = 4096;           // per axis: fixed-point products stay below 2⁶² (crossings.cpp)
constexpr double kLeastEdge = 1e-30, kLargestEdge = 1e30;  // density is depth/h in floats: far from their ends (1e-38, 3e38) on all levels
constexpr double kPeriodSlack = 1e-3;      // voxels a period may be off a whole number of them: sides given with six digits still do

Box3d used_bounds(const Scene& scene, const Recipe& recipe) {
  const Mesh& mesh = scene.mesh;
  Box3d box;
  for (std::size_t t = 0; t < mesh.triangles.size() - mesh.made; ++t)
    for (const std::uint32_t v : mesh.triangles[t]) box.extendBy(mesh.points[v]);
  if (!scene.instances.empty()) box.extendBy(instance_bounds(scene, box));
  box.extendBy(fibre_bounds(scene.fibres));
  for (const HeightField& field : scene.heights) box.extendBy(height_bounds(field, recipe.cyclic));
  box.extendBy(scene.bounds);
  for (const Implicit& solid : scene.implicits) {
    if (solid.box.isEmpty() && !recipe.box && mesh.made == 0)
      throw Error(Code::kCommandLine, "--box", "missing: nothing says where " + solid.name + " ends", "give X0,Y0,Z0,X1,Y1,Z1");
    if (!solid.box.isEmpty()) box.extendBy(solid.box);
  }
  return box;
}

int voxels_for(double extent, double h) {
  const double n = std::ceil(extent / h - 1e-9);
  if (!(n <= kMaxVoxels))
    throw Error(Code::kCommandLine, "--voxel-size", "the box needs more than " + std::to_string(kMaxVoxels) + " voxels on a side",
                "choose a larger voxel or a smaller box");
  return std::max(1, static_cast<int>(n));
}

// Voxels in a period; 0: not a whole number of them.
int voxels_of_period(double period, double h) {
  const double n = std::nearbyint(period / h);
  return n >= 1 && n <= kMaxVoxels && std::abs(period / h - n) <= kPeriodSlack ? static_cast<int>(n) : 0;
}

// The longest cyclic side; −1: none is.
int longest_period(const V3d& size, const Recipe& recipe) {
  int longest = -1;
  for (int a = 0; a < 3; ++a)
    if (recipe.cyclic[static_cast<std::size_t>(a)] && (longest < 0 || size[a] > size[longest])) longest = a;
  return longest;
}

// The edge nearest to h of which the period holds a whole number.
double whole_edge(double period, double h) { return period / std::max(1.0, std::nearbyint(period / h)); }

// The --resolution nearest to the one asked for with whole numbers of voxels in every period; 0: there is none. `margin`: of the longest side.
int fitting_resolution(const V3d& size, const Recipe& recipe, int margin) {
  const double longest = std::max({size.x, size.y, size.z}), period = size[longest_period(size, recipe)];
  const auto fits = [&](int n) {
    if (n < 1 || n > kMaxVoxels) return false;
    const double h = whole_edge(period, longest / std::max(1, n - 2 * margin));
    for (int a = 0; a < 3; ++a)
      if (recipe.cyclic[static_cast<std::size_t>(a)] && voxels_of_period(size[a], h) == 0) return false;
    return true;
  };
  for (int step = 0; step < kMaxVoxels; ++step)
    for (const int n : {recipe.resolution.x + step, recipe.resolution.x - step})
      if (fits(n)) return n;
  return 0;
}

// Cubes of one edge must fill every period: the edge follows the longest of them, and the others are checked.
void fit_periods(const V3d& size, const Recipe& recipe, int margin, Grid& grid) {
  constexpr const char* kNames = "xyz";
  const int longest = longest_period(size, recipe);
  if (longest < 0) return;
  for (int a = 0; a < 3; ++a)
    if (recipe.cyclic[static_cast<std::size_t>(a)] && !(size[a] > 0))
      throw Error(Code::kCommandLine, "--cyclic", std::string("the scene has no extent along ") + kNames[a] + " and so no period", "give it with --box");
  if (recipe.voxel_size <= 0) grid.h = whole_edge(size[longest], grid.h);
  for (int a = 0; a < 3; ++a) {
    if (!recipe.cyclic[static_cast<std::size_t>(a)]) continue;
    grid.n[a] = voxels_of_period(size[a], grid.h);
    if (grid.n[a] > 0) continue;
    char text[200];
    std::snprintf(text, sizeof text, "the period along %c, %.6g, is %.6g voxels of %.6g: it must be a whole number, from 1 to %d", kNames[a], size[a], size[a] / grid.h, grid.h, kMaxVoxels);
    const int better = recipe.voxel_size > 0 ? 0 : fitting_resolution(size, recipe, margin);
    const std::string advice = better > 0 ? "--resolution " + std::to_string(better) + " fits" : "give a --box with sides of whole voxels, and --voxel-size";
    throw Error(Code::kCommandLine, "--cyclic", text, advice);
  }
}

Grid make_grid(const Box3d& bounds, const Recipe& recipe) {
  const bool boxed = recipe.box.has_value();
  const Box3d region = boxed ? *recipe.box : bounds;
  const V3d size = region.size();
  if (boxed && !(size.x > 0 && size.y > 0 && size.z > 0))
    throw Error(Code::kCommandLine, "--box", "the box has no volume", "give X0,Y0,Z0,X1,Y1,Z1 with each X1 > X0");
  const auto cyclic = [&](int a) { return recipe.cyclic[static_cast<std::size_t>(a)]; };
  const auto margin_of = [&](int a) { return boxed || cyclic(a) ? 0 : recipe.margin; };
  const bool counts_given = recipe.resolution.y > 0 && recipe.resolution.z > 0;
  const double longest = std::max({size.x, size.y, size.z});
  const int widest = size.x == longest ? 0 : size.y == longest ? 1 : 2;

  Grid grid;
  if (recipe.voxel_size > 0) {
    grid.h = recipe.voxel_size;
  } else if (counts_given) {
    grid.h = 0;
    for (int a = 0; a < 3; ++a) grid.h = std::max(grid.h, size[a] / std::max(1, recipe.resolution[a] - 2 * margin_of(a)));
  } else {
    grid.h = longest / std::max(1, recipe.resolution.x - 2 * margin_of(widest));
  }
  if (!(longest > 0) && recipe.voxel_size <= 0) grid.h = 1;  // a single point: any voxel will do
  if (!(grid.h >= kLeastEdge && grid.h <= kLargestEdge)) {
    char edge[32];
    std::snprintf(edge, sizeof edge, "%.3g", grid.h);
    throw Error(Code::kBadInput, "", std::string("voxels would be ") + edge + " units wide, which the grids' floats cannot hold (1e-30 to 1e30)", "scale the model");
  }
  fit_periods(size, recipe, margin_of(widest), grid);
  const bool fitted = cyclic(0) || cyclic(1) || cyclic(2);  // the edge may have changed: counts follow from it
  for (int a = 0; a < 3; ++a) {
    const int margin = margin_of(a);
    const bool longest_axis = size[a] == longest && recipe.voxel_size <= 0 && !counts_given && !fitted;
    if (cyclic(a)) {
      if (counts_given && grid.n[a] != recipe.resolution[a])
        throw Error(Code::kCommandLine, "--cyclic", "the box has other proportions than the resolution given", "give one number, --resolution " + std::to_string(recipe.resolution.x));
    } else if (counts_given && recipe.voxel_size <= 0) grid.n[a] = recipe.resolution[a];
    else if (longest_axis) grid.n[a] = std::max(recipe.resolution.x, 1 + (longest > 0 ? 0 : 2 * margin));
    else grid.n[a] = voxels_for(size[a], grid.h) + 2 * margin;
    if (grid.n[a] > kMaxVoxels)
      throw Error(Code::kCommandLine, "--resolution", std::to_string(grid.n[a]) + " voxels on a side", "the largest is " + std::to_string(kMaxVoxels));
    // What the whole voxels are larger than the region goes to both sides alike, except that a given box keeps its lowest corner.
    grid.origin[a] = boxed || cyclic(a) ? region.min[a] : region.min[a] - (grid.n[a] * grid.h - size[a]) / 2;
  }
  if (longest > 0 && grid.origin + V3d(grid.h) == grid.origin)
    throw Error(Code::kBadInput, "", "the scene lies so far from the origin that voxels cannot be told apart in double precision",
                "move the model closer to the origin");
  return grid;
}

}  // namespace

Grid plan_grid(const Scene& scene, const Recipe& recipe) {
  if (scene.hypertexture) {
    Recipe whole = recipe;
    // A cube that repeats is a whole period, without a margin.
    if (scene.hypertexture->preset == HypertexturePreset::kOctaves && !recipe.box) whole.box = Box3d(V3d(0, 0, 0), V3d(1, 1, 1));
    return make_grid(whole.box ? *whole.box : density_bounds(*make_density(*scene.hypertexture, 0)), whole);
  }
  if (scene.mesh.triangles.empty() && scene.instances.empty() && scene.fibres.strands() == 0 && scene.implicits.empty() && scene.heights.empty()) throw Error(Code::kBadInput, "", "the scene has no triangle", "check the input file");
  return make_grid(used_bounds(scene, recipe), recipe);
}

}  // namespace texel
