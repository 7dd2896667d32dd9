// Stage 8 and the coarser levels: sums, means, composition, inside flags.
#include "bake/levels.h"

#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

Scene shapes() {
  Scene s = empty_scene();
  add_ball(s, 1, 20);
  add_box(s, V3d(0.2, 0.3, 0.4), V3d(1.7, 1.3, 1.1));
  add_quad(s, V3d(-1.5, -1.2, -0.4), V3d(0.7, 0.2, 0.3), V3d(0.1, 0.6, -0.8));
  return s;
}
// Values of one level's border voxels in a dense table.
template <class T>
struct Table {
  V3i n;
  std::vector<T> values;
  Table(const VoxelSet& set, const V3i& counts, const std::function<T(std::int64_t)>& value) : n(counts), values(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z)) {
    for_each_voxel(set, [&](const V3i& v, std::int64_t i) { values[place(v)] = value(i); });
  }
  [[nodiscard]] std::size_t place(const V3i& v) const { return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(v.y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(v.x); }
  [[nodiscard]] bool holds(const V3i& v) const { return v.x < n.x && v.y < n.y && v.z < n.z; }
  [[nodiscard]] T at(const V3i& v) const { return holds(v) ? values[place(v)] : T{}; }
};
V3i child(const V3i& parent, int i) { return {2 * parent.x + (i & 1), 2 * parent.y + (i >> 1 & 1), 2 * parent.z + (i >> 2)}; }

TEST(Levels, MomentsAreTheChildrensSum) {
  const auto s = run_stages(shapes(), volume_recipe(37), false);
  ASSERT_GE(s->surfaces.size(), 6u);
  for (std::size_t l = 1; l < s->surfaces.size(); ++l) {
    const Grid fine = s->plan.grid.level(static_cast<int>(l) - 1);
    const Surface &f = s->surfaces[l - 1], &c = s->surfaces[l];
    const Table<Moments> table(f.set, fine.n, [&](std::int64_t i) { return f.moments[static_cast<std::size_t>(i)]; });
    const Table<Areas> areas(f.set, fine.n, [&](std::int64_t i) { return f.areas[static_cast<std::size_t>(i)]; });
    double total = 0;
    for_each_voxel(c.set, [&](const V3i& v, std::int64_t i) {
      Moments sum;
      Areas area;
      for (int k = 0; k < 8; ++k) { sum += table.at(child(v, k)); area += areas.at(child(v, k)); }
      const Moments& m = c.moments[static_cast<std::size_t>(i)];
      const Areas& a = c.areas[static_cast<std::size_t>(i)];
      const double e = 1e-14 * area.area;  // rounding: the order of eight additions
      EXPECT_NEAR(a.area, area.area, e);
      EXPECT_NEAR(a.covered, area.covered, e);
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(a.crossings[k], area.crossings[k], e);
        EXPECT_NEAR(a.stopping[k], area.stopping[k], e);
        EXPECT_NEAR(a.outward[k], area.outward[k], e);
      }
      EXPECT_NEAR(m.covered, sum.covered, e);
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(m.m[k], sum.m[k], e);
      EXPECT_NEAR(m.xx, sum.xx, e); EXPECT_NEAR(m.yy, sum.yy, e); EXPECT_NEAR(m.zz, sum.zz, e);
      EXPECT_NEAR(m.xy, sum.xy, e); EXPECT_NEAR(m.xz, sum.xz, e); EXPECT_NEAR(m.yz, sum.yz, e);
      EXPECT_GT(a.area, 0);
      total += a.area;
    });
    double below = 0;
    for (const Areas& a : f.areas) below += a.area;
    EXPECT_NEAR(total / below, 1, 1e-13);  // no child is lost, rounding
  }
}

// crossings: Σ of eight over four columns. solid: mean of eight. Both of the pack, tiles and voxels inside included.
TEST(Levels, CrossingsSolidAndInside) {
  for (const LevelMode mode : {LevelMode::kRecompute, LevelMode::kFilter}) {
    Recipe recipe = volume_recipe(45);
    recipe.level_mode = mode;
    const Pack pack = bake_quietly(shapes(), recipe);
    ASSERT_EQ(pack.levels.size(), 7u);
    for (std::size_t l = 1; l < pack.levels.size(); ++l) {
      EXPECT_EQ(pack.levels[l].grid.n, pack.grid.level(static_cast<int>(l)).n);
      EXPECT_EQ(pack.levels[l].grid.origin, pack.grid.origin);
      const Dense f = dense(pack.levels[l - 1], "solid"), c = dense(pack.levels[l], "solid");
      const Dense fx = dense(pack.levels[l - 1], "crossings"), cx = dense(pack.levels[l], "crossings");
      const Dense area = dense(pack.levels[l], "area"), fine_area = dense(pack.levels[l - 1], "area");
      for_each_cell(c.n, [&](const V3i& v) {
        double solid = 0;
        V3d crossings(0);
        bool all_inside = true, any_border = false;
        for (int k = 0; k < 8; ++k) {
          const V3i x = child(v, k);
          if (!f.holds(x)) { all_inside = false; continue; }
          solid += static_cast<double>(f.at(x)) / 8;
          crossings += V3d(fx.at3(x)) / 4;
          all_inside = all_inside && f.state(x) && !fine_area.state(x);
          any_border = any_border || fine_area.state(x);
        }
        EXPECT_NEAR(c.at(v), solid, 1e-6);  // float
        for (int a = 0; a < 3; ++a) EXPECT_NEAR(cx.at(v, a), crossings[a], 1e-5);  // float, of values up to some tens
        EXPECT_EQ(area.state(v) != 0, any_border);
        EXPECT_EQ(c.state(v) != 0 && !area.state(v), all_inside) << "inside of parents";
        if (all_inside) {
          EXPECT_EQ(c.at(v), 1);
        }
      });
    }
    // Volume is kept level by level.
    for (const Level& level : pack.levels) EXPECT_NEAR(sum_of(level, "solid") * std::pow(level.grid.h, 3) / filled_volume(pack), 1, 1e-6);  // float
  }
}

// Filter mode: 1 − mean over the four columns of Π (1 − child's alpha).
TEST(Levels, FilterFormula) {
  Recipe recipe = volume_recipe(45);
  recipe.level_mode = LevelMode::kFilter;
  const Pack pack = bake_quietly(shapes(), recipe);
  for (std::size_t l = 1; l < pack.levels.size(); ++l) {
    const Dense f = dense(pack.levels[l - 1], "alpha"), c = dense(pack.levels[l], "alpha");
    for_each_cell(c.n, [&](const V3i& v) {
      for (int axis = 0; axis < 3; ++axis) {
        double sum = 0;
        for (int q = 0; q < 4; ++q) {
          double open = 1;
          for (int d = 0; d < 2; ++d) {
            V3i x;
            x[axis] = 2 * v[axis] + d;
            x[(axis + 1) % 3] = 2 * v[(axis + 1) % 3] + (q & 1);
            x[(axis + 2) % 3] = 2 * v[(axis + 2) % 3] + (q >> 1);
            if (f.holds(x)) open *= 1 - static_cast<double>(f.at(x, axis));
          }
          sum += (1 - open) / 4;
        }
        EXPECT_NEAR(c.at(v, axis), sum, 1e-6);  // float
      }
    });
  }
}

// Recompute mode at level 1 uses every ray: opacity there is what a bake of the coarser grid with twice the sub-rays an edge sees.
TEST(Levels, RecomputedIsABakeOfTheCoarserGrid) {
  Recipe fine;
  fine.want.slices = fine.want.preview = false;
  fine.box = Box3d(V3d(-2), V3d(2));
  fine.resolution = V3i(32, 0, 0);
  fine.pattern = Pattern::kGrid;  // whose rays, unlike the lattice's, are the same for both
  fine.samples = 4;
  Recipe coarse = fine;
  coarse.resolution = V3i(16, 0, 0);
  coarse.samples = 8;
  const Pack a = bake_quietly(shapes(), fine), b = bake_quietly(shapes(), coarse);
  const Dense x = dense(a.levels[1], "alpha"), y = dense(b.levels[0], "alpha"), area_a = dense(a.levels[1], "area"), area_b = dense(b.levels[0], "area");
  std::int64_t compared = 0, differ = 0;
  for_each_cell(x.n, [&](const V3i& v) {
    // Surface that only touches a wall may leave a sliver of rounding's size behind it, in either grid.
    if ((x.state(v) != 0) != (y.state(v) != 0)) {
      const double sliver = x.state(v) ? static_cast<double>(area_a.at(v)) : static_cast<double>(area_b.at(v));
      EXPECT_LE(sliver, 1e-12);
      return;
    }
    for (int k = 0; k < 3; ++k) {
      compared += x.state(v) != 0;
      differ += std::abs(x.at(v, k) - y.at(v, k)) > 1e-6f;
      // Fixed point is 2⁻¹⁶ of a voxel of another size: a ray on an edge may differ, one of 64 (and one more on an opposite edge).
      EXPECT_NEAR(x.at(v, k), y.at(v, k), 2.0 / 64 + 1e-6);
    }
  });
  EXPECT_LE(differ, compared / 100);
  std::printf("levels: recomputed level 1 against a bake of the coarser grid: %lld of %lld values differ\n", static_cast<long long>(differ), static_cast<long long>(compared));
}
TEST(Levels, CountAndEnd) {
  Recipe recipe = volume_recipe(45);
  recipe.levels = 3;
  EXPECT_EQ(bake_quietly(shapes(), recipe).levels.size(), 3u);
  recipe.levels = 100;
  EXPECT_EQ(bake_quietly(shapes(), recipe).levels.size(), 7u);
  recipe.want.levels = false;
  EXPECT_EQ(bake_quietly(shapes(), recipe).levels.size(), 1u);
}

}  // namespace
}  // namespace texel::test
