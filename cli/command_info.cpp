// texel info: what is in a pack, from its manifest alone.
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/print.h"
#include "formats/error.h"
#include "formats/read_pack.h"

namespace texel {
namespace {

using Json = nlohmann::ordered_json;

// Manifests come from anywhere: what is missing or of another type is shown as "-".
std::string plain(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_integer()) return grouped(value.get<std::int64_t>());
  if (value.is_number_float()) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.6g", value.get<double>());
    return buffer;
  }
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_array()) {
    std::string text;
    for (const Json& item : value) text += (text.empty() ? "" : ", ") + plain(item);
    return text;
  }
  return "-";
}

const Json& member(const Json& object, const char* key) {
  static const Json nothing;
  if (!object.is_object()) return nothing;
  const auto found = object.find(key);
  return found == object.end() ? nothing : *found;
}

std::string bytes_of(const Json& object) {
  const Json& bytes = member(object, "bytes");
  return bytes.is_number() ? bytes_text(bytes.get<double>()) : "-";
}

std::string by_x(const Json& triple) {
  if (!triple.is_array()) return plain(triple);
  std::string text;
  for (const Json& item : triple) text += (text.empty() ? "" : " x ") + plain(item);
  return text;
}

class Table {
 public:
  void line(const std::string& what, const std::string& value) {
    constexpr std::size_t kColumn = 14;
    text_ += what + std::string(what.size() < kColumn ? kColumn - what.size() : 1, ' ') + value + "\n";
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

void add_levels(Table& table, const Json& levels) {
  if (!levels.is_array()) return;
  int number = 0;
  for (const Json& level : levels) {
    std::string grids;
    const Json& list = member(level, "grids");
    if (list.is_array())
      for (const Json& grid : list) grids += " " + plain(grid.is_object() ? member(grid, "name") : grid);
    table.line("level " + std::to_string(number++), by_x(member(level, "resolution")) + ", " + plain(member(level, "active_voxels")) +
                                                        " active voxels, " + bytes_of(level) + ":" + grids);
  }
}

// What makes the volumes smaller than they would be; nothing where nothing does.
void add_packing(Table& table, const Json& recipe) {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  for (const char* key : {"prune", "quantize"})
    if (const Json& value = member(recipe, key); value.is_number() && value.get<double>() > 0) add(std::string(key) + " " + plain(value));
  if (const Json& codec = member(recipe, "codec"); codec.is_string() && codec != "blosc") add("codec " + plain(codec));
  if (!text.empty()) table.line("packed", text);
}

void add_slices(Table& table, const Json& slices) {
  if (!slices.is_object()) return;
  for (const auto& [axis, stack] : slices.items()) {
    table.line("slices " + axis, plain(member(stack, "count")) + " of " + plain(member(stack, "width")) + " x " + plain(member(stack, "height")) +
                                     ", thickness " + plain(member(stack, "thickness")) + ", up to " + plain(member(stack, "max_angle")) +
                                     " degrees, " + plain(member(stack, "color_space")) + ", " + bytes_of(stack));
  }
}

// Error figures are bounds and rounding leftovers: two digits say all there is to know.
std::string figure(const Json& value) {
  if (!value.is_number()) return plain(value);
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.2g", value.get<double>());
  return buffer;
}

std::string table_text(const Json& manifest, bool verbose) {
  Table table;
  table.line("generator", plain(member(manifest, "generator")));
  if (member(manifest, "source").is_array())
    for (const Json& source : member(manifest, "source")) table.line("source", plain(member(source, "path")) + ", " + bytes_of(source));
  const Json& box = member(manifest, "box");
  table.line("box", "(" + plain(member(box, "min")) + ") .. (" + plain(member(box, "max")) + ")");
  table.line("resolution", by_x(member(manifest, "resolution")) + " voxels of " + plain(member(manifest, "voxel_size")));
  add_levels(table, member(manifest, "levels"));
  add_packing(table, member(manifest, "recipe"));
  add_slices(table, member(manifest, "slices"));
  const auto pairs = [&](const char* key, const auto& value) {
    const Json& object = member(manifest, key);
    if (object.is_object())
      for (const auto& [name, item] : object.items()) table.line(name, value(item));
  };
  pairs("statistics", [](const Json& item) { return plain(item); });
  pairs("error", [verbose](const Json& item) { return figure(member(item, "value")) + (verbose ? " (" + plain(member(item, "how")) + ")" : ""); });
  if (member(manifest, "issues").is_array())
    for (const Json& i : member(manifest, "issues"))
      table.line("issue", "[" + plain(member(i, "id")) + "] " + plain(member(i, "text")) +
                              (member(i, "count") == 1 ? "" : " (" + plain(member(i, "count")) + " times)"));
  if (member(manifest, "skipped").is_array())
    for (const Json& s : member(manifest, "skipped")) table.line("skipped", plain(member(s, "what")) + ": " + plain(member(s, "why")));
  return table.text();
}

}  // namespace

int command_info(const Settings& settings) {
  const std::string text = read_manifest(only_input(settings, "PACK"));
  print_product(settings.json ? text : table_text(Json::parse(text), settings.verbose));
  return 0;
}

}  // namespace texel
