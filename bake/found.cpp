#include "bake/found.h"

#include <utility>

#include "bake/levels.h"
#include "bake/seen_material.h"

namespace texel {

void add_parts(const Job& job, const SeenWant& seen_material, std::vector<Surface>& surfaces, VisibilityResult& seen, int first, Found& found, Report& report, const Report& bar) {
  const StageTimer timer(report, "levels");
  const bool filtered = job.opacity && job.recipe.level_mode == LevelMode::kFilter;
  const int last = static_cast<int>(surfaces.size());
  for (int level = first; level < last; ++level) {
    const auto l = static_cast<std::size_t>(level);
    const Grid grid = job.plan.grid.level(level);
    if (level > 0) {
      filter_visibility(surfaces[l - 1], seen.levels[l - 1], surfaces[l], level, grid.n, filtered, seen.levels[l]);
      surfaces[l - 1] = {};  // the finest level is most of the memory
      seen.levels[l - 1] = {};
    }
    SeenSurface shown = seen_surface(surfaces[l], seen.levels[l].seen_material, seen_material);
    const auto exchange = [&] {  // the level above is made of all surface's sums
      if (!shown.color.empty()) std::swap(surfaces[l].color, shown.color);
      if (!shown.material.empty()) std::swap(surfaces[l].material, shown.material);
    };
    exchange();
    found.parts[l].push_back(make_part(surfaces[l], seen.levels[l], grid, level, job.recipe, job.kinds));
    exchange();
    if (bar.progress) bar.progress("levels", static_cast<double>(level + 1 - first) / static_cast<double>(last - first));
  }
}

}  // namespace texel
