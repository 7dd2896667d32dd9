#pragma once
// Scene files among the inputs -> the recipes they bring along
#include <vector>

#include "cli/options.h"
#include "formats/read_scene_file.h"

namespace texel {

// Fills in a texel's recipes, as parse_options takes it. `file`: the scene, beside which pictures are looked for.
[[nodiscard]] std::function<void(Settings&)> beneath_all(const std::vector<SceneTexel::Recipe>& recipes, const std::string& file);

// The settings of a `bake` or `view` with the recipes of its scene files beneath the recipe file and the command line. Throws as list_texels, choose_texel and
// parse_options; Error{kCommandLine} where a texel is asked for and no input is a scene, or a glTF
// file's scene and no input may be one.
[[nodiscard]] Settings with_scene_recipes(Command command, Settings settings);

}  // namespace texel
