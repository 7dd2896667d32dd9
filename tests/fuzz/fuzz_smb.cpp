// Any bytes as .smb: a shape that can be placed, or Error.
#include "formats/plant_files.h"
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  check_reader([](const Input& input, Report& report) {
    Plant plant;
    plant.meshes.push_back(read_smb(input, report));
    plant.materials.push_back(plain_organ());
    plant.organs.emplace_back();
    plant.organs.back().base = 2;
    plant.organs.back().tip = 0.5;
    return plant_scene(plant, {}, report, input.path);
  }, {data, size}, "nowhere/input.smb");
  return 0;
}
