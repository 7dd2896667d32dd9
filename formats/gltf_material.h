#pragma once
// The materials and pictures of a glTF file as the scene's. For the glTF reader only. The mapping is in docs/inputs.md.
#include <map>
#include <optional>
#include <tuple>

#include "formats/gltf_file.h"
#include "formats/scene.h"

namespace texel {

// What a primitive has to know of its material.
struct GltfMaterial {
  std::uint32_t material = 0;      // into Scene::materials
  bool drawn = true;               // false: masked away wholly
  bool alpha = false;              // alphaMode is not OPAQUE
  std::optional<std::uint64_t> uv_set;  // TEXCOORD_n of its picture; none: needs no uv
  // From TEXCOORD_n to the scene's uv (v = 0 at the bottom): u' = a u + b v + c, v' = d u + e v + f.
  double uv[6] = {1, 0, 0, 0, -1, 1};
};

// Makes materials as they are asked for, so that pictures nobody uses are not looked for.
class GltfMaterials {
 public:
  GltfMaterials(GltfFile& file, Scene& scene, Report& report) : file_(file), scene_(scene), report_(report) {}
  // Throws Error{kBadInput} for values that are none. Metallic-roughness, emissive and similar pictures are decoded here, for their means.
  [[nodiscard]] const GltfMaterial& of(const GltfValue& primitive);

 private:
  struct Picture {
    std::size_t image;
    std::array<Wrap, 2> wrap;
  };
  struct Look {  // a colour and how much of it is metal, before it is split
    double base[4] = {1, 1, 1, 1}, metallic = 1, roughness = 1, f0[3] = {0.04, 0.04, 0.04};
    std::optional<GltfValue> texture;  // the textureInfo of the colour
  };
  GltfMaterial make(const GltfValue& at);
  GltfMaterial plain();
  Look metallic_roughness(const GltfValue& at);
  Look specular_glossiness(const GltfValue& at, const GltfValue& extension, Material& m);
  void add_specular(const GltfValue& at, Look& look);
  void finish_look(const GltfValue& at, const Look& look, bool opaque, Material& m);
  void add_alpha(const GltfValue& at, const Look& look, GltfMaterial& result, Material& m, float* cutoff);
  void place_uv(const GltfValue& info, GltfMaterial& result) const;
  void name_unused(const GltfValue& at);
  void factors(const GltfValue& at, const char* key, std::size_t count, double* to, double most = 1);
  void factor(const GltfValue& at, const char* key, double* to) { limit(at, key, to, 1, 1); }
  void limit(const GltfValue& at, const char* key, double* values, std::size_t count, double most);
  std::optional<Picture> picture(const GltfValue& info);
  int texture(std::size_t image, bool opaque, float cutoff);
  const Texture* stored(std::size_t image);
  // Mean of red, green, blue and alpha; colour is linear and weighted by alpha unless `raw`. None, with an issue, where it cannot be read.
  std::optional<std::array<double, 4>> mean(const GltfValue& info, bool raw, bool weighted);

  GltfFile& file_;
  Scene& scene_;
  Report& report_;
  std::map<std::size_t, GltfMaterial> made_;
  std::optional<GltfMaterial> plain_;
  int missing_ = 0;  // pictures
  std::map<std::size_t, std::optional<Texture>> stored_;  // per image; none: cannot be had
  std::map<std::tuple<std::size_t, bool, float>, int> textures_;
  std::map<std::tuple<std::size_t, bool, bool>, std::optional<std::array<double, 4>>> means_;
};

}  // namespace texel
