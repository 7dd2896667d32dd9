#pragma once
// A pack's folder -> how it was baked and from what, for view --truth, compare and bench
#include "cli/options.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// What the pack's recipe says; a pack may also come from elsewhere and have none that can be read.
[[nodiscard]] Recipe recorded_recipe(const std::string& pack);

// What the pack named first in settings.inputs was made from: its recipe's options, and the meshes named after it or else its own.
[[nodiscard]] Settings sources_of(const Settings& settings);

// The scene of a pack's sources as read; a warning where a file is not the one that was baked. Throws as input_scene; Error{kBadInput} where there are none.
[[nodiscard]] Scene source_scene(const Settings& settings, const std::vector<SourceFile>& baked_from, Report& report);

// Height fields and functions made triangles, as a picture of the truth takes them.
[[nodiscard]] Scene meshed(Scene scene, const Recipe& recipe, Report& report);

}  // namespace texel
