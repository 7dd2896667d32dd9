#include "bake/shape_sums.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "bake/plan.h"
#include "bake/texture.h"

namespace texel {
namespace {

// What one triangle adds.
struct Part {
  V3d vector{0, 0, 0};     // A n, turned, of all of it
  V3d middle{0, 0, 0};
  double area = 0, coverage = 1;
  V3f color{0, 0, 0};
  std::uint32_t material = 0;
  bool closed = false, gathered = false;
};

V3d corner(const Mesh& mesh, std::uint32_t triangle, int i) { return mesh.points[mesh.triangles[triangle][static_cast<std::size_t>(i)]]; }

Part part_of(const Scene& scene, const Mesh& mesh, const ShapeTree& tree, const TextureSet& textures, bool color, std::uint32_t t) {
  Part p;
  const V3d a = corner(mesh, t, 0), b = corner(mesh, t, 1), c = corner(mesh, t, 2);
  p.vector = (b - a).cross(c - a) * (0.5 * static_cast<double>(tree.turn[t]));
  p.area = p.vector.length();
  p.middle = (a + b + c) / 3.0;
  p.material = mesh.materials[t];
  p.closed = tree.winding[t] != 0;
  const bool holes = textures.has_cutouts(p.material);
  p.gathered = !scene.materials[p.material].solid && !(holes && p.closed);
  p.color = scene.materials[p.material].kd;
  if (holes || (color && (textures.textured(p.material) || !mesh.colors.empty()))) {
    // As a triangle that lies in one voxel is integrated: once, at its middle, over its own width.
    const float width = tree.uv_width.empty() ? 0 : tree.uv_width[t] * static_cast<float>(std::sqrt(p.area));
    const SurfaceSample s = footprint_sample(textures, mesh, t, 1.0 / 3, 1.0 / 3, width);
    p.color = s.color;
    p.coverage = static_cast<double>(s.coverage);
  }
  return p;
}

void add_part(const Part& p, ShapeSums::Group& g) {
  if (!(p.area > 0)) return;
  const double w = p.area * p.coverage;
  g.area += p.area;
  g.covered += w;
  g.vector += p.vector * p.coverage;
  add_outer(g, p.vector, p.coverage / p.area);
  for (int r = 0; r < 3 && p.closed; ++r)
    for (int c = 0; c < 3; ++c) g.place[static_cast<std::size_t>(3 * r + c)] += p.vector[r] * p.middle[c];
  g.color += V3d(p.color) * w;
}

// Where a direction lies on an octahedron unfolded to a square of kSide × kSide.
constexpr int kSide = 128;
int direction_bin(const V3d& a) {
  const double sum = std::abs(a.x) + std::abs(a.y) + std::abs(a.z);
  if (!(sum > 0)) return 0;
  double x = a.x / sum, y = a.y / sum;
  if (a.z < 0) {
    const double fold = (1 - std::abs(y)) * (x < 0 ? -1 : 1);
    y = (1 - std::abs(x)) * (y < 0 ? -1 : 1);
    x = fold;
  }
  const auto at = [](double v) { return std::clamp(static_cast<int>((v + 1) / 2 * kSide), 0, kSide - 1); };
  return at(y) * kSide + at(x);
}

void gather_node(const ShapeTree& tree, std::uint32_t at, const std::vector<Part>& parts, ShapeSums& sums) {
  const ShapeNode& node = tree.nodes[at];
  ShapeSums::Node& own = sums.nodes[at];
  if (node.count < kLeastGathered) return;
  std::map<std::pair<std::uint32_t, bool>, ShapeSums::Group> groups;
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
    const Part& p = parts[i];
    if (!p.gathered) return;
    ShapeSums::Group& g = groups[{p.material, p.closed}];
    g.material = p.material;
    g.closed = p.closed;
    add_part(p, g);
  }
  own.group = static_cast<std::uint32_t>(sums.groups.size());
  own.groups = static_cast<std::uint32_t>(groups.size());
  for (const auto& entry : groups) sums.groups.push_back(entry.second);
  own.vector = node.first;
  own.vectors = node.count;
  if (node.count <= kMostVectors) return;
  std::map<int, V3d> bins;
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) 
    bins.try_emplace(direction_bin(parts[i].vector) * 2 + (parts[i].closed ? 1 : 0), V3d(0, 0, 0)).first->second += parts[i].vector * parts[i].coverage;
  own.vector = sums.vectors.size();
  own.vectors = bins.size();
  for (const auto& [bin, vector] : bins) sums.vectors.push_back({vector, bin % 2 == 1});
}

}  // namespace

std::vector<ShapeSums> sum_shapes(const Scene& scene, const Plan& plan, const TextureSet& textures, bool color) {
  std::vector<ShapeSums> all(plan.shapes.size());
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t s) {
    const ShapeTree& tree = plan.shapes[s];
    std::vector<Part> parts;
    parts.reserve(tree.order.size());
    for (const std::uint32_t t : tree.order) parts.push_back(part_of(scene, scene.shapes[s], tree, textures, color, t));
    for (const Part& p : parts) all[s].vectors.push_back({p.vector * p.coverage, p.closed});
    all[s].nodes.resize(tree.nodes.size());
    for (std::uint32_t n = 0; n < tree.nodes.size(); ++n) gather_node(tree, n, parts, all[s]);
  });
  return all;
}

void add_group(const ShapeSums::Group& group, const Placed& placed, bool one_sided, int cell_z, Areas& areas, Moments* moments, double& covered, V3d& color) {
  const std::array<double, 9>& m = placed.turn;
  const auto turned = [&](const V3d& v) { return V3d(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z, m[6] * v.x + m[7] * v.y + m[8] * v.z); };
  const double s = placed.scale, ss = s * s;
  const V3d vector = turned(group.vector) * s;  // Σ A n: turned, and grown by s² of which `turn` holds one s
  covered = group.covered * ss;
  color = group.color * ss;
  areas.area += group.area * ss;
  areas.covered += covered;
  if (group.closed) {
    areas.outward += vector;
    // Σ A n_z (cell + 1 − z) with z = m_z·c + move_z.
    double lever = 0;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) lever += m[6 + r] * group.place[3 * r + c] * m[6 + c];
    areas.lost += vector.z * (cell_z + 1 - placed.move.z) - s * lever;
  }
  if (!moments) return;
  // M S Mᵀ, M = s times the turn.
  const double in[3][3] = {{group.xx, group.xy, group.xz}, {group.xy, group.yy, group.yz}, {group.xz, group.yz, group.zz}};
  double half[3][3] = {}, out[3][3] = {};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) half[r][c] += m[3 * r + k] * in[k][c];
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) out[r][c] += half[r][k] * m[3 * c + k];
  moments->covered += covered;
  if (one_sided) moments->m += vector;
  moments->xx += out[0][0]; moments->yy += out[1][1]; moments->zz += out[2][2];
  moments->xy += out[0][1]; moments->xz += out[0][2]; moments->yz += out[1][2];
}

void add_shadows(const ShapeSums& sums, const ShapeSums::Node& node, const Placed& placed, Areas& areas) {
  const std::array<double, 9>& m = placed.turn;
  V3d crossings(0, 0, 0), stopping(0, 0, 0);
  for (std::uint64_t i = node.vector; i < node.vector + node.vectors; ++i) {
    const ShapeSums::Vector& v = sums.vectors[i];
    const V3d a(m[0] * v.a.x + m[1] * v.a.y + m[2] * v.a.z, m[3] * v.a.x + m[4] * v.a.y + m[5] * v.a.z, m[6] * v.a.x + m[7] * v.a.y + m[8] * v.a.z);
    const V3d across(std::abs(a.x), std::abs(a.y), std::abs(a.z));
    crossings += across;
    // Closed surface stops a ray where it enters: half of |a| − a.
    stopping += v.closed ? (across - a) / 2.0 : across;
  }
  areas.crossings += crossings * placed.scale;
  areas.stopping += stopping * placed.scale;
}

}  // namespace texel
