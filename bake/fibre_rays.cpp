// Stage 3c: fibres -> crossings of the axis-parallel sub-rays
#include <algorithm>
#include <cmath>

#include "bake/crossings.h"

namespace texel {
namespace {

constexpr double kUnit = 0x1p-16;

struct Corner { double u, v; };

// Corners of the rectangle about an outline, as wide as its wider end.
std::array<Corner, 4> corners_of(const FibreOutline& o) {
  const double w = std::max(o.wa, o.wb), far = o.length + o.behind;
  const auto at = [&](double along, double across) { return Corner{o.u + o.du * along - o.dv * across, o.v + o.dv * along + o.du * across}; };
  return {at(-o.before, -w), at(-o.before, w), at(far, w), at(far, -w)};
}

FibreOutline outline_of(const Bundle& bundle, const FibreSegment& fibre) { return fibre_outline(fibre, fibre_shape(fibre), bundle.axis, bundle.axes.u, bundle.axes.v); }

// Where a line v = const is within the rectangle about the outline: [low, high], empty where low > high.
void row_extent(const FibreOutline& o, double v, double& low, double& high) {
  const double w = std::max(o.wa, o.wb), y = v - o.v, far = o.length + o.behind;
  low = -1e300;
  high = 1e300;
  // |x dv − y du| <= w and −before <= x du + y dv <= far, for x = u − o.u
  const auto limit = [&](double factor, double from, double to) {
    if (std::abs(factor) < 1e-12) {
      if (from > 0 || to < 0) low = 1, high = -1;
      return;
    }
    const double a = from / factor, b = to / factor;
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  };
  limit(o.dv, y * o.du - w, y * o.du + w);
  if (low <= high) limit(o.du, -o.before - y * o.dv, far - y * o.dv);
  low += o.u;
  high += o.u;
}

}  // namespace

void bin_fibres(const Bundle& bundle, BundleLists& lists) {
  const auto for_each_band = [&](auto&& call) {
    for (std::uint32_t f = 0; f < bundle.plan->fibres.size(); ++f) {
      const auto corners = corners_of(outline_of(bundle, bundle.plan->fibres[f]));
      const auto [lo, hi] = std::minmax({corners[0].v, corners[1].v, corners[2].v, corners[3].v});
      if (!(hi >= 0 && lo <= bundle.nv)) continue;
      const int b0 = static_cast<int>(std::max(lo, 0.0)) / bundle.band_rows, b1 = std::min(bundle.bands - 1, static_cast<int>(std::min(hi, static_cast<double>(bundle.nv))) / bundle.band_rows);
      for (int b = b0; b <= b1; ++b) call(static_cast<std::size_t>(b), f);
    }
  };
  lists.fibre_first.assign(static_cast<std::size_t>(bundle.bands) + 1, 0);
  for_each_band([&](std::size_t b, std::uint32_t) { ++lists.fibre_first[b + 1]; });
  for (std::size_t b = 0; b < static_cast<std::size_t>(bundle.bands); ++b) lists.fibre_first[b + 1] += lists.fibre_first[b];
  lists.fibre_bins.resize(lists.fibre_first.back());
  std::vector<std::size_t> at(lists.fibre_first.begin(), lists.fibre_first.end() - 1);
  for_each_band([&](std::size_t b, std::uint32_t f) { lists.fibre_bins[at[b]++] = f; });
}

double fibre_place(const Bundle& bundle, const FibreSegment& fibre, double u, double v) { return std::max(0.0, meet_outline(outline_of(bundle, fibre), u, v)); }

void trace_fibres(const Bundle& bundle, int band, const Band& out, BandScratch& scratch) {
  const RayPattern& pattern = bundle.pattern;
  const auto b = static_cast<std::size_t>(band);
  const BundleLists& lists = *bundle.lists;
  for (std::size_t k = lists.fibre_first[b]; k < lists.fibre_first[b + 1]; ++k) {
    const FibreSegment& fibre = bundle.plan->fibres[lists.fibre_bins[k]];
    const FibreOutline o = outline_of(bundle, fibre);
    const V3d d = fibre.b - fibre.a;
    const auto corners = corners_of(o);
    const auto [lo, hi] = std::minmax({corners[0].v, corners[1].v, corners[2].v, corners[3].v});
    const int v0 = std::max(out.v0, static_cast<int>(std::floor(std::max(lo, -1.0)))), v1 = std::min(out.v1, static_cast<int>(std::min(hi, bundle.nv + 1.0)) + 1);
    for (int row = v0; row < v1; ++row)
      for (int r = 0; r < pattern.rows; ++r) {
        if (!bundle.used.empty() && bundle.used[static_cast<std::size_t>(row) * static_cast<std::size_t>(pattern.rows) + static_cast<std::size_t>(r)] == 0) continue;
        const double v = row + pattern.v[static_cast<std::size_t>(r)] * kUnit;
        if (v < lo || v > hi) continue;
        double from = 0, to = 0;
        row_extent(o, v, from, to);
        if (!(from <= to) || to < 0 || from > bundle.nu) continue;
        for (int j = 0; j < pattern.per_row; ++j) {
          const double offset = pattern.u[static_cast<std::size_t>(r * pattern.per_row + j)] * kUnit;
          const int first = std::max(0, static_cast<int>(std::ceil(std::max(from - offset, -1.0) - 1e-6))), last = static_cast<int>(std::floor(std::min(to - offset + 1e-6, bundle.nu - 1.0)));
          for (int column = first; column <= last; ++column) {
            if (!out.traced(column)) continue;
            const double u = column + offset, s = meet_outline(o, u, v);
            if (s < 0) continue;
            const V3d at = fibre.a + d * s;
            if (std::floor(at[bundle.axes.u]) != column || std::floor(at[bundle.axes.v]) != row) continue;
            Crossing c{};
            c.w = at[bundle.axes.w];
            c.cell = static_cast<std::int32_t>(std::floor(std::clamp(c.w, -2.0, bundle.nw + 2.0)));
            c.triangle = bundle.triangles + lists.fibre_bins[k];
            c.coverage = 1;
            c.enters = -1;  // with winding 0: what lies in a wall belongs to the cell beyond
            const std::size_t ray = ((static_cast<std::size_t>(row - out.v0) * static_cast<std::size_t>(pattern.rows) + static_cast<std::size_t>(r)) * static_cast<std::size_t>(out.width) + static_cast<std::size_t>(out.place(column))) *
                                        static_cast<std::size_t>(pattern.per_row) + static_cast<std::size_t>(j);
            scratch.found.push_back({c, static_cast<std::uint32_t>(ray)});
          }
        }
      }
  }
}

}  // namespace texel
