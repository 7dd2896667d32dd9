#pragma once
// What --max-error says against what it is. Test code only.
#include <algorithm>
#include <array>
#include <cmath>

#include "bake/bake.h"
#include "bake/compare_voxels.h"

namespace texel::test {

inline Recipe opacity_recipe(int resolution) {
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.samples = 4;
  recipe.want = Want{.slices = true, .density = true, .color = true, .ndf = false, .visibility = true, .material = false, .normal = false, .levels = true, .preview = false};
  return recipe;
}

struct Reached { std::array<double, 3> says{}; double worst = 0, coarse = 0; bool met = true; double rays = 0; };

// What --max-error says and what the border voxels' opacity is off by, against a bake of the same voxels. A voxel that only one of them has is empty in the other.
inline Reached reach(const Scene& scene, Recipe recipe, double error, const Pack& truth) {
  recipe.want.slices = false;
  recipe.max_error = error;
  Report report;
  const Pack pack = bake(scene, recipe, report);
  Reached reached;
  for (const ErrorFigure& e : pack.errors)
    if (e.measure.starts_with("alpha_rms_")) reached.says[static_cast<std::size_t>(e.measure.back() - 'x')] = e.value;
  for (const auto& [what, value] : report.counts)
    if (what.starts_with("rays a column")) reached.rays += value / 3;
  for (const Issue& i : report.issues) reached.met = reached.met && i.id != "max-error";
  for (std::size_t l = 0; l < pack.levels.size(); ++l) {
    const VoxelField a(pack.levels[l], "alpha", 3), t(truth.levels[l], "alpha", 3);
    const Layer* border = nullptr;
    (void)pack.levels[l].find("crossings", &border);
    std::array<double, 3> square{};
    for_either(a, t, [&](const V3i&, const float* x, const float* y) {
      for (std::size_t k = 0; k < 3; ++k) square[k] += std::pow((x ? static_cast<double>(x[k]) : 0) - (y ? static_cast<double>(y[k]) : 0), 2);
    });
    for (double& x : square) x = std::sqrt(x / static_cast<double>(border->set.count));
    const double worst = std::max({square[0], square[1], square[2]});
    (l == 0 ? reached.worst : reached.coarse) = std::max(l == 0 ? reached.worst : reached.coarse, worst);
  }
  return reached;
}

// Against as many rays as said.
inline Reached reach(const Scene& scene, const Recipe& recipe, double error, int truth_samples) {
  Recipe finest = recipe;
  finest.want.slices = false;
  finest.samples = truth_samples;
  Report silent;
  return reach(scene, recipe, error, bake(scene, finest, silent));
}

}  // namespace texel::test
