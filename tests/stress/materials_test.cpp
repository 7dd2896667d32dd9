// Materials at and beyond the ends of their ranges, cut-outs of noise, clear glass in and about solids; meshes of ../shared/data/dirty at many resolutions.
#include <algorithm>

#include "formats/error.h"
#include "tests/stress/invariants.h"
#include "tests/stress/shapes.h"

namespace texel::stress {
namespace {

Case odd_materials(std::uint64_t seed) {
  Random random(seed * 236887691 + 61);
  Case made;
  made.what = "odd materials";
  made.scene = test::empty_scene();
  const int n = 2 + below(random, 14);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  const auto pick = [&](std::initializer_list<float> values) { return values.begin()[below(random, static_cast<int>(values.size()))]; };
  made.scene.materials.clear();
  const int count = 1 + below(random, 4);
  for (int m = 0; m < count; ++m) {
    Material& material = made.scene.materials.emplace_back();
    material.name = std::string("m").append(std::to_string(m));
    for (int k = 0; k < 3; ++k) {
      material.kd[k] = pick({0, 1e-30f, 0.5f, 1});
      material.ks[k] = pick({0, 0, 1e-20f, 1});
      material.ke[k] = pick({0, 0, 1, 1e4f});
    }
    material.roughness = pick({0, 1e-6f, 0.3f, 1});
    material.opacity = pick({1, 1, 0, 1e-7f, 0.5f});
    material.two_sided = below(random, 4) == 0;
    if (below(random, 3) == 0) {
      material.map_kd.texture = 0;
      material.map_kd.scale = V2f(pick({1, 0, -3, 1e4f}), pick({1, 0, 1e-6f}));
      material.map_kd.offset = V2f(pick({0, 1e6f, -0.5f}), 0);
      material.map_kd.wrap = {static_cast<Wrap>(below(random, 3)), static_cast<Wrap>(below(random, 3))};
    }
  }
  made.scene.textures.push_back({"noise.png", "noise.png"});
  made.scene.load_texture = [seed](int) {
    Random noise(seed + 5);
    Image image;
    image.width = 1 + below(noise, 9);
    image.height = 1 + below(noise, 9);
    image.channels = 4;
    const int kind = below(noise, 3);
    for (int i = 0; i < image.width * image.height; ++i)
      for (int c = 0; c < 4; ++c) image.pixels.push_back(c < 3 ? static_cast<float>(noise.uniform()) : kind == 0 ? 0.f : kind == 1 ? static_cast<float>(below(noise, 2)) : static_cast<float>(noise.uniform()));
    return image;
  };
  for (int i = 0; i < 3; ++i) {
    const auto m = static_cast<std::uint32_t>(below(random, count));
    const V3d lo = point_in(random, V3d(n * 0.6));
    if (below(random, 2)) test::add_box(made.scene, lo, lo + V3d(0.05 * n) + point_in(random, V3d(n * 0.3)), false, 63, m);
    else test::add_quad(made.scene, lo, random.direction() * n * 0.4, random.direction() * n * 0.4, m);
  }
  // A corner without texture coordinates, and one far out.
  if (below(random, 2)) made.scene.mesh.uv_corners[0][1] = kNoIndex;
  for (V2f& uv : made.scene.mesh.uvs)
    if (below(random, 20) == 0) uv = V2f(1e7f, -1e7f);
  return made;
}
TEST(Materials, OddOnes) { run_family("materials", 500, odd_materials); }

TEST(Dirty, EveryFileAtManyResolutions) {
  const std::filesystem::path root = std::string(TEXEL_SHARED_DATA) + "/dirty";
  if (!std::filesystem::exists(root)) GTEST_SKIP() << "not there: " << root;
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    std::string extension = entry.path().extension();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension == ".obj" || extension == ".off" || extension == ".ply" || extension == ".stl") paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  Tally tally;
  for (const std::string& path : paths) {
    Case made;
    Report report;
    try {
      made.scene = read_scene(path, report);
    } catch (const Error& e) {
      EXPECT_TRUE(e.code == Code::kBadInput || e.code == Code::kFile) << path << ": " << e.what();
      ++tally.refused;
      continue;
    }
    for (const int n : {1, 2, 13, 31}) {
      made.recipe.resolution = V3i(n, 0, 0);
      made.recipe.want.preview = false;
      Random random(static_cast<std::uint64_t>(n));
      vary(made.recipe, random);
      ++tally.cases;
      try {
        const Pack pack = test::bake_quietly(made.scene, made.recipe);
        for (const std::string& f : faults_of(made, pack, tally)) ADD_FAILURE() << path << " at " << n << ": " << f;
      } catch (const Error& e) {
        EXPECT_EQ(e.code, Code::kBadInput) << path << ": " << e.what();
        ++tally.refused;
      }
    }
  }
  std::printf("stress dirty          %lld cases of %zu files, %lld refused, %lld voxels\n", static_cast<long long>(tally.cases), paths.size(), static_cast<long long>(tally.refused), static_cast<long long>(tally.voxels));
}

}  // namespace
}  // namespace texel::stress
