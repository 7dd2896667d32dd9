// How far the volume and the slices are from the geometry itself, seen from all around (docs/view.md).
//
//   view_error [--resolution N] [--size N] [--up x|y|z] [--picture FILE.png] INPUT...
//   view_error --recede [--no-shadows] INPUT...
//
// All inputs together are one model, baked in memory. --recede doubles the camera's distance step by step instead.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "bake/bake.h"
#include "bake/view.h"
#include "formats/error.h"
#include "formats/read.h"

namespace texel {
namespace {

struct Task {
  std::vector<std::string> inputs;
  std::string picture;
  int resolution = 128, size = 256, up = -1;
  bool recede = false, shadows = true;
};

struct Errors {
  double color = 0, alpha = 0;  // root of the mean square
  double cover = 0;             // mean alpha over the truth's
};

Errors compare(const Image& truth, const Image& other) {
  double color = 0, alpha = 0, truth_alpha = 0, other_alpha = 0;
  const std::size_t pixels = truth.pixels.size() / 4;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float *t = &truth.pixels[4 * i], *o = &other.pixels[4 * i];
    for (int c = 0; c < 3; ++c) color += std::pow(static_cast<double>(t[c] * t[3] - o[c] * o[3]), 2) / 3;
    alpha += std::pow(static_cast<double>(t[3] - o[3]), 2);
    truth_alpha += static_cast<double>(t[3]);
    other_alpha += static_cast<double>(o[3]);
  }
  const auto n = static_cast<double>(pixels);
  return {std::sqrt(color / n), std::sqrt(alpha / n), truth_alpha > 0 ? other_alpha / truth_alpha : 0};
}

// Half the size, opaque over grey.
Image half_on_grey(const Image& image) {
  const Image flat = over_background(image, V3f(0.18f));
  Image out{image.width / 2, image.height / 2, 3, {}};
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      for (int c = 0; c < 3; ++c)
        out.pixels.push_back((flat.at(2 * x, 2 * y)[c] + flat.at(2 * x + 1, 2 * y)[c] + flat.at(2 * x, 2 * y + 1)[c] + flat.at(2 * x + 1, 2 * y + 1)[c]) / 4);
  return out;
}

Image difference(const Image& a, const Image& b) {
  Image out = a;
  for (std::size_t i = 0; i < out.pixels.size(); ++i) out.pixels[i] = std::min(4 * std::abs(a.pixels[i] - b.pixels[i]), 1.0f);
  return out;
}

void print_row(const char* name, const Errors& volume, const Errors& slices) {
  std::printf("| %-14s | %.4f | %.4f | %.3f | %.4f | %.4f | %.3f |\n", name, volume.color, volume.alpha, volume.cover, slices.color, slices.alpha, slices.cover);
}

void all_around(const Task& task, const Scene& scene, const Pack& pack, int up) {
  Report report;
  std::array<Errors, 2> mean;
  std::vector<Image> tiles;
  std::printf("| azimuth, elevation | volume: colour | alpha | cover | slices: colour | alpha | cover |\n|---|---|---|---|---|---|---|\n");
  int views = 0;
  for (const double elevation : {10.0, 45.0})
    for (const double azimuth : {-60.0, 30.0, 120.0, 210.0}) {
      ViewOptions options;
      options.camera = orbit_camera(pack.grid.box(), azimuth, elevation, 30, up);
      options.width = options.height = task.size;
      const Image truth = view_truth(scene, options, report), volume = view_volume(pack, options, report);
      const Image slices = view_slices(pack, options, report);
      // Slices show albedo; so does truth in ambient light of 1.
      ViewOptions plain = options;
      plain.lights = {{Light::Kind::kAmbient, V3d(0, 0, 0), V3f(1.0f)}};
      const std::array<Errors, 2> here = {compare(truth, volume), compare(view_truth(scene, plain, report), slices)};
      print_row((std::to_string(std::lround(azimuth)) + ", " + std::to_string(std::lround(elevation))).c_str(), here[0], here[1]);
      for (std::size_t i = 0; i < 2; ++i) {
        mean[i].color += here[i].color;
        mean[i].alpha += here[i].alpha;
        mean[i].cover += here[i].cover;
      }
      ++views;
      const Image small_truth = half_on_grey(truth), small_volume = half_on_grey(volume);
      tiles.insert(tiles.end(), {small_truth, small_volume, half_on_grey(slices), difference(small_truth, small_volume)});
    }
  for (Errors& e : mean) e = {e.color / views, e.alpha / views, e.cover / views};
  print_row("mean", mean[0], mean[1]);
  if (task.picture.empty()) return;
  const int side = task.size / 2;
  Image sheet{4 * side, views * side, 3, std::vector<float>(static_cast<std::size_t>(4 * side) * static_cast<std::size_t>(views * side) * 3)};
  for (std::size_t i = 0; i < tiles.size(); ++i)
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x)
        for (int c = 0; c < 3; ++c)
          sheet.at(static_cast<int>(i % 4) * side + x, static_cast<int>(i / 4) * side + y)[c] = tiles[i].at(x, y)[c];
  write_png(sheet, task.picture);
}

// Mean colour of what is seen, and how much is seen: alpha summed, times the distance squared.
struct Seen {
  double brightness = 0, cover = 0;
};

Seen seen(const Image& image, double scale) {
  double light = 0, alpha = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    const float* p = &image.pixels[i];
    light += static_cast<double>((p[0] + p[1] + p[2]) / 3 * p[3]);
    alpha += static_cast<double>(p[3]);
  }
  return {alpha > 0 ? light / alpha : 0, alpha * scale};
}

void recede(const Task& task, const Scene& scene, const Pack& pack, int up) {
  Report report;
  const Camera near = orbit_camera(pack.grid.box(), -60, 20, 30, up);
  Seen first_volume, first_truth;
  std::printf("| distance | voxel per pixel | volume: brightness | cover | truth: brightness | cover |\n|---|---|---|---|---|---|\n");
  for (int step = 0; step < 7; ++step) {
    const double far = static_cast<double>(1 << step);
    ViewOptions options;
    options.camera = near;
    options.camera.eye = near.target + (near.eye - near.target) * far;
    options.width = options.height = task.size;
    options.shadows = task.shadows;
    options.samples = 64;  // the object soon is a few pixels wide
    const Seen volume = seen(view_volume(pack, options, report), far * far), truth = seen(view_truth(scene, options, report), far * far);
    if (step == 0) {
      first_volume = volume;
      first_truth = truth;
    }
    const double pixel = 2 * std::tan(near.fov / 360 * 3.141592653589793) * (near.eye - near.target).length() * far / task.size;
    std::printf("| x%-3g | %.2f | %.4f (%+.2f %%) | %+.2f %% | %.4f (%+.2f %%) | %+.2f %% |\n", far, pixel / pack.grid.h, volume.brightness,
                100 * (volume.brightness / first_volume.brightness - 1), 100 * (volume.cover / first_volume.cover - 1), truth.brightness,
                100 * (truth.brightness / first_truth.brightness - 1), 100 * (truth.cover / first_truth.cover - 1));
  }
}

int number(const char* text, int low, int high) {
  const int n = std::atoi(text);
  if (n < low || n > high) throw Error(Code::kCommandLine, text, "out of range", "use " + std::to_string(low) + " to " + std::to_string(high));
  return n;
}

Task parse(int count, char** words) {
  Task task;
  for (int i = 1; i < count; ++i) {
    const std::string_view word = words[i];
    const bool more = i + 1 < count;
    if (word == "--recede") task.recede = true;
    else if (word == "--no-shadows") task.shadows = false;
    else if (word == "--picture" && more) task.picture = words[++i];
    else if (word == "--resolution" && more) task.resolution = number(words[++i], 4, 1024);
    else if (word == "--size" && more) task.size = number(words[++i], 16, 2048);
    else if (word == "--up" && more) task.up = number(std::to_string(words[++i][0] - 'x').c_str(), 0, 2);
    else task.inputs.emplace_back(word);
  }
  if (task.inputs.empty()) throw Error(Code::kCommandLine, "INPUT", "missing");
  return task;
}

void run(const Task& task) {
  Report report;
  const Scene scene = read_scene(task.inputs, report);
  Recipe recipe;
  recipe.resolution = V3i(task.resolution, 0, 0);
  const Pack pack = bake(scene, recipe, report);
  const int up = up_axis(task.up, scene.sources);
  if (task.recede) recede(task, scene, pack, up);
  else all_around(task, scene, pack, up);
}

}  // namespace
}  // namespace texel

int main(int count, char** words) {
  try {
    texel::run(texel::parse(count, words));
    return 0;
  } catch (const texel::Error& error) {
    std::fprintf(stderr, "view_error: %s\n", error.what());
    return static_cast<int>(error.code);
  }
}
