// What `texel bench` measures against: counted normals and their ellipsoids, random rays a voxel.
#include <tbb/global_control.h>

#include <numeric>

#include "bake/ndf_fits.h"
#include "bake/random_rays.h"
#include "bake/truth_voxels.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

TEST(NormalBins, AreOfEqualAreaAndWithoutSign) {
  std::vector<int> count(kNormalBins, 0);
  constexpr int kEach = 400;
  for (const V3d& n : half_sphere(kEach * kNormalBins)) {
    ++count[static_cast<std::size_t>(normal_bin(n))];
    EXPECT_EQ(normal_bin(n), normal_bin(-n));
  }
  for (int i = 0; i < kNormalBins; ++i) {
    // Order: 400 places spread evenly over a cell; its outline passes about 4·√400 of them.
    EXPECT_NEAR(count[static_cast<std::size_t>(i)], kEach, 80) << i;
    EXPECT_EQ(normal_bin(bin_centre(i)), i);
  }
  EXPECT_GE(normal_bin(V3d(0, 0, 1)), 0);
  EXPECT_LT(normal_bin(V3d(0, 0, -1)), kNormalBins);
  EXPECT_EQ(normal_bin(V3d(1, 0, 0)), normal_bin(V3d(-1, 0, 0)));
}

TEST(RatibFits, EllipsoidOfKnownRadii) {
  // Radii that are an ellipsoid's come back exactly by least squares.
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const Rotation turn = random_rotation(random);
    const std::array<double, 3> e{1, random.uniform(0.3, 0.9), random.uniform(0.2, 0.9)};
    std::vector<double> bins(kNormalBins);
    for (int i = 0; i < kNormalBins; ++i) {
      const V3d n = bin_centre(i);
      const double form = std::pow(n.dot(turn.x) / e[0], 2) + std::pow(n.dot(turn.y) / e[1], 2) + std::pow(n.dot(turn.z) / e[2], 2);
      bins[static_cast<std::size_t>(i)] = 7 / std::sqrt(form);
    }
    const auto fit = ratib_by_least_squares(bins);
    ASSERT_TRUE(fit);
    const VoxelNdf ndf = *ndf_from_axes(NdfKind::kRatib, fit->axis_1, fit->axis_2);
    std::vector<double> density(2);
    const std::vector<V3d> two{turn.x, turn.y};
    normal_density(ndf, two, density);
    EXPECT_NEAR(density[1] / density[0], e[1], 1e-5);  // floats
    EXPECT_LT(total_variation(bins, ndf), 0.02);       // the bins' centres stand for all of them, of which each is 0.2 wide
  }
}

TEST(RatibFits, FullestBins) {
  std::vector<double> bins(kNormalBins, 0.0);
  EXPECT_FALSE(ratib_from_fullest(bins));
  EXPECT_FALSE(ratib_by_least_squares(bins));
  const int up = normal_bin(V3d(0.1, 0.05, 1));
  int side = 0;  // the bin nearest to square to it
  for (int i = 0; i < kNormalBins; ++i)
    if (std::abs(bin_centre(i).dot(bin_centre(up))) < std::abs(bin_centre(side).dot(bin_centre(up)))) side = i;
  bins[static_cast<std::size_t>(up)] = 10;
  bins[static_cast<std::size_t>(side)] = 5;
  const auto fit = ratib_from_fullest(bins);
  ASSERT_TRUE(fit);
  const V3d a(fit->axis_1), b(fit->axis_2);
  EXPECT_LT(axis_angle(a, bin_centre(up)), 1e-4);
  EXPECT_LT(axis_angle(b, bin_centre(side)), 8);   // turned to be square to the first
  EXPECT_NEAR(a.dot(b), 0, 1e-3);
  EXPECT_NEAR(a.length() / b.length(), 2, 1e-5);
  EXPECT_NEAR(a.length(), 100, 1e-3);              // the third has no counts: held at 1:100
  // One bin alone: least squares makes its direction the long axis.
  std::fill(bins.begin(), bins.end(), 0.0);
  bins[static_cast<std::size_t>(up)] = 3;
  const auto needle = ratib_by_least_squares(bins);
  ASSERT_TRUE(needle);
  EXPECT_LT(axis_angle(V3d(needle->axis_1), bin_centre(up)), 0.1);
}

TEST(TotalVariation, EndsOfItsRange) {
  for (const int bin : {3, 40, 100, 127}) {
    Symmetric sheet;
    add_outer(sheet, bin_centre(bin), 1);
    std::vector<double> bins(kNormalBins, 0.0);
    bins[static_cast<std::size_t>(bin)] = 2;
    EXPECT_NEAR(total_variation(bins, ndf_from_sggx(sheet)), 0, 1e-12);
    std::swap(bins[static_cast<std::size_t>(bin)], bins[static_cast<std::size_t>((bin + 50) % kNormalBins)]);
    EXPECT_NEAR(total_variation(bins, ndf_from_sggx(sheet)), 1, 1e-12);
  }
  const std::vector<double> even(kNormalBins, 1.0);
  EXPECT_NEAR(total_variation(even, ndf_from_sggx({1, 1, 1, 0, 0, 0})), 0, 0.02);  // 32 places a bin
  // The half of a sphere's normals that lie nearest to one axis, against all.
  std::vector<double> half(kNormalBins, 0.0);
  std::fill(half.begin() + kNormalBins / 2, half.end(), 1.0);
  EXPECT_NEAR(total_variation(half, ndf_from_sggx({1, 1, 1, 0, 0, 0})), 0.5, 0.02);
}

struct Ready {
  std::unique_ptr<TruthScene> truth;
  Surface surface;
};
Ready ready(const Scene& scene, const Recipe& recipe) {
  Report report;
  Ready r;
  r.truth = make_truth_scene(scene, recipe, plan_grid(scene, recipe), report);
  r.surface = clip_surface(r.truth->scene, r.truth->plan, r.truth->textures, {}, report);
  return r;
}

TEST(RandomRays, PlaneBySquareRootOfTheirNumber) {
  // One layer: alpha is the projected area; the error is √(α(1−α)/N).
  Scene scene = empty_scene();
  add_quad(scene, {-5, -5, -3.1}, {10, 0, 6}, {0, 10, 1});
  Recipe recipe = volume_recipe(8);
  recipe.box = Box3d(V3d(-1, -1, -1), V3d(1, 1, 1));
  const Ready r = ready(scene, recipe);
  const RayScene rays(r.truth->scene, &r.truth->textures);
  for (const int count : {16, 64, 256, 1024}) {
    const RandomRaysLevel traced = trace_random_rays(r.truth->scene, r.truth->plan, rays, r.surface.set, 0, {.rays = count, .seed = 5});
    double square = 0, expected = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(r.surface.set.count); ++i)
      for (int k = 0; k < 3; ++k) {
        const double a = r.surface.areas[i].crossings[k];
        square += std::pow(static_cast<double>(traced.alpha[static_cast<std::size_t>(k)][i]) - a, 2);
        expected += a * (1 - a) / count;
      }
    // Statistical: about 250 independent values, whose sum of squares varies by √(2/250) of itself; 4 deviations.
    EXPECT_NEAR(square / expected, 1, 0.4) << count;
  }
}

TEST(RandomRays, NormalsOfAPlaneAndTheInside) {
  Scene scene = empty_scene();
  add_box(scene, {1, 1, 1}, {5, 5, 5});
  Recipe recipe = volume_recipe(8);
  recipe.box = Box3d(V3d(0, 0, 0), V3d(8, 8, 8));
  // Not in the walls, where a ray's float may fall on either side.
  scene = transformed(scene, [](const V3d& p) { return p + V3d(0.25, 0.25, 0.25); });
  const Ready r = ready(scene, recipe);
  const RayScene rays(r.truth->scene, &r.truth->textures);
  const RandomRaysLevel traced = trace_random_rays(r.truth->scene, r.truth->plan, rays, r.surface.set, 0, {.rays = 32, .seed = 1, .normals = true});
  const RandomRaysLevel without = trace_random_rays(r.truth->scene, r.truth->plan, rays, r.surface.set, 0, {.rays = 32, .seed = 1});
  for_each_voxel(r.surface.set, [&](const V3i& v, std::int64_t index) {
    const auto i = static_cast<std::size_t>(index);
    int low = 0;
    for (int k = 0; k < 3; ++k) low += v[k] == 1 || v[k] == 5;
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(traced.alpha[k][i], without.alpha[k][i]);
    if (low != 1) return;  // in the middle of a side: a wall across
    for (int k = 0; k < 3; ++k) {
      const bool across = v[k] == 1 || v[k] == 5;
      if (across) EXPECT_EQ(traced.alpha[static_cast<std::size_t>(k)][i], 1) << "a wall stops every ray";
      // Along the wall: the filled part, three quarters or a quarter, stops though its rays meet nothing. 4 deviations.
      else EXPECT_NEAR(traced.alpha[static_cast<std::size_t>(k)][i], v.x == 1 || v.y == 1 || v.z == 1 ? 0.75 : 0.25, 4 * std::sqrt(0.1875 / 32));
    }
    V3d normal(0, 0, 0);
    for (int k = 0; k < 3; ++k)
      if (v[k] == 1 || v[k] == 5) normal[k] = 1;
    const double all = std::accumulate(traced.bins[i].begin(), traced.bins[i].end(), 0.0);
    EXPECT_EQ(all, 64);  // first and last, the same
    EXPECT_EQ(traced.bins[i][static_cast<std::size_t>(normal_bin(normal))], all);
  });
}

TEST(RandomRays, SameForAnyThreads) {
  Scene scene = empty_scene();
  add_ball(scene, 1, 12);
  const Ready r = ready(scene, volume_recipe(12));
  const RayScene rays(r.truth->scene, &r.truth->textures);
  std::vector<float> first;
  for (const std::size_t threads : {std::size_t{1}, std::size_t{2}}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const RandomRaysLevel traced = trace_random_rays(r.truth->scene, r.truth->plan, rays, r.surface.set, 0, {.rays = 9, .seed = 2});
    if (first.empty()) first = traced.alpha[0];
    EXPECT_EQ(first, traced.alpha[0]);
  }
}

}  // namespace
}  // namespace texel::test
