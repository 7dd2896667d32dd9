// As few rays as leave opacity with the error asked for.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "bake/bake.h"
#include "bake/samples.h"
#include "tests/bake/bake_util.h"
#include "tests/bake/made_scene.h"
#include "tests/bake/max_error.h"

namespace texel::test {
namespace {

// Leaves in a crown over a ball: layers of open surface, a solid.
Scene bush(int leaves, double radius) {
  Scene scene = empty_scene();
  add_ball(scene, 0.3, 24);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> to(-1, 1);
  const auto direction = [&] {
    V3d d(0, 0, 0);
    while (!(d.length() > 0.1 && d.length() < 1)) d = V3d(to(random), to(random), to(random));
    return d.normalized();
  };
  for (int i = 0; i < leaves; ++i) {
    const V3d n = direction(), a = n.cross(direction()).normalized();
    add_quad(scene, V3d(0, 0, 0.9) + direction() * std::cbrt(std::abs(to(random))) * 0.5, a * radius, n.cross(a) * radius);
  }
  return scene;
}

struct Stack { VisibilityResult seen; std::array<SliceRecords, 3> slices; };

// Levels 0 to 3, slices too.
Stack see(Stages& s, const Recipe& recipe, const ChosenSamples* chosen) {
  VisibilityOptions options;
  options.slice_counts = {s.plan.grid.n.x, s.plan.grid.n.y, s.plan.grid.n.z};
  options.chosen = chosen;
  SliceShader grey;
  grey.crossing = [](const Bundle&, const Crossing&, double u, double v) { return V3f(static_cast<float>(u - std::floor(u)), static_cast<float>(v - std::floor(v)), 0.5f); };
  grey.voxel = [](const V3i&, std::int64_t) { return V3f(0.5f, 0.5f, 0.5f); };
  SlabSums sums;
  Stack stack;
  stack.seen = see_voxels(s.scene, s.plan, *s.textures, std::span(s.surfaces).first(4), recipe, options, grey, sums, s.report);
  stack.slices = gather_stacks(s.plan.grid, options, sums);
  return stack;
}

ChosenSamples everywhere(const Grid& grid, int samples) {
  ChosenSamples all;
  for (int axis = 0; axis < 3; ++axis) {
    const BundleAxes axes = bundle_axes(axis);
    all.samples[static_cast<std::size_t>(axis)].assign(static_cast<std::size_t>((grid.n[axes.u] + 7) / 8) * static_cast<std::size_t>((grid.n[axes.v] + 7) / 8), static_cast<std::uint8_t>(samples));
  }
  return all;
}

TEST(ChosenSamples, EachTileIsAsIfAllHadItsRays) {
  const Recipe recipe = opacity_recipe(44);
  const auto s = run_stages(bush(400, 0.12), recipe, false);
  // Some tiles of each.
  ChosenSamples mixed = everywhere(s->plan.grid, 2);
  for (auto& tiles : mixed.samples)
    for (std::size_t t = 0; t < tiles.size(); ++t) tiles[t] = static_cast<std::uint8_t>(2 + t * 7 % 3);
  const Stack all = see(*s, recipe, &mixed);
  int kinds = 0;
  for (int samples = 2; samples <= 4; ++samples) {
    Recipe uniform = recipe;
    uniform.samples = samples;
    const Stack alone = see(*s, uniform, nullptr);
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      const BundleAxes axes = bundle_axes(axis);
      const auto tiles = static_cast<std::size_t>((s->plan.grid.n[axes.u] + 7) / 8);
      const auto mine = [&](int u, int v) { return mixed.samples[a][static_cast<std::size_t>(v >> 3) * tiles + static_cast<std::size_t>(u >> 3)] == samples; };
      for (int level = 0; level < 4; ++level) {
        const auto l = static_cast<std::size_t>(level);
        std::int64_t seen = 0, wrong = 0;
        for_each_voxel(s->surfaces[l].set, [&](const V3i& v, std::int64_t i) {
          if (!mine(v[axes.u] << level, v[axes.v] << level)) return;
          ++seen;
          wrong += all.seen.levels[l].alpha[a][static_cast<std::size_t>(i)] != alone.seen.levels[l].alpha[a][static_cast<std::size_t>(i)];
        });
        EXPECT_EQ(wrong, 0) << "axis " << axis << " level " << level << " samples " << samples << " of " << seen;
        kinds += seen > 0;
      }
      // Slices: as many pixels, each the same.
      const SliceRecords &p = all.slices[a], &q = alone.slices[a];
      ASSERT_EQ(p.count, q.count);
      std::int64_t pixels = 0;
      for (int k = 0; k < p.count; ++k) {
        const auto of_tile = [&](const SliceRecords& r) {
          std::vector<std::array<float, 5>> found;
          for (std::size_t i = r.first[static_cast<std::size_t>(k)]; i < r.first[static_cast<std::size_t>(k) + 1]; ++i) {
            const SliceRecords::Pixel& x = r.pixels[i];
            if (mine(static_cast<int>(x.at) % r.width, static_cast<int>(x.at) / r.width)) found.push_back({static_cast<float>(x.at), x.r, x.g, x.b, x.a});
          }
          return found;
        };
        const auto there = of_tile(p);
        EXPECT_EQ(there, of_tile(q)) << "slice " << k << " axis " << axis << " samples " << samples;
        pixels += static_cast<std::int64_t>(there.size());
      }
      EXPECT_GT(pixels, 100);
    }
  }
  EXPECT_EQ(kinds, 36);
}

TEST(ChosenSamples, NarrowBundlesSeeTheSameInTheirColumns) {
  const Recipe recipe = opacity_recipe(40);
  const auto s = run_stages(bush(300, 0.15), recipe, false);
  std::mt19937 random(3);
  for (const Pattern kind : {Pattern::kGrid, Pattern::kLattice})
    for (int axis = 0; axis < 3; ++axis) {
      Recipe of_kind = recipe;
      of_kind.pattern = kind;
      const Bundle all = make_bundle(s->scene, s->plan, *s->textures, of_kind, axis);
      std::vector<char> columns(static_cast<std::size_t>(all.nu) * static_cast<std::size_t>(all.nv));
      for (char& c : columns) c = random() % 9 == 0;
      const Bundle narrow = narrow_bundle(all, columns);
      Band whole, part;
      BandScratch scratch;
      std::int64_t met = 0;
      for (int b = 0; b < all.bands; ++b) {
        trace_band(all, b, whole, scratch);
        for (int v = whole.v0; v < whole.v1; ++v) {
          trace_band(narrow, v, part, scratch);
          EXPECT_EQ(part.first.size(), static_cast<std::size_t>(part.width) * static_cast<std::size_t>(narrow.pattern.rays()) + 1);
          for (int u = 0; u < all.nu; ++u) {
            const bool wanted = columns[static_cast<std::size_t>(v) * static_cast<std::size_t>(all.nu) + static_cast<std::size_t>(u)] != 0;
            ASSERT_EQ(part.traced(u), wanted);
            for (int r = 0; wanted && r < all.pattern.rows; ++r)
              for (int j = 0; j < all.pattern.per_row; ++j) {
                const auto id = [&](const Band& band) {
                  return ((static_cast<std::size_t>(v - band.v0) * static_cast<std::size_t>(all.pattern.rows) + static_cast<std::size_t>(r)) * static_cast<std::size_t>(band.width) + static_cast<std::size_t>(band.place(u))) *
                             static_cast<std::size_t>(all.pattern.per_row) + static_cast<std::size_t>(j);
                };
                const std::size_t x = id(whole), y = id(part);
                ASSERT_EQ(whole.first[x + 1] - whole.first[x], part.first[y + 1] - part.first[y]);
                for (std::uint32_t k = 0; k < part.first[y + 1] - part.first[y]; ++k) {
                  const Crossing &c = whole.crossings[whole.first[x] + k], &d = part.crossings[part.first[y] + k];
                  ASSERT_TRUE(c.w == d.w && c.cell == d.cell && c.triangle == d.triangle && c.winding == d.winding);
                  ++met;
                }
              }
          }
        }
      }
      EXPECT_GT(met, 1000);
    }
}

// The rasteriser looks for the j-th ray of a row in the j-th of its equal parts, in fixed point.
TEST(ChosenSamples, ShearedRowsHaveOneRayInEachPart) {
  for (int rows = 1; rows <= 90; ++rows)
    for (int per_row = 1; per_row <= 45; ++per_row) {
      const RayPattern p = make_sheared_pattern(rows, per_row);
      ASSERT_EQ(p.u.size(), static_cast<std::size_t>(rows * per_row));
      std::vector<int> places = p.u;
      for (int r = 0; r < rows; ++r) {
        ASSERT_TRUE(r == 0 || p.v[static_cast<std::size_t>(r)] > p.v[static_cast<std::size_t>(r) - 1]);
        for (int j = 0; j < per_row; ++j) {
          const int u = p.u[static_cast<std::size_t>(r * per_row + j)];
          ASSERT_EQ((static_cast<std::int64_t>(u) * per_row) >> 16, j) << rows << " x " << per_row;
          ASSERT_LT(u, 1 << 16);
        }
      }
      // An edge across the rows is met at all of their places.
      std::sort(places.begin(), places.end());
      EXPECT_TRUE(std::adjacent_find(places.begin(), places.end()) == places.end()) << rows << " x " << per_row;
    }
}

// What a sheared pattern's rays meet is what a plain grid's at the same places would: fine ones agree on opacity, whether through all columns or some.
TEST(ChosenSamples, ShearedRowsSeeTheSame) {
  const Recipe recipe = opacity_recipe(24);
  const auto s = run_stages(bush(200, 0.15), recipe, false);
  for (int axis = 0; axis < 3; ++axis) {
    const Bundle grid = make_bundle(s->scene, s->plan, *s->textures, recipe, axis);
    Bundle sheared = grid;
    sheared.pattern = make_sheared_pattern(48, 12);
    const auto mean_crossings = [](const Bundle& bundle) {
      Band band;
      BandScratch scratch;
      double met = 0;
      for (int b = 0; b < bundle.bands; ++b) {
        trace_band(bundle, b, band, scratch);
        met += band.first.back();
      }
      return met / bundle.pattern.rays();
    };
    Bundle fine = grid;
    fine.pattern = make_pattern(Pattern::kGrid, 24);
    // Order: both sum the same areas by 576 points a voxel; outlines of 200 leaves of some voxels' width leave less than a thousandth.
    EXPECT_NEAR(mean_crossings(sheared) / mean_crossings(fine), 1, 1e-3) << "axis " << axis;
  }
}

TEST(MaxError, IsKeptAndRaysFollowIt) {
  const Scene scene = bush(1500, 0.1);
  double before = 0;
  for (const double error : {0.02, 0.01, 0.005}) {
    const Reached r = reach(scene, opacity_recipe(40), error, 32);
    std::printf("bush, %.3f asked for: says %.4f %.4f %.4f, is %.4f, coarser levels %.4f; %.1f rays a column\n", error, r.says[0], r.says[1], r.says[2], r.worst, r.coarse, r.rays);
    EXPECT_TRUE(r.met);
    EXPECT_LE(r.worst, error);
    EXPECT_LE(r.coarse, error);
    for (const double says : r.says) EXPECT_LE(says, error);
    EXPECT_GT(*std::max_element(r.says.begin(), r.says.end()), 0.4 * r.worst);
    EXPECT_GT(r.rays, before);
    before = r.rays;
  }
}

TEST(MaxError, OneSheetNeedsFewRays) {
  Scene scene = empty_scene();
  add_quad(scene, V3d(-1, -1, -0.2), V3d(2, 0, 0.3), V3d(0, 2, 0.1));
  const Reached r = reach(scene, opacity_recipe(40), 0.001, 16);
  EXPECT_TRUE(r.met);
  EXPECT_LT(r.worst, 1e-6);
  EXPECT_EQ(r.rays, 4);
}

TEST(MaxError, SameBytesAtAnyThreadCount) {
  const Scene scene = bush(600, 0.12);
  Recipe recipe = opacity_recipe(40);
  recipe.max_error = 0.01;
  std::vector<std::vector<float>> first;
  for (const int threads : {1, 2, 5}) {
    recipe.threads = threads;
    Report report;
    const Pack pack = bake(scene, recipe, report);
    std::vector<std::vector<float>> values;
    for (const Level& level : pack.levels) values.push_back(level.find("alpha")->values);
    for (const ErrorFigure& e : pack.errors) values.push_back({static_cast<float>(e.value)});
    for (const SliceStack& stack : pack.slices)
      for (int k = 0; k < stack.count; ++k) values.push_back(stack.image(k).pixels);
    if (first.empty()) first = values;
    EXPECT_TRUE(values == first) << threads << " threads";
  }
}

TEST(MaxError, SlabsKeepItToo) {
  Recipe recipe = opacity_recipe(96);
  recipe.want.slices = false;
  recipe.max_error = 0.01;
  recipe.memory = 1;
  const Scene scene = bush(1000, 0.1);
  Report report;
  const Pack pack = bake(scene, recipe, report);
  Recipe finest = recipe;
  finest.max_error = 0;
  finest.samples = 24;
  Report silent;
  const Pack truth = bake(scene, finest, silent);
  for (std::size_t l = 0; l < pack.levels.size(); ++l) {
    const Channel *a = pack.levels[l].find("alpha"), *t = truth.levels[l].find("alpha");
    ASSERT_EQ(a->values.size(), t->values.size());
    double square = 0;
    for (std::size_t i = 0; i < a->values.size(); ++i) square += std::pow(static_cast<double>(a->values[i]) - static_cast<double>(t->values[i]), 2);
    EXPECT_LE(std::sqrt(square / static_cast<double>(a->values.size())), 0.01) << "level " << l;
  }
}

}  // namespace
}  // namespace texel::test
