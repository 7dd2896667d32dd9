#pragma once
// Stage 4b: materials, textures, lights -> colour of what the rays of slices meet
#include "bake/job.h"
#include "bake/light.h"
#include "bake/slice.h"
#include "bake/surface.h"

namespace texel {

// Colours of crossings and of voxels that no ray met, linear, lit where the recipe has lights; `rays` (null: none) cast their shadows. Keeps references to `job`, `surface` and `rays`.
// Cost of a call: a texture look-up; with lights and `rays` a ray a light.
[[nodiscard]] SliceShader make_shader(const Job& job, const Surface& surface, const RayScene* rays);

}  // namespace texel
