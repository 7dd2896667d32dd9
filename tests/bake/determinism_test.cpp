// The bytes of whole packs do not depend on the number of threads or on the run.
#include <fstream>
#include <iterator>

#include "formats/write.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

// Every file of a folder by its name in it.
std::map<std::string, std::string> files_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    files[std::filesystem::relative(entry.path(), folder)] = std::string(std::istreambuf_iterator<char>(in), {});
  }
  return files;
}
void expect_same_packs(const std::string& path, Recipe recipe) {
  SCOPED_TRACE(path);
  std::map<std::string, std::string> first;
  std::size_t bytes = 0;
  for (const int threads : {1, 2, 4, 2}) {
    Report report;
    recipe.threads = threads;
    recipe.write.threads = threads;
    const Scene scene = read_scene(path, report);
    const std::filesystem::path folder = ::testing::TempDir() + "texel_determinism_test.pack";
    write_pack(bake(scene, recipe, report), folder, recipe.write, report);
    auto files = files_of(folder);
    std::filesystem::remove_all(folder);
    if (first.empty()) {
      first = std::move(files);
      for (const auto& [name, content] : first) bytes += content.size();
      EXPECT_TRUE(first.count("manifest.json"));
      EXPECT_TRUE(first.count("volume.vdb"));
      continue;
    }
    ASSERT_EQ(first.size(), files.size());
    for (const auto& [name, content] : first) EXPECT_TRUE(files.at(name) == content) << name << " with " << threads << " threads";
  }
  std::printf("determinism %s: %zu files, %zu bytes, the same with 1, 2, 4 threads and once more\n", path.substr(path.find_last_of('/') + 1).c_str(), first.size(), bytes);
}

Recipe small(int resolution) {
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.want.preview = false;
  recipe.slice_levels = 1;
  return recipe;
}
TEST(Determinism, Bunny) { expect_same_packs(std::string(TEXEL_SAMPLES) + "/bunny/bunny_closed.off", small(64)); }
TEST(Determinism, LitLeavesWithCutOuts) {
  Recipe recipe = small(48);
  recipe.lights = {{Light::Kind::kAmbient, V3d(0), V3f(0.4f)}, {Light::Kind::kSun, V3d(1, 1, -2), V3f(0.8f)}};
  recipe.shadows = true;
  expect_same_packs(std::string(TEXEL_SAMPLES) + "/bonsai/bonsai-tree.obj", recipe);
}
TEST(Determinism, FilteredLevelsAndOtherEllipsoids) {
  Recipe recipe = small(40);
  recipe.level_mode = LevelMode::kFilter;
  recipe.ndf = NdfKind::kNeyret;
  recipe.pattern = Pattern::kGrid;
  expect_same_packs(std::string(TEXEL_SAMPLES) + "/crossing_shells/crossing_shells.obj", recipe);
}

}  // namespace
}  // namespace texel::test
