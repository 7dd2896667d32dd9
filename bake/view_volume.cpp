// The reference renderer: one cone per sample, marched from front to back through the levels that match its width.
#include <algorithm>
#include <array>
#include <cmath>

#include "bake/view_voxels.h"
#include "formats/error.h"

namespace texel {

namespace {

constexpr float kSeen = 1.0f / 1024;     // transmittance below which a cone ends
constexpr double kStep = 0.5;            // voxel edges, of the levels in use as they are blended
constexpr int kShadowResolution = 128;   // shadow cones use the first level of at most so many voxels a side

// A ray in one level's voxel space; t stays in world units.
struct LevelRay {
  V3d origin, direction, inverse;
  [[nodiscard]] V3d at(double t) const { return origin + direction * t; }
};

struct Volume {
  const Pack& pack;
  Eye eye;
  std::vector<std::unique_ptr<LitLevel>> levels;
  int only = -1;
  V3f unseen;                            // colour of matter before any surface was met (the eye is inside)

  Volume(const Pack& p, const ViewOptions& options, const Report& report);
  void trace(const Rays::Ray& ray, V3f* color, float* alpha) const;
  [[nodiscard]] double level_of(double footprint) const;
};

Volume::Volume(const Pack& p, const ViewOptions& options, const Report& report) : pack(p) {
  if (p.levels.empty()) throw Error(Code::kBadInput, "", "the pack has no volume", "bake it with --want density");
  const auto count = static_cast<int>(p.levels.size());
  if (options.level >= count) throw Error(Code::kCommandLine, "", "level " + std::to_string(options.level) + " asked for, the pack has " + std::to_string(count));
  only = options.level;
  eye.rays = make_rays(options.camera, options.width, options.height);
  eye.lights = view_lights(options, eye.rays);
  eye.ambient = ambient_of(eye.lights);
  eye.shadows = options.shadows;
  unseen = p.statistics.mean_color * eye.ambient;
  int shadow = 0;
  const auto side = [&](int l) { const V3i& n = p.levels[static_cast<std::size_t>(l)].grid.n; return std::max({n.x, n.y, n.z}); };
  while (shadow + 1 < count && side(shadow) > kShadowResolution) ++shadow;
  levels.resize(p.levels.size());
  for (int l = count - 1; l >= 0; --l) {
    if (report.progress) report.progress("view volume", 0);
    levels[static_cast<std::size_t>(l)] = std::make_unique<LitLevel>(p.levels[static_cast<std::size_t>(l)], eye, l < shadow ? levels[static_cast<std::size_t>(shadow)].get() : nullptr, !p.density);
  }
}

// The level whose voxels are as wide as the footprint; a fraction f between two of them is the linear blend (r − s_l)/(s_(l+1) − s_l).
double Volume::level_of(double footprint) const {
  if (only >= 0) return only;
  std::size_t l = 0;
  while (l + 1 < levels.size() && levels[l + 1]->grid().h <= footprint) ++l;
  if (l + 1 == levels.size()) return static_cast<double>(l);
  const double fine = levels[l]->grid().h, coarse = levels[l + 1]->grid().h;
  return static_cast<double>(l) + std::clamp((footprint - fine) / (coarse - fine), 0.0, 1.0);
}

// The part of the ray within the grid and half a voxel around it, where interpolation still finds something.
bool clip(const LevelRay& ray, const V3i& n, double* from, double* to) {
  for (int k = 0; k < 3; ++k) {
    const double low = -0.5, high = n[k] + 0.5;
    if (ray.direction[k] == 0) {
      if (ray.origin[k] < low || ray.origin[k] > high) return false;
      continue;
    }
    const double a = (low - ray.origin[k]) * ray.inverse[k], b = (high - ray.origin[k]) * ray.inverse[k];
    *from = std::max(*from, std::min(a, b));
    *to = std::min(*to, std::max(a, b));
  }
  return *from < *to;
}

// Where the ray leaves the aligned cell of `edge` voxels it is in.
double cell_exit(const LevelRay& ray, const V3d& p, int edge) {
  double exit = 1e300;
  for (int k = 0; k < 3; ++k) {
    if (ray.direction[k] == 0) continue;
    const double low = std::floor(p[k] / edge) * edge;
    exit = std::min(exit, ((ray.direction[k] > 0 ? low + edge : low) - ray.origin[k]) * ray.inverse[k]);
  }
  return exit;
}

void Volume::trace(const Rays::Ray& ray, V3f* color, float* alpha) const {
  std::vector<LevelRay> in(levels.size());
  double from = 0, to = 0;
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const Grid& g = levels[l]->grid();
    const V3d direction = ray.direction / g.h;
    in[l] = {g.to_voxel(ray.origin), direction, V3d(1 / direction.x, 1 / direction.y, 1 / direction.z)};
    double a = 0, b = 1e300;
    if (!clip(in[l], g.n, &a, &b)) continue;
    from = to > 0 ? std::min(from, a) : a;
    to = std::max(to, b);
  }
  const V3d size(std::abs(ray.direction.x), std::abs(ray.direction.y), std::abs(ray.direction.z));
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  float left = 1, before = 1, fullest = 0;  // before: what was left where the ray came to the body it is in
  V3f last = unseen;
  for (double t = from; t < to && left > kSeen;) {
    const double level = level_of(eye.rays.footprint(t));
    const auto l = static_cast<std::size_t>(level);
    const double f = level - static_cast<double>(l);
    const std::size_t count = f > 0 ? 2 : 1;
    const double h = levels[l]->grid().h;

    // Leave cells that are empty on both levels at once.
    double skip = 1e300;
    for (std::size_t i = 0; i < count; ++i) {
      const V3d p = in[l + i].at(t);
      const int edge = levels[l + i]->empty_cell(p);
      skip = edge == 0 ? t : std::min(skip, cell_exit(in[l + i], p, edge));
      if (skip <= t) break;
    }
    if (skip > t) {
      before = left;
      fullest = 0;
      t = std::max(skip, t) + 1e-4 * h;
      continue;
    }

    const double step = std::min(kStep * h * (1 + f), to - t), middle = t + step / 2;
    float gain = 0;          // of what the eye sees, what this step adds
    float filled = 0;        // how much the body hides here
    V3f light(0, 0, 0);
    float known = 0;
    std::array<float, 2> parts{};
    std::array<LitVoxel, 2> found;
    for (std::size_t i = 0; i < count; ++i) {
      const LitVoxel& voxel = found[i] = levels[l + i]->at(in[l + i].at(middle), axis);
      const auto blend = static_cast<float>(count == 1 ? 1 : i == 0 ? 1 - f : f);
      // Surfaces hide what they hide of all that is left, as if in places of their own. But where one sheet goes from a layer of voxels
      // to the next, each has a part of it and the parts add up. And a solid is one body: the fullest place the ray passed says how
      // much of it the body hides.
      const auto way = static_cast<float>(step / levels[l + i]->grid().h);
      const float apart = -left * std::expm1(-voxel.alpha * way), opacity = -std::expm1(-voxel.alpha);
      const float together = std::max(apart, std::min(left, (opacity + voxel.full) * way));
      const auto share = [opacity](float of) { return opacity > 0 ? std::min(of / opacity, 1.0f) : 0.0f; };
      const float bounds = share(voxel.body);
      parts[i] = blend * (1 - bounds) * (apart + share(voxel.sheet) * (together - apart));
      filled += blend * voxel.solid;
    }
    // A gap ends the body: what comes behind hides in places of its own.
    if (!(filled > 0)) {
      before = left;
      fullest = 0;
    }
    fullest = std::max(fullest, filled);
    const float solid_gain = std::max(left - before * (1 - fullest), 0.0f);
    gain = std::min(std::max(solid_gain, parts[0] + parts[1]), left);
    if (gain > 0) {
      for (std::size_t i = 0; i < count; ++i) {
        const auto blend = static_cast<float>(count == 1 ? 1 : i == 0 ? 1 - f : f);
        const float weight = solid_gain > parts[0] + parts[1] ? blend * std::max(found[i].solid, found[i].body) : parts[i];
        known += weight * found[i].known;
        light += found[i].light * weight;
      }
      if (known > 1e-6f) last = light / known;
      *color += last * gain;
      *alpha += gain;
      left = std::max(left - gain, 0.0f);
    }
    t += step;
  }
}

}  // namespace

Image view_volume(const Pack& pack, const ViewOptions& options, Report& report) {
  const StageTimer timer(report, "view volume");
  const Volume volume(pack, options, report);
  const int samples = std::clamp(options.samples / 16, 1, 4);
  return trace_pixels(volume.eye.rays, samples, options.threads, "view volume", report,
                      [&volume](const Rays::Ray& ray, V3f* color, float* alpha) { volume.trace(ray, color, alpha); });
}

}  // namespace texel
