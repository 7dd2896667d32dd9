#pragma once
// Instances as triangles.
#include <cstdint>

#include "formats/scene.h"

namespace texel {

// Triangles of the mesh and of every instance of a shape.
[[nodiscard]] std::uint64_t count_triangles(const Scene& scene);

// Bounds of all points that the mesh's and the instances' triangles use (world), exact; empty where there is none. Cost: O(points of the
// shapes) for each instance whose box reaches beyond what is known already.
[[nodiscard]] Box3d surface_bounds(const Scene& scene);
// `known` grown by the instances alone.
[[nodiscard]] Box3d instance_bounds(const Scene& scene, Box3d known);

// Appends the shape, moved, to the mesh. Where the map mirrors, corners are turned round.
void place_shape(const Mesh& shape, const Affine& place, Mesh& mesh);

// The scene with every instance as triangles of its own, after those of the mesh and in the instances' order; no shapes are left.
// Throws Error{kUnsupported} when the mesh would have more than 2^27 triangles or points.
[[nodiscard]] Scene flatten_instances(const Scene& scene);

}  // namespace texel
