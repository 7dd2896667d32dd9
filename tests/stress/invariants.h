#pragma once
// All that must hold of a pack, whatever the input. Test code only.
#include <string>
#include <vector>

#include "tests/stress/stress.h"

namespace texel::stress {

// What is wrong with the bake of a case; empty: nothing. Each entry names grid, level, voxel, figure and bound. At most a dozen.
// Σ area against the input, level by level; S positive semidefinite, its largest eigenvalue 1; alpha within [0, 1] and, without matter, not above the
// crossings; parents against their children's sums; slices against the volume; inside flags and volume against the case's solid; no value that is not
// finite.
[[nodiscard]] std::vector<std::string> faults_of(const Case& made, const Pack& pack, Tally& tally);

// The pack written, read again by the program's own reader and looked through by `texel check`.
[[nodiscard]] std::vector<std::string> faults_of_files(const Pack& pack, const Recipe& recipe, const std::string& folder);

}  // namespace texel::stress
