// glTF 2.0 specification, sections 3.8, 3.9 and appendix B; the KHR_materials extensions.
#include "formats/gltf_material.h"

#include <algorithm>
#include <cmath>

#include "formats/error.h"
#include "formats/image.h"
#include "formats/readers.h"

namespace texel {
namespace {

constexpr double kMostEmission = 1e4;  // as in MTL

// The picture of a texture: the core one, or of an extension whose form the image library reads.
std::optional<std::size_t> source_of(GltfFile& file, const GltfValue& texture) {
  if (const auto webp = texture.extension("EXT_texture_webp"))
    if (const auto image = file.reference(*webp, "source", "images")) return image;
  return file.reference(texture, "source", "images");
}

Wrap wrap_of(const GltfValue& sampler, const char* key) {
  switch (sampler.whole_or(key, 10497)) {
    case 10497: return Wrap::kRepeat;
    case 33071: return Wrap::kClamp;
    case 33648: return Wrap::kMirror;
    default: sampler[key].fail("is " + sampler[key].shown() + ", not 10497 (repeat), 33071 (clamp) or 33648 (mirror)");
  }
}

std::array<double, 4> mean_of(const Image& image, bool weighted) {
  std::array<double, 4> sum{};
  const auto n = static_cast<std::size_t>(image.channels);
  double weight = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += n) {
    const float* p = &image.pixels[i];
    const double alpha = image.has_alpha() ? static_cast<double>(p[n - 1]) : 1.0, w = weighted ? alpha : 1.0;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += w * static_cast<double>(p[n >= 3 ? c : 0]);
    sum[3] += alpha;
    weight += w;
  }
  for (std::size_t c = 0; c < 3; ++c) sum[c] = weight > 0 ? sum[c] / weight : 0;
  sum[3] *= static_cast<double>(n) / static_cast<double>(image.pixels.size());
  return sum;
}

V3f limited(const double* v, double most) {
  const auto one = [&](double x) { return static_cast<float>(std::clamp(x, 0.0, most)); };
  return {one(v[0]), one(v[1]), one(v[2])};
}

bool black(const V3f& c) { return c == V3f(0, 0, 0); }

}  // namespace

const GltfMaterial& GltfMaterials::of(const GltfValue& primitive) {
  const auto index = file_.reference(primitive, "material", "materials");
  if (!index) {
    if (!plain_) plain_ = plain();
    return *plain_;
  }
  const auto found = made_.find(*index);
  return found != made_.end() ? found->second : made_.emplace(*index, make(file_.item("materials", *index))).first->second;
}

// The default material of glTF is a white metal, which nobody means who leaves the material out. White lets vertex colours be.
GltfMaterial GltfMaterials::plain() {
  GltfMaterial result;
  result.material = static_cast<std::uint32_t>(scene_.materials.size());
  scene_.materials.push_back(plain_color("default", V3f(1, 1, 1)));
  return result;
}

GltfMaterial GltfMaterials::make(const GltfValue& at) {
  GltfMaterial result;
  Material m;
  m.name = at.has("name") ? at["name"].text() : "";
  if (m.name.empty()) m.name = at.path();
  m.two_sided = at.boolean_or("doubleSided", false);
  const auto glossy = at.extension("KHR_materials_pbrSpecularGlossiness");
  Look look = glossy ? specular_glossiness(at, *glossy, m) : metallic_roughness(at);
  float cutoff = -1;
  add_alpha(at, look, result, m, &cutoff);
  if (!glossy) finish_look(at, look, !result.alpha, m);
  double emission[3] = {0, 0, 0};
  factors(at, "emissiveFactor", 3, emission);
  if (const auto strength = at.extension("KHR_materials_emissive_strength"))
    for (double& e : emission) e *= strength->number_or("emissiveStrength", 1);
  if (emission[0] > 0 || emission[1] > 0 || emission[2] > 0) {
    if (at.has("emissiveTexture"))
      if (const auto average = mean(at["emissiveTexture"], false, false))
        for (std::size_t c = 0; c < 3; ++c) emission[c] *= (*average)[c];
    m.ke = limited(emission, kMostEmission);
  }
  if (look.texture) {
    if (const auto found = picture(*look.texture)) {
      m.map_kd.texture = texture(found->image, !result.alpha || cutoff == 0, result.alpha ? cutoff : -1);
      m.map_kd.wrap = found->wrap;
      if (m.map_kd.used()) place_uv(*look.texture, result);
    }
  }
  name_unused(at);
  result.material = static_cast<std::uint32_t>(scene_.materials.size());
  scene_.materials.push_back(std::move(m));
  return result;
}

void GltfMaterials::limit(const GltfValue& at, const char* key, double* values, std::size_t count, double most) {
  if (count == 1) *values = at.number_or(key, *values);
  else at.numbers(key, count, values);
  bool good = true;
  for (std::size_t i = 0; i < count; ++i) {
    good = good && values[i] >= 0 && values[i] <= most;
    values[i] = std::clamp(values[i], 0.0, most);
  }
  if (!good) report_.issue("gltf-out-of-range", "factors of materials outside their range were limited to it", 1, file_.path() + ": " + at.path() + "." + key);
}

void GltfMaterials::factors(const GltfValue& at, const char* key, std::size_t count, double* to, double most) { limit(at, key, to, count, most); }

GltfMaterials::Look GltfMaterials::metallic_roughness(const GltfValue& at) {
  Look look;
  if (at.has("pbrMetallicRoughness")) {
    const GltfValue pbr = at["pbrMetallicRoughness"];
    factors(pbr, "baseColorFactor", 4, look.base);
    factor(pbr, "metallicFactor", &look.metallic);
    factor(pbr, "roughnessFactor", &look.roughness);
    if (pbr.has("baseColorTexture")) look.texture = pbr["baseColorTexture"];
    if (pbr.has("metallicRoughnessTexture") && (look.metallic > 0 || look.roughness > 0)) {
      if (const auto average = mean(pbr["metallicRoughnessTexture"], true, false)) {
        look.metallic *= (*average)[2];
        look.roughness *= (*average)[1];
      } else {
        look.metallic = 0;  // nothing is known of it, and most things are no metals
      }
    }
  }
  if (at.extension("KHR_materials_unlit")) {
    look.metallic = 0;
    look.f0[0] = look.f0[1] = look.f0[2] = 0;
  } else {
    add_specular(at, look);
  }
  return look;
}

void GltfMaterials::add_specular(const GltfValue& at, Look& look) {
  if (const auto ior = at.extension("KHR_materials_ior")) {
    const double n = ior->number_or("ior", 1.5);
    if (n != 0 && !(n >= 1)) (*ior)["ior"].fail("is " + (*ior)["ior"].shown() + ", neither 0 nor at least 1");
    for (double& f : look.f0) f = n == 0 ? 1.0 : (n - 1) / (n + 1) * ((n - 1) / (n + 1));
  }
  if (const auto specular = at.extension("KHR_materials_specular")) {
    double weight = 1, color[3] = {1, 1, 1};
    factor(*specular, "specularFactor", &weight);
    factors(*specular, "specularColorFactor", 3, color, 1e6);
    for (std::size_t c = 0; c < 3; ++c) look.f0[c] = std::min(look.f0[c] * color[c], 1.0) * weight;
  }
}

// The archived extension, still in many files: colours of both terms are given as they are.
GltfMaterials::Look GltfMaterials::specular_glossiness(const GltfValue&, const GltfValue& extension, Material& m) {
  Look look;
  double specular[3] = {1, 1, 1}, glossiness = 1;
  factors(extension, "diffuseFactor", 4, look.base);
  factors(extension, "specularFactor", 3, specular);
  factor(extension, "glossinessFactor", &glossiness);
  if (extension.has("diffuseTexture")) look.texture = extension["diffuseTexture"];
  if (extension.has("specularGlossinessTexture"))
    if (const auto average = mean(extension["specularGlossinessTexture"], false, false)) {
      for (std::size_t c = 0; c < 3; ++c) specular[c] *= (*average)[c];
      glossiness *= (*average)[3];
    }
  m.kd = limited(look.base, 1);
  m.ks = limited(specular, 1);
  m.roughness = black(m.ks) ? 1.0f : static_cast<float>((1 - glossiness) * (1 - glossiness));
  return look;
}

void GltfMaterials::finish_look(const GltfValue& at, const Look& look, bool opaque, Material& m) {
  double diffuse[3], specular[3];
  std::array<double, 4> average{1, 1, 1, 1};
  if (look.metallic > 0 && look.texture) average = mean(*look.texture, false, !opaque).value_or(average);
  for (std::size_t c = 0; c < 3; ++c) {
    diffuse[c] = look.base[c] * (1 - look.metallic);
    specular[c] = look.f0[c] + (look.base[c] * average[c] - look.f0[c]) * look.metallic;
  }
  m.kd = limited(diffuse, 1);
  m.ks = limited(specular, 1);
  m.roughness = black(m.ks) ? 1.0f : static_cast<float>(look.roughness * look.roughness);
  if (look.metallic == 1 && !black(limited(look.base, 1)))
    report_.issue("gltf-metal", "materials that are wholly metal have no diffuse colour: Cd is black there, and ks has their colour", 1,
                  file_.path() + ": " + at.path());
}

// OPAQUE: alpha means nothing. MASK: what is below the cutoff is cut out. BLEND: the picture's alpha is coverage, the factor opacity.
void GltfMaterials::add_alpha(const GltfValue& at, const Look& look, GltfMaterial& result, Material& m, float* cutoff) {
  if (!at.has("alphaMode")) return;
  const GltfValue mode = at["alphaMode"];
  const std::string& name = mode.text();
  if (name == "OPAQUE") return;
  result.alpha = true;
  if (name == "BLEND") {
    m.opacity = static_cast<float>(look.base[3]);
    return;
  }
  if (name != "MASK") mode.fail("is " + mode.shown() + ", not OPAQUE, MASK or BLEND");
  const double limit = at.number_or("alphaCutoff", 0.5);
  if (!(limit >= 0)) at["alphaCutoff"].fail("is " + at["alphaCutoff"].shown() + ", below 0");
  // factor · alpha >= limit, alpha being 1 where there is no picture.
  result.drawn = look.base[3] >= limit;
  *cutoff = look.base[3] > 0 ? static_cast<float>(std::min(limit / look.base[3], 2.0)) : 0.0f;
  if (!result.drawn)
    report_.issue("gltf-masked", "materials whose alpha is below their cutoff everywhere: their triangles are left out", 1, file_.path() + ": " + at.path());
}

void GltfMaterials::place_uv(const GltfValue& info, GltfMaterial& result) const {
  result.uv_set = info.whole_or("texCoord", 0);
  const auto transform = info.extension("KHR_texture_transform");
  if (!transform) return;
  double offset[2] = {0, 0}, scale[2] = {1, 1};
  transform->numbers("offset", 2, offset);
  transform->numbers("scale", 2, scale);
  const double angle = transform->number_or("rotation", 0), s = std::sin(angle), c = std::cos(angle);
  if (transform->has("texCoord")) result.uv_set = (*transform)["texCoord"].whole();
  // Counter-clockwise as the picture is seen, v pointing down: the README's second example, three.js and Blender agree on it.
  const double v[3] = {-s * scale[0], c * scale[1], offset[1]};
  const double turned[6] = {c * scale[0], s * scale[1], offset[0], -v[0], -v[1], 1 - v[2]};
  std::copy(turned, turned + 6, result.uv);
}

// What changes the look and is not baked, so that nobody has to wonder.
void GltfMaterials::name_unused(const GltfValue& at) {
  const std::string where = file_.path() + ": " + at.path();
  if (at.has("normalTexture")) report_.issue("gltf-normal-map", "normal maps are not baked: normals are the geometry's own", 1, where);
  if (!at.has("extensions")) return;
  constexpr const char* kUnused[] = {"KHR_materials_clearcoat", "KHR_materials_transmission", "KHR_materials_volume", "KHR_materials_sheen",
                                     "KHR_materials_iridescence", "KHR_materials_anisotropy", "KHR_materials_dispersion", "KHR_materials_diffuse_transmission"};
  for (const char* name : kUnused)
    if (at["extensions"].has(name)) report_.issue("gltf-extension", std::string("materials' ") + name + " is not baked", 1, where);
}

std::optional<GltfMaterials::Picture> GltfMaterials::picture(const GltfValue& info) {
  const auto index = file_.reference(info, "index", "textures");
  if (!index) info.fail("has no \"index\"");
  const GltfValue at = file_.item("textures", *index);
  Picture result{};
  if (const auto sampler = file_.reference(at, "sampler", "samplers")) {
    const GltfValue s = file_.item("samplers", *sampler);
    result.wrap = {wrap_of(s, "wrapS"), wrap_of(s, "wrapT")};
  }
  const auto image = source_of(file_, at);
  if (!image) {
    report_.issue("gltf-texture-format", "textures without a PNG, JPEG or WebP picture (KTX2, DDS, …): the material's colour is used; export them as PNG", 1,
                  file_.path() + ": " + at.path());
    return {};
  }
  result.image = *image;
  return result;
}

const Texture* GltfMaterials::stored(std::size_t image) {
  const auto found = stored_.find(image);
  if (found != stored_.end()) return found->second ? &*found->second : nullptr;
  std::optional<Texture>& entry = stored_[image];
  const GltfValue at = file_.item("images", image);
  Texture t;
  t.path = file_.path();
  t.name = file_.path() + ": " + at.path();
  if (const auto view = file_.reference(at, "bufferView", "bufferViews")) {
    const std::span<const char> bytes = file_.view(*view);
    file_.charge(bytes.size(), at);
    t.bytes = std::make_shared<const std::string>(bytes.data(), bytes.size());
  } else if (const GltfValue uri = at["uri"]; uri.text().starts_with("data:")) {
    t.bytes = std::make_shared<const std::string>(file_.data_uri(uri));
  } else {
    std::string why;
    t.path = file_.find_file(uri.text(), why);
    t.name = uri.text();
    if (t.path.empty()) {
      constexpr int kMostNamed = 50;  // one by one, but not without end
      const std::string which = ++missing_ <= kMostNamed ? "picture " + shown_as(uri.text()) + " " + why : "further pictures are not there";
      report_.issue("texture-missing", which + ": the material's colour is used instead", 1, file_.path() + ": " + uri.path());
      return nullptr;
    }
    add_source(scene_, t.path);
  }
  entry = std::move(t);
  return &*entry;
}

int GltfMaterials::texture(std::size_t image, bool opaque, float cutoff) {
  const auto [at, is_new] = textures_.try_emplace({image, opaque, cutoff}, -1);
  if (!is_new) return at->second;
  const Texture* from = stored(image);
  if (!from) return -1;
  Texture t = *from;
  t.opaque = opaque;
  t.cutoff = opaque ? -1 : cutoff;
  at->second = static_cast<int>(scene_.textures.size());
  scene_.textures.push_back(std::move(t));
  return at->second;
}

std::optional<std::array<double, 4>> GltfMaterials::mean(const GltfValue& info, bool raw, bool weighted) {
  const auto found = picture(info);
  if (!found) return {};
  const auto [at, is_new] = means_.try_emplace({found->image, raw, weighted}, std::nullopt);
  if (!is_new) return at->second;
  const Texture* t = stored(found->image);
  if (!t) return {};
  try {
    at->second = mean_of(t->bytes ? read_image(*t->bytes, t->name, raw) : read_image(t->path, raw), weighted);
    report_.issue("gltf-mean-texture", "pictures of metalness, roughness, specular or emission stand for their mean", 1, file_.path() + ": " + info.path());
  } catch (const Error& e) {
    if (e.code != Code::kFile) throw;
    report_.issue("texture-unreadable", "texture cannot be decoded and is left out: " + e.message, 1, t->name);
  }
  return at->second;
}

}  // namespace texel
