// The pack's preview: labelled pictures side by side.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "bake/shading.h"
#include "formats/error.h"

namespace texel {

namespace {

constexpr V3f kBackground(0.18f, 0.18f, 0.18f);
constexpr V3f kFrame(0.45f, 0.45f, 0.45f);
constexpr V3f kInk(0.9f, 0.9f, 0.9f);
constexpr double kAzimuth = -60, kElevation = 20;

// Five columns of seven pixels, lowest bit on top.
struct Glyph { char sign; std::array<unsigned char, 5> columns; };
constexpr Glyph kFont[] = {
    {'0', {0x3e, 0x51, 0x49, 0x45, 0x3e}}, {'1', {0x00, 0x42, 0x7f, 0x40, 0x00}}, {'2', {0x42, 0x61, 0x51, 0x49, 0x46}},
    {'3', {0x21, 0x41, 0x45, 0x4b, 0x31}}, {'4', {0x18, 0x14, 0x12, 0x7f, 0x10}}, {'5', {0x27, 0x45, 0x45, 0x45, 0x39}},
    {'6', {0x3c, 0x4a, 0x49, 0x49, 0x30}}, {'7', {0x01, 0x71, 0x09, 0x05, 0x03}}, {'8', {0x36, 0x49, 0x49, 0x49, 0x36}},
    {'9', {0x06, 0x49, 0x49, 0x29, 0x1e}}, {'A', {0x7e, 0x11, 0x11, 0x11, 0x7e}}, {'B', {0x7f, 0x49, 0x49, 0x49, 0x36}},
    {'C', {0x3e, 0x41, 0x41, 0x41, 0x22}}, {'D', {0x7f, 0x41, 0x41, 0x22, 0x1c}}, {'E', {0x7f, 0x49, 0x49, 0x49, 0x41}},
    {'F', {0x7f, 0x09, 0x09, 0x09, 0x01}}, {'G', {0x3e, 0x41, 0x49, 0x49, 0x7a}}, {'H', {0x7f, 0x08, 0x08, 0x08, 0x7f}},
    {'I', {0x00, 0x41, 0x7f, 0x41, 0x00}}, {'J', {0x20, 0x40, 0x41, 0x3f, 0x01}}, {'K', {0x7f, 0x08, 0x14, 0x22, 0x41}},
    {'L', {0x7f, 0x40, 0x40, 0x40, 0x40}}, {'M', {0x7f, 0x02, 0x0c, 0x02, 0x7f}}, {'N', {0x7f, 0x04, 0x08, 0x10, 0x7f}},
    {'O', {0x3e, 0x41, 0x41, 0x41, 0x3e}}, {'P', {0x7f, 0x09, 0x09, 0x09, 0x06}}, {'Q', {0x3e, 0x41, 0x51, 0x21, 0x5e}},
    {'R', {0x7f, 0x09, 0x19, 0x29, 0x46}}, {'S', {0x46, 0x49, 0x49, 0x49, 0x31}}, {'T', {0x01, 0x01, 0x7f, 0x01, 0x01}},
    {'U', {0x3f, 0x40, 0x40, 0x40, 0x3f}}, {'V', {0x1f, 0x20, 0x40, 0x20, 0x1f}}, {'W', {0x3f, 0x40, 0x38, 0x40, 0x3f}},
    {'X', {0x63, 0x14, 0x08, 0x14, 0x63}}, {'Y', {0x07, 0x08, 0x70, 0x08, 0x07}}, {'Z', {0x61, 0x51, 0x49, 0x45, 0x43}},
    {'x', {0x44, 0x28, 0x10, 0x28, 0x44}}, {'.', {0x00, 0x60, 0x60, 0x00, 0x00}}, {'-', {0x08, 0x08, 0x08, 0x08, 0x08}},
    {'/', {0x20, 0x10, 0x08, 0x04, 0x02}}, {'^', {0x00, 0x06, 0x09, 0x09, 0x06}}, {':', {0x00, 0x36, 0x36, 0x00, 0x00}},
};

void put(Image& sheet, int x, int y, const V3f& color) {
  if (x < 0 || y < 0 || x >= sheet.width || y >= sheet.height) return;
  for (int c = 0; c < 3; ++c) sheet.at(x, y)[c] = color[c];
}

void write_text(Image& sheet, int x, int y, const std::string& text, int size) {
  for (const char sign : text) {
    for (const Glyph& glyph : kFont) {
      if (glyph.sign != sign) continue;
      for (int i = 0; i < 5 * size; ++i)
        for (int j = 0; j < 7 * size; ++j)
          if (glyph.columns[static_cast<std::size_t>(i / size)] >> (j / size) & 1) put(sheet, x + i, y + j, kInk);
    }
    x += 6 * size;
  }
}

struct Tile {
  std::string label;
  Image picture;  // RGBA
};

std::string text_of(const V3i& n) { return std::to_string(n.x) + "x" + std::to_string(n.y) + "x" + std::to_string(n.z); }

Image lay_out(const std::vector<Tile>& tiles, int size) {
  const int text = std::max(1, size / 160), bar = 7 * text + 8;
  Image sheet;
  sheet.width = static_cast<int>(tiles.size()) * (size + 1) + 1;
  sheet.height = size + bar + 3;
  sheet.channels = 3;
  sheet.pixels.resize(static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height) * 3);
  for (int y = 0; y < sheet.height; ++y)
    for (int x = 0; x < sheet.width; ++x) {
      const bool line = x % (size + 1) == 0 || y == 0 || y == size + 1 || y == sheet.height - 1;
      put(sheet, x, y, line ? kFrame : V3f(0.03f));
    }
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const int left = static_cast<int>(i) * (size + 1) + 1;
    const Image picture = over_background(tiles[i].picture, kBackground);
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) put(sheet, left + x, 1 + y, V3f(picture.at(x, y)[0], picture.at(x, y)[1], picture.at(x, y)[2]));
    write_text(sheet, left + 5, size + 2 + (bar - 7 * text) / 2, tiles[i].label, text);
  }
  return sheet;
}

// From far enough that the box's sphere fits; then the angle is narrowed until the box itself fills the tile.
Camera camera_for(const Box3d& box, double elevation) {
  Camera camera = orbit_camera(box, kAzimuth, elevation);
  const Rays rays = make_rays(camera, 1, 1);
  double widest = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const V3d p(corner & 1 ? box.max.x : box.min.x, corner & 2 ? box.max.y : box.min.y, corner & 4 ? box.max.z : box.min.z);
    const V3d v = p - rays.eye;
    const double ahead = v.dot(rays.forward);
    if (ahead > 0) widest = std::max({widest, std::abs(v.dot(rays.right)) / ahead, std::abs(v.dot(rays.up)) / ahead});
  }
  if (widest > 0) camera.fov = std::min(camera.fov, 2 * std::atan(widest * 1.02) * 180 / std::numbers::pi);
  return camera;
}

// From near the steepest angle at which the stack along z still closes, at most 60° away from its axis.
double grazing_elevation(const Pack& pack) {
  for (const SliceStack& stack : pack.slices)
    if (stack.axis == 2 && stack.level == 0 && stack.max_angle > 0) return 90 - std::clamp(stack.max_angle - 5, 10.0, 60.0);
  return 40;
}

}  // namespace

Image contact_sheet(const Pack& pack, const Scene* scene, int tile_size, int threads, Report& report) {
  if (tile_size < 16 || tile_size > 4096) throw Error(Code::kCommandLine, "", "tile size " + std::to_string(tile_size) + " is out of range", "use 16 to 4096");
  ViewOptions options;
  options.camera = camera_for(pack.grid.box(), kElevation);
  options.width = options.height = tile_size;
  options.threads = threads;
  std::vector<Tile> tiles;
  if (scene) tiles.push_back({"TRUTH", view_truth(*scene, options, report)});
  if (!pack.levels.empty()) tiles.push_back({"VOLUME " + text_of(pack.levels[0].grid.n), view_volume(pack, options, report)});
  const bool z_slices = std::any_of(pack.slices.begin(), pack.slices.end(), [](const SliceStack& s) { return s.axis == 2 && s.level == 0; });
  if (z_slices) {
    ViewOptions grazing = options;
    const double elevation = grazing_elevation(pack);
    grazing.camera = camera_for(pack.grid.box(), elevation);
    grazing.slice_axis = 2;
    const auto angle = static_cast<int>(std::lround(90 - elevation));
    tiles.push_back({"SLICES Z AT " + std::to_string(angle) + "^", view_slices(pack, grazing, report)});
  } else if (!pack.slices.empty()) {
    tiles.push_back({"SLICES", view_slices(pack, options, report)});
  }
  if (pack.levels.size() > 1) {
    ViewOptions coarse = options;
    coarse.level = std::min(3, static_cast<int>(pack.levels.size()) - 1);
    const std::string label = "LEVEL " + std::to_string(coarse.level) + " " + text_of(pack.levels[static_cast<std::size_t>(coarse.level)].grid.n);
    tiles.push_back({label, view_volume(pack, coarse, report)});
  }
  if (tiles.empty()) return {};
  return lay_out(tiles, tile_size);
}

}  // namespace texel
