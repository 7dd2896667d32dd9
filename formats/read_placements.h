#pragma once
// Tables of places: a transform a row.
#include <cstdint>
#include <functional>

#include "formats/affine.h"
#include "formats/report.h"
#include "formats/text_scanner.h"

namespace texel {

// Calls `place` with each row's transform, in order. A row holds numbers with commas, semicolons or blanks between them:
//   x y z | x y z scale | x y z scale rx ry rz | twelve of a row-major 3 x 4 matrix
// (scaled, turned by rx, ry, rz degrees about x, then y, then z, moved). All rows have as many. A first row of names gives them in another order;
// x, y and z have to be there: x, y, z, scale, rx, ry, rz, or m00, m01 … m23. Empty lines and what begins with # are skipped.
// Throws Error{kBadInput} with FILE:LINE for a field that is no number, another count of fields, a name that is not known, or a transform that is
// not invertible(). Memory: none by the file's size. Cost: about 20 million numbers a second.
void read_placements(const Input& input, Report& report, const std::function<void(const Affine&)>& place);

// At least as many as there are rows in it.
[[nodiscard]] std::uint64_t most_placements(const Input& input);

}  // namespace texel
