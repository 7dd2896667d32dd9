// Any bytes as .off: a scene, or Error; never a crash, an endless loop or an invalid index.
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  texel::check_reader(texel::read_off, {data, size}, "nowhere/input.off");
  return 0;
}
