#include "formats/hypertexture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "formats/color_ramp.h"
#include "formats/solid_textures.h"

namespace texel {
namespace {

constexpr std::size_t kBatch = 64;
using Row = std::array<double, kBatch>;

// Defaults chosen by eye on the ball of radius 1 at 128³.
struct Named { const char* name; Hypertexture values; };
const Named kPresets[] = {
    {"fog", {HypertexturePreset::kFog, 1, 1, 0, 1, 0.5, 0.5, 1, 0, nullptr, 0}},
    {"eroded", {HypertexturePreset::kEroded, 1.5, 6, 0.9, 0.06, 0.5, 0.5, 40, 0, nullptr, 0}},
    {"fire", {HypertexturePreset::kFire, 1.7, 6, 1.2, 0.55, 0.4, 0.5, 6, 0, nullptr, 0}},
    {"marble", {HypertexturePreset::kMarble, 2.5, 5, 2, 0.05, 0.5, 0.8, 30, 0, nullptr, 0}},
    {"octaves", {HypertexturePreset::kOctaves, 8, 1, 0, 1, 0.5, 0.5, 1, 0, nullptr, 0}},
    {"fur", {HypertexturePreset::kFur, 18, 2, 0.35, 0.12, 0.5, 0.5, 40, 0, nullptr, 0}},
};

class Ball : public Field {
 public:
  Ball(const V3d& centre, double radius) : centre_(centre), radius_(radius) {}

  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override {
    for (std::size_t i = 0; i < n; ++i) f[i] = radius_ - distance(x[i], y[i], z[i]);
  }
  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    for (std::size_t i = 0; i < n; ++i) {
      const double d = distance(x[i], y[i], z[i]), inverse = d > 0 ? 1 / d : 0;
      const double px = x[i], py = y[i], pz = z[i];
      f[i] = radius_ - d;
      gx[i] = (centre_.x - px) * inverse;
      gy[i] = (centre_.y - py) * inverse;
      gz[i] = (centre_.z - pz) * inverse;
    }
  }
  [[nodiscard]] Interval range(const Box3d& box) const override {
    double near = 0, far = 0;
    for (int a = 0; a < 3; ++a) {
      const double low = box.min[a] - centre_[a], high = box.max[a] - centre_[a];
      const double least = low > 0 ? low : high < 0 ? -high : 0, most = std::max(std::abs(low), std::abs(high));
      near += least * least;
      far += most * most;
    }
    const double rounding = 4 * std::numeric_limits<double>::epsilon() * (radius_ + std::sqrt(far));
    return {radius_ - std::sqrt(far) - rounding, radius_ - std::sqrt(near) + rounding};
  }
  [[nodiscard]] Box3d bounds(double iso) const override {
    const V3d r(std::max(0.0, radius_ - iso));
    return {centre_ - r, centre_ + r};
  }

 private:
  [[nodiscard]] double distance(double x, double y, double z) const {
    const double dx = x - centre_.x, dy = y - centre_.y, dz = z - centre_.z;
    return std::sqrt(dx * dx + dy * dy + dz * dz);
  }
  V3d centre_;
  double radius_;
};

double bias_slope(double t, double b) {
  const double k = 1 / b - 2, d = k * (1 - t) + 1;
  return (1 + k) / (d * d);
}
double gain_slope(double t, double g) { return t < 0.5 ? bias_slope(2 * t, 1 - g) : bias_slope(2 - 2 * t, 1 - g); }

// Soft region: u held to [0, 1], then both curves. NaN stays NaN.
double soft(double u, const Hypertexture& h) {
  if (u >= 1) return 1;
  if (u <= 0) return 0;
  return gain_curve(bias_curve(u, h.bias), h.gain);
}
double soft_slope(double u, const Hypertexture& h) {
  if (!(u > 0 && u < 1)) return 0;
  return gain_slope(bias_curve(u, h.bias), h.gain) * bias_slope(u, h.bias);
}
Interval soft(const Interval& u, const Hypertexture& h) {
  constexpr double kRounding = 1e-12;
  const double low = soft(u.low, h), high = soft(u.high, h);
  return {low > 0 && low < 1 ? std::max(0.0, low - kRounding) : low, high > 0 && high < 1 ? std::min(1.0, high + kRounding) : high};
}

// Height along z counts for less, so that turbulence is drawn out upwards.
constexpr double kUpdraft = 0.4;
V3d drawn(const V3d& p) { return {p.x, p.y, p.z * kUpdraft}; }

constexpr double kRoot = -0.02, kTip = 0.45;  // fur: noise above which there is hair, at the skin and at the ends of the longest
constexpr double kCurl = 0.16;                // fur: how far hairs wander over their length, in hair lengths

// Everything but the noise is elementary; one class for all, so that the chain rule stands in one place.
class Density : public Field {
 public:
  Density(const Hypertexture& h, double filter) : h_(h), base_(h.base ? h.base : make_ball(V3d(0, 0, 0), 1)) {
    octaves_.frequency = h.frequency;
    octaves_.count = h.octaves;
    octaves_.seed = h.seed;
    octaves_.filter = filter;
    octaves_.turbulence = h.preset == HypertexturePreset::kFire || h.preset == HypertexturePreset::kMarble;
    octaves_ = fit_octaves(octaves_, h.preset == HypertexturePreset::kFire ? drawn(h.period) : h.period);
    cells_ = fit_period(V3d(h.frequency), h.period, "");
    detail_ = octave_weight(1 / h.frequency, filter);
    if (h.preset == HypertexturePreset::kMarble) {
      vein_mean_ = 0;
      for (int i = 0; i < 1024; ++i) vein_mean_ += shaped(std::sin(2 * M_PI * (i + 0.5) / 1024)) / 1024;
    }
    if (h.preset == HypertexturePreset::kFur && detail_ < 1) measure_hair();
  }

  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override {
    for (std::size_t i = 0; i < n; i += kBatch) batch(std::min(kBatch, n - i), x + i, y + i, z + i, f + i, nullptr, nullptr, nullptr);
  }
  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    for (std::size_t i = 0; i < n; i += kBatch) batch(std::min(kBatch, n - i), x + i, y + i, z + i, f + i, gx + i, gy + i, gz + i);
  }

  [[nodiscard]] Interval range(const Box3d& box) const override {
    if (h_.preset == HypertexturePreset::kOctaves) return {0.5, 0.5};
    Interval f = base_->range(box);
    if (std::isnan(f.low) || std::isnan(f.high)) return {0, 1};
    f = {f.low - h_.iso, f.high - h_.iso};
    switch (h_.preset) {
      case HypertexturePreset::kFog: return {std::clamp(f.low, 0.0, 1.0), std::clamp(f.high, 0.0, 1.0)};
      case HypertexturePreset::kEroded: return moved(f, octave_range(octaves_, box));
      case HypertexturePreset::kFire: return moved(f, octave_range(octaves_, {drawn(box.min), drawn(box.max)}));
      case HypertexturePreset::kMarble: return {0, soft({f.low / h_.softness, f.high / h_.softness}, h_soft_).high};
      case HypertexturePreset::kOctaves: break;
      case HypertexturePreset::kFur: return {f.low >= h_.amount ? 1.0 : 0.0, f.high <= 0 ? 0.0 : 1.0};
    }
    return {0, 1};
  }

  [[nodiscard]] Box3d bounds(double) const override {
    if (h_.preset == HypertexturePreset::kOctaves) return {V3d(0, 0, 0), V3d(1, 1, 1)};
    double reach = 0;  // how far below the iso value the base can be and still have matter
    if (h_.preset == HypertexturePreset::kEroded) {
      double sum = 0, amplitude = 1;
      for (int i = 0; i < h_.octaves; ++i) { sum += amplitude * kNoiseBound; amplitude *= octaves_.gain; }
      reach = h_.amount * sum;
    }
    if (h_.preset == HypertexturePreset::kFire) reach = h_.amount * 2 * kNoiseBound;
    // D > 0 only where f is above: a base that is 0 far and wide has bounds there only.
    return base_->bounds(std::nextafter(h_.iso - reach, std::numeric_limits<double>::infinity()));
  }

 private:
  [[nodiscard]] Interval moved(const Interval& f, const Interval& noise) const {
    return soft({(f.low + h_.amount * noise.low) / h_.softness, (f.high + h_.amount * noise.high) / h_.softness}, h_);
  }
  [[nodiscard]] double shaped(double sine) const { return gain_curve(bias_curve(0.5 + 0.5 * sine, h_.bias), h_.gain); }

  void batch(std::size_t n, const double* x, const double* y, const double* z, double* d, double* gx, double* gy, double* gz) const {
    switch (h_.preset) {
      case HypertexturePreset::kFog: return fog(n, x, y, z, d, gx, gy, gz);
      case HypertexturePreset::kEroded: return displaced(n, x, y, z, 1, d, gx, gy, gz);
      case HypertexturePreset::kFire: return displaced(n, x, y, z, kUpdraft, d, gx, gy, gz);
      case HypertexturePreset::kMarble: return marble(n, x, y, z, d, gx, gy, gz);
      case HypertexturePreset::kOctaves: {
        std::fill_n(d, n, 0.5);
        for (double* g : {gx, gy, gz})
          if (g) std::fill_n(g, n, 0.0);
        return;
      }
      case HypertexturePreset::kFur: return gx ? fur_gradient(n, x, y, z, d, gx, gy, gz) : fur(n, x, y, z, d);
    }
  }

  void base(std::size_t n, const double* x, const double* y, const double* z, Row& f, Row* g) const {
    if (g) base_->gradients(n, x, y, z, f.data(), g[0].data(), g[1].data(), g[2].data());
    else base_->values(n, x, y, z, f.data());
    for (std::size_t i = 0; i < n; ++i) f[i] -= h_.iso;
  }
  void noise(std::size_t n, const double* x, const double* y, const double* z, Row& v, Row* g) const {
    if (g) octave_gradients(octaves_, n, x, y, z, v.data(), g[0].data(), g[1].data(), g[2].data());
    else octave_values(octaves_, n, x, y, z, v.data());
  }

  void fog(std::size_t n, const double* x, const double* y, const double* z, double* d, double* gx, double* gy, double* gz) const {
    Row f, g[3];
    base(n, x, y, z, f, gx ? g : nullptr);
    for (std::size_t i = 0; i < n; ++i) {
      d[i] = f[i] >= 1 ? 1 : f[i] <= 0 ? 0 : f[i];
      if (!gx) continue;
      const bool within = f[i] > 0 && f[i] < 1;
      gx[i] = within ? g[0][i] : 0;
      gy[i] = within ? g[1][i] : 0;
      gz[i] = within ? g[2][i] : 0;
    }
  }

  // D = soft((f + amount·noise(x, y, up·z)) / softness)
  void displaced(std::size_t n, const double* x, const double* y, const double* z, double up, double* d, double* gx, double* gy, double* gz) const {
    Row f, v, raised, g[3], s[3];
    for (std::size_t i = 0; i < n; ++i) raised[i] = z[i] * up;
    base(n, x, y, z, f, gx ? g : nullptr);
    noise(n, x, y, raised.data(), v, gx ? s : nullptr);
    for (std::size_t i = 0; i < n; ++i) {
      const double u = (f[i] + h_.amount * v[i]) / h_.softness;
      d[i] = soft(u, h_);
      if (!gx) continue;
      const double slope = soft_slope(u, h_) / h_.softness;
      gx[i] = slope * (g[0][i] + h_.amount * s[0][i]);
      gy[i] = slope * (g[1][i] + h_.amount * s[1][i]);
      gz[i] = slope * (g[2][i] + h_.amount * s[2][i] * up);
    }
  }

  // D = soft(f / softness) · curves(½ + ½ sin 2π(frequency·x + amount·turbulence))
  void marble(std::size_t n, const double* x, const double* y, const double* z, double* d, double* gx, double* gy, double* gz) const {
    Row f, v, g[3], s[3];
    base(n, x, y, z, f, gx ? g : nullptr);
    noise(n, x, y, z, v, gx ? s : nullptr);
    for (std::size_t i = 0; i < n; ++i) {
      const double u = f[i] / h_.softness, shape = soft(u, h_soft_);
      const double phase = 2 * M_PI * (cells_.frequency.x * x[i] + h_.amount * v[i]);
      const double sine = std::sin(phase), vein = detail_ * shaped(sine) + (1 - detail_) * vein_mean_;
      d[i] = shape * vein;
      if (!gx) continue;
      const double t = 0.5 + 0.5 * sine;
      const double curve = detail_ * gain_slope(bias_curve(t, h_.bias), h_.gain) * bias_slope(t, h_.bias) * M_PI * std::cos(phase);
      const double along = soft_slope(u, h_soft_) / h_.softness * vein;
      gx[i] = along * g[0][i] + shape * curve * (cells_.frequency.x + h_.amount * s[0][i]);
      gy[i] = along * g[1][i] + shape * curve * h_.amount * s[1][i];
      gz[i] = along * g[2][i] + shape * curve * h_.amount * s[2][i];
    }
  }

  [[nodiscard]] double hair(double noise, double height) const { return soft((noise - (kRoot + (kTip - kRoot) * height)) / h_.softness, h_); }

  void fur(std::size_t n, const double* x, const double* y, const double* z, double* d) const {
    Row f, g[3], q[3], v, curl[3];
    base(n, x, y, z, f, g);
    // Curls: a slow vector of noise, growing with the square of the height, so that hairs stand on their roots.
    Octaves slow;
    slow.frequency = 0.25 * h_.frequency;
    slow.count = std::min(h_.octaves, 3);
    slow = fit_octaves(slow, h_.period);
    for (std::uint32_t a = 0; a < 3; ++a) {
      slow.seed = h_.seed + 101 + a;
      octave_values(slow, n, x, y, z, curl[a].data());
    }
    for (std::size_t i = 0; i < n; ++i) {
      const double square = g[0][i] * g[0][i] + g[1][i] * g[1][i] + g[2][i] * g[2][i];
      // Down along the gradient to the skin, f = amount, by one step of Newton's: exact where f is a distance.
      const double step = square > 0 ? (h_.amount - f[i]) / square : 0;
      const double height = std::clamp(1 - f[i] / h_.amount, 0.0, 1.0);
      const double wander = square > 0 ? kCurl * h_.amount / std::sqrt(square) * height * height / std::sqrt(kNoiseVariance) : 0;
      q[0][i] = x[i] + step * g[0][i] + wander * curl[0][i];
      q[1][i] = y[i] + step * g[1][i] + wander * curl[1][i];
      q[2][i] = z[i] + step * g[2][i] + wander * curl[2][i];
    }
    for (int a = 0; a < 3; ++a)
      for (std::size_t i = 0; i < n; ++i) q[a][i] *= cells_.frequency[a];
    noise_values({h_.seed, cells_.count}, n, q[0].data(), q[1].data(), q[2].data(), v.data());
    for (std::size_t i = 0; i < n; ++i) {
      if (std::isnan(f[i])) { d[i] = f[i]; continue; }
      if (!(f[i] > 0) || f[i] >= h_.amount) { d[i] = f[i] >= h_.amount ? 1 : 0; continue; }
      const double height = 1 - f[i] / h_.amount;
      const double one = std::isfinite(v[i]) ? hair(v[i], height) : 0;
      d[i] = detail_ < 1 ? detail_ * one + (1 - detail_) * mean_hair(height) : one;
    }
  }

  void fur_gradient(std::size_t n, const double* x, const double* y, const double* z, double* d, double* gx, double* gy, double* gz) const {
    fur(n, x, y, z, d);
    const double step = 1e-4 / h_.frequency;
    const double* at[3] = {x, y, z};
    double* to[3] = {gx, gy, gz};
    Row moved, low, high;
    std::array<Row, 3> result;
    for (std::size_t a = 0; a < 3; ++a) {
      const double* p[3] = {x, y, z};
      p[a] = moved.data();
      for (std::size_t i = 0; i < n; ++i) moved[i] = at[a][i] - step;
      fur(n, p[0], p[1], p[2], low.data());
      for (std::size_t i = 0; i < n; ++i) moved[i] = at[a][i] + step;
      fur(n, p[0], p[1], p[2], high.data());
      for (std::size_t i = 0; i < n; ++i) result[a][i] = (high[i] - low[i]) / (2 * step);
    }
    for (std::size_t a = 0; a < 3; ++a) std::copy_n(result[a].data(), n, to[a]);
  }

  // Mean of hair() over the noise's values, by height: what fur too fine for the filter looks like.
  void measure_hair() {
    constexpr std::size_t kCount = 4096;
    std::vector<double> x(kCount), y(kCount), z(kCount), v(kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
      const auto k = static_cast<double>(i);
      x[i] = k * 1.618033988749895;  // a rank-1 sequence through many cells
      y[i] = k * 1.324717957244746;
      z[i] = k * 1.220744084605760;
    }
    noise_values({h_.seed, {0, 0, 0}}, kCount, x.data(), y.data(), z.data(), v.data());
    hair_.resize(65, 0);
    for (std::size_t t = 0; t < hair_.size(); ++t)
      for (const double noise : v) hair_[t] += hair(noise, static_cast<double>(t) / 64) / kCount;
  }
  [[nodiscard]] double mean_hair(double height) const {
    const double at = std::clamp(height, 0.0, 1.0) * 64;
    const auto t = static_cast<std::size_t>(std::min(at, 63.0));
    return hair_[t] + (hair_[t + 1] - hair_[t]) * (at - static_cast<double>(t));
  }

  Hypertexture h_, h_soft_{};             // h_soft_: the soft region without curves
  std::shared_ptr<const Field> base_;
  Octaves octaves_;
  PeriodFit cells_;                       // of the frequency itself
  double detail_ = 1, vein_mean_ = 0.5;
  std::vector<double> hair_;
};

class PresetColor : public SolidTexture {
 public:
  explicit PresetColor(const Hypertexture& h)
      : h_(h), base_(h.base ? h.base : make_ball(V3d(0, 0, 0), 1)), source_(make_octave_source(std::max(1, static_cast<int>(std::lround(h.frequency))), h.seed)) {
    if (const auto fitted = source_->with_period(h.period, nullptr)) source_ = fitted;
  }

  void colors(std::size_t n, const double* x, const double* y, const double* z, const V3d*, double width, V3f* color) const override {
    if (h_.copies.shifts.empty()) return colors_of_one(n, x, y, z, width, color);
    // Those of the copy the point is deepest in, at the point's place in that copy.
    Row px, py, pz, qx, qy, qz, f, best;
    for (std::size_t at = 0; at < n; at += kBatch) {
      const std::size_t count = std::min(kBatch, n - at);
      best.fill(-std::numeric_limits<double>::infinity());
      std::copy_n(x + at, count, px.begin());
      std::copy_n(y + at, count, py.begin());
      std::copy_n(z + at, count, pz.begin());
      for (const V3d& shift : h_.copies.shifts) {
        for (std::size_t i = 0; i < count; ++i) { qx[i] = x[at + i] - shift.x; qy[i] = y[at + i] - shift.y; qz[i] = z[at + i] - shift.z; }
        base_->values(count, qx.data(), qy.data(), qz.data(), f.data());
        for (std::size_t i = 0; i < count; ++i) {
          if (!(f[i] > best[i])) continue;
          best[i] = f[i];
          px[i] = qx[i];
          py[i] = qy[i];
          pz[i] = qz[i];
        }
      }
      colors_of_one(count, px.data(), py.data(), pz.data(), width, color + at);
    }
  }

 private:
  void colors_of_one(std::size_t n, const double* x, const double* y, const double* z, double width, V3f* color) const {
    Row f, v, raised, g[3], q[3];
    for (std::size_t at = 0; at < n; at += kBatch) {
      const std::size_t count = std::min(kBatch, n - at);
      const double *px = x + at, *py = y + at, *pz = z + at;
      V3f* to = color + at;
      Octaves octaves{.frequency = h_.frequency, .count = h_.octaves, .seed = h_.seed, .filter = width};
      switch (h_.preset) {
        case HypertexturePreset::kFog: std::fill_n(to, count, V3f(0.8f)); break;
        case HypertexturePreset::kOctaves: source_->colors(count, px, py, pz, nullptr, width, to); break;
        case HypertexturePreset::kEroded: {
          static constexpr ColorStop kStone[] = {{0, {0.12f, 0.085f, 0.06f}}, {0.45, {0.30f, 0.22f, 0.15f}}, {0.7, {0.45f, 0.36f, 0.26f}}, {1, {0.62f, 0.55f, 0.45f}}};
          octaves.frequency *= 2;
          octaves.seed += 7;
          octave_values(fit_octaves(octaves, h_.period), count, px, py, pz, v.data());
          for (std::size_t i = 0; i < count; ++i) to[i] = color_ramp(kStone, 0.5 + v[i]);
          break;
        }
        case HypertexturePreset::kFire: {
          // By how deep in the soft region: dark red smoke at the rim, white in the middle.
          static constexpr ColorStop kHeat[] = {{0, {0.25f, 0.01f, 0.0f}}, {0.35, {0.8f, 0.08f, 0.005f}}, {0.7, {1.0f, 0.32f, 0.02f}}, {1.3, {1.0f, 0.72f, 0.18f}}, {2.2, {1.0f, 0.95f, 0.7f}}};
          octaves.turbulence = true;
          base_->values(count, px, py, pz, f.data());
          for (std::size_t i = 0; i < count; ++i) raised[i] = pz[i] * kUpdraft;
          octave_values(fit_octaves(octaves, drawn(h_.period)), count, px, py, raised.data(), v.data());
          for (std::size_t i = 0; i < count; ++i) to[i] = color_ramp(kHeat, (f[i] - h_.iso + h_.amount * v[i]) / h_.softness);
          break;
        }
        case HypertexturePreset::kMarble: {
          static constexpr ColorStop kVeins[] = {{0, {0.08f, 0.09f, 0.12f}}, {0.35, {0.35f, 0.36f, 0.38f}}, {0.7, {0.78f, 0.77f, 0.74f}}, {1, {0.88f, 0.87f, 0.84f}}};
          octaves.turbulence = true;
          octave_values(fit_octaves(octaves, h_.period), count, px, py, pz, v.data());
          const double detail = octave_weight(1 / h_.frequency, width), veins = fit_period(V3d(h_.frequency), h_.period, "").frequency.x;
          for (std::size_t i = 0; i < count; ++i)
            to[i] = color_ramp(kVeins, 0.5 + 0.5 * detail * std::sin(2 * M_PI * (veins * px[i] + h_.amount * v[i])));
          break;
        }
        case HypertexturePreset::kFur: {
          static constexpr ColorStop kCoat[] = {{0, {0.10f, 0.045f, 0.02f}}, {0.5, {0.33f, 0.17f, 0.075f}}, {1, {0.62f, 0.42f, 0.22f}}};
          base_->gradients(count, px, py, pz, f.data(), g[0].data(), g[1].data(), g[2].data());
          for (std::size_t i = 0; i < count; ++i) {
            f[i] -= h_.iso;
            const double square = g[0][i] * g[0][i] + g[1][i] * g[1][i] + g[2][i] * g[2][i], step = square > 0 ? (h_.amount - f[i]) / square : 0;
            q[0][i] = px[i] + step * g[0][i];
            q[1][i] = py[i] + step * g[1][i];
            q[2][i] = pz[i] + step * g[2][i];
          }
          octaves = {.frequency = h_.frequency / 8, .count = 4, .seed = h_.seed + 55, .filter = width};
          octave_values(fit_octaves(octaves, h_.period), count, q[0].data(), q[1].data(), q[2].data(), v.data());
          for (std::size_t i = 0; i < count; ++i) to[i] = color_ramp(kCoat, 0.25 + 0.5 * std::clamp(1 - f[i] / h_.amount, 0.0, 1.0) + 0.8 * v[i]);
          break;
        }
      }
    }
  }

  Hypertexture h_;
  std::shared_ptr<const Field> base_;
  std::shared_ptr<const SolidTexture> source_;
};

}  // namespace

double bias_curve(double t, double bias) { return t / ((1 / bias - 2) * (1 - t) + 1); }

double gain_curve(double t, double gain) { return t < 0.5 ? bias_curve(2 * t, 1 - gain) / 2 : 1 - bias_curve(2 - 2 * t, 1 - gain) / 2; }

bool find_hypertexture(std::string_view name, Hypertexture* out) {
  for (const Named& preset : kPresets)
    if (name == preset.name) {
      *out = preset.values;
      return true;
    }
  return false;
}

const char* hypertexture_name(HypertexturePreset preset) {
  for (const Named& named : kPresets)
    if (named.values.preset == preset) return named.name;
  return "";
}

PeriodFit hypertexture_fit(const Hypertexture& h) {
  if (h.preset == HypertexturePreset::kFog) return {};
  const char* what = h.preset == HypertexturePreset::kMarble ? "veins or lattice cells" : h.preset == HypertexturePreset::kFur ? "hairs" : "lattice cells";
  if (h.preset == HypertexturePreset::kOctaves) return fit_period(V3d(std::max(1.0, std::nearbyint(h.frequency))), h.period, what);
  return fit_period(V3d(h.frequency), h.preset == HypertexturePreset::kFire ? drawn(h.period) : h.period, what);
}

std::shared_ptr<const Field> make_density(const Hypertexture& hypertexture, double filter) {
  return repeat_field(std::make_shared<Density>(hypertexture, filter), hypertexture.copies);
}

std::shared_ptr<const SolidTexture> hypertexture_color(const Hypertexture& hypertexture) { return std::make_shared<PresetColor>(hypertexture); }

float hypertexture_glow(const Hypertexture& hypertexture) { return hypertexture.preset == HypertexturePreset::kFire ? 0.8f : 0.0f; }

std::shared_ptr<const Field> make_ball(const V3d& centre, double radius) { return std::make_shared<Ball>(centre, radius); }

}  // namespace texel
