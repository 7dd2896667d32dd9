#pragma once
// Whole columns and beams: the light that what was baked lets through against what the voxels' opacities multiply to (docs/compare.md)
#include <functional>

#include "bake/compare_sums.h"

namespace texel {

struct ColumnOptions {
  int columns = 1000;          // an axis, and of all directions
  std::uint32_t seed = 0;
};

// A ray through a level's whole grid, voxel space of the level: it is in the grid from `start` on for `length` along the unit vector `along`.
struct ColumnRay {
  V3d start, along;
  double length = 0;
  std::uint64_t seed = 0;      // of what is drawn along it: another for every ray of every column
};
// The share of a ray's light that passes, 0…1: the truth, of the scene (compare_truth.cpp) or of a density (density_light.h). Called by many threads at once.
using LightPassed = std::function<double(const ColumnRay&)>;

// Adds column_bias, column_rms by axis and direction_bias, direction_rms of a level. `truth`: of all that lies in the grid.
// Columns: one voxel wide, those with matter in the pack; beams: likewise, through random voxels with matter in random directions.
// 256 jittered rays each. Nothing where the level has neither alpha nor density.
void compare_columns(const Level& level, int number, const LightPassed& truth, const ColumnOptions& options, std::vector<Measure>& rows, Report& report);

}  // namespace texel
