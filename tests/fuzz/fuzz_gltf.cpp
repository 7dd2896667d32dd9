// Any bytes as .gltf or .glb: a scene, or Error; never a crash, an endless loop, an invalid index or memory out of proportion.
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  check_reader(
      [](const Input& input, Report& report) {
        try {
          return read_gltf(input, {.most_triangles = 1 << 16, .most_instances = 1 << 12}, report);
        } catch (const Error& e) {
          if (e.code != Code::kFile) throw;
          throw Error(Code::kBadInput, e.where, e.message);  // a buffer's file that is not there
        }
      },
      {data, size}, "nowhere/input.glb");
  return 0;
}
