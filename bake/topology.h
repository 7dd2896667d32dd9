#pragma once
// Stage 1: triangles -> edge-connected components, closed or open, consistently turned
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/grid.h"

namespace texel {

// Components join triangles that share an edge, vertices at bitwise equal positions being one.
// A component is *closed* when, after turning triangles to agree with their neighbours across two-triangle edges, the oriented
// triangles of every edge cancel: then every ray has a well-defined winding number, manifold or not.
struct Topology {
  std::vector<std::uint32_t> component;  // per triangle
  std::vector<std::int8_t> turn;         // per triangle: −1 turned to agree with the first triangle of its component, else +1
  struct Component {
    std::int64_t triangles = 0, turned = 0;
    std::int64_t open_edges = 0;         // edges whose triangles do not cancel
    bool closed = false;
    double volume = 0;                   // signed, of the turned triangles; only for closed ones
    std::uint32_t first = 0;             // its lowest triangle
  };
  std::vector<Component> components;     // in the order of their lowest triangle
};

// Triangles with two equal corners join nothing and belong to no component (kNoIndex). Cost: O(t log t), two sorts of 3t keys.
[[nodiscard]] Topology find_topology(std::span<const V3d> points, std::span<const std::array<std::uint32_t, 3>> triangles);

}  // namespace texel
