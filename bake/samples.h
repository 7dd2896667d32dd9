#pragma once
// Stage 5: an error of opacity asked for -> sub-rays of each tile of columns
#include <array>

#include "bake/visibility.h"

namespace texel {

struct SampleChoice {
  ChosenSamples chosen;
  // Squared error of opacity over the voxels of level 0, estimated, and the variance of that estimate, per axis.
  std::array<double, 3> square{0, 0, 0}, variance{0, 0, 0};
  std::array<double, 3> rays{0, 0, 0};         // sub-rays per voxel column, mean over the tiles with surface
  double voxels = 0;                           // border voxels of level 0
  bool met = true;                             // the upper end of each axis' interval is within the error asked for
};

// For an rms error of at most `recipe.max_error` along each axis: two bundles of 2 × 2 rays at different places tell where opacity is not known, some hundred columns
// drawn by that are traced with several numbers of rays and with so many that they serve as the truth, and each tile gets the rays that cost least for the error of
// all. What the two bundles differ by at all voxels has to stay within the error, too: few voxels that err much are in no draw.
// Only rays along the wanted axes; of the slab alone. Deterministic; the columns are drawn by a hash of axis and place in the row of draws.
// `cutouts`: coverage is looked up at points, so that what the surface says of it is not exact: the truth is then the plain mean of the rays.
// Cost: that of two bakes with 2 × 2 rays and without slices or levels, and of 50 to 400 columns × 200 … 4000 rays an axis.
// Source: sampling with probability proportional to size, Hansen & Hurwitz 1943 (e.g. Cochran, Sampling Techniques, §9A.2).
[[nodiscard]] SampleChoice choose_samples(const Scene& scene, const Plan& plan, const TextureSet& textures, const Surface& surface, const Recipe& recipe,
                                          const VisibilityOptions& options, const SlabSums& below, bool cutouts, Report& report);

// Rays along the edge of the voxels of levels 1 to 3, and beyond, which see_voxels takes by themselves, for that error.
[[nodiscard]] int coarse_rays_for(double max_error, bool beyond);

// How finely coverage and colour of cut-outs are looked up for it (SurfaceWant::finest_cut).
[[nodiscard]] int finest_cut_for(double max_error);

}  // namespace texel
