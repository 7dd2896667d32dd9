#include "bake/levels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "bake/block_index.h"

namespace texel {
namespace {

// Index among a set's values, or −1.
std::int64_t find(const VoxelSet& set, const BlockIndex& index, const V3i& voxel) {
  const std::int32_t b = index(V3i(voxel.x >> 3, voxel.y >> 3, voxel.z >> 3));
  if (b < 0) return -1;
  const Block& block = set.blocks[static_cast<std::size_t>(b)];
  return block.has(voxel.x & 7, voxel.y & 7, voxel.z & 7) ? block.index(voxel.x & 7, voxel.y & 7, voxel.z & 7) : -1;
}

// One block of children, 2×2×2 bits into one where all eight are set, into its octant of the parent.
void merge_mask(const std::array<std::uint64_t, 8>& child, const V3i& octant, std::array<std::uint64_t, 8>& parent) {
  for (int x = 0; x < 4; ++x) {
    std::uint64_t all = child[static_cast<std::size_t>(2 * x)] & child[static_cast<std::size_t>(2 * x + 1)];
    all &= all >> 1;
    all &= all >> 8;
    for (int y = 0; y < 4; ++y)
      for (int z = 0; z < 4; ++z)
        if ((all >> (2 * y << 3 | 2 * z)) & 1u)
          parent[static_cast<std::size_t>(octant.x * 4 + x)] |= std::uint64_t{1} << ((octant.y * 4 + y) << 3 | (octant.z * 4 + z));
  }
}

void merge_inside(const Visibility& fine, const V3i& coarse_voxels, Visibility& coarse) {
  const V3i n((coarse_voxels.x + 7) / 8, (coarse_voxels.y + 7) / 8, (coarse_voxels.z + 7) / 8);
  std::vector<std::int32_t> slot(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z), -1);
  std::vector<Block> parents;
  std::array<std::uint64_t, 8> full;
  full.fill(~std::uint64_t{0});
  const auto merge = [&](const V3i& at, const std::array<std::uint64_t, 8>& mask) {
    const V3i up(at.x >> 1, at.y >> 1, at.z >> 1);
    std::int32_t& s = slot[(static_cast<std::size_t>(up.z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(up.y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(up.x)];
    if (s < 0) {
      s = static_cast<std::int32_t>(parents.size());
      parents.emplace_back().at = up;
    }
    merge_mask(mask, V3i(at.x & 1, at.y & 1, at.z & 1), parents[static_cast<std::size_t>(s)].mask);
  };
  for (const Block& b : fine.inside.blocks) merge(b.at, b.mask);
  for (const V3i& at : fine.inside_blocks) merge(at, full);
  for (const std::int32_t s : slot) {
    if (s < 0) continue;
    const Block& b = parents[static_cast<std::size_t>(s)];
    add_inside(b.at, b.mask, coarse);
  }
}

// A voxel with matter in it below one without surface.
struct EdgeChild {
  V3i voxel;
  Visibility::Edge value;
};

// Parents without surface that are inside in part: those at the grid's upper walls whose other children lie beyond, and what lies above such ones.
void make_edges(std::vector<EdgeChild>& children, const std::vector<std::int64_t>& places, Visibility& coarse) {
  // By parent, in the order of a VoxelSet.
  std::vector<std::size_t> order(children.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return places[a] != places[b] ? places[a] < places[b] : a < b; });
  for (std::size_t i = 0, j = 0; i < order.size(); i = j) {
    float columns[3][4] = {};
    double solid = 0;
    for (; j < order.size() && places[order[j]] == places[order[i]]; ++j) {
      const EdgeChild& child = children[order[j]];
      const V3i bit(child.voxel.x & 1, child.voxel.y & 1, child.voxel.z & 1);
      solid += static_cast<double>(child.value.solid) / 8;
      for (int a = 0; a < 3; ++a) {
        // One behind the other they are cut alike, so that both stop the same rays.
        float& column = columns[a][(a == 0 ? bit.y : bit.x) + 2 * (a == 2 ? bit.y : bit.z)];
        column = std::max(column, child.value.alpha[a]);
      }
    }
    const V3i& first = children[order[i]].voxel;
    const V3i up(first.x >> 1, first.y >> 1, first.z >> 1), at(up.x >> 3, up.y >> 3, up.z >> 3);
    std::vector<Block>& blocks = coarse.edge.blocks;
    if (blocks.empty() || blocks.back().at != at) coarse.edge.add(at, {});
    blocks.back().mask[static_cast<std::size_t>(up.x & 7)] |= std::uint64_t{1} << ((up.y & 7) << 3 | (up.z & 7));
    ++coarse.edge.count;
    Visibility::Edge edge{{}, static_cast<float>(solid)};
    for (int a = 0; a < 3; ++a) edge.alpha[a] = (columns[a][0] + columns[a][1] + columns[a][2] + columns[a][3]) / 4;
    coarse.edges.push_back(edge);
  }
}

}  // namespace

void filter_visibility(const Surface& fine, const Visibility& fine_seen, const Surface& coarse, int level, const V3i& coarse_voxels, bool opacity, Visibility& coarse_seen) {
  const auto count = static_cast<std::size_t>(coarse.set.count);
  const double face = std::pow(4.0, level);  // level-0 voxel faces in one of the coarse level's
  const BlockIndex parents(coarse.set, coarse_voxels);
  std::vector<double> solid(count, 0.0);
  // Opacity: per parent and axis, the share that each of the four columns stops. Of what passes, a float would not tell a faint voxel from none.
  std::array<std::vector<std::array<double, 4>>, 3> stopped;
  for (std::size_t a = 0; a < 3; ++a) {
    if (opacity && !fine_seen.alpha[a].empty()) stopped[a].assign(count, {0, 0, 0, 0});
  }
  const auto pass = [&](std::size_t axis, std::int64_t parent, const V3i& voxel, double alpha) {
    const int u = axis == 0 ? voxel.y & 1 : voxel.x & 1, v = axis == 2 ? voxel.y & 1 : voxel.z & 1;
    double& column = stopped[axis][static_cast<std::size_t>(parent)][static_cast<std::size_t>(u + 2 * v)];
    column += alpha * (1 - column);
  };
  for_each_voxel(fine.set, [&](const V3i& voxel, std::int64_t i) {
    const std::int64_t p = find(coarse.set, parents, V3i(voxel.x >> 1, voxel.y >> 1, voxel.z >> 1));
    const auto from = static_cast<std::size_t>(i), to = static_cast<std::size_t>(p);
    if (!fine_seen.solid.empty()) solid[to] += static_cast<double>(fine_seen.solid[from]) / 8;
    for (std::size_t a = 0; a < 3; ++a) {
      if (!stopped[a].empty()) pass(a, p, voxel, static_cast<double>(fine_seen.alpha[a][from]));
    }
  });
  // Inside children of a border parent. Whole inside blocks are at most half of a parent block and are visited voxel by voxel only
  // where the parent block holds border voxels at all.
  const auto inside_child = [&](const V3i& voxel) {
    const std::int64_t p = find(coarse.set, parents, V3i(voxel.x >> 1, voxel.y >> 1, voxel.z >> 1));
    if (p < 0) return;
    solid[static_cast<std::size_t>(p)] += 1.0 / 8;
    for (std::size_t a = 0; a < 3; ++a)
      if (!stopped[a].empty()) pass(a, p, voxel, 1);
  };
  for_each_voxel(fine_seen.inside, [&](const V3i& voxel, std::int64_t) { inside_child(voxel); });
  for (const V3i& at : fine_seen.inside_blocks) {
    if (parents(V3i(at.x >> 1, at.y >> 1, at.z >> 1)) < 0) continue;
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y)
        for (int z = 0; z < 8; ++z) inside_child(V3i(at.x * 8 + x, at.y * 8 + y, at.z * 8 + z));
  }
  // Matter whose parent has no surface and is not wholly inside.
  std::vector<EdgeChild> orphans;
  std::vector<std::int64_t> places;     // of their parents, ascending in the order of a VoxelSet
  const BlockIndex grid({}, coarse_voxels);
  const auto orphan = [&](const V3i& voxel, const Visibility::Edge& value) {
    const V3i up(voxel.x >> 1, voxel.y >> 1, voxel.z >> 1);
    orphans.push_back({voxel, value});
    places.push_back(static_cast<std::int64_t>(grid.place(V3i(up.x >> 3, up.y >> 3, up.z >> 3))) << 9 | (up.x & 7) << 6 | (up.y & 7) << 3 | (up.z & 7));
  };
  for (const Block& b : fine_seen.inside.blocks) {
    std::array<std::uint64_t, 8> whole{};
    merge_mask(b.mask, V3i(0, 0, 0), whole);
    for (int x = 0; x < 8; ++x)
      for (std::uint64_t word = b.mask[static_cast<std::size_t>(x)]; word; word &= word - 1) {
        const int bit = __builtin_ctzll(word), y = bit >> 3, z = bit & 7;
        const V3i voxel(b.at.x * 8 + x, b.at.y * 8 + y, b.at.z * 8 + z);
        if ((whole[static_cast<std::size_t>(x / 2)] >> ((y / 2) << 3 | z / 2) & 1u) == 0 && find(coarse.set, parents, V3i(voxel.x >> 1, voxel.y >> 1, voxel.z >> 1)) < 0) orphan(voxel, {{1, 1, 1}, 1});
      }
  }
  for_each_voxel(fine_seen.edge, [&](const V3i& voxel, std::int64_t i) {
    const Visibility::Edge& value = fine_seen.edges[static_cast<std::size_t>(i)];
    const std::int64_t p = find(coarse.set, parents, V3i(voxel.x >> 1, voxel.y >> 1, voxel.z >> 1));
    if (p < 0) return orphan(voxel, value);
    solid[static_cast<std::size_t>(p)] += static_cast<double>(value.solid) / 8;
    for (std::size_t a = 0; a < 3; ++a)
      if (!stopped[a].empty()) pass(a, p, voxel, static_cast<double>(value.alpha[a]));
  });
  make_edges(orphans, places, coarse_seen);
  if (!fine_seen.visible.empty()) {
    coarse_seen.visible.resize(count);
    for_each_voxel(fine.set, [&](const V3i& voxel, std::int64_t i) {
      const std::int64_t p = find(coarse.set, parents, V3i(voxel.x >> 1, voxel.y >> 1, voxel.z >> 1));
      coarse_seen.visible[static_cast<std::size_t>(p)] += fine_seen.visible[static_cast<std::size_t>(i)];
    });
  }
  // Likewise of a voxel by itself; where rays have seen the level, it has its own.
  if (!fine_seen.seen_material.empty() && coarse_seen.seen_material.empty()) {
    coarse_seen.seen_material.resize(count);
    for_each_voxel(fine.set, [&](const V3i& voxel, std::int64_t i) {
      const std::int64_t p = find(coarse.set, parents, V3i(voxel.x >> 1, voxel.y >> 1, voxel.z >> 1));
      coarse_seen.seen_material[static_cast<std::size_t>(p)] += fine_seen.seen_material[static_cast<std::size_t>(i)];
    });
  }
  coarse_seen.solid.assign(solid.begin(), solid.end());
  for (std::size_t a = 0; a < 3; ++a) {
    if (!stopped[a].empty()) {
      coarse_seen.alpha[a].resize(count);
      for (std::size_t i = 0; i < count; ++i) {
        const auto& s = stopped[a][i];
        coarse_seen.alpha[a][i] = static_cast<float>((s[0] + s[1] + s[2] + s[3]) / 4);
      }
    }
    // As level 0 has it, see fill_fractions. Filtered opacity is what its children say.
    const int axis = static_cast<int>(a);
    for (std::size_t i = 0; i < coarse_seen.alpha[a].size(); ++i) {
      const bool matter = coarse_seen.solid[i] > 0;
      if (matter && (opacity || solid[i] > kThinMatter)) continue;
      const double most = matter ? most_met(coarse.areas[i], axis) / face + solid[i] : coarse.areas[i].crossings[axis] / face;
      coarse_seen.alpha[a][i] = std::min(coarse_seen.alpha[a][i], static_cast<float>(most));
    }
  }
  merge_inside(fine_seen, coarse_voxels, coarse_seen);
}

}  // namespace texel
