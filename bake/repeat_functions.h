#pragma once
// Stage 0a: Scene, Grid, cyclic axes -> functions, density and solid textures that repeat with the grid's box
#include "bake/recipe.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// All of them: the box of `grid` is one period along recipe.cyclic; where no axis is cyclic, what was given. An end is looked for along each axis by
// itself: a column without end along z, crossing the border along x, has copies along x.
// Throw Error{kCommandLine} where a function is so much larger than the period that more than kMostCopies of it meet one.
inline constexpr int kMostCopies = 1000;

// A function with an end: the union of copies, as many as meet the grid; what leaves the box on one side comes in on the other. `box` stays that of
// one copy. A function without one: as it is; where opposite faces of the box differ the issue `cyclic-seam` says along which axis.
[[nodiscard]] Implicit repeat_solid(Implicit solid, const Grid& grid, const Recipe& recipe, Report& report);

// The scene's density: its shape likewise; noise that no shape ends repeats by itself, its frequency fitted to the period (`cyclic-frequency`).
// Solid textures are fitted likewise; those that cannot be have a seam (`cyclic-solid-texture`).
[[nodiscard]] bool has_patterns(const Scene& scene);  // either of them
[[nodiscard]] Scene repeat_patterns(Scene scene, const Grid& grid, const Recipe& recipe, Report& report);

}  // namespace texel
