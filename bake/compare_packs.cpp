// Pack against pack: every voxel, every column, every slice.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "bake/compare_sums.h"
#include "bake/compare_voxels.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr int kDirections = 64;

std::string text_of(const Grid& g) {
  char text[160];
  std::snprintf(text, sizeof text, "%d x %d x %d voxels of %.9g from %.9g, %.9g, %.9g", g.n.x, g.n.y, g.n.z, g.h, g.origin.x, g.origin.y, g.origin.z);
  return text;
}

void require_same_grid(const Grid& a, const Grid& b) {
  constexpr double kSlack = 1e-6;  // of an edge
  bool same = a.n == b.n && std::abs(a.h - b.h) <= kSlack * b.h / std::max({b.n.x, b.n.y, b.n.z});
  for (int k = 0; k < 3; ++k) same = same && std::abs(a.origin[k] - b.origin[k]) <= kSlack * b.h;
  if (!same) throw Error(Code::kBadInput, "", "the packs' grids differ (" + text_of(a) + "; " + text_of(b) + ")", "bake both with the same --box and --resolution");
}

using Rows = std::vector<Measure>;

void compare_alpha(const VoxelField& a, const VoxelField& b, int level, Rows& rows) {
  std::array<ErrorSums, 3> sums;
  std::int64_t missing = 0, extra = 0;
  for_either(a, b, [&](const V3i&, const float* x, const float* y) {
    missing += !x;
    extra += !y;
    if (x && y && x[0] == 1 && x[1] == 1 && x[2] == 1 && y[0] == 1 && y[1] == 1 && y[2] == 1) return;  // inside in both: tells nothing
    for (std::size_t k = 0; k < 3; ++k) sums[k].add((x ? static_cast<double>(x[k]) : 0) - (y ? static_cast<double>(y[k]) : 0));
  });
  rows.push_back(at_level(exactly("voxels_missing", static_cast<double>(missing), missing), level));
  rows.push_back(at_level(exactly("voxels_extra", static_cast<double>(extra), extra), level));
  for (int k = 0; k < 3; ++k) {
    const ErrorSums& s = sums[static_cast<std::size_t>(k)];
    rows.push_back(at_level(s.bias("alpha_bias"), level, k));
    rows.push_back(at_level(s.rms("alpha_rms"), level, k));
    rows.push_back(at_level(s.max("alpha_max"), level, k));
  }
}

// Σ over a level; relative to b's where that is not 0.
void compare_sum(const VoxelField& a, const VoxelField& b, const char* relative, const char* rms, bool by_mean, int level, Rows& rows) {
  double sum_a = 0, sum_b = 0;
  std::int64_t count = 0;
  for_either(a, b, [&](const V3i&, const float* x, const float* y) {
    sum_a += x ? static_cast<double>(*x) : 0;
    sum_b += y ? static_cast<double>(*y) : 0;
    ++count;
  });
  if (sum_b > 0) rows.push_back(at_level(exactly(relative, sum_a / sum_b - 1, count), level));
  const double unit = by_mean && sum_b > 0 ? sum_b / static_cast<double>(count) : 1;
  ErrorSums errors;
  for_either(a, b, [&](const V3i&, const float* x, const float* y) { errors.add(((x ? static_cast<double>(*x) : 0) - (y ? static_cast<double>(*y) : 0)) / unit); });
  rows.push_back(at_level(errors.rms(rms), level));
}

// Of a grid with one or three components, where both have it.
void compare_grid(const VoxelField& a, const VoxelField& b, int components, double unit, const std::string& rms, const char* max, int level, Rows& rows) {
  ErrorSums errors;
  for_either(a, b, [&](const V3i&, const float* x, const float* y) {
    if (!x || !y) return;
    double mean = 0, square = 0, most = 0;
    for (int c = 0; c < components; ++c) {
      const double e = (static_cast<double>(x[c]) - static_cast<double>(y[c])) * unit;
      mean += e / components;
      square += e * e / components;
      most = std::max(most, std::abs(e));
    }
    errors.add(mean, square, most);
  });
  rows.push_back(at_level(errors.rms(rms), level));
  if (max) rows.push_back(at_level(errors.max(max), level));
}

void compare_normals(const VoxelField& a, const VoxelField& b, int level, Rows& rows) {
  ErrorSums errors;
  for_either(a, b, [&](const V3i&, const float* x, const float* y) {
    if (x && y) errors.add((V3d(V3f(x[0], x[1], x[2])) - V3d(V3f(y[0], y[1], y[2]))).length());
  });
  rows.push_back(at_level(errors.rms("normal_rms"), level));
}

void compare_ndf(const Level& a, const Level& b, const CompareOptions& options, int level, Rows& rows) {
  const NdfField ndf_a(a, options.ndf_a), ndf_b(b, options.ndf_b);
  const VoxelField area_a(a, "area", 1), area_b(b, "area", 1), cover_a(a, "coverage", 1), cover_b(b, "coverage", 1);
  if (!ndf_a.present() || !ndf_b.present() || !area_a.present() || !area_b.present()) return;
  const std::vector<V3d> directions = half_sphere(kDirections);
  std::vector<double> sigma_a(directions.size()), sigma_b(directions.size());
  ErrorSums sigma, angle;
  std::int64_t indefinite = 0;
  double covered = 0;
  for_either(area_a, area_b, [&](const V3i& v, const float* x, const float* y) {
    if (!x || !y) return;
    const auto p = ndf_a.at(v), q = ndf_b.at(v);
    const double covered_a = static_cast<double>(*x * cover_a.value(v, 1)), covered_b = static_cast<double>(*y * cover_b.value(v, 1));
    const auto lobes_p = ndf_a.lobes(v), lobes_q = ndf_b.lobes(v);
    if (p) indefinite += is_indefinite(*p) || is_indefinite(lobes_p->ndf[0]) || is_indefinite(lobes_p->ndf[1]);
    if (!p || !q || !(covered_b > 0)) return;
    projected_areas(*lobes_p, covered_a, directions, sigma_a);
    projected_areas(*lobes_q, covered_b, directions, sigma_b);
    add_sigma(sigma_a, sigma_b, sigma);
    covered += covered_b;
    if (const auto axis = principal_axis(*q)) angle.add(axis_angle(axis_of(*p, axis->fibre), axis_of(*q, axis->fibre)));
  });
  const double mean = sigma.count > 0 ? covered / 2 / static_cast<double>(sigma.count) : 0;
  rows.push_back(at_level(in_units(sigma.rms("sigma_rms"), mean), level));
  rows.push_back(at_level(in_units(sigma.max("sigma_max"), mean), level));
  rows.push_back(at_level(angle.rms("axis_angle_rms"), level));
  rows.push_back(at_level(angle.max("axis_angle_max"), level));
  rows.push_back(at_level(exactly("indefinite", static_cast<double>(indefinite), indefinite), level));
}

void compare_columns(const VoxelField& a, const VoxelField& b, const V3i& n, int level, Rows& rows) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> x = column_transmittance(a, n, axis), y = column_transmittance(b, n, axis);
    ErrorSums errors;
    for (std::size_t i = 0; i < x.size(); ++i)
      if (x[i] < 1 || y[i] < 1) errors.add(x[i] - y[i]);
    rows.push_back(at_level(errors.bias("column_bias"), level, axis));
    rows.push_back(at_level(errors.rms("column_rms"), level, axis));
  }
}

void compare_levels(const Level& a, const Level& b, const CompareOptions& options, int level, Comparison& out) {
  Rows& rows = out.measures;
  const auto both = [&](const char* name) {
    const bool in_a = a.find(name), in_b = b.find(name);
    if (in_a != in_b) out.skipped.push_back({"grid " + std::string(name) + " of level " + std::to_string(level), std::string("only the ") + (in_a ? "first" : "second") + " pack has it"});
    return in_a && in_b;
  };
  if (both("alpha")) {
    const VoxelField x(a, "alpha", 3), y(b, "alpha", 3);
    compare_alpha(x, y, level, rows);
    compare_columns(x, y, a.grid.n, level, rows);
  }
  if (both("density")) compare_grid({a, "density", 1}, {b, "density", 1}, 1, a.grid.h, "depth_rms", nullptr, level, rows);
  if (both("solid")) compare_sum({a, "solid", 1}, {b, "solid", 1}, "volume_relative", "solid_rms", false, level, rows);
  if (both("area")) compare_sum({a, "area", 1}, {b, "area", 1}, "area_relative", "area_rms", true, level, rows);
  if (both("normal")) compare_normals({a, "normal", 3}, {b, "normal", 3}, level, rows);
  compare_ndf(a, b, options, level, rows);
  if (both("Cd")) compare_grid({a, "Cd", 3}, {b, "Cd", 3}, 3, 1, "color_rms", "color_max", level, rows);
  for (const char* name : {"coverage", "crossings", "kd", "ks", "roughness", "transparency", "emission"})
    if (both(name)) {
      const int components = a.find(name)->components;
      if (components != b.find(name)->components) out.skipped.push_back({"grid " + std::string(name), "one pack has it as a number, the other as a vector"});
      else compare_grid({a, name, components}, {b, name, components}, components, 1, std::string(name) + "_rms", nullptr, level, rows);
    }
}

void compare_stacks(const SliceStack& a, const SliceStack& b, Comparison& out, Report& report) {
  ErrorSums alpha, color;
  for (int k = 0; k < a.count; ++k) {
    if (report.progress) report.progress("slices", static_cast<double>(k) / a.count);
    const Image x = a.image(k), y = b.image(k);
    if (x.pixels.size() != y.pixels.size() || x.channels != 4) throw Error(Code::kBadInput, "", "a slice does not have the size its manifest says");
    for (std::size_t i = 0; i < x.pixels.size(); i += 4) {
      const double p = static_cast<double>(x.pixels[i + 3]), q = static_cast<double>(y.pixels[i + 3]);
      double mean = 0, square = 0, most = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double e = static_cast<double>(x.pixels[i + c]) * p - static_cast<double>(y.pixels[i + c]) * q;
        mean += e / 3;
        square += e * e / 3;
        most = std::max(most, std::abs(e));
      }
      alpha.add(p - q);
      color.add(mean, square, most);
    }
  }
  out.measures.push_back(at_level(alpha.rms("slice_alpha_rms"), a.level, a.axis));
  out.measures.push_back(at_level(color.rms("slice_color_rms"), a.level, a.axis));
}

}  // namespace

Comparison compare_packs(const Pack& a, const Pack& b, const CompareOptions& options, Report& report) {
  require_same_grid(a.grid, b.grid);
  Comparison out;
  const std::size_t levels = std::min(a.levels.size(), b.levels.size());
  for (std::size_t l = 0; l < levels; ++l) {
    if (options.level >= 0 && l != static_cast<std::size_t>(options.level)) continue;
    if (report.progress) report.progress("voxels", static_cast<double>(l) / static_cast<double>(levels));
    compare_levels(a.levels[l], b.levels[l], options, static_cast<int>(l), out);
  }
  if (a.levels.size() != b.levels.size())
    out.skipped.push_back({"levels from " + std::to_string(levels), "the first pack has " + std::to_string(a.levels.size()) + ", the second " + std::to_string(b.levels.size())});
  for (const SliceStack& x : a.slices) {
    if (options.level >= 0 && x.level != options.level) continue;
    const auto y = std::find_if(b.slices.begin(), b.slices.end(), [&](const SliceStack& s) { return s.axis == x.axis && s.level == x.level; });
    const std::string what = std::string("slices along ") + "xyz"[x.axis] + " of level " + std::to_string(x.level);
    if (y == b.slices.end()) out.skipped.push_back({what, "only the first pack has them"});
    else if (x.count != y->count || x.width != y->width || x.height != y->height) out.skipped.push_back({what, "the packs have another number or size of them"});
    else compare_stacks(x, *y, out, report);
  }
  for (const SliceStack& y : b.slices)
    if (options.level < 0 && std::none_of(a.slices.begin(), a.slices.end(), [&](const SliceStack& s) { return s.axis == y.axis && s.level == y.level; }))
      out.skipped.push_back({std::string("slices along ") + "xyz"[y.axis] + " of level " + std::to_string(y.level), "only the second pack has them"});
  return out;
}

}  // namespace texel
