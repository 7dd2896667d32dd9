#pragma once
// The one table of options: the parser, --help, recipe files, the recipe in a pack's manifest and docs/cli.md all come from it.
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bake/recipe.h"
#include "bake/view.h"

namespace texel {

enum class Progress { kAuto, kAlways, kNever };

// What `texel view` is asked for beyond the lights, which it shares with the recipe.
struct ViewSettings {
  std::string mode;                    // "volume", "slices", "truth", "zoom"; empty: volume for a pack, truth for a mesh
  bool truth = false;
  double azimuth = -60, elevation = 20, fov = 30;  // degrees
  int width = 512, height = 512;
  int samples = 4;
  int level = -1, axis = -1;
  bool no_shadows = false;
  V3f background{-1, -1, -1};          // linear RGB; negative: none, the picture keeps its alpha
  double distance = 1;                 // times that from which all just fits into the picture
  std::string over, tips;              // "plane", "sphere" or a mesh to repeat the pack over, and the mesh of its height vectors' ends; empty: none
  int repeat_u = 0, repeat_v = 0;      // texels along u and v; 0: as suits `over`
  double texel_height = 0;             // world; 0: the box's own, or in proportion
  V3f ground{-1, -1, -1};              // linear RGB of the surface itself; negative: it is not there
};

// What `texel compare` is asked for beyond the camera's settings.
struct CompareSettings {
  std::vector<std::pair<std::string, double>> allowed;  // measure, most (or least) that is good
  int voxels = 1000, columns = 1000;
  int views = 8, doublings = 6;
  int seed = 0;
};

// What `texel bench` sweeps.
struct BenchSettings {
  std::vector<int> resolutions{32, 64, 128};
  std::vector<int> samples{1, 2, 3, 4, 6, 8, 12, 16};
  std::vector<int> rays{1, 4, 16, 64, 256, 1024, 4096};
  std::vector<double> errors{0.005, 0.01, 0.02};
  int voxels = 500, repeats = 3;
  double time_limit = 30;
};

// Everything a command line or a recipe file can say.
struct Settings {
  std::vector<std::string> inputs;
  std::string output, recipe_file, depfile, report_file;
  std::vector<std::string> words;      // the command line these were read from
  bool force = false, plan = false, verbose = false, json = false, help = false;
  int jobs = 0;                        // of a batch: items at once; 0: as many as threads, at most 4
  Progress progress = Progress::kAuto;
  Recipe recipe;
  ViewSettings view;
  CompareSettings compare;
  BenchSettings bench;
};

// The commands, as bits, so that a row can belong to several.
enum Command : unsigned { kBake = 1, kInfo = 2, kCheck = 4, kView = 8, kBatch = 16, kCompare = 32, kBench = 64 };

struct OptionRow {
  const char* name = "";               // long name without dashes; with '_' for '-' it is the recipe's key
  char letter = 0;                     // short name, or 0
  const char* metavar = "";            // empty: a switch
  const char* group = "";
  unsigned commands = 0;               // Command bits
  const char* help = "";               // one line, without default and range
  bool in_recipe = false;              // it influences the pack's bytes
  bool repeatable = false;
  bool list = false;                   // always an array in JSON
  bool literal = false;                // always one string in JSON, whatever is in it
  bool unsaid = false;                 // at its default it is left out of a pack's recipe, so that packs without it stay what they were before there was the option
  const char* shown_default = nullptr; // where get() of the default would not read well
  std::string accepts{};               // range or list of values, as shown in help and errors
  // Takes one value as text; false: not acceptable. For a switch "true" or "false".
  std::function<bool(Settings&, const std::string&)> set{};
  // The value as `set` would take it; empty: none. Of a repeatable option: the values, separated by blanks.
  std::function<std::string(const Settings&)> get{};

  [[nodiscard]] bool is_switch() const { return metavar[0] == 0; }
  [[nodiscard]] std::string key() const;
  [[nodiscard]] std::string flag() const { return std::string("--") + name; }
};

// All rows, in the order of help and documentation.
[[nodiscard]] std::vector<OptionRow> option_table();
// Those of option_table.cpp; over_options.cpp puts the others between them.
[[nodiscard]] std::vector<OptionRow> option_rows();

// Reads `arguments` (without program and command) over `settings`. `given` receives the names of the options that were there.
// With --help among them nothing else is checked. A recipe file named there is read first (recipe_file.h), so that the command
// line beats it. Throws Error{kCommandLine}; naming both where two options clash.
// `beneath` fills in what the recipe file and the command line both beat.
[[nodiscard]] Settings parse_options(Command command, const std::vector<std::string>& arguments, std::set<std::string>* given = nullptr,
                                     const std::function<void(Settings&)>& beneath = {});

// The number's shortest text that reads back as the same double.
[[nodiscard]] std::string number_text(double value);
// All of `text` as a finite number; false where it is none.
[[nodiscard]] bool read_number(const std::string& text, double* value);
[[nodiscard]] std::vector<std::string> split(const std::string& text, char at);

}  // namespace texel
