// Meshes as they come: open, self-crossing, non-manifold, flipped. Whatever can be read is baked without nonsense in the values.
#include "formats/error.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

TEST(Dirty, EveryFileKeepsTheInvariants) {
  const std::filesystem::path root = std::string(TEXEL_SHARED_DATA) + "/dirty";
  if (!std::filesystem::exists(root)) GTEST_SKIP() << "not there: " << root;
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    std::string extension = entry.path().extension();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension == ".obj" || extension == ".off" || extension == ".ply" || extension == ".stl") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  ASSERT_FALSE(paths.empty());
  int baked = 0, refused = 0;
  std::int64_t values = 0;
  for (const std::string& path : paths) {
    SCOPED_TRACE(path);
    Report report;
    Scene scene;
    Recipe recipe;
    recipe.resolution = V3i(40, 0, 0);
    recipe.want.preview = false;
    try {
      scene = read_scene(path, report);
      const Pack pack = bake(scene, recipe, report);
      values += check_invariants(pack);
      ++baked;
      const double truth = mesh_area(scene.mesh) + fibre_area(scene.fibres);
      for (const Level& level : pack.levels) EXPECT_NEAR(sum_of(level, "area") * level.grid.h * level.grid.h / truth, 1, 1e-6);  // float
      const double box = static_cast<double>(pack.grid.voxels()) * std::pow(pack.grid.h, 3);
      EXPECT_LE(filled_volume(pack), box * (1 + 1e-6));
    } catch (const Error& e) {
      ++refused;
      EXPECT_TRUE(e.code == Code::kBadInput || e.code == Code::kFile) << e.what();
    }
  }
  EXPECT_GE(baked, 15);
  std::printf("dirty: %d files baked, %d refused, %lld values looked at\n", baked, refused, static_cast<long long>(values));
}

}  // namespace
}  // namespace texel::test
