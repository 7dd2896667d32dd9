#pragma once
// A pack's level made ready to be looked at: fast lookup, and voxels lit for one eye, block by block when a ray first gets there.
#include <array>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "bake/direction_opacity.h"
#include "bake/facets.h"
#include "formats/pack.h"

namespace texel {

// One channel of a level, by voxel.
class VoxelField {
 public:
  VoxelField() = default;
  // Absent where the level has no such channel. Throws Error{kBadInput} where it has other components or fewer values than voxels.
  VoxelField(const Level& level, const std::string& name, int components);

  [[nodiscard]] bool present() const { return channel_ != nullptr; }
  // The voxel's values; null where it is not active or outside the grid.
  [[nodiscard]] const float* at(const V3i& voxel) const;
  [[nodiscard]] V3f color(const V3i& voxel, const V3f& otherwise) const;
  [[nodiscard]] float value(const V3i& voxel, float otherwise) const;
  [[nodiscard]] bool has_block(const V3i& block) const;
  [[nodiscard]] const Layer* layer() const { return layer_; }

 private:
  const Layer* layer_ = nullptr;
  const Channel* channel_ = nullptr;
  V3i blocks_{0, 0, 0};
  std::vector<std::int32_t> slots_;  // per block of the grid: 0 none, i + 1 block i, −(i + 1) tile i
};

// A voxel as the eye sees it.
struct LitVoxel {
  float alpha = 0;     // of the surfaces: opacity of one voxel edge along the line of sight; between voxels: the optical depth
  float sheet = 0;     // opacity · how far the surfaces are one open sheet, (|m|/A)² or as S tells
  float solid = 0;     // how much of it a solid hides: its filled share, or opacity where it is too thin to fill a voxel
  float full = 0;      // sheet · what its parts hide beyond opacity where they add up (sheet_along)
  float body = 0;      // opacity · how far the surfaces bound a solid thicker than the voxel, (|m|/A)²; 0 without solid
  float known = 0;     // weight of `light`; 0: inside a solid, the ray's last colour goes on
  V3f light{0, 0, 0};  // light sent to the eye · known
};

// Where the eye is and what lights the scene.
struct Eye {
  Rays rays;
  std::vector<Light> lights;
  V3f ambient{0, 0, 0};
  bool shadows = true;
};

class LitLevel {
 public:
  // Keeps references to `level`, `eye` and `shadow` (null: itself), which must outlive it. `sheets`: surfaces may be open sheets, as those of a density are not.
  // Throws as VoxelField; Error{kBadInput} without the grids "alpha" and "density".
  LitLevel(const Level& level, const Eye& eye, const LitLevel* shadow, bool sheets);

  [[nodiscard]] const Grid& grid() const { return level_.grid; }
  // Edge in voxels (8, 4 or 2) of the aligned cell about `p` (voxel space) that interpolation finds nothing in; 0: it may find something.
  // Thread-safe.
  [[nodiscard]] int empty_cell(const V3d& p) const;
  // Between voxel centres: trilinear, except that of the surfaces opacity is interpolated across `axis`, along which a ray passes,
  // and optical depth along it: a sheet one voxel thick loses nothing then. `p` in voxel space. Thread-safe.
  [[nodiscard]] LitVoxel at(const V3d& p, int axis) const;
  // Share of light along the segment from `p`, direction `d` (unit), `length`, all in world units. Thread-safe.
  [[nodiscard]] float transmittance(const V3d& p, const V3d& d, double length) const;

 private:
  using Block = std::array<LitVoxel, 512>;  // x<<6 | y<<3 | z
  struct Slot {
    std::once_flag once;
    std::unique_ptr<Block> block;
  };

  [[nodiscard]] const Block* block_at(const V3i& block) const;
  [[nodiscard]] LitVoxel light_up(const V3i& voxel) const;
  [[nodiscard]] Facets facets(const V3i& voxel) const;
  [[nodiscard]] V3f light_sent(const V3i& voxel, const V3d& to_eye) const;
  [[nodiscard]] AxisOpacity axes(const V3i& voxel) const;
  [[nodiscard]] double depth(const V3i& voxel, const V3d& direction) const;

  const Level& level_;
  const Eye& eye_;
  const LitLevel* shadow_;
  bool sheets_;
  VoxelField alpha_, crossings_, density_, solid_, diagonal_, off_, normal_, albedo_, ks_, roughness_, transparency_, emission_;
  std::array<VoxelField, 2> lobe_diagonal_, lobe_off_;
  VoxelField share_;
  const VoxelField* matter_ = nullptr;
  V3i blocks_{0, 0, 0};
  struct Place {
    std::uint64_t near = 0;               // bit x<<4 | y<<2 | z: matter within one voxel of that cell of 2³
    bool filled = false;                  // the block itself holds matter
  };
  std::vector<std::int32_t> place_of_;    // per block: into places_ and slots_; −1: nothing within one voxel
  std::vector<Place> places_;
  std::unique_ptr<Slot[]> slots_;
};

}  // namespace texel
