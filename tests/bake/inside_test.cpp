// What is inside, against exact predicates (CGAL): 120 turned, scaled and moved meshes; slices without holes.
#ifdef TEXEL_HAVE_EXACT
#include <tbb/parallel_for.h>

#include <atomic>

#include "bake/exact.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

const std::vector<std::string> kSix{"spot/spot_triangulated.obj", "bunny_closed.off", "armadillo.off", "hedge/hedgeTextured.obj", "fixed_top.ply", "quadknot.obj"};

// Centred, longest side 1.
Scene unit_size(Scene scene) {
  Box3d box;
  for (const V3d& p : scene.mesh.points) box.extendBy(p);
  const V3d size = box.size();
  const double longest = std::max({size.x, size.y, size.z});
  return transformed(std::move(scene), [&](const V3d& p) { return (p - box.center()) / longest; });
}
V3i cell_of(const Grid& grid, const V3d& p) {
  const V3d v = grid.to_voxel(p);
  return {static_cast<int>(std::floor(v.x)), static_cast<int>(std::floor(v.y)), static_cast<int>(std::floor(v.z))};
}

TEST(ExactInside, KnowsACube) {
  Scene s = empty_scene();
  add_box(s, V3d(0), V3d(1));
  add_triangle(s, V3d(5), V3d(5), V3d(6));  // no area: left out
  const ExactInside exact(s.mesh.points, s.mesh.triangles);
  EXPECT_EQ(exact.side(V3d(0.5)), Side::kInside);
  EXPECT_EQ(exact.side(V3d(0.5, 0.5, 1)), Side::kOnSurface);
  EXPECT_EQ(exact.side(V3d(1, 1, 1)), Side::kOnSurface);
  EXPECT_EQ(exact.side(V3d(0.5, 0.5, std::nextafter(1.0, 0.0))), Side::kInside);
  EXPECT_EQ(exact.side(V3d(0.5, 0.5, std::nextafter(1.0, 2.0))), Side::kOutside);
  EXPECT_EQ(exact.side(V3d(0, 0, -1)), Side::kOutside);
  EXPECT_EQ(exact.distance(V3d(0.5, 0.5, 3)), 2);
}

// `solid` > ½ where a point is inside, < ½ where it is outside, for points not nearer than a voxel's edge to the surface. (Such a point
// may lie in a corner of a voxel that holds surface; at least an eighth of a ball of that radius, 0.52 of the voxel, is then on its side.)
TEST(Inside, AgreesWithExactPredicates) {
  Random random(20240607);
  std::int64_t asked = 0, far = 0, near = 0, inside = 0, wrong = 0, packs = 0;
  for (const std::string& name : kSix) {
    Scene model;
    std::string reason;
    if (!load_model(name, model, reason)) GTEST_SKIP() << reason;
    model = unit_size(std::move(model));
    for (int turn = 0; turn < 20; ++turn) {
      SCOPED_TRACE(name + " turn " + std::to_string(turn));
      const Rotation rotation = random_rotation(random);
      const double scale = std::pow(10.0, random.uniform(-6, 6));
      // Offsets up to 1e6, a third of them in units of the model, the others as far as double still has 1/30 of a voxel.
      const double offset = turn % 3 == 0 ? scale * 1e6 * random.uniform() : std::min(1e6, scale * 1e12) * std::pow(10.0, random.uniform(-6, 0));
      const V3d moved = random.direction() * offset;
      const Scene scene = transformed(model, [&](const V3d& p) { return rotation(p) * scale + moved; });
      Recipe recipe = volume_recipe(turn % 2 ? 48 : 33);
      recipe.want.color = recipe.want.ndf = recipe.want.material = recipe.want.levels = recipe.want.density = false;
      const Pack pack = bake_quietly(scene, recipe);
      ++packs;
      const Grid& grid = pack.grid;
      const Dense solid = dense(pack.levels[0], "solid"), area = dense(pack.levels[0], "area");
      const ExactInside exact(scene.mesh.points, scene.mesh.triangles);

      std::vector<V3d> points;
      std::vector<char> known_far;
      const auto propose = [&](const V3d& p) {
        const V3i v = cell_of(grid, p);
        if (!solid.holds(v)) return;
        bool is_far = true;  // no surface in the 5³ neighbourhood: two whole voxels lie between
        for (int i = 0; i < 125 && is_far; ++i) is_far = !area.state(v + V3i(i % 5 - 2, i / 5 % 5 - 2, i / 25 - 2));
        points.push_back(p);
        known_far.push_back(is_far);
      };
      const auto corner = [&] {
        return scene.mesh.points[scene.mesh.triangles[static_cast<std::size_t>(random.uniform() * static_cast<double>(scene.mesh.triangles.size()))][0]];
      };
      for (int i = 0; i < 600; ++i) propose(grid.origin + V3d(random.uniform() * grid.n.x, random.uniform() * grid.n.y, random.uniform() * grid.n.z) * grid.h);
      for (int i = 0; i < 600; ++i) {  // on chords, half of them inside
        const V3d a = corner(), b = corner();
        propose(a + (b - a) * random.uniform());
      }
      for (int i = 0; i < 300; ++i) propose(corner() + random.direction() * grid.h * random.uniform(1, 2.5));  // close to the surface, where errors would be
      std::atomic<std::int64_t> bad{0}, in{0}, used_far{0}, used_near{0};
      tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
        if (!known_far[i] && exact.distance(points[i]) < grid.h) return;
        (known_far[i] ? used_far : used_near)++;
        const bool truth = exact.side(points[i]) == Side::kInside;
        in += truth;
        bad += (solid.at(cell_of(grid, points[i])) > 0.5f) != truth;
      });
      EXPECT_EQ(bad, 0) << "scale " << scale << " offset " << offset;
      wrong += bad;
      inside += in;
      far += used_far;
      near += used_near;
    }
  }
  asked = far + near;
  EXPECT_GE(asked, 100000);
  std::printf("inside: %lld packs, %lld points (%lld with no surface in 5x5x5 voxels, %lld by exact distance), %lld inside, %lld wrong\n", static_cast<long long>(packs),
              static_cast<long long>(asked), static_cast<long long>(far), static_cast<long long>(near), static_cast<long long>(inside), static_cast<long long>(wrong));
}

// Every voxel without surface is wholly inside or outside. Regions of such voxels that touch by a face are one; the exact test is asked
// once a region and at some voxels of it at random.
TEST(Slices, NoHolesAndNothingOutside) {
  Random random(7);
  std::int64_t full = 0, empty = 0, holes = 0, border = 0, stacks = 0;
  for (const std::string& name : kSix) {
    SCOPED_TRACE(name);
    Scene scene;
    std::string reason;
    if (!load_model(name, scene, reason)) GTEST_SKIP() << reason;
    const Rotation rotation = random_rotation(random);
    scene = transformed(unit_size(std::move(scene)), rotation);
    Recipe recipe = volume_recipe(64);
    recipe.want.slices = true;
    recipe.want.color = recipe.want.ndf = recipe.want.material = recipe.want.levels = recipe.want.density = false;
    const Pack pack = bake_quietly(scene, recipe);
    const Grid& grid = pack.grid;
    const ExactInside exact(scene.mesh.points, scene.mesh.triangles);
    const Dense area = dense(pack.levels[0], "area");
    std::vector<signed char> truth(area.active.size(), -1);  // 0 outside, 1 inside, 2 border
    for (std::size_t i = 0; i < truth.size(); ++i)
      if (area.active[i]) truth[i] = 2;
    for_each_cell(grid.n, [&](const V3i& seed) {
      if (truth[area.place(seed)] >= 0) return;
      const signed char side = exact.side(grid.centre(seed)) == Side::kInside ? 1 : 0;
      std::vector<V3i> stack{seed};
      truth[area.place(seed)] = side;
      while (!stack.empty()) {
        const V3i v = stack.back();
        stack.pop_back();
        if (random.uniform() < 0.005) {
          EXPECT_EQ(exact.side(grid.centre(v)) == Side::kInside, side == 1);
        }
        for (int a = 0; a < 6; ++a) {
          V3i to = v;
          to[a / 2] += a % 2 ? 1 : -1;
          if (!area.holds(to) || truth[area.place(to)] >= 0) continue;
          truth[area.place(to)] = side;
          stack.push_back(to);
        }
      }
    });
    for (const SliceStack& s : pack.slices) {
      ++stacks;
      for (int k = 0; k < s.count; ++k) {
        const Image image = s.image(k);
        const auto voxel = [&](int x, int y) {
          const int row = s.height - 1 - y;
          return s.axis == 2 ? V3i(x, row, k) : s.axis == 1 ? V3i(x, k, row) : V3i(k, x, row);
        };
        std::vector<char> open(static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height), 0);  // transparent and joined to the picture's edge
        const auto place = [&](int x, int y) { return static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width) + static_cast<std::size_t>(x); };
        std::vector<std::array<int, 2>> stack;
        for (int y = 0; y < s.height; ++y)
          for (int x = 0; x < s.width; ++x) {
            const float alpha = image.at(x, y)[3];
            const signed char side = truth[area.place(voxel(x, y))];
            if (side == 1) { EXPECT_EQ(alpha, 1) << "slice " << k << " axis " << s.axis; ++full; }
            if (side == 0) { EXPECT_EQ(alpha, 0) << "slice " << k << " axis " << s.axis; ++empty; }
            border += side == 2;
            if (alpha <= 0 && (x == 0 || y == 0 || x == s.width - 1 || y == s.height - 1)) { open[place(x, y)] = 1; stack.push_back({x, y}); }
          }
        while (!stack.empty()) {
          const auto [x, y] = stack.back();
          stack.pop_back();
          for (int d = 0; d < 9; ++d) {
            const int nx = x + d % 3 - 1, ny = y + d / 3 - 1;
            if (nx < 0 || ny < 0 || nx >= s.width || ny >= s.height || open[place(nx, ny)] || image.at(nx, ny)[3] > 0) continue;
            open[place(nx, ny)] = 1;
            stack.push_back({nx, ny});
          }
        }
        for (int y = 0; y < s.height; ++y)
          for (int x = 0; x < s.width; ++x) {
            if (image.at(x, y)[3] > 0 || open[place(x, y)]) continue;
            bool all = true;  // inside at every depth of the slab
            V3d p = grid.centre(voxel(x, y));
            for (const double depth : {0.1, 0.3, 0.5, 0.7, 0.9}) {
              p[s.axis] = grid.origin[s.axis] + (k + depth) * grid.h;
              all = all && exact.side(p) == Side::kInside;
            }
            holes += all;
          }
      }
    }
  }
  EXPECT_EQ(holes, 0);
  std::printf("slices: %lld stacks; %lld pixels wholly inside, all opaque; %lld outside, all clear; %lld with surface; %lld holes\n", static_cast<long long>(stacks),
              static_cast<long long>(full), static_cast<long long>(empty), static_cast<long long>(border), static_cast<long long>(holes));
}

}  // namespace
}  // namespace texel::test
#endif
