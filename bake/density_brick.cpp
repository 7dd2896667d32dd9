#include "bake/density_brick.h"

#include <algorithm>
#include <cmath>

namespace texel {
namespace {

int local(int x, int y, int z) { return x << 6 | y << 3 | z; }

struct Sampler : BrickSource {
  [[nodiscard]] int side() const { return kBrick * s + 2; }
  [[nodiscard]] std::size_t at(int i, int j, int k) const {  // −1 … 8s
    return (static_cast<std::size_t>(k + 1) * static_cast<std::size_t>(side()) + static_cast<std::size_t>(j + 1)) * static_cast<std::size_t>(side()) + static_cast<std::size_t>(i + 1);
  }

  [[nodiscard]] V3i voxels_in(const V3i& b) const {
    V3i n;
    for (int a = 0; a < 3; ++a) n[a] = std::min(kBrick, grid.n[a] - b[a] * kBrick);
    return n;
  }

  // Row by row along x; corners and edges beyond the brick are not asked for.
  void sample(const V3i& b, const V3i& n, BrickWork& w, Brick& out) const {
    const int m = kBrick * s;
    w.d.assign(static_cast<std::size_t>(side()) * static_cast<std::size_t>(side()) * static_cast<std::size_t>(side()), 0);
    w.x.resize(static_cast<std::size_t>(side()));
    w.y.resize(w.x.size());
    w.z.resize(w.x.size());
    // From the sample's number in the whole grid, so that neighbouring bricks ask for the very same places.
    const auto place = [&](int axis, int i) { return grid.origin[axis] + grid.h * ((static_cast<double>(b[axis]) * m + i + 0.5) / s); };
    for (int k = -1; k <= std::min(m, n.z * s); ++k)
      for (int j = -1; j <= std::min(m, n.y * s); ++j) {
        const bool beyond = k < 0 || k == m || j < 0 || j == m;
        const int first = beyond ? 0 : -1, last = std::min(m, n.x * s) - (beyond ? 1 : 0);
        const auto count = static_cast<std::size_t>(last - first + 1);
        for (int i = first; i <= last; ++i) {
          const auto p = static_cast<std::size_t>(i - first);
          w.x[p] = place(0, i);
          w.y[p] = place(1, j);
          w.z[p] = place(2, k);
        }
        double* row = w.d.data() + at(first, j, k);
        density.values(count, w.x.data(), w.y.data(), w.z.data(), row);
        for (std::size_t p = 0; p < count; ++p) {
          if (std::isnan(row[p])) { row[p] = 0; ++out.undefined; }
          row[p] = std::clamp(row[p], 0.0, 1.0);
        }
      }
  }

  // Share of each ray that passes the voxel, and the mean optical depth, along one axis.
  double rays(const BrickWork& w, int axis, const V3i& voxel, double* pass) const {
    const std::size_t stride = axis == 0 ? 1 : axis == 1 ? static_cast<std::size_t>(side()) : static_cast<std::size_t>(side()) * static_cast<std::size_t>(side());
    const double step = texture.scale * grid.h / s;
    double depth = 0;
    for (int v = 0; v < s; ++v)
      for (int u = 0; u < s; ++u) {
        V3i first = voxel * s;
        const int ua = axis == 0 ? 1 : 0, va = axis == 2 ? 1 : 2;
        first[ua] += u;
        first[va] += v;
        const double* d = w.d.data() + at(first.x, first.y, first.z);
        const double t = ray_depth(d, stride, s) * step;
        pass[v * s + u] = std::exp(-t);
        depth += std::min(t, cap);
      }
    return depth / (s * s);
  }

  // A voxel's matter by octants (one alone of a single sample): where its colour is taken, and what it weighs.
  struct Spots {
    std::array<V3d, 8> sum;                    // of places, times weight; samples from the voxel's corner
    std::array<double, 8> weight{};
    Spots() { sum.fill(V3d(0, 0, 0)); }
  };

  // Moments of the voxel, and where its surface lies.
  Moments moments(const BrickWork& w, const V3i& voxel, double* area, double* solid, double* mass, Spots* spots) const {
    Moments sum;
    const std::size_t sy = static_cast<std::size_t>(side()), sz = sy * sy;
    double dust = 0, ones = 0;
    const double cell = 1.0 / (s * s);         // (1/s³ of the voxel) · (differences over 1/s of its edge)
    for (int k = 0; k < s; ++k)
      for (int j = 0; j < s; ++j)
        for (int i = 0; i < s; ++i) {
          const double* d = w.d.data() + at(voxel.x * s + i, voxel.y * s + j, voxel.z * s + k);
          const V3d g = V3d(*(d + 1) - *(d - 1), *(d + sy) - *(d - sy), *(d + sz) - *(d - sz)) * (-0.5 * cell);
          const double size = g.length();
          dust += d[0];
          ones += d[0] >= 1;
          const double weight = size * s * s * s + kDust * d[0];
          const auto octant = static_cast<std::size_t>((2 * i >= s ? 1 : 0) | (2 * j >= s ? 2 : 0) | (2 * k >= s ? 4 : 0));
          spots->sum[octant] += V3d(i + 0.5, j + 0.5, k + 0.5) * weight;
          spots->weight[octant] += weight;
          if (size > 0) sum.add(g / size, size, true);
        }
    const double samples = static_cast<double>(s) * s * s;
    *solid = ones / samples;
    *mass = dust / samples;
    const double flakes = kDust * dust / samples;
    sum.covered += flakes;
    *area = sum.covered;
    sum.xx += flakes / 3;
    sum.yy += flakes / 3;
    sum.zz += flakes / 3;
    return sum;
  }

  // 0: all samples in and next to the voxel are 0; 1: all are 1; 2: neither.
  int state(const BrickWork& w, const V3i& voxel) const {
    bool zeros = true, ones = true;
    const auto look = [&](int i, int j, int k) {
      const double d = w.d[at(i, j, k)];
      zeros = zeros && d <= 0;
      ones = ones && d >= 1;
    };
    const V3i o = voxel * s;
    for (int k = 0; k < s; ++k)
      for (int j = 0; j < s; ++j) {
        for (int i = 0; i < s; ++i) look(o.x + i, o.y + j, o.z + k);
        for (const int beyond : {-1, s}) {
          look(o.x + beyond, o.y + j, o.z + k);
          look(o.x + j, o.y + beyond, o.z + k);
          look(o.x + j, o.y + k, o.z + beyond);
        }
        if (!zeros && !ones) return 2;
      }
    return zeros ? 0 : ones ? 1 : 2;
  }

  void bake(const V3i& b, BrickWork& w, Brick& out) const {
    const V3i n = voxels_in(b);
    const V3d low(b * kBrick), high(b * kBrick + n);
    const V3d reach(1.0 / s);
    const Interval range = density.range({grid.to_world(low - reach), grid.to_world(high + reach)});
    if (range.high <= 0) return;
    if (range.low >= 1) {
      fill(n, out);
      return;
    }
    out.sampled = true;
    sample(b, n, w, out);
    std::array<std::int8_t, 512> states{};
    bool any = false, all = true;
    for (int x = 0; x < n.x; ++x)
      for (int y = 0; y < n.y; ++y)
        for (int z = 0; z < n.z; ++z) {
          const int state_here = state(w, V3i(x, y, z));
          states[static_cast<std::size_t>(local(x, y, z))] = static_cast<std::int8_t>(state_here);
          any = any || state_here != 0;
          all = all && state_here == 1;
        }
    if (!any) return;
    if (all) {
      fill(n, out);
      return;
    }
    out.kind = Brick::Kind::kMixed;
    measure(b, n, states, w, out);
  }

  void fill(const V3i& n, Brick& out) const {
    out.kind = Brick::Kind::kFull;
    out.mass = static_cast<double>(n.x) * n.y * n.z;
    for (int x = 0; x < n.x; ++x)
      for (int y = 0; y < n.y; ++y)
        for (int z = 0; z < n.z; ++z) out.inside[static_cast<std::size_t>(x)] |= std::uint64_t{1} << (y << 3 | z);
  }

  void measure(const V3i& b, const V3i& n, const std::array<std::int8_t, 512>& states, BrickWork& w, Brick& out) const {
    const auto r = static_cast<std::size_t>(s) * static_cast<std::size_t>(s);
    if (options.opacity)
      for (auto& p : w.pass) p.assign(512 * r, 1.0);
    Palette palette;
    for (int x = 0; x < n.x; ++x)
      for (int y = 0; y < n.y; ++y)
        for (int z = 0; z < n.z; ++z) {
          const V3i voxel(x, y, z);
          const auto i = static_cast<std::size_t>(local(x, y, z));
          const std::uint64_t bit = std::uint64_t{1} << (y << 3 | z);
          if (states[i] == 0) continue;
          if (states[i] == 1) {
            out.inside[static_cast<std::size_t>(x)] |= bit;
            out.mass += 1;
            if (options.opacity)
              for (int axis = 0; axis < 3; ++axis) std::fill_n(w.pass[static_cast<std::size_t>(axis)].begin() + static_cast<std::ptrdiff_t>(slot(axis, voxel) * r), r, 0.0);
            continue;
          }
          out.border[static_cast<std::size_t>(x)] |= bit;
          double area = 0, solid = 0, mass = 0;
          Spots spots;
          out.moments.push_back(moments(w, voxel, &area, &solid, &mass, &spots));
          Areas& areas = out.areas.emplace_back();
          areas.area = areas.covered = area;
          out.mass += mass;
          out.solid.push_back(static_cast<float>(solid));
          const Moments& m = out.moments.back();
          palette.add(V3d(b * kBrick + voxel), spots, m.m.length() > 0 ? m.m / m.m.length() : V3d(0, 0, 0), *this);
          if (!options.opacity) continue;
          for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            double* pass = w.pass[a].data() + slot(axis, voxel) * r;
            areas.crossings[axis] = rays(w, axis, voxel, pass);
            double mean = 0;
            for (std::size_t k = 0; k < r; ++k) mean += pass[k];
            out.alpha[a].push_back(static_cast<float>(1 - mean / static_cast<double>(r)));
          }
        }
    if (options.color) paint(palette, out);
    if (options.opacity && options.recompute && options.levels > 1) compose(w, r, out);
  }

  // Where colours are asked for: up to eight places a voxel.
  struct Palette {
    std::vector<double> x, y, z, weight;
    std::vector<V3d> normal;
    std::vector<std::uint32_t> first{0};       // of each voxel, and one more
    void add(const V3d& voxel, const Spots& spots, const V3d& facing, const Sampler& sampler) {
      for (std::size_t o = 0; o < 8; ++o) {
        if (!(spots.weight[o] > 0)) continue;
        const V3d p = sampler.grid.to_world(voxel + spots.sum[o] / (spots.weight[o] * sampler.s));
        x.push_back(p.x);
        y.push_back(p.y);
        z.push_back(p.z);
        weight.push_back(spots.weight[o]);
        normal.push_back(facing);
      }
      first.push_back(static_cast<std::uint32_t>(weight.size()));
    }
  };

  void paint(const Palette& palette, Brick& out) const {
    const std::size_t count = palette.weight.size();
    std::vector<V3f> colors(count, plain);
    if (color) color->colors(count, palette.x.data(), palette.y.data(), palette.z.data(), palette.normal.data(), grid.h / 2, colors.data());
    for (std::size_t i = 0; i + 1 < palette.first.size(); ++i) {
      V3d mean(0, 0, 0);
      double whole = 0;
      for (std::size_t k = palette.first[i]; k < palette.first[i + 1]; ++k) {
        mean += V3d(colors[k]) * palette.weight[k];
        whole += palette.weight[k];
      }
      const V3d sum = (whole > 0 ? mean / whole : V3d(plain)) * out.moments[i].covered;
      out.color.push_back(sum * static_cast<double>(1 - glow));
      if (glow > 0) {
        out.material.emplace_back();
        out.material.back().emission = sum * static_cast<double>(glow);
        out.material.back().roughness2 = out.moments[i].covered;
      }
    }
  }

  // Place of a voxel's rays: w changes fastest, then u, then v of that axis.
  static std::size_t slot(int axis, const V3i& voxel) {
    const int u = axis == 0 ? voxel.y : voxel.x, v = axis == 2 ? voxel.y : voxel.z;
    return static_cast<std::size_t>((v * 8 + u) * 8 + voxel[axis]);
  }

  // Rays through two, four, eight voxels, each by itself; then their means.
  void compose(BrickWork& w, std::size_t r, Brick& out) const {
    out.passing.resize(3);
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<double>& pass = w.pass[static_cast<std::size_t>(axis)];
      Brick::Passing& to = out.passing[static_cast<std::size_t>(axis)];
      for (int level = 1, length = 4; level <= 3; ++level, length /= 2) {
        for (std::size_t column = 0; column < 64; ++column)
          for (int k = 0; k < length; ++k)
            for (std::size_t ray = 0; ray < r; ++ray)
              pass[(column * 8 + static_cast<std::size_t>(k)) * r + ray] = pass[(column * 8 + static_cast<std::size_t>(2 * k)) * r + ray] * pass[(column * 8 + static_cast<std::size_t>(2 * k + 1)) * r + ray];
        const int across = 1 << level;
        for (int cv = 0; cv < 8 / across; ++cv)
          for (int cu = 0; cu < 8 / across; ++cu)
            for (int k = 0; k < length; ++k) {
              double mean = 0;
              for (int v = 0; v < across; ++v)
                for (int u = 0; u < across; ++u)
                  for (std::size_t ray = 0; ray < r; ++ray)
                    mean += pass[static_cast<std::size_t>(((cv * across + v) * 8 + cu * across + u) * 8 + k) * r + ray];
              const auto value = static_cast<float>(mean / (static_cast<double>(r) * across * across));
              const auto place = static_cast<std::size_t>((cv * length + cu) * length + k);
              if (level == 1) to.level1[place] = value;
              else if (level == 2) to.level2[place] = value;
              else to.level3 = value;
            }
      }
      for (std::size_t column = 0; column < 64; ++column) {
        double mean = 0;
        for (std::size_t ray = 0; ray < r; ++ray) mean += pass[column * 8 * r + ray];
        to.columns[column] = static_cast<float>(mean / static_cast<double>(r));
      }
    }
  }
};

}  // namespace

void bake_brick(const BrickSource& source, const V3i& b, BrickWork& work, Brick& out) { Sampler{source}.bake(b, work, out); }

}  // namespace texel
