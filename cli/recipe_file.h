#pragma once
// Recipe files: the options of a bake as JSON, read with --recipe and stored in every pack's manifest.
#include <string>

#include "cli/options.h"

namespace texel {

// Applies `path` over `settings`: a recipe (an object of option keys), a pack's manifest, or a pack's folder. From a pack the
// object `recipe` is taken and, where `settings` has no inputs, its source meshes too. null leaves an option as it is.
// Throws Error{kFile} (cannot be read) and Error{kCommandLine} (not JSON, unknown key, bad value: names key, value, accepted range).
void read_recipe_file(const std::string& path, Settings& settings);

// The same with a recipe that stands in another file: `json` is an object, `where` names it in messages, pictures lie beside `file`.
void apply_recipe_text(const std::string& json, const std::string& where, const std::string& file, Settings& settings);

// The meshes a pack was made from, as its manifest names them, in their order. Throws Error{kFile} where one is not there.
[[nodiscard]] std::vector<std::string> manifest_meshes(const std::string& manifest_path);

// The recipe as resolved, canonical: one JSON object, keys in the table's order, every option that influences the pack's bytes and no other.
[[nodiscard]] std::string recipe_json(const Settings& settings);

}  // namespace texel
