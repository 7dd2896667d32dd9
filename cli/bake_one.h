#pragma once
// Settings -> one pack: what `texel bake` does once, and `texel batch` for each item
#include <optional>
#include <string>
#include <vector>

#include "cli/options.h"
#include "formats/pack.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

struct Outcome {
  std::string status = "failed";       // "baked", "up to date", "planned"
  std::string closing;                 // the line that ends the talk
  std::vector<SourceFile> sources;     // every file read
  std::optional<Pack> pack;            // where one was baked
};

// Reads, bakes and writes, unless the pack is up to date or only a plan is asked for. Calls report.progress, which may throw to stop.
// Throws as input_scene, bake and write_pack; the old pack, or none, is then still there.
void bake_pack(const Settings& settings, Report& report, Outcome& outcome);

// Stages hand their memory on to each other instead of to the system and back, which costs a page fault each 4 KiB: a third of
// them, and a twentieth of the time of a small bake. `one_arena`: of one bake; several at once would wait for each other.
void keep_freed_memory(bool one_arena);

[[nodiscard]] double now_seconds();

}  // namespace texel
