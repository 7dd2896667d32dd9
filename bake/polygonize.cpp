#include "bake/polygonize.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "bake/bake.h"
#include "bake/cube_loops.h"
#include "bake/repeat_functions.h"
#include "bake/thin_parts.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr int kCells = kBrickCells, kSide = kBrickSide;
constexpr int kGroup = 8;                 // bricks along the edge of a task's region
constexpr double kEdgeTolerance = 1e-13;  // of a lattice edge

// Lattice points 0 … last along each axis. The outermost are outside by decree, half a cell from the grid's walls and more: they close
// what the box cuts. Point p lies at voxel coordinate p − 1.
struct Lattice {
  Grid grid;
  V3i last;
  [[nodiscard]] double at(int axis, double p) const { return grid.origin[axis] + (p - 1) * grid.h; }
  [[nodiscard]] bool decreed(const V3i& p) const {
    return p.x <= 0 || p.y <= 0 || p.z <= 0 || p.x >= last.x || p.y >= last.y || p.z >= last.z;
  }
};

// A brick with surface: which of the lattice edges it owns (their lower point is in the brick, upper faces excluded) are cut.
struct Brick {
  V3i at;                                  // in bricks
  BrickBits inside{};                      // of its 5³ points
  std::array<std::uint64_t, 3> cut{};      // per axis, of 4³ edges
  std::uint32_t vertices = 0, first_vertex = 0, triangles = 0;
  std::size_t first_triangle = 0;

  [[nodiscard]] bool is_inside(std::size_t point) const { return (inside[point >> 6] >> (point & 63)) & 1; }
};

struct Found {
  std::vector<Brick> bricks;
  std::vector<V3d> points;                 // of the bricks in order
  std::vector<V3f> normals;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> at_corner;  // lattice point, index into points: vertices that lie on it
  std::int64_t sampled = 0, not_numbers = 0, jumps = 0, thin = 0;
};

std::size_t point_of(int i, int j, int k) { return static_cast<std::size_t>((k * kSide + j) * kSide + i); }
unsigned edge_bit(int i, int j, int k) { return static_cast<unsigned>((k * kCells + j) * kCells + i); }
std::uint64_t key_of(const V3i& v) {
  return static_cast<std::uint64_t>(v.z) << 42 | static_cast<std::uint64_t>(v.y) << 21 | static_cast<std::uint64_t>(v.x);
}

// A cut lattice edge while its crossing is looked for: places along it, 0 at the lower point, 1 at the upper.
struct Edge {
  V3i lower;
  int axis = 0;
  double in = 0, out = 1;          // bracket: inside (f >= iso) and not inside
  double f_in = 0, f_out = 0;      // f − iso there
  double w_in = 0, w_out = 0;      // the same; an end that stays put is weighed down (Anderson & Björck 1973), or it would slow the secant
  double scale = 0;                // |f_in| + |f_out| of the whole edge
  double t = 0, width = 1;
  int moved = 0;                   // the end that moved last: 1 in, −1 out
  bool fixed = false, done = false, jump = false, undefined = false;
};

class Sampler {
 public:
  Sampler(const Field& field, double iso, const Lattice& lattice) : field_(field), iso_(iso), lattice_(lattice), thin_(field, iso) {}

  // Adds the brick to `found` if the surface passes it.
  void sample(const V3i& at, Found& found) {
    Brick brick;
    brick.at = at;
    const V3i low = at * kCells;
    std::size_t n = 0;
    for (int k = 0; k < kSide; ++k)
      for (int j = 0; j < kSide; ++j)
        for (int i = 0; i < kSide; ++i, ++n) {
          x_[n] = lattice_.at(0, low.x + i);
          y_[n] = lattice_.at(1, low.y + j);
          z_[n] = lattice_.at(2, low.z + k);
        }
    field_.values(n, x_.data(), y_.data(), z_.data(), f_.data());
    ++found.sampled;
    bool any = false, all = true;
    BrickBits outside{};
    for (int k = 0; k < kSide; ++k)
      for (int j = 0; j < kSide; ++j)
        for (int i = 0; i < kSide; ++i) {
          const std::size_t p = point_of(i, j, k);
          const bool decreed = lattice_.decreed(low + V3i(i, j, k));
          if (!decreed && std::isnan(f_[p]) && i < kCells && j < kCells && k < kCells) ++found.not_numbers;
          const bool in = !decreed && f_[p] >= iso_;
          any = any || in;
          all = all && in;
          if (in) brick.inside[p >> 6] |= std::uint64_t{1} << (p & 63);
          else if (!decreed && f_[p] < iso_) outside[p >> 6] |= std::uint64_t{1} << (p & 63);
        }
    found.thin += thin_.count({V3d(x_[0], y_[0], z_[0]), lattice_.grid.h, f_.data(), outside});
    if (!any || all) return;
    collect_edges(brick, low);
    solve();
    place(found);
    found.bricks.push_back(brick);
  }

 private:
  void collect_edges(Brick& brick, const V3i& low) {
    edges_.clear();
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < kCells; ++k)
        for (int j = 0; j < kCells; ++j)
          for (int i = 0; i < kCells; ++i) {
            const std::size_t a = point_of(i, j, k), b = point_of(i + (axis == 0), j + (axis == 1), k + (axis == 2));
            if (brick.is_inside(a) == brick.is_inside(b)) continue;
            brick.cut[static_cast<std::size_t>(axis)] |= std::uint64_t{1} << edge_bit(i, j, k);
            Edge e;
            e.lower = low + V3i(i, j, k);
            e.axis = axis;
            const bool lower_in = brick.is_inside(a);
            e.in = lower_in ? 0 : 1;
            e.out = 1 - e.in;
            e.f_in = e.w_in = f_[lower_in ? a : b] - iso_;
            e.f_out = e.w_out = f_[lower_in ? b : a] - iso_;
            e.scale = std::abs(e.f_in) + std::abs(e.f_out);
            V3i upper = e.lower;
            ++upper[axis];
            if (lattice_.decreed(lower_in ? upper : e.lower)) {
              e.t = 0.5;
              e.fixed = e.done = true;
            } else if (e.f_in == 0) {
              e.t = e.in;
              e.done = true;
            }
            edges_.push_back(e);
          }
    brick.vertices = static_cast<std::uint32_t>(edges_.size());
  }

  // Where to look next: the weighted secant's zero; the middle where an end is not finite or the bracket has not halved in three steps.
  static void aim(Edge& e, int step) {
    constexpr double kJump = 1e-3;  // of the edge's own difference, left within 1e-13 of its length: no slope explains that
    const double before = e.t, low = std::min(e.in, e.out), high = std::max(e.in, e.out);
    bool middle = !std::isfinite(e.w_in) || !std::isfinite(e.w_out);
    if (step % 3 == 2) {
      middle = middle || high - low > e.width / 2;
      e.width = high - low;
    }
    if (!middle) e.t = e.in + (e.out - e.in) * (e.w_in / (e.w_in - e.w_out));
    if (middle || !(e.t >= low && e.t <= high)) e.t = low + (high - low) / 2;
    if (high - low <= kEdgeTolerance) {
      e.done = true;
      e.undefined = std::isnan(e.f_out);
      e.jump = !e.undefined && !(e.f_in - e.f_out <= kJump * e.scale);
    } else if (step > 0 && !middle && std::abs(e.t - before) <= kEdgeTolerance) {
      e.done = true;
    }
  }

  void solve() {
    // Two steps in three at the least halve the bracket or are secants that converge; 200 is beyond the worst case of both.
    for (int step = 0; step < 200; ++step) {
      active_.clear();
      for (Edge& e : edges_) {
        if (!e.done) aim(e, step);
        if (!e.done) active_.push_back(&e);
      }
      if (active_.empty()) return;
      const std::size_t n = active_.size();
      for (std::size_t i = 0; i < n; ++i) write_place(*active_[i], i);
      field_.values(n, x_.data(), y_.data(), z_.data(), f_.data());
      for (std::size_t i = 0; i < n; ++i) narrow(*active_[i], f_[i] - iso_);
    }
  }
  static void narrow(Edge& e, double f) {
    if (f >= 0) {
      if (e.moved == 1) e.w_out *= weight(f, e.w_in);
      e.in = e.t;
      e.f_in = e.w_in = f;
      e.moved = 1;
    } else {
      if (e.moved == -1) e.w_in *= weight(f, e.w_out);
      e.out = e.t;
      e.f_out = e.w_out = f;
      e.moved = -1;
    }
    if (std::abs(f) <= 1e-15 * e.scale && std::isfinite(e.scale)) e.done = true;
  }
  static double weight(double now, double before) {
    const double m = 1 - now / before;
    return m > 0 && m < 1 ? m : 0.5;
  }

  void write_place(const Edge& e, std::size_t i) {
    x_[i] = lattice_.at(0, e.lower.x + (e.axis == 0 ? e.t : 0));
    y_[i] = lattice_.at(1, e.lower.y + (e.axis == 1 ? e.t : 0));
    z_[i] = lattice_.at(2, e.lower.z + (e.axis == 2 ? e.t : 0));
  }

  void place(Found& found) {
    const std::size_t n = edges_.size();
    for (std::size_t i = 0; i < n; ++i) write_place(edges_[i], i);
    field_.gradients(n, x_.data(), y_.data(), z_.data(), f_.data(), gx_.data(), gy_.data(), gz_.data());
    for (std::size_t i = 0; i < n; ++i) {
      const Edge& e = edges_[i];
      found.jumps += e.jump;
      found.not_numbers += e.undefined;
      if (e.t == 0 || e.t == 1) {
        V3i corner = e.lower;
        if (e.t == 1) ++corner[e.axis];
        found.at_corner.emplace_back(key_of(corner), static_cast<std::uint32_t>(found.points.size()));
      }
      found.points.emplace_back(x_[i], y_[i], z_[i]);
      V3d g(gx_[i], gy_[i], gz_[i]);
      const double most = std::max({std::abs(g.x), std::abs(g.y), std::abs(g.z)});
      const bool good = most > 0 && std::isfinite(most) && std::isfinite(g.x + g.y + g.z) && !e.fixed && !e.jump && !e.undefined;
      if (good) g /= most;  // the squares of very large or small gradients would not do
      found.normals.push_back(good ? V3f(-g / g.length()) : V3f(0, 0, 0));
    }
  }

  const Field& field_;
  double iso_;
  const Lattice& lattice_;
  ThinParts thin_;
  std::vector<Edge> edges_;
  std::vector<Edge*> active_;
  static constexpr std::size_t kMost = 3 * kCells * kCells * kCells;  // cut edges; more than a brick's points
  std::array<double, kMost> x_, y_, z_, f_, gx_, gy_, gz_;
};

// Where the bricks are: by key, open addressing.
class BrickTable {
 public:
  explicit BrickTable(const std::vector<Brick>& bricks) : bricks_(bricks), slots_(std::bit_ceil(bricks.size() * 2 + 2), kNoIndex) {
    for (std::uint32_t i = 0; i < bricks.size(); ++i) {
      std::size_t at = slot(bricks[i].at);
      while (slots_[at] != kNoIndex) at = (at + 1) & (slots_.size() - 1);
      slots_[at] = i;
    }
  }
  [[nodiscard]] const Brick* find(const V3i& at) const {
    for (std::size_t s = slot(at); slots_[s] != kNoIndex; s = (s + 1) & (slots_.size() - 1))
      if (bricks_[slots_[s]].at == at) return &bricks_[slots_[s]];
    return nullptr;
  }

 private:
  [[nodiscard]] std::size_t slot(const V3i& at) const {
    std::uint64_t h = key_of(at) * 0x9e3779b97f4a7c15u;
    return (h ^ (h >> 29)) & (slots_.size() - 1);
  }
  const std::vector<Brick>& bricks_;
  std::vector<std::uint32_t> slots_;
};

enum class Proof { kNone, kEmpty, kFull };

struct Polygonizer {
  const Implicit& solid;
  Lattice lattice;
  V3i bricks;                 // how many along each axis
  Report& report;
  Found all;

  // What the range over bricks [low, high) says; beyond the lattice nothing is inside.
  [[nodiscard]] Proof prove(const V3i& low, const V3i& high) const {
    Box3d box;
    bool border = false;
    for (int a = 0; a < 3; ++a) {
      const int first = std::max(low[a] * kCells, 1), last = std::min(high[a] * kCells, lattice.last[a] - 1);
      if (first > last) return Proof::kEmpty;
      border = border || low[a] == 0 || high[a] * kCells >= lattice.last[a];
      box.min[a] = lattice.at(a, first);
      box.max[a] = lattice.at(a, last);
    }
    const Interval range = solid.field->range(box);
    if (range.high < solid.iso) return Proof::kEmpty;
    return range.low >= solid.iso && !border ? Proof::kFull : Proof::kNone;
  }

  // call(brick) for the bricks of a cube of `size` (a power of two) bricks that cannot be proved empty or full.
  template <class Call>
  void descend(const V3i& low, int size, Call&& call) const {
    V3i high;
    for (int a = 0; a < 3; ++a) {
      if (low[a] >= bricks[a]) return;
      high[a] = std::min(low[a] + size, bricks[a]);
    }
    if (prove(low, high) != Proof::kNone) return;
    if (size == 1) return call(low);
    const int half = size / 2;
    for (int i = 0; i < 8; ++i) descend(low + V3i(i & 1 ? half : 0, i & 2 ? half : 0, i & 4 ? half : 0), half, call);
  }

  void sample_bricks() {
    // Regions first, those that stay as tasks.
    std::vector<V3i> regions;
    const int span = static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max({bricks.x, bricks.y, bricks.z}))));
    const int size = std::min(span, kGroup);
    collect_regions(V3i(0, 0, 0), span, size, regions);
    std::vector<Found> found(regions.size());
    std::atomic<std::size_t> done{0};
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, regions.size(), 1), [&](const auto& some) {
      Sampler sampler(*solid.field, solid.iso, lattice);
      for (std::size_t r = some.begin(); r < some.end(); ++r) {
        descend(regions[r], size, [&](const V3i& at) { sampler.sample(at, found[r]); });
        if (report.progress) report.progress("polygonize", static_cast<double>(++done) / static_cast<double>(regions.size()));
      }
    });
    for (Found& f : found) take(f);
  }
  void collect_regions(const V3i& low, int size, int least, std::vector<V3i>& regions) const {
    if (size == least) {
      regions.push_back(low);
      return;
    }
    V3i high;
    for (int a = 0; a < 3; ++a) {
      if (low[a] >= bricks[a]) return;
      high[a] = std::min(low[a] + size, bricks[a]);
    }
    if (prove(low, high) != Proof::kNone) return;
    const int half = size / 2;
    for (int i = 0; i < 8; ++i) collect_regions(low + V3i(i & 1 ? half : 0, i & 2 ? half : 0, i & 4 ? half : 0), half, least, regions);
  }
  void take(Found& f) {
    const auto first = static_cast<std::uint32_t>(all.points.size());
    if (all.points.size() + f.points.size() >= kNoIndex)
      throw Error(Code::kUnsupported, solid.name, "the surface has more than 2^32 vertices", "choose a lower --resolution");
    for (auto& [corner, point] : f.at_corner) all.at_corner.emplace_back(corner, point + first);
    all.bricks.insert(all.bricks.end(), f.bricks.begin(), f.bricks.end());
    all.points.insert(all.points.end(), f.points.begin(), f.points.end());
    all.normals.insert(all.normals.end(), f.normals.begin(), f.normals.end());
    all.sampled += f.sampled;
    all.not_numbers += f.not_numbers;
    all.jumps += f.jumps;
    all.thin += f.thin;
    f = {};
  }

  // Bricks across a face the surface passes were proved empty or full only where a range was wrong: they are sampled after all, until
  // none is missing, so that there is no hole.
  void close_gaps() {
    for (std::size_t from = 0; from < all.bricks.size();) {
      std::vector<V3i> missing;
      {
        const BrickTable table(all.bricks);
        for (std::size_t b = from; b < all.bricks.size(); ++b) add_missing(all.bricks[b], table, missing);
      }
      from = all.bricks.size();
      std::sort(missing.begin(), missing.end(), [](const V3i& a, const V3i& b) { return key_of(a) < key_of(b); });
      missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
      Found found;
      Sampler sampler(*solid.field, solid.iso, lattice);
      for (const V3i& at : missing) sampler.sample(at, found);
      take(found);
    }
  }
  void add_missing(const Brick& brick, const BrickTable& table, std::vector<V3i>& missing) const {
    for (int a = 0; a < 3; ++a)
      for (int side = 0; side < 2; ++side) {
        V3i next = brick.at;
        next[a] += side ? 1 : -1;
        if (next[a] < 0 || next[a] >= bricks[a]) continue;
        bool any = false, every = true;
        for (int u = 0; u < kSide; ++u)
          for (int v = 0; v < kSide; ++v) {
            V3i p;
            p[a] = side ? kCells : 0;
            p[(a + 1) % 3] = u;
            p[(a + 2) % 3] = v;
            const bool in = brick.is_inside(point_of(p.x, p.y, p.z));
            any = any || in;
            every = every && in;
          }
        if (any && !every && !table.find(next)) missing.push_back(next);
      }
  }

  // --- triangles ---------------------------------------------------------------------------------------------------------------

  static unsigned corners_of(const Brick& brick, int i, int j, int k) {
    unsigned corners = 0;
    for (int c = 0; c < 8; ++c)
      if (brick.is_inside(point_of(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)))) corners |= 1u << c;
    return corners;
  }

  void add_triangles(Mesh& mesh) {
    std::uint32_t vertices = 0;
    std::size_t triangles = 0;
    for (Brick& b : all.bricks) {
      b.first_vertex = vertices;
      vertices += b.vertices;
    }
    const auto& loops = cube_loops();
    tbb::parallel_for(std::size_t{0}, all.bricks.size(), [&](std::size_t i) {
      Brick& b = all.bricks[i];
      for (int c = 0; c < 64; ++c) b.triangles += loops[corners_of(b, c & 3, c >> 2 & 3, c >> 4)].triangles;
    });
    for (Brick& b : all.bricks) {
      b.first_triangle = triangles;
      triangles += b.triangles;
    }
    const auto first_point = static_cast<std::uint32_t>(mesh.points.size());
    const std::size_t first = mesh.triangles.size();
    mesh.triangles.resize(first + triangles);
    const BrickTable table(all.bricks);
    tbb::parallel_for(std::size_t{0}, all.bricks.size(), [&](std::size_t i) {
      fill_brick(all.bricks[i], table, mesh.triangles.data() + first + all.bricks[i].first_triangle);
    });
    join_corners(mesh, first);
    for (std::size_t t = first; t < mesh.triangles.size(); ++t)
      for (std::uint32_t& v : mesh.triangles[t]) v += first_point;
    mesh.points.insert(mesh.points.end(), all.points.begin(), all.points.end());
    mesh.normals.insert(mesh.normals.end(), all.normals.begin(), all.normals.end());
    mesh.materials.resize(mesh.triangles.size(), solid.material);
    mesh.made += mesh.triangles.size() - first;
  }

  void fill_brick(const Brick& brick, const BrickTable& table, std::array<std::uint32_t, 3>* out) const {
    std::array<const Brick*, 8> near{};  // neighbours above, by the axes stepped along
    near[0] = &brick;
    const auto vertex = [&](const V3i& cell, int edge) {
      const int corner = edge_corner(edge);
      V3i p = cell + V3i(corner & 1, corner >> 1 & 1, corner >> 2);
      std::size_t step = 0;
      V3i at = brick.at;
      for (int a = 0; a < 3; ++a)
        if (p[a] == kCells) {
          p[a] = 0;
          ++at[a];
          step |= std::size_t{1} << a;
        }
      if (!near[step]) near[step] = table.find(at);
      const Brick& owner = *near[step];
      const auto axis = static_cast<std::size_t>(edge / 4);
      std::uint32_t rank = 0;
      for (std::size_t a = 0; a < axis; ++a) rank += static_cast<std::uint32_t>(std::popcount(owner.cut[a]));
      rank += static_cast<std::uint32_t>(std::popcount(owner.cut[axis] & ((std::uint64_t{1} << edge_bit(p.x, p.y, p.z)) - 1)));
      return owner.first_vertex + rank;
    };
    for (int c = 0; c < 64; ++c) {
      const V3i cell(c & 3, c >> 2 & 3, c >> 4);
      const CubeLoops& loops = cube_loops()[corners_of(brick, cell.x, cell.y, cell.z)];
      for (std::size_t l = 0; l < loops.count; ++l) {
        std::array<std::uint32_t, 12> v{};
        std::size_t n = 0;
        for (std::size_t e = loops.first[l]; e < loops.first[l + 1]; ++e) v[n++] = vertex(cell, loops.edges[e]);
        out = add_fan(v, n, out);
      }
    }
  }

  // From the corner whose diagonals are shortest; of equal ones the first.
  std::array<std::uint32_t, 3>* add_fan(const std::array<std::uint32_t, 12>& v, std::size_t n, std::array<std::uint32_t, 3>* out) const {
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; n > 3 && i < n; ++i) {
      double sum = 0;
      for (std::size_t d = 2; d + 1 < n; ++d) sum += (all.points[v[(i + d) % n]] - all.points[v[i]]).length2();
      if (sum < least) {
        least = sum;
        best = i;
      }
    }
    for (std::size_t d = 1; d + 1 < n; ++d) *out++ = {v[best], v[(best + d) % n], v[(best + d + 1) % n]};
    return out;
  }

  // Vertices that lie on one lattice point are one. Triangles that lose a corner so are left out, which leaves the surface closed.
  void join_corners(Mesh& mesh, std::size_t first) {
    if (all.at_corner.empty()) return;
    std::sort(all.at_corner.begin(), all.at_corner.end());
    std::vector<std::uint32_t> becomes(all.points.size());
    for (std::uint32_t i = 0; i < becomes.size(); ++i) becomes[i] = i;
    for (std::size_t i = 1; i < all.at_corner.size(); ++i)
      if (all.at_corner[i].first == all.at_corner[i - 1].first) becomes[all.at_corner[i].second] = becomes[all.at_corner[i - 1].second];
    std::size_t kept = first;
    for (std::size_t t = first; t < mesh.triangles.size(); ++t) {
      std::array<std::uint32_t, 3> c = mesh.triangles[t];
      for (std::uint32_t& v : c) v = becomes[v];
      if (c[0] != c[1] && c[1] != c[2] && c[2] != c[0]) mesh.triangles[kept++] = c;
    }
    mesh.triangles.resize(kept);
  }
};

// Whether the solid fills the grid; where it has no surface there, one point tells.
bool is_full(const Implicit& solid, const Grid& grid) {
  const V3d p = grid.to_world(V3d(grid.n) / 2.0);
  double f = 0;
  solid.field->values(1, &p.x, &p.y, &p.z, &f);
  return f >= solid.iso;
}

std::string short_number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", v);
  return text;
}

std::string grouped_share(std::int64_t part, std::int64_t whole) {
  char text[64];
  std::snprintf(text, sizeof text, "%lld of %lld", static_cast<long long>(part), static_cast<long long>(whole));
  return text;
}

}  // namespace

Scene polygonize(Scene scene, const Recipe& recipe, Report& report) {
  Mesh& mesh = scene.mesh;
  if (scene.implicits.empty() || mesh.made > 0) return scene;
  const StageTimer timer(report, "polygonize");
  const Grid grid = plan_grid(scene, recipe);
  const std::size_t given = mesh.triangles.size();
  mesh.normals.resize(mesh.points.size(), V3f(0, 0, 0));
  std::int64_t bricks = 0, sampled = 0;
  for (const Implicit& one : scene.implicits) {
    const Implicit solid = repeat_solid(one, grid, recipe, report);
    Polygonizer work{solid, {grid, grid.n + V3i(2, 2, 2)}, {}, report, {}};
    for (int a = 0; a < 3; ++a) work.bricks[a] = (work.lattice.last[a] + kCells - 1) / kCells;
    work.sample_bricks();
    work.close_gaps();
    bricks += std::int64_t{work.bricks.x} * work.bricks.y * work.bricks.z;
    sampled += work.all.sampled;
    if (work.all.not_numbers > 0)
      report.issue("implicit-nan", "points where the function is not a number; they count as outside", work.all.not_numbers, solid.name);
    if (work.all.jumps > 0)
      report.issue("implicit-jump", "places where the function jumps instead of crossing; the surface was put at the jump", work.all.jumps, solid.name);
    if (work.all.thin > 0)
      report.issue("implicit-thin", "voxels with parts thinner than a voxel that pass between the lattice points and are missing; a finer --resolution finds them", work.all.thin, solid.name);
    const std::size_t before = mesh.triangles.size();
    work.add_triangles(mesh);
    bool inside_box = false;
    for (const V3d& p : work.all.points) {
      const V3d v = grid.to_voxel(p);
      inside_box = inside_box || (v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x <= grid.n.x && v.y <= grid.n.y && v.z <= grid.n.z);
    }
    const bool fills = !inside_box && is_full(solid, grid);
    const bool empty = mesh.triangles.size() == before, slips = empty && work.all.thin > 0;
    if (given == 0 && scene.implicits.size() == 1 && slips)
      throw Error(Code::kBadInput, solid.name, "the solid is thinner than a voxel and passes between the lattice points", "choose a finer --resolution");
    if (given == 0 && scene.implicits.size() == 1 && (fills || empty))
      throw Error(Code::kBadInput, solid.name, std::string(fills ? "the function is >= " : "the function is nowhere >= ") + short_number(solid.iso) +
                  (fills ? " all over the box, so that no surface is in it" : " in the box"), "change --iso or --box");
    if (empty && !slips) report.issue("implicit-empty", "the function is nowhere >= iso in the box", 1, solid.name);
    else if (fills) report.issue("implicit-full", "the function is >= iso all over the box", 1, solid.name);
  }
  report.count("bricks", static_cast<double>(bricks));
  report.count("bricks sampled", static_cast<double>(sampled));
  report.count("implicit triangles", static_cast<double>(mesh.made));
  if (sampled < bricks)
    report.skip("sampling of " + grouped_share(bricks - sampled, bricks) + " bricks of 4x4x4 cells", "proved empty or full by interval arithmetic");
  const auto pad = [&](auto& list, const auto& value, std::size_t size) {
    if (!list.empty()) list.resize(size, value);
  };
  pad(mesh.colors, V3f(1, 1, 1), mesh.points.size());
  pad(mesh.uv_corners, std::array<std::uint32_t, 3>{kNoIndex, kNoIndex, kNoIndex}, mesh.triangles.size());
  return scene;
}

}  // namespace texel
