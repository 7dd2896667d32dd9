#pragma once
// Stage 5: what a voxel's rays met, exact projected areas -> opacity along the rays
#include <array>
#include <cstdint>
#include <vector>

#include "bake/surface.h"

namespace texel {

// Of each ray through a voxel: a, the share of it that is stopped; l, 1 where it is inside matter already at the voxel's near wall; w, 1 where its
// winding number in the voxel is ever other than 0 or 1 (matter overlaps); t, how much surface it meets that could stop it: open surface by its coverage, closed surface where it enters.
// Sums over rays. The mean of t over *all* rays, and without overlap that of l, are known exactly from the clipped surface, which is what makes a few rays enough.
struct RaySums {
  double a = 0, t = 0, l = 0, w = 0, tt = 0, tl = 0, at = 0, al = 0;

  void add(double stopped, double met, bool inside_before, bool overlap) {
    const double inside = inside_before ? 1 : 0;
    a += stopped; t += met; l += inside; w += overlap ? 1 : 0;
    tt += met * met; tl += met * inside; at += stopped * met; al += stopped * inside;
  }
  // As many stopped rays without overlap that are inside before, or meet just `met`.
  void add_many(double rays, double met, bool inside_before) {
    const double t_all = rays * met, inside = inside_before ? rays : 0;
    a += rays; t += t_all; l += inside;
    tt += t_all * met; tl += inside * met; at += t_all; al += inside;
  }
  // To a ray counted as one inside before that met nothing: it did meet this much open surface.
  void add_met_inside(double met) { t += met; tt += met * met; tl += met; at += met; }
};

// The same sums as integers, per voxel, so that bands of rays may add to one voxel in any order.
struct OpacitySums {
  std::vector<std::array<std::uint64_t, 8>> voxels;
  void add(std::int64_t voxel, const RaySums& sums);
  [[nodiscard]] RaySums get(std::int64_t voxel) const;
};

// What is exactly known along one axis, as means over a face of the voxel: t; the share of the near wall that is inside.
struct ExactMeans { double t = 0, near_inside = 0; };

// Opacity from the rays' mean, corrected by two control variates: the difference between the rays' mean of t (of l) and its exact value,
// times the regression of a on t and l over the voxel's own rays. Where no surface lies before another, a = l + t on every ray and the
// result is exact to rounding; where all rays are stopped a varies with neither and the mean stands. Shrunk a little towards
// the coefficients 1, 1, so that surface no ray has met still counts. In [0, 1]. `sampled`, when not null, receives the plain mean.
// Error: docs/accuracy.md. Source: control variates by regression (e.g. Owen, Monte Carlo theory, §8.9).
[[nodiscard]] double estimate_opacity(const RaySums& sums, double rays, const ExactMeans& exact, double* sampled = nullptr);

// How unsure the rays leave opacity: the variance, from ray to ray, of what is not exactly known of it. 0 where one layer lies in the voxel or all rays are
// stopped. Only to compare voxels by.
[[nodiscard]] double doubt(const RaySums& sums, double rays);

}  // namespace texel
