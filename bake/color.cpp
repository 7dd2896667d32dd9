#include "bake/color.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "bake/block_index.h"

namespace texel {
namespace {

bool before(const V3i& a, const V3i& b) { return a.z != b.z ? a.z < b.z : a.y != b.y ? a.y < b.y : a.x < b.x; }

void number(VoxelSet& set) {
  set.count = 0;
  for (Block& b : set.blocks) {
    b.first = set.count;
    set.count += count_voxels(b.mask);
  }
}

// The 10×10×10 neighbourhood of a block as bits: rows along z, bit z+1.
struct Padded {
  std::array<std::array<std::uint16_t, 10>, 10> row{};

  Padded(const VoxelSet& set, const BlockIndex& index, const V3i& at) {
    for (int bx = -1; bx <= 1; ++bx)
      for (int by = -1; by <= 1; ++by)
        for (int bz = -1; bz <= 1; ++bz) {
          const std::int32_t s = index(V3i(at.x + bx, at.y + by, at.z + bz));
          if (s < 0) continue;
          const Block& b = set.blocks[static_cast<std::size_t>(s)];
          const int x0 = bx < 0 ? 7 : 0, x1 = bx > 0 ? 0 : 7, y0 = by < 0 ? 7 : 0, y1 = by > 0 ? 0 : 7;
          for (int x = x0; x <= x1; ++x)
            for (int y = y0; y <= y1; ++y) {
              const auto byte = static_cast<unsigned>((b.mask[static_cast<std::size_t>(x)] >> (y * 8)) & 0xff);
              const unsigned bits = bz < 0 ? (byte >> 7) & 1u : bz > 0 ? (byte & 1u) << 9 : byte << 1;
              auto& to = row[static_cast<std::size_t>(x + 8 * bx + 1)][static_cast<std::size_t>(y + 8 * by + 1)];
              to = static_cast<std::uint16_t>(to | bits);
            }
        }
  }

  // Voxels of the block with a set voxel among them and their 26 neighbours.
  [[nodiscard]] std::array<std::uint64_t, 8> dilated() const {
    std::array<std::uint64_t, 8> mask{};
    for (std::size_t x = 0; x < 8; ++x)
      for (std::size_t y = 0; y < 8; ++y) {
        unsigned any = 0;
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) any |= row[x + i][y + j];
        any |= any << 1 | any >> 1;
        mask[x] |= std::uint64_t{(any >> 1) & 0xffu} << (y * 8);
      }
    return mask;
  }
};

std::array<std::uint64_t, 8> within_grid(const V3i& at, const V3i& n) {
  std::array<std::uint64_t, 8> mask{};
  const auto used = [](int block, int count) { return std::clamp(count - block * 8, 0, 8); };
  const int ux = used(at.x, n.x), uy = used(at.y, n.y), uz = used(at.z, n.z);
  const std::uint64_t byte = (1u << uz) - 1u;
  std::uint64_t word = 0;
  for (int y = 0; y < uy; ++y) word |= byte << (8 * y);
  for (int x = 0; x < ux; ++x) mask[static_cast<std::size_t>(x)] = word;
  return mask;
}

struct Colored {
  VoxelSet set;
  std::vector<V3f> color;  // empty where all there is has one colour: nothing to average
};

Colored grow(const Colored& from, const Grid& grid) {
  const BlockIndex index(from.set, grid.n);
  std::vector<char> wanted(index.slots.size(), 0);
  for (const Block& b : from.set.blocks)
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
          if (const V3i at(b.at.x + x, b.at.y + y, b.at.z + z); index.holds(at)) wanted[index.place(at)] = 1;
  std::vector<Block> candidates;
  for (int z = 0; z < index.n.z; ++z)
    for (int y = 0; y < index.n.y; ++y)
      for (int x = 0; x < index.n.x; ++x)
        if (wanted[index.place(V3i(x, y, z))]) candidates.emplace_back().at = V3i(x, y, z);
  tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t i) {
    Block& b = candidates[i];
    const auto inside = within_grid(b.at, grid.n);
    const auto mask = Padded(from.set, index, b.at).dilated();
    for (std::size_t x = 0; x < 8; ++x) b.mask[x] = mask[x] & inside[x];
  });
  Colored to;
  for (const Block& b : candidates)
    if (count_voxels(b.mask) > 0) to.set.blocks.push_back(b);
  number(to.set);
  if (from.color.empty()) return to;
  to.color.resize(static_cast<std::size_t>(to.set.count));
  tbb::parallel_for(std::size_t{0}, to.set.blocks.size(), [&](std::size_t i) {
    const Block& b = to.set.blocks[i];
    std::array<std::int32_t, 27> near;
    for (int n = 0; n < 27; ++n) near[static_cast<std::size_t>(n)] = index(V3i(b.at.x + n / 9 - 1, b.at.y + n / 3 % 3 - 1, b.at.z + n % 3 - 1));
    const auto color_at = [&](int x, int y, int z) -> const V3f* {
      const std::int32_t s = near[static_cast<std::size_t>(((x >> 3) + 1) * 9 + ((y >> 3) + 1) * 3 + (z >> 3) + 1)];
      if (s < 0) return nullptr;
      const Block& n = from.set.blocks[static_cast<std::size_t>(s)];
      return n.has(x & 7, y & 7, z & 7) ? &from.color[static_cast<std::size_t>(n.index(x & 7, y & 7, z & 7))] : nullptr;
    };
    auto out = static_cast<std::size_t>(b.first);
    for (int x = 0; x < 8; ++x)
      for (std::uint64_t word = b.mask[static_cast<std::size_t>(x)]; word; word &= word - 1) {
        const int bit = __builtin_ctzll(word), y = bit >> 3, z = bit & 7;
        V3f& color = to.color[out++];
        if (const V3f* own = color_at(x, y, z)) { color = *own; continue; }
        V3f sum(0, 0, 0);
        int count = 0;
        for (int dx = -1; dx <= 1; ++dx)
          for (int dy = -1; dy <= 1; ++dy)
            for (int dz = -1; dz <= 1; ++dz)
              if (const V3f* c = color_at(x + dx, y + dy, z + dz)) { sum += *c; ++count; }
        color = sum / static_cast<float>(std::max(1, count));
      }
  });
  return to;
}

// A block of room on either side of the axes that repeat, with the voxels that lie kColorReach or less beyond the border.
struct Widened {
  Grid grid;
  V3i blocks{0, 0, 0};         // of room
  Colored colored;
};

Widened widen(const Colored& from, const Grid& grid, const std::array<bool, 3>& cyclic) {
  Widened to;
  to.grid = grid;
  for (int a = 0; a < 3; ++a)
    if (cyclic[static_cast<std::size_t>(a)]) {
      to.blocks[a] = 1;
      to.grid.n[a] += 16;
    }
  const V3i room = to.blocks * 8;
  BlockIndex wide({}, to.grid.n);
  std::vector<Block>& blocks = to.colored.set.blocks;
  const auto mark = [&](const V3i& v) {
    const V3i at(v.x >> 3, v.y >> 3, v.z >> 3);
    std::int32_t& slot = wide.slots[wide.place(at)];
    if (slot < 0) {
      slot = static_cast<std::int32_t>(blocks.size());
      blocks.emplace_back().at = at;
    }
    blocks[static_cast<std::size_t>(slot)].mask[static_cast<std::size_t>(v.x & 7)] |= std::uint64_t{1} << ((v.y & 7) << 3 | (v.z & 7));
  };
  V3i turns;                   // periods within reach
  for (int a = 0; a < 3; ++a) turns[a] = to.blocks[a] > 0 ? (kColorReach + grid.n[a] - 1) / grid.n[a] : 0;
  for_each_voxel(from.set, [&](const V3i& v, std::int64_t) {
    for (int z = -turns.z; z <= turns.z; ++z)
      for (int y = -turns.y; y <= turns.y; ++y)
        for (int x = -turns.x; x <= turns.x; ++x) {
          const V3i image = v + V3i(x, y, z) * grid.n;
          bool near = true;
          for (int a = 0; a < 3; ++a) near = near && image[a] >= -kColorReach && image[a] < grid.n[a] + kColorReach;
          if (near) mark(image + room);
        }
  });
  std::sort(blocks.begin(), blocks.end(), [](const Block& a, const Block& b) { return before(a.at, b.at); });
  number(to.colored.set);
  if (from.color.empty()) return to;
  const BlockIndex index(from.set, grid.n);
  for_each_voxel(to.colored.set, [&](const V3i& v, std::int64_t) {
    V3i own = v - room;
    for (int a = 0; a < 3; ++a) own[a] = ((own[a] % grid.n[a]) + grid.n[a]) % grid.n[a];
    const Block& b = from.set.blocks[static_cast<std::size_t>(index(V3i(own.x >> 3, own.y >> 3, own.z >> 3)))];
    to.colored.color.push_back(from.color[static_cast<std::size_t>(b.index(own.x & 7, own.y & 7, own.z & 7))]);
  });
  return to;
}

// The grid's own part again.
Colored narrow(const Widened& from, const Grid& grid) {
  const VoxelSet& set = from.colored.set;
  const BlockIndex own({}, grid.n);
  Colored to;
  for (const Block& b : set.blocks) {
    const V3i at = b.at - from.blocks;
    if (!own.holds(at)) continue;
    Block block;
    block.at = at;
    const auto inside = within_grid(at, grid.n);
    for (std::size_t x = 0; x < 8; ++x) block.mask[x] = b.mask[x] & inside[x];
    if (count_voxels(block.mask) == 0) continue;
    to.set.blocks.push_back(block);
    if (from.colored.color.empty()) continue;
    auto i = static_cast<std::size_t>(b.first);
    for (std::size_t x = 0; x < 8; ++x)
      for (std::uint64_t word = b.mask[x]; word; word &= word - 1, ++i)
        if (block.mask[x] & word & (~word + 1)) to.color.push_back(from.colored.color[i]);
  }
  number(to.set);
  return to;
}

// What is matter but farther than spreading reaches: blocks' mean colours, from block to block, wave by wave. One per block of the grid.
std::vector<V3f> block_colors(const Colored& grown, const BlockIndex& index, const VoxelSet& matter, const std::vector<V3i>& inside_blocks, const std::array<bool, 3>& cyclic) {
  std::vector<V3f> mean(index.slots.size(), V3f(-1, -1, -1));
  for (const Block& b : grown.set.blocks) {
    V3f sum(0, 0, 0);
    const int bits = count_voxels(b.mask);
    for (int k = 0; k < bits; ++k) sum += grown.color[static_cast<std::size_t>(b.first + k)];
    mean[index.place(b.at)] = sum / static_cast<float>(bits);
  }
  // Through those that are matter and still without a colour.
  std::vector<char> waiting(index.slots.size(), 0);
  const auto wait = [&](const V3i& at) { if (mean[index.place(at)].x < 0) waiting[index.place(at)] = 1; };
  for (const Block& b : matter.blocks) wait(b.at);
  for (const V3i& at : inside_blocks) wait(at);
  const auto for_each_neighbour = [&](const V3i& at, auto&& call) {
    for (int n = 0; n < 27; ++n) {
      V3i near(at.x + n / 9 - 1, at.y + n / 3 % 3 - 1, at.z + n % 3 - 1);
      for (int a = 0; a < 3; ++a)
        if (cyclic[static_cast<std::size_t>(a)]) near[a] = (near[a] + index.n[a]) % index.n[a];
      if (index.holds(near)) call(near);
    }
  };
  std::vector<V3i> wave;
  for (const Block& b : grown.set.blocks) wave.push_back(b.at);
  while (!wave.empty()) {
    std::vector<V3i> next;
    for (const V3i& at : wave)
      for_each_neighbour(at, [&](const V3i& near) {
        if (char& w = waiting[index.place(near)]; w) { w = 0; next.push_back(near); }
      });
    std::vector<V3f> found;
    for (const V3i& at : next) {
      V3f sum(0, 0, 0);
      int count = 0;
      for_each_neighbour(at, [&](const V3i& near) {
        if (mean[index.place(near)].x >= 0) { sum += mean[index.place(near)]; ++count; }
      });
      found.push_back(sum / static_cast<float>(count));  // at least the one it was reached from
    }
    for (std::size_t i = 0; i < next.size(); ++i) mean[index.place(next[i])] = found[i];
    wave = std::move(next);
  }
  // Inside a surface that was all cut away nothing has a colour.
  for (V3f& m : mean)
    if (m.x < 0) m = V3f(0, 0, 0);
  return mean;
}

}  // namespace

VoxelSet join_sets(const VoxelSet& a, const VoxelSet& b) {
  VoxelSet all;
  std::size_t i = 0, j = 0;
  while (i < a.blocks.size() || j < b.blocks.size()) {
    const bool take_a = j == b.blocks.size() || (i < a.blocks.size() && !before(b.blocks[j].at, a.blocks[i].at));
    const bool take_b = i == a.blocks.size() || (j < b.blocks.size() && !before(a.blocks[i].at, b.blocks[j].at));
    Block block = take_a ? a.blocks[i] : b.blocks[j];
    if (take_a && take_b)
      for (std::size_t x = 0; x < 8; ++x) block.mask[x] |= b.blocks[j].mask[x];
    i += take_a;
    j += take_b;
    all.blocks.push_back(block);
  }
  number(all);
  return all;
}

BorderColors border_colors(const Surface& surface) {
  BorderColors own;
  own.one_color = surface.one_color;
  own.set.blocks = surface.set.blocks;
  std::vector<Block>& blocks = own.set.blocks;
  const auto for_each_covered = [&](std::size_t b, auto&& call) {
    const Block& block = surface.set.blocks[b];
    auto i = static_cast<std::size_t>(block.first);
    for (std::size_t x = 0; x < 8; ++x)
      for (std::uint64_t word = block.mask[x]; word; word &= word - 1, ++i)
        if (surface.areas[i].covered > 0) call(x, word & (~word + 1), i);
  };
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    blocks[b].mask.fill(0);
    for_each_covered(b, [&](std::size_t x, std::uint64_t bit, std::size_t) { blocks[b].mask[x] |= bit; });
  });
  number(own.set);
  if (!surface.one_color) {
    own.color.resize(static_cast<std::size_t>(own.set.count));
    tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
      auto to = static_cast<std::size_t>(blocks[b].first);
      for_each_covered(b, [&](std::size_t, std::uint64_t, std::size_t i) { own.color[to++] = surface.mean_color(i); });
    });
  }
  std::erase_if(blocks, [](const Block& b) { return count_voxels(b.mask) == 0; });
  return own;
}

VoxelSet bare_voxels(const Surface& surface) {
  VoxelSet bare;
  for (const Block& block : surface.set.blocks) {
    std::array<std::uint64_t, 8> mask{};
    auto i = static_cast<std::size_t>(block.first);
    for (std::size_t x = 0; x < 8; ++x)
      for (std::uint64_t word = block.mask[x]; word; word &= word - 1, ++i)
        if (!(surface.areas[i].covered > 0)) mask[x] |= word & (~word + 1);
    if (count_voxels(mask) > 0) bare.add(block.at, mask);
  }
  return bare;
}

ColorField spread_colors(BorderColors border, const VoxelSet& matter, const std::vector<V3i>& inside_blocks, const Grid& grid, const std::array<bool, 3>& cyclic) {
  Colored grown{std::move(border.set), std::move(border.color)};
  // All of it cut away: no colour at all.
  const bool none = grown.set.count == 0;
  if (cyclic[0] || cyclic[1] || cyclic[2]) {
    Widened wide = widen(grown, grid, cyclic);
    for (int i = 0; i < kColorReach; ++i) wide.colored = grow(wide.colored, wide.grid);
    grown = narrow(wide, grid);
  } else {
    for (int i = 0; i < kColorReach; ++i) grown = grow(grown, grid);
  }
  const BlockIndex index(grown.set, grid.n);

  ColorField field;
  if (border.one_color || none) field.one_color = none ? V3f(0, 0, 0) : *border.one_color;
  // Whole inside blocks are tiles; voxels that spreading reached within them give way.
  BlockIndex tile;
  tile.n = index.n;
  tile.slots.assign(index.slots.size(), -1);
  for (const V3i& at : inside_blocks) tile.slots[tile.place(at)] = 0;
  VoxelSet reached;
  for (const Block& b : grown.set.blocks)
    if (tile(b.at) < 0) reached.blocks.push_back(b);
  field.set = join_sets(reached, matter);
  if (field.one_color) return field;

  const std::vector<V3f> mean = block_colors(grown, index, matter, inside_blocks, cyclic);
  field.color.resize(static_cast<std::size_t>(field.set.count));
  tbb::parallel_for(std::size_t{0}, field.set.blocks.size(), [&](std::size_t i) {
    const Block& b = field.set.blocks[i];
    const std::int32_t s = index(b.at);
    const Block* from = s >= 0 ? &grown.set.blocks[static_cast<std::size_t>(s)] : nullptr;
    auto out = static_cast<std::size_t>(b.first);
    for (int x = 0; x < 8; ++x)
      for (std::uint64_t word = b.mask[static_cast<std::size_t>(x)]; word; word &= word - 1) {
        const int bit = __builtin_ctzll(word), y = bit >> 3, z = bit & 7;
        field.color[out++] = from && from->has(x, y, z) ? grown.color[static_cast<std::size_t>(from->index(x, y, z))] : mean[index.place(b.at)];
      }
  });
  for (const V3i& at : inside_blocks) field.tiles.push_back(mean[index.place(at)]);
  return field;
}

}  // namespace texel
