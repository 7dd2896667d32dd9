#pragma once
// How a surface passes through a cube, from which of its corners are inside: closed loops over its edges. Internal to bake/.
#include <array>
#include <cstdint>

namespace texel {

// Corner c has the coordinates (c & 1, c >> 1 & 1, c >> 2). Edge axis·4 + k runs along the axis from its lower corner, whose coordinates
// along the next two axes (cyclic) are k & 1 and k >> 1.
struct CubeLoops {
  std::uint8_t count = 0;                  // loops, at most four
  std::array<std::uint8_t, 5> first{};     // loop i is edges[first[i]] … edges[first[i + 1] − 1]
  std::array<std::uint8_t, 12> edges{};    // counter-clockwise seen from outside the solid
  std::uint8_t triangles = 0;              // Σ (length − 2)
};

// By the bits of the inside corners. Every face is cut by the signs of its own four corners alone, inside corners of a face joined by its
// edges only, so that two cubes cut the face they share alike and the surface is closed for every pattern (Bloomenthal 1988).
[[nodiscard]] const std::array<CubeLoops, 256>& cube_loops();

// Corner at the lower end of an edge.
[[nodiscard]] constexpr int edge_corner(int edge) {
  const int axis = edge / 4, k = edge % 4;
  return ((k & 1) << ((axis + 1) % 3)) | ((k >> 1) << ((axis + 2) % 3));
}

}  // namespace texel
