#include "bake/view_voxels.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/error.h"

namespace texel {

namespace {

constexpr double kMaxDepth = 9.21034037197618;  // optical depth of a voxel that is wholly opaque: −ln(1e-4)
constexpr std::int64_t kMaxBlocks = std::int64_t{1} << 28;

V3i blocks_of(const V3i& n) { return {(n.x + 7) / 8, (n.y + 7) / 8, (n.z + 7) / 8}; }

bool inside(const V3i& b, const V3i& n) { return b.x >= 0 && b.y >= 0 && b.z >= 0 && b.x < n.x && b.y < n.y && b.z < n.z; }

std::size_t place(const V3i& b, const V3i& n) {
  return (static_cast<std::size_t>(b.z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(b.y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(b.x);
}

std::size_t count_blocks(const Grid& grid) {
  const V3i n = blocks_of(grid.n);
  if (n.x < 1 || n.y < 1 || n.z < 1 || n.x > 1 << 20 || n.y > 1 << 20 || n.z > 1 << 20 || std::int64_t{n.x} * n.y > kMaxBlocks ||
      std::int64_t{n.x} * n.y * n.z > kMaxBlocks || !(grid.h > 0))
    throw Error(Code::kBadInput, "", "a level's grid cannot be looked at: " + std::to_string(grid.n.x) + "x" + std::to_string(grid.n.y) + "x" + std::to_string(grid.n.z) + " voxels");
  return static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z);
}

double unit_share(float v) { return v > 0 ? std::min(static_cast<double>(v), 1.0) : 0.0; }  // NaN becomes 0

Form form_of(const float* diagonal, const float* off) {
  return {static_cast<double>(diagonal[0]), static_cast<double>(diagonal[1]), static_cast<double>(diagonal[2]), static_cast<double>(off[0]), static_cast<double>(off[1]), static_cast<double>(off[2])};
}

}  // namespace

VoxelField::VoxelField(const Level& level, const std::string& name, int components) {
  const Layer* layer = nullptr;
  const Channel* channel = level.find(name, &layer);
  if (!channel) return;
  const auto c = static_cast<std::size_t>(components);
  std::int64_t count = 0;
  blocks_ = blocks_of(level.grid.n);
  slots_.assign(count_blocks(level.grid), 0);
  bool good = channel->components == components && layer->tiles.size() * c <= channel->tiles.size();
  for (std::size_t i = 0; good && i < layer->set.blocks.size(); ++i) {
    const Block& block = layer->set.blocks[i];
    good = block.first == count && inside(block.at, blocks_);
    count += count_voxels(block.mask);
    if (good) slots_[place(block.at, blocks_)] = static_cast<std::int32_t>(i) + 1;
  }
  for (std::size_t i = 0; good && i < layer->tiles.size(); ++i) {
    good = inside(layer->tiles[i], blocks_);
    if (good) slots_[place(layer->tiles[i], blocks_)] = -static_cast<std::int32_t>(i) - 1;
  }
  if (!good || static_cast<std::size_t>(count) * c > channel->values.size())
    throw Error(Code::kBadInput, "", "the grid " + name + " is damaged: its values do not fit its voxels");
  layer_ = layer;
  channel_ = channel;
}

const float* VoxelField::at(const V3i& voxel) const {
  if (!channel_ || voxel.x < 0 || voxel.y < 0 || voxel.z < 0) return nullptr;
  const V3i b(voxel.x >> 3, voxel.y >> 3, voxel.z >> 3);
  if (!inside(b, blocks_)) return nullptr;
  const std::int32_t slot = slots_[place(b, blocks_)];
  if (slot == 0) return nullptr;
  const auto c = static_cast<std::size_t>(channel_->components);
  if (slot < 0) return channel_->tiles.data() + static_cast<std::size_t>(-slot - 1) * c;
  const Block& block = layer_->set.blocks[static_cast<std::size_t>(slot - 1)];
  const int x = voxel.x & 7, y = voxel.y & 7, z = voxel.z & 7;
  if (!block.has(x, y, z)) return nullptr;
  return channel_->values.data() + static_cast<std::size_t>(block.index(x, y, z)) * c;
}

V3f VoxelField::color(const V3i& voxel, const V3f& otherwise) const {
  const float* p = at(voxel);
  return p ? V3f(p[0], p[1], p[2]) : otherwise;
}

float VoxelField::value(const V3i& voxel, float otherwise) const {
  const float* p = at(voxel);
  return p ? *p : otherwise;
}

bool VoxelField::has_block(const V3i& block) const { return inside(block, blocks_) && channel_ && slots_[place(block, blocks_)] != 0; }

LitLevel::LitLevel(const Level& level, const Eye& eye, const LitLevel* shadow, bool sheets)
    : level_(level), eye_(eye), shadow_(shadow ? shadow : this), sheets_(sheets), alpha_(level, "alpha", 3), crossings_(level, "crossings", 3), density_(level, "density", 1), solid_(level, "solid", 1),
      diagonal_(level, "S_diag", 3), off_(level, "S_off", 3), normal_(level, "normal", 3), albedo_(level, "Cd", 3), ks_(level, "ks", 3),
      roughness_(level, "roughness", 1), transparency_(level, "transparency", 1), emission_(level, "emission", 3),
      lobe_diagonal_{VoxelField(level, "S1_diag", 3), VoxelField(level, "S2_diag", 3)}, lobe_off_{VoxelField(level, "S1_off", 3), VoxelField(level, "S2_off", 3)}, share_(level, "share_1", 1) {
  matter_ = alpha_.present() ? &alpha_ : &density_;
  if (!matter_->present()) throw Error(Code::kBadInput, "", "the pack has neither the grid alpha nor density", "bake it with --want density or visibility");
  blocks_ = blocks_of(level.grid.n);
  place_of_.assign(count_blocks(level.grid), -1);
  const auto place_at = [&](const V3i& b) -> Place& {
    std::int32_t& i = place_of_[place(b, blocks_)];
    if (i < 0) {
      i = static_cast<std::int32_t>(places_.size());
      places_.emplace_back();
    }
    return places_[static_cast<std::size_t>(i)];
  };
  // Interpolation reaches one voxel far: a box of voxels is near to the cells from one voxel below to one above it.
  const auto mark = [&](const V3i& low, const V3i& high) {
    const auto down = [](int v) { return (v - 1) >> 1; };
    const auto up = [](int v) { return (v + 1) >> 1; };
    for (int x = down(low.x); x <= up(high.x); ++x)
      for (int y = down(low.y); y <= up(high.y); ++y)
        for (int z = down(low.z); z <= up(high.z); ++z)
          if (const V3i b(x >> 2, y >> 2, z >> 2); inside(b, blocks_)) place_at(b).near |= std::uint64_t{1} << ((x & 3) << 4 | (y & 3) << 2 | (z & 3));
  };
  for (const texel::Block& block : matter_->layer()->set.blocks) {
    place_at(block.at).filled = true;
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y)
        for (int z = 0; z < 8; ++z)
          if (block.has(x, y, z)) mark(block.at * 8 + V3i(x, y, z), block.at * 8 + V3i(x, y, z));
  }
  for (const V3i& tile : matter_->layer()->tiles) {
    place_at(tile).filled = true;
    mark(tile * 8, tile * 8 + V3i(7, 7, 7));
  }
  slots_ = std::make_unique<Slot[]>(places_.size());
}

int LitLevel::empty_cell(const V3d& p) const {
  V3i voxel;
  for (int k = 0; k < 3; ++k) voxel[k] = static_cast<int>(std::clamp(std::floor(p[k]), 0.0, level_.grid.n[k] - 1.0));
  const std::int32_t i = place_of_[place(V3i(voxel.x >> 3, voxel.y >> 3, voxel.z >> 3), blocks_)];
  if (i < 0) return 8;
  const std::uint64_t near = places_[static_cast<std::size_t>(i)].near;
  constexpr std::uint64_t kEight = 0x330033;  // the 2×2×2 cells at the lowest corner
  if ((near >> ((voxel.x >> 2 & 1) << 5 | (voxel.y >> 2 & 1) << 3 | (voxel.z >> 2 & 1) << 1) & kEight) == 0) return 4;
  const int bit = (voxel.x >> 1 & 3) << 4 | (voxel.y >> 1 & 3) << 2 | (voxel.z >> 1 & 3);
  return near >> bit & 1 ? 0 : 2;
}

AxisOpacity LitLevel::axes(const V3i& voxel) const {
  const auto there = static_cast<float>(1 - unit_share(transparency_.value(voxel, 0)));
  return axis_opacity(alpha_.at(voxel), crossings_.at(voxel), diagonal_.at(voxel), off_.at(voxel), solid_.value(voxel, 0), there);
}

// Optical depth of one voxel edge along `direction`.
double LitLevel::depth(const V3i& voxel, const V3d& direction) const {
  if (!alpha_.present()) return std::min(std::max(static_cast<double>(density_.value(voxel, 0)), 0.0) * level_.grid.h, 1e6);
  return alpha_.at(voxel) ? depth_along(axes(voxel), direction, kMaxDepth) : 0;
}

float LitLevel::transmittance(const V3d& p, const V3d& d, double length) const {
  const Grid& g = level_.grid;
  const V3d start = g.to_voxel(p);
  const double end = length / g.h;
  double from = 0, to = end;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(d[k]) < 1e-12) {
      if (start[k] < 0 || start[k] > g.n[k]) return 1;
      continue;
    }
    const double a = -start[k] / d[k], b = (g.n[k] - start[k]) / d[k];
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
  }
  double depth_sum = 0;
  for (double t = from; t < to && depth_sum < kMaxDepth;) {
    const V3d at = start + d * t;
    const V3i voxel(static_cast<int>(std::floor(at.x)), static_cast<int>(std::floor(at.y)), static_cast<int>(std::floor(at.z)));
    const V3i b(voxel.x >> 3, voxel.y >> 3, voxel.z >> 3);
    const bool empty = !matter_->has_block(b);
    // On to where the ray leaves the voxel, or the whole block where it is empty.
    double next = to;
    for (int k = 0; k < 3; ++k) {
      if (std::abs(d[k]) < 1e-12) continue;
      const int size = empty ? 8 : 1, low = empty ? b[k] * 8 : voxel[k];
      next = std::min(next, ((d[k] > 0 ? low + size : low) - start[k]) / d[k]);
    }
    next = std::min(std::max(next, t) + 1e-6, to);
    if (!empty) depth_sum += (density_.present() ? static_cast<double>(density_.value(voxel, 0)) * g.h : depth(voxel, d)) * (next - t);
    t = std::max(next, t + 1e-6);
  }
  return static_cast<float>(std::exp(-std::max(depth_sum, 0.0)));
}

Facets LitLevel::facets(const V3i& voxel) const {
  Facets facets;
  facets.look = {albedo_.color(voxel, V3f(0.5f)), ks_.color(voxel, V3f(0.0f)), emission_.color(voxel, V3f(0.0f)), roughness_.value(voxel, 1)};
  const V3d m(normal_.color(voxel, V3f(0.0f)));
  facets.mean = m;
  const float* diagonal = diagonal_.at(voxel);
  const float* off = off_.at(voxel);
  if (diagonal && off)
    facets.s = form_of(diagonal, off);
  else if (m.length() > 0.5)
    facets.s = {m.x * m.x, m.y * m.y, m.z * m.z, m.x * m.y, m.x * m.z, m.y * m.z};
  facets.closed = solid_.value(voxel, 0) > 0;
  const double share = static_cast<double>(share_.value(voxel, 1));
  const float *d1 = lobe_diagonal_[0].at(voxel), *o1 = lobe_off_[0].at(voxel), *d2 = lobe_diagonal_[1].at(voxel), *o2 = lobe_off_[1].at(voxel);
  if (share > 0 && share < 1 && d1 && o1 && d2 && o2) {
    facets.lobes = {form_of(d1, o1), form_of(d2, o2)};
    facets.share_2 = 1 - share;
  }
  return facets;
}

V3f LitLevel::light_sent(const V3i& voxel, const V3d& v) const {
  const Facets facets = this->facets(voxel);
  const V3d& m = facets.mean;
  const double sidedness = std::min(m.length(), 1.0);
  const V3d centre = level_.grid.centre(voxel);
  return texel::light_sent(facets, v, eye_.lights, eye_.ambient, centre, [&](const V3d& l, const Light& light) {
    if (!eye_.shadows) return 1.0f;
    // Out of the surface's own voxels first: it must not shade itself.
    const double h = std::max(level_.grid.h, shadow_->level_.grid.h);
    const V3d out = sidedness > 0.2 && m.dot(l) > 0 ? m / m.length() : l;
    const V3d start = centre + (out + l) * h;
    const double length = light.kind == Light::Kind::kPoint ? (light.vector - start).dot(l) : 1e30 * h;
    return length > 0 ? shadow_->transmittance(start, l, length) : 1.0f;
  });
}

LitVoxel LitLevel::light_up(const V3i& voxel) const {
  LitVoxel lit;
  const V3d centre = level_.grid.centre(voxel);
  V3d direction = eye_.rays.forward;
  if (eye_.rays.perspective) {
    const V3d line = centre - eye_.rays.eye;
    if (line.length() > 0) direction = line / line.length();
  }
  // Without any surface grid every voxel is shaded as if its normals went all ways.
  const bool surface = normal_.at(voxel) || diagonal_.at(voxel) || (!normal_.present() && !diagonal_.present());
  lit.solid = static_cast<float>(unit_share(solid_.value(voxel, 0)));
  if (surface || lit.solid <= 0) lit.alpha = static_cast<float>(-std::expm1(-depth(voxel, direction)));
  const float sheet = sheets_ ? sheet_share(normal_.color(voxel, V3f(0.0f)), diagonal_.at(voxel), off_.at(voxel)) : 0;
  lit.sheet = lit.alpha * sheet;
  if (sheet > 0) lit.full = sheet * std::max(static_cast<float>(sheet_along(axes(voxel), direction)) - lit.alpha, 0.0f);
  if (lit.solid > 0) {
    const V3f m = normal_.color(voxel, V3f(0.0f));
    lit.body = lit.alpha * std::min(m.dot(m), 1.0f);
    if (const float length = m.length(); length > 0) {
      float behind = lit.solid;
      for (const float way : {1.0f, 2.0f}) {
        V3i there = voxel;
        for (int k = 0; k < 3; ++k) there[k] -= static_cast<int>(std::lround(m[k] / length * way));
        behind = std::max(behind, static_cast<float>(unit_share(solid_.value(there, 0))));
      }
      lit.solid = std::max(lit.solid, lit.body * (1 - behind));
    }
  }
  const float weight = std::max(lit.alpha, lit.solid);
  if (!surface || !(weight > 0)) return lit;
  lit.known = weight;
  lit.light = light_sent(voxel, -direction) * weight;
  return lit;
}

const LitLevel::Block* LitLevel::block_at(const V3i& b) const {
  if (!inside(b, blocks_)) return nullptr;
  const std::int32_t i = place_of_[place(b, blocks_)];
  if (i < 0 || !places_[static_cast<std::size_t>(i)].filled) return nullptr;
  Slot& slot = slots_[static_cast<std::size_t>(i)];
  std::call_once(slot.once, [&] {
    auto block = std::make_unique<Block>();
    for (int k = 0; k < 512; ++k) (*block)[static_cast<std::size_t>(k)] = light_up(V3i(b.x * 8 + (k >> 6), b.y * 8 + (k >> 3 & 7), b.z * 8 + (k & 7)));
    slot.block = std::move(block);
  });
  return slot.block.get();
}

LitVoxel LitLevel::at(const V3d& p, int axis) const {
  const V3d q = p - V3d(0.5, 0.5, 0.5);
  if (!(std::abs(q.x) < 1e9 && std::abs(q.y) < 1e9 && std::abs(q.z) < 1e9)) return {};
  const V3i low(static_cast<int>(std::floor(q.x)), static_cast<int>(std::floor(q.y)), static_cast<int>(std::floor(q.z)));
  const V3f f(static_cast<float>(q.x - low.x), static_cast<float>(q.y - low.y), static_cast<float>(q.z - low.z));
  const bool one_block = (low.x & 7) < 7 && (low.y & 7) < 7 && (low.z & 7) < 7;
  const Block* block = one_block ? block_at(V3i(low.x >> 3, low.y >> 3, low.z >> 3)) : nullptr;
  LitVoxel sum;
  if (one_block && !block) return sum;
  float layers[2] = {0, 0};  // opacity of the two layers across the axis, times the weight of the layer
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner >> 2, dy = corner >> 1 & 1, dz = corner & 1;
    const int x = low.x + dx, y = low.y + dy, z = low.z + dz;
    const Block* b = one_block ? block : block_at(V3i(x >> 3, y >> 3, z >> 3));
    if (!b) continue;
    const LitVoxel& voxel = (*b)[static_cast<std::size_t>((x & 7) << 6 | (y & 7) << 3 | (z & 7))];
    const float weight = (dx ? f.x : 1 - f.x) * (dy ? f.y : 1 - f.y) * (dz ? f.z : 1 - f.z);
    layers[(axis == 0 ? dx : axis == 1 ? dy : dz)] += weight * voxel.alpha;
    sum.sheet += weight * voxel.sheet;
    sum.solid += weight * voxel.solid;
    sum.full += weight * voxel.full;
    sum.body += weight * voxel.body;
    sum.known += weight * voxel.known;
    sum.light += voxel.light * weight;
  }
  for (int layer = 0; layer < 2; ++layer) {
    const float share = layer ? f[axis] : 1 - f[axis];
    if (layers[layer] > 0) sum.alpha -= share * std::log1p(-std::min(layers[layer] / share, 1 - 1e-6f));
  }
  return sum;
}

}  // namespace texel
