#include "formats/fibres.h"

#include <algorithm>
#include <cmath>

namespace texel {
namespace {

constexpr double kMost = 1e100;  // beyond it areas overflow
constexpr int kMostSteps = 256;

bool usable(const FibrePoint& p) {
  return std::abs(p.at.x) <= kMost && std::abs(p.at.y) <= kMost && std::abs(p.at.z) <= kMost && p.radius >= 0 && p.radius <= kMost;
}

}  // namespace

void FibreBuilder::strand(std::span<const FibrePoint> points, std::uint32_t material) {
  const std::size_t begin = fibres_.points.size();
  double thickest = 0;
  for (const FibrePoint& p : points) {
    if (!usable(p)) {
      ++bad_points_;
      continue;
    }
    if (fibres_.points.size() > begin && fibres_.points.back() == p.at) continue;
    thickest = std::max(thickest, p.radius);
    fibres_.points.push_back(p.at);
    fibres_.radii.push_back(p.radius);
    if (colored_) fibres_.colors.push_back(p.color);
  }
  const bool too_short = fibres_.points.size() < begin + 2;
  if (too_short || !(thickest > 0)) {
    ++(too_short ? short_ : thin_);
    fibres_.points.resize(begin);
    fibres_.radii.resize(begin);
    if (colored_) fibres_.colors.resize(begin);
    return;
  }
  fibres_.first.push_back(fibres_.points.size());
  fibres_.materials.push_back(material);
}

void FibreBuilder::moved(const Fibres& from, const Affine& place, std::uint32_t first_material) {
  const double thicker = std::cbrt(std::abs(place.determinant()));
  std::vector<FibrePoint> points;
  for (std::size_t s = 0; s < from.strands(); ++s) {
    points.clear();
    for (std::size_t i = from.first[s]; i < from.first[s + 1]; ++i)
      points.push_back({place * from.points[i], from.radii[i] * thicker, from.colors.empty() ? V3f(1, 1, 1) : from.colors[i]});
    strand(points, from.materials[s] + first_material);
  }
}

void FibreBuilder::report_to(Report& report, const std::string& where) const {
  if (bad_points_) report.issue("non-finite", "points of fibres whose coordinates or radius are not usable numbers; they were dropped", bad_points_, where);
  if (short_) report.issue("fibre-degenerate", "fibres with fewer than two different points; they were dropped", short_, where);
  if (thin_) report.issue("fibre-no-radius", "fibres whose radius is 0 throughout; they have no surface and were dropped", thin_, where);
}

std::string FibreBuilder::reason() const {
  if (bad_points_) return "no fibre has two points that are usable numbers";
  if (thin_) return "every fibre's radius is 0";
  return short_ ? "no fibre has two different points" : "holds no fibre";
}

void add_bezier(const std::array<FibrePoint, 4>& control, double tolerance, std::vector<FibrePoint>& to) {
  const auto bend = [&](std::size_t i) {
    const V3d d = control[i].at - control[i + 1].at * 2.0 + control[i + 2].at;
    return std::max(d.length(), std::abs(control[i].radius - 2 * control[i + 1].radius + control[i + 2].radius));
  };
  const double most = std::max(bend(0), bend(1));
  const double wanted = std::sqrt(6 * most / (8 * tolerance));
  const int steps = wanted < kMostSteps ? std::max(1, static_cast<int>(std::ceil(wanted))) : kMostSteps;  // not a number: the most
  for (int i = 1; i <= steps; ++i) {
    if (i == steps) {
      to.push_back(control[3]);
      break;
    }
    const double t = static_cast<double>(i) / steps, s = 1 - t;
    const double w[4] = {s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t};
    FibrePoint p{V3d(0, 0, 0), 0, V3f(0, 0, 0)};
    for (std::size_t k = 0; k < 4; ++k) {
      p.at += control[k].at * w[k];
      p.radius += control[k].radius * w[k];
      p.color += control[k].color * static_cast<float>(w[k]);
    }
    p.radius = std::max(0.0, p.radius);
    to.push_back(p);
  }
}

void join_fibres(Fibres& to, Fibres&& from, std::uint32_t first_material) {
  if (from.strands() == 0) return;
  if (to.colors.empty() != from.colors.empty()) {  // one without colours multiplies by white
    to.colors.resize(to.points.size(), V3f(1, 1, 1));
    from.colors.resize(from.points.size(), V3f(1, 1, 1));
  }
  const std::size_t points = to.points.size();
  to.points.insert(to.points.end(), from.points.begin(), from.points.end());
  to.radii.insert(to.radii.end(), from.radii.begin(), from.radii.end());
  to.colors.insert(to.colors.end(), from.colors.begin(), from.colors.end());
  for (std::size_t s = 1; s < from.first.size(); ++s) to.first.push_back(from.first[s] + points);
  for (const std::uint32_t m : from.materials) to.materials.push_back(m + first_material);
  from = {};
}

}  // namespace texel
