// Any bytes as .obj: a scene, or Error; never a crash, an endless loop or an invalid index.
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  texel::check_reader([](const texel::Input& input, texel::Report& report) { return texel::read_obj(input, {}, report); }, {data, size}, "nowhere/input.obj");
  return 0;
}
