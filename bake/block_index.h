#pragma once
// Where a block of a voxel set is: a dense table over the grid's blocks.
#include <vector>

#include "formats/pack.h"

namespace texel {

// Position in set.blocks of the block at (x,y,z), in units of 8 voxels; −1 where there is none or outside the grid.
// 4 bytes a block of the grid: 8 MB at 1024³, 512 MB at 4096³.
struct BlockIndex {
  V3i n{0, 0, 0};
  std::vector<std::int32_t> slots;

  BlockIndex() = default;
  BlockIndex(const VoxelSet& set, const V3i& voxels) : n((voxels.x + 7) / 8, (voxels.y + 7) / 8, (voxels.z + 7) / 8) {
    slots.assign(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z), -1);
    for (std::size_t i = 0; i < set.blocks.size(); ++i) slots[place(set.blocks[i].at)] = static_cast<std::int32_t>(i);
  }
  [[nodiscard]] std::size_t place(const V3i& b) const {
    return (static_cast<std::size_t>(b.z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(b.y)) * static_cast<std::size_t>(n.x) +
           static_cast<std::size_t>(b.x);
  }
  [[nodiscard]] bool holds(const V3i& b) const { return b.x >= 0 && b.y >= 0 && b.z >= 0 && b.x < n.x && b.y < n.y && b.z < n.z; }
  [[nodiscard]] std::int32_t operator()(const V3i& b) const { return holds(b) ? slots[place(b)] : -1; }
};

}  // namespace texel
