// The keys and their meaning are in docs/scenes.md and docs/scene.schema.json; scene_keys() holds the reader and the schema together.
#include "formats/read_scene_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "formats/error.h"
#include "formats/fibres.h"
#include "formats/image.h"
#include "formats/json_reader.h"
#include "formats/read_placements.h"
#include "formats/readers.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 32u << 20;
constexpr int kMostDepth = 32;                 // of groups
constexpr std::uint64_t kMostPlaced = 1u << 24;
constexpr std::size_t kMostInputs = 4096;
constexpr std::uint64_t kMostFibrePoints = 1u << 25;  // of fibres that stand several times: 1.1 GB, 1.5 GB with colours

constexpr const char* kTopKeys[] = {"format", "version", "name", "inputs", "objects", "texels", "recipe"};
constexpr const char* kInputKeys[] = {"file", "unit", "up", "materials", "texel", "scene"};
constexpr const char* kMaterialKeys[] = {"kd", "ks", "ke", "roughness", "opacity", "map_kd"};
constexpr const char* kObjectKeys[] = {"name", "input", "objects", "transform", "instances", "instances_file"};
constexpr const char* kTransformKeys[] = {"scale", "rotate", "translate", "matrix"};
constexpr const char* kRotationKeys[] = {"axis", "angle"};
constexpr const char* kTexelKeys[] = {"name", "objects", "recipe"};
constexpr SceneKeys kKeys[] = {{"scene", kTopKeys},           {"input", kInputKeys},       {"material", kMaterialKeys}, {"object", kObjectKeys},
                               {"transform", kTransformKeys}, {"rotation", kRotationKeys}, {"texel", kTexelKeys}};

constexpr std::pair<const char*, double> kUnits[] = {{"mm", 0.001}, {"cm", 0.01}, {"m", 1}, {"km", 1000}, {"in", 0.0254}, {"ft", 0.3048}};

// What the file says of a material; the rest stays as it is.
struct Override {
  std::string name;  // "*": all
  std::optional<V3f> kd, ks, ke;
  std::optional<float> roughness, opacity;
  std::optional<std::string> map_kd;  // as written; empty: none
  std::string where;
};

struct InputRow {
  std::string name, file, texel, where;  // `where`: its path in the JSON
  double unit = 0;
  int scene = -1;
  bool y_up = false;
  std::vector<Override> overrides;       // "*" first
  std::uint64_t placed = 0;
  Affine first;                          // its first placement
};

// Stands where the parser tells of each key and value, and stops it when the answer is known.
class FormatFinder : public nlohmann::json_sax<Json> {
 public:
  explicit FormatFinder(bool first_key_only) : first_key_only_(first_key_only) {}
  bool found = false;

  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(number_integer_t) override { return value(); }
  bool number_unsigned(number_unsigned_t) override { return value(); }
  bool number_float(number_float_t, const string_t&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool string(string_t& text) override {
    found = depth_ == 1 && asked_ && text == "texel-scene";
    return value();
  }
  bool start_object(std::size_t) override { return open(); }
  bool start_array(std::size_t) override { return depth_ > 0 && open(); }  // no object at the top: no scene
  bool end_object() override { return --depth_ > 0; }
  bool end_array() override { return --depth_ > 0; }
  bool key(string_t& name) override {
    if (depth_ != 1) return true;
    asked_ = name == "format";
    return asked_ || !first_key_only_;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override { return false; }

 private:
  [[nodiscard]] bool value() const { return depth_ > 0 && !(depth_ == 1 && asked_); }
  bool open() {
    const bool go_on = value() || depth_ == 0;
    ++depth_;
    return go_on;
  }
  bool first_key_only_, asked_ = false;
  int depth_ = 0;
};

// A linear colour, or sRGB as "#rrggbb".
V3f read_color(const JsonReader& json, const Json& v, const std::string& path, double most) {
  if (!v.is_string()) return json.color(v, path, most);
  const std::string text = v.get<std::string>();
  const bool hex = text.size() == 7 && text[0] == '#' && text.find_first_not_of("0123456789abcdefABCDEF", 1) == std::string::npos;
  if (!hex) json.fail(path, "is " + JsonReader::shown(v), "expected \"#rrggbb\" (sRGB) or three linear numbers");
  V3f c;
  for (int i = 0; i < 3; ++i) c[i] = srgb_to_linear(static_cast<float>(std::stoi(text.substr(1 + 2 * static_cast<std::size_t>(i), 2), nullptr, 16)) / 255.0f);
  return c;
}

bool is_identity(const Affine& a) { return a.m == Affine().m; }

constexpr double kFarthest = 1e100;            // beyond it areas and volumes overflow

class SceneReader : private JsonReader {
 public:
  SceneReader(const Input& input, const SceneFiles* files, Report* report)
      : JsonReader(input.path, "docs/scenes.md"), root_(parse_json(input, kMostBytes, "scene", R"({"format": "texel-scene", "inputs": {...}, "objects": [...]})")), files_(files), report_(report) {
    if (!root_.is_object() || !root_.contains("format") || root_.at("format") != "texel-scene") fail("", "is not a scene: its \"format\" is not \"texel-scene\"", "see docs/scenes.md");
    check_keys(root_, "", kTopKeys);
    if (root_.contains("version") && root_.at("version") != 1) fail("/version", "is " + shown(root_.at("version")), "this program reads version 1");
    if (root_.contains("name")) (void)text(root_.at("name"), "/name");
    if (root_.contains("objects") == root_.contains("texels"))
      fail("", root_.contains("objects") ? "has both \"objects\" and \"texels\"" : "has neither \"objects\" nor \"texels\"", "give objects for one texel, or texels with objects of their own");
  }

  std::vector<SceneTexel> texels() const {
    std::vector<SceneTexel> all;
    std::vector<SceneTexel::Recipe> top;
    add_recipe(root_, "", top);
    if (root_.contains("objects")) return {{"", top}};
    const Json& list = root_.at("texels");
    if (!list.is_array() || list.empty()) fail("/texels", "is " + shown(list), "expected a list of texels");
    std::map<std::string, std::size_t> names;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string at = "/texels/" + std::to_string(i);
      check_keys(list[i], at, kTexelKeys);
      SceneTexel texel;
      texel.name = text(need(list[i], "name", at), at + "/name");
      const bool plain = texel.name.size() <= 100 && texel.name.front() != '.' && std::none_of(texel.name.begin(), texel.name.end(), [](unsigned char c) { return c < 32 || c == 127 || c == '/' || c == '\\'; });
      if (!plain) fail(at + "/name", "is " + shown(list[i].at("name")), "expected a name for a folder: no slash, no dot at its start, at most 100 bytes");
      if (!names.emplace(texel.name, i).second) fail(at + "/name", "is that of /texels/" + std::to_string(names[texel.name]), "give each texel a name of its own");
      texel.recipes = top;
      add_recipe(list[i], at, texel.recipes);
      all.push_back(std::move(texel));
    }
    return all;
  }

  Scene read(const std::string& texel) {
    read_inputs();
    const std::vector<SceneTexel> all = texels();
    const auto index = static_cast<std::size_t>(&choose_texel(all, texel, file()) - all.data());
    const bool top = root_.contains("objects");
    const std::string at = top ? "/objects" : "/texels/" + std::to_string(index) + "/objects";
    const Json& list = top ? root_.at("objects") : need(root_.at("texels")[index], "objects", "/texels/" + std::to_string(index));
    const Affine world;
    objects(list, at, std::span(&world, 1), 0);
    return resolve();
  }

 private:
  void add_recipe(const Json& object, const std::string& path, std::vector<SceneTexel::Recipe>& recipes) const {
    if (!object.contains("recipe")) return;
    const Json& r = object.at("recipe");
    if (!r.is_object()) fail(path + "/recipe", "is " + shown(r), "expected an object of options, e.g. {\"resolution\": 64}");
    if (r.contains("texel")) fail(path + "/recipe/texel", "chooses among texels, and this is one", "leave it out");
    recipes.push_back({r.dump(-1, ' ', false, Json::error_handler_t::replace), file() + ": " + path + "/recipe"});
  }

  // --- inputs ---
  std::string find_file(const Json& v, const std::string& path) const {
    std::string name = text(v, path);
    std::replace(name.begin(), name.end(), '\\', '/');
    const std::string found = (fs::path(file()).parent_path() / name).lexically_normal().string();
    if (!files_->is_file(found)) throw Error(Code::kFile, found, "named at " + file() + ": " + path + ", is not there", "names are relative to the scene's folder");
    return found;
  }

  void read_inputs() {
    const Json& table = need(root_, "inputs", "");
    if (!table.is_object() || table.empty()) fail("/inputs", "is " + shown(table), "expected an object of inputs by name");
    if (table.size() > kMostInputs) fail("/inputs", "has " + std::to_string(table.size()) + " inputs", "the most is " + std::to_string(kMostInputs));
    for (const auto& [name, v] : table.items()) {
      InputRow row;
      row.name = name;
      row.where = member("/inputs", name);
      if (v.is_string()) {
        row.file = text(v, row.where);
      } else {
        check_keys(v, row.where, kInputKeys);
        row.file = text(need(v, "file", row.where), row.where + "/file");
        if (v.contains("unit")) row.unit = unit(v.at("unit"), row.where + "/unit");
        if (v.contains("up")) row.y_up = up(v.at("up"), row.where + "/up");
        if (v.contains("texel")) row.texel = text(v.at("texel"), row.where + "/texel");
        if (v.contains("scene")) {
          const double number = this->number(v.at("scene"), row.where + "/scene");
          if (!(number >= 0 && number <= 1 << 30 && number == std::floor(number))) fail(row.where + "/scene", "is " + shown(v.at("scene")), "expected a whole number from 0 on");
          row.scene = static_cast<int>(number);
        }
        if (v.contains("materials")) read_overrides(v.at("materials"), row.where + "/materials", row.overrides);
      }
      numbers_of_[name] = static_cast<std::uint32_t>(inputs_.size());
      inputs_.push_back(std::move(row));
    }
  }

  double unit(const Json& v, const std::string& path) const {
    if (v.is_number()) {
      const double metres = positive(v, path);
      if (!(metres >= 1e-15 && metres <= 1e15)) fail(path, "is " + shown(v), "expected metres from 1e-15 to 1e15");
      return metres;
    }
    for (const auto& [name, metres] : kUnits)
      if (v == name) return metres;
    fail(path, "is " + shown(v), "expected mm, cm, m, km, in, ft or a number of metres");
  }

  bool up(const Json& v, const std::string& path) const {
    if (v != "y" && v != "z") fail(path, "is " + shown(v), "expected \"y\" or \"z\"");
    return v == "y";
  }

  void read_overrides(const Json& table, const std::string& path, std::vector<Override>& overrides) const {
    if (!table.is_object()) fail(path, "is " + shown(table), "expected an object of materials by name, \"*\" for all");
    for (const auto& [name, v] : table.items()) {
      Override o;
      o.name = name;
      o.where = member(path, name);
      check_keys(v, o.where, kMaterialKeys);
      const auto color = [&, &v = v](const char* key, std::optional<V3f>& to, double most) {
        if (v.contains(key)) to = read_color(*this, v.at(key), o.where + "/" + key, most);
      };
      color("kd", o.kd, 1);
      color("ks", o.ks, 1);
      color("ke", o.ke, 10000);
      if (v.contains("roughness")) o.roughness = share(v.at("roughness"), o.where + "/roughness");
      if (v.contains("opacity")) o.opacity = share(v.at("opacity"), o.where + "/opacity");
      if (v.contains("map_kd")) o.map_kd = v.at("map_kd").is_null() ? std::string() : text(v.at("map_kd"), o.where + "/map_kd");
      overrides.insert(name == "*" ? overrides.begin() : overrides.end(), std::move(o));
    }
  }

  void apply_overrides(const InputRow& row, Scene& scene) const {
    for (const Override& o : row.overrides) {
      TextureUse picture;
      if (o.map_kd && !o.map_kd->empty()) {
        const std::string path = find_file(Json(*o.map_kd), o.where + "/map_kd");
        picture.texture = static_cast<int>(scene.textures.size());
        scene.textures.push_back({path, *o.map_kd});
        add_source(scene, path);
      }
      bool any = o.name == "*";
      for (Material& m : scene.materials) {
        if (o.name != "*" && m.name != o.name) continue;
        any = true;
        if (o.map_kd) {
          m.map_kd = picture;
          if (picture.used() && !o.kd) m.kd = V3f(1, 1, 1);  // the picture alone gives the colour
        }
        if (o.kd) m.kd = *o.kd;
        if (o.ks) m.ks = *o.ks;
        if (o.ke) m.ke = *o.ke;
        if (o.roughness) m.roughness = *o.roughness;
        if (o.opacity) m.opacity = *o.opacity;
      }
      if (any) continue;
      std::string names;
      for (const Material& m : scene.materials) {
        if (names.size() > 200) {
          names += ", ...";
          break;
        }
        names += (names.empty() ? "" : ", ") + shown_as(m.name);
      }
      fail(o.where, "is no material of " + row.file, "it has " + names);
    }
  }

  // --- transforms ---
  Affine transform(const Json& v, const std::string& path) const {
    check_keys(v, path, kTransformKeys);
    Affine a;
    if (v.contains("matrix")) {
      if (v.size() > 1) fail(path, "has a matrix and other keys", "give one of them");
      a = matrix(v.at("matrix"), path + "/matrix");
    } else {
      if (v.contains("scale")) {
        const Json& s = v.at("scale");
        a = s.is_array() ? Affine::scale(vector(s, path + "/scale")) : Affine::scale(number(s, path + "/scale"));
      }
      if (v.contains("rotate")) a = rotation(v.at("rotate"), path + "/rotate") * a;
      if (v.contains("translate")) a = Affine::translation(vector(v.at("translate"), path + "/translate")) * a;
    }
    if (!a.invertible()) fail(path, "makes things flat or infinite: " + shown(v), "scale by numbers other than 0, and move by no more than 1e30");
    return a;
  }

  Affine matrix(const Json& v, const std::string& path) const {
    const bool whole = v.is_array() && v.size() == 16;
    const std::vector<double> m = whole ? numbers(v, path, 16) : numbers(v, path, 12);
    if (whole && !(m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1)) fail(path, "does not end with 0, 0, 0, 1", "give the rows of an affine matrix, the translation at the end of each");
    Affine a;
    std::copy_n(m.begin(), 12, a.m.begin());
    return a;
  }

  Affine rotation(const Json& v, const std::string& path) const {
    if (v.is_array()) {
      const V3d turn = vector(v, path);
      return Affine::rotation({0, 0, 1}, turn.z) * Affine::rotation({0, 1, 0}, turn.y) * Affine::rotation({1, 0, 0}, turn.x);
    }
    check_keys(v, path, kRotationKeys);
    return Affine::rotation(direction(need(v, "axis", path), path + "/axis"), number(need(v, "angle", path), path + "/angle"));
  }

  // --- objects ---
  // `parents`: where the list stands, once or more often.
  void objects(const Json& list, const std::string& path, std::span<const Affine> parents, int depth) {
    if (depth > kMostDepth) fail(path, "is nested more than " + std::to_string(kMostDepth) + " groups deep", "make it flatter");
    if (!list.is_array() || list.empty()) fail(path, "is " + shown(list), "expected a list of objects");
    for (std::size_t i = 0; i < list.size(); ++i) object(list[i], path + "/" + std::to_string(i), parents, depth);
  }

  void object(const Json& v, const std::string& path, std::span<const Affine> parents, int depth) {
    check_keys(v, path, kObjectKeys);
    if (v.contains("name")) (void)text(v.at("name"), path + "/name");
    if (v.contains("input") == v.contains("objects")) fail(path, v.contains("input") ? "has both \"input\" and \"objects\"" : "has neither \"input\" nor \"objects\"", "give one of them");
    if (v.contains("instances") && v.contains("instances_file")) fail(path, "has both \"instances\" and \"instances_file\"", "give one of them");
    const Affine own = v.contains("transform") ? transform(v.at("transform"), path + "/transform") : Affine();
    std::vector<Affine> places;  // of a group, or within `own`
    InputRow* input = nullptr;
    if (v.contains("input")) {
      const std::string name = text(v.at("input"), path + "/input");
      const auto found = numbers_of_.find(name);
      if (found == numbers_of_.end()) fail(path + "/input", "is " + shown(v.at("input")) + ", which is not among the inputs", "known: " + input_names());
      input = &inputs_[found->second];
    }
    const auto each = [&](const Affine& parent, const Affine& inner) {
      const Affine place = parent * own * inner;
      if (!place.invertible()) fail(path, "makes things flat or infinite together with the groups it is in", "scale by less");
      if (++work_ > kMostPlaced) fail(path, "is one placement too many", "the most are 2^24 together");
      if (!input) {
        places.push_back(place);
        return;
      }
      if (input->placed++ == 0) input->first = place;
      placed_.push_back({static_cast<std::uint32_t>(input - inputs_.data()), place});
    };
    if (v.contains("instances_file")) {
      table(v.at("instances_file"), path + "/instances_file", parents, input != nullptr, each);
    } else if (v.contains("instances")) {
      const Json& list = v.at("instances");
      if (!list.is_array() || list.empty()) fail(path + "/instances", "is " + shown(list), "expected a list of transforms");
      std::vector<Affine> inner;
      for (std::size_t i = 0; i < list.size(); ++i) inner.push_back(transform(list[i], path + "/instances/" + std::to_string(i)));
      for (const Affine& parent : parents)
        for (const Affine& one : inner) each(parent, one);
    } else {
      for (const Affine& parent : parents) each(parent, Affine());
    }
    if (!input) objects(v.at("objects"), path + "/objects", places, depth + 1);
  }

  template <class Each>
  void table(const Json& v, const std::string& path, std::span<const Affine> parents, bool of_input, const Each& each) {
    const std::string found = find_file(v, path);
    if (std::find(tables_.begin(), tables_.end(), found) == tables_.end()) tables_.push_back(found);
    std::uint64_t rows = 0;
    files_->open(found, [&](const Input& bytes) {
      if (parents.size() == 1) {  // as they are read: there may be millions
        const std::uint64_t need = placed_.size() + std::min(most_placements(bytes), kMostPlaced);
        if (of_input && need > placed_.capacity()) placed_.reserve(std::max<std::uint64_t>(need, placed_.empty() ? 0 : placed_.size() + placed_.size() / 2));
        read_placements(bytes, *report_, [&](const Affine& one) {
          ++rows;
          each(parents[0], one);
        });
        return;
      }
      std::vector<Affine> inner;
      read_placements(bytes, *report_, [&](const Affine& one) {
        if (++rows > kMostPlaced) fail(path, "has one placement too many", "the most are 2^24 together");
        inner.push_back(one);
      });
      for (const Affine& parent : parents)
        for (const Affine& one : inner) each(parent, one);
    });
    if (rows == 0) throw Error(Code::kBadInput, found, "places nothing", "give a row of x, y, z for each placement");
  }

  std::string input_names() const {
    std::string names;
    for (const InputRow& row : inputs_) {
      if (names.size() > 200) return names + ", ...";
      names += (names.empty() ? "" : ", ") + shown_as(row.name);
    }
    return names;
  }

  // --- the scene ---
  // An input's own scene, turned and recoloured.
  Scene open(const InputRow& row) const {
    const std::string path = find_file(Json(row.file), row.where + "/file");
    Scene part = files_->read({path, row.unit, row.texel, row.scene});
    apply_overrides(row, part);
    const bool made_of_triangles = part.implicits.empty() && part.heights.empty() && !part.hypertexture;
    if (!made_of_triangles) {
      if (row.placed != 1 || row.unit > 0 || row.y_up || !is_identity(row.first))
        fail(row.where, "is a function or a height field (" + row.file + "), which can stand only once, without a transform, unit or up", "bake it by itself, or give a mesh");
    } else if (row.y_up) {
      Affine turn;
      turn.m = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0};
      move_scene(part, turn);
    }
    return part;
  }

  Scene resolve() {
    struct Placed {
      std::vector<Instance> parts;  // of one placement; empty: it is part of the mesh
      Fibres fibres;                // likewise; they are copied
      std::uint32_t first_material = 0;
      double reach = 0;
    };
    Scene all;
    std::vector<Placed> known(inputs_.size());
    bool any = false, compound = false, colored = false;
    std::uint64_t fibre_points = 0, fibre_strands = 0, copied_points = 0;
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const InputRow& row = inputs_[i];
      if (row.placed == 0) continue;
      Scene part = open(row);
      known[i].reach = scene_reach(part);
      known[i].first_material = static_cast<std::uint32_t>(all.materials.size());
      if (part.fibres.strands() > 0) {
        const std::uint64_t points = part.fibres.points.size();  // below 2^40, and placed at most 2^24 times
        if (row.placed > 1 && (copied_points += points * row.placed) > kMostFibrePoints)
          fail(row.where, "holds fibres or lines (" + row.file + "), which are copied, and the " + std::to_string(points) + " points of this one would stand " + std::to_string(row.placed) + " times: together more than 2^25",
               "place it less often (--fibre-radius 0 leaves out the lines of .obj files)");
        fibre_points += points * row.placed;
        fibre_strands += part.fibres.strands() * row.placed;
        colored = colored || !part.fibres.colors.empty();
        known[i].fibres = std::move(part.fibres);
        part.fibres = {};
      }
      if (row.placed == 1) {
        if (!(row.first.reach(known[i].reach) <= kFarthest)) fail(row.where, "is placed where coordinates are beyond 1e100", "scale by less");
        if (!is_identity(row.first)) move_scene(part, row.first);
      } else {
        std::vector<Instance> parts = take_instances(part);
        for (Instance& one : parts) one.shape += static_cast<std::uint32_t>(all.shapes.size());
        compound = compound || parts.size() > 1 || (parts.size() == 1 && !is_identity(parts[0].place));
        known[i].parts = std::move(parts);
      }
      if (any) join_scenes(all, std::move(part));
      else all = std::move(part);
      any = true;
    }
    for (const std::string& path : tables_) add_source(all, path);
    std::uint64_t total = all.instances.size();
    for (const Instance& p : placed_) {
      const Placed& part = known[p.shape];
      total += part.parts.size();
      if (total > kMostPlaced) fail("", "has more than 2^24 instances, those of its scenes included", "bake parts of it by themselves");
      if (!(p.place.reach(part.reach) <= kFarthest)) fail(inputs_[p.shape].where, "is placed where coordinates are beyond 1e100", "scale by less");
    }
    if (fibre_strands > 0) {
      all.fibres.points.reserve(fibre_points);
      all.fibres.radii.reserve(fibre_points);
      all.fibres.colors.reserve(colored ? fibre_points : 0);
      all.fibres.first.reserve(fibre_strands + 1);
      all.fibres.materials.reserve(fibre_strands);
      FibreBuilder builder(all.fibres, colored);
      for (const Instance& p : placed_)
        if (const Placed& part = known[p.shape]; part.fibres.strands() > 0) builder.moved(part.fibres, p.place, part.first_material);
      builder.report_to(*report_, file());
      if (all.fibres.strands() == 0 && all.mesh.triangles.empty() && total == 0) fail("", "has no fibre left that can be used where it is placed: " + builder.reason(), "move it less far, or scale by more");
    }
    if (!compound && all.instances.empty()) {  // in place: there may be millions
      std::size_t kept = 0;
      for (const Instance& p : placed_)
        if (const Placed& part = known[p.shape]; !part.parts.empty()) placed_[kept++] = {part.parts[0].shape, p.place};
      placed_.resize(kept);
      all.instances = std::move(placed_);
    } else {
      all.instances.reserve(total);
      for (const Instance& p : placed_)
        for (const Instance& one : known[p.shape].parts) all.instances.push_back({one.shape, p.place * one.place});
    }
    return all;
  }

  Json root_;
  const SceneFiles* files_;
  Report* report_;
  std::vector<InputRow> inputs_;
  std::map<std::string, std::uint32_t> numbers_of_;
  std::vector<Instance> placed_;         // `shape` is the input's number
  std::vector<std::string> tables_;
  std::uint64_t work_ = 0;               // placements of inputs and groups
};

}  // namespace

bool is_scene_file(std::span<const char> bytes, bool first_key_only) {
  FormatFinder finder(first_key_only);
  (void)Json::sax_parse(bytes.begin(), bytes.end(), &finder);
  return finder.found;
}

std::vector<SceneTexel> list_texels(const Input& input) { return SceneReader(input, nullptr, nullptr).texels(); }

std::vector<SceneTexel> list_texels(const std::string& path) {
  const FileBytes file(path);
  if (!is_scene_file(file.bytes())) return {};
  return list_texels(Input{file.bytes(), path});
}

const SceneTexel& choose_texel(const std::vector<SceneTexel>& texels, const std::string& name, const std::string& path) {
  if (name.empty() && texels.size() == 1) return texels[0];
  std::string names;
  for (const SceneTexel& texel : texels) {
    if (!name.empty() && texel.name == name) return texel;
    if (names.size() < 200) names += (names.empty() ? "" : ", ") + texel.name;
    else if (!names.ends_with("...")) names += ", ...";
  }
  if (texels.size() == 1 && texels[0].name.empty()) throw Error(Code::kBadInput, path, "has no texels by name, so none \"" + name + "\"", "leave --texel out");
  if (name.empty()) throw Error(Code::kBadInput, path, "holds " + std::to_string(texels.size()) + " texels", "choose one by --texel, in a scene by \"texel\": " + names + "; `texel batch` bakes all");
  throw Error(Code::kBadInput, path, "has no texel " + shown_as(name), "it has " + names);
}

Scene read_scene_file(const Input& input, const std::string& texel, const SceneFiles& files, Report& report) {
  Scene scene = SceneReader(input, &files, &report).read(texel);
  if (scene.materials.empty()) scene.materials.push_back(plain_color("default", Material().kd));
  return scene;
}

std::span<const SceneKeys> scene_keys() { return kKeys; }

}  // namespace texel
