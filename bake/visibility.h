#pragma once
// Stage 5: crossings, border voxels -> opacity along each axis at every level, inside voxels
#include <array>
#include <span>
#include <vector>

#include "bake/crossings.h"
#include "bake/seen_material.h"
#include "bake/surface.h"
#include "bake/slice.h"

namespace texel {

// What the bundles of rays say of a level's border voxels (Surface::set of that level).
struct Visibility {
  std::array<std::vector<float>, 3> alpha;      // per axis and voxel: share of the rays stopped by surface or inside matter
  std::vector<Moments> visible;                 // of the surface seen from outside the voxel, where asked for; else empty
  std::vector<SeenMaterial> seen_material;      // likewise, where that is asked for
  std::vector<float> solid;                     // filled fraction, from the chords along the axes the surface faces
  VoxelSet inside;                              // voxels wholly inside, in blocks that hold border voxels or are only partly inside
  std::vector<V3i> inside_blocks;               // whole blocks inside, sorted by (z, y, x)
  std::int64_t inside_count = 0;                // voxels of both

  // Of coarser levels: voxels without surface that hold matter and are not wholly inside, since they jut out of the grid.
  VoxelSet edge;
  struct Edge { float alpha[3], solid; };
  std::vector<Edge> edges;                      // per voxel of `edge`
};

// Adds the voxels of a block that are inside, as voxels or whole. Blocks come sorted by (z, y, x).
inline void add_inside(const V3i& at, const std::array<std::uint64_t, 8>& mask, Visibility& to) {
  const int count = count_voxels(mask);
  to.inside_count += count;
  if (count == 512) to.inside_blocks.push_back(at);
  else if (count > 0) to.inside.add(at, mask);
}

// Rays chosen for an error of opacity (samples.h): per axis and tile of 8 × 8 columns (row · tiles of a row + column), sub-rays along a voxel's edge.
struct ChosenSamples {
  std::array<std::vector<std::uint8_t>, 3> samples;
};

struct VisibilityOptions {
  std::array<bool, 3> volume_axes{true, true, true};  // bundles whose volume sums are wanted
  std::array<bool, 3> slice_axes{true, true, true};
  bool recompute = true;                        // opacity of the coarser levels from the crossings rather than from the finer level
  bool visible_normals = false;                 // gather Visibility::visible
  SeenWant seen_material;                       // what of Visibility::seen_material to gather: at each level whose opacity comes from the crossings
  std::array<int, 3> slice_counts{0, 0, 0};
  Slab slab;                                    // the surfaces' voxels are all in it
  const ChosenSamples* chosen = nullptr;        // null: the recipe's samples everywhere. Then levels from 4 on have to be seen by themselves
  int coarse_rays = 0;                          // along the edge of coarser levels' voxels, at least, where they have as many
  int first_level = 0;                          // those below are done already: their surfaces are empty, and there are no slices
};

struct VisibilityResult {
  std::vector<Visibility> levels;               // as many as `surfaces`
};

// What the slabs of a grid share, lowest first. As a bake begins it is empty.
struct SlabSums {
  std::array<std::vector<SliceBand>, 3> slices; // per band
  double volume = 0;                            // filled volume of the border voxels, voxels³
  std::int64_t inside_count = 0;                // voxels wholly inside
  std::array<std::int64_t, 3> met{-1, -1, -1};  // crossings along each axis; −1: no rays
  // Per level-0 column (row · nu + column) of a bundle: its mean winding number where it enters the box, which is the share inside where matter
  // does not overlap; NaN: not exactly known. Empty: 0 everywhere, the box cuts no matter.
  std::array<std::vector<double>, 3> begins_inside;
  std::vector<std::vector<double>> inside;      // per level and column along z: the same where the column leaves the slab. Empty: 0 everywhere
};

// The bundles of one axis, all columns once between them: one for the recipe's samples, or one for each number chosen, the most first.
[[nodiscard]] std::vector<Bundle> make_bundles(const Scene& scene, const Plan& plan, const TextureSet& textures, const Recipe& recipe, const VisibilityOptions& options, int axis);

// Traces the three bundles band by band; memory is a band's crossings per thread and the results. Opacity, filled fractions, slices and inside flags are
// the same, to the bit, however the grid is cut into slabs, unless a column of the first has surface in all its voxels.
// Opacity: exact for a voxel with one layer of surface; else docs/accuracy.md.
// Levels 0 and 1 use every ray, coarser ones as many as RayStep says (axis_rays.h).
[[nodiscard]] VisibilityResult see_voxels(const Scene& scene, const Plan& plan, const TextureSet& textures, std::span<const Surface> surfaces,
                                          const Recipe& recipe, const VisibilityOptions& options, const SliceShader& shade, SlabSums& sums, Report& report);

// The stacks that the slabs' rays have seen, of the axes wanted.
[[nodiscard]] std::array<SliceRecords, 3> gather_stacks(const Grid& grid, const VisibilityOptions& options, SlabSums& sums);

// What slabs, lowest first, know of one level as one.
[[nodiscard]] Visibility join_visibility(std::vector<Visibility>& parts);

// How thick the filled matter is across each axis, voxels: the 5th percentile of the chords inside it along x, y and z, by one ray a
// voxel column. Where nothing is filled: 2, so that slices stand as close as voxels for the eye.
[[nodiscard]] V3d measure_thickness(const Scene& scene, const Plan& plan, const TextureSet& textures);

}  // namespace texel
