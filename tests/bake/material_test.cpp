// Colour and material of voxels: of what is seen alone, and the roughness that stands for a mean of lobes.
#include "bake/compare.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

// Red, green, blue: 0, 1, 2, each with a shine of its own.
Scene coloured_scene() {
  Scene s = empty_scene();
  s.materials.resize(3);
  for (std::size_t m = 0; m < 3; ++m) {
    s.materials[m].kd = V3f(m == 0, m == 1, m == 2);
    s.materials[m].ks = V3f(0.25f * static_cast<float>(m));
    s.materials[m].ke = V3f(static_cast<float>(m), 0, 0);
    s.materials[m].roughness = 0.2f + 0.3f * static_cast<float>(m);
  }
  return s;
}
// A square across the unit cube at height z.
void add_sheet(Scene& s, double z, std::uint32_t material) { add_quad(s, V3d(0, 0, z), V3d(1, 0, 0), V3d(0, 1, 0), material); }

Recipe unit_cube(int resolution, MaterialOf which) {
  Recipe recipe = volume_recipe(resolution);
  recipe.box = Box3d(V3d(0), V3d(1));
  recipe.material = which;
  return recipe;
}
V3f color_of(const Pack& pack, std::size_t level = 0) { return dense(pack.levels[level], "Cd").at3(V3i(0)); }

// A picture of 8 × 8 texels, each half there.
void cut_out(Scene& scene, std::uint32_t material) {
  Image image;
  image.width = image.height = 8;
  image.channels = 4;
  for (int i = 0; i < 64; ++i) image.pixels.insert(image.pixels.end(), {1, 1, 1, 0.5f});
  scene.materials[material].map_kd.texture = static_cast<int>(scene.textures.size());
  scene.textures.push_back({"made", "made"});
  scene.load_texture = [image](int) { return image; };
}

void expect_same_grids(const Pack& a, const Pack& b, std::size_t levels) {
  ASSERT_GE(a.levels.size(), levels);
  for (std::size_t l = 0; l < levels; ++l)
    for (const char* name : {"Cd", "ks", "roughness", "emission", "density"}) {
      const Channel *p = a.levels[l].find(name), *q = b.levels[l].find(name);
      ASSERT_TRUE(p && q) << name;
      EXPECT_EQ(p->values, q->values) << name << " of level " << l;
      EXPECT_EQ(p->tiles, q->tiles) << name << " of level " << l;
    }
}

// Exact: to the bit. Nothing of a ball hides any other part of it, in a voxel of any size, and all of a sheet is seen from both sides, however it is coloured.
TEST(VisibleMaterial, OneLayerIsAllThereIs) {
  Scene ball = coloured_scene();
  add_ball(ball, 1, 20);
  for (std::size_t t = 0; t < ball.mesh.materials.size(); ++t) ball.mesh.materials[t] = static_cast<std::uint32_t>(t % 3);
  Scene sheet = coloured_scene();
  for (int i = 0; i < 24; ++i)
    for (int j = 0; j < 24; ++j) {
      const auto at = [](int x, int y) { return V3d(x / 24.0, y / 24.0, 0.1 + 0.013 * x + 0.017 * y); };
      add_triangle(sheet, at(i, j), at(i + 1, j), at(i + 1, j + 1), static_cast<std::uint32_t>(i + j) % 3);
      add_triangle(sheet, at(i, j), at(i + 1, j + 1), at(i, j + 1), static_cast<std::uint32_t>(i * j) % 3);
    }
  for (const int resolution : {7, 40}) {
    Recipe all = volume_recipe(resolution), visible = all;
    visible.material = MaterialOf::kVisible;
    const Pack a = bake_quietly(ball, all), b = bake_quietly(ball, visible);
    expect_same_grids(a, b, a.levels.size());
  }
  Recipe all = volume_recipe(40), visible = all;
  visible.material = MaterialOf::kVisible;
  const Pack a = bake_quietly(sheet, all);
  expect_same_grids(a, bake_quietly(sheet, visible), a.levels.size());
}

// The branch between two leaves: 1/3 of the surface, and nothing of what is seen. All rays are alike, so that the tolerance is a float's rounding.
TEST(VisibleMaterial, HiddenSurfaceDoesNotCount) {
  Scene s = coloured_scene();
  add_sheet(s, 0.2, 0);
  add_sheet(s, 0.5, 1);
  add_sheet(s, 0.8, 2);
  const Pack all = bake_quietly(s, unit_cube(1, MaterialOf::kAll)), visible = bake_quietly(s, unit_cube(1, MaterialOf::kVisible));
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(color_of(all)[k], 1.0 / 3, 1e-6);
    EXPECT_NEAR(color_of(visible)[k], k == 1 ? 0 : 0.5, 1e-6);
  }
  EXPECT_NEAR(dense(visible.levels[0], "ks").at(V3i(0)), 0.25, 1e-6);        // of 0 and 0.5
  EXPECT_NEAR(dense(visible.levels[0], "emission").at(V3i(0)), 1, 1e-6);     // of 0 and 2
  EXPECT_NEAR(dense(visible.levels[0], "roughness").at(V3i(0)), 0.8, 1e-6);  // red does not shine
  EXPECT_NEAR(dense(all.levels[0], "area").at(V3i(0)), dense(visible.levels[0], "area").at(V3i(0)), 0);
  EXPECT_NEAR(visible.statistics.mean_color.y, 1.0 / 3, 1e-6) << "the manifest's is of all surface";
}

// Leaf of half coverage above, branch, whole leaf below. From above: ½ leaf, ½ branch; from below: leaf.
TEST(VisibleMaterial, CutOutsLetPass) {
  Scene s = coloured_scene();
  add_sheet(s, 0.2, 0);
  add_sheet(s, 0.5, 1);
  add_sheet(s, 0.8, 2);
  cut_out(s, 2);
  const V3f visible = color_of(bake_quietly(s, unit_cube(1, MaterialOf::kVisible)));
  EXPECT_NEAR(visible.x, 0.5, 1e-6);
  EXPECT_NEAR(visible.y, 0.25, 1e-6);
  EXPECT_NEAR(visible.z, 0.25, 1e-6);
}

// Through clear surface the eye passes, but the surface itself counts as far as it is there: above 1 : ½, below 1.
TEST(VisibleMaterial, ClearSurfaceLetsPass) {
  Scene s = coloured_scene();
  add_sheet(s, 0.2, 0);
  add_sheet(s, 0.5, 1);
  add_sheet(s, 0.8, 2);
  s.materials[2].opacity = 0.5f;
  const V3f visible = color_of(bake_quietly(s, unit_cube(1, MaterialOf::kVisible)));
  EXPECT_NEAR(visible.x, 0.4, 1e-6);
  EXPECT_NEAR(visible.y, 0.2, 1e-6);
  EXPECT_NEAR(visible.z, 0.4, 1e-6);
}

// A box within a voxel hides what is in it along all three axes; what sticks in its matter, too. The rays' places do not matter: none sees the inner sheet.
TEST(VisibleMaterial, NothingIsSeenWithinMatter) {
  Scene s = coloured_scene();
  add_box(s, V3d(0.1, 0.2, 0.3), V3d(0.8, 0.7, 0.9), false, 63, 1);
  add_quad(s, V3d(0.2, 0.3, 0.5), V3d(0.3, 0, 0.1), V3d(0, 0.3, 0), 0);
  Recipe recipe = unit_cube(1, MaterialOf::kVisible);
  recipe.samples = 64;
  const V3f all = color_of(bake_quietly(s, unit_cube(1, MaterialOf::kAll))), visible = color_of(bake_quietly(s, recipe));
  EXPECT_GT(all.x, 0.04f);
  // The exact mean is moved by the rays' difference, and rays 1/64 apart may err on a sheet's area by half that beside its outline: 1.2/128 of 2.1 here.
  EXPECT_NEAR(visible.x, 0, 0.005);
  EXPECT_NEAR(visible.y, 1, 0.005);
}

// Sheets in voxels of their own hide nothing there, but in the voxels of coarser levels they do: seen again where opacity is recomputed, the children's sums where it is filtered.
// At 64 voxels the coarser levels lie in several bands of rays.
TEST(VisibleMaterial, Levels) {
  Scene s = coloured_scene();
  add_sheet(s, 0.11, 0);
  add_sheet(s, 0.51, 1);
  add_sheet(s, 0.91, 2);
  for (const int resolution : {4, 64}) {
    Recipe recipe = unit_cube(resolution, MaterialOf::kVisible);
    const Pack pack = bake_quietly(s, recipe);
    const std::size_t top = pack.levels.size() - 1;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(color_of(pack, top)[k], k == 1 ? 0 : 0.5, 1e-6) << resolution;
    const Dense c = dense(pack.levels[0], "Cd");
    for (int k = 0; k < 3; ++k) EXPECT_EQ(c.at(V3i(1, 1, resolution / 2), k), k == 1);
    recipe.level_mode = LevelMode::kFilter;
    const V3f filtered = color_of(bake_quietly(s, recipe), top);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(filtered[k], 1.0 / 3, 1e-6) << resolution;
  }
}

// A round fibre shows its wall to all sides and half of it to any: beside a leaf of as much area as its wall it counts for half. Rays are 64 × 64: 2 % of a contrast of 1.
TEST(VisibleMaterial, FibresCountAsTheyAreSeen) {
  Scene s = coloured_scene();
  constexpr double kRadius = 0.02;
  s.fibres.points = {V3d(0.1, 0.25, 0.5), V3d(0.9, 0.25, 0.5)};
  s.fibres.radii = {kRadius, kRadius};
  s.fibres.first = {0, 2};
  s.fibres.materials = {0};
  const double wall = 2 * std::numbers::pi * kRadius * 0.8;
  add_quad(s, V3d(0.1, 0.7, 0.5), V3d(0.8, 0, 0), V3d(0, wall / 0.8 / std::sqrt(2.0), wall / 0.8 / std::sqrt(2.0)), 1);
  Recipe recipe = unit_cube(1, MaterialOf::kVisible);
  recipe.samples = 64;
  const V3f visible = color_of(bake_quietly(s, recipe));
  recipe.material = MaterialOf::kAll;
  EXPECT_NEAR(color_of(bake_quietly(s, recipe)).x, 0.5, 0.01);
  EXPECT_NEAR(visible.x, 1.0 / 3, 0.02);
  EXPECT_NEAR(visible.y, 2.0 / 3, 0.02);
}

Scene leaves(int count, std::uint64_t seed) {
  Random random(seed);
  Scene s = coloured_scene();
  for (int i = 0; i < count; ++i) {
    const V3d c = random.direction() * std::cbrt(random.uniform()), a = random.direction() * 0.15, b = random.direction() * 0.15;
    add_triangle(s, c, c + a, c + b, c.length() < 0.6 ? 0u : random.uniform() < 0.8 ? 1u : 2u);
  }
  return s;
}

TEST(VisibleMaterial, SameOnAnyNumberOfThreads) {
  const Scene s = leaves(3000, 5);
  Recipe recipe = volume_recipe(48);
  recipe.material = MaterialOf::kVisible;
  recipe.threads = 1;
  const Pack one = bake_quietly(s, recipe);
  recipe.threads = 3;
  expect_same_grids(one, bake_quietly(s, recipe), one.levels.size());
}

// Against rays of compare's own, 3 · 64 × 64 a voxel. Of the bake's rays each end sees one of three colours: by 8 × 8 of them at level 0 and 32 × 32 from level 2 on, the mean is off by
// sqrt(0.2 / (6 · 1024)) = 0.006 there, and a thicket that is red within is off by more where all of it counts, by ever more on coarser levels.
TEST(VisibleMaterial, NearerToWhatIsSeen) {
  const Scene s = leaves(3000, 9);
  Recipe recipe = volume_recipe(16);
  recipe.samples = 8;
  CompareOptions options;
  options.voxels = 100;
  std::map<std::pair<std::string, int>, double> rms[2];
  for (const MaterialOf which : {MaterialOf::kAll, MaterialOf::kVisible}) {
    recipe.material = which;
    const Pack pack = bake_quietly(s, recipe);
    recipe.material = MaterialOf::kVisible;
    Report report;
    for (const Measure& m : compare_truth(pack, s, recipe, options, report).measures) rms[which == MaterialOf::kVisible][{m.name, m.level}] = m.value;
  }
  for (const auto& [name, level, bound] : {std::tuple{"color_rms", 1, 0.75}, {"color_rms", 2, 0.75}, {"color_rms", 3, 0.5}, {"color_rms", 4, 0.25}, {"ks_rms", 4, 0.25}, {"emission_rms", 4, 0.25}}) {
    ASSERT_TRUE(rms[0].contains({name, level})) << name;
    const double all = rms[0][{name, level}], visible = rms[1][{name, level}];
    std::printf("%s of level %d against what is seen: all %.4f, visible %.4f\n", name, level, all, visible);
    EXPECT_LT(visible, bound * all) << name << " level " << level;
  }
}

TEST(VisibleMaterial, SkippedWhereAllIsAlike) {
  Scene s = empty_scene();
  s.materials[0].ks = V3f(0.5f);
  s.materials[0].roughness = 0.3f;
  add_ball(s, 1, 12);
  Recipe recipe = volume_recipe(12);
  recipe.material = MaterialOf::kVisible;
  const Pack pack = bake_quietly(s, recipe);
  bool told = false;
  for (const Skip& skip : pack.skipped) told = told || skip.what == "visible material";
  EXPECT_TRUE(told);
}

// Mean lobes.

constexpr int kAngles = 4000;

// Half-vector angles, dense where lobes are narrow, with the solid angle each stands for.
struct Angles {
  std::vector<double> cos2, weight;
  Angles() {
    for (int i = 0; i < kAngles; ++i) {
      const double u = (i + 0.5) / kAngles, theta = std::numbers::pi / 2 * u * u * u;
      cos2.push_back(std::cos(theta) * std::cos(theta));
      weight.push_back(std::sin(theta) * u * u);
    }
  }
};
double ggx(double alpha, double cos2) {
  const double a2 = alpha * alpha, d = cos2 * (a2 - 1) + 1;
  return a2 / (std::numbers::pi * d * d);
}

struct Part { double area, ks, alpha; };
using Mix = std::vector<Part>;

struct LobeError { double l2, peak; };  // relative L2 over solid angle; peak over the true one

LobeError lobe_error(const Angles& at, const Mix& mix, double alpha) {
  double area = 0, ks = 0;
  for (const Part& p : mix) {
    area += p.area;
    ks += p.area * p.ks;
  }
  ks /= area;
  const auto mean = [&](double cos2) {
    double sum = 0;
    for (const Part& p : mix) sum += p.area / area * p.ks * ggx(p.alpha, cos2);
    return sum;
  };
  double off = 0, all = 0;
  for (std::size_t i = 0; i < at.cos2.size(); ++i) {
    const double truth = mean(at.cos2[i]), e = ks * ggx(alpha, at.cos2[i]) - truth;
    off += e * e * at.weight[i];
    all += truth * truth * at.weight[i];
  }
  return {std::sqrt(off / all), ks * ggx(alpha, 1) / mean(1)};
}

double power_mean(const Mix& mix, double power, bool by_ks) {
  double sum = 0, weight = 0;
  for (const Part& p : mix) {
    const double w = p.area * (by_ks ? p.ks : 1);
    sum += w * std::pow(p.alpha, power);
    weight += w;
  }
  return std::pow(sum / weight, 1 / power);
}
// Phong's exponent is 2/α² − 2.
double exponent_mean(const Mix& mix) {
  double sum = 0, area = 0;
  for (const Part& p : mix) {
    sum += p.area * (2 / (p.alpha * p.alpha) - 2);
    area += p.area;
  }
  return std::sqrt(2 / (sum / area + 2));
}
double least_squares(const Angles& at, const Mix& mix) {
  double best = 1, least = 1e9;
  for (double alpha = 0.02; alpha <= 1; alpha *= 1.01)
    if (const double e = lobe_error(at, mix, alpha).l2; e < least) {
      least = e;
      best = alpha;
    }
  return best;
}
double half_width(const Mix& mix) {
  const auto width = [](auto&& lobe) {
    double angle = 0;
    while (angle < std::numbers::pi / 2 && lobe(std::cos(angle) * std::cos(angle)) > lobe(1.0) / 2) angle += 1e-4;
    return angle;
  };
  const double wanted = width([&](double c) {
    double sum = 0;
    for (const Part& p : mix) sum += p.area * p.ks * ggx(p.alpha, c);
    return sum;
  });
  double low = 0.01, high = 1;
  for (int i = 0; i < 30; ++i) {
    const double middle = std::sqrt(low * high);
    (width([&](double c) { return ggx(middle, c); }) < wanted ? low : high) = middle;
  }
  return low;
}
double baked(const Mix& mix) {
  MaterialSums sums;
  double area = 0;
  for (const Part& p : mix) {
    Material m;
    m.ks = V3f(static_cast<float>(p.ks));
    m.roughness = static_cast<float>(p.alpha);
    sums.add(m, p.area);
    area += p.area;
  }
  return mean_roughness(sums, area);
}

// The table of docs/accuracy.md. What is adopted must beat every other closed form in the rms over the mixtures, and come within a tenth of the best lobe there is.
TEST(MeanLobe, HarmonicMeanByShine) {
  const Angles at;
  const std::vector<std::pair<const char*, Mix>> mixes{
      {"90 % matt leaf, 10 % waxy 0.2", {{0.9, 0, 1}, {0.1, 0.5, 0.2}}}, {"half matt, half gloss 0.1", {{0.5, 0, 1}, {0.5, 0.04, 0.1}}}, {"0.3 and 0.5", {{0.5, 0.04, 0.3}, {0.5, 0.04, 0.5}}},
      {"0.1 and 0.5", {{0.5, 0.04, 0.1}, {0.5, 0.04, 0.5}}},            {"10 % 0.1, 90 % 0.5", {{0.1, 0.04, 0.1}, {0.9, 0.04, 0.5}}},   {"90 % 0.1, 10 % 0.5", {{0.9, 0.04, 0.1}, {0.1, 0.04, 0.5}}},
      {"metal 0.2, plastic 0.4", {{0.5, 0.9, 0.2}, {0.5, 0.04, 0.4}}},  {"plastic 0.1, metal 0.5", {{0.5, 0.04, 0.1}, {0.5, 0.9, 0.5}}}, {"0.03 and 0.3", {{0.5, 0.04, 0.03}, {0.5, 0.04, 0.3}}}};
  const std::vector<std::pair<const char*, std::function<double(const Mix&)>>> ways{
      {"mean exponent", exponent_mean},
      {"mean a", [](const Mix& m) { return power_mean(m, 1, false); }},
      {"mean a2", [](const Mix& m) { return power_mean(m, 2, false); }},
      {"ks a2", [](const Mix& m) { return power_mean(m, 2, true); }},
      {"ks a", [](const Mix& m) { return power_mean(m, 1, true); }},
      {"ks 1/a", baked},
      {"ks 1/a2", [](const Mix& m) { return power_mean(m, -2, true); }},
      {"half width", half_width},
      {"least squares", [&](const Mix& m) { return least_squares(at, m); }}};
  std::map<std::string, double> square, peak;
  for (const auto& [name, mix] : mixes) {
    std::printf("%-30s", name);
    for (const auto& [way, alpha] : ways) {
      const LobeError e = lobe_error(at, mix, alpha(mix));
      square[way] += e.l2 * e.l2 / static_cast<double>(mixes.size());
      peak[way] += std::pow(std::log2(e.peak), 2) / static_cast<double>(mixes.size());
      std::printf("  %s %.2f (x%.2f)", way, e.l2, e.peak);
    }
    std::printf("\n");
  }
  std::printf("%-30s", "rms, stops of the peak");
  for (const auto& [way, alpha] : ways) std::printf("  %s %.2f (%.2f)", way, std::sqrt(square[way]), std::sqrt(peak[way]));
  std::printf("\n");
  for (const auto& [way, alpha] : ways) {
    if (way == std::string("ks 1/a")) continue;
    if (way == std::string("least squares")) EXPECT_LT(std::sqrt(square["ks 1/a"]), 1.1 * std::sqrt(square[way]));
    else EXPECT_LT(square["ks 1/a"], square[way]) << way;
  }
}

// Exact to rounding of a few operations and of a float's roughness.
TEST(MeanLobe, OfOneMaterialIsItsOwn) {
  for (const double alpha : {0.0, 1e-6, 0.005, 0.02, 0.3, 1.0})
    for (const double ks : {0.0, 0.04, 1.0}) {
      const Mix mix{{0.3, ks, alpha}, {1.7, ks, alpha}};
      EXPECT_NEAR(baked(mix), alpha, 1e-7 * std::max(alpha, 1e-3)) << alpha << ' ' << ks;
    }
}
TEST(MeanLobe, WhatDoesNotShineHasNoSay) {
  EXPECT_NEAR(baked({{100, 0, 1}, {1, 0.5, 0.2}}), 0.2, 1e-7);
  EXPECT_NEAR(baked({{100, 0, 0.05}, {1, 0.5, 0.6}}), 0.6, 1e-7);
  EXPECT_NEAR(baked({{1, 0, 0.6}, {1, 0, 0.8}}), std::sqrt(0.5), 1e-7) << "where nothing shines, the mean of the squares";
}
TEST(MeanLobe, MirrorsCountAsTheSun) {
  EXPECT_NEAR(baked({{0.01, 1, 0}, {0.99, 1, 0.5}}), 1 / (0.01 / 0.01 + 0.99 / 0.5), 1e-6);
  EXPECT_EQ(baked({}), 0);
}

// From the geometry into the grid, at every level: 1 : 3 of area along x.
TEST(MeanLobe, InTheGrid) {
  Scene s = coloured_scene();
  add_quad(s, V3d(0, 0, 0.3), V3d(0.25, 0, 0), V3d(0, 1, 0), 1);
  add_quad(s, V3d(0.25, 0, 0.3), V3d(0.75, 0, 0), V3d(0, 1, 0), 2);
  const Pack pack = bake_quietly(s, unit_cube(4, MaterialOf::kAll));
  const Dense fine = dense(pack.levels[0], "roughness");
  EXPECT_NEAR(fine.at(V3i(0, 0, 1)), 0.5, 1e-6);
  EXPECT_NEAR(fine.at(V3i(1, 0, 1)), 0.8, 1e-6);
  const double shine = 0.25 * 0.25 + 0.75 * 0.5;
  EXPECT_NEAR(dense(pack.levels[2], "roughness").at(V3i(0)), shine / (0.25 * 0.25 / 0.5 + 0.75 * 0.5 / 0.8), 1e-6);
}

}  // namespace
}  // namespace texel::test
