#pragma once
// What the runs of a bench found -> table, JSON and plots
#include <map>
#include <string>
#include <vector>

#include "bake/compare.h"
#include "cli/bench_plot.h"
#include "cli/bench_run.h"

namespace texel {

struct BenchRun {
  BenchTask task;
  BenchTimes times;
  std::map<std::string, Measure> errors;
  bool is_default = false;
};

struct BenchSkip { std::string what, why; };

// How much sooner the bundle has an axis alpha of rms 1/256 than random rays; where no bundle gets there, of the default's own rms.
struct BenchRace {
  bool known = false;
  double target = 0;
  double bundle = 0, random = 0;     // CPU seconds
  std::string bundle_how, random_how;
};

struct BenchFindings {
  std::string scene;                 // the inputs' names
  std::vector<BenchRun> runs;
  std::vector<BenchSkip> skipped;
  std::map<int, double> truth_noise; // rms of alpha's truth at level 0, by resolution
};

inline constexpr double kAlphaTarget = 1.0 / 256;
inline constexpr double kFrontSlack = 0.1;  // times of two runs alike differ by so much

[[nodiscard]] BenchRace race(const BenchFindings& findings, int resolution);
// Slope of the error's logarithm over that of the rays a voxel and axis, or, of "pack", of seconds, bytes or peak over the resolution.
[[nodiscard]] double error_slope(const BenchFindings& findings, const std::string& family, int resolution, const std::string& error);
[[nodiscard]] double growth(const BenchFindings& findings, double BenchTimes::* what);

// One plot of error against CPU seconds.
struct BenchPlot {
  std::string file, error;
  Plot plot;
  bool has_default = false, default_on_front = false;
};
[[nodiscard]] std::vector<BenchPlot> bench_plots(const BenchFindings& findings);
[[nodiscard]] Plot growth_plot(const BenchFindings& findings);

[[nodiscard]] std::string bench_table(const BenchFindings& findings);
[[nodiscard]] std::string bench_json(const BenchFindings& findings, const std::string& command);

}  // namespace texel
