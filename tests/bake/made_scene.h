#pragma once
// Small scenes made in memory. Test code only.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "formats/scene.h"

namespace texel::test {

// One grey material, no triangles.
inline Scene empty_scene() {
  Scene scene;
  scene.materials.emplace_back().name = "grey";
  return scene;
}

// A preset of --hypertexture about the ball of radius 1.
inline Scene density_preset(const char* name) {
  Scene scene;
  scene.materials.resize(1);
  EXPECT_TRUE(find_hypertexture(name, &scene.hypertexture.emplace()));
  return scene;
}

// The parallelogram from `corner` along a and b, its normal a×b, uv from (0,0) at `corner` to (1,1).
inline void add_quad(Scene& scene, const V3d& corner, const V3d& a, const V3d& b, std::uint32_t material = 0) {
  Mesh& mesh = scene.mesh;
  const auto p = static_cast<std::uint32_t>(mesh.points.size()), t = static_cast<std::uint32_t>(mesh.uvs.size());
  for (const V3d& v : {corner, corner + a, corner + a + b, corner + b}) mesh.points.push_back(v);
  for (const V2f& v : {V2f(0, 0), V2f(1, 0), V2f(1, 1), V2f(0, 1)}) mesh.uvs.push_back(v);
  for (const std::array<std::uint32_t, 3>& c : {std::array<std::uint32_t, 3>{0, 1, 2}, std::array<std::uint32_t, 3>{0, 2, 3}}) {
    mesh.triangles.push_back({p + c[0], p + c[1], p + c[2]});
    mesh.uv_corners.push_back({t + c[0], t + c[1], t + c[2]});
    mesh.materials.push_back(material);
  }
}

// A ball of rings × 2·rings quads about the origin, vertices on the sphere, its front outside.
inline void add_ball(Scene& scene, double radius, int rings, std::uint32_t material = 0) {
  Mesh& mesh = scene.mesh;
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  const int around = 2 * rings;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j < around; ++j) {
      const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * j / around;
      const double ring = i == 0 || i == rings ? 0 : std::sin(theta);
      mesh.points.push_back(V3d(ring * std::cos(phi), ring * std::sin(phi), std::cos(theta)) * radius + V3d(0, 0, 0));  // no −0 at the poles
    }
  const auto at = [&](int i, int j) { return first + static_cast<std::uint32_t>(i * around + j % around); };
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.triangles.push_back({a, b, c});
    mesh.uv_corners.push_back({kNoIndex, kNoIndex, kNoIndex});
    mesh.materials.push_back(material);
  };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      if (i > 0) add(at(i, j), at(i + 1, j), at(i, j + 1));
      if (i + 1 < rings) add(at(i, j + 1), at(i + 1, j), at(i + 1, j + 1));
    }
}

}  // namespace texel::test
