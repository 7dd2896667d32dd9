#pragma once
// Polygons -> triangles.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/grid.h"

namespace texel {

// Cuts polygons into triangles. Keeps its scratch memory between calls: use one object per thread.
class Triangulator {
 public:
  // corners.size() − 2 triangles of corner numbers, wound as the polygon is. A polygon convex in its mean plane (Newell's
  // normal) becomes a fan from its first corner, any other is cut ear by ear in that plane; bridges to holes (corners
  // that repeat) are allowed. The span lives until the next call. Fewer than 3 corners: none.
  // Always ends: about n² steps, at most 2^26, and what is left then, or has no ear because it crosses itself, becomes a fan.
  [[nodiscard]] std::span<const std::array<std::uint32_t, 3>> operator()(std::span<const V3d> corners);

  // Whether the last polygon crossed itself, so that its triangles overlap.
  [[nodiscard]] bool was_not_simple() const { return not_simple_; }

 private:
  struct Flat { double x, y; };
  bool flatten(std::span<const V3d> corners);
  [[nodiscard]] bool convex() const;
  void fan(std::uint32_t corners);
  bool cut_ears();
  [[nodiscard]] bool is_ear(std::uint32_t at, double least_area) const;
  [[nodiscard]] double turn(std::uint32_t a, std::uint32_t b, std::uint32_t c) const;

  std::vector<Flat> flat_;                     // corners in the mean plane, scaled to about 1
  std::vector<std::uint32_t> next_, previous_; // ring of the corners not yet cut off
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  mutable std::int64_t steps_ = 0;
  bool not_simple_ = false;
};

}  // namespace texel
