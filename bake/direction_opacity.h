#pragma once
// A voxel's opacity along the axes and its distribution of normals -> its opacity in any direction
#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/grid.h"

namespace texel {

// What one voxel says of its opacity, 0 where it says nothing.
struct AxisOpacity {
  V3f alpha{0, 0, 0};          // along x, y, z
  V3f met{0, 0, 0};            // layers of surface along them, each of which could hide what is behind it
  V3f fog{0, 0, 0};            // −ln(1 − alpha), at most 9.21: depth, were it a fog
  V3f depth{0, 0, 0};          // the same, but not above `met`
  V3f joined{0, 0, 0};         // correlations xy, xz, yz of S: S_ij/√(S_ii·S_jj), −1…1
  bool full = false;           // matter alone: opaque in all directions
};

// `alpha`, `crossings`, `diagonal`, `off`: the voxel's values of the grids alpha, crossings, S_diag and S_off, or null; `solid`: that grid's, the share that is matter: a
// body's two walls are one layer, and all of it is opaque whatever the axes say; `there`: share of the surface that lets nothing through. Values out of range are brought into it. Without `crossings` as many layers are
// taken as the opacity asks for, at most 1.
[[nodiscard]] inline AxisOpacity axis_opacity(const float* alpha, const float* crossings, const float* diagonal, const float* off, float solid, float there = 1) {
  AxisOpacity voxel;
  voxel.full = solid >= 1 && there >= 1;
  for (int k = 0; alpha && k < 3; ++k) {
    const float a = alpha[k] > 0 ? std::min(alpha[k], 1.0f) * there : 0.0f;
    const float most = !crossings ? 1.0f : crossings[k] > 0 ? crossings[k] * there * (solid > 0 ? 0.5f : 1.0f) : 0.0f;
    const float fog = a < 1 ? -std::log1p(-a) : std::numeric_limits<float>::infinity();
    voxel.alpha[k] = a;
    voxel.fog[k] = std::min(fog, 9.21f);
    voxel.depth[k] = std::min(fog, most);
    voxel.met[k] = crossings ? most : voxel.depth[k];
  }
  if (!diagonal || !off) return voxel;
  const auto one = [&](int i, int j, float s_ij) {
    const float limit = diagonal[i] * diagonal[j];
    const float r = limit > 1e-12f ? s_ij / std::sqrt(limit) : 0.0f;
    return r > 1 ? 1.0f : r < -1 ? -1.0f : r == r ? r : 0.0f;
  };
  voxel.joined = {one(0, 1, off[0]), one(0, 2, off[1]), one(1, 2, off[2])};
  return voxel;
}

// √(wᵀGSGw), G such that along the axes it is `axes`: the shadow of an ellipsoid.
[[nodiscard]] inline double ellipsoid_shadow(const V3f& axes, const V3f& joined, const V3d& w) {
  const V3d p(static_cast<double>(axes.x) * w.x, static_cast<double>(axes.y) * w.y, static_cast<double>(axes.z) * w.z);
  const double cross = p.x * p.y * static_cast<double>(joined.x) + p.x * p.z * static_cast<double>(joined.y) + p.y * p.z * static_cast<double>(joined.z);
  return std::sqrt(std::max(p.dot(p) + 2 * cross, 0.0));
}

// Share (0…1) that the voxel alone hides of parallel rays along `w` (unit) spread evenly over the shadow of its cube, Σ|w_k| faces. The larger of two answers: of surface that
// nowhere hides itself, whose shadow is `alpha` joined, exact along the axes and for a sheet; and of surfaces strewn at random, whose layers are joined and count as much as
// along the axes. Error: docs/accuracy.md, "Opacity in any direction". Of a cell with edges e instead of 1: give w/e.
[[nodiscard]] inline double opacity_along(const AxisOpacity& voxel, const V3d& w) {
  if (voxel.full) return 1;
  const double faces = std::abs(w.x) + std::abs(w.y) + std::abs(w.z);
  const double apart = ellipsoid_shadow(voxel.alpha, voxel.joined, w) / faces;
  const V3d square = w * w;
  const double met = square.dot(V3d(voxel.met)), depth = square.dot(V3d(voxel.depth));
  const double layers = met > 0 ? ellipsoid_shadow(voxel.met, voxel.joined, w) / faces * (depth / met) : 0;
  const double strewn = layers > apart ? -std::expm1(-layers) : 0;  // less than `layers`: mostly it need not be worked out
  return std::min(std::max(apart, strewn), 1.0);
}

// The same as optical depth of one voxel edge, at most `most`: a ray of the cube's mean chord, 1/Σ|w_k|, loses opacity_along.
[[nodiscard]] inline double depth_along(const AxisOpacity& voxel, const V3d& w, double most) {
  const double opacity = opacity_along(voxel, w);
  return opacity < 1 ? std::min(-std::log1p(-opacity) * (std::abs(w.x) + std::abs(w.y) + std::abs(w.z)), most) : most;
}

// How far a voxel's surface is one sheet, 0…1: by its mean normal, or, as two-sided surface has none, by how much one axis prevails in S (`diagonal`, `off`, or null).
[[nodiscard]] inline float sheet_share(const V3f& mean, const float* diagonal, const float* off) {
  const float one_way = std::min(mean.dot(mean), 1.0f);
  if (!diagonal || !off) return one_way;
  const float trace = diagonal[0] + diagonal[1] + diagonal[2];
  const float squares = diagonal[0] * diagonal[0] + diagonal[1] * diagonal[1] + diagonal[2] * diagonal[2] + 2 * (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]);
  if (!(trace > 0)) return one_way;
  const float flat = std::clamp(1.5f * squares / (trace * trace) - 0.5f, 0.0f, 1.0f);  // 1: one direction, 0: all alike
  return std::max(one_way, flat * flat);
}

// What a sheet hides of a ray along `w` (unit) per voxel edge, where its parts in one voxel and the next add up instead of hiding alike: its shadow, raised where it is closed. A ray
// passes a closed sheet in voxels that hold more or less of it, and what it gains in the one it may have lost beyond 1 in the other; the raise keeps gaps from showing. Closed: by its axes'
// depths joined, that take it for a fog and so stay near 1 for a voxel without holes.
[[nodiscard]] inline double sheet_along(const AxisOpacity& voxel, const V3d& w) {
  constexpr double kRaise = 0.75;
  const double closed = -std::expm1(-ellipsoid_shadow(voxel.fog, voxel.joined, w)), twice = closed * closed;
  return ellipsoid_shadow(voxel.alpha, voxel.joined, w) * (1 + kRaise * twice * twice);
}

}  // namespace texel
