#include "tests/stress/shapes.h"

#include <algorithm>
#include <cmath>

namespace texel::stress {

double decade(Random& random, double low, double high) { return std::pow(10.0, random.uniform(low, high)); }
int below(Random& random, int n) { return static_cast<int>(random.bits() % static_cast<std::uint64_t>(n)); }
V3d point_in(Random& random, const V3d& size) {
  const double x = random.uniform(), y = random.uniform(), z = random.uniform();
  return V3d(x, y, z) * size;
}

double on_lattice(Random& random, int n, int bits) { return std::ldexp(static_cast<double>(random.bits() % ((static_cast<std::uint64_t>(n) << bits) + 1)), -bits); }
double on_ray(Random& random, int n, int samples) {
  const int voxel = below(random, n), ray = below(random, samples);
  return voxel + (2 * ray + 1) * 0.5 / samples;
}

void add_thin(Scene& scene, Random& random, const V3d& n, double length, double most) {
  const double thin = length / decade(random, 0, most);
  const V3d a = point_in(random, n);
  V3d along = random.direction(), across = random.direction();
  if (below(random, 4) == 0) {  // in a plane of the axes
    along[below(random, 3)] = 0;
    if (!(along.length() > 0)) along = V3d(1, 0, 0);
    along.normalize();
  }
  if (below(random, 6) == 0) {  // along an axis
    along = V3d(0);
    along[below(random, 3)] = below(random, 2) ? 1 : -1;
  }
  const V3d b = a + along * length;
  const V3d c = a + along * (below(random, 2) ? length * random.uniform() : 0) + across * thin;
  const int turn = below(random, 3);
  const V3d p[3] = {a, b, c};
  test::add_triangle(scene, p[turn], p[(turn + 1) % 3], p[(turn + 2) % 3]);
}

void add_tetrahedron(Scene& scene, const V3d& a, const V3d& b, const V3d& c, const V3d& d, bool inside_out) {
  const bool turned = ((b - a).cross(c - a).dot(d - a) > 0) != inside_out;  // d lies on the side that (a, b, c) faces
  const auto p = static_cast<std::uint32_t>(scene.mesh.points.size());
  for (const V3d& v : {a, b, c, d}) scene.mesh.points.push_back(v);
  const std::array<std::array<std::uint32_t, 3>, 4> faces{{{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}};
  for (const auto& f : faces) {
    scene.mesh.triangles.push_back(turned ? std::array<std::uint32_t, 3>{p + f[0], p + f[2], p + f[1]} : std::array<std::uint32_t, 3>{p + f[0], p + f[1], p + f[2]});
    scene.mesh.uv_corners.push_back({kNoIndex, kNoIndex, kNoIndex});
    scene.mesh.materials.push_back(0);
  }
}

void add_lump(Scene& scene, const V3d& centre, double radius, int rings, const std::function<V3d(const V3d&)>& place) {
  const std::size_t first = scene.mesh.points.size();
  test::add_ball(scene, radius, rings);
  for (std::size_t i = first; i < scene.mesh.points.size(); ++i) scene.mesh.points[i] = place(scene.mesh.points[i] + centre);
}

}  // namespace texel::stress
