// The options that lay a pack over a surface, and the whole table with them.
#include <algorithm>
#include <string_view>

#include "cli/options.h"

namespace texel {
namespace {

constexpr const char* kCamera = "Camera";
constexpr const char* kOver = "A pack as a texel";
constexpr int kMostTexels = 4096;

// A whole number 1…kMostTexels; 0: it is none.
int texels(const std::string& value) {
  double v = 0;
  return read_number(value, &v) && v >= 1 && v <= kMostTexels && v == static_cast<int>(v) ? static_cast<int>(v) : 0;
}

OptionRow positive(OptionRow row, double ViewSettings::*field, double most, bool none) {
  row.accepts = none ? "> 0" : "> 0, <= " + number_text(most);
  row.set = [=](Settings& s, const std::string& value) {
    double v = 0;
    if (!read_number(value, &v) || !(v > 0) || v > most) return false;
    s.view.*field = v;
    return true;
  };
  row.get = [=](const Settings& s) { return s.view.*field > 0 ? number_text(s.view.*field) : std::string(); };
  return row;
}

OptionRow words(OptionRow row, std::string ViewSettings::*field) {
  row.set = [=](Settings& s, const std::string& value) {
    if (value.empty()) return false;
    s.view.*field = value;
    return true;
  };
  row.get = [=](const Settings& s) { return s.view.*field; };
  return row;
}

OptionRow repeat() {
  OptionRow row{.name = "repeat", .metavar = "NU,NV", .group = kOver, .commands = kView, .help = "texels along u and v; of a mesh: for each unit of its (u,v)",
                .shown_default = "plane 5,5, sphere 12,6, mesh 1,1"};
  row.accepts = "two numbers 1.." + std::to_string(kMostTexels) + ", as 12,6";
  row.set = [](Settings& s, const std::string& value) {
    const std::vector<std::string> parts = split(value, ',');
    if (parts.size() != 2 || texels(parts[0]) == 0 || texels(parts[1]) == 0) return false;
    s.view.repeat_u = texels(parts[0]);
    s.view.repeat_v = texels(parts[1]);
    return true;
  };
  row.get = [](const Settings& s) { return s.view.repeat_u > 0 ? std::to_string(s.view.repeat_u) + "," + std::to_string(s.view.repeat_v) : std::string(); };
  return row;
}

OptionRow ground() {
  OptionRow row{.name = "ground", .metavar = "R,G,B", .group = kOver, .commands = kView, .help = "the surface itself, matt, in this colour", .shown_default = "none: it is not seen"};
  row.accepts = "three linear values 0..1";
  row.set = [](Settings& s, const std::string& value) {
    const std::vector<std::string> parts = split(value, ',');
    V3f color;
    if (parts.size() != 3) return false;
    for (int k = 0; k < 3; ++k) {
      double v = 0;
      if (!read_number(parts[static_cast<std::size_t>(k)], &v) || v < 0 || v > 1) return false;
      color[k] = static_cast<float>(v);
    }
    s.view.ground = color;
    return true;
  };
  row.get = [](const Settings& s) -> std::string {
    const V3f& c = s.view.ground;
    return c.x < 0 ? std::string() : number_text(c.x) + "," + number_text(c.y) + "," + number_text(c.z);
  };
  return row;
}

}  // namespace

std::vector<OptionRow> option_table() {
  std::vector<OptionRow> rows = option_rows();
  const auto place = [&](std::string_view name) { return std::find_if(rows.begin(), rows.end(), [&](const OptionRow& row) { return row.name == name; }); };
  rows.insert(place("size"), positive({.name = "distance", .metavar = "F", .group = kCamera, .commands = kView,
                                       .help = "camera so many times as far away as all just fits into the picture"}, &ViewSettings::distance, 1e6, false));
  const std::vector<OptionRow> over{
      words({.name = "over", .metavar = "SURFACE", .group = kOver, .commands = kView, .help = "repeat the pack over a surface: plane, sphere, or a mesh file with (u,v)",
             .shown_default = "none: the pack alone"}, &ViewSettings::over),
      repeat(),
      positive({.name = "texel-height", .metavar = "H", .group = kOver, .commands = kView, .help = "length of the height vectors, world units",
                .shown_default = "the box's own; mesh: in proportion to the mean size of a texel"}, &ViewSettings::texel_height, 1e30, true),
      words({.name = "tips", .metavar = "MESH", .group = kOver, .commands = kView, .help = "the mesh of --over with its points moved to the ends of their height vectors",
             .shown_default = "none: along the normals"}, &ViewSettings::tips),
      ground()};
  rows.insert(place("threads"), over.begin(), over.end());
  return rows;
}

}  // namespace texel
