// texel compare: pack against pack, or against the geometry it was baked from.
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "bake/compare_views.h"
#include "cli/commands.h"
#include "cli/input_scene.h"
#include "cli/interrupt.h"
#include "cli/pack_sources.h"
#include "cli/print.h"
#include "formats/error.h"
#include "formats/read_pack.h"

namespace texel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// A folder is a pack, or reading it says why not.
bool is_pack(const std::string& path) {
  std::error_code ec;
  return fs::is_directory(path, ec);
}

struct Result {
  std::string against;
  Comparison comparison;
};

void append(Comparison& to, Comparison&& more) {
  to.measures.insert(to.measures.end(), more.measures.begin(), more.measures.end());
  to.skipped.insert(to.skipped.end(), more.skipped.begin(), more.skipped.end());
}

Comparison against_geometry(const Settings& settings, const Pack& pack, const CompareOptions& options, Report& report) {
  const std::string& name = settings.inputs.front();
  const Recipe recorded = recorded_recipe(name);
  Recipe baked = recorded;
  baked.cyclic = pack.cyclic;
  const Scene scene = source_scene(settings, pack.sources, report);
  Comparison all = compare_truth(pack, scene, baked, options, report);
  if (!settings.view.truth) return all;
  CompareViewsOptions views{.views = settings.compare.views, .doublings = settings.compare.doublings, .up = up_axis(recorded.up, pack.sources), .seed = options.seed, .view = {}};
  const bool size_given = settings.view.width != ViewSettings{}.width || settings.view.height != ViewSettings{}.height;
  views.view.width = size_given ? settings.view.width : 256;
  views.view.height = size_given ? settings.view.height : 256;
  views.view.lights = settings.recipe.lights;
  views.view.shadows = !settings.view.no_shadows;
  views.view.two_sided = recorded.two_sided;
  views.view.cyclic = pack.cyclic;
  views.view.grid = pack.grid;
  append(all, compare_views(pack, meshed(scene, recorded, report), views, report));
  return all;
}

Result compare(const Settings& settings, Report& report) {
  const std::vector<std::string>& inputs = settings.inputs;
  if (inputs.empty()) throw Error(Code::kCommandLine, "PACK", "missing", "name a pack, and what to hold it against");
  const std::string& first = inputs.front();
  if (!is_pack(first)) {
    std::error_code ec;
    if (!fs::exists(first, ec)) throw Error(Code::kFile, first, "is not there");
    throw Error(Code::kCommandLine, first, "is no pack", "name the pack first, then what to hold it against");
  }
  CompareOptions options{.level = settings.view.level, .voxels = settings.compare.voxels, .columns = settings.compare.columns, .seed = static_cast<std::uint32_t>(settings.compare.seed)};
  const Pack a = read_pack(first);
  options.ndf_a = recorded_recipe(first).ndf;
  if (options.level >= 0 && options.level >= static_cast<int>(a.levels.size()) && !a.levels.empty())
    throw Error(Code::kCommandLine, "--level", std::to_string(options.level) + " asked for, the pack has " + std::to_string(a.levels.size()));
  if (inputs.size() > 1 && is_pack(inputs[1])) {
    if (inputs.size() > 2) throw Error(Code::kCommandLine, inputs[2], "one argument too many", "compare two packs");
    if (settings.view.truth) throw Error(Code::kCommandLine, "--truth", "needs geometry, and " + inputs[1] + " is a pack", "leave it out, or name one pack alone");
    options.ndf_b = recorded_recipe(inputs[1]).ndf;
    return {inputs[1], compare_packs(a, read_pack(inputs[1]), options, report)};
  }
  std::string against;
  for (std::size_t i = 1; i < inputs.size(); ++i) against += (i > 1 ? ", " : "") + inputs[i];
  return {against.empty() ? "its source" : against, against_geometry(settings, a, options, report)};
}

struct Verdict {
  std::string measure;
  double allowed = 0, found = 0;
  bool good = true;
};

std::vector<Verdict> judge(const Settings& settings, const std::vector<Measure>& measures) {
  std::vector<Verdict> verdicts;
  for (const auto& [name, allowed] : settings.compare.allowed) {
    Verdict v{name, allowed, 0, true};
    bool any = false;
    for (const Measure& m : measures) {
      if (m.name != name) continue;
      const bool beyond = exceeds(m, allowed);
      const MeasureKind* kind = find_measure(name);
      const bool worse = !any || std::isnan(m.value) || (kind->more_is_better ? m.value < v.found : std::abs(m.value) > std::abs(v.found));
      if (worse) v.found = m.value;
      v.good = v.good && !beyond;
      any = true;
    }
    if (!any && !settings.view.truth && (name.starts_with("image_") || name.starts_with("silhouette_") || name.starts_with("recede_")))
      throw Error(Code::kCommandLine, "--allow " + name, "is of pictures", "give --truth as well");
    if (!any) throw Error(Code::kBadInput, "--allow " + name, "the measure was not taken: the packs have nothing of it", "see what was skipped without --allow");
    verdicts.push_back(v);
  }
  return verdicts;
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

std::string as_json(const Settings& settings, const Result& result, const std::vector<Verdict>& verdicts) {
  Json j{{"pack", settings.inputs.front()}, {"against", result.against}, {"measures", Json::array()}, {"skipped", Json::array()}, {"allowed", Json::array()}};
  for (const Measure& m : result.comparison.measures) {
    Json row{{"name", m.name}};
    if (m.level >= 0) row["level"] = m.level;
    if (m.axis >= 0) row["axis"] = std::string(1, "xyz"[m.axis]);
    if (m.view >= 0) row["view"] = m.view;
    row["value"] = number(m.value);
    row["low"] = number(m.low);
    row["high"] = number(m.high);
    row["count"] = m.count;
    if (m.of < (std::int64_t{1} << 60)) row["of"] = m.of;
    const MeasureKind* kind = find_measure(m.name);
    row["unit"] = kind ? kind->unit : "";
    row["norm"] = kind ? kind->norm : "";
    j["measures"].push_back(row);
  }
  for (const Skip& s : result.comparison.skipped) j["skipped"].push_back({{"what", s.what}, {"why", s.why}});
  for (const Verdict& v : verdicts) j["allowed"].push_back({{"measure", v.measure}, {"allowed", v.allowed}, {"found", number(v.found)}, {"good", v.good}});
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string short_number(double value) {
  char text[32];
  if (value == std::round(value) && std::abs(value) < 1e6) std::snprintf(text, sizeof text, "%.0f", value == 0 ? 0.0 : value);
  else std::snprintf(text, sizeof text, std::abs(value) >= 1e-3 && std::abs(value) < 1e5 ? "%.4g" : "%.2e", value);
  return text;
}

std::string row_name(const Measure& m) { return m.name + (m.axis >= 0 ? std::string(" ") + "xyz"[m.axis] : ""); }

std::string aligned(const std::vector<std::vector<std::string>>& table) {
  std::vector<std::size_t> width;
  for (const auto& row : table)
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i == width.size()) width.push_back(0);
      width[i] = std::max(width[i], row[i].size());
    }
  std::string text;
  for (const auto& row : table) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string pad(width[i] - row[i].size(), ' ');
      line += i == 0 ? row[i] + pad : "  " + pad + row[i];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

// Measures by rows, levels by columns; then pictures, views by columns would be too many: their mean.
std::string as_table(const Result& result) {
  std::vector<std::vector<std::string>> table{{"measure"}};
  std::map<std::string, std::size_t> row_of;
  int levels = 0;
  for (const Measure& m : result.comparison.measures) levels = std::max(levels, m.level + 1);
  for (int l = 0; l < levels; ++l) table[0].push_back("level " + std::to_string(l));
  for (const Measure& m : result.comparison.measures) {
    if (m.level < 0) continue;
    const auto [at, fresh] = row_of.try_emplace(row_name(m), table.size());
    if (fresh) table.push_back({row_name(m)});
    std::vector<std::string>& row = table[at->second];
    row.resize(std::max(row.size(), static_cast<std::size_t>(m.level) + 2), "-");
    row[static_cast<std::size_t>(m.level) + 1] = short_number(m.value);
  }
  std::string text = levels > 0 ? aligned(table) : "";
  std::vector<std::vector<std::string>> pictures;
  for (const Measure& m : result.comparison.measures) {
    if (m.level >= 0) continue;
    const bool recede = m.name.starts_with("recede");
    if (m.view >= 0 && !recede) continue;
    pictures.push_back({row_name(m) + (recede ? " x" + std::to_string(1 << m.view) : ""), short_number(m.value)});
  }
  return text + (text.empty() || pictures.empty() ? "" : "\n") + aligned(pictures);
}

std::string as_list(const Result& result) {
  std::vector<std::vector<std::string>> table{{"measure", "level", "view", "value", "95 % from", "to", "of"}};
  for (const Measure& m : result.comparison.measures)
    table.push_back({row_name(m), m.level >= 0 ? std::to_string(m.level) : "-", m.view >= 0 ? std::to_string(m.view) : "-", short_number(m.value), short_number(m.low), short_number(m.high),
                     std::to_string(m.count) + (m.of < (std::int64_t{1} << 60) ? "/" + std::to_string(m.of) : "")});
  std::string text = aligned(table) + "\n";
  std::vector<std::vector<std::string>> norms;
  for (const MeasureKind& kind : measure_kinds())
    if (std::any_of(result.comparison.measures.begin(), result.comparison.measures.end(), [&](const Measure& m) { return m.name == kind.name; }))
      norms.push_back({kind.name, kind.unit});
  for (auto& n : norms) text += n[0] + " [" + n[1] + "]: " + find_measure(n[0])->norm + "\n";
  return text;
}

}  // namespace

int command_compare(const Settings& settings) {
  std::optional<tbb::global_control> limit;
  if (settings.recipe.threads > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(settings.recipe.threads));
  Report report;
  ProgressBar bar(settings.progress);
  report.progress = [&bar](const std::string& stage, double done) {
    stop_if_interrupted();
    bar.update(stage, done);
  };
  const Result result = compare(settings, report);
  stop_if_interrupted();
  bar.clear();
  print_warnings(report.issues);
  const std::vector<Verdict> verdicts = judge(settings, result.comparison.measures);
  std::string text;
  if (settings.json) {
    text = as_json(settings, result, verdicts);
  } else {
    text = settings.inputs.front() + " against " + result.against + "\n\n" + (settings.verbose ? as_list(result) : as_table(result));
    for (const Skip& s : result.comparison.skipped) text += "skipped: " + s.what + ": " + s.why + "\n";
    for (const Verdict& v : verdicts) text += v.measure + ": " + short_number(v.found) + (v.good ? " is within " : " is beyond ") + short_number(v.allowed) + "\n";
  }
  print_product(text);
  const bool good = std::all_of(verdicts.begin(), verdicts.end(), [](const Verdict& v) { return v.good; });
  return static_cast<int>(good ? Code::kOk : Code::kDifference);
}

}  // namespace texel
