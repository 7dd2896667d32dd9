#pragma once
// Stage 5: the rays along one axis, followed through the border voxels of each level
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "bake/visibility.h"

namespace texel {

struct InsideRun { std::int32_t u, v, first, last; };  // voxels of a level-0 column that are wholly inside

// Which rays a level uses: every 2^shift-th row, and in it every 2^shift-th ray, staggered, so that there are twice a level-0 voxel's along
// the edge of a voxel of levels 1 and 2, four times on 3 and 4, eight times on 5 and 6, and so on, or `least`, where there are as many. Never fewer than one in
// eight: what the coarsest levels cost is little.
// Rows count from the voxel's first, so that every voxel has the same rays.
inline constexpr int kSeenRays = 32;            // `least` of VisibilityOptions::seen_material
struct RayStep {
  int shift = 0, step = 1;
  RayStep(int level, int rows_per_voxel, int per_row, int least);
  [[nodiscard]] bool row(std::int64_t r) const { return (r & (step - 1)) == step / 2; }
  [[nodiscard]] int first_column(std::int64_t r) const { return static_cast<int>((r >> shift) * 7 & (step - 1)); }
};

// Rows of a bundle that one of the levels [first, last) uses.
[[nodiscard]] std::vector<char> used_rows(const Bundle& bundle, int first, int last, int least);

struct AxisRays {
  // Of one axis, each with its own pattern; a column's rays are traced by one of them, and so are those of all columns of a tile (8 × 8).
  std::span<const Bundle> bundles;
  std::span<const Surface> surfaces;
  const VisibilityOptions& options;
  const SliceShader& shade;
  bool plain = false;                           // opacity is the rays' mean alone, without what is exactly known (opacity.h)
};

// What they find. By voxel of level 0 unless said; null: not wanted.
struct AxisFound {
  VisibilityResult& result;                     // alpha of the axis, visible
  SlabSums& slabs;                              // slices, begins_inside, inside
  std::vector<float>* lengths = nullptr;        // inside length, voxels, mean of the rays
  std::vector<double>* exact_solid = nullptr;   // filled fraction where exactly known, else left alone; rays along z only
  std::vector<std::vector<InsideRun>>* runs = nullptr;  // per band; rays along z only
  std::vector<float>* doubt = nullptr;          // see doubt() of opacity.h
};

// Returns how many crossings there are.
std::int64_t see_axis(const AxisRays& rays, const AxisFound& found, const std::function<void(double)>& progress);

}  // namespace texel
