// Any bytes as .ply: a scene, or Error; never a crash, an endless loop or an invalid index.
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  texel::check_reader(texel::read_ply, {data, size}, "nowhere/input.ply");
  return 0;
}
