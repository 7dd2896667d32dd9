#include "bake/value_norms.h"

#include <algorithm>

namespace texel {

Norm norm_of(const std::string& grid) {
  for (const char* name : {"alpha", "solid", "coverage", "share_1", "roughness", "transparency"})
    if (grid == name) return Norm::kShare;
  for (const char* name : {"Cd", "kd", "ks", "emission"})
    if (grid == name) return Norm::kColor;
  if (grid == "density") return Norm::kRelative;
  if (grid == "normal" || grid.starts_with("S_") || grid.starts_with("S1_") || grid.starts_with("S2_")) return Norm::kEntry;
  return Norm::kAmount;
}

const char* text_of(Norm norm) {
  switch (norm) {
    case Norm::kShare: return "difference";
    case Norm::kRelative: return "relative";
    case Norm::kColor: return "difference of square roots";
    case Norm::kAmount: return "difference, relative above 1";
    case Norm::kEntry: return "difference of a component";
  }
  return "";
}

void add_errors(const std::string& grid, const ValueErrors& errors, std::vector<GridErrors>& to) {
  const auto found = std::find_if(to.begin(), to.end(), [&](const GridErrors& g) { return g.grid == grid; });
  if (found == to.end()) to.push_back({grid, errors});
  else found->errors.add(errors);
}

void tell_errors(const std::string& prefix, const std::string& what, const std::vector<GridErrors>& grids, std::vector<ErrorFigure>& to) {
  for (const GridErrors& g : grids) {
    if (!(g.errors.most > 0)) continue;
    const std::string how = what + ", all levels; " + text_of(norm_of(g.grid));
    to.push_back({prefix + "_rms_" + g.grid, std::sqrt(g.errors.square / static_cast<double>(g.errors.count)), how});
    to.push_back({prefix + "_max_" + g.grid, g.errors.most, how});
  }
}

}  // namespace texel
