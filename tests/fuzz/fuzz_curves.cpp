// Any bytes as .xml of curves: strands, or Error; never a crash, an endless loop or an invalid index.
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  texel::check_reader(texel::read_curves, {data, size}, "nowhere/input.xml");
  return 0;
}
