#include "formats/affine.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace texel {

Affine Affine::scale(const V3d& s) {
  Affine r;
  r.m[0] = s.x;
  r.m[5] = s.y;
  r.m[10] = s.z;
  return r;
}

Affine Affine::translation(const V3d& by) {
  Affine r;
  r.m[3] = by.x;
  r.m[7] = by.y;
  r.m[11] = by.z;
  return r;
}

Affine Affine::rotation(const V3d& a, double degrees) {
  const double turn = std::fmod(degrees, 360), quarters = turn / 90;
  double c = std::cos(turn * std::numbers::pi / 180), s = std::sin(turn * std::numbers::pi / 180);
  if (quarters == std::floor(quarters)) {
    c = std::round(c);
    s = std::round(s);
  }
  const double k = 1 - c;
  Affine r;
  r.m = {c + k * a.x * a.x,       k * a.x * a.y - s * a.z, k * a.x * a.z + s * a.y, 0,
         k * a.y * a.x + s * a.z, c + k * a.y * a.y,       k * a.y * a.z - s * a.x, 0,
         k * a.z * a.x - s * a.y, k * a.z * a.y + s * a.x, c + k * a.z * a.z,       0};
  return r;
}

double Affine::reach(double most) const {
  double reached = 0;
  for (std::size_t row = 0; row < 12; row += 4) reached = std::max(reached, (std::abs(m[row]) + std::abs(m[row + 1]) + std::abs(m[row + 2])) * most + std::abs(m[row + 3]));
  return reached;
}

bool Affine::invertible() const {
  for (const double v : m)
    if (!(std::abs(v) <= 1e30)) return false;
  double lengths = 1;
  for (std::size_t column = 0; column < 3; ++column) lengths *= V3d(m[column], m[column + 4], m[column + 8]).length();
  return std::abs(determinant()) > 1e-14 * lengths && lengths > 1e-90;
}

}  // namespace texel
