#pragma once
// Stage 2: convex polygons cut by voxel walls
#include <array>
#include <cmath>

#include "formats/grid.h"

namespace texel {

// A convex planar polygon in voxel space. A triangle cut by the six walls of a cell has at most nine corners.
struct Polygon {
  static constexpr int kMax = 12;
  int n = 0;
  std::array<V3d, kMax> v;
  void add(const V3d& p) { if (n < kMax) v[static_cast<std::size_t>(n++)] = p; }
};

// Cells [first, last] along one axis that an extent [lo, hi] meets. An extent lying in a wall belongs to the cell below it where `normal`
// points up, else to the one above. Otherwise an extent that only touches a wall does not enter the cell beyond.
struct CellRange { int first, last; };
[[nodiscard]] inline CellRange cell_range(double lo, double hi, double normal) {
  const int first = static_cast<int>(std::floor(lo));
  if (lo == hi) return lo == first && normal > 0 ? CellRange{first - 1, first - 1} : CellRange{first, first};
  return {first, static_cast<int>(std::ceil(hi)) - 1};
}

// Parts of `p` at or below and at or above the plane x[axis] = wall. Cut corners are the same, bit for bit, in both parts.
void split(const Polygon& p, int axis, double wall, Polygon& below, Polygon& above);

// Calls emit(k, part) for the part of `p` in each cell k of [lo, hi) along `axis`, in ascending order. `normal`: which way is
// out of the cell that a polygon lying in a wall belongs to.
template <class Emit>
void split_cells(const Polygon& p, int axis, double normal, int lo, int hi, Emit&& emit) {
  double low = p.v[0][axis], high = low;
  for (int i = 1; i < p.n; ++i) {
    const double x = p.v[static_cast<std::size_t>(i)][axis];
    low = x < low ? x : low;
    high = x > high ? x : high;
  }
  // Comparing as double first keeps far-away coordinates from overflowing int.
  if (high < lo - 1 || low > hi + 1) return;
  low = low > lo - 2.0 ? low : lo - 2.0;
  const CellRange cells = cell_range(low, high < hi + 2.0 ? high : hi + 2.0, normal);
  if (cells.first == cells.last) {
    if (cells.first >= lo && cells.first < hi) emit(cells.first, p);
    return;
  }
  Polygon below, parts[2];
  const Polygon* rest = &p;
  int spare = 0;  // of parts: the one that `rest` is not in
  int k = cells.first;
  const auto cut = [&](double wall) {
    split(*rest, axis, wall, below, parts[spare]);
    rest = &parts[spare];
    spare = 1 - spare;
  };
  if (k < lo) {
    cut(lo);
    k = lo;
  }
  for (; k < cells.last && k < hi && rest->n >= 3; ++k) {
    cut(k + 1);
    if (below.n >= 3) emit(k, below);
  }
  if (k == cells.last && k < hi && rest->n >= 3) emit(k, *rest);
}

// Area of a polygon whose plane has the unit normal `normal`, from its shadow along the normal's longest component.
// `height`, when not null, receives the mean z over the area.
[[nodiscard]] double polygon_area(const Polygon& p, const V3d& normal, double* height = nullptr);

}  // namespace texel
