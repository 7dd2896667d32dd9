#pragma once
// Stage 2: a shape's surface summed over the nodes of its tree, for instances that are small against a voxel
#include <cstdint>
#include <vector>

#include "bake/placed.h"
#include "bake/surface.h"

namespace texel {

// What a voxel gets of a node that lies wholly in it needs no clipping: areas, moments and colours turn and grow with the instance. Only
// shadows need each normal by itself, Σ|A·n|; of nodes with more than kMostVectors triangles, normals of about one direction (δ = 0.04 apart at
// most) are added up first. What faces the shadow's edge is then short by δ/12 on average, all of an even spread of normals by δ²/12: 1.3e-4.
inline constexpr std::uint32_t kLeastGathered = 6;      // triangles: below, clipping is as quick and a sum takes more room
inline constexpr std::uint32_t kMostVectors = 8192;

struct ShapeSums {
  // Triangles of one material, closed or not, in one node. The shape's space.
  struct Group {
    std::uint32_t material = 0;
    bool closed = false;
    double area = 0, covered = 0;
    V3d vector{0, 0, 0};             // Σ A n, covered
    double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;  // Σ A n nᵀ, covered
    std::array<double, 9> place{};   // closed: Σ A n cᵀ, c the triangle's middle; row by row
    V3d color{0, 0, 0};              // Σ A albedo, covered
  };
  // A covered vector area, and which kind it is of: open (false) or closed surface.
  struct Vector { V3d a; bool closed; };
  struct Node {
    std::uint32_t group = 0, groups = 0;    // groups = 0: not gathered, clip its triangles
    std::uint64_t vector = 0, vectors = 0;
  };
  std::vector<Node> nodes;           // as ShapeTree::nodes
  std::vector<Group> groups;
  std::vector<Vector> vectors;       // those of the triangles in tree order, then those of large nodes
};

// Of every shape. Nodes with a solid texture, or with holes in closed surface, are not gathered. `color`: albedo is wanted.
// Memory: some 150 bytes a triangle of the shapes. Cost: O(t log t).
[[nodiscard]] std::vector<ShapeSums> sum_shapes(const Scene& scene, const Plan& plan, const TextureSet& textures, bool color);

// A group where an instance that keeps shapes has it, in a voxel: adds to the sums of the voxel `cell`, and its covered area and colour to
// `covered` and `color`. `moments` may be null.
void add_group(const ShapeSums::Group& group, const Placed& placed, bool one_sided, int cell_z, Areas& areas, Moments* moments, double& covered, V3d& color);
// The shadows of a node's vectors.
void add_shadows(const ShapeSums& sums, const ShapeSums::Node& node, const Placed& placed, Areas& areas);

// call(A n) for each of a node's vectors where an instance that keeps shapes has it; voxel faces.
template <class Call>
void for_each_vector(const ShapeSums& sums, const ShapeSums::Node& node, const Placed& placed, Call&& call) {
  const std::array<double, 9>& m = placed.turn;
  for (std::uint64_t i = node.vector; i < node.vector + node.vectors; ++i) {
    const V3d& v = sums.vectors[i].a;
    call(V3d(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z, m[6] * v.x + m[7] * v.y + m[8] * v.z) * placed.scale);
  }
}

}  // namespace texel
