#pragma once
// Gradient noise in space and its sums of octaves: values, exact derivatives and proven ranges over boxes.
#include <cstddef>
#include <cstdint>

#include "formats/field.h"
#include "formats/grid.h"

namespace texel {

// One noise: a unit gradient, uniform over the sphere, hashed from each lattice point and the seed; between lattice points the blend
// 6t⁵ − 15t⁴ + 10t³ (Perlin 2002), so that value and first and second derivative are continuous. 0 at every lattice point.
struct Noise {
  std::uint32_t seed = 0;
  V3i period{0, 0, 0};         // lattice cells, per axis; 0: none (2³² of itself). Where x + period is exact, so is the repetition
};

inline constexpr double kNoiseBound = 0.866026;              // |value| <= √3/2, the length of half a cell's diagonal, rounded up
inline constexpr double kNoiseVariance = 17527135.0 / 480729249;  // over all points and seeds, 0.19094²; exact, by integrating the blend
inline constexpr double kNoiseMeanAbs = 0.156365;           // mean of |value|, measured at 5·10⁸ points: ± 0.00001

// Values at n points in lattice units, arrays of n. NaN where a coordinate is not finite; coordinates beyond 2⁵¹ count as 0.
// The same bytes from every compiler, and however the points are cut into calls. No point depends on another; in place is allowed.
// Cost: docs/performance.md, "Noise".
void noise_values(const Noise& noise, std::size_t n, const double* x, const double* y, const double* z, double* value);

// Values and their exact derivatives, lattice cells⁻¹.
void noise_gradients(const Noise& noise, std::size_t n, const double* x, const double* y, const double* z, double* value, double* gx, double* gy, double* gz);

// Encloses the noise over a box in lattice units, rounding included. Within a lattice cell it closes in on the value as the box shrinks;
// boxes over more than 8 cells get ±kNoiseBound.
[[nodiscard]] Interval noise_range(const Noise& noise, const Box3d& box);

// Sum of octaves: Σ gainⁱ·n(lacunarityⁱ·frequency·p), or of |n| (turbulence). Octave i has a seed of its own.
struct Octaves {
  double frequency = 1;        // lattice cells a world unit, of the first octave; > 0
  int count = 4;               // 1…kMostOctaves
  double gain = 0.5;           // of each octave over the one before
  double lacunarity = 2;       // ratio of frequencies; a whole number where the sum has a period
  bool turbulence = false;     // sum of absolute values: creases where an octave crosses 0
  std::uint32_t seed = 0;
  V3i period{0, 0, 0};         // lattice cells of the first octave; 0: none
  double filter = 0;           // width of what the sum is seen through, world units: octaves it cannot show are replaced by their mean
  V3d axes{1, 1, 1};           // frequency along each axis over `frequency`: other than 1 where a period is no whole number of cells
};
inline constexpr int kMostOctaves = 24;

// The octaves repeating with `period` (world units, per axis; 0: not along it): the nearest whole number of lattice cells >= 1 in each. Where they
// fit already only their period is set. Repeats to rounding, and bit for bit where period, frequency and places are short binary fractions.
[[nodiscard]] Octaves fit_octaves(Octaves octaves, const V3d& period);

// Weight in [0, 1] of an octave with lattice cells of `cell` world units seen through voxels of width `filter`: 0 up to two voxels a cell,
// 1 from four on, between them 3s² − 2s³ in s = cell/(2·filter) − 1. Nothing jumps when the filter's width changes.
[[nodiscard]] double octave_weight(double cell, double filter);

// The sum at n points in world units, and its gradient (world units⁻¹); where an octave of a turbulence is 0 its part of the gradient is 0.
void octave_values(const Octaves& octaves, std::size_t n, const double* x, const double* y, const double* z, double* value);
void octave_gradients(const Octaves& octaves, std::size_t n, const double* x, const double* y, const double* z, double* value, double* gx, double* gy, double* gz);
[[nodiscard]] Interval octave_range(const Octaves& octaves, const Box3d& box);
// Mean of the sum over space: 0, or of a turbulence kNoiseMeanAbs·Σ gainⁱ. The same for every filter width.
[[nodiscard]] double octave_mean(const Octaves& octaves);

}  // namespace texel
