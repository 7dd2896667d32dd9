#include "formats/solid_textures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <vector>

#include "formats/color_ramp.h"
#include "formats/noise.h"
#include "formats/period_fit.h"

namespace texel {
namespace {

constexpr std::size_t kBatch = 64;
using Row = std::array<double, kBatch>;

constexpr ColorStop kMarble[] = {{0, {0.05f, 0.06f, 0.09f}}, {0.25, {0.28f, 0.29f, 0.32f}}, {0.55, {0.72f, 0.71f, 0.69f}}, {1, {0.88f, 0.87f, 0.84f}}};
constexpr ColorStop kWood[] = {{0, {0.42f, 0.23f, 0.10f}}, {0.6, {0.33f, 0.16f, 0.065f}}, {0.9, {0.16f, 0.07f, 0.028f}}, {1, {0.40f, 0.22f, 0.095f}}};
constexpr ColorStop kGranite[] = {{0, {0.025f, 0.025f, 0.03f}}, {0.3, {0.10f, 0.09f, 0.09f}}, {0.42, {0.42f, 0.36f, 0.33f}}, {0.6, {0.55f, 0.47f, 0.43f}}, {0.75, {0.75f, 0.73f, 0.71f}}, {1, {0.85f, 0.84f, 0.82f}}};

const V3d kVeins(1, 0.5, 0);      // marble: veins a size along each axis
const V3d kFibre(40, 40, 2);      // wood: fibres, how much finer than the rings' wobble

class NoiseTexture : public SolidTexture {
 public:
  NoiseTexture(SolidKind kind, double size, std::uint32_t seed, const V3d& period = {0, 0, 0}) : kind_(kind), size_(size), frequency_(1 / size), seed_(seed), period_(period) {
    if (kind == SolidKind::kMarble) noise_ = {.frequency = frequency_, .count = 6, .turbulence = true, .seed = seed};
    if (kind == SolidKind::kWood) noise_ = {.frequency = frequency_, .count = 3, .seed = seed};
    if (kind == SolidKind::kGranite) noise_ = {.frequency = 10 * frequency_, .count = 3, .gain = 0.7, .seed = seed};
    noise_ = fit_octaves(noise_, period);
    fibres_ = fit_octaves({.frequency = frequency_, .count = 2, .seed = seed + 31}, kFibre * period);
    veins_ = vein_fit().frequency / (kVeins * frequency_);
    for (int i = 0; i < 512; ++i) {
      vein_mean_ += color_ramp(kMarble, vein(std::sin(2 * M_PI * (i + 0.5) / 512))) / 512.0f;
      ring_mean_ += color_ramp(kWood, (i + 0.5) / 512) / 512.0f;
    }
  }

  [[nodiscard]] std::shared_ptr<const SolidTexture> with_period(const V3d& period, std::string* changed) const override {
    auto made = std::make_shared<NoiseTexture>(kind_, size_, seed_, period);
    if (!changed) return made;
    const double cells = kind_ == SolidKind::kGranite ? 10 * frequency_ : frequency_;
    *changed = kind_ == SolidKind::kMarble ? made->vein_fit().changed : "";
    const auto add = [&](const std::string& text) { *changed += (changed->empty() || text.empty() ? "" : "; ") + text; };
    if (kind_ == SolidKind::kWood && (period.x > 0 || period.y > 0)) add("rings about one line a period");
    add(fit_period(V3d(cells), period, kind_ == SolidKind::kGranite ? "grains" : "lattice cells").changed);
    return made;
  }

  void colors(std::size_t n, const double* x, const double* y, const double* z, const V3d*, double width, V3f* color) const override {
    Row v, w;
    for (std::size_t at = 0; at < n; at += kBatch) {
      const std::size_t count = std::min(kBatch, n - at);
      const double *px = x + at, *py = y + at, *pz = z + at;
      V3f* to = color + at;
      if (kind_ == SolidKind::kMarble) {
        // Veins across x + y/2, bent by turbulence.
        octave_values(seen(noise_, width), count, px, py, pz, v.data());
        const auto detail = static_cast<float>(octave_weight(1 / frequency_, width));
        for (std::size_t i = 0; i < count; ++i) {
          const double phase = 2 * M_PI * (frequency_ * (veins_.x * px[i] + veins_.y * (0.5 * py[i])) + 2 * v[i]);
          to[i] = std::isfinite(phase) ? color_ramp(kMarble, vein(std::sin(phase))) * detail + vein_mean_ * (1 - detail) : vein_mean_;
        }
      } else if (kind_ == SolidKind::kWood) {
        // Rings about the z axis, ten to `size`, wobbling, with fibres along z.
        octave_values(seen(noise_, width), count, px, py, pz, v.data());
        Row fx, fy, fz;
        for (std::size_t i = 0; i < count; ++i) { fx[i] = px[i] * kFibre.x; fy[i] = py[i] * kFibre.y; fz[i] = pz[i] * kFibre.z; }
        octave_values(seen(fibres_, 40 * width), count, fx.data(), fy.data(), fz.data(), w.data());
        const auto detail = static_cast<float>(octave_weight(0.1 / frequency_, width));
        for (std::size_t i = 0; i < count; ++i) {
          const double ax = from_axis(px[i], period_.x), ay = from_axis(py[i], period_.y);
          const double rings = 10 * frequency_ * std::sqrt(ax * ax + ay * ay) + 1.5 * v[i];
          const V3f ring = std::isfinite(rings) ? color_ramp(kWood, rings - std::floor(rings)) * detail + ring_mean_ * (1 - detail) : ring_mean_;
          to[i] = ring * static_cast<float>(std::isfinite(w[i]) ? 1 + 0.5 * w[i] : 1);
        }
      } else {
        // Grains of two sizes, ten of the larger to `size`.
        octave_values(seen(noise_, width), count, px, py, pz, v.data());
        for (std::size_t i = 0; i < count; ++i) to[i] = color_ramp(kGranite, 0.5 + 0.85 * v[i]);
      }
    }
  }

 private:
  // Narrow dark veins in light stone.
  static double vein(double sine) { return 1 - std::pow(0.5 + 0.5 * sine, 3); }

  static Octaves seen(Octaves octaves, double width) {
    octaves.filter = width;
    return octaves;
  }
  // Along an axis with a period rings lie about one line a period, and join half way.
  static double from_axis(double x, double period) { return period > 0 ? period / M_PI * std::sin(M_PI / period * x) : x; }
  [[nodiscard]] PeriodFit vein_fit() const { return fit_period(kVeins * frequency_, {period_.x, period_.y, 0}, "veins"); }

  SolidKind kind_;
  double size_, frequency_;
  std::uint32_t seed_;
  V3d period_;
  Octaves noise_, fibres_;
  V3d veins_{1, 1, 1};
  V3f vein_mean_{0, 0, 0}, ring_mean_{0, 0, 0};
};

// One level of a wrapped mip chain, row 0 lowest.
struct Level {
  int width = 0, height = 0;
  std::vector<V3f> texels;
  [[nodiscard]] const V3f& at(int x, int y) const { return texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)]; }
};

struct Chain {
  std::vector<Level> levels;
  V3f mean{0, 0, 0};
};

V3f pixel_color(const Image& picture, int x, int y) {
  const float* p = picture.at(x, y);
  V3f c = picture.channels >= 3 ? V3f(p[0], p[1], p[2]) : V3f(p[0]);
  for (int k = 0; k < 3; ++k) c[k] = std::isfinite(c[k]) ? std::clamp(c[k], 0.0f, 1.0f) : 0.0f;
  return c;
}

Chain make_chain(const Image& picture) {
  Chain chain;
  Level level{picture.width, picture.height, {}};
  for (int y = picture.height - 1; y >= 0; --y)
    for (int x = 0; x < picture.width; ++x) level.texels.push_back(pixel_color(picture, x, y));
  V3d sum(0, 0, 0);
  for (const V3f& c : level.texels) sum += V3d(c);
  chain.mean = V3f(sum / static_cast<double>(level.texels.size()));
  chain.levels.push_back(std::move(level));
  while (chain.levels.back().width > 1 || chain.levels.back().height > 1) {
    const Level& fine = chain.levels.back();
    Level half{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
    // Box of the area under each texel, whatever the parity: shares of up to three source texels each way.
    for (int y = 0; y < half.height; ++y)
      for (int x = 0; x < half.width; ++x) {
        const double sx = static_cast<double>(fine.width) / half.width, sy = static_cast<double>(fine.height) / half.height;
        V3d total(0, 0, 0);
        for (int j = static_cast<int>(y * sy); j < std::min(fine.height, static_cast<int>(std::ceil((y + 1) * sy - 1e-9))); ++j)
          for (int i = static_cast<int>(x * sx); i < std::min(fine.width, static_cast<int>(std::ceil((x + 1) * sx - 1e-9))); ++i) {
            const double wx = std::min(i + 1.0, (x + 1) * sx) - std::max(static_cast<double>(i), x * sx), wy = std::min(j + 1.0, (y + 1) * sy) - std::max(static_cast<double>(j), y * sy);
            total += V3d(fine.at(i, j)) * (wx * wy / (sx * sy));
          }
        half.texels.push_back(V3f(total));
      }
    chain.levels.push_back(std::move(half));
  }
  return chain;
}

V3f bilinear(const Level& level, double u, double v) {
  const double x = (u - std::floor(u)) * level.width - 0.5, y = (v - std::floor(v)) * level.height - 0.5;
  const double fx0 = std::floor(x), fy0 = std::floor(y);
  const auto fx = static_cast<float>(x - fx0), fy = static_cast<float>(y - fy0);
  const auto wrap = [](int i, int n) { return i < 0 ? i + n : i >= n ? i - n : i; };
  const int x0 = wrap(static_cast<int>(fx0), level.width), y0 = wrap(static_cast<int>(fy0), level.height);
  const int x1 = wrap(x0 + 1, level.width), y1 = wrap(y0 + 1, level.height);
  return (level.at(x0, y0) * (1 - fx) + level.at(x1, y0) * fx) * (1 - fy) + (level.at(x0, y1) * (1 - fx) + level.at(x1, y1) * fx) * fy;
}

// Trilinear: the two levels whose texels are next to the footprint's width.
V3f sample(const Chain& chain, double u, double v, double width) {
  if (!std::isfinite(u) || !std::isfinite(v)) return chain.mean;
  const double texels = width * chain.levels.front().width;
  const double level = texels > 1 ? std::min(std::log2(texels), static_cast<double>(chain.levels.size() - 1)) : 0;
  const auto below = static_cast<std::size_t>(level);
  const auto t = static_cast<float>(level - static_cast<double>(below));
  const V3f fine = bilinear(chain.levels[below], u, v);
  return t > 0 ? fine * (1 - t) + bilinear(chain.levels[below + 1], u, v) * t : fine;
}

class PlaneTexture : public SolidTexture {
 public:
  PlaneTexture(const std::array<std::shared_ptr<const Image>, 3>& pictures, double size, PlaneBlend blend) : blend_(blend) {
    size_.fill({size, size});
    std::map<const Image*, std::shared_ptr<const Chain>> made;  // one picture may stand on several planes
    for (std::size_t k = 0; k < 3; ++k) {
      auto& chain = made[pictures[k].get()];
      if (!chain) chain = std::make_shared<const Chain>(make_chain(*pictures[k]));
      chains_[k] = chain;
      mean_ += chain->mean / 3.0f;
    }
  }

  [[nodiscard]] std::shared_ptr<const SolidTexture> with_period(const V3d& period, std::string* changed) const override {
    auto made = std::make_shared<PlaneTexture>(*this);
    std::string said;
    for (std::size_t k = 0; k < 3; ++k) {
      const int u = across(k), v = up(k);
      V3d frequency(0, 0, 0), length = period;
      length[static_cast<int>(k)] = 0;
      frequency[u] = 1 / size_[k].x;
      frequency[v] = shape(k) / size_[k].y;
      const PeriodFit fit = fit_period(frequency, length, "pictures");
      if (fit.count[u] > 0) made->size_[k].x = period[u] / fit.count[u];
      if (fit.count[v] > 0) made->size_[k].y = period[v] / fit.count[v] * shape(k);
      if (!fit.changed.empty() && said.find(fit.changed) == std::string::npos) said += (said.empty() ? "" : "; ") + fit.changed;
    }
    if (changed) *changed = said;
    return made;
  }

  void colors(std::size_t n, const double* x, const double* y, const double* z, const V3d* normal, double width, V3f* color) const override {
    for (std::size_t i = 0; i < n; ++i) {
      const double p[3] = {x[i], y[i], z[i]};
      V3f seen[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const Chain& chain = *chains_[k];
        const double u = p[across(k)] / size_[k].x, v = p[up(k)] / size_[k].y;
        seen[k] = sample(chain, u, v * shape(k), width / std::min(size_[k].x, size_[k].y));
      }
      double weight[3] = {0, 0, 0}, total = 0;
      if (blend_ == PlaneBlend::kNormal && normal)
        for (int k = 0; k < 3; ++k) total += weight[k] = std::pow(normal[i][k], 4);
      if (total > 0) {
        color[i] = V3f(0, 0, 0);
        for (int k = 0; k < 3; ++k) color[i] += seen[k] * static_cast<float>(weight[k] / total);
        continue;
      }
      const auto share = static_cast<float>(1 / std::sqrt(3.0));
      V3f sum = mean_;
      for (std::size_t k = 0; k < 3; ++k) sum += (seen[k] - chains_[k]->mean) * share;
      for (int c = 0; c < 3; ++c) color[i][c] = std::clamp(sum[c], 0.0f, 1.0f);
    }
  }

 private:
  std::array<std::shared_ptr<const Chain>, 3> chains_;
  static int across(std::size_t k) { return k == 0 ? 1 : 0; }
  static int up(std::size_t k) { return k == 2 ? 1 : 2; }
  [[nodiscard]] double shape(std::size_t k) const { return static_cast<double>(chains_[k]->levels.front().width) / chains_[k]->levels.front().height; }

  V3f mean_{0, 0, 0};
  std::array<Imath::V2d, 3> size_;  // world, of the picture's width on each plane; y: of the width again, as the height would have it
  PlaneBlend blend_;
};

class OctaveSource : public SolidTexture {
 public:
  OctaveSource(int cells, std::uint32_t seed) : cells_(cells), frequency_(cells), noise_{seed, V3i(cells, cells, cells)} {}

  // It repeats every unit: only other periods than whole numbers of them need another lattice.
  [[nodiscard]] std::shared_ptr<const SolidTexture> with_period(const V3d& period, std::string* changed) const override {
    auto made = std::make_shared<OctaveSource>(*this);
    V3d needed = period;
    for (int a = 0; a < 3; ++a)
      if (period[a] >= 0.5 && std::abs(period[a] - std::nearbyint(period[a])) <= kSamePeriod * period[a]) needed[a] = 0;
    const PeriodFit fit = fit_period(V3d(cells_), needed, "lattice cells");
    for (int a = 0; a < 3; ++a) {
      if (fit.count[a] == 0) continue;
      made->frequency_[a] = fit.frequency[a];
      made->noise_.period[a] = fit.count[a];
    }
    if (changed) *changed = fit.changed;
    return made;
  }

  void colors(std::size_t n, const double* x, const double* y, const double* z, const V3d*, double width, V3f* color) const override {
    Row px, py, pz, v;
    const double share = octave_weight(1.0 / cells_, width) * 0.5 / kNoiseBound;
    for (std::size_t at = 0; at < n; at += kBatch) {
      const std::size_t count = std::min(kBatch, n - at);
      for (std::size_t i = 0; i < count; ++i) { px[i] = x[at + i] * frequency_.x; py[i] = y[at + i] * frequency_.y; pz[i] = z[at + i] * frequency_.z; }
      noise_values(noise_, count, px.data(), py.data(), pz.data(), v.data());
      for (std::size_t i = 0; i < count; ++i) color[at + i] = V3f(static_cast<float>(std::isfinite(v[i]) ? 0.5 + share * v[i] : 0.5));
    }
  }

 private:
  int cells_;
  V3d frequency_;
  Noise noise_;
};

}  // namespace

bool find_solid_texture(std::string_view name, SolidKind* out) {
  if (name == "marble") *out = SolidKind::kMarble;
  else if (name == "wood") *out = SolidKind::kWood;
  else if (name == "granite") *out = SolidKind::kGranite;
  else return false;
  return true;
}

std::shared_ptr<const SolidTexture> make_solid_texture(SolidKind kind, double size, std::uint32_t seed) { return std::make_shared<NoiseTexture>(kind, size, seed); }

std::shared_ptr<const SolidTexture> make_plane_texture(std::array<std::shared_ptr<const Image>, 3> pictures, double size, PlaneBlend blend) {
  return std::make_shared<PlaneTexture>(pictures, size, blend);
}

WrapStep wrap_step(const Image& picture) {
  const auto brightness = [&](int x, int y) { return static_cast<double>(pixel_color(picture, x, y).dot(V3f(0.2126f, 0.7152f, 0.0722f))); };
  double inner[2] = {0, 0}, border[2] = {0, 0};
  const int w = picture.width, h = picture.height;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x + 1 < w; ++x) inner[0] += std::abs(brightness(x + 1, y) - brightness(x, y)) / std::max(1, w - 1);
    border[0] += std::abs(brightness(w - 1, y) - brightness(0, y));
  }
  for (int x = 0; x < w; ++x) {
    for (int y = 0; y + 1 < h; ++y) inner[1] += std::abs(brightness(x, y + 1) - brightness(x, y)) / std::max(1, h - 1);
    border[1] += std::abs(brightness(x, h - 1) - brightness(x, 0));
  }
  const auto ratio = [&](int k) { return inner[k] > 0 ? border[k] / inner[k] : border[k] > 0 ? 1e9 : 1.0; };
  return {ratio(0), ratio(1)};
}

std::array<double, kZoomOctaves> zoom_weights(double s) {
  // (a − s)/b rather than a/b − s/b: exact where both ends of a cycle meet.
  return {s / 2, (3 - s) / 6, (2 - s) / 6, (1 - s) / 6};
}

std::shared_ptr<const SolidTexture> make_octave_source(int cells, std::uint32_t seed) { return std::make_shared<OctaveSource>(cells, seed); }

}  // namespace texel
