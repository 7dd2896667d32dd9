// Fibres: the closed forms against numerical integration, straight fibres against what is known of cylinders, conservation on all levels.
#include "bake/fibre.h"

#include "bake/fibre_tubes.h"
#include "bake/light.h"
#include "bake/view.h"
#include "formats/error.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

constexpr int kGrid = 64;  // voxels of edge 1, from the origin

struct Tensor { double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0; };

void add_strand(Scene& scene, const std::vector<V3d>& points, const std::vector<double>& radii, std::uint32_t material = 0) {
  Fibres& f = scene.fibres;
  f.points.insert(f.points.end(), points.begin(), points.end());
  f.radii.insert(f.radii.end(), radii.begin(), radii.end());
  f.first.push_back(f.points.size());
  f.materials.push_back(material);
}

Recipe unit_recipe(int n = kGrid) {
  Recipe recipe = volume_recipe(n);
  recipe.box = Box3d(V3d(0, 0, 0), V3d(n, n, n));
  recipe.samples = 4;
  return recipe;
}

Moments sum_moments(const Surface& surface) {
  Moments all;
  for (const Moments& m : surface.moments) all += m;
  return all;
}
Areas sum_areas(const Surface& surface) {
  Areas all;
  for (const Areas& a : surface.areas) all += a;
  return all;
}

// Shadow of a cylinder with its discs along an axis.
double silhouette(const V3d& t, double r, double length, int axis) {
  return 2 * r * length * std::hypot(t[(axis + 1) % 3], t[(axis + 2) % 3]) + M_PI * r * r * std::abs(t[axis]);
}

std::vector<V3d> directions() {
  std::vector<V3d> all{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1), V3d(1, 1, 0).normalized(), V3d(1, 1, 1).normalized(), V3d(1, -2e-3, 1e-3).normalized()};
  Random random(7);
  for (int i = 0; i < 8; ++i) all.push_back(random.direction());
  return all;
}

// Midpoints of ever so many strips of the wall, whose normals are differences of the surface itself.
TEST(FibreForms, AreIntegralsOverTheCone) {
  Random random(1);
  for (int i = 0; i < 24; ++i) {
    const V3d a(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)), d = random.direction() * random.uniform(0.1, 2);
    const double ra = random.uniform(0, 0.5), rb = i % 3 == 0 ? ra : random.uniform(0, 0.5);
    const FibreSegment f{a, a + d, ra, rb, 0, 0, true, true};
    const FibreShape shape = fibre_shape(f);
    const double s0 = i % 2 ? 0 : 0.2, s1 = i % 4 < 2 ? 1 : 0.7;
    Areas areas;
    Moments m;
    add_fibre(f, shape, s0, s1, true, areas, &m);
    const V3d x = shape.t.cross(std::abs(shape.t.x) < 0.7 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized(), y = shape.t.cross(x);
    constexpr int kAround = 4096;
    double area = 0;
    V3d shadow(0, 0, 0), vector(0, 0, 0);
    Tensor s;
    const auto add = [&](const V3d& n, double w) {
      area += w;
      vector += n * w;
      for (int k = 0; k < 3; ++k) shadow[k] += std::abs(n[k]) * w;
      s.xx += n.x * n.x * w; s.yy += n.y * n.y * w; s.zz += n.z * n.z * w;
      s.xy += n.x * n.y * w; s.xz += n.x * n.z * w; s.yz += n.y * n.z * w;
    };
    const auto at = [&](double s2, double phi) { return a + d * s2 + (x * std::cos(phi) + y * std::sin(phi)) * (ra + (rb - ra) * s2); };
    for (int k = 0; k < kAround; ++k) {
      const double p0 = 2 * M_PI * k / kAround, p1 = 2 * M_PI * (k + 1) / kAround;
      const V3d diagonal1 = at(s1, p1) - at(s0, p0), diagonal2 = at(s0, p1) - at(s1, p0);
      const V3d cross = diagonal2.cross(diagonal1) / 2.0;
      if (const double w = cross.length(); w > 0) add(cross / w * (cross.dot(x * std::cos(p0) + y * std::sin(p0)) < 0 ? -1.0 : 1.0), w);
    }
    if (s0 == 0) add(-shape.t, M_PI * ra * ra);
    if (s1 == 1) add(shape.t, M_PI * rb * rb);
    const double e = 3e-6 * (area + 1e-3);  // strips are off by (2π/4096)²/6 of themselves, and a kink of |n| costs as much again
    EXPECT_NEAR(areas.area, area, e);
    EXPECT_NEAR(m.covered, area, e);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(areas.crossings[k], shadow[k], e) << "taper " << shape.taper;
      EXPECT_NEAR(areas.stopping[k], shadow[k] / 2, e);
      EXPECT_NEAR(m.m[k], vector[k], e);
    }
    EXPECT_NEAR(m.xx, s.xx, e); EXPECT_NEAR(m.yy, s.yy, e); EXPECT_NEAR(m.zz, s.zz, e);
    EXPECT_NEAR(m.xy, s.xy, e); EXPECT_NEAR(m.xz, s.xz, e); EXPECT_NEAR(m.yz, s.yz, e);
  }
}

// Exact but for rounding.
TEST(FibreForms, OutlineHasTheShadowsArea) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const V3d d = i % 5 == 0 ? V3d(0, 0, 1) : random.direction();
    const double ra = random.uniform(1e-4, 0.1), rb = i % 2 ? ra : random.uniform(1e-4, 0.1);
    const FibreSegment f{V3d(0, 0, 0), d, ra, rb, 0, 0, i % 3 != 0, i % 3 == 1};
    const FibreShape shape = fibre_shape(f);
    Areas areas;
    add_fibre(f, shape, 0, 1, true, areas, nullptr);
    for (int axis = 0; axis < 3; ++axis) {
      const FibreOutline o = fibre_outline(f, shape, axis, (axis + 1) % 3, (axis + 2) % 3);
      const double area = o.length * (o.wa + o.wb) + 2 * o.before * o.wa + 2 * o.behind * o.wb;
      const double sine = std::hypot(d[(axis + 1) % 3], d[(axis + 2) % 3]);
      const bool seen_from_its_tip = shape.taper != 0 && std::abs(shape.taper * d[axis]) >= sine;
      if (!seen_from_its_tip) { EXPECT_NEAR(area, areas.stopping[axis], 1e-13); }
    }
  }
}

// Parts tile the piece bit for bit, whatever boxes they are asked of; each lies in its cell to rounding.
TEST(FibreWalk, PartsTileThePiece) {
  Random random(3);
  for (int i = 0; i < 500; ++i) {
    V3d a(random.uniform(0, 20), random.uniform(0, 20), random.uniform(0, 20)), b = a + random.direction() * random.uniform(0, 15);
    if (i % 7 == 0) b.x = a.x;
    if (i % 11 == 0) a = V3d(std::floor(a.x), std::floor(a.y), std::floor(a.z));
    if (i % 13 == 0) b = V3d(a.x, a.y, std::floor(b.z));
    const FibreSegment f{a, b, 0.1, 0.1, 0, 0, true, true};
    std::map<double, double> parts;
    for (int layer = -2; layer < 6; ++layer)
      walk_fibre(f, V3i(-100, -100, layer * 8), V3i(100, 100, layer * 8 + 8), [&](const V3i& cell, double s0, double s1) {
        EXPECT_LT(s0, s1);
        EXPECT_TRUE(parts.emplace(s0, s1).second);
        const V3d middle = a + (b - a) * ((s0 + s1) / 2);
        for (int k = 0; k < 3; ++k) {
          EXPECT_GE(middle[k], cell[k] - 1e-12);
          EXPECT_LE(middle[k], cell[k] + 1 + 1e-12);
        }
      });
    double at = 0;
    for (const auto& [s0, s1] : parts) {
      EXPECT_EQ(s0, at);
      at = s1;
    }
    EXPECT_EQ(at, 1) << i;
  }
  int met = 0;
  walk_fibre({V3d(-1e18, 3, 3.5), V3d(1e18, 3, 3.5), 1, 1, 0, 0, false, false}, V3i(0, 0, 0), V3i(8, 8, 8), [&](const V3i&, double, double) { ++met; });
  EXPECT_LE(met, 9);  // no walk from there
}

// The demand: area, Σ A n nᵀ and mean alpha of a straight fibre at any angle, from 10 voxels to 1e-4 voxel.
TEST(Fibre, StraightAgainstTheCylinder) {
  std::printf("straight fibre, length 30 voxels: largest relative errors over 14 directions\n  r/h      as      area      S         alpha, all levels\n");
  for (const double r : {10.0, 3.0, 1.0, 0.3, 0.1, 0.07, kThickRadius, 0.06, 0.03, 0.01, 1e-3, 1e-4}) {
    const bool thick = r >= kThickRadius;
    double worst_area = 0, worst_s = 0, worst_alpha = 0;
    for (const V3d& t : directions()) {
      constexpr double kLength = 30;
      Scene scene = empty_scene();
      const V3d middle(32.137, 31.71, 32.42);
      add_strand(scene, {middle - t * (kLength / 2), middle + t * (kLength / 2)}, {r, r});
      Report report;
      const Recipe recipe = unit_recipe();
      const auto s = run_stages(mesh_thick_fibres(scene, recipe, report), recipe);
      EXPECT_EQ(s->plan.fibres.empty(), thick);
      const double wall = 2 * M_PI * r * kLength, disc = M_PI * r * r, area = wall + 2 * disc;
      const Areas areas = sum_areas(s->surfaces[0]);
      worst_area = std::max(worst_area, std::abs(areas.area / area - 1));
      const Moments m = sum_moments(s->surfaces[0]);
      const double along = 2 * disc, across = wall / 2;
      const auto expected = [&](int i, int j) { return across * ((i == j ? 1 : 0) - t[i] * t[j]) + along * t[i] * t[j]; };
      for (const auto& [value, i, j] : {std::tuple(m.xx, 0, 0), std::tuple(m.yy, 1, 1), std::tuple(m.zz, 2, 2), std::tuple(m.xy, 0, 1), std::tuple(m.xz, 0, 2), std::tuple(m.yz, 1, 2)})
        worst_s = std::max(worst_s, std::abs(value - expected(i, j)) / area);
      EXPECT_LE(m.m.length(), 1e-12 * area);  // closed
      for (std::size_t level = 0; level < s->surfaces.size(); ++level) {
        if (thick && level + 1 < s->surfaces.size()) continue;  // matter in voxels one behind the other; the coarsest is one voxel
        for (int axis = 0; axis < 3; ++axis) {
          double sum = 0;
          for (const float a : s->seen.levels[level].alpha[static_cast<std::size_t>(axis)]) sum += static_cast<double>(a);
          const double found = sum * std::pow(4.0, static_cast<double>(level)), truth = silhouette(t, r, kLength, axis);
          worst_alpha = std::max(worst_alpha, std::abs(found - truth) / (2 * r * kLength));
        }
      }
    }
    std::printf("  %-8.4g %-6s  %.1e   %.1e   %.1e\n", r, thick ? "tube" : "fibre", worst_area, worst_s, worst_alpha);
    if (thick) {
      // Discs are polygons of the circle's circumference and (π/n)²/3 less area; the width of a regular polygon of n sides, n odd, is from 2R cos²(π/2n) to
      // 2R cos(π/2n), its mean 2R sin(π/n)/(π/n): within (π/n)²/12. Hundredths for the next order.
      const double n = tube_sides(r), corner = M_PI / n, share = r / 30;
      EXPECT_LE(worst_area, corner * corner / 3 * share * 1.01) << r;
      EXPECT_LE(worst_s, corner * corner / 3 * share * 1.01) << r;
      EXPECT_LE(worst_alpha, corner * corner * (1.01 / 12 + M_PI / 6 * share) + 1e-6) << r;
    } else {
      EXPECT_LE(worst_area, 1e-12) << r;    // scaled rounding
      EXPECT_LE(worst_s, 1e-12) << r;
      EXPECT_LE(worst_alpha, 2e-6) << r;    // opacities are stored as floats; sums of rays on coarse levels are multiples of 2⁻²⁴
    }
  }
}

// A piece lies in the voxels of its axis: what that costs on either side of the limit, against the same fibre as a tube.
TEST(Fibre, ErrorByTheVoxelOfTheAxis) {
  std::printf("fibre against tube of 129 sides, 24 random fibres: opacity of voxels\n  r/h      rms       worst\n");
  for (const double r : {0.25, 0.125, kThickRadius * 0.999, 0.03, 0.01}) {
    double square = 0, worst = 0;
    std::int64_t count = 0;
    Random random(11);
    for (int i = 0; i < 24; ++i) {
      const V3d t = random.direction(), middle(16 + random.uniform(), 16 + random.uniform(), 16 + random.uniform());
      Scene thin = empty_scene();
      add_strand(thin, {middle - t * 10.0, middle + t * 10.0}, {r, r});
      const Recipe recipe = unit_recipe(32);
      const auto fibre = run_stages(thin, recipe, true, 1);
      Recipe many = recipe;
      many.samples = 16;
      Scene tube = empty_scene();
      const V3d x = t.cross(std::abs(t.x) < 0.7 ? V3d(1, 0, 0) : V3d(0, 1, 0)).normalized(), y = t.cross(x);
      for (int k = 0; k < 64; ++k) {
        const auto spoke = [&](int j) { return (x * std::cos(2 * M_PI * j / 64) + y * std::sin(2 * M_PI * j / 64)) * r; };
        const V3d a = middle - t * 10.0 + spoke(k), b = middle - t * 10.0 + spoke(k + 1);
        add_triangle(tube, a, b, a + t * 20.0);
        add_triangle(tube, b, b + t * 20.0, a + t * 20.0);
      }
      many.fill = Fill::kOff;
      const auto truth = run_stages(tube, many, true, 1);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::map<std::array<int, 3>, double> difference;
        for_each_voxel(fibre->surfaces[0].set, [&](const V3i& v, std::int64_t k) { difference[{v.x, v.y, v.z}] += static_cast<double>(fibre->seen.levels[0].alpha[axis][static_cast<std::size_t>(k)]); });
        for_each_voxel(truth->surfaces[0].set, [&](const V3i& v, std::int64_t k) { difference[{v.x, v.y, v.z}] -= static_cast<double>(truth->seen.levels[0].alpha[axis][static_cast<std::size_t>(k)]); });
        for (const auto& [at, e] : difference) {
          square += e * e;
          worst = std::max(worst, std::abs(e));
          ++count;
        }
      }
    }
    const double rms = std::sqrt(square / static_cast<double>(count));
    std::printf("  %-8.4g %.5f   %.4f\n", r, rms, worst);
    // A piece within r of a wall puts up to half its width 2r on the wrong side, over up to √3 voxels; below the limit that is what users get.
    EXPECT_LE(worst, 2 * r * std::sqrt(3.0) + 0.01) << r;
    EXPECT_LE(rms, 0.75 * r + 1e-3) << r;
  }
}

Scene hairs(int count, double radius, std::uint64_t seed, double n = kGrid) {
  Scene scene = empty_scene();
  Random random(seed);
  for (int i = 0; i < count; ++i) {
    V3d p(random.uniform(0.2 * n, 0.8 * n), random.uniform(0.2 * n, 0.8 * n), random.uniform(0.2 * n, 0.8 * n)), d = random.direction();
    std::vector<V3d> points;
    std::vector<double> radii;
    for (int k = 0; k < 8; ++k) {
      points.push_back(p);
      radii.push_back(radius * (1 - k / 8.0));
      p += d * (0.02 * n);
      d = (d + random.direction() * 0.3).normalized();
    }
    add_strand(scene, points, radii);
  }
  return scene;
}

TEST(Fibre, AreaIsConservedOnAllLevels) {
  const Scene scene = hairs(300, 0.04, 5);
  const auto s = run_stages(scene, unit_recipe(), false);
  for (const Surface& surface : s->surfaces) {
    const Areas areas = sum_areas(surface);
    EXPECT_NEAR(areas.area / fibre_area(scene.fibres), 1, 1e-12);  // scaled rounding
    const Moments m = sum_moments(surface);
    EXPECT_NEAR((m.xx + m.yy + m.zz) / areas.area, 1, 1e-12);
    // What a bend leaves open: the difference of the discs on either side of it.
    V3d open(0, 0, 0);
    for (std::size_t f = 1; f < s->plan.fibres.size(); ++f)
      if (!s->plan.fibres[f].begins) open += (fibre_shape(s->plan.fibres[f]).t - fibre_shape(s->plan.fibres[f - 1]).t) * (M_PI * s->plan.fibres[f].ra * s->plan.fibres[f].ra);
    EXPECT_LE((m.m - open).length(), 1e-12 * areas.area);
  }
  const Pack pack = bake_quietly(scene, unit_recipe());
  (void)check_invariants(pack);
  for (const Level& level : pack.levels) EXPECT_NEAR(sum_of(level, "area") * std::pow(level.grid.h, 2) / fibre_area(scene.fibres), 1, 1e-6) << level.grid.h;
}

// What no ray meets counts, and layers hide each other: many crossing fibres against the same ones traced with 64 × 64 rays.
TEST(Fibre, CrossingFibresHideEachOther) {
  for (const double radius : {0.06, 0.01, 1e-3}) {
    Scene scene = empty_scene();
    Random random(9);
    const int count = static_cast<int>(40 / radius);
    for (int i = 0; i < count; ++i) {
      const V3d p(random.uniform(4, 12), random.uniform(4, 12), random.uniform(4, 12)), d = random.direction() * 6.0;
      add_strand(scene, {p - d, p + d}, {radius, radius});
    }
    Recipe few = unit_recipe(16), many = few;
    few.samples = 6;  // what scenes with fibres get
    many.samples = 32;
    const auto a = run_stages(scene, few), b = run_stages(scene, many);
    for (std::size_t level = 0; level < 4; ++level)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double mean = 0, truth = 0, square = 0;
        const auto &x = a->seen.levels[level].alpha[axis], &y = b->seen.levels[level].alpha[axis];
        ASSERT_EQ(x.size(), y.size());
        for (std::size_t i = 0; i < x.size(); ++i) {
          mean += static_cast<double>(x[i]);
          truth += static_cast<double>(y[i]);
          square += std::pow(static_cast<double>(x[i]) - static_cast<double>(y[i]), 2);
        }
        const double rms = std::sqrt(square / static_cast<double>(x.size()));
        if (axis == 0) std::printf("radius %g level %zu: mean alpha %.4f, 32 x 32 rays %.4f, rms %.4f\n", radius, level, mean / static_cast<double>(x.size()), truth / static_cast<double>(x.size()), rms);
        // Statistical: voxels' errors are independent, so that their mean is within 3.5 rms/√voxels; a bias of 0.004 is allowed beside it.
        const auto voxels = static_cast<double>(x.size());
        EXPECT_NEAR(mean / voxels, truth / voxels, 0.004 + 3.5 * rms / std::sqrt(voxels)) << radius << " level " << level;
        EXPECT_LE(rms, 0.05) << radius << " level " << level;  // as for meshes of many layers (docs/accuracy.md)
      }
  }
}

TEST(Fibre, SamePackAtAnyNumberOfThreads) {
  Scene scene = hairs(200, 0.05, 6);
  scene.fibres.colors.resize(scene.fibres.points.size());
  Random random(4);
  for (V3f& c : scene.fibres.colors) c = V3f(static_cast<float>(random.uniform()), static_cast<float>(random.uniform()), 0.5f);
  Recipe recipe = unit_recipe();
  recipe.want.slices = true;
  recipe.lights.push_back({Light::Kind::kSun, V3d(1, -1, -2), V3f(1, 1, 1)});
  recipe.shadows = true;
  recipe.threads = 1;
  const Pack one = bake_quietly(scene, recipe);
  (void)check_invariants(one);
  recipe.threads = 4;
  const Pack four = bake_quietly(scene, recipe);
  ASSERT_EQ(one.levels.size(), four.levels.size());
  for (std::size_t l = 0; l < one.levels.size(); ++l)
    for (std::size_t i = 0; i < one.levels[l].layers.size(); ++i)
      for (std::size_t c = 0; c < one.levels[l].layers[i].channels.size(); ++c) EXPECT_EQ(one.levels[l].layers[i].channels[c].values, four.levels[l].layers[i].channels[c].values);
  for (std::size_t s = 0; s < one.slices.size(); ++s)
    for (int k = 0; k < one.slices[s].count; ++k) EXPECT_EQ(one.slices[s].image(k).pixels, four.slices[s].image(k).pixels);
}

// A slice a voxel thick shows the volume's opacity: the sum over a stack's pixels is the silhouette of a single fibre.
TEST(Fibre, SlicesShowTheSilhouette) {
  Scene scene = empty_scene();
  const V3d t = V3d(3, 1, 2).normalized();
  add_strand(scene, {V3d(32, 32, 32) - t * 15.0, V3d(32, 32, 32) + t * 15.0}, {0.02, 0.02});
  Recipe recipe = unit_recipe();
  recipe.want.slices = true;
  const Pack pack = bake_quietly(scene, recipe);
  ASSERT_EQ(pack.slices.size(), 3u);
  for (const SliceStack& stack : pack.slices) {
    double sum = 0;
    for (int k = 0; k < stack.count; ++k) {
      const Image image = stack.image(k);
      for (std::size_t i = 3; i < image.pixels.size(); i += 4) sum += static_cast<double>(image.pixels[i]);
    }
    EXPECT_NEAR(sum / silhouette(t, 0.02, 30, stack.axis), 1, 1e-5) << stack.axis;  // rounding of floats, some hundred pixels
  }
}

// A bent tube is closed and outward, and its area and volume are near the fibre's.
TEST(FibreTubes, AreClosed) {
  Scene scene = empty_scene();
  std::vector<V3d> points;
  std::vector<double> radii;
  for (int i = 0; i <= 40; ++i) {
    const double a = 0.2 * i;
    points.push_back(V3d(32 + 15 * std::cos(a), 32 + 15 * std::sin(a), 20 + 0.6 * i));
    radii.push_back(1 + 0.02 * i);
  }
  add_strand(scene, points, radii);
  add_strand(scene, {V3d(5, 5, 5), V3d(10, 5, 5), V3d(6, 5.5, 5)}, {0.5, 0.5, 0});  // folds back, ends in a point
  Report report;
  const Scene made = mesh_thick_fibres(scene, unit_recipe(), report);
  EXPECT_EQ(made.fibres.strands(), 0u);
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : made.mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
  EXPECT_GT(mesh_volume(made.mesh), 0);
  // Rings in the planes that halve the turns keep area to the second order of thickness over bend: (1.8/15)² here at most.
  EXPECT_NEAR(mesh_area(made.mesh) / fibre_area(scene.fibres), 1, 0.015);
  const auto s = run_stages(made, unit_recipe());
  EXPECT_TRUE(s->plan.fill);
  EXPECT_EQ(s->plan.statistics.closed, s->plan.statistics.components);
}

TEST(Fibre, DegenerateAndHuge) {
  Scene scene = empty_scene();
  add_strand(scene, {V3d(1, 1, 1), V3d(1 + 1e-15, 1, 1)}, {0.01, 0.01});          // nothing in voxels but its discs
  add_strand(scene, {V3d(-1e90, 3, 3), V3d(1e90, 3.5, 3)}, {0.01, 0.01});
  add_strand(scene, {V3d(0, 2, 2), V3d(64, 2, 2)}, {0.01, 0});                      // from wall to wall, along lattice lines
  add_strand(scene, {V3d(8, 8, 8), V3d(8, 8, 9)}, {0, 0.05});
  const Pack pack = bake_quietly(scene, unit_recipe());
  (void)check_invariants(pack);
  Recipe filled = unit_recipe();
  filled.fill = Fill::kOn;
  EXPECT_THROW((void)bake_quietly(scene, filled), Error);                           // thin fibres hold nothing
  Scene none = empty_scene();
  add_strand(none, {V3d(100, 1, 1), V3d(101, 1, 1)}, {0.01, 0.01});
  EXPECT_THROW((void)bake_quietly(none, unit_recipe()), Error);                     // outside the box: said so
}

// The mean over the wall of max(0, n·l), and what stands in the way of the light.
TEST(FibreLight, IsTheMeanOverTheWall) {
  Scene scene = empty_scene();
  add_strand(scene, {V3d(0, 0, 0), V3d(0, 0, 4)}, {0.01, 0.01});
  add_strand(scene, {V3d(1, -2, 2), V3d(1, 2, 2)}, {0.1, 0.1});     // between the first one's middle and a sun from +x
  const RayScene rays(scene);
  for (const V3d& l : {V3d(1, 0, 0), V3d(1, 2, 3).normalized(), V3d(0, 1, 5).normalized()}) {
    const Light sun{Light::Kind::kSun, -l, V3f(1, 1, 1)};
    double mean = 0;
    constexpr int kAround = 20000;
    for (int k = 0; k < kAround; ++k) mean += std::max(0.0, l.x * std::cos(2 * M_PI * (k + 0.5) / kAround) + l.y * std::sin(2 * M_PI * (k + 0.5) / kAround)) / kAround;
    EXPECT_NEAR(fibre_irradiance(std::span(&sun, 1), nullptr, V3d(0, 0, 2), V3d(0, 0, 1), 0.01).x, mean, 1e-6);  // float
  }
  const Light sun{Light::Kind::kSun, V3d(-1, 0, 0), V3f(1, 1, 1)};
  EXPECT_EQ(fibre_irradiance(std::span(&sun, 1), &rays, V3d(0, 0, 2), V3d(0, 0, 1), 0.01).x, 0);
  EXPECT_GT(fibre_irradiance(std::span(&sun, 1), &rays, V3d(0, 0, 1), V3d(0, 0, 1), 0.01).x, 0.3f);  // no shadow of its own
}

// Truth and volume show one fibre equally much: covered pixels of an orthographic-like far view against its silhouette.
TEST(FibreTruth, ShowsTheSilhouette) {
  Scene scene = empty_scene();
  add_strand(scene, {V3d(-1, 0, 0), V3d(0, 0, 0), V3d(1, 0, 0)}, {0.05, 0.05, 0.05});
  scene.fibres.colors = {V3f(1, 0, 0), V3f(1, 0, 0), V3f(1, 0, 0)};
  ViewOptions options;
  options.width = options.height = 200;
  options.samples = 16;
  options.camera = orbit_camera(Box3d(V3d(-1.2, -1.2, -1.2), V3d(1.2, 1.2, 1.2)), 0, 90, 2, 2, 1);  // from above, nearly parallel
  options.lights.push_back({Light::Kind::kAmbient, V3d(0, 0, 0), V3f(1, 1, 1)});
  Report report;
  const Image image = view_truth(scene, options, report);
  double alpha = 0, red = 0, other = 0;
  int from = image.height, to = 0;  // azimuth 0 is from +x: the fibre stands upright in the picture
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float* p = image.at(x, y);
      alpha += static_cast<double>(p[3]);
      red += static_cast<double>(p[0]);
      other += static_cast<double>(p[1] + p[2]);
      if (p[3] > 0.5f) { from = std::min(from, y); to = std::max(to, y + 1); }
    }
  ASSERT_GT(to - from, 100);
  const double pixel = 2.1 / (to - from);  // Embree closes the ends by balls: length 2 and two radii
  EXPECT_NEAR(alpha * pixel * pixel, 0.1 * 2 + M_PI * 0.05 * 0.05, 0.02 * 0.2);  // the length is known to a pixel of 175 at either end
  EXPECT_GT(red, 0);
  EXPECT_EQ(other, 0);
}

// Colours along a fibre: the mean by area, exactly; a material's factor goes with it.
TEST(Fibre, ColoursAreMeansByArea) {
  Scene scene = empty_scene();
  scene.materials[0].kd = V3f(0.5f, 1, 1);
  add_strand(scene, {V3d(10.3, 20.2, 30.1), V3d(50.7, 40.2, 31.3)}, {0.03, 0.03});
  scene.fibres.colors = {V3f(1, 0, 0.25f), V3f(0, 1, 0.25f)};
  const auto s = run_stages(scene, unit_recipe(), false);
  V3d color(0, 0, 0);
  for (const V3d& c : s->surfaces[0].color) color += c;
  color /= sum_areas(s->surfaces[0]).covered;
  // Discs, r/L of the area, have their piece's mean colour, which may be off by that of a voxel's length: 0.03/45/45.
  EXPECT_NEAR(color.x, 0.25, 1e-5);
  EXPECT_NEAR(color.y, 0.5, 1.5e-5);
  EXPECT_NEAR(color.z, 0.25, 1e-6);  // floats
}

TEST(Fibre, OnePeriodIsTheMiddleOfManyPeriods) {
  Scene scene = hairs(40, 0.04, 12, 16);
  for (V3d& p : scene.fibres.points) p += V3d(7, -5, 0);                            // over the borders
  Recipe recipe = unit_recipe(16);
  recipe.cyclic = {true, true, false};
  const Pack period = bake_quietly(scene, recipe);
  Scene tiled = empty_scene();
  for (int y = -2; y <= 2; ++y)
    for (int x = -2; x <= 2; ++x)
      for (std::size_t s = 0; s < scene.fibres.strands(); ++s) {
        std::vector<V3d> points;
        std::vector<double> radii;
        for (std::size_t i = scene.fibres.first[s]; i < scene.fibres.first[s + 1]; ++i) {
          points.push_back(scene.fibres.points[i] + V3d(16 * x, 16 * y, 0));
          radii.push_back(scene.fibres.radii[i]);
        }
        add_strand(tiled, points, radii);
      }
  Recipe plain = unit_recipe(16);
  const Pack middle = bake_quietly(tiled, plain);
  for (const char* name : {"area", "alpha"}) {
    const Dense a = dense(period.levels[0], name), b = dense(middle.levels[0], name);
    for_each_cell(a.n, [&](const V3i& v) {
      ASSERT_EQ(a.state(v), b.state(v));
      for (int c = 0; c < a.components; ++c) EXPECT_NEAR(a.at(v, c), b.at(v, c), 1e-6) << name;
    });
  }
}

}  // namespace
}  // namespace texel::test
