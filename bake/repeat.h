#pragma once
// Stage 1b: Scene, Plan of a scene that repeats -> the same with every repetition that reaches into the grid
#include "bake/plan.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// The scene repeated along the cyclic axes, the grid's own extent being the period: each triangle as often as it comes within a voxel of the grid,
// moved by whole periods (exactly so in voxel space), those of implicit surfaces once (they are repeated already). `plan` is made to fit; its
// statistics stay those of one period.
//
// What is left out lies beyond the grid on a cyclic axis, so filled components are cut open there. From each edge that this opens a curtain hangs
// down an axis along which the component ends, to below everything. It lies outside the grid and closes what was cut: rays that enter the grid
// within matter have met it before, and winding numbers are those of the endless scene.
// Order: what was given, repetitions by (z, y, x) of their shift, curtains (plan.curtains of them).
// Throws Error{kBadInput} where more than 2·10⁸ triangles would be needed. Cost: one pass over the triangles and their repetitions.
[[nodiscard]] Scene repeat_scene(const Scene& scene, const std::array<bool, 3>& cyclic, Plan& plan, Report& report);

// The same for the eye alone: nothing is filled, nothing is cut.
[[nodiscard]] Scene repeat_scene(const Scene& scene, const Grid& grid, const std::array<bool, 3>& cyclic);

// What repeat_scene made without its curtains: what light meets.
[[nodiscard]] Scene without_curtains(Scene repeated, const Plan& plan);

}  // namespace texel
