// Any bytes as .lig, with a table of two symbols one of which has no file: a scene, or Error.
#include "formats/plant_files.h"
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  check_reader([](const Input& input, Report& report) {
    const std::vector<PlantSymbol> table = {{1, "there", plain_organ()}, {2, "missing", plain_organ()}};
    const auto load = [](const std::string& file, PlantMesh& mesh) {
      mesh = {{V3d(0, 0, 0), V3d(1, 0, 0), V3d(0, 1, 0)}, {{0, 1, 2}}, 0, 1};
      return file == "there";
    };
    return plant_scene(read_lig(input, table, load, report), {}, report, input.path);
  }, {data, size}, "nowhere/input.lig");
  return 0;
}
