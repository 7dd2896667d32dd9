#include "bake/opacity.h"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace texel {
namespace {

constexpr double kUnit = 0x1p24;
constexpr double kShrink = 1e-4;   // in squared rays: far below the variance of any voxel with both stopped and open rays

std::uint64_t to_integer(double x) { return static_cast<std::uint64_t>(static_cast<std::int64_t>(x * kUnit + (x < 0 ? -0.5 : 0.5))); }
double to_double(std::uint64_t i) { return static_cast<double>(static_cast<std::int64_t>(i)) / kUnit; }

}  // namespace

void OpacitySums::add(std::int64_t voxel, const RaySums& s) {
  auto& to = voxels[static_cast<std::size_t>(voxel)];
  const double values[8] = {s.a, s.t, s.l, s.w, s.tt, s.tl, s.at, s.al};
  for (std::size_t i = 0; i < 8; ++i)
    if (values[i] != 0) std::atomic_ref<std::uint64_t>(to[i]).fetch_add(to_integer(values[i]), std::memory_order_relaxed);
}

RaySums OpacitySums::get(std::int64_t voxel) const {
  const auto& v = voxels[static_cast<std::size_t>(voxel)];
  return {to_double(v[0]), to_double(v[1]), to_double(v[2]), to_double(v[3]), to_double(v[4]), to_double(v[5]), to_double(v[6]), to_double(v[7])};
}

double estimate_opacity(const RaySums& sums, double rays, const ExactMeans& exact, double* sampled) {
  const double a = sums.a / rays, t = sums.t / rays, l = sums.l / rays;
  if (sampled) *sampled = a;
  const double tt = sums.tt / rays - t * t, tl = sums.tl / rays - t * l, ll = l - l * l;
  const double at = sums.at / rays - a * t, al = sums.al / rays - a * l;
  // Prior slopes: each piece of surface stops its own ray, unless the rays have seen several on one.
  const double prior_t = t <= a - l + 1e-9 ? 1 : 0;
  // The near wall's share is known where matter does not overlap .
  const bool wall_known = sums.w == 0 && exact.near_inside > -1e-6 && exact.near_inside < 1 + 1e-6;
  double slope_t = 0, slope_l = 0;
  if (wall_known) {
    const double m_tt = tt + kShrink, m_ll = ll + kShrink, determinant = m_tt * m_ll - tl * tl;
    const double c_t = at + kShrink * prior_t, c_l = al + kShrink;
    slope_t = (c_t * m_ll - c_l * tl) / determinant;
    slope_l = (c_l * m_tt - c_t * tl) / determinant;
  } else {
    slope_t = (at + kShrink * prior_t) / (tt + kShrink);
  }
  const double corrected = a - slope_t * (t - exact.t) - (wall_known ? slope_l * (l - exact.near_inside) : 0);
  return std::clamp(corrected, 0.0, 1.0);
}

double doubt(const RaySums& sums, double rays) {
  const double a = sums.a / rays, over = (sums.t + sums.l - sums.a) / rays;  // hidden behind what stops the ray
  const double over2 = (sums.tt + sums.l + sums.a + 2 * (sums.tl - sums.at - sums.al)) / rays;  // a² is nearly a
  // Rays that all say the same do not exclude others: as of a uniform prior.
  const double seen = sums.w > 0 ? (sums.a + 1) * (rays - sums.a + 1) / ((rays + 2) * (rays + 3)) : a - a * a;
  return std::max(0.0, sums.w > 0 ? seen : std::min(seen, over2 - over * over));  // overlapping matter: the near wall is not known
}

}  // namespace texel
