#pragma once
// One run of `texel bench`: a process of its own, because the peak of memory is a process's
#include <map>
#include <string>
#include <vector>

#include "cli/options.h"

namespace texel {

// What is run. Families: "grid", "lattice" (bundles of value² sub-rays), "filtered" (the grid, coarser levels from the finest), "random" (value rays a voxel and
// axis), "exact" (clipping alone), "sggx", "neyret", "ratib", each also with " visible", "ratib bins" and "ratib squares" (of value random rays), "pack" (all there is), "asked" (rays chosen for `error`).
struct BenchTask {
  std::string family;
  int value = 0;
  int resolution = 64;
  double error = 0;            // rms, of alpha; above 0: instead of value

  [[nodiscard]] double number() const { return error > 0 ? error : value; }
  [[nodiscard]] std::string text() const { return error > 0 ? number_text(error) : std::to_string(value); }
};

struct BenchTimes {
  double cpu = 0, wall = 0;    // seconds, of the repetition with least CPU time: from the scene in memory to values in memory
  double cpu_median = 0;
  double peak = 0;             // bytes the process held at most, scene and program included
  double bytes = 0;            // of the pack on disk
  std::string failure;         // empty: it went well
};

// Runs the task as another process of this program with the words of this command line, its pack (full floats) left in `folder`. What the process
// says on stderr is dropped unless it fails. Throws Error{kRunning} when interrupted, and where no process can be made.
[[nodiscard]] BenchTimes run_bench_task(const BenchTask& task, const Settings& settings, const std::string& folder);

// The recipe every run of this bench begins with.
[[nodiscard]] Recipe bench_recipe(const Settings& settings, int resolution);

}  // namespace texel
