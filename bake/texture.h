#pragma once
// Stage 2b: Scene -> albedo and coverage anywhere on its surface (textures decoded once, mip-mapped)
#include <cstdint>
#include <memory>
#include <vector>

#include "bake/recipe.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

struct SurfaceSample {
  V3f color{0, 0, 0};   // linear albedo: kd · vertex colour · map_kd
  float coverage = 1;   // share of the footprint that is there: alpha of map_kd · map_d
};

// The textures of a scene's materials, decoded and filtered down to one texel. Straight colour is averaged weighted by alpha.
class TextureSet {
 public:
  enum class Need { kCoverage, kColor };  // kColor: colour and coverage

  // Decodes what `need` asks for of the textures that triangles use, in parallel, each file once; the rest goes to
  // report.skipped. A texture that cannot be decoded becomes the issue "texture-unreadable" and is left out.
  // Throws Error{kUnsupported} where the image module is not installed. Keeps nothing of `scene`.
  TextureSet(const Scene& scene, Need need, Report& report);
  ~TextureSet();
  TextureSet(TextureSet&&) noexcept;
  TextureSet& operator=(TextureSet&&) noexcept;

  // Whether some texel of the material is not wholly there. A file with an alpha channel of ones has no cut-outs.
  [[nodiscard]] bool has_cutouts(std::uint32_t material) const;
  [[nodiscard]] bool any_cutouts() const;
  // Whether sampling the material needs uv at all.
  [[nodiscard]] bool textured(std::uint32_t material) const;
  [[nodiscard]] bool double_sided(std::uint32_t material) const;  // the material says so itself
  // Whether a surface seen from behind shows its back; of a solid nobody sees it.
  [[nodiscard]] bool two_sided(std::uint32_t material, Sidedness sidedness) const {
    return sidedness == Sidedness::kAlways || (sidedness == Sidedness::kAuto && (has_cutouts(material) || double_sided(material)));
  }

  // Texels to a unit of uv, along the picture's denser side; 0 without a picture.
  [[nodiscard]] float texels_per_uv(std::uint32_t material) const;

  // `uv` as the mesh has it (scale, offset and clamp are applied here; v = 0 is the bottom row); `footprint`: width in uv of what
  // is averaged, 0 for a point. Trilinear: two levels of the mip chain, bilinear in each. No vertex colour. Thread-safe.
  [[nodiscard]] SurfaceSample sample(std::uint32_t material, V2f uv, float footprint) const;
  // The coverage of `sample` alone, cheaper.
  [[nodiscard]] float coverage(std::uint32_t material, V2f uv, float footprint) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Per material, whether surface of the scene is of it.
[[nodiscard]] std::vector<bool> used_materials(const Scene& scene);

// uv at barycentrics (b1, b2) of corners 1 and 2; (0,0) where the triangle has none.
[[nodiscard]] V2f uv_at(const Mesh& mesh, std::uint32_t triangle, double b1, double b2);
// Vertex colour there; 1 where the mesh has none.
[[nodiscard]] V3f vertex_color_at(const Mesh& mesh, std::uint32_t triangle, double b1, double b2);
// Width in uv of a world length on the triangle: the square root of the ratio of the areas. 0 without uv or without area.
[[nodiscard]] float uv_per_world(const Mesh& mesh, std::uint32_t triangle);

// All of it: colour with vertex colour and texture, and coverage, of a footprint `width` (world units) about the point.
[[nodiscard]] SurfaceSample surface_sample(const TextureSet& textures, const Mesh& mesh, std::uint32_t triangle, double b1, double b2, double width);

// The same with the footprint's width given in uv.
[[nodiscard]] SurfaceSample footprint_sample(const TextureSet& textures, const Mesh& mesh, std::uint32_t triangle, double b1, double b2, float footprint);
// uv_per_world of every textured triangle, 0 for the others.
[[nodiscard]] std::vector<float> uv_widths(const TextureSet& textures, const Mesh& mesh);

}  // namespace texel
