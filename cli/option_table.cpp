#include "cli/options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>

#include "bake/compare.h"
#include "formats/noise.h"

namespace texel {
namespace {

constexpr const char* kFiles = "Input and output";
constexpr const char* kHeights = "Height fields";
constexpr const char* kGridGroup = "Grid";
constexpr const char* kVolume = "Volume";
constexpr const char* kNoise = "Hypertextures and solid textures";
constexpr const char* kSlices = "Slices";
constexpr const char* kLevels = "Levels";
constexpr const char* kAccuracy = "Accuracy";
constexpr const char* kRunning = "Running";
constexpr const char* kCamera = "Camera";
constexpr const char* kPicture = "Picture";
constexpr const char* kMeasuring = "Measuring";

constexpr unsigned kAll = kBake | kInfo | kCheck | kView | kBatch | kCompare | kBench;
constexpr unsigned kBakes = kBake | kBatch;
constexpr int kMostVoxels = 4096;

std::string range_text(double low, double high) { return number_text(low) + ".." + number_text(high); }

// --- builders: each completes a row's head with set and get for one kind of value -------------------------------------------

template <class Ref>
OptionRow toggle(OptionRow row, Ref ref) {
  row.accepts = "true, false";
  row.set = [ref](Settings& s, const std::string& text) {
    if (text != "true" && text != "false") return false;
    ref(s) = text == "true";
    return true;
  };
  row.get = [ref](const Settings& s) { return std::string(ref(s) ? "true" : "false"); };
  return row;
}

template <class Ref>
OptionRow text(OptionRow row, Ref ref) {
  row.set = [ref](Settings& s, const std::string& value) {
    if (value.empty()) return false;
    ref(s) = value;
    return true;
  };
  row.get = [ref](const Settings& s) { return ref(s); };
  return row;
}

bool read_integer(const std::string& value, int low, int high, int* out) {
  int number = 0;
  const char* end = value.data() + value.size();
  const auto [stop, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc{} || stop != end || number < low || number > high) return false;
  *out = number;
  return true;
}

// `word` stands for the value `meaning` ("all" for −1); null: no such word.
template <class Ref>
OptionRow integer(OptionRow row, Ref ref, int low, int high, const char* word = nullptr, int meaning = 0) {
  row.accepts = (word ? std::string(word) + ", " : "") + range_text(low, high);
  row.set = [=](Settings& s, const std::string& value) {
    if (word && value == word) {
      ref(s) = meaning;
      return true;
    }
    return read_integer(value, low, high, &ref(s));
  };
  row.get = [=](const Settings& s) { return word && ref(s) == meaning ? std::string(word) : std::to_string(ref(s)); };
  return row;
}

struct Interval {
  double low, high;
  bool open_low = false;   // low itself is out
  bool zero_is_none = false;  // 0 means "not given": get() is empty
};

template <class Ref>
OptionRow number(OptionRow row, Ref ref, Interval interval) {
  const bool unlimited = !(interval.high < 1e300);
  const std::string low = number_text(interval.low);
  row.accepts = unlimited ? (interval.open_low ? "> " : ">= ") + low
                          : interval.open_low ? "> " + low + ", <= " + number_text(interval.high) : range_text(interval.low, interval.high);
  row.set = [=](Settings& s, const std::string& value) {
    double v = 0;
    if (!read_number(value, &v)) return false;
    if (v < interval.low || v > interval.high || (interval.open_low && v == interval.low)) return false;
    ref(s) = v;
    return true;
  };
  row.get = [=](const Settings& s) {
    const double v = ref(s);
    return (interval.zero_is_none && v == 0) || v < interval.low ? std::string() : number_text(v);  // below all that can be given: not given
  };
  return row;
}

// A number that need not be given.
template <class Ref>
OptionRow maybe_number(OptionRow row, Ref ref) {
  row.accepts = "a number";
  row.set = [=](Settings& s, const std::string& value) {
    double v = 0;
    if (!read_number(value, &v)) return false;
    ref(s) = v;
    return true;
  };
  row.get = [=](const Settings& s) { return ref(s) ? number_text(*ref(s)) : std::string(); };
  return row;
}

template <class Ref, class Enum>
OptionRow choice(OptionRow row, Ref ref, std::vector<std::pair<const char*, Enum>> values) {
  for (const auto& [word, value] : values) row.accepts += (row.accepts.empty() ? "" : ", ") + std::string(word);
  row.set = [=](Settings& s, const std::string& given) {
    for (const auto& [word, value] : values)
      if (given == word) {
        ref(s) = value;
        return true;
      }
    return false;
  };
  row.get = [=](const Settings& s) {
    for (const auto& [word, value] : values)
      if (ref(s) == value) return std::string(word);
    return std::string();
  };
  return row;
}

template <class Ref>
OptionRow axes(OptionRow row, Ref ref) {
  row.accepts = "x, y, z, any of them";
  row.list = true;
  row.set = [ref](Settings& s, const std::string& value) {
    std::array<bool, 3> on{};
    for (const std::string& axis : split(value, ',')) {
      if (axis.size() != 1 || axis[0] < 'x' || axis[0] > 'z') return false;
      on[static_cast<std::size_t>(axis[0] - 'x')] = true;
    }
    ref(s) = on;
    return true;
  };
  row.get = [ref](const Settings& s) {
    std::string value;
    for (std::size_t i = 0; i < 3; ++i)
      if (ref(s)[i]) value += (value.empty() ? "" : ",") + std::string(1, static_cast<char>('x' + i));
    return value;
  };
  return row;
}

// --- rows with a form of their own --------------------------------------------------------------------------------------------

bool read_numbers(const std::string& value, std::size_t count, double* out) {
  const std::vector<std::string> parts = split(value, ',');
  if (parts.size() != count) return false;
  for (std::size_t i = 0; i < count; ++i)
    if (!read_number(parts[i], out + i)) return false;
  return true;
}

OptionRow resolution(OptionRow row) {
  row.accepts = range_text(1, kMostVoxels) + ", or three of them";
  row.set = [](Settings& s, const std::string& value) {
    const std::vector<std::string> parts = split(value, ',');
    if (parts.size() != 1 && parts.size() != 3) return false;
    V3i n(0, 0, 0);
    for (unsigned i = 0; i < parts.size(); ++i)
      if (!read_integer(parts[i], 1, kMostVoxels, &n[static_cast<int>(i)])) return false;
    s.recipe.resolution = n;
    s.recipe.voxel_size = 0;
    return true;
  };
  row.get = [](const Settings& s) -> std::string {
    if (s.recipe.voxel_size > 0) return {};
    const V3i n = s.recipe.resolution;
    std::string value = std::to_string(n.x);
    if (n.y > 0) value += "," + std::to_string(n.y) + "," + std::to_string(n.z);
    return value;
  };
  return row;
}

OptionRow box(OptionRow row) {
  row.accepts = "six numbers, each lower one below its upper one";
  row.set = [](Settings& s, const std::string& value) {
    double v[6];
    if (!read_numbers(value, 6, v)) return false;
    if (!(v[0] < v[3] && v[1] < v[4] && v[2] < v[5])) return false;
    s.recipe.box = Box3d(V3d(v[0], v[1], v[2]), V3d(v[3], v[4], v[5]));
    return true;
  };
  row.get = [](const Settings& s) -> std::string {
    if (!s.recipe.box) return {};
    std::string value;
    for (const V3d& corner : {s.recipe.box->min, s.recipe.box->max})
      for (int i = 0; i < 3; ++i) value += (value.empty() ? "" : ",") + number_text(corner[i]);
    return value;
  };
  return row;
}

OptionRow extent(OptionRow row) {
  row.accepts = "two numbers > 0";
  row.set = [](Settings& s, const std::string& value) {
    double v[2];
    if (!read_numbers(value, 2, v) || !(v[0] > 0) || !(v[1] > 0) || v[0] > 1e30 || v[1] > 1e30) return false;
    s.recipe.heights.extent = V2d(v[0], v[1]);
    return true;
  };
  row.get = [](const Settings& s) -> std::string {
    const V2d e = s.recipe.heights.extent;
    return e.x > 0 ? number_text(e.x) + "," + number_text(e.y) : std::string();
  };
  return row;
}

// The recipe keeps the picture's name only: where it lies says the list of sources, or the recipe's own folder.
OptionRow height_color(OptionRow row) {
  row.set = [](Settings& s, const std::string& value) {
    if (value.empty()) return false;
    s.recipe.heights.color = value;
    return true;
  };
  row.get = [](const Settings& s) { return std::filesystem::path(s.recipe.heights.color).filename().string(); };
  return row;
}

OptionRow perlin_field(OptionRow row) {
  row.accepts = "none, or a period 1..64, 1..12 octaves, a seed 0..2147483647";
  row.set = [](Settings& s, const std::string& value) {
    PerlinField field;
    const std::vector<std::string> parts = split(value, ',');
    int seed = 0;
    if (value == "none") {
      s.recipe.heights.perlin = field;
      return true;
    }
    if (parts.size() != 3 || !read_integer(parts[0], 1, 64, &field.period) || !read_integer(parts[1], 1, 12, &field.octaves) ||
        !read_integer(parts[2], 0, std::numeric_limits<int>::max(), &seed))
      return false;
    field.seed = static_cast<std::uint32_t>(seed);
    s.recipe.heights.perlin = field;
    return true;
  };
  row.get = [](const Settings& s) -> std::string {
    const PerlinField& field = s.recipe.heights.perlin;
    return field.period > 0 ? std::to_string(field.period) + "," + std::to_string(field.octaves) + "," + std::to_string(field.seed) : std::string();
  };
  return row;
}

using WantFlag = std::pair<const char*, bool Want::*>;
constexpr WantFlag kWanted[] = {
    {"slices", &Want::slices},         {"density", &Want::density},   {"color", &Want::color},   {"ndf", &Want::ndf},
    {"visibility", &Want::visibility}, {"material", &Want::material}, {"normal", &Want::normal}, {"levels", &Want::levels},
    {"preview", &Want::preview}};

OptionRow want(OptionRow row) {
  for (const auto& [word, member] : kWanted) row.accepts += std::string(word) + ", ";
  row.accepts += "or all, renderer (all but slices)";
  row.list = true;
  row.set = [](Settings& s, const std::string& value) {
    Want wanted;
    for (const auto& [word, member] : kWanted) wanted.*member = false;
    for (const std::string& item : split(value, ',')) {
      bool known = item == "all" || item == "renderer";
      for (const auto& [word, member] : kWanted) {
        const bool is_slices = member == &Want::slices;
        if (item == word || item == "all" || (item == "renderer" && !is_slices)) wanted.*member = known = true;
      }
      if (!known) return false;
    }
    s.recipe.want = wanted;
    return true;
  };
  row.get = [](const Settings& s) {
    std::string value;
    for (const auto& [word, member] : kWanted)
      if (s.recipe.want.*member) value += (value.empty() ? "" : ",") + std::string(word);
    return value;
  };
  return row;
}

std::string light_text(const Light& light) {
  std::string value = light.kind == Light::Kind::kAmbient ? "ambient:" : light.kind == Light::Kind::kSun ? "sun:" : "point:";
  if (light.kind != Light::Kind::kAmbient)
    for (int i = 0; i < 3; ++i) value += number_text(light.vector[i]) + ",";
  // A float's shortest text, not that of the double it widens to.
  for (int i = 0; i < 3; ++i) {
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, light.color[i]).ptr;
    value.append(buffer, end);
    if (i < 2) value += ",";
  }
  return value;
}

OptionRow light(OptionRow row) {
  row.repeatable = true;
  row.accepts = "none, ambient:R,G,B, sun:DX,DY,DZ,R,G,B (direction of travel), point:X,Y,Z,R,G,B";
  row.set = [](Settings& s, const std::string& value) {
    if (value == "none") {
      s.recipe.lights.clear();
      return true;
    }
    const std::size_t colon = value.find(':');
    if (colon == std::string::npos) return false;
    const std::string kind = value.substr(0, colon), rest = value.substr(colon + 1);
    Light light;
    double v[6] = {};
    const double* color = v + 3;
    if (kind == "ambient") {
      color = v;
      if (!read_numbers(rest, 3, v)) return false;
    } else if (kind == "sun" || kind == "point") {
      light.kind = kind == "sun" ? Light::Kind::kSun : Light::Kind::kPoint;
      if (!read_numbers(rest, 6, v)) return false;
      light.vector = V3d(v[0], v[1], v[2]);
      if (kind == "sun" && light.vector.length() == 0) return false;
    } else {
      return false;
    }
    for (int i = 0; i < 3; ++i) {
      if (color[i] < 0 || color[i] > 1e6) return false;
      light.color[i] = static_cast<float>(color[i]);
    }
    s.recipe.lights.push_back(light);
    return true;
  };
  row.get = [](const Settings& s) {
    std::string value;
    for (const Light& light : s.recipe.lights) value += (value.empty() ? "" : " ") + light_text(light);
    return value;
  };
  return row;
}

OptionRow memory(OptionRow row) {
  row.accepts = "bytes, or a number with K, M, G or T";
  row.set = [](Settings& s, const std::string& value) {
    if (value.empty()) return false;
    double unit = 1;
    std::string digits = value;
    const std::size_t at = std::string("KMGT").find(value.back());
    if (at != std::string::npos) {
      unit = std::pow(1024.0, static_cast<double>(at + 1));
      digits.pop_back();
    }
    double v = 0;
    if (!read_number(digits, &v) || v < 0 || v * unit > 9e18) return false;
    s.recipe.memory = static_cast<std::int64_t>(v * unit);
    return true;
  };
  row.get = [](const Settings& s) { return s.recipe.memory > 0 ? std::to_string(s.recipe.memory) : std::string(); };
  return row;
}

OptionRow picture_size(OptionRow row) {
  row.accepts = "two numbers 1..8192, as 640x480";
  row.set = [](Settings& s, const std::string& value) {
    const std::vector<std::string> parts = split(value, 'x');
    if (parts.size() != 2) return false;
    int w = 0, h = 0;
    if (!read_integer(parts[0], 1, 8192, &w) || !read_integer(parts[1], 1, 8192, &h)) return false;
    s.view.width = w;
    s.view.height = h;
    return true;
  };
  row.get = [](const Settings& s) { return std::to_string(s.view.width) + "x" + std::to_string(s.view.height); };
  return row;
}

template <class Ref>
OptionRow integers(OptionRow row, int low, int high, Ref ref) {
  row.accepts = range_text(low, high) + ", one or several, with commas";
  row.set = [=](Settings& s, const std::string& value) {
    std::vector<int> all;
    for (const std::string& part : split(value, ',')) {
      int number = 0;
      if (!read_integer(part, low, high, &number)) return false;
      all.push_back(number);
    }
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    ref(s) = all;
    return true;
  };
  row.get = [=](const Settings& s) {
    std::string value;
    for (const int number : ref(s)) value += (value.empty() ? "" : ",") + std::to_string(number);
    return value;
  };
  return row;
}

OptionRow allow(OptionRow row) {
  row.repeatable = true;
  row.accepts = "one of the measures of docs/compare.md and a number";
  row.set = [](Settings& s, const std::string& value) {
    const std::size_t at = value.find('=');
    double v = 0;
    if (at == std::string::npos || !find_measure(value.substr(0, at)) || !read_number(value.substr(at + 1), &v) || v < 0) return false;
    s.compare.allowed.emplace_back(value.substr(0, at), v);
    return true;
  };
  row.get = [](const Settings& s) {
    std::string value;
    for (const auto& [name, v] : s.compare.allowed) value += (value.empty() ? "" : " ") + name + "=" + number_text(v);
    return value;
  };
  return row;
}

OptionRow background(OptionRow row) {
  row.accepts = "three linear values 0..1";
  row.set = [](Settings& s, const std::string& value) {
    double v[3];
    if (!read_numbers(value, 3, v)) return false;
    for (int i = 0; i < 3; ++i) {
      if (v[i] < 0 || v[i] > 1) return false;
      s.view.background[i] = static_cast<float>(v[i]);
    }
    return true;
  };
  row.get = [](const Settings& s) -> std::string {
    const V3f b = s.view.background;
    return b.x < 0 ? std::string() : number_text(b.x) + "," + number_text(b.y) + "," + number_text(b.z);
  };
  return row;
}

}  // namespace

std::string OptionRow::key() const {
  std::string k = name;
  std::replace(k.begin(), k.end(), '-', '_');
  return k;
}

std::string number_text(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

bool read_number(const std::string& text, double* value) {
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (begin != end && *begin == '+') ++begin;
  const auto [stop, error] = std::from_chars(begin, end, *value);
  return error == std::errc{} && stop == end && std::isfinite(*value);
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == at) parts.emplace_back();
    else parts.back() += c;
  }
  return parts;
}

std::vector<OptionRow> option_rows() {
  const double far = std::numeric_limits<double>::max();
  const std::vector<std::pair<const char*, Progress>> progress = {
      {"auto", Progress::kAuto}, {"always", Progress::kAlways}, {"never", Progress::kNever}};
  return {
      // Input and output
      text({.name = "output", .letter = 'o', .metavar = "PACK", .group = kFiles, .commands = kBake,
            .help = "the pack's folder, by convention NAME.texel; missing folders above it are made"},
           [](auto& s) -> auto& { return s.output; }),
      text({.name = "output", .letter = 'o', .metavar = "FOLDER", .group = kFiles, .commands = kBatch,
            .help = "where the packs go, one NAME.texel an item, in folders like those given"},
           [](auto& s) -> auto& { return s.output; }),
      text({.name = "output", .letter = 'o', .metavar = "IMAGE", .group = kFiles, .commands = kView, .help = "the picture: NAME.png or NAME.exr"},
           [](auto& s) -> auto& { return s.output; }),
      text({.name = "output", .letter = 'o', .metavar = "FOLDER", .group = kFiles, .commands = kBench, .help = "where bench.json and the plots go; also --out"},
           [](auto& s) -> auto& { return s.output; }),
      text({.name = "implicit", .metavar = "EXPR", .group = kFiles, .commands = kBake | kView | kBench,
            .help = "the solid where this function of x, y, z is >= --iso, as an INPUT or beside others (docs/inputs.md)", .in_recipe = true,
            .literal = true, .shown_default = "none", .accepts = "an expression"},
           [](auto& s) -> auto& { return s.recipe.implicit; }),
      maybe_number({.name = "iso", .metavar = "V", .group = kFiles, .commands = kBakes | kView | kBench, .help = "implicit surfaces lie where their function has this value",
                    .in_recipe = true, .shown_default = "the input's own, for --implicit 0"},
                   [](auto& s) -> auto& { return s.recipe.iso; }),
      text({.name = "recipe", .metavar = "FILE", .group = kFiles, .commands = kBakes,
            .help = "options from a JSON file, or from a pack or its manifest to rebake it; the command line beats it"},
           [](auto& s) -> auto& { return s.recipe_file; }),
      text({.name = "depfile", .metavar = "FILE", .group = kFiles, .commands = kBake,
            .help = "write a make-style list of everything read"},
           [](auto& s) -> auto& { return s.depfile; }),
      text({.name = "report", .metavar = "FILE", .group = kFiles, .commands = kBake,
            .help = "write JSON: counts, times per stage, peak memory, skipped and why, issues, errors"},
           [](auto& s) -> auto& { return s.report_file; }),
      text({.name = "report", .metavar = "FILE", .group = kFiles, .commands = kBatch,
            .help = "where the report of all items goes", .shown_default = "batch-report.json in FOLDER"},
           [](auto& s) -> auto& { return s.report_file; }),
      toggle({.name = "force", .group = kFiles, .commands = kBakes, .help = "bake though the pack is up to date"},
             [](auto& s) -> auto& { return s.force; }),
      toggle({.name = "plan", .group = kFiles, .commands = kBake, .help = "say what would be done, and stop"},
             [](auto& s) -> auto& { return s.plan; }),
      toggle({.name = "json", .group = kFiles, .commands = kInfo | kCheck | kCompare, .help = "print JSON"},
             [](auto& s) -> auto& { return s.json; }),

      text({.name = "texel", .metavar = "NAME", .group = kFiles, .commands = kBake | kView | kBench,
            .help = "which texel of a scene file with several (docs/scenes.md)", .in_recipe = true, .literal = true, .shown_default = "the one there is"},
           [](auto& s) -> auto& { return s.recipe.texel; }),
      [] {
        OptionRow row = integer({.name = "scene", .metavar = "N|auto", .group = kFiles, .commands = kBakes | kView | kBench, .help = "which scene of glTF files with several, from 0 on",
                                 .in_recipe = true, .shown_default = "the file's own choice"},
                                [](auto& s) -> auto& { return s.recipe.scene; }, 0, 1 << 30, "auto", -1);
        row.get = [](const Settings& s) { return s.recipe.scene >= 0 ? std::to_string(s.recipe.scene) : std::string(); };
        return row;
      }(),
      choice({.name = "unit", .metavar = "UNIT", .group = kFiles, .commands = kBakes | kView | kBench,
              .help = "unit of the mesh and plant files; the scene is then in metres. auto: cm for .opf, .gwa and .lig, others stay as they are", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.plants.unit; }, std::vector<std::pair<const char*, double>>{{"auto", 0}, {"mm", 0.001}, {"cm", 0.01}, {"m", 1}}),
      choice({.name = "angles", .metavar = "UNIT", .group = kFiles, .commands = kBakes | kView | kBench,
              .help = "unit of the angles in .ops files, degrees or radians", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.plants.radians; }, std::vector<std::pair<const char*, bool>>{{"deg", false}, {"rad", true}}),

      number({.name = "fibre-radius", .metavar = "R", .group = kFiles, .commands = kBakes | kView | kBench,
              .help = "radius of the lines in .obj files, in the file's unit; 0 leaves lines out", .in_recipe = true,
              .shown_default = "1/2000 of their diagonal"},
             [](auto& s) -> auto& { return s.recipe.fibres.radius; }, {0, 1e30, false, true}),

      // Height fields
      number({.name = "height", .metavar = "H", .group = kHeights, .commands = kBakes | kView | kBench,
              .help = "world height of value 1: an integer picture's full scale, a float picture's 1.0", .in_recipe = true,
              .shown_default = "a quarter of the longer side; a GeoTIFF's own units"},
             [](auto& s) -> auto& { return s.recipe.heights.height; }, {0, 1e30, true, true}),
      extent({.name = "extent", .metavar = "W,D", .group = kHeights, .commands = kBakes | kView | kBench,
              .help = "world size in x and y, from the first sample to the last; of a cyclic axis, one period", .in_recipe = true,
              .shown_default = "longer side 1; a GeoTIFF's own"}),
      maybe_number({.name = "base", .metavar = "Z", .group = kHeights, .commands = kBakes | kView | kBench,
                    .help = "world height of the plane the field is solid down to", .in_recipe = true,
                    .shown_default = "1/32 of the longer side below the lowest height"},
                   [](auto& s) -> auto& { return s.recipe.heights.base; }),
      maybe_number({.name = "no-data", .metavar = "V", .group = kHeights, .commands = kBakes | kView | kBench,
                    .help = "value, as stored in the picture, that means no data: holes, as where alpha is 0 or the file says so",
                    .in_recipe = true, .shown_default = "the file's own"},
                   [](auto& s) -> auto& { return s.recipe.heights.no_data; }),
      height_color({.name = "height-color", .metavar = "FILE", .group = kHeights, .commands = kBakes | kView | kBench,
                    .help = "picture of the surface's colour, or of its light", .in_recipe = true, .shown_default = "grey"}),
      perlin_field({.name = "perlin-field", .metavar = "PERIOD,OCTAVES,SEED", .group = kHeights, .commands = kBake | kView | kBench,
                    .help = "a cyclic field of gradient noise, as an input of its own", .in_recipe = true, .shown_default = "none"}),

      // Grid
      resolution({.name = "resolution", .letter = 'r', .metavar = "N|NX,NY,NZ", .group = kGridGroup, .commands = kBakes,
                  .help = "voxels along the longest side, or along x, y and z", .in_recipe = true}),
      number({.name = "voxel-size", .metavar = "S", .group = kGridGroup, .commands = kBakes,
              .help = "voxel edge in world units, instead of a resolution", .in_recipe = true, .shown_default = "from the resolution"},
             [](auto& s) -> auto& { return s.recipe.voxel_size; }, {0, far, true, true}),
      box({.name = "box", .metavar = "X0,Y0,Z0,X1,Y1,Z1", .group = kGridGroup, .commands = kBakes | kView | kBench, .help = "region to bake, or to make triangles of an implicit surface in, world units",
           .in_recipe = true, .shown_default = "the scene's bounds and --margin"}),
      integer({.name = "margin", .metavar = "N", .group = kGridGroup, .commands = kBakes | kBench, .help = "voxels around the scene's bounds",
               .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.margin; }, 0, 64),
      axes({.name = "cyclic", .metavar = "AXES", .group = kGridGroup, .commands = kBakes | kBench, .help = "axes along which the scene repeats; the box is one period, a whole number of voxels, without margin",
            .in_recipe = true, .shown_default = "none"},
           [](auto& s) -> auto& { return s.recipe.cyclic; }),

      // Volume
      want({.name = "want", .metavar = "LIST", .group = kVolume, .commands = kBakes,
            .help = "what the pack shall hold; what is not wanted costs nothing", .in_recipe = true, .shown_default = "renderer,slices"}),
      choice({.name = "fill", .metavar = "WHEN", .group = kVolume, .commands = kBakes | kBench,
              .help = "fill the inside: of closed components; on: an error where none is closed", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.fill; },
             std::vector<std::pair<const char*, Fill>>{{"auto", Fill::kAuto}, {"on", Fill::kOn}, {"off", Fill::kOff}}),
      choice({.name = "ndf", .metavar = "KIND", .group = kVolume, .commands = kBakes, .help = "what stands for the normals of a voxel",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.ndf; },
             std::vector<std::pair<const char*, NdfKind>>{{"sggx", NdfKind::kSggx}, {"neyret", NdfKind::kNeyret}, {"ratib", NdfKind::kRatib}}),
      choice({.name = "normals", .metavar = "WHICH", .group = kVolume, .commands = kBakes,
              .help = "whose normals count: of all surface, or of what is seen from outside the voxel", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.normals; },
             std::vector<std::pair<const char*, Normals>>{{"all", Normals::kAll}, {"visible", Normals::kVisible}}),
      choice({.name = "two-sided", .metavar = "WHEN", .group = kVolume, .commands = kBakes | kBench,
              .help = "surface lit from both sides; auto: materials with cut-outs, and where it is no solid those that say so themselves", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.two_sided; },
             std::vector<std::pair<const char*, Sidedness>>{
                 {"auto", Sidedness::kAuto}, {"always", Sidedness::kAlways}, {"never", Sidedness::kNever}}),
      number({.name = "max-depth", .metavar = "D", .group = kVolume, .commands = kBakes, .help = "cap of a voxel's optical depth; 9.21 is opacity 0.9999",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.max_depth; }, {0, 1000, true}),

      // Hypertexture
      choice({.name = "hypertexture", .metavar = "PRESET", .group = kNoise, .commands = kBakes | kView,
              .help = "bake a density: the input shape's, or a ball's, soft surface modulated by noise; fog: the input's values as they are; octaves: a periodic cube of noise to zoom through", .in_recipe = true,
              .shown_default = "none"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.preset; },
             std::vector<std::pair<const char*, std::string>>{{"eroded", "eroded"}, {"fire", "fire"}, {"fog", "fog"}, {"fur", "fur"}, {"marble", "marble"}, {"octaves", "octaves"}}),
      number({.name = "frequency", .metavar = "F", .group = kNoise, .commands = kBakes | kView, .help = "noise cells, hairs or veins a world unit", .in_recipe = true,
              .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.frequency; }, {0, 1e9, true, true}),
      [] {
        OptionRow row = integer({.name = "octaves", .metavar = "N", .group = kNoise, .commands = kBakes | kView,
                                 .help = "octaves of noise; those finer than two voxels are left out by themselves", .in_recipe = true, .shown_default = "the preset's"},
                                [](auto& s) -> auto& { return s.recipe.hypertexture.octaves; }, 1, kMostOctaves);
        row.get = [](const Settings& s) { return s.recipe.hypertexture.octaves > 0 ? std::to_string(s.recipe.hypertexture.octaves) : std::string(); };
        return row;
      }(),
      [] {
        OptionRow row = number({.name = "amount", .metavar = "A", .group = kNoise, .commands = kBakes | kView,
                                .help = "how far noise moves the surface, world units; marble: bends veins, in veins; fur: hair length", .in_recipe = true,
                                .shown_default = "the preset's"},
                               [](auto& s) -> auto& { return s.recipe.hypertexture.amount; }, {0, 1e9});
        row.get = [](const Settings& s) { return s.recipe.hypertexture.amount >= 0 ? number_text(s.recipe.hypertexture.amount) : std::string(); };
        return row;
      }(),
      number({.name = "softness", .metavar = "W", .group = kNoise, .commands = kBakes | kView, .help = "width of the soft region, world units; fur: of a hair's side, in noise",
              .in_recipe = true, .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.softness; }, {0, 1e9, true, true}),
      number({.name = "bias", .metavar = "B", .group = kNoise, .commands = kBakes | kView, .help = "density that the middle of the soft region gets", .in_recipe = true,
              .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.bias; }, {0, 0.999, true, true}),
      number({.name = "gain", .metavar = "G", .group = kNoise, .commands = kBakes | kView, .help = "contrast of the soft region; 0.5 changes nothing", .in_recipe = true,
              .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.gain; }, {0, 0.999, true, true}),
      number({.name = "density-scale", .metavar = "C", .group = kNoise, .commands = kBakes | kView,
              .help = "c of opacity 1-(1-D)^(c*length), per world unit", .in_recipe = true, .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.scale; }, {0, 1e12, true, true}),
      integer({.name = "seed", .metavar = "N", .group = kNoise, .commands = kBakes | kView, .help = "another noise of the same kind", .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.hypertexture.seed; }, 0, std::numeric_limits<int>::max()),

      text({.name = "solid-texture", .metavar = "NAME", .group = kNoise, .commands = kBakes | kView,
            .help = "colour by position instead of the materials' own: marble, wood, granite, or a picture for all planes or three for x, y, z, with commas",
            .in_recipe = true, .shown_default = "none"},
           [](auto& s) -> auto& { return s.recipe.solid_texture; }),
      number({.name = "solid-size", .metavar = "S", .group = kNoise, .commands = kBakes | kView, .help = "world units a picture, a vein, ten rings or ten grains take",
              .in_recipe = true, .shown_default = "half the scene's longest side"},
             [](auto& s) -> auto& { return s.recipe.solid_size; }, {0, 1e12, true, true}),
      choice({.name = "solid-blend", .metavar = "HOW", .group = kNoise, .commands = kBakes | kView,
              .help = "pictures on three planes: the plane the surface faces, or the sum of all three", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.solid_blend; },
             std::vector<std::pair<const char*, PlaneBlend>>{{"normal", PlaneBlend::kNormal}, {"sum", PlaneBlend::kSum}}),

      // Slices
      axes({.name = "slices", .metavar = "AXES", .group = kSlices, .commands = kBakes, .help = "axes along which to slice", .in_recipe = true},
           [](auto& s) -> auto& { return s.recipe.slice_axes; }),
      [] {
        OptionRow row = integer({.name = "slice-count", .metavar = "N|auto", .group = kSlices, .commands = kBakes,
                                 .help = "slices per axis; auto: as few as show no gap (--max-angle, --see-in)", .in_recipe = true,
                                 .shown_default = "the voxel count"},
                                [](auto& s) -> auto& { return s.recipe.slice_count; }, 1, kMostVoxels, "auto", -1);
        row.get = [](const Settings& s) -> std::string {
          const int n = s.recipe.slice_count;
          return n == 0 ? "" : n < 0 ? "auto" : std::to_string(n);
        };
        return row;
      }(),
      number({.name = "max-angle", .metavar = "DEG", .group = kSlices, .commands = kBakes,
              .help = "for --slice-count auto: largest angle between sight and axis, degrees", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.max_angle; }, {1, 89}),
      number({.name = "see-in", .metavar = "D", .group = kSlices, .commands = kBakes,
              .help = "for --slice-count auto: share of the width one can look into the object", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.see_in; }, {0, 0.5, true}),
      choice({.name = "slice-format", .metavar = "FORMAT", .group = kSlices, .commands = kBakes,
              .help = "png: 8 bit, sRGB, straight alpha; exr: half, linear, premultiplied", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.write.slice_format; },
             std::vector<std::pair<const char*, SliceFormat>>{{"png", SliceFormat::kPng}, {"exr", SliceFormat::kExr}}),
      integer({.name = "slice-levels", .metavar = "N", .group = kSlices, .commands = kBakes, .help = "coarser stacks beside the full one",
               .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.slice_levels; }, 0, 12),
      light({.name = "light", .metavar = "SPEC", .group = kSlices, .commands = kBakes,
             .help = "light to bake into the slices' colour; may be repeated", .in_recipe = true, .shown_default = "none"}),
      toggle({.name = "shadows", .group = kSlices, .commands = kBakes, .help = "lights cast shadows", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.shadows; }),

      // Levels
      integer({.name = "levels", .metavar = "all|N", .group = kLevels, .commands = kBakes, .help = "octree levels in all; all: down to one voxel",
               .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.levels; }, 1, 13, "all", -1),
      choice({.name = "level-mode", .metavar = "MODE", .group = kLevels, .commands = kBakes,
              .help = "opacity of coarser levels: from the geometry again, or from the finer level; the rest is always filtered",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.level_mode; },
             std::vector<std::pair<const char*, LevelMode>>{{"recompute", LevelMode::kRecompute}, {"filter", LevelMode::kFilter}}),
      number({.name = "prune", .metavar = "TOL", .group = kLevels, .commands = kBakes, .help = "leave out detail that changes less than this; only 0 in this version",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.prune; }, {0, 1}),

      // Accuracy
      integer({.name = "samples", .metavar = "S|auto", .group = kAccuracy, .commands = kBakes,
               .help = "sub-rays per voxel edge and axis: S*S rays through each voxel column; auto: 4, or 6 where textures cut holes or fibres lie", .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.samples; }, 1, 64, "auto", 0),
      number({.name = "max-error", .metavar = "E", .group = kAccuracy, .commands = kBakes,
              .help = "instead of --samples: as few rays as leave alpha with this rms error, more of them where it is uncertain; says what it reached", .in_recipe = true, .shown_default = "none"},
             [](auto& s) -> auto& { return s.recipe.max_error; }, {0, 1, true, true}),
      choice({.name = "pattern", .metavar = "KIND", .group = kAccuracy, .commands = kBakes,
              .help = "places of the sub-rays: rank-1 lattice or square grid", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.pattern; },
             std::vector<std::pair<const char*, Pattern>>{{"lattice", Pattern::kLattice}, {"grid", Pattern::kGrid}}),
      toggle({.name = "full-float", .group = kAccuracy, .commands = kBakes, .help = "store grids as 32-bit floats rather than halves",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.write.full_float; }),

      // Compare
      allow({.name = "allow", .metavar = "MEASURE=VALUE", .group = kMeasuring, .commands = kCompare,
             .help = "exit status 7 if a figure of this measure is larger, at any level and axis (of psnr and ssim: smaller); may be repeated", .shown_default = "anything"}),
      integer({.name = "level", .metavar = "N|all", .group = kMeasuring, .commands = kCompare, .help = "this level only"},
              [](auto& s) -> auto& { return s.view.level; }, 0, 12, "all", -1),
      integer({.name = "voxels", .metavar = "N|all", .group = kMeasuring, .commands = kCompare, .help = "voxels of each level held against the geometry"},
              [](auto& s) -> auto& { return s.compare.voxels; }, 1, 65536, "all", std::numeric_limits<int>::max()),
      integer({.name = "columns", .metavar = "N", .group = kMeasuring, .commands = kCompare, .help = "columns of each level and axis, and beams in random directions"},
              [](auto& s) -> auto& { return s.compare.columns; }, 1, 65536),
      integer({.name = "seed", .metavar = "N", .group = kMeasuring, .commands = kCompare | kBench, .help = "another sample of the same size"},
              [](auto& s) -> auto& { return s.compare.seed; }, 0, std::numeric_limits<int>::max()),
      toggle({.name = "truth", .group = kPicture, .commands = kCompare, .help = "pictures of the pack against pictures of its geometry, too"},
             [](auto& s) -> auto& { return s.view.truth; }),
      integer({.name = "views", .metavar = "N", .group = kPicture, .commands = kCompare, .help = "cameras all around"},
              [](auto& s) -> auto& { return s.compare.views; }, 1, 10000),
      integer({.name = "recede", .metavar = "D", .group = kPicture, .commands = kCompare, .help = "times one camera doubles its distance; 0: not at all"},
              [](auto& s) -> auto& { return s.compare.doublings; }, 0, 30),
      picture_size({.name = "size", .metavar = "WxH", .group = kPicture, .commands = kCompare, .help = "pixels of the pictures", .shown_default = "256x256"}),

      // Bench
      integers({.name = "resolution", .letter = 'r', .metavar = "N[,N...]", .group = kMeasuring, .commands = kBench, .help = "voxels along the longest side, one sweep each"}, 1, 1024,
               [](auto& s) -> auto& { return s.bench.resolutions; }),
      integers({.name = "samples", .metavar = "S[,S...]", .group = kMeasuring, .commands = kBench, .help = "sub-rays per voxel edge of the bundles"}, 1, 64,
               [](auto& s) -> auto& { return s.bench.samples; }),
      integers({.name = "rays", .metavar = "N[,N...]", .group = kMeasuring, .commands = kBench, .help = "random rays a voxel and axis of the baseline"}, 1, 1 << 20,
               [](auto& s) -> auto& { return s.bench.rays; }),
      integer({.name = "voxels", .metavar = "N", .group = kMeasuring, .commands = kBench, .help = "voxels of each level that errors are measured in"},
              [](auto& s) -> auto& { return s.bench.voxels; }, 1, 65536),
      integer({.name = "repeat", .metavar = "N", .group = kMeasuring, .commands = kBench, .help = "times each run is done; the quickest counts"},
              [](auto& s) -> auto& { return s.bench.repeats; }, 1, 100),
      number({.name = "time-limit", .metavar = "SECONDS", .group = kMeasuring, .commands = kBench, .help = "runs that would take more CPU time, as those before them tell, are left out"},
             [](auto& s) -> auto& { return s.bench.time_limit; }, {0, 1e6, true}),

      // View
      choice({.name = "up", .metavar = "AXIS", .group = kCamera, .commands = kBakes | kView,
              .help = "axis that points up in pictures; auto: y for .obj, .ply and .off, else z", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.up; },
             std::vector<std::pair<const char*, int>>{{"auto", -1}, {"x", 0}, {"y", 1}, {"z", 2}}),
      number({.name = "azimuth", .metavar = "DEG", .group = kCamera, .commands = kView, .help = "camera about the up axis; -90: from the front (-Y where Z is up, else +Z, -Z)"},
             [](auto& s) -> auto& { return s.view.azimuth; }, {-360, 360}),
      number({.name = "elevation", .metavar = "DEG", .group = kCamera, .commands = kView, .help = "camera above the horizon"},
             [](auto& s) -> auto& { return s.view.elevation; }, {-90, 90}),
      number({.name = "fov", .metavar = "DEG", .group = kCamera, .commands = kView, .help = "vertical field of view"},
             [](auto& s) -> auto& { return s.view.fov; }, {1, 120}),
      picture_size({.name = "size", .metavar = "WxH", .group = kPicture, .commands = kView, .help = "pixels"}),
      choice({.name = "mode", .metavar = "MODE", .group = kPicture, .commands = kView,
              .help = "reference renderer, slices laid over each other, the true geometry, or one zoom cycle of a cube of octaves", .shown_default = "volume; truth for a mesh"},
             [](auto& s) -> auto& { return s.view.mode; },
             std::vector<std::pair<const char*, std::string>>{{"volume", "volume"}, {"slices", "slices"}, {"truth", "truth"}, {"zoom", "zoom"}}),
      toggle({.name = "truth", .group = kPicture, .commands = kView, .help = "the same as --mode truth; of a pack: its source meshes, or those named after it"},
             [](auto& s) -> auto& { return s.view.truth; }),
      integer({.name = "samples", .metavar = "S", .group = kPicture, .commands = kView, .help = "rays per pixel"},
              [](auto& s) -> auto& { return s.view.samples; }, 1, 1024),
      integer({.name = "level", .metavar = "N|auto", .group = kPicture, .commands = kView, .help = "this level only; auto: as the pixel's size asks"},
              [](auto& s) -> auto& { return s.view.level; }, 0, 12, "auto", -1),
      choice({.name = "axis", .metavar = "AXIS", .group = kPicture, .commands = kView, .help = "slices of this axis; auto: by the camera"},
             [](auto& s) -> auto& { return s.view.axis; },
             std::vector<std::pair<const char*, int>>{{"auto", -1}, {"x", 0}, {"y", 1}, {"z", 2}}),
      light({.name = "light", .metavar = "SPEC", .group = kPicture, .commands = kView | kCompare,
             .help = "light to view with; may be repeated", .shown_default = "a sun over the left shoulder and ambient light"}),
      toggle({.name = "no-shadows", .group = kPicture, .commands = kView | kCompare, .help = "lights cast no shadows"},
             [](auto& s) -> auto& { return s.view.no_shadows; }),
      background({.name = "background", .metavar = "R,G,B", .group = kPicture, .commands = kView, .help = "plain background",
                  .shown_default = "none: the picture has alpha"}),

      // Running
      integer({.name = "threads", .metavar = "N", .group = kRunning, .commands = kBakes | kView | kCompare | kBench,
               .help = "the product has the same bytes for every N"},
              [](auto& s) -> auto& { return s.recipe.threads; }, 1, 1024, "all", 0),
      integer({.name = "jobs", .letter = 'j', .metavar = "N", .group = kRunning, .commands = kBatch,
               .help = "items at once, which share the threads; auto: as many as threads, at most 4"},
              [](auto& s) -> auto& { return s.jobs; }, 1, 256, "auto", 0),
      memory({.name = "memory", .metavar = "SIZE", .group = kRunning, .commands = kBakes, .help = "the bake is cut into slabs to keep within it; mesh, textures and finished grids are not bounded, and the pack is the same", .shown_default = "3G"}),
      choice({.name = "progress", .metavar = "WHEN", .group = kRunning, .commands = kBakes | kView | kCompare | kBench,
              .help = "a bar on stderr; auto: on a terminal, after two seconds"},
             [](auto& s) -> auto& { return s.progress; }, progress),
      toggle({.name = "verbose", .letter = 'v', .group = kRunning, .commands = kBakes | kView, .help = "times and counts of each stage"},
             [](auto& s) -> auto& { return s.verbose; }),
      toggle({.name = "verbose", .letter = 'v', .group = kRunning, .commands = kCompare, .help = "every figure with its interval, unit and norm"},
             [](auto& s) -> auto& { return s.verbose; }),
      toggle({.name = "verbose", .letter = 'v', .group = kFiles, .commands = kInfo, .help = "how each error figure was found, too"},
             [](auto& s) -> auto& { return s.verbose; }),
      toggle({.name = "help", .letter = 'h', .group = kRunning, .commands = kAll, .help = "this text"},
             [](auto& s) -> auto& { return s.help; }),
  };
}

}  // namespace texel
