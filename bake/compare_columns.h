#pragma once
// Whole columns and beams: the light the geometry lets through, by Embree, against what the voxels' opacities multiply to (docs/compare.md)
#include "bake/compare_sums.h"
#include "bake/light.h"

namespace texel {

struct ColumnOptions {
  int columns = 1000;          // an axis, and of all directions
  std::uint32_t seed = 0;
};

// Adds column_bias, column_rms by axis and direction_bias, direction_rms of a level. `rays`: the scene, all of which lies in the grid or is not filled.
// Columns: one voxel wide, those with matter in the pack; beams: likewise, through random voxels with matter in random directions.
// 256 jittered rays each. Nothing where the level has neither alpha nor density.
void compare_columns(const Level& level, int number, const RayScene& rays, const ColumnOptions& options, std::vector<Measure>& rows, Report& report);

}  // namespace texel
