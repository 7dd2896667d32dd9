#include "formats/noise.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "formats/period_fit.h"

namespace texel {
namespace {

constexpr double kLargest = 0x1p51;        // beyond it fractions of a lattice cell cannot be told
constexpr double kRound = 0x1.8p52;        // added to |x| < 2⁵¹, leaves the nearest integer in the low bits
constexpr std::size_t kBatch = 64;         // points worked on together: their arrays stay in the nearest cache

// Low 32 bits of the integer that `whole` is.
inline std::uint32_t low_bits(double whole) { return static_cast<std::uint32_t>(std::bit_cast<std::uint64_t>(whole + kRound)); }

// Every input bit reaches every output bit (the finalizer of MurmurHash3, public domain).
inline std::uint32_t mix(std::uint32_t h) {
  h ^= h >> 16;
  h *= 0x85ebca6bu;
  h ^= h >> 13;
  h *= 0xc2b2ae35u;
  return h ^ h >> 16;
}

// Odd multipliers of each axis: 2³² over the powers of the plastic number, which spreads neighbouring points evenly.
constexpr std::uint32_t kAxis[3] = {0xd1b54a33u, 0xabc98389u, 0x8cb92ba7u};

struct Corner { double x, y, z; };

// Unit vector, uniform over the sphere to 2⁻¹⁵: height and longitude from 16 and 15 bits, the half circle from the last. In floats: a
// direction needs no more, and twice as many fit a register.
inline Corner direction(std::uint32_t h) {
  // Signed conversions only: they vectorise.
  const float z = static_cast<float>(static_cast<std::int32_t>(h & 0xffffu)) * 0x1p-15f - (1 - 0x1p-16f);
  const float u = static_cast<float>(static_cast<std::int32_t>(h >> 16 & 0x7fffu)) * 0x1p-14f - (1 - 0x1p-15f);  // (−1, 1)
  // sin(πu/2), odd, 1 at u = 1, within 7·10⁻⁷ (least squares on Chebyshev nodes). Its cosine by Pythagoras: the length is 1 to 2·10⁻⁷.
  const float w = u * u;
  const float s = u * (1.5707903f + w * (-0.6458861f + w * (0.0794184f - w * 0.0043226f)));
  const float ring = 1 - z * z;
  const float c = std::sqrt(ring * std::max(0.0f, 1 - s * s));
  return {static_cast<double>(h >> 31 ? -c : c), static_cast<double>(std::sqrt(ring) * s), static_cast<double>(z)};
}

inline double blend(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
inline double blend_slope(double t) { return 30 * t * t * (t * (t - 2) + 1); }

// Along one axis: fraction in the cell and the hashed lattice coordinates on either side.
struct Axis {
  std::array<double, kBatch> t;
  std::array<std::uint32_t, kBatch> low, high;
};

void split(int axis, int period, std::size_t n, const double* x, Axis& out) {
  const std::uint32_t k = kAxis[axis];
  if (period <= 0) {
    for (std::size_t i = 0; i < n; ++i) {
      const double p = std::abs(x[i]) < kLargest ? x[i] : 0;
      const double whole = std::floor(p);
      out.t[i] = p - whole;
      out.low[i] = low_bits(whole) * k;
      out.high[i] = low_bits(whole + 1) * k;
    }
    return;
  }
  const double length = period;
  for (std::size_t i = 0; i < n; ++i) {
    const double p = std::abs(x[i]) < kLargest ? x[i] : 0;
    const double whole = std::floor(p);
    // Whole numbers below 2⁵¹: the quotient cannot round up across a multiple of the period.
    const double place = whole - length * std::floor(whole / length);
    const double next = place + 1 < length ? place + 1 : 0;
    out.t[i] = p - whole;
    out.low[i] = low_bits(place) * k;
    out.high[i] = low_bits(next) * k;
  }
}

inline double lerp(double s, double a, double b) { return a + s * (b - a); }

struct Batch {
  Axis x, y, z;
  std::uint32_t seed;

  Batch(const Noise& noise, std::size_t n, const double* px, const double* py, const double* pz) : seed(mix(noise.seed + 0x9e3779b9u)) {
    split(0, noise.period.x, n, px, x);
    split(1, noise.period.y, n, py, y);
    split(2, noise.period.z, n, pz, z);
  }
  // call(i, gradient of corner c, offset of point i from it). Corner by corner rather than point by point: short loops vectorise.
  template <class Call>
  void for_corner(int c, std::size_t n, Call&& call) const {
    const std::uint32_t* hx = (c & 1 ? x.high : x.low).data();
    const std::uint32_t* hy = (c & 2 ? y.high : y.low).data();
    const std::uint32_t* hz = (c & 4 ? z.high : z.low).data();
    const double ox = c & 1, oy = c >> 1 & 1, oz = c >> 2;
    for (std::size_t i = 0; i < n; ++i) call(i, direction(mix(seed + hx[i] + hy[i] + hz[i])), Corner{x.t[i] - ox, y.t[i] - oy, z.t[i] - oz});
  }
};

void batch_values(const Noise& noise, std::size_t n, const double* px, const double* py, const double* pz, double* value) {
  const Batch b(noise, n, px, py, pz);
  std::array<std::array<double, kBatch>, 8> dot;
  for (int c = 0; c < 8; ++c) {
    double* to = dot[static_cast<std::size_t>(c)].data();
    b.for_corner(c, n, [&](std::size_t i, const Corner& g, const Corner& d) { to[i] = g.x * d.x + g.y * d.y + g.z * d.z; });
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double sx = blend(b.x.t[i]), sy = blend(b.y.t[i]), sz = blend(b.z.t[i]);
    const double v = lerp(sz, lerp(sy, lerp(sx, dot[0][i], dot[1][i]), lerp(sx, dot[2][i], dot[3][i])),
                          lerp(sy, lerp(sx, dot[4][i], dot[5][i]), lerp(sx, dot[6][i], dot[7][i])));
    value[i] = v + 0 * (px[i] + py[i] + pz[i]);  // NaN where a coordinate is not finite
  }
}

void batch_gradients(const Noise& noise, std::size_t n, const double* px, const double* py, const double* pz, double* value, double* gx, double* gy, double* gz) {
  const Batch b(noise, n, px, py, pz);
  std::array<std::array<double, kBatch>, 8> dot, g[3];
  for (int c = 0; c < 8; ++c) {
    const auto k = static_cast<std::size_t>(c);
    double *to = dot[k].data(), *hx = g[0][k].data(), *hy = g[1][k].data(), *hz = g[2][k].data();
    b.for_corner(c, n, [&](std::size_t i, const Corner& h, const Corner& d) {
      to[i] = h.x * d.x + h.y * d.y + h.z * d.z;
      hx[i] = h.x;
      hy[i] = h.y;
      hz[i] = h.z;
    });
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double sx = blend(b.x.t[i]), sy = blend(b.y.t[i]), sz = blend(b.z.t[i]);
    const auto blended = [&](const std::array<std::array<double, kBatch>, 8>& v) {
      return lerp(sz, lerp(sy, lerp(sx, v[0][i], v[1][i]), lerp(sx, v[2][i], v[3][i])), lerp(sy, lerp(sx, v[4][i], v[5][i]), lerp(sx, v[6][i], v[7][i])));
    };
    // Derivative of the blend weights: differences of the corners' values along each axis, blended over the other two.
    const double ux = lerp(sz, lerp(sy, dot[1][i] - dot[0][i], dot[3][i] - dot[2][i]), lerp(sy, dot[5][i] - dot[4][i], dot[7][i] - dot[6][i]));
    const double uy = lerp(sz, lerp(sx, dot[2][i] - dot[0][i], dot[3][i] - dot[1][i]), lerp(sx, dot[6][i] - dot[4][i], dot[7][i] - dot[5][i]));
    const double uz = lerp(sy, lerp(sx, dot[4][i] - dot[0][i], dot[5][i] - dot[1][i]), lerp(sx, dot[6][i] - dot[2][i], dot[7][i] - dot[3][i]));
    const double undefined = 0 * (px[i] + py[i] + pz[i]);
    const double v = blended(dot), dx = blended(g[0]) + blend_slope(b.x.t[i]) * ux, dy = blended(g[1]) + blend_slope(b.y.t[i]) * uy,
                 dz = blended(g[2]) + blend_slope(b.z.t[i]) * uz;
    value[i] = v + undefined;
    gx[i] = dx + undefined;
    gy[i] = dy + undefined;
    gz[i] = dz + undefined;
  }
}

// Blend of two enclosures by a weight in [s0, s1]: linear in the weight, so its ends decide.
Interval lerp(double s0, double s1, const Interval& a, const Interval& b) {
  return {std::min(lerp(s0, a.low, b.low), lerp(s1, a.low, b.low)), std::max(lerp(s0, a.high, b.high), lerp(s1, a.high, b.high))};
}

// Over the part of one lattice cell with fractions lo…hi.
Interval cell_range(const Noise& noise, const V3d& cell, const V3d& lo, const V3d& hi) {
  const V3d middle = cell + V3d(0.5, 0.5, 0.5);
  const Batch b(noise, 1, &middle.x, &middle.y, &middle.z);
  std::array<Interval, 8> dot;
  for (int c = 0; c < 8; ++c)
    b.for_corner(c, 1, [&](std::size_t, const Corner& g, const Corner&) {
      const double slope[3] = {g.x, g.y, g.z};
      Interval& to = dot[static_cast<std::size_t>(c)];
      for (int a = 0; a < 3; ++a) {
        const double at = c >> a & 1, p = slope[a] * (lo[a] - at), q = slope[a] * (hi[a] - at);
        to.low += std::min(p, q);
        to.high += std::max(p, q);
      }
    });
  const V3d s0(blend(lo.x), blend(lo.y), blend(lo.z)), s1(blend(hi.x), blend(hi.y), blend(hi.z));
  for (int a = 0, step = 1; a < 3; ++a, step *= 2)
    for (int c = 0; c < 8; c += 2 * step) {
      const auto k = static_cast<std::size_t>(c);
      dot[k] = lerp(s0[a], s1[a], dot[k], dot[k + static_cast<std::size_t>(step)]);
    }
  return dot[0];
}

Noise octave_noise(const Octaves& octaves, int i, double scale) {
  Noise noise;
  noise.seed = mix(octaves.seed + 0x632be5abu * static_cast<std::uint32_t>(i));
  // Periods beyond an integer are none: the lattice repeats at 2³² anyway.
  for (int a = 0; a < 3; ++a) {
    const double period = octaves.period[a] * scale;
    noise.period[a] = period < 0x1p31 ? static_cast<int>(std::lround(period)) : 0;
  }
  return noise;
}

// call(noise, cells a world unit along each axis, amplitude, weight) for each octave; a weight of 0 means that only the mean is left.
template <class Call>
void for_each_octave(const Octaves& octaves, Call&& call) {
  double scale = 1, amplitude = 1;
  const double finest = std::max({octaves.axes.x, octaves.axes.y, octaves.axes.z});
  for (int i = 0; i < std::clamp(octaves.count, 1, kMostOctaves); ++i) {
    const double frequency = octaves.frequency * scale;
    call(octave_noise(octaves, i, scale), octaves.axes * frequency, amplitude, octave_weight(1 / (frequency * finest), octaves.filter));
    scale *= octaves.lacunarity;
    amplitude *= octaves.gain;
  }
}

}  // namespace

void noise_values(const Noise& noise, std::size_t n, const double* x, const double* y, const double* z, double* value) {
  for (std::size_t i = 0; i < n; i += kBatch) batch_values(noise, std::min(kBatch, n - i), x + i, y + i, z + i, value + i);
}

void noise_gradients(const Noise& noise, std::size_t n, const double* x, const double* y, const double* z, double* value, double* gx, double* gy, double* gz) {
  for (std::size_t i = 0; i < n; i += kBatch)
    batch_gradients(noise, std::min(kBatch, n - i), x + i, y + i, z + i, value + i, gx + i, gy + i, gz + i);
}

Interval noise_range(const Noise& noise, const Box3d& box) {
  constexpr double kRounding = 1e-14;
  Interval all{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  V3d first, last;
  double cells = 1;
  for (int a = 0; a < 3; ++a) {
    if (!(box.min[a] <= box.max[a]) || !(std::abs(box.min[a]) < kLargest) || !(std::abs(box.max[a]) < kLargest)) return {-kNoiseBound, kNoiseBound};
    first[a] = std::floor(box.min[a]);
    last[a] = std::floor(box.max[a]);
    cells *= last[a] - first[a] + 1;
  }
  if (cells > 8) return {-kNoiseBound, kNoiseBound};
  for (double z = first.z; z <= last.z; ++z)
    for (double y = first.y; y <= last.y; ++y)
      for (double x = first.x; x <= last.x; ++x) {
        const V3d cell(x, y, z);
        V3d lo, hi;
        for (int a = 0; a < 3; ++a) {
          lo[a] = std::clamp(box.min[a] - cell[a], 0.0, 1.0);
          hi[a] = std::clamp(box.max[a] - cell[a], 0.0, 1.0);
        }
        const Interval part = cell_range(noise, cell, lo, hi);
        all.low = std::min(all.low, part.low);
        all.high = std::max(all.high, part.high);
      }
  return {std::max(all.low - kRounding, -kNoiseBound), std::min(all.high + kRounding, kNoiseBound)};
}

double octave_weight(double cell, double filter) {
  if (!(filter > 0)) return 1;
  const double s = std::clamp(cell / (2 * filter) - 1, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

void octave_values(const Octaves& octaves, std::size_t n, const double* x, const double* y, const double* z, double* value) {
  std::array<double, kBatch> px, py, pz, v, sum;
  for (std::size_t at = 0; at < n; at += kBatch) {
    const std::size_t count = std::min(kBatch, n - at);
    sum.fill(0);
    for_each_octave(octaves, [&](const Noise& noise, const V3d& frequency, double amplitude, double weight) {
      const double share = amplitude * weight, mean = octaves.turbulence ? amplitude * (1 - weight) * kNoiseMeanAbs : 0;
      if (weight > 0) {
        for (std::size_t i = 0; i < count; ++i) { px[i] = x[at + i] * frequency.x; py[i] = y[at + i] * frequency.y; pz[i] = z[at + i] * frequency.z; }
        batch_values(noise, count, px.data(), py.data(), pz.data(), v.data());
        for (std::size_t i = 0; i < count; ++i) sum[i] += share * (octaves.turbulence ? std::abs(v[i]) : v[i]) + mean;
      } else {
        for (std::size_t i = 0; i < count; ++i) sum[i] += mean + 0 * (x[at + i] + y[at + i] + z[at + i]);
      }
    });
    std::copy_n(sum.data(), count, value + at);
  }
}

void octave_gradients(const Octaves& octaves, std::size_t n, const double* x, const double* y, const double* z, double* value, double* gx, double* gy, double* gz) {
  std::array<double, kBatch> px, py, pz, v, vx, vy, vz, sum, sx, sy, sz;
  for (std::size_t at = 0; at < n; at += kBatch) {
    const std::size_t count = std::min(kBatch, n - at);
    for (auto* s : {&sum, &sx, &sy, &sz}) s->fill(0);
    for_each_octave(octaves, [&](const Noise& noise, const V3d& frequency, double amplitude, double weight) {
      const double share = amplitude * weight, mean = octaves.turbulence ? amplitude * (1 - weight) * kNoiseMeanAbs : 0;
      if (!(weight > 0)) {
        for (std::size_t i = 0; i < count; ++i) sum[i] += mean + 0 * (x[at + i] + y[at + i] + z[at + i]);
        return;
      }
      for (std::size_t i = 0; i < count; ++i) { px[i] = x[at + i] * frequency.x; py[i] = y[at + i] * frequency.y; pz[i] = z[at + i] * frequency.z; }
      batch_gradients(noise, count, px.data(), py.data(), pz.data(), v.data(), vx.data(), vy.data(), vz.data());
      for (std::size_t i = 0; i < count; ++i) {
        const double sign = !octaves.turbulence ? 1 : v[i] > 0 ? 1 : v[i] < 0 ? -1 : 0;
        sum[i] += share * (octaves.turbulence ? std::abs(v[i]) : v[i]) + mean;
        sx[i] += share * sign * frequency.x * vx[i];
        sy[i] += share * sign * frequency.y * vy[i];
        sz[i] += share * sign * frequency.z * vz[i];
      }
    });
    std::copy_n(sum.data(), count, value + at);
    std::copy_n(sx.data(), count, gx + at);
    std::copy_n(sy.data(), count, gy + at);
    std::copy_n(sz.data(), count, gz + at);
  }
}

Interval octave_range(const Octaves& octaves, const Box3d& box) {
  Interval sum{0, 0};
  for_each_octave(octaves, [&](const Noise& noise, const V3d& frequency, double amplitude, double weight) {
    const double share = amplitude * weight, mean = octaves.turbulence ? amplitude * (1 - weight) * kNoiseMeanAbs : 0;
    Interval part{0, 0};
    if (weight > 0) part = noise_range(noise, {box.min * frequency, box.max * frequency});
    if (octaves.turbulence) {
      const double low = std::abs(part.low), high = std::abs(part.high);
      part = {part.low > 0 || part.high < 0 ? std::min(low, high) : 0, std::max(low, high)};
    }
    sum.low += std::min(share * part.low, share * part.high) + mean;
    sum.high += std::max(share * part.low, share * part.high) + mean;
  });
  const double rounding = 1e-14 * (1 + std::max(std::abs(sum.low), std::abs(sum.high)));
  return {sum.low - rounding, sum.high + rounding};
}

Octaves fit_octaves(Octaves octaves, const V3d& period) {
  const PeriodFit fit = fit_period(octaves.axes * octaves.frequency, period, "");
  octaves.period = fit.count;
  // Of the first axis with a period the frequency is exact, and so of all where they have one.
  int first = 0;
  while (first < 2 && fit.count[first] == 0) ++first;
  octaves.frequency = fit.frequency[first];
  for (int a = 0; a < 3; ++a) octaves.axes[a] = fit.frequency[a] / octaves.frequency;
  return octaves;
}

double octave_mean(const Octaves& octaves) {
  double mean = 0;
  if (octaves.turbulence) for_each_octave(octaves, [&](const Noise&, const V3d&, double amplitude, double) { mean += amplitude * kNoiseMeanAbs; });
  return mean;
}

}  // namespace texel
