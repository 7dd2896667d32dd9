#pragma once
// A pack's level as a texel that is repeated: matter by direction, facets, and where nothing is, on from one side of the box to the other.
#include <array>
#include <memory>
#include <mutex>
#include <vector>

#include "bake/view_voxels.h"

namespace texel {

// What LitVoxel is, without light: opacity of one voxel edge along a direction.
struct Matter {
  float alpha = 0, sheet = 0, solid = 0, full = 0, body = 0;
};

// Places are in voxels of the level, from the box's lowest corner. Along `wrap` axes they lie in [0, period) and neighbours are found on the other side; along
// the others the outermost voxels go on. Voxels that reach beyond the box (counts of coarser levels are rounded up) are taken as the part of them within it.
class TexelLevel {
 public:
  // Keeps a reference to `level`. `extent`: the box in voxels of this level; `sheets`: as LitLevel's. Throws as it.
  TexelLevel(const Level& level, const V3d& extent, const std::array<bool, 3>& wrap, bool sheets);

  [[nodiscard]] double h() const { return level_.grid.h; }
  [[nodiscard]] const V3d& period() const { return extent_; }
  // `p` moved by whole periods into the box.
  [[nodiscard]] V3d home(const V3d& p) const;
  // Edge in voxels (8, 4 or 2) of the aligned cell about `p` that interpolation finds nothing in; 0: it may find something. Thread-safe.
  [[nodiscard]] int empty_cell(const V3d& p) const;
  // Interpolated as LitLevel::at, along unit direction `d`, whose main axis is `axis`. Thread-safe.
  [[nodiscard]] Matter at(const V3d& p, const V3d& d, int axis) const;
  // Mean of the facets about `p`, weighted by the opacity of their voxels; its weight, 0 where there are none. Thread-safe.
  [[nodiscard]] double facets(const V3d& p, Facets* mean) const;
  // Optical depth of one voxel edge along unit direction `d` in the voxel `p` is in; below 0: nothing in its whole 8³ block. Thread-safe.
  [[nodiscard]] double depth(const V3d& p, const V3d& d) const;

 private:
  // A voxel's matter, still for all directions.
  struct Voxel {
    AxisOpacity opacity;                // of what lies within the box
    V3f within{1, 1, 1};                // edges of what of the voxel lies within the box
    float even = -1;                    // optical depth alike in all directions; below 0: `opacity` tells
    float sheet = 0;                    // share of opacity
    float bounds = 0;                   // (|m|/A)² of a solid's surface
    float solid = 0, behind = 1;        // filled share, and the fullest of what lies behind its surface
    bool surface = false, known = false;
  };
  using Block = std::array<Voxel, 512>;
  struct Slot {
    std::once_flag once;
    std::unique_ptr<Block> block;
  };
  struct Place {
    std::uint64_t near = 0;
    bool filled = false;
  };

  [[nodiscard]] V3i around(V3i voxel) const;
  [[nodiscard]] const Voxel* find(const V3i& voxel) const;
  [[nodiscard]] Voxel prepared(const V3i& voxel) const;
  [[nodiscard]] static double depth(const Voxel& voxel, const V3d& d);
  [[nodiscard]] float share_within(int axis, int index) const;

  const Level& level_;
  V3d extent_;
  std::array<bool, 3> wrap_;
  bool sheets_;
  VoxelField alpha_, crossings_, density_, solid_, diagonal_, off_, normal_, albedo_, ks_, roughness_, transparency_, emission_;
  V3i blocks_{0, 0, 0};
  std::vector<std::int32_t> place_of_;
  std::vector<Place> places_;
  std::unique_ptr<Slot[]> slots_;
};

}  // namespace texel
