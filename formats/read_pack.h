#pragma once
// Folder -> Pack, for view, info, check and compare.
#include <string>
#include <vector>

#include "formats/pack.h"

namespace texel {

// The pack as written: levels' grids read from the .vdb files (tiles stay tiles), slices decoded when asked for.
// Throws Error{kFile} (missing or unreadable file), Error{kBadInput} (not a pack, a manifest of another version, damaged grid).
[[nodiscard]] Pack read_pack(const std::string& folder);

// The manifest's text, for `info --json`. Throws Error{kFile}, Error{kBadInput} (not JSON, not a pack).
[[nodiscard]] std::string read_manifest(const std::string& folder);

// What a reader would trip over: missing or extra files, hashes and sizes that differ from the manifest, grids with wrong transform, class or
// counts, values out of their ranges, parent area ≠ sum of children, non-finite numbers. Empty: the pack is whole.
struct CheckFinding { std::string id, file, text; };
[[nodiscard]] std::vector<CheckFinding> check_pack(const std::string& folder);

}  // namespace texel
