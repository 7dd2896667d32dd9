// Parts of implicit solids that pass between lattice points: warned of where there are such, never where there are none.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "bake/polygonize.h"
#include "formats/error.h"
#include "formats/expression.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

// Cells of edge 1 from the origin on, beside a large ball, so that there is a surface.
constexpr int kSide = 40;
std::int64_t warned_of(const std::string& expression, int resolution = kSide, const Box3d& box = Box3d(V3d(0, 0, 0), V3d(kSide, kSide, kSide))) {
  Scene scene = empty_scene();
  scene.implicits.push_back({read_expression(expression), 0, box, 0, "--implicit"});
  Recipe recipe = volume_recipe(resolution);
  recipe.box = box;
  Report report;
  (void)polygonize(scene, recipe, report);
  for (const Issue& i : report.issues)
    if (i.id == "implicit-thin") return i.count;
  return 0;
}
std::string number(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "(%.17g)", v);
  return text;
}
std::string ball(const V3d& c, double radius) {
  return number(radius) + " - length(x - " + number(c.x) + ", y - " + number(c.y) + ", z - " + number(c.z) + ")";
}
const std::string kLarge = "10 - length(x - 14.3, y - 14.1, z - 14.7)";

TEST(ThinParts, OfABallThatTouchesNoLatticePoint) {
  EXPECT_EQ(warned_of("max(" + kLarge + ", " + ball(V3d(30.5, 30.5, 30.5), 0.4) + ")"), 1);
  EXPECT_EQ(warned_of("max(" + kLarge + ", " + ball(V3d(30, 30, 30), 0.4) + ")"), 0) << "a lattice point is in it";
  EXPECT_EQ(warned_of(kLarge), 0);
}

// Wherever the ball lies: warned of unless a lattice point is in it. The function is a distance, or falls off ever faster or ever slower.
TEST(ThinParts, OfBallsAnywhere) {
  Random random(6);
  int missed = 0, all = 0;
  for (int round = 0; round < 100; ++round) {
    const V3d c(random.uniform(28, 36), random.uniform(28, 36), random.uniform(28, 36));
    const V3d nearest(std::round(c.x), std::round(c.y), std::round(c.z));
    if ((c - nearest).length() < 0.45) continue;
    const std::string square = "((x - " + number(c.x) + ")^2 + (y - " + number(c.y) + ")^2 + (z - " + number(c.z) + ")^2)";
    for (const std::string& f : {ball(c, 0.4), "0.16 - " + square, "0.16/" + square + " - 1"}) {
      ++all;
      missed += warned_of("max(" + kLarge + ", " + f + ")") == 0;
    }
  }
  std::printf("balls of 0.4 voxel between lattice points: %d of %d warned of\n", all - missed, all);
  EXPECT_GT(all, 150);
  EXPECT_LE(missed, all / 20);
}

// A plate of 0.2 voxel at an angle. Those cells that it passes without a corner in it can be told exactly.
TEST(ThinParts, OfAPlateAtAnAngle) {
  std::int64_t passed = 0;
  for_each_cell(V3i(kSide, kSide, kSide), [&](const V3i& cell) {
    bool above = false, below = false, within = false;
    for (int c = 0; c < 8; ++c) {
      const double v = (2.0 * (cell.x + (c & 1)) + 3.0 * (cell.y + (c >> 1 & 1)) + 6.0 * (cell.z + (c >> 2))) / 7 - 20.3;
      within = within || std::abs(v) <= 0.1;
      above = above || v > 0.1;
      below = below || v < -0.1;
    }
    passed += above && below && !within;
  });
  const std::int64_t thin = warned_of("0.1 - abs((2*x + 3*y + 6*z)/7 - 20.3)"), thick = warned_of("0.9 - abs((2*x + 3*y + 6*z)/7 - 20.3)");
  std::printf("plate of 0.2 voxel: %lld of %lld voxels warned of; of 1.8: %lld\n", static_cast<long long>(thin), static_cast<long long>(passed), static_cast<long long>(thick));
  EXPECT_LE(thin, passed);
  EXPECT_GT(thin, passed / 4);
  EXPECT_EQ(thick, 0);
}

// Parts as thick as a voxel and more, of which bulges poke through walls everywhere.
TEST(ThinParts, NotOfThickParts) {
  const double tau = 2 * std::numbers::pi;
  const Box3d period(V3d(0, 0, 0), V3d(tau, tau, tau));
  const std::string gyroid = "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)";
  Random random(3);
  for (const int n : {12, 16, 24, 33, 48, 96}) {
    const V3d shift(random.uniform(), random.uniform(), random.uniform());
    const Box3d moved(shift + V3d(-1.7, -1.7, -1.7), shift + V3d(1.5, 1.5, 1.5));
    const auto of = [&](const std::string& f, const Box3d& box) { return warned_of(f, n, box); };
    EXPECT_EQ(of("1 - length(x, y, z)", moved), 0) << n;
    EXPECT_EQ(of("1 - x*x - y*y - z*z", moved), 0) << n;
    EXPECT_EQ(of("0.35 - length(length(x, y) - 0.85, z)", moved), 0) << n;
    EXPECT_EQ(of("1 - max(abs(x), abs(y), abs(z))", moved), 0) << n;
    EXPECT_EQ(of("min(1.5 - x - y, x - y + 1, y + z + 1, 1 - z)", moved), 0) << n;
    EXPECT_EQ(of(gyroid, period), 0) << n;
    EXPECT_EQ(of("a = max(1 - ((x - 0.5)^2 + y*y + z*z), 0); b = max(1 - ((x + 0.5)^2 + y*y + z*z), 0); a^3 + b^3 - 0.3", moved), 0) << n;
    EXPECT_EQ(of("noise(x*2, y*2, z*2)", moved), 0) << n;
    EXPECT_EQ(of("min(x + y/2, 0.6*z - x)", moved), 0) << n << ": an edge of 40 degrees";
    // Edges of every angle: where the surfaces all but touch they are thin for some voxels.
    EXPECT_LE(of("min(" + gyroid + ", 4 - length(x - 3, y - 3, z - 3))", period), 8) << n;
  }
}

TEST(ThinParts, SaysWhatToDo) {
  Scene scene = empty_scene();
  const Box3d box(V3d(0, 0, 0), V3d(kSide, kSide, kSide));
  scene.implicits.push_back({read_expression("max(" + kLarge + ", " + ball(V3d(30.5, 30.5, 30.5), 0.4) + ")"), 0, box, 0, "--implicit"});
  Recipe recipe = volume_recipe(kSide);
  recipe.box = box;
  const Pack pack = bake_quietly(scene, recipe);
  ASSERT_TRUE(has_issue(pack, "implicit-thin"));
  recipe.resolution = V3i(2 * kSide, 0, 0);  // and so it is
  EXPECT_FALSE(has_issue(bake_quietly(scene, recipe), "implicit-thin"));

  recipe.resolution = V3i(kSide, 0, 0);
  scene.implicits[0].field = read_expression(ball(V3d(30.5, 30.5, 30.5), 0.4));
  try {
    (void)bake_quietly(scene, recipe);
    ADD_FAILURE() << "no error";
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "--implicit: the solid is thinner than a voxel and passes between the lattice points; choose a finer --resolution");
  }
}

}  // namespace
}  // namespace texel::test
