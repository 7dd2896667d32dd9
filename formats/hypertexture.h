#pragma once
// Hypertextures (Perlin & Hoffert 1989): a shape's soft region modulated by noise into a density D in [0, 1], as a Field.
#include <memory>
#include <string>
#include <string_view>

#include "formats/field.h"
#include "formats/noise.h"
#include "formats/period_fit.h"
#include "formats/repeated_field.h"
#include "formats/solid_texture.h"

namespace texel {

// What D is made of. f is the base shape's height inside: its function less its iso value, > 0 inside. All formulas: docs/inputs.md.
enum class HypertexturePreset {
  kFog,     // D = f itself, held to [0, 1]: densities that come ready made (fog volumes, expressions)
  kEroded,  // the shape's soft surface moved in and out by a sum of octaves
  kFire,    // moved outwards by turbulence drawn out upwards (+z), in a wide soft region
  kMarble,  // veins across x bent by turbulence, within the soft shape
  kOctaves, // D = ½ in the unit cube at the origin, coloured by the source volume of a self-zoomable sum (formats/solid_textures.h)
  kFur,     // hairs: noise of the surface's points carried along the normal, thinning to the tips, on a solid skin
};

struct Hypertexture {
  HypertexturePreset preset = HypertexturePreset::kEroded;
  double frequency = 2;        // lattice cells (fur: hairs; marble: veins) a world unit; > 0
  int octaves = 6;             // 1…kMostOctaves
  double amount = 0.3;         // how far noise moves the surface, in units of f; marble: veins' bending, in veins; fur: hair length, in units of f
  double softness = 0.05;      // width of the soft region in units of f; fur: of a hair's side, in units of noise; > 0
  double bias = 0.5, gain = 0.5;  // Schlick's curves over the soft region, each in (0, 1); ½ changes nothing
  double scale = 1;            // c, world units⁻¹: opacity over a step is 1 − (1 − D)^(c·Δt); > 0
  std::uint32_t seed = 0;
  std::shared_ptr<const Field> base;  // null: the ball of radius 1 about the origin, f = 1 − |p|
  double iso = 0;
  // What repeats: copies of a shape that ends, each with its own noise; noise that repeats by itself where the shape does not end (world units,
  // per axis; 0: not along it).
  Copies copies{};
  V3d period{0, 0, 0};
};

// Lattice cells of the noise (marble: veins) in each period: what the preset makes of its frequency there.
[[nodiscard]] PeriodFit hypertexture_fit(const Hypertexture& hypertexture);

// The defaults of a preset, for the ball. `name`: fog, eroded, fire, marble, fur, octaves; false: no such preset.
[[nodiscard]] bool find_hypertexture(std::string_view name, Hypertexture* out);
[[nodiscard]] const char* hypertexture_name(HypertexturePreset preset);

// t -> [0, 1] for t in [0, 1]; bias b takes ½ to b, gain g steepens (g > ½) or flattens the middle. Exact 0 and 1 stay so.
// Source: Schlick, Fast alternatives to Perlin's bias and gain functions, Graphics Gems IV.
[[nodiscard]] double bias_curve(double t, double bias);
[[nodiscard]] double gain_curve(double t, double gain);

// D as seen through voxels of width `filter` (world units; 0: as it is): octaves, veins and hairs that such voxels cannot show give way to
// their means. D is NaN where the base is. Gradients are analytic, fur's by central differences. range() is sound; bounds(iso) is where
// D >= iso > 0 can be, empty where the base does not know.
[[nodiscard]] std::shared_ptr<const Field> make_density(const Hypertexture& hypertexture, double filter);

// The preset's own colours.
[[nodiscard]] std::shared_ptr<const SolidTexture> hypertexture_color(const Hypertexture& hypertexture);
// Share of its colour that is light of its own (fire), the rest being albedo; 0: all of it is albedo.
[[nodiscard]] float hypertexture_glow(const Hypertexture& hypertexture);

// f = radius − |p − centre|.
[[nodiscard]] std::shared_ptr<const Field> make_ball(const V3d& centre, double radius);

}  // namespace texel
