// Ear clipping after G. Meisters, "Polygons have ears" (1975); a diagonal is accepted when no corner lies in the ear and no edge crosses
// the diagonal, which also suffices for polygons whose holes are joined by bridges.
#include "formats/triangulate.h"

#include <algorithm>
#include <cmath>

namespace texel {
namespace {

// Twice an area, in polygons scaled to a box of edge 1, that counts as nothing: some hundred roundings of the flattening.
constexpr double kNoArea = 1e-14;
constexpr std::int64_t kMostSteps = std::int64_t{1} << 26;

V3d newell_normal(std::span<const V3d> corners) {
  V3d normal(0, 0, 0);
  V3d a = corners.back() - corners[0];
  for (const V3d& corner : corners) {
    const V3d b = corner - corners[0];  // relative to a corner: no cancellation far from the origin
    normal += a.cross(b);
    a = b;
  }
  return normal;
}

bool fan_has_area(std::span<const V3d> corners) {
  double area = 0, extent = 0;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const V3d a = corners[i - 1] - corners[0], b = corners[i] - corners[0];
    area += a.cross(b).length();
    extent = std::max({extent, a.length(), b.length()});
  }
  return area > 1e-9 * extent * extent;
}

}  // namespace

// False when the polygon has no extent or no area to speak of.
bool Triangulator::flatten(std::span<const V3d> corners) {
  Box3d box;
  for (const V3d& corner : corners) box.extendBy(corner - corners[0]);
  const V3d size = box.size();
  const double extent = std::max({size.x, size.y, size.z});
  const V3d normal = newell_normal(corners) / (extent * extent);
  if (!(extent > 0) || !(normal.length() > kNoArea)) return false;
  const V3d n = normal.normalized();
  // The axis least along the normal makes the most stable frame.
  V3d axis(0, 0, 0);
  axis[std::abs(n.x) <= std::abs(n.y) && std::abs(n.x) <= std::abs(n.z) ? 0 : std::abs(n.y) <= std::abs(n.z) ? 1 : 2] = 1;
  const V3d right = axis.cross(n).normalized();
  const V3d up = n.cross(right);
  flat_.clear();
  for (const V3d& corner : corners) {
    const V3d p = (corner - corners[0]) / extent;
    flat_.push_back({p.dot(right), p.dot(up)});
  }
  return true;
}

double Triangulator::turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  const Flat &p = flat_[a], &q = flat_[b], &r = flat_[c];
  return (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
}

// Turning left everywhere is not enough: a pentagram does so too, but goes round twice.
bool Triangulator::convex() const {
  const auto n = static_cast<std::uint32_t>(flat_.size());
  int reversals = 0;
  double way = 0;  // the last edge's direction along x
  double first_way = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = i + 1 == n ? 0 : i + 1, k = j + 1 == n ? 0 : j + 1;
    if (turn(i, j, k) < -kNoArea) return false;
    const double dx = flat_[j].x - flat_[i].x;
    if (std::abs(dx) <= kNoArea) continue;
    if (way * dx < 0) ++reversals;
    if (way == 0) first_way = dx;
    way = dx;
  }
  if (way * first_way < 0) ++reversals;
  return reversals <= 2;
}

void Triangulator::fan(std::uint32_t corners) {
  triangles_.clear();
  for (std::uint32_t i = 2; i < corners; ++i) triangles_.push_back({0, i - 1, i});
}

bool Triangulator::is_ear(std::uint32_t at, double least_area) const {
  const std::uint32_t a = previous_[at], c = next_[at];
  if (turn(a, at, c) <= least_area) return false;
  const auto same = [&](std::uint32_t p, std::uint32_t q) { return flat_[p].x == flat_[q].x && flat_[p].y == flat_[q].y; };
  for (std::uint32_t q = next_[c]; q != a; q = next_[q]) {
    ++steps_;
    if (same(q, a) || same(q, at) || same(q, c)) continue;
    // In the ear or on its diagonal; corners may touch its two sides from either side, as bridges do.
    if (turn(a, at, q) > 0 && turn(at, c, q) > 0 && turn(c, a, q) >= 0) return false;
  }
  for (std::uint32_t q = c; q != a; q = next_[q]) {
    const std::uint32_t r = next_[q];
    if (turn(a, c, q) * turn(a, c, r) < 0 && turn(q, r, a) * turn(q, r, c) < 0) return false;
  }
  return true;
}

// False when some corners are left that form no ear.
bool Triangulator::cut_ears() {
  const auto n = static_cast<std::uint32_t>(flat_.size());
  next_.resize(n);
  previous_.resize(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    next_[i] = i + 1 == n ? 0 : i + 1;
    previous_[i] = i == 0 ? n - 1 : i - 1;
  }
  triangles_.clear();
  steps_ = 0;
  std::uint32_t at = 1, left = n, refused = 0;
  while (left > 3) {
    if (steps_ > kMostSteps) return false;
    // After a round without an ear, corners on a straight line and spikes may go: they have no area.
    const bool flat_round = refused >= left;
    const bool cut = flat_round ? std::abs(turn(previous_[at], at, next_[at])) <= kNoArea : is_ear(at, kNoArea);
    if (!cut) {
      if (++refused >= 2 * left) return false;
      at = next_[at];
      continue;
    }
    const std::uint32_t a = previous_[at], c = next_[at];
    triangles_.push_back({a, at, c});
    next_[a] = c;
    previous_[c] = a;
    --left;
    refused = 0;
    at = c;
  }
  if (turn(previous_[at], at, next_[at]) < -kNoArea) return false;
  triangles_.push_back({previous_[at], at, next_[at]});
  return true;
}

std::span<const std::array<std::uint32_t, 3>> Triangulator::operator()(std::span<const V3d> corners) {
  not_simple_ = false;
  const auto n = static_cast<std::uint32_t>(corners.size());
  if (n <= 3) {
    fan(n);
    return triangles_;
  }
  if (!flatten(corners)) {
    fan(n);
    not_simple_ = fan_has_area(corners);  // a bow whose halves cancel
    return triangles_;
  }
  if (convex()) {
    fan(n);
    return triangles_;
  }
  if (!cut_ears()) {
    not_simple_ = true;
    fan(n);
  }
  return triangles_;
}

}  // namespace texel
