#pragma once
// Oracle: Mesh -> which side of a closed surface a point is on, by exact predicates (CGAL, GPL-3.0-or-later). For tests and diagnosis;
// no bake uses it.
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "formats/grid.h"

namespace texel {

enum class Side { kOutside, kOnSurface, kInside };

// A closed triangle mesh to ask points about. Triangles without area are left out: they bound nothing.
class ExactInside {
 public:
  // Copies what it needs. Indices must be valid and coordinates finite. An open mesh gives answers without meaning.
  // Cost: O(t log t), about 1 µs a triangle.
  ExactInside(std::span<const V3d> points, std::span<const std::array<std::uint32_t, 3>> triangles);
  ~ExactInside();
  ExactInside(const ExactInside&) = delete;
  ExactInside& operator=(const ExactInside&) = delete;

  // By the parity of a ray's crossings, every predicate exact. Thread-safe. Cost: some 10 µs.
  [[nodiscard]] Side side(const V3d& point) const;
  // Distance to the nearest triangle, to double rounding. Thread-safe. Cost: some 100 µs.
  [[nodiscard]] double distance(const V3d& point) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace texel
