#pragma once
// What read_pack and check_pack share. Internal to formats/.
#include <filesystem>
#include <string>

#include "formats/manifest.h"

namespace texel {

// Whether every active voxel of the layer lies in [0, n), and every tile begins there.
[[nodiscard]] bool inside_grid(const Layer& layer, const V3i& n);

// The first file of the manifest that is missing or not of the size stated; empty: none. Slices are stated by the sum of a stack.
[[nodiscard]] std::string missing_file(const Manifest& manifest, const std::filesystem::path& folder);

}  // namespace texel
