#include "formats/grid_field.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/interval.h"

namespace texel {
namespace {

std::size_t place_in_block(int x, int y, int z) { return static_cast<std::size_t>((x & 7) | (y & 7) << 3 | (z & 7) << 6); }

struct Range {
  float low = std::numeric_limits<float>::infinity(), high = -std::numeric_limits<float>::infinity();
  void add(float v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  void add(const Range& r) {
    low = std::min(low, r.low);
    high = std::max(high, r.high);
  }
};

// Least and largest per block, per 2³ blocks and so on up to one.
struct Level {
  V3i n;
  std::vector<Range> ranges;
  [[nodiscard]] const Range& at(int x, int y, int z) const {
    return ranges[(static_cast<std::size_t>(z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(x)];
  }
  Range& at(int x, int y, int z) { return const_cast<Range&>(static_cast<const Level&>(*this).at(x, y, z)); }
};

class GridField final : public Field {
 public:
  GridField(SampleGrid grid, double sign) : grid_(std::move(grid)), sign_(sign), blocks_(grid_.block_count()) {
    const V3d *s = grid_.step, across[3] = {s[1].cross(s[2]), s[2].cross(s[0]), s[0].cross(s[1])};
    const double volume = s[0].dot(across[0]);
    for (int a = 0; a < 3; ++a) inverse_[a] = across[a] / volume;
    build_pyramid();
  }

  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override {
    for (std::size_t i = 0; i < n; ++i) {
      const Cell c = cell_at(V3d(x[i], y[i], z[i]));
      if (!c.any) {
        f[i] = c.defined ? sign_ * static_cast<double>(grid_.outside) : std::nan("");
        continue;
      }
      double v[8];
      corners(c.low, v);
      f[i] = sign_ * blend(v, c.t);
    }
  }

  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    for (std::size_t i = 0; i < n; ++i) {
      const Cell c = cell_at(V3d(x[i], y[i], z[i]));
      V3d g(0, 0, 0);
      f[i] = c.defined ? sign_ * static_cast<double>(grid_.outside) : std::nan("");
      if (c.any) {
        double v[8];
        corners(c.low, v);
        f[i] = sign_ * blend(v, c.t);
        for (int a = 0; a < 3; ++a) {
          const int b = (a + 1) % 3, d = (a + 2) % 3;
          double slope = 0;
          for (int k = 0; k < 4; ++k) {
            const int low = ((k & 1) << b) | ((k >> 1) << d);
            const double w = (k & 1 ? c.t[b] : 1 - c.t[b]) * (k >> 1 ? c.t[d] : 1 - c.t[d]);
            slope += w * (v[low | 1 << a] - v[low]);
          }
          g += inverse_[a] * (sign_ * slope);
        }
      }
      gx[i] = g.x;
      gy[i] = g.y;
      gz[i] = g.z;
    }
  }

  [[nodiscard]] Interval range(const Box3d& box) const override {
    V3i low, high;
    bool outside = false;
    const V3d middle = (box.min + box.max) / 2.0 - grid_.origin, half = (box.max - box.min) / 2.0;
    for (int a = 0; a < 3; ++a) {
      const V3d& w = inverse_[a];
      const double at = w.dot(middle), reach = std::abs(w.x) * half.x + std::abs(w.y) * half.y + std::abs(w.z) * half.z;
      const double slack = 1e-9 + 1e-12 * (std::abs(at) + reach);  // index units: above the rounding of values' own way there
      if (!(at - reach > -1e9 && at + reach < 1e9)) return whole();
      low[a] = static_cast<int>(std::floor(at - reach - slack));
      high[a] = static_cast<int>(std::floor(at + reach + slack)) + 1;
      outside = outside || low[a] < 0 || high[a] >= grid_.n[a];
      low[a] = std::max(low[a], 0);
      high[a] = std::min(high[a], grid_.n[a] - 1);
    }
    Range r;
    if (outside) r.add(grid_.outside);
    if (low.x <= high.x && low.y <= high.y && low.z <= high.z) r.add(samples(low, high));
    return result(r);
  }

  [[nodiscard]] Box3d bounds(double iso) const override {
    if (sign_ * static_cast<double>(grid_.outside) >= iso) return {};
    V3i low = grid_.n, high(-1, -1, -1);
    for (int bz = 0; bz < blocks_.z; ++bz)
      for (int by = 0; by < blocks_.y; ++by)
        for (int bx = 0; bx < blocks_.x; ++bx) {
          const Interval of = result(levels_[0].at(bx, by, bz));
          if (of.high < iso) continue;
          const V3i from(bx * 8, by * 8, bz * 8), to(std::min(from.x + 7, grid_.n.x - 1), std::min(from.y + 7, grid_.n.y - 1), std::min(from.z + 7, grid_.n.z - 1));
          for (int z = from.z; z <= to.z; ++z)
            for (int y = from.y; y <= to.y; ++y)
              for (int x = from.x; x <= to.x; ++x) {
                if (sign_ * static_cast<double>(sample(x, y, z)) < iso) continue;
                const V3i p(x, y, z);
                for (int a = 0; a < 3; ++a) {
                  low[a] = std::min(low[a], p[a]);
                  high[a] = std::max(high[a], p[a]);
                }
              }
        }
    Box3d box;
    if (high.x < 0) return box;
    for (int i = 0; i < 8; ++i) {
      V3d p = grid_.origin;
      for (int a = 0; a < 3; ++a) p += grid_.step[a] * ((i >> a) & 1 ? high[a] + 1.0 : low[a] - 1.0);
      box.extendBy(p);
    }
    return box;
  }

 private:
  struct Cell {
    V3i low;
    V3d t;
    bool any = false, defined = true;
  };
  [[nodiscard]] Cell cell_at(const V3d& world) const {
    Cell c;
    const V3d p = world - grid_.origin;
    for (int a = 0; a < 3; ++a) {
      const double at = inverse_[a].dot(p);
      if (!(at > -1 && at < grid_.n[a])) {
        c.defined = !std::isnan(at);
        return c;
      }
      const double whole = std::floor(at);
      c.low[a] = static_cast<int>(whole);
      c.t[a] = at - whole;
    }
    c.any = true;
    return c;
  }
  [[nodiscard]] float sample(int x, int y, int z) const {
    if (static_cast<unsigned>(x) >= static_cast<unsigned>(grid_.n.x) || static_cast<unsigned>(y) >= static_cast<unsigned>(grid_.n.y) ||
        static_cast<unsigned>(z) >= static_cast<unsigned>(grid_.n.z))
      return grid_.outside;
    const std::int32_t b = block(x >> 3, y >> 3, z >> 3);
    return b < 0 ? grid_.constants[static_cast<std::size_t>(~b)] : grid_.data[static_cast<std::size_t>(b) * 512 + place_in_block(x, y, z)];
  }
  [[nodiscard]] std::int32_t block(int x, int y, int z) const {
    return grid_.blocks[(static_cast<std::size_t>(z) * static_cast<std::size_t>(blocks_.y) + static_cast<std::size_t>(y)) * static_cast<std::size_t>(blocks_.x) + static_cast<std::size_t>(x)];
  }
  void corners(const V3i& low, double* v) const {
    const bool one_block = (low.x & 7) < 7 && (low.y & 7) < 7 && (low.z & 7) < 7 && low.x >= 0 && low.y >= 0 && low.z >= 0;
    if (one_block) {
      const std::int32_t b = block(low.x >> 3, low.y >> 3, low.z >> 3);
      if (b < 0) {
        std::fill_n(v, 8, static_cast<double>(grid_.constants[static_cast<std::size_t>(~b)]));
        return;
      }
      const float* from = grid_.data.data() + static_cast<std::size_t>(b) * 512 + place_in_block(low.x, low.y, low.z);
      for (int i = 0; i < 8; ++i) v[i] = static_cast<double>(from[(i & 1) + ((i >> 1) & 1) * 8 + (i >> 2) * 64]);
      return;
    }
    for (int i = 0; i < 8; ++i) v[i] = static_cast<double>(sample(low.x + (i & 1), low.y + ((i >> 1) & 1), low.z + (i >> 2)));
  }
  static double blend(const double* v, const V3d& t) {
    const double a = v[0] + (v[1] - v[0]) * t.x, b = v[2] + (v[3] - v[2]) * t.x, c = v[4] + (v[5] - v[4]) * t.x, d = v[6] + (v[7] - v[6]) * t.x;
    const double e = a + (b - a) * t.y, f = c + (d - c) * t.y;
    return e + (f - e) * t.z;
  }

  void build_pyramid() {
    Level level{blocks_, std::vector<Range>(grid_.blocks.size())};
    for (int z = 0; z < blocks_.z; ++z)
      for (int y = 0; y < blocks_.y; ++y)
        for (int x = 0; x < blocks_.x; ++x) {
          Range& r = level.at(x, y, z);
          if (const std::int32_t b = block(x, y, z); b < 0) r.add(grid_.constants[static_cast<std::size_t>(~b)]);
          else
            for (std::size_t i = 0; i < 512; ++i) r.add(grid_.data[static_cast<std::size_t>(b) * 512 + i]);
        }
    levels_.push_back(std::move(level));
    while (std::max({levels_.back().n.x, levels_.back().n.y, levels_.back().n.z}) > 1) {
      const Level& fine = levels_.back();
      Level coarse{V3i((fine.n.x + 1) / 2, (fine.n.y + 1) / 2, (fine.n.z + 1) / 2), {}};
      coarse.ranges.resize(static_cast<std::size_t>(coarse.n.x) * static_cast<std::size_t>(coarse.n.y) * static_cast<std::size_t>(coarse.n.z));
      for (int z = 0; z < fine.n.z; ++z)
        for (int y = 0; y < fine.n.y; ++y)
          for (int x = 0; x < fine.n.x; ++x) coarse.at(x / 2, y / 2, z / 2).add(fine.at(x, y, z));
      levels_.push_back(std::move(coarse));
    }
  }

  // Of the samples low … high: themselves where they are few, else the finest level of the pyramid that has few.
  [[nodiscard]] Range samples(const V3i& low, const V3i& high) const {
    constexpr double kFew = 2048;
    const auto count = [&](int shift) {
      double n = 1;
      for (int a = 0; a < 3; ++a) n *= (high[a] >> shift) - (low[a] >> shift) + 1;
      return n;
    };
    Range r;
    if (count(0) <= kFew) {
      for (int z = low.z; z <= high.z; ++z)
        for (int y = low.y; y <= high.y; ++y)
          for (int x = low.x; x <= high.x; ++x) r.add(sample(x, y, z));
      return r;
    }
    std::size_t l = 0;
    while (l + 1 < levels_.size() && count(static_cast<int>(l) + 3) > kFew) ++l;
    const int shift = static_cast<int>(l) + 3;
    for (int z = low.z >> shift; z <= high.z >> shift; ++z)
      for (int y = low.y >> shift; y <= high.y >> shift; ++y)
        for (int x = low.x >> shift; x <= high.x >> shift; ++x) r.add(levels_[l].at(x, y, z));
    return r;
  }

  // The blend of eight rounds seven times.
  [[nodiscard]] Interval result(const Range& r) const {
    const double a = sign_ * static_cast<double>(r.low), b = sign_ * static_cast<double>(r.high);
    const double slack = 32 * interval::kEpsilon * std::max(std::abs(a), std::abs(b));
    return {std::min(a, b) - slack, std::max(a, b) + slack};
  }
  [[nodiscard]] Interval whole() const {
    Range r = levels_.back().at(0, 0, 0);
    r.add(grid_.outside);
    return result(r);
  }

  SampleGrid grid_;
  double sign_;
  V3i blocks_;
  V3d inverse_[3];  // index a of a world offset p: inverse_[a]·p
  std::vector<Level> levels_;
};

}  // namespace

SampleGrid make_samples(const V3i& n, const std::function<void(int y, int z, float* out)>& row, std::int64_t* bad) {
  SampleGrid grid;
  grid.n = n;
  const V3i blocks = grid.block_count();
  const auto width = static_cast<std::size_t>(blocks.x) * 8;
  std::vector<float> slab(width * static_cast<std::size_t>(blocks.y) * 64);  // eight layers, padded to whole blocks
  const float none = std::numeric_limits<float>::quiet_NaN();
  float least = std::numeric_limits<float>::infinity();
  *bad = 0;
  std::vector<std::size_t> with_bad;  // blocks of `data` to mend when the least value is known
  bool constants_bad = false;
  for (int bz = 0; bz < blocks.z; ++bz) {
    std::fill(slab.begin(), slab.end(), none);
    for (int z = bz * 8; z < std::min(n.z, bz * 8 + 8); ++z)
      for (int y = 0; y < n.y; ++y) {
        float* out = slab.data() + (static_cast<std::size_t>(z & 7) * static_cast<std::size_t>(blocks.y) * 8 + static_cast<std::size_t>(y)) * width;
        row(y, z, out);
        for (int x = 0; x < n.x; ++x) {
          if (std::isfinite(out[x])) least = std::min(least, out[x]);
          else {
            ++*bad;
            out[x] = none;
          }
        }
      }
    for (int by = 0; by < blocks.y; ++by)
      for (int bx = 0; bx < blocks.x; ++bx) {
        float block[512];
        bool same = true, any_none = false;
        for (int z = 0; z < 8; ++z)
          for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x) {
              const float v = slab[(static_cast<std::size_t>(z) * static_cast<std::size_t>(blocks.y) * 8 + static_cast<std::size_t>(by * 8 + y)) * width + static_cast<std::size_t>(bx * 8 + x)];
              const std::size_t i = place_in_block(x, y, z);
              block[i] = v;
              same = same && (v == block[0] || (std::isnan(v) && std::isnan(block[0])));
              any_none = any_none || std::isnan(v);
            }
        if (same) {
          constants_bad = constants_bad || any_none;
          grid.blocks.push_back(~static_cast<std::int32_t>(grid.constants.size()));
          grid.constants.push_back(block[0]);
          continue;
        }
        const std::size_t at = grid.data.size() / 512;
        if (any_none) with_bad.push_back(at);
        grid.blocks.push_back(static_cast<std::int32_t>(at));
        grid.data.insert(grid.data.end(), block, block + 512);
      }
  }
  if (!std::isfinite(least)) least = 0;
  for (const std::size_t b : with_bad)
    for (std::size_t i = b * 512; i < b * 512 + 512; ++i)
      if (std::isnan(grid.data[i])) grid.data[i] = least;
  if (constants_bad)
    for (float& v : grid.constants)
      if (std::isnan(v)) v = least;
  grid.outside = least;
  return grid;
}

Interval sample_range(const SampleGrid& grid) {
  Range r;
  const V3i blocks = grid.block_count();
  std::size_t b = 0;
  for (int bz = 0; bz < blocks.z; ++bz)
    for (int by = 0; by < blocks.y; ++by)
      for (int bx = 0; bx < blocks.x; ++bx, ++b) {
        const std::int32_t at = grid.blocks[b];
        if (at < 0) {
          r.add(grid.constants[static_cast<std::size_t>(~at)]);
          continue;
        }
        for (int z = bz * 8; z < std::min(bz * 8 + 8, grid.n.z); ++z)
          for (int y = by * 8; y < std::min(by * 8 + 8, grid.n.y); ++y)
            for (int x = bx * 8; x < std::min(bx * 8 + 8, grid.n.x); ++x) r.add(grid.data[static_cast<std::size_t>(at) * 512 + place_in_block(x, y, z)]);
      }
  return {static_cast<double>(r.low), static_cast<double>(r.high)};
}

std::shared_ptr<const Field> make_grid_field(SampleGrid grid, double sign) { return std::make_shared<GridField>(std::move(grid), sign); }

}  // namespace texel
