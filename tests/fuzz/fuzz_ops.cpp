// Any bytes as .ops: rows whose placements can be used and whose names stay in the scene's folder, or Error.
#include "formats/plant_files.h"
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  check_reader([](const Input& input, Report& report) {
    Plant plant;
    plant.meshes.push_back({{V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0)}, {{0, 1, 2}}, 0, 1});
    plant.materials.push_back(plain_organ());
    plant.organs.emplace_back();
    Scene scene;
    scene.materials = plant.materials;
    for (const OpsRow& row : read_ops_rows(input, {}, report)) {
      demand(!row.file.empty() && row.file.front() != '/' && row.file != ".." && !row.file.starts_with("../") && row.file.find("/../") == std::string::npos);
      place_plant(plant, row.placement, 0, scene, report, row.where);
    }
    finish_mesh(scene, report, input.path, "places nothing");
    return scene;
  }, {data, size}, "nowhere/input.ops");
  return 0;
}
