#pragma once
// Half-edges of triangles, sorted by edge: what components, open edges and seams are found with
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "bake/topology.h"

namespace texel {

// Index of the first point with the same position, for every point.
[[nodiscard]] std::vector<std::uint32_t> weld(std::span<const V3d> points);

struct HalfEdge {          // of a known lower vertex
  std::uint32_t higher;
  std::uint32_t triangle;
  std::int32_t sign;       // +1 where the triangle runs from the lower to the higher vertex
  bool operator<(const HalfEdge& o) const { return higher != o.higher ? higher < o.higher : triangle < o.triangle; }
};

// All half-edges, those of one edge side by side, edges and their triangles ascending; first[v] … first[v+1]: those whose lower vertex is v.
// A vertex has a handful, so a counting sort by it leaves next to nothing to sort.
struct HalfEdges {
  std::vector<std::size_t> first;
  std::vector<HalfEdge> edges;

  // each(call) calls call(lower, half-edge) for all of them, the same each time; lower < vertices.
  template <class Each>
  HalfEdges(std::size_t vertices, Each&& each) : first(vertices + 2, 0) {
    // Counted one place further on, so that filling moves each start to where it belongs.
    each([&](std::uint32_t lower, const HalfEdge&) { ++first[lower + 2]; });
    std::partial_sum(first.begin(), first.end(), first.begin());
    edges.resize(first.back());
    each([&](std::uint32_t lower, const HalfEdge& e) { edges[first[lower + 1]++] = e; });
    first.pop_back();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, first.size() - 1, 4096), [&](const auto& range) {
      for (std::size_t v = range.begin(); v < range.end(); ++v)
        std::sort(edges.begin() + static_cast<std::ptrdiff_t>(first[v]), edges.begin() + static_cast<std::ptrdiff_t>(first[v + 1]));
    });
  }

  // call(from, to) for the half-edges [from, to) of each edge, in order.
  template <class Call>
  void for_each_edge(Call&& call) const {
    for (std::size_t v = 0; v + 1 < first.size(); ++v)
      for (std::size_t i = first[v], j; i < first[v + 1]; i = j) {
        for (j = i + 1; j < first[v + 1] && edges[j].higher == edges[i].higher;) ++j;
        call(i, j);
      }
  }
};

// The half-edges of triangles whose vertices are `welded`; those with two equal corners have none.
[[nodiscard]] HalfEdges half_edges(std::span<const std::uint32_t> welded, std::span<const std::array<std::uint32_t, 3>> triangles);

// Components of as many triangles, their turns and open edges; no volumes. Where joins[t] is 0 triangle t has no half-edge and no component.
[[nodiscard]] Topology join_triangles(const HalfEdges& half, std::span<const char> joins);

}  // namespace texel
