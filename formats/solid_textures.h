#pragma once
// Solid textures: of noise (marble, wood, granite), of tileable pictures on three planes, and the self-zoomable cube of octaves.
#include <array>
#include <memory>
#include <string_view>

#include "formats/image.h"
#include "formats/solid_texture.h"

namespace texel {

enum class SolidKind { kMarble, kWood, kGranite };

// false: no such name. Names: marble, wood, granite.
[[nodiscard]] bool find_solid_texture(std::string_view name, SolidKind* out);

// `size`: world length of a vein (marble), ten rings (wood), ten grains (granite). Formulas and colours: docs/inputs.md.
// Detail finer than two widths fades to its mean.
[[nodiscard]] std::shared_ptr<const SolidTexture> make_solid_texture(SolidKind kind, double size, std::uint32_t seed);

// How three planes become one colour.
//   kNormal  each plane weighs n_k⁴, n the surface's normal: sharp where it faces an axis. Without a normal: as kSum
//   kSum     mean + Σ(colour_k − mean)/√3, clamped to [0, 1]: every plane everywhere; the sum of independent pictures keeps their contrast
enum class PlaneBlend { kNormal, kSum };

// Pictures (linear colour, as read_image gives them; alpha is left out) seen along x (picture axes y, z), y (x, z) and z (x, y), the lowest row at the
// lower coordinate, repeating every `size` world units of the picture's width; a picture that is not square keeps its shape. Filtered by mip maps.
[[nodiscard]] std::shared_ptr<const SolidTexture> make_plane_texture(std::array<std::shared_ptr<const Image>, 3> pictures, double size, PlaneBlend blend);

// How well a picture tiles: mean difference of brightness (linear) across its wrapped border over that between neighbours inside, along x and y.
// About 1: tiles. Above kSeam it shows. 1 for a picture of one colour.
struct WrapStep { double x = 1, y = 1; };
inline constexpr double kSeam = 3;
[[nodiscard]] WrapStep wrap_step(const Image& picture);

// Weights of the four octaves at place s in [0, 1] of the zoom cycle (after Bénard, Bousseau & Thollot 2009): s/2, 1/2 − s/6, 1/3 − s/6,
// 1/6 − s/6. Their sum is 1; the end, shifted by one, is the next cycle's start, exactly: (1/2, 1/3, 1/6, 0), (0, 1/2, 1/3, 1/6).
inline constexpr int kZoomOctaves = 4;
[[nodiscard]] std::array<double, kZoomOctaves> zoom_weights(double s);

// The sum seen at distance `z` > 0 where the source volume's coordinate at distance 1 is p: octave i reads 2^i·p·z/2^floor(log2 z).
// `source(p)`: the volume, periodic; any value type with + and * double.
template <class Source>
[[nodiscard]] double zoom_value(const Source& source, const V3d& p, double z);

// The source volume: one octave of noise of `cells` lattice cells, repeating every world unit on all three axes; grey, in (0, 1), of mean 1/2.
[[nodiscard]] std::shared_ptr<const SolidTexture> make_octave_source(int cells, std::uint32_t seed);

}  // namespace texel

#include <cmath>

namespace texel {

template <class Source>
double zoom_value(const Source& source, const V3d& p, double z) {
  const double cycle = std::floor(std::log2(z)), scale = z / std::exp2(cycle);
  const std::array<double, kZoomOctaves> weights = zoom_weights(std::log2(scale));
  double sum = 0;
  for (int i = 0; i < kZoomOctaves; ++i) sum += weights[static_cast<std::size_t>(i)] * source(p * (scale * static_cast<double>(1 << i)));
  return sum;
}

}  // namespace texel
