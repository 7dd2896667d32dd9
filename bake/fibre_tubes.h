#pragma once
// Stage 0c: Scene with fibres -> the same with closed tubes for those that are thick against a voxel
#include "bake/recipe.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// Half a strand's greatest thickness, in voxels, from which it becomes a tube. A thin piece is put into the voxels its axis passes, so that surface
// nearer than its radius to a wall may be one voxel off; below this that is at most 1/16 of a voxel. Measured on both sides: docs/accuracy.md.
inline constexpr double kThickRadius = 1.0 / 16;

// Sides of a tube of `radius` voxels: odd, so that its width changes with the direction as that of a polygon with twice as many sides does; at least 25
// (width within 0.13 % of the fibre's), and as many as keep the sides within 1/256 voxel of the round tube, up to 1025.
[[nodiscard]] int tube_sides(double radius);

// Thick strands as closed triangles, outward, before those made of implicit surfaces; the others stay fibres. Rings are regular polygons of the
// fibre's circumference, in the planes that halve each turn: a straight tube's area, Σ A n nᵀ and mean width are the fibre's to rounding. A turn of
// more than 120 degrees, and a point without thickness, ends a tube and begins another.
// The fibres' bounds go into scene.bounds, so that plan_grid stays what it was. Throws Error{kUnsupported} where tubes would have more than 2²⁸ vertices.
[[nodiscard]] Scene mesh_thick_fibres(Scene scene, const Recipe& recipe, Report& report);

}  // namespace texel
