#pragma once
// A field and its moved copies as one.
#include <limits>
#include <memory>
#include <vector>

#include "formats/field.h"

namespace texel {

// Where the copies of one thing lie. Without shifts there is only the thing itself, where it is.
struct Copies {
  std::vector<V3d> shifts;  // world
  // Of densities, values in [0, 1]: where one copy, unmoved, can be > 0. Infinite along all axes: any field, every copy is asked everywhere.
  Box3d reach{V3d(-std::numeric_limits<double>::infinity()), V3d(std::numeric_limits<double>::infinity())};
};

// The union of the copies' solids: the maximum of field(p − shift), values that are not a number left out; its gradient is that of the first
// copy that is greatest, its range sound, its bounds those of all copies.
[[nodiscard]] std::shared_ptr<const Field> repeat_field(std::shared_ptr<const Field> field, Copies copies);

}  // namespace texel
