#include "bake/ndf.h"

#include <algorithm>
#include <boost/math/special_functions/ellint_rg.hpp>
#include <cmath>

namespace texel {
namespace {

constexpr double kExponent = 1.3;
constexpr double kLeastRatio = 1e-2;  // halves hold no flatter ellipsoid anyway

Eigen3 moment_eigen(const Moments& m) {
  Eigen3 e = eigen({m.xx, m.yy, m.zz, m.xy, m.xz, m.yz});
  for (double& v : e.value) v = std::max(0.0, v);  // M is positive semidefinite; rounding may say −1e-17
  return e;
}

StoredAxes stored(const Eigen3& e, const std::array<double, 3>& semi) {
  const double longest = std::max({semi[0], semi[1], semi[2]});
  std::array<double, 3> held;
  for (std::size_t i = 0; i < 3; ++i) held[i] = std::max(semi[i], kLeastRatio * longest);
  return {V3f(e.vector[0] * (held[0] / held[2])), V3f(e.vector[1] * (held[1] / held[2]))};
}

}  // namespace

Eigen3 eigen(const Symmetric& m) {
  double a[3][3] = {{m.xx, m.xy, m.xz}, {m.xy, m.yy, m.yz}, {m.xz, m.yz, m.zz}};
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 32; ++sweep) {
    const double off = std::abs(a[0][1]) + std::abs(a[0][2]) + std::abs(a[1][2]);
    if (!(off > 0)) break;
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        const double apq = a[p][q];
        if (apq == 0) continue;
        // An off-diagonal element below both diagonals' last digit changes neither.
        if (sweep > 3 && std::abs(apq) <= 1e-18 * std::min(std::abs(a[p][p]), std::abs(a[q][q]))) { a[p][q] = a[q][p] = 0; continue; }
        const double theta = (a[q][q] - a[p][p]) / (2 * apq);
        const double t = std::isfinite(theta * theta) ? std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(theta * theta + 1)) : 0.5 / theta;
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        a[p][p] -= t * apq;
        a[q][q] += t * apq;
        a[p][q] = a[q][p] = 0;
        const int r = 3 - p - q;
        const double arp = a[r][p], arq = a[r][q];
        a[r][p] = a[p][r] = c * arp - s * arq;
        a[r][q] = a[q][r] = s * arp + c * arq;
        for (auto& row : v) {
          const double vp = row[p], vq = row[q];
          row[p] = c * vp - s * vq;
          row[q] = s * vp + c * vq;
        }
      }
  }
  int order[3] = {0, 1, 2};
  std::sort(order, order + 3, [&](int i, int j) { return a[i][i] != a[j][j] ? a[i][i] > a[j][j] : i < j; });
  Eigen3 e;
  for (std::size_t i = 0; i < 3; ++i) {
    const int k = order[i];
    e.value[i] = a[k][k];
    e.vector[i] = V3d(v[0][k], v[1][k], v[2][k]);
  }
  return e;
}

Symmetric sggx(const Moments& moments) {
  if (!(moments.covered > 0)) return {};
  const Eigen3 e = moment_eigen(moments);
  if (!(e.value[0] > 0)) return {};
  Symmetric s;
  for (std::size_t i = 0; i < 3; ++i) {
    add_outer(s, e.vector[i], std::pow(e.value[i] / e.value[0], kExponent));
  }
  return s;
}

double sggx_scale(const Moments& moments) {
  if (!(moments.covered > 0)) return 0;
  const Eigen3 e = moment_eigen(moments);
  if (!(e.value[0] > 0)) return 0;
  const auto s = [&](std::size_t i) { return std::pow(e.value[i] / e.value[0], kExponent); };
  return moments.covered / (2 * boost::math::ellint_rg(s(0), s(1), s(2)));
}

double mean_shadow(const Symmetric& s) {
  const Eigen3 e = eigen(s);
  return e.value[0] > 0 ? boost::math::ellint_rg(e.value[0], std::max(e.value[1], 0.0), std::max(e.value[2], 0.0)) : 0;
}

SggxLobe sggx_lobe(const Moments& moments) {
  if (!(moments.covered > 0)) return {};
  const Eigen3 e = moment_eigen(moments);
  if (!(e.value[0] > 0)) return {};
  SggxLobe lobe;
  std::array<double, 3> s;
  for (std::size_t i = 0; i < 3; ++i) {
    s[i] = std::pow(e.value[i] / e.value[0], kExponent);
    add_outer(lobe.s, e.vector[i], s[i]);
  }
  lobe.scale = moments.covered / (2 * boost::math::ellint_rg(s[0], s[1], s[2]));
  return lobe;
}

StoredAxes neyret_axes(const Symmetric& s) {
  const Eigen3 e = eigen(s);
  std::array<double, 3> sigma, semi;
  for (std::size_t i = 0; i < 3; ++i) sigma[i] = std::max(std::sqrt(std::max(0.0, e.value[i])), kLeastRatio * std::sqrt(std::max(0.0, e.value[0])));
  if (!(sigma[0] > 0)) return {V3f(0), V3f(0)};
  for (std::size_t i = 0; i < 3; ++i) semi[i] = std::sqrt(sigma[(i + 1) % 3] * sigma[(i + 2) % 3] / sigma[i]);
  return stored(e, semi);
}

StoredAxes ratib_axes(const Symmetric& s) {
  const Eigen3 e = eigen(s);
  if (!(e.value[0] > 0)) return {V3f(0), V3f(0)};
  std::array<double, 3> semi;
  for (std::size_t i = 0; i < 3; ++i) { const double v = std::max(0.0, e.value[i]); semi[i] = v * v; }
  return stored(e, semi);
}

}  // namespace texel
