#include "formats/triangulate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace texel {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

struct Cut {
  std::vector<Triangle> triangles;
  bool simple;
  V3d sum{0, 0, 0};   // of the triangles' vector areas: the polygon's own, whatever the cut
  double area = 0;    // of the triangles: larger than the sum's length where they overlap
};

Cut cut(const std::vector<V3d>& corners) {
  Triangulator triangulate;
  const auto span = triangulate(corners);
  Cut c{{span.begin(), span.end()}, !triangulate.was_not_simple()};
  for (const Triangle& t : c.triangles) {
    const V3d n = (corners[t[1]] - corners[t[0]]).cross(corners[t[2]] - corners[t[0]]) * 0.5;
    c.sum += n;
    c.area += n.length();
  }
  return c;
}

TEST(Triangulate, ConvexIsAFanFromTheFirstCorner) {
  EXPECT_EQ(cut({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}).triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  // With a corner on an edge, and bent out of its plane.
  EXPECT_EQ(cut({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0.3}, {0, 2, 0}}).triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(Triangulate, TooFewCorners) {
  EXPECT_TRUE(cut({}).triangles.empty());
  EXPECT_TRUE(cut({{0, 0, 0}, {1, 0, 0}}).triangles.empty());
}

// Scaled rounding: areas of order 1, some tens of operations.
constexpr double kRounding = 1e-12;

TEST(Triangulate, ConcaveQuadsFromEachStart) {
  const std::vector<V3d> arrow = {{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}};  // area 4
  for (std::size_t start = 0; start < 4; ++start) {
    std::vector<V3d> turned;
    for (std::size_t i = 0; i < 4; ++i) turned.push_back(arrow[(start + i) % 4]);
    const Cut c = cut(turned);
    EXPECT_TRUE(c.simple);
    EXPECT_EQ(c.triangles.size(), 2u);
    EXPECT_NEAR(c.area, 4, 4 * kRounding);
    EXPECT_NEAR(c.sum.z, 4, 4 * kRounding);
  }
}

TEST(Triangulate, HoleJoinedByABridge) {
  // A 9 × 9 square with a 3 × 3 hole: one polygon that goes along the bridge twice.
  const Cut c = cut({{0, 0, 0}, {9, 0, 0}, {9, 9, 0}, {0, 9, 0}, {0, 0, 0}, {3, 3, 0}, {3, 6, 0}, {6, 6, 0}, {6, 3, 0}, {3, 3, 0}});
  EXPECT_TRUE(c.simple);
  EXPECT_EQ(c.triangles.size(), 8u);
  EXPECT_NEAR(c.area, 72, 72 * kRounding);
}

TEST(Triangulate, CrossingItselfIsAFanAndSaysSo) {
  const Cut bow = cut({{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 3, 0}});
  EXPECT_FALSE(bow.simple);
  EXPECT_EQ(bow.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
  std::vector<V3d> pentagram;  // turns left at each corner, but goes round twice
  for (int i = 0; i < 5; ++i) pentagram.emplace_back(std::cos(i * 4 * M_PI / 5), std::sin(i * 4 * M_PI / 5), 0);
  EXPECT_FALSE(cut(pentagram).simple);
}

TEST(Triangulate, WithoutAreaStillEnds) {
  EXPECT_EQ(cut(std::vector<V3d>(7, V3d(1, 1, 1))).triangles.size(), 5u);
  EXPECT_EQ(cut({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 0, 0}}).triangles.size(), 2u);
  const double nan = std::nan("");
  EXPECT_EQ(cut({{0, 0, 0}, {1, nan, 0}, {2, 0, 0}, {5, 0, 0}}).triangles.size(), 2u);
  EXPECT_EQ(cut({{0, 0, 0}, {1e300, 0, 0}, {1e300, 1e300, 0}, {0, 1e300, 0}, {5e299, 5e299, 0}}).triangles.size(), 3u);
}

// Star-shaped polygons in a random plane, far from the origin: no overlap, so the areas add up.
TEST(Triangulate, RandomSimplePolygons) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < 500; ++round) {
    const int n = 4 + round % 60;
    const V3d right = V3d(unit(random), unit(random), unit(random) + 0.1).normalized();
    const V3d up = right.cross(V3d(unit(random) + 0.1, -1, unit(random))).normalized();
    std::vector<V3d> polygon;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * M_PI * (i + 0.8 * unit(random)) / n, radius = 0.1 + unit(random);
      polygon.push_back(V3d(1000, -2000, 500) + right * (radius * std::cos(angle)) + up * (radius * std::sin(angle)));
    }
    const Cut c = cut(polygon);
    ASSERT_TRUE(c.simple) << round;
    ASSERT_EQ(c.triangles.size(), static_cast<std::size_t>(n - 2));
    // Scaled rounding: coordinates of 2000 carry 2e-13, times the circumference of up to 60 edges.
    ASSERT_NEAR(c.area, c.sum.length(), 1e-10) << round;
  }
}

TEST(Triangulate, LongCombEndsInTime) {
  // 4000 teeth: every other corner is reflex. About n² steps: well under a second.
  std::vector<V3d> comb;
  for (int i = 0; i <= 4000; ++i) comb.emplace_back(i, i % 2 ? 1 : 10, 0);
  comb.emplace_back(4000, 0, 0);
  comb.emplace_back(0, 0, 0);
  const Cut c = cut(comb);
  EXPECT_EQ(c.triangles.size(), comb.size() - 2);
  EXPECT_TRUE(c.simple);
  EXPECT_NEAR(c.area, c.sum.length(), 22000 * kRounding * 100);
}

}  // namespace
}  // namespace texel
