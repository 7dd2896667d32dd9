#include "bake/repeat.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include "bake/topology.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr double kReach = 1;                 // voxels beyond the grid that must be there
constexpr std::int64_t kMostTriangles = 200'000'000;

// Whole periods by which something from `low` to `high` can be moved and still meet the grid.
struct Shifts { std::int64_t first = 0, last = 0; };

Shifts shifts_of(double low, double high, int n) {
  return {static_cast<std::int64_t>(std::ceil((-kReach - high) / n)), static_cast<std::int64_t>(std::floor((n + kReach - low) / n))};
}

struct Repeater {
  const Scene& scene;
  const std::array<bool, 3>& cyclic;
  const Plan& plan;

  // The shifts of triangle t along each axis.
  [[nodiscard]] std::array<Shifts, 3> shifts(std::size_t t) const {
    const auto& corner = scene.mesh.triangles[t];
    const Plan::Body* body = !plan.body.empty() && plan.body[t] != kNoIndex ? &plan.bodies[plan.body[t]] : nullptr;
    std::array<Shifts, 3> all{};
    for (int a = 0; a < 3; ++a) {
      if (!cyclic[static_cast<std::size_t>(a)]) continue;
      const double p = plan.points[corner[0]][a], q = plan.points[corner[1]][a], r = plan.points[corner[2]][a];
      // Along the axis it is not cut open on, a component comes as a whole.
      const bool whole = body && body->bounded == a;
      all[static_cast<std::size_t>(a)] = whole ? shifts_of(body->box.min[a], body->box.max[a], plan.grid.n[a]) : shifts_of(std::min({p, q, r}), std::max({p, q, r}), plan.grid.n[a]);
    }
    return all;
  }
};

using Shift = std::array<std::int64_t, 3>;   // z, y, x: in the order of repetitions

// Triangles of the repeated scene and the points they need.
struct Repeated {
  Mesh mesh;
  std::vector<V3d> points;                   // voxel space
  std::vector<std::int8_t> turn, winding;
  std::vector<int> bounded;                  // of filled triangles; −1: not filled
};

void add_triangle(const Scene& scene, const Plan& plan, std::size_t t, const std::array<std::uint32_t, 3>& corners, Repeated& to) {
  const Mesh& mesh = scene.mesh;
  to.mesh.triangles.push_back(corners);
  to.mesh.materials.push_back(mesh.materials[t]);
  if (!mesh.uv_corners.empty()) to.mesh.uv_corners.push_back(mesh.uv_corners[t]);
  to.turn.push_back(plan.turn[t]);
  to.winding.push_back(plan.winding[t]);
  to.bounded.push_back(!plan.body.empty() && plan.body[t] != kNoIndex ? plan.bodies[plan.body[t]].bounded : -1);
}

void add_copies(const Scene& scene, const Plan& plan, const Shift& shift, std::span<const std::uint32_t> triangles, std::vector<std::uint32_t>& place, Repeated& to) {
  const Mesh& mesh = scene.mesh;
  const V3d periods(static_cast<double>(shift[2]), static_cast<double>(shift[1]), static_cast<double>(shift[0]));
  const V3d moved = periods * V3d(plan.grid.n);
  for (const std::uint32_t t : triangles) {
    std::array<std::uint32_t, 3> corners{};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t v = mesh.triangles[t][i];
      if (place[v] == kNoIndex) {
        place[v] = static_cast<std::uint32_t>(to.points.size());
        to.points.push_back(plan.points[v] + moved);
        to.mesh.points.push_back(mesh.points[v] + moved * plan.grid.h);
        if (!mesh.colors.empty()) to.mesh.colors.push_back(mesh.colors[v]);
        if (!mesh.normals.empty()) to.mesh.normals.push_back(mesh.normals[v]);
      }
      corners[i] = place[v];
    }
    add_triangle(scene, plan, t, corners, to);
  }
  for (const std::uint32_t t : triangles)
    for (const std::uint32_t v : mesh.triangles[t]) place[v] = kNoIndex;
}

// A quad from each open edge of the triangles that end along `axis` straight down to below them all.
void hang_curtains(const Plan& plan, int axis, Repeated& to) {
  std::vector<std::array<std::uint32_t, 3>> part;
  std::vector<std::int8_t> weight;
  std::vector<std::uint32_t> material;
  double lowest = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < to.bounded.size(); ++t) {
    if (to.bounded[t] != axis) continue;
    part.push_back(to.mesh.triangles[t]);
    weight.push_back(to.turn[t]);
    material.push_back(to.mesh.materials[t]);
    for (const std::uint32_t v : to.mesh.triangles[t]) lowest = std::min(lowest, to.points[v][axis]);
  }
  std::map<std::uint32_t, std::uint32_t> feet;
  const auto foot = [&](std::uint32_t v) {
    const auto [at, is_new] = feet.try_emplace(v, static_cast<std::uint32_t>(to.points.size()));
    if (is_new) {
      V3d p = to.points[v];
      p[axis] = lowest - 1;
      to.points.push_back(p);
      to.mesh.points.push_back(plan.grid.to_world(p));
      if (!to.mesh.colors.empty()) to.mesh.colors.push_back(to.mesh.colors[v]);
      if (!to.mesh.normals.empty()) to.mesh.normals.push_back(V3f(0, 0, 0));
    }
    return at->second;
  };
  for (const ChainEdge& e : chain_boundary(to.points, part, weight))
    for (int k = 0; k < e.times; ++k) {
      const std::uint32_t a = foot(e.from), b = foot(e.to);
      for (const std::array<std::uint32_t, 3>& corners : {std::array{e.to, e.from, a}, std::array{e.to, a, b}}) {
        to.mesh.triangles.push_back(corners);
        to.mesh.materials.push_back(material[e.triangle]);
        if (!to.mesh.uv_corners.empty()) to.mesh.uv_corners.push_back({kNoIndex, kNoIndex, kNoIndex});
        to.turn.push_back(1);
        to.winding.push_back(1);
      }
    }
}

}  // namespace

Scene repeat_scene(const Scene& scene, const std::array<bool, 3>& cyclic, Plan& plan, Report& report) {
  const Mesh& mesh = scene.mesh;
  const Repeater repeater{scene, cyclic, plan};
  const std::size_t given = mesh.triangles.size() - mesh.made;

  std::map<Shift, std::vector<std::uint32_t>> copies;
  std::vector<std::uint32_t> own;            // those that stay where they are
  std::int64_t total = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t >= given) {
      own.push_back(t);
      continue;
    }
    const std::array<Shifts, 3> range = repeater.shifts(t);
    double count = 1;
    for (const Shifts& s : range) count *= static_cast<double>(std::max<std::int64_t>(0, s.last - s.first + 1));
    if (!(static_cast<double>(total) + count <= static_cast<double>(kMostTriangles)))
      throw Error(Code::kBadInput, "--cyclic", "the scene reaches so many periods far that over 200 million triangles would lie in one", "choose a larger --box");
    total += static_cast<std::int64_t>(count);
    for (std::int64_t z = range[2].first; z <= range[2].last; ++z)
      for (std::int64_t y = range[1].first; y <= range[1].last; ++y)
        for (std::int64_t x = range[0].first; x <= range[0].last; ++x) {
          if (x == 0 && y == 0 && z == 0) own.push_back(t);
          else copies[{z, y, x}].push_back(t);
        }
  }

  Repeated all;
  all.mesh.points = mesh.points;             // what no triangle needs any more does no harm
  all.mesh.uvs = mesh.uvs;
  all.mesh.colors = mesh.colors;
  all.mesh.normals = mesh.normals;
  all.points = plan.points;
  for (const std::uint32_t t : own) add_triangle(scene, plan, t, mesh.triangles[t], all);
  std::vector<std::uint32_t> place(mesh.points.size(), kNoIndex);
  for (const auto& [shift, triangles] : copies) add_copies(scene, plan, shift, triangles, place, all);
  const std::size_t surface = all.mesh.triangles.size();
  for (int axis = 0; axis < 3; ++axis)
    if (std::find(all.bounded.begin(), all.bounded.end(), axis) != all.bounded.end()) hang_curtains(plan, axis, all);

  Scene repeated = scene;
  repeated.mesh = std::move(all.mesh);
  plan.points = std::move(all.points);
  plan.turn = std::move(all.turn);
  plan.winding = std::move(all.winding);
  plan.body.clear();
  plan.curtains = repeated.mesh.triangles.size() - surface;
  report.count("repeated triangles", static_cast<double>(surface) - static_cast<double>(own.size()));
  return repeated;
}

Scene repeat_scene(const Scene& scene, const Grid& grid, const std::array<bool, 3>& cyclic) {
  Plan plan;
  plan.grid = grid;
  for (const V3d& p : scene.mesh.points) plan.points.push_back(grid.to_voxel(p));
  plan.turn.assign(scene.mesh.triangles.size(), 1);
  plan.winding.assign(scene.mesh.triangles.size(), 0);
  Report unheard;
  return repeat_scene(scene, cyclic, plan, unheard);
}

Scene without_curtains(Scene repeated, const Plan& plan) {
  const std::size_t left = repeated.mesh.triangles.size() - plan.curtains;
  repeated.mesh.triangles.resize(left);
  repeated.mesh.materials.resize(left);
  if (!repeated.mesh.uv_corners.empty()) repeated.mesh.uv_corners.resize(left);
  return repeated;
}

}  // namespace texel
