#pragma once
// Stage 1: closed components -> which of them lies in which
#include <cstdint>
#include <span>
#include <vector>

#include "bake/topology.h"

namespace texel {

// For each component that takes part, the outermost one it lies in, by way of the smallest (by |volume|) that holds it, the smallest that holds
// that one, and so on; itself where none does. A component is held where a point of its first triangle is inside and, in a container closed by itself, its whole
// box in the container's. `points` and `period` (0: none along that axis): voxel space; `boxes`: the components'.
// Cost: O(t log c + k) for t triangles, c components and k pairs of a triangle and a component that lies behind its outline along an axis.
[[nodiscard]] std::vector<std::uint32_t> find_outermost(std::span<const V3d> points, std::span<const std::array<std::uint32_t, 3>> triangles,
                                                        const Topology& topology, std::span<const Box3d> boxes, const std::vector<bool>& takes_part, const V3i& period);

}  // namespace texel
