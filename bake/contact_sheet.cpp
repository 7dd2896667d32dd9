// The pack's preview: labelled pictures side by side.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "bake/view_voxels.h"
#include "formats/error.h"

namespace texel {

namespace {

constexpr V3f kBackground(0.18f, 0.18f, 0.18f);
constexpr V3f kFrame(0.45f, 0.45f, 0.45f);
constexpr V3f kInk(0.9f, 0.9f, 0.9f);
constexpr double kAzimuth = -60, kElevation = 30, kAngle = 25;

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

// Corners of what there is: of the finest level's voxels, block by block, or of the box.
std::vector<V3d> outline(const Pack& pack) {
  std::vector<V3d> points;
  const auto add = [&](const Grid& grid, const V3d& low, const V3d& high) {
    for (int i = 0; i < 8; ++i) points.push_back(grid.to_world(V3d(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z)));
  };
  const Layer* layer = nullptr;
  if (!pack.levels.empty() && (pack.levels[0].find("alpha", &layer) || pack.levels[0].find("density", &layer))) {
    const Grid& grid = pack.levels[0].grid;
    for (const Block& block : layer->set.blocks) {
      Box3d box;
      for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y)
          for (int z = 0; z < 8; ++z)
            if (block.has(x, y, z)) box.extendBy(V3d(block.at * 8 + V3i(x, y, z)));
      if (!box.isEmpty()) add(grid, box.min, box.max + V3d(1, 1, 1));
    }
    for (const V3i& tile : layer->tiles) add(grid, V3d(tile * 8), V3d(tile * 8 + V3i(8, 8, 8)));
  }
  if (points.empty()) add(pack.grid, V3d(0, 0, 0), V3d(pack.grid.n));
  return points;
}

double angle_to(const SliceStack& stack, const V3d& forward) {
  return std::acos(std::min(std::abs(forward[std::clamp(stack.axis, 0, 2)]), 1.0)) * 180 / std::numbers::pi;
}

// The finest stack along the up axis: seen from the side and a little above it shows slices at a grazing angle. Else any.
const SliceStack* shown_stack(const Pack& pack, int up) {
  const SliceStack* any = nullptr;
  for (const SliceStack& stack : pack.slices) {
    if (stack.level != 0) continue;
    if (stack.axis == up) return &stack;
    if (!any) any = &stack;
  }
  return any;
}

// Near the steepest angle at which that stack still closes, within what shows the rest well.
double elevation_for(const SliceStack* stack, int up) {
  if (!stack || stack->axis != up || !(stack->max_angle > 0)) return kElevation;
  return 90 - std::clamp(stack->max_angle - 0.5, 50.0, 90 - kElevation);
}

// Slices have no light of their own, so that a model of one colour is a flat patch. Here each pixel is multiplied by what a white matt
// surface with the mean normal of the volume's voxels there would send: ambient light and sun, no shadows.
class SliceLight {
 public:
  SliceLight(const Pack& pack, const SliceStack& stack, const Rays& rays, const std::vector<Light>& lights)
      : stack_(stack), grid_(pack.grid), to_eye_(-rays.forward), lights_(lights), ambient_(ambient_of(lights)),
        normal_(pack.levels[0], "normal", 3), solid_(pack.levels[0], "solid", 1) {}

  [[nodiscard]] Image lit(int k) const {
    Image image = stack_.image(k);
    if (image.channels != 4 || image.width < 1 || image.height < 1) return image;
    const int axis = stack_.axis, across = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
    const double first = k * stack_.thickness / grid_.h;
    V3d low, high;
    low[axis] = first;
    high[axis] = first + stack_.thickness / grid_.h;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        float* pixel = image.at(x, y);
        if (!(pixel[3] > 0)) continue;
        low[across] = static_cast<double>(x) * grid_.n[across] / image.width;
        high[across] = static_cast<double>(x + 1) * grid_.n[across] / image.width;
        low[up] = static_cast<double>(image.height - 1 - y) * grid_.n[up] / image.height;
        high[up] = static_cast<double>(image.height - y) * grid_.n[up] / image.height;
        const V3f light = light_in(low, high);
        for (int c = 0; c < 3; ++c) pixel[c] *= light[c];
      }
    return image;
  }

 private:
  // Sum over the voxels whose centres lie in the box widened by `reach` voxels; whether there was any.
  bool gather(const V3d& low, const V3d& high, int reach, V3d* sum, int* count, bool* open) const {
    V3i a, b;
    for (int i = 0; i < 3; ++i) {
      a[i] = std::max(static_cast<int>(std::ceil(low[i] - 0.5 - 1e-6)) - reach, 0);
      b[i] = std::min(std::max(static_cast<int>(std::ceil(high[i] - 0.5 - 1e-6)) - 1, a[i] + reach) + reach, grid_.n[i] - 1);
    }
    for (int z = a.z; z <= b.z; ++z)
      for (int y = a.y; y <= b.y; ++y)
        for (int x = a.x; x <= b.x; ++x)
          if (const float* n = normal_.at(V3i(x, y, z))) {
            *sum += V3d(n[0], n[1], n[2]);
            ++*count;
            if (!(solid_.value(V3i(x, y, z), 0) > 0)) *open = true;
          }
    return *count > 0;
  }

  [[nodiscard]] V3f light_in(const V3d& low, const V3d& high) const {
    V3d sum(0, 0, 0);
    int count = 0;
    bool open = false;
    // Inside a solid, next to its surface, the light of that goes on.
    const bool any = gather(low, high, 0, &sum, &count, &open) || gather(low, high, 1, &sum, &count, &open);
    const V3d m = any ? sum / count : V3d(0, 0, 0);
    const double length = std::min(m.length(), 1.0);
    const bool back = open && m.dot(to_eye_) < 0;
    V3f light = ambient_;
    for (const Light& source : lights_) {
      V3d l;
      V3f color;
      if (!light_at(source, grid_.to_world((low + high) / 2), &l, &color)) continue;
      // What has no one normal is lit as normals in all directions turned to the eye are, on average.
      const double one = length > 0 && !back ? std::max(m.dot(l) / length, 0.0) : 0.0;
      light += color * static_cast<float>(length * one + (1 - length) * 0.5);
    }
    return light;
  }

  const SliceStack& stack_;
  const Grid& grid_;
  V3d to_eye_;
  std::vector<Light> lights_;
  V3f ambient_;
  VoxelField normal_, solid_;
};

Tile slice_tile(const Pack& pack, const SliceStack& stack, ViewOptions options, bool light, Report& report) {
  const Rays rays = make_rays(options.camera, options.width, options.height);
  options.slice_axis = stack.axis;
  Tile tile;
  tile.label = std::string("SLICES ") + "XYZ"[std::clamp(stack.axis, 0, 2)] + " AT " + std::to_string(std::lround(angle_to(stack, rays.forward))) + "^";
  if (!light || pack.levels.empty() || !pack.levels[0].find("normal") || pack.levels[0].grid.n != pack.grid.n) {
    tile.picture = view_slices(pack, options, report);
    return tile;
  }
  const SliceLight lighter(pack, stack, rays, view_lights(options, rays));
  Pack shown;  // only what view_slices reads
  shown.grid = pack.grid;
  shown.slices.push_back(stack);
  shown.slices.back().image = [&lighter](int k) { return lighter.lit(k); };
  tile.label += " LIT";
  tile.picture = view_slices(shown, options, report);
  return tile;
}

}  // namespace

Image contact_sheet(const Pack& pack, const Scene* scene, const SheetOptions& sheet, Report& report) {
  if (sheet.tile < 16 || sheet.tile > 4096) throw Error(Code::kCommandLine, "", "tile size " + std::to_string(sheet.tile) + " is out of range", "use 16 to 4096");
  ViewOptions options;
  const SliceStack* stack = shown_stack(pack, sheet.up);
  options.camera = frame_points(outline(pack), kAzimuth, elevation_for(stack, sheet.up), kAngle, sheet.up);
  options.width = options.height = sheet.tile;
  options.threads = sheet.threads;
  options.two_sided = sheet.two_sided;
  options.cyclic = pack.cyclic;
  options.grid = pack.grid;
  options.lights = sheet.lights;
  const bool own_light = !sheet.lights.empty();
  if (own_light) options.shadows = sheet.shadows;
  std::vector<Tile> tiles;
  if (scene) tiles.push_back({"TRUTH", view_truth(*scene, options, report)});
  if (!pack.levels.empty()) tiles.push_back({"VOLUME " + text_of(pack.levels[0].grid.n), view_volume(pack, options, report)});
  if (stack) tiles.push_back(slice_tile(pack, *stack, options, !own_light, report));
  if (pack.levels.size() > 1) {
    ViewOptions coarse = options;
    coarse.level = std::min(3, static_cast<int>(pack.levels.size()) - 1);
    const std::string label = "LEVEL " + std::to_string(coarse.level) + " " + text_of(pack.levels[static_cast<std::size_t>(coarse.level)].grid.n);
    tiles.push_back({label, view_volume(pack, coarse, report)});
  }
  if (tiles.empty()) return {};
  return lay_out(tiles, sheet.tile);
}

}  // namespace texel
