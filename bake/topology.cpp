#include "bake/topology.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "bake/half_edges.h"
#include "formats/random.h"
#include "formats/scene.h"

namespace texel {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

struct Sets {              // union-find that also keeps the parity of turns between a triangle and its root
  std::vector<std::uint32_t> parent;
  std::vector<std::uint8_t> parity;

  explicit Sets(std::size_t n) : parent(n), parity(n, 0) { std::iota(parent.begin(), parent.end(), 0u); }

  std::uint32_t find(std::uint32_t t, std::uint8_t* turned) {
    std::uint32_t root = t;
    std::uint8_t all = 0;
    while (parent[root] != root) { all ^= parity[root]; root = parent[root]; }
    *turned = all;
    while (parent[t] != root && t != root) {  // compress, keeping each parity relative to the root
      const std::uint32_t next = parent[t];
      const std::uint8_t own = parity[t];
      parent[t] = root;
      parity[t] = all;
      all ^= own;
      t = next;
    }
    return root;
  }

  void join(std::uint32_t a, std::uint32_t b, std::uint8_t turned) {
    std::uint8_t pa = 0, pb = 0;
    std::uint32_t ra = find(a, &pa), rb = find(b, &pb);
    if (ra == rb) return;
    if (rb < ra) std::swap(ra, rb);  // the lowest triangle stays the root and keeps its orientation
    parent[rb] = ra;
    parity[rb] = static_cast<std::uint8_t>(pa ^ pb ^ turned);
  }
};

}  // namespace

std::vector<std::uint32_t> weld(std::span<const V3d> points) {
  const std::size_t slots = std::bit_ceil(points.size() * 2 + 2);
  std::vector<std::uint32_t> table(slots, kNoIndex), first(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const V3d p = points[i] + V3d(0, 0, 0);  // −0 becomes 0
    std::uint64_t hash = 0;
    for (int a = 0; a < 3; ++a) hash = mix_bits(hash ^ std::bit_cast<std::uint64_t>(p[a]));
    std::size_t slot = hash & (slots - 1);
    while (table[slot] != kNoIndex && points[table[slot]] != p) slot = (slot + 1) & (slots - 1);
    if (table[slot] == kNoIndex) table[slot] = static_cast<std::uint32_t>(i);
    first[i] = table[slot];
  }
  return first;
}

HalfEdges half_edges(std::span<const std::uint32_t> welded, std::span<const Triangle> triangles) {
  return HalfEdges(welded.size(), [&](auto&& call) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const std::uint32_t v[3] = {welded[triangles[t][0]], welded[triangles[t][1]], welded[triangles[t][2]]};
      if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t a = v[i], b = v[(i + 1) % 3];
        call(std::min(a, b), HalfEdge{std::max(a, b), static_cast<std::uint32_t>(t), a < b ? 1 : -1});
      }
    }
  });
}

Topology join_triangles(const HalfEdges& half, std::span<const char> joins) {
  const std::size_t triangles = joins.size();
  const std::vector<HalfEdge>& edges = half.edges;
  // Two-triangle edges first: they alone say who must be turned. Then the rest, which only join.
  Sets sets(triangles);
  for (int pass = 0; pass < 2; ++pass)
    half.for_each_edge([&](std::size_t i, std::size_t j) {
      if ((j - i == 2) != (pass == 0)) return;
      for (std::size_t k = i + 1; k < j; ++k)
        sets.join(edges[i].triangle, edges[k].triangle, pass == 0 && edges[i].sign == edges[k].sign ? 1 : 0);
    });

  Topology result;
  result.component.assign(triangles, kNoIndex);
  result.turn.assign(triangles, 1);
  std::vector<std::uint32_t> number(triangles, kNoIndex);
  for (std::uint32_t t = 0; t < triangles; ++t) {
    if (!joins[t]) continue;
    std::uint8_t turned = 0;
    const std::uint32_t root = sets.find(t, &turned);
    if (number[root] == kNoIndex) {
      number[root] = static_cast<std::uint32_t>(result.components.size());
      result.components.push_back({});
      result.components.back().first = t;
    }
    Topology::Component& part = result.components[number[root]];
    result.component[t] = number[root];
    result.turn[t] = turned ? -1 : 1;
    ++part.triangles;
    part.turned += turned;
  }
  half.for_each_edge([&](std::size_t i, std::size_t j) {
    int sum = 0;
    for (std::size_t k = i; k < j; ++k) sum += edges[k].sign * result.turn[edges[k].triangle];
    if (sum != 0) ++result.components[result.component[edges[i].triangle]].open_edges;
  });
  // Those that were the other way than most are the wrong ones, be the first triangle among them.
  std::vector<char> reversed;
  for (Topology::Component& part : result.components) {
    part.closed = part.open_edges == 0;
    reversed.push_back(2 * part.turned > part.triangles);
    if (reversed.back()) part.turned = part.triangles - part.turned;
  }
  for (std::size_t t = 0; t < triangles; ++t)
    if (result.component[t] != kNoIndex && reversed[result.component[t]]) result.turn[t] = static_cast<std::int8_t>(-result.turn[t]);
  return result;
}

Topology find_topology(std::span<const V3d> points, std::span<const Triangle> triangles) {
  const std::vector<std::uint32_t> first = weld(points);
  std::vector<char> joins(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Triangle& c = triangles[t];
    joins[t] = first[c[0]] != first[c[1]] && first[c[1]] != first[c[2]] && first[c[2]] != first[c[0]];
  }
  Topology result = join_triangles(half_edges(first, triangles), joins);

  // Signed volume about each component's own first corner, so that offsets cost no digits.
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (result.component[t] == kNoIndex) continue;
    Topology::Component& part = result.components[result.component[t]];
    if (!part.closed) continue;
    const V3d o = points[triangles[part.first][0]];
    const V3d &p = points[triangles[t][0]], a = p - o, b = points[triangles[t][1]] - p, c = points[triangles[t][2]] - p;
    part.volume += result.turn[t] * a.dot(b.cross(c)) / 6;
    part.volume_terms += a.length() * b.length() * c.length() / 6;
  }
  return result;
}

std::vector<ChainEdge> chain_boundary(std::span<const V3d> points, std::span<const Triangle> triangles, std::span<const std::int8_t> weight) {
  const std::vector<std::uint32_t> first = weld(points);
  const HalfEdges half = half_edges(first, triangles);
  std::vector<ChainEdge> left;
  for (std::uint32_t v = 0; v + 1 < half.first.size(); ++v)
    for (std::size_t i = half.first[v], j; i < half.first[v + 1]; i = j) {
      int sum = 0;
      for (j = i; j < half.first[v + 1] && half.edges[j].higher == half.edges[i].higher; ++j) sum += half.edges[j].sign * weight[half.edges[j].triangle];
      const std::uint32_t other = half.edges[i].higher;
      if (sum != 0) left.push_back({sum > 0 ? v : other, sum > 0 ? other : v, half.edges[i].triangle, std::abs(sum)});
    }
  return left;
}

}  // namespace texel
