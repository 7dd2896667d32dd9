// Colour by position in bakes of meshes, and the cube of octaves.
#include <bit>

#include "bake/hypertexture.h"
#include "bake/view.h"
#include "bake/view_zoom.h"
#include "formats/error.h"
#include "formats/read_pack.h"
#include "formats/solid_textures.h"
#include "formats/write.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

// A linear function of place: its mean over a piece of surface is its value at the piece's middle.
class Linear : public SolidTexture {
 public:
  void colors(std::size_t n, const double* x, const double* y, const double* z, const V3d*, double, V3f* color) const override {
    for (std::size_t i = 0; i < n; ++i) color[i] = V3f(V3d(0.5 + 0.4 * x[i], 0.5 + 0.4 * y[i], 0.5 + 0.4 * z[i]));
  }
};

Scene cube_of(std::shared_ptr<const SolidTexture> solid) {
  Scene scene = empty_scene();
  add_box(scene, V3d(-1, -1, -1), V3d(1, 1, 1));
  scene.materials[0].solid = std::move(solid);
  return scene;
}

TEST(SolidTexture, ColoursSurfaceSlicesAndTruth) {
  const Scene scene = cube_of(std::make_shared<Linear>());
  Recipe recipe = volume_recipe(24);
  recipe.want.slices = true;
  const Pack pack = bake_quietly(scene, recipe);
  check_invariants(pack);
  const Dense color = dense(pack.levels[0], "Cd"), area = dense(pack.levels[0], "area");
  double worst = 0;
  int looked_at = 0;
  for_each_cell(color.n, [&](const V3i& v) {
    if (!(area.at(v) > 0)) return;
    ++looked_at;
    // The surface lies in the voxel: its colour is within half a voxel's change of the middle's.
    const V3d c = pack.grid.centre(v);
    for (int a = 0; a < 3; ++a) worst = std::max(worst, std::abs(static_cast<double>(color.at(v, a)) - (0.5 + 0.4 * c[a])));
  });
  EXPECT_GT(looked_at, 2000);
  EXPECT_LT(worst, 0.4 * pack.grid.h * 0.5 + 1e-6);
  // Level by level the area-weighted mean of colour stays: 0.5 by symmetry.
  EXPECT_NEAR(pack.statistics.mean_color.x, 0.5, 1e-6);
  for (const SliceStack& s : pack.slices) {
    if (s.axis != 2) continue;
    const Image image = s.image(12);
    const double z = pack.grid.origin.z + 12.5 * s.thickness;
    const float* left = image.at(1, image.height / 2);  // the face x = −1
    EXPECT_EQ(left[3], 1);
    EXPECT_NEAR(left[0], 0.1, 0.4 * pack.grid.h);
    EXPECT_NEAR(left[2], 0.5 + 0.4 * z, 0.4 * pack.grid.h);
  }
  ViewOptions options;
  options.camera = frame_points(std::vector<V3d>{V3d(-1, -1, -1), V3d(1, 1, 1)}, -90, 0, 0, 2);
  options.width = options.height = 32;
  options.lights = {{Light::Kind::kAmbient, V3d(0, 0, 0), V3f(1, 1, 1)}};
  Report report;
  const Image truth = view_truth(scene, options, report);
  const float* middle = truth.at(16, 16);
  EXPECT_NEAR(middle[1], 0.1, 0.01);  // the face y = −1, from the front
  EXPECT_NEAR(middle[0], 0.5, 0.03);
}

// The stored cube: every period of it the same bits on three axes, at every level; mean and deviation those of the file.
TEST(SolidTexture, CubeOfOctavesRepeatsAndStatesItsMoments) {
  Scene scene;
  scene.materials.resize(1);
  scene.hypertexture.emplace();
  ASSERT_TRUE(find_hypertexture("octaves", &*scene.hypertexture));
  scene.hypertexture->frequency = 4;
  Recipe recipe = volume_recipe(32);
  recipe.want.levels = true;
  const Pack pack = bake_quietly(scene, recipe);
  EXPECT_EQ(pack.grid.n, V3i(32, 32, 32));
  EXPECT_EQ(pack.grid.box().max, V3d(1, 1, 1));
  EXPECT_EQ(pack.cyclic, (std::array<bool, 3>{true, true, true}));
  recipe.box = Box3d(V3d(0, 0, 0), V3d(2, 2, 2));
  recipe.resolution = V3i(64, 0, 0);
  const Pack eight = bake_quietly(scene, recipe);
  for (std::size_t l = 0; l < 4; ++l) {
    const Dense one = dense(pack.levels[l], "Cd"), all = dense(eight.levels[l], "Cd");
    for_each_cell(all.n, [&](const V3i& v) {
      const V3i in(v.x % one.n.x, v.y % one.n.y, v.z % one.n.z);
      ASSERT_EQ(std::bit_cast<std::uint32_t>(all.at(v)), std::bit_cast<std::uint32_t>(one.at(in))) << l;
    });
  }
  ASSERT_TRUE(pack.cube);
  EXPECT_EQ(pack.cube->octaves, 4);
  EXPECT_EQ(pack.cube->cells, 4);
  const std::string folder = ::testing::TempDir() + "texel_solid_cube_test.pack";
  Report report;
  write_pack(pack, folder, recipe.write, report);
  const Pack read = read_pack(folder);
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(read.cube);
  EXPECT_EQ(read.cube->weights_start, (std::vector<double>{0, 0.5, 1.0 / 3, 1.0 / 6}));
  EXPECT_EQ(read.cube->weights_end, (std::vector<double>{0.5, 1.0 / 3, 1.0 / 6, 0}));
  const Dense stored = dense(read.levels[0], "Cd");
  double mean = 0, square = 0;
  const auto count = static_cast<double>(read.grid.voxels());
  for_each_cell(stored.n, [&](const V3i& v) { mean += static_cast<double>(stored.at(v)) / count; });
  for_each_cell(stored.n, [&](const V3i& v) { square += std::pow(static_cast<double>(stored.at(v)) - mean, 2) / count; });
  EXPECT_NEAR(read.cube->mean.x, mean, 1e-6);
  EXPECT_NEAR(read.cube->deviation.x, std::sqrt(square), 1e-6);
  const Image strip = view_zoom(read, 32, 8);
  EXPECT_EQ(strip.width, 9 * 32);
  double jump = 0, inner = 0;
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x) {
      ASSERT_EQ(strip.at(x, y)[0], strip.at(8 * 32 + x, y)[0]);
      inner += std::abs(strip.at(x, y)[0] - strip.at(32 + x, y)[0]);
      jump += std::abs(strip.at(7 * 32 + x, y)[0] - strip.at(8 * 32 + x, y)[0]);
    }
  EXPECT_LT(jump, 1.5 * inner);  // the step that closes the cycle is as large as the others
  Pack other = bake_quietly(cube_of(nullptr), volume_recipe(8));
  EXPECT_THROW((void)view_zoom(other, 8, 2), Error);
}

}  // namespace
}  // namespace texel::test
