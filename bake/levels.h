#pragma once
// Stage 8: level l -> level l+1: sums, means and inside flags that need no geometry
#include "bake/surface.h"
#include "bake/visibility.h"

namespace texel {

// Fills what coarse_seen takes from the level below: solid (mean of the eight), inside (all eight inside). Opacity too (filter_opacity) when `opacity`; otherwise coarse_seen.alpha was recomputed and stays.
// `level`, `coarse_voxels`: the coarser grid's number and counts. Children beyond the finer grid are empty.
void filter_visibility(const Surface& fine, const Visibility& fine_seen, const Surface& coarse, int level, const V3i& coarse_voxels, bool opacity, Visibility& coarse_seen);

}  // namespace texel
