#include "bake/crossings.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "bake/clip.h"
#include "bake/prefetch.h"

namespace texel {
namespace {

constexpr std::int64_t kOne = std::int64_t{1} << kFixedBits;
// Corners lie within ±2¹³ voxels, where products of differences fit int64; what reaches farther is cut to kNear first.
constexpr std::int64_t kNarrow = std::int64_t{1} << 29;
constexpr double kNear = 8191;
// Only keeps the conversion to integers defined.
constexpr double kFar = 0x1p40;
// Doubles place the ends of a row within this many units; rays that near an end are decided exactly.
constexpr int kUnsure = 1;

std::int64_t to_fixed(double x) { return std::llrint(x * static_cast<double>(kOne)); }  // one instruction, which llround is not

int lattice_generator(int n) {
  int best = 1;
  std::int64_t best_distance = -1;
  for (int g = 1; g < n; ++g) {
    if (std::gcd(g, n) != 1) continue;
    std::int64_t least = std::int64_t{n} * n;
    for (int r = 1; r < n; ++r) {  // distances on the torus from point 0; a lattice looks the same from all of them
      const std::int64_t du = std::min<std::int64_t>(std::int64_t{r} * g % n, n - std::int64_t{r} * g % n);
      const std::int64_t dv = std::min(r, n - r);
      least = std::min(least, du * du + dv * dv);
      if (least <= best_distance) break;
    }
    if (least > best_distance) { best_distance = least; best = g; }
  }
  return best;
}

struct Edge {
  std::int64_t x, y;
  std::int64_t dx, dy;
  bool closed;         // a ray exactly on the edge belongs to this triangle (top-left rule)
  [[nodiscard]] std::int64_t value(std::int64_t u, std::int64_t v) const { return dx * (v - y) - dy * (u - x); }
  [[nodiscard]] bool holds(std::int64_t u, std::int64_t v) const {
    const std::int64_t e = value(u, v);
    return e > 0 || (e == 0 && closed);
  }
};

// An edge as doubles: where it crosses a row, within kUnsure units.
struct Line {
  double x, y, slope;
  [[nodiscard]] double at(double v) const { return x + (v - y) * slope; }
};

struct Rasteriser {
  const Bundle& bundle;
  const std::int64_t* fixed;
  Band& band;
  BandScratch& scratch;

  // First pattern row at or above fixed-point v: voxel row · rows + row.
  [[nodiscard]] std::int64_t row_at(std::int64_t v) const {
    const auto& rows = bundle.pattern.v;
    const std::int64_t voxel = v >> kFixedBits;
    const int inside = static_cast<int>(v & (kOne - 1));
    auto guess = static_cast<std::int64_t>((static_cast<std::int64_t>(inside) * bundle.pattern.rows) >> kFixedBits);
    while (guess > 0 && rows[static_cast<std::size_t>(guess) - 1] >= inside) --guess;
    while (guess < bundle.pattern.rows && rows[static_cast<std::size_t>(guess)] < inside) ++guess;
    return voxel * bundle.pattern.rows + guess;
  }

  // Corners of a triangle, or of a piece of one: fixed point across the rays, voxel space along them.
  struct Corners {
    std::int64_t x[3], y[3];
    double w[3];
    bool whole;
  };

  // What is drawn: where its corners are, and all else only once it is known to be met.
  struct Source {
    std::uint32_t number;           // Crossing::triangle
    std::uint16_t page;
    const V3d *p0, *p1, *p2;        // voxel space
    const Mesh* mesh;
    std::uint32_t triangle;         // of *mesh
    const Face* face;               // of an instance; null: of the scene's mesh
  };

  void triangle(std::uint32_t t) {
    const auto& tri = bundle.scene->mesh.triangles[t];
    const V3d* points = bundle.plan->points.data();
    const Source source{t, 0, points + tri[0], points + tri[1], points + tri[2], &bundle.scene->mesh, t, nullptr};
    Corners c{};
    c.whole = true;
    bool narrow = true;
    for (std::size_t i = 0; i < 3; ++i) {
      c.x[i] = fixed[2 * std::size_t{tri[i]}];
      c.y[i] = fixed[2 * std::size_t{tri[i]} + 1];
      c.w[i] = bundle.plan->points[tri[i]][bundle.axes.w];
      narrow = narrow && std::abs(c.x[i]) < kNarrow && std::abs(c.y[i]) < kNarrow;
    }
    if (narrow) fill(source, c);
    else far_triangle(source);
  }

  void placed_triangle(const Face& face, std::uint64_t number) {
    const Source source{static_cast<std::uint32_t>(number), static_cast<std::uint16_t>((number >> 32) + 1), &face.p[0], &face.p[1], &face.p[2], face.mesh, face.triangle, &face};
    Corners c{};
    c.whole = true;
    bool narrow = true;
    for (std::size_t i = 0; i < 3; ++i) {
      c.x[i] = to_fixed(std::clamp(face.p[i][bundle.axes.u], -kFar, kFar));
      c.y[i] = to_fixed(std::clamp(face.p[i][bundle.axes.v], -kFar, kFar));
      c.w[i] = face.p[i][bundle.axes.w];
      narrow = narrow && std::abs(c.x[i]) < kNarrow && std::abs(c.y[i]) < kNarrow;
    }
    if (narrow) fill(source, c);
    else far_triangle(source);
  }

  // Whether a ray of this band passes through the box (voxel space).
  [[nodiscard]] bool meets_ray(const Box3d& box) const {
    if (box.min[bundle.axes.w] > bundle.end) return false;
    const double u0 = std::max(box.min[bundle.axes.u], 0.0), u1 = std::min<double>(box.max[bundle.axes.u], bundle.nu);
    const double v0 = std::max<double>(box.min[bundle.axes.v], band.v0), v1 = std::min<double>(box.max[bundle.axes.v], band.v1);
    if (u0 > u1 || v0 > v1) return false;
    if (!band.traced(std::min(bundle.nu - 1, static_cast<int>(u0)), std::min(bundle.nu - 1, static_cast<int>(u1)))) return false;
    // Rows lie at (i + 1/2)/rows; in a row of the plain grid rays do likewise, while those of the others may lie anywhere.
    const RayPattern& pattern = bundle.pattern;
    if (std::ceil(v0 * pattern.rows - 0.5) > v1 * pattern.rows - 0.5) return false;
    return pattern.per_row == 1 || pattern.sheared || std::ceil(u0 * pattern.per_row - 0.5) <= u1 * pattern.per_row - 0.5;
  }

  void placed(const Placed& instance) {
    const Plan& plan = *bundle.plan;
    walk_shape(plan.shapes[instance.shape], [&](const ShapeNode& node) { return meets_ray(placed_box(instance, node.box)); }, [&](std::uint32_t t, const std::array<V3d, 3>& corners) {
      // Most triangles of a small instance lie between the rays: where it is, nearly, tells at a fifth of the cost of where it is exactly.
      Box3d box;
      for (const V3d& corner : corners) {
        V3d p(0, 0, 0);
        for (const int axis : {bundle.axes.u, bundle.axes.v}) p[axis] = placed_coordinate(instance, corner, axis);
        box.extendBy(p);
      }
      const double slack = 0x1p-20 + 1e-12 * (box.min.length() + box.max.length());
      box.min -= V3d(slack, slack, slack);
      box.max += V3d(slack, slack, slack);
      if (meets_ray(box)) placed_triangle(placed_face(*bundle.scene, plan, instance, t, corners), instance.first + t);
    });
  }

  // Cut to the neighbourhood of the grid. split() cuts a shared edge at the same point for both its triangles, so nothing opens.
  void far_triangle(const Source& source) {
    Polygon p, below, above;
    for (const V3d* q : {source.p0, source.p1, source.p2}) p.add(V3d((*q)[bundle.axes.u], (*q)[bundle.axes.v], (*q)[bundle.axes.w]));
    for (int axis = 0; axis < 2; ++axis) {
      split(p, axis, -kNear, below, above);
      if (above.n < 3) return;
      split(above, axis, kNear, p, below);
      if (p.n < 3) return;
    }
    for (std::size_t i = 1; i + 1 < static_cast<std::size_t>(p.n); ++i) {
      Corners c{};
      const V3d corner[3] = {p.v[0], p.v[i], p.v[i + 1]};
      for (int k = 0; k < 3; ++k) {
        c.x[k] = to_fixed(corner[k].x);
        c.y[k] = to_fixed(corner[k].y);
        c.w[k] = corner[k].z;
      }
      fill(source, c);
    }
  }

  void fill(const Source& source, const Corners& c) {
    const std::int64_t(&x)[3] = c.x;
    const std::int64_t(&y)[3] = c.y;
    const std::int64_t from_v = std::max(std::min({y[0], y[1], y[2]}), std::int64_t{band.v0} << kFixedBits);
    const std::int64_t to_v = std::min(std::max({y[0], y[1], y[2]}), (std::int64_t{band.v1} << kFixedBits) - 1);
    if (from_v > to_v || std::min({c.w[0], c.w[1], c.w[2]}) > bundle.end) return;
    const std::int64_t row0 = row_at(from_v), row1 = row_at(to_v + 1);
    if (row0 >= row1) return;
    const std::int64_t least_x = std::min({x[0], x[1], x[2]}), most_x = std::max({x[0], x[1], x[2]});
    if (most_x < 0 || least_x > std::int64_t{bundle.nu} << kFixedBits) return;
    const bool some = !band.before.empty();  // columns only
    const auto column_of = [&](std::int64_t at) { return static_cast<int>(std::clamp<std::int64_t>(at >> kFixedBits, 0, bundle.nu - 1)); };
    if (some && !band.traced(column_of(least_x), column_of(most_x))) return;
    const std::int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (area == 0) return;
    const int order[3] = {0, area > 0 ? 1 : 2, area > 0 ? 2 : 1};  // counter-clockwise in (u, v)
    Edge edge[3];  // edge i is opposite corner order[i]
    for (int i = 0; i < 3; ++i) {
      const int a = order[(i + 1) % 3], b = order[(i + 2) % 3];
      const std::int64_t dx = x[b] - x[a], dy = y[b] - y[a];
      edge[i] = {x[a], y[a], dx, dy, dy < 0 || (dy == 0 && dx < 0)};
    }
    Line left[2], right[2];  // edges that bound a row; a triangle has at most two on a side
    int lefts = 0, rights = 0;
    std::int64_t not_mine = std::numeric_limits<std::int64_t>::min();  // row along an edge whose rays belong to the triangle beyond it
    for (const Edge& e : edge) {
      if (e.dy == 0 && !e.closed) not_mine = e.y;
      if (e.dy == 0) continue;
      Line& line = e.dy < 0 ? left[lefts++] : right[rights++];
      line = {static_cast<double>(e.x), static_cast<double>(e.y), static_cast<double>(e.dx) / static_cast<double>(e.dy)};
    }
    std::optional<Shade> shade;  // made once a ray is met: half of all thin triangles meet none
    const RayPattern& pattern = bundle.pattern;
    const double end = static_cast<double>(std::int64_t{bundle.nu} << kFixedBits);
    std::int64_t voxel_row = row0 / pattern.rows;
    auto r = static_cast<std::size_t>(row0 - voxel_row * pattern.rows);
    for (std::int64_t row = row0; row < row1; ++row, ++r) {
      if (r == static_cast<std::size_t>(pattern.rows)) {
        r = 0;
        ++voxel_row;
      }
      const std::int64_t v = (voxel_row << kFixedBits) + pattern.v[r];
      if (v == not_mine || (!bundle.used.empty() && bundle.used[static_cast<std::size_t>(row)] == 0)) continue;
      const auto vd = static_cast<double>(v);
      double lo = -1, hi = end;
      for (int i = 0; i < lefts; ++i) lo = std::max(lo, left[i].at(vd));
      for (int i = 0; i < rights; ++i) hi = std::min(hi, right[i].at(vd));
      if (hi < lo - 2 * kUnsure) continue;
      const auto from = static_cast<std::int64_t>(lo) - 1 - kUnsure, to = static_cast<std::int64_t>(hi) + 1 + kUnsure;
      const std::size_t row_rays = (static_cast<std::size_t>(row) - static_cast<std::size_t>(band.v0) * static_cast<std::size_t>(pattern.rows)) * static_cast<std::size_t>(band.width);
      // The row's rays one after the other, from the first at or above `from` to the last at or below `to`.
      const int* offsets = pattern.u.data() + r * static_cast<std::size_t>(pattern.per_row);
      std::int64_t column = 0, last_column = to >> kFixedBits;
      int j = 0, last_j = pattern.per_row - 1;
      if (from > 0) {
        column = from >> kFixedBits;
        const auto within = static_cast<int>(from & (kOne - 1));
        j = (within * pattern.per_row) >> kFixedBits;
        j += offsets[j] < within;
      }
      if (last_column >= bundle.nu) {
        last_column = bundle.nu - 1;
      } else {
        const auto within = static_cast<int>(to & (kOne - 1));
        last_j = (within * pattern.per_row) >> kFixedBits;
        last_j -= offsets[last_j] > within;
      }
      if (some) {
        if (column > last_column || !band.traced(static_cast<int>(column), static_cast<int>(last_column))) continue;
        // From traced column to traced column, as if the others' rays were not there.
        if (!band.traced(static_cast<int>(column))) {
          while (!band.traced(static_cast<int>(column))) ++column;
          j = 0;
        }
        if (!band.traced(static_cast<int>(last_column))) {
          while (!band.traced(static_cast<int>(last_column))) --last_column;
          last_j = pattern.per_row - 1;
        }
      }
      auto ray = (static_cast<std::int64_t>(row_rays) + (some ? band.place(static_cast<int>(column)) : column)) * pattern.per_row + j;
      const auto last_ray = (static_cast<std::int64_t>(row_rays) + (some ? band.place(static_cast<int>(last_column)) : last_column)) * pattern.per_row + last_j;
      for (; ray <= last_ray; ++ray, ++j) {
        if (j == pattern.per_row) {
          j = 0;
          ++column;
          while (some && !band.traced(static_cast<int>(column))) ++column;
        }
        const std::int64_t u = (column << kFixedBits) + offsets[j];
        const auto at = static_cast<double>(u);
        if (!(at > lo + kUnsure && at < hi - kUnsure) && !(edge[0].holds(u, v) && edge[1].holds(u, v) && edge[2].holds(u, v))) continue;
        const double e1 = static_cast<double>(edge[1].value(u, v)), e2 = static_cast<double>(edge[2].value(u, v));
        if (!shade) shade = make_shade(source, c, area > 0, static_cast<double>(std::abs(area)), order);
        emit(*shade, {static_cast<std::uint32_t>(ray), u, v}, e1 * shade->inverse_area, e2 * shade->inverse_area);
      }
    }
  }

  // What a triangle's crossings share.
  struct Shade {
    const Source* source;
    double inverse_area;
    double w0, d1, d2, low, high;   // depth = w0 + b1·d1 + b2·d2 for the ordered corners, held within [low, high]
    std::int32_t first, last;       // cells that the triangle enters, where it does not lie in a wall
    bool whole;                     // else b1, b2 are those of a piece
    bool swapped;                   // ordered corner 1 is the triangle's corner 2
    bool up;                        // the turned normal points along +w
    std::int8_t enters, winding;
    bool cut_out;
    std::uint32_t material;
  };

  Shade make_shade(const Source& source, const Corners& c, bool ccw, double area, const int* order) const {
    const std::uint32_t t = source.triangle;
    const double w[3] = {c.w[order[0]], c.w[order[1]], c.w[order[2]]};
    Shade s;
    s.source = &source;
    s.whole = c.whole;
    s.inverse_area = 1 / area;
    s.w0 = w[0];
    s.d1 = w[1] - w[0];
    s.d2 = w[2] - w[0];
    s.low = std::min({w[0], w[1], w[2]});
    s.high = std::max({w[0], w[1], w[2]});
    // As clip_surface has it: a triangle that ends at a wall has no surface beyond, even where a ray meets it right there.
    constexpr double kMost = 1 << 30;
    s.first = s.low < s.high ? static_cast<std::int32_t>(std::floor(std::clamp(s.low, -kMost, kMost))) : -(1 << 30);
    s.last = s.low < s.high ? std::max(s.first, static_cast<std::int32_t>(std::ceil(std::clamp(s.high, -kMost, kMost))) - 1) : 1 << 30;
    s.swapped = !ccw;
    // (u, v, w) is right-handed for z and x, left-handed for y.
    const bool right_handed = bundle.axis != 1;
    s.up = (ccw == right_handed) == ((source.face ? source.face->turn : bundle.plan->turn[t]) > 0);
    s.enters = s.up ? -1 : 1;
    s.winding = (source.face ? source.face->winding : bundle.plan->winding[t]) ? s.enters : std::int8_t{0};
    s.material = source.mesh->materials[t];
    s.cut_out = bundle.textures->has_cutouts(s.material);
    return s;
  }

  struct At { std::uint32_t ray; std::int64_t u, v; };

  void emit(const Shade& s, const At& at, double b1, double b2) {
    Crossing c;
    c.w = std::clamp(s.w0 + b1 * s.d1 + b2 * s.d2, s.low, s.high);
    const double wall = std::floor(std::clamp(c.w, -2.0, bundle.nw + 2.0));
    c.cell = std::clamp(static_cast<std::int32_t>(wall) - (s.up == (s.winding != 0) && c.w == wall ? 1 : 0), s.first, s.last);
    c.triangle = s.source->number;
    c.page = s.source->page;
    c.enters = s.enters;
    c.winding = s.winding;
    c.coverage = 1;
    if (s.cut_out) {
      // A point of the mask: filtered coverage would let two sheets on top of each other hide more than one (1 − (1−c)² > c); the
      // exact covered areas take out the noise (opacity.h).
      if (!s.whole) {
        const Barycentrics b = face_barycentrics(bundle.axes, *s.source->p0, *s.source->p1, *s.source->p2, static_cast<double>(at.u) / static_cast<double>(kOne), static_cast<double>(at.v) / static_cast<double>(kOne));
        b1 = s.swapped ? b.b2 : b.b1;
        b2 = s.swapped ? b.b1 : b.b2;
      }
      const V2f uv = s.swapped ? uv_at(*s.source->mesh, s.source->triangle, b2, b1) : uv_at(*s.source->mesh, s.source->triangle, b1, b2);
      c.coverage = bundle.textures->coverage(s.material, uv, 0);
      if (c.coverage <= 0 && c.winding == 0) return;
    }
    scratch.found.push_back({c, at.ray});
  }
};

// How many columns of [0, u] are traced, in each voxel row; empty: all.
std::vector<std::int32_t> count_columns(const Bundle& b) {
  std::vector<std::int32_t> counts;
  if (b.columns.empty()) return counts;
  counts.resize((static_cast<std::size_t>(b.nu) + 1) * static_cast<std::size_t>(b.nv));
  for (std::size_t v = 0, i = 0; v < static_cast<std::size_t>(b.nv); ++v, ++i)
    for (std::size_t u = 0; u < static_cast<std::size_t>(b.nu); ++u, ++i) counts[i + 1] = counts[i] + (b.columns[v * static_cast<std::size_t>(b.nu) + u] != 0);
  return counts;
}

// The scene's triangles, fibres and instances by band. `lists` has its points. Of bands of one row only what lies over a traced column.
void bin_scene(const Bundle& b, BundleLists& lists) {
  const std::vector<std::int32_t> counts = b.band_rows == 1 ? count_columns(b) : std::vector<std::int32_t>();
  const std::vector<std::int64_t>& points = *lists.points;
  const auto for_each_band = [&](const std::array<std::uint32_t, 3>& t, auto&& call) {
    const std::int64_t y0 = points[2 * std::size_t{t[0]} + 1], y1 = points[2 * std::size_t{t[1]} + 1], y2 = points[2 * std::size_t{t[2]} + 1];
    const std::int64_t low = std::min({y0, y1, y2}), high = std::max({y0, y1, y2});
    if (high < 0) return;
    const std::int64_t b0 = std::max<std::int64_t>(0, (low >> kFixedBits) / b.band_rows), b1 = std::min<std::int64_t>(b.bands - 1, (high >> kFixedBits) / b.band_rows);
    if (counts.empty()) {
      for (std::int64_t i = b0; i <= b1; ++i) call(static_cast<std::size_t>(i));
      return;
    }
    const std::int64_t x0 = points[2 * std::size_t{t[0]}], x1 = points[2 * std::size_t{t[1]}], x2 = points[2 * std::size_t{t[2]}];
    const std::int64_t u0 = std::clamp<std::int64_t>(std::min({x0, x1, x2}) >> kFixedBits, 0, b.nu - 1), u1 = std::clamp<std::int64_t>(std::max({x0, x1, x2}) >> kFixedBits, 0, b.nu - 1);
    for (std::int64_t i = b0; i <= b1; ++i) {
      const std::int32_t* row = counts.data() + i * (std::int64_t{b.nu} + 1);
      if (row[u0] < row[u1 + 1]) call(static_cast<std::size_t>(i));
    }
  };
  const auto& triangles = b.scene->mesh.triangles;
  lists.first.assign(static_cast<std::size_t>(b.bands) + 1, 0);
  for (const auto& t : triangles) for_each_band(t, [&](std::size_t i) { ++lists.first[i + 1]; });
  for (std::size_t i = 0; i < static_cast<std::size_t>(b.bands); ++i) lists.first[i + 1] += lists.first[i];
  lists.bins.resize(lists.first.back());
  std::vector<std::size_t> at(lists.first.begin(), lists.first.end() - 1);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) for_each_band(triangles[t], [&](std::size_t i) { lists.bins[at[i]++] = t; });
  if (!b.plan->fibres.empty()) bin_fibres(b, lists);
  lists.placed = layer_placed(*b.plan, b.axes.v, b.band_rows, b.bands);
}

}  // namespace

RayPattern make_pattern(Pattern kind, int samples) {
  RayPattern p;
  const int all = samples * samples;
  p.rows = kind == Pattern::kLattice ? all : samples;
  p.per_row = kind == Pattern::kLattice ? 1 : samples;
  const int g = kind == Pattern::kLattice ? lattice_generator(all) : 0;
  const auto middle = [](std::int64_t i, int n) { return static_cast<int>((2 * i + 1) * (kOne / 2) / n); };
  for (int r = 0; r < p.rows; ++r) {
    p.v.push_back(middle(r, p.rows));
    for (int j = 0; j < p.per_row; ++j)
      p.u.push_back(kind == Pattern::kLattice ? middle(std::int64_t{r} * g % all, all) : middle(j, samples));
  }
  return p;
}

RayPattern make_sheared_pattern(int rows, int per_row) {
  constexpr double kGolden = 0.61803398874989485;
  RayPattern p;
  p.rows = rows;
  p.per_row = per_row;
  p.sheared = true;
  for (int r = 0; r < rows; ++r) {
    p.v.push_back(static_cast<int>((2 * std::int64_t{r} + 1) * (kOne / 2) / rows));
    const double shift = (r + 0.5) * kGolden - std::floor((r + 0.5) * kGolden);
    // Not below its part of the row, where trace_band looks for it.
    for (int j = 0; j < per_row; ++j) p.u.push_back(std::max(static_cast<int>((j + shift) * static_cast<double>(kOne) / per_row), static_cast<int>((j * kOne + per_row - 1) / per_row)));
  }
  return p;
}

Bundle make_bundle(const Scene& scene, const Plan& plan, const TextureSet& textures, const Recipe& recipe, int axis) {
  Bundle b;
  b.scene = &scene;
  b.plan = &plan;
  b.textures = &textures;
  b.pattern = make_pattern(recipe.pattern, recipe.samples);
  b.axis = axis;
  b.triangles = static_cast<std::uint32_t>(scene.mesh.triangles.size());
  b.axes = bundle_axes(axis);
  b.nu = plan.grid.n[b.axes.u];
  b.nv = plan.grid.n[b.axes.v];
  b.nw = plan.grid.n[b.axes.w];
  // About a quarter of a million rays a band: some tens of bands to share out, crossings that stay in the cache.
  const std::int64_t row_rays = std::int64_t{b.nu} * b.pattern.rays();
  b.band_rows = 8;
  while (b.band_rows > 1 && row_rays * b.band_rows > (1 << 18)) b.band_rows /= 2;
  b.bands = (b.nv + b.band_rows - 1) / b.band_rows;

  const auto lists = std::make_shared<BundleLists>();
  const auto points = std::make_shared<std::vector<std::int64_t>>(plan.points.size() * 2);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, plan.points.size(), 8192), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      (*points)[2 * i] = to_fixed(std::clamp(plan.points[i][b.axes.u], -kFar, kFar));
      (*points)[2 * i + 1] = to_fixed(std::clamp(plan.points[i][b.axes.v], -kFar, kFar));
    }
  });
  lists->points = points;
  for (std::size_t t = 0; t < scene.mesh.triangles.size() - plan.curtains && !b.begins_inside; ++t) {
    if (plan.winding[t] == 0) continue;
    for (const std::uint32_t v : scene.mesh.triangles[t]) b.begins_inside = b.begins_inside || plan.points[v][b.axes.w] < 0;
  }
  bin_scene(b, *lists);
  b.lists = lists;
  return b;
}

Bundle narrow_bundle(const Bundle& all, std::vector<char> columns) {
  Bundle b = all;
  b.band_rows = 1;
  b.bands = b.nv;
  b.columns = std::move(columns);
  const auto lists = std::make_shared<BundleLists>();
  lists->points = all.lists->points;
  bin_scene(b, *lists);
  b.lists = lists;
  return b;
}

void trace_band(const Bundle& bundle, int band, Band& out, BandScratch& scratch) {
  out.v0 = band * bundle.band_rows;
  out.v1 = std::min(bundle.nv, out.v0 + bundle.band_rows);
  scratch.found.clear();
  out.width = bundle.nu;
  out.before.clear();
  if (!bundle.columns.empty()) {
    out.before.assign(static_cast<std::size_t>(bundle.nu) + 1, 0);
    for (int u = 0; u < bundle.nu; ++u) {
      bool any = false;
      for (int v = out.v0; v < out.v1; ++v) any = any || bundle.columns[static_cast<std::size_t>(v) * static_cast<std::size_t>(bundle.nu) + static_cast<std::size_t>(u)] != 0;
      out.before[static_cast<std::size_t>(u) + 1] = out.before[static_cast<std::size_t>(u)] + any;
    }
    out.width = out.before.back();
  }
  const BundleLists& lists = *bundle.lists;
  const std::int64_t* fixed = lists.points->data();
  Rasteriser rasteriser{bundle, fixed, out, scratch};
  const auto b = static_cast<std::size_t>(band);
  const auto& triangles = bundle.scene->mesh.triangles;
  const auto touch = [&](std::uint32_t t) {
    for (const std::uint32_t v : triangles[t]) {
      __builtin_prefetch(&fixed[2 * std::size_t{v}]);
      __builtin_prefetch(&bundle.plan->points[v]);
    }
  };
  if (out.width > 0) {
    visit_triangles(lists.bins.data(), lists.first[b], lists.first[b + 1], triangles.data(), touch, [&](std::uint32_t t) { rasteriser.triangle(t); });
    if (!lists.fibre_first.empty()) trace_fibres(bundle, band, out, scratch);
    for (const std::uint32_t i : lists.placed.of(band)) rasteriser.placed(bundle.plan->placed[i]);
  }

  // Counting sort by ray keeps triangle order; then each short list by depth.
  const std::size_t rays = static_cast<std::size_t>(out.v1 - out.v0) * static_cast<std::size_t>(out.width) * static_cast<std::size_t>(bundle.pattern.rays());
  // Counted one place further on, so that filling moves each start to where it belongs.
  out.first.assign(rays + 2, 0);
  for (const BandScratch::Found& f : scratch.found) ++out.first[f.ray + 2];
  for (std::size_t r = 0; r <= rays; ++r) out.first[r + 1] += out.first[r];
  if (out.crossings.size() < scratch.found.size()) out.crossings.resize(scratch.found.size());
  for (const BandScratch::Found& f : scratch.found) out.crossings[out.first[f.ray + 1]++] = f.crossing;
  out.first.pop_back();

  // In a wall what belongs to the voxel before it comes first: where two solids touch, the ray leaves one and then enters the other.
  const auto before = [](const Crossing& a, const Crossing& b2) { return a.w != b2.w ? a.w < b2.w : a.cell != b2.cell ? a.cell < b2.cell : a.page != b2.page ? a.page < b2.page : a.triangle < b2.triangle; };
  for (std::size_t r = 0; r < rays; ++r) {
    const auto lo = out.crossings.begin() + out.first[r], hi = out.crossings.begin() + out.first[r + 1];
    if (hi - lo > 16) {
      std::sort(lo, hi, before);
      continue;
    }
    for (auto i = lo; i != hi; ++i)
      for (auto j = i; j != lo && before(*j, *(j - 1)); --j) std::swap(*j, *(j - 1));
  }
}

Face crossed_face(const Bundle& bundle, const Crossing& c) {
  if (c.page == 0) return mesh_face(*bundle.scene, *bundle.plan, c.triangle);
  std::uint32_t triangle = 0;
  const Placed& placed = find_placed(*bundle.plan, c.placed_number(), &triangle);
  return placed_face(*bundle.scene, *bundle.plan, placed, triangle);
}

std::uint32_t crossed_material(const Bundle& bundle, const Crossing& c) {
  if (const FibreSegment* fibre = crossed_fibre(bundle, c)) return fibre->material;
  if (c.page == 0) return bundle.scene->mesh.materials[c.triangle];
  std::uint32_t triangle = 0;
  const Placed& placed = find_placed(*bundle.plan, c.placed_number(), &triangle);
  return bundle.scene->shapes[placed.shape].materials[triangle];
}

Barycentrics face_barycentrics(const BundleAxes& axes, const V3d& p0, const V3d& p1, const V3d& p2, double u, double v) {
  const double x0 = p0[axes.u], y0 = p0[axes.v], x1 = p1[axes.u] - x0, y1 = p1[axes.v] - y0, x2 = p2[axes.u] - x0, y2 = p2[axes.v] - y0;
  const double area = x1 * y2 - x2 * y1;
  if (area == 0) return {1.0 / 3, 1.0 / 3};
  // Held within the triangle: the fixed-point outline may be 2⁻¹⁷ voxel wider than the plane's own.
  const double b1 = std::clamp(((u - x0) * y2 - x2 * (v - y0)) / area, 0.0, 1.0);
  const double b2 = std::clamp((x1 * (v - y0) - (u - x0) * y1) / area, 0.0, 1.0 - b1);
  return {b1, b2};
}

}  // namespace texel
