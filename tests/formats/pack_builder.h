#pragma once
// Made-up packs for tests: a filled ball with every usual grid, levels, slices and a preview. Test code only.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "formats/pack.h"

namespace texel::test {

struct BallOptions {
  int n = 32;                    // voxels along x; y has n, z has n + 3 (so that no axis can be taken for another)
  int levels = 4;                // 0: slices only
  V3d origin{-1.5, 2.0, 0.25};
  double h = 0.125;
  V3d centre{0, 0, 0};           // voxel space; zero: the grid's middle
  double radius = 0;             // voxels; zero: 0.4 n
  V3f color{0.8f, 0.3f, 0.1f};
  bool slices = true, preview = true;
  int slice_levels = 0;          // coarser stacks beside level 0
};

// What the ball is made of in one voxel.
struct BallCell {
  float solid = 0, area = 0;  // area / h²
  V3f normal{0, 0, 0};        // m / A
};

struct BallLevel {
  Grid grid;
  std::vector<BallCell> cells;  // x fastest
  [[nodiscard]] bool in(int x, int y, int z) const {
    return x >= 0 && y >= 0 && z >= 0 && x < grid.n.x && y < grid.n.y && z < grid.n.z;
  }
  [[nodiscard]] std::size_t at(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(grid.n.y) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(grid.n.x) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] BallCell cell(int x, int y, int z) const { return in(x, y, z) ? cells[at(x, y, z)] : BallCell{}; }
  [[nodiscard]] bool matter(int x, int y, int z) const { const BallCell c = cell(x, y, z); return c.solid > 0 || c.area > 0; }
};

using CellTest = std::function<bool(int x, int y, int z)>;

// The layer of the voxels of an n.x × n.y × n.z grid for which `active` holds. Blocks for which `uniform` holds become tiles.
inline Layer make_layer(const V3i& n, const CellTest& active, const CellTest& uniform_block = {}) {
  Layer layer;
  for (int bz = 0; bz * 8 < n.z; ++bz)
    for (int by = 0; by * 8 < n.y; ++by)
      for (int bx = 0; bx * 8 < n.x; ++bx) {
        if (uniform_block && uniform_block(bx, by, bz)) { layer.tiles.emplace_back(bx, by, bz); continue; }
        Block block;
        block.at = V3i(bx, by, bz);
        block.first = layer.set.count;
        for (int x = 0; x < 8; ++x)
          for (int y = 0; y < 8; ++y)
            for (int z = 0; z < 8; ++z) {
              const V3i v(bx * 8 + x, by * 8 + y, bz * 8 + z);
              if (v.x >= n.x || v.y >= n.y || v.z >= n.z || !active(v.x, v.y, v.z)) continue;
              block.mask[static_cast<std::size_t>(x)] |= std::uint64_t{1} << (y << 3 | z);
              ++layer.set.count;
            }
        if (layer.set.count > block.first) layer.set.blocks.push_back(block);
      }
  return layer;
}

// Adds a channel with value(x, y, z) at every active voxel, and at the first voxel of every tile.
inline void add_channel(Layer& layer, const std::string& name, int components, const std::function<V3f(int, int, int)>& value) {
  Channel channel;
  channel.name = name;
  channel.components = components;
  const auto put = [&](std::vector<float>& to, const V3f& v) {
    for (int c = 0; c < components; ++c) to.push_back(v[c]);
  };
  for (const Block& b : layer.set.blocks)
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y)
        for (int z = 0; z < 8; ++z)
          if (b.has(x, y, z)) put(channel.values, value(b.at.x * 8 + x, b.at.y * 8 + y, b.at.z * 8 + z));
  for (const V3i& t : layer.tiles) put(channel.tiles, value(t.x * 8, t.y * 8, t.z * 8));
  layer.channels.push_back(std::move(channel));
}

inline BallLevel finest_ball(const BallOptions& o) {
  BallLevel level;
  level.grid = {o.origin, o.h, V3i(o.n, o.n, o.n + 3)};
  const V3i n = level.grid.n;
  level.cells.resize(static_cast<std::size_t>(level.grid.voxels()));
  const V3d centre = o.centre == V3d(0) ? V3d(n.x, n.y, n.z) / 2.0 : o.centre;
  const double radius = o.radius > 0 ? o.radius : 0.4 * o.n;
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        const V3d out = V3d(x + 0.5, y + 0.5, z + 0.5) - centre;
        if (std::abs(out.length() - radius) > 1 && out.length() > radius) continue;
        int inside = 0;
        constexpr int s = 6;
        for (int k = 0; k < s * s * s; ++k) {
          const V3d p(x + (k % s + 0.5) / s, y + (k / s % s + 0.5) / s, z + (k / s / s + 0.5) / s);
          inside += (p - centre).length() < radius;
        }
        BallCell& cell = level.cells[level.at(x, y, z)];
        cell.solid = static_cast<float>(inside) / (s * s * s);
        if (inside == 0 || inside == s * s * s) continue;
        const V3d d = out.normalized();
        cell.area = static_cast<float>(1.5 - std::abs(cell.solid - 0.5));
        cell.normal = V3f(d) * 0.96875f;
      }
  return level;
}

inline BallLevel coarser_ball(const BallLevel& fine) {
  BallLevel coarse;
  coarse.grid = fine.grid.level(1);
  coarse.cells.resize(static_cast<std::size_t>(coarse.grid.voxels()));
  for (int z = 0; z < coarse.grid.n.z; ++z)
    for (int y = 0; y < coarse.grid.n.y; ++y)
      for (int x = 0; x < coarse.grid.n.x; ++x) {
        BallCell& sum = coarse.cells[coarse.at(x, y, z)];
        for (int c = 0; c < 8; ++c) {
          const BallCell child = fine.cell(2 * x + (c & 1), 2 * y + (c >> 1 & 1), 2 * z + (c >> 2));
          sum.solid += child.solid / 8;
          sum.area += child.area / 4;
          sum.normal += child.normal * (child.area / 4);
        }
        if (sum.area > 0) sum.normal /= sum.area;
      }
  return coarse;
}

inline V3f ball_alpha(const BallCell& c) {
  const float a = c.solid >= 1 ? 1.0f : std::min(1.0f, std::max(c.solid, c.area / 3));
  return {a, a, a};
}

inline V3f ball_direction(const BallCell& c) {
  return c.normal.length() > 1e-4f ? c.normal.normalized() : V3f(0, 0, 1);
}

// Layers "matter" (density, alpha, solid; whole blocks inside are tiles), "surface" and "colour" of one level.
inline Level ball_level(const BallLevel& ball, const V3f& color) {
  Level level;
  level.grid = ball.grid;
  const double h = ball.grid.h;
  const CellTest full = [&](int bx, int by, int bz) {
    for (int k = 0; k < 512; ++k)
      if (const BallCell c = ball.cell(bx * 8 + (k >> 6), by * 8 + (k >> 3 & 7), bz * 8 + (k & 7)); c.solid < 1 || c.area > 0) return false;
    return true;
  };
  Layer matter = make_layer(ball.grid.n, [&](int x, int y, int z) { return ball.matter(x, y, z); }, full);
  add_channel(matter, "density", 1, [&](int x, int y, int z) {
    const double a = ball_alpha(ball.cell(x, y, z)).x;
    return V3f(static_cast<float>(std::min(9.21, -std::log(std::max(1e-4, 1 - a))) / h));
  });
  add_channel(matter, "alpha", 3, [&](int x, int y, int z) { return ball_alpha(ball.cell(x, y, z)); });
  add_channel(matter, "solid", 1, [&](int x, int y, int z) { return V3f(ball.cell(x, y, z).solid); });
  level.layers.push_back(std::move(matter));

  Layer surface = make_layer(ball.grid.n, [&](int x, int y, int z) { return ball.cell(x, y, z).area > 0; });
  add_channel(surface, "area", 1, [&](int x, int y, int z) { return V3f(ball.cell(x, y, z).area); });
  add_channel(surface, "normal", 3, [&](int x, int y, int z) { return ball.cell(x, y, z).normal; });
  add_channel(surface, "S_diag", 3, [&](int x, int y, int z) { const V3f d = ball_direction(ball.cell(x, y, z)); return d * d; });
  add_channel(surface, "S_off", 3, [&](int x, int y, int z) {
    const V3f d = ball_direction(ball.cell(x, y, z));
    return V3f(d.x * d.y, d.x * d.z, d.y * d.z);
  });
  add_channel(surface, "crossings", 3, [&](int x, int y, int z) {
    const BallCell c = ball.cell(x, y, z);
    return V3f(std::abs(c.normal.x), std::abs(c.normal.y), std::abs(c.normal.z)) * c.area;
  });
  level.layers.push_back(std::move(surface));

  Layer run_on = make_layer(ball.grid.n, [&](int x, int y, int z) {
    for (int k = 0; k < 125; ++k)
      if (ball.matter(x + k % 5 - 2, y + k / 5 % 5 - 2, z + k / 25 - 2)) return true;
    return false;
  });
  add_channel(run_on, "Cd", 3, [&](int x, int y, int z) {
    const float t = static_cast<float>((x * 7 + y * 3 + z) % 16) / 64;
    return V3f(color.x * (1 - t), color.y + t * 0.5f, color.z + t);
  });
  level.layers.push_back(std::move(run_on));
  return level;
}

// Slice k of the stack along `axis`: alpha is `solid`, colour goes over the picture and runs on under alpha 0.
inline Image ball_slice(const BallLevel& ball, int axis, int k, const V3f& color) {
  const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  Image image{ball.grid.n[u], ball.grid.n[v], 4, {}};
  image.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4);
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      V3i p;
      p[axis] = k;
      p[u] = column;
      p[v] = image.height - 1 - row;
      float* pixel = image.at(column, row);
      const float t = static_cast<float>(column) / static_cast<float>(image.width);
      pixel[0] = color.x * t;
      pixel[1] = color.y;
      pixel[2] = color.z + 0.5f * static_cast<float>(row) / static_cast<float>(image.height);
      pixel[3] = ball.cell(p.x, p.y, p.z).solid;
    }
  return image;
}

inline Pack ball_pack(const BallOptions& o = {}) {
  Pack pack;
  std::vector<BallLevel> balls{finest_ball(o)};
  for (int l = 1; l < std::max(o.levels, o.slice_levels + 1); ++l) balls.push_back(coarser_ball(balls.back()));
  pack.grid = balls[0].grid;
  for (int l = 0; l < o.levels; ++l) pack.levels.push_back(ball_level(balls[static_cast<std::size_t>(l)], o.color));
  if (o.slices)
    for (int l = 0; l <= o.slice_levels; ++l)
      for (int axis = 0; axis < 3; ++axis) {
        const BallLevel& ball = balls[static_cast<std::size_t>(l)];
        SliceStack stack;
        stack.axis = axis;
        stack.level = l;
        stack.count = ball.grid.n[axis];
        stack.width = ball.grid.n[axis == 0 ? 1 : 0];
        stack.height = ball.grid.n[axis == 2 ? 1 : 2];
        stack.thickness = ball.grid.h;
        stack.max_angle = 54.735610317245346;
        stack.image = [ball, axis, color = o.color](int k) { return ball_slice(ball, axis, k, color); };
        pack.slices.push_back(std::move(stack));
      }
  if (o.preview) {
    pack.preview = {24, 16, 4, {}};
    for (int i = 0; i < 24 * 16; ++i)
      for (int c = 0; c < 4; ++c) pack.preview.pixels.push_back(c == 3 ? 1.0f : static_cast<float>(i % 24) / 23 * o.color[c]);
  }
  Statistics& s = pack.statistics;
  s.triangles = 1280;
  s.components = s.closed = 1;
  for (const BallCell& c : balls[0].cells) {
    s.area += static_cast<double>(c.area) * o.h * o.h;
    s.volume += static_cast<double>(c.solid) * o.h * o.h * o.h;
    s.border_voxels += c.area > 0;
    s.inside_voxels += c.area <= 0 && c.solid > 0;
  }
  s.covered_area = s.area;
  s.mean_color = o.color;
  pack.errors.push_back({"axis_alpha_rms", 0.001953125, "made up for the test"});
  pack.issues.push_back({"mesh-open", "2 components are open and were left unfilled", 2, "ball.obj:17"});
  pack.skipped.push_back({"texture leaf.png", "no triangle uses it"});
  pack.recipe_json = R"({"margin":1,"resolution":[32,32,35],"voxel_size":0.1})";
  return pack;
}

}  // namespace texel::test
