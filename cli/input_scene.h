#pragma once
// Settings -> Scene: what the input files hold, and what options make of it.
#include "cli/options.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// Throws as read_scene; Error{kCommandLine} for options that need others, Error{kUnsupported} for a hypertexture of a mesh.
[[nodiscard]] Scene input_scene(const Settings& settings, Report& report);

// Whether the settings make a scene by themselves, without input files.
[[nodiscard]] bool makes_scene(const Settings& settings);

}  // namespace texel
