#include "formats/affine.h"

namespace texel {

Affine Affine::operator*(const Affine& b) const {
  Affine r;
  for (std::size_t i = 0; i < 12; i += 4)
    for (std::size_t j = 0; j < 4; ++j) r.m[i + j] = m[i] * b.m[j] + m[i + 1] * b.m[4 + j] + m[i + 2] * b.m[8 + j] + (j == 3 ? m[i + 3] : 0.0);
  return r;
}

double Affine::determinant() const {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) + m[2] * (m[4] * m[9] - m[5] * m[8]);
}

Affine Affine::scale(double s) {
  Affine r;
  r.m[0] = r.m[5] = r.m[10] = s;
  return r;
}

}  // namespace texel
