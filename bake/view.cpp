#include "bake/view.h"

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <string>

#include "bake/shading.h"
#include "formats/error.h"

namespace texel {

namespace {

constexpr double kDegree = std::numbers::pi / 180;

bool finite(const V3d& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

V3d unit_or(const V3d& v, const V3d& otherwise) {
  const double most = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(most > 0) || !std::isfinite(most)) return otherwise;
  const V3d scaled = v / most;
  return scaled / std::sqrt(scaled.dot(scaled));
}

// Well mixed bits of a pixel's place (the finaliser of MurmurHash3).
std::uint32_t hash(std::uint32_t x, std::uint32_t y) {
  std::uint32_t h = x * 0x9e3779b1u ^ (y + 0x7f4a7c15u) * 0x85ebca77u;
  h ^= h >> 16;
  h *= 0x85ebca6bu;
  h ^= h >> 13;
  h *= 0xc2b2ae35u;
  return h ^ h >> 16;
}

double fraction(double v) { return v - std::floor(v); }

}  // namespace

Camera frame_points(std::span<const V3d> points, double azimuth, double elevation, double fov, int up, double aspect) {
  constexpr double kBorder = 0.04;
  const auto turned = [up](const V3d& v) { return up == 1 ? V3d(v.x, v.z, -v.y) : up == 0 ? V3d(v.z, v.x, v.y) : v; };
  const double a = azimuth * kDegree, e = elevation * kDegree;
  const V3d towards = turned(V3d(std::cos(a) * std::cos(e), std::sin(a) * std::cos(e), std::sin(e)));
  Camera camera;
  camera.up = turned(V3d(-std::cos(a) * std::sin(e), -std::sin(a) * std::sin(e), std::cos(e)));
  camera.fov = fov > 0 ? std::min(fov, 170.0) : 0;
  const V3d right = camera.up.cross(towards);

  Box3d box;
  for (const V3d& p : points)
    if (finite(p)) box.extendBy(p);
  V3d middle = box.isEmpty() ? V3d(0, 0, 0) : box.min / 2 + box.max / 2;
  const V3d half = box.isEmpty() ? V3d(0, 0, 0) : box.max / 2 - box.min / 2;
  double radius = std::max({half.x, half.y, half.z}) * std::sqrt(half.length2() > 0 ? 3.0 : 1.0);
  if (!(radius > 0) || !std::isfinite(radius)) radius = 1;

  // In units of the radius. A point r to the right of the middle and f nearer is in the picture from distance D when
  // |r − shift| <= (D − f)·k. Both sides' tightest points give the least D and the shift at once.
  const bool perspective = camera.fov > 0;
  const double slope = perspective ? std::tan(camera.fov / 2 * kDegree) * (1 - kBorder) : 0;
  double shift[2] = {0, 0}, need = 0, nearest = -1;
  for (int k = 0; k < 2; ++k) {
    const V3d& across = k == 0 ? right : camera.up;
    const double stretch = k == 0 ? aspect : 1;
    double most = -1e300, least = -1e300;
    for (const V3d& p : points) {
      if (!finite(p)) continue;
      const V3d v = (p - middle) / radius;
      const double r = v.dot(across), f = v.dot(towards);
      nearest = std::max(nearest, f);
      most = std::max(most, perspective ? r / (slope * stretch) + f : r);
      least = std::max(least, perspective ? -r / (slope * stretch) + f : -r);
    }
    if (!(most > -1e300)) most = least = 1;
    shift[k] = (most - least) / 2 * (perspective ? slope * stretch : 1);
    need = std::max(need, (most + least) / 2 / (perspective ? 1 : stretch));
  }
  camera.target = middle + (right * shift[0] + camera.up * shift[1]) * radius;
  // Never nearer than the nearest point: what is flat and seen edge-on needs no width.
  camera.height = (need > 0 ? 2 * need / (1 - kBorder) : 2) * radius;
  camera.eye = camera.target + towards * ((perspective ? std::max(need, nearest + 0.1) : 2 + nearest) * radius);
  return camera;
}

Camera orbit_camera(const Box3d& box, double azimuth, double elevation, double fov, int up, double aspect) {
  std::array<V3d, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) corners[i] = V3d(i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z);
  return frame_points(box.isEmpty() ? std::span<const V3d>() : std::span<const V3d>(corners), azimuth, elevation, fov, up, aspect);
}

int up_axis(int up, const std::vector<SourceFile>& sources) {
  if (up >= 0 && up <= 2) return up;
  for (const SourceFile& source : sources) {
    const std::size_t dot = source.path.rfind('.');
    if (dot == std::string::npos) continue;
    std::string extension = source.path.substr(dot);
    for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    if (extension == ".obj" || extension == ".ply" || extension == ".off") return 1;
    for (const char* z_up : {".json", ".stl", ".opf", ".ops", ".gwa", ".lig", ".smb"})
      if (extension == z_up) return 2;
  }
  return 2;
}

Image over_background(const Image& image, V3f background) {
  Image out;
  out.width = image.width;
  out.height = image.height;
  out.channels = 3;
  out.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float* in = image.at(x, y);
      const float alpha = image.has_alpha() ? in[image.channels - 1] : 1.0f;
      for (int c = 0; c < 3; ++c) out.at(x, y)[c] = alpha * in[image.channels >= 3 ? c : 0] + (1 - alpha) * background[c];
    }
  return out;
}

Rays::Ray Rays::at(double x, double y) const {
  const double pixel = 2 * half_height / height;
  const V3d across = right * ((x - width * 0.5) * pixel) + up * ((height * 0.5 - y) * pixel);
  if (!perspective) return {eye + across, forward};
  const V3d d = forward + across;
  return {eye, d / d.length()};
}

Rays make_rays(const Camera& camera, int width, int height) {
  if (width < 1 || height < 1 || std::int64_t{width} * height > (std::int64_t{1} << 28))
    throw Error(Code::kCommandLine, "", "picture size " + std::to_string(width) + "x" + std::to_string(height) + " is out of range", "use 1 to 2^28 pixels");
  if (!finite(camera.eye) || !finite(camera.target) || !finite(camera.up) || !std::isfinite(camera.fov) || !std::isfinite(camera.height))
    throw Error(Code::kCommandLine, "", "the camera is not finite");
  Rays rays;
  rays.width = width;
  rays.height = height;
  rays.eye = camera.eye;
  rays.forward = unit_or(camera.target - camera.eye, V3d(0, 1, 0));
  V3d side = rays.forward.cross(unit_or(camera.up, V3d(0, 0, 1)));
  if (side.length() < 1e-9) side = rays.forward.cross(std::abs(rays.forward.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0));
  rays.right = unit_or(side, V3d(1, 0, 0));
  rays.up = rays.right.cross(rays.forward);
  rays.perspective = camera.fov > 0;
  rays.half_height = rays.perspective ? std::tan(std::min(camera.fov, 170.0) / 2 * kDegree) : camera.height / 2;
  if (!(rays.half_height > 0)) rays.half_height = 1;
  return rays;
}

std::vector<Light> view_lights(const ViewOptions& options, const Rays& rays) {
  if (!options.lights.empty()) return options.lights;
  const V3d travels = rays.right * 0.6 - rays.up * 0.7 + rays.forward;
  return {{Light::Kind::kAmbient, V3d(0, 0, 0), V3f(0.25f)}, {Light::Kind::kSun, travels, V3f(0.75f)}};
}

V2f pixel_sample(int x, int y, int i, int n) {
  const std::uint32_t bits = hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
  if (n <= 1) return {0.5f, 0.5f};
  // One sample in each of n columns; rows follow the golden ratio.
  const double turn_x = (bits & 0xffffu) / 65536.0, turn_y = (bits >> 16) / 65536.0;
  return {static_cast<float>(fraction((i + turn_x) / n)), static_cast<float>(fraction(i * 0.6180339887498949 + turn_y))};
}

void for_rows(int height, int threads, const std::function<void(int)>& row) {
  const auto all = [&] {
    tbb::parallel_for(tbb::blocked_range<int>(0, height, 1), [&](const tbb::blocked_range<int>& rows) {
      for (int y = rows.begin(); y < rows.end(); ++y) row(y);
    });
  };
  if (threads <= 0 || threads >= tbb::info::default_concurrency()) return all();  // more than there are only earns a warning of TBB's
  tbb::task_arena arena(threads);
  arena.execute(all);
}

Image trace_pixels(const Rays& rays, int samples, int threads, const std::string& stage, const Report& report,
                   const std::function<void(const Rays::Ray& ray, V3f* color, float* alpha)>& trace) {
  Image image;
  image.width = rays.width;
  image.height = rays.height;
  image.channels = 4;
  image.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4);
  std::atomic<int> done{0};
  for_rows(image.height, threads, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      V3f color(0, 0, 0);
      float alpha = 0;
      for (int i = 0; i < samples; ++i) {
        const V2f at = pixel_sample(x, y, i, samples);
        trace(rays.at(x + static_cast<double>(at.x), y + static_cast<double>(at.y)), &color, &alpha);
      }
      float* out = image.at(x, y);
      for (int c = 0; c < 3; ++c) out[c] = alpha > 0 ? color[c] / alpha : 0.0f;
      out[3] = std::min(alpha / static_cast<float>(samples), 1.0f);
    }
    if (report.progress) report.progress(stage, static_cast<double>(++done) / image.height);
  });
  return image;
}

V3f lit_facet(const Look& look, const V3d& n, const V3d& v, const V3d& l, const V3f& color) {
  const double nl = n.dot(l), nv = std::max(n.dot(v), 1e-3);
  if (!(nl > 0)) return {0, 0, 0};
  V3f answer = look.albedo * static_cast<float>(nl);
  if (look.ks.x > 0 || look.ks.y > 0 || look.ks.z > 0) {
    const V3d h = unit_or(v + l, n);
    const double a = std::max(look.roughness, kMinRoughness), a2 = a * a, nh = n.dot(h);
    const double root = nh * nh * (a2 - 1) + 1;
    const double distribution = a2 / (std::numbers::pi * root * root);
    // Smith's masking of both directions, with the division by 4·nl·nv of the microfacet model.
    const double masking = 0.5 / (nl * std::sqrt(nv * nv * (1 - a2) + a2) + nv * std::sqrt(nl * nl * (1 - a2) + a2));
    answer += look.ks * static_cast<float>(std::numbers::pi * distribution * masking * nl);
  }
  return answer * color;
}

V3f ambient_of(const std::vector<Light>& lights) {
  V3f sum(0, 0, 0);
  for (const Light& light : lights)
    if (light.kind == Light::Kind::kAmbient) sum += light.color;
  return sum;
}

}  // namespace texel
