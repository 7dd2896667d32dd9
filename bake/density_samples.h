#pragma once
// Stage 2c: an error of opacity asked for -> density points along a voxel's edge
#include <array>

#include "bake/hypertexture.h"

namespace texel {

struct DensityChoice {
  int samples = 1;                             // along a voxel's edge, everywhere
  // Squared error of opacity over the voxels of level 0, estimated, and the variance of that estimate, per axis.
  std::array<double, 3> square{0, 0, 0}, variance{0, 0, 0};
  bool met = true;                             // the upper end of each axis' interval is within the error asked for
};

inline constexpr int kMostDensitySamples = 16;  // that are chosen

// For an rms error of at most `recipe.max_error` along each axis, as choose_samples has it: one number for all voxels, since the moments of neighbouring blocks only
// add up to the whole where they share their points. Voxels are drawn by how much the density varies from voxel to voxel; those of half of the blocks choose,
// those of the other half, which have no part in it, say what is reached. A voxel's truth are two sets of rays of their own, each 1.5 times as many along an
// edge and with four times as many points along the ray. Deterministic, whatever the threads.
// Cost: nine points a voxel, and of the number chosen 7000 to 30 000 voxels'.
// Source: sampling with probability proportional to size, Hansen & Hurwitz 1943 (e.g. Cochran, Sampling Techniques, §9A.2).
[[nodiscard]] DensityChoice choose_density_samples(const Field& density, const Grid& grid, const Recipe& recipe, double scale, Report& report);

}  // namespace texel
