#pragma once
// Ground truth of a density: rays marched through it.
#include "bake/view.h"

namespace texel {

// Straight linear RGBA of scene.hypertexture. Along each ray D is taken at steps of 1/320 of the density's longest side, linear between
// them, so that alpha is exact where D is; empty cells of a 64³ grid, proven so by the field's range, are passed over. Local light by the
// gradient's direction, where there is one; shadows from a 96³ grid of optical depths, softer than the truth by a cell of it.
// An eighth of options.samples rays a pixel, at least one: the density is smooth already. Throws as view_truth.
[[nodiscard]] Image view_density(const Scene& scene, const ViewOptions& options, Report& report);

}  // namespace texel
