#pragma once
// Stage 9: surface, visibility, colour of a level -> the pack's grids
#include "bake/color.h"
#include "bake/ndf.h"
#include "bake/recipe.h"
#include "bake/surface.h"
#include "bake/visibility.h"
#include "formats/pack.h"

namespace texel {

// Which optional grids the scene has something to say in.
struct MaterialKinds { bool ks = false, roughness = false, transparency = false, emission = false, cutouts = false; };

// The grids of one level as docs/pack-format.md defines them; only those the recipe wants. Values are rounded to float here and nowhere else.
[[nodiscard]] Level make_level(const Surface& surface, const Visibility& seen, const ColorField& color, const Grid& grid, int level,
                               const Recipe& recipe, const MaterialKinds& kinds);

}  // namespace texel
