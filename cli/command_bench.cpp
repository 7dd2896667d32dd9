// texel bench: run time against error on the user's own data.
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>

#include "bake/bake.h"
#include "bake/compare_voxels.h"
#include "bake/ndf_fits.h"
#include "bake/truth_voxels.h"
#include "cli/bench_report.h"
#include "cli/commands.h"
#include "cli/input_scene.h"
#include "cli/interrupt.h"
#include "cli/print.h"
#include "formats/error.h"
#include "formats/read_pack.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

constexpr int kTruthRays = 96;  // a voxel edge: noise well below 1/256
constexpr int kDirections = 64;

// The truth of one resolution, in the same voxels for every run.
struct BenchTruth {
  std::vector<V3d> directions = half_sphere(kDirections);
  std::vector<std::vector<VoxelTruth>> levels;
  std::vector<std::int64_t> of;      // voxels with surface there are
  double noise = 0;
  bool many_layers = false;          // cut-outs or fibres: the default has more samples
};

BenchTruth find_truth(const Scene& scene, const Recipe& recipe, const BenchSettings& bench, std::uint32_t seed, Report& report) {
  BenchTruth truth;
  const auto made = make_truth_scene(scene, recipe, plan_grid(scene, recipe), report);
  truth.many_layers = made->textures.any_cutouts() || made->scene.fibres.strands() > 0;
  Surface surface = clip_surface(made->scene, made->plan, made->textures, {.color = false, .normals = false, .material = false}, report);
  Grid grid = made->plan.grid;
  for (int level = 0;; ++level) {
    std::vector<V3i> voxels;
    for_each_voxel(surface.set, [&](const V3i& v, std::int64_t) { voxels.push_back(v); });
    truth.of.push_back(surface.set.count);
    truth.levels.push_back(true_voxels(*made, level, sample_voxels(std::move(voxels), bench.voxels, seed),
                                       {.rays = kTruthRays, .directions = truth.directions, .bins = level == 0, .color = false, .seed = seed}, report));
    if (grid.n == V3i(1, 1, 1)) break;
    grid = grid.level(1);
    surface = coarser(surface);
  }
  double noise = 0, count = 0;
  for (const VoxelTruth& t : truth.levels[0])
    for (const double v : t.noise) {
      noise += v;
      ++count;
    }
  truth.noise = count > 0 ? std::sqrt(noise / count) : 0;
  return truth;
}

void measure_alpha(const Pack& pack, const BenchTruth& truth, BenchRun& run) {
  ErrorSums finest, coarser_ones;
  std::int64_t of_coarser = 0;
  for (std::size_t l = 0; l < std::min(pack.levels.size(), truth.levels.size()); ++l) {
    const VoxelField alpha(pack.levels[l], "alpha", 3);
    if (!alpha.present()) return;
    for (const VoxelTruth& t : truth.levels[l]) {
      const float* a = alpha.at(t.at);
      double mean = 0, square = 0, most = 0;
      for (int k = 0; k < 3; ++k) {
        const double e = (a ? static_cast<double>(a[k]) : 0) - t.alpha[static_cast<std::size_t>(k)];
        mean += e / 3;
        square += e * e / 3;
        most = std::max(most, std::abs(e));
      }
      (l == 0 ? finest : coarser_ones).add(mean, square, most);
    }
    if (l > 0) of_coarser += truth.of[l];
  }
  run.errors["alpha_rms"] = finest.rms("alpha_rms", truth.of[0]);
  run.errors["alpha_bias"] = finest.bias("alpha_bias", truth.of[0]);
  if (coarser_ones.count > 0) run.errors["alpha_rms_coarser"] = coarser_ones.rms("alpha_rms", of_coarser);
}

void measure_surface(const Pack& pack, NdfKind kind, const BenchTruth& truth, BenchRun& run) {
  const Level& level = pack.levels[0];
  const VoxelField area(level, "area", 1), coverage(level, "coverage", 1);
  const NdfField ndf(level, kind);
  if (!area.present()) return;
  ErrorSums areas, sigma, angle, all, visible;
  double mean_area = 0, covered = 0;
  std::vector<double> shadow(truth.directions.size());
  for (const VoxelTruth& t : truth.levels[0]) {
    areas.add(static_cast<double>(area.value(t.at, 0)) - t.area);
    mean_area += t.area;
    const auto found = ndf.at(t.at);
    if (!found || !(t.moments.covered > 0)) continue;
    projected_areas(*found, static_cast<double>(area.value(t.at, 0) * coverage.value(t.at, 1)), truth.directions, shadow);
    add_sigma(shadow, t.sigma, sigma);
    covered += t.moments.covered;
    const Moments& m = t.moments;
    if (const auto axis = principal_axis(Symmetric{m.xx, m.yy, m.zz, m.xy, m.xz, m.yz})) angle.add(axis_angle(axis_of(*found, axis->fibre), axis->axis));
    all.add(total_variation(t.bins, *found));
    if (t.visible.covered > 0) visible.add(total_variation(t.visible_bins, *found));
  }
  const auto count = static_cast<double>(truth.levels[0].size());
  if (run.task.family == "exact" || run.task.family == "pack") run.errors["area_rms"] = in_units(areas.rms("area_rms", truth.of[0]), mean_area / count);
  if (!ndf.present() || sigma.count == 0) return;
  run.errors["sigma_rms"] = in_units(sigma.rms("sigma_rms", truth.of[0]), covered / 2 / static_cast<double>(sigma.count));
  run.errors["axis_angle_rms"] = angle.rms("axis_angle_rms", truth.of[0]);
  run.errors["tv_all"] = all.bias("tv_all", truth.of[0]);
  run.errors["tv_visible"] = visible.bias("tv_visible", truth.of[0]);
}

struct Sweep {
  const Settings& settings;
  fs::path folder;
  BenchFindings findings;
  Report& report;
  int resolution = 0;
  BenchTruth truth{};
  int done = 0, all = 1;

  void run(const std::string& family, int value, bool is_default = false) {
    run({family, value, resolution}, is_default);
  }

  void run(const BenchTask& task, bool is_default) {
    BenchRun r{task, {}, {}, is_default};
    report.progress("bench", static_cast<double>(done++) / all);
    const std::string& family = task.family;
    const std::string place = (folder / "run.texel").string();
    r.times = run_bench_task(r.task, settings, place);
    if (r.times.failure.empty()) {
      const Pack pack = read_pack(place);
      if (pack.levels.empty()) r.times.failure = "the run made no volume";
      else {
        measure_alpha(pack, truth, r);
        measure_surface(pack, family.starts_with("neyret") ? NdfKind::kNeyret : family.starts_with("ratib") ? NdfKind::kRatib : NdfKind::kSggx, truth, r);
      }
    }
    std::error_code ec;
    fs::remove_all(place, ec);
    findings.runs.push_back(std::move(r));
  }

  // In the order of their times; `power` of the value that time grows with.
  void series(const std::string& family, const std::vector<int>& values, double power, int the_default = 0) {
    std::vector<BenchTask> tasks;
    for (const int value : values) tasks.push_back({family, value, resolution});
    series(tasks, power, the_default);
  }

  void series(const std::vector<BenchTask>& tasks, double power, int the_default = 0) {
    double before = 0, last = 0;
    for (const BenchTask& task : tasks) {
      // A small run's time is mostly not the rays'.
      const double expected = last > 0 ? before * std::pow(task.number() / last, power) : 0;
      if (expected > settings.bench.time_limit && before > 0.05 * settings.bench.time_limit) {
        findings.skipped.push_back({task.family + " " + task.text() + " at " + std::to_string(resolution) + " voxels", "would take about " + std::to_string(std::lround(expected)) + " CPU s; --time-limit is " + number_text(settings.bench.time_limit)});
        ++done;
        continue;
      }
      run(task, the_default > 0 && task.value == the_default);
      if (!findings.runs.back().times.failure.empty()) break;
      before = findings.runs.back().times.cpu;  // a paused process would count as a slow one
      last = task.number();
    }
  }

  void at(int n, const Scene& scene) {
    resolution = n;
    truth = find_truth(scene, bench_recipe(settings, n), settings.bench, static_cast<std::uint32_t>(settings.compare.seed), report);
    if (truth.levels[0].empty()) throw Error(Code::kRunning, "", "the truth of " + std::to_string(n) + " voxels meets too many triangles", "use fewer --voxels");
    findings.truth_noise[n] = truth.noise;
    const int samples = truth.many_layers ? 6 : 4;
    std::vector<int> bundle = settings.bench.samples;
    bundle.push_back(samples);
    std::sort(bundle.begin(), bundle.end());
    bundle.erase(std::unique(bundle.begin(), bundle.end()), bundle.end());
    run("exact", 0);
    series("grid", bundle, 2, samples);
    series("lattice", bundle, 2);
    series("filtered", bundle, 2);
    // Rays along an edge go about as the error to -2/3: where layers lie behind each other.
    std::vector<double> errors = settings.bench.errors;
    std::sort(errors.begin(), errors.end(), std::greater<>());
    std::vector<BenchTask> asked;
    for (const double error : errors) asked.push_back({"asked", 0, resolution, error});
    series(asked, -4.0 / 3);
    series("random", settings.bench.rays, 1);
    for (const char* family : {"sggx", "neyret", "ratib"}) {
      run(family, 0, std::string(family) == "sggx");
      run(std::string(family) + " visible", 0);
    }
    series("ratib bins", settings.bench.rays, 1);
    series("ratib squares", settings.bench.rays, 1);
    run("pack", 0);
  }
};

std::string names_of(const Settings& settings) {
  std::string names;
  for (const std::string& input : settings.inputs) names += (names.empty() ? "" : ", ") + fs::path(input).filename().string();
  return names.empty() ? "the function" : names;
}

}  // namespace

int command_bench(const Settings& settings) {
  if (settings.inputs.empty() && !makes_scene(settings)) throw Error(Code::kCommandLine, "INPUT", "missing", "name a mesh");
  if (settings.output.empty()) throw Error(Code::kCommandLine, "--output", "missing", "name a folder for bench.json and the plots, e.g. -o bench");
  std::error_code ec;
  fs::create_directories(settings.output, ec);
  if (!fs::is_directory(settings.output, ec)) throw Error(Code::kFile, settings.output, "no folder can be made there");
  require_file_place((fs::path(settings.output) / "bench.json").string());
  std::optional<tbb::global_control> limit;
  if (settings.recipe.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(settings.recipe.threads));
  Report report;
  ProgressBar bar(settings.progress);
  report.progress = [&bar](const std::string& stage, double done) {
    stop_if_interrupted();
    bar.update(stage, done);
  };
  const Scene scene = input_scene(settings, report);
  if (scene.hypertexture) throw Error(Code::kUnsupported, "--hypertexture", "a density has no surface to measure against", "bench a mesh or an implicit surface");
  Sweep sweep{settings, settings.output, {names_of(settings), {}, {}, {}}, report};
  sweep.all = static_cast<int>(settings.bench.resolutions.size() * (8 + 3 * (settings.bench.samples.size() + 1) + 3 * settings.bench.rays.size() + settings.bench.errors.size()));
  for (const int n : settings.bench.resolutions) sweep.at(n, scene);
  stop_if_interrupted();
  bar.clear();
  print_warnings(report.issues);
  std::string words = "texel bench";
  for (const std::string& word : settings.words) words += " " + word;
  const fs::path folder = settings.output;
  for (const BenchPlot& p : bench_plots(sweep.findings)) write_text_file((folder / p.file).string(), plot_svg(p.plot));
  if (settings.bench.resolutions.size() > 1) write_text_file((folder / "growth.svg").string(), plot_svg(growth_plot(sweep.findings)));
  write_text_file((folder / "bench.json").string(), bench_json(sweep.findings, words));
  print_product(bench_table(sweep.findings));
  return 0;
}

}  // namespace texel
