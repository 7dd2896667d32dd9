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
};

}  // namespace texel
