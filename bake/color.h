#pragma once
// Stage 7: mean colours of border voxels -> colour grid running on into and out of the matter
#include <array>
#include <optional>
#include <vector>

#include "bake/surface.h"
#include "bake/visibility.h"

namespace texel {

inline constexpr int kColorReach = 2;  // voxels: a renderer interpolates colour and density apart, and one voxel left dark rims (docs/pack-format.md)

// Border voxels' own colours: those of their surface, where not all of it is cut away.
struct BorderColors {
  VoxelSet set;
  std::optional<V3f> one_color; // of all the surface there is; the vector is then empty
  std::vector<V3f> color;       // per voxel
};
[[nodiscard]] BorderColors border_colors(const Surface& surface);

// Voxels whose surface is all cut away.
[[nodiscard]] VoxelSet bare_voxels(const Surface& surface);

struct ColorField {
  VoxelSet set;                 // matter and kColorReach voxels beyond it, within the grid
  std::optional<V3f> one_color; // of all of it; the vectors are then empty
  std::vector<V3f> color;       // per voxel
  std::vector<V3f> tiles;       // per block that is wholly inside
};

// Border voxels take their surface's mean; each further voxel the mean of those of its 26 neighbours that already have a colour. What
// lies farther from them than kColorReach takes its block's mean, whole blocks the nearest coloured block's (by steps from block to block).
// Colour runs across the borders of axes that repeat.
// `matter`: voxels that must have a colour though they have none of their own; `inside_blocks`: as Visibility has them.
[[nodiscard]] ColorField spread_colors(BorderColors border, const VoxelSet& matter, const std::vector<V3i>& inside_blocks, const Grid& grid, const std::array<bool, 3>& cyclic);

// The union of two sets: blocks merged, values of neither.
[[nodiscard]] VoxelSet join_sets(const VoxelSet& a, const VoxelSet& b);

}  // namespace texel
