#pragma once
// Density -> light along whole rays, volume of D = 1: the truth for whole packs, by code that shares nothing with the bake's sampler but the density (docs/compare.md)
#include <cstdint>
#include <vector>

#include "formats/field.h"

namespace texel {

// A density as a pack's box holds it: 0 outside of it. What the density's own range proves to be empty or opaque is not asked for point by point.
struct DensityLight {
  enum class Cell : std::uint8_t { kEmpty, kFull, kMixed };
  const Field* density = nullptr;
  double scale = 1;            // c, world units⁻¹
  Grid grid;                   // the pack's, level 0
  Grid cells;                  // over the same box, at most 64 along each edge
  std::vector<Cell> kinds;     // cells.n, x fastest
};

// `density` has to outlive it. Cost: one range a cell.
[[nodiscard]] DensityLight make_density_light(const Field& density, double scale, const Grid& grid);

// exp(−c ∫ −ln(1 − D)) from `from` to `to` (world), 0…1: D at jittered places, kLightSteps along an edge of level 0. NaN counts as 0, D = 1 at any of them as opaque.
// Error of one ray: where D changes within a step, its variance of depth; in the mean over rays half of that variance, at most 4e-4 of what was measured (docs/compare.md).
// Cost: one value of D a step in mixed cells, until e⁻⁴⁰ is left. Thread-safe.
inline constexpr int kLightSteps = 8;
[[nodiscard]] double light_passed(const DensityLight& light, const V3d& from, const V3d& to, std::uint64_t seed);

// The volume of D = 1 in the box, world units³, from 64 jittered places in each mixed cell. `error`: standard, by pairs of neighbouring places, which in the mean is not too
// small (Cochran, Sampling Techniques, §5A.12). Deterministic, whatever the threads. Cost: one value of D a place, of at most 17 million.
struct FullVolume {
  double value = 0, error = 0;
  std::int64_t places = 0;
};
[[nodiscard]] FullVolume full_volume(const DensityLight& light, std::uint64_t seed);

}  // namespace texel
