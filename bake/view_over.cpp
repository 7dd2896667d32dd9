// Cones through texels: straight within each tetrahedron of the shell, in the pack's own space, and bent from one to the next.
#include "bake/view_over.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "bake/facets.h"
#include "bake/texel_level.h"
#include "formats/error.h"

namespace texel {

namespace {

// As view_volume.cpp.
constexpr float kSeen = 1.0f / 1024;
constexpr double kStep = 0.5;
constexpr int kShadowResolution = 128;

constexpr float kFaint = 1.0f / 1024;   // a step that adds less takes the ray's last colour
constexpr double kDark = 9.21;          // optical depth at which a shadow is taken as full

int main_axis(const V3d& d) {
  const V3d size(std::abs(d.x), std::abs(d.y), std::abs(d.z));
  return size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
}

// A piece's map and the ray in it. Lengths of the ray stay in world units.
struct Bent {
  TexelMap map;
  V3d origin, direction, unit;  // from the box's lowest corner, world units of the pack; `direction` per world unit along the ray
  double speed = 0;             // its length
  int axis = 0;
  Bent(const TexelMap& m, const V3d& o, const V3d& d) : map(m), origin(m.point(o)), direction(m.direction(d)), unit(direction), speed(direction.length()) {
    if (speed > 0) unit /= speed;
    axis = main_axis(direction);
  }
  [[nodiscard]] bool usable() const { return speed > 0 && std::isfinite(speed) && std::isfinite(origin.length()); }
};

// Distance along the ray to where it leaves the aligned cell of `edge` voxels about `p`, or comes to a border of the box.
double to_cell_exit(const TexelLevel& level, const Bent& bent, const V3d& p, double edge) {
  double exit = 1e300;
  for (int k = 0; k < 3; ++k) {
    const double d = bent.direction[k] / level.h();
    if (d == 0) continue;
    const double low = std::floor(p[k] / edge) * edge, high = std::min(low + edge, std::max(level.period()[k], p[k]));
    exit = std::min(exit, ((d > 0 ? high : low) - p[k]) / d);
  }
  return std::max(exit, 0.0);
}

struct Cast {
  std::vector<ShellPiece> pieces, shadow_pieces;
  std::vector<float> shares;     // of each light, at `shaded`
  V3d shaded{0, 0, 0};
  bool any_shaded = false;
};

class Over {
 public:
  Over(const Pack& pack, const TexelSurface& surface, const OverOptions& over, const ViewOptions& options, Report& report);
  void trace(const Rays::Ray& ray, V3f* color, float* alpha) const;
  Rays rays;

 private:
  [[nodiscard]] double level_of(double footprint) const;
  [[nodiscard]] double transmittance(const V3d& from, const V3d& direction, double length, std::size_t level, std::vector<ShellPiece>* pieces) const;
  [[nodiscard]] V3f shade(const Facets& facets, const Bent& bent, const V3d& place, const V3d& to_eye, double level, Cast* cast) const;
  [[nodiscard]] V3f ground_light(std::uint32_t triangle, const V3d& place, const V3d& to_eye, double level, Cast* cast) const;

  TexelShell shell_;
  std::vector<std::unique_ptr<TexelLevel>> levels_;
  std::vector<Light> lights_;
  V3f ambient_, unseen_, ground_;
  bool shadows_, has_ground_;
  int only_;
  std::size_t shadow_level_ = 0;
  double size_;
};

Over::Over(const Pack& pack, const TexelSurface& surface, const OverOptions& over, const ViewOptions& options, Report& report)
    : rays(make_rays(options.camera, options.width, options.height)), shell_(surface, pack.grid.box(), over.axes, report), lights_(view_lights(options, rays)),
      ambient_(ambient_of(lights_)), unseen_(pack.statistics.mean_color * ambient_), ground_(over.ground), shadows_(options.shadows), has_ground_(over.ground.x >= 0), only_(options.level) {
  if (pack.levels.empty()) throw Error(Code::kBadInput, "", "the pack has no volume", "bake it with --want density");
  if (only_ >= static_cast<int>(pack.levels.size()))
    throw Error(Code::kCommandLine, "", "level " + std::to_string(only_) + " asked for, the pack has " + std::to_string(pack.levels.size()));
  std::array<bool, 3> wrap{false, false, false};
  wrap[static_cast<std::size_t>(over.axes.u)] = wrap[static_cast<std::size_t>(over.axes.v)] = true;
  for (const Level& level : pack.levels) {
    if (report.progress) report.progress("view over", 0);
    levels_.push_back(std::make_unique<TexelLevel>(level, pack.grid.box().size() / level.grid.h, wrap, !pack.density));
  }
  const auto side = [&](std::size_t l) { const V3i& n = pack.levels[l].grid.n; return std::max({n.x, n.y, n.z}); };
  while (shadow_level_ + 1 < levels_.size() && side(shadow_level_) > kShadowResolution) ++shadow_level_;
  Box3d box;
  for (const auto* list : {&shell_.surface().points, &shell_.surface().tips})
    for (const V3d& p : *list) box.extendBy(p);
  size_ = box.size().length();
}

double Over::level_of(double footprint) const {
  if (only_ >= 0) return only_;
  std::size_t l = 0;
  while (l + 1 < levels_.size() && levels_[l + 1]->h() <= footprint) ++l;
  if (l + 1 == levels_.size()) return static_cast<double>(l);
  const double fine = levels_[l]->h(), coarse = levels_[l + 1]->h();
  return static_cast<double>(l) + std::clamp((footprint - fine) / (coarse - fine), 0.0, 1.0);
}

double Over::transmittance(const V3d& from, const V3d& direction, double length, std::size_t l, std::vector<ShellPiece>* pieces) const {
  const TexelLevel& level = *levels_[l];
  double depth = 0;
  shell_.along(from, direction, length, pieces, [&](const ShellPiece& piece) {
    if (has_ground_ && piece.in_by_ground) return (depth = kDark, false);
    const Bent bent(shell_.map(piece), from, direction);
    if (!bent.usable()) return true;
    const double end = std::min(piece.to, length);
    for (double t = piece.from; t < end && depth < kDark;) {
      const V3d p = level.home((bent.origin + bent.direction * t) / level.h());
      const double tau = level.depth(p, bent.unit);
      const double step = std::min(to_cell_exit(level, bent, p, tau < 0 ? 8 : 1) + 1e-6 * level.h() / bent.speed, end - t);
      if (tau > 0) depth += tau * step * bent.speed / level.h();
      t += step;
      if (!(step > 0)) break;
    }
    if (has_ground_ && piece.out_by_ground && end == piece.to) depth = kDark;
    return depth < kDark;
  });
  return depth < kDark ? std::exp(-depth) : 0;
}

V3f Over::shade(const Facets& facets, const Bent& bent, const V3d& place, const V3d& to_eye, double level, Cast* cast) const {
  const Facets here = carried(facets, bent.map.rows);
  const auto l = std::max(shadow_level_, static_cast<std::size_t>(level + 0.5));
  const double h = levels_[l]->h();
  const auto voxel = [&](const V3d& way) { return h / std::max(bent.map.direction(way).length(), 1e-300); };  // world length of a voxel's edge
  // Shadows change little within a voxel: neighbouring steps share them.
  if (!cast->any_shaded || (place - cast->shaded).length() > levels_[static_cast<std::size_t>(level)]->h() / bent.speed) {
    cast->shares.assign(lights_.size(), -1.0f);
    cast->shaded = place;
    cast->any_shaded = true;
  }
  return light_sent(here, to_eye, lights_, ambient_, place, [&](const V3d& way, const Light& light) {
    if (!shadows_) return 1.0f;
    float& share = cast->shares[static_cast<std::size_t>(&light - lights_.data())];
    if (share < 0) {
      // Out of the surface's own voxels first: it must not shade itself.
      const double sided = here.mean.length();
      const V3d out = sided > 0.2 && here.mean.dot(way) > 0 ? here.mean / sided : way;
      const V3d start = place + out * voxel(out) + way * voxel(way);
      const double length = light.kind == Light::Kind::kPoint ? (light.vector - start).dot(way) : 1e30 * size_;
      share = length > 0 ? static_cast<float>(transmittance(start, way, length, l, &cast->shadow_pieces)) : 1.0f;
    }
    return share;
  });
}

V3f Over::ground_light(std::uint32_t triangle, const V3d& place, const V3d& to_eye, double level, Cast* cast) const {
  V3d n = shell_.ground_normal(triangle);
  if (n.dot(to_eye) < 0) n = -n;
  V3f sum = ground_ * ambient_;
  const auto l = std::max(shadow_level_, static_cast<std::size_t>(level + 0.5));
  for (const Light& light : lights_) {
    V3d way;
    V3f color;
    if (!light_at(light, place, &way, &color) || !(n.dot(way) > 0)) continue;
    if (shadows_) {
      const V3d start = place + n * (1e-6 * size_);
      const double length = light.kind == Light::Kind::kPoint ? (light.vector - start).dot(way) : 1e30 * size_;
      if (length > 0) color *= static_cast<float>(transmittance(start, way, length, l, &cast->shadow_pieces));
    }
    sum += ground_ * color * static_cast<float>(n.dot(way));
  }
  return sum;
}

void Over::trace(const Rays::Ray& ray, V3f* color, float* alpha) const {
  Cast cast;
  float left = 1, before = 1, fullest = 0;  // as in view_volume.cpp
  V3f last = unseen_;
  double out_at = -1;  // where the piece before ended
  const auto hit_ground = [&](const ShellPiece& piece, double t, double level) {
    const V3f light = ground_light(piece.triangle, ray.origin + ray.direction * t, -ray.direction, level, &cast);
    *color += light * left;
    *alpha += left;
    left = 0;
  };
  shell_.along(ray.origin, ray.direction, 1e300, &cast.pieces, [&](const ShellPiece& piece) {
    const Bent bent(shell_.map(piece), ray.origin, ray.direction);
    if (!bent.usable()) return true;
    // The cone's width where it meets the texel: what the map makes of its cross-section's area.
    const double narrowing = std::sqrt(std::abs(bent.map.determinant()) / bent.speed);
    if (has_ground_ && piece.in_by_ground) {
      hit_ground(piece, piece.from, level_of(rays.footprint(piece.from) * narrowing));
      return false;
    }
    if (piece.from > out_at * (1 + 1e-12)) {  // another part of the shell: another body
      before = left;
      fullest = 0;
    }
    out_at = piece.to;
    for (double t = piece.from; t < piece.to && left > kSeen;) {
      const double level = level_of(rays.footprint(t) * narrowing);
      const auto l = static_cast<std::size_t>(level);
      const double f = level - static_cast<double>(l);
      const std::size_t count = f > 0 ? 2 : 1;
      const double h = levels_[l]->h();

      // Leave cells that are empty on both levels at once.
      double skip = 1e300;
      for (std::size_t i = 0; i < count && skip > 0; ++i) {
        const TexelLevel& at = *levels_[l + i];
        const V3d p = at.home((bent.origin + bent.direction * t) / at.h());
        const int edge = at.empty_cell(p);
        skip = edge == 0 ? 0 : std::min(skip, to_cell_exit(at, bent, p, edge));
      }
      if (skip > 0) {
        before = left;
        fullest = 0;
        t += skip + 1e-4 * h / bent.speed;
        continue;
      }

      const double step = std::min(kStep * h * (1 + f) / bent.speed, piece.to - t), middle = t + step / 2;
      float filled = 0, together_all = 0;
      std::array<float, 2> parts{}, bodies{};
      for (std::size_t i = 0; i < count; ++i) {
        const TexelLevel& at = *levels_[l + i];
        const Matter matter = at.at(at.home((bent.origin + bent.direction * middle) / at.h()), bent.unit, bent.axis);
        const auto blend = static_cast<float>(count == 1 ? 1 : i == 0 ? 1 - f : f);
        // How surfaces, sheets and bodies hide: view_volume.cpp.
        const auto way = static_cast<float>(step * bent.speed / at.h());
        const float apart = -left * std::expm1(-matter.alpha * way), opacity = -std::expm1(-matter.alpha);
        const float together = std::max(apart, std::min(left, (opacity + matter.full) * way));
        const auto share = [opacity](float of) { return opacity > 0 ? std::min(of / opacity, 1.0f) : 0.0f; };
        parts[i] = blend * (1 - share(matter.body)) * (apart + share(matter.sheet) * (together - apart));
        bodies[i] = blend * std::max(matter.solid, matter.body);
        filled += blend * matter.solid;
        together_all += parts[i];
      }
      if (!(filled > 0)) {
        before = left;
        fullest = 0;
      }
      fullest = std::max(fullest, filled);
      const float solid_gain = std::max(left - before * (1 - fullest), 0.0f);
      const float gain = std::min(std::max(solid_gain, together_all), left);
      if (gain > 0) {
        if (gain > kFaint || !cast.any_shaded) {
          Facets mean;
          double weight = 0;
          for (std::size_t i = 0; i < count; ++i) {
            const double part = static_cast<double>(solid_gain > together_all ? bodies[i] : parts[i]);
            if (!(part > 0)) continue;
            const TexelLevel& at = *levels_[l + i];
            Facets found;
            const double there = part * at.facets(at.home((bent.origin + bent.direction * middle) / at.h()), &found);
            if (!(there > 0)) continue;
            weight += there;
            const double of = there / weight;  // running mean
            const auto lerp = [of](double a, double b) { return a + (b - a) * of; };
            const auto share = static_cast<float>(of);
            mean.s = {lerp(mean.s.xx, found.s.xx), lerp(mean.s.yy, found.s.yy), lerp(mean.s.zz, found.s.zz), lerp(mean.s.xy, found.s.xy), lerp(mean.s.xz, found.s.xz), lerp(mean.s.yz, found.s.yz)};
            mean.mean += (found.mean - mean.mean) * of;
            if (of > 0.5) mean.closed = found.closed;
            mean.look.albedo += (found.look.albedo - mean.look.albedo) * share;
            mean.look.ks += (found.look.ks - mean.look.ks) * share;
            mean.look.ke += (found.look.ke - mean.look.ke) * share;
            mean.look.roughness += (found.look.roughness - mean.look.roughness) * share;
          }
          if (weight > 1e-6) last = shade(mean, bent, ray.origin + ray.direction * middle, -ray.direction, level, &cast);
        }
        *color += last * gain;
        *alpha += gain;
        left = std::max(left - gain, 0.0f);
      }
      t += step;
    }
    if (has_ground_ && piece.out_by_ground && left > kSeen) hit_ground(piece, piece.to, level_of(rays.footprint(piece.to) * narrowing));
    return left > kSeen;
  });
}

}  // namespace

Image view_over(const Pack& pack, const TexelSurface& surface, const OverOptions& over, const ViewOptions& options, Report& report) {
  const StageTimer timer(report, "view over");
  const Over scene(pack, surface, over, options, report);
  const int samples = std::clamp(options.samples / 4, 1, 16);
  return trace_pixels(scene.rays, samples, options.threads, "view over", report, [&scene](const Rays::Ray& ray, V3f* color, float* alpha) { scene.trace(ray, color, alpha); });
}

}  // namespace texel
