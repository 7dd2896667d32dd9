// Any bytes as the table of a line tree, of either kind: symbols with files and materials in range, or Error.
#include "formats/plant_files.h"
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  for (const auto read : {read_dta, read_dsp}) {
    Report report;
    try {
      Scene scene;
      for (const PlantSymbol& symbol : read({{data, size}, "nowhere/input.dta"}, report)) {
        demand(!symbol.file.empty());
        scene.materials.push_back(symbol.material);
      }
      check_materials(scene);
    } catch (const Error& e) {
      demand(e.code == Code::kBadInput && !e.where.empty() && !e.message.empty());
    }
  }
  return 0;
}
