#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "formats/error.h"
#include "formats/manifest.h"

namespace texel {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::int64_t kMaxVoxels = 1 << 16;   // along an axis
constexpr std::int64_t kMaxPixels = 1 << 16;   // along a slice's side
constexpr std::int64_t kMaxSlices = 1 << 16;
constexpr std::size_t kMaxLevels = 17;         // 2^16 voxels down to one
constexpr std::size_t kMaxGrids = 64;
constexpr std::int64_t kMaxCount = std::int64_t{1} << 53;  // what a JSON number holds exactly everywhere
constexpr const char* kAxisNames[] = {"x", "y", "z"};

// A value and the way to it, for messages: "levels[2].bytes".
class Node {
 public:
  Node(const Json& json, const std::string& where, std::string path) : json_(json), where_(where), path_(std::move(path)) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Code::kBadInput, where_, (path_.empty() ? "manifest" : path_) + " " + what, "bake the pack again");
  }
  [[nodiscard]] bool has(const char* key) const { return json_.is_object() && json_.contains(key); }
  [[nodiscard]] Node key(const char* name) const {
    if (!json_.is_object()) fail("is not an object");
    const auto found = json_.find(name);
    if (found == json_.end()) fail(std::string("has no \"") + name + "\"");
    return {*found, where_, path_.empty() ? name : path_ + "." + name};
  }
  [[nodiscard]] std::vector<Node> items(std::size_t most) const {
    if (!json_.is_array()) fail("is not a list");
    if (json_.size() > most) fail("has " + std::to_string(json_.size()) + " entries, more than " + std::to_string(most));
    std::vector<Node> nodes;
    for (std::size_t i = 0; i < json_.size(); ++i) nodes.emplace_back(json_[i], where_, path_ + "[" + std::to_string(i) + "]");
    return nodes;
  }
  [[nodiscard]] std::vector<Node> exactly(std::size_t count) const {
    std::vector<Node> nodes = items(count);
    if (nodes.size() != count) fail("does not have " + std::to_string(count) + " entries");
    return nodes;
  }
  [[nodiscard]] std::vector<std::pair<std::string, Node>> members() const {
    if (!json_.is_object()) fail("is not an object");
    std::vector<std::pair<std::string, Node>> nodes;
    for (const auto& [name, value] : json_.items()) nodes.emplace_back(name, Node(value, where_, path_ + "." + name));
    return nodes;
  }
  [[nodiscard]] std::string text() const {
    if (!json_.is_string()) fail("is not a text");
    return json_.get<std::string>();
  }
  [[nodiscard]] bool flag() const {
    if (!json_.is_boolean()) fail("is not true or false");
    return json_.get<bool>();
  }
  // null stands for a figure that was not finite: JSON has no other way.
  [[nodiscard]] double number() const {
    if (json_.is_null()) return std::numeric_limits<double>::quiet_NaN();
    if (!json_.is_number()) fail("is not a number");
    return json_.get<double>();
  }
  [[nodiscard]] double finite() const {
    const double v = number();
    if (!std::isfinite(v)) fail("is not a finite number");
    return v;
  }
  [[nodiscard]] std::int64_t integer(std::int64_t least, std::int64_t most) const {
    const bool fits = json_.is_number_integer() && (!json_.is_number_unsigned() || json_.get<std::uint64_t>() <= static_cast<std::uint64_t>(kMaxCount));
    const std::int64_t v = fits ? json_.get<std::int64_t>() : least - 1;
    if (!fits || v < least || v > most) fail("is not a whole number from " + std::to_string(least) + " to " + std::to_string(most));
    return v;
  }
  [[nodiscard]] std::int64_t count() const { return integer(0, kMaxCount); }
  [[nodiscard]] int small(std::int64_t least, std::int64_t most) const { return static_cast<int>(integer(least, most)); }
  [[nodiscard]] std::string json() const { return json_.dump(-1, ' ', false, Json::error_handler_t::replace); }
  [[nodiscard]] bool is_object() const { return json_.is_object(); }

 private:
  const Json& json_;
  const std::string& where_;
  std::string path_;
};

V3i resolution(const Node& node) {
  const auto n = node.exactly(3);
  return {n[0].small(1, kMaxVoxels), n[1].small(1, kMaxVoxels), n[2].small(1, kMaxVoxels)};
}

V3d point(const Node& node) {
  const auto p = node.exactly(3);
  return {p[0].finite(), p[1].finite(), p[2].finite()};
}

double positive(const Node& node) {
  const double v = node.finite();
  if (v <= 0) node.fail("is not positive");
  return v;
}

std::string sha256(const Node& node) {
  const std::string text = node.text();
  if (text.size() != 64 || text.find_first_not_of("0123456789abcdef") != std::string::npos) node.fail("is not a SHA-256 hash");
  return text;
}

// The names are fixed by the layout, so a manifest cannot lead a reader elsewhere.
FileRecord file_record(const Node& node, const std::string& name) {
  if (node.key("file").text() != name) node.key("file").fail("is not \"" + name + "\"");
  return {name, sha256(node.key("sha256")), node.key("bytes").count()};
}

GridRecord grid_record(const Node& node) {
  GridRecord g;
  g.name = node.key("name").text();
  g.components = node.key("components").small(1, 3);
  const std::string type = node.key("type").text();
  if (!(type == "float" && g.components == 1) && !(type == "vec3s" && g.components == 3)) node.key("type").fail("does not fit the components");
  const std::string stored = node.key("stored_as").text();
  if (stored != "half" && stored != "float") node.key("stored_as").fail("is neither half nor float");
  g.half = stored == "half";
  g.active = node.key("active_voxels").count();
  return g;
}

LevelRecord level_record(const Node& node, int number, const V3d& origin) {
  LevelRecord l;
  l.file = file_record(node, level_file(number));
  l.grid = {origin, positive(node.key("voxel_size")), resolution(node.key("resolution"))};
  l.active = node.key("active_voxels").count();
  for (const Node& g : node.key("grids").items(kMaxGrids)) l.grids.push_back(grid_record(g));
  return l;
}

StackRecord stack_record(const Node& node, int axis, int level, SliceFormat format) {
  StackRecord s;
  s.axis = axis;
  s.level = level;
  s.format = format;
  s.count = node.key("count").small(1, kMaxSlices);
  s.width = node.key("width").small(1, kMaxPixels);
  s.height = node.key("height").small(1, kMaxPixels);
  s.thickness = positive(node.key("thickness"));
  s.max_angle = node.key("max_angle").number();
  if (node.key("pattern").text() != slice_pattern(axis, level, format)) node.key("pattern").fail("is not \"" + slice_pattern(axis, level, format) + "\"");
  s.sha256 = sha256(node.key("sha256"));
  s.bytes = node.key("bytes").count();
  return s;
}

std::vector<StackRecord> stack_records(const Node& slices) {
  std::vector<StackRecord> stacks;
  for (const auto& [name, node] : slices.members())
    if (std::find(std::begin(kAxisNames), std::end(kAxisNames), name) == std::end(kAxisNames)) node.fail("is not an axis");
  for (int axis = 0; axis < 3; ++axis) {
    if (!slices.has(kAxisNames[axis])) continue;
    const Node node = slices.key(kAxisNames[axis]);
    const std::string format = node.key("format").text();
    if (format != "png" && format != "exr") node.key("format").fail("is neither png nor exr");
    const SliceFormat f = format == "png" ? SliceFormat::kPng : SliceFormat::kExr;
    stacks.push_back(stack_record(node, axis, 0, f));
    const auto levels = node.key("levels").items(kMaxLevels);
    for (std::size_t l = 0; l < levels.size(); ++l) stacks.push_back(stack_record(levels[l], axis, static_cast<int>(l) + 1, f));
  }
  return stacks;
}

Statistics statistics(const Node& node) {
  Statistics s;
  s.triangles = node.key("triangles").count();
  s.degenerate = node.key("degenerate").count();
  s.components = node.key("components").count();
  s.closed = node.key("closed").count();
  s.area = node.key("area").number();
  s.covered_area = node.key("covered_area").number();
  s.volume = node.key("volume").number();
  const auto color = node.key("mean_color").exactly(3);
  for (int c = 0; c < 3; ++c) s.mean_color[c] = static_cast<float>(std::clamp(color[static_cast<std::size_t>(c)].number(), -3e38, 3e38));
  s.border_voxels = node.key("border_voxels").count();
  s.inside_voxels = node.key("inside_voxels").count();
  return s;
}

SolidCube solid_cube(const Node& node) {
  SolidCube c;
  c.octaves = static_cast<int>(node.key("octaves").integer(1, 64));
  c.cells = static_cast<int>(node.key("cells").integer(1, 1 << 20));
  const auto count = static_cast<std::size_t>(c.octaves);
  for (const Node& w : node.key("weights_start").exactly(count)) c.weights_start.push_back(w.number());
  for (const Node& w : node.key("weights_end").exactly(count)) c.weights_end.push_back(w.number());
  c.mean = point(node.key("mean"));
  c.deviation = point(node.key("deviation"));
  return c;
}

}  // namespace

Manifest parse_manifest(const std::string& text, const std::string& where) {
  // The parser itself does not recurse; what comes out of it is walked to fixed depths, but for the recipe, which dump() recurses into.
  int depth = 0;
  const auto shallow = [&](int at, Json::parse_event_t, Json&) { depth = std::max(depth, at); return at < 64; };
  const Json json = Json::parse(text, shallow, /*allow_exceptions=*/false);
  const Node root(json, where, "");
  if (json.is_discarded() || depth >= 64) throw Error(Code::kBadInput, where, "is not JSON", "bake the pack again");
  if (!root.has("format") || root.key("format").json() != "\"texel-pack\"") throw Error(Code::kBadInput, where, "is not the manifest of a texel pack");
  if (const auto version = root.key("version").integer(0, kMaxCount); version != kPackVersion)
    throw Error(Code::kBadInput, where, "is of pack version " + std::to_string(version) + ", this program reads " + std::to_string(kPackVersion), "bake the pack again");
  constexpr std::size_t kMany = 1 << 20;
  Manifest m;
  m.generator = root.key("generator").text();
  for (const Node& s : root.key("source").items(kMany)) m.sources.push_back({s.key("path").text(), sha256(s.key("sha256")), s.key("bytes").count(), s.has("input") && s.key("input").flag()});
  if (!root.key("recipe").is_object()) root.key("recipe").fail("is not an object");
  m.recipe_json = root.key("recipe").json();
  const auto tolerance = [&root](const char* option, double most) {
    const Node recipe = root.key("recipe");
    return recipe.has(option) ? std::clamp(recipe.key(option).number(), 0.0, most) : 0;
  };
  m.prune = tolerance("prune", 0.25);
  m.quantize = tolerance("quantize", 0.0625);
  m.grid = {point(root.key("box").key("min")), positive(root.key("voxel_size")), resolution(root.key("resolution"))};
  if (const Box3d box = m.grid.box(); !(box.max - box.min).equalWithAbsError(point(root.key("box").key("max")) - box.min, 1e-6 * m.grid.h * kMaxVoxels))
    root.key("box").fail("is not resolution times voxel_size");
  const auto cyclic = root.key("cyclic").exactly(3);
  for (std::size_t c = 0; c < 3; ++c) m.cyclic[c] = cyclic[c].flag();
  const auto levels = root.key("levels").items(kMaxLevels);
  for (std::size_t l = 0; l < levels.size(); ++l) m.levels.push_back(level_record(levels[l], static_cast<int>(l), m.grid.origin));
  m.slices = stack_records(root.key("slices"));
  if (root.has("preview")) m.preview = file_record(root.key("preview"), "preview.png");
  m.statistics = statistics(root.key("statistics"));
  if (root.has("solid_texture")) m.cube = solid_cube(root.key("solid_texture"));
  for (const auto& [measure, node] : root.key("error").members()) m.errors.push_back({measure, node.key("value").number(), node.key("how").text()});
  for (const Node& i : root.key("issues").items(kMany)) m.issues.push_back({i.key("id").text(), i.key("text").text(), i.key("count").count(), i.key("where").text()});
  for (const Node& s : root.key("skipped").items(kMany)) m.skipped.push_back({s.key("what").text(), s.key("why").text()});
  return m;
}

}  // namespace texel
