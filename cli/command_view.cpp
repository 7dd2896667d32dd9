// texel view: pack or meshes -> picture.
#include <tbb/global_control.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "bake/fibre.h"
#include "bake/hypertexture.h"
#include "bake/view.h"
#include "bake/view_over.h"
#include "bake/view_zoom.h"
#include "cli/commands.h"
#include "cli/input_scene.h"
#include "cli/interrupt.h"
#include "cli/pack_sources.h"
#include "cli/print.h"
#include "formats/error.h"
#include "formats/instances.h"
#include "formats/read.h"
#include "formats/read_pack.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

constexpr int kTruthVoxels = 256;  // the lattice on which an implicit surface without a pack becomes triangles

enum class Format { kPng, kExr };

constexpr int kZoomPictures = 8;  // steps of a zoom cycle

Format picture_format(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
  if (extension == ".png") return Format::kPng;
  if (extension == ".exr") return Format::kExr;
  throw Error(Code::kUnsupported, path, "pictures of extension \"" + extension + "\" cannot be written", "use .png or .exr");
}

Box3d bounds(const Scene& scene) {
  if (scene.hypertexture) return density_bounds(*make_density(*scene.hypertexture, 0));
  Box3d box = surface_bounds(scene);
  box.extendBy(fibre_bounds(scene.fibres));
  return box;
}

// What has no meaning in a mode is refused where it would change the picture asked for; light may stay, for the three modes side by side.
void check_mode(const ViewSettings& view, const std::string& mode, bool lights, Report& report) {
  if (view.axis >= 0 && mode != "slices") throw Error(Code::kCommandLine, "--axis", "chooses among slices and means nothing to --mode " + mode, "add --mode slices");
  if (view.level >= 0 && mode == "truth") throw Error(Code::kCommandLine, "--level", "means nothing to --mode truth", "leave it out");
  if ((lights || view.no_shadows) && mode == "slices")
    report.issue("light-not-used", "slices hold the light they were baked with; --light and --no-shadows change nothing");
}

// What belongs to --over is refused without it, and what it has no use for with it.
void check_over(const ViewSettings& view, const std::string& mode) {
  const std::pair<const char*, bool> options[] = {{"--repeat", view.repeat_u > 0}, {"--texel-height", view.texel_height > 0}, {"--tips", !view.tips.empty()}, {"--ground", view.ground.x >= 0}};
  for (const auto& [name, given] : options)
    if (given && view.over.empty()) throw Error(Code::kCommandLine, name, "says how a pack lies over a surface, and none is named", "add --over plane, sphere or a mesh");
  if (view.over.empty()) return;
  if (!mode.empty() && mode != "volume") throw Error(Code::kCommandLine, "--over", "repeats a pack's volume and means nothing to --mode " + mode, "leave one of them out");
  const bool mesh = view.over != "plane" && view.over != "sphere";
  if (!view.tips.empty() && !mesh) throw Error(Code::kCommandLine, "--tips", "is for a mesh, and --over " + view.over + " is none", "name a mesh there");
  if (!view.tips.empty() && view.texel_height > 0) throw Error(Code::kCommandLine, "--tips", "gives the height vectors, and so does --texel-height", "leave one of them out");
}

// Points that the camera has to see, of a surface and its height vectors.
std::vector<V3d> ends(const TexelSurface& surface) {
  std::vector<V3d> points;
  for (const auto& triangle : surface.triangles)
    for (const std::uint32_t p : triangle) points.insert(points.end(), {surface.points[p], surface.tips[p]});
  return points;
}

Image render_over(const Settings& settings, const Pack& pack, int pack_up, ViewOptions& options, Report& report) {
  const ViewSettings& view = settings.view;
  const TexelAxes axes = texel_axes(pack_up);
  const Box3d box = pack.grid.box();
  const bool plane = view.over == "plane", sphere = view.over == "sphere";
  const int nu = view.repeat_u > 0 ? view.repeat_u : plane ? 5 : sphere ? 12 : 1, nv = view.repeat_v > 0 ? view.repeat_v : plane ? 5 : sphere ? 6 : 1;
  const double height = view.texel_height > 0 ? view.texel_height : plane || sphere ? box.size()[axes.up] : 0;
  int up = settings.recipe.up >= 0 ? settings.recipe.up : pack_up;
  TexelSurface surface;
  if (plane) {
    surface = plane_surface(box, axes, nu, nv, height);
  } else if (sphere) {
    surface = sphere_surface(box, axes, nu, nv, height);
  } else {
    const Scene scene = flatten_instances(read_scene(view.over, report));
    std::optional<Scene> tips;
    if (!view.tips.empty()) tips = flatten_instances(read_scene(view.tips, report));
    surface = mesh_surface(scene, tips ? &*tips : nullptr, box, axes, nu, nv, height, view.over, report);
    up = up_axis(settings.recipe.up, scene.sources);
  }
  options.camera = frame_points(ends(surface), view.azimuth, view.elevation, view.fov, up, static_cast<double>(view.width) / view.height);
  options.camera.eye = options.camera.target + (options.camera.eye - options.camera.target) * view.distance;
  return view_over(pack, surface, {axes, view.ground}, options, report);
}

Image render(const Settings& settings, ViewOptions& options, Report& report) {
  const ViewSettings& view = settings.view;
  const std::string mode = view.truth ? "truth" : view.mode;
  const std::string input = settings.inputs.empty() ? std::string() : settings.inputs.front();
  const auto aim = [&](const Box3d& box, int up) {
    options.camera = orbit_camera(box, view.azimuth, view.elevation, view.fov, up, static_cast<double>(view.width) / view.height);
    options.camera.eye = options.camera.target + (options.camera.eye - options.camera.target) * view.distance;
  };
  check_over(view, mode);
  std::error_code ec;
  if (input.empty() || !fs::is_directory(input, ec)) {
    if (!view.over.empty()) throw Error(Code::kCommandLine, "--over", "repeats a pack, and " + (input.empty() ? "a function" : input) + " is none", "bake it first");
    if (!mode.empty() && mode != "truth")
      throw Error(Code::kCommandLine, "--mode " + mode, "needs a pack, and " + (input.empty() ? "a function" : input) + " is none", "bake it first, or use --mode truth");
    check_mode(view, "truth", false, report);
    Recipe recipe = settings.recipe;
    recipe.resolution = V3i(kTruthVoxels, 0, 0);
    const Scene scene = meshed(input_scene(settings, report), recipe, report);
    aim(bounds(scene), up_axis(settings.recipe.up, scene.sources));
    return view_truth(scene, options, report);
  }
  check_mode(view, mode.empty() ? "volume" : mode, !settings.recipe.lights.empty(), report);
  if (settings.inputs.size() > 1 && mode != "truth")
    throw Error(Code::kCommandLine, settings.inputs[1], "one argument too many", "meshes beside a pack are for --mode truth");
  const Pack pack = read_pack(input);
  if (mode == "zoom") return view_zoom(pack, view.height, kZoomPictures);
  // The same camera for the pack and its truth; the side that is up is the one the pack was baked with, unless it is asked for.
  const Recipe recorded = recorded_recipe(input);
  const int up = settings.recipe.up >= 0 ? settings.recipe.up : recorded.up;
  if (!view.over.empty()) return render_over(settings, pack, up_axis(recorded.up, pack.sources), options, report);
  aim(pack.grid.box(), up_axis(up, pack.sources));
  if (mode == "truth") {
    const Scene scene = meshed(source_scene(settings, pack.sources, report), recorded, report);
    options.two_sided = recorded.two_sided;
    options.cyclic = pack.cyclic;
    options.grid = pack.grid;
    return view_truth(scene, options, report);
  }
  return mode == "slices" ? view_slices(pack, options, report) : view_volume(pack, options, report);
}

}  // namespace

int command_view(const Settings& settings) {
  if (settings.inputs.empty() && !makes_scene(settings)) throw Error(Code::kCommandLine, "INPUT", "missing", "name a pack or a mesh");
  if (settings.output.empty()) throw Error(Code::kCommandLine, "--output", "missing", "name the picture, e.g. -o tree.png");
  const Format format = picture_format(settings.output);
  require_file_place(settings.output);
  std::optional<tbb::global_control> limit;
  if (settings.recipe.threads > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(settings.recipe.threads));

  Report report;
  ProgressBar bar(settings.progress);
  report.progress = [&bar](const std::string& stage, double done) {
    stop_if_interrupted();
    bar.update(stage, done);
  };
  const ViewSettings& view = settings.view;
  ViewOptions options;
  options.width = view.width;
  options.height = view.height;
  options.samples = view.samples;
  options.lights = settings.recipe.lights;
  options.shadows = !view.no_shadows;
  options.level = view.level;
  options.slice_axis = view.axis;
  options.threads = settings.recipe.threads;
  Image image = render(settings, options, report);
  stop_if_interrupted();
  if (view.background.x >= 0) image = over_background(image, view.background);
  if (format == Format::kPng) write_png(image, settings.output);
  else write_exr(image, settings.output);
  bar.clear();
  print_warnings(report.issues);
  if (settings.verbose) print_stages(report);
  return 0;
}

}  // namespace texel
