#include "cli/bake_one.h"

#include <malloc.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <future>
#include <limits>
#include <numbers>

#include "bake/bake.h"
#include "bake/fibre.h"
#include "bake/height_mesh.h"
#include "bake/polygonize.h"
#include "bake/view.h"
#include "cli/input_scene.h"
#include "cli/interrupt.h"
#include "cli/print.h"
#include "cli/recipe_file.h"
#include "formats/error.h"
#include "formats/instances.h"
#include "formats/write.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

std::string size_text(const V3i& n) {
  return std::to_string(n.x) + " x " + std::to_string(n.y) + " x " + std::to_string(n.z);
}

// Make's own special characters in a file name.
std::string make_escaped(const std::string& path) {
  std::string out;
  for (const char c : path) {
    if (c == ' ' || c == '#') out += '\\';
    if (c == '$') out += '$';
    out += c;
  }
  return out;
}

// The manifest is the file that stands for the pack: it is written last.
void write_depfile(const Settings& settings, const Scene& scene) {
  std::string text = make_escaped((fs::path(settings.output) / "manifest.json").string()) + ":";
  const auto add = [&](const std::string& path) { text += " \\\n  " + make_escaped(path); };
  for (const SourceFile& source : scene.sources) add(source.path);
  if (!settings.recipe_file.empty()) {
    std::error_code ec;
    add(fs::is_directory(settings.recipe_file, ec) ? (fs::path(settings.recipe_file) / "manifest.json").string() : settings.recipe_file);
  }
  write_text_file(settings.depfile, text + "\n");
}

double mesh_area(const Mesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const V3d a = mesh.points[t[0]];
    area += 0.5 * (mesh.points[t[1]] - a).cross(mesh.points[t[2]] - a).length();
  }
  return area;
}

// Enough to tell 200 MB from 20 GB. A surface of area A crosses about 1.5·A/h² cells (a plane at a random angle), and a bundle of
// samples² rays per cell and axis meets it about 1.5·A/h²·samples² times in all three axes.
double memory_estimate(const Scene& scene, const Settings& settings, const Grid& grid) {
  const Recipe& recipe = settings.recipe;
  const Mesh& mesh = scene.mesh;
  // A density fills its box about half, and keeps no crossings.
  if (scene.hypertexture) return 0.5 * static_cast<double>(grid.voxels()) * 400;
  // Of a function nothing is known but its box: as much surface as an ellipsoid that fills it, two triangles a cell.
  double implicit_area = 0;
  for (const Implicit& solid : scene.implicits) {
    const V3d size = (solid.box.isEmpty() ? grid.box() : solid.box).size();
    implicit_area += 2 * std::numbers::pi / 4 * (size.x * size.y + size.y * size.z + size.z * size.x);
  }
  double placed_area = 0;
  std::vector<double> shape_areas;
  for (const Mesh& shape : scene.shapes) shape_areas.push_back(mesh_area(shape));
  for (const Instance& instance : scene.instances) placed_area += shape_areas[instance.shape] * std::pow(std::abs(instance.place.determinant()), 2.0 / 3);
  const double area = mesh_area(mesh) + placed_area + fibre_area(scene.fibres) + implicit_area, made = 2 * 1.5 * implicit_area / (grid.h * grid.h) * 100;
  double geometry = made + 24.0 * static_cast<double>(mesh.points.size()) + 60.0 * static_cast<double>(mesh.triangles.size());
  for (const Mesh& shape : scene.shapes) geometry += 24.0 * static_cast<double>(shape.points.size()) + 140.0 * static_cast<double>(shape.triangles.size());  // with its tree
  geometry += 370.0 * static_cast<double>(scene.instances.size()) + 112.0 * static_cast<double>(scene.fibres.points.size());  // in the scene and in the plan
  const double cells = std::min(1.5 * area / (grid.h * grid.h), static_cast<double>(grid.voxels()));
  constexpr double kBytesPerCell = 4 * 40, kBytesPerCrossing = 24;  // 40 stored floats and moments; place, triangle, side
  const double crossings = cells * recipe.samples * recipe.samples;
  const double slice = 16.0 * std::max({1.0 * grid.n.x * grid.n.y, 1.0 * grid.n.y * grid.n.z, 1.0 * grid.n.x * grid.n.z});
  return geometry + cells * kBytesPerCell + crossings * kBytesPerCrossing + (recipe.want.slices ? 4 * slice : 0);
}

std::string shown(double v) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", v);
  return buffer;
}

std::string height_lines(const Scene& scene) {
  std::string text;
  for (const HeightField& field : scene.heights) {
    const std::string kind = field.function ? "noise" : std::to_string(field.width) + " x " + std::to_string(field.height) + " samples";
    text += "heights     " + field.name + ": " + kind + ", " + shown(field.size.x) + " x " + shown(field.size.y) + ", from " +
            shown(field.low) + " to " + shown(field.high) + ", solid down to " + shown(field.base) + "\n";
  }
  return text;
}

std::string plan_text(const Scene& scene, const Settings& settings, const Grid& grid, const std::string& fresh) {
  const Recipe& recipe = settings.recipe;
  const Box3d box = grid.box();
  std::string text;
  const auto line = [&](const std::string& what, const std::string& value) {
    text += what + std::string(what.size() < 12 ? 12 - what.size() : 1, ' ') + value + "\n";
  };
  const auto corner = [&](const V3d& v) { return "(" + shown(v.x) + ", " + shown(v.y) + ", " + shown(v.z) + ")"; };
  if (scene.hypertexture) line("density", hypertexture_name(scene.hypertexture->preset));
  else line("triangles", grouped(static_cast<std::int64_t>(count_triangles(scene))));
  if (!scene.instances.empty()) line("instances", grouped(static_cast<std::int64_t>(scene.instances.size())) + " of " + grouped(static_cast<std::int64_t>(scene.shapes.size())) + (scene.shapes.size() == 1 ? " shape" : " shapes"));
  if (const std::size_t strands = scene.fibres.strands()) line("fibres", grouped(static_cast<std::int64_t>(strands)) + " of " + grouped(static_cast<std::int64_t>(scene.fibres.points.size() - strands)) + " segments");
  if (!scene.implicits.empty()) line("implicit", grouped(static_cast<std::int64_t>(scene.implicits.size())) + (scene.implicits.size() == 1 ? " solid" : " solids"));
  line("box", corner(box.min) + " .. " + corner(box.max));
  line("grid", size_text(grid.n) + " voxels of " + shown(grid.h));
  line("memory", "about " + bytes_text(memory_estimate(scene, settings, grid)));
  if (recipe.want.volume()) line("volume", recipe.want.levels ? "with coarser levels" : "level 0 only");
  else line("volume", "skipped: not wanted");
  std::string axes;
  for (std::size_t a = 0; a < 3; ++a)
    if (recipe.slice_axes[a]) axes += (axes.empty() ? "" : ", ") + std::string(1, static_cast<char>('x' + a));
  line("slices", recipe.want.slices && !axes.empty() ? "along " + axes : "skipped: not wanted");
  line("preview", recipe.want.preview ? "yes" : "skipped: not wanted");
  if (!settings.output.empty()) line("pack", settings.output + ": " + fresh);
  return text;
}

}  // namespace

double now_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void keep_freed_memory(bool one_arena) {
  if (one_arena) mallopt(M_ARENA_MAX, 1);
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
}

void bake_pack(const Settings& settings, Report& report, Outcome& outcome) {
  const double start = now_seconds();
  // Opening the volume library takes as long as reading a small mesh; both at once, unless there is a pack that may be up to date.
  std::future<void> opening;
  std::error_code ec;
  const bool nothing_there = settings.force || !fs::exists(fs::path(settings.output) / "manifest.json", ec);
  if (settings.recipe.want.volume() && nothing_there && !settings.plan) opening = open_volume_writer();
  Scene scene;
  {
    const StageTimer timer(report, "read");
    scene = input_scene(settings, report);
  }
  outcome.sources = scene.sources;
  stop_if_interrupted();
  const std::string recipe = recipe_json(settings);
  std::string why;
  const bool fresh = !settings.output.empty() && !settings.force && pack_up_to_date(settings.output, scene, recipe, &why);
  if (settings.plan) {
    const std::string fields = height_lines(scene);
    scene = mesh_heights(std::move(scene), settings.recipe, report);
    print_product(fields + plan_text(scene, settings, plan_grid(scene, settings.recipe), fresh ? "up to date" : why.empty() ? "to be baked" : "to be baked: " + why));
    outcome.status = "planned";
    return;
  }
  if (fresh) {
    // A build tool goes by time stamps: this pack has been looked at now.
    if (!settings.depfile.empty()) {
      fs::last_write_time(fs::path(settings.output) / "manifest.json", fs::file_time_type::clock::now(), ec);
      write_depfile(settings, scene);
    }
    outcome.closing = settings.output + ": up to date (--force bakes it anyway)";
    outcome.status = "up to date";
    return;
  }
  // What writing needs is looked for before the work is done.
  require_place(settings.output);
  if (settings.recipe.want.slices) require_slice_writer(settings.recipe.write.slice_format);
  if (settings.recipe.want.volume() && !opening.valid()) opening = open_volume_writer();
  // A scene that repeats is baked as triangles, and what is made of functions and heights stands last among them.
  if (settings.recipe.cyclic != std::array<bool, 3>{} && !scene.instances.empty() && !(scene.implicits.empty() && scene.heights.empty())) scene = flatten_instances(scene);
  scene = polygonize(mesh_heights(std::move(scene), settings.recipe, report), settings.recipe, report);  // here rather than in bake: the preview shows it too
  Pack& pack = outcome.pack.emplace(bake(scene, settings.recipe, report));
  pack.recipe_json = recipe;
  pack.sources = scene.sources;
  if (settings.recipe.want.preview) {
    const StageTimer timer(report, "preview");
    constexpr int kTile = 320;
    Report views;  // its pictures time themselves; here they count as one stage
    views.progress = report.progress;
    const SheetOptions sheet{.tile = kTile, .up = up_axis(settings.recipe.up, scene.sources), .lights = settings.recipe.lights,
                             .shadows = settings.recipe.shadows, .threads = settings.recipe.threads, .two_sided = settings.recipe.two_sided};
    pack.preview = contact_sheet(pack, &scene, sheet, views);
    for (const Issue& issue : views.issues) report.issue(issue.id, issue.text, issue.count, issue.where);
  }
  stop_if_interrupted();
  write_pack(pack, settings.output, settings.recipe.write, report);
  if (!settings.depfile.empty()) write_depfile(settings, scene);
  outcome.status = "baked";
  const auto counted = [](std::size_t n, const char* what) { return std::to_string(n) + " " + what + (n == 1 ? ", " : "s, "); };
  outcome.closing = settings.output + ": pack written, " + size_text(pack.grid.n) + " voxels, " + counted(pack.levels.size(), "level") +
                    counted(pack.slices.size(), "stack") + seconds_text(now_seconds() - start);
}

}  // namespace texel
