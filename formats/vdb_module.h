#pragma once
// The table of functions texel_vdb.so exports: everything that touches OpenVDB. Reached through module_symbol("texel_vdb", kVdbSymbol).
// Exceptions stay inside the module: every function returns an empty string, or one line saying what went wrong.
#include <functional>
#include <string>
#include <vector>

#include "formats/grid_field.h"
#include "formats/pack.h"
#include "formats/write.h"

namespace texel {

struct VdbWriteJob {
  std::string path;               // created or overwritten
  const Level* level = nullptr;
  int number = 0;                 // 0: finest
  std::vector<bool> half;         // per channel, layers in order: 16-bit floats on disk
  VolumeCodec codec = VolumeCodec::kBlosc;
  std::function<bool()> go_on;    // asked every few milliseconds, by one thread at a time; false ends the writing. May be empty
};

// One grid as the file has it.
struct VdbGrid {
  Layer layer;                    // with exactly one channel; full_float tells how it is stored
  std::string grid_class;         // "fog volume"
  std::string vector_type;        // "invariant", "covariant normalize"; empty for scalar grids
  bool linear = false;            // the transform is a uniform scale and a translation
  double h = 0;                   // voxel edge; when linear
  V3d origin{0, 0, 0};            // world position of the lowest corner of voxel (0,0,0); when linear
};

// A grid as a function to bake: its samples, tiles and all, over the box of its active voxels and one more around.
struct VdbVolume {
  SampleGrid grid;
  std::string name;
  bool level_set = false;         // signed distance, negative inside; else a density
  bool unsupported = false;       // why it was refused: a kind of grid that is not read
  std::int64_t others = 0;        // further grids in the file
  std::int64_t bad = 0;           // samples that are not finite: the background stands for them
};

inline constexpr int kVdbModuleVersion = 4;
inline constexpr const char* kVdbSymbol = "texel_vdb_functions";

struct VdbFunctions {
  int version;                    // kVdbModuleVersion
  // Writes one level. The file's 36 UUID characters at kVdbUuidOffset are random: the caller replaces them.
  // The answer is what went wrong, or empty. `disk_full` is set when the cause is a full disk or quota.
  std::string (*write)(const VdbWriteJob& job, bool* disk_full);
  // Reads every grid, in the file's order. Tiles other than 8³ are refused: no writer of ours makes them.
  std::string (*read)(const std::string& path, std::vector<VdbGrid>* grids);
  // The first grid of floats or doubles. Points, vectors and whole numbers are refused, and maps that are not linear.
  std::string (*read_volume)(const std::string& path, VdbVolume* volume);
};

inline constexpr int kVdbUuidOffset = 21, kVdbUuidLength = 36;

// The module's table, loaded on first use. Throws as module_symbol.
[[nodiscard]] const VdbFunctions& vdb_functions();

}  // namespace texel
