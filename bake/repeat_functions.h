#pragma once
// Stage 0a: Scene, Grid, cyclic axes -> the scene whose functions, density and solid textures repeat with the grid's box
#include "bake/recipe.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// The scene, with the box of `grid` as one period along recipe.cyclic; as it is where no axis is. Meshes and height fields are left alone.
//   functions with an end   the union of copies, as many as meet the grid: what leaves the box on one side comes in on the other
//   functions without one   as they are; where they differ between opposite faces of the box the issue `cyclic-seam` says along which axis
//   densities               their shapes likewise; noise that no shape ends repeats by itself, its frequency fitted to the period
//   solid textures          fitted to the period, `cyclic-frequency`; those that cannot be have a seam, `cyclic-solid-texture`
// An end is looked for along each axis by itself: a column without end along z, crossing the border along x, has copies along x.
// Throws Error{kCommandLine} where a function is so much larger than the period that more than kMostCopies of it meet one.
inline constexpr int kMostCopies = 1000;
[[nodiscard]] Scene repeat_functions(Scene scene, const Grid& grid, const Recipe& recipe, Report& report);

}  // namespace texel
