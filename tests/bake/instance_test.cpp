// Instances: the same pack as their triangles copied, for the memory of one.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "bake/bake.h"
#include "bake/plan.h"
#include "formats/instances.h"
#include "formats/read.h"
#include "tests/bake/shapes.h"

namespace texel {
namespace {

Affine placement(const V3d& at, const V3d& axis, double angle, const V3d& scale) {
  const double c = std::cos(angle), s = std::sin(angle), k = 1 - c;
  const V3d a = axis.normalized();
  const double r[3][3] = {{c + k * a.x * a.x, k * a.x * a.y - s * a.z, k * a.x * a.z + s * a.y},
                          {k * a.y * a.x + s * a.z, c + k * a.y * a.y, k * a.y * a.z - s * a.x},
                          {k * a.z * a.x - s * a.y, k * a.z * a.y + s * a.x, c + k * a.z * a.z}};
  Affine m;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) m.m[4 * i + j] = r[i][j] * scale[static_cast<int>(j)];
    m.m[4 * i + 3] = at[static_cast<int>(i)];
  }
  return m;
}

}  // namespace
}  // namespace texel
