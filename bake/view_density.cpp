#include "bake/view_density.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "bake/hypertexture.h"
#include "bake/shading.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr int kCells = 64, kShadowCells = 96, kSteps = 320;
constexpr double kSeen = 1.0 / 1024;         // transmittance below which a ray ends
constexpr std::size_t kBatch = 32;

// A cubic lattice over the density's bounds.
struct Lattice {
  V3d origin{0, 0, 0};
  double cell = 1;
  V3i n{1, 1, 1};

  Lattice(const Box3d& box, int longest) : origin(box.min) {
    const V3d size = box.size();
    cell = std::max({size.x, size.y, size.z}) / longest;
    for (int a = 0; a < 3; ++a) n[a] = std::clamp(static_cast<int>(std::ceil(size[a] / cell - 1e-9)), 1, longest);
  }
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z); }
  [[nodiscard]] std::size_t place(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(x);
  }
  // Of values at cell centres; 0 outside.
  [[nodiscard]] float at(const std::vector<float>& values, const V3d& p) const {
    const V3d v = (p - origin) / cell - V3d(0.5, 0.5, 0.5);
    const V3d whole(std::floor(v.x), std::floor(v.y), std::floor(v.z));
    const V3d t = v - whole;
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
      const int x = static_cast<int>(whole.x) + (c & 1), y = static_cast<int>(whole.y) + (c >> 1 & 1), z = static_cast<int>(whole.z) + (c >> 2);
      if (x < 0 || y < 0 || z < 0 || x >= n.x || y >= n.y || z >= n.z) continue;
      sum += (c & 1 ? t.x : 1 - t.x) * (c >> 1 & 1 ? t.y : 1 - t.y) * (c >> 2 ? t.z : 1 - t.z) * static_cast<double>(values[place(x, y, z)]);
    }
    return static_cast<float>(sum);
  }
};

// One period of what repeats, else as far as there is matter.
Box3d region(const Scene& scene, const ViewOptions& options) {
  if (options.cyclic[0] || options.cyclic[1] || options.cyclic[2]) return options.grid.box();
  return density_bounds(*make_density(*scene.hypertexture, 0));
}

struct March {
  const Scene& scene;
  const ViewOptions& options;
  Rays rays;
  std::vector<Light> lights;
  V3f ambient;
  std::shared_ptr<const Field> density;
  std::shared_ptr<const SolidTexture> color;
  float glow;
  double scale;
  Box3d box;
  Lattice cells, shade;
  double step, detail;
  std::vector<char> occupied;
  std::vector<std::vector<float>> passing;   // per light: share that reaches the cell; empty without shadows

  March(const Scene& s, const ViewOptions& o)
      : scene(s), options(o), rays(make_rays(o.camera, o.width, o.height)), lights(view_lights(o, rays)), ambient(ambient_of(lights)),
        glow(s.materials.front().solid ? 0 : hypertexture_glow(*s.hypertexture)), scale(s.hypertexture->scale), box(region(s, o)),
        cells(box, kCells), shade(box, kShadowCells) {
    const V3d size = box.size();
    step = std::max({size.x, size.y, size.z}) / kSteps;
    // What a pixel shows at the middle of the density; its octaves are filtered like a voxel's of that size.
    detail = rays.footprint((box.center() - rays.eye).dot(rays.forward)) / 2;
    density = make_density(*s.hypertexture, std::max(0.0, detail));
    color = s.materials.front().solid ? s.materials.front().solid : hypertexture_color(*s.hypertexture);
    occupied.resize(cells.size());
    tbb::parallel_for(0, cells.n.z, [&](int z) {
      for (int y = 0; y < cells.n.y; ++y)
        for (int x = 0; x < cells.n.x; ++x) {
          const V3d low = cells.origin + V3d(x, y, z) * cells.cell;
          occupied[cells.place(x, y, z)] = density->range({low, low + V3d(cells.cell)}).high > 0;
        }
    });
    if (options.shadows) cast_shadows();
  }

  void cast_shadows() {
    std::vector<float> depth(shade.size());
    tbb::parallel_for(0, shade.n.z, [&](int z) {
      std::vector<double> x(static_cast<std::size_t>(shade.n.x)), y(x.size()), w(x.size()), d(x.size());
      for (int j = 0; j < shade.n.y; ++j) {
        for (std::size_t i = 0; i < x.size(); ++i) {
          const V3d p = shade.origin + V3d(static_cast<double>(i) + 0.5, j + 0.5, z + 0.5) * shade.cell;
          x[i] = p.x; y[i] = p.y; w[i] = p.z;
        }
        density->values(x.size(), x.data(), y.data(), w.data(), d.data());
        for (std::size_t i = 0; i < x.size(); ++i)
          depth[shade.place(static_cast<int>(i), j, z)] = d[i] > 0 ? static_cast<float>(std::min(20.0, mean_depth(1 - d[i], 1 - d[i]) * scale * shade.cell)) : 0;
      }
    });
    passing.resize(lights.size());
    for (std::size_t k = 0; k < lights.size(); ++k) {
      if (lights[k].kind == Light::Kind::kAmbient) continue;
      passing[k].resize(shade.size());
      tbb::parallel_for(0, shade.n.z, [&](int z) {
        for (int y = 0; y < shade.n.y; ++y)
          for (int x = 0; x < shade.n.x; ++x) {
            const V3d p = shade.origin + V3d(x + 0.5, y + 0.5, z + 0.5) * shade.cell;
            V3d l;
            V3f c;
            double sum = 0;
            if (light_at(lights[k], p, &l, &c))
              for (double t = 1.5; sum < 8; t += 1) {  // a cell and a half off: no shadow of its own
                const V3d q = p + l * (t * shade.cell);
                if (!box.intersects(q)) break;
                sum += static_cast<double>(shade.at(depth, q));
              }
            passing[k][shade.place(x, y, z)] = static_cast<float>(std::exp(-sum));
          }
      });
    }
  }

  [[nodiscard]] V3f light_from(const V3d& p, const V3d& gradient, const V3f& albedo) const {
    const double length = gradient.length();
    V3f light = ambient;
    for (std::size_t k = 0; k < lights.size(); ++k) {
      V3d l;
      V3f c;
      if (!light_at(lights[k], p, &l, &c)) continue;
      // Dust without a direction is lit as normals in all directions turned to the eye are, on average.
      const double facing = length > 0 ? std::max(0.0, -gradient.dot(l) / length) : 0.5;
      const float visible = passing.empty() ? 1.0f : shade.at(passing[k], p);
      light += c * (static_cast<float>(facing) * visible);
    }
    return albedo * (light * (1 - glow) + V3f(glow));
  }

  // Where the ray leaves the cell that p lies in.
  [[nodiscard]] double cell_exit(const Rays::Ray& ray, const V3d& p, double t) const {
    double least = cells.cell * 2;
    for (int a = 0; a < 3; ++a) {
      const double d = ray.direction[a];
      if (d == 0) continue;
      const double in = (p[a] - cells.origin[a]) / cells.cell, wall = d > 0 ? std::floor(in) + 1 : std::ceil(in) - 1;
      least = std::min(least, std::max(0.0, (wall - in) * cells.cell / d));
    }
    return t + least + 1e-6 * cells.cell;
  }
  [[nodiscard]] bool is_occupied(const V3d& p) const {
    const V3d v = (p - cells.origin) / cells.cell;
    const V3i i(static_cast<int>(std::floor(v.x)), static_cast<int>(std::floor(v.y)), static_cast<int>(std::floor(v.z)));
    return i.x >= 0 && i.y >= 0 && i.z >= 0 && i.x < cells.n.x && i.y < cells.n.y && i.z < cells.n.z && occupied[cells.place(i.x, i.y, i.z)];
  }

  void trace(const Rays::Ray& ray, V3f* color_sum, float* alpha) const {
    double from = rays.perspective ? 0 : -1e300, to = 1e300;
    for (int a = 0; a < 3; ++a) {
      const double d = ray.direction[a];
      if (d == 0) {
        if (ray.origin[a] < box.min[a] || ray.origin[a] > box.max[a]) return;
        continue;
      }
      const double t0 = (box.min[a] - ray.origin[a]) / d, t1 = (box.max[a] - ray.origin[a]) / d;
      from = std::max(from, std::min(t0, t1));
      to = std::min(to, std::max(t0, t1));
    }
    if (!(from < to)) return;
    std::array<double, kBatch> x, y, z, t, d, gx, gy, gz;
    std::array<V3f, kBatch> colors;
    double left = 1, before = 1, before_at = from;   // 1 − D at the last place
    double next = from;
    while (next < to && left > kSeen) {
      std::size_t n = 0;
      while (n < kBatch && next < to) {
        const V3d p = ray.origin + ray.direction * next;
        if (!is_occupied(p)) {
          next = std::max(cell_exit(ray, p, next), next + 1e-3 * step);
          continue;
        }
        x[n] = p.x; y[n] = p.y; z[n] = p.z;
        t[n++] = next;
        next += step;
      }
      if (n == 0) break;
      density->values(n, x.data(), y.data(), z.data(), d.data());
      // What each place adds, then light and colour of those that add something.
      std::size_t shown = 0;
      std::array<double, kBatch> gain;
      for (std::size_t i = 0; i < n && left > kSeen; ++i) {
        const double here = std::isnan(d[i]) ? 1 : 1 - std::clamp(d[i], 0.0, 1.0);
        const double way = std::min(t[i] - before_at, 1.5 * step);  // across an empty gap D is 0
        const double pass = std::exp(-mean_depth(before, here) * scale * way);
        before = here;
        before_at = t[i];
        if (!(pass < 1)) continue;
        x[shown] = x[i]; y[shown] = y[i]; z[shown] = z[i];
        gain[shown++] = left * (1 - pass);
        left *= pass;
      }
      if (shown == 0) continue;
      density->gradients(shown, x.data(), y.data(), z.data(), d.data(), gx.data(), gy.data(), gz.data());
      color->colors(shown, x.data(), y.data(), z.data(), nullptr, detail, colors.data());
      for (std::size_t i = 0; i < shown; ++i) {
        const V3d g(gx[i], gy[i], gz[i]);
        const bool known = std::isfinite(g.x) && std::isfinite(g.y) && std::isfinite(g.z);
        const auto share = static_cast<float>(gain[i]);
        *color_sum += light_from(V3d(x[i], y[i], z[i]), known ? g : V3d(0, 0, 0), colors[i]) * share;
        *alpha += share;
      }
    }
  }
};

}  // namespace

Image view_density(const Scene& scene, const ViewOptions& options, Report& report) {
  const StageTimer timer(report, "view truth");
  const March march(scene, options);
  return trace_pixels(march.rays, std::max(1, options.samples / 8), options.threads, "view truth", report,
                      [&march](const Rays::Ray& ray, V3f* color, float* alpha) { march.trace(ray, color, alpha); });
}

}  // namespace texel
