#include "cli/input_scene.h"

#include <string>
#include <utility>

#include "formats/error.h"
#include "formats/read.h"

namespace texel {
namespace {

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

}  // namespace

bool makes_scene(const Settings& settings) { return !settings.recipe.hypertexture.preset.empty() || !settings.recipe.implicit.empty(); }

Scene input_scene(const Settings& settings, Report& report) {
  const HypertextureOptions& given = settings.recipe.hypertexture;
  if (given.preset.empty()) {
    if (given != HypertextureOptions{})
      throw Error(Code::kCommandLine, "--hypertexture", "missing: frequency, octaves, amount, softness, bias, gain, density-scale and seed belong to it", "name a preset");
    return read_scene(settings.inputs, {settings.recipe.implicit, settings.recipe.iso}, report);
  }
  Scene scene;
  if (!settings.inputs.empty() || !settings.recipe.implicit.empty()) scene = read_scene(settings.inputs, {settings.recipe.implicit, settings.recipe.iso}, report);
  if (!scene.mesh.triangles.empty())
    throw Error(Code::kUnsupported, settings.inputs.front(), "is a mesh, and --hypertexture needs a function", "leave the file out for a ball, or give --implicit");
  if (scene.implicits.size() > 1)
    throw Error(Code::kUnsupported, "--hypertexture", std::to_string(scene.implicits.size()) + " shapes given, and it takes one", "join them into one");
  Hypertexture texture = hypertexture(given);
  if (!scene.implicits.empty()) {
    texture.base = scene.implicits.front().field;
    texture.iso = scene.implicits.front().iso;
    scene.implicits.clear();
  } else if (texture.preset == HypertexturePreset::kFog) {
    throw Error(Code::kCommandLine, "--hypertexture fog", "needs an input whose values are a density", "give --implicit or a volume");
  }
  scene.materials.resize(1);
  scene.materials[0].name = given.preset;
  scene.hypertexture = std::move(texture);
  return scene;
}

}  // namespace texel
