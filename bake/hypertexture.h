#pragma once
// Stage 2c: Hypertexture, Grid -> surface moments, opacity at every level, slices of a density
#include <array>
#include <cstdint>
#include <vector>

#include "bake/recipe.h"
#include "bake/surface.h"
#include "bake/visibility.h"
#include "formats/field.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// Where a density can be > 0: the field's own bounds narrowed by its ranges over 64³ cells. Throws Error{kCommandLine} where the field does not
// know its bounds and there is no box to ask for, Error{kBadInput} where it is 0 everywhere.
[[nodiscard]] Box3d density_bounds(const Field& density);

// −ln(1 − ρ) averaged over a step on which ρ goes from 1 − u to 1 − v in a straight line, exactly: 1 − (u ln u − v ln v)/(u − v).
// Infinite where u = v = 0: density 1 is opaque whatever its scale.
[[nodiscard]] double mean_depth(double u, double v);

// Optical depth, over c times the distance of its points, of a ray through a voxel with the densities d[0], d[stride] … d[(points − 1)·stride] at the
// middles of as many equal parts and one beyond on either side. D is linear between them. Infinite where D is 1 on some stretch.
[[nodiscard]] double ray_depth(const double* d, std::size_t stride, int points);

struct DensityOptions {
  int levels = 1;                                  // as many Surfaces and Visibilities are made
  bool color = true, opacity = true;
  bool recompute = true;                           // opacity of the coarser levels from the rays, else left empty
  std::array<bool, 3> slice_axes{false, false, false};
  std::array<int, 3> slice_counts{0, 0, 0};
};

struct DensityBake {
  std::vector<Surface> surfaces;                   // per level
  VisibilityResult seen;
  std::array<SliceRecords, 3> stacks;              // of the axes wanted
  double filled = 0;                               // of the border voxels, voxels³
  double mass = 0;                                 // ∫ D, world units³
  double area = 0;                                 // ∫ |∇D|, world units²
};

// Samples D at samples³ places a voxel, shared by the rays of all three axes; between samples along a ray D is linear.
//   area, m, M   by the coarea formula: the mean over all thresholds of what the surface D = threshold has: ∫|∇D|, −∫∇D, ∫|∇D| n nᵀ, with ∇D
//                by central differences of the samples, so that Σ m telescopes and a step of any steepness counts whole
//   alpha        1 − mean over the rays of ∏ (1 − ρ)^(c·dt) along the voxel, c and dt in world units; density 1 is opaque
//   crossings    mean optical depth of the rays, each at most recipe.max_depth or 1: dust met rather than surface crossed
//   solid        share of the samples with D = 1; inside: voxels with nothing but such samples in and next to them
// Matter without a gradient (fog) counts as isotropic dust of kDust·D area a voxel, so that it has a colour and a normal distribution.
// Levels 1 to 3: over every ray; from there on by columns of level-0 voxels. Bricks of 8³ voxels over which the field's range is all 0 or all 1
// are not sampled; report.count "bricks …" says how many. NaN counts as 0, with the issue "field-undefined".
// Throws Error{kBadInput} where nothing of the density lies in the grid. Deterministic for any number of threads.
// D is sampled as it is, with octaves finer than the samples: their noise in a voxel's mean is far less than what leaving them out changes. Area and normals are of D's differences over two
// samples' distances, so that they depend on the number of samples where D has finer detail. Colour: at the middle of the surface in each eighth of the voxel.
inline constexpr double kDust = 1e-6;
inline constexpr int kDensitySamples = 2;       // along a voxel's edge, unless the recipe says otherwise
[[nodiscard]] DensityBake bake_density(const Scene& scene, const Grid& grid, const Recipe& recipe, const DensityOptions& options, Report& report);

}  // namespace texel
