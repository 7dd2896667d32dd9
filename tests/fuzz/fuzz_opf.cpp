// Any bytes as .opf or .gwa: a plant whose organs can be placed, or Error.
#include "formats/plant.h"
#include "formats/xml.h"
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  const std::string_view root = xml_root({data, size});
  demand(root.size() < size || size == 0);
  check_reader([](const Input& input, Report& report) { return plant_scene(read_opf(input, report), {}, report, input.path); }, {data, size}, "nowhere/input.opf");
  return 0;
}
