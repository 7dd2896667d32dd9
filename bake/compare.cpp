// What the figures are called, and their norms. docs/compare.md has the same table with the reasons.
#include "bake/compare.h"

#include <cmath>

namespace texel {

const std::vector<MeasureKind>& measure_kinds() {
  static const std::vector<MeasureKind> kinds = {
      {"voxels_missing", "voxels", "voxels with surface or matter that the first lacks"},
      {"voxels_extra", "voxels", "voxels the first has and the other lacks"},
      {"area_relative", "1", "sum of the areas over the true one, less 1"},
      {"area_rms", "mean area", "rms over voxels of the area's error, in units of the level's mean area of a voxel"},
      {"volume_relative", "1", "sum of the filled fractions over the true volume, less 1"},
      {"solid_rms", "1", "rms over voxels of the filled fraction's error"},
      {"sigma_rms", "mean projected area", "rms over voxels and directions of the projected area's error, in units of half the mean area of the level's voxels"},
      {"sigma_max", "mean projected area", "largest of these"},
      {"alpha_bias", "1", "mean error of the opacity along an axis, with its sign"},
      {"alpha_rms", "1", "rms over voxels of the opacity's error along an axis"},
      {"alpha_max", "1", "largest of these"},
      {"alpha_truth_noise", "1", "rms error of the truth's own rays, as estimated from pairs of neighbouring ones: what alpha_rms cannot fall below"},
      {"column_bias", "1", "mean error of the share of light that passes whole columns along an axis"},
      {"column_rms", "1", "rms over columns of that"},
      {"direction_bias", "1", "mean error of the share of light that passes a beam one voxel wide in a random direction"},
      {"direction_rms", "1", "rms over beams of that"},
      {"normal_rms", "1", "rms over voxels of the length of the mean normals' difference"},
      {"axis_angle_rms", "degrees", "rms angle between principal axes, where one stands out"},
      {"axis_angle_max", "degrees", "largest of these"},
      {"indefinite", "voxels", "voxels whose S has an eigenvalue below -1/1000 of the largest"},
      {"color_rms", "1", "rms over voxels and channels of linear albedo"},
      {"color_max", "1", "largest of these"},
      {"depth_rms", "1", "rms over voxels of density times edge, the optical depth of one voxel"},
      {"coverage_rms", "1", "rms over voxels of the share left after cut-outs"},
      {"crossings_rms", "1", "rms over voxels and axes of the mean number of surface crossings"},
      {"kd_rms", "1", "rms over voxels and channels"},
      {"ks_rms", "1", "rms over voxels and channels"},
      {"roughness_rms", "1", "rms over voxels"},
      {"transparency_rms", "1", "rms over voxels"},
      {"emission_rms", "1", "rms over voxels and channels"},
      {"slice_alpha_rms", "1", "rms over all pixels of a stack"},
      {"slice_color_rms", "1", "rms over all pixels and channels of a stack, premultiplied linear"},
      {"image_rmse", "1", "rms over pixels and channels of premultiplied linear colour"},
      {"image_psnr", "dB", "20 log10 of 1 over the rms of sRGB over grey", true},
      {"image_ssim", "1", "structural similarity of sRGB luma over grey (Wang et al. 2004)", true},
      {"silhouette_rms", "1", "rms over pixels of alpha"},
      {"silhouette_cover", "1", "mean alpha over the true one, less 1"},
      {"recede_brightness", "1", "brightness of what is seen at 2^k times the distance over that at the first, less that of the truth"},
      {"recede_alpha", "1", "alpha summed over the picture times the distance squared, likewise"},
  };
  return kinds;
}

const MeasureKind* find_measure(const std::string& name) {
  for (const MeasureKind& kind : measure_kinds())
    if (name == kind.name) return &kind;
  return nullptr;
}

bool exceeds(const Measure& measure, double allowed) {
  const MeasureKind* kind = find_measure(measure.name);
  return kind && kind->more_is_better ? !(measure.value >= allowed) : !(std::abs(measure.value) <= allowed);
}

}  // namespace texel
