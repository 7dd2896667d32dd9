#include "bake/compare_views.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "bake/compare_sums.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr V3f kGrey(0.18f, 0.18f, 0.18f);

// sRGB over grey: what is seen, with its three channels.
Image seen_over_grey(const Image& image) {
  Image out = over_background(image, kGrey);
  for (float& v : out.pixels) v = linear_to_srgb(v);
  return out;
}

std::vector<double> luma(const Image& rgb) {
  std::vector<double> y;
  y.reserve(rgb.pixels.size() / 3);
  for (std::size_t i = 0; i < rgb.pixels.size(); i += 3)
    y.push_back(0.2126 * static_cast<double>(rgb.pixels[i]) + 0.7152 * static_cast<double>(rgb.pixels[i + 1]) + 0.0722 * static_cast<double>(rgb.pixels[i + 2]));
  return y;
}

// Rows, then columns, with `window`; what does not fit wholly is left out.
std::vector<double> filtered(const std::vector<double>& in, int width, int height, const std::vector<double>& window) {
  const int n = static_cast<int>(window.size()), w = width - n + 1, h = height - n + 1;
  std::vector<double> rows(static_cast<std::size_t>(w) * static_cast<std::size_t>(height)), out(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < w; ++x) {
      double sum = 0;
      for (int k = 0; k < n; ++k) sum += window[static_cast<std::size_t>(k)] * in[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x + k)];
      rows[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)] = sum;
    }
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      double sum = 0;
      for (int k = 0; k < n; ++k) sum += window[static_cast<std::size_t>(k)] * rows[static_cast<std::size_t>(y + k) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)];
      out[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)] = sum;
    }
  return out;
}

double ssim(const std::vector<double>& a, const std::vector<double>& b, int width, int height) {
  constexpr int kWindow = 11;
  constexpr double kSigma = 1.5, kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;
  if (width < kWindow || height < kWindow) {
    const auto n = static_cast<double>(a.size());
    double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      ma += a[i] / n;
      mb += b[i] / n;
      aa += a[i] * a[i] / n;
      bb += b[i] * b[i] / n;
      ab += a[i] * b[i] / n;
    }
    return (2 * ma * mb + kC1) * (2 * (ab - ma * mb) + kC2) / ((ma * ma + mb * mb + kC1) * (aa - ma * ma + bb - mb * mb + kC2));
  }
  std::vector<double> window(kWindow);
  double total = 0;
  for (int i = 0; i < kWindow; ++i) total += window[static_cast<std::size_t>(i)] = std::exp(-(i - kWindow / 2) * (i - kWindow / 2) / (2 * kSigma * kSigma));  // NOLINT: 5
  for (double& v : window) v /= total;
  std::vector<double> square_a(a.size()), square_b(a.size()), product(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    square_a[i] = a[i] * a[i];
    square_b[i] = b[i] * b[i];
    product[i] = a[i] * b[i];
  }
  const std::vector<double> ma = filtered(a, width, height, window), mb = filtered(b, width, height, window), aa = filtered(square_a, width, height, window),
                            bb = filtered(square_b, width, height, window), ab = filtered(product, width, height, window);
  double sum = 0;
  for (std::size_t i = 0; i < ma.size(); ++i)
    sum += (2 * ma[i] * mb[i] + kC1) * (2 * (ab[i] - ma[i] * mb[i]) + kC2) / ((ma[i] * ma[i] + mb[i] * mb[i] + kC1) * (aa[i] - ma[i] * ma[i] + bb[i] - mb[i] * mb[i] + kC2));
  return sum / static_cast<double>(ma.size());
}

double psnr_of(double mean_square) { return mean_square > 0 ? -10 * std::log10(mean_square) : std::numeric_limits<double>::infinity(); }

struct Seen { double brightness = 0, cover = 0; };
Seen seen(const Image& image, double scale) {
  double light = 0, alpha = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
    const float* p = &image.pixels[i];
    light += static_cast<double>((p[0] + p[1] + p[2]) / 3 * p[3]);
    alpha += static_cast<double>(p[3]);
  }
  return {alpha > 0 ? light / alpha : 0, alpha * scale};
}

double change(double now, double first) { return first > 0 ? now / first : 1; }

}  // namespace

ImageErrors compare_images(const Image& image, const Image& truth) {
  if (image.width != truth.width || image.height != truth.height || image.channels != 4 || truth.channels != 4 || image.empty())
    throw Error(Code::kBadInput, "", "pictures of different sizes cannot be compared");
  ImageErrors e;
  double alpha = 0, truth_alpha = 0;
  for (std::size_t i = 0; i < truth.pixels.size(); i += 4) {
    const float *p = &image.pixels[i], *t = &truth.pixels[i];
    for (int c = 0; c < 3; ++c) e.rmse += std::pow(static_cast<double>(p[c] * p[3] - t[c] * t[3]), 2) / 3;
    e.silhouette += std::pow(static_cast<double>(p[3] - t[3]), 2);
    alpha += static_cast<double>(p[3]);
    truth_alpha += static_cast<double>(t[3]);
  }
  const double n = static_cast<double>(truth.pixels.size()) / 4;
  e.rmse = std::sqrt(e.rmse / n);
  e.silhouette = std::sqrt(e.silhouette / n);
  e.cover = truth_alpha > 0 ? alpha / truth_alpha - 1 : 0;
  const Image a = seen_over_grey(image), b = seen_over_grey(truth);
  double square = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) square += std::pow(static_cast<double>(a.pixels[i] - b.pixels[i]), 2);
  e.psnr = psnr_of(square / static_cast<double>(a.pixels.size()));
  e.ssim = ssim(luma(a), luma(b), a.width, a.height);
  return e;
}

Comparison compare_views(const Pack& pack, const Scene& scene, const CompareViewsOptions& options, Report& report) {
  Comparison out;
  const auto add = [&](const char* name, int view, double value, std::int64_t count) {
    Measure m = exactly(name, value, count);
    m.view = view;
    out.measures.push_back(m);
  };
  const auto quiet = [&](const std::string& stage, double done) { if (report.progress) report.progress(stage, done); };
  Report unheard;  // the renderers' own progress would begin anew at each picture
  ViewOptions view = options.view;
  const double turn = options.seed * 0.6180339887498949;
  ImageErrors mean;
  mean.ssim = 0;
  double square = 0, rmse = 0, silhouette = 0;
  for (int i = 0; i < options.views; ++i) {
    quiet("pictures", static_cast<double>(i) / options.views);
    const double z = 1 - 2 * (i + 0.5) / options.views;
    view.camera = orbit_camera(pack.grid.box(), std::fmod((i * 0.6180339887498949 + turn) * 360, 360.0), std::asin(z) * 180 / std::numbers::pi, 30, options.up, static_cast<double>(view.width) / view.height);
    view.samples = 16;
    const ImageErrors e = compare_images(view_volume(pack, view, unheard), view_truth(scene, view, unheard));
    add("image_rmse", i, e.rmse, 1);
    add("image_psnr", i, e.psnr, 1);
    add("image_ssim", i, e.ssim, 1);
    add("silhouette_rms", i, e.silhouette, 1);
    add("silhouette_cover", i, e.cover, 1);
    rmse += e.rmse * e.rmse;
    square += std::pow(10.0, -e.psnr / 10);
    silhouette += e.silhouette * e.silhouette;
    mean.ssim += e.ssim;
    mean.cover += e.cover;
  }
  if (const double n = options.views; n > 0) {
    add("image_rmse", -1, std::sqrt(rmse / n), options.views);
    add("image_psnr", -1, psnr_of(square / n), options.views);
    add("image_ssim", -1, mean.ssim / n, options.views);
    add("silhouette_rms", -1, std::sqrt(silhouette / n), options.views);
    add("silhouette_cover", -1, mean.cover / n, options.views);
  }
  const Camera near = orbit_camera(pack.grid.box(), -60, 20, 30, options.up, static_cast<double>(view.width) / view.height);
  Seen first_volume, first_truth;
  for (int k = 0; k <= options.doublings && options.doublings > 0; ++k) {
    quiet("receding", static_cast<double>(k) / (options.doublings + 1));
    const double far = std::ldexp(1.0, k);
    view.camera = near;
    view.camera.eye = near.target + (near.eye - near.target) * far;
    view.samples = 64;  // the object soon is a few pixels wide
    const Seen volume = seen(view_volume(pack, view, unheard), far * far), truth = seen(view_truth(scene, view, unheard), far * far);
    if (k == 0) {
      first_volume = volume;
      first_truth = truth;
      continue;
    }
    add("recede_brightness", k, change(volume.brightness, first_volume.brightness) - change(truth.brightness, first_truth.brightness), 1);
    add("recede_alpha", k, change(volume.cover, first_volume.cover) - change(truth.cover, first_truth.cover), 1);
  }
  return out;
}

}  // namespace texel
