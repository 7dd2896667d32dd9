#pragma once
// What --max-error says against what it is. Test code only.
#include <algorithm>
#include <array>
#include <cmath>

#include "bake/bake.h"

namespace texel::test {

inline Recipe opacity_recipe(int resolution) {
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.samples = 4;
  recipe.want = Want{.slices = true, .density = true, .color = true, .ndf = false, .visibility = true, .material = false, .normal = false, .levels = true, .preview = false};
  return recipe;
}

struct Reached { std::array<double, 3> says{}; double worst = 0, coarse = 0; bool met = true; double rays = 0; };

// What --max-error says and what the border voxels' opacity is off by, against as many rays as said.
inline Reached reach(const Scene& scene, Recipe recipe, double error, int truth_samples) {
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
  Recipe finest = recipe;
  finest.max_error = 0;
  finest.samples = truth_samples;
  Report silent;
  const Pack truth = bake(scene, finest, silent);
  for (std::size_t l = 0; l < pack.levels.size(); ++l) {
    const Channel *a = pack.levels[l].find("alpha"), *t = truth.levels[l].find("alpha");
    const Layer* border = nullptr;
    (void)pack.levels[l].find("crossings", &border);
    std::array<double, 3> square{};
    for (std::size_t i = 0; i < a->values.size(); ++i) square[i % 3] += std::pow(static_cast<double>(a->values[i]) - static_cast<double>(t->values[i]), 2);
    for (double& x : square) x = std::sqrt(x / static_cast<double>(border->set.count));
    const double worst = std::max({square[0], square[1], square[2]});
    (l == 0 ? reached.worst : reached.coarse) = std::max(l == 0 ? reached.worst : reached.coarse, worst);
  }
  return reached;
}

}  // namespace texel::test
