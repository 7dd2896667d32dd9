#pragma once
// A scalar function of world space: what implicit surfaces and hypertextures are made of.
#include <cstddef>

#include "formats/grid.h"

namespace texel {

// Every value lies in [low, high]; NaN in either end: nothing is known.
struct Interval { double low = 0, high = 0; };

// Implementations are immutable and thread-safe. Coordinates are world space. A solid is where f >= iso (method: solid by construction).
class Field {
 public:
  virtual ~Field() = default;
  // f at n points, arrays of n each. May be NaN or infinite where the function is not defined.
  virtual void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const = 0;
  // f and its gradient, world units⁻¹, analytic or by automatic differentiation; NaN where it does not exist.
  virtual void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const = 0;
  // Encloses f over the box: never narrower than the truth, rounding included.
  [[nodiscard]] virtual Interval range(const Box3d& box) const = 0;
  // What is known of where f can be >= iso; empty: unknown, the user has to give a box.
  [[nodiscard]] virtual Box3d bounds(double iso) const = 0;
};

}  // namespace texel
