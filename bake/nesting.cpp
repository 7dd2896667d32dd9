#include "bake/nesting.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numeric>

#include "formats/scene.h"

#define BOOST_ALLOW_DEPRECATED_HEADERS  // Boost 1.74's own geometry includes one and says so in every build
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/iterator/function_output_iterator.hpp>

namespace texel {
namespace {

namespace geometry = boost::geometry;
using Point2 = geometry::model::point<double, 2, geometry::cs::cartesian>;
using Box2 = geometry::model::box<Point2>;
using Probe = std::pair<Point2, std::uint32_t>;  // and the component's rank

// What looks along axis w sees of space: (u, v, w) is right-handed. Repeated: one period, which stands for all.
struct Outlook {
  int w;
  V3i period{0, 0, 0};
  [[nodiscard]] int u() const { return (w + 1) % 3; }
  [[nodiscard]] int v() const { return (w + 2) % 3; }
  [[nodiscard]] double within(double x, int axis) const { return period[axis] > 0 ? x - std::floor(x / period[axis]) * period[axis] : x; }
};

// Which side of the line through two corners, each given by (u, v), the probe is on: the same but for its sign for both triangles of an edge, and never 0:
// a probe on a line counts as moved by (ε, ε²), so that it is behind one triangle of a closed surface's outline and not behind two or none.
double side_of(const V2d& a, const V2d& b, const V2d& p) {
  if (b.x < a.x || (b.x == a.x && b.y < a.y)) return -side_of(b, a, p);
  const double side = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
  if (side != 0) return side;
  return b.y != a.y ? a.y - b.y : b.x - a.x;
}

// What a triangle adds to the winding number of a ray from the probe at `p` (height h) down axis w: ±1 where it lies below, else 0.
int winding_below(const V3d corner[3], const Outlook& look, const V2d& p, double h) {
  V2d flat[3];
  for (int i = 0; i < 3; ++i) flat[i] = {corner[i][look.u()], corner[i][look.v()]};
  const double side[3] = {side_of(flat[1], flat[2], p), side_of(flat[2], flat[0], p), side_of(flat[0], flat[1], p)};
  const bool left = side[0] > 0 && side[1] > 0 && side[2] > 0, right = side[0] < 0 && side[1] < 0 && side[2] < 0;
  if (!left && !right) return 0;
  const double height = (side[0] * corner[0][look.w] + side[1] * corner[1][look.w] + side[2] * corner[2][look.w]) / (side[0] + side[1] + side[2]);
  if (!(height < h)) return 0;
  return left ? -1 : 1;  // upwards through a face that looks down: in
}

// The probes of all components as seen along an axis.
class Probes {
 public:
  Probes(const Outlook& look, std::span<const V3d> probes) : look_(look), probes_(probes) {
    std::vector<Probe> places;
    places.reserve(probes.size());
    for (std::uint32_t i = 0; i < probes.size(); ++i) places.emplace_back(Point2(look.within(probes[i][look.u()], look.u()), look.within(probes[i][look.v()], look.v())), i);
    tree_ = Tree(places);  // packed, all at once
  }

  // Calls call(rank, place) for all probes within the box along u and v, of repetitions too; `place` is where the box's own repetition has it.
  template <class Call>
  void each_within(const Box3d& box, Call&& call) const {
    const auto shifts = [&](int a) {
      const double period = look_.period[a];
      return period > 0 ? std::pair(std::floor(box.min[a] / period), std::floor(box.max[a] / period)) : std::pair(0.0, 0.0);
    };
    const auto [u0, u1] = shifts(look_.u());
    const auto [v0, v1] = shifts(look_.v());
    for (double i = u0; i <= u1; ++i)
      for (double j = v0; j <= v1; ++j) {
        const double x = i * look_.period[look_.u()], y = j * look_.period[look_.v()];
        const Box2 range(Point2(box.min[look_.u()] - x, box.min[look_.v()] - y), Point2(box.max[look_.u()] - x, box.max[look_.v()] - y));
        tree_.query(geometry::index::intersects(range),
                    boost::make_function_output_iterator([&](const Probe& probe) { call(probe.second, V2d(geometry::get<0>(probe.first) + x, geometry::get<1>(probe.first) + y)); }));
      }
  }
  [[nodiscard]] double height(std::uint32_t rank) const { return probes_[rank][look_.w]; }
  [[nodiscard]] const Outlook& look() const { return look_; }

 private:
  using Tree = geometry::index::rtree<Probe, geometry::index::quadratic<16>>;
  Outlook look_;
  std::span<const V3d> probes_;
  Tree tree_;
};

// Triangles by component, ascending.
struct Members {
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> triangles;

  explicit Members(const Topology& topology) : first(topology.components.size() + 1, 0) {
    for (const std::uint32_t c : topology.component)
      if (c != kNoIndex) ++first[c + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    triangles.resize(first.back());
    std::vector<std::size_t> at(first.begin(), first.end() - 1);
    for (std::uint32_t t = 0; t < topology.component.size(); ++t)
      if (const std::uint32_t c = topology.component[t]; c != kNoIndex) triangles[at[c]++] = t;
  }
  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t c) const { return {triangles.data() + first[c], triangles.data() + first[c + 1]}; }
};

bool holds(const Box3d& outer, const Box3d& inner) {
  for (int a = 0; a < 3; ++a)
    if (inner.min[a] < outer.min[a] || inner.max[a] > outer.max[a]) return false;
  return true;
}

}  // namespace

Nesting find_nesting(std::span<const V3d> points, std::span<const std::array<std::uint32_t, 3>> triangles, const Topology& topology,
                     std::span<const Box3d> boxes, const std::vector<bool>& takes_part, const V3i& period) {
  const auto& parts = topology.components;
  Nesting nesting;
  std::vector<std::uint32_t>& order = nesting.order;  // a component's rank is its place here
  for (std::uint32_t c = 0; c < parts.size(); ++c)
    if (takes_part[c]) order.push_back(c);
  const auto size = [&](std::uint32_t c) { return std::abs(parts[c].volume); };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return size(a) != size(b) ? size(a) > size(b) : a < b; });
  std::vector<V3d> probes;
  for (const std::uint32_t c : order) {
    // A point of a face, not on the lines of a regular mesh where it is beside edges of others.
    const auto& face = triangles[parts[c].first];
    probes.push_back(points[face[0]] * 0.41 + points[face[1]] * 0.32 + points[face[2]] * 0.27);
  }
  std::map<int, Probes> seen_along;  // by axis; −1: the usual one of what is closed by itself, without repetitions
  const auto seen_by = [&](const Topology::Component& part) -> const Probes& {
    const auto at = seen_along.find(part.bounded);
    if (at != seen_along.end()) return at->second;
    const Outlook look = part.bounded < 0 ? Outlook{2} : Outlook{part.bounded, period};
    return seen_along.try_emplace(part.bounded, look, probes).first->second;
  };

  const Members members(topology);
  std::vector<std::uint32_t> touched;
  nesting.container.assign(parts.size(), kNoIndex);
  std::vector<int> winding(order.size(), 0);
  for (std::uint32_t rank = 0; rank < order.size(); ++rank) {
    const std::uint32_t o = order[rank];
    const Probes& seen = seen_by(parts[o]);
    const auto may_hold = [&](std::uint32_t i) { return i > rank && (parts[o].bounded >= 0 || holds(boxes[o], boxes[order[i]])); };
    bool any = false;
    seen.each_within(boxes[o], [&](std::uint32_t i, const V2d&) { any = any || may_hold(i); });
    if (!any) continue;
    touched.clear();
    for (const std::uint32_t t : members.of(o)) {
      const V3d corner[3] = {points[triangles[t][0]], points[triangles[t][1]], points[triangles[t][2]]};
      Box3d box;
      for (const V3d& p : corner) box.extendBy(p);
      seen.each_within(box, [&](std::uint32_t i, const V2d& place) {
        if (!may_hold(i)) return;
        winding[i] += topology.turn[t] * winding_below(corner, seen.look(), place, seen.height(i));
        touched.push_back(i);
      });
    }
    for (const std::uint32_t i : touched) {
      if (winding[i] != 0) nesting.container[order[i]] = o;
      winding[i] = 0;
    }
  }
  return nesting;
}

bool any_within_another(std::span<const Box3d> boxes, const std::vector<bool>& asks) {
  using Point3 = geometry::model::point<double, 3, geometry::cs::cartesian>;
  using Box3 = geometry::model::box<Point3>;
  using Entry = std::pair<Box3, std::size_t>;
  const auto as_box = [](const Box3d& b) { return Box3(Point3(b.min.x, b.min.y, b.min.z), Point3(b.max.x, b.max.y, b.max.z)); };
  std::vector<Entry> entries;
  for (std::size_t i = 0; i < boxes.size(); ++i)
    if (!boxes[i].isEmpty()) entries.emplace_back(as_box(boxes[i]), i);
  const geometry::index::rtree<Entry, geometry::index::quadratic<16>> tree(entries);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (!asks[i] || boxes[i].isEmpty()) continue;
    const auto covering = geometry::index::covers(as_box(boxes[i])) && geometry::index::satisfies([i](const Entry& e) { return e.second != i; });
    if (tree.qbegin(covering) != tree.qend()) return true;
  }
  return false;
}

}  // namespace texel
