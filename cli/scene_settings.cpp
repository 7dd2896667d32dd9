#include "cli/scene_settings.h"

#include <algorithm>
#include <filesystem>

#include "cli/recipe_file.h"
#include "formats/error.h"

namespace texel {

std::function<void(Settings&)> beneath_all(const std::vector<SceneTexel::Recipe>& recipes, const std::string& file) {
  return [recipes, file](Settings& settings) {
    for (const SceneTexel::Recipe& recipe : recipes) apply_recipe_text(recipe.json, recipe.where, file, settings);
  };
}

Settings with_scene_recipes(Command command, Settings settings) {
  std::vector<std::function<void(Settings&)>> all;
  bool any = false, any_gltf = false;
  for (const std::string& input : settings.inputs) {
    std::string extension = std::filesystem::path(input).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
    any_gltf = any_gltf || extension == ".gltf" || extension == ".glb" || extension == ".ops";  // which may place some
    std::error_code ec;
    if (extension != ".json" || !std::filesystem::is_regular_file(input, ec)) continue;  // what is not there is said when it is read
    const std::vector<SceneTexel> texels = list_texels(input);
    if (texels.empty()) continue;
    any = true;
    const SceneTexel& texel = choose_texel(texels, settings.recipe.texel, input);
    if (!texel.recipes.empty()) all.push_back(beneath_all(texel.recipes, input));
  }
  const bool pack = !settings.inputs.empty() && std::filesystem::is_directory(settings.inputs.front());
  if (!any && !any_gltf && settings.recipe.scene >= 0)
    throw Error(Code::kCommandLine, "--scene " + std::to_string(settings.recipe.scene), pack ? "chooses in a glTF file, and a pack is one scene" : "chooses in a glTF file, and no input is one", "leave it out");
  if (!any && !settings.recipe.texel.empty())
    throw Error(Code::kCommandLine, "--texel " + settings.recipe.texel, pack ? "chooses in a scene file, and a pack is one texel" : "chooses in a scene file, and no input is one", "leave it out");
  if (all.empty()) return settings;
  return parse_options(command, settings.words, nullptr, [&](Settings& s) {
    for (const auto& beneath : all) beneath(s);
  });
}

}  // namespace texel
