#pragma once
// How much of the grid is baked at a time, so that what is held for each border voxel keeps within memory.
#include "bake/plan.h"
#include "bake/recipe.h"
#include "bake/surface.h"
#include "bake/visibility.h"

namespace texel {

struct SlabPlan {
  int thickness = 0;           // voxels that are clipped at a time, a multiple of 8 · 2^(levels − 1); all of the grid where that is sure to fit
  int levels = 0;              // whose blocks lie in one slab each
  std::int64_t voxels = 0;     // border voxels to hold before a slab is finished
};

// A slab is as many times `thickness` as hold `voxels` border voxels. Half of Recipe::memory goes to it (of kUsualMemory where none is given); mesh,
// textures, slices and the finished grids need the rest, and are not bounded.
inline constexpr double kUsualMemory = 3e9;  // bytes
[[nodiscard]] SlabPlan plan_slabs(const Scene& scene, const Plan& plan, const SurfaceWant& want, const VisibilityOptions& options, const Recipe& recipe);

// Voxels that the scene's surface may be expected to meet, as if no two pieces of it met the same: what a convex piece at a random place meets is the
// volume of its Minkowski sum with a voxel. Instances count by their boxes.
[[nodiscard]] double expected_voxels(const Scene& scene, const Plan& plan);

}  // namespace texel
