#include "cli/option_kinds.h"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>

#include "bake/compare.h"
#include "formats/noise.h"

namespace texel {
namespace {

bool read_numbers(const std::string& value, std::size_t count, double* out) {
  const std::vector<std::string> parts = split(value, ',');
  if (parts.size() != count) return false;
  for (std::size_t i = 0; i < count; ++i)
    if (!read_number(parts[i], out + i)) return false;
  return true;
}

using WantFlag = std::pair<const char*, bool Want::*>;
constexpr WantFlag kWanted[] = {
    {"slices", &Want::slices},         {"density", &Want::density},   {"color", &Want::color},   {"ndf", &Want::ndf},
    {"visibility", &Want::visibility}, {"material", &Want::material}, {"normal", &Want::normal}, {"levels", &Want::levels},
    {"preview", &Want::preview}};

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

}  // namespace

std::string range_text(double low, double high) { return number_text(low) + ".." + number_text(high); }

bool read_integer(const std::string& value, int low, int high, int* out) {
  int number = 0;
  const char* end = value.data() + value.size();
  const auto [stop, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc{} || stop != end || number < low || number > high) return false;
  *out = number;
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

}  // namespace texel
