// OPS (Open Plant Scene): a table of plants and where they stand.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <optional>

#include "formats/error.h"
#include "formats/plant_files.h"
#include "formats/readers.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostInstances = std::size_t{1} << 24;

// The fields between runs of tabs, so that names may have blanks; where these are fewer than nine, between any blanks.
std::vector<std::string_view> fields_of(std::string_view line) {
  for (const bool tabs_only : {true, false}) {
    std::vector<std::string_view> fields;
    const char* separators = tabs_only ? "\t" : " \t\v\f";
    for (std::size_t at = line.find_first_not_of(separators); at != std::string_view::npos; at = line.find_first_not_of(separators, at)) {
      const std::size_t end = std::min(line.size(), line.find_first_of(separators, at));
      std::string_view field = line.substr(at, end - at);
      while (!field.empty() && is_blank(field.front())) field.remove_prefix(1);
      while (!field.empty() && is_blank(field.back())) field.remove_suffix(1);
      if (!field.empty()) fields.push_back(field);
      at = end;
      if (at == line.size()) break;
    }
    if (fields.size() >= 9 || !tabs_only) return fields;
  }
  return {};
}

bool whole(std::string_view text, double& value) {
  return !text.empty() && parse_number(text.data(), text.data() + text.size(), value) == text.data() + text.size();
}
bool whole_number(std::string_view text, double& value) { return whole(text, value) && std::abs(value) < 9e15 && value == std::floor(value); }

Affine turn(const V3d& axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), k = 1 - c;
  Affine r;
  r.m = {c + k * axis.x * axis.x,          k * axis.x * axis.y - s * axis.z, k * axis.x * axis.z + s * axis.y, 0,
         k * axis.y * axis.x + s * axis.z, c + k * axis.y * axis.y,          k * axis.y * axis.z - s * axis.x, 0,
         k * axis.z * axis.x - s * axis.y, k * axis.z * axis.y + s * axis.x, c + k * axis.z * axis.z,          0};
  return r;
}

std::string extension_of(const std::string& name) {
  std::string extension = fs::path(name).extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

void check_name(const std::string& name, const std::string& where) {
  const fs::path path(name);
  bool leads_out = path.is_absolute() || (name.size() > 1 && name[1] == ':');
  for (const fs::path& part : path) leads_out = leads_out || part == "..";
  if (leads_out) throw Error(Code::kBadInput, where, shown_as(name) + " leads out of the scene's folder", "put the plant beside the scene or below it");
}

}  // namespace

std::vector<OpsRow> read_ops_rows(const Input& input, const PlantOptions& options, Report& report) {
  TextScanner text(input);
  std::vector<OpsRow> rows;
  double scene = 0;
  bool first = true;
  std::int64_t unknown = 0, others = 0;
  std::string unknown_where, others_where;
  for (; !text.at_end(); text.next_line()) {
    const char* start = text.position();
    const char* stop = start;
    while (stop != text.end() && !is_line_end(*stop)) ++stop;
    std::string_view line(start, static_cast<std::size_t>(stop - start));
    if (line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
    const std::vector<std::string_view> fields = fields_of(line);
    if (fields.empty() || fields[0].starts_with('#') || fields[0] == "T") continue;  // remarks, terrain
    double ids[3] = {};
    const bool numbered = fields.size() >= 3 && whole_number(fields[0], ids[0]) && whole_number(fields[1], ids[1]);
    if (numbered && fields.size() == 3 && whole_number(fields[2], ids[2])) continue;  // scenes that follow one another
    if (!numbered || fields.size() < 9) {
      if (unknown++ == 0) unknown_where = text.where(start);
      continue;
    }
    double v[7] = {0, 0, 0, 1, 0, 0, 0};  // x y z scale azimuth inclination twist
    const bool scaled = fields.size() >= 10;
    for (std::size_t i = 0, field = 3; i < 7; ++i) {
      if (i == 3 && !scaled) continue;
      if (!whole(fields[field], v[i]) || !(std::abs(v[i]) <= 1e30)) throw Error(Code::kBadInput, text.where(start), "is not a finite number (" + shown_as(fields[field]) + ")");
      ++field;
    }
    if (first) scene = ids[0];
    first = false;
    if (ids[0] != scene) {
      if (others++ == 0) others_where = text.where(start);
      continue;
    }
    OpsRow row;
    row.where = text.where(start);
    row.file = std::string(fields[2]);
    for (char& c : row.file)
      if (c == '\\') c = '/';
    check_name(row.file, row.where);
    const double unit = options.radians ? 1 : std::numbers::pi / 180;
    Affine move;
    move.m[3] = v[0];
    move.m[7] = v[1];
    move.m[11] = v[2];
    const double azimuth = v[4] * unit;
    row.placement = move * turn(V3d(-std::sin(azimuth), std::cos(azimuth), 0), v[5] * unit) * Affine::scale(v[3] == 0 ? 1 : v[3]) * turn(V3d(0, 0, 1), v[6] * unit);
    rows.push_back(std::move(row));
  }
  if (unknown) report.issue("plant-rows", "rows of a scene that place no file; skipped", unknown, unknown_where);
  if (others) report.issue("plant-scenes", "rows of further scenes in the file (times, variants); only the first scene is read", others, others_where);
  return rows;
}

Scene read_ops(const Input& input, const PlantOptions& options, const ReadMesh& read_mesh, Report& report) {
  struct Part {
    std::optional<Plant> plant;    // of one row only
    std::optional<Scene> mesh;     // likewise
    std::uint32_t first_material = 0;
    std::int64_t rows = 0, organs = 0;
    bool open = false, known = false;
    std::vector<Instance> placed;  // of several rows: what stands in it
    double reach = 0;
  };
  Scene scene;
  std::vector<Part> parts;
  std::map<std::string, std::size_t> numbers;  // by the file it really is
  std::map<std::string, std::pair<std::size_t, std::string>> named;  // by the name in a row: the part, and the file found
  constexpr std::size_t kNone = ~std::size_t{0};
  std::int64_t skipped = 0, placed = 0, organs = 0;
  std::string skipped_where, skipped_name;
  const auto find = [&](const OpsRow& row) -> std::pair<std::size_t, std::string> {
    const std::string extension = extension_of(row.file);
    const bool plant = extension == ".opf" || extension == ".gwa" || extension == ".lig";
    const std::string found = find_beside(input.path, row.file);
    if (found.empty() && !plant) return {kNone, found};
    if (found.empty()) throw Error(Code::kFile, row.file, "named at " + row.where + ", is not there", "put it beside the scene");
    std::error_code ec;
    const fs::path real = fs::weakly_canonical(found, ec);
    const auto at = numbers.try_emplace(ec ? found : real.string(), parts.size());
    if (at.second) parts.emplace_back();
    return {at.first->second, found};
  };
  const auto read = [&](const OpsRow& row, const std::string& found, Part& part) {
    part.open = true;
    const std::string extension = extension_of(row.file);
    if (extension == ".opf" || extension == ".gwa" || extension == ".lig") {
      const FileBytes bytes(found);
      const Input file{bytes.bytes(), found};
      std::vector<std::string> files{found};
      part.plant = extension == ".lig" ? open_line_tree(file, files, report) : read_opf(file, report);
      for (const std::string& used : files) add_source(scene, used);
      part.organs = static_cast<std::int64_t>(part.plant->organs.size());
      part.first_material = static_cast<std::uint32_t>(scene.materials.size());
      scene.materials.insert(scene.materials.end(), part.plant->materials.begin(), part.plant->materials.end());
    } else if (read_mesh) {
      part.mesh = read_mesh(found);
    }
    part.known = part.plant || part.mesh;
    if (part.mesh && part.mesh->fibres.strands() > 0) throw Error(Code::kUnsupported, found, "holds fibres or lines, which scenes of plants do not place", "leave lines out by --fibre-radius 0");
  };
  const auto in_metres = [&](const Plant& plant) { return Affine::scale(options.unit > 0 ? options.unit : plant.unit); };
  // A part of several rows, in its own space.
  const auto make_shape = [&](const OpsRow& row, Part& part) {
    Scene own;
    if (part.mesh) {
      own = *std::move(part.mesh);
      part.reach = scene_reach(own);
      part.placed = take_instances(own);
      for (Instance& one : part.placed) one.shape += static_cast<std::uint32_t>(scene.shapes.size());
      join_scenes(scene, std::move(own));
    } else {
      place_plant(*part.plant, in_metres(*part.plant), part.first_material, own, report, row.where);
      if (!own.mesh.triangles.empty()) {
        finish_mesh(own, report, row.where, "holds no drawable geometry");
        part.reach = mesh_reach(own.mesh);
        part.placed = {{static_cast<std::uint32_t>(scene.shapes.size()), Affine()}};
        scene.shapes.push_back(std::move(own.mesh));
      }
    }
    part.mesh.reset();
    part.plant.reset();
  };

  const std::vector<OpsRow> rows = read_ops_rows(input, options, report);
  std::vector<std::size_t> part_of;
  part_of.reserve(rows.size());
  for (const OpsRow& row : rows) {
    const auto [at, added] = named.try_emplace(row.file);
    if (added) at->second = find(row);
    part_of.push_back(at->second.first);
    if (at->second.first != kNone) ++parts[at->second.first].rows;
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const OpsRow& row = rows[i];
    Part* part = part_of[i] == kNone ? nullptr : &parts[part_of[i]];
    if (part && !part->open) {
      read(row, named[row.file].second, *part);
      if (part->rows > 1 && part->known) make_shape(row, *part);
      else if (part->mesh) part->reach = scene_reach(*part->mesh);
    }
    if (!part || !part->known) {
      if (skipped++ == 0) {
        skipped_where = row.where;
        skipped_name = row.file;
      }
      continue;
    }
    if (!row.placement.invertible() || !(row.placement.reach(part->reach) <= 1e100))
      throw Error(Code::kBadInput, row.where, "is a transform that makes things flat or infinite", "leave the row out");
    if (!part->placed.empty()) {
      if (part->placed.size() > kMostInstances - std::min(scene.instances.size(), kMostInstances))
        throw Error(Code::kUnsupported, row.where, "has more than 2^24 instances with the rows before, those of its meshes included", "bake parts of it by themselves");
      for (const Instance& one : part->placed) scene.instances.push_back({one.shape, row.placement * one.place});
    } else if (part->plant) {
      place_plant(*part->plant, row.placement * in_metres(*part->plant), part->first_material, scene, report, row.where);
    } else if (part->mesh) {
      move_scene(*part->mesh, row.placement);
      join_scenes(scene, *std::move(part->mesh));
    }
    ++placed;
    organs += part->organs;
    if (report.progress && placed % 64 == 0) report.progress("place plants", static_cast<double>(placed) / static_cast<double>(rows.size()));
  }
  if (skipped) report.issue("plant-part", "rows that place other files than plants and meshes, or meshes that are not there (first: " + shown_as(skipped_name) + "); skipped", skipped, skipped_where);
  report.count("plants", static_cast<double>(placed));
  report.count("organs", static_cast<double>(organs));
  finish_mesh(scene, report, input.path, "places no plant with drawable geometry");
  return scene;
}

}  // namespace texel
