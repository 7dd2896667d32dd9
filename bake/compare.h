#pragma once
// Pack against Pack or Scene -> error figures: what `texel compare`, `texel bench` and the tests measure with (docs/compare.md)
#include <cstdint>
#include <string>
#include <vector>

#include "bake/recipe.h"
#include "formats/pack.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// One figure. `value` ± : [low, high] holds the true figure with 95 % confidence where `count` of `of` places were looked at; both are
// `value` where all were. Of a maximum over a sample only the lower end is known: `high` is infinite.
struct Measure {
  std::string name;            // as in measure_kinds()
  int level = -1;              // of the octree; −1: of the whole pack
  int axis = -1;               // 0 x, 1 y, 2 z; −1: of all
  int view = -1;               // of the pictures; −1: none, or their mean
  double value = 0, low = 0, high = 0;
  std::int64_t count = 0, of = 0;
};

struct Comparison {
  std::vector<Measure> measures;
  std::vector<Skip> skipped;   // what could not be measured, and why
};

// What a figure is: its unit and norm, and whether more is better (then --allow gives the least allowed).
struct MeasureKind {
  const char* name;
  const char* unit;
  const char* norm;
  bool more_is_better = false;
};
[[nodiscard]] const std::vector<MeasureKind>& measure_kinds();
// Null where there is none of that name.
[[nodiscard]] const MeasureKind* find_measure(const std::string& name);

// Whether a figure is beyond `allowed`: its size above it, or below it where more is better. What is not a number is.
[[nodiscard]] bool exceeds(const Measure& measure, double allowed);

struct CompareOptions {
  NdfKind ndf_a = NdfKind::kSggx, ndf_b = NdfKind::kSggx;  // what `axis_1` and `axis_2` mean in either pack
  int level = -1;              // this level only; −1: all
  int voxels = 1000;           // of each level that are looked at for the truth; fewer are all looked at
  int columns = 1000;          // rays' bundles for transmittance, a level and axis, and of all directions
  std::uint32_t seed = 0;      // another sample of the same size
};

// `a` against `b`, which have the same grid: n equal, origin and edge to 1e-6 of an edge; throws Error{kBadInput} otherwise. Everything is
// looked at; grids and levels that only one of them has are skipped, and said. Cost: about 1 µs a voxel.
[[nodiscard]] Comparison compare_packs(const Pack& a, const Pack& b, const CompareOptions& options, Report& report);

// `pack` against its geometry, by its recipe `baked`. The truth: triangles clipped to a voxel one by one, 64 × 64 jittered rays a voxel and axis in
// double, Embree along whole columns; none of it is code of the bake's own clipper or rasteriser. Seeded voxels of each level.
// Throws Error{kBadInput} where scene and pack have nothing in common. Of a density compare_density().
// Cost: about 5 ms a voxel; the same figures for every number of threads.
[[nodiscard]] Comparison compare_truth(const Pack& pack, const Scene& scene, const Recipe& baked, const CompareOptions& options, Report& report);

// `pack` against the density scene.hypertexture, single voxels, columns, beams and the volume of D = 1; area and normals against D's differences over the distance of the bake's samples, since finer octaves make the surface of any size. Jittered rays and places in voxels drawn from those with surface in the pack and their neighbours.
// Cost: about 5 ms a voxel and octave on level 0, 20 on others, 8 to 16 ms a column or beam on level 0 of 64 voxels; the same figures for every number of threads.
[[nodiscard]] Comparison compare_density(const Pack& pack, const Scene& scene, const Recipe& baked, const CompareOptions& options, Report& report);

}  // namespace texel
