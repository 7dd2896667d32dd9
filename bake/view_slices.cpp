// Slice compositing: the stack that faces the eye best, its planes laid over each other.
#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/shading.h"
#include "formats/error.h"

namespace texel {

namespace {

constexpr int kBatch = 16;  // slices decoded at once: enough for the threads, little memory

// What is to be seen of one pixel's sample so far: premultiplied, nearest slice first.
struct Sum {
  V3f color{0, 0, 0};
  float left = 1;
};

struct View {
  const SliceStack& stack;
  Box3d box;
  Rays rays;
  int samples = 1;
};

// Premultiplied bilinear value at (s,t) in [0,1]², t downwards; beyond the outer pixels' centres their value goes on.
void add_bilinear(const Image& image, double s, double t, V3f* color, float* alpha) {
  const double x = std::clamp(s * image.width - 0.5, 0.0, image.width - 1.0), y = std::clamp(t * image.height - 0.5, 0.0, image.height - 1.0);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.width - 1), y1 = std::min(y0 + 1, image.height - 1);
  const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
  const auto add = [&](int i, int j, float weight) {
    const float* p = image.at(i, j);
    const float a = weight * p[3];
    *color += V3f(p[0], p[1], p[2]) * a;
    *alpha += a;
  };
  add(x0, y0, (1 - fx) * (1 - fy));
  add(x1, y0, fx * (1 - fy));
  add(x0, y1, (1 - fx) * fy);
  add(x1, y1, fx * fy);
}

// `under`: the slice comes behind all that the sum holds (front to back, which is `over` read the other way).
void lay_under(const View& view, const Image& image, int k, const Rays::Ray& ray, Sum* sum) {
  const int axis = view.stack.axis;
  const double plane = view.box.min[axis] + (k + 0.5) * view.stack.thickness;
  const double t = (plane - ray.origin[axis]) / ray.direction[axis];
  if (!(t > 0) || !std::isfinite(t)) return;
  const V3d p = ray.origin + ray.direction * t;
  const int across = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
  const double s = (p[across] - view.box.min[across]) / (view.box.max[across] - view.box.min[across]);
  const double v = (p[up] - view.box.min[up]) / (view.box.max[up] - view.box.min[up]);
  if (!(s >= 0 && s <= 1 && v >= 0 && v <= 1)) return;
  V3f color(0, 0, 0);
  float alpha = 0;
  add_bilinear(image, s, 1 - v, &color, &alpha);
  sum->color += color * sum->left;
  sum->left *= 1 - std::min(alpha, 1.0f);
}

// (1/c² − 1)·h²: how far planes h apart seem shifted at the angle with cosine c, squared (method 4.4).
double slant(const SliceStack& stack, const V3d& forward) {
  const double c = std::abs(forward[stack.axis]);
  return c > 0 ? (1 / (c * c) - 1) * stack.thickness * stack.thickness : std::numeric_limits<double>::infinity();
}

bool usable(const SliceStack& stack) { return stack.axis >= 0 && stack.axis < 3 && stack.count > 0 && stack.thickness > 0 && stack.image; }

const SliceStack& choose(const Pack& pack, const ViewOptions& options, const Rays& rays) {
  const SliceStack* best = nullptr;
  for (const SliceStack& stack : pack.slices) {
    if (!usable(stack) || stack.level != std::max(options.level, 0) || (options.slice_axis >= 0 && stack.axis != options.slice_axis)) continue;
    if (!best || slant(stack, rays.forward) < slant(*best, rays.forward)) best = &stack;
  }
  if (!best) {
    const std::string level = options.level > 0 ? " of level " + std::to_string(options.level) : "";
    const std::string axis = options.slice_axis >= 0 ? std::string(" along ") + "xyz"[std::clamp(options.slice_axis, 0, 2)] : "";
    throw Error(Code::kBadInput, "", "the pack has no slices" + axis + level,
                options.level > 0 ? "bake it with --slice-levels " + std::to_string(options.level)
                                  : options.slice_axis >= 0 ? "leave --axis out or bake it with --slices" : "bake it with --want slices");
  }
  return *best;
}

// Rays that go up the axis meet slices in rising order, the others in falling order; a ray takes part in one of both passes only.
void composite(const View& view, bool rising, int threads, std::vector<Sum>& sums, const Report& report) {
  const int axis = view.stack.axis;
  std::vector<int> order;
  for (int k = 0; k < view.stack.count; ++k) {
    const double plane = view.box.min[axis] + (k + 0.5) * view.stack.thickness;
    const bool ahead = !view.rays.perspective || (rising ? plane > view.rays.eye[axis] : plane < view.rays.eye[axis]);
    if (ahead) order.push_back(k);
  }
  if (!rising) std::reverse(order.begin(), order.end());
  for (std::size_t first = 0; first < order.size(); first += kBatch) {
    const std::size_t count = std::min<std::size_t>(kBatch, order.size() - first);
    std::vector<Image> images(count);
    const auto told = [&] { if (report.progress) report.progress("view slices", static_cast<double>(first) / static_cast<double>(order.size())); };
    for_rows(static_cast<int>(count), threads, [&](int i) {
      images[static_cast<std::size_t>(i)] = view.stack.image(order[first + static_cast<std::size_t>(i)]);
      told();
    });
    for (const Image& image : images)
      if (image.channels != 4 || image.width < 1 || image.height < 1 || image.pixels.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4)
        throw Error(Code::kBadInput, "", "a slice is not an RGBA picture");
    for_rows(view.rays.height, threads, [&](int y) {
      for (int x = 0; x < view.rays.width; ++x)
        for (int i = 0; i < view.samples; ++i) {
          const V2f at = pixel_sample(x, y, i, view.samples);
          const Rays::Ray ray = view.rays.at(x + static_cast<double>(at.x), y + static_cast<double>(at.y));
          if (rising ? !(ray.direction[axis] > 0) : !(ray.direction[axis] < 0)) continue;
          Sum& sum = sums[(static_cast<std::size_t>(y) * static_cast<std::size_t>(view.rays.width) + static_cast<std::size_t>(x)) * static_cast<std::size_t>(view.samples) + static_cast<std::size_t>(i)];
          for (std::size_t k = 0; k < count && sum.left > 0; ++k) lay_under(view, images[k], order[first + k], ray, &sum);
        }
      told();
    });
  }
}

}  // namespace

Image view_slices(const Pack& pack, const ViewOptions& options, Report& report) {
  const StageTimer timer(report, "view slices");
  const Rays rays = make_rays(options.camera, options.width, options.height);
  const View view{choose(pack, options, rays), pack.grid.box(), rays, std::clamp(options.samples / 16, 1, 4)};
  std::vector<Sum> sums(static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height) * static_cast<std::size_t>(view.samples));
  composite(view, true, options.threads, sums, report);
  composite(view, false, options.threads, sums, report);

  Image image;
  image.width = options.width;
  image.height = options.height;
  image.channels = 4;
  image.pixels.reserve(static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height) * 4);
  const auto n = static_cast<std::size_t>(view.samples);
  for (std::size_t pixel = 0; pixel < sums.size(); pixel += n) {
    V3f color(0, 0, 0);
    float alpha = 0;
    for (std::size_t i = 0; i < n; ++i) {
      color += sums[pixel + i].color;
      alpha += 1 - sums[pixel + i].left;
    }
    for (int c = 0; c < 3; ++c) image.pixels.push_back(alpha > 0 ? color[c] / alpha : 0.0f);
    image.pixels.push_back(alpha / static_cast<float>(n));
  }
  return image;
}

}  // namespace texel
