#include "bake/visibility.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "bake/block_index.h"

namespace texel {
namespace {

// Sums are integers, so that bands may add to the same voxel in any order.
constexpr double kAlphaUnit = 0x1p24;
constexpr double kLengthUnit = 0x1p32;

struct Sums {                                // of one level
  std::array<std::vector<std::uint64_t>, 3> alpha, crossings;
  std::array<std::vector<std::uint64_t>, 3> solid;
};

void add(std::vector<std::uint64_t>& to, std::int64_t at, std::uint64_t value) {
  if (value) std::atomic_ref<std::uint64_t>(to[static_cast<std::size_t>(at)]).fetch_add(value, std::memory_order_relaxed);
}

// Blocks of a set by the column (u, v) they stand in, in ascending w.
struct BlockColumns {
  int nu = 0, nv = 0;
  std::vector<std::size_t> first;
  std::vector<std::int32_t> blocks;

  BlockColumns(const VoxelSet& set, const Grid& grid, const BundleAxes& axes)
      : nu((grid.n[axes.u] + 7) / 8), nv((grid.n[axes.v] + 7) / 8), first(static_cast<std::size_t>(nu) * static_cast<std::size_t>(nv) + 1, 0) {
    const auto place = [&](const Block& b) { return static_cast<std::size_t>(b.at[axes.v]) * static_cast<std::size_t>(nu) + static_cast<std::size_t>(b.at[axes.u]); };
    for (const Block& b : set.blocks) ++first[place(b) + 1];
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    blocks.resize(set.blocks.size());
    std::vector<std::size_t> at(first.begin(), first.end() - 1);
    // Blocks come sorted by (z, y, x), so every column gets its blocks in ascending w.
    for (std::size_t i = 0; i < set.blocks.size(); ++i) blocks[at[place(set.blocks[i])]++] = static_cast<std::int32_t>(i);
  }
};

struct LevelView {
  const Surface* surface;
  BlockColumns columns;

  void cells(const BundleAxes& axes, int u, int v, std::vector<Cell>& out) const {
    out.clear();
    const std::size_t column = static_cast<std::size_t>(v >> 3) * static_cast<std::size_t>(columns.nu) + static_cast<std::size_t>(u >> 3);
    V3i local;
    local[axes.u] = u & 7;
    local[axes.v] = v & 7;
    for (std::size_t i = columns.first[column]; i < columns.first[column + 1]; ++i) {
      const Block& block = surface->set.blocks[static_cast<std::size_t>(columns.blocks[i])];
      for (int w = 0; w < 8; ++w) {
        local[axes.w] = w;
        if (block.has(local.x, local.y, local.z)) out.push_back({block.at[axes.w] * 8 + w, block.index(local.x, local.y, local.z)});
      }
    }
  }
};

// Nearest integer of a value that is not negative.
std::uint64_t round_up(double x) { return static_cast<std::uint64_t>(x + 0.5); }

struct InsideRun { std::int32_t u, v, first, last; };  // voxels of a level-0 column that are wholly inside

struct CellSum { std::uint64_t alpha, crossings, length; int inside_above; };

struct Worker {                               // reused buffers of one thread
  Band band;
  BandScratch trace;
  SliceScratch slice;
  std::vector<Cell> cells;
  std::vector<CellSum> sums;
};

// Follows one ray through the border voxels of its column. Cells are level-`level` voxels.
void follow_ray(const Crossing* c, const Crossing* end, std::span<const Cell> cells, int level, std::span<CellSum> sums, int* inside_first) {
  int winding = 0;
  const int below = cells.empty() ? 0 : cells.front().k << level;
  while (c != end && c->cell < below) winding += (c++)->winding;
  if (inside_first) *inside_first += winding != 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const int lo = cells[i].k << level, hi = lo + (1 << level);
    while (c != end && c->cell < lo) winding += (c++)->winding;
    CellSum& sum = sums[i];
    bool stopped = winding != 0;
    if (c == end || c->cell >= hi) {
      if (stopped) {
        sum.alpha += static_cast<std::uint64_t>(kAlphaUnit);
        sum.length += static_cast<std::uint64_t>(kLengthUnit);
        ++sum.inside_above;
      }
      continue;
    }
    double open = 1, length = 0, from = lo, met = 0;
    for (; c != end && c->cell < hi; ++c) {
      if (winding != 0) length += c->w - from;
      from = c->w;
      winding += c->winding;
      stopped = stopped || winding != 0;
      open *= 1 - static_cast<double>(c->coverage);
      met += static_cast<double>(c->coverage);
    }
    if (winding != 0) { length += hi - from; ++sum.inside_above; }
    sum.alpha += round_up((stopped ? 1 : 1 - open) * kAlphaUnit);
    sum.crossings += round_up(met * kAlphaUnit);
    sum.length += round_up(std::clamp(length, 0.0, static_cast<double>(hi - lo)) * kLengthUnit);
  }
}

// Which rays a level uses: every one up to level 1; then every 2^(level−1)th row, and in it every 2^(level−1)th column, staggered.
struct RayStep {
  int step;
  explicit RayStep(int level) : step(level <= 1 ? 1 : 1 << (level - 1)) {}
  [[nodiscard]] bool row(std::int64_t r) const { return r % step == step / 2; }
  [[nodiscard]] int first_column(std::int64_t r) const { return static_cast<int>((r / step) * 7 % step); }
};

struct Tracer {
  const Bundle& bundle;
  std::span<const LevelView> views;
  std::vector<Sums>& sums;
  int levels;                                 // how many of them are traced
  const VisibilityOptions& options;
  const SliceShader& shade;
  // Of level 0; a voxel's rays along one axis are all in one band, so adding needs no order. Null: not wanted.
  std::vector<Moments>* visible;
  mutable std::vector<double> weights{};

  std::span<const Crossing> ray(const Band& band, std::size_t id) const {
    return {band.crossings.data() + band.first[id], band.crossings.data() + band.first[id + 1]};
  }

  // The part of a cell's surface that a ray sees first from either side, weighted so that surface seen along all three axes counts
  // its area: a ray's share of a face over |nx| + |ny| + |nz|, the rays it gets from the three axes together (Ratib 1997 §3.3.1).
  void add_visible(std::span<const Crossing> list, std::span<const Cell> cells) const {
    std::size_t c = 0;
    int winding = 0;
    for (const Cell& cell : cells) {
      for (; c < list.size() && list[c].cell < cell.k; ++c) winding += list[c].winding;
      const std::size_t first = c;
      double front = winding == 0 ? 1 : 0;
      std::vector<double>& seen = weights;
      seen.clear();
      for (; c < list.size() && list[c].cell == cell.k; ++c) {
        seen.push_back(front * static_cast<double>(list[c].coverage));
        winding += list[c].winding;
        front = winding != 0 ? 0 : front * (1 - static_cast<double>(list[c].coverage));
      }
      double back = winding == 0 ? 1 : 0;
      int inside = winding;
      for (std::size_t i = c; i-- > first;) {
        const double from_back = back * static_cast<double>(list[i].coverage);
        add_surface(list[i].triangle, std::max(seen[i - first], from_back), cell.index);
        inside -= list[i].winding;
        back = inside != 0 ? 0 : back * (1 - static_cast<double>(list[i].coverage));
      }
    }
  }

  void add_surface(std::uint32_t triangle, double weight, std::int64_t voxel) const {
    if (!(weight > 0)) return;
    const auto& t = bundle.scene->mesh.triangles[triangle];
    const V3d n = triangle_normal(bundle.plan->points[t[0]], bundle.plan->points[t[1]], bundle.plan->points[t[2]]) * static_cast<double>(bundle.plan->turn[triangle]);
    const double sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    if (!(sum > 0)) return;
    const double area = weight / (sum * bundle.pattern.rays());
    Moments& m = (*visible)[static_cast<std::size_t>(voxel)];
    m.covered += area;
    if (!bundle.plan->two_sided[bundle.scene->mesh.materials[triangle]]) m.m += n * area;
    m.xx += area * n.x * n.x;
    m.yy += area * n.y * n.y;
    m.zz += area * n.z * n.z;
    m.xy += area * n.x * n.y;
    m.xz += area * n.x * n.z;
    m.yz += area * n.y * n.z;
  }

  void level_column(Worker& w, int level, int cu, int cv, std::vector<InsideRun>* runs) const {
    const Band& band = w.band;
    const RayPattern& pattern = bundle.pattern;
    views[static_cast<std::size_t>(level)].cells(bundle.axes, cu, cv, w.cells);
    if (w.cells.empty() && !runs) return;
    w.sums.assign(w.cells.size(), {});
    const RayStep step(level);
    const int v0 = std::max(band.v0, cv << level), v1 = std::min(band.v1, (cv + 1) << level);
    const int u0 = cu << level, u1 = std::min(bundle.nu, (cu + 1) << level);
    int rays = 0, inside_first = 0;
    for (std::int64_t row = std::int64_t{v0} * pattern.rows; row < std::int64_t{v1} * pattern.rows; ++row) {
      if (!step.row(row)) continue;
      const std::size_t base = static_cast<std::size_t>(row - std::int64_t{band.v0} * pattern.rows) * static_cast<std::size_t>(bundle.nu);
      for (int u = u0 + step.first_column(row); u < u1; u += step.step)
        for (int j = 0; j < pattern.per_row; ++j) {
          const auto list = ray(band, (base + static_cast<std::size_t>(u)) * static_cast<std::size_t>(pattern.per_row) + static_cast<std::size_t>(j));
          ++rays;
          if (list.empty()) continue;         // meets nothing anywhere: adds nothing
          if (level == 0 && visible) add_visible(list, w.cells);
          follow_ray(list.data(), list.data() + list.size(), w.cells, level, w.sums, runs ? &inside_first : nullptr);
        }
    }
    Sums& to = sums[static_cast<std::size_t>(level)];
    const auto axis = static_cast<std::size_t>(bundle.axis);
    for (std::size_t i = 0; i < w.cells.size(); ++i) {
      add(to.alpha[axis], w.cells[i].index, w.sums[i].alpha);
      if (level > 0) continue;                // these two are means: coarser levels take them from level 0
      add(to.crossings[axis], w.cells[i].index, w.sums[i].crossings);
      add(to.solid[axis], w.cells[i].index, w.sums[i].length);
    }
    if (!runs) return;
    // Between border voxels all rays agree; half of them decides, should rounding make one differ.
    int from = 0, inside = inside_first;
    for (std::size_t i = 0; i <= w.cells.size(); ++i) {
      const int to_cell = i < w.cells.size() ? w.cells[i].k : bundle.nw;
      if (2 * inside > rays && to_cell > from) runs->push_back({cu, cv, from, to_cell});
      if (i == w.cells.size()) break;
      from = w.cells[i].k + 1;
      inside = w.sums[i].inside_above;
    }
  }

  // `runs` collects the inside runs, on one axis only.
  void band(Worker& w, int index, SliceBand* slices, std::vector<InsideRun>* runs) const {
    trace_band(bundle, index, w.band, w.trace);
    const auto axis = static_cast<std::size_t>(bundle.axis);
    if (options.volume_axes[axis])
      for (int level = 0; level < levels; ++level) {
        const int c0 = w.band.v0 >> level, c1 = (w.band.v1 - 1) >> level, cu1 = (bundle.nu - 1) >> level;
        for (int cv = c0; cv <= c1; ++cv)
          for (int cu = 0; cu <= cu1; ++cu) level_column(w, level, cu, cv, level == 0 ? runs : nullptr);
      }
    if (slices)
      for (int v = w.band.v0; v < w.band.v1; ++v)
        for (int u = 0; u < bundle.nu; ++u) {
          views[0].cells(bundle.axes, u, v, w.cells);
          slice_column(bundle, w.band, {u, v, options.slice_counts[axis], w.cells}, shade, w.slice, *slices);
        }
  }
};

// Level-0 inside runs along z -> sets of voxels and whole blocks.
void collect_inside(const std::vector<std::vector<InsideRun>>& runs, const Surface& surface, const Grid& grid, Visibility& out) {
  const BlockIndex border(surface.set, grid.n);
  VoxelSet all;
  std::vector<std::int32_t> slot(border.slots.size(), -1);
  for (const auto& band : runs)
    for (const InsideRun& run : band)
      for (int bz = run.first >> 3; bz <= (run.last - 1) >> 3; ++bz) {
        const V3i at(run.u >> 3, run.v >> 3, bz);
        std::int32_t& s = slot[border.place(at)];
        if (s < 0) {
          s = static_cast<std::int32_t>(all.blocks.size());
          all.blocks.emplace_back().at = at;
        }
        const int z0 = std::max(run.first - bz * 8, 0), z1 = std::min(run.last - bz * 8, 8);
        const std::uint64_t bits = ((std::uint64_t{1} << (z1 - z0)) - 1) << z0;
        all.blocks[static_cast<std::size_t>(s)].mask[static_cast<std::size_t>(run.u & 7)] |= bits << ((run.v & 7) << 3);
      }
  for (std::size_t place = 0; place < slot.size(); ++place) {
    if (slot[place] < 0) continue;
    Block& block = all.blocks[static_cast<std::size_t>(slot[place])];
    int bits = 0;
    for (const std::uint64_t word : block.mask) bits += __builtin_popcountll(word);
    out.inside_count += bits;
    if (bits == 512) { out.inside_blocks.push_back(block.at); continue; }
    block.first = out.inside.count;
    out.inside.count += bits;
    out.inside.blocks.push_back(block);
  }
}

}  // namespace

VisibilityResult see_voxels(const Scene& scene, const Plan& plan, const TextureSet& textures, std::span<const Surface> surfaces,
                            const Recipe& recipe, const VisibilityOptions& options, const SliceShader& shade, Report& report) {
  VisibilityResult result;
  result.levels.resize(surfaces.size());
  std::vector<Sums> sums(surfaces.size());
  const int traced = options.recompute ? static_cast<int>(surfaces.size()) : 1;
  const bool any_volume = options.volume_axes[0] || options.volume_axes[1] || options.volume_axes[2];
  std::vector<std::vector<InsideRun>> runs;
  if (options.visible_normals) {
    result.levels[0].visible.resize(static_cast<std::size_t>(surfaces[0].set.count));
    for (std::size_t i = 0; i < result.levels[0].visible.size(); ++i) result.levels[0].visible[i].area = surfaces[0].moments[i].area;
  }
  double crossings = 0;
  int axes_done = 0, volume_axes = 0;

  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const bool volume = options.volume_axes[a];
    if (!volume && !options.slice_axes[a]) continue;
    const Bundle bundle = make_bundle(scene, plan, textures, recipe, axis);
    std::vector<LevelView> views;
    for (int l = 0; l < (volume ? traced : 1); ++l) {
      const auto s = static_cast<std::size_t>(l);
      views.push_back({&surfaces[s], BlockColumns(surfaces[s].set, plan.grid.level(l), bundle.axes)});
      if (!volume) continue;
      const auto count = static_cast<std::size_t>(surfaces[s].set.count);
      sums[s].alpha[a].assign(count, 0);
      if (l == 0) {
        sums[s].crossings[a].assign(count, 0);
        sums[s].solid[a].assign(count, 0);
      }
    }
    volume_axes += volume;
    const bool collects = volume && axis == 2 && plan.fill;
    std::vector<SliceBand> slices(options.slice_axes[a] ? static_cast<std::size_t>(bundle.bands) : 0);
    if (collects) runs.resize(static_cast<std::size_t>(bundle.bands));
    const Tracer tracer{bundle, views, sums, traced, options, shade, volume && options.visible_normals ? &result.levels[0].visible : nullptr};
    tbb::enumerable_thread_specific<Worker> workers;
    std::atomic<std::int64_t> met{0};
    std::atomic<int> done{0};
    const bool wants_volume = volume;
    tbb::parallel_for(0, bundle.bands, [&](int b) {
      Worker& w = workers.local();
      const auto s = static_cast<std::size_t>(b);
      Tracer own = tracer;
      own.levels = wants_volume ? traced : 0;
      own.band(w, b, slices.empty() ? nullptr : &slices[s], collects ? &runs[s] : nullptr);
      met += static_cast<std::int64_t>(w.band.crossings.size());
      if (report.progress) report.progress("crossings", (axes_done + static_cast<double>(++done) / bundle.bands) / 3);
    });
    crossings += static_cast<double>(met.load());
    ++axes_done;
    if (!slices.empty()) result.slices[a] = gather_slices(bundle, options.slice_counts[a], slices);
  }
  report.count("crossings", crossings);
  if (!any_volume) return result;

  // Integers to shares.
  for (std::size_t l = 0; l < static_cast<std::size_t>(traced); ++l) {
    const RayPattern pattern = make_pattern(recipe.pattern, recipe.samples);
    const RayStep step(static_cast<int>(l));
    Visibility& to = result.levels[l];
    // Rays a voxel column of this level holds; columns cut by the box's end hold fewer, the missing ones meet nothing.
    const double rays = static_cast<double>(pattern.rays()) * std::pow(4.0, static_cast<double>(l)) / (static_cast<double>(step.step) * step.step);
    const auto count = static_cast<std::size_t>(surfaces[l].set.count);
    for (std::size_t a = 0; a < 3; ++a) {
      if (sums[l].alpha[a].empty()) continue;
      to.alpha[a].resize(count);
      for (std::size_t i = 0; i < count; ++i) to.alpha[a][i] = static_cast<float>(static_cast<double>(sums[l].alpha[a][i]) / (kAlphaUnit * rays));
      if (l > 0) continue;
      to.crossings[a].resize(count);
      for (std::size_t i = 0; i < count; ++i) to.crossings[a][i] = static_cast<float>(static_cast<double>(sums[l].crossings[a][i]) / (kAlphaUnit * rays));
    }
    if (l > 0) continue;
    to.solid.assign(count, 0);
    double filled = 0;
    for (std::size_t i = 0; i < count; ++i) {
      // Chords along an axis are exact for surface that faces it, while surface beside the rays is met in whole sub-ray rows: each axis
      // counts as much as the surface in the voxel faces it.
      const Moments& m = surfaces[0].moments[i];
      const double facing[3] = {m.xx, m.yy, m.zz};
      double length = 0, weight = 0, plain = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        if (sums[0].solid[a].empty()) continue;
        const auto of_axis = static_cast<double>(sums[0].solid[a][i]);
        length += facing[a] * of_axis;
        weight += facing[a];
        plain += of_axis / volume_axes;
      }
      const double share = (weight > 0 ? length / weight : plain) / (kLengthUnit * rays);
      filled += share;
      to.solid[i] = static_cast<float>(share);
    }
    if (plan.fill) collect_inside(runs, surfaces[0], plan.grid, to);
    result.volume = filled + static_cast<double>(to.inside_count);
  }
  return result;
}

V3d measure_thickness(const Scene& scene, const Plan& plan, const TextureSet& textures) {
  constexpr double kOpen = 2;
  V3d thickness(kOpen, kOpen, kOpen);
  if (!plan.fill) return thickness;
  Recipe one;
  one.samples = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const Bundle bundle = make_bundle(scene, plan, textures, one, axis);
    std::vector<std::vector<float>> found(static_cast<std::size_t>(bundle.bands));
    tbb::parallel_for(0, bundle.bands, [&](int b) {
      Band band;
      BandScratch scratch;
      trace_band(bundle, b, band, scratch);
      for (std::size_t r = 0; r + 1 < band.first.size(); ++r) {
        int winding = 0;
        double from = 0;
        for (std::size_t i = band.first[r]; i < band.first[r + 1]; ++i) {
          const Crossing& c = band.crossings[i];
          const int before = winding;
          winding += c.winding;
          if (before == 0 && winding != 0) from = c.w;
          if (before != 0 && winding == 0) found[static_cast<std::size_t>(b)].push_back(static_cast<float>(c.w - from));
        }
      }
    });
    std::vector<float> chords;
    for (const auto& f : found) chords.insert(chords.end(), f.begin(), f.end());
    if (chords.empty()) continue;
    const auto fifth = chords.begin() + static_cast<std::ptrdiff_t>(chords.size() / 20);
    std::nth_element(chords.begin(), fifth, chords.end());
    thickness[axis] = std::max(kOpen, static_cast<double>(*fifth));
  }
  return thickness;
}

}  // namespace texel
