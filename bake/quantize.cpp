#include "bake/quantize.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "bake/lobes.h"

namespace texel {
namespace {

// A channel filled by fill(i) -> V3d (or its x) for each voxel of the layer, in parallel.
template <class Fill>
Channel make_channel(const std::string& name, int components, std::int64_t count, Fill&& fill) {
  Channel c;
  c.name = name;
  c.components = components;
  c.values.resize(static_cast<std::size_t>(count) * static_cast<std::size_t>(components));
  tbb::parallel_for(std::int64_t{0}, (count + 4095) / 4096, [&](std::int64_t chunk) {
    for (std::int64_t i = chunk * 4096; i < std::min(count, (chunk + 1) * 4096); ++i) {
      const V3d v = fill(static_cast<std::size_t>(i));
      for (int k = 0; k < components; ++k) c.values[static_cast<std::size_t>(i) * static_cast<std::size_t>(components) + static_cast<std::size_t>(k)] = static_cast<float>(v[k]);
    }
  });
  return c;
}

// Half floats end at 65504 and have steps of 6e-8 at the lower end: where the largest value is below kLeastLargest, that step is more than
// rounding to 11 bits would be for values a hundredth as large.
bool half_holds(const Channel& c) {
  constexpr float kLeastLargest = 1e-2f;
  float largest = 0;
  for (const float v : c.values) largest = std::max(largest, std::abs(v));
  for (const float v : c.tiles) largest = std::max(largest, std::abs(v));
  return largest <= 65504.0f && (largest == 0 || largest >= kLeastLargest);
}

// For each voxel of `all`, its index in `part`, or −1.
std::vector<std::int64_t> indices_in(const VoxelSet& all, const VoxelSet& part) {
  std::vector<std::int64_t> to(static_cast<std::size_t>(all.count), -1);
  std::size_t p = 0;
  for (const Block& b : all.blocks) {
    if (p == part.blocks.size()) break;
    const Block& q = part.blocks[p];
    if (q.at != b.at) continue;
    ++p;
    auto out = static_cast<std::size_t>(b.first);
    std::int64_t in = q.first;
    for (std::size_t x = 0; x < 8; ++x)
      for (std::uint64_t word = b.mask[x]; word; word &= word - 1, ++out)
        if (q.mask[x] & word & (~word + 1)) to[out] = in++;
  }
  return to;
}

Layer matter_layer(const Surface& surface, const Visibility& seen, const Grid& grid, const Recipe& recipe) {
  Layer layer;
  layer.set = join_sets(join_sets(surface.set, seen.inside), seen.edge);
  layer.tiles = seen.inside_blocks;
  const std::vector<std::int64_t> border = indices_in(layer.set, surface.set), edge = indices_in(layer.set, seen.edge);
  const auto tiles = [&](Channel& c, double value) {
    c.tiles.assign(layer.tiles.size() * static_cast<std::size_t>(c.components), static_cast<float>(value));
  };
  const auto alpha = [&](std::size_t i) {
    const std::int64_t b = border[i];
    if (b < 0 && edge[i] < 0) return V3d(1, 1, 1);
    if (b < 0) {
      const auto& a = seen.edges[static_cast<std::size_t>(edge[i])].alpha;
      return V3d(static_cast<double>(a[0]), static_cast<double>(a[1]), static_cast<double>(a[2]));
    }
    const auto at = static_cast<std::size_t>(b);
    return V3d(static_cast<double>(seen.alpha[0][at]), static_cast<double>(seen.alpha[1][at]), static_cast<double>(seen.alpha[2][at]));
  };
  if (recipe.want.density) {
    const double cap = recipe.max_depth;
    Channel c = make_channel("density", 1, layer.set.count, [&](std::size_t i) {
      V3d a = alpha(i);
      if (const std::int64_t b = border[i]; b >= 0 && !surface.material.empty()) {
        const auto at = static_cast<std::size_t>(b);
        // Solid parts are opaque; transparency belongs to what surface there is.
        if (seen.solid.empty() || seen.solid[at] <= 0)
          if (const double covered = surface.areas[at].covered; covered > 0) a *= 1 - surface.material[at].transparency / covered;
      }
      double depth = 0;
      for (int k = 0; k < 3; ++k) depth += a[k] < 1 ? std::min(cap, -std::log1p(-a[k])) : cap;
      return V3d(depth / 3 / grid.h, 0, 0);
    });
    tiles(c, cap / grid.h);
    layer.channels.push_back(std::move(c));
  }
  if (recipe.want.visibility) {
    layer.channels.push_back(make_channel("alpha", 3, layer.set.count, alpha));
    tiles(layer.channels.back(), 1);
    layer.channels.push_back(make_channel("solid", 1, layer.set.count, [&](std::size_t i) {
      if (border[i] < 0 && edge[i] >= 0) return V3d(static_cast<double>(seen.edges[static_cast<std::size_t>(edge[i])].solid), 0, 0);
      return V3d(border[i] < 0 ? 1.0 : seen.solid.empty() ? 0.0 : static_cast<double>(seen.solid[static_cast<std::size_t>(border[i])]), 0, 0);
    }));
    tiles(layer.channels.back(), 1);
  }
  return layer;
}

// S of each voxel's moments(i).
template <class Of>
std::vector<Symmetric> matrices(std::int64_t count, Of&& moments) {
  std::vector<Symmetric> s(static_cast<std::size_t>(count));
  tbb::parallel_for(std::int64_t{0}, (count + 1023) / 1024, [&](std::int64_t chunk) {
    for (std::int64_t i = chunk * 1024; i < std::min(count, (chunk + 1) * 1024); ++i) s[static_cast<std::size_t>(i)] = sggx(moments(static_cast<std::size_t>(i)));
  });
  return s;
}

void add_matrices(const std::string& name, const std::vector<Symmetric>& s, Layer& layer) {
  const auto count = static_cast<std::int64_t>(s.size());
  layer.channels.push_back(make_channel(name + "_diag", 3, count, [&](std::size_t i) { return V3d(s[i].xx, s[i].yy, s[i].zz); }));
  layer.channels.push_back(make_channel(name + "_off", 3, count, [&](std::size_t i) { return V3d(s[i].xy, s[i].xz, s[i].yz); }));
}

// The groups' own S, and the first one's share of the covered area: 1 where there is one, whose S is then that of all.
void add_lobes(const Surface& surface, Layer& layer) {
  const auto count = static_cast<std::int64_t>(surface.lobes.size());
  const auto second = [&](std::size_t i) -> const Moments& { return surface.lobes[i].second; };
  add_matrices("S1", matrices(count, [&](std::size_t i) { return first_group(surface.moments[i], second(i)); }), layer);
  add_matrices("S2", matrices(count, second), layer);
  layer.channels.push_back(make_channel("share_1", 1, count, [&](std::size_t i) { return V3d(second(i).covered > 0 ? 1 - second(i).covered / surface.moments[i].covered : 1, 0, 0); }));
}

void add_ndf(const std::vector<Moments>& moments, const Recipe& recipe, Layer& layer) {
  const auto count = static_cast<std::int64_t>(moments.size());
  const std::vector<Symmetric> s = matrices(count, [&](std::size_t i) -> const Moments& { return moments[i]; });
  if (recipe.ndf == NdfKind::kSggx) return add_matrices("S", s, layer);
  std::vector<StoredAxes> axes(static_cast<std::size_t>(count));
  for (std::size_t i = 0; i < axes.size(); ++i) axes[i] = recipe.ndf == NdfKind::kNeyret ? neyret_axes(s[i]) : ratib_axes(s[i]);
  layer.channels.push_back(make_channel("axis_1", 3, count, [&](std::size_t i) { return V3d(axes[i].axis_1); }));
  layer.channels.push_back(make_channel("axis_2", 3, count, [&](std::size_t i) { return V3d(axes[i].axis_2); }));
}

Layer surface_layer(const Surface& surface, const Visibility& seen, int level, const Recipe& recipe, const MaterialKinds& kinds) {
  Layer layer;
  layer.set = surface.set;
  const std::int64_t count = surface.set.count;
  const double face = std::pow(4.0, level);  // level-0 voxel faces in one of this level's
  const auto over_covered = [&](std::size_t i, const V3d& sum) {
    const double covered = surface.areas[i].covered;
    return covered > 0 ? sum / covered : V3d(0, 0, 0);
  };
  const auto add = [&](const std::string& name, int components, auto&& fill) { layer.channels.push_back(make_channel(name, components, count, fill)); };
  if (recipe.want.ndf || recipe.want.normal) {
    add("area", 1, [&](std::size_t i) { return V3d(surface.areas[i].area / face, 0, 0); });
    if (kinds.cutouts)
      add("coverage", 1, [&](std::size_t i) { return V3d(surface.areas[i].area > 0 ? surface.areas[i].covered / surface.areas[i].area : 0, 0, 0); });
  }
  // Visible normals where they were asked for; surface that no ray met keeps all of its own.
  std::vector<Moments> visible = seen.visible;
  for (std::size_t i = 0; i < visible.size(); ++i)
    if (!(visible[i].covered > 0)) visible[i] = surface.moments[i];
  const std::vector<Moments>& moments = visible.empty() ? surface.moments : visible;
  if (recipe.want.normal) add("normal", 3, [&](std::size_t i) { return moments[i].covered > 0 ? moments[i].m / moments[i].covered : V3d(0, 0, 0); });
  if (recipe.want.ndf) add_ndf(moments, recipe, layer);
  if (recipe.want.ndf && !surface.lobes.empty()) add_lobes(surface, layer);
  if (recipe.want.visibility) add("crossings", 3, [&](std::size_t i) { return surface.areas[i].crossings / face; });
  if (recipe.want.material && !surface.material.empty()) {
    if (kinds.ks) add("ks", 3, [&](std::size_t i) { return over_covered(i, surface.material[i].ks); });
    if (kinds.roughness) add("roughness", 1, [&](std::size_t i) { return V3d(mean_roughness(surface.material[i], surface.areas[i].covered), 0, 0); });
    if (kinds.transparency) add("transparency", 1, [&](std::size_t i) { return over_covered(i, V3d(surface.material[i].transparency)); });
    if (kinds.emission) add("emission", 3, [&](std::size_t i) { return over_covered(i, surface.material[i].emission); });
  }
  return layer;
}

// Moves what is in `from` to the end of `to`.
template <class T>
void append(std::vector<T>& from, std::vector<T>& to) {
  if (to.capacity() == 0) to = std::move(from);
  else to.insert(to.end(), from.begin(), from.end());
  from = {};
}

// `from` lies above all of `to`.
void append_set(VoxelSet& from, VoxelSet& to) {
  if (to.blocks.empty()) to = std::move(from);
  else for (const Block& block : from.blocks) to.add(block.at, block.mask);
  from = {};
}

// A slab without voxels of a layer may lack channels of it; the others have the same ones.
Layer join_layers(std::vector<LevelPart>& parts, Layer LevelPart::* layer) {
  Layer all;
  for (LevelPart& part : parts) {
    Layer& from = part.*layer;
    if (from.set.count == 0 && from.tiles.empty() && &part != &parts.front()) continue;
    if (all.set.count == 0 && all.tiles.empty()) all.channels = {};
    if (all.channels.empty())
      for (const Channel& c : from.channels) all.channels.push_back({c.name, c.components, {}, {}, c.full_float});
    append_set(from.set, all.set);
    append(from.tiles, all.tiles);
  }
  // One channel after the other, so that no more than one is there twice.
  for (Channel& c : all.channels) {
    std::size_t values = 0;
    const auto own = [&](LevelPart& part) {
      std::vector<Channel>& channels = (part.*layer).channels;
      return std::find_if(channels.begin(), channels.end(), [&](const Channel& other) { return other.name == c.name; });
    };
    for (LevelPart& part : parts)
      if (const auto it = own(part); it != (part.*layer).channels.end()) values += it->values.size();
    if (parts.size() > 1) c.values.reserve(values);
    for (LevelPart& part : parts) {
      const auto it = own(part);
      if (it == (part.*layer).channels.end()) continue;
      append(it->values, c.values);
      append(it->tiles, c.tiles);
    }
  }
  return all;
}

}  // namespace

LevelPart make_part(const Surface& surface, const Visibility& seen, const Grid& grid, int level, const Recipe& recipe, const MaterialKinds& kinds) {
  LevelPart part;
  if (recipe.want.density || recipe.want.visibility) part.matter = matter_layer(surface, seen, grid, recipe);
  part.surface = surface_layer(surface, seen, level, recipe, kinds);
  if (!recipe.want.color) return part;
  part.colors = border_colors(surface);
  part.uncolored = join_sets(seen.inside, seen.edge);
  if (part.colors.set.count < surface.set.count) part.uncolored = join_sets(part.uncolored, bare_voxels(surface));
  part.inside_blocks = seen.inside_blocks;
  return part;
}

Level join_parts(std::vector<LevelPart>& parts, const Grid& grid, const Recipe& recipe) {
  Level out;
  out.grid = grid;
  for (Layer LevelPart::* layer : {&LevelPart::matter, &LevelPart::surface}) {
    Layer all = join_layers(parts, layer);
    for (Channel& c : all.channels)
      if (c.name == "density") c.full_float = !half_holds(c);
    if (!all.channels.empty()) out.layers.push_back(std::move(all));
  }
  if (!recipe.want.color) return out;
  BorderColors border;
  VoxelSet uncolored;
  Layer layer;
  for (LevelPart& part : parts) {
    border.one_color = part.colors.one_color;
    append_set(part.colors.set, border.set);
    append_set(part.uncolored, uncolored);
    append(part.colors.color, border.color);
    append(part.inside_blocks, layer.tiles);
  }
  ColorField color = spread_colors(std::move(border), uncolored, layer.tiles, grid, recipe.cyclic);
  layer.set = std::move(color.set);
  const auto of = [&](const std::vector<V3f>& colors, std::size_t i) { return color.one_color ? *color.one_color : colors[i]; };
  Channel c = make_channel("Cd", 3, layer.set.count, [&](std::size_t i) { return V3d(of(color.color, i)); });
  for (std::size_t t = 0; t < layer.tiles.size(); ++t) {
    const V3f v = of(color.tiles, t);
    c.tiles.insert(c.tiles.end(), {v.x, v.y, v.z});
  }
  layer.channels.push_back(std::move(c));
  out.layers.push_back(std::move(layer));
  return out;
}

}  // namespace texel
