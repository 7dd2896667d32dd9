#include <cmath>
#include <map>
#include <optional>
#include <tuple>
#include <unordered_map>

#include "bake/half_edges.h"
#include "formats/scene.h"

namespace texel {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr double kCell = 0x1p-7;         // voxels: of the table corners are looked up in; divides every period
constexpr double kExact = 0x1p-36;       // voxels: multiples up to 2¹⁶ have 52 bits
constexpr double kFarthest = 0x1p40;     // voxels: what lies beyond meets no repetition
constexpr double kBalanced = 1e-6;       // of a component's area: what its vector area may be and it still has an inside

// Each vertex as a repetition of another: its position is that of `of`, moved by `shift` periods.
struct Twin {
  std::uint32_t of = 0;
  V3i shift{0, 0, 0};
};

// Finds among the corners given so far the nearest one that the next is a repetition of.
class SeamTable {
 public:
  SeamTable(const V3i& period, std::span<const V3d> points) : period_(period), points_(points) {}

  // The twin of vertex v; itself where it is none, and then later ones may be twins of it.
  Twin add(std::uint32_t v) {
    const V3d& p = points_[v];
    for (int a = 0; a < 3; ++a)
      if (!(std::abs(p[a]) < kFarthest)) return {v, V3i(0, 0, 0)};
    Twin best{v, V3i(0, 0, 0)};
    double nearest = kSeamTolerance;
    for (int corner = 0; corner < 8; ++corner) {
      const auto cell = cells_.find(key(p, corner));
      if (cell == cells_.end()) continue;
      for (const std::uint32_t q : cell->second) {
        V3i shift(0, 0, 0);
        double distance = 0;
        for (int a = 0; a < 3; ++a) {
          const double off = p[a] - points_[q][a];
          if (period_[a] > 0) shift[a] = static_cast<int>(std::nearbyint(off / period_[a]));
          distance = std::max(distance, std::abs(off - static_cast<double>(shift[a]) * period_[a]));
        }
        if (shift == V3i(0, 0, 0) || distance > nearest || (distance == nearest && best.of <= q)) continue;
        nearest = distance;
        best = {q, shift};
      }
    }
    if (best.of == v) cells_[key(p, -1)].push_back(v);
    return best;
  }

 private:
  // The cell of p, or of p moved by the tolerance down or up each axis.
  [[nodiscard]] std::uint64_t key(const V3d& p, int corner) const {
    std::uint64_t all = 0;
    for (int a = 0; a < 3; ++a) {
      const double moved = corner < 0 ? p[a] : p[a] + (((corner >> a) & 1) ? kSeamTolerance : -kSeamTolerance);
      auto cell = static_cast<std::int64_t>(std::floor(moved / kCell));
      if (const auto cells = static_cast<std::int64_t>(period_[a] / kCell); cells > 0) cell = ((cell % cells) + cells) % cells;
      all = (all ^ static_cast<std::uint64_t>(cell)) * 0x9e3779b97f4a7c15u;
      all ^= all >> 29;
    }
    return all;
  }

  V3i period_;
  std::span<const V3d> points_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

// Half-edges between vertices of which some are repetitions of others. An edge is its lower vertex, its upper one, and how many periods lie between
// them; the last two become one number.
HalfEdges half_edges_over_period(std::span<const Twin> twin, std::span<const Triangle> triangles, std::span<const char> joins) {
  std::map<std::tuple<std::uint32_t, int, int, int>, std::uint32_t> far;
  const auto upper = [&](std::uint32_t v, const V3i& shift) {
    if (shift == V3i(0, 0, 0)) return v;
    return far.try_emplace({v, shift.x, shift.y, shift.z}, static_cast<std::uint32_t>(twin.size() + far.size())).first->second;
  };
  return HalfEdges(twin.size(), [&](auto&& call) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      if (!joins[t]) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        const Twin &a = twin[triangles[t][i]], &b = twin[triangles[t][(i + 1) % 3]];
        const V3i step = b.shift - a.shift;
        const bool forward = a.of != b.of ? a.of < b.of : std::tuple(step.x, step.y, step.z) > std::tuple(0, 0, 0);
        call(std::min(a.of, b.of), HalfEdge{upper(std::max(a.of, b.of), forward ? step : -step), static_cast<std::uint32_t>(t), forward ? 1 : -1});
      }
    }
  });
}

// What says whether a component that closes over the period has an inside.
struct Balance {
  double area = 0;
  V3d vector{0, 0, 0}, volume{0, 0, 0};                          // Σ A n; Σ A n_a·(height along a), per axis
  std::array<bool, 3> moved{false, false, false};                // joined across the period along this axis
};

std::vector<Balance> balance_components(const Topology& part, std::span<const Triangle> triangles, std::span<const V3d> points, std::span<const Twin> twin) {
  std::vector<Balance> all(part.components.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (part.component[t] == kNoIndex) continue;
    Balance& b = all[part.component[t]];
    const Triangle& c = triangles[t];
    const V3d n = (points[c[1]] - points[c[0]]).cross(points[c[2]] - points[c[0]]) * (part.turn[t] / 2.0);
    const V3d middle = (points[c[0]] + points[c[1]] + points[c[2]]) / 3.0;
    b.area += n.length();
    b.vector += n;
    for (int a = 0; a < 3; ++a) b.volume[a] += n[a] * middle[a];
    for (const std::uint32_t v : c)
      for (int a = 0; a < 3; ++a)
        if (twin[v].shift[a] != 0) b.moved[static_cast<std::size_t>(a)] = true;
  }
  return all;
}

// An axis along which a component and its repetitions end: one that does not repeat, z first; else one it is not joined across. −1: none.
int bounded_axis(const Balance& b, const V3i& period) {
  for (const bool repeats : {false, true})
    for (int a = 2; a >= 0; --a)
      if ((period[a] > 0) == repeats && !b.moved[static_cast<std::size_t>(a)]) return a;
  return -1;
}

// Closed components get their axis and volume; those that have neither are open after all. Sheets that balance each other become one.
StillOpen judge(const V3i& period, std::span<const Triangle> triangles, std::span<const V3d> points, std::span<const Twin> twin, Topology& part) {
  StillOpen left;
  const std::vector<Balance> balance = balance_components(part, triangles, points, twin);
  std::array<double, 3> sheet_sum{}, sheet_area{}, sheet_volume{};
  std::array<std::vector<std::uint32_t>, 3> sheets;              // by bounded axis
  for (std::uint32_t c = 0; c < part.components.size(); ++c) {
    Topology::Component& component = part.components[c];
    if (!component.closed) continue;
    const Balance& b = balance[c];
    component.bounded = bounded_axis(b, period);
    if (component.bounded < 0) {
      component.closed = false;
      ++left.endless;
      continue;
    }
    const auto axis = static_cast<std::size_t>(component.bounded);
    component.volume = b.volume[component.bounded];
    if (std::abs(b.vector[component.bounded]) <= kBalanced * b.area) continue;
    sheets[axis].push_back(c);
    sheet_sum[axis] += b.vector[component.bounded];
    sheet_area[axis] += b.area;
    sheet_volume[axis] += b.volume[component.bounded];
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (sheets[axis].empty()) continue;
    const std::uint32_t head = sheets[axis].front();
    const bool balanced = std::abs(sheet_sum[axis]) <= kBalanced * sheet_area[axis];
    if (!balanced) left.sheets += static_cast<std::int64_t>(sheets[axis].size());
    for (const std::uint32_t c : sheets[axis]) {
      Topology::Component& component = part.components[c];
      if (!balanced) {
        component.closed = false;
        component.bounded = -1;
      } else if (c != head) {
        part.components[head].triangles += component.triangles;
        part.components[head].turned += component.turned;
        component = {};
      }
    }
    if (!balanced) continue;
    part.components[head].volume = sheet_volume[axis];
    for (std::uint32_t& c : part.component)
      if (c != kNoIndex && std::binary_search(sheets[axis].begin(), sheets[axis].end(), c)) c = head;
  }
  return left;
}

}  // namespace

StillOpen close_over_period(const V3i& period, std::vector<V3d>& points, std::span<const Triangle> triangles, Topology& topology) {
  std::vector<Triangle> open;              // triangles of open components
  std::vector<std::uint32_t> number;       // theirs among all
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    if (const std::uint32_t c = topology.component[t]; c != kNoIndex && !topology.components[c].closed) {
      open.push_back(triangles[t]);
      number.push_back(t);
    }
  if (open.empty()) return {};

  // Corners on open edges that are repetitions of one another.
  const std::vector<std::uint32_t> first = weld(points);
  std::vector<char> on_edge(points.size(), 0);
  std::vector<std::int8_t> turn;
  for (const std::uint32_t t : number) turn.push_back(topology.turn[t]);
  for (const ChainEdge& e : chain_boundary(points, open, turn)) on_edge[e.from] = on_edge[e.to] = 1;
  std::vector<Twin> twin(points.size());
  {
    SeamTable table(period, points);
    for (std::uint32_t v = 0; v < points.size(); ++v) twin[v] = first[v] != v ? twin[first[v]] : on_edge[v] ? table.add(v) : Twin{v, V3i(0, 0, 0)};
  }
  std::vector<char> repeats(points.size(), 0);
  for (const Twin& i : twin)
    if (i.shift != V3i(0, 0, 0)) repeats[i.of] = 1;
  if (std::find(repeats.begin(), repeats.end(), 1) == repeats.end()) return {};
  for (std::uint32_t v = 0; v < points.size(); ++v) {
    const Twin& i = twin[v];
    if (!repeats[i.of]) continue;
    // On a lattice so fine that whole periods can be added and taken away without rounding.
    V3d p = points[i.of];
    for (int a = 0; a < 3; ++a)
      if (period[a] > 0) p[a] = std::nearbyint(p[a] / kExact) * kExact;
    points[v] = p + V3d(i.shift) * V3d(period);
  }

  std::vector<char> joins(open.size());
  for (std::size_t t = 0; t < open.size(); ++t) {
    const auto same = [&](std::size_t i, std::size_t j) { return twin[open[t][i]].of == twin[open[t][j]].of && twin[open[t][i]].shift == twin[open[t][j]].shift; };
    joins[t] = !same(0, 1) && !same(1, 2) && !same(2, 0);
  }
  Topology part = join_triangles(half_edges_over_period(twin, open, joins), joins);
  const StillOpen left = judge(period, open, points, twin, part);

  // Both kinds together, in the order of their lowest triangle.
  for (std::size_t i = 0; i < open.size(); ++i) {
    const std::uint32_t c = part.component[i];
    topology.component[number[i]] = c == kNoIndex ? kNoIndex : static_cast<std::uint32_t>(topology.components.size()) + c;
    topology.turn[number[i]] = part.turn[i];
  }
  std::vector<Topology::Component> all = topology.components;
  for (Topology::Component c : part.components) {
    if (c.triangles > 0) c.first = number[c.first];
    all.push_back(c);
  }
  std::vector<std::uint32_t> place(all.size(), kNoIndex);
  topology.components.clear();
  for (std::uint32_t& c : topology.component) {
    if (c == kNoIndex) continue;
    if (place[c] == kNoIndex) {
      place[c] = static_cast<std::uint32_t>(topology.components.size());
      topology.components.push_back(all[c]);
    }
    c = place[c];
  }
  return left;
}

}  // namespace texel
