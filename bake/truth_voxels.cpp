#include "bake/truth_voxels.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>

#include "bake/bake.h"
#include "bake/crossings.h"
#include "bake/fibre_tubes.h"
#include "bake/height_mesh.h"
#include "bake/ndf_fits.h"
#include "bake/polygonize.h"
#include "bake/repeat.h"
#include "bake/repeat_functions.h"
#include "formats/error.h"
#include "formats/instances.h"
#include "formats/random.h"

namespace texel {
namespace {

constexpr std::size_t kMostVisits = 100'000'000;  // triangles a level's voxels look at: 8 bytes each
constexpr int kFibreSides = 48;                   // facets that stand for a fibre's wall: shadows to (π/48)²/6 < 1e-3
constexpr double kSamplesAFace = 256;             // points at which colour is taken in a level-0 face's worth of surface

std::uint64_t hash_of(const V3i& v, std::uint64_t seed) {
  return mix_bits(static_cast<std::uint64_t>(v.x) ^ mix_bits(static_cast<std::uint64_t>(v.y) ^ mix_bits(static_cast<std::uint64_t>(v.z) ^ mix_bits(seed))));
}

// A convex polygon under Sutherland and Hodgman's cuts.
struct Piece {
  std::array<V3d, 16> v;
  int n = 0;
};
// The part on the side of x[axis] = wall where sign·(x − wall) >= 0.
void cut(Piece& p, int axis, double wall, double sign) {
  Piece out;
  for (int i = 0; i < p.n; ++i) {
    const V3d &a = p.v[static_cast<std::size_t>(i)], &b = p.v[static_cast<std::size_t>((i + 1) % p.n)];
    const double da = sign * (a[axis] - wall), db = sign * (b[axis] - wall);
    if (da >= 0) out.v[static_cast<std::size_t>(out.n++)] = a;
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
      V3d cross = a + (b - a) * (da / (da - db));
      cross[axis] = wall;
      out.v[static_cast<std::size_t>(out.n++)] = cross;
    }
    if (out.n > 14) break;
  }
  p = out;
}

// The cell that surface lying in the wall x = `wall` belongs to: the one behind closed surface, the one before open surface.
int cell_of_wall(double wall, double normal, bool closed) {
  const int cell = static_cast<int>(wall);
  return (normal > 0) == closed ? cell - 1 : cell;
}

struct Voxel {
  V3i lo, hi;   // cells of level 0
};

struct Truth {
  const TruthScene& of;
  const TruthOptions& options;
  int level;
  double share;  // faces of level 0 in one of this level

  [[nodiscard]] Face face_of(std::uint64_t id) const {
    const std::size_t triangles = of.scene.mesh.triangles.size();
    if (id < triangles) return mesh_face(of.scene, of.plan, static_cast<std::uint32_t>(id));
    std::uint32_t triangle = 0;
    const Placed& placed = find_placed(of.plan, id - triangles, &triangle);
    return placed_face(of.scene, of.plan, placed, triangle);
  }
  void add_normal(const V3d& n, double area, VoxelTruth& to) const {
    for (std::size_t i = 0; i < options.directions.size(); ++i) to.sigma[i] += area * std::abs(n.dot(options.directions[i]));
    if (options.bins) to.bins[static_cast<std::size_t>(normal_bin(n))] += area;
  }
  void add_face(const Face& face, const Voxel& voxel, VoxelTruth& to, V3d& color) const;
  void add_fibre_part(const FibreSegment& fibre, double s0, double s1, VoxelTruth& to, V3d& color) const;
  [[nodiscard]] V3f color_at(const Face& face, const V3d& normal, double b1, double b2, double width) const;
  [[nodiscard]] V3f fibre_color(const FibreSegment& fibre, double s, double width) const;
  void trace(int axis, const Voxel& voxel, std::span<const std::uint64_t> faces, std::span<const std::uint32_t> fibres, VoxelTruth& to) const;
};

void Truth::add_face(const Face& face, const Voxel& voxel, VoxelTruth& to, V3d& color) const {
  const V3d &a = face.p[0], &b = face.p[1], &c = face.p[2];
  const V3d cross = (b - a).cross(c - a);
  const double square = cross.length2();
  if (!(square > 0) || !std::isfinite(square)) return;
  const V3d normal = cross / std::sqrt(square) * static_cast<double>(face.turn);
  Piece p;
  p.n = 3;
  for (std::size_t i = 0; i < 3; ++i) p.v[i] = face.p[i];
  for (int k = 0; k < 3; ++k) {
    const double lo = std::min({a[k], b[k], c[k]}), hi = std::max({a[k], b[k], c[k]});
    if (lo == hi && lo == std::floor(lo)) {
      const int cell = cell_of_wall(lo, normal[k], face.winding != 0);
      if (cell < voxel.lo[k] || cell >= voxel.hi[k]) return;
      continue;
    }
    if (lo < voxel.lo[k]) cut(p, k, voxel.lo[k], 1);
    if (hi > voxel.hi[k]) cut(p, k, voxel.hi[k], -1);
    if (p.n < 3) return;
  }
  const bool one_sided = !of.plan.is_two_sided(face.winding, face.material);
  const Material& material = of.scene.materials[face.material];
  const Mesh& mesh = *face.mesh;
  const bool bent = !mesh.normals.empty();
  const bool sampled = of.textures.has_cutouts(face.material) || bent || (options.color && (of.textures.textured(face.material) || !mesh.colors.empty() || material.solid));
  const V3d g1 = (c - a).cross(cross) / square, g2 = cross.cross(b - a) / square;
  for (int i = 1; i + 1 < p.n; ++i) {
    const V3d &q0 = p.v[0], &q1 = p.v[static_cast<std::size_t>(i)], &q2 = p.v[static_cast<std::size_t>(i + 1)];
    const double area = (q1 - q0).cross(q2 - q0).length() / (2 * share);
    if (!(area > 0)) continue;
    to.area += area;
    if (!sampled) {
      to.moments.add(normal, area, one_sided);
      to.material.add(material, area);
      add_normal(normal, area, to);
      color += V3d(material.kd) * area;
      continue;
    }
    const int points = std::clamp(static_cast<int>(std::ceil(area * share * kSamplesAFace)), 1, 1024);
    // Turned at random: of a piece that gets one point alone any place is as likely.
    const std::uint64_t turn = hash_of(to.at, mix_bits(face.triangle) + static_cast<unsigned>(i));
    const double turn_u = unit_of(turn), turn_v = unit_of(mix_bits(turn));
    const double part = area / points, width = std::sqrt(part * share) * of.plan.grid.h;
    for (int k = 0; k < points; ++k) {
      // Roberts' R2 sequence, folded into the triangle.
      double u = std::fmod(turn_u + k * 0.7548776662466927, 1.0), v = std::fmod(turn_v + k * 0.5698402909980532, 1.0);
      if (u + v > 1) {
        u = 1 - u;
        v = 1 - v;
      }
      const V3d at = q0 + (q1 - q0) * u + (q2 - q0) * v;
      const double b1 = (at - a).dot(g1), b2 = (at - a).dot(g2);
      SurfaceSample s = footprint_sample(of.textures, mesh, face.triangle, b1, b2, face.uv_width * static_cast<float>(width));
      if (material.solid) s.color = material.solid->color(of.plan.grid.to_world(at), normal, width);
      V3d n = normal;
      if (bent) {
        const auto& corner = mesh.triangles[face.triangle];
        const V3d n0(mesh.normals[corner[0]]), n1(mesh.normals[corner[1]]), n2(mesh.normals[corner[2]]);
        const V3d mean = n0 * (1 - b1 - b2) + n1 * b1 + n2 * b2;
        if (n0.length2() > 0 && n1.length2() > 0 && n2.length2() > 0 && mean.length2() > 0.25) n = mean.normalized();
      }
      const double w = part * static_cast<double>(s.coverage);
      to.moments.add(n, w, one_sided);
      to.material.add(material, w);
      add_normal(n, w, to);
      color += V3d(s.color) * w;
    }
  }
}

void Truth::add_fibre_part(const FibreSegment& fibre, double s0, double s1, VoxelTruth& to, V3d& color) const {
  const FibreShape shape = fibre_shape(fibre);
  Areas areas;
  Moments moments;
  add_fibre(fibre, shape, s0, s1, !of.plan.two_sided[fibre.material], areas, &moments);
  to.area += areas.area / share;
  to.moments.add(moments, 1 / share);
  to.material.add(of.scene.materials[fibre.material], areas.covered / share);
  color += V3d(fibre_color(fibre, (s0 + s1) / 2, (s1 - s0) * shape.length)) * (areas.covered / share);
  V3d side = shape.t.cross(std::abs(shape.t.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0));
  if (!(side.length() > 0)) return;
  side.normalize();
  const V3d other = shape.t.cross(side);
  for (int i = 0; i < kFibreSides; ++i) {
    const double phi = 2 * M_PI * (i + 0.5) / kFibreSides;
    const V3d n = (side * std::cos(phi) + other * std::sin(phi) + shape.t * shape.taper).normalized();
    add_normal(n, areas.covered / share / kFibreSides, to);
  }
}

// Widths in voxels of level 0.
V3f Truth::color_at(const Face& face, const V3d& normal, double b1, double b2, double width) const {
  const Material& material = of.scene.materials[face.material];
  if (material.solid) return material.solid->color(of.plan.grid.to_world(face.p[0] + (face.p[1] - face.p[0]) * b1 + (face.p[2] - face.p[0]) * b2), normal, width * of.plan.grid.h);
  return footprint_sample(of.textures, *face.mesh, face.triangle, b1, b2, face.uv_width * static_cast<float>(width * of.plan.grid.h)).color;
}
V3f Truth::fibre_color(const FibreSegment& fibre, double s, double width) const {
  const Material& material = of.scene.materials[fibre.material];
  V3f color = material.kd;
  if (material.solid) color = material.solid->color(of.plan.grid.to_world(fibre.a + (fibre.b - fibre.a) * s), V3d(0, 0, 1), width * of.plan.grid.h);
  if (const auto& colors = of.scene.fibres.colors; !colors.empty()) color *= colors[fibre.point] * static_cast<float>(1 - s) + colors[fibre.point + 1] * static_cast<float>(s);
  return color;
}

// What one ray meets within the voxel.
struct Met {
  double w;
  std::uint32_t ray;
  float coverage;
  std::int8_t winding;
  bool one_sided;
  V3d normal;
  const Material* material;
  V3f color;
};

void Truth::trace(int axis, const Voxel& voxel, std::span<const std::uint64_t> faces, std::span<const std::uint32_t> fibres, VoxelTruth& to) const {
  const BundleAxes ax = bundle_axes(axis);
  const int n = options.rays;
  const double edge = voxel.hi[ax.w] - voxel.lo[ax.w], step = edge / n, u0 = voxel.lo[ax.u], v0 = voxel.lo[ax.v], lo = voxel.lo[ax.w], hi = voxel.hi[ax.w];
  const auto rays = static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
  std::vector<double> ru(rays), rv(rays);
  const std::uint64_t base = hash_of(to.at, options.seed * 4ull + static_cast<unsigned>(axis) + 1);
  for (std::size_t i = 0; i < rays; ++i) {
    const std::uint64_t bits = mix_bits(base + i);
    ru[i] = u0 + (static_cast<double>(i % static_cast<std::size_t>(n)) + unit_of(bits)) * step;
    rv[i] = v0 + (static_cast<double>(i / static_cast<std::size_t>(n)) + unit_of(mix_bits(bits))) * step;
  }
  std::vector<int> before(rays, 0);
  std::vector<Met> met;
  const auto strata = [&](double low, double high, double origin, int& first, int& last) {
    first = static_cast<int>(std::clamp(std::floor((low - origin) / step), 0.0, static_cast<double>(n)));
    last = static_cast<int>(std::clamp(std::floor((high - origin) / step), -1.0, n - 1.0));
  };
  for (const std::uint64_t id : faces) {
    const Face f = face_of(id);
    const V3d &a = f.p[0], &b = f.p[1], &c = f.p[2];
    const V3d cross = (b - a).cross(c - a);
    const double square = cross.length2();
    if (!(square > 0) || cross[ax.w] == 0) continue;
    const V3d normal = cross / std::sqrt(square) * static_cast<double>(f.turn);
    double least = std::min({a[ax.w], b[ax.w], c[ax.w]});
    const double most = std::max({a[ax.w], b[ax.w], c[ax.w]});
    const bool flat = least == most && least == std::floor(least);
    if (flat) least = cell_of_wall(least, normal[ax.w], f.winding != 0) + 0.5;  // anywhere in the cell it belongs to; its depth is the wall
    const int winding = f.winding == 0 ? 0 : normal[ax.w] < 0 ? f.winding : -f.winding;
    int i0, i1, j0, j1;
    strata(std::min({a[ax.u], b[ax.u], c[ax.u]}), std::max({a[ax.u], b[ax.u], c[ax.u]}), u0, i0, i1);
    strata(std::min({a[ax.v], b[ax.v], c[ax.v]}), std::max({a[ax.v], b[ax.v], c[ax.v]}), v0, j0, j1);
    const bool cutouts = of.textures.has_cutouts(f.material);
    for (int j = j0; j <= j1; ++j)
      for (int i = i0; i <= i1; ++i) {
        const std::size_t ray = static_cast<std::size_t>(j) * static_cast<std::size_t>(n) + static_cast<std::size_t>(i);
        const double u = ru[ray], v = rv[ray];
        const double e0 = (b[ax.u] - a[ax.u]) * (v - a[ax.v]) - (b[ax.v] - a[ax.v]) * (u - a[ax.u]);
        const double e1 = (c[ax.u] - b[ax.u]) * (v - b[ax.v]) - (c[ax.v] - b[ax.v]) * (u - b[ax.u]);
        const double e2 = (a[ax.u] - c[ax.u]) * (v - c[ax.v]) - (a[ax.v] - c[ax.v]) * (u - c[ax.u]);
        if (!((e0 > 0 && e1 > 0 && e2 > 0) || (e0 < 0 && e1 < 0 && e2 < 0))) continue;
        const double sum = e0 + e1 + e2, depth = flat ? least : (e1 * a[ax.w] + e2 * b[ax.w] + e0 * c[ax.w]) / sum;
        if (depth >= hi) continue;
        if (depth < lo) {
          before[ray] += winding;
          continue;
        }
        const float coverage = cutouts ? of.textures.coverage(f.material, uv_at(*f.mesh, f.triangle, e2 / sum, e0 / sum), 0) : 1.0f;
        met.push_back({flat ? most : depth, static_cast<std::uint32_t>(ray), coverage, static_cast<std::int8_t>(winding), !of.plan.is_two_sided(f.winding, f.material), normal, &of.scene.materials[f.material],
                       options.visible_material ? color_at(f, normal, e2 / sum, e0 / sum, step) : V3f(0, 0, 0)});
      }
  }
  for (const std::uint32_t k : fibres) {
    const FibreSegment& f = of.plan.fibres[k];
    const FibreShape shape = fibre_shape(f);
    const FibreOutline o = fibre_outline(f, shape, axis, ax.u, ax.v);
    const double reach = std::max(f.ra, f.rb) * kTubeReach + std::max(o.before, o.behind);
    int i0, i1, j0, j1;
    strata(std::min(f.a[ax.u], f.b[ax.u]) - reach, std::max(f.a[ax.u], f.b[ax.u]) + reach, u0, i0, i1);
    strata(std::min(f.a[ax.v], f.b[ax.v]) - reach, std::max(f.a[ax.v], f.b[ax.v]) + reach, v0, j0, j1);
    const double sine = std::sqrt(std::max(1 - shape.t[ax.w] * shape.t[ax.w], 0.0));
    for (int j = j0; j <= j1; ++j)
      for (int i = i0; i <= i1; ++i) {
        const std::size_t ray = static_cast<std::size_t>(j) * static_cast<std::size_t>(n) + static_cast<std::size_t>(i);
        const double s = meet_outline(o, ru[ray], rv[ray]);
        if (s < 0) continue;
        const double radius = f.ra + (f.rb - f.ra) * s, across = (ru[ray] - o.u) * o.dv - (rv[ray] - o.v) * o.du;
        const double off = radius > 0 ? std::clamp(across / radius, -1.0, 1.0) : 0, rise = std::sqrt(1 - off * off);
        const double half = std::min(radius * rise / std::max(sine, 0.1), 8 * radius), middle = f.a[ax.w] + (f.b[ax.w] - f.a[ax.w]) * s;
        V3d flat(0, 0, 0), w(0, 0, 0);
        flat[ax.u] = o.dv;
        flat[ax.v] = -o.du;
        w[ax.w] = 1;
        const V3d up = sine > 1e-6 ? (w - shape.t * shape.t[ax.w]) / sine : w;
        for (const double side : {-1.0, 1.0})
          if (const double depth = middle + side * half; depth >= lo && depth < hi)
            met.push_back({depth, static_cast<std::uint32_t>(ray), 1, 0, false, flat * off + up * (side * rise), &of.scene.materials[f.material], options.visible_material ? fibre_color(f, s, step) : V3f(0, 0, 0)});
      }
  }
  std::sort(met.begin(), met.end(), [](const Met& x, const Met& y) { return x.ray != y.ray ? x.ray < y.ray : x.w != y.w ? x.w < y.w : x.winding > y.winding; });

  std::vector<double> stopped(rays), weight, clear;
  double inside_length = 0;
  std::size_t at = 0;
  for (std::size_t ray = 0; ray < rays; ++ray) {
    const std::size_t first = at;
    while (at < met.size() && met[at].ray == ray) ++at;
    int winding = before[ray];
    bool blocked = winding != 0;
    double open = 1, from = lo, front = winding == 0 ? 1 : 0, eye = front;  // eye: what materials' transparency lets pass, too
    weight.clear();
    clear.clear();
    for (std::size_t k = first; k < at; ++k) {
      const double cover = static_cast<double>(met[k].coverage);
      weight.push_back(front * cover);
      if (winding != 0) inside_length += met[k].w - from;
      from = met[k].w;
      winding += met[k].winding;
      blocked = blocked || winding != 0;
      open *= 1 - cover;
      front = winding != 0 ? 0 : front * (1 - cover);
      clear.push_back(eye * cover);
      eye = winding != 0 ? 0 : eye * (1 - cover * static_cast<double>(met[k].material->opacity));
    }
    if (winding != 0) inside_length += hi - from;
    stopped[ray] = blocked ? 1 : 1 - open;
    double back = winding == 0 ? 1 : 0;
    eye = back;
    for (std::size_t k = at; k-- > first;) {
      const Met& m = met[k];
      const double cover = static_cast<double>(m.coverage), seen = std::max(weight[k - first], back * cover);
      const double sum = std::abs(m.normal.x) + std::abs(m.normal.y) + std::abs(m.normal.z);
      if (seen > 0 && sum > 0) {
        const double area = seen / (sum * static_cast<double>(rays));
        to.visible.add(m.normal, area, m.one_sided);
        if (options.bins) to.visible_bins[static_cast<std::size_t>(normal_bin(m.normal))] += area;
      }
      if (options.visible_material && sum > 0) {
        const double area = (clear[k - first] + eye * cover) / (2 * sum * static_cast<double>(rays));
        to.seen.area += area;
        to.seen.color += V3d(m.color) * area;
        to.seen.material.add(*m.material, area);
      }
      winding -= m.winding;
      back = winding != 0 ? 0 : back * (1 - cover);
      eye = winding != 0 ? 0 : eye * (1 - cover * static_cast<double>(m.material->opacity));
    }
  }
  double sum = 0, pairs = 0;
  for (std::size_t i = 0; i + 1 < rays; i += 2) {
    sum += stopped[i] + stopped[i + 1];
    pairs += (stopped[i] - stopped[i + 1]) * (stopped[i] - stopped[i + 1]);
  }
  if (rays % 2) sum += stopped.back();
  const auto count = static_cast<double>(rays);
  to.alpha[static_cast<std::size_t>(axis)] = sum / count;
  to.noise[static_cast<std::size_t>(axis)] = pairs / (count * count);
  if (axis == 2) to.solid = inside_length / (count * edge);
}

// The sampled voxels of a level by the column they stand in along one axis.
struct Columns {
  BundleAxes ax;
  int nu, nv, level;
  std::span<const Voxel> voxels;
  std::vector<std::int32_t> head, next;

  Columns(int axis, int l, const V3i& n, std::span<const Voxel> all) : ax(bundle_axes(axis)), nu(n[ax.u]), nv(n[ax.v]), level(l), voxels(all), head(static_cast<std::size_t>(nu) * static_cast<std::size_t>(nv), -1), next(all.size(), -1) {
    for (std::size_t i = all.size(); i-- > 0;) {
      std::int32_t& h = head[place(all[i].lo[ax.u] >> l, all[i].lo[ax.v] >> l)];
      next[i] = h;
      h = static_cast<std::int32_t>(i);
    }
  }
  [[nodiscard]] std::size_t place(int u, int v) const { return static_cast<std::size_t>(v) * static_cast<std::size_t>(nu) + static_cast<std::size_t>(u); }
  // call(voxel's number) for those whose column the box may meet, walls included.
  template <class Call>
  void meet(const Box3d& box, Call&& call) const {
    const double edge = 1 << level;
    const auto range = [&](int k, int n, int& lo, int& hi) {
      lo = static_cast<int>(std::clamp(std::ceil(box.min[k] / edge) - 1, 0.0, static_cast<double>(n)));
      hi = static_cast<int>(std::clamp(std::floor(box.max[k] / edge), -1.0, n - 1.0));
    };
    int a0, a1, b0, b1;
    range(ax.u, nu, a0, a1);
    range(ax.v, nv, b0, b1);
    if (a0 > a1 || b0 > b1) return;
    if (static_cast<std::int64_t>(a1 - a0 + 1) * (b1 - b0 + 1) > static_cast<std::int64_t>(voxels.size())) {
      for (std::size_t i = 0; i < voxels.size(); ++i) {
        const int u = voxels[i].lo[ax.u] >> level, v = voxels[i].lo[ax.v] >> level;
        if (u >= a0 && u <= a1 && v >= b0 && v <= b1) call(i);
      }
      return;
    }
    for (int v = b0; v <= b1; ++v)
      for (int u = a0; u <= a1; ++u)
        for (std::int32_t i = head[place(u, v)]; i >= 0; i = next[static_cast<std::size_t>(i)]) call(static_cast<std::size_t>(i));
  }
};

Box3d box_of(const Face& f) {
  Box3d box;
  for (const V3d& p : f.p) box.extendBy(p);
  return box;
}

struct Lists {
  std::vector<std::array<std::vector<std::uint64_t>, 3>> faces;    // per voxel and axis
  std::vector<std::array<std::vector<std::uint32_t>, 3>> fibres;
  struct Part { std::uint32_t fibre; double s0, s1; };
  std::vector<std::vector<Part>> parts;                            // of fibres' axes in the voxel
  std::size_t visits = 0;
};

bool gather(const TruthScene& truth, int level, std::span<const Voxel> voxels, const V3i& n, bool rays, Lists& lists, Report& report) {
  const std::array<Columns, 3> columns{Columns(0, level, n, voxels), Columns(1, level, n, voxels), Columns(2, level, n, voxels)};
  lists.faces.resize(voxels.size());
  lists.fibres.resize(voxels.size());
  lists.parts.resize(voxels.size());
  const auto add = [&](const Face& f, std::uint64_t id) {
    const Box3d box = box_of(f);
    for (int axis = rays ? 0 : 2; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      columns[a].meet(box, [&](std::size_t i) {
        if (box.min[axis] > voxels[i].hi[axis] || (box.max[axis] < voxels[i].lo[axis] && (f.winding == 0 || !rays))) return;
        lists.faces[i][a].push_back(id);
        ++lists.visits;
      });
    }
  };
  const std::size_t triangles = truth.scene.mesh.triangles.size();
  for (std::uint32_t t = 0; t < triangles && lists.visits < kMostVisits; ++t) add(mesh_face(truth.scene, truth.plan, t), t);
  std::size_t done = 0;
  for (const Placed& placed : truth.plan.placed) {
    if (report.progress && ++done % 1024 == 0) report.progress("truth: instances", static_cast<double>(done) / static_cast<double>(truth.plan.placed.size()));
    if (lists.visits >= kMostVisits) break;
    walk_shape(truth.plan.shapes[placed.shape], [&](const ShapeNode& node) {
      if (lists.visits >= kMostVisits) return false;
      const Box3d box = placed_box(placed, node.box);
      for (int axis = rays ? 0 : 2; axis < 3; ++axis) {
        bool found = false;
        columns[static_cast<std::size_t>(axis)].meet(box, [&](std::size_t) { found = true; });
        if (found) return true;
      }
      return false;
    }, [&](std::uint32_t t, const std::array<V3d, 3>& corners) { add(placed_face(truth.scene, truth.plan, placed, t, corners), triangles + placed.first + t); });
  }
  for (std::uint32_t k = 0; k < truth.plan.fibres.size() && lists.visits < kMostVisits; ++k) {
    const FibreSegment& f = truth.plan.fibres[k];
    const double reach = std::max(f.ra, f.rb) * 2;
    Box3d box;
    for (const V3d& p : {f.a, f.b}) {
      box.extendBy(p - V3d(reach));
      box.extendBy(p + V3d(reach));
    }
    for (int axis = 0; axis < 3; ++axis)
      columns[static_cast<std::size_t>(axis)].meet(box, [&](std::size_t i) {
        if (box.min[axis] > voxels[i].hi[axis] || box.max[axis] < voxels[i].lo[axis]) return;
        lists.fibres[i][static_cast<std::size_t>(axis)].push_back(k);
        ++lists.visits;
      });
    bool any = false;
    columns[2].meet(box, [&](std::size_t) { any = true; });
    if (!any) continue;
    const V3i grid = truth.plan.grid.n;
    walk_fibre(f, V3i(0, 0, 0), grid, [&](const V3i& cell, double s0, double s1) {
      const V3i c(cell.x >> level, cell.y >> level, cell.z >> level);
      for (std::int32_t i = columns[2].head[columns[2].place(c.x, c.y)]; i >= 0; i = columns[2].next[static_cast<std::size_t>(i)])
        if (voxels[static_cast<std::size_t>(i)].lo.z >> level == c.z) lists.parts[static_cast<std::size_t>(i)].push_back({k, s0, s1});
    });
  }
  if (lists.visits < kMostVisits) return true;
  report.skip("truth of level " + std::to_string(level), "its voxels meet more than " + std::to_string(kMostVisits) + " triangles; look at fewer of them");
  return false;
}

}  // namespace

std::unique_ptr<TruthScene> make_truth_scene(const Scene& given, const Recipe& baked, const Grid& grid, Report& report) {
  if (given.hypertexture) throw Error(Code::kUnsupported, "", "a density has no surface to measure against", "compare the pack with one baked with more --samples");
  Recipe recipe = baked;
  recipe.box = grid.box();
  recipe.resolution = grid.n;
  recipe.voxel_size = 0;
  const bool cyclic = recipe.cyclic != std::array<bool, 3>{};
  Scene scene = !given.instances.empty() && cyclic ? flatten_instances(given) : given;
  if (cyclic && has_patterns(scene)) scene = repeat_patterns(scene, grid, recipe, report);
  const bool functions = !scene.implicits.empty() && scene.mesh.made == 0;
  if (!scene.heights.empty() || functions) scene = polygonize(mesh_heights(std::move(scene), recipe, report), recipe, report);
  if (scene.fibres.strands() > 0) scene = mesh_thick_fibres(std::move(scene), recipe, report);
  TextureSet textures(scene, TextureSet::Need::kColor, report);
  std::vector<bool> cutouts;
  for (std::uint32_t m = 0; m < scene.materials.size(); ++m) cutouts.push_back(textures.has_cutouts(m));
  Report unheard;  // of defects, which the bake told of already
  Plan plan = make_plan(scene, recipe, cutouts, unheard);
  if (plan.grid.n != grid.n || std::abs(plan.grid.h - grid.h) > 1e-9 * grid.h)
    throw Error(Code::kBadInput, "", "the scene cannot be laid on the pack's grid", "name the scene the pack was baked from");
  Box3d bounds = surface_bounds(scene);
  if (scene.fibres.strands() > 0) bounds.extendBy(fibre_bounds(scene.fibres));
  const Box3d box = grid.box();
  bool whole = !cyclic && !bounds.isEmpty();
  for (int k = 0; k < 3 && whole; ++k) whole = bounds.min[k] >= box.min[k] && bounds.max[k] <= box.max[k];
  if (cyclic) {
    Scene repeated = repeat_scene(scene, recipe.cyclic, plan, report);
    if (!plan.fibres.empty()) {
      repeated.fibres = repeat_fibres(scene.fibres, plan.grid, recipe.cyclic);
      plan.fibres = fibre_segments(repeated, plan.grid);
    }
    scene = std::move(repeated);
  }
  plan.uv_width = uv_widths(textures, scene.mesh);
  for (std::size_t i = 0; i < plan.shapes.size(); ++i) plan.shapes[i].uv_width = uv_widths(textures, scene.shapes[i]);
  return std::make_unique<TruthScene>(TruthScene{std::move(scene), std::move(textures), std::move(plan), whole});
}

std::vector<V3i> sample_voxels(std::vector<V3i> voxels, std::int64_t most, std::uint32_t seed) {
  const auto less = [](const V3i& a, const V3i& b) { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; };
  if (static_cast<std::int64_t>(voxels.size()) > most) {
    const auto by_hash = [&](const V3i& a, const V3i& b) {
      const std::uint64_t ha = hash_of(a, seed), hb = hash_of(b, seed);
      return ha != hb ? ha < hb : less(a, b);
    };
    std::nth_element(voxels.begin(), voxels.begin() + most, voxels.end(), by_hash);
    voxels.resize(static_cast<std::size_t>(most));
  }
  std::sort(voxels.begin(), voxels.end(), less);
  return voxels;
}

std::vector<VoxelTruth> true_voxels(const TruthScene& truth, int level, std::span<const V3i> cells, const TruthOptions& options, Report& report) {
  const V3i n = truth.plan.grid.level(level).n;
  std::vector<Voxel> voxels;
  for (const V3i& c : cells) {
    if (c.x < 0 || c.y < 0 || c.z < 0 || c.x >= n.x || c.y >= n.y || c.z >= n.z) throw Error(Code::kBadInput, "", "a voxel of the pack lies outside its grid");
    voxels.push_back({c * (1 << level), (c + V3i(1, 1, 1)) * (1 << level)});
  }
  Lists lists;
  if (!gather(truth, level, voxels, n, options.rays > 0, lists, report)) return {};
  std::vector<VoxelTruth> all(cells.size());
  std::atomic<std::size_t> done{0};
  const Truth make{truth, options, level, std::pow(4.0, level)};
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t i) {
    VoxelTruth& to = all[i];
    to.at = cells[i];
    to.sigma.assign(options.directions.size(), 0.0);
    to.bins.assign(options.bins ? kNormalBins : 0, 0.0);
    to.visible_bins.assign(options.bins ? kNormalBins : 0, 0.0);
    V3d color(0, 0, 0);
    for (const std::uint64_t id : lists.faces[i][2]) make.add_face(make.face_of(id), voxels[i], to, color);
    for (const Lists::Part& p : lists.parts[i]) make.add_fibre_part(truth.plan.fibres[p.fibre], p.s0, p.s1, to, color);
    if (to.moments.covered > 0) to.color = color / to.moments.covered;
    for (int axis = 0; axis < 3 && options.rays > 0; ++axis) make.trace(axis, voxels[i], lists.faces[i][static_cast<std::size_t>(axis)], lists.fibres[i][static_cast<std::size_t>(axis)], to);
    const std::size_t d = ++done;
    if (report.progress) report.progress("truth of level " + std::to_string(level), static_cast<double>(d) / static_cast<double>(cells.size()));
  });
  return all;
}

}  // namespace texel
