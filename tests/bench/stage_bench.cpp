// Every stage of bake() by itself, on real models: time, throughput and the error it leaves, in one row.
//   stage_bench [--resolutions=64,256] [--models=bunny,bonsai,PATH] [--triangles=81920] [Google Benchmark's own options]
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <optional>
#include <span>
#include <sstream>

#include "bake/bake.h"
#include "bake/color.h"
#include "bake/levels.h"
#include "bake/plan.h"
#include "bake/quantize.h"
#include "bake/slice.h"
#include "bake/surface.h"
#include "bake/texture.h"
#include "bake/visibility.h"
#include "formats/error.h"
#include "formats/read.h"
#include "tests/bench/bench_util.h"
#include "formats/write.h"
#include "tests/bench/sphere_obj.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

constexpr int kTruthSamples = 16;  // rms error about 0.0006 to 0.003 (docs/accuracy.md), a quarter to a tenth of what is judged by it

struct Settings {
  std::vector<int> resolutions{256};
  std::vector<std::string> models{"sphere", "bunny", "armadillo", "dragon", "bonsai", "fruit_bowl"};
  int sphere_level = 6;
};

// A folder that is gone afterwards.
struct Folder {
  fs::path path = fs::temp_directory_path() / ("texel_stage_bench_" + std::to_string(::getpid()));
  Folder() { fs::create_directories(path); }
  ~Folder() { std::error_code ec; fs::remove_all(path, ec); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return (path / name).string(); }
};

// Where a model is, a known one by its name or any by its path; empty when it is not there.
std::string find_model(const std::string& name) {
  const std::string shared = TEXEL_SHARED_DATA "/models/", samples = TEXEL_SAMPLES "/";
  const std::vector<std::pair<std::string, std::vector<std::string>>> places{
      {"bunny", {shared + "bunny_closed.off", samples + "bunny/bunny_closed.off"}},
      {"armadillo", {shared + "armadillo.off"}},
      {"dragon", {shared + "dragon.obj"}},
      {"bonsai", {shared + "bonsai/bonsai-tree.obj", samples + "bonsai/bonsai-tree.obj"}},
      {"fruit_bowl", {shared + "fruit_bowl/bowlWithFruits.obj"}},
      {"hedge", {shared + "hedge/hedgeTextured.obj"}},
      {"lily", {shared + "lily_vase/calla_lily_with_roses.obj"}}};
  for (const auto& [model, files] : places)
    for (const std::string& file : files)
      if (model == name && fs::exists(file)) return file;
  return fs::exists(name) ? name : std::string();
}

// What the stages before the one that is timed have made.
struct Prepared {
  std::string path;
  Recipe recipe;
  Scene scene;
  Report report;
  std::unique_ptr<TextureSet> textures;
  Plan plan;
  std::vector<Surface> surfaces;
  VisibilityOptions options;
  VisibilityResult seen;
  Pack pack;
  std::optional<VisibilityResult> truth;       // of level 0, by many rays
};

SliceShader plain_shader(const Prepared& p) {
  const auto width = static_cast<float>(p.plan.grid.h / p.recipe.samples);
  SliceShader shader;
  shader.crossing = [&p, width](const Bundle& bundle, const Crossing& c, double u, double v) {
    if (!p.textures->textured(p.scene.mesh.materials[c.triangle]) && p.scene.mesh.colors.empty()) return p.scene.materials[p.scene.mesh.materials[c.triangle]].kd;
    const Face face = crossed_face(bundle, c);
    const Barycentrics b = face_barycentrics(bundle.axes, face.p[0], face.p[1], face.p[2], u, v);
    return footprint_sample(*p.textures, p.scene.mesh, c.triangle, b.b1, b.b2, p.plan.uv_width.empty() ? 0 : p.plan.uv_width[c.triangle] * width).color;
  };
  shader.voxel = [&p](const V3i&, std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    return p.surfaces[0].areas[at].covered > 0 ? p.surfaces[0].mean_color(at) : V3f(-1, -1, -1);
  };
  return shader;
}

std::vector<bool> cutouts_of(const Prepared& p) {
  std::vector<bool> cutouts;
  for (std::uint32_t m = 0; m < p.scene.materials.size(); ++m) cutouts.push_back(p.textures->has_cutouts(m));
  return cutouts;
}

Plan planned(const Prepared& p, Report& report) {
  Plan plan = make_plan(p.scene, p.recipe, cutouts_of(p), report);
  bool textured = false;
  for (std::uint32_t m = 0; m < p.scene.materials.size(); ++m) textured = textured || p.textures->textured(m);
  if (textured) plan.uv_width = uv_widths(*p.textures, p.scene.mesh);
  return plan;
}

std::unique_ptr<Prepared> prepare(const std::string& path, int resolution) {
  auto p = std::make_unique<Prepared>();
  p->path = path;
  p->recipe.resolution = V3i(resolution, 0, 0);
  p->recipe.want.preview = false;
  p->scene = read_scene(path, p->report);
  p->textures = std::make_unique<TextureSet>(p->scene, TextureSet::Need::kColor, p->report);
  if (p->recipe.samples == 0) p->recipe.samples = p->textures->any_cutouts() ? 6 : 4;  // as bake() chooses
  p->plan = planned(*p, p->report);
  p->surfaces.push_back(clip_surface(p->scene, p->plan, *p->textures, {.color = true, .material = false}, p->report));
  int levels = 1;
  for (int longest = std::max({p->plan.grid.n.x, p->plan.grid.n.y, p->plan.grid.n.z}); longest > 1; longest = (longest + 1) / 2) ++levels;
  while (static_cast<int>(p->surfaces.size()) < levels) p->surfaces.push_back(coarser(p->surfaces.back()));
  p->options.slice_counts = {p->plan.grid.n.x, p->plan.grid.n.y, p->plan.grid.n.z};
  SlabSums sums;
  p->seen = see_voxels(p->scene, p->plan, *p->textures, p->surfaces, p->recipe, p->options, plain_shader(*p), sums, p->report);
  p->pack = bake(p->scene, p->recipe, p->report);
  return p;
}

// Keeps what was made last: rows of one model and resolution follow each other.
class Workshop {
 public:
  Prepared& get(const std::string& path, int resolution) {
    if (!prepared_ || path != path_ || resolution != resolution_) {
      prepared_.reset();
      prepared_ = prepare(path, resolution);
      path_ = path;
      resolution_ = resolution;
    }
    return *prepared_;
  }
  [[nodiscard]] const Folder& folder() const { return folder_; }

 private:
  Folder folder_;
  std::unique_ptr<Prepared> prepared_;
  std::string path_;
  int resolution_ = 0;
};

double figure(const Pack& pack, const std::string& measure) {
  for (const ErrorFigure& e : pack.errors)
    if (e.measure == measure) return e.value;
  return std::nan("");
}

double folder_bytes(const fs::path& folder) {
  double sum = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) sum += static_cast<double>(entry.file_size());
  return sum;
}

using benchmark::Counter;
void rate(benchmark::State& state, const char* name, double each) {
  state.counters[name] = Counter(each * static_cast<double>(state.iterations()), Counter::kIsRate);
}
void voxel_rate(benchmark::State& state, const Prepared& p) { rate(state, "voxels/s", static_cast<double>(p.surfaces[0].set.count)); }

// Relative difference of the area in a surface's voxels from the triangles'.
double area_error(const Surface& surface, const Plan& plan) {
  double area = 0;
  for (const Areas& a : surface.areas) area += a.area;
  return area * plan.grid.h * plan.grid.h / plan.statistics.area - 1;
}

// Error of level 0 against many rays, made once, outside the timing.
double alpha_rms(Prepared& p, const VisibilityResult& seen) {
  if (!p.truth) {
    Recipe recipe = p.recipe;
    recipe.samples = kTruthSamples;
    recipe.pattern = Pattern::kGrid;
    VisibilityOptions options = p.options;
    options.slice_axes = {false, false, false};
    options.recompute = false;
    Report report;
    SlabSums sums;
    p.truth = see_voxels(p.scene, p.plan, *p.textures, std::span(p.surfaces).first(1), recipe, options, plain_shader(p), sums, report);
  }
  double square = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t i = 0; i < seen.levels[0].alpha[axis].size(); ++i) {
      const double e = static_cast<double>(seen.levels[0].alpha[axis][i] - p.truth->levels[0].alpha[axis][i]);
      square += e * e;
    }
  return std::sqrt(square / (3 * static_cast<double>(p.surfaces[0].set.count)));
}

void bench_read(benchmark::State& state, const Prepared& p) {
  std::size_t triangles = 0;
  for (auto _ : state) {
    Report report;
    triangles = read_scene(p.path, report).mesh.triangles.size();
  }
  rate(state, "triangles/s", static_cast<double>(triangles));
}

void bench_textures(benchmark::State& state, const Prepared& p) {
  for (auto _ : state) {
    Report report;
    benchmark::DoNotOptimize(TextureSet(p.scene, TextureSet::Need::kColor, report));
  }
  state.counters["textures"] = static_cast<double>(p.scene.textures.size());
}

void bench_plan(benchmark::State& state, const Prepared& p) {
  for (auto _ : state) {
    Report report;
    benchmark::DoNotOptimize(planned(p, report));
  }
  rate(state, "triangles/s", static_cast<double>(p.scene.mesh.triangles.size()));
}

void bench_surface(benchmark::State& state, const Prepared& p) {
  double error = 0;
  for (auto _ : state) {
    Report report;
    error = area_error(clip_surface(p.scene, p.plan, *p.textures, {.color = true, .material = false}, report), p.plan);
  }
  state.counters["area_relative"] = error;
  voxel_rate(state, p);
}

void bench_coarser(benchmark::State& state, const Prepared& p) {
  double error = 0;
  for (auto _ : state) {
    std::vector<Surface> above{coarser(p.surfaces[0])};
    while (above.size() + 1 < p.surfaces.size()) above.push_back(coarser(above.back()));
    error = area_error(above.back(), p.plan);
  }
  state.counters["area_relative"] = error;
  voxel_rate(state, p);
}

enum class Trace { kVolume, kVolumeAndSlices, kSlices, kFilter, kLevel0 };
void bench_rays(benchmark::State& state, Prepared& p, Trace what) {
  VisibilityOptions options = p.options;
  const bool slices = what == Trace::kSlices || what == Trace::kVolumeAndSlices;
  options.slice_axes = {slices, slices, slices};
  if (what == Trace::kSlices) options.volume_axes = {false, false, false};
  options.recompute = what != Trace::kFilter && what != Trace::kLevel0;
  const std::span<const Surface> levels = std::span<const Surface>(p.surfaces).first(what == Trace::kLevel0 ? 1 : p.surfaces.size());
  const SliceShader shader = plain_shader(p);
  double crossings = 0;
  VisibilityResult seen;
  SlabSums sums;
  for (auto _ : state) {
    Report report;
    crossings = 0;
    sums = {};
    seen = see_voxels(p.scene, p.plan, *p.textures, levels, p.recipe, options, shader, sums, report);
    if (slices) benchmark::DoNotOptimize(gather_stacks(p.plan.grid, options, sums));
    for (std::size_t l = 1; what == Trace::kFilter && l < p.surfaces.size(); ++l)
      filter_visibility(p.surfaces[l - 1], seen.levels[l - 1], p.surfaces[l], static_cast<int>(l), p.plan.grid.level(static_cast<int>(l)).n, true, seen.levels[l]);
    for (const std::int64_t met : sums.met) crossings += static_cast<double>(std::max(met, std::int64_t{0}));
  }
  rate(state, "crossings/s", crossings);
  state.counters["crossings"] = crossings;
  voxel_rate(state, p);
  if (what == Trace::kSlices) return;
  state.counters["alpha_rms"] = alpha_rms(p, seen);
  if (p.plan.statistics.volume > 0) state.counters["volume_relative"] = (sums.volume + static_cast<double>(sums.inside_count)) * std::pow(p.plan.grid.h, 3) / p.plan.statistics.volume - 1;
}

void bench_spread(benchmark::State& state, const Prepared& p) {
  for (auto _ : state)
    for (std::size_t l = 0; l < p.surfaces.size(); ++l) benchmark::DoNotOptimize(spread_colors(border_colors(p.surfaces[l]), p.seen.levels[l].inside, p.seen.levels[l].inside_blocks, p.plan.grid.level(static_cast<int>(l)), {}));
  voxel_rate(state, p);
}

// Level 0; the error is that of storing halves.
void bench_level(benchmark::State& state, const Prepared& p) {
  Level level;
  for (auto _ : state) {
    std::vector<LevelPart> parts(1);
    parts[0] = make_part(p.surfaces[0], p.seen.levels[0], p.plan.grid, 0, p.recipe, {});
    level = join_parts(parts, p.plan.grid, p.recipe);
  }
  double area = 0;
  if (const Channel* channel = level.find("area"))
    for (const float v : channel->values) area += static_cast<double>(v);
  state.counters["area_relative"] = area * p.plan.grid.h * p.plan.grid.h / p.plan.statistics.area - 1;
  voxel_rate(state, p);
}

void bench_slice_image(benchmark::State& state, const Prepared& p) {
  const SliceStack& stack = p.pack.slices.back();
  int k = 0;
  for (auto _ : state) benchmark::DoNotOptimize(stack.image(k = (k + 1) % stack.count));
  rate(state, "pixels/s", static_cast<double>(stack.width) * stack.height);
}

// Every eighth slice. The error is that of 8 bits, read back: half a step at most.
void bench_write_png(benchmark::State& state, const Prepared& p, const Folder& folder) {
  const SliceStack& stack = p.pack.slices.back();
  std::vector<Image> images;
  for (int k = 0; k < stack.count; k += 8) images.push_back(stack.image(k));
  const std::string path = folder.file("slice.png");
  double bytes = 0;
  std::size_t next = 0;
  for (auto _ : state) {
    write_png(images[next % images.size()], path);
    ++next;
  }
  float worst = 0;
  for (const Image& image : images) {
    write_png(image, path);
    bytes += static_cast<double>(fs::file_size(path)) / static_cast<double>(images.size());
    const Image back = read_image(path, true);
    for (std::size_t i = 3; i < image.pixels.size(); i += 4) worst = std::max(worst, std::abs(image.pixels[i] - back.pixels[i]));
  }
  rate(state, "pixels/s", static_cast<double>(stack.width) * stack.height);
  state.counters["bytes"] = bytes;
  state.counters["alpha_worst"] = static_cast<double>(worst);
}

void bench_write(benchmark::State& state, const Prepared& p, const Folder& folder, bool volume, bool slices) {
  Pack pack = p.pack;
  pack.recipe_json = "{}";
  if (!volume) pack.levels.clear();
  if (!slices) pack.slices.clear();
  const std::string path = folder.file("pack.texel");
  for (auto _ : state) {
    Report report;
    write_pack(pack, path, {}, report);
  }
  state.counters["bytes"] = folder_bytes(path);
  voxel_rate(state, p);
  if (!volume) return;
  double active = 0;
  for (const Level& level : pack.levels)
    for (const Layer& layer : level.layers)
      for (const Channel& c : layer.channels) active += static_cast<double>(layer.set.count) * c.components;
  rate(state, "values/s", active);
}

void bench_bake(benchmark::State& state, const Prepared& p, bool all) {
  Recipe recipe = p.recipe;
  if (!all) recipe.want = {.slices = false, .density = true, .color = true, .ndf = false, .visibility = false, .material = false, .normal = false, .levels = false, .preview = false};
  Pack pack;
  for (auto _ : state) {
    Report report;
    pack = bake(p.scene, recipe, report);
  }
  state.counters["area_relative"] = figure(pack, "area_relative");
  if (p.plan.fill) state.counters["volume_relative"] = figure(pack, "volume_relative");
  voxel_rate(state, p);
}

// From the file to the pack, without the program's start.
void bench_whole(benchmark::State& state, const Prepared& p, const Folder& folder) {
  const std::string path = folder.file("whole.texel");
  for (auto _ : state) {
    Report report;
    const Scene scene = read_scene(p.path, report);
    Pack pack = bake(scene, p.recipe, report);
    pack.recipe_json = "{}";
    write_pack(pack, path, {}, report);
  }
  state.counters["bytes"] = folder_bytes(path);
  voxel_rate(state, p);
}

void register_rows(const std::string& model, const std::string& path, int n, Workshop& workshop) {
  const auto add = [&](const std::string& stage, auto call) {
    benchmark::RegisterBenchmark((model + "/" + std::to_string(n) + "/" + stage).c_str(), [=, &workshop](benchmark::State& state) {
      try {
        call(state, workshop.get(path, n));
      } catch (const std::exception& e) {
        state.SkipWithError(e.what());
      }
    })->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();
  };
  const Folder& folder = workshop.folder();
  add("read", bench_read);
  add("textures", bench_textures);
  add("plan", bench_plan);
  add("surface", bench_surface);
  add("coarser", bench_coarser);
  add("rays_level_0", [](benchmark::State& s, Prepared& p) { bench_rays(s, p, Trace::kLevel0); });
  add("rays_volume", [](benchmark::State& s, Prepared& p) { bench_rays(s, p, Trace::kVolume); });
  add("rays_volume_filter", [](benchmark::State& s, Prepared& p) { bench_rays(s, p, Trace::kFilter); });
  add("rays_slices", [](benchmark::State& s, Prepared& p) { bench_rays(s, p, Trace::kSlices); });
  add("rays_both", [](benchmark::State& s, Prepared& p) { bench_rays(s, p, Trace::kVolumeAndSlices); });
  add("spread_colors", bench_spread);
  add("make_level_0", bench_level);
  add("slice_image", bench_slice_image);
  add("write_png", [&folder](benchmark::State& s, Prepared& p) { bench_write_png(s, p, folder); });
  add("write_volume", [&folder](benchmark::State& s, Prepared& p) { bench_write(s, p, folder, true, false); });
  add("write_slices", [&folder](benchmark::State& s, Prepared& p) { bench_write(s, p, folder, false, true); });
  add("bake_density_color", [](benchmark::State& s, Prepared& p) { bench_bake(s, p, false); });
  add("bake_all", [](benchmark::State& s, Prepared& p) { bench_bake(s, p, true); });
  add("whole_pack", [&folder](benchmark::State& s, Prepared& p) { bench_whole(s, p, folder); });
}

std::vector<std::string> listed(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
  return parts;
}

// Takes our own options out of the command line.
Settings take_options(int& argc, char** argv) {
  Settings settings;
  int kept = 1;
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i];
    const auto value = [&](const char* name) { return text.starts_with(name) ? text.substr(std::string(name).size()) : std::string(); };
    if (const std::string list = value("--resolutions="); !list.empty()) {
      settings.resolutions.clear();
      for (const std::string& n : listed(list)) settings.resolutions.push_back(std::stoi(n));
    } else if (const std::string models = value("--models="); !models.empty()) {
      settings.models = listed(models);
    } else if (const std::string triangles = value("--triangles="); !triangles.empty()) {
      settings.sphere_level = 0;
      while (20.0 * std::pow(4, settings.sphere_level) < 0.9 * std::stod(triangles)) ++settings.sphere_level;
    } else {
      argv[kept++] = argv[i];
    }
  }
  argc = kept;
  return settings;
}

int run(int argc, char** argv) {
  const Settings settings = take_options(argc, argv);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  Workshop workshop;
  for (const std::string& model : settings.models) {
    std::string path = find_model(model);
    if (model == "sphere") {
      path = workshop.folder().file("sphere.obj");
      std::ofstream(path, std::ios::binary) << sphere_obj(settings.sphere_level);
    }
    if (path.empty()) {
      std::cerr << "stage_bench: no model " << model << "\n";
      continue;
    }
    for (const int n : settings.resolutions) register_rows(model, path, n, workshop);
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace
}  // namespace texel

int main(int argc, char** argv) { return texel::bench::guarded("stage_bench", texel::run, argc, argv); }
