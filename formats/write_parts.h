#pragma once
// The parts write_pack is made of. Internal to formats/.
#include <filesystem>
#include <vector>

#include "formats/manifest.h"

namespace texel {

// Writes every slice of every stack below `folder`, in parallel; each worker holds one slice. Stacks come back sorted by axis and level.
// `pixels` receives what there is to see in PNG slices, and how much of it was too bright for them; zeros for EXR.
// Throws Error{kFile}, Error{kRunning} (a stack whose pictures are not of the size it states).
[[nodiscard]] std::vector<StackRecord> write_slices(const std::vector<SliceStack>& stacks, const std::filesystem::path& folder, SliceFormat format,
                                                    const Report& report, PixelCount* pixels);

// Fills in the hash and the bytes of the stack's files; `report`, when not null, hears of each. Throws Error{kFile}.
void sum_stack(StackRecord& record, const std::filesystem::path& folder, const Report* report = nullptr);

// Number of voxels active in at least one layer, tiles counted as 512.
[[nodiscard]] std::int64_t active_voxels(const Level& level);

// The name's, size's and hash's record of a file of the pack. Throws Error{kFile}.
[[nodiscard]] FileRecord record_file(const std::filesystem::path& folder, const std::string& name);

}  // namespace texel
