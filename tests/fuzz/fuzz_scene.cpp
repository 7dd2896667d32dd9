// Any bytes as a texel-scene file, and what follows a zero byte as its table of places: an Error, or a scene whose instances can be used.
#include <algorithm>

#include "formats/read_scene_file.h"
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  const char* const end = data + size;
  const char* const zero = std::find(data, end, '\0');
  const Input table{{zero == end ? end : zero + 1, end}, "nowhere/p.csv"};
  SceneFiles files;
  files.is_file = [](const std::string& path) { return path.find("none") == std::string::npos; };
  files.open = [&](const std::string&, const std::function<void(const Input&)>& use) { use(table); };
  files.read = [](const SceneInput& input) {
    demand(input.unit >= 0 && std::isfinite(input.unit));
    Scene scene;
    scene.mesh.points = {V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0)};
    scene.mesh.triangles = {{0, 1, 2}};
    scene.mesh.materials = {0};
    scene.materials.push_back(plain_color("leaf", V3f(0.5f, 0.5f, 0.5f)));
    if (input.path.find("pair") != std::string::npos) {  // a scene
      scene.shapes = {scene.mesh};
      scene.instances = {{0, Affine()}, {0, Affine::scale(2)}};
    }
    if (input.path.find("hair") != std::string::npos) {  // many points, so that the limit of copies comes before the memory of placements
      if (input.path.find("alone") != std::string::npos) scene.mesh = {};
      for (int i = 0; i < 40; ++i) {
        scene.fibres.points.push_back(V3d(0, 0, i));
        scene.fibres.radii.push_back(i % 2);
      }
      scene.fibres.first.push_back(40);
      scene.fibres.materials = {0};
    }
    return scene;
  };
  Report report;
  try {
    const Input input{{data, zero}, "nowhere/s.json"};
    (void)is_scene_file(input.bytes);
    for (const SceneTexel& texel : list_texels(input)) {
      Scene scene = read_scene_file(input, texel.name, files, report);
      check_scene(scene);
    }
  } catch (const Error& e) {
    demand((e.code == Code::kBadInput || e.code == Code::kUnsupported || e.code == Code::kFile) && !e.where.empty() && !e.message.empty());
  }
  return 0;
}
