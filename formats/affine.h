#pragma once
// An affine map of space.
#include <array>
#include <cstddef>

#include "formats/grid.h"

namespace texel {

// Row-major 3 x 4: the last column is the translation.
struct Affine {
  std::array<double, 12> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  [[nodiscard]] V3d operator*(const V3d& p) const {
    return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7], m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
  }
  // First b, then this.
  [[nodiscard]] Affine operator*(const Affine& b) const {
    Affine r;
    for (std::size_t i = 0; i < 12; i += 4)
      for (std::size_t j = 0; j < 4; ++j) r.m[i + j] = m[i] * b.m[j] + m[i + 1] * b.m[4 + j] + m[i + 2] * b.m[8 + j] + (j == 3 ? m[i + 3] : 0.0);
    return r;
  }
  // Of the left 3 x 3: below 0 where the map mirrors.
  [[nodiscard]] double determinant() const {
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
  }
  [[nodiscard]] static Affine scale(double s) {
    Affine r;
    r.m[0] = r.m[5] = r.m[10] = s;
    return r;
  }
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
