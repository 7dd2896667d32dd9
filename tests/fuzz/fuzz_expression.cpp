// Any text as an expression: an Error with a column, or a function whose values lie in its ranges and whose NaN they announce.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "formats/expression.h"
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  std::shared_ptr<const Field> field;
  try {
    field = read_expression({data, size});
  } catch (const Error& e) {
    demand(e.code == Code::kCommandLine && e.where.starts_with("--implicit:") && !e.message.empty());
    return 0;
  }
  const Box3d boxes[] = {Box3d(V3d(-1, -1, -1), V3d(1, 1, 1)), Box3d(V3d(0.25, 2, -3), V3d(0.375, 2.125, -2.5)), Box3d(V3d(-1e9, 0, 1e-9), V3d(1e9, 1e-300, 2e-9))};
  for (const Box3d& box : boxes) {
    const Interval range = field->range(box);
    double x[9], y[9], z[9], f[9], g[9], gx[9], gy[9], gz[9];
    for (int i = 0; i < 9; ++i) {
      x[i] = i == 8 ? (box.min.x + box.max.x) / 2 : i & 1 ? box.max.x : box.min.x;
      y[i] = i == 8 ? (box.min.y + box.max.y) / 2 : i & 2 ? box.max.y : box.min.y;
      z[i] = i == 8 ? (box.min.z + box.max.z) / 2 : i & 4 ? box.max.z : box.min.z;
    }
    field->values(9, x, y, z, f);
    field->gradients(9, x, y, z, g, gx, gy, gz);
    for (int i = 0; i < 9; ++i) {
      demand(f[i] == g[i] || (std::isnan(f[i]) && std::isnan(g[i])));
      if (!std::isnan(range.low) && !std::isnan(range.high)) demand(f[i] >= range.low && f[i] <= range.high);
    }
  }
  if (size < 200) (void)field->bounds(0);
  return 0;
}
