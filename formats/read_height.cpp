#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>

#include "formats/error.h"
#include "formats/noise.h"
#include "formats/readers.h"
#include "formats/tiff_tags.h"

namespace texel {
namespace {

// Bottom and default height hang on the longer side, so that a field of any size looks alike.
constexpr double kDefaultHeight = 1.0 / 4, kDefaultPlinth = 1.0 / 32, kSteep = 4;

std::string number_words(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}

double longer(const V2d& size) { return std::max(size.x, size.y); }

// Puts no-data values and what is no number to NaN.
void drop_no_data(std::vector<double>& values, const HeightOptions& options, const TiffTags& tags, const std::string& path, Report& report) {
  std::int64_t missing = 0, broken = 0;
  // A float file's tag is written with the digits of a double.
  const auto is = [](double value, const std::optional<double>& none) {
    return none && (value == *none || static_cast<float>(value) == static_cast<float>(*none));
  };
  const bool nan_is_none = (tags.no_data && std::isnan(*tags.no_data)) || (options.no_data && std::isnan(*options.no_data));
  for (double& v : values) {
    if (std::isfinite(v) && !is(v, options.no_data) && !is(v, tags.no_data)) continue;
    ++(std::isfinite(v) || std::isnan(v) || nan_is_none ? missing : broken);
    v = std::numeric_limits<double>::quiet_NaN();
  }
  if (broken > 0) report.issue("height-infinite", "heights that are infinite; no data there", broken, path);
  if (missing > 0) report.skip(std::to_string(missing) + " heights of " + path, "no data: the squares they are a corner of are holes");
}

void add_color(const HeightOptions& options, HeightField& field, Scene& scene) {
  Material material = plain_color("height field", Material().kd);
  if (!options.color.empty()) {
    std::error_code ec;
    if (!std::filesystem::is_regular_file(options.color, ec)) throw Error(Code::kFile, options.color, "picture not found", "give --height-color a picture");
    material.kd = V3f(1, 1, 1);
    material.map_kd.texture = static_cast<int>(scene.textures.size());
    material.map_kd.wrap.fill(Wrap::kClamp);
    scene.textures.push_back({options.color, options.color, true});
    add_source(scene, options.color);
    field.textured = true;
  }
  scene.materials.push_back(std::move(material));
}

void place_base(const HeightOptions& options, const std::string& where, HeightField& field) {
  field.base = options.base ? *options.base : field.low - longer(field.size) * kDefaultPlinth;
  if (field.base <= field.low) return;
  throw Error(Code::kCommandLine, "--base", number_words(field.base) + " is above the lowest height of " + where + " (" + number_words(field.low) + ")",
              "give a lower plane");
}

// The noise on a plane through space, (u, v) in [0,1]² over one period. The plane keeps off those of the lattice, on which noise is 0
// at every lattice point.
void plane_values(const Octaves& octaves, std::size_t n, const double* u, const double* v, double* value, double* du = nullptr, double* dv = nullptr) {
  constexpr double kPlane = 0.37;
  std::vector<double> x(n), y(n), z(n, kPlane);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = u[i] * octaves.period.x;
    y[i] = v[i] * octaves.period.y;
  }
  if (!du) {
    octave_values(octaves, n, x.data(), y.data(), z.data(), value);
    return;
  }
  std::vector<double> dz(n);
  octave_gradients(octaves, n, x.data(), y.data(), z.data(), value, du, dv, dz.data());
  for (std::size_t i = 0; i < n; ++i) {
    du[i] *= octaves.period.x;
    dv[i] *= octaves.period.y;
  }
}

struct Extremes { double low, high; };

// Lowest and highest value of the plane: the best of a grid of samples, each then followed uphill by a shrinking cross of steps.
Extremes find_extremes(const Octaves& octaves) {
  constexpr int kPerCell = 8, kMostSamples = 1024, kFollowed = 32;
  const int side = static_cast<int>(std::min(std::ldexp(octaves.period.x, octaves.count - 1) * kPerCell, double{kMostSamples}));
  const auto count = static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
  std::vector<double> u(count), v(count), value(count);
  for (std::size_t i = 0; i < count; ++i) {
    u[i] = static_cast<double>(i % static_cast<std::size_t>(side)) / side;
    v[i] = static_cast<double>(i / static_cast<std::size_t>(side)) / side;
  }
  plane_values(octaves, count, u.data(), v.data(), value.data());
  const auto best = [&](double sign) {
    std::vector<std::size_t> order(count);
    for (std::size_t i = 0; i < count; ++i) order[i] = i;
    const auto followed = std::min<std::size_t>(kFollowed, count);
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(followed), order.end(),
                      [&](std::size_t a, std::size_t b) { return value[a] != value[b] ? sign * value[a] > sign * value[b] : a < b; });
    double top = sign * value[order[0]];
    for (std::size_t k = 0; k < followed; ++k) {
      double at[2] = {u[order[k]], v[order[k]]}, here = sign * value[order[k]];
      for (double step = 0.5 / side; step > 1e-10;) {
        const double us[4] = {at[0] + step, at[0] - step, at[0], at[0]}, vs[4] = {at[1], at[1], at[1] + step, at[1] - step};
        double found[4];
        plane_values(octaves, 4, us, vs, found);
        int up = -1;
        for (int d = 0; d < 4; ++d)
          if (sign * found[d] > here) { here = sign * found[d]; up = d; }
        if (up < 0) step /= 2;
        else { at[0] = us[up]; at[1] = vs[up]; }
      }
      top = std::max(top, here);
    }
    return sign * top;
  };
  return {best(-1), best(1)};
}

}  // namespace

HeightField make_height_field(Samples samples, const HeightOptions& options, const TiffTags& tags, const std::string& path, Report& report) {
  HeightField field;
  field.name = path;
  field.width = samples.width;
  field.height = samples.height;
  if (field.width < 2 || field.height < 2)
    throw Error(Code::kBadInput, path, "is no height field (" + std::to_string(field.width) + " x " + std::to_string(field.height) + " pixels)",
                "give a picture of at least 2 x 2");
  const V2d steps(field.width - 1, field.height - 1);
  const bool stated = tags.pixel_scale.x > 0;
  const V2d own = stated ? V2d(steps.x * tags.pixel_scale.x, steps.y * tags.pixel_scale.y) : steps / longer(steps);
  field.size = options.extent.x > 0 ? options.extent : own;
  // Of a file in world units the proportions stay, whatever the extent.
  double top = stated ? samples.full * (field.size.x / own.x) : longer(field.size) * kDefaultHeight;
  if (options.height > 0) top = options.height;

  drop_no_data(samples.values, options, tags, path, report);
  field.z = std::move(samples.values);
  field.low = std::numeric_limits<double>::infinity();
  field.high = -field.low;
  const auto w = static_cast<std::size_t>(field.width), h = static_cast<std::size_t>(field.height);
  for (double& z : field.z) z = z * top / samples.full;
  for (std::size_t y = 0; y + 1 < h; ++y)
    for (std::size_t x = 0; x + 1 < w; ++x) {
      const double* a = field.z.data() + y * w + x;
      const double corner[4] = {a[0], a[1], a[w], a[w + 1]};
      if (std::isnan(corner[0] + corner[1] + corner[2] + corner[3])) continue;
      field.low = std::min({field.low, corner[0], corner[1], corner[2], corner[3]});
      field.high = std::max({field.high, corner[0], corner[1], corner[2], corner[3]});
    }
  if (!(field.low <= field.high))
    throw Error(Code::kBadInput, path, "no four neighbouring pixels have data", "check --no-data and the picture's alpha");
  constexpr double kMost = 1e100;  // as for vertices: beyond it areas and volumes overflow
  if (!(std::abs(field.low) < kMost) || !(std::abs(field.high) < kMost))
    throw Error(Code::kBadInput, path, "heights are too large to compute with (" + number_words(std::max(-field.low, field.high)) + ")", "give --no-data or a smaller --height");
  const double steepness = (field.high - field.low) / longer(field.size);
  if (steepness > kSteep)
    report.issue("height-steep", "heights range over " + number_words(steepness) + " times the longer side; --height and --extent set the scale", 1, path);
  place_base(options, path, field);
  return field;
}

Scene read_height(const std::string& path, const HeightOptions& options, Report& report) {
  Scene scene;
  TiffTags tags;
  {
    const FileBytes file(path);
    scene.sources.push_back({path, {}, static_cast<std::int64_t>(file.bytes().size())});
    tags = read_tiff_tags(file.bytes());
  }
  scene.heights.push_back(make_height_field(read_samples(path), options, tags, path, report));
  add_color(options, scene.heights.back(), scene);
  return scene;
}

Scene make_perlin_field(const HeightOptions& options) {
  Scene scene;
  HeightField& field = scene.heights.emplace_back();
  const PerlinField& perlin = options.perlin;
  field.name = "--perlin-field";
  field.size = options.extent.x > 0 ? options.extent : V2d(1, 1);
  const double top = options.height > 0 ? options.height : longer(field.size) * kDefaultHeight;
  Octaves octaves;
  octaves.count = perlin.octaves;
  octaves.seed = perlin.seed;
  octaves.period = V3i(perlin.period, perlin.period, 0);
  const Extremes extremes = find_extremes(octaves);
  field.low = 0;
  field.high = top;
  field.detail = std::min(field.size.x, field.size.y) / std::ldexp(perlin.period, perlin.octaves - 1);
  field.function = [octaves, extremes, top, size = field.size](std::size_t n, const double* x, const double* y, double* z, double* dx, double* dy) {
    std::vector<double> u(n), v(n);
    for (std::size_t i = 0; i < n; ++i) {
      u[i] = x[i] / size.x;  // 1 exactly at the far side, so that it repeats bit for bit
      v[i] = y[i] / size.y;
    }
    plane_values(octaves, n, u.data(), v.data(), z, dx, dy);
    const double range = extremes.high - extremes.low;
    for (std::size_t i = 0; i < n; ++i) z[i] = top * std::clamp((z[i] - extremes.low) / range, 0.0, 1.0);
    for (std::size_t i = 0; dx && i < n; ++i) {
      dx[i] *= top / (range * size.x);
      dy[i] *= top / (range * size.y);
    }
  };
  add_color(options, field, scene);
  place_base(options, "the field", field);
  return scene;
}

}  // namespace texel
