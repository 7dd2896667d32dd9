#pragma once
// Affine maps of space.
#include <array>

#include "formats/grid.h"

namespace texel {

// Row-major 3 x 4: the last column is the translation.
struct Affine {
  std::array<double, 12> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  [[nodiscard]] V3d operator*(const V3d& p) const {
    return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7], m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
  }
  // First b, then this.
  [[nodiscard]] Affine operator*(const Affine& b) const;
  [[nodiscard]] double determinant() const;  // of the left 3 x 3
  [[nodiscard]] static Affine scale(double s);
  [[nodiscard]] static Affine scale(const V3d& s);
  [[nodiscard]] static Affine translation(const V3d& by);
  // About a unit axis through the origin, counter-clockwise seen against it; multiples of 90 degrees are exact about x, y and z.
  [[nodiscard]] static Affine rotation(const V3d& axis, double degrees);
  // Whether it can place a thing: finite, no entry above 1e30, and its axes do not fall into a plane: the determinant is above 1e-14 of the product
  // of their lengths, which is some twenty times what rounding makes of 0.
  [[nodiscard]] bool invertible() const;
  // The largest coordinate that a point with none above `most` can get.
  [[nodiscard]] double reach(double most) const;
};

}  // namespace texel
