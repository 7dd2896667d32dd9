#include "bake/fibre_tubes.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "bake/bake.h"
#include "bake/fibre.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr int kLeastSides = 25, kMostSides = 1025;
constexpr double kSagitta = 1.0 / 256;              // voxels
constexpr double kSharp = -0.5;                     // cosine of the turn that a ring can still halve
constexpr double kMostVertices = 0x1p28;

struct Tubes {
  const Fibres& fibres;
  Mesh mesh;                                        // points, colors, triangles, materials

  std::uint32_t vertex(const V3d& p, std::size_t at) {
    mesh.points.push_back(p);
    if (!fibres.colors.empty()) mesh.colors.push_back(fibres.colors[at]);
    return static_cast<std::uint32_t>(mesh.points.size() - 1);
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t material) {
    mesh.triangles.push_back({a, b, c});
    mesh.materials.push_back(material);
  }

  [[nodiscard]] V3d direction(std::size_t i) const { return (fibres.points[i + 1] - fibres.points[i]).normalized(); }

  // One tube along the points [begin, last]; only its ends may be without thickness.
  void tube(std::size_t begin, std::size_t last, int sides, std::uint32_t material) {
    if (last == begin || (last == begin + 1 && fibres.radii[begin] == 0 && fibres.radii[last] == 0)) return;
    const auto n = static_cast<std::size_t>(sides);
    const double reach = M_PI / (sides * std::sin(M_PI / sides));  // circumradius of a polygon of circumference 2π
    V3d t = direction(begin);
    const V3d helper = std::abs(t.x) < 0.6 ? V3d(1, 0, 0) : std::abs(t.y) < 0.6 ? V3d(0, 1, 0) : V3d(0, 0, 1);
    const V3d x = t.cross(helper).normalized(), y = t.cross(x);
    std::vector<V3d> spokes(n);                     // across the piece at hand, unit
    for (std::size_t k = 0; k < n; ++k) {
      const double angle = 2 * M_PI * static_cast<double>(k) / sides;
      spokes[k] = x * std::cos(angle) + y * std::sin(angle);
    }
    std::vector<std::uint32_t> ring, before;
    for (std::size_t i = begin; i <= last; ++i) {
      const V3d& p = fibres.points[i];
      const double r = fibres.radii[i] * reach;
      before.swap(ring);
      ring.clear();
      if (r == 0) {
        ring.push_back(vertex(p, i));               // an apex
      } else if (i == begin || i == last) {
        for (const V3d& e : spokes) ring.push_back(vertex(p + e * r, i));
      } else {
        // The plane that halves the turn: the piece's edges run on until they meet it, and mirrored in it they are the next piece's.
        const V3d next = direction(i), m = (t + next).normalized();
        for (V3d& e : spokes) {
          ring.push_back(vertex(p + (e - t * (e.dot(m) / t.dot(m))) * r, i));
          e -= m * (2 * e.dot(m));
        }
        t = next;
        for (V3d& e : spokes) e = (e - t * e.dot(t)).normalized();  // no rounding piles up along a strand
      }
      if (i > begin) wall(before, ring, material);
      if (i == begin && ring.size() > 1) disc(ring, false, material);
      if (i == last && ring.size() > 1) disc(ring, true, material);
    }
  }

  // Spokes run counter-clockwise seen against the direction of the tube.
  void wall(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b, std::uint32_t material) {
    const std::size_t n = std::max(a.size(), b.size());
    const auto at = [n](const std::vector<std::uint32_t>& ring, std::size_t k) { return ring.size() == 1 ? ring[0] : ring[k % n]; };
    for (std::size_t k = 0; k < n; ++k) {
      if (a.size() > 1) triangle(at(a, k), at(a, k + 1), at(b, k), material);
      if (b.size() > 1) triangle(at(a, k + 1), at(b, k + 1), at(b, k), material);
    }
  }
  void disc(const std::vector<std::uint32_t>& ring, bool at_end, std::uint32_t material) {
    for (std::size_t k = 1; k + 1 < ring.size(); ++k) {
      if (at_end) triangle(ring[0], ring[k], ring[k + 1], material);
      else triangle(ring[0], ring[k + 1], ring[k], material);
    }
  }

  void strand(std::size_t s, int sides) {
    const std::size_t begin = fibres.first[s], last = fibres.first[s + 1] - 1;
    std::size_t from = begin;
    for (std::size_t i = begin + 1; i <= last; ++i) {
      const bool ends = i == last || fibres.radii[i] == 0 || direction(i - 1).dot(direction(i)) < kSharp;
      if (!ends) continue;
      tube(from, i, sides, fibres.materials[s]);
      from = i;
    }
  }
};

// Behind the triangles that were given and before those made of implicit surfaces.
void insert(Mesh& mesh, Mesh&& tubes) {
  if (mesh.points.size() + tubes.points.size() >= kNoIndex) throw Error(Code::kUnsupported, "", "mesh and tubes of fibres have more than 2^32 vertices", "use larger voxels");
  if (mesh.colors.empty() != tubes.colors.empty()) {
    mesh.colors.resize(mesh.points.size(), V3f(1, 1, 1));
    tubes.colors.resize(tubes.points.size(), V3f(1, 1, 1));
  }
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  for (auto& t : tubes.triangles)
    for (std::uint32_t& corner : t) corner += first;
  mesh.points.insert(mesh.points.end(), tubes.points.begin(), tubes.points.end());
  mesh.colors.insert(mesh.colors.end(), tubes.colors.begin(), tubes.colors.end());
  if (!mesh.normals.empty()) mesh.normals.resize(mesh.points.size(), V3f(0, 0, 0));
  const auto given = static_cast<std::ptrdiff_t>(mesh.triangles.size() - mesh.made);
  if (!mesh.uv_corners.empty()) mesh.uv_corners.insert(mesh.uv_corners.begin() + given, tubes.triangles.size(), {kNoIndex, kNoIndex, kNoIndex});
  mesh.triangles.insert(mesh.triangles.begin() + given, tubes.triangles.begin(), tubes.triangles.end());
  mesh.materials.insert(mesh.materials.begin() + given, tubes.materials.begin(), tubes.materials.end());
}

}  // namespace

int tube_sides(double radius) {
  const double wanted = M_PI / std::acos(1 - std::min(1.0, kSagitta / std::max(radius * kTubeReach, kSagitta)));
  const int sides = wanted < kMostSides ? static_cast<int>(std::ceil(wanted)) | 1 : kMostSides;
  return std::max(kLeastSides, sides);
}

Scene mesh_thick_fibres(Scene scene, const Recipe& recipe, Report& report) {
  if (scene.fibres.strands() == 0) return scene;
  const StageTimer timer(report, "fibres");
  const Grid grid = plan_grid(scene, recipe);
  const Fibres given = std::move(scene.fibres);
  scene.fibres = {};
  scene.bounds.extendBy(fibre_bounds(given));
  Tubes tubes{given, {}};
  double vertices = 0;
  std::size_t thick = 0;
  for (std::size_t s = 0; s < given.strands(); ++s) {
    const std::size_t begin = given.first[s], end = given.first[s + 1];
    const double radius = *std::max_element(given.radii.begin() + static_cast<std::ptrdiff_t>(begin), given.radii.begin() + static_cast<std::ptrdiff_t>(end)) / grid.h;
    if (radius >= kThickRadius) {
      const int sides = tube_sides(radius);
      vertices += static_cast<double>(end - begin) * sides;
      if (vertices > kMostVertices) throw Error(Code::kUnsupported, "", "the fibres are so thick against a voxel that their tubes have more than 2^28 corners", "use larger voxels, or bake the scene in parts");
      tubes.strand(s, sides);
      ++thick;
      continue;
    }
    const auto at = [](auto& from, std::size_t i) { return from.begin() + static_cast<std::ptrdiff_t>(i); };
    Fibres& thin = scene.fibres;
    thin.points.insert(thin.points.end(), at(given.points, begin), at(given.points, end));
    thin.radii.insert(thin.radii.end(), at(given.radii, begin), at(given.radii, end));
    if (!given.colors.empty()) thin.colors.insert(thin.colors.end(), at(given.colors, begin), at(given.colors, end));
    thin.first.push_back(thin.points.size());
    thin.materials.push_back(given.materials[s]);
  }
  report.count("fibres", static_cast<double>(given.strands()));
  report.count("fibres made tubes", static_cast<double>(thick));
  if (thick > 0) insert(scene.mesh, std::move(tubes.mesh));
  return scene;
}

}  // namespace texel
