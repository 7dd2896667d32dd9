#pragma once
// Scene, Recipe -> what all stages of one bake share: stages 0 and 1 together
#include <memory>

#include "bake/plan.h"
#include "bake/quantize.h"
#include "bake/recipe.h"
#include "bake/texture.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

inline constexpr double kOpenThickness = 2;  // voxels: what measure_thickness says of matter that is not solid

struct Job {
  Recipe recipe;                    // as given, with samples chosen where it leaves them open
  // The scene as it is baked: functions and height fields made triangles, copies added where it repeats. Each owned one is made from the one before.
  const Scene* given = nullptr;     // the caller's
  std::unique_ptr<const Scene> flat, made, repeated;
  std::unique_ptr<const TextureSet> textures;
  MaterialKinds kinds;
  Plan plan;                        // of a density: its grid alone
  int levels = 1;                   // of the volume
  bool opacity = false, colors = false;

  [[nodiscard]] const Scene& source() const { return made ? *made : flat ? *flat : *given; }  // of one copy
  [[nodiscard]] const Scene& scene() const { return repeated ? *repeated : source(); }
  [[nodiscard]] bool density() const { return given->hypertexture.has_value(); }
  [[nodiscard]] bool cyclic() const { return recipe.cyclic[0] || recipe.cyclic[1] || recipe.cyclic[2]; }
};

// `scene` must outlive the job. Throws as bake. Cost: that of the triangles that have to be made, and of make_plan.
[[nodiscard]] Job prepare(const Scene& scene, const Recipe& recipe, Report& report);

// How often `counts` voxels or pixels can be halved where they repeat: none may hold the end of one period and the beginning of the next. 31 where nothing repeats.
[[nodiscard]] int periods_halve(const V3i& counts, const Recipe& recipe);

// Slices along an axis when the eye may look see_in of the width (world units) across it into the object.
[[nodiscard]] int slice_count(const Recipe& recipe, const Grid& grid, double width, int axis);

}  // namespace texel
