#pragma once
// Surface, rays -> opacity and normals of voxels by random rays in each of them: the baseline `texel bench` measures against
#include <array>
#include <cstdint>
#include <vector>

#include "bake/light.h"
#include "bake/plan.h"
#include "bake/surface.h"

namespace texel {

struct RandomRays {
  int rays = 64;               // a voxel and axis
  std::uint32_t seed = 0;
  bool normals = false;        // count those of the first and the last surface each ray meets, all alike
};

struct RandomRaysLevel {
  std::array<std::vector<float>, 3> alpha;       // per axis and voxel of the level's set
  std::vector<std::array<double, 128>> bins;     // normals, by normal_bin of ndf_fits.h; empty where not asked for
};

// Every border voxel of one level by itself, as G. Ratib, "Textures volumiques et multi-échelles", 1997, §3.3: rays parallel to an axis from random places of a face to
// the opposite face; opacity is the share that is stopped, the normals are those met first and last. Where matter is filled a ray that meets nothing
// counts as stopped if the next surface behind it is met from the inside (so no opacity is wrong by definition; he gives it only to voxels).
// Embree's single rays. Places are a function of seed, level, voxel and ray. Standard error √(α(1−α)/rays); cost: one to three rays each.
[[nodiscard]] RandomRaysLevel trace_random_rays(const Scene& scene, const Plan& plan, const RayScene& rays, const VoxelSet& set, int level, const RandomRays& options);

}  // namespace texel
