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
    return scene;
  };
  Report report;
  try {
    const Input input{{data, zero}, "nowhere/s.json"};
    (void)is_scene_file(input.bytes);
    for (const SceneTexel& texel : list_texels(input)) {
      Scene scene = read_scene_file(input, texel.name, files, report);
      demand(!scene.mesh.triangles.empty() || !scene.instances.empty());
      for (const Instance& instance : scene.instances) {
        demand(instance.shape < scene.shapes.size());
        for (const Mesh& shape : scene.shapes) demand(instance.place.reach(mesh_reach(shape)) <= 1e101);
      }
      if (!scene.mesh.triangles.empty()) check_scene(scene);
      for (Mesh& shape : scene.shapes) {
        scene.mesh = std::move(shape);
        check_scene(scene);
      }
    }
  } catch (const Error& e) {
    demand((e.code == Code::kBadInput || e.code == Code::kUnsupported || e.code == Code::kFile) && !e.where.empty() && !e.message.empty());
  }
  return 0;
}
