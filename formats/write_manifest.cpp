#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "formats/error.h"
#include "formats/manifest.h"

namespace texel {
namespace {

using Json = nlohmann::ordered_json;  // keys stay in the order of docs/pack-format.md

constexpr const char* kAxisNames[] = {"x", "y", "z"};

Json to_json(const V3d& v) { return {v.x, v.y, v.z}; }
Json to_json(const V3i& v) { return {v.x, v.y, v.z}; }

Json to_json(const FileRecord& f) { return {{"file", f.file}, {"sha256", f.sha256}, {"bytes", f.bytes}}; }

Json to_json(const LevelRecord& l) {
  Json j = to_json(l.file);
  j["resolution"] = to_json(l.grid.n);
  j["voxel_size"] = l.grid.h;
  j["active_voxels"] = l.active;
  j["grids"] = Json::array();
  for (const GridRecord& g : l.grids)
    j["grids"].push_back({{"name", g.name},
                          {"type", g.components == 3 ? "vec3s" : "float"},
                          {"components", g.components},
                          {"stored_as", g.half ? "half" : "float"},
                          {"active_voxels", g.active}});
  return j;
}

Json size_of_stack(const StackRecord& s) {
  return {{"count", s.count}, {"width", s.width}, {"height", s.height}, {"spacing", s.thickness}, {"thickness", s.thickness},
          {"max_angle", s.max_angle}, {"pattern", slice_pattern(s.axis, s.level, s.format)}};
}

void add_sums(Json& j, const StackRecord& s) {
  j["sha256"] = s.sha256;
  j["bytes"] = s.bytes;
}

Json slices_to_json(const std::vector<StackRecord>& stacks) {
  Json j = Json::object();
  for (const StackRecord& s : stacks) {
    Json entry = size_of_stack(s);
    if (s.level > 0) {
      add_sums(entry, s);
      entry["level"] = s.level;
      j.at(kAxisNames[s.axis])["levels"].push_back(entry);
      continue;
    }
    entry["format"] = slice_format_name(s.format);
    entry["color_space"] = s.format == SliceFormat::kPng ? "sRGB" : "linear";
    entry["alpha"] = s.format == SliceFormat::kPng ? "straight" : "premultiplied";
    add_sums(entry, s);
    entry["levels"] = Json::array();
    j[kAxisNames[s.axis]] = entry;
  }
  return j;
}

Json to_json(const Statistics& s) {
  return {{"triangles", s.triangles},       {"degenerate", s.degenerate},     {"components", s.components},
          {"closed", s.closed},             {"area", s.area},                 {"covered_area", s.covered_area},
          {"volume", s.volume},             {"mean_color", {s.mean_color.x, s.mean_color.y, s.mean_color.z}},
          {"border_voxels", s.border_voxels}, {"inside_voxels", s.inside_voxels}};
}

Json recipe_to_json(const std::string& text) {
  if (text.empty()) return Json::object();
  Json recipe = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!recipe.is_object()) throw Error(Code::kRunning, "recipe", "is not a JSON object");
  return recipe;
}

}  // namespace

std::string generator() { return std::string("texel ") + TEXEL_VERSION; }

std::string level_file(int level) { return level == 0 ? "volume.vdb" : "volume_level_" + std::to_string(level) + ".vdb"; }

const char* slice_format_name(SliceFormat format) { return format == SliceFormat::kPng ? "png" : "exr"; }

std::string slice_pattern(int axis, int level, SliceFormat format) {
  return std::string("slices/") + (level == 0 ? "" : "level_" + std::to_string(level) + "/") + kAxisNames[axis] + "/%04d." +
         slice_format_name(format);
}

std::string slice_file(int axis, int level, SliceFormat format, int k) {
  std::string name = slice_pattern(axis, level, format);
  char number[16];
  std::snprintf(number, sizeof number, "%04d", k);
  return name.replace(name.find("%04d"), 4, number);
}

std::string manifest_text(const Manifest& m) {
  Json j;
  j["format"] = "texel-pack";
  j["version"] = kPackVersion;
  j["generator"] = m.generator;
  j["source"] = Json::array();
  for (const SourceFile& s : m.sources) {
    j["source"].push_back({{"path", s.path}, {"sha256", s.sha256}, {"bytes", s.bytes}});
    if (s.input) j["source"].back()["input"] = true;
  }
  j["recipe"] = recipe_to_json(m.recipe_json);
  const Box3d box = m.grid.box();
  j["box"] = {{"min", to_json(box.min)}, {"max", to_json(box.max)}};
  j["resolution"] = to_json(m.grid.n);
  j["voxel_size"] = m.grid.h;
  j["cyclic"] = {m.cyclic[0], m.cyclic[1], m.cyclic[2]};
  j["levels"] = Json::array();
  for (const LevelRecord& l : m.levels) j["levels"].push_back(to_json(l));
  j["slices"] = slices_to_json(m.slices);
  if (m.preview) j["preview"] = to_json(*m.preview);
  j["statistics"] = to_json(m.statistics);
  if (m.cube) {
    const SolidCube& c = *m.cube;
    j["solid_texture"] = {{"octaves", c.octaves}, {"cells", c.cells}, {"weights_start", c.weights_start}, {"weights_end", c.weights_end},
                          {"mean", to_json(c.mean)}, {"deviation", to_json(c.deviation)}};
  }
  j["error"] = Json::object();
  for (const ErrorFigure& e : m.errors) j["error"][e.measure] = {{"value", e.value}, {"how", e.how}};
  j["issues"] = Json::array();
  for (const Issue& i : m.issues) j["issues"].push_back({{"id", i.id}, {"text", i.text}, {"count", i.count}, {"where", i.where}});
  j["skipped"] = Json::array();
  for (const Skip& s : m.skipped) j["skipped"].push_back({{"what", s.what}, {"why", s.why}});
  // Texts come from file names and materials, which need not be UTF-8; the manifest has to be.
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace texel
