#include "bake/ndf_fits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace texel {
namespace {

constexpr double kMostRatio = 100;      // of axes, as in ndf.cpp
constexpr double kSquare = 0.3420;      // cosine of 70 degrees
constexpr int kDirections = 4096;

StoredAxes stored(const std::array<V3d, 3>& axis, std::array<double, 3> radius) {
  const double most = std::max({radius[0], radius[1], radius[2]});
  for (double& r : radius) r = std::max(r, most / kMostRatio);
  return {V3f(axis[0] * (radius[0] / radius[2])), V3f(axis[1] * (radius[1] / radius[2]))};
}

// Solves the symmetric 6 × 6 system in place; false where it is singular.
bool solve(std::array<std::array<double, 6>, 6>& a, std::array<double, 6>& b) {
  for (std::size_t k = 0; k < 6; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < 6; ++i)
      if (std::abs(a[i][k]) > std::abs(a[pivot][k])) pivot = i;
    if (!(std::abs(a[pivot][k]) > 1e-300)) return false;
    std::swap(a[k], a[pivot]);
    std::swap(b[k], b[pivot]);
    for (std::size_t i = k + 1; i < 6; ++i) {
      const double f = a[i][k] / a[k][k];
      for (std::size_t j = k; j < 6; ++j) a[i][j] -= f * a[k][j];
      b[i] -= f * b[k];
    }
  }
  for (std::size_t k = 6; k-- > 0;) {
    for (std::size_t j = k + 1; j < 6; ++j) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
  return true;
}

struct Quadrature {
  std::vector<V3d> directions = half_sphere(kDirections);
  std::vector<int> bin;
  Quadrature() {
    for (const V3d& d : directions) bin.push_back(normal_bin(d));
  }
};

}  // namespace

int normal_bin(const V3d& normal) {
  const V3d n = normal.z < 0 || (normal.z == 0 && (normal.y < 0 || (normal.y == 0 && normal.x < 0))) ? -normal : normal;
  // + 0.0: a negative zero at the pole would point the other way.
  const double turn = (std::atan2(n.y + 0.0, n.x + 0.0) + std::numbers::pi) / (2 * std::numbers::pi);
  const int row = std::clamp(static_cast<int>(n.z * kNormalRows), 0, kNormalRows - 1), column = std::clamp(static_cast<int>(turn * kNormalColumns), 0, kNormalColumns - 1);
  return row * kNormalColumns + column;
}

V3d bin_centre(int bin) {
  const double z = (bin / kNormalColumns + 0.5) / kNormalRows, phi = ((bin % kNormalColumns + 0.5) / kNormalColumns) * 2 * std::numbers::pi - std::numbers::pi;  // NOLINT: whole rows
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

std::optional<StoredAxes> ratib_from_fullest(std::span<const double> bins) {
  int first = -1, second = -1;
  for (int i = 0; i < kNormalBins; ++i)
    if (bins[static_cast<std::size_t>(i)] > 0 && (first < 0 || bins[static_cast<std::size_t>(i)] > bins[static_cast<std::size_t>(first)])) first = i;
  if (first < 0) return std::nullopt;
  const V3d a = bin_centre(first);
  for (int i = 0; i < kNormalBins; ++i)
    if (std::abs(a.dot(bin_centre(i))) < kSquare && (second < 0 || bins[static_cast<std::size_t>(i)] > bins[static_cast<std::size_t>(second)])) second = i;
  V3d b = bin_centre(second);
  b = (b - a * a.dot(b)).normalized();
  const V3d c = a.cross(b);
  return stored({a, b, c}, {bins[static_cast<std::size_t>(first)], bins[static_cast<std::size_t>(second)], bins[static_cast<std::size_t>(normal_bin(c))]});
}

std::optional<StoredAxes> ratib_by_least_squares(std::span<const double> bins) {
  double most = 0;
  for (const double b : bins) most = std::max(most, b);
  if (!(most > 0)) return std::nullopt;
  std::array<std::array<double, 6>, 6> normal{};
  std::array<double, 6> q{};
  for (int i = 0; i < kNormalBins; ++i) {
    const double r = bins[static_cast<std::size_t>(i)] / most;
    if (!(r > 0)) continue;
    const V3d p = bin_centre(i) * r;
    const std::array<double, 6> row{p.x * p.x, p.y * p.y, p.z * p.z, 2 * p.x * p.y, 2 * p.x * p.z, 2 * p.y * p.z};
    for (std::size_t j = 0; j < 6; ++j) {
      for (std::size_t k = 0; k < 6; ++k) normal[j][k] += row[j] * row[k];
      q[j] += row[j];
    }
  }
  // Fewer than six bins leave directions open: there the ellipsoid is to be as thin as it may.
  constexpr double kThin = 1e-9;
  for (std::size_t j = 0; j < 6; ++j) {
    normal[j][j] += j < 3 ? kThin : 2 * kThin;  // as the matrix' own norm weighs them: no direction is preferred
    if (j < 3) q[j] += kThin * kMostRatio * kMostRatio;
  }
  if (!solve(normal, q)) return std::nullopt;
  const Eigen3 e = eigen({q[0], q[1], q[2], q[3], q[4], q[5]});
  const double largest = e.value[0];
  if (!(largest > 0) || !std::isfinite(largest)) return std::nullopt;
  std::array<double, 3> radius;
  for (std::size_t k = 0; k < 3; ++k) radius[k] = 1 / std::sqrt(std::max(e.value[k], largest / (kMostRatio * kMostRatio)));
  return stored({e.vector[2], e.vector[1], e.vector[0]}, {radius[2], radius[1], radius[0]});  // longest first
}

double total_variation(std::span<const double> bins, const VoxelNdf& ndf) {
  static const Quadrature quadrature;
  std::array<double, kNormalBins> share{};
  double total = 0, counted = 0;
  const auto put = [&](int bin, double weight) {
    share[static_cast<std::size_t>(bin)] += weight;
    total += weight;
  };
  if (ndf.kind == VoxelNdf::Kind::kSggx) {
    // SGGX's normals are those of an ellipsoid's surface: places u of the unit sphere go to the normals S^½u, with weights |S^½u|. So a sheet needs no width.
    for (const V3d& u : quadrature.directions) {
      V3d n(0, 0, 0);
      for (std::size_t k = 0; k < 3; ++k) n += ndf.axes.vector[k] * (std::sqrt(ndf.axes.value[k]) * u.dot(ndf.axes.vector[k]));
      if (const double length = n.length(); length > 0) put(normal_bin(n / length), length);
    }
  } else {
    std::vector<double> density(quadrature.directions.size());
    normal_density(ndf, quadrature.directions, density);
    for (std::size_t i = 0; i < density.size(); ++i) put(quadrature.bin[i], density[i]);
  }
  for (const double b : bins) counted += b;
  double sum = 0;
  for (std::size_t i = 0; i < kNormalBins; ++i) sum += std::abs(bins[i] / counted - (total > 0 ? share[i] / total : 0));
  return sum / 2;
}

}  // namespace texel
