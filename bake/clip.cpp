#include "bake/clip.h"

namespace texel {

void split(const Polygon& p, int axis, double wall, Polygon& below, Polygon& above) {
  below.n = above.n = 0;
  V3d previous = p.v[static_cast<std::size_t>(p.n - 1)];
  double dp = previous[axis] - wall;
  for (int i = 0; i < p.n; ++i) {
    const V3d& current = p.v[static_cast<std::size_t>(i)];
    const double dc = current[axis] - wall;
    if ((dp < 0 && dc > 0) || (dp > 0 && dc < 0)) {
      // Always from the lower to the upper end, so that two polygons sharing the edge get the same corner.
      const V3d& low = dp < 0 ? previous : current;
      const V3d& high = dp < 0 ? current : previous;
      const double dl = dp < 0 ? dp : dc, dh = dp < 0 ? dc : dp;
      V3d cut = low + (high - low) * (dl / (dl - dh));
      cut[axis] = wall;
      below.add(cut);
      above.add(cut);
    }
    if (dc <= 0) below.add(current);
    if (dc >= 0) above.add(current);
    previous = current;
    dp = dc;
  }
}

double polygon_area(const Polygon& p, const V3d& normal, double* height) {
  int axis = 0;
  if (std::abs(normal.y) > std::abs(normal[axis])) axis = 1;
  if (std::abs(normal.z) > std::abs(normal[axis])) axis = 2;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  double twice = 0, above = 0;
  const V3d& o = p.v[0];
  for (int i = 1; i + 1 < p.n; ++i) {
    const V3d& a = p.v[static_cast<std::size_t>(i)];
    const V3d& b = p.v[static_cast<std::size_t>(i + 1)];
    const double part = (a[u] - o[u]) * (b[v] - o[v]) - (a[v] - o[v]) * (b[u] - o[u]);
    twice += part;
    above += part * ((a.z - o.z) + (b.z - o.z)) / 3;
  }
  if (height) *height = o.z + (twice != 0 ? above / twice : 0);
  return std::abs(twice / (2 * normal[axis]));
}

}  // namespace texel
