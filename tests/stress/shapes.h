#pragma once
// Triangles and solids that are hard on numbers. Everything follows from the generator's numbers. Test code only.
#include "tests/stress/stress.h"

namespace texel::stress {

// A number 10^e, e uniform; and one of ±.
[[nodiscard]] double decade(Random& random, double low, double high);
[[nodiscard]] int below(Random& random, int n);
[[nodiscard]] V3d point_in(Random& random, const V3d& size);

// A multiple of 2^-bits in [0, n].
[[nodiscard]] double on_lattice(Random& random, int n, int bits);
// Where one of the sub-rays of `samples` a voxel edge stands, in [0, n]: exactly, where `samples` is a power of two.
[[nodiscard]] double on_ray(Random& random, int n, int samples);

// A triangle of this longest side within [0, n]³ and an aspect ratio of 1 to 10^most: a needle (short side) or a sliver (low height).
void add_thin(Scene& scene, Random& random, const V3d& n, double length, double most);
// A tetrahedron, turned outwards; without volume it stays as it comes.
void add_tetrahedron(Scene& scene, const V3d& a, const V3d& b, const V3d& c, const V3d& d, bool inside_out = false);
// A closed ball of triangles whose points go through `place` after they are made: whatever that does, it stays closed.
void add_lump(Scene& scene, const V3d& centre, double radius, int rings, const std::function<V3d(const V3d&)>& place);

}  // namespace texel::stress
