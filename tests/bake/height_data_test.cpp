// Real height maps: each is read, baked, written and found whole; volumes are those of their samples.
#include "formats/read_pack.h"
#include "formats/write.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

TEST(HeightData, EveryFileBakesWhole) {
  const std::filesystem::path root = std::string(TEXEL_SHARED_DATA) + "/heightfields";
  if (!std::filesystem::exists(root)) GTEST_SKIP() << "not there: " << root;
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(root))
    if (is_picture(entry.path())) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  ASSERT_GE(paths.size(), 8u);
  for (const std::string& path : paths) {
    SCOPED_TRACE(path);
    Report report;
    Recipe recipe = volume_recipe(48);
    recipe.write.full_float = true;
    const Scene scene = read_scene(path, report);
    ASSERT_EQ(scene.heights.size(), 1u);
    const HeightField& field = scene.heights[0];
    double volume = 0;
    for (int y = 0; y + 1 < field.height; ++y)
      for (int x = 0; x + 1 < field.width; ++x) {
        const double* z = field.z.data() + static_cast<std::ptrdiff_t>(y) * field.width + x;
        volume += (z[0] + z[1] + z[field.width] + z[field.width + 1]) / 4 - field.base;
      }
    volume *= field.size.x * field.size.y / ((field.width - 1.0) * (field.height - 1.0));
    const Pack pack = bake(scene, recipe, report);
    EXPECT_EQ(pack.statistics.closed, 1);
    EXPECT_EQ(pack.statistics.components, 1);
    EXPECT_NEAR(pack.statistics.volume / volume, 1, 1e-10);
    EXPECT_NEAR(filled_volume(pack) / volume, 1, 1e-6);  // floats
    check_invariants(pack);
    const std::string folder = ::testing::TempDir() + "texel_height_data_test.texel";
    write_pack(pack, folder, recipe.write, report);
    for (const CheckFinding& finding : check_pack(folder)) ADD_FAILURE() << finding.id << ": " << finding.text;
    std::filesystem::remove_all(folder);
  }
}

}  // namespace
}  // namespace texel::test
