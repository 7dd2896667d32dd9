#pragma once
// What shading knows of the surface in a voxel, and the light it sends (method: docs/view.md)
#include <array>
#include <functional>
#include <span>

#include "bake/shading.h"

namespace texel {

// A symmetric 3×3 matrix as a quadratic form.
struct Form {
  double xx = 1, yy = 1, zz = 1, xy = 0, xz = 0, yz = 0;
  [[nodiscard]] V3d times(const V3d& v) const { return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z}; }
  [[nodiscard]] double form(const V3d& a, const V3d& b) const { return a.dot(times(b)); }
  [[nodiscard]] double determinant() const { return xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz); }
  [[nodiscard]] Form adjugate() const {
    return {yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy, xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz};
  }
  // share·S + (1 − share)·I
  [[nodiscard]] Form rounded(double share) const {
    const double rest = 1 - share;
    return {xx * share + rest, yy * share + rest, zz * share + rest, xy * share, xz * share, yz * share};
  }
};

struct Facets {
  Form s;               // SGGX, largest eigenvalue 1
  V3d mean{0, 0, 0};    // signed mean normal m/A, length <= 1
  bool closed = false;  // they bound a solid: their backs are hidden
  Look look;
  std::array<Form, 2> lobes{};  // SGGX of two lobes, where share_2 > 0
  double share_2 = 0;           // of the area, what the second has; 0: `s` alone is what the facets are
};

// Light the facets at `place` (world) send towards `v` (unit). `open` says what share of a light arrives from direction l (unit) over `distance` (world; infinite
// for a sun); it is asked only where the answer matters.
[[nodiscard]] V3f light_sent(const Facets& facets, const V3d& v, std::span<const Light> lights, const V3f& ambient, const V3d& place,
                             const std::function<float(const V3d& l, const Light& light)>& open);

// The facets of a voxel carried along by an affine map: `back` is the linear part of its inverse, as rows. A facet of vector area a·n becomes one of det·back^T·a·n, so
// that projected areas become sqrt(ω^T back^T S back ω) exactly, and SGGX stays SGGX; m/A changes with the mean of those over all directions (Thomsen's formula for
// an ellipsoid's area: 1.1 %). Source: Ratib 1997 §4.5.1 (normals by the inverse transpose); the closed form for S follows from Heitz et al. 2015, eq. for σ.
// Of two lobes what they are together is carried, as one.
[[nodiscard]] Facets carried(const Facets& facets, const std::array<V3d, 3>& back);

}  // namespace texel
