#include "bake/density_slices.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "bake/block_index.h"

namespace texel {
namespace {

// A run of voxels along a column: one border voxel, or inside ones (index −1).
struct Piece {
  std::uint32_t at;
  std::int32_t first, last;
  std::int64_t index;
};

}  // namespace

SliceRecords density_slices(const Surface& surface, const Visibility& seen, const Grid& grid, int axis, int count, const std::function<V3f(const V3i&, std::int64_t)>& shade) {
  const BundleAxes axes = bundle_axes(axis);
  const int nu = grid.n[axes.u], nv = grid.n[axes.v], nw = grid.n[axes.w];
  // Pieces of each row of columns, then in order of the column.
  std::vector<std::vector<Piece>> rows(static_cast<std::size_t>(nv));
  const auto add = [&](const V3i& voxel, int length, std::int64_t index) {
    const int u = voxel[axes.u], v = voxel[axes.v], w = voxel[axes.w];
    rows[static_cast<std::size_t>(v)].push_back({static_cast<std::uint32_t>(v) * static_cast<std::uint32_t>(nu) + static_cast<std::uint32_t>(u), w, w + length, index});
  };
  for_each_voxel(surface.set, [&](const V3i& voxel, std::int64_t i) { add(voxel, 1, i); });
  for_each_voxel(seen.inside, [&](const V3i& voxel, std::int64_t) { add(voxel, 1, -1); });
  for (const V3i& at : seen.inside_blocks)
    for (int v = 0; v < 8; ++v)
      for (int u = 0; u < 8; ++u) {
        V3i voxel = at * 8;
        voxel[axes.u] += u;
        voxel[axes.v] += v;
        add(voxel, 8, -1);
      }
  const auto& alpha = seen.alpha[static_cast<std::size_t>(axis)];
  std::vector<SliceBand> bands(static_cast<std::size_t>(nv));
  tbb::parallel_for(0, nv, [&](int v) {
    std::vector<Piece>& pieces = rows[static_cast<std::size_t>(v)];
    std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) { return a.at != b.at ? a.at < b.at : a.first < b.first; });
    SliceBand& out = bands[static_cast<std::size_t>(v)];
    struct SliceSum { double passes = 1, weight = 0; V3d color{0, 0, 0}; bool has_color = false; };
    std::vector<SliceSum> slices(static_cast<std::size_t>(count));
    std::vector<int> touched;
    for (std::size_t p = 0; p < pieces.size();) {
      const std::uint32_t at = pieces[p].at;
      touched.clear();
      std::vector<SliceRecords::Run> runs;
      for (; p < pieces.size() && pieces[p].at == at; ++p) {
        const Piece& piece = pieces[p];
        // The slices a voxel lies in share its optical depth by length.
        const double low = static_cast<double>(piece.first) * count / nw, high = static_cast<double>(piece.last) * count / nw;
        const int k0 = static_cast<int>(std::floor(low)), k1 = std::min(count, static_cast<int>(std::ceil(high)));
        if (piece.index < 0) {
          if (!runs.empty() && runs.back().last >= k0) runs.back().last = std::max(runs.back().last, k1);
          else runs.push_back({at, k0, k1, 1.0f});
          continue;
        }
        const auto i = static_cast<std::size_t>(piece.index);
        V3i voxel;
        voxel[axes.u] = static_cast<int>(at) % nu;
        voxel[axes.v] = v;
        voxel[axes.w] = piece.first;
        const V3f color = shade(voxel, piece.index);
        const double opacity = static_cast<double>(alpha[i]);
        for (int k = k0; k < k1; ++k) {
          const double share = std::min(high, k + 1.0) - std::max(low, static_cast<double>(k));
          if (!(share > 0)) continue;
          SliceSum& slice = slices[static_cast<std::size_t>(k)];
          if (touched.empty() || touched.back() != k) touched.push_back(k);
          const double whole = high - low;
          slice.passes *= share >= whole ? 1 - opacity : std::pow(1 - opacity, share / whole);
          if (color.x < 0) continue;
          const double weight = std::max(opacity, 1e-9) * share;
          slice.color += V3d(color) * weight;
          slice.weight += weight;
        }
      }
      // A slice that inside matter reaches into is opaque; where border voxels do so too it has their colour.
      std::size_t t = 0;
      for (const SliceRecords::Run& run : runs) {
        std::int32_t from = run.first;
        for (; t < touched.size() && touched[t] < run.last; ++t) {
          if (touched[t] < run.first) continue;
          slices[static_cast<std::size_t>(touched[t])].passes = 0;
          if (touched[t] > from) out.runs.push_back({at, from, touched[t], 1.0f});
          from = touched[t] + 1;
        }
        if (run.last > from) out.runs.push_back({at, from, run.last, 1.0f});
      }
      for (const int k : touched) {
        SliceSum& slice = slices[static_cast<std::size_t>(k)];
        SliceRecords::Pixel pixel{at, -1, -1, -1, static_cast<float>(1 - slice.passes)};
        if (slice.weight > 0) {
          const V3f color(slice.color / slice.weight);
          pixel.r = color.x;
          pixel.g = color.y;
          pixel.b = color.z;
        }
        if (pixel.a > 0) out.records.push_back({k, pixel});
        slice = {};
      }
    }
  });
  return gather_slices(axis, nu, nv, count, bands);
}

}  // namespace texel
