#pragma once
// Texel scenes (docs/scenes.md): inputs placed by transforms, once or many times, and the texels that are made of them.
// All throw Error{kBadInput} that names the path in the file; bytes of any kind are safe.
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "formats/report.h"
#include "formats/scene.h"
#include "formats/text_scanner.h"

namespace texel {

// Whether JSON text says that it is a scene; `first_key_only`: with its first key, so that nothing else has to be looked at.
[[nodiscard]] bool is_scene_file(std::span<const char> bytes, bool first_key_only = false);

// What a scene bakes.
struct SceneTexel {
  struct Recipe {
    std::string json;      // object of options
    std::string where;     // FILE: /texels/2/recipe
  };
  std::string name;        // one part of a path, not hidden; empty: the objects stand at the top of the file
  std::vector<Recipe> recipes;  // the top's, then the texel's own, which beats it; those there are
};
[[nodiscard]] std::vector<SceneTexel> list_texels(const Input& input);
// The same of a file; empty where it is no scene. Throws Error{kFile} where it cannot be read.
[[nodiscard]] std::vector<SceneTexel> list_texels(const std::string& path);
// The one of that name; of a single one no name is needed. Throws Error{kBadInput} that says what there is.
[[nodiscard]] const SceneTexel& choose_texel(const std::vector<SceneTexel>& texels, const std::string& name, const std::string& path);

struct SceneInput {
  std::string path;        // a file that is there
  double unit = 0;         // metres one of its units is; 0: not said
  std::string texel;       // of a scene; may be empty
  int scene = -1;          // of a glTF file; below 0: not said
};
// How a scene comes by what it names.
struct SceneFiles {
  std::function<Scene(const SceneInput& input)> read;                                              // its own scene, sources included
  std::function<void(const std::string& path, const std::function<void(const Input&)>& use)> open; // the bytes of a table
  std::function<bool(const std::string& path)> is_file;
};

// The scene of one texel. What is placed once becomes triangles of the mesh, in the order of the inputs' names; what is placed more often one mesh of
// Scene::shapes, with an instance for each placement in the file's order. Inputs that are never placed are not read.
// Bounds: 2^24 placements (104 bytes each), groups nested 32 deep, 32 MiB of JSON.
[[nodiscard]] Scene read_scene_file(const Input& input, const std::string& texel, const SceneFiles& files, Report& report);

// What keys an object of the file may have, by the object's name in docs/scene.schema.json.
struct SceneKeys {
  const char* object;
  std::span<const char* const> keys;
};
[[nodiscard]] std::span<const SceneKeys> scene_keys();

}  // namespace texel
