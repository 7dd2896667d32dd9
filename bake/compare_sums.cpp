#include "bake/compare_sums.h"

#include <algorithm>
#include <boost/math/special_functions/ellint_rg.hpp>
#include <cmath>
#include <numbers>

#include "bake/compare_voxels.h"

namespace texel {
namespace {

constexpr double kSure = 1.959963984540054;  // 95 % of a normal distribution
constexpr int kQuadrature = 1024;            // directions for distributions without a closed form
constexpr double kStandsOut = 0.1;           // of the eigenvalues' sum

struct Ends { double low, high; };

Ends interval(double mean, double mean_square, std::int64_t count, std::int64_t of) {
  if (count == of || count < 1) return {mean, mean};
  if (count < 2) return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  const auto n = static_cast<double>(count);
  const double variance = std::max(mean_square - mean * mean, 0.0) * n / (n - 1);
  const double left = std::max(1 - n / static_cast<double>(of), 0.0);
  const double half = kSure * std::sqrt(variance / n * left);
  return {mean - half, mean + half};
}

Measure measure(const std::string& name, double value, const Ends& ends, std::int64_t count, std::int64_t of) {
  return {.name = name, .value = value, .low = ends.low, .high = ends.high, .count = count, .of = of};
}

const std::vector<V3d>& quadrature() {
  static const std::vector<V3d> directions = half_sphere(kQuadrature);
  return directions;
}

double ratib_radius(const Symmetric& q, const V3d& n) {
  const double form = q.xx * n.x * n.x + q.yy * n.y * n.y + q.zz * n.z * n.z + 2 * (q.xy * n.x * n.y + q.xz * n.x * n.z + q.yz * n.y * n.z);
  return form > 0 ? 1 / std::sqrt(form) : 0;
}

Symmetric symmetric(const float* d, const float* o) {
  return {static_cast<double>(d[0]), static_cast<double>(d[1]), static_cast<double>(d[2]), static_cast<double>(o[0]), static_cast<double>(o[1]), static_cast<double>(o[2])};
}

}  // namespace

Measure ErrorSums::bias(const std::string& name, std::int64_t of) const {
  const double n = static_cast<double>(std::max<std::int64_t>(count, 1)), mean = sum / n;
  if (of == 0) of = count;
  return measure(name, mean, interval(mean, square / n, count, of), count, of);
}

Measure ErrorSums::rms(const std::string& name, std::int64_t of) const {
  const double n = static_cast<double>(std::max<std::int64_t>(count, 1)), mean = square / n;
  if (of == 0) of = count;
  const Ends ends = interval(mean, fourth / n, count, of);
  return measure(name, std::sqrt(mean), {std::sqrt(std::max(ends.low, 0.0)), std::sqrt(ends.high)}, count, of);
}

Measure ErrorSums::max(const std::string& name, std::int64_t of) const {
  if (of == 0) of = count;
  return measure(name, most, {most, count < of ? std::numeric_limits<double>::infinity() : most}, count, of);
}

Measure exactly(const std::string& name, double value, std::int64_t count) { return measure(name, value, {value, value}, count, count); }

Measure at_level(Measure m, int level, int axis) {
  m.level = level;
  m.axis = axis;
  return m;
}

std::vector<V3d> half_sphere(int n) {
  std::vector<V3d> all;
  for (int i = 0; i < n; ++i) {
    const double z = (i + 0.5) / n, r = std::sqrt(1 - z * z), phi = 2 * std::numbers::pi * std::fmod(i * 0.6180339887498949, 1.0);
    all.push_back({r * std::cos(phi), r * std::sin(phi), z});
  }
  return all;
}

VoxelNdf ndf_from_sggx(const Symmetric& s) {
  VoxelNdf ndf{VoxelNdf::Kind::kSggx, s, eigen(s)};
  for (double& v : ndf.axes.value) v = std::max(v, 0.0);  // halves may make the least of them a little negative
  return ndf;
}

std::optional<VoxelNdf> ndf_from_axes(NdfKind kind, const V3f& axis_1, const V3f& axis_2) {
  const V3d a(axis_1), b(axis_2);
  const double e1 = a.length(), e2 = b.length();
  if (!(e1 > 0) || !(e2 > 0)) return std::nullopt;
  V3d v1 = a / e1, v2 = b / e2;
  v2 -= v1 * v1.dot(v2);  // halves leave them a little off square
  if (!(v2.length() > 0)) return std::nullopt;
  v2 /= v2.length();
  const V3d v3 = v1.cross(v2);
  Symmetric s;
  if (kind == NdfKind::kRatib) {
    add_outer(s, v1, 1 / (e1 * e1));
    add_outer(s, v2, 1 / (e2 * e2));
    add_outer(s, v3, 1);
    return VoxelNdf{VoxelNdf::Kind::kRatib, s, eigen(s)};
  }
  // Neyret's: shadows along its axes are products of the other two, and S holds their squares.
  const double most = std::max({e1 * e2, e1, e2});
  add_outer(s, v1, std::pow(e2 / most, 2));
  add_outer(s, v2, std::pow(e1 / most, 2));
  add_outer(s, v3, std::pow(e1 * e2 / most, 2));
  return ndf_from_sggx(s);
}

void projected_areas(const VoxelNdf& ndf, double area, std::span<const V3d> directions, std::span<double> sigma) {
  std::fill(sigma.begin(), sigma.end(), 0.0);
  if (ndf.kind == VoxelNdf::Kind::kSggx) {
    const double mean = boost::math::ellint_rg(ndf.axes.value[0], ndf.axes.value[1], ndf.axes.value[2]);
    if (!(mean > 0)) return;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      double form = 0;
      for (std::size_t k = 0; k < 3; ++k) form += ndf.axes.value[k] * std::pow(directions[i].dot(ndf.axes.vector[k]), 2);
      sigma[i] = area / (2 * mean) * std::sqrt(form);
    }
    return;
  }
  double total = 0;
  for (const V3d& n : quadrature()) {
    const double weight = ratib_radius(ndf.s, n);
    total += weight;
    for (std::size_t i = 0; i < directions.size(); ++i) sigma[i] += weight * std::abs(n.dot(directions[i]));
  }
  for (double& v : sigma) v *= total > 0 ? area / total : 0;
}

void projected_areas(const VoxelLobes& lobes, double area, std::span<const V3d> directions, std::span<double> sigma) {
  projected_areas(lobes.ndf[0], area * lobes.share[0], directions, sigma);
  if (!(lobes.share[1] > 0)) return;
  std::vector<double> second(sigma.size());
  projected_areas(lobes.ndf[1], area * lobes.share[1], directions, second);
  for (std::size_t i = 0; i < second.size(); ++i) sigma[i] += second[i];
}

void normal_density(const VoxelNdf& ndf, std::span<const V3d> directions, std::span<double> density) {
  double total = 0;
  const auto of = [&](const V3d& n) {
    if (ndf.kind == VoxelNdf::Kind::kRatib) return ratib_radius(ndf.s, n);
    double form = 0;  // D(n) ∝ (nᵀS⁻¹n)⁻²; eigenvalues are held at 1e-4 of the largest, where half floats end
    for (std::size_t k = 0; k < 3; ++k) form += std::pow(n.dot(ndf.axes.vector[k]), 2) / std::max(ndf.axes.value[k], 1e-4 * ndf.axes.value[0]);
    return form > 0 ? 1 / (form * form) : 0.0;
  };
  for (const V3d& n : quadrature()) total += of(n);
  const double per_area = total > 0 ? static_cast<double>(kQuadrature) / (2 * std::numbers::pi * total) : 0;
  for (std::size_t i = 0; i < directions.size(); ++i) density[i] = of(directions[i]) * per_area;
}

std::optional<PrincipalAxis> principal_axis(const Symmetric& moments) {
  const Eigen3 e = eigen(moments);
  const double sum = e.value[0] + e.value[1] + e.value[2];
  if (!(sum > 0)) return std::nullopt;
  const double above = e.value[0] - e.value[1], below = e.value[1] - e.value[2];
  if (std::max(above, below) < kStandsOut * sum) return std::nullopt;
  return above >= below ? PrincipalAxis{e.vector[0], false} : PrincipalAxis{e.vector[2], true};
}

std::optional<PrincipalAxis> principal_axis(const VoxelNdf& ndf) {
  // Eigenvectors of the second moment are those of S; its eigenvalues are t ∝ s^(1/1.3) for S as stored (ndf.h), an integral for Ratib's.
  Symmetric m;
  if (ndf.kind == VoxelNdf::Kind::kSggx) {
    double sum = 0;
    for (const double v : ndf.axes.value) sum += std::pow(v, 1 / 1.3);
    if (!(sum > 0)) return std::nullopt;
    for (std::size_t k = 0; k < 3; ++k) add_outer(m, ndf.axes.vector[k], std::pow(ndf.axes.value[k], 1 / 1.3) / sum);
  } else {
    double total = 0;
    for (const V3d& n : quadrature()) {
      const double weight = ratib_radius(ndf.s, n);
      add_outer(m, n, weight);
      total += weight;
    }
    if (!(total > 0)) return std::nullopt;
  }
  return principal_axis(m);
}

double axis_angle(const V3d& a, const V3d& b) {
  if (a == b) return 0;
  // By sine and cosine: the arc cosine alone loses half its digits near 0.
  return std::atan2(a.cross(b).length(), std::abs(a.dot(b))) * 180 / std::numbers::pi;
}

NdfField::NdfField(const Level& level, NdfKind kind)
    : kind_(kind), diagonal_(level, "S_diag", 3), off_(level, "S_off", 3), axis_1_(level, "axis_1", 3), axis_2_(level, "axis_2", 3),
      lobe_diagonal_{VoxelField(level, "S1_diag", 3), VoxelField(level, "S2_diag", 3)}, lobe_off_{VoxelField(level, "S1_off", 3), VoxelField(level, "S2_off", 3)}, share_(level, "share_1", 1) {}

std::optional<VoxelLobes> NdfField::lobes(const V3i& voxel) const {
  const auto one = at(voxel);
  if (!one) return std::nullopt;
  VoxelLobes lobes{.ndf = {*one, *one}};
  const double share = static_cast<double>(share_.value(voxel, 1));
  if (!(share > 0) || !(share < 1)) return lobes;
  for (std::size_t g = 0; g < 2; ++g) {
    const float *d = lobe_diagonal_[g].at(voxel), *o = lobe_off_[g].at(voxel);
    if (!d || !o) return VoxelLobes{.ndf = {*one, *one}};
    lobes.ndf[g] = ndf_from_sggx(symmetric(d, o));
  }
  lobes.share = {share, 1 - share};
  return lobes;
}

std::optional<VoxelNdf> NdfField::at(const V3i& voxel) const {
  if (const float *d = diagonal_.at(voxel), *o = off_.at(voxel); d && o) {
    const Symmetric s = symmetric(d, o);
    if (!(s.xx + s.yy + s.zz > 0)) return std::nullopt;
    return ndf_from_sggx(s);
  }
  if (const float *a = axis_1_.at(voxel), *b = axis_2_.at(voxel); a && b) return ndf_from_axes(kind_, V3f(a[0], a[1], a[2]), V3f(b[0], b[1], b[2]));
  return std::nullopt;
}

std::vector<double> column_transmittance(const VoxelField& alpha, const V3i& n, int axis) {
  const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  std::vector<double> through(static_cast<std::size_t>(n[u]) * static_cast<std::size_t>(n[v]), 1.0);
  for_each_active(alpha, n, [&](const V3i& at, const float* a) {
    through[static_cast<std::size_t>(at[v]) * static_cast<std::size_t>(n[u]) + static_cast<std::size_t>(at[u])] *= 1 - std::clamp(static_cast<double>(a[axis]), 0.0, 1.0);
  });
  return through;
}

}  // namespace texel
