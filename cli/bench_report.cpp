#include "cli/bench_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "cli/print.h"

namespace texel {
namespace {

using Json = nlohmann::ordered_json;

bool is_bundle(const std::string& family) { return family == "grid" || family == "lattice" || family == "filtered"; }
constexpr int kLeastBundle = 4;  // coarser ones are right by what is known exactly, rather than by their rays
double rays_of(const BenchTask& task) { return is_bundle(task.family) ? static_cast<double>(task.value) * task.value : task.value; }

std::string family_name(const std::string& family) {
  if (family == "grid") return "bundle, grid";
  if (family == "lattice") return "bundle, lattice";
  if (family == "filtered") return "bundle, levels filtered";
  if (family == "random") return "random rays a voxel (Ratib)";
  if (family == "asked") return "error asked for";
  if (family == "exact") return "exact clipping";
  if (family == "ratib bins") return "Ratib, fullest bins";
  if (family == "ratib squares") return "Ratib, least squares";
  if (family == "pack") return "whole pack";
  std::string name = family;
  if (name.starts_with("sggx")) name.replace(0, 4, "SGGX");
  else name[0] = static_cast<char>(name[0] - 'a' + 'A');
  const std::size_t visible = name.find(" visible");
  return visible == std::string::npos ? name : name.substr(0, visible) + ", visible normals";
}

std::string shown(double v) {
  char text[32];
  if (std::isnan(v)) return "-";
  std::snprintf(text, sizeof text, std::abs(v) >= 1e-3 && std::abs(v) < 1e5 ? "%.4g" : "%.2e", v);
  return v == 0 ? "0" : text;
}

double error_of(const BenchRun& run, const std::string& name) {
  const auto at = run.errors.find(name);
  return at == run.errors.end() ? std::numeric_limits<double>::quiet_NaN() : at->second.value;
}

std::set<int> resolutions(const BenchFindings& f) {
  std::set<int> all;
  for (const BenchRun& r : f.runs) all.insert(r.task.resolution);
  return all;
}

std::string value_text(const BenchTask& task) { return task.number() > 0 ? task.text() : ""; }

}  // namespace

double error_slope(const BenchFindings& findings, const std::string& family, int resolution, const std::string& error) {
  std::vector<PlotPlace> points;
  for (const BenchRun& r : findings.runs)
    if (r.task.family == family && r.task.resolution == resolution && r.times.failure.empty() && (!is_bundle(family) || r.task.value >= kLeastBundle)) points.push_back({rays_of(r.task), error_of(r, error)});
  std::erase_if(points, [](const PlotPlace& p) { return !(p.y > 0); });
  return log_slope(points);
}

double growth(const BenchFindings& findings, double BenchTimes::* what) {
  std::vector<PlotPlace> points;
  for (const BenchRun& r : findings.runs)
    if (r.task.family == "pack" && r.times.failure.empty()) points.push_back({static_cast<double>(r.task.resolution), r.times.*what});
  return log_slope(points);
}

BenchRace race(const BenchFindings& findings, int resolution) {
  BenchRace out;
  double best = std::numeric_limits<double>::infinity();
  std::vector<PlotPlace> random;
  const auto bundles = [&](auto&& call) {
    for (const BenchRun& r : findings.runs)
      if (r.task.resolution == resolution && r.times.failure.empty() && is_bundle(r.task.family) && r.task.family != "filtered") call(r, error_of(r, "alpha_rms"));
  };
  bool reached = false;
  bundles([&](const BenchRun& r, double error) {
    reached = reached || error <= kAlphaTarget;
    if (r.is_default) out.target = error;
  });
  if (reached || !(out.target > 0)) out.target = kAlphaTarget;
  for (const BenchRun& r : findings.runs) {
    if (r.task.resolution != resolution || !r.times.failure.empty()) continue;
    const double error = error_of(r, "alpha_rms");
    if (is_bundle(r.task.family) && r.task.family != "filtered" && error <= out.target && r.times.cpu < best) {
      best = r.times.cpu;
      out.bundle_how = family_name(r.task.family) + " of " + value_text(r.task) + " x " + value_text(r.task);
    }
    if (r.task.family == "random" && error > 0) random.push_back({r.times.cpu, error});
  }
  if (!std::isfinite(best) || random.size() < 2) return out;
  out.bundle = best;
  std::sort(random.begin(), random.end(), [](const PlotPlace& a, const PlotPlace& b) { return a.x < b.x; });
  out.known = true;
  for (std::size_t i = 0; i < random.size(); ++i) {
    if (random[i].y > out.target) continue;
    if (i == 0) {
      out.random = random[0].x;
      out.random_how = "the first run";
      return out;
    }
    const double share = std::log(random[i - 1].y / out.target) / std::log(random[i - 1].y / random[i].y);
    out.random = random[i - 1].x * std::pow(random[i].x / random[i - 1].x, share);
    out.random_how = "between two runs";
    return out;
  }
  const PlotPlace& last = random.back();
  out.random = last.x * std::pow(last.y / out.target, 2);
  out.random_how = "from the last run by its slope of 1/2";
  return out;
}

std::vector<BenchPlot> bench_plots(const BenchFindings& findings) {
  struct Kind {
    const char *file, *error, *title, *y;
    std::vector<const char*> families;
    double target;
  };
  const std::vector<Kind> kinds = {
      {"opacity", "alpha_rms", "Opacity along the axes", "rms error of alpha, level 0", {"grid", "lattice", "asked", "random"}, kAlphaTarget},
      {"levels", "alpha_rms_coarser", "Opacity of the coarser levels", "rms error of alpha, levels from 1", {"grid", "filtered", "asked", "random"}, 0},
      {"shadows", "sigma_rms", "Projected areas", "rms error of \xcf\x83(\xcf\x89), mean projected areas", {"sggx", "neyret", "ratib", "ratib bins", "ratib squares"}, 0},
      {"normals", "tv_all", "Normals", "total variation from all normals", {"sggx", "neyret", "ratib", "ratib bins", "ratib squares"}, 0},
      {"visible", "tv_visible", "Visible normals", "total variation from the visible normals", {"sggx", "sggx visible", "neyret visible", "ratib visible", "ratib bins", "ratib squares"}, 0},
  };
  std::vector<BenchPlot> all;
  for (const int n : resolutions(findings))
    for (const Kind& kind : kinds) {
      BenchPlot p;
      p.file = std::string(kind.file) + "_" + std::to_string(n) + ".svg";
      p.error = kind.error;
      p.plot.title = std::string(kind.title) + ", " + findings.scene + ", " + std::to_string(n) + " voxels";
      p.plot.x_label = "CPU seconds, from the scene in memory to values in memory";
      p.plot.y_label = kind.y;
      p.plot.target = kind.target;
      p.plot.target_label = kind.target > 0 ? "1/256" : "";
      std::vector<PlotPlace> places;
      std::size_t at_default = 0;
      for (const char* family : kind.families) {
        PlotSeries series{family_name(family), {}};
        for (const BenchRun& r : findings.runs) {
          const double error = error_of(r, kind.error);
          if (r.task.family != family || r.task.resolution != n || !r.times.failure.empty() || !(error > 0)) continue;
          const bool rings = r.is_default && (std::string(kind.file) != "visible" || r.task.family == "sggx");
          if (rings) {
            p.has_default = true;
            at_default = places.size();
          }
          places.push_back({r.times.cpu, error});
          series.points.push_back({r.times.cpu, error, value_text(r.task), rings});
        }
        if (!series.points.empty()) p.plot.series.push_back(series);
      }
      if (places.empty()) continue;
      if (p.has_default) p.default_on_front = on_front(places, kFrontSlack)[at_default];
      all.push_back(p);
    }
  return all;
}

Plot growth_plot(const BenchFindings& findings) {
  Plot plot;
  plot.title = "A whole pack by resolution, " + findings.scene;
  plot.x_label = "voxels along the longest side";
  plot.y_label = "CPU seconds, 10 MiB on disk, GiB of memory at most";
  plot.front = false;
  plot.series = {{"CPU seconds", {}}, {"pack, 10 MiB", {}}, {"peak memory, GiB", {}}};
  for (const BenchRun& r : findings.runs) {
    if (r.task.family != "pack" || !r.times.failure.empty()) continue;
    const double n = r.task.resolution;
    plot.series[0].points.push_back({n, r.times.cpu, "", false});
    plot.series[1].points.push_back({n, r.times.bytes / (10 * 1048576.0), "", false});
    plot.series[2].points.push_back({n, r.times.peak / 1073741824.0, "", false});
  }
  return plot;
}

std::string bench_table(const BenchFindings& findings) {
  const std::vector<std::pair<const char*, const char*>> columns = {{"alpha_rms", "alpha rms"}, {"alpha_rms_coarser", "coarser"}, {"area_rms", "area rms"}, {"sigma_rms", "sigma rms"},
                                                                     {"axis_angle_rms", "axis deg"}, {"tv_all", "tv all"}, {"tv_visible", "tv visible"}};
  std::vector<std::vector<std::string>> table{{"method", "value", "voxels", "CPU s", "wall s", "peak MiB"}};
  for (const auto& [name, head] : columns) table[0].push_back(head);
  for (const BenchRun& r : findings.runs) {
    std::vector<std::string> row{family_name(r.task.family) + (r.is_default ? " *" : ""), value_text(r.task), std::to_string(r.task.resolution)};
    if (!r.times.failure.empty()) {
      row.push_back("failed: " + r.times.failure);
      table.push_back(row);
      continue;
    }
    row.insert(row.end(), {shown(r.times.cpu), shown(r.times.wall), shown(r.times.peak / 1048576)});
    for (const auto& [name, head] : columns) row.push_back(shown(error_of(r, name)));
    table.push_back(row);
  }
  std::vector<std::size_t> width;
  for (const auto& row : table)
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i == width.size()) width.push_back(0);
      if (!row[i].starts_with("failed")) width[i] = std::max(width[i], row[i].size());
    }
  std::string text;
  for (const auto& row : table) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string pad(width[i] > row[i].size() ? width[i] - row[i].size() : 0, ' ');
      line += i == 0 ? row[i] + pad : "  " + (row[i].starts_with("failed") ? row[i] : pad + row[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  text += "* the default\n\n";
  for (const int n : resolutions(findings)) {
    const std::string at = std::to_string(n) + " voxels: ";
    if (const BenchRace r = race(findings, n); r.known)
      text += at + "alpha rms " + (r.target == kAlphaTarget ? "1/256" : shown(r.target)) + " takes " + shown(r.bundle) + " s (" + r.bundle_how + "), with random rays " + shown(r.random) + " s (" + r.random_how + "): " + shown(r.random / r.bundle) + " times\n";
    std::string slopes;
    for (const char* family : {"grid", "lattice", "random"})
      if (const double s = error_slope(findings, family, n, "alpha_rms"); std::isfinite(s)) slopes += (slopes.empty() ? "" : ", ") + family_name(family) + " " + shown(s);
    if (!slopes.empty()) text += at + "slope of alpha's error over the rays: " + slopes + "\n";
    if (const auto noise = findings.truth_noise.find(n); noise != findings.truth_noise.end()) text += at + "the truth's own noise is " + shown(noise->second) + " at most\n";
  }
  if (std::isfinite(growth(findings, &BenchTimes::cpu)))
    text += "whole packs grow with the resolution to the power of " + shown(growth(findings, &BenchTimes::cpu)) + " (CPU seconds), " + shown(growth(findings, &BenchTimes::bytes)) + " (bytes), " +
            shown(growth(findings, &BenchTimes::peak)) + " (peak memory)\n";
  for (const BenchPlot& p : bench_plots(findings))
    if (p.has_default) text += p.file + ": the default is " + (p.default_on_front ? "" : "not ") + "on the front\n";
  for (const BenchSkip& s : findings.skipped) text += "skipped: " + s.what + ": " + s.why + "\n";
  return text;
}

std::string bench_json(const BenchFindings& findings, const std::string& command) {
  const auto number = [](double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); };
  Json j{{"format", "texel-bench"}, {"generator", std::string("texel ") + TEXEL_VERSION}, {"command", command}, {"scene", findings.scene}, {"runs", Json::array()}};
  for (const BenchRun& r : findings.runs) {
    Json run{{"method", r.task.family}, {"value", r.task.error > 0 ? Json(r.task.error) : Json(r.task.value)}, {"resolution", r.task.resolution}, {"default", r.is_default}};
    if (!r.times.failure.empty()) {
      run["failure"] = r.times.failure;
      j["runs"].push_back(run);
      continue;
    }
    run["cpu_seconds"] = r.times.cpu;
    run["cpu_seconds_median"] = r.times.cpu_median;
    run["wall_seconds"] = r.times.wall;
    run["peak_bytes"] = r.times.peak;
    run["pack_bytes"] = r.times.bytes;
    for (const auto& [name, m] : r.errors) run["errors"][name] = {{"value", number(m.value)}, {"low", number(m.low)}, {"high", number(m.high)}, {"count", m.count}, {"of", m.of}};
    j["runs"].push_back(run);
  }
  j["races"] = Json::array();
  for (const int n : resolutions(findings)) {
    const BenchRace r = race(findings, n);
    if (r.known) j["races"].push_back({{"resolution", n}, {"alpha_rms", r.target}, {"bundle_seconds", r.bundle}, {"bundle", r.bundle_how}, {"random_seconds", r.random}, {"random", r.random_how}, {"ratio", number(r.random / r.bundle)}});
  }
  j["slopes"] = Json::array();
  for (const int n : resolutions(findings))
    for (const char* family : {"grid", "lattice", "filtered", "random"})
      j["slopes"].push_back({{"resolution", n}, {"method", family}, {"alpha_rms", number(error_slope(findings, family, n, "alpha_rms"))}, {"alpha_rms_coarser", number(error_slope(findings, family, n, "alpha_rms_coarser"))}});
  j["growth"] = {{"cpu_seconds", number(growth(findings, &BenchTimes::cpu))}, {"bytes", number(growth(findings, &BenchTimes::bytes))}, {"peak_bytes", number(growth(findings, &BenchTimes::peak))}};
  j["plots"] = Json::array();
  for (const BenchPlot& p : bench_plots(findings)) j["plots"].push_back({{"file", p.file}, {"error", p.error}, {"default_on_front", p.has_default ? Json(p.default_on_front) : Json(nullptr)}});
  j["truth_noise"] = Json::object();
  for (const auto& [n, noise] : findings.truth_noise) j["truth_noise"][std::to_string(n)] = noise;
  j["skipped"] = Json::array();
  for (const BenchSkip& s : findings.skipped) j["skipped"].push_back({{"what", s.what}, {"why", s.why}});
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace texel
