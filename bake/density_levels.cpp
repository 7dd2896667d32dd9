#include "bake/density_levels.h"

#include <tbb/parallel_for.h>

#include <utility>

#include "bake/block_index.h"

namespace texel {
namespace {

// Shares of the columns that pass a cube of 2^k level-0 voxels a side, k >= 3: (v, u) of each axis. Empty: all or none pass, by `kind`.
struct Cube {
  Brick::Kind kind = Brick::Kind::kEmpty;
  std::array<std::vector<float>, 3> columns;
};

// Eight cubes into one: columns through the two behind each other multiply.
Cube merge(const std::array<const Cube*, 8>& children, int side) {
  Cube parent;
  bool empty = true, full = true;
  for (const Cube* c : children) {
    empty = empty && (!c || c->kind == Brick::Kind::kEmpty);
    full = full && c && c->kind == Brick::Kind::kFull;
  }
  parent.kind = empty ? Brick::Kind::kEmpty : full ? Brick::Kind::kFull : Brick::Kind::kMixed;
  if (empty || full) return parent;
  const auto width = static_cast<std::size_t>(2 * side);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float>& to = parent.columns[static_cast<std::size_t>(axis)];
    to.assign(width * width, 1.0f);
    for (int c = 0; c < 8; ++c) {
      const Cube* child = children[static_cast<std::size_t>(c)];
      if (!child || child->kind == Brick::Kind::kEmpty) continue;
      const V3i corner(c & 1, c >> 1 & 1, c >> 2);
      const auto u0 = static_cast<std::size_t>((axis == 0 ? corner.y : corner.x) * side), v0 = static_cast<std::size_t>((axis == 2 ? corner.y : corner.z) * side);
      for (std::size_t v = 0; v < static_cast<std::size_t>(side); ++v)
        for (std::size_t u = 0; u < static_cast<std::size_t>(side); ++u)
          to[(v0 + v) * width + u0 + u] *= child->kind == Brick::Kind::kFull ? 0.0f : child->columns[static_cast<std::size_t>(axis)][v * static_cast<std::size_t>(side) + u];
    }
  }
  return parent;
}

}  // namespace

void coarse_opacity(const std::vector<Brick>& bricks, V3i n, const std::vector<Surface>& surfaces, std::vector<Visibility>& seen) {
  const auto place = [](const V3i& b, const V3i& size) {
    return (static_cast<std::size_t>(b.z) * static_cast<std::size_t>(size.y) + static_cast<std::size_t>(b.y)) * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(b.x);
  };
  for (std::size_t level = 1; level < surfaces.size() && level <= 3; ++level) {
    const int length = 8 >> level;
    for (std::size_t a = 0; a < 3; ++a) seen[level].alpha[a].resize(static_cast<std::size_t>(surfaces[level].set.count));
    for_each_voxel(surfaces[level].set, [&](const V3i& voxel, std::int64_t index) {
      const V3i b(voxel.x / length, voxel.y / length, voxel.z / length), in(voxel.x % length, voxel.y % length, voxel.z % length);
      const Brick& brick = bricks[place(b, n)];
      for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const Brick::Passing& passing = brick.passing[a];  // a voxel with surface: the brick is mixed
        const int u = axis == 0 ? in.y : in.x, v = axis == 2 ? in.y : in.z;
        const auto i = static_cast<std::size_t>((v * length + u) * length + in[axis]);
        seen[level].alpha[a][static_cast<std::size_t>(index)] = 1 - (level == 1 ? passing.level1[i] : level == 2 ? passing.level2[i] : passing.level3);
      }
    });
  }
  if (surfaces.size() <= 4) return;
  std::vector<Cube> cubes(bricks.size());
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    cubes[i].kind = bricks[i].kind;
    if (bricks[i].kind != Brick::Kind::kMixed) continue;
    for (std::size_t a = 0; a < 3; ++a) cubes[i].columns[a].assign(bricks[i].passing[a].columns.begin(), bricks[i].passing[a].columns.end());
  }
  int side = 8;
  for (std::size_t level = 4; level < surfaces.size(); ++level, side *= 2) {
    const V3i up((n.x + 1) / 2, (n.y + 1) / 2, (n.z + 1) / 2);
    std::vector<Cube> parents(static_cast<std::size_t>(up.x) * static_cast<std::size_t>(up.y) * static_cast<std::size_t>(up.z));
    tbb::parallel_for(0, up.z, [&](int z) {
      for (int y = 0; y < up.y; ++y)
        for (int x = 0; x < up.x; ++x) {
          std::array<const Cube*, 8> children{};
          for (int c = 0; c < 8; ++c)
            if (const V3i at(2 * x + (c & 1), 2 * y + (c >> 1 & 1), 2 * z + (c >> 2)); at.x < n.x && at.y < n.y && at.z < n.z)
              children[static_cast<std::size_t>(c)] = &cubes[place(at, n)];
          parents[place(V3i(x, y, z), up)] = merge(children, side);
        }
    });
    for (std::size_t a = 0; a < 3; ++a) seen[level].alpha[a].resize(static_cast<std::size_t>(surfaces[level].set.count));
    for_each_voxel(surfaces[level].set, [&](const V3i& voxel, std::int64_t index) {
      const Cube& cube = parents[place(voxel, up)];
      for (std::size_t a = 0; a < 3; ++a) {
        double mean = 0;
        for (const float c : cube.columns[a]) mean += static_cast<double>(c);
        seen[level].alpha[a][static_cast<std::size_t>(index)] = static_cast<float>(1 - mean / static_cast<double>(cube.columns[a].size()));
      }
    });
    cubes = std::move(parents);
    n = up;
  }
}

}  // namespace texel
