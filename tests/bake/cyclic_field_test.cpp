// --cyclic for functions: one period against the same period cut out of an explicit tiling; steps across the border; what cannot repeat.
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "bake/polygonize.h"
#include "formats/error.h"
#include "formats/expression.h"
#include "formats/solid_textures.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

constexpr std::array<bool, 3> kAll{true, true, true};
const Box3d kUnit(V3d(0, 0, 0), V3d(1, 1, 1));

// What the copies are measured against: three in a row along every axis, or one where `copies` is 0, each asked everywhere. That is the tiling as
// far as kAround can see.
class Tiling : public Field {
 public:
  Tiling(std::shared_ptr<const Field> one, const V3i& copies = {1, 1, 1}) : one_(std::move(one)), copies_(copies) {}
  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override {
    std::vector<double> px(n), py(n), pz(n), v(n);
    std::fill_n(f, n, -1e300);
    for_each_shift([&](const V3d& shift) {
      for (std::size_t i = 0; i < n; ++i) { px[i] = x[i] - shift.x; py[i] = y[i] - shift.y; pz[i] = z[i] - shift.z; }
      one_->values(n, px.data(), py.data(), pz.data(), v.data());
      for (std::size_t i = 0; i < n; ++i) f[i] = std::max(f[i], v[i]);
    });
  }
  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    std::vector<double> px(n), py(n), pz(n), v(n), dx(n), dy(n), dz(n);
    std::fill_n(f, n, -1e300);
    for_each_shift([&](const V3d& shift) {
      for (std::size_t i = 0; i < n; ++i) { px[i] = x[i] - shift.x; py[i] = y[i] - shift.y; pz[i] = z[i] - shift.z; }
      one_->gradients(n, px.data(), py.data(), pz.data(), v.data(), dx.data(), dy.data(), dz.data());
      for (std::size_t i = 0; i < n; ++i) {
        if (!(v[i] > f[i])) continue;
        f[i] = v[i];
        gx[i] = dx[i];
        gy[i] = dy[i];
        gz[i] = dz[i];
      }
    });
  }
  [[nodiscard]] Interval range(const Box3d& box) const override {
    Interval all{-1e300, -1e300};
    for_each_shift([&](const V3d& shift) {
      const Interval r = one_->range({box.min - shift, box.max - shift});
      all = {std::max(all.low, r.low), std::max(all.high, r.high)};
    });
    return all;
  }
  [[nodiscard]] Box3d bounds(double) const override { return {}; }

 private:
  template <class Call>
  void for_each_shift(Call&& call) const {
    for (int c = -copies_.z; c <= copies_.z; ++c)
      for (int b = -copies_.y; b <= copies_.y; ++b)
        for (int a = -copies_.x; a <= copies_.x; ++a) call(V3d(a, b, c));
  }
  std::shared_ptr<const Field> one_;
  V3i copies_;
};

// The unit box with a quarter more on every side: at 48 the same voxels as the unit box's at 32, from (8, 8, 8) on.
const Box3d kAround(V3d(-0.25, -0.25, -0.25), V3d(1.25, 1.25, 1.25));
const V3i kInner(8, 8, 8);

Scene solid_of(std::shared_ptr<const Field> field, double iso = 0) {
  Scene scene = empty_scene();
  const Box3d box = field->bounds(iso);
  scene.implicits.push_back({std::move(field), iso, box, 0, "--implicit"});
  return scene;
}
Scene density_of(const char* preset, std::shared_ptr<const Field> base) {
  Scene scene = empty_scene();
  EXPECT_TRUE(find_hypertexture(preset, &scene.hypertexture.emplace()));
  scene.hypertexture->base = std::move(base);
  return scene;
}
Recipe boxed(int resolution, const Box3d& box, const std::array<bool, 3>& cyclic = {}) {
  Recipe recipe = volume_recipe(resolution);
  recipe.box = box;
  recipe.cyclic = cyclic;
  return recipe;
}
std::vector<Issue> issues_of(const Scene& scene, const Recipe& recipe) {
  std::vector<Issue> issues = bake_quietly(scene, recipe).issues;
  std::erase_if(issues, [](const Issue& i) { return i.id == "cyclic-levels"; });  // of boxes that are not all powers of two
  return issues;
}
const Issue* find_issue(const std::vector<Issue>& issues, const std::string& id) {
  for (const Issue& i : issues)
    if (i.id == id) return &i;
  return nullptr;
}

// The largest difference of a channel over the voxels of `part`, which lies in `whole` from voxel `at` on and wraps around there. Voxels must be
// active in both or in neither.
double difference(const Pack& part, const Pack& whole, const V3i& at, const std::string& name) {
  const Dense a = dense(part.levels[0], name), b = dense(whole.levels[0], name), area = dense(part.levels[0], "area");
  const bool inner = name == "Cd";  // which is spread from the surface: looked at there only
  double worst = 0;
  int other = 0, seen = 0;
  for_each_cell(a.n, [&](const V3i& v) {
    const V3i w((v.x + at.x) % b.n.x, (v.y + at.y) % b.n.y, (v.z + at.z) % b.n.z);
    if (inner && !(area.at(v) > 0)) return;
    other += (a.state(v) != 0) != (b.state(w) != 0);
    seen += a.state(v) != 0;
    for (int c = 0; c < a.components; ++c) worst = std::max(worst, static_cast<double>(std::abs(a.at(v, c) - b.at(w, c))));
  });
  EXPECT_EQ(other, 0) << name;
  EXPECT_GT(seen, 100) << name;
  return worst;
}

// Two blobs that cross five of the unit box's faces. Nothing about them is symmetric on the lattice: equal diagonals would leave it to rounding how a
// polygon is cut into triangles.
const std::string kBlobs = "a = max(0.1 - ((x - 0.131)^2 + (y - 0.517)^2 + (z - 0.943)^2), 0); b = max(0.1 - ((x - 0.444)^2 + (y - 0.892)^2 + (z - 0.762)^2), 0); a^3 + b^3 - 0.0001";

TEST(CyclicFields, OnePeriodIsThatOfTheTiling) {
  const auto one = read_expression(kBlobs);
  const Pack cyclic = bake_quietly(solid_of(one), boxed(32, kUnit, kAll)), tiled = bake_quietly(solid_of(std::make_shared<Tiling>(one)), boxed(48, kAround));
  check_invariants(cyclic);
  EXPECT_TRUE(cyclic.issues.empty());
  // Shifts and places are short binary fractions: both bakes ask the function at the very same points but where a secant has been elsewhere.
  for (const char* name : {"area", "normal", "solid", "alpha", "S_diag", "S_off", "density"}) {
    const double d = difference(cyclic, tiled, kInner, name);
    std::printf("tiling of blobs: %s differs by %.1e\n", name, d);
    EXPECT_LE(d, 1e-6) << name;
  }
  // Matter does cross: some voxels of either end of each axis are inside or have surface.
  const Dense solid = dense(cyclic.levels[0], "solid");
  V3i low(0, 0, 0), high(0, 0, 0);
  for_each_cell(solid.n, [&](const V3i& v) {
    for (int a = 0; a < 3; ++a) {
      low[a] += v[a] == 0 && solid.at(v) > 0;
      high[a] += v[a] == 31 && solid.at(v) > 0;
    }
  });
  for (int a = 0; a < 3; ++a) {
    EXPECT_GT(low[a], 20) << a;
    EXPECT_GT(high[a], 20) << a;
  }
}

// The mean crossings of sub-rays, before they are stored as floats.
TEST(CyclicFields, CrossingsAreThoseOfTheTiling) {
  const auto one = read_expression(kBlobs);
  Recipe part = boxed(32, kUnit, kAll), whole = boxed(48, kAround);
  part.samples = whole.samples = 4;
  Report report;
  const auto a = run_stages(polygonize(solid_of(one), part, report), part, true, 1), b = run_stages(polygonize(solid_of(std::make_shared<Tiling>(one)), whole, report), whole, true, 1);
  std::map<std::tuple<int, int, int>, V3d> crossings;
  for_each_voxel(b->surfaces[0].set, [&](const V3i& v, std::int64_t i) {
    const auto& c = b->surfaces[0].areas[static_cast<std::size_t>(i)].crossings;
    crossings[{v.x - 8, v.y - 8, v.z - 8}] = V3d(c[0], c[1], c[2]);
  });
  std::int64_t looked = 0;
  double worst = 0;
  for_each_voxel(a->surfaces[0].set, [&](const V3i& v, std::int64_t i) {
    const auto& c = a->surfaces[0].areas[static_cast<std::size_t>(i)].crossings;
    const auto found = crossings.find({v.x, v.y, v.z});
    ASSERT_NE(found, crossings.end());
    worst = std::max(worst, (found->second - V3d(c[0], c[1], c[2])).length());
    ++looked;
  });
  std::printf("tiling of blobs: %lld voxels, crossings differ by %.1e\n", static_cast<long long>(looked), worst);
  EXPECT_GT(looked, 1000);
  EXPECT_LE(worst, 1e-9);  // where one layer lies in a voxel they are areas, whose places in voxels are rounded differently
}

// A column without an end along z has copies along x and y, and needs none along z.
TEST(CyclicFields, AColumnWithoutEndIsRepeatedAcross) {
  const auto one = read_expression("0.3125 - length(x - 0.125, y - 0.8125)");
  ASSERT_TRUE(one->bounds(0).isEmpty());
  const Pack cyclic = bake_quietly(solid_of(one), boxed(32, kUnit, kAll));
  const Pack tiled = bake_quietly(solid_of(std::make_shared<Tiling>(one, V3i(1, 1, 0))), boxed(48, kAround));
  EXPECT_TRUE(cyclic.issues.empty());
  for (const char* name : {"area", "normal", "solid"}) EXPECT_LE(difference(cyclic, tiled, kInner, name), 1e-6) << name;
  EXPECT_NEAR(filled_volume(cyclic), std::numbers::pi * 0.3125 * 0.3125, 2e-3);  // chords of cells inside the circle: less than h²/8r · 2πr
}

const std::string kGyroid = "t = 2*pi; sin(t*x)*cos(t*y) + sin(t*y)*cos(t*z) + sin(t*z)*cos(t*x)";

// Half of the cell is inside by the function's symmetry f(−p) = −f(p). No wall is surface: the area is the surface's own.
TEST(CyclicFields, GyroidTilesWithoutWalls) {
  constexpr double kArea = 3.09164555050106;  // of the level set f = 0 in the unit cell, by implicit_test's integrals
  const Pack pack = bake_quietly(solid_of(read_expression(kGyroid)), boxed(64, kUnit, kAll));
  EXPECT_TRUE(pack.issues.empty());
  const double area = sum_of(pack.levels[0], "area") * pack.grid.h * pack.grid.h;
  std::printf("gyroid at 64, cyclic: area %.6f (%.1e relative), solid %.6f\n", area, area / kArea - 1, filled_volume(pack));
  // Triangles of edge h inscribed in a surface of curvature below 2π: (2πh)²/12 relative at most.
  EXPECT_NEAR(area / kArea, 1, std::pow(2 * std::numbers::pi / 64, 2) / 12);
  EXPECT_NEAR(filled_volume(pack), 0.5, 1e-3);
}

// Another place to cut the period gives the same voxels, moved: nothing tells where the border is.
TEST(CyclicFields, WhereThePeriodIsCutDoesNotShow) {
  const Scene gyroid = solid_of(read_expression(kGyroid), 0.1);
  const V3d moved(0.25, 0.125, 0.5);
  const Pack a = bake_quietly(gyroid, boxed(32, Box3d(moved, moved + V3d(1, 1, 1)), kAll)), b = bake_quietly(gyroid, boxed(32, kUnit, kAll));
  for (const char* name : {"area", "normal", "solid", "alpha"}) {
    const double d = difference(a, b, {8, 4, 16}, name);
    std::printf("gyroid cut elsewhere: %s differs by %.1e\n", name, d);
    EXPECT_LE(d, 2e-6) << name;  // sines an argument of 2π apart, over slopes: 1e-15; then floats
  }
}

// The same of densities whose shape does not end along x and y, with a solid texture too: bit for bit where places are short binary fractions.
TEST(CyclicFields, WhereADensityIsCutDoesNotShow) {
  for (const char* preset : {"eroded", "marble", "fire", "fur"})
    for (const bool textured : {false, true}) {
      Scene scene = density_of(preset, read_expression("0.25 - abs(z - 0.5)"));
      scene.hypertexture->frequency = 6.6;
      scene.hypertexture->amount = 0.125;
      if (textured) scene.materials[0].solid = make_solid_texture(SolidKind::kMarble, 0.37, 1);
      const V3d moved(0.25, 0.625, 0);
      const Pack a = bake_quietly(scene, boxed(32, Box3d(moved, moved + V3d(1, 1, 1)), {true, true, false})), b = bake_quietly(scene, boxed(32, kUnit, {true, true, false}));
      for (const char* name : {"area", "normal", "solid", "alpha", "Cd"}) EXPECT_LE(difference(a, b, {8, 20, 0}, name), 1e-6) << preset << " " << name;
    }
}

TEST(CyclicFields, DensitiesAreThoseOfTheTiling) {
  for (const char* preset : {"eroded", "fur", "fire"}) {
    Scene scene = density_of(preset, make_ball(V3d(0.125, 0.5, 0.9375), 0.3125));
    Hypertexture& h = *scene.hypertexture;
    h.frequency = 7.3;
    h.amount = 0.0625;
    h.softness = h.preset == HypertexturePreset::kFur ? 0.12 : 0.03;
    const Pack cyclic = bake_quietly(scene, boxed(16, kUnit, kAll));
    EXPECT_TRUE(cyclic.issues.empty()) << preset << cyclic.issues.front().text;
    check_invariants(cyclic);
    Scene tiled = density_of("fog", std::make_shared<Tiling>(make_density(h, 0)));
    tiled.hypertexture->scale = h.scale;
    const Pack whole = bake_quietly(tiled, boxed(24, kAround));
    for (const char* name : {"area", "normal", "solid", "alpha", "S_diag"}) {
      const double d = difference(cyclic, whole, V3i(4, 4, 4), name);
      std::printf("tiling of %s: %s differs by %.1e\n", preset, name, d);
      EXPECT_LE(d, 0) << preset << " " << name;  // the very same points: bit for bit
    }
  }
}

// A density that fills space: its noise repeats. Two periods side by side, baked as one box that is not cyclic, are twice the same.
TEST(CyclicFields, NoiseWithoutAShapeRepeats) {
  for (const char* preset : {"marble", "eroded", "fire", "fur"}) {
    const bool fur = std::string(preset) == "fur";
    Scene scene = density_of(preset, read_expression(fur ? "0.2" : std::string(preset) == "marble" ? "1" : "0.1"));
    scene.hypertexture->frequency = 2.7;
    scene.hypertexture->amount = fur ? 0.35 : 0.5;
    const Pack cyclic = bake_quietly(scene, boxed(32, kUnit, kAll));
    const Issue* issue = find_issue(cyclic.issues, "cyclic-frequency");
    ASSERT_NE(issue, nullptr) << preset;
    EXPECT_EQ(find_issue(cyclic.issues, "cyclic-seam"), nullptr) << preset;
    scene.hypertexture->period = V3d(1, 1, 1);
    const Pack twice = bake_quietly(scene, boxed(64, Box3d(V3d(0, 0, 0), V3d(2, 1, 1))));
    // Fire's third axis is drawn by 0.4, which is no binary fraction.
    const double bound = std::string(preset) == "fire" ? 1e-6 : 0;
    for (const char* name : {"alpha", "solid", "Cd"}) {
      const double d = std::max(difference(cyclic, twice, {32, 0, 0}, name), difference(cyclic, twice, {0, 0, 0}, name));
      std::printf("two periods of %s: %s differs by %.1e\n", preset, name, d);
      // The doubled box's outermost samples see on what the wrapped ones do, too: no voxel is left out.
      EXPECT_LE(d, bound) << preset << " " << name;
    }
  }
}

// Mean |difference| of neighbouring voxels across the wrapped border, over the largest such mean of the planes within.
double seam_ratio(const Pack& pack, const std::string& name, int axis) {
  const Dense d = dense(pack.levels[0], name), area = dense(pack.levels[0], "area");
  std::vector<double> sum(static_cast<std::size_t>(d.n[axis]), 0), count(sum);
  for_each_cell(d.n, [&](const V3i& v) {
    V3i w = v;
    w[axis] = (v[axis] + 1) % d.n[axis];
    if (!(area.at(v) > 0 && area.at(w) > 0)) return;  // colours of the inside are spread, not looked up
    const auto k = static_cast<std::size_t>(v[axis]);
    for (int c = 0; c < d.components; ++c) sum[k] += static_cast<double>(std::abs(d.at(v, c) - d.at(w, c)));
    count[k] += 1;
  });
  double inner = 0;
  for (std::size_t k = 0; k < sum.size(); ++k) {
    if (count[k] > 0) sum[k] /= count[k];
    if (k + 1 < sum.size()) inner = std::max(inner, sum[k]);
  }
  EXPECT_GT(inner, 0) << name;
  EXPECT_GT(count.back(), 20) << name;
  return sum.back() / inner;
}

TEST(CyclicFields, NoStepAcrossTheBorder) {
  const auto slab = "0.25 - abs(z - 0.5)";
  // Of 48 planes one has the largest step, and now and then that is the border's: a quarter more for noise with details of a voxel.
  // Cut between two lattice planes of the noise, on which its slopes are steepest.
  const Box3d box(V3d(0.117, 0.061, 0), V3d(1.117, 1.061, 1));
  for (const char* preset : {"eroded", "marble", "fire", "fur"}) {
    Scene scene = density_of(preset, read_expression(slab));
    scene.hypertexture->frequency = 6.6;
    scene.hypertexture->amount = scene.hypertexture->preset == HypertexturePreset::kMarble ? 2 : 0.125;
    const Pack pack = bake_quietly(scene, boxed(48, box, {true, true, false}));
    for (int axis = 0; axis < 2; ++axis)
      for (const char* name : {"alpha", "Cd"}) {
        const double r = seam_ratio(pack, name, axis);
        std::printf("step of %s across %c: %s %.2f of the largest within\n", preset, "xy"[axis], name, r);
        EXPECT_LE(r, 1.25) << preset << name << axis;
      }
  }
  const auto picture = std::make_shared<Image>();
  picture->width = 32;
  picture->height = 16;
  picture->channels = 3;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 32; ++x)
      for (int c = 0; c < 3; ++c) picture->pixels.push_back(static_cast<float>(0.5 + 0.3 * std::sin(2 * std::numbers::pi * x / 32) + 0.15 * std::sin(2 * std::numbers::pi * (y + 3 * c) / 16)));
  const std::pair<const char*, std::shared_ptr<const SolidTexture>> textures[] = {
      {"marble", make_solid_texture(SolidKind::kMarble, 0.37, 1)},   {"wood", make_solid_texture(SolidKind::kWood, 0.8, 1)},
      {"granite", make_solid_texture(SolidKind::kGranite, 0.83, 1)}, {"picture, normal", make_plane_texture({picture, picture, picture}, 0.37, PlaneBlend::kNormal)},
      {"picture, sum", make_plane_texture({picture, picture, picture}, 0.37, PlaneBlend::kSum)}};
  for (const auto& [name, texture] : textures) {
    Scene scene = solid_of(read_expression(slab));
    scene.materials[0].solid = texture;
    const Pack pack = bake_quietly(scene, boxed(48, box, {true, true, false}));
    EXPECT_NE(find_issue(pack.issues, "cyclic-frequency"), nullptr) << name;
    const Pack plain = bake_quietly(scene, boxed(48, box));
    for (int axis = 0; axis < 2; ++axis) {
      const double r = seam_ratio(pack, "Cd", axis), before = seam_ratio(plain, "Cd", axis);
      std::printf("step of %s across %c: %.2f of the largest within (not cyclic: %.2f)\n", name, "xy"[axis], r, before);
      EXPECT_LE(r, 1 + 1e-5) << name << axis;
    }
  }
}

// All textures and all axes: a period on, the colour is the same to the rounding of places.
TEST(CyclicFields, SolidTexturesRepeat) {
  const auto picture = std::make_shared<Image>();
  picture->width = 8;
  picture->height = 4;
  picture->channels = 3;
  for (int i = 0; i < 96; ++i) picture->pixels.push_back(static_cast<float>(i * 37 % 96) / 96);
  const V3d period(1.25, 0.7, 3.1);
  Random random(5);
  for (const auto& texture : {make_solid_texture(SolidKind::kMarble, 0.3, 4), make_solid_texture(SolidKind::kWood, 1.7, 4), make_solid_texture(SolidKind::kGranite, 2.3, 4),
                              make_plane_texture({picture, picture, picture}, 0.6, PlaneBlend::kSum), make_octave_source(4, 2)}) {
    const auto fitted = texture->with_period(period, nullptr);
    ASSERT_NE(fitted, nullptr);
    double worst = 0, differs = 0;
    for (int i = 0; i < 500; ++i) {
      const V3d p(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2));
      for (int a = 0; a < 3; ++a) {
        V3d q = p;
        q[a] += period[a];
        worst = std::max(worst, static_cast<double>((fitted->color(p, V3d(0, 0, 0), 0.01) - fitted->color(q, V3d(0, 0, 0), 0.01)).length()));
        differs = std::max(differs, static_cast<double>((texture->color(p, V3d(0, 0, 0), 0.01) - texture->color(q, V3d(0, 0, 0), 0.01)).length()));
      }
    }
    EXPECT_LT(worst, 1e-5);
    EXPECT_GT(differs, 0.05);
  }
}

// Copies with and without a reach, and octaves with another frequency along each axis: values within the range of any box, gradients as differences.
TEST(CyclicFields, RangesAndGradientsOfWhatRepeats) {
  std::vector<std::shared_ptr<const Field>> fields;
  std::vector<V3d> shifts;
  for (int i = 0; i < 27; ++i) shifts.push_back(V3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
  fields.push_back(repeat_field(read_expression(kBlobs), {shifts}));
  fields.push_back(repeat_field(read_expression("sqrt(0.2 - x*x) - abs(y) - z*z"), {shifts}));
  for (const bool copies : {false, true}) {
    Hypertexture h;
    ASSERT_TRUE(find_hypertexture("eroded", &h));
    h.base = make_ball(V3d(0.125, 0.5, 0.875), 0.5);
    h.amount = 0.1;
    h.softness = 0.5;
    if (copies) h.copies = {shifts, make_density(h, 0)->bounds(0)};
    else h.period = V3d(0.7, 1.9, 0);
    fields.push_back(make_density(h, 0));
  }
  Random random(9);
  std::int64_t unknown = 0;
  double worst = 0;
  for (std::size_t k = 0; k < fields.size(); ++k)
    for (int i = 0; i < 400; ++i) {
      const V3d low(random.uniform(-1, 2), random.uniform(-1, 2), random.uniform(-1, 2)), size = V3d(random.uniform(), random.uniform(), random.uniform()) * std::exp2(-random.uniform(0, 9));
      const Interval range = fields[k]->range({low, low + size});
      unknown += std::isnan(range.low);
      for (int j = 0; j < 8 && !std::isnan(range.low); ++j) {
        const V3d p = low + size * V3d(random.uniform(), random.uniform(), random.uniform());
        double f = 0, d[3];
        fields[k]->gradients(1, &p.x, &p.y, &p.z, &f, &d[0], &d[1], &d[2]);
        ASSERT_GE(f, range.low) << k;
        ASSERT_LE(f, range.high) << k;
        if (k != 2 || !(f > 0.01 && f < 0.99)) continue;
        for (int a = 0; a < 3; ++a) {
          V3d q[2] = {p, p};
          double v[2];
          for (int side = 0; side < 2; ++side) {
            q[side][a] += side ? 1e-6 : -1e-6;
            fields[k]->values(1, &q[side].x, &q[side].y, &q[side].z, &v[side]);
          }
          worst = std::max(worst, std::abs((v[1] - v[0]) / 2e-6 - d[a]) / (1 + std::abs(d[a])));
        }
      }
    }
  EXPECT_GT(unknown, 100);  // the root's
  EXPECT_LT(unknown, 401);
  EXPECT_LT(worst, 1e-3);   // 1e-6 of a length over octaves of 1/50 of it
}

TEST(CyclicFields, FunctionsThatDoNotRepeatAreTold) {
  // Inside for z < 0.5 + x/4: along x a step of a quarter, along y none.
  const Scene ramp = solid_of(read_expression("0.5 + 0.25*x - z"));
  const std::vector<Issue> issues = issues_of(ramp, boxed(32, kUnit, {true, true, false}));
  ASSERT_EQ(issues.size(), 1u);
  EXPECT_EQ(issues[0].id, "cyclic-seam");
  EXPECT_EQ(issues[0].where, "--implicit");
  EXPECT_EQ(issues[0].count, 8 * 33);
  EXPECT_EQ(issues[0].text, "the function does not repeat along x: it is inside on one side only at 264 of 1089 points on opposite faces of the box; the pattern has a seam there");
  EXPECT_TRUE(issues_of(ramp, boxed(32, kUnit, {false, true, false})).empty());
  EXPECT_TRUE(issues_of(ramp, boxed(32, kUnit)).empty());
  // Periods with rounding: not told, however often f is exactly iso at lattice points.
  const Scene gyroid = solid_of(read_expression("sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)"));
  EXPECT_TRUE(issues_of(gyroid, boxed(32, Box3d(V3d(0, 0, 0), V3d(2 * std::numbers::pi)), kAll)).empty());
  EXPECT_TRUE(issues_of(gyroid, boxed(32, Box3d(V3d(0, 0, 0), V3d(6.28319)), kAll)).empty());
  EXPECT_TRUE(issues_of(gyroid, boxed(32, Box3d(V3d(-1, 2, 3), V3d(-1, 2, 3) + V3d(4 * std::numbers::pi)), kAll)).empty());
  const std::vector<Issue> off = issues_of(gyroid, boxed(32, Box3d(V3d(0, 0, 0), V3d(6, 6, 6)), kAll));
  EXPECT_EQ(off.size(), 3u);
  // What is no number is outside on both sides.
  EXPECT_TRUE(find_issue(issues_of(solid_of(read_expression("sqrt(-cos(2*pi*x)) + 0.2 - abs(z - 0.5)")), boxed(32, kUnit, {true, true, false})), "cyclic-seam") == nullptr);
  const std::vector<Issue> undefined = issues_of(solid_of(read_expression("sqrt(x - 0.5) + 0.2 - abs(z - 0.5)")), boxed(32, kUnit, {true, true, false}));
  EXPECT_NE(find_issue(undefined, "cyclic-seam"), nullptr);
}

TEST(CyclicFields, DensitiesThatDoNotRepeatAreTold) {
  const std::vector<Issue> issues = issues_of(density_of("fog", read_expression("0.5 + 0.25*x")), boxed(16, kUnit, {true, true, false}));
  ASSERT_EQ(issues.size(), 1u);
  EXPECT_EQ(issues[0].id, "cyclic-seam");
  EXPECT_EQ(issues[0].where, "fog");
  EXPECT_EQ(issues[0].text, "the function does not repeat along x: it differs by more than 1/256 at 289 of 289 points on opposite faces of the box; the pattern has a seam there");
  EXPECT_TRUE(issues_of(density_of("fog", read_expression("0.5 + 0.25*sin(2*pi*x)")), boxed(16, kUnit, {true, true, false})).empty());
}

TEST(CyclicFields, ChangedFrequenciesAreTold) {
  Scene scene = density_of("eroded", read_expression("0.1"));
  scene.hypertexture->frequency = 2.71;
  const Box3d box(V3d(0, 0, 0), V3d(1, 1, 0.5));
  std::vector<Issue> issues = issues_of(scene, boxed(32, box, kAll));
  ASSERT_EQ(issues.size(), 1u);
  EXPECT_EQ(issues[0].id, "cyclic-frequency");
  EXPECT_EQ(issues[0].where, "eroded");
  EXPECT_EQ(issues[0].text, "noise has to repeat with the period: along x 3 lattice cells a period instead of 2.71, along y 3 lattice cells a period instead of 2.71, along z 1 lattice cells a period instead of 1.355");
  scene.hypertexture->frequency = 4;
  EXPECT_TRUE(issues_of(scene, boxed(32, box, kAll)).empty());

  Scene slab = solid_of(read_expression("0.25 - abs(z - 0.5)"));
  const auto said = [&](std::shared_ptr<const SolidTexture> texture, const char* name) {
    slab.materials[0].solid = std::move(texture);
    Recipe recipe = boxed(16, kUnit, {true, false, false});
    recipe.solid_texture = name;
    const std::vector<Issue> list = issues_of(slab, recipe);
    if (list.empty()) return std::string();
    EXPECT_EQ(list.size(), 1u);
    EXPECT_EQ(list[0].where, name);
    return list[0].id + " " + list[0].text;
  };
  const std::string start = "cyclic-frequency the solid texture has to repeat with the period: ";
  EXPECT_EQ(said(make_solid_texture(SolidKind::kMarble, 0.4, 1), "marble"), start + "along x 2 veins a period instead of 2.5; along x 2 lattice cells a period instead of 2.5");
  EXPECT_EQ(said(make_solid_texture(SolidKind::kMarble, 0.25, 1), "marble"), "");
  EXPECT_EQ(said(make_solid_texture(SolidKind::kWood, 0.25, 1), "wood"), start + "rings about one line a period");
  EXPECT_EQ(said(make_solid_texture(SolidKind::kGranite, 0.3, 1), "granite"), start + "along x 33 grains a period instead of 33.33");
  // What has only a function for its colour cannot be asked to repeat.
  class Linear : public SolidTexture {
   public:
    void colors(std::size_t n, const double* x, const double*, const double*, const V3d*, double, V3f* color) const override {
      for (std::size_t i = 0; i < n; ++i) color[i] = V3f(static_cast<float>(x[i]));
    }
  };
  EXPECT_EQ(said(std::make_shared<Linear>(), "linear"), "cyclic-solid-texture the solid texture cannot repeat with the period; its colour has a seam at the box's borders");
}

TEST(CyclicFields, TooManyCopiesAreRefused) {
  const Scene ball = solid_of(make_ball(V3d(0, 0, 0), 8));
  Report report;
  try {
    (void)bake(ball, boxed(16, kUnit, kAll), report);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code, Code::kCommandLine);
    EXPECT_STREQ(e.what(), "--cyclic: --implicit: 4096 copies of the function meet one period, and the most are 1000; give a larger --box");
  }
}

// Copies, fitted noise and their order do not depend on the threads.
TEST(CyclicFields, ThreadsDoNotMatter) {
  Scene scene = density_of("eroded", make_ball(V3d(0.125, 0.5, 0.9375), 0.3125));
  scene.hypertexture->amount = 0.2;
  scene.materials[0].solid = make_solid_texture(SolidKind::kMarble, 0.4, 1);
  for (const Scene& s : {scene, solid_of(read_expression(kBlobs))}) {
    Recipe recipe = boxed(32, kUnit, kAll);
    recipe.threads = 1;
    const Pack a = bake_quietly(s, recipe);
    recipe.threads = 3;
    const Pack b = bake_quietly(s, recipe);
    for (std::size_t l = 0; l < a.levels.size(); ++l)
      for (std::size_t i = 0; i < a.levels[l].layers.size(); ++i)
        for (std::size_t c = 0; c < a.levels[l].layers[i].channels.size(); ++c) EXPECT_EQ(a.levels[l].layers[i].channels[c].values, b.levels[l].layers[i].channels[c].values);
  }
}

}  // namespace
}  // namespace texel::test
