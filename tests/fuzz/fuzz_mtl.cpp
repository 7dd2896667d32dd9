// Any bytes as .mtl: materials whose values are in their ranges.
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  texel::Report report;
  texel::Scene scene;
  for (const texel::MtlMaterial& m : texel::read_mtl({{data, size}, "nowhere/input.mtl"}, report)) (void)texel::add_mtl_material(m, scene, report);
  texel::check_materials(scene);
  return 0;
}
