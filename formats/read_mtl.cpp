// MTL after the "Object Files" and "Material Library File" appendices of Wavefront's Advanced Visualizer manual (1993), read as exporters
// write it rather than as the manual has it: where these differ, a comment says so.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "formats/readers.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

class MtlReader {
 public:
  MtlReader(const Input& input, Report& report) : input_(input), text_(input), report_(report) {}

  std::vector<MtlMaterial> read() {
    for (; !text_.at_end(); text_.next_line()) line();
    finish();
    return std::move(materials_);
  }

 private:
  void line() {
    const char* start = text_.position();
    const std::string_view word = text_.word();
    if (word.empty() || word.front() == '#') return;
    if (word == "newmtl") return begin(start);
    if (materials_.empty()) return;  // values before the first material belong to nobody
    Material& m = materials_.back().material;
    if (word == "Kd") has_kd_ = color(m.kd, 1) || has_kd_;
    else if (word == "Ks") color(m.ks, 1);
    else if (word == "Ke") color(m.ke, 1e4);
    else if (word == "Ns") scalar(exponent_, 0, 1e9);
    else if (word == "d") opacity(false);
    else if (word == "Tr") opacity(true);
    else if (word == "map_Kd" || word == "map_kd") map(materials_.back().map_kd);
    else if (word == "map_d" || word == "map_D") map(materials_.back().map_d);
  }

  void begin(const char* start) {
    finish();
    MtlMaterial& next = materials_.emplace_back();
    next.path = input_.path;
    next.where = text_.where(start);
    next.material.name = text_.rest_of_line();
    exponent_ = 0;
    has_kd_ = has_d_ = has_tr_ = false;
  }

  // What can be said only when the whole material has been read.
  void finish() {
    if (materials_.empty()) return;
    MtlMaterial& last = materials_.back();
    Material& m = last.material;
    last.kd_left_out = !has_kd_;
    const bool shiny = m.ks.x > 0 || m.ks.y > 0 || m.ks.z > 0;
    m.roughness = shiny ? static_cast<float>(std::sqrt(2.0 / (exponent_ + 2.0))) : 1.0f;
    // MeshLab and others write Tr 1 for what is opaque. A material that is wholly transparent has no use in a mesh: it is taken as opaque.
    if (has_tr_ && !has_d_ && m.opacity == 0) {
      m.opacity = 1;
      report_.issue("tr-one", "materials with Tr 1 and no d are taken as opaque, as their exporters mean it", 1, last.where);
    }
  }

  void unreadable(const char* what) {
    report_.issue("mtl-unreadable", std::string("values of ") + what + " that can't be used are left at their defaults", 1, text_.where());
  }

  // One number stands for all three. Spectral curves and CIE XYZ, which the manual allows, are not read.
  bool color(V3f& target, double most) {
    std::array<double, 3> v{};
    int count = 0;
    while (count < 3 && text_.number(v[static_cast<std::size_t>(count)])) ++count;
    if (count == 1) v[1] = v[2] = v[0];
    const bool finite = std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
    if (count == 0 || count == 2 || !finite) {
      unreadable("a colour");
      return false;
    }
    const auto limited = [&](double value) { return static_cast<float>(std::clamp(value, 0.0, most)); };
    const V3f stored(limited(v[0]), limited(v[1]), limited(v[2]));
    if (std::any_of(v.begin(), v.end(), [&](double value) { return value < 0 || value > most; }))
      report_.issue("mtl-out-of-range", "material colours outside their range were limited to it", 1, text_.where());
    target = stored;
    return true;
  }

  bool scalar(double& target, double least, double most) {
    double v = 0;
    if (!text_.number(v) || !std::isfinite(v)) {
      unreadable("a number");
      return false;
    }
    target = std::clamp(v, least, most);
    return true;
  }

  void opacity(bool transparency) {
    if (!transparency && text_.peek_word() == "-halo") (void)text_.word();
    double v = 1;
    if (!scalar(v, 0, 1)) return;
    const float d = static_cast<float>(transparency ? 1 - v : v);
    Material& m = materials_.back().material;
    // Half a step of the six decimals exporters write.
    const bool contradicts = (transparency ? has_d_ : has_tr_) && std::abs(d - m.opacity) > 1e-6f;
    if (contradicts) report_.issue("d-tr-contradict", "materials whose d and Tr contradict each other: the later was used", 1, text_.where());
    m.opacity = d;
    (transparency ? has_tr_ : has_d_) = true;
  }

  void numbers(int most, double* values) {
    for (int i = 0; i < most && text_.number(values[i]); ++i) {}
  }

  // Options come first, each with a known number of arguments; what follows is the name, blanks included.
  void map(MtlMap& target) {
    MtlMap read;
    read.where = text_.where();
    for (;;) {
      const std::string_view option = text_.peek_word();
      if (option.size() < 2 || option.front() != '-') break;
      const char* before = text_.position();
      (void)text_.word();
      double v[3] = {0, 0, 0};
      if (option == "-s") {
        v[0] = v[1] = 1;
        numbers(3, v);
        read.use.scale = usable(v[0], v[1], V2f(1, 1));
      } else if (option == "-o") {
        numbers(3, v);
        read.use.offset = usable(v[0], v[1], V2f(0, 0));
      } else if (option == "-t") {
        numbers(3, v);
      } else if (option == "-mm") {
        numbers(2, v);
      } else if (option == "-bm" || option == "-boost" || option == "-texres") {
        numbers(1, v);
      } else if (option == "-clamp") {
        read.use.wrap.fill(text_.word() == "on" ? Wrap::kClamp : Wrap::kRepeat);
      } else if (option == "-imfchan") {
        const std::string_view channel = text_.word();
        read.channel_chosen = true;
        read.use.alpha_channel = channel == "m";
      } else if (option == "-blendu" || option == "-blendv" || option == "-cc" || option == "-type") {
        (void)text_.word();
      } else {
        text_.move_to(before);  // a name that begins with '-'
        break;
      }
    }
    read.name = text_.rest_of_line();
    if (read.name.size() > 1 && read.name.front() == '"' && read.name.back() == '"') read.name = read.name.substr(1, read.name.size() - 2);
    if (read.name.empty()) return unreadable("a map's name");
    target = read;
  }

  V2f usable(double x, double y, V2f otherwise) {
    if (std::abs(x) < 1e6 && std::abs(y) < 1e6) return {static_cast<float>(x), static_cast<float>(y)};
    unreadable("a map's option");
    return otherwise;
  }

  const Input& input_;
  TextScanner text_;
  Report& report_;
  std::vector<MtlMaterial> materials_;
  double exponent_ = 0;
  bool has_kd_ = false, has_d_ = false, has_tr_ = false;
};

bool is_file(const fs::path& path) {
  std::error_code ec;
  return fs::is_regular_file(path, ec);
}

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

// The file of `folder` whose name differs from `name` in case only; of several the first in order.
fs::path same_but_case(const fs::path& folder, const std::string& name) {
  std::error_code ec;
  fs::path best;
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, ec), last; !ec && entry != last; entry.increment(ec))
    if (lower(entry->path().filename().string()) == lower(name) && is_file(entry->path()) && (best.empty() || entry->path() < best))
      best = folder / entry->path().filename();
  return best;
}

// Index of the texture, entered when new; −1 and an issue when the picture is not there.
int add_texture(const MtlMaterial& mtl, const MtlMap& map, bool raw, Scene& scene, Report& report) {
  const std::string path = find_beside(mtl.path, map.name);
  if (path.empty()) {
    // Named one by one, but not without end.
    constexpr int kMostNamed = 50;
    const auto named = std::count_if(report.issues.begin(), report.issues.end(), [](const Issue& i) { return i.id == "texture-missing"; });
    const std::string which = named < kMostNamed ? "picture " + shown_as(map.name) + " is" : "further pictures are";
    report.issue("texture-missing", which + " not there: the material's colour is used instead", 1, map.where);
    return -1;
  }
  const std::vector<bool> raws = raw_textures(scene);
  for (std::size_t i = 0; i < scene.textures.size(); ++i)
    if (scene.textures[i].path == path && raws[i] == raw) return static_cast<int>(i);
  scene.textures.push_back({path, map.name});
  add_source(scene, path);
  return static_cast<int>(scene.textures.size()) - 1;
}

}  // namespace

std::vector<MtlMaterial> read_mtl(const Input& input, Report& report) { return MtlReader(input, report).read(); }

std::uint32_t add_mtl_material(const MtlMaterial& mtl, Scene& scene, Report& report) {
  Material m = mtl.material;
  if (!mtl.map_kd.name.empty()) {
    m.map_kd = mtl.map_kd.use;
    m.map_kd.texture = add_texture(mtl, mtl.map_kd, false, scene, report);
    if (m.map_kd.used() && mtl.kd_left_out) m.kd = V3f(1, 1, 1);  // the picture alone gives the colour
    if (m.map_kd.used() && m.kd == V3f(0, 0, 0)) {
      m.kd = V3f(1, 1, 1);
      report.issue("kd-black-with-texture", "materials with Kd 0 0 0 and a map_Kd, which would be black: Kd taken as 1 1 1", 1, mtl.where);
    }
  }
  if (!mtl.map_d.name.empty()) {
    m.map_d = mtl.map_d.use;
    // Exporters name the colour picture again as map_d when they mean its alpha channel.
    if (!mtl.map_d.channel_chosen && mtl.map_d.name == mtl.map_kd.name) m.map_d.alpha_channel = true;
    m.map_d.texture = add_texture(mtl, mtl.map_d, !m.map_d.alpha_channel, scene, report);
  }
  scene.materials.push_back(m);
  return static_cast<std::uint32_t>(scene.materials.size()) - 1;
}

std::string find_beside(const std::string& from, const std::string& name) {
  std::string slashed = name;
  std::replace(slashed.begin(), slashed.end(), '\\', '/');
  while (slashed.starts_with("./")) slashed.erase(0, 2);
  if (slashed.empty() || slashed.find('\0') != std::string::npos) return {};
  const fs::path folder = fs::path(from).parent_path();
  const fs::path relative(slashed);
  if (is_file(folder / relative)) return (folder / relative).string();  // an absolute one stays as it is
  if (is_file(folder / name)) return (folder / name).string();          // a backslash may belong to a name here
  const std::string last = relative.filename().string();
  if (last.empty()) return {};
  if (is_file(folder / last)) return (folder / last).string();
  const fs::path found = same_but_case((folder / relative).parent_path(), last);
  return (found.empty() ? same_but_case(folder, last) : found).string();
}

}  // namespace texel
