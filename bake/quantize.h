#pragma once
// Stage 9: surface, visibility of a level, slab by slab -> the pack's grids
#include "bake/color.h"
#include "bake/ndf.h"
#include "bake/recipe.h"
#include "bake/surface.h"
#include "bake/visibility.h"
#include "formats/pack.h"

namespace texel {

// Which optional grids the scene has something to say in.
struct MaterialKinds { bool ks = false, roughness = false, transparency = false, emission = false, cutouts = false; };

// What a slab gives to a level: its grids, but for colour, which runs from slab to slab.
struct LevelPart {
  Layer matter, surface;
  BorderColors colors;             // where colour is wanted
  VoxelSet uncolored;              // matter without a colour of its own: inside, or its surface all cut away
  std::vector<V3i> inside_blocks;
};

// The grids as docs/pack-format.md defines them; only those the recipe wants. Values are rounded to float here and nowhere else.
[[nodiscard]] LevelPart make_part(const Surface& surface, const Visibility& seen, const Grid& grid, int level, const Recipe& recipe, const MaterialKinds& kinds);

// Parts, lowest first, to one level; they are taken apart on the way.
[[nodiscard]] Level join_parts(std::vector<LevelPart>& parts, const Grid& grid, const Recipe& recipe);

}  // namespace texel
