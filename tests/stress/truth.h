#pragma once
// What a bake should come to, by other means than the bake's. Test code only.
#include <optional>
#include <span>

#include "formats/scene.h"

namespace texel::stress {

// Area within a box, world units², each triangle clipped by itself in long double, and how far it may be off in a bake for the rounding of coordinates.
// What lies in the box's own walls is in `most` only: the half-open rule of walls decides on it.
struct AreaTruth { long double least = 0, most = 0, slack = 0; };
[[nodiscard]] AreaTruth area_within(const Mesh& mesh, const Grid& grid);

// The winding number of a closed, oriented mesh at a point, by a ray along z. Edges count by the canonical side of the shared edge, so that they never
// count twice or not at all. None: the point lies within `near` of a triangle's plane where the ray meets it.
[[nodiscard]] std::optional<int> winding_at(const Mesh& mesh, const V3d& point, double near);

// Signed volume, world units³, in long double about the first corner.
[[nodiscard]] long double volume_of(const Mesh& mesh);

}  // namespace texel::stress
