#include "bake/hypertexture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "bake/block_index.h"
#include "bake/light.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr int kBrick = 8;

// What a brick leaves behind. `rays[axis]`: level 1 (4³ voxels), 2 (2³), 3 (1): share of the rays that pass; then of its 8×8 columns, by
// (v, u) of that axis.
struct Brick {
  enum class Kind : std::uint8_t { kEmpty, kFull, kMixed } kind = Kind::kEmpty;
  bool sampled = false;
  std::array<std::uint64_t, 8> border{}, inside{};
  std::vector<Moments> moments;
  std::vector<Areas> areas;
  std::vector<V3d> color;
  std::vector<MaterialSums> material;
  std::array<std::vector<float>, 3> alpha;
  std::vector<float> solid;
  struct Passing { std::array<float, 64> level1; std::array<float, 8> level2; float level3; std::array<float, 64> columns; };
  std::vector<Passing> passing;    // 3, or none
  double mass = 0;
  std::int64_t undefined = 0;
};

int local(int x, int y, int z) { return x << 6 | y << 3 | z; }

// Buffers of one task.
struct Work {
  std::vector<double> d;                       // samples with one beyond each side
  std::vector<double> x, y, z;
  std::array<std::vector<double>, 3> pass;     // per axis, voxel column, w: rays
};

struct Sampler {
  const Field& density;
  const Hypertexture& texture;
  const SolidTexture* color;
  V3f plain;
  float glow;
  const Grid& grid;
  const Recipe& recipe;
  const DensityOptions& options;
  int s;                                       // samples a voxel edge
  double cap;                                  // of a ray's optical depth in a voxel

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
  void sample(const V3i& b, const V3i& n, Work& w, Brick& out) const {
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
  double rays(const Work& w, int axis, const V3i& voxel, double* pass) const {
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
  Moments moments(const Work& w, const V3i& voxel, double* area, double* solid, double* mass, Spots* spots) const {
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
  int state(const Work& w, const V3i& voxel) const {
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

  void bake(const V3i& b, Work& w, Brick& out) const {
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

  void measure(const V3i& b, const V3i& n, const std::array<std::int8_t, 512>& states, Work& w, Brick& out) const {
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
  void compose(Work& w, std::size_t r, Brick& out) const {
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

// Bricks in order -> one level-0 surface and what is seen of it.
void join(std::vector<Brick>& bricks, const V3i& n, Surface& surface, Visibility& seen) {
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        Brick& brick = bricks[(static_cast<std::size_t>(z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(x)];
        add_inside(V3i(x, y, z), brick.inside, seen);
        if (count_voxels(brick.border) == 0) continue;
        surface.set.add(V3i(x, y, z), brick.border);
        const auto append = [](auto& to, auto& from) {
          to.insert(to.end(), from.begin(), from.end());
          from = {};
        };
        append(surface.moments, brick.moments);
        append(surface.areas, brick.areas);
        append(surface.color, brick.color);
        append(surface.material, brick.material);
        append(seen.solid, brick.solid);
        for (std::size_t a = 0; a < 3; ++a) append(seen.alpha[a], brick.alpha[a]);
      }
}

// Shares of the columns that pass a cube of 2^k level-0 voxels a side, k >= 3: (v, u) of each axis. Empty: all or none pass, by `kind`.
struct Cube {
  Brick::Kind kind = Brick::Kind::kEmpty;
  std::array<std::vector<float>, 3> columns;
};

// Eight cubes into one: columns through the two behind each other multiply.
Cube merge(const std::array<const Cube*, 8>& children, int side) {
  Cube parent;
  bool empty = true, full = true;
  for (const Cube* c : children) {
    empty = empty && (!c || c->kind == Brick::Kind::kEmpty);
    full = full && c && c->kind == Brick::Kind::kFull;
  }
  parent.kind = empty ? Brick::Kind::kEmpty : full ? Brick::Kind::kFull : Brick::Kind::kMixed;
  if (empty || full) return parent;
  const auto width = static_cast<std::size_t>(2 * side);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float>& to = parent.columns[static_cast<std::size_t>(axis)];
    to.assign(width * width, 1.0f);
    for (int c = 0; c < 8; ++c) {
      const Cube* child = children[static_cast<std::size_t>(c)];
      if (!child || child->kind == Brick::Kind::kEmpty) continue;
      const V3i corner(c & 1, c >> 1 & 1, c >> 2);
      const auto u0 = static_cast<std::size_t>((axis == 0 ? corner.y : corner.x) * side), v0 = static_cast<std::size_t>((axis == 2 ? corner.y : corner.z) * side);
      for (std::size_t v = 0; v < static_cast<std::size_t>(side); ++v)
        for (std::size_t u = 0; u < static_cast<std::size_t>(side); ++u)
          to[(v0 + v) * width + u0 + u] *= child->kind == Brick::Kind::kFull ? 0.0f : child->columns[static_cast<std::size_t>(axis)][v * static_cast<std::size_t>(side) + u];
    }
  }
  return parent;
}

// Opacity of levels 1 … from what the bricks have kept.
void coarse_opacity(std::vector<Brick>& bricks, V3i n, const std::vector<Surface>& surfaces, std::vector<Visibility>& seen) {
  const auto place = [](const V3i& b, const V3i& size) {
    return (static_cast<std::size_t>(b.z) * static_cast<std::size_t>(size.y) + static_cast<std::size_t>(b.y)) * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(b.x);
  };
  for (std::size_t level = 1; level < surfaces.size() && level <= 3; ++level) {
    const int length = 8 >> level;
    for (std::size_t a = 0; a < 3; ++a) seen[level].alpha[a].resize(static_cast<std::size_t>(surfaces[level].set.count));
    for_each_voxel(surfaces[level].set, [&](const V3i& voxel, std::int64_t index) {
      const V3i b(voxel.x / length, voxel.y / length, voxel.z / length), in(voxel.x % length, voxel.y % length, voxel.z % length);
      const Brick& brick = bricks[place(b, n)];
      for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const Brick::Passing& passing = brick.passing[a];  // a voxel with surface: the brick is mixed
        const int u = axis == 0 ? in.y : in.x, v = axis == 2 ? in.y : in.z;
        const auto i = static_cast<std::size_t>((v * length + u) * length + in[axis]);
        seen[level].alpha[a][static_cast<std::size_t>(index)] = 1 - (level == 1 ? passing.level1[i] : level == 2 ? passing.level2[i] : passing.level3);
      }
    });
  }
  if (surfaces.size() <= 4) return;
  std::vector<Cube> cubes(bricks.size());
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    cubes[i].kind = bricks[i].kind;
    if (bricks[i].kind != Brick::Kind::kMixed) continue;
    for (std::size_t a = 0; a < 3; ++a) cubes[i].columns[a].assign(bricks[i].passing[a].columns.begin(), bricks[i].passing[a].columns.end());
  }
  int side = 8;
  for (std::size_t level = 4; level < surfaces.size(); ++level, side *= 2) {
    const V3i up((n.x + 1) / 2, (n.y + 1) / 2, (n.z + 1) / 2);
    std::vector<Cube> parents(static_cast<std::size_t>(up.x) * static_cast<std::size_t>(up.y) * static_cast<std::size_t>(up.z));
    tbb::parallel_for(0, up.z, [&](int z) {
      for (int y = 0; y < up.y; ++y)
        for (int x = 0; x < up.x; ++x) {
          std::array<const Cube*, 8> children{};
          for (int c = 0; c < 8; ++c)
            if (const V3i at(2 * x + (c & 1), 2 * y + (c >> 1 & 1), 2 * z + (c >> 2)); at.x < n.x && at.y < n.y && at.z < n.z)
              children[static_cast<std::size_t>(c)] = &cubes[place(at, n)];
          parents[place(V3i(x, y, z), up)] = merge(children, side);
        }
    });
    for (std::size_t a = 0; a < 3; ++a) seen[level].alpha[a].resize(static_cast<std::size_t>(surfaces[level].set.count));
    for_each_voxel(surfaces[level].set, [&](const V3i& voxel, std::int64_t index) {
      const Cube& cube = parents[place(voxel, up)];
      for (std::size_t a = 0; a < 3; ++a) {
        double mean = 0;
        for (const float c : cube.columns[a]) mean += static_cast<double>(c);
        seen[level].alpha[a][static_cast<std::size_t>(index)] = static_cast<float>(1 - mean / static_cast<double>(cube.columns[a].size()));
      }
    });
    cubes = std::move(parents);
    n = up;
  }
}

// A run of voxels along a column: one border voxel, or inside ones (index −1).
struct Piece {
  std::uint32_t at;
  std::int32_t first, last;
  std::int64_t index;
};

SliceRecords make_slices(const Surface& surface, const Visibility& seen, const Grid& grid, int axis, int count, const std::function<V3f(const V3i&, std::int64_t)>& shade) {
  const BundleAxes axes = bundle_axes(axis);
  const int nu = grid.n[axes.u], nv = grid.n[axes.v], nw = grid.n[axes.w];
  // Pieces of each row of columns, then in order of the column.
  std::vector<std::vector<Piece>> rows(static_cast<std::size_t>(nv));
  const auto add = [&](const V3i& voxel, int length, std::int64_t index) {
    const int u = voxel[axes.u], v = voxel[axes.v], w = voxel[axes.w];
    rows[static_cast<std::size_t>(v)].push_back({static_cast<std::uint32_t>(v) * static_cast<std::uint32_t>(nu) + static_cast<std::uint32_t>(u), w, w + length, index});
  };
  for_each_voxel(surface.set, [&](const V3i& voxel, std::int64_t i) { add(voxel, 1, i); });
  for_each_voxel(seen.inside, [&](const V3i& voxel, std::int64_t) { add(voxel, 1, -1); });
  for (const V3i& at : seen.inside_blocks)
    for (int v = 0; v < 8; ++v)
      for (int u = 0; u < 8; ++u) {
        V3i voxel = at * 8;
        voxel[axes.u] += u;
        voxel[axes.v] += v;
        add(voxel, 8, -1);
      }
  const auto& alpha = seen.alpha[static_cast<std::size_t>(axis)];
  std::vector<SliceBand> bands(static_cast<std::size_t>(nv));
  tbb::parallel_for(0, nv, [&](int v) {
    std::vector<Piece>& pieces = rows[static_cast<std::size_t>(v)];
    std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.at != b.at ? a.at < b.at : a.first < b.first; });
    SliceBand& out = bands[static_cast<std::size_t>(v)];
    struct Slab { double passes = 1, weight = 0; V3d color{0, 0, 0}; bool has_color = false; };
    std::vector<Slab> slabs(static_cast<std::size_t>(count));
    std::vector<int> touched;
    for (std::size_t p = 0; p < pieces.size();) {
      const std::uint32_t at = pieces[p].at;
      touched.clear();
      std::vector<SliceRecords::Run> runs;
      for (; p < pieces.size() && pieces[p].at == at; ++p) {
        const Piece& piece = pieces[p];
        // The slabs a voxel lies in share its optical depth by length.
        const double low = static_cast<double>(piece.first) * count / nw, high = static_cast<double>(piece.last) * count / nw;
        const int k0 = static_cast<int>(std::floor(low)), k1 = std::min(count, static_cast<int>(std::ceil(high)));
        if (piece.index < 0) {
          if (!runs.empty() && runs.back().last >= k0) runs.back().last = std::max(runs.back().last, k1);
          else runs.push_back({at, k0, k1, 1.0f});
          continue;
        }
        const auto i = static_cast<std::size_t>(piece.index);
        V3i voxel;
        voxel[axes.u] = static_cast<int>(at) % nu;
        voxel[axes.v] = v;
        voxel[axes.w] = piece.first;
        const V3f color = shade(voxel, piece.index);
        const double opacity = static_cast<double>(alpha[i]);
        for (int k = k0; k < k1; ++k) {
          const double share = std::min(high, k + 1.0) - std::max(low, static_cast<double>(k));
          if (!(share > 0)) continue;
          Slab& slab = slabs[static_cast<std::size_t>(k)];
          if (touched.empty() || touched.back() != k) touched.push_back(k);
          const double whole = high - low;
          slab.passes *= share >= whole ? 1 - opacity : std::pow(1 - opacity, share / whole);
          if (color.x < 0) continue;
          const double weight = std::max(opacity, 1e-9) * share;
          slab.color += V3d(color) * weight;
          slab.weight += weight;
        }
      }
      // A slab that inside matter reaches into is opaque; where border voxels do so too it has their colour.
      std::size_t t = 0;
      for (const SliceRecords::Run& run : runs) {
        std::int32_t from = run.first;
        for (; t < touched.size() && touched[t] < run.last; ++t) {
          if (touched[t] < run.first) continue;
          slabs[static_cast<std::size_t>(touched[t])].passes = 0;
          if (touched[t] > from) out.runs.push_back({at, from, touched[t], 1.0f});
          from = touched[t] + 1;
        }
        if (run.last > from) out.runs.push_back({at, from, run.last, 1.0f});
      }
      for (const int k : touched) {
        Slab& slab = slabs[static_cast<std::size_t>(k)];
        SliceRecords::Pixel pixel{at, -1, -1, -1, static_cast<float>(1 - slab.passes)};
        if (slab.weight > 0) {
          const V3f color(slab.color / slab.weight);
          pixel.r = color.x;
          pixel.g = color.y;
          pixel.b = color.z;
        }
        if (pixel.a > 0) out.records.push_back({k, pixel});
        slab = {};
      }
    }
  });
  return gather_slices(axis, nu, nv, count, bands);
}

}  // namespace

double mean_depth(double u, double v) {
  if (u >= 1 && v >= 1) return 0;
  if (!(u > 0) && !(v > 0)) return std::numeric_limits<double>::infinity();
  const double d = u - v, m = (u + v) / 2;
  // Series about the middle where the closed form would cancel: the next term is d⁴/(80 m⁴) < 2e-14.
  if (std::abs(d) < 1e-3 * m) return -std::log(m) + d * d / (24 * m * m);
  const double a = u > 0 ? u * std::log(u) : 0, b = v > 0 ? v * std::log(v) : 0;
  return std::max(0.0, 1 - (a - b) / d);
}

double ray_depth(const double* d, std::size_t stride, int points) {
  double sum = 0, here = 1 - d[0];
  const double before = 1 - *(d - stride);
  sum += mean_depth((before + here) / 2, here) / 2;
  for (int k = 1; k < points; ++k) {
    const double next = 1 - d[static_cast<std::size_t>(k) * stride];
    sum += mean_depth(here, next);
    here = next;
  }
  const double after = 1 - d[static_cast<std::size_t>(points) * stride];
  return sum + mean_depth(here, (here + after) / 2) / 2;
}

Box3d density_bounds(const Field& density) {
  const Box3d all = density.bounds(0);
  for (int a = 0; a < 3; ++a)
    if (all.isEmpty() || !std::isfinite(all.min[a]) || !std::isfinite(all.max[a]))
      throw Error(Code::kCommandLine, "--box", "missing: the base shape does not say where it ends", "give the region to bake");
  constexpr int kCells = 64;
  const V3d cell = all.size() / kCells;
  Box3d found;
  // From large cells to small; what lies within what was found already adds nothing.
  const auto visit = [&](auto&& self, const V3i& at, int size) -> void {
    const Box3d box(all.min + cell * V3d(at), all.min + cell * V3d(at + V3i(size)));
    if (!found.isEmpty() && found.intersects(box.min) && found.intersects(box.max)) return;
    if (density.range(box).high <= 0) return;
    if (size == 1) {
      found.extendBy(box);
      return;
    }
    for (int c = 0; c < 8; ++c) self(self, at + V3i(c & 1, c >> 1 & 1, c >> 2) * (size / 2), size / 2);
  };
  visit(visit, V3i(0, 0, 0), kCells);
  if (found.isEmpty()) throw Error(Code::kBadInput, "--hypertexture", "the density is 0 everywhere", "change the shape, its iso value or the amount of noise");
  return found;
}

DensityBake bake_density(const Scene& scene, const Grid& grid, const Recipe& recipe, const DensityOptions& options, Report& report) {
  const Hypertexture& texture = *scene.hypertexture;
  // D as it is: were finer octaves faded to their means first, opacity would be that of the mean density, which is not the mean opacity (docs/accuracy.md).
  const std::shared_ptr<const Field> density = make_density(texture, 0);
  const Material& material = scene.materials.front();
  const bool own = material.solid == nullptr;
  const std::shared_ptr<const SolidTexture> color = own ? hypertexture_color(texture) : material.solid;
  const int samples = std::max(1, recipe.samples);
  const Sampler sampler{*density, texture, color.get(), material.kd, own ? hypertexture_glow(texture) : 0, grid, recipe, options, samples, std::max(1.0, recipe.max_depth)};

  const V3i n((grid.n.x + 7) / 8, (grid.n.y + 7) / 8, (grid.n.z + 7) / 8);
  std::vector<Brick> bricks(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z));
  std::atomic<int> done{0};
  tbb::parallel_for(0, n.z * n.y, [&](int row) {
    Work work;
    for (int x = 0; x < n.x; ++x) sampler.bake(V3i(x, row % n.y, row / n.y), work, bricks[static_cast<std::size_t>(row) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(x)]);
    if (report.progress) report.progress("density", static_cast<double>(++done) / (n.z * n.y));
  });

  DensityBake result;
  std::int64_t sampled = 0, undefined = 0;
  for (const Brick& b : bricks) {
    sampled += b.sampled;
    undefined += b.undefined;
    result.mass += b.mass;
  }
  report.count("bricks", static_cast<double>(bricks.size()));
  report.count("bricks sampled", static_cast<double>(sampled));
  if (const auto skipped = static_cast<std::int64_t>(bricks.size()) - sampled; skipped > 0)
    report.skip("sampling of " + std::to_string(skipped) + " of " + std::to_string(bricks.size()) + " bricks of 8x8x8 voxels", "all empty or all full by the density's range");
  if (undefined > 0) report.issue("field-undefined", "samples of the density have no value; they count as empty", undefined);

  result.surfaces.resize(1);
  result.seen.levels.resize(1);
  join(bricks, n, result.surfaces[0], result.seen.levels[0]);
  if (result.surfaces[0].set.count == 0 && result.seen.levels[0].inside_count == 0)
    throw Error(Code::kBadInput, "--box", "no matter lies in the box", "choose a box that meets the density");
  while (static_cast<int>(result.surfaces.size()) < options.levels) {
    result.surfaces.push_back(coarser(result.surfaces.back()));
    result.seen.levels.emplace_back();
  }
  if (options.opacity && options.recompute) coarse_opacity(bricks, n, result.surfaces, result.seen.levels);
  bricks.clear();

  const double edge = grid.h;
  for (const Areas& a : result.surfaces[0].areas) result.area += a.area * edge * edge;
  result.mass *= edge * edge * edge;
  for (const float f : result.seen.levels[0].solid) result.filled += static_cast<double>(f);

  const Surface& surface = result.surfaces[0];
  const auto shade = [&](const V3i& voxel, std::int64_t index) {
    const Moments& m = surface.moments[static_cast<std::size_t>(index)];
    if (!(m.covered > 0)) return V3f(-1, -1, -1);
    const V3f albedo(surface.color[static_cast<std::size_t>(index)] / m.covered);
    const V3f own_light = surface.material.empty() ? V3f(0, 0, 0) : V3f(surface.material[static_cast<std::size_t>(index)].emission / m.covered);
    if (recipe.lights.empty()) return albedo + own_light;
    const double length = m.m.length();
    return own_light + albedo * irradiance(recipe.lights, nullptr, grid.centre(voxel), length > 0 ? m.m / length : V3d(0, 0, 1), !(length > 0));
  };
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (options.slice_axes[a]) result.stacks[a] = make_slices(surface, result.seen.levels[0], grid, axis, options.slice_counts[a], shade);
  }
  return result;
}

}  // namespace texel
