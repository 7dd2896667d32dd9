#include "bake/prune.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <unordered_map>

#include "bake/block_index.h"

namespace texel {
namespace {

using Mask = std::array<std::uint64_t, 8>;
constexpr std::uint64_t kAll = ~std::uint64_t{0};

bool before(const V3i& a, const V3i& b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); }

// A set of voxels to mark and look up; its order is never asked for.
class Marks {
 public:
  Mask& at(const V3i& block) { return masks_[key(block)]; }
  [[nodiscard]] const Mask* find(const V3i& block) const {
    const auto it = masks_.find(key(block));
    return it == masks_.end() ? nullptr : &it->second;
  }
  [[nodiscard]] bool has(const V3i& v) const {
    const Mask* mask = find(V3i(v.x >> 3, v.y >> 3, v.z >> 3));
    return mask && ((*mask)[static_cast<std::size_t>(v.x & 7)] >> ((v.y & 7) << 3 | (v.z & 7)) & 1u);
  }
  void set(const V3i& v) { at(V3i(v.x >> 3, v.y >> 3, v.z >> 3))[static_cast<std::size_t>(v.x & 7)] |= std::uint64_t{1} << ((v.y & 7) << 3 | (v.z & 7)); }

 private:
  static std::uint64_t key(const V3i& b) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(b.z)) << 42 | static_cast<std::uint64_t>(static_cast<std::uint32_t>(b.y)) << 21 | static_cast<std::uint32_t>(b.x);
  }
  std::unordered_map<std::uint64_t, Mask> masks_;
};

// The voxels above those of a layer, on the next coarser level.
Marks parents_of(const Layer& layer) {
  Marks up;
  for_each_voxel(layer.set, [&](const V3i& v, std::int64_t) { up.set(V3i(v.x >> 1, v.y >> 1, v.z >> 1)); });
  for (const V3i& t : layer.tiles)
    for (int i = 0; i < 64; ++i) up.set(t * 4 + V3i(i >> 4, i >> 2 & 3, i & 3));
  return up;
}

const Layer* layer_of(const Level& level, const char* grid) {
  const Layer* layer = nullptr;
  return level.find(grid, &layer) ? layer : nullptr;
}

// The layer without the marked voxels.
void leave_out(Layer& layer, const Marks& marks) {
  VoxelSet kept;
  std::vector<std::int64_t> from;  // for each kept voxel
  for (const Block& b : layer.set.blocks) {
    const Mask* out = marks.find(b.at);
    Mask mask = b.mask;
    if (out)
      for (std::size_t x = 0; x < 8; ++x) mask[x] &= ~(*out)[x];
    if (count_voxels(mask) == 0) continue;
    std::int64_t index = b.first;
    for (std::size_t x = 0; x < 8; ++x)
      for (std::uint64_t word = b.mask[x]; word; word &= word - 1, ++index)
        if (mask[x] & word & (~word + 1)) from.push_back(index);
    kept.add(b.at, mask);
  }
  for (Channel& c : layer.channels) {
    const auto n = static_cast<std::size_t>(c.components);
    for (std::size_t i = 0; i < from.size(); ++i)  // forwards: a value never moves up
      for (std::size_t k = 0; k < n; ++k) c.values[i * n + k] = c.values[static_cast<std::size_t>(from[i]) * n + k];
    c.values.resize(from.size() * n);
    c.values.shrink_to_fit();
  }
  layer.set = std::move(kept);
}

// Opacities of a level's voxels along the axes; with density alone an upper bound of each: its mean over the axes is known.
struct Opacity {
  const Layer* layer = nullptr;
  const Channel* alpha = nullptr;
  const Channel* density = nullptr;
  double h = 0;
  explicit Opacity(const Level& level) : h(level.grid.h) {
    alpha = level.find("alpha", &layer);
    if (!alpha) density = level.find("density", &layer);
  }
  [[nodiscard]] V3d operator()(std::size_t i) const {
    if (alpha) return {static_cast<double>(alpha->values[3 * i]), static_cast<double>(alpha->values[3 * i + 1]), static_cast<double>(alpha->values[3 * i + 2])};
    return V3d(-std::expm1(-3 * h * static_cast<double>(density->values[i])));
  }
};

double sum_of(const Channel& c) {
  double sum = 0;
  for (const float v : c.values) sum += static_cast<double>(v);
  for (const float v : c.tiles) sum += 512 * static_cast<double>(v);
  return sum;
}

// Values of another layer's grid at any voxel; 0 where it is not active.
struct Lookup {
  const Layer* layer = nullptr;
  const Channel* channel = nullptr;
  BlockIndex index;
  double whole = 0, out = 0;  // the level's sum; what of it is left out
  Lookup(const Level& level, const char* grid) {
    channel = level.find(grid, &layer);
    if (!channel) return;
    index = BlockIndex(layer->set, level.grid.n);
    whole = sum_of(*channel);
  }
  [[nodiscard]] double operator()(const V3i& v) const {
    const std::int32_t slot = channel ? index(V3i(v.x >> 3, v.y >> 3, v.z >> 3)) : -1;
    if (slot < 0) return 0;
    const Block& b = layer->set.blocks[static_cast<std::size_t>(slot)];
    return b.has(v.x & 7, v.y & 7, v.z & 7) ? static_cast<double>(channel->values[static_cast<std::size_t>(b.index(v.x & 7, v.y & 7, v.z & 7))]) : 0;
  }
};

// `needed`: voxels whose children are stored.
void prune_faint(Level& level, double tolerance, const Marks& needed, Pruned& pruned) {
  const Opacity opacity(level);
  struct Faint { double most; std::int64_t index; V3i voxel; };
  std::vector<Faint> faint;
  for_each_voxel(opacity.layer->set, [&](const V3i& v, std::int64_t i) {
    const V3d a = opacity(static_cast<std::size_t>(i));
    const double most = std::max({a.x, a.y, a.z});
    if (most <= tolerance && !needed.has(v)) faint.push_back({most, i, v});
  });
  std::sort(faint.begin(), faint.end(), [](const Faint& a, const Faint& b) { return std::tie(a.most, a.index) < std::tie(b.most, b.index); });
  Lookup area(level, "area"), solid(level, "solid");
  const V3i n = level.grid.n;
  std::array<std::vector<double>, 3> columns;
  for (int k = 0; k < 3; ++k)
    columns[static_cast<std::size_t>(k)].assign(static_cast<std::size_t>(n[(k + 1) % 3]) * static_cast<std::size_t>(n[(k + 2) % 3]), 0);
  Marks marks;
  std::int64_t out = 0;
  for (const Faint& f : faint) {
    const V3d a = opacity(static_cast<std::size_t>(f.index));
    std::array<double*, 3> column{};
    bool fits = true;
    for (int k = 0; k < 3; ++k) {
      const auto s = static_cast<std::size_t>(k);
      column[s] = &columns[s][static_cast<std::size_t>(f.voxel[(k + 1) % 3]) * static_cast<std::size_t>(n[(k + 2) % 3]) + static_cast<std::size_t>(f.voxel[(k + 2) % 3])];
      fits = fits && *column[s] + a[k] <= tolerance;
    }
    const double surface = area(f.voxel), matter = solid(f.voxel);
    if (!fits || area.out + surface > tolerance * area.whole || solid.out + matter > tolerance * solid.whole) continue;
    for (int k = 0; k < 3; ++k) pruned.column = std::max(pruned.column, *column[static_cast<std::size_t>(k)] += a[k]);
    area.out += surface;
    solid.out += matter;
    marks.set(f.voxel);
    ++out;
  }
  if (out == 0) return;
  pruned.voxels += out;
  if (area.whole > 0) pruned.area = std::max(pruned.area, area.out / area.whole);
  if (solid.whole > 0) pruned.volume = std::max(pruned.volume, solid.out / solid.whole);
  for (Layer& layer : level.layers)
    if (std::none_of(layer.channels.begin(), layer.channels.end(), [](const Channel& c) { return c.name == "Cd"; })) leave_out(layer, marks);
}

// Whether a block of this grid may be one value where only part of it is active: what runs on beyond the surface harms nobody.
bool runs_on(const std::string& grid) {
  for (const char* name : {"Cd", "kd", "ks", "roughness", "transparency", "coverage"})
    if (grid == name) return true;
  return false;
}
bool fills_blocks(const std::string& grid) { return grid == "density" || grid == "alpha" || grid == "solid"; }

// Where 0 means what nothing means.
bool has_background(const std::string& grid) {
  for (const char* name : {"solid", "kd", "ks", "transparency", "emission"})
    if (grid == name) return true;
  return false;
}

// The mean of a block's values, where all of them are near it.
struct OneValue {
  bool is = false;
  std::array<float, 3> value{};
  ValueErrors errors;
};
OneValue one_value(const Channel& c, const Block& block, double tolerance) {
  const auto n = static_cast<std::size_t>(c.components);
  const auto count = static_cast<std::size_t>(count_voxels(block.mask));
  const float* values = &c.values[static_cast<std::size_t>(block.first) * n];
  const Norm norm = norm_of(c.name);
  OneValue one;
  for (std::size_t k = 0; k < n; ++k) {
    double sum = 0;
    bool same = true, full = false;
    for (std::size_t i = 0; i < count; ++i) {
      const float v = values[i * n + k];
      sum += static_cast<double>(v);
      same = same && v == values[k];
      full = full || v == 1;
    }
    // What is opaque or filled stays so, and nothing else becomes so.
    if (full && !same && (c.name == "alpha" || c.name == "solid")) return one;
    one.value[k] = same ? values[k] : static_cast<float>(sum / static_cast<double>(count));
    for (std::size_t i = 0; i < count; ++i) {
      const double v = static_cast<double>(values[i * n + k]), mean = static_cast<double>(one.value[k]);
      if (!(difference(c.name == "alpha" ? Norm::kRelative : norm, v, mean) <= tolerance)) return one;
      one.errors.add(difference(norm, v, mean));
    }
  }
  one.is = true;
  return one;
}

// The channel's own layer, with blocks of one value as tiles. `above`: the same grid of the next coarser level, null on the coarsest.
Layer with_tiles(const Layer& layer, const Channel& channel, const Layer* above, const Grid& above_grid, double tolerance, Pruned& pruned) {
  const auto n = static_cast<std::size_t>(channel.components);
  Layer out;
  Channel c{channel.name, channel.components, {}, {}, channel.full_float};
  BlockIndex index;
  Marks above_tiles;
  if (above) {
    index = BlockIndex(above->set, above_grid.n);
    for (const V3i& t : above->tiles) above_tiles.at(t).fill(kAll);
  }
  // Whether all voxels of the block have their parents, those beyond the box aside.
  const auto covered = [&](const V3i& at) {
    for (int i = 0; above && i < 64; ++i) {
      const V3i up = at * 4 + V3i(i >> 4, i >> 2 & 3, i & 3), block(up.x >> 3, up.y >> 3, up.z >> 3);
      if (up.x >= above_grid.n.x || up.y >= above_grid.n.y || up.z >= above_grid.n.z || above_tiles.find(block)) continue;
      const std::int32_t slot = index(block);
      if (slot < 0 || !above->set.blocks[static_cast<std::size_t>(slot)].has(up.x & 7, up.y & 7, up.z & 7)) return false;
    }
    return true;
  };
  struct Tile { V3i at; std::array<float, 3> value; };
  std::vector<Tile> tiles;
  for (std::size_t t = 0; t < layer.tiles.size(); ++t) {
    Tile& tile = tiles.emplace_back(Tile{layer.tiles[t], {}});
    for (std::size_t k = 0; k < n; ++k) tile.value[k] = channel.tiles[t * n + k];
  }
  ValueErrors errors;
  for (const Block& b : layer.set.blocks) {
    const bool full = count_voxels(b.mask) == 512;
    if (runs_on(channel.name) ? full || covered(b.at) : full)
      if (const OneValue one = one_value(channel, b, tolerance); one.is) {
        tiles.push_back({b.at, one.value});
        errors.add(one.errors);
        ++pruned.tiles;
        continue;
      }
    const float* values = &channel.values[static_cast<std::size_t>(b.first) * n];
    c.values.insert(c.values.end(), values, values + static_cast<std::size_t>(count_voxels(b.mask)) * n);
    out.set.add(b.at, b.mask);
  }
  add_errors(channel.name, errors, pruned.errors);
  std::sort(tiles.begin(), tiles.end(), [](const Tile& a, const Tile& b) { return before(a.at, b.at); });
  for (const Tile& t : tiles) {
    out.tiles.push_back(t.at);
    c.tiles.insert(c.tiles.end(), t.value.begin(), t.value.begin() + channel.components);
  }
  out.channels.push_back(std::move(c));
  return out;
}

// Leaves values near 0 to the background, but for those whose children are stored. `layer` has one channel.
void prune_background(Layer& layer, const Marks& needed, double tolerance, Pruned& pruned) {
  Channel& c = layer.channels.front();
  const auto n = static_cast<std::size_t>(c.components);
  const Norm norm = norm_of(c.name);
  const double most = c.name == "solid" ? 0 : tolerance;  // the sum of what is filled is a promise
  ValueErrors errors;
  const auto is_background = [&](const float* v) {
    for (std::size_t k = 0; k < n; ++k)
      if (!(difference(norm, static_cast<double>(v[k]), 0) <= most)) return false;
    for (std::size_t k = 0; k < n; ++k) errors.add(difference(norm, static_cast<double>(v[k]), 0));
    return true;
  };
  Marks out;
  std::int64_t count = 0;
  for_each_voxel(layer.set, [&](const V3i& v, std::int64_t i) {
    if (needed.has(v) || !is_background(&c.values[static_cast<std::size_t>(i) * n])) return;
    out.set(v);
    ++count;
  });
  if (count > 0) leave_out(layer, out);
  std::vector<V3i> tiles;
  std::vector<float> values;
  for (std::size_t t = 0; t < layer.tiles.size(); ++t) {
    if (!needed.find(layer.tiles[t]) && is_background(&c.tiles[t * n])) { count += 512; continue; }
    tiles.push_back(layer.tiles[t]);
    values.insert(values.end(), &c.tiles[t * n], &c.tiles[t * n] + n);
  }
  layer.tiles = std::move(tiles);
  c.tiles = std::move(values);
  pruned.background += count;
  add_errors(c.name, errors, pruned.errors);
}

bool goes_its_own_way(const std::string& grid) { return runs_on(grid) || fills_blocks(grid) || has_background(grid); }

// Such channels get a layer each, at the end.
void split(Level& level) {
  std::vector<Layer> own;
  for (Layer& layer : level.layers) {
    for (Channel& c : layer.channels)
      if (goes_its_own_way(c.name)) {
        own.push_back({layer.set, layer.tiles, {}});
        own.back().channels.push_back(std::move(c));
        c.name.clear();
      }
    std::erase_if(layer.channels, [](const Channel& c) { return c.name.empty(); });
  }
  std::erase_if(level.layers, [](const Layer& layer) { return layer.channels.empty(); });
  for (Layer& layer : own) level.layers.push_back(std::move(layer));
}

}  // namespace

Pruned prune_levels(std::vector<Level>& levels, double tolerance) {
  Pruned pruned;
  // Faint voxels, from fine to coarse: what is stored needs its parents.
  Marks needed;
  for (Level& level : levels) {
    const Opacity opacity(level);
    pruned.judged = pruned.judged && opacity.layer;
    if (!opacity.layer) continue;
    prune_faint(level, tolerance, needed, pruned);
    needed = parents_of(*layer_of(level, opacity.alpha ? "alpha" : "density"));
  }
  // Tiles, from coarse to fine: they must have their parents.
  for (std::size_t l = levels.size(); l-- > 0;) {
    split(levels[l]);
    for (Layer& layer : levels[l].layers) {
      if (layer.channels.size() != 1) continue;
      const Channel& c = layer.channels.front();
      if (!runs_on(c.name) && !fills_blocks(c.name)) continue;
      const bool coarsest = l + 1 == levels.size();
      const Layer* above = coarsest ? nullptr : layer_of(levels[l + 1], c.name.c_str());
      layer = with_tiles(layer, Channel(c), above, coarsest ? levels[l].grid : levels[l + 1].grid, tolerance, pruned);
    }
  }
  // The background, from fine to coarse again.
  for (const char* grid : {"solid", "kd", "ks", "transparency", "emission"}) {
    Marks above;
    for (Level& level : levels)
      for (Layer& layer : level.layers)
        if (layer.channels.size() == 1 && layer.channels.front().name == grid) {
          prune_background(layer, above, tolerance, pruned);
          above = parents_of(layer);
        }
  }
  return pruned;
}

}  // namespace texel
