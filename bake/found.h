#pragma once
// What stages 2 to 8 leave behind, slab by slab, and the pack is put together from.
#include <array>
#include <optional>
#include <vector>

#include "bake/job.h"
#include "bake/samples.h"
#include "bake/slice.h"
#include "bake/surface.h"
#include "bake/visibility.h"

namespace texel {

// What is summed over all voxels of level 0.
struct Totals {
  double area = 0, covered = 0;  // voxel faces
  V3d color{0, 0, 0};
  std::int64_t border = 0, blocks = 0, tiles = 0;
  void add(const Surface& surface, const Visibility& seen) {
    for (const Areas& a : surface.areas) { area += a.area; covered += a.covered; }
    for (const V3d& c : surface.color) color += c;
    border += surface.set.count;
    blocks += static_cast<std::int64_t>(surface.set.blocks.size());
    tiles += static_cast<std::int64_t>(seen.inside_blocks.size());
  }
};

// What choose_samples expects of all slabs together.
struct Reached {
  std::array<double, 3> square{0, 0, 0}, variance{0, 0, 0}, rays{0, 0, 0};
  double voxels = 0;
  bool met = true;
  void add(const SampleChoice& c) {
    for (std::size_t a = 0; a < 3; ++a) {
      square[a] += c.square[a];
      variance[a] += c.variance[a];
      rays[a] += c.rays[a] * c.voxels;
    }
    voxels += c.voxels;
    met = met && c.met;
  }
};

struct Found {
  std::vector<std::vector<LevelPart>> parts;         // per level and slab
  Totals totals;
  Statistics statistics;                             // the plan's; of a density what its samples sum up to
  SlabSums sums;
  std::optional<V3f> one_color;                      // of all the surface there is, where colour is wanted and it is the same
  std::array<double, 3> widths{};                    // world units, across each axis: how thick matter is, for the angle that slices stay closed to
  std::array<SliceRecords, 3> stacks;                // of the axes wanted
  Reached reached;                                   // where an error is asked for
};

// 6. to 8.: from level to level, what needs no geometry comes from the one below; then levels `first` … become grids, one part each of found.parts. Takes `surfaces` and `seen`, which are of these
// and, where `first` > 0, of the level before. `seen_material`: what of the surface's colour and material is to be that of what is seen. Of `bar` only the progress is used.
void add_parts(const Job& job, const SeenWant& seen_material, std::vector<Surface>& surfaces, VisibilityResult& seen, int first, Found& found, Report& report, const Report& bar);

// Stages 2 to 8 of triangles, fibres and instances, slab by slab where memory asks for it. Throws as bake.
[[nodiscard]] Found find_surfaces(const Job& job, Report& report);

// The same of a density, which is sampled at once. Throws as bake.
[[nodiscard]] Found find_density(const Job& job, Report& report);

}  // namespace texel
