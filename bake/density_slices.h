#pragma once
// Stage 2c: opacity of a density's voxels -> slices
#include <functional>

#include "bake/surface.h"
#include "bake/visibility.h"
#include "formats/grid.h"

namespace texel {

// `count` slices along an axis from the opacity of level 0's voxels: a slice takes its share of each voxel's optical depth by length; what is inside is opaque.
// `shade(voxel, index)`: linear color of a border voxel, negative: none; slices' colors are means weighed by opacity. Deterministic. Cost: linear in the voxels with matter.
[[nodiscard]] SliceRecords density_slices(const Surface& surface, const Visibility& seen, const Grid& grid, int axis, int count, const std::function<V3f(const V3i&, std::int64_t)>& shade);

}  // namespace texel
