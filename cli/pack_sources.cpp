#include "cli/pack_sources.h"

#include <algorithm>
#include <filesystem>

#include "bake/height_mesh.h"
#include "bake/polygonize.h"
#include "cli/input_scene.h"
#include "cli/recipe_file.h"
#include "formats/error.h"
#include "formats/write.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

// A truth that is not the pack's own would be a misleading comparison.
void warn_of_other_sources(const std::vector<SourceFile>& baked_from, const Scene& scene, Report& report) {
  for (const SourceFile& read : scene.sources) {
    const std::string sum = file_sha256(read.path);
    const auto same = [&](const SourceFile& kept) { return kept.sha256 == sum; };
    if (std::none_of(baked_from.begin(), baked_from.end(), same))
      report.issue("source-differs", "the file is not the one the pack was baked from (another sha256)", 1, read.path);
  }
}

}  // namespace

Recipe recorded_recipe(const std::string& pack) {
  Settings baked;
  baked.inputs = {pack};
  try {
    read_recipe_file(pack, baked);
  } catch (const Error&) {
    return {};
  }
  return baked.recipe;
}

Settings sources_of(const Settings& settings) {
  const std::string& pack = settings.inputs.front();
  Settings baked;
  baked.inputs.assign(settings.inputs.begin() + 1, settings.inputs.end());
  const bool named = !baked.inputs.empty();
  try {
    read_recipe_file(pack, baked);
  } catch (const Error&) {
    if (!named) baked.inputs = manifest_meshes((fs::path(pack) / "manifest.json").string());
  }
  return baked;
}

Scene source_scene(const Settings& settings, const std::vector<SourceFile>& baked_from, Report& report) {
  const Settings baked = sources_of(settings);
  if (baked.inputs.empty() && !makes_scene(baked)) throw Error(Code::kBadInput, settings.inputs.front(), "names no source mesh", "name the mesh as a further argument");
  Scene scene = input_scene(baked, report);
  warn_of_other_sources(baked_from, scene, report);
  return scene;
}

Scene meshed(Scene scene, const Recipe& recipe, Report& report) { return polygonize(mesh_heights(std::move(scene), recipe, report), recipe, report); }

}  // namespace texel
