#include "bake/cube_loops.h"

namespace texel {
namespace {

constexpr int edge_between(int corner, int other) {
  const int low = corner & other, difference = corner ^ other;
  const int axis = difference == 1 ? 0 : difference == 2 ? 1 : 2;
  return axis * 4 + ((low >> ((axis + 1) % 3)) & 1) + 2 * ((low >> ((axis + 2) % 3)) & 1);
}

CubeLoops loops_of(int inside) {
  // On each face, walked counter-clockwise seen from outside the cube, a run of inside corners is entered over one edge and left over
  // another. The neighbouring face walks each edge the other way: so every cut edge is entered once and left once.
  std::array<int, 12> next;
  next.fill(-1);
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side) {
      const int b = 1 << ((axis + 1) % 3), c = 1 << ((axis + 2) % 3), base = side << axis;
      const std::array<int, 4> walk = side ? std::array<int, 4>{base, base | b, base | b | c, base | c} : std::array<int, 4>{base, base | c, base | b | c, base | b};
      for (unsigned i = 0; i < 4; ++i) {
        const auto is_in = [&](unsigned j) { return (inside >> walk[j % 4]) & 1; };
        if (is_in(i) || !is_in(i + 1)) continue;  // entered between i and i + 1
        unsigned last = i + 1;
        while (is_in(last + 1)) ++last;
        next[static_cast<std::size_t>(edge_between(walk[i % 4], walk[(i + 1) % 4]))] = edge_between(walk[last % 4], walk[(last + 1) % 4]);
      }
    }
  CubeLoops loops;
  std::array<bool, 12> seen{};
  unsigned used = 0;
  for (int start = 0; start < 12; ++start) {
    if (next[static_cast<std::size_t>(start)] < 0 || seen[static_cast<std::size_t>(start)]) continue;
    const unsigned begin = used;
    for (int e = start; !seen[static_cast<std::size_t>(e)]; e = next[static_cast<std::size_t>(e)]) {
      seen[static_cast<std::size_t>(e)] = true;
      loops.edges[used++] = static_cast<std::uint8_t>(e);
    }
    loops.first[++loops.count] = static_cast<std::uint8_t>(used);
    loops.triangles = static_cast<std::uint8_t>(loops.triangles + used - begin - 2);
  }
  return loops;
}

}  // namespace

const std::array<CubeLoops, 256>& cube_loops() {
  static const std::array<CubeLoops, 256> table = [] {
    std::array<CubeLoops, 256> t;
    for (int i = 0; i < 256; ++i) t[static_cast<std::size_t>(i)] = loops_of(i);
    return t;
  }();
  return table;
}

}  // namespace texel
