#include "bake/plan.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "bake/bake.h"
#include "bake/nesting.h"
#include "bake/topology.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr double kFlat = 1e-13;            // of Topology::Component::volume_terms: above the rounding of a volume, below any slab or needle worth a fill
constexpr double kWallSnap = 0x1p-30;      // voxels; far above double rounding at 4096 voxels, far below any feature

// Triangles that were given, rather than made of implicit surfaces.
std::size_t given_triangles(const Mesh& mesh) { return mesh.triangles.size() - mesh.made; }

// What is known of the closed components that take part.
struct Solids {
  std::vector<std::int8_t> sense;  // what each is multiplied by: −1 where it is inside out
  std::vector<std::int8_t> adds;   // 1: matter where there was none, −1: a cavity, 0: matter within matter
};

// Outermost components face outwards. One that lies in another keeps its sense relative to it: opposite, it is a cavity, or matter in a cavity; where there is no matter
// around it that it could take away, it is inside out itself.
Solids turn_inside_out(std::span<const std::array<std::uint32_t, 3>> given, const V3i& period, const Plan& plan, const Topology& topology, std::span<const Box3d> boxes, const std::vector<bool>& takes_part, Report& report) {
  const auto& parts = topology.components;
  const Nesting nesting = find_nesting(plan.points, given, topology, boxes, takes_part, period);
  Solids solids;
  solids.sense.assign(parts.size(), 1);
  solids.adds.assign(parts.size(), 0);
  std::vector<int> winding(parts.size(), 0);  // within each
  std::int64_t turned = 0, cavities = 0;
  for (const std::uint32_t c : nesting.order) {
    const std::uint32_t o = nesting.container[c];
    const int around = o == kNoIndex ? 0 : winding[o], sign = parts[c].volume < 0 ? -1 : 1;
    std::int8_t& sense = solids.sense[c];
    if (o != kNoIndex) sense = solids.sense[o];
    if (around + sense * sign < 0) sense = static_cast<std::int8_t>(-sense);
    winding[c] = around + sense * sign;
    solids.adds[c] = static_cast<std::int8_t>((winding[c] != 0) - (around != 0));
    turned += sense < 0;
    cavities += solids.adds[c] < 0;
  }
  if (turned > 0) report.issue("mesh-inside-out", "closed components are inside out; their faces were turned", turned);
  report.count("cavities", static_cast<double>(cavities));
  return solids;
}

// Triangles made of implicit surfaces are closed and turned outwards by construction.
void fill_made(const Mesh& mesh, const std::vector<Material>& materials, Plan& plan, Report& report) {
  for (std::size_t t = given_triangles(mesh); t < mesh.triangles.size(); ++t)
    if (!(materials[mesh.materials[t]].opacity < 1)) {
      plan.winding[t] = 1;
      plan.fill = true;
    }
  report.skip("components of " + std::to_string(mesh.made) + " triangles", "made of implicit surfaces: solid by construction");
}

// Area and volume of what was made of implicit surfaces, as far as it lies in the grid: their triangles do not cross its walls, and go on
// beyond them only to close what the box cuts.
void measure_made(const Mesh& mesh, Plan& plan, double* area, double* volume) {
  const V3d n(plan.grid.n);
  for (std::size_t t = given_triangles(mesh); t < mesh.triangles.size(); ++t) {
    const auto& c = mesh.triangles[t];
    const V3d &p = plan.points[c[0]], &q = plan.points[c[1]], &r = plan.points[c[2]];
    const V3d middle = (p + q + r) / 3.0, normal = (q - p).cross(r - p) / 2.0;
    if (middle.x < 0 || middle.y < 0 || middle.x > n.x || middle.y > n.y) continue;
    // Divergence theorem for the field (0, 0, z): what lies above the grid stands for the share of its upper wall that is inside.
    *volume += normal.z * std::clamp(middle.z, 0.0, n.z);
    if (middle.z >= 0 && middle.z <= n.z) *area += normal.length();
  }
}

V3i period_of(const Grid& grid, const Recipe& recipe) {
  return {recipe.cyclic[0] ? grid.n.x : 0, recipe.cyclic[1] ? grid.n.y : 0, recipe.cyclic[2] ? grid.n.z : 0};
}

// Components that need their repetitions to be closed.
void close_repeated(const V3i& period, std::span<const std::array<std::uint32_t, 3>> given, Plan& plan, Topology& topology, Report& report) {
  const StillOpen left = close_over_period(period, plan.points, given, topology);
  if (left.sheets > 0)
    report.issue("cyclic-sheet", "sheets repeat without end but are the side of nothing; they are surfaces without an inside (an underside makes a slab)", left.sheets);
  if (left.endless > 0)
    report.issue("cyclic-endless", "components are joined to their repetitions along every axis, so that inside and outside cannot be told; they are surfaces without an inside", left.endless);
}

// Sets turn and winding of the mesh's triangles, of which plan.points are the points, and what the solids add to the statistics.
void find_solids(const Mesh& mesh, const std::vector<Material>& materials, const Recipe& recipe, Plan& plan, Report& report) {
  if (mesh.made > 0) fill_made(mesh, materials, plan, report);
  if (given_triangles(mesh) == 0) return;
  const auto given = std::span(mesh.triangles).first(given_triangles(mesh));
  Topology topology = find_topology(plan.points, given);
  const V3i period = period_of(plan.grid, recipe);
  if (period != V3i(0, 0, 0)) close_repeated(period, given, plan, topology, report);
  std::vector<bool> takes_part(topology.components.size());
  std::vector<bool> transparent(topology.components.size(), false);
  for (std::size_t t = 0; t < topology.component.size(); ++t)
    if (topology.component[t] != kNoIndex && materials[mesh.materials[t]].opacity < 1) transparent[topology.component[t]] = true;

  std::vector<Box3d> boxes(topology.components.size());
  for (std::size_t t = 0; t < topology.component.size(); ++t)
    if (topology.component[t] != kNoIndex)
      for (const std::uint32_t v : mesh.triangles[t]) boxes[topology.component[t]].extendBy(plan.points[v]);

  Statistics& s = plan.statistics;
  std::int64_t open = 0, open_edges = 0, glass = 0, flipped = 0, flat = 0;
  for (std::size_t c = 0; c < topology.components.size(); ++c) {
    const Topology::Component& part = topology.components[c];
    // A sheet modelled twice, back to back, is closed too, but holds nothing: it stays surface.
    const bool holds = std::abs(part.volume) > kFlat * (part.bounded >= 0 ? std::pow(boxes[c].size().length(), 3) : part.volume_terms);
    flat += part.closed && !holds;
    takes_part[c] = part.closed && !transparent[c] && holds;
    s.closed += part.closed;
    open += !part.closed;
    open_edges += part.open_edges;
    glass += part.closed && transparent[c];
    if (part.closed) flipped += part.turned;
  }
  s.components += static_cast<std::int64_t>(topology.components.size());
  if (open > 0)
    report.issue("mesh-open", "components have open edges (" + std::to_string(open_edges) + " in all); they are surfaces without an inside", open);
  if (flipped > 0) report.issue("mesh-flipped", "faces were turned the other way than their neighbours; they were turned back", flipped);
  if (glass > 0) report.skip("fill of " + std::to_string(glass) + " components", "transparent");

  if (flat > 0) report.skip("fill of " + std::to_string(flat) + " components", "closed without volume");

  const Solids solids = turn_inside_out(given, period, plan, topology, boxes, takes_part, report);
  for (std::size_t t = 0; t < topology.component.size(); ++t) {
    const std::uint32_t c = topology.component[t];
    if (c == kNoIndex || !topology.components[c].closed) continue;
    plan.turn[t] = static_cast<std::int8_t>(topology.turn[t] * solids.sense[c]);
    if (takes_part[c]) { plan.winding[t] = 1; plan.fill = true; }
  }
  const double cell = plan.grid.h * plan.grid.h * plan.grid.h;
  for (std::size_t c = 0; c < topology.components.size(); ++c) s.volume += solids.adds[c] * std::abs(topology.components[c].volume) * cell;
  if (period != V3i(0, 0, 0)) {
    plan.body.assign(mesh.triangles.size(), kNoIndex);
    for (std::size_t t = 0; t < topology.component.size(); ++t)
      if (plan.winding[t] != 0) plan.body[t] = topology.component[t];
    const int straight = period.z == 0 ? 2 : period.y == 0 ? 1 : period.x == 0 ? 0 : 2;  // of what is closed by itself any axis will do
    for (std::size_t c = 0; c < topology.components.size(); ++c)
      plan.bodies.push_back({boxes[c], topology.components[c].bounded >= 0 ? topology.components[c].bounded : straight});
  }
}

}  // namespace

V3d plan_point(const Grid& grid, const V3d& world) {
  V3d p = grid.to_voxel(world);
  for (int a = 0; a < 3; ++a)
    if (const double wall = std::nearbyint(p[a]); std::abs(p[a] - wall) < kWallSnap) p[a] = wall;
  return p;
}

Statistics find_shape_solids(const Mesh& shape, const std::vector<Material>& materials, const Recipe& recipe, std::vector<std::int8_t>& turn, std::vector<std::int8_t>& winding, Report& report) {
  Plan own;
  own.turn.assign(shape.triangles.size(), 1);
  own.winding.assign(shape.triangles.size(), 0);
  if (recipe.fill != Fill::kOff) {
    own.points = shape.points;  // in a grid of edge 1 about its own origin
    Report found;
    find_solids(shape, materials, recipe, own, found);
    for (const Issue& issue : found.issues) report.issue(issue.id, issue.text, issue.count, issue.where);
    for (const Skip& skip : found.skipped)
      if (std::none_of(report.skipped.begin(), report.skipped.end(), [&](const Skip& s) { return s.what == skip.what && s.why == skip.why; })) report.skip(skip.what, skip.why);
  }
  turn = std::move(own.turn);
  winding = std::move(own.winding);
  return own.statistics;
}

V3d triangle_normal(const V3d& a, const V3d& b, const V3d& c, double* area) {
  const V3d cross = (b - a).cross(c - a);
  const double length = cross.length();
  if (area) *area = length / 2;
  return length > 0 ? cross / length : V3d(0, 0, 0);
}

Plan make_plan(const Scene& scene, const Recipe& recipe, const std::vector<bool>& has_cutouts, Report& report) {
  const Mesh& mesh = scene.mesh;
  Plan plan;
  plan.grid = plan_grid(scene, recipe);
  plan.points.resize(mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) plan.points[i] = plan_point(plan.grid, mesh.points[i]);
  plan.turn.assign(mesh.triangles.size(), 1);
  plan.winding.assign(mesh.triangles.size(), 0);
  for (std::size_t m = 0; m < scene.materials.size(); ++m)
    plan.two_sided.push_back(recipe.two_sided == Sidedness::kAlways || (recipe.two_sided == Sidedness::kAuto && has_cutouts[m]));
  for (const Material& material : scene.materials) plan.two_sided_open.push_back(recipe.two_sided == Sidedness::kAuto && material.two_sided);

  Statistics& s = plan.statistics;
  s.triangles = static_cast<std::int64_t>(mesh.triangles.size());
  double area_voxels = 0;
  for (std::size_t i = 0; i < given_triangles(mesh); ++i) {
    const auto& t = mesh.triangles[i];
    double area = 0;
    (void)triangle_normal(plan.points[t[0]], plan.points[t[1]], plan.points[t[2]], &area);
    area_voxels += area;
    s.degenerate += !(area > 0);
  }
  double made_volume = 0;
  measure_made(mesh, plan, &area_voxels, &made_volume);
  if (scene.fibres.strands() > 0) {
    plan.fibres = fibre_segments(scene, plan.grid);
    area_voxels += fibre_area(scene.fibres) / (plan.grid.h * plan.grid.h);
  }
  s.area = area_voxels * plan.grid.h * plan.grid.h;
  if (recipe.fill == Fill::kOff) report.skip("components, fill", "--fill off");
  else find_solids(mesh, scene.materials, recipe, plan, report);
  if (mesh.made > 0) {
    s.components += static_cast<std::int64_t>(scene.implicits.size());
    s.closed += static_cast<std::int64_t>(scene.implicits.size());
    if (plan.fill) s.volume += made_volume * plan.grid.h * plan.grid.h * plan.grid.h;
  }
  plan_instances(scene, recipe, plan, report);
  if (!(s.area > 0)) throw Error(Code::kBadInput, "", "no triangle has an area", "check the input file");
  if (s.degenerate > 0) report.issue("degenerate-triangles", "triangles have no area; they change nothing", s.degenerate);
  if (!plan.fill && recipe.fill != Fill::kOff) {
    if (recipe.fill == Fill::kOn) throw Error(Code::kBadInput, "--fill on", "no component is closed and opaque", "use --fill auto or close the mesh");
    if (given_triangles(mesh) + plan.placed.size() > 0) report.skip("fill", "no closed component");
  }
  return plan;
}

}  // namespace texel
