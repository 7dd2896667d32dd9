#include "bake/exact.h"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <cmath>

namespace texel {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SurfaceMesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, CGAL::AABB_face_graph_triangle_primitive<SurfaceMesh>>>;
using SideOf = CGAL::Side_of_triangle_mesh<SurfaceMesh, Kernel>;

Kernel::Point_3 convert(const V3d& p) { return {p.x, p.y, p.z}; }

// Every triangle has its own three vertices: the tree asks for no connections, and so any mesh goes in, manifold or not.
void fill_mesh(std::span<const V3d> points, std::span<const std::array<std::uint32_t, 3>> corners, SurfaceMesh& mesh) {
  mesh.reserve(static_cast<SurfaceMesh::size_type>(3 * corners.size()), static_cast<SurfaceMesh::size_type>(3 * corners.size()),
               static_cast<SurfaceMesh::size_type>(corners.size()));
  for (const auto& t : corners) {
    const auto a = convert(points[t[0]]), b = convert(points[t[1]]), c = convert(points[t[2]]);
    if (!CGAL::collinear(a, b, c)) mesh.add_face(mesh.add_vertex(a), mesh.add_vertex(b), mesh.add_vertex(c));
  }
}

}  // namespace

struct ExactInside::Impl {
  SurfaceMesh mesh;
  Tree tree;
  std::unique_ptr<SideOf> side_of;
};

ExactInside::ExactInside(std::span<const V3d> points, std::span<const std::array<std::uint32_t, 3>> triangles) : impl_(std::make_unique<Impl>()) {
  fill_mesh(points, triangles, impl_->mesh);
  if (impl_->mesh.number_of_faces() == 0) return;
  impl_->tree.insert(faces(impl_->mesh).first, faces(impl_->mesh).second, impl_->mesh);
  // Both built now, so that later calls only read.
  impl_->tree.build();
  impl_->tree.accelerate_distance_queries();
  impl_->side_of = std::make_unique<SideOf>(impl_->tree);
}

ExactInside::~ExactInside() = default;

Side ExactInside::side(const V3d& point) const {
  if (!impl_->side_of) return Side::kOutside;
  switch ((*impl_->side_of)(convert(point))) {
    case CGAL::ON_BOUNDED_SIDE: return Side::kInside;
    case CGAL::ON_BOUNDARY: return Side::kOnSurface;
    default: return Side::kOutside;
  }
}

double ExactInside::distance(const V3d& point) const {
  if (!impl_->side_of) return HUGE_VAL;
  return std::sqrt(impl_->tree.squared_distance(convert(point)));
}

}  // namespace texel
