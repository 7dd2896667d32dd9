#pragma once
// What comparisons of packs with packs and with their geometry do alike, voxel by voxel.
#include <algorithm>
#include <cmath>

#include "bake/compare_sums.h"

namespace texel {

// call(voxel, values) for every active voxel of a grid; those of tiles one by one.
template <class Call>
void for_each_active(const VoxelField& field, const V3i& n, Call&& call) {
  if (!field.present()) return;
  for_each_voxel(field.layer()->set, [&](const V3i& v, std::int64_t) {
    if (v.x < n.x && v.y < n.y && v.z < n.z) call(v, field.at(v));
  });
  for (const V3i& tile : field.layer()->tiles)
    for (int i = 0; i < 512; ++i) {
      const V3i v = tile * 8 + V3i(i >> 6, i >> 3 & 7, i & 7);
      if (v.x < n.x && v.y < n.y && v.z < n.z) call(v, field.at(v));
    }
}

// Σ of the first component over a level.
[[nodiscard]] inline double sum_of(const VoxelField& field, const V3i& n) {
  double sum = 0;
  for_each_active(field, n, [&](const V3i&, const float* v) { sum += static_cast<double>(*v); });
  return sum;
}

// call(voxel, a's values, b's values) for every voxel active in either, null where it is not in one.
template <class Call>
void for_either(const VoxelField& a, const VoxelField& b, Call&& call) {
  const V3i all(1 << 30, 1 << 30, 1 << 30);
  for_each_active(a, all, [&](const V3i& v, const float* x) { call(v, x, b.at(v)); });
  for_each_active(b, all, [&](const V3i& v, const float* y) {
    if (!a.at(v)) call(v, nullptr, y);
  });
}

// Share of light that passes each column along `axis`, with the voxels' opacities multiplied as if independent: n[u]·n[v] values, u fastest.
[[nodiscard]] std::vector<double> column_transmittance(const VoxelField& alpha, const V3i& n, int axis);

// The errors of one voxel's projected areas.
inline void add_sigma(std::span<const double> sigma, std::span<const double> truth, ErrorSums& to) {
  double mean = 0, square = 0, most = 0;
  for (std::size_t i = 0; i < sigma.size(); ++i) {
    const double e = sigma[i] - truth[i];
    mean += e;
    square += e * e;
    most = std::max(most, std::abs(e));
  }
  const auto n = static_cast<double>(sigma.size());
  to.add(mean / n, square / n, most);
}

// The errors of three components, as one; none where the voxel has no value.
inline void add_vector(const float* value, const V3d& truth, ErrorSums& to) {
  if (!value) return;
  double mean = 0, square = 0, most = 0;
  for (int k = 0; k < 3; ++k) {
    const double e = static_cast<double>(value[k]) - truth[k];
    mean += e / 3;
    square += e * e / 3;
    most = std::max(most, std::abs(e));
  }
  to.add(mean, square, most);
}

// Order of voxels in lists: z, then y, then x.
[[nodiscard]] inline bool voxel_before(const V3i& a, const V3i& b) { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; }

// A figure in another unit.
[[nodiscard]] inline Measure in_units(Measure m, double unit) {
  for (double* v : {&m.value, &m.low, &m.high}) *v /= unit > 0 ? unit : 1;
  return m;
}

// The axis that stands for a sheet's normal or a fibre's direction.
[[nodiscard]] inline V3d axis_of(const VoxelNdf& ndf, bool fibre) { return ndf.axes.vector[fibre == (ndf.kind == VoxelNdf::Kind::kSggx) ? 2 : 0]; }

// Whether S as stored has a negative eigenvalue that is more than a half float's rounding.
[[nodiscard]] inline bool is_indefinite(const VoxelNdf& ndf) {
  const Eigen3 e = eigen(ndf.s);
  return e.value[2] < -1e-3 * e.value[0];
}

}  // namespace texel
