#pragma once
// Stage 11: levels -> the same levels with values rounded to few steps, which a volume's codec stores in fewer bytes
#include <vector>

#include "bake/value_norms.h"
#include "formats/pack.h"

namespace texel {

// Rounds every value to the nearest multiple of a power of two chosen so that it is off by `error` at most in its grid's norm (value_norms.h): halves
// then end in zeros, and any reader of OpenVDB reads them as before. `error`: above 0, up to 1/16.
//   alpha, solid, coverage, roughness, transparency: 0 and 1 stay, and nothing else becomes 0 or 1; below 1/4 and above 3/4 the step shrinks with the
//     distance to 0 and 1, so that a column of faint voxels lets light through to 1.7 error however long it is (docs/accuracy.md).
//   area, solid: up or down by what rounding has left over so far, so that a level's sum keeps to half a step of one voxel.
//   S: a quarter of the others' step; the diagonal is then raised until no eigenvalue is negative. The largest stays within 1.5 errors of 1.
//   normal: never longer than it was where that would be longer than 1.
//   density stays the density of the opacity before rounding, relative to which it is off by `error`.
// Comes back: the errors, each grid's of all levels. The same for any number of threads. Cost: about 10 ns a value, S 1 µs a voxel.
[[nodiscard]] std::vector<GridErrors> round_levels(std::vector<Level>& levels, double error);

}  // namespace texel
