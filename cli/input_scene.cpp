#include "cli/input_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>

#include "bake/hypertexture.h"
#include "formats/error.h"
#include "formats/image.h"
#include "formats/instances.h"
#include "formats/read.h"
#include "formats/solid_textures.h"

namespace texel {
namespace {

ReadOptions read_options(const Recipe& recipe) {
  return {.implicit = recipe.implicit, .iso = recipe.iso, .plants = recipe.plants, .fibres = recipe.fibres, .texel = recipe.texel, .scene = recipe.scene, .heights = recipe.heights};
}

Hypertexture hypertexture(const HypertextureOptions& given) {
  Hypertexture h;
  (void)find_hypertexture(given.preset, &h);  // the option table knows the presets only
  if (given.frequency > 0) h.frequency = given.frequency;
  if (given.octaves > 0) h.octaves = given.octaves;
  if (given.amount >= 0) h.amount = given.amount;
  if (given.softness > 0) h.softness = given.softness;
  if (given.bias > 0) h.bias = given.bias;
  if (given.gain > 0) h.gain = given.gain;
  if (given.scale > 0) h.scale = given.scale;
  h.seed = static_cast<std::uint32_t>(given.seed);
  return h;
}

// Where there is something, as far as it is known; may be empty.
Box3d known_bounds(const Scene& scene, const Recipe& recipe) {
  if (recipe.box) return *recipe.box;
  if (scene.hypertexture) return density_bounds(*make_density(*scene.hypertexture, 0));
  Box3d box = surface_bounds(scene);
  for (const V3d& p : scene.fibres.points) box.extendBy(p);
  for (const Implicit& solid : scene.implicits)
    if (!solid.box.isEmpty()) box.extendBy(solid.box);
  return box;
}

std::shared_ptr<const SolidTexture> picture_texture(const std::string& names, double size, PlaneBlend blend, Scene& scene, Report& report) {
  const std::vector<std::string> files = split(names, ',');
  if (files.size() != 1 && files.size() != 3)
    throw Error(Code::kCommandLine, "--solid-texture", std::to_string(files.size()) + " pictures given", "give one for all planes, or three for x, y and z");
  std::array<std::shared_ptr<const Image>, 3> pictures;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t same = static_cast<std::size_t>(std::find(files.begin(), files.end(), files[files.size() == 1 ? 0 : k]) - files.begin());
    if (same < k) {
      pictures[k] = pictures[same];
      continue;
    }
    const std::string& file = files[k];
    if (std::filesystem::path(file).extension().empty())
      throw Error(Code::kCommandLine, "--solid-texture", "no texture \"" + file + "\"", "give marble, wood, granite or the name of a picture");
    pictures[k] = std::make_shared<const Image>(read_image(file));
    std::error_code ec;
    scene.sources.push_back({file, {}, static_cast<std::int64_t>(std::filesystem::file_size(file, ec))});
    const WrapStep step = wrap_step(*pictures[k]);
    if (const double worst = std::max(step.x, step.y); worst > kSeam) {
      char text[160];
      std::snprintf(text, sizeof text, "the picture does not tile: across its border it changes %.1f times as much along x and %.1f along y as inside; the seams will show", step.x, step.y);
      report.issue("texture-seam", text, 1, file);
    }
  }
  return make_plane_texture(pictures, size, blend);
}

void apply_solid_texture(const Recipe& recipe, Scene& scene, Report& report) {
  if (recipe.solid_texture.empty()) {
    if (recipe.solid_size > 0 || recipe.solid_blend != PlaneBlend::kNormal)
      throw Error(Code::kCommandLine, "--solid-texture", "missing: --solid-size and --solid-blend belong to it", "name a texture");
    return;
  }
  double size = recipe.solid_size;
  if (!(size > 0)) {
    const Box3d box = known_bounds(scene, recipe);
    const V3d side = box.isEmpty() ? V3d(2, 2, 2) : box.size();
    size = std::max({side.x, side.y, side.z}) / 2;
    if (!(size > 0) || !std::isfinite(size)) size = 1;
  }
  SolidKind kind{};
  const std::shared_ptr<const SolidTexture> texture =
      find_solid_texture(recipe.solid_texture, &kind) ? make_solid_texture(kind, size, static_cast<std::uint32_t>(recipe.hypertexture.seed))
                                                      : picture_texture(recipe.solid_texture, size, recipe.solid_blend, scene, report);
  for (Material& material : scene.materials) material.solid = texture;
}

Scene base_scene(const Settings& settings, Report& report);

}  // namespace

bool makes_scene(const Settings& settings) { return !settings.recipe.hypertexture.preset.empty() || !settings.recipe.implicit.empty() || settings.recipe.heights.perlin.period > 0; }

Scene input_scene(const Settings& settings, Report& report) {
  Scene scene = base_scene(settings, report);
  apply_solid_texture(settings.recipe, scene, report);
  return scene;
}

namespace {

Scene base_scene(const Settings& settings, Report& report) {
  const HypertextureOptions& given = settings.recipe.hypertexture;
  if (given.preset.empty()) {
    HypertextureOptions alone = given;
    if (!settings.recipe.solid_texture.empty()) alone.seed = 0;
    if (alone != HypertextureOptions{})
      throw Error(Code::kCommandLine, "--hypertexture", "missing: frequency, octaves, amount, softness, bias, gain, density-scale and seed belong to it", "name a preset");
    return read_scene(settings.inputs, read_options(settings.recipe), report);
  }
  Scene scene;
  if (!settings.inputs.empty() || !settings.recipe.implicit.empty() || settings.recipe.heights.perlin.period > 0) scene = read_scene(settings.inputs, read_options(settings.recipe), report);
  if (!scene.heights.empty())
    throw Error(Code::kUnsupported, scene.heights.front().name, "is a height field, and --hypertexture needs a function", "leave it out for a ball, or give --implicit");
  if (!scene.mesh.triangles.empty() || !scene.instances.empty() || scene.fibres.strands() > 0)
    throw Error(Code::kUnsupported, settings.inputs.front(), "is a mesh, and --hypertexture needs a function", "leave the file out for a ball, or give --implicit");
  if (scene.implicits.size() > 1)
    throw Error(Code::kUnsupported, "--hypertexture", std::to_string(scene.implicits.size()) + " shapes given, and it takes one", "join them into one");
  Hypertexture texture = hypertexture(given);
  if (!scene.implicits.empty()) {
    texture.base = scene.implicits.front().field;
    // Fog is the values themselves, not what they are above the value that would make them a solid.
    texture.iso = texture.preset == HypertexturePreset::kFog ? settings.recipe.iso.value_or(0) : scene.implicits.front().iso;
    scene.implicits.clear();
  } else if (texture.preset == HypertexturePreset::kFog) {
    throw Error(Code::kCommandLine, "--hypertexture fog", "needs an input whose values are a density", "give --implicit or a volume");
  }
  scene.materials.resize(1);
  scene.materials[0].name = given.preset;
  scene.hypertexture = std::move(texture);
  return scene;
}

}  // namespace
}  // namespace texel
