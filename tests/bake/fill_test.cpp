// Stage 1 and the fill: which solids are filled, which components are turned.
#include "formats/error.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

void add_ball_at(Scene& scene, const V3d& centre, double radius, int rings, bool inside_out = false) {
  const std::size_t points = scene.mesh.points.size(), triangles = scene.mesh.triangles.size();
  add_ball(scene, radius, rings);
  for (std::size_t i = points; i < scene.mesh.points.size(); ++i) scene.mesh.points[i] += centre;
  if (inside_out) turn_faces(scene, triangles, scene.mesh.triangles.size());
}
double ball_volume(double radius, int rings) {
  Scene s = empty_scene();
  add_ball(s, radius, rings);
  return mesh_volume(s.mesh);
}
Recipe fill_recipe(int resolution) {
  Recipe recipe = volume_recipe(resolution);
  recipe.want.ndf = recipe.want.color = recipe.want.material = recipe.want.levels = false;
  return recipe;
}
float solid_at(const Pack& pack, const V3d& world) {
  const V3d v = pack.grid.to_voxel(world);
  return dense(pack.levels[0], "solid").at(V3i(static_cast<int>(std::floor(v.x)), static_cast<int>(std::floor(v.y)), static_cast<int>(std::floor(v.z))));
}
// Chords at 16 rays a voxel and axis: statistical, below 5e-4 of the volume for a ball at 32³.
constexpr double kVolume = 5e-4;

TEST(Fill, Ball) {
  Scene s = empty_scene();
  add_ball_at(s, V3d(0.1, 0.2, 0.3), 1, 24);
  const Pack pack = bake_quietly(s, fill_recipe(32));
  EXPECT_NEAR(filled_volume(pack) / ball_volume(1, 24), 1, kVolume);
  EXPECT_EQ(solid_at(pack, V3d(0.1, 0.2, 0.3)), 1);
  EXPECT_TRUE(pack.issues.empty());
}
TEST(Fill, InsideOutInnerBallIsACavity) {
  Scene s = empty_scene();
  add_ball_at(s, V3d(0), 1, 24);
  add_ball_at(s, V3d(0.1, 0, 0), 0.5, 16, true);
  const Pack pack = bake_quietly(s, fill_recipe(32));
  EXPECT_NEAR(filled_volume(pack) / (ball_volume(1, 24) - ball_volume(0.5, 16)), 1, kVolume);
  EXPECT_EQ(solid_at(pack, V3d(0.1, 0, 0)), 0);
  EXPECT_FALSE(has_issue(pack, "mesh-inside-out"));
  EXPECT_NEAR(pack.statistics.volume / (ball_volume(1, 24) - ball_volume(0.5, 16)), 1, 1e-9);  // rounding
}
TEST(Fill, CavityFirstInTheFileToo) {
  Scene s = empty_scene();
  add_ball_at(s, V3d(0.1, 0, 0), 0.5, 16, true);
  add_ball_at(s, V3d(0), 1, 24);
  const Pack pack = bake_quietly(s, fill_recipe(32));
  EXPECT_EQ(solid_at(pack, V3d(0.1, 0, 0)), 0);
  EXPECT_EQ(solid_at(pack, V3d(-0.7, 0, 0)), 1);
}
TEST(Fill, CoreWithinACavity) {
  Scene s = empty_scene();
  add_ball_at(s, V3d(0), 1, 24);
  add_ball_at(s, V3d(0), 0.7, 20, true);
  add_ball_at(s, V3d(0), 0.4, 16);
  const Pack pack = bake_quietly(s, fill_recipe(40));
  EXPECT_EQ(solid_at(pack, V3d(0)), 1);
  EXPECT_EQ(solid_at(pack, V3d(0.55, 0, 0)), 0);
  EXPECT_EQ(solid_at(pack, V3d(0.85, 0, 0)), 1);
}
TEST(Fill, NestedOfTheSameSenseStaysFull) {
  Scene s = empty_scene();
  add_ball_at(s, V3d(0), 1, 24);
  add_ball_at(s, V3d(0.1, 0, 0), 0.5, 16);
  const Pack pack = bake_quietly(s, fill_recipe(32));
  EXPECT_NEAR(filled_volume(pack) / ball_volume(1, 24), 1, kVolume);
  EXPECT_EQ(solid_at(pack, V3d(0.1, 0, 0)), 1);
}
TEST(Fill, CrossingBallsAreTheirUnion) {
  Scene s = empty_scene();
  const double r = 1, d = 1.1;
  add_ball_at(s, V3d(0), r, 64);
  add_ball_at(s, V3d(d, 0, 0), r, 64);
  const Pack pack = bake_quietly(s, fill_recipe(48));
  const double lens = M_PI * (4 * r + d) * (2 * r - d) * (2 * r - d) / 12, ball = 4 * M_PI / 3 * r * r * r;
  // 64 rings lose about (π/64)²/2 of a ball's volume, the lens likewise.
  EXPECT_NEAR(filled_volume(pack) / (2 * ball - lens), 1, 2.5e-3);
  EXPECT_NEAR(filled_volume(pack) / (2 * ball_volume(r, 64) - lens * ball_volume(r, 64) / ball), 1, 1e-3);
  EXPECT_EQ(solid_at(pack, V3d(d / 2, 0, 0)), 1);
}
TEST(Fill, InsideOutOuterIsTurned) {
  Scene s = empty_scene();
  add_ball_at(s, V3d(0), 1, 24, true);
  const Pack pack = bake_quietly(s, fill_recipe(32));
  EXPECT_TRUE(has_issue(pack, "mesh-inside-out"));
  EXPECT_NEAR(filled_volume(pack) / ball_volume(1, 24), 1, kVolume);
  EXPECT_NEAR(pack.statistics.volume / ball_volume(1, 24), 1, 1e-9);  // rounding
  // The stored normals point outward.
  const Dense normal = dense(pack.levels[0], "normal");
  for_each_cell(normal.n, [&](const V3i& v) {
    if (!normal.state(v)) return;
    const V3d from = pack.grid.centre(v);
    EXPECT_GT(V3d(normal.at3(v)).dot(from), 0);
  });
}
TEST(Fill, BothInsideOut) {  // a hollow ball, turned as a whole: turned back as a whole, it is hollow still
  Scene s = empty_scene();
  add_ball_at(s, V3d(0), 1, 24, true);
  add_ball_at(s, V3d(0), 0.5, 16, false);
  const Pack pack = bake_quietly(s, fill_recipe(32));
  EXPECT_TRUE(has_issue(pack, "mesh-inside-out"));
  EXPECT_EQ(solid_at(pack, V3d(0)), 0);
  EXPECT_EQ(solid_at(pack, V3d(0.75, 0, 0)), 1);
}
TEST(Fill, TouchingCubesShareAFace) {
  for (const bool welded : {false, true}) {
    SCOPED_TRACE(welded);
    Scene s = empty_scene();
    add_box(s, V3d(0, 0, 0), V3d(1, 1, 1));
    add_box(s, V3d(1, 0, 0), V3d(2, 1, 1));  // the shared face is there twice, once each way: corners at equal positions are one anyway
    if (welded)
      for (auto& t : s.mesh.triangles)
        for (std::uint32_t& v : t)
          for (std::uint32_t i = 0; i < v; ++i)
            if (s.mesh.points[i] == s.mesh.points[v]) { v = i; break; }
    for (const int resolution : {18, 23}) {  // faces on walls, and not
      Recipe recipe = fill_recipe(resolution);
      const Pack pack = bake_quietly(s, recipe);
      // Exact on walls, but for floats. Else chords have exact ends, and their number in a column is whole: a share of 16 for the
      // columns along the rim.
      EXPECT_NEAR(filled_volume(pack), 2, resolution == 18 ? 4e-6 : 2e-3);
      EXPECT_EQ(solid_at(pack, V3d(0.5, 0.5, 0.5)), 1);
      EXPECT_EQ(solid_at(pack, V3d(1.5, 0.5, 0.5)), 1);
      EXPECT_EQ(pack.statistics.closed, pack.statistics.components);
    }
  }
}
TEST(Fill, CubesSharingAnEdge) {  // four triangles at one edge: they cancel, so the whole is closed
  Scene s = empty_scene();
  add_box(s, V3d(0, 0, 0), V3d(1, 1, 1));
  add_box(s, V3d(1, 1, 0), V3d(2, 2, 1));
  const Pack pack = bake_quietly(s, fill_recipe(23));
  EXPECT_NEAR(pack.statistics.volume, 2, 1e-9);
  EXPECT_EQ(solid_at(pack, V3d(0.5, 0.5, 0.5)), 1);
  EXPECT_EQ(solid_at(pack, V3d(1.5, 1.5, 0.5)), 1);
  EXPECT_EQ(solid_at(pack, V3d(0.5, 1.5, 0.5)), 0);
}
TEST(Fill, OpenBoxIsASurface) {
  Scene s = empty_scene();
  add_box(s, V3d(0), V3d(1), false, 31);
  const Pack pack = bake_quietly(s, fill_recipe(20));
  EXPECT_TRUE(has_issue(pack, "mesh-open"));
  EXPECT_EQ(solid_at(pack, V3d(0.5)), 0);
  EXPECT_EQ(sum_of(pack.levels[0], "solid"), 0);
  EXPECT_EQ(pack.statistics.closed, 0);
  Recipe must = fill_recipe(20);
  must.fill = Fill::kOn;
  EXPECT_THROW((void)bake_quietly(s, must), Error);
}
TEST(Fill, OpenBesideClosed) {
  Scene s = empty_scene();
  add_box(s, V3d(0), V3d(1));
  add_box(s, V3d(2, 0, 0), V3d(3, 1, 1), false, 31);
  add_quad(s, V3d(-0.5, 0.5, 0.5), V3d(2, 0, 0), V3d(0, 0.2, 0.2));  // a sheet through the solid changes nothing inside
  const Pack pack = bake_quietly(s, fill_recipe(37));
  EXPECT_TRUE(has_issue(pack, "mesh-open"));
  EXPECT_NEAR(filled_volume(pack), 1, 1e-5);
}
TEST(Fill, FlippedFacesAreTurnedBack) {
  Scene s = empty_scene();
  add_ball_at(s, V3d(0), 1, 24);
  Scene straight = s;
  Random random(1);
  std::size_t flipped = 0;
  for (std::size_t t = 1; t < s.mesh.triangles.size(); ++t)
    if (random.uniform() < 0.3) { turn_faces(s, t, t + 1); ++flipped; }
  ASSERT_GT(flipped, 100u);
  const Pack a = bake_quietly(s, fill_recipe(32)), b = bake_quietly(straight, fill_recipe(32));
  EXPECT_TRUE(has_issue(a, "mesh-flipped"));
  EXPECT_NEAR(filled_volume(a) / ball_volume(1, 24), 1, kVolume);
  const Channel *x = a.levels[0].find("normal"), *y = b.levels[0].find("normal");
  ASSERT_EQ(x->values.size(), y->values.size());
  for (std::size_t i = 0; i < x->values.size(); ++i) ASSERT_NEAR(x->values[i], y->values[i], 1e-6);  // float
}
// The face that is wrong is the first one: what most say still holds, for a cavity too.
TEST(Fill, FlippedFirstFaces) {
  Scene s = empty_scene();
  add_ball_at(s, V3d(0), 1, 24);
  const std::size_t cavity = s.mesh.triangles.size();
  add_ball_at(s, V3d(0), 0.5, 16, true);
  turn_faces(s, 0, 1);
  turn_faces(s, cavity, cavity + 3);
  const Pack pack = bake_quietly(s, fill_recipe(32));
  const double expected = ball_volume(1, 24) - ball_volume(0.5, 16);
  EXPECT_NEAR(filled_volume(pack) / expected, 1, kVolume);
  EXPECT_NEAR(pack.statistics.volume / expected, 1, 1e-9);  // rounding
  EXPECT_FALSE(has_issue(pack, "mesh-inside-out"));
  for (const Issue& i : pack.issues)
    if (i.id == "mesh-flipped") { EXPECT_EQ(i.count, 4); }
  EXPECT_TRUE(has_issue(pack, "mesh-flipped"));
}
// In a cavity there is nothing to take away: what faces inwards there is inside out, and is turned.
TEST(Fill, InsideOutWithinACavity) {
  Scene s = empty_scene();
  add_ball_at(s, V3d(0), 1, 24);
  add_ball_at(s, V3d(0), 0.7, 20, true);
  add_ball_at(s, V3d(0), 0.4, 16, true);
  Scene straight = empty_scene();
  add_ball_at(straight, V3d(0), 1, 24);
  add_ball_at(straight, V3d(0), 0.7, 20, true);
  add_ball_at(straight, V3d(0), 0.4, 16);
  const Pack a = bake_quietly(s, fill_recipe(32)), b = bake_quietly(straight, fill_recipe(32));
  EXPECT_TRUE(has_issue(a, "mesh-inside-out"));
  EXPECT_NEAR(a.statistics.volume / (ball_volume(1, 24) - ball_volume(0.7, 20) + ball_volume(0.4, 16)), 1, 1e-9);  // rounding
  const Channel *x = a.levels[0].find("normal"), *y = b.levels[0].find("normal");
  ASSERT_EQ(x->values.size(), y->values.size());
  for (std::size_t i = 0; i < x->values.size(); ++i) ASSERT_NEAR(x->values[i], y->values[i], 1e-6);  // float
}
// Matter within matter is there once.
TEST(Fill, NestedVolumesCountOnce) {
  Scene s = empty_scene();
  add_box(s, V3d(0), V3d(6));
  add_box(s, V3d(1), V3d(5));
  add_box(s, V3d(2), V3d(4), true);  // a cavity of the inner one alone: matter still, of the outer
  add_box(s, V3d(7, 0, 0), V3d(9, 2, 2));
  const Pack pack = bake_quietly(s, fill_recipe(40));
  EXPECT_NEAR(pack.statistics.volume, 216 + 8, 1e-9);
  EXPECT_NEAR(filled_volume(pack), 216 + 8, 1e-5);
  EXPECT_TRUE(pack.issues.empty());
}
// What a column's sum rounds to is no matter: an open sheet above a solid has none behind it, to the bit, or a renderer would take it for a body's wall.
TEST(Fill, SheetsAboveSolidsAreNoBodies) {
  Random random(3);
  for (int k = 0; k < 20; ++k) {
    Scene s = empty_scene();
    const Rotation turn = random_rotation(random);
    add_box(s, V3d(-1, -1, -0.4), V3d(1, 1, 0.4));
    for (V3d& p : s.mesh.points) p = turn(p);
    add_quad(s, V3d(-3, -3, 2.5), V3d(6, 0, 0.2), V3d(0, 6, 0.1));
    add_quad(s, V3d(-3, -3, -3.5), V3d(6, 0, -0.1), V3d(0, 6, 0.3));
    const Pack pack = bake_quietly(s, fill_recipe(48));
    const auto solid = dense(pack.levels[0], "solid");
    std::int64_t sheets = 0;
    for_each_cell(pack.grid.n, [&](const V3i& v) {
      const double z = pack.grid.centre(v).z;
      if (std::abs(z) < 1.8) return;  // the box, turned
      ASSERT_EQ(solid.at(v), 0) << k << ", " << v;
      ++sheets;
    });
    ASSERT_GT(sheets, 10000);
  }
}
TEST(Fill, OffFillsNothing) {
  Scene s = empty_scene();
  add_box(s, V3d(0), V3d(1));
  Recipe recipe = fill_recipe(20);
  recipe.fill = Fill::kOff;
  EXPECT_EQ(sum_of(bake_quietly(s, recipe).levels[0], "solid"), 0);
}
TEST(Fill, TransparentTakesNoPart) {
  Scene s = empty_scene();
  s.materials[0].opacity = 0.3f;
  add_box(s, V3d(0), V3d(1));
  const Pack pack = bake_quietly(s, fill_recipe(20));
  EXPECT_EQ(solid_at(pack, V3d(0.5)), 0);
}

}  // namespace
}  // namespace texel::test
