#pragma once
// Scene -> Pack: the pipeline on one page (bake.cpp).
#include "bake/recipe.h"
#include "formats/pack.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// The pack of `scene`. Preview and sources' hashes are not filled here (view.h, write.h). The slices' image functions keep what they
// need alive by themselves; `scene` may be destroyed.
// Throws Error{kBadInput} (nothing to bake: no area inside the box), Error{kCommandLine} (a recipe that cannot be, e.g. a box of no
// extent), Error{kUnsupported}, Error{kRunning} (interrupted, memory). The result does not depend on recipe.threads.
// Cost: see docs/performance.md.
[[nodiscard]] Pack bake(const Scene& scene, const Recipe& recipe, Report& report);

// The grid that bake would use. Throws as bake.
[[nodiscard]] Grid plan_grid(const Scene& scene, const Recipe& recipe);

}  // namespace texel
