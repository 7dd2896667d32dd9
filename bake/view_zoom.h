#pragma once
// One zoom cycle of a cube of solid texture, as a strip of pictures.
#include "formats/pack.h"

namespace texel {

// `pictures` + 1 squares of `size` pixels side by side, from distance 1 to 2: the sum of octaves (zoom_value) of the pack's Cd on an oblique plane from
// the origin on, one period across at distance 1, trilinear. Grey is spread over three deviations of the sum to either side, by its own deviation at each place of the
// cycle. The last picture is the first, exactly. Throws Error{kBadInput} where the pack is no such cube.
[[nodiscard]] Image view_zoom(const Pack& pack, int size, int pictures);

}  // namespace texel
