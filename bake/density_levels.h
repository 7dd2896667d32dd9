#pragma once
// Stage 2c: bricks of a density -> opacity of levels 1 …
#include <vector>

#include "bake/density_brick.h"

namespace texel {

// Fills `alpha` of seen[1] …, as many as there are surfaces: levels 1 to 3 from each brick's own rays, coarser ones from its 8 × 8 columns, multiplied along the way and averaged across it.
// `n`: how many bricks there are along each axis; x changes fastest in `bricks`, which must have `passing`.
void coarse_opacity(const std::vector<Brick>& bricks, V3i n, const std::vector<Surface>& surfaces, std::vector<Visibility>& seen);

}  // namespace texel
