#pragma once
// In what sense the values of each grid may be off: what --prune, --quantize and their reports mean by an error.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/pack.h"

namespace texel {

enum class Norm {
  kShare,     // alpha, solid, coverage, share_1, roughness, transparency: the difference
  kRelative,  // density: the difference in parts of the value, so that a long way through little is off by no more than a short one through much
  kColor,     // Cd, kd, ks, emission: the difference of the square roots, which is near that of sRGB values
  kAmount,    // area, crossings, axes: the difference, in parts of the value where that is above 1
  kEntry,     // normal, S, S1, S2: the difference of each component
};
[[nodiscard]] Norm norm_of(const std::string& grid);
[[nodiscard]] const char* text_of(Norm norm);

// The error of `is` where `was` was meant; infinite where a relative one has nothing to be relative to.
[[nodiscard]] inline double difference(Norm norm, double was, double is) {
  const double d = std::abs(is - was);
  switch (norm) {
    case Norm::kRelative: return d > 0 ? d / std::abs(was) : 0;
    case Norm::kColor: return std::abs(std::sqrt(std::max(0.0, is)) - std::sqrt(std::max(0.0, was)));
    case Norm::kAmount: return d / std::max(1.0, std::abs(was));
    default: return d;
  }
}

// Errors of one grid's values on all levels.
struct ValueErrors {
  std::int64_t count = 0;
  double square = 0, most = 0;
  void add(double error, double times = 1) {
    count += static_cast<std::int64_t>(times);
    square += error * error * times;
    most = std::max(most, error);
  }
  void add(const ValueErrors& other) {
    count += other.count;
    square += other.square;
    most = std::max(most, other.most);
  }
};
struct GridErrors { std::string grid; ValueErrors errors; };

// Adds to those of `grid`, which come into the list in the order in which they are named first.
void add_errors(const std::string& grid, const ValueErrors& errors, std::vector<GridErrors>& to);

// PREFIX_rms_GRID and PREFIX_max_GRID for the manifest; grids without error are left out. `what` is the beginning of how they were measured.
void tell_errors(const std::string& prefix, const std::string& what, const std::vector<GridErrors>& grids, std::vector<ErrorFigure>& to);

}  // namespace texel
