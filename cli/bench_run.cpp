#include "cli/bench_run.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "bake/bake.h"
#include "bake/ndf_fits.h"
#include "bake/random_rays.h"
#include "bake/truth_voxels.h"
#include "cli/bake_one.h"
#include "cli/commands.h"
#include "cli/input_scene.h"
#include "cli/interrupt.h"
#include "cli/print.h"
#include "cli/scene_settings.h"
#include "formats/error.h"
#include "formats/write.h"

extern char** environ;

namespace texel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

double cpu_seconds() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Want nothing() {
  return {.slices = false, .density = false, .color = false, .ndf = false, .visibility = false, .material = false, .normal = false, .levels = false, .preview = false};
}

// The stages before the rays, as bake() has them; what the baseline needs of them.
struct Prepared {
  std::unique_ptr<TruthScene> truth;
  std::vector<Surface> surfaces;
};

Prepared prepare(const Scene& scene, const Recipe& recipe, bool normals, bool levels, Report& report) {
  Prepared p;
  p.truth = make_truth_scene(scene, recipe, plan_grid(scene, recipe), report);
  const TruthScene& t = *p.truth;
  p.surfaces.push_back(clip_surface(t.scene, t.plan, t.textures, {.color = false, .normals = normals, .material = false}, report));
  for (Grid g = t.plan.grid; levels && (g.n.x > 1 || g.n.y > 1 || g.n.z > 1); g = g.level(1)) p.surfaces.push_back(coarser(p.surfaces.back()));
  return p;
}

Channel empty_channel(const char* name, int components, const VoxelSet& set) {
  Channel c;
  c.name = name;
  c.components = components;
  c.values.resize(static_cast<std::size_t>(set.count) * static_cast<std::size_t>(components));
  return c;
}

Pack empty_pack(const Grid& grid) {
  Pack pack;
  pack.grid = grid;
  return pack;
}

Pack random_pack(const Scene& scene, const Recipe& recipe, int count, std::uint32_t seed, Report& report) {
  const Prepared p = prepare(scene, recipe, false, true, report);
  const RayScene rays(p.truth->scene, &p.truth->textures);
  Pack pack = empty_pack(p.truth->plan.grid);
  for (std::size_t l = 0; l < p.surfaces.size(); ++l) {
    const VoxelSet& set = p.surfaces[l].set;
    const RandomRaysLevel traced = trace_random_rays(p.truth->scene, p.truth->plan, rays, set, static_cast<int>(l), {.rays = count, .seed = seed});
    Layer layer;
    layer.set = set;
    Channel& alpha = layer.channels.emplace_back(empty_channel("alpha", 3, set));
    for (std::size_t i = 0; i < static_cast<std::size_t>(set.count); ++i)
      for (std::size_t k = 0; k < 3; ++k) alpha.values[3 * i + k] = traced.alpha[k][i];
    pack.levels.push_back({pack.grid.level(static_cast<int>(l)), {std::move(layer)}});
  }
  return pack;
}

Pack ratib_pack(const Scene& scene, const Recipe& recipe, int count, bool squares, std::uint32_t seed, Report& report) {
  const Prepared p = prepare(scene, recipe, false, false, report);
  const RayScene rays(p.truth->scene, &p.truth->textures);
  Pack pack = empty_pack(p.truth->plan.grid);
  const Surface& surface = p.surfaces[0];
  const RandomRaysLevel traced = trace_random_rays(p.truth->scene, p.truth->plan, rays, surface.set, 0, {.rays = count, .seed = seed, .normals = true});
  Layer layer;
  layer.set = surface.set;
  for (const char* name : {"area", "coverage", "axis_1", "axis_2"}) layer.channels.push_back(empty_channel(name, name[0] == 'a' && name[1] == 'x' ? 3 : 1, surface.set));
  for (std::size_t i = 0; i < static_cast<std::size_t>(surface.set.count); ++i) {
    layer.channels[0].values[i] = static_cast<float>(surface.areas[i].area);
    layer.channels[1].values[i] = static_cast<float>(surface.areas[i].area > 0 ? surface.areas[i].covered / surface.areas[i].area : 0);
    const auto axes = squares ? ratib_by_least_squares(traced.bins[i]) : ratib_from_fullest(traced.bins[i]);
    for (std::size_t k = 0; axes && k < 3; ++k) {
      layer.channels[2].values[3 * i + k] = axes->axis_1[static_cast<int>(k)];
      layer.channels[3].values[3 * i + k] = axes->axis_2[static_cast<int>(k)];
    }
  }
  pack.levels.push_back({pack.grid, {std::move(layer)}});
  return pack;
}

Pack exact_pack(const Scene& scene, const Recipe& recipe, Report& report) {
  const Prepared p = prepare(scene, recipe, true, false, report);
  Pack pack = empty_pack(p.truth->plan.grid);
  const Surface& surface = p.surfaces[0];
  Layer layer;
  layer.set = surface.set;
  Channel& area = layer.channels.emplace_back(empty_channel("area", 1, surface.set));
  for (std::size_t i = 0; i < static_cast<std::size_t>(surface.set.count); ++i) area.values[i] = static_cast<float>(surface.areas[i].area);
  pack.levels.push_back({pack.grid, {std::move(layer)}});
  return pack;
}

// From the scene in memory to values in memory.
Pack make_pack(const BenchTask& task, const Scene& scene, const Recipe& base, std::uint32_t seed, Report& report) {
  Recipe recipe = base;
  const bool visible = task.family.ends_with(" visible");
  const std::string family = visible ? task.family.substr(0, task.family.size() - 8) : task.family;
  if (family == "grid" || family == "lattice" || family == "filtered") {
    recipe.want = nothing();
    recipe.want.visibility = recipe.want.levels = true;
    recipe.samples = task.value;
    recipe.pattern = family == "lattice" ? Pattern::kLattice : Pattern::kGrid;
    if (family == "filtered") recipe.level_mode = LevelMode::kFilter;
    return bake(scene, recipe, report);
  }
  if (family == "asked") {
    recipe.want = nothing();
    recipe.want.visibility = recipe.want.levels = true;
    recipe.max_error = task.error;
    return bake(scene, recipe, report);
  }
  if (family == "sggx" || family == "neyret" || family == "ratib") {
    recipe.want = nothing();
    recipe.want.ndf = recipe.want.normal = true;
    recipe.ndf = family == "neyret" ? NdfKind::kNeyret : family == "ratib" ? NdfKind::kRatib : NdfKind::kSggx;
    recipe.normals = visible ? Normals::kVisible : Normals::kAll;
    return bake(scene, recipe, report);
  }
  // The baseline's own opacity: MTL's d has no part in alpha.
  if (family == "random" || family.starts_with("ratib ")) {
    Scene opaque = scene;
    for (Material& m : opaque.materials) m.opacity = 1;
    return family == "random" ? random_pack(opaque, recipe, task.value, seed, report) : ratib_pack(opaque, recipe, task.value, family == "ratib squares", seed, report);
  }
  if (family == "exact") return exact_pack(scene, recipe, report);
  if (family == "pack") return bake(scene, recipe, report);
  throw Error(Code::kCommandLine, "bench-run", "no method \"" + task.family + "\"");
}

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

double folder_bytes(const fs::path& folder) {
  double bytes = 0;
  std::error_code ec;
  for (fs::recursive_directory_iterator at(folder, ec), end; !ec && at != end; at.increment(ec))
    if (at->is_regular_file(ec)) bytes += static_cast<double>(at->file_size(ec));
  return bytes;
}

// Waits for the process, and ends it when this one is asked to end.
int wait_for(pid_t process) {
  for (int status = 0;;) {
    const pid_t done = ::waitpid(process, &status, WNOHANG);
    if (done == process) return status;
    if (done < 0 && errno != EINTR) throw Error(Code::kRunning, "", std::string("a run of the bench is lost: ") + std::strerror(errno));
    if (interrupted()) {
      ::kill(process, SIGTERM);
      ::kill(process, SIGTERM);  // at once
      (void)::waitpid(process, &status, 0);
      stop_if_interrupted();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

}  // namespace

Recipe bench_recipe(const Settings& settings, int resolution) {
  Recipe recipe = settings.recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.voxel_size = 0;
  return recipe;
}

BenchTimes run_bench_task(const BenchTask& task, const Settings& settings, const std::string& folder) {
  std::error_code ec;
  fs::remove_all(folder, ec);
  const std::string said = folder + ".json", complaints = folder + ".err";
  std::vector<std::string> words{"texel", "bench-run", task.family, task.text(), std::to_string(task.resolution), folder};
  words.insert(words.end(), settings.words.begin(), settings.words.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 1, said.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
  posix_spawn_file_actions_addopen(&actions, 2, complaints.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
  pid_t process = 0;
  const int failed = ::posix_spawn(&process, "/proc/self/exe", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed) throw Error(Code::kRunning, "", std::string("no process can be made for a run of the bench: ") + std::strerror(failed));
  const int status = wait_for(process);
  BenchTimes times;
  try {
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
      times.failure = read_text(complaints);
      times.failure.erase(std::min(times.failure.find('\n'), times.failure.size()));
      if (times.failure.starts_with("texel: error: ")) times.failure.erase(0, 14);
      if (times.failure.empty()) times.failure = WIFSIGNALED(status) ? std::string("ended by signal ") + std::to_string(WTERMSIG(status)) : "failed";
    } else {
      const Json j = Json::parse(read_text(said));
      times.cpu = j.at("cpu").get<double>();
      times.cpu_median = j.at("cpu_median").get<double>();
      times.wall = j.at("wall").get<double>();
      times.peak = j.at("peak").get<double>();
      times.bytes = folder_bytes(folder);
    }
  } catch (const nlohmann::json::exception&) {
    times.failure = "the run said nothing that can be read";
  }
  fs::remove(said, ec);
  fs::remove(complaints, ec);
  return times;
}

int command_bench_run(const std::vector<std::string>& arguments) {
  if (arguments.size() < 5) throw Error(Code::kCommandLine, "bench-run", "is a part of `texel bench`", "use that");
  BenchTask task{arguments[0], 0, std::atoi(arguments[2].c_str())};
  if (task.family == "asked") task.error = std::atof(arguments[1].c_str());
  else task.value = std::atoi(arguments[1].c_str());
  const std::string folder = arguments[3];
  Settings settings = parse_options(kBench, {arguments.begin() + 4, arguments.end()});
  catch_interrupts();
  settings = with_scene_recipes(kBench, std::move(settings));
  keep_freed_memory(true);
  std::optional<tbb::global_control> limit;
  if (settings.recipe.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(settings.recipe.threads));
  Report report;
  report.progress = [](const std::string&, double) { stop_if_interrupted(); };
  const Scene scene = input_scene(settings, report);
  const Recipe recipe = bench_recipe(settings, task.resolution);
  std::vector<std::pair<double, double>> times;  // CPU, wall
  Pack pack;
  double spent = 0;
  // Short runs more often: theirs are the times that other work on the machine blurs.
  constexpr double kShort = 0.5;
  constexpr int kMost = 25;
  const auto again = [&](int i) { return i == 0 || (i < settings.bench.repeats && spent < settings.bench.time_limit) || (i < kMost && settings.bench.repeats > 1 && spent < kShort); };
  for (int i = 0; again(i); ++i) {
    pack = {};
    const auto start = std::chrono::steady_clock::now();
    const double before = cpu_seconds();
    pack = make_pack(task, scene, recipe, static_cast<std::uint32_t>(settings.compare.seed) + 1, report);
    times.emplace_back(cpu_seconds() - before, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    spent += times.back().second;
  }
  std::sort(times.begin(), times.end());
  const double peak = peak_bytes();
  write_pack(pack, folder, {.full_float = task.family != "pack"}, report);
  const Json j{{"cpu", times.front().first}, {"wall", times.front().second}, {"cpu_median", times[times.size() / 2].first}, {"peak", peak}};
  print_product(j.dump() + "\n");
  return 0;
}

}  // namespace texel
