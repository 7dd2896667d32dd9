#pragma once
// The reference volume: an axis-aligned box of cubic voxels. The half-voxel rule lives here and nowhere else.
#include <Imath/ImathBox.h>
#include <Imath/ImathVec.h>
#include <array>
#include <cstdint>

namespace texel {

using Imath::Box3d;
using Imath::V2f;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;

// Voxel (i,j,k), 0 <= i < n.x …, is the cell origin + h·[i,i+1]×[j,j+1]×[k,k+1]; its centre is at +½.
// Three spaces are used throughout, all double: *world* (the source's own units), *voxel* (world − origin)/h, in which
// cell walls are the integers, and OpenVDB's *index* space, in which cell centres are: index = voxel − ½.
struct Grid {
  V3d origin{0, 0, 0};  // lowest corner, world
  double h = 1;         // voxel edge, world units; > 0
  V3i n{1, 1, 1};       // voxels along x, y, z; each >= 1

  [[nodiscard]] V3d to_voxel(const V3d& world) const { return (world - origin) / h; }
  [[nodiscard]] V3d to_world(const V3d& voxel) const { return origin + voxel * h; }
  [[nodiscard]] V3d centre(const V3i& ijk) const { return to_world(V3d(ijk.x + 0.5, ijk.y + 0.5, ijk.z + 0.5)); }
  [[nodiscard]] Box3d box() const { return {origin, origin + V3d(n.x, n.y, n.z) * h}; }
  [[nodiscard]] std::int64_t voxels() const { return std::int64_t{n.x} * n.y * n.z; }

  // Level l: edge h·2^l, the same origin, counts halved and rounded up, so outer cells may reach beyond the level-0 box.
  [[nodiscard]] Grid level(int l) const {
    const int add = (1 << l) - 1;
    return {origin, h * static_cast<double>(1 << l), V3i((n.x + add) >> l, (n.y + add) >> l, (n.z + add) >> l)};
  }
};

}  // namespace texel
