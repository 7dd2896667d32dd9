#pragma once
// Stage 1c: Scene::fibres -> straight pieces in voxel space, and all that is known of a piece in closed form
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/pack.h"
#include "formats/scene.h"

namespace texel {

struct Areas;
struct Moments;

// Circumradius of a tube's ring over the fibre's radius, at most (fibre_tubes.h): bounds hold both.
inline constexpr double kTubeReach = 1.003;

// Where fibres have surface, world. A little generous at slanting ends: it is the balls about the points.
[[nodiscard]] Box3d fibre_bounds(const Fibres& fibres);
// Area with the discs at the ends, world².
[[nodiscard]] double fibre_area(const Fibres& fibres);

// A frustum of a cone from a (radius ra) to b (rb) about their line, without its discs but where a strand begins or ends there. Voxel space.
struct FibreSegment {
  V3d a, b;
  double ra, rb;
  std::uint32_t point;     // of a, in Scene::fibres; b is the next
  std::uint32_t material;
  bool begins, ends;       // a disc closes it at a; at b
};

// The pieces of all strands in their order. Ends within 2⁻³⁰ of a wall are put on it, as Plan::points are.
// Throws Error{kUnsupported} where triangles and pieces together are 2³² or more.
[[nodiscard]] std::vector<FibreSegment> fibre_segments(const Scene& scene, const Grid& grid);

// What does not change along a piece. Per unit of length and of radius, that is for ∫ r ds = 1:
struct FibreShape {
  V3d t{0, 0, 0};          // unit, from a to b; 0 where they are one
  double length = 0;
  double taper = 0;        // (ra − rb)/length: the tangent of the cone's half angle
  V3d shadow{0, 0, 0};     // half of Σ A|n| along x, y and z: 2·sin of the angle to the axis for a cylinder
  double area = 0;         // 2π√(1 + taper²)
  double slope = 0;        // Σ A n is this times t
  double across = 0, along = 0;  // Σ A n nᵀ = across·(I − t tᵀ) + along·t tᵀ
};
[[nodiscard]] FibreShape fibre_shape(const FibreSegment& segment);

// A quarter of ∫₀²π |s cos φ + q| dφ, s, q >= 0: the half shadow of a frustum whose axis shows s of its length and whose walls lean by q. Exact.
[[nodiscard]] inline double frustum_shadow(double s, double q) {
  if (q >= s) return q * (M_PI / 2);
  return std::sqrt((s - q) * (s + q)) + q * std::asin(q / s);
}

// Adds the part s0…s1 (of 0…1) of a piece, with its discs where it includes an end of a strand that has one. Fibres are open surface of covered area;
// of the shadow half stops a ray: as many walls face it as face away, over a whole strand exactly.
void add_fibre(const FibreSegment& segment, const FibreShape& shape, double s0, double s1, bool one_sided, Areas& areas, Moments* moments);

// Calls emit(cell, s0, s1) for the parts of the piece in the cells of [low, high) that its axis passes, in order from a to b. Cells are half-open.
// Parts share their ends bit for bit, whatever box is asked for, so that nothing is lost or counted twice.
template <class Emit>
void walk_fibre(const FibreSegment& segment, const V3i& low, const V3i& high, Emit&& emit);

// What a bundle of rays along `axis` sees of a piece: its middle line and how far from it rays still meet it, in the plane (u, v). The outline's area
// is the piece's share of `stopping`, to rounding, discs included, unless it is a cone seen from its tip.
struct FibreOutline {
  double u, v;             // of a
  double du, dv;           // unit, from a to b
  double length;           // from a to b
  double before, behind;   // how far it goes on beyond a and b: discs seen at a slant
  double wa, wb;           // half widths at a and b
};
[[nodiscard]] FibreOutline fibre_outline(const FibreSegment& segment, const FibreShape& shape, int axis, int u_axis, int v_axis);

// Where on the piece (0…1, never quite an end) a ray at (u, v) meets the outline; below 0: nowhere.
[[nodiscard]] inline double meet_outline(const FibreOutline& o, double u, double v) {
  const double x = u - o.u, y = v - o.v;
  const double along = x * o.du + y * o.dv, across = std::abs(x * o.dv - y * o.du);
  if (along < -o.before || along > o.length + o.behind) return -1;
  const double s = o.length > 0 ? std::fmin(std::fmax(along / o.length, 1e-9), 1 - 1e-9) : along < 0 ? 1e-9 : 1 - 1e-9;
  return across <= o.wa + (o.wb - o.wa) * s ? s : -1;
}

// The same fibres with every repetition that comes within a voxel of the grid, moved by whole periods: theirs come behind the given ones, which stay.
// Throws Error{kBadInput} where more than 10⁸ points would be needed.
[[nodiscard]] Fibres repeat_fibres(const Fibres& fibres, const Grid& grid, const std::array<bool, 3>& cyclic);

// ---

template <class Emit>
void walk_fibre(const FibreSegment& f, const V3i& low, const V3i& high, Emit&& emit) {
  const V3d d = f.b - f.a;
  double from = 0, to = 1;
  for (int k = 0; k < 3; ++k) {
    const double lo = low[k], hi = high[k];
    if (d[k] == 0) {
      if (f.a[k] < lo || f.a[k] >= hi) return;
      continue;
    }
    const double s_lo = (lo - f.a[k]) / d[k], s_hi = (hi - f.a[k]) / d[k];
    from = std::fmax(from, std::fmin(s_lo, s_hi));
    to = std::fmin(to, std::fmax(s_lo, s_hi));
  }
  if (!(from < to)) return;
  // Next wall along each axis: its number and where it is met. The wall's parameter depends on nothing but the wall.
  int cell[3], step[3];
  double next[3];
  const auto meet = [&](int k) {
    const int wall = step[k] > 0 ? cell[k] + 1 : cell[k];
    return (wall - f.a[k]) / d[k];
  };
  for (int k = 0; k < 3; ++k) {
    step[k] = d[k] > 0 ? 1 : d[k] < 0 ? -1 : 0;
    // The cell begun in, by rounding perhaps the one before: then its far wall lies at or before `from` and is stepped over.
    const double x = std::fmin(std::fmax(f.a[k] + d[k] * from, static_cast<double>(low[k])), static_cast<double>(high[k]));
    cell[k] = static_cast<int>(std::floor(x)) - (step[k] > 0 ? 1 : 0) + (step[k] < 0 ? 1 : 0);
    if (step[k] == 0) {
      cell[k] = static_cast<int>(std::floor(f.a[k]));
      next[k] = 2;
      continue;
    }
    while ((next[k] = meet(k)) <= from) cell[k] += step[k];
  }
  for (double s = from; s < to;) {
    const int k = next[0] <= next[1] ? (next[0] <= next[2] ? 0 : 2) : (next[1] <= next[2] ? 1 : 2);
    const double end = std::fmin(next[k], to);
    if (end > s && cell[0] >= low.x && cell[1] >= low.y && cell[2] >= low.z && cell[0] < high.x && cell[1] < high.y && cell[2] < high.z)
      emit(V3i(cell[0], cell[1], cell[2]), s, end);
    s = end;
    if (!(next[k] < to)) break;
    cell[k] += step[k];
    next[k] = meet(k);
  }
}

}  // namespace texel
