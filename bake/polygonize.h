#pragma once
// Stage 0: Scene with implicit surfaces -> the same with closed triangles for them, on the bake's own grid
#include "bake/recipe.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// Appends to scene.mesh the surface of every implicit and sets Mesh::made and Mesh::normals; a scene without implicits, or one that has
// its triangles already, is returned as it is.
//
// Vertices lie on the edges of a lattice of one cell a voxel, where the solid (f >= iso; NaN counts as outside) ends: to 1e-13 of the edge.
// The triangles of a cell follow from its eight corners by loops over its faces, so that they close and face outwards for every pattern of
// corners. Where a box cuts the solid the surface is closed half a cell outside the grid: matter goes on beyond the box.
// Along recipe.cyclic the function is that of the repeated solid (repeat_functions.h).
// Parts and gaps thinner than a cell may be missed, as between two lattice points; most missed parts are warned of (bake/thin_parts.h).
//
// Bricks of 4x4x4 cells that field.range proves empty or full are not sampled; the report counts them. A range that is wrong can lose
// pieces of surface but never leave a hole. Issues: `cyclic-seam`, `implicit-nan`, `implicit-jump`, `implicit-thin`, `implicit-empty`.
// Throws Error{kBadInput} where no implicit has any surface in the grid and there is no mesh either, and as plan_grid.
// Cost: about 12 values of f a border cell; memory about 100 bytes a triangle. The result does not depend on the number of threads.
[[nodiscard]] Scene polygonize(Scene scene, const Recipe& recipe, Report& report);

}  // namespace texel
