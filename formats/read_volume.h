#pragma once
// The readers of sampled functions: raw volumes and .vdb. Each gives the samples, and what their values mean.
#include <functional>
#include <optional>
#include <string>

#include "formats/grid_field.h"
#include "formats/report.h"
#include "formats/scene.h"
#include "formats/text_scanner.h"

namespace texel {

struct Volume {
  SampleGrid grid;
  double sign = 1;              // −1: level sets, negative inside
  std::optional<double> iso;    // where the surface is unless the user says otherwise; none: the format does not tell
  std::vector<std::string> further_files;
};

// All throw Error{kBadInput} (malformed: the field and the value found), Error{kUnsupported}. Bytes of any kind are safe; memory is
// bounded by what the bytes really hold. Samples that are not finite become the least one: issue `volume-non-finite`.

// POV-Ray density file: 8, 16 or 32 bits, big-endian, scaled to 0…1, in the unit cube; samples in the middle of their cells.
[[nodiscard]] Volume read_df3(const Input& input, Report& report);
// INRIMAGE-4, gzip or plain. Sample (0,0,0) is at the origin.
[[nodiscard]] Volume read_inr(const Input& input, Report& report);
// MetaImage: .mhd with its data file, or .mha. `load` gives the bytes of a further file; it is called with the name as the header has it.
using LoadBytes = std::function<std::span<const char>(const std::string& name)>;
[[nodiscard]] Volume read_mhd(const Input& input, const LoadBytes& load, Report& report);
// OpenVDB: the first grid of floats or doubles, a level set or a density. Opens the file through the module texel_vdb.
[[nodiscard]] Volume read_vdb(const std::string& path, Report& report);

// The scene of a volume: the solid where it is >= iso, or <= for level sets, whose field is the distance's negative.
// Throws Error{kCommandLine} where no iso is given and none is known, Error{kBadInput} where it parts nothing.
[[nodiscard]] Scene volume_scene(Volume volume, std::optional<double> iso, const std::string& path);

}  // namespace texel
