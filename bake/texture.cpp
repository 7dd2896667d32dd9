#include "bake/texture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <exception>
#include <map>
#include <utility>
#include <vector>

#include "formats/error.h"

namespace texel {

namespace {

// One level of a mip chain. With alpha the colour is premultiplied, so that plain averages are right.
struct Level {
  int width = 0, height = 0;
  std::vector<float> texels;  // width·height·channels, row 0 on top
};

struct Chain {
  int channels = 0;           // 1 mask, 3 colour, 4 premultiplied colour and alpha
  bool holes = false;         // some alpha or mask below 1
  std::vector<Level> levels;  // finest first, the last is one texel
};

// How a material looks at a picture. One picture may be looked at in several ways.
enum class Role { kColor, kColorAlpha, kLuminance, kAlpha };
using Key = std::pair<int, Role>;

struct Use {
  int chain = -1;             // into the chains
  V2f scale{1, 1}, offset{0, 0};
  std::array<Wrap, 2> wrap{};
};

struct MaterialUse {
  V3f kd{0, 0, 0};
  Use color, mask;
  bool cutouts = false, two_sided = false;
};

constexpr float kWhole = 1.0f - 0.5f / 65535.0f;  // half a step of a 16-bit picture

bool plausible(const Image& image) {
  if (image.width < 1 || image.height < 1 || image.channels < 1 || image.channels > 4) return false;
  return image.pixels.size() == static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * static_cast<std::size_t>(image.channels);
}

float finite_or_zero(float v) { return std::isfinite(v) ? v : 0.0f; }
float share(float v) { return v > 0 ? std::min(v, 1.0f) : 0.0f; }  // NaN becomes 0

V3f color_of(const float* p, int channels) {
  return channels >= 3 ? V3f(finite_or_zero(p[0]), finite_or_zero(p[1]), finite_or_zero(p[2])) : V3f(finite_or_zero(p[0]));
}

// The finest level for `role`. Masks of luminance were stored as plain shares but decoded as sRGB colour: the curve is undone.
Chain finest(const Image& image, Role role) {
  Chain chain;
  chain.channels = role == Role::kColor ? 3 : role == Role::kColorAlpha ? 4 : 1;
  const std::size_t count = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  Level level{image.width, image.height, std::vector<float>(count * static_cast<std::size_t>(chain.channels))};
  const int n = image.channels;
  const float* in = image.pixels.data();
  float* out = level.texels.data();
  for (std::size_t i = 0; i < count; ++i, in += n, out += chain.channels) {
    const float alpha = image.has_alpha() ? share(in[n - 1]) : 1.0f;
    const V3f color = color_of(in, n);
    float mask = 1;
    if (role == Role::kLuminance) mask = share(linear_to_srgb(color.dot(V3f(0.2126f, 0.7152f, 0.0722f))));
    else if (role != Role::kColor) mask = alpha;
    chain.holes = chain.holes || mask < kWhole;
    if (chain.channels == 1) {
      out[0] = mask;
      continue;
    }
    for (int c = 0; c < 3; ++c) out[c] = role == Role::kColorAlpha ? color[c] * alpha : color[c];
    if (chain.channels == 4) out[3] = alpha;
  }
  chain.levels.push_back(std::move(level));
  return chain;
}

// Source texels under one texel of a row half as long (rounded up), and their shares. Odd lengths make three overlap.
struct Taps { int first = 0, count = 0; float weight[3] = {0, 0, 0}; };
Taps taps(int i, int from, int to) {
  const double step = static_cast<double>(from) / to, low = i * step, high = low + step;
  Taps t;
  t.first = std::min(static_cast<int>(low), from - 1);
  for (int s = t.first; s < from && s < high - 1e-9 && t.count < 3; ++s)
    t.weight[t.count++] = static_cast<float>((std::min<double>(s + 1, high) - std::max<double>(s, low)) / step);
  return t;
}

Level half_of(const Level& fine, int channels) {
  Level half{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
  const auto n = static_cast<std::size_t>(channels);
  half.texels.resize(static_cast<std::size_t>(half.width) * static_cast<std::size_t>(half.height) * n);
  float* out = half.texels.data();
  for (int y = 0; y < half.height; ++y) {
    const Taps rows = taps(y, fine.height, half.height);
    for (int x = 0; x < half.width; ++x, out += n) {
      const Taps columns = taps(x, fine.width, half.width);
      for (int r = 0; r < rows.count; ++r)
        for (int c = 0; c < columns.count; ++c) {
          const float weight = rows.weight[r] * columns.weight[c];
          const float* in = fine.texels.data() + (static_cast<std::size_t>(rows.first + r) * static_cast<std::size_t>(fine.width) + static_cast<std::size_t>(columns.first + c)) * n;
          for (std::size_t k = 0; k < n; ++k) out[k] += weight * in[k];
        }
    }
  }
  return half;
}

Chain make_chain(const Image& image, Role role) {
  Chain chain = finest(image, role);
  if (role == Role::kColorAlpha && !chain.holes) chain = finest(image, Role::kColor);
  if (chain.channels == 1 && !chain.holes) return chain;  // all there: the caller drops it
  while (chain.levels.back().width > 1 || chain.levels.back().height > 1) chain.levels.push_back(half_of(chain.levels.back(), chain.channels));
  return chain;
}

// A mirrored picture goes on with the texel at its border.
int wrap(int i, int n, Wrap how) {
  if (how != Wrap::kRepeat) return std::clamp(i, 0, n - 1);
  return i < 0 ? i + n : i >= n ? i - n : i;  // i is in [-1, n]
}

// Adds weight · the bilinear value at (s,t) in [0,1]², t downwards, to out.
void add_bilinear(const Level& level, int channels, float s, float t, const std::array<Wrap, 2>& how, float weight, float* out) {
  const float x = s * static_cast<float>(level.width) - 0.5f, y = t * static_cast<float>(level.height) - 0.5f;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const auto row = [&](int j) { return static_cast<std::size_t>(wrap(y0 + j, level.height, how[1])) * static_cast<std::size_t>(level.width); };
  const auto column = [&](int i) { return static_cast<std::size_t>(wrap(x0 + i, level.width, how[0])); };
  const std::size_t r0 = row(0), r1 = row(1), c0 = column(0), c1 = column(1), n = static_cast<std::size_t>(channels);
  const float* const texel[4] = {&level.texels[(r0 + c0) * n], &level.texels[(r0 + c1) * n], &level.texels[(r1 + c0) * n], &level.texels[(r1 + c1) * n]};
  const float w[4] = {weight * (1 - fx) * (1 - fy), weight * fx * (1 - fy), weight * (1 - fx) * fy, weight * fx * fy};
  for (std::size_t c = 0; c < n; ++c) out[c] += w[0] * texel[0][c] + w[1] * texel[1][c] + w[2] * texel[2][c] + w[3] * texel[3][c];
}

// A coordinate brought into [0,1]. Beyond a float's fraction bits there is no position left to speak of.
float unit_coordinate(float v, Wrap how) {
  if (!std::isfinite(v)) return 0;
  if (how == Wrap::kClamp) return std::clamp(v, 0.0f, 1.0f);
  if (how == Wrap::kMirror) {
    const float twice = v - 2 * std::floor(v / 2);  // in [0, 2]
    return std::clamp(twice > 1 ? 2 - twice : twice, 0.0f, 1.0f);
  }
  return std::clamp(v - std::floor(v), 0.0f, 1.0f);
}

void sample_chain(const Chain& chain, const Use& use, V2f uv, float footprint, float out[4]) {
  out[0] = out[1] = out[2] = out[3] = 0;
  const float s = unit_coordinate(uv.x * use.scale.x + use.offset.x, use.wrap[0]);
  const float t = 1 - unit_coordinate(uv.y * use.scale.y + use.offset.y, use.wrap[1]);
  const Level& top = chain.levels.front();
  // Isotropic: the footprint's width in texels of the finest level, by the geometric mean of both directions.
  const double texels = static_cast<double>(footprint) * std::sqrt(std::abs(static_cast<double>(use.scale.x) * use.scale.y) * top.width * top.height);
  const auto last = static_cast<double>(chain.levels.size() - 1);
  const double level = texels > 1 ? std::min(std::log2(texels), last) : 0;
  const auto l = static_cast<std::size_t>(level);
  const auto f = static_cast<float>(level - static_cast<double>(l));
  add_bilinear(chain.levels[l], chain.channels, s, t, use.wrap, 1 - f, out);
  if (f > 0 && l + 1 < chain.levels.size()) add_bilinear(chain.levels[l + 1], chain.channels, s, t, use.wrap, f, out);
}

// The last channel of sample_chain alone. A point (footprint 0) is one bilinear look-up in the finest level.
float sample_last(const Chain& chain, const Use& use, V2f uv, float footprint) {
  if (footprint > 0) {
    float all[4];
    sample_chain(chain, use, uv, footprint, all);
    return all[chain.channels - 1];
  }
  const Level& level = chain.levels.front();
  const float x = unit_coordinate(uv.x * use.scale.x + use.offset.x, use.wrap[0]) * static_cast<float>(level.width) - 0.5f;
  const float y = (1 - unit_coordinate(uv.y * use.scale.y + use.offset.y, use.wrap[1])) * static_cast<float>(level.height) - 0.5f;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const auto n = static_cast<std::size_t>(chain.channels);
  const auto texel = [&](int i, int j) {
    const auto row = static_cast<std::size_t>(wrap(y0 + j, level.height, use.wrap[1])) * static_cast<std::size_t>(level.width);
    return level.texels[(row + static_cast<std::size_t>(wrap(x0 + i, level.width, use.wrap[0]))) * n + n - 1];
  };
  return (texel(0, 0) * (1 - fx) + texel(1, 0) * fx) * (1 - fy) + (texel(0, 1) * (1 - fx) + texel(1, 1) * fx) * fy;
}

}  // namespace

struct TextureSet::Impl {
  std::vector<Chain> chains;
  std::vector<MaterialUse> materials;
};

namespace {

// Pictures to decode, in the order of the textures, and what each is looked at as.
struct Job {
  int texture = -1;
  std::vector<Role> roles;
  std::vector<Chain> chains;   // one per role
  std::exception_ptr failed;
};

bool valid(const TextureUse& use, const Scene& scene) {
  return use.used() && static_cast<std::size_t>(use.texture) < scene.textures.size();
}

Role mask_role(const TextureUse& use) { return use.alpha_channel ? Role::kAlpha : Role::kLuminance; }

std::vector<Job> list_jobs(const Scene& scene, TextureSet::Need need, Report& report) {
  const std::vector<bool> used = used_materials(scene);
  std::map<int, std::vector<Role>> wanted;
  const auto want = [&](int texture, Role role) {
    auto& roles = wanted[texture];
    if (std::find(roles.begin(), roles.end(), role) == roles.end()) roles.push_back(role);
  };
  for (std::size_t m = 0; m < scene.materials.size(); ++m) {
    if (!used[m]) continue;
    const Material& material = scene.materials[m];
    // The colour picture is opened for coverage too: only its pixels tell whether its alpha cuts anything out.
    if (valid(material.map_kd, scene)) want(material.map_kd.texture, need == TextureSet::Need::kColor ? Role::kColorAlpha : Role::kAlpha);
    if (valid(material.map_d, scene)) want(material.map_d.texture, mask_role(material.map_d));
  }
  for (std::size_t t = 0; t < scene.textures.size(); ++t)
    if (!wanted.contains(static_cast<int>(t))) report.skip("texture " + scene.textures[t].name, "no triangle uses it");
  std::vector<Job> jobs;
  for (auto& [texture, roles] : wanted) jobs.push_back({texture, std::move(roles), {}, {}});
  return jobs;
}

void decode(const Scene& scene, Job& job) {
  try {
    if (!scene.load_texture) throw Error(Code::kFile, scene.textures[static_cast<std::size_t>(job.texture)].name, "the scene has no way to load textures");
    const Image image = scene.load_texture(job.texture);
    if (!plausible(image)) throw Error(Code::kFile, scene.textures[static_cast<std::size_t>(job.texture)].name, "not a picture of 1 to 4 channels");
    for (const Role role : job.roles) job.chains.push_back(make_chain(image, role));
  } catch (...) {
    job.failed = std::current_exception();
    job.chains.clear();
  }
}

// Rethrows what no input is to blame for; a bad file becomes an issue.
void report_failure(const Scene& scene, const Job& job, Report& report) {
  const std::string& name = scene.textures[static_cast<std::size_t>(job.texture)].name;
  try {
    std::rethrow_exception(job.failed);
  } catch (const Error& e) {
    if (e.code == Code::kUnsupported || e.code == Code::kRunning) throw;
    report.issue("texture-unreadable", "texture cannot be decoded and is left out: " + e.message, 1, name);
  }
}

Use use_of(const TextureUse& use, int chain) { return {chain, use.scale, use.offset, use.wrap}; }

}  // namespace

TextureSet::TextureSet(const Scene& scene, Need need, Report& report) : impl_(std::make_unique<Impl>()) {
  std::vector<Job> jobs = list_jobs(scene, need, report);
  std::atomic<std::size_t> done{0};
  tbb::parallel_for(std::size_t{0}, jobs.size(), [&](std::size_t i) {
    decode(scene, jobs[i]);
    if (report.progress) report.progress("textures", static_cast<double>(++done) / static_cast<double>(jobs.size()));
  });

  std::map<Key, int> places;
  for (Job& job : jobs) {
    if (job.failed) {
      report_failure(scene, job, report);
      continue;
    }
    for (std::size_t r = 0; r < job.roles.size(); ++r) {
      if (job.chains[r].channels == 1 && !job.chains[r].holes) {
        report.skip("alpha of texture " + scene.textures[static_cast<std::size_t>(job.texture)].name, "wholly opaque");
        continue;
      }
      places[{job.texture, job.roles[r]}] = static_cast<int>(impl_->chains.size());
      impl_->chains.push_back(std::move(job.chains[r]));
    }
  }
  const auto place = [&](int texture, Role role) {
    const auto found = places.find({texture, role});
    return found == places.end() ? -1 : found->second;
  };
  for (const Material& material : scene.materials) {
    MaterialUse& use = impl_->materials.emplace_back();
    use.kd = material.kd;
    use.two_sided = material.two_sided;
    use.color = use_of(material.map_kd, place(material.map_kd.texture, need == Need::kColor ? Role::kColorAlpha : Role::kAlpha));
    use.mask = use_of(material.map_d, place(material.map_d.texture, mask_role(material.map_d)));
    const auto cuts = [&](const Use& u) { return u.chain >= 0 && impl_->chains[static_cast<std::size_t>(u.chain)].holes; };
    use.cutouts = cuts(use.color) || cuts(use.mask);
  }
}

TextureSet::~TextureSet() = default;
TextureSet::TextureSet(TextureSet&&) noexcept = default;
TextureSet& TextureSet::operator=(TextureSet&&) noexcept = default;

bool TextureSet::has_cutouts(std::uint32_t material) const { return material < impl_->materials.size() && impl_->materials[material].cutouts; }

bool TextureSet::double_sided(std::uint32_t material) const { return material < impl_->materials.size() && impl_->materials[material].two_sided; }

bool TextureSet::any_cutouts() const {
  return std::any_of(impl_->materials.begin(), impl_->materials.end(), [](const MaterialUse& m) { return m.cutouts; });
}

bool TextureSet::textured(std::uint32_t material) const {
  return material < impl_->materials.size() && (impl_->materials[material].color.chain >= 0 || impl_->materials[material].mask.chain >= 0);
}

float TextureSet::texels_per_uv(std::uint32_t material) const {
  if (material >= impl_->materials.size()) return 0;
  float most = 0;
  for (const Use* use : {&impl_->materials[material].color, &impl_->materials[material].mask}) {
    if (use->chain < 0) continue;
    const auto& picture = impl_->chains[static_cast<std::size_t>(use->chain)].levels.front();
    most = std::max({most, std::abs(use->scale.x) * static_cast<float>(picture.width), std::abs(use->scale.y) * static_cast<float>(picture.height)});
  }
  return most;
}

SurfaceSample TextureSet::sample(std::uint32_t material, V2f uv, float footprint) const {
  SurfaceSample result;
  if (material >= impl_->materials.size()) return result;
  const MaterialUse& use = impl_->materials[material];
  result.color = use.kd;
  float value[4];
  if (use.color.chain >= 0) {
    const Chain& chain = impl_->chains[static_cast<std::size_t>(use.color.chain)];
    sample_chain(chain, use.color, uv, footprint, value);
    if (chain.channels == 1) {
      result.coverage = value[0];
    } else {
      if (chain.channels == 4) result.coverage = value[3];
      const float weight = chain.channels == 4 ? value[3] : 1.0f;
      // Where nothing is there the colour means nothing; the material's own keeps it in range.
      if (weight > 0) result.color *= V3f(value[0], value[1], value[2]) / weight;
    }
  }
  if (use.mask.chain >= 0) {
    sample_chain(impl_->chains[static_cast<std::size_t>(use.mask.chain)], use.mask, uv, footprint, value);
    result.coverage *= value[0];
  }
  result.coverage = share(result.coverage);
  return result;
}

float TextureSet::coverage(std::uint32_t material, V2f uv, float footprint) const {
  if (!has_cutouts(material)) return 1;
  const MaterialUse& use = impl_->materials[material];
  float result = 1;
  if (use.color.chain >= 0) {
    const Chain& chain = impl_->chains[static_cast<std::size_t>(use.color.chain)];
    if (chain.channels != 3) result = sample_last(chain, use.color, uv, footprint);  // a mask alone, or the alpha of four channels
  }
  if (use.mask.chain >= 0) result *= sample_last(impl_->chains[static_cast<std::size_t>(use.mask.chain)], use.mask, uv, footprint);
  return share(result);
}

std::vector<bool> used_materials(const Scene& scene) {
  std::vector<bool> used(scene.materials.size(), false);
  const auto use = [&](const std::vector<std::uint32_t>& materials) {
    for (const std::uint32_t m : materials)
      if (m < used.size()) used[m] = true;
  };
  use(scene.mesh.materials);
  use(scene.fibres.materials);
  std::vector<bool> placed(scene.shapes.size(), false);
  for (const Instance& instance : scene.instances) placed[instance.shape] = true;
  for (std::size_t i = 0; i < scene.shapes.size(); ++i)
    if (placed[i]) use(scene.shapes[i].materials);
  return used;
}

V2f uv_at(const Mesh& mesh, std::uint32_t triangle, double b1, double b2) {
  if (triangle >= mesh.uv_corners.size()) return {0, 0};
  double u = 0, v = 0;
  const double weight[3] = {1 - b1 - b2, b1, b2};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t i = mesh.uv_corners[triangle][k];
    if (i >= mesh.uvs.size()) return {0, 0};
    u += weight[k] * static_cast<double>(mesh.uvs[i].x);
    v += weight[k] * static_cast<double>(mesh.uvs[i].y);
  }
  return {static_cast<float>(u), static_cast<float>(v)};
}

V3f vertex_color_at(const Mesh& mesh, std::uint32_t triangle, double b1, double b2) {
  if (mesh.colors.size() != mesh.points.size() || mesh.colors.empty()) return {1, 1, 1};
  const auto& corner = mesh.triangles[triangle];
  return mesh.colors[corner[0]] * static_cast<float>(1 - b1 - b2) + mesh.colors[corner[1]] * static_cast<float>(b1) + mesh.colors[corner[2]] * static_cast<float>(b2);
}

float uv_per_world(const Mesh& mesh, std::uint32_t triangle) {
  if (triangle >= mesh.uv_corners.size()) return 0;
  V3d t[3];
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t i = mesh.uv_corners[triangle][k];
    if (i >= mesh.uvs.size()) return 0;
    t[k] = V3d(static_cast<double>(mesh.uvs[i].x), static_cast<double>(mesh.uvs[i].y), 0);
  }
  const auto& corner = mesh.triangles[triangle];
  const V3d a = mesh.points[corner[1]] - mesh.points[corner[0]], b = mesh.points[corner[2]] - mesh.points[corner[0]];
  // Square roots before the ratio, so that areas of very small or large scenes do not leave the range of a double.
  const double world = std::sqrt(a.length()) * std::sqrt(b.length());
  const double sine = a.length() > 0 && b.length() > 0 ? (a / a.length()).cross(b / b.length()).length() : 0;
  const double uv_area = std::abs((t[1].x - t[0].x) * (t[2].y - t[0].y) - (t[1].y - t[0].y) * (t[2].x - t[0].x));
  const double ratio = world > 0 && sine > 0 ? std::sqrt(uv_area / sine) / world : 0;
  return std::isfinite(ratio) && ratio < 1e30 ? static_cast<float>(ratio) : 0.0f;
}

SurfaceSample surface_sample(const TextureSet& textures, const Mesh& mesh, std::uint32_t triangle, double b1, double b2, double width) {
  const std::uint32_t material = triangle < mesh.materials.size() ? mesh.materials[triangle] : kNoIndex;
  const bool textured = textures.textured(material);
  return footprint_sample(textures, mesh, triangle, b1, b2, textured ? static_cast<float>(width * static_cast<double>(uv_per_world(mesh, triangle))) : 0);
}

SurfaceSample footprint_sample(const TextureSet& textures, const Mesh& mesh, std::uint32_t triangle, double b1, double b2, float footprint) {
  const std::uint32_t material = triangle < mesh.materials.size() ? mesh.materials[triangle] : kNoIndex;
  SurfaceSample s = textures.textured(material) ? textures.sample(material, uv_at(mesh, triangle, b1, b2), footprint) : textures.sample(material, {0, 0}, 0);
  if (!mesh.colors.empty()) s.color *= vertex_color_at(mesh, triangle, b1, b2);
  return s;
}

std::vector<float> uv_widths(const TextureSet& textures, const Mesh& mesh) {
  std::vector<float> widths(mesh.triangles.size(), 0.0f);
  for (std::uint32_t t = 0; t < widths.size(); ++t)
    if (textures.textured(mesh.materials[t])) widths[t] = uv_per_world(mesh, t);
  return widths;
}

}  // namespace texel
