#pragma once
// Pack, Scene -> pictures of both from the same cameras, and how far they are apart (docs/compare.md)
#include "bake/compare.h"
#include "bake/view.h"

namespace texel {

struct ImageErrors {
  double rmse = 0;             // premultiplied linear colour, all pixels and channels
  double psnr = 0;             // dB; sRGB over grey, peak 1; infinite where nothing differs
  double ssim = 1;             // mean over the picture
  double silhouette = 0;       // rms of alpha
  double cover = 0;            // Σ alpha / Σ alpha of the truth − 1; 0 where the truth is empty
};

// Straight linear RGBA pictures of one size; throws Error{kBadInput} otherwise.
// SSIM: Wang, Bovik, Sheikh, Simoncelli 2004, of the luma (Rec. 709 weights of sRGB-encoded channels) over linear grey 0.18: Gaussian window of 11 × 11, σ 1.5,
// K1 = 0.01, K2 = 0.03, peak 1; windows wholly in the picture, of one smaller than 11 pixels the whole.
[[nodiscard]] ImageErrors compare_images(const Image& image, const Image& truth);

struct CompareViewsOptions {
  int views = 8;               // from all around, by azimuth and elevation evenly over the sphere, turned by the seed
  int doublings = 6;           // of the camera's distance
  int up = 2;
  std::uint32_t seed = 0;
  ViewOptions view;            // size, lights, shadows, sidedness, period; camera is set here
};

// Adds the image_… and silhouette_… measures of each view and of all together (of psnr, that of the mean square), and recede_… of each
// doubling (`view`: how many). The volume by the reference renderer against `scene` (functions already triangles).
// 16 rays a pixel of the truth, 64 when receding. Throws as view_volume, view_truth.
[[nodiscard]] Comparison compare_views(const Pack& pack, const Scene& scene, const CompareViewsOptions& options, Report& report);

}  // namespace texel
