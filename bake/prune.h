#pragma once
// Stage 10: levels -> the same levels without what changes less than a tolerance
#include <cstdint>
#include <vector>

#include "bake/value_norms.h"
#include "formats/pack.h"

namespace texel {

struct Pruned {
  std::int64_t voxels = 0;         // faint ones left out, of all levels
  std::int64_t tiles = 0;          // blocks stored as one value, of all grids and levels
  std::int64_t background = 0;     // values that read the same, or nearly, where nothing is stored, of all grids and levels
  double column = 0;               // the largest sum of opacities left out of one column of voxels, of all axes and levels
  double area = 0, volume = 0;     // the largest share of a level's sum left out
  bool judged = true;              // false: no grid of opacity to judge voxels by
  std::vector<GridErrors> errors;  // of values in tiles and of those left to the background
};

// What is left out changes nothing by more than `tolerance` (above 0, below 1) for a reader that knows nothing of it:
//   Faint voxels lose all grids but Cd. A voxel is left out only while the opacities left out of each column of voxels it lies in, along each axis, sum
//     to `tolerance` at most, which bounds what more light passes; and while no more than that share of the level's area and of its volume is left out.
//     Faintest first. Voxels above one that is stored are stored, so that every voxel still has its parent.
//   Blocks whose values differ from their mean by `tolerance` at most in the grid's norm (value_norms.h; alpha as density, in parts of the mean) become
//     tiles: full blocks of density, alpha and solid (where one value of a block is 1, all are), blocks of Cd and materials also where they are not
//     full, so that these run on further into empty space.
//   Voxels of solid that are 0, and of ks, kd, transparency and emission that are within `tolerance` of 0, are left to the background, which is 0.
// Every level is pruned as it is: none is computed from a pruned one. `levels`: finest first. The same for any number of threads.
// Cost: some 50 ns a voxel and grid, sorting of the faint voxels; memory 16 bytes for each of these and 8 for each column.
[[nodiscard]] Pruned prune_levels(std::vector<Level>& levels, double tolerance);

}  // namespace texel
