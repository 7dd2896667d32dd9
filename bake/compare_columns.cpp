#include "bake/compare_columns.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "bake/compare_voxels.h"
#include "bake/direction_opacity.h"
#include "bake/truth_voxels.h"
#include "formats/random.h"

namespace texel {
namespace {

constexpr int kEdgeRays = 16;  // a beam has so many squared

// Light through a level's voxels, each of one opacity in the ray's direction (docs/view.md: the axes' depths joined by the correlations of S).
struct Medium {
  const Level& level;
  VoxelField alpha, crossings, density, diagonal, off, transparency, solid;

  explicit Medium(const Level& l) : level(l), alpha(l, "alpha", 3), crossings(l, "crossings", 3), density(l, "density", 1), diagonal(l, "S_diag", 3), off(l, "S_off", 3), transparency(l, "transparency", 1), solid(l, "solid", 1) {}
  [[nodiscard]] bool present() const { return alpha.present() || density.present(); }
  [[nodiscard]] const VoxelField& matter() const { return alpha.present() ? alpha : density; }

  [[nodiscard]] double depth(const V3i& v, const V3d& w) const {
    constexpr double kMost = 40;  // e^-40 is none
    if (!alpha.present()) return std::max(static_cast<double>(density.value(v, 0)), 0.0) * level.grid.h;
    const float* a = alpha.at(v);
    if (!a) return 0;
    const float there = solid.value(v, 0) > 0 ? 1 : 1 - std::clamp(transparency.value(v, 0), 0.0f, 1.0f);
    return depth_along(axis_opacity(a, crossings.at(v), diagonal.at(v), off.at(v), solid.value(v, 0), there), w, kMost);
  }

  // From `at` (voxel space) along the unit direction for `length` voxels.
  [[nodiscard]] double through(const V3d& at, const V3d& w, double length) const {
    double depths = 0;
    for (double t = 0; t < length && depths < 40;) {
      const V3d p = at + w * (t + 1e-9);
      const V3i v(static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)), static_cast<int>(std::floor(p.z)));
      double next = length;
      for (int k = 0; k < 3; ++k)
        if (w[k] != 0) next = std::min(next, ((w[k] > 0 ? v[k] + 1 : v[k]) - at[k]) / w[k]);
      next = std::max(next, t + 1e-9);
      if (v.x >= 0 && v.y >= 0 && v.z >= 0) depths += depth(v, w) * (next - t);
      t = next;
    }
    return std::exp(-depths);
  }
};

struct Beam {
  V3d middle, along;           // voxel space of the level
};

// Where the line middle + t·along is in the grid.
bool clip(const Beam& beam, const V3d& offset, const V3i& n, double& from, double& to) {
  from = -1e300;
  to = 1e300;
  for (int k = 0; k < 3; ++k) {
    const double x = beam.middle[k] + offset[k];
    if (beam.along[k] == 0) {
      if (x < 0 || x > n[k]) return false;
      continue;
    }
    const double a = -x / beam.along[k], b = (n[k] - x) / beam.along[k];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  return from < to;
}

struct Passed { double truth = 0, pack = 0; };

Passed pass(const Beam& beam, const Medium& medium, const LightPassed& truth, std::uint64_t seed) {
  int smallest = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(beam.along[k]) < std::abs(beam.along[smallest])) smallest = k;
  V3d unit(0, 0, 0);
  unit[smallest] = 1;
  const V3d u = beam.along.cross(unit).normalized(), v = beam.along.cross(u);
  RandomSequence random(seed);
  Passed sum;
  constexpr double kRays = kEdgeRays * kEdgeRays;
  for (int i = 0; i < kEdgeRays * kEdgeRays; ++i) {
    const double x = (i % kEdgeRays + random.next()) / kEdgeRays - 0.5, y = (i / kEdgeRays + random.next()) / kEdgeRays - 0.5;  // NOLINT: whole rows
    const V3d offset = u * x + v * y;
    double from = 0, to = 0;
    if (!clip(beam, offset, medium.level.grid.n, from, to)) {
      sum.truth += 1;
      sum.pack += 1;
      continue;
    }
    const V3d start = beam.middle + offset + beam.along * from;
    sum.truth += truth({start, beam.along, to - from, mix_bits(seed ^ mix_bits(static_cast<std::uint64_t>(i)))});
    sum.pack += medium.through(start, beam.along, to - from);
  }
  return {sum.truth / kRays, sum.pack / kRays};
}

ErrorSums measure(const std::vector<Beam>& beams, const Medium& medium, const LightPassed& truth, std::uint64_t seed, const std::string& stage, Report& report) {
  std::vector<Passed> passed(beams.size());
  std::atomic<std::size_t> done{0};
  tbb::parallel_for(std::size_t{0}, beams.size(), [&](std::size_t i) {
    passed[i] = pass(beams[i], medium, truth, seed * 0x2545f4914f6cdd1du + i);
    const std::size_t d = ++done;
    if (report.progress) report.progress(stage, static_cast<double>(d) / static_cast<double>(beams.size()));
  });
  ErrorSums errors;
  for (const Passed& p : passed) errors.add(p.pack - p.truth);
  return errors;
}

}  // namespace

void compare_columns(const Level& level, int number, const LightPassed& truth, const ColumnOptions& options, std::vector<Measure>& rows, Report& report) {
  const Medium medium(level);
  if (!medium.present()) return;
  const V3i n = level.grid.n;
  std::vector<V3i> matter;
  for_each_active(medium.matter(), n, [&](const V3i& v, const float*) { matter.push_back(v); });
  const std::string stage = "columns of level " + std::to_string(number);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<V3i> columns = matter;
    for (V3i& v : columns) v[axis] = 0;
    std::sort(columns.begin(), columns.end(), [](const V3i& a, const V3i& b) { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; });
    columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
    const auto of = static_cast<std::int64_t>(columns.size());
    std::vector<Beam> beams;
    V3d along(0, 0, 0);
    along[axis] = 1;
    for (const V3i& v : sample_voxels(std::move(columns), options.columns, options.seed + static_cast<unsigned>(axis))) beams.push_back({V3d(v) + V3d(0.5), along});
    const ErrorSums errors = measure(beams, medium, truth, options.seed + static_cast<unsigned>(axis), stage, report);
    rows.push_back(at_level(errors.bias("column_bias", of), number, axis));
    rows.push_back(at_level(errors.rms("column_rms", of), number, axis));
  }
  // Beams are drawn from infinitely many: the whole there is counts for nothing.
  RandomSequence random(options.seed * 977ull + 13);
  std::vector<Beam> beams;
  for (int i = 0; i < options.columns && !matter.empty(); ++i) {
    const V3i v = matter[static_cast<std::size_t>(random.next() * static_cast<double>(matter.size()))];
    const double z = 2 * random.next() - 1, phi = 2 * std::numbers::pi * random.next(), r = std::sqrt(1 - z * z);
    const double x = random.next(), y = random.next(), w = random.next();
    beams.push_back({V3d(v) + V3d(x, y, w), V3d(r * std::cos(phi), r * std::sin(phi), z)});
  }
  const ErrorSums errors = measure(beams, medium, truth, options.seed + 3, stage, report);
  rows.push_back(at_level(errors.bias("direction_bias", kEndless), number));
  rows.push_back(at_level(errors.rms("direction_rms", kEndless), number));
}

}  // namespace texel
