// The same files through OpenMesh, a reader that has nothing in common with ours.
#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include <set>

#include "formats/read.h"
#include "tests/formats/read_test_util.h"

namespace texel {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
};
using OtherMesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

class OpenMeshAgrees : public ::testing::TestWithParam<const char*> {};

TEST_P(OpenMeshAgrees, OnCountsBoxAndArea) {
  const std::string path = std::string(TEXEL_SHARED_DATA) + "/" + GetParam();
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  OtherMesh other;
  omerr().disable();  // it prints each non-manifold edge
  ASSERT_TRUE(OpenMesh::IO::read_mesh(other, path));
  Report report;
  const Scene scene = read_scene(path, report);

  std::vector<V3d> corners;
  Mesh theirs;
  for (const auto face : other.faces()) {
    std::array<std::uint32_t, 3> t{};
    std::size_t c = 0;
    for (const auto vertex : other.fv_range(face)) {
      t.at(c++) = static_cast<std::uint32_t>(corners.size());
      const auto p = other.point(vertex);
      corners.emplace_back(p[0], p[1], p[2]);
    }
    theirs.triangles.push_back(t);
  }
  theirs.points = corners;
  // OpenMesh drops triangles whose corners coincide; none of these files has any.
  EXPECT_EQ(scene.mesh.triangles.size(), theirs.triangles.size());
  // It cuts non-manifold meshes apart by copying vertices, and so may have more of them.
  EXPECT_LE(scene.mesh.points.size(), other.n_vertices());
  const Measures ours = measure(scene.mesh), its = measure(theirs);
  // It reads ASCII coordinates and binary floats through single precision: half a step of a float, relative to the largest coordinate.
  const double largest = std::max(ours.box.max.length(), ours.box.min.length());
  const double step = largest * 0x1p-24;
  EXPECT_LE((ours.box.min - its.box.min).length(), 2 * step);
  EXPECT_LE((ours.box.max - its.box.max).length(), 2 * step);
  // Each triangle's area changes by at most its circumference times that step: well under 1e-4 of it in these meshes.
  EXPECT_NEAR(ours.area, its.area, 1e-4 * ours.area);
}

INSTANTIATE_TEST_SUITE_P(Shared, OpenMeshAgrees,
                         ::testing::Values("models/bunny_closed.off", "models/armadillo.off", "models/sphere.off", "models/sphere.ply", "models/sphere.stl",
                                           "models/fixed_top.ply", "dirty/elephant-with-holes.off", "dirty/bunny_nonmanifold.ply", "dirty/cycloidal.ply",
                                           "dirty/soup.stl", "dirty/featuretype.STL", "dirty/quads_to_stitch.off", "dirty/tetra_intersected_by_triangle.off"));

}  // namespace
}  // namespace texel
