#pragma once
// manifest.json as a struct, and the names of a pack's files. Internal to formats/.
#include <optional>
#include <string>
#include <vector>

#include "formats/pack.h"
#include "formats/write.h"

namespace texel {

inline constexpr int kPackVersion = 1;  // of the folder layout and the manifest's keys

struct FileRecord {
  std::string file;               // relative to the pack, '/' between the parts
  std::string sha256;
  std::int64_t bytes = 0;
};

struct GridRecord {
  std::string name;
  int components = 1;
  bool half = true;
  std::int64_t active = 0;        // voxels, tiles counted as 512
};

struct LevelRecord {
  FileRecord file;
  Grid grid;
  std::int64_t active = 0;        // voxels active in at least one grid
  std::vector<GridRecord> grids;
};

struct StackRecord {
  int axis = 2, level = 0;
  int count = 0, width = 0, height = 0;
  double thickness = 0, max_angle = 0;
  SliceFormat format = SliceFormat::kPng;
  std::string sha256;             // of all files' bytes, in order
  std::int64_t bytes = 0;         // of all files
};

struct Manifest {
  std::string generator;
  std::vector<SourceFile> sources;  // path as it stands in the file
  std::string recipe_json;
  double prune = 0, quantize = 0;   // of the recipe: how far values may be off
  Grid grid;
  std::array<bool, 3> cyclic{false, false, false};
  std::vector<LevelRecord> levels;
  std::vector<StackRecord> slices;  // by axis, then level
  std::optional<FileRecord> preview;
  Statistics statistics;
  std::optional<SolidCube> cube;
  std::vector<ErrorFigure> errors;
  std::vector<Issue> issues;
  std::vector<Skip> skipped;
};

[[nodiscard]] std::string generator();                                                   // "texel X.Y.Z"
[[nodiscard]] std::string level_file(int level);                                         // "volume_level_1.vdb"
[[nodiscard]] std::string slice_pattern(int axis, int level, SliceFormat format);        // "slices/level_1/z/%04d.png"
[[nodiscard]] std::string slice_file(int axis, int level, SliceFormat format, int k);    // "slices/level_1/z/0017.png"
[[nodiscard]] const char* slice_format_name(SliceFormat format);                         // "png"

// The JSON text. Numbers read back as the same double.
// Throws Error{kRunning} when recipe_json is not a JSON object.
[[nodiscard]] std::string manifest_text(const Manifest& manifest);

// Every key, type and range checked: counts are such that they can be allocated, file names are the ones above, nothing points out of the
// pack. `where` names the file in errors. Throws Error{kBadInput}.
[[nodiscard]] Manifest parse_manifest(const std::string& text, const std::string& where);

}  // namespace texel
