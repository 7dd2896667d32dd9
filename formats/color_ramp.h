#pragma once
// Piecewise linear colours over [0, 1], for noise to be read as.
#include <cstddef>
#include <span>

#include "formats/grid.h"

namespace texel {

struct ColorStop { double at; V3f color; };

// The colour at t, the first one's before and the last one's behind all stops, which are sorted; NaN gives the first.
[[nodiscard]] inline V3f color_ramp(std::span<const ColorStop> stops, double t) {
  if (!(t > stops.front().at)) return stops.front().color;
  for (std::size_t i = 1; i < stops.size(); ++i)
    if (t < stops[i].at) {
      const auto s = static_cast<float>((t - stops[i - 1].at) / (stops[i].at - stops[i - 1].at));
      return stops[i - 1].color * (1 - s) + stops[i].color * s;
    }
  return stops.back().color;
}

}  // namespace texel
