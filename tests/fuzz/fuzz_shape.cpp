// Any bytes as a texel-shape file: an Error, or one solid of one material with a function that can be asked.
#include <cstdint>

#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  Report report;
  try {
    const Scene scene = read_shape({{data, size}, "nowhere/input.json"}, {}, report);
    demand(scene.implicits.size() == 1 && scene.implicits[0].field && scene.implicits[0].material < scene.materials.size());
    check_materials(scene);
    const double x = 0.5, y = -1, z = 2;
    double f = 0, gx = 0, gy = 0, gz = 0;
    scene.implicits[0].field->gradients(1, &x, &y, &z, &f, &gx, &gy, &gz);
  } catch (const Error& e) {
    demand((e.code == Code::kBadInput || e.code == Code::kUnsupported) && !e.where.empty() && !e.message.empty());
  }
  return 0;
}
