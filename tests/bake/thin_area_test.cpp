// What is thin against a voxel loses nothing: total projected area of spokes, of leaves edge-on and of grass cards is the same at every resolution.
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

constexpr double kSame = 1e-3;  // what is asked for; what is seen is printed

struct Totals { double area = 0; V3d shadow{0, 0, 0}, alpha{0, 0, 0}; };

// Areas, shadows (Σ A|n|) and opacities times the voxels' faces, summed over the voxels; world².
Totals totals(const Scene& scene, int resolution, bool rays) {
  Recipe recipe = volume_recipe(resolution);
  recipe.samples = 4;
  const auto s = run_stages(scene, recipe, rays, 1);
  Totals t;
  const double face = s->plan.grid.h * s->plan.grid.h;
  for (const Areas& a : s->surfaces[0].areas) {
    t.area += a.area * face;
    t.shadow += a.crossings * face;
  }
  for (int axis = 0; axis < 3 && rays; ++axis)
    for (const float a : s->seen.levels[0].alpha[static_cast<std::size_t>(axis)]) t.alpha[axis] += static_cast<double>(a) * face;
  return t;
}

double worst(const V3d& a, const V3d& b) {
  double w = 0;
  for (int k = 0; k < 3; ++k) w = std::max(w, std::abs(a[k] / b[k] - 1));
  return w;
}

// Cards so far apart that none hides another within a voxel at 32³: opacities add up to the shadows then.
void same_at_all_resolutions(const char* what, const Scene& scene, const V3d& expected) {
  for (const int n : {32, 64, 128, 256, 512}) {
    const Totals t = totals(scene, n, true);
    std::printf("%s at %d^3: shadow off by %.1e, opacity by %.1e\n", what, n, worst(t.shadow, expected), worst(t.alpha, expected));
    EXPECT_LE(worst(t.shadow, expected), kSame) << n;
    EXPECT_LE(worst(t.alpha, expected), kSame) << n;
  }
}

V3d shadow_of(const Mesh& mesh) {
  V3d sum(0, 0, 0);
  for (const auto& t : mesh.triangles) {
    const V3d cross = (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]) / 2.0;
    for (int k = 0; k < 3; ++k) sum[k] += std::abs(cross[k]);
  }
  return sum;
}

TEST(ThinArea, LeavesEdgeOn) {
  Scene scene = empty_scene();
  Random random(1);
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j)
      for (int k = 0; k < 5; ++k) {  // leaves of 1/40, normals within 1/20 of x
        const V3d n = V3d(1, random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05)).normalized();
        const V3d u = n.cross(V3d(0, 1, 0)).normalized() * 0.025, v = n.cross(u);
        add_quad(scene, V3d(i, j, k) / 5.0 + V3d(0.05, 0.05, 0.05) * random.uniform(), u, v);
      }
  same_at_all_resolutions("leaves edge-on", scene, shadow_of(scene.mesh));
}

TEST(ThinArea, GrassCards) {
  Scene scene = empty_scene();
  Random random(2);
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {  // blades 1/1000 wide and half as high as the field, upright but for 1/50
      const double a = random.uniform(0, 2 * M_PI);
      add_quad(scene, V3d((i + 0.5) / 8, (j + 0.5) / 8, 0), V3d(0.001 * std::cos(a), 0.001 * std::sin(a), 0), V3d(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), 0.5));
    }
  same_at_all_resolutions("grass cards", scene, shadow_of(scene.mesh));
}

TEST(ThinArea, BicycleSpokes) {
  Scene scene;
  std::string reason;
  if (!load_model("bicycle/bicycle.obj", scene, reason)) GTEST_SKIP() << reason;
  Mesh& mesh = scene.mesh;  // the spokes are chrome, as are handle bar and pedals
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (scene.materials[mesh.materials[t]].name != "chrome") continue;
    mesh.triangles[kept] = mesh.triangles[t];
    mesh.materials[kept] = mesh.materials[t];
    if (!mesh.uv_corners.empty()) mesh.uv_corners[kept] = mesh.uv_corners[t];
    ++kept;
  }
  ASSERT_GT(kept, 0u);
  mesh.triangles.resize(kept);
  mesh.materials.resize(kept);
  if (!mesh.uv_corners.empty()) mesh.uv_corners.resize(kept);
  const V3d expected = shadow_of(mesh);
  for (const int n : {32, 64, 128, 256, 512}) {
    const Totals t = totals(scene, n, false);
    std::printf("bicycle at %d^3: area off by %.1e, shadow by %.1e\n", n, std::abs(t.area / mesh_area(scene.mesh) - 1), worst(t.shadow, expected));
    EXPECT_LE(worst(t.shadow, expected), kSame) << n;
    EXPECT_NEAR(t.area / mesh_area(scene.mesh), 1, kSame) << n;
  }
}

}  // namespace
}  // namespace texel::test
