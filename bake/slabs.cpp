#include "bake/slabs.h"

#include <algorithm>
#include <cmath>

namespace texel {
namespace {

// Per border voxel, at the most of what is held at once: clipped parts and their join, coarser levels, what the rays find.
double bytes_per_voxel(const SurfaceWant& want, const VisibilityOptions& options) {
  double sums = sizeof(Areas);
  if (want.normals) sums += sizeof(Moments);
  if (want.lobes) sums += sizeof(Lobes);
  if (want.color) sums += sizeof(V3d);
  if (want.material) sums += sizeof(MaterialSums);
  const double seen = 12 + 4 + 8 + 12 + (options.slice_axes[0] || options.slice_axes[1] || options.slice_axes[2] ? 8 : 0) + (options.visible_normals ? double{sizeof(Moments)} : 0) +
                      (options.seen_material.any() ? double{sizeof(SeenMaterial)} : 0);
  return 2 * sums + seen;
}

}  // namespace

double expected_voxels(const Scene& scene, const Plan& plan) {
  const Box3d grid(V3d(0, 0, 0), V3d(plan.grid.n));
  const auto of_box = [](const V3d& extent) { return (1 + extent.x) * (1 + extent.y) * (1 + extent.z); };
  double voxels = 0;
  for (const auto& t : scene.mesh.triangles) {
    Box3d box;
    for (const std::uint32_t v : t) box.extendBy(plan.points[v]);
    if (!box.intersects(grid)) continue;
    const V3d &a = plan.points[t[0]], &b = plan.points[t[1]], &c = plan.points[t[2]], cross = (b - a).cross(c - a), extent = box.size();
    const double whole = 1 + extent.x + extent.y + extent.z + (std::abs(cross.x) + std::abs(cross.y) + std::abs(cross.z)) / 2;
    for (int k = 0; k < 3; ++k) {
      box.min[k] = std::max(box.min[k], grid.min[k]);
      box.max[k] = std::min(box.max[k], grid.max[k]);
    }
    voxels += std::min(whole, of_box(box.size()));
  }
  for (const FibreSegment& f : plan.fibres) {
    const V3d d = f.b - f.a;
    voxels += 1 + std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  }
  for (const Placed& placed : plan.placed) {
    Box3d box = placed.box;
    if (!box.intersects(grid)) continue;
    for (int k = 0; k < 3; ++k) {
      box.min[k] = std::max(box.min[k], grid.min[k]);
      box.max[k] = std::min(box.max[k], grid.max[k]);
    }
    voxels += of_box(box.size());
  }
  return std::min(voxels, static_cast<double>(plan.grid.n.x) * plan.grid.n.y * plan.grid.n.z);
}

SlabPlan plan_slabs(const Scene& scene, const Plan& plan, const SurfaceWant& want, const VisibilityOptions& options, const Recipe& recipe) {
  constexpr int kLevels = 4, kThickness = 8 << (kLevels - 1);
  constexpr double kLeast = 1 << 16;  // voxels: below, a slab is more trouble than it saves
  SlabPlan slabs;
  slabs.levels = kLevels;
  const double memory = (recipe.memory > 0 ? static_cast<double>(recipe.memory) : kUsualMemory) / 2;
  slabs.voxels = static_cast<std::int64_t>(std::max(kLeast, memory / bytes_per_voxel(want, options)));
  slabs.thickness = (plan.grid.n.z + 7) / 8 * 8;
  if (plan.grid.n.z <= kThickness || expected_voxels(scene, plan) <= static_cast<double>(slabs.voxels)) return slabs;
  slabs.thickness = kThickness;
  return slabs;
}

}  // namespace texel
