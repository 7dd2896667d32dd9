// Any bytes as .hair: strands, or Error; never a crash, an endless loop or memory beyond the file's.
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  texel::check_reader(texel::read_hair, {data, size}, "nowhere/input.hair");
  return 0;
}
