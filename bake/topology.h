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
  std::vector<std::int8_t> turn;         // per triangle: −1 turned to agree with most of its component (of as many of either with the first), else +1
  struct Component {
    std::int64_t triangles = 0, turned = 0;
    std::int64_t open_edges = 0;         // edges whose triangles do not cancel
    bool closed = false;
    double volume = 0;                   // signed, of the turned triangles; only for closed ones
    double volume_terms = 0;             // only for those closed by themselves: what the volume's rounding is in proportion to
    std::uint32_t first = 0;             // its lowest triangle
    int bounded = -1;                    // closed only with its repetitions: an axis along which they all end; −1: closed by itself, or open
  };
  std::vector<Component> components;     // in the order of their lowest triangle
};

// Triangles with two equal corners join nothing and belong to no component (kNoIndex). Cost: O(t log t), two sorts of 3t keys.
[[nodiscard]] Topology find_topology(std::span<const V3d> points, std::span<const std::array<std::uint32_t, 3>> triangles);

// What stays open of a scene that repeats.
struct StillOpen {
  std::int64_t sheets = 0;   // components that meet their own repetitions on all sides, have an upper and a lower side but no inside
  std::int64_t endless = 0;  // closed components that go on without end along every axis: their inside cannot be told from their outside
};
// How far corners on open edges may lie from a repetition of one another to be one, voxels. Moves them together, by as much at most.
inline constexpr double kSeamTolerance = 0x1p-9;

// Closes the components of `topology` that are open by themselves but meet their own repetitions by `period` (voxel space; 0: none along that axis):
// fields of heights, pipes, tiles without end walls. They get an axis `bounded` and their volume per period. Sheets whose vector areas cancel
// (the upper and the lower side of a slab) become one component. `triangles`: those of find_topology.
[[nodiscard]] StillOpen close_over_period(const V3i& period, std::vector<V3d>& points, std::span<const std::array<std::uint32_t, 3>> triangles, Topology& topology);

// The edges where the oriented triangles, each counted `weight` times (negative: turned), do not cancel: `times` times from -> to remains.
struct ChainEdge { std::uint32_t from, to, triangle; int times; };
[[nodiscard]] std::vector<ChainEdge> chain_boundary(std::span<const V3d> points, std::span<const std::array<std::uint32_t, 3>> triangles, std::span<const std::int8_t> weight);

}  // namespace texel
