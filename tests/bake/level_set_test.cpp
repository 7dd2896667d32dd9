// A level set written by OpenVDB from a mesh against the mesh's own bake. Links OpenVDB itself: the files are made by the library.
#include <openvdb/openvdb.h>
#include <openvdb/points/PointConversion.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <openvdb/tools/MeshToVolume.h>

#include <filesystem>

#include "formats/error.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

std::string temporary(const std::string& name) { return ::testing::TempDir() + "texel_level_set_" + name; }

void write(const std::string& path, openvdb::GridPtrVec grids) {
  openvdb::io::File file(path);
  file.write(grids);
  file.close();
}
Scene read(const std::string& path, std::optional<double> iso = {}) {
  Report report;
  return read_scene(std::span(&path, 1), {.implicit = "", .iso = iso, .heights = {}}, report);
}
std::string fault(const std::string& path, std::optional<double> iso = {}) {
  try {
    (void)read(path, iso);
  } catch (const Error& e) {
    return std::to_string(static_cast<int>(e.code)) + " " + e.message;
  }
  return "no error";
}

TEST(LevelSet, OfAMeshBakesAsTheMesh) {
  openvdb::initialize();
  Report report;
  const Scene mesh = read_scene(std::string(TEXEL_SAMPLES) + "/bunny/bunny_closed.off", report);
  Recipe recipe = volume_recipe(64);
  recipe.box = plan_grid(mesh, recipe).box();
  const Pack truth = bake(mesh, recipe, report);

  std::vector<openvdb::Vec3I> triangles;
  for (const auto& t : mesh.mesh.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  const double cell = truth.grid.h / 2;
  const auto transform = openvdb::math::Transform::createLinearTransform(cell);
  std::vector<openvdb::Vec3s> placed;
  for (const V3d& p : mesh.mesh.points) placed.emplace_back(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
  const std::string path = temporary("bunny.vdb");
  write(path, {openvdb::tools::meshToLevelSet<openvdb::FloatGrid>(*transform, placed, triangles)});
  Scene scene = read(path);
  EXPECT_EQ(scene.implicits.size(), 1u);
  const Pack pack = bake(scene, recipe, report);
  check_invariants(pack);

  // Two samples a voxel: the interpolated surface is off by about the surface's curvature times cell²/8 — a hundredth of a voxel on this
  // model's round parts — and cuts edges sharper than that. Volume and area follow; alpha and normals differ most where ears are thin.
  const double volume = filled_volume(pack) / filled_volume(truth) - 1, area = sum_of(pack.levels[0], "area") / sum_of(truth.levels[0], "area") - 1;
  EXPECT_LE(std::abs(volume), 0.002);
  EXPECT_LE(std::abs(area), 0.01);
  const Dense alpha = dense(pack.levels[0], "alpha"), alpha_truth = dense(truth.levels[0], "alpha");
  const Dense normal = dense(pack.levels[0], "normal"), normal_truth = dense(truth.levels[0], "normal");
  const Dense surface = dense(pack.levels[0], "area"), surface_truth = dense(truth.levels[0], "area");
  double square = 0, turned = 0;
  std::int64_t voxels = 0, both = 0;
  for_each_cell(alpha.n, [&](const V3i& v) {
    if (!(surface.at(v) > 0) && !(surface_truth.at(v) > 0)) return;  // border voxels of either
    ++voxels;
    square += static_cast<double>((alpha.at3(v) - alpha_truth.at3(v)).length2()) / 3;
    const V3d a(normal.at3(v)), b(normal_truth.at3(v));
    if (a.length() < 0.9 || b.length() < 0.9) return;  // several sheets or an edge: no one normal
    ++both;
    turned += (a.normalized() - b.normalized()).length2();
  });
  const double rms = std::sqrt(square / static_cast<double>(voxels)), angle = std::sqrt(turned / static_cast<double>(both)) * 180 / M_PI;
  EXPECT_LE(rms, 0.03);
  EXPECT_LE(angle, 4);
  std::printf("bunny 64^3 from a level set of half a voxel: volume %+.2e, area %+.2e, alpha rms %.3f over %lld voxels, normals rms %.1f degrees over %lld\n", volume, area, rms,
              static_cast<long long>(voxels), angle, static_cast<long long>(both));
}

TEST(LevelSet, OfASphereHasItsAreaAndVolume) {
  openvdb::initialize();
  const std::string path = temporary("sphere.vdb");
  write(path, {openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1.0f, openvdb::Vec3f(3, 0, 0), 0.025f)});
  Report report;
  const Pack pack = bake(read(path), volume_recipe(96), report);
  // Distances in floats at 40 samples a radius: chords miss the sphere by 1/(8·40²) of its radius, both in the samples and in the bake.
  EXPECT_NEAR(filled_volume(pack) / (4 * M_PI / 3), 1, 1.5e-3);
  EXPECT_NEAR(sum_of(pack.levels[0], "area") * std::pow(pack.grid.h, 2) / (4 * M_PI), 1, 1e-3);
  EXPECT_TRUE(report.issues.empty());
  // A positive iso shrinks it: the function is the distance to the surface, positive inside.
  const Pack smaller = bake(read(path, 0.05), volume_recipe(96), report);
  EXPECT_NEAR(filled_volume(smaller) / (4 * M_PI / 3), std::pow(0.95, 3), 2e-3);
}

TEST(LevelSet, GridsThatAreNoFunctionsAreRefusedByName) {
  openvdb::initialize();
  const std::string path = temporary("refused.vdb");
  auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("velocity");
  auto numbers = openvdb::Int32Grid::create();
  numbers->setName("labels");
  write(path, {vectors, numbers});
  EXPECT_EQ(fault(path), "5 grid \"labels\" holds int32, grid \"velocity\" holds vectors, which cannot be baked");
  auto density = openvdb::FloatGrid::create();
  density->setName("density");
  write(path, {vectors, density});
  EXPECT_EQ(fault(path), "3 grid \"density\" has no active voxel");
  density->fill(openvdb::CoordBBox(openvdb::Coord(-3), openvdb::Coord(4)), 0.75f);
  write(path, {vectors, density});
  Report report;
  const Pack pack = bake(read(path), volume_recipe(32), report);
  // Samples −3 … 4 in voxels of 1: 0.5 lies a third of a voxel beyond the faces. Along the edges the solid is (1 − u)(1 − v) >= 2/3, whose
  // section has (1 − c) + c·ln c for c = 2/3; at the corners that is integrated once more. Chords cut the rounding: 0.5 %.
  const auto section = [](double c) { return 1 - c + c * std::log(c); };
  double corner = 0;
  for (int i = 0; i < 1000; ++i) corner += section(2.0 / 3 / (1 - (i + 0.5) / 3000)) / 3000;
  EXPECT_NEAR(filled_volume(pack) / (343 + 6 * 49 / 3.0 + 12 * 7 * section(2.0 / 3) + 8 * corner), 1, 0.005);
  EXPECT_EQ(fault(path, 0.8), "3 no value is >= 0.8 (they run from 0 to 0.75)");
  auto points = openvdb::points::createPointDataGrid<openvdb::points::NullCodec, openvdb::points::PointDataGrid>(std::vector<openvdb::Vec3f>{openvdb::Vec3f(0)},
                                                                                                                *openvdb::math::Transform::createLinearTransform(1));
  points->setName("sparks");
  write(path, {points});
  EXPECT_EQ(fault(path), "5 grid \"sparks\" holds points, which cannot be baked");
}

}  // namespace
}  // namespace texel::test
