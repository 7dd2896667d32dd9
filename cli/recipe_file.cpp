#include "cli/recipe_file.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "formats/error.h"

namespace texel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uintmax_t kMostBytes = 64u << 20;  // a recipe is a page, a manifest of 13 levels a few; more is some other file

std::string read_text(const fs::path& path) {
  std::error_code ec;
  if (fs::is_regular_file(path, ec) && fs::file_size(path, ec) > kMostBytes)
    throw Error(Code::kCommandLine, path.string(), "is too large for a recipe");
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  if (file) text << file.rdbuf();
  if (!file || file.bad()) throw Error(Code::kFile, path.string(), "cannot be read", "check the name and its permissions");
  return std::move(text).str();
}

int line_of(const std::string& text, std::size_t byte) {
  return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(std::min(byte, text.size())), '\n'));
}

Json parse(const fs::path& path) {
  const std::string text = read_text(path);
  // Values are written by recursion where they are shown, which deep ones would crash.
  constexpr int kMostDepth = 200;
  int depth = 0;
  const auto shallow = [&](int at, Json::parse_event_t, Json&) { depth = std::max(depth, at); return at <= kMostDepth; };
  try {
    Json json = Json::parse(text, shallow);
    if (depth > kMostDepth) throw Error(Code::kCommandLine, path.string(), "is nested more than " + std::to_string(kMostDepth) + " deep", "a recipe is an object of options, e.g. {\"resolution\": 64}");
    return json;
  } catch (const Json::parse_error& error) {
    throw Error(Code::kCommandLine, path.string() + ":" + std::to_string(line_of(text, error.byte)), "is not JSON",
                "a recipe is an object of options, e.g. {\"resolution\": 64}");
  } catch (const Json::out_of_range&) {
    throw Error(Code::kCommandLine, path.string(), "has a number beyond what a double holds", "the largest is about 1.8e308");
  }
}

// The value as it would stand on the command line; false where nothing like it can.
bool value_text(const Json& value, std::string* text) {
  if (value.is_string()) *text = value.get<std::string>();
  else if (value.is_boolean()) *text = value.get<bool>() ? "true" : "false";
  else if (value.is_number()) *text = value.dump();
  else return false;
  return true;
}

bool apply(const OptionRow& row, const Json& value, Settings& settings) {
  std::string text;
  if (!value.is_array()) return value_text(value, &text) && row.set(settings, text);
  if (row.repeatable) {
    settings.recipe.lights.clear();  // the only one; a recipe's lights replace those of a recipe beneath it
    for (const Json& item : value)
      if (!value_text(item, &text) || !row.set(settings, text)) return false;
    return true;
  }
  std::string joined;
  for (const Json& item : value) {
    if (!value_text(item, &text)) return false;
    joined += (joined.empty() ? "" : ",") + text;
  }
  // An empty list is "none of them", which the command line has no word for.
  return value.empty() ? row.list && row.get(Settings{}).empty() : row.set(settings, joined);
}

void apply_recipe(const Json& recipe, const std::string& where, Settings& settings) {
  if (!recipe.is_object())
    throw Error(Code::kCommandLine, where, "holds no recipe", "a recipe is an object of options, e.g. {\"resolution\": 64}");
  std::vector<OptionRow> rows = option_table();
  std::erase_if(rows, [](const OptionRow& row) { return !row.in_recipe; });
  for (const auto& [key, value] : recipe.items()) {
    const auto row = std::find_if(rows.begin(), rows.end(), [&, &k = key](const OptionRow& r) { return r.key() == k; });
    if (row == rows.end()) {
      std::string known;
      for (const OptionRow& r : rows) known += (known.empty() ? "" : ", ") + r.key();
      throw Error(Code::kCommandLine, where, "unknown key \"" + key + "\"", "known: " + known);
    }
    if (value.is_null()) continue;
    if (!apply(*row, value, settings))
      throw Error(Code::kCommandLine, where, "bad value " + value.dump(-1, ' ', false, Json::error_handler_t::replace) + " of \"" + key + "\"",
                  "accepted: " + row->accepts);
  }
  const auto given = [&](const char* key) { return recipe.contains(key) && !recipe.at(key).is_null(); };
  if (given("samples") && !given("max_error")) settings.recipe.max_error = 0;  // as on the command line
  if (given("resolution") && given("voxel_size"))
    throw Error(Code::kCommandLine, where, "\"resolution\" and \"voxel_size\" cannot be combined", "give one of them");
}

bool is_mesh(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
  constexpr const char* kInputs[] = {".obj", ".ply", ".stl", ".off", ".opf", ".gwa", ".ops", ".lig", ".smb", ".json", ".vdb", ".df3", ".mhd", ".mha", ".inr"};
  return std::any_of(std::begin(kInputs), std::end(kInputs), [&](const char* e) { return extension == e; }) || path.ends_with(".inr.gz");
}

// Numbers stay numbers, words become strings, nothing is null.
Json scalar(const std::string& text) {
  if (text.empty()) return nullptr;
  double number = 0;
  if (!read_number(text, &number)) return text;
  return Json::parse(text);
}

Json list(const std::string& text, char at) {
  Json items = Json::array();
  if (!text.empty())
    for (const std::string& item : split(text, at)) items.push_back(scalar(item));
  return items;
}

}  // namespace

std::vector<std::string> manifest_meshes(const std::string& manifest_path) {
  const Json manifest = parse(manifest_path);
  std::vector<std::string> meshes;
  const auto sources = manifest.find("source");
  if (sources == manifest.end() || !sources->is_array()) return meshes;
  const auto is_input = [](const Json& source) { return source.is_object() && source.contains("input") && source.at("input") == true; };
  // Where the pack says what was named, a mesh beside it is part of a scene.
  const bool says = std::any_of(sources->begin(), sources->end(), is_input);
  for (const Json& source : *sources) {
    if (!source.is_object() || !source.contains("path") || !source.at("path").is_string()) continue;
    const fs::path path = source.at("path").get<std::string>();
    if (says ? !is_input(source) : !is_mesh(path.string())) continue;
    const fs::path mesh = (fs::path(manifest_path).parent_path() / path).lexically_normal();
    std::error_code ec;
    if (!fs::exists(mesh, ec))
      throw Error(Code::kFile, mesh.string(), "source of the pack is not there", "name the mesh as a further argument (a pack far from its source keeps the file's name alone)");
    meshes.push_back(mesh.string());
  }
  return meshes;
}

// The colour picture a recipe names: of a pack the source of that name, of a recipe the file beside it.
void find_height_color(const Json& json, const std::string& file, bool manifest, std::string& color) {
  if (color.empty()) return;
  const fs::path folder = fs::path(file).parent_path();
  std::error_code ec;
  if (manifest && json.contains("source") && json.at("source").is_array()) {
    for (const Json& source : json.at("source")) {
      if (!source.is_object() || !source.contains("path") || !source.at("path").is_string()) continue;
      const fs::path path = source.at("path").get<std::string>();
      if (path.filename() != color || (source.contains("input") && source.at("input") == true)) continue;
      color = (folder / path).lexically_normal().string();
      return;
    }
  }
  if (fs::exists(folder / color, ec)) color = (folder / color).lexically_normal().string();
}

void apply_recipe_text(const std::string& json, const std::string& where, const std::string& file, Settings& settings) {
  const Json recipe = Json::parse(json);
  apply_recipe(recipe, where, settings);
  if (recipe.contains("height_color")) find_height_color(recipe, file, false, settings.recipe.heights.color);
}

void read_recipe_file(const std::string& path, Settings& settings) {
  std::error_code ec;
  const std::string file = fs::is_directory(path, ec) ? (fs::path(path) / "manifest.json").string() : path;
  const Json json = parse(file);
  const bool manifest = json.is_object() && json.contains("format") && json.at("format") == "texel-pack";
  if (manifest) settings.recipe = Recipe{};  // a pack's recipe is whole: nothing beneath it counts
  apply_recipe(manifest && json.contains("recipe") ? json.at("recipe") : json, file, settings);
  find_height_color(json, file, manifest, settings.recipe.heights.color);
  if (manifest && settings.inputs.empty()) settings.inputs = manifest_meshes(file);
}

std::string recipe_json(const Settings& settings) {
  Json recipe = Json::object();
  for (const OptionRow& row : option_table()) {
    if (!row.in_recipe) continue;
    const std::string value = row.get(settings);
    if (row.unsaid && value == row.get(Settings{})) continue;
    if (row.is_switch()) recipe[row.key()] = value == "true";
    else if (row.literal) recipe[row.key()] = value.empty() ? Json(nullptr) : Json(value);
    else if (row.repeatable) recipe[row.key()] = list(value, ' ');
    else if (row.list || value.find(',') != std::string::npos) recipe[row.key()] = list(value, ',');
    else recipe[row.key()] = scalar(value);
  }
  return recipe.dump();
}

}  // namespace texel
