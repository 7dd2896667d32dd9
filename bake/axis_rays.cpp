#include "bake/axis_rays.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "bake/opacity.h"
#include "bake/prefetch.h"

namespace texel {
namespace {

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

// Voxels. Where a ray grazes an edge of a solid, or passes from one solid into another that it touches, rounding may take the farther of two crossings first: for so
// long a winding number of -1 or 2 is no overlap. The rays' places are rounded to 2^-17 voxel, depths on faces up to 1:64 steep to less than this.
constexpr double kTouching = 0x1p-10;

constexpr double kRounding = 1e-12;          // of a voxel: above what adding up along a column rounds, far below the thinnest layer there is (2⁻³⁰, plan_point)
constexpr double kNoMatter = 1e-9;           // of a face: above what adding up along a column rounds, far below what a float of alpha shows beside a ray

struct CellSum {
  RaySums rays;
  double length = 0;                          // inside, over all rays; voxels of level 0
  int inside_above = 0;                       // rays inside beyond the cell
  // Nearly all rays are of these kinds, counted here until fold(): one that passes wholly inside, as changes from the cell before; one
  // inside at the near wall; one stopped by the first surface it meets.
  int passing = 0, begun_inside = 0, met_once = 0;
};

// Spreads the counts of a column's cells out to their sums.
void fold(std::span<CellSum> sums, int edge) {
  int passing = 0;
  for (CellSum& s : sums) {
    passing += s.passing;
    s.rays.add_many(passing + s.begun_inside, 0, true);
    s.rays.add_many(s.met_once, 1, false);
    s.length += static_cast<double>(passing) * edge;
    s.inside_above += passing;
  }
}

// What a band has seen of a voxel that others meet, too: added up in the order of the bands.
struct SeenPart { int level; std::int64_t voxel; SeenMaterial sums; };

struct Worker {                               // reused buffers of one thread
  Band band;
  BandScratch trace;
  SliceScratch slice;
  std::vector<Cell> cells;
  std::vector<CellSum> sums;
  std::vector<SeenMaterial> seen;             // per cell
  std::vector<SeenPart> seen_parts;
};

// Follows one ray through the border voxels of its column, from crossing to crossing. Cells are level-`level` voxels. `sums` has one more
// than cells, for what begins to pass beyond the last. The column is voxels [start, stop) of level 0.
void follow_ray(const Crossing* c, const Crossing* end, std::span<const Cell> cells, int level, int start, int stop, std::span<CellSum> sums, int* inside_first) {
  int winding = 0;
  const int below = cells.empty() ? start : cells.front().k << level;
  while (c != end && c->cell < below) winding += (c++)->winding;
  if (inside_first) *inside_first += winding != 0;
  // Crossings in voxels without surface of their own, by rounding or since only a corner lies in their wall: what is beyond cell i - 1 begins behind them.
  const auto cross_between = [&](std::size_t i, int until) {
    const bool inside = winding != 0;
    while (c != end && c->cell < until) winding += (c++)->winding;
    if (i > 0) sums[i - 1].inside_above += (winding != 0) - inside;
  };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    // Cells up to the next crossing's are passed through.
    const std::size_t from_cell = i;
    if (c == end) i = cells.size();
    else while (i < cells.size() && cells[i].k < c->cell >> level) ++i;
    if (winding == 1) {
      ++sums[from_cell].passing;
      --sums[i].passing;
    } else if (winding != 0) {
      for (std::size_t j = from_cell; j < i; ++j) {
        sums[j].rays.add(1, 0, true, true);
        sums[j].length += 1 << level;
        ++sums[j].inside_above;
      }
    }
    if (i == cells.size()) break;
    const int lo = cells[i].k << level, hi = std::min(lo + (1 << level), stop);  // what juts out of the grid is empty
    cross_between(i, lo);
    CellSum& sum = sums[i];
    const int before = winding;
    if (c == end || c->cell >= hi) {
      if (before == 0) continue;
      if (before == 1) ++sum.begun_inside;
      else sum.rays.add(1, 0, true, true);
      sum.length += hi - lo;
      ++sum.inside_above;
      continue;
    }
    const int after = before + c->winding;
    if ((c + 1 == end || c[1].cell >= hi) && c->coverage == 1 && (before == 0 || before == 1) && (after == 0 || after == 1)) {
      const double depth = std::clamp<double>(c->w, lo, hi);
      if (before == 1) {
        ++sum.begun_inside;
        if (c->winding == 0) sum.rays.add_met_inside(1);
        sum.length += (after == 1 ? hi : depth) - lo;
      } else {
        ++sum.met_once;
        if (after == 1) sum.length += hi - depth;
      }
      sum.inside_above += after;
      winding = after;
      ++c;
      continue;
    }
    bool stopped = before != 0, overlap = false;
    double open = 1, met = 0, from = lo;
    const auto pass_to = [&](double depth) {
      if (winding != 0) sum.length += std::max(0.0, depth - from);
      overlap = overlap || (winding != 0 && winding != 1 && depth - from > kTouching);
    };
    for (; c != end && c->cell < hi; ++c) {
      pass_to(c->w);
      from = c->w;
      winding += c->winding;
      stopped = stopped || winding != 0;
      open *= 1 - static_cast<double>(c->coverage);
      met += c->winding == 0 ? static_cast<double>(c->coverage) : c->winding > 0 ? 1 : 0;
    }
    pass_to(hi);
    sum.inside_above += winding != 0;
    sum.rays.add(stopped ? 1 : 1 - open, met, before != 0, overlap);
  }
  cross_between(cells.size(), stop);
}

struct Tracer {
  const Bundle& bundle;
  std::span<const LevelView> views;
  std::vector<OpacitySums>& sums;             // of this axis, per level
  const AxisFound& found;
  std::vector<float>& gain;                   // of this axis, per level-0 voxel: see SliceColumn; empty without slices
  std::vector<float>& missed;
  int low, high;                              // voxels of the columns: all, or the slab's
  std::vector<double>* begins_inside;         // SlabSums', of this axis; null: 0 everywhere
  int levels;                                 // how many of them are traced
  bool plain;
  const VisibilityOptions& options;
  const SliceShader& shade;
  // Of level 0; a voxel's rays along one axis are all in one band, so adding needs no order. Null: not wanted.
  std::vector<Moments>* visible;
  bool sees_material;                         // what options.seen_material wants is gathered
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
        add_surface(list[i], std::max(seen[i - first], from_back), cell.index);
        inside -= list[i].winding;
        back = inside != 0 ? 0 : back * (1 - static_cast<double>(list[i].coverage));
      }
    }
  }

  void add_surface(const Crossing& c, double weight, std::int64_t voxel) const {
    if (!(weight > 0)) return;
    if (const FibreSegment* fibre = crossed_fibre(bundle, c)) return add_fibre_seen(*fibre, weight, voxel);
    const Face face = crossed_face(bundle, c);
    const V3d n = triangle_normal(face.p[0], face.p[1], face.p[2]) * static_cast<double>(face.turn);
    const double sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    if (!(sum > 0)) return;
    const double area = weight / (sum * bundle.pattern.rays());
    (*visible)[static_cast<std::size_t>(voxel)].add(n, area, !bundle.plan->is_two_sided(face.winding, face.material));
  }

  // A piece's whole wall goes with the rays its three shadows get.
  void add_fibre_seen(const FibreSegment& fibre, double weight, std::int64_t voxel) const {
    const FibreShape shape = fibre_shape(fibre);
    const double rays = shape.shadow.x + shape.shadow.y + shape.shadow.z;
    if (!(rays > 0)) return;
    Moments m;
    m.covered = shape.area;
    m.xx = m.yy = m.zz = shape.across;
    add_outer(m, shape.t, shape.along - shape.across);
    (*visible)[static_cast<std::size_t>(voxel)].add(m, weight / (rays * bundle.pattern.rays()));
  }

  // What is seen of a column's voxels, by more rays than opacity has need of: what a ray sees first varies from ray to ray far more than whether it is stopped.
  void see_material(Worker& w, int level, int cu, int cv) const {
    const Band& band = w.band;
    const RayPattern& pattern = bundle.pattern;
    const RayStep step(level, pattern.rows, pattern.per_row, kSeenRays);
    const int v0 = std::max(band.v0, cv << level), v1 = std::min(band.v1, (cv + 1) << level), u0 = cu << level, u1 = std::min(bundle.nu, u0 + (1 << level));
    const std::int64_t first_row = (std::int64_t{cv} << level) * pattern.rows;
    SeenRay seen;
    seen.width = step.step / std::sqrt(static_cast<double>(pattern.rays()));
    seen.rays = pattern.rays() * std::pow(4.0, level) / (static_cast<double>(step.step) * step.step);
    w.seen.assign(w.cells.size(), {});
    for (std::int64_t row = std::int64_t{v0} * pattern.rows; row < std::int64_t{v1} * pattern.rows; ++row) {
      if (!step.row(row - first_row)) continue;
      const auto r = static_cast<std::size_t>(row % pattern.rows), per_row = static_cast<std::size_t>(pattern.per_row);
      const std::size_t base = (static_cast<std::size_t>(row - std::int64_t{band.v0} * pattern.rows) * static_cast<std::size_t>(band.width) + static_cast<std::size_t>(band.place(u0))) * per_row;
      seen.v = static_cast<double>(row / pattern.rows) + pattern.v[r] * 0x1p-16;
      for (auto i = static_cast<std::size_t>(step.first_column(row - first_row)); i < static_cast<std::size_t>(u1 - u0) * per_row; i += static_cast<std::size_t>(step.step)) {
        const auto list = ray(band, base + i);
        if (list.empty()) continue;
        seen.u = u0 + static_cast<double>(i / per_row) + pattern.u[r * per_row + i % per_row] * 0x1p-16;
        see_along(w, level, list, seen);
      }
    }
    // A voxel's rays along an axis are all in one band where that is as high as the voxel; then adding needs no order.
    const bool own = 1 << level <= bundle.band_rows;
    for (std::size_t i = 0; i < w.cells.size(); ++i) {
      if (!(w.seen[i].met.area > 0)) continue;
      if (own) found.result.levels[static_cast<std::size_t>(level)].seen_material[static_cast<std::size_t>(w.cells[i].index)] += w.seen[i];
      else w.seen_parts.push_back({level, w.cells[i].index, w.seen[i]});
    }
  }

  void see_along(Worker& w, int level, std::span<const Crossing> list, SeenRay& seen) const {
    std::size_t c = 0;
    int winding = 0;
    for (std::size_t i = 0; i < w.cells.size() && c < list.size(); ++i) {
      const int lo = w.cells[i].k << level, hi = std::min(lo + (1 << level), high);
      for (; c < list.size() && list[c].cell < lo; ++c) winding += list[c].winding;
      const std::size_t from = c;
      seen.winding = winding;
      for (; c < list.size() && list[c].cell < hi; ++c) winding += list[c].winding;
      seen.list = list.subspan(from, c - from);
      if (c > from) add_seen(bundle, seen, options.seen_material, w.seen[i]);
    }
  }

  void level_column(Worker& w, int level, int cu, int cv, std::vector<InsideRun>* runs) const {
    const Band& band = w.band;
    const RayPattern& pattern = bundle.pattern;
    views[static_cast<std::size_t>(level)].cells(bundle.axes, cu, cv, w.cells);
    if (level == 0 && low == 0) {
      if (begins_inside) begin_of(cu, cv) = winding_at_box(band, cu, cv, w.cells);
      if (bundle.axis == 2 && !found.slabs.inside.empty()) found.slabs.inside[0][place_of(cu, cv)] = begins_inside ? begin_of(cu, cv) : 0;
    }
    if (w.cells.empty() && !runs) return;
    // finish_column reads them in another order than they lie in; while the rays are followed they come nearer.
    for (const Cell& cell : w.cells) prefetch_lines(&views[static_cast<std::size_t>(level)].surface->areas[static_cast<std::size_t>(cell.index)]);
    w.sums.assign(w.cells.size() + 1, {});
    const RayStep step = step_of(level);
    const std::int64_t first_row = (std::int64_t{cv} << level) * pattern.rows;
    const int v0 = std::max(band.v0, cv << level), v1 = std::min(band.v1, (cv + 1) << level);
    const int u0 = band.place(cu << level), u1 = u0 + std::min(bundle.nu, (cu + 1) << level) - (cu << level);  // all of them are traced
    int rays = 0, inside_first = 0;
    for (std::int64_t row = std::int64_t{v0} * pattern.rows; row < std::int64_t{v1} * pattern.rows; ++row) {
      if (!step.row(row - first_row)) continue;
      const std::size_t base = static_cast<std::size_t>(row - std::int64_t{band.v0} * pattern.rows) * static_cast<std::size_t>(band.width) * static_cast<std::size_t>(pattern.per_row);
      for (int u = u0 * pattern.per_row + step.first_column(row - first_row); u < u1 * pattern.per_row; u += step.step) {
        const auto list = ray(band, base + static_cast<std::size_t>(u));
        ++rays;
        if (list.empty()) continue;           // meets nothing anywhere: adds nothing
        if (level == 0 && visible) add_visible(list, w.cells);
        follow_ray(list.data(), list.data() + list.size(), w.cells, level, low, high, w.sums, runs ? &inside_first : nullptr);
      }
    }
    if (sees_material) see_material(w, level, cu, cv);
    fold(w.sums, 1 << level);
    if (level == 0) {  // all of a level-0 column's rays are in this band
      for (std::size_t i = 0; i < w.cells.size() && found.lengths; ++i) (*found.lengths)[static_cast<std::size_t>(w.cells[i].index)] = static_cast<float>(w.sums[i].length / pattern.rays());
      finish_column(0, cu, cv, w.cells, [&](std::size_t i) { return w.sums[i].rays; });
    } else {
      for (std::size_t i = 0; i < w.cells.size(); ++i) sums[static_cast<std::size_t>(level)].add(w.cells[i].index, w.sums[i].rays);
    }
    if (!runs) return;
    // Between border voxels all rays agree; half of them decides, should rounding make one differ.
    int from = low, inside = inside_first;
    for (std::size_t i = 0; i <= w.cells.size(); ++i) {
      const int to_cell = i < w.cells.size() ? w.cells[i].k : high;
      if (2 * inside > rays && to_cell > from) runs->push_back({cu, cv, from, to_cell});
      if (i == w.cells.size()) break;
      from = w.cells[i].k + 1;
      inside = w.sums[i].inside_above;
    }
  }

  // The mean winding number of a level-0 column's rays where they enter the box, exactly. Where the column's surface first lets a voxel out the
  // winding number is the same on all of it, a whole number that every ray tells; back from there the surface gives the rest.
  double winding_at_box(const Band& band, int u, int v, std::span<const Cell> cells) const {
    double lost = 0;
    std::size_t c = 0;
    for (; c < cells.size() && cells[c].k == static_cast<int>(c); ++c)
      lost += views[0].surface->areas[static_cast<std::size_t>(cells[c].index)].outward[bundle.axis];
    if (static_cast<int>(c) == high) return std::numeric_limits<double>::quiet_NaN();
    const RayPattern& pattern = bundle.pattern;
    double winding = 0;
    for (int r = 0; r < pattern.rows; ++r)
      for (int j = 0; j < pattern.per_row; ++j) {
        const std::size_t row = static_cast<std::size_t>(v - band.v0) * static_cast<std::size_t>(pattern.rows) + static_cast<std::size_t>(r);
        const std::size_t id = (row * static_cast<std::size_t>(band.width) + static_cast<std::size_t>(band.place(u))) * static_cast<std::size_t>(pattern.per_row) + static_cast<std::size_t>(j);
        for (const Crossing& crossing : ray(band, id)) {
          if (crossing.cell >= static_cast<int>(c)) break;
          winding += crossing.winding;
        }
      }
    return std::round(winding / pattern.rays()) + lost;
  }

  [[nodiscard]] std::size_t place_of(int u, int v) const { return static_cast<std::size_t>(v) * static_cast<std::size_t>(bundle.nu) + static_cast<std::size_t>(u); }
  [[nodiscard]] double& begin_of(int u, int v) const { return (*begins_inside)[place_of(u, v)]; }

  // The same of a column at any level, once level 0 is done: the mean of its columns, those beyond the grid being empty.
  double begin_winding(int level, int cu, int cv) const {
    double sum = 0;
    for (int v = cv << level; v < std::min(bundle.nv, (cv + 1) << level); ++v)
      for (int u = cu << level; u < std::min(bundle.nu, (cu + 1) << level); ++u) sum += begin_of(u, v);
    return sum * std::pow(0.25, level);
  }

  // Opacity of a column's voxels, once all its rays have been followed. The inside share of each near wall adds up along the column.
  // `met_in(i)`: the sums of cells[i].
  template <class Met>
  void finish_column(int level, int cu, int cv, std::span<const Cell> cells, Met&& met_in) const {
    const auto l = static_cast<std::size_t>(level), axis = static_cast<std::size_t>(bundle.axis);
    const RayStep step = step_of(level);
    const double face = std::pow(4.0, level), rays = bundle.pattern.rays() * face / (static_cast<double>(step.step) * step.step);
    std::vector<double>* carried = bundle.axis == 2 && !found.slabs.inside.empty() ? &found.slabs.inside[l] : nullptr;
    const std::size_t column = static_cast<std::size_t>(cv) * static_cast<std::size_t>(((bundle.nu - 1) >> level) + 1) + static_cast<std::size_t>(cu);
    double inside = carried && low > 0 ? (*carried)[column] : begins_inside ? begin_winding(level, cu, cv) : 0;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const auto i = static_cast<std::size_t>(cells[c].index);
      const Areas& p = views[l].surface->areas[i];
      const RaySums met = met_in(c);
      double sampled = 0;
      double alpha = estimate_opacity(met, rays, {p.stopping[bundle.axis] / face, inside}, &sampled);
      const double crossings = std::max(p.crossings[bundle.axis], p.stopping[bundle.axis]) / face;  // matter is there where its surface is cut out, too
      // No filled matter: only surface stops. That no ray has met matter is not enough: a layer thinner than their distance lies between them.
      if (plain) alpha = sampled;
      else if (met.l == 0 && met.w == 0 && p.outward[bundle.axis] == 0 && !(inside > kNoMatter)) alpha = std::min(alpha, crossings);
      const double near_inside = inside;
      inside -= p.outward[bundle.axis] / face;
      Visibility& to = found.result.levels[l];
      to.alpha[axis][i] = static_cast<float>(alpha);
      if (level > 0) continue;
      if (found.doubt) (*found.doubt)[i] = static_cast<float>(doubt(met, rays));
      // The filled fraction is known exactly too, by the surface alone, where matter does not overlap. What rounding leaves of a column's sum would make a body of an open sheet.
      if (const double filled = near_inside - p.lost; found.exact_solid && axis == 2 && met.w == 0 && filled > -1e-6 && filled < 1 + 1e-6)
        (*found.exact_solid)[i] = filled < kRounding ? 0.0 : std::min(filled, 1.0);
      if (gain.empty()) continue;
      gain[i] = sampled > 0 ? static_cast<float>(alpha / sampled) : 1.0f;
      if (sampled > 0) continue;
      const Surface& surface = *views[0].surface;
      const double covered = surface.areas[i].covered;
      const double clear = surface.material.empty() || !(covered > 0) ? 0 : surface.material[i].transparency / covered;
      missed[i] = static_cast<float>(alpha * (1 - clear));
    }
    if (carried) (*carried)[column] = inside;
  }

  [[nodiscard]] RayStep step_of(int level) const { return {level, bundle.pattern.rows, bundle.pattern.per_row, options.coarse_rays}; }

  // `runs` collects the inside runs, on one axis only.
  void band(Worker& w, int index, SliceBand* slices, std::vector<InsideRun>* runs) const {
    trace_band(bundle, index, w.band, w.trace);
    if (w.band.width == 0) return;
    const auto axis = static_cast<std::size_t>(bundle.axis);
    const int count = options.slice_counts[axis], first_slice = first_slice_of(low, count, bundle.nw), last_slice = first_slice_of(high, count, bundle.nw);
    for (int level = options.first_level; level < levels; ++level) {
      const int c0 = w.band.v0 >> level, c1 = (w.band.v1 - 1) >> level, cu1 = (bundle.nu - 1) >> level;
      for (int cv = c0; cv <= c1; ++cv)
        for (int cu = 0; cu <= cu1; ++cu)
          if (w.band.traced(cu << level)) level_column(w, level, cu, cv, level == 0 ? runs : nullptr);
    }
    if (slices)
      for (int v = w.band.v0; v < w.band.v1; ++v)
        for (int u = 0; u < bundle.nu; ++u) {
          if (!w.band.traced(u)) continue;
          views[0].cells(bundle.axes, u, v, w.cells);
          slice_column(bundle, w.band, {u, v, count, first_slice, last_slice, w.cells, gain, missed}, shade, w.slice, *slices);
        }
  }
};

}  // namespace

RayStep::RayStep(int level, int rows_per_voxel, int per_row, int least) {
  constexpr int kMost = 3;
  // Rays along the edge of a level-0 voxel, in either pattern.
  const auto samples = static_cast<std::int64_t>(std::lround(std::sqrt(static_cast<double>(rows_per_voxel) * per_row)));
  // The coarser, the fewer voxels, and the more surface in each that hides other.
  const std::int64_t wanted = std::max<std::int64_t>(samples * (std::int64_t{2} << std::max(0, (level - 1) / 2)), least);
  while (shift < kMost && (samples << level) >> (shift + 1) >= wanted) ++shift;
  step = 1 << shift;
}

std::vector<char> used_rows(const Bundle& bundle, int first, int last, int least) {
  std::vector<char> used(static_cast<std::size_t>(bundle.nv) * static_cast<std::size_t>(bundle.pattern.rows), 0);
  for (int level = first; level < last; ++level) {
    const RayStep step(level, bundle.pattern.rows, bundle.pattern.per_row, least);
    for (std::size_t row = 0; row < used.size(); ++row)
      if (step.row(static_cast<std::int64_t>(row))) used[row] = 1;
  }
  return used;
}

std::int64_t see_axis(const AxisRays& rays, const AxisFound& found, const std::function<void(double)>& progress) {
  const Bundle& bundle = rays.bundles[0];  // for all that they share
  const VisibilityOptions& options = rays.options;
  const std::span<const Surface> surfaces = rays.surfaces;
  const auto a = static_cast<std::size_t>(bundle.axis);
  const bool volume = options.volume_axes[a];
  // Slices take their opacity from level 0 too.
  const int levels = volume && options.recompute ? static_cast<int>(surfaces.size()) : 1;
  std::vector<LevelView> views;
  std::vector<OpacitySums> sums(static_cast<std::size_t>(levels));
  for (std::size_t l = 0; l < static_cast<std::size_t>(levels); ++l) {
    const auto count = static_cast<std::size_t>(surfaces[l].set.count);
    views.push_back({&surfaces[l], BlockColumns(surfaces[l].set, bundle.plan->grid.level(static_cast<int>(l)), bundle.axes)});
    if (l > 0) sums[l].voxels.assign(count, {});
    found.result.levels[l].alpha[a].assign(count, 0);
  }
  const std::size_t slice_voxels = options.slice_axes[a] ? static_cast<std::size_t>(surfaces[0].set.count) : 0;
  std::vector<float> gain(slice_voxels, 1.0f), missed(slice_voxels, 0.0f);
  const bool collects = found.runs && volume && bundle.axis == 2 && bundle.plan->fill && options.first_level == 0;
  if (collects) found.runs->resize(static_cast<std::size_t>(bundle.bands));
  if (options.slice_axes[a]) found.slabs.slices[a].resize(static_cast<std::size_t>(bundle.bands));

  // Rays along z pass through all slabs; bands of the others lie in one.
  const Slab slab{options.slab.z0, std::min(options.slab.z1, bundle.plan->grid.n.z)};
  const bool along = bundle.axis == 2;
  std::vector<double>& begins_inside = found.slabs.begins_inside[a];
  if (begins_inside.empty() && options.first_level == 0 && bundle.begins_inside) begins_inside.resize(static_cast<std::size_t>(bundle.nu) * static_cast<std::size_t>(bundle.nv));
  if (slab.z0 == 0 && slab.z1 == bundle.nw) found.slabs.inside.clear();
  else if (along && slab.z0 == 0 && bundle.plan->fill) {
    found.slabs.inside.resize(static_cast<std::size_t>(levels));
    for (int level = 0; level < levels; ++level)
      found.slabs.inside[static_cast<std::size_t>(level)].resize(static_cast<std::size_t>(((bundle.nu - 1) >> level) + 1) * static_cast<std::size_t>(((bundle.nv - 1) >> level) + 1));
  }
  std::vector<Tracer> tracers;
  for (const Bundle& b : rays.bundles)
    tracers.push_back({b, views, sums, found, gain, missed, along ? slab.z0 : 0, along ? slab.z1 : bundle.nw, begins_inside.empty() ? nullptr : &begins_inside, levels, rays.plain, options, rays.shade,
                       volume && options.visible_normals ? &found.result.levels[0].visible : nullptr,
                       volume && options.seen_material.any()});
  const int b0 = along ? 0 : slab.z0 / bundle.band_rows, b1 = along ? bundle.bands : (slab.z1 + bundle.band_rows - 1) / bundle.band_rows;
  tbb::enumerable_thread_specific<Worker> workers;
  std::vector<std::vector<SeenPart>> seen_parts(static_cast<std::size_t>(bundle.bands));
  std::atomic<std::int64_t> met{0};
  std::atomic<int> done{0};
  tbb::parallel_for(b0, b1, [&](int b) {
    Worker& w = workers.local();
    const auto s = static_cast<std::size_t>(b);
    SliceBand* slices = options.slice_axes[a] ? &found.slabs.slices[a][s] : nullptr;
    const std::size_t records = slices ? slices->records.size() : 0, slice_runs = slices ? slices->runs.size() : 0;
    for (const Tracer& tracer : tracers) {
      Tracer own = tracer;  // it holds a buffer
      own.band(w, b, slices, collects ? &(*found.runs)[s] : nullptr);
      const auto begin = w.band.crossings.begin(), end = begin + w.band.first.back();
      const bool all = !along || (slab.z0 == 0 && slab.z1 == bundle.nw);
      met += all ? end - begin : std::count_if(begin, end, [&](const Crossing& c) { return (c.cell >= slab.z0 || slab.z0 == 0) && (c.cell < slab.z1 || slab.z1 == bundle.nw); });
    }
    seen_parts[s] = std::move(w.seen_parts);
    w.seen_parts.clear();
    if (slices && tracers.size() > 1) {  // pixel by pixel, whichever pattern they had
      std::stable_sort(slices->records.begin() + static_cast<std::ptrdiff_t>(records), slices->records.end(), [](const auto& x, const auto& y) { return x.pixel.at < y.pixel.at; });
      std::stable_sort(slices->runs.begin() + static_cast<std::ptrdiff_t>(slice_runs), slices->runs.end(), [](const auto& x, const auto& y) { return x.at < y.at; });
    }
    progress(static_cast<double>(++done) / (b1 - b0));
  });
  for (const auto& parts : seen_parts)
    for (const SeenPart& part : parts) found.result.levels[static_cast<std::size_t>(part.level)].seen_material[static_cast<std::size_t>(part.voxel)] += part.sums;
  const auto tracer_of = [&](int u, int v) -> const Tracer& {
    for (const Tracer& t : tracers)
      if (t.bundle.columns.empty() || t.bundle.columns[t.place_of(u, v)] != 0) return t;
    return tracers[0];
  };
  for (int level = std::max(1, options.first_level); level < levels; ++level) {
    const int v0 = along ? 0 : slab.z0 >> level, v1 = along ? bundle.nv : slab.z1;
    tbb::parallel_for(v0, ((v1 - 1) >> level) + 1, [&](int v) {
      std::vector<Cell> cells;
      for (int u = 0; u <= (bundle.nu - 1) >> level; ++u) {
        views[static_cast<std::size_t>(level)].cells(bundle.axes, u, v, cells);
        tracer_of(u << level, v << level).finish_column(level, u, v, cells, [&](std::size_t i) { return sums[static_cast<std::size_t>(level)].get(cells[i].index); });
      }
    });
  }
  return met.load();
}

}  // namespace texel
