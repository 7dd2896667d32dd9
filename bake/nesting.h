#pragma once
// Stage 1: closed components -> which of them lies in which
#include <cstdint>
#include <span>
#include <vector>

#include "bake/topology.h"

namespace texel {

struct Nesting {
  std::vector<std::uint32_t> order;      // the components that take part, largest |volume| first, of equal ones the lower
  std::vector<std::uint32_t> container;  // per component: the last in that order that comes before it and holds it; kNoIndex: none does
};

// A component is held where a point of its first triangle is inside and, in a container closed by itself, its whole box in the container's.
// `points` and `period` (0: none along that axis): voxel space; `boxes`: the components'.
// Cost: O(t log c + k) for t triangles of components with others' boxes in their own, c components and k pairs of a triangle and a component that lies behind its outline along an axis.
[[nodiscard]] Nesting find_nesting(std::span<const V3d> points, std::span<const std::array<std::uint32_t, 3>> triangles,
                                   const Topology& topology, std::span<const Box3d> boxes, const std::vector<bool>& takes_part, const V3i& period);

// Whether any of the boxes lies wholly within another one: boxes[i] for which `asks[i]` in boxes[k], k != i. Cost: O(n log n).
[[nodiscard]] bool any_within_another(std::span<const Box3d> boxes, const std::vector<bool>& asks);

}  // namespace texel
