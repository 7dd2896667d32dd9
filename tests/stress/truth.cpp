#include "tests/stress/truth.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace texel::stress {
namespace {

using Real = long double;
struct Point { Real v[3]; };

Real area_of(const std::vector<Point>& p) {
  Real sum[3] = {0, 0, 0};
  for (std::size_t i = 1; i + 1 < p.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const int u = (k + 1) % 3, w = (k + 2) % 3;
      sum[k] += (p[i].v[u] - p[0].v[u]) * (p[i + 1].v[w] - p[0].v[w]) - (p[i].v[w] - p[0].v[w]) * (p[i + 1].v[u] - p[0].v[u]);
    }
  return std::hypot(sum[0], sum[1], sum[2]) / 2;
}

// The part of a convex polygon at or above (sign +1) or below a plane across an axis (Sutherland & Hodgman 1974).
std::vector<Point> keep(const std::vector<Point>& p, int axis, Real wall, int sign) {
  std::vector<Point> out;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Point &a = p[i], &b = p[(i + 1) % p.size()];
    const Real da = sign * (a.v[axis] - wall), db = sign * (b.v[axis] - wall);
    if (da >= 0) out.push_back(a);
    if ((da < 0 && db > 0) || (da > 0 && db < 0)) {
      Point cut;
      for (int k = 0; k < 3; ++k) cut.v[k] = a.v[k] + (b.v[k] - a.v[k]) * (da / (da - db));
      cut.v[axis] = wall;
      out.push_back(cut);
    }
  }
  return out;
}

}  // namespace

AreaTruth area_within(const Mesh& mesh, const Grid& grid) {
  constexpr Real kSnap = 0x1p-30L;       // voxels: nearer points are put on the wall (plan_point)
  constexpr Real kDouble = 0x1p-53L;     // half a unit in the last place
  AreaTruth truth;
  for (const auto& t : mesh.triangles) {
    std::vector<Point> p(3);
    bool snaps = false;
    Real reach = 0;
    for (std::size_t i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) {
        const double world = mesh.points[t[i]][k];
        p[i].v[k] = (static_cast<Real>(world) - static_cast<Real>(grid.origin[k])) / static_cast<Real>(grid.h);
        // As plan_point has it, except where double and long double may think differently of what is near.
        const Real wall = std::nearbyint(p[i].v[k]), off = std::abs(p[i].v[k] - wall);
        snaps = snaps || std::abs(off - kSnap) < 1e-3L * kSnap;
        if (off < kSnap) p[i].v[k] = wall;
        reach = std::max({reach, std::abs(p[i].v[k]), std::abs(static_cast<Real>(world) / static_cast<Real>(grid.h))});
      }
    Real around = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      Real length[3];
      for (int k = 0; k < 3; ++k) length[k] = p[(i + 1) % 3].v[k] - p[i].v[k];
      around += std::hypot(length[0], length[1], length[2]);
    }
    bool in_wall = false;
    for (int k = 0; k < 3; ++k) {
      const Real lo = std::min({p[0].v[k], p[1].v[k], p[2].v[k]}), hi = std::max({p[0].v[k], p[1].v[k], p[2].v[k]});
      for (const Real wall : {Real{0}, static_cast<Real>(grid.n[k])}) in_wall = in_wall || (lo == wall && hi == wall);
    }
    const bool whole = [&] {
      for (const Point& q : p)
        for (int k = 0; k < 3; ++k)
          if (q.v[k] < 0 || q.v[k] > grid.n[k]) return false;
      return true;
    }();
    std::vector<Point> inner = p;
    for (int k = 0; k < 3 && !whole && inner.size() >= 3; ++k) {
      inner = keep(inner, k, 0, 1);
      if (inner.size() >= 3) inner = keep(inner, k, static_cast<Real>(grid.n[k]), -1);
    }
    const Real area = inner.size() >= 3 ? area_of(inner) : 0;
    // A corner that moves by e sweeps at most e times half the sides beside it. Cuts put corners that far off, too: a few of them in each of the cells
    // the triangle crosses, along a length that is at most its own outline or the grid's.
    const Real cells = std::min<Real>(around, 3.0L * (grid.n.x + grid.n.y + grid.n.z)) + 3;
    const Real length = std::min<Real>(around, 6.0L * (grid.n.x + grid.n.y + grid.n.z));
    truth.slack += length * (8 * kDouble * reach * std::min<Real>(cells, 64) + (snaps ? 2 * kSnap : 0)) + 64 * kDouble * area;
    truth.most += area;
    if (!in_wall) truth.least += area;
  }
  const Real face = static_cast<Real>(grid.h) * static_cast<Real>(grid.h);
  truth.least *= face;
  truth.most *= face;
  truth.slack *= face;
  return truth;
}

std::optional<int> winding_at(const Mesh& mesh, const V3d& q, double near) {
  int winding = 0;
  for (const auto& t : mesh.triangles) {
    const V3d* p[3] = {&mesh.points[t[0]], &mesh.points[t[1]], &mesh.points[t[2]]};
    int covers = 0;  // winding number of the triangle's outline about q in (x, y)
    for (int i = 0; i < 3; ++i) {
      const V3d &a = *p[i], &b = *p[(i + 1) % 3];
      if ((a.y <= q.y) == (b.y <= q.y)) continue;
      const bool up = a.y < b.y;
      const V3d &low = up ? a : b, &high = up ? b : a;
      const Real side = (static_cast<Real>(high.x) - low.x) * (static_cast<Real>(q.y) - low.y) - (static_cast<Real>(q.x) - low.x) * (static_cast<Real>(high.y) - low.y);
      if (side > 0) covers += up ? 1 : -1;
    }
    if (covers == 0) continue;
    Real u[3], v[3], d[3];
    for (int k = 0; k < 3; ++k) {
      u[k] = static_cast<Real>((*p[1])[k]) - (*p[0])[k];
      v[k] = static_cast<Real>((*p[2])[k]) - (*p[0])[k];
      d[k] = static_cast<Real>(q[k]) - (*p[0])[k];
    }
    const Real n[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    const Real above = (d[0] * n[0] + d[1] * n[1] + d[2] * n[2]) / std::hypot(n[0], n[1], n[2]);
    if (!(std::abs(above) > near)) return std::nullopt;
    // Upwards from q: the plane is met where q is below it, on the side away from n_z's sign.
    if ((above > 0) != (n[2] > 0)) winding += covers;
  }
  return winding;
}

long double volume_of(const Mesh& mesh) {
  Real sum = 0;
  const V3d& o = mesh.points[mesh.triangles[0][0]];
  for (const auto& t : mesh.triangles) {
    Real p[3][3];
    for (std::size_t i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) p[i][k] = static_cast<Real>(mesh.points[t[i]][k]) - o[k];
    sum += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) + p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) + p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
  }
  return sum / 6;
}

}  // namespace texel::stress
