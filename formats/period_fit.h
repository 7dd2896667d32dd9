#pragma once
// Whole numbers of something in a period: what functions need to repeat.
#include <string>

#include "formats/grid.h"

namespace texel {

inline constexpr double kSamePeriod = 1e-9;  // relative: lengths of a whole number of voxels come with rounding

struct PeriodFit {
  V3d frequency;        // a world unit; as wanted along axes without a period
  V3i count{0, 0, 0};   // in a period; 0 along axes without one
  std::string changed;  // "along x 3 WHAT a period instead of 2.71, …"; empty: nothing by more than kSamePeriod
};

// The nearest whole numbers >= 1 of `frequency`·`period`, both per axis; a period of 0: none. `what`: veins, lattice cells, …
[[nodiscard]] PeriodFit fit_period(const V3d& frequency, const V3d& period, const std::string& what);

}  // namespace texel
