// Functions as inputs: implicit surfaces beside the same sphere as a mesh, and densities. One row each: time and the error it leaves.
//   field_bench [--resolutions=128,256] [--repeat=5] [--only=sphere,gyroid,creature,eroded,fire,fur,marble]
// Prints Markdown. Times are of what bake() or bake_density() takes, with everything in memory: no reading, no writing.
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <numbers>
#include <sstream>
#include <tuple>

#include "bake/bake.h"
#include "bake/hypertexture.h"
#include "bake/plan.h"
#include "formats/expression.h"
#include "formats/read.h"
#include "tests/bench/sphere_obj.h"

namespace texel {
namespace {

struct Settings {
  std::vector<int> resolutions{128, 256};
  int repeat = 5;
  std::string only = "sphere,gyroid,creature,eroded,fire,fur,marble";
  [[nodiscard]] bool wants(const std::string& name) const { return ("," + only + ",").find("," + name + ",") != std::string::npos; }
};

// CPU seconds of all threads.
double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

struct Times {
  double least = 0, median = 0, wall = 0;  // CPU seconds; wall: the least
};
Times timed(int repeat, const std::function<void()>& work) {
  std::vector<double> cpu, wall;
  for (int i = 0; i < repeat; ++i) {
    const double before = cpu_seconds();
    const auto start = std::chrono::steady_clock::now();
    work();
    wall.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    cpu.push_back(cpu_seconds() - before);
  }
  std::sort(cpu.begin(), cpu.end());
  return {cpu.front(), cpu[cpu.size() / 2], *std::min_element(wall.begin(), wall.end())};
}

double sum_of(const Pack& pack, const char* name) {
  double sum = 0;
  const Layer* layer = nullptr;
  const Channel* channel = pack.levels[0].find(name, &layer);
  if (!channel) return std::nan("");
  for (const float v : channel->values) sum += static_cast<double>(v);
  for (const float v : channel->tiles) sum += 512 * static_cast<double>(v);
  return sum;
}

// Area and filled volume of a pack, world units.
struct Measure { double area = 0, volume = 0; };
Measure measure(const Scene& scene, const Recipe& recipe) {
  Recipe with_area = recipe;
  with_area.want.visibility = with_area.want.normal = with_area.want.ndf = true;  // `area` and `solid` come with them
  Report report;
  const Pack pack = bake(scene, with_area, report);
  return {sum_of(pack, "area") * std::pow(pack.grid.h, 2), sum_of(pack, "solid") * std::pow(pack.grid.h, 3)};
}

Recipe density_color(int resolution, const Box3d& box) {
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.want = {.slices = false, .density = true, .color = true, .ndf = false, .visibility = false, .material = false, .normal = false, .levels = false, .preview = false};
  if (!box.isEmpty()) recipe.box = box;
  return recipe;
}

Times surface_row(const std::string& name, const Scene& scene, const Recipe& recipe, int repeat, const Measure& truth) {
  Report report;
  const Times t = timed(repeat, [&] {
    report = {};
    (void)bake(scene, recipe, report);
  });
  double stage = 0, triangles = 0;
  for (const auto& time : report.times)
    if (time.stage == "polygonize") stage = time.cpu_seconds;
  for (const auto& [what, value] : report.counts)
    if (what == "implicit triangles") triangles = value;
  if (triangles == 0) triangles = static_cast<double>(scene.mesh.triangles.size());
  const Measure m = measure(scene, recipe);
  std::printf("| %s, %d | %.0f | %.2f | %.2f | %.2f | %.2f | %+.1e | %+.1e |\n", name.c_str(), recipe.resolution.x, triangles, t.wall, t.least, t.median, stage,
              m.area / truth.area - 1, m.volume / truth.volume - 1);
  std::fflush(stdout);
  return t;
}

Scene from_expression(const std::string& text, const Box3d& box) {
  Scene scene;
  scene.materials.resize(1);
  scene.implicits.push_back({read_expression(text), 0, box, 0, "--implicit"});
  return scene;
}

void surfaces(const Settings& settings) {
  constexpr double pi = std::numbers::pi;
  std::printf("\n| surface, n | triangles | wall s | CPU s, least | median | of which polygonize | area, relative error | volume |\n|---|---|---|---|---|---|---|---|\n");
  for (const int n : settings.resolutions) {
    if (settings.wants("sphere")) {
      const Box3d box(V3d(-1.01, -1.01, -1.01), V3d(1.01, 1.01, 1.01));
      const Recipe recipe = density_color(n, box);
      const Measure ball{4 * pi, 4 * pi / 3};
      const std::string path = (std::filesystem::temp_directory_path() / "texel_field_bench.obj").string();
      std::ofstream(path, std::ios::binary) << sphere_obj(6);
      Report report;
      const Scene mesh = read_scene(path, report);
      std::filesystem::remove(path);
      const Times by_mesh = surface_row("sphere as a mesh", mesh, recipe, settings.repeat, ball);
      const Times by_expression = surface_row("sphere as an expression", from_expression("1 - length(x, y, z)", box), recipe, settings.repeat, ball);
      std::printf("| ratio, %d | | %.2f | %.2f | %.2f | | | |\n", n, by_expression.wall / by_mesh.wall, by_expression.least / by_mesh.least, by_expression.median / by_mesh.median);
    }
    if (settings.wants("gyroid")) {
      const Box3d cell(V3d(0, 0, 0), V3d(2 * pi, 2 * pi, 2 * pi));
      // Area of one period: as in implicit_test, by roots column by column and tanh-sinh quadrature.
      surface_row("gyroid, one period", from_expression("sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)", cell), density_color(n, cell), settings.repeat, {122.0532741273, 4 * pi * pi * pi});
    }
    if (settings.wants("creature")) {
      Report report;
      const Scene scene = read_scene(std::string(TEXEL_SAMPLES) + "/creature/creature.json", report);
      const Box3d box = plan_grid(scene, density_color(n, {})).box();
      surface_row("creature.json, against twice n", scene, density_color(n, box), settings.repeat, measure(scene, density_color(2 * n, box)));
    }
  }
}

DensityBake density_bake(const Scene& scene, const Grid& grid, Recipe recipe, int samples, bool all) {
  recipe.samples = samples;
  DensityOptions options;
  if (all) {
    options.slice_axes = {true, true, true};
    options.slice_counts = {grid.n.x, grid.n.y, grid.n.z};
    for (int longest = std::max({grid.n.x, grid.n.y, grid.n.z}); longest > 1; longest = (longest + 1) / 2) ++options.levels;
  }
  Report report;
  return bake_density(scene, grid, recipe, options, report);
}

// Of alpha in the voxels both have, and of the mass.
struct DensityError { double rms = 0, mass = 0; };
DensityError density_error(const DensityBake& made, const DensityBake& truth) {
  std::map<std::tuple<int, int, int>, std::size_t> places;
  for_each_voxel(truth.surfaces[0].set, [&](const V3i& v, std::int64_t at) { places[{v.x, v.y, v.z}] = static_cast<std::size_t>(at); });
  double square = 0, count = 0;
  for_each_voxel(made.surfaces[0].set, [&](const V3i& v, std::int64_t at) {
    const auto found = places.find({v.x, v.y, v.z});
    if (found == places.end()) return;
    for (std::size_t axis = 0; axis < 3; ++axis, ++count) {
      const double e = static_cast<double>(made.seen.levels[0].alpha[axis][static_cast<std::size_t>(at)] - truth.seen.levels[0].alpha[axis][found->second]);
      square += e * e;
    }
  });
  return {std::sqrt(square / count), made.mass / truth.mass - 1};
}

void densities(const Settings& settings) {
  std::printf("\n| density, n | border voxels | wall s | CPU s, least | median | alpha, rms error | mass, relative |\n|---|---|---|---|---|---|---|\n");
  for (const int n : settings.resolutions)
    for (const char* name : {"eroded", "fire", "fur", "marble"}) {
      if (!settings.wants(name)) continue;
      Scene scene;
      scene.materials.resize(1);
      scene.hypertexture.emplace();
      (void)find_hypertexture(name, &*scene.hypertexture);
      Recipe recipe;
      recipe.resolution = V3i(n, 0, 0);
      const Grid grid = plan_grid(scene, recipe);
      std::int64_t border = 0;
      const Times t = timed(settings.repeat, [&] { border = density_bake(scene, grid, recipe, 2, true).surfaces[0].set.count; });
      // The error in one octant, of 128³ voxels at most: 8 samples a voxel, as always, against 216.
      Grid part = grid;
      for (int a = 0; a < 3; ++a) part.n[a] = std::min(grid.n[a] / 2, 128);
      part.origin = grid.to_world(V3d(grid.n) * 0.75 - V3d(part.n) / 2);
      const DensityError e = density_error(density_bake(scene, part, recipe, 2, false), density_bake(scene, part, recipe, 6, false));
      std::printf("| %s, %d | %lld | %.2f | %.2f | %.2f | %.1e | %+.1e |\n", name, n, static_cast<long long>(border), t.wall, t.least, t.median, e.rms, e.mass);
      std::fflush(stdout);
    }
}

Settings take_options(int argc, char** argv) {
  Settings settings;
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i];
    const auto value = [&](const std::string& name) { return text.starts_with(name) ? text.substr(name.size()) : std::string(); };
    if (const std::string list = value("--resolutions="); !list.empty()) {
      settings.resolutions.clear();
      std::istringstream in(list);
      for (std::string part; std::getline(in, part, ',');) settings.resolutions.push_back(std::stoi(part));
    } else if (const std::string repeat = value("--repeat="); !repeat.empty()) {
      settings.repeat = std::max(1, std::stoi(repeat));
    } else if (const std::string only = value("--only="); !only.empty()) {
      settings.only = only;
    } else {
      throw std::invalid_argument("unknown option " + text);
    }
  }
  return settings;
}

}  // namespace
}  // namespace texel

int main(int argc, char** argv) {
  try {
    const texel::Settings settings = texel::take_options(argc, argv);
    texel::surfaces(settings);
    texel::densities(settings);
  } catch (const std::exception& e) {
    std::cerr << "field_bench: " << e.what() << "\n";
    return 1;
  }
}
