#pragma once
// A subdivided icosahedron as OBJ text, made in memory: v, vt, vn and three materials, as an exporter writes them.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "formats/grid.h"

namespace texel {

// 20·4^level triangles; level 8: 1.31 million, 138 MB.
inline std::string sphere_obj(int level) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<V3d> points = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0}, {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g}, {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  std::vector<std::array<std::uint32_t, 3>> faces = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                                     {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8}, {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}};
  for (V3d& p : points) p.normalize();
  for (int l = 0; l < level; ++l) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto found = middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(points.size()));
      if (found.second) points.push_back((points[a] + points[b]).normalized());
      return found.first->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    finer.reserve(faces.size() * 4);
    for (const auto& [a, b, c] : faces) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  std::string text = "# subdivided icosahedron\no sphere\n";
  char line[160];
  const auto add = [&](int length) { text.append(line, static_cast<std::size_t>(length)); };
  for (const V3d& p : points) add(std::snprintf(line, sizeof line, "v %.9f %.9f %.9f\n", p.x, p.y, p.z));
  for (const V3d& p : points) add(std::snprintf(line, sizeof line, "vt %.6f %.6f\n", 0.5 + std::atan2(p.y, p.x) / (2 * M_PI), 0.5 + std::asin(p.z) / M_PI));
  for (const V3d& p : points) add(std::snprintf(line, sizeof line, "vn %.6f %.6f %.6f\n", p.x, p.y, p.z));
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (i % ((faces.size() + 2) / 3) == 0) add(std::snprintf(line, sizeof line, "usemtl part_%zu\ns 1\n", i * 3 / faces.size()));
    const std::uint32_t a = faces[i][0] + 1, b = faces[i][1] + 1, c = faces[i][2] + 1;
    add(std::snprintf(line, sizeof line, "f %u/%u/%u %u/%u/%u %u/%u/%u\n", a, a, a, b, b, b, c, c, c));
  }
  return text;
}

}  // namespace texel
