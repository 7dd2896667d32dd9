#include "bake/texel_level.h"

#include <algorithm>
#include <cmath>

#include "formats/error.h"

namespace texel {

namespace {

constexpr double kMaxDepth = 9.21034037197618;  // as in view_voxels.cpp

V3i blocks_of(const V3i& n) { return {(n.x + 7) / 8, (n.y + 7) / 8, (n.z + 7) / 8}; }

bool inside(const V3i& b, const V3i& n) { return b.x >= 0 && b.y >= 0 && b.z >= 0 && b.x < n.x && b.y < n.y && b.z < n.z; }

std::size_t place(const V3i& b, const V3i& n) {
  return (static_cast<std::size_t>(b.z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(b.y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(b.x);
}

double unit_share(float v) { return v > 0 ? std::min(static_cast<double>(v), 1.0) : 0.0; }

V3i floored(const V3d& p) { return {static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)), static_cast<int>(std::floor(p.z))}; }

}  // namespace

TexelLevel::TexelLevel(const Level& level, const V3d& extent, const std::array<bool, 3>& wrap, bool sheets)
    : level_(level), extent_(extent), wrap_(wrap), sheets_(sheets), alpha_(level, "alpha", 3), crossings_(level, "crossings", 3), density_(level, "density", 1), solid_(level, "solid", 1), diagonal_(level, "S_diag", 3),
      off_(level, "S_off", 3), normal_(level, "normal", 3), albedo_(level, "Cd", 3), ks_(level, "ks", 3), roughness_(level, "roughness", 1),
      transparency_(level, "transparency", 1), emission_(level, "emission", 3) {
  const VoxelField& matter = alpha_.present() ? alpha_ : density_;  // its constructor has checked the grid's size
  if (!matter.present()) throw Error(Code::kBadInput, "", "the pack has neither the grid alpha nor density", "bake it with --want density or visibility");
  const V3i& n = level.grid.n;
  blocks_ = blocks_of(n);
  place_of_.assign(static_cast<std::size_t>(blocks_.x) * static_cast<std::size_t>(blocks_.y) * static_cast<std::size_t>(blocks_.z), -1);
  const auto place_at = [&](const V3i& b) -> Place& {
    std::int32_t& i = place_of_[place(b, blocks_)];
    if (i < 0) {
      i = static_cast<std::int32_t>(places_.size());
      places_.emplace_back();
    }
    return places_[static_cast<std::size_t>(i)];
  };
  const auto down = [](int v) { return (v - 1) >> 1; };
  const auto up = [](int v) { return (v + 1) >> 1; };
  const auto mark_box = [&](const V3i& low, const V3i& high) {
    for (int x = std::max(down(low.x), 0); x <= up(high.x); ++x)
      for (int y = std::max(down(low.y), 0); y <= up(high.y); ++y)
        for (int z = std::max(down(low.z), 0); z <= up(high.z); ++z)
          if (const V3i b(x >> 2, y >> 2, z >> 2); inside(b, blocks_)) place_at(b).near |= std::uint64_t{1} << ((x & 3) << 4 | (y & 3) << 2 | (z & 3));
  };
  // What lies at one border is near to the other.
  const auto mark = [&](const V3i& low, const V3i& high) {
    for (int i = 0; i < 27; ++i) {
      V3i by(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      bool wanted = true;
      for (int k = 0; k < 3; ++k) {
        wanted = wanted && (by[k] == 0 || (wrap_[static_cast<std::size_t>(k)] && (by[k] > 0 ? low[k] == 0 : high[k] >= n[k] - 1)));
        by[k] *= n[k];
      }
      if (wanted) mark_box(low + by, high + by);
    }
  };
  for (const texel::Block& block : matter.layer()->set.blocks) {
    place_at(block.at).filled = true;
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y)
        for (int z = 0; z < 8; ++z)
          if (block.has(x, y, z)) mark(block.at * 8 + V3i(x, y, z), block.at * 8 + V3i(x, y, z));
  }
  for (const V3i& tile : matter.layer()->tiles) {
    place_at(tile).filled = true;
    mark(tile * 8, tile * 8 + V3i(7, 7, 7));
  }
  slots_ = std::make_unique<Slot[]>(places_.size());
}

V3d TexelLevel::home(const V3d& p) const {
  V3d at = p;
  for (int k = 0; k < 3; ++k)
    if (wrap_[static_cast<std::size_t>(k)]) {
      at[k] -= std::floor(at[k] / extent_[k]) * extent_[k];
      if (!(at[k] < extent_[k])) at[k] = 0;  // rounding
    }
  return at;
}

int TexelLevel::empty_cell(const V3d& p) const {
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

// How much of a voxel with this index along `axis` lies within the box.
float TexelLevel::share_within(int axis, int index) const {
  const double share = extent_[axis] - index;
  return share >= 1 ? 1.0f : static_cast<float>(std::max(share, 1e-3));
}

TexelLevel::Voxel TexelLevel::prepared(const V3i& at) const {
  Voxel voxel;
  const V3f within(share_within(0, at.x), share_within(1, at.y), share_within(2, at.z));
  const float volume = within.x * within.y * within.z;
  const auto fuller = [&](float v) { return unit_share(v / volume); };
  const float* diagonal = diagonal_.at(at);
  const float* off = off_.at(at);
  // Without any surface grid every voxel is shaded as if its normals went all ways.
  voxel.surface = normal_.at(at) || diagonal || (!normal_.present() && !diagonal_.present());
  voxel.solid = static_cast<float>(fuller(solid_.value(at, 0)));
  if (!alpha_.present()) {
    const double depth = std::min(std::max(static_cast<double>(density_.value(at, 0)), 0.0) * level_.grid.h, 1e6) / static_cast<double>(volume);
    voxel.even = static_cast<float>(depth);
  } else if (const float* alpha = alpha_.at(at)) {
    // Across, only a share of the voxel's face lies in the box.
    const float* crossings = crossings_.at(at);
    V3f seen(0, 0, 0), met(0, 0, 0);
    for (int k = 0; k < 3; ++k) {
      seen[k] = alpha[k] * within[k] / volume;
      met[k] = crossings ? crossings[k] * within[k] / volume : 0;
    }
    voxel.within = within;
    voxel.opacity = axis_opacity(&seen.x, crossings ? &met.x : nullptr, diagonal, off, voxel.solid, static_cast<float>(1 - unit_share(transparency_.value(at, 0))));
  }
  const V3f m = normal_.color(at, V3f(0.0f));
  const float one_way = std::min(m.dot(m), 1.0f);
  if (sheets_) voxel.sheet = sheet_share(m, diagonal, off);
  if (voxel.solid > 0) {
    voxel.bounds = one_way;
    voxel.behind = 1;
    if (const float length = m.length(); length > 0) {
      voxel.behind = voxel.solid;
      for (const float way : {1.0f, 2.0f}) {
        V3i there = at;
        for (int k = 0; k < 3; ++k) there[k] -= static_cast<int>(std::lround(m[k] / length * way));
        voxel.behind = std::max(voxel.behind, static_cast<float>(unit_share(solid_.value(around(there), 0))));
      }
    }
  }
  voxel.known = voxel.surface && (voxel.solid > 0 || std::max({voxel.opacity.alpha.x, voxel.opacity.alpha.y, voxel.opacity.alpha.z, voxel.even}) > 0);
  return voxel;
}

V3i TexelLevel::around(V3i voxel) const {
  const V3i& n = level_.grid.n;
  for (int k = 0; k < 3; ++k) {
    if (wrap_[static_cast<std::size_t>(k)]) voxel[k] = ((voxel[k] % n[k]) + n[k]) % n[k];
    else voxel[k] = std::clamp(voxel[k], 0, n[k] - 1);
  }
  return voxel;
}

const TexelLevel::Voxel* TexelLevel::find(const V3i& at) const {
  const V3i b(at.x >> 3, at.y >> 3, at.z >> 3);
  const std::int32_t i = place_of_[place(b, blocks_)];
  if (i < 0 || !places_[static_cast<std::size_t>(i)].filled) return nullptr;
  Slot& slot = slots_[static_cast<std::size_t>(i)];
  std::call_once(slot.once, [&] {
    auto block = std::make_unique<Block>();
    for (int k = 0; k < 512; ++k) (*block)[static_cast<std::size_t>(k)] = prepared(V3i(b.x * 8 + (k >> 6), b.y * 8 + (k >> 3 & 7), b.z * 8 + (k & 7)));
    slot.block = std::move(block);
  });
  return &(*slot.block)[static_cast<std::size_t>((at.x & 7) << 6 | (at.y & 7) << 3 | (at.z & 7))];
}

double TexelLevel::depth(const Voxel& voxel, const V3d& d) {
  if (voxel.even >= 0) return static_cast<double>(voxel.even);
  return depth_along(voxel.opacity, d / V3d(voxel.within), kMaxDepth);
}

double TexelLevel::depth(const V3d& p, const V3d& d) const {
  const Voxel* voxel = find(around(floored(p)));
  return voxel ? depth(*voxel, d) : -1;
}

Matter TexelLevel::at(const V3d& p, const V3d& d, int axis) const {
  const V3d q = p - V3d(0.5, 0.5, 0.5);
  const V3i low = floored(q);
  const V3f f(static_cast<float>(q.x - low.x), static_cast<float>(q.y - low.y), static_cast<float>(q.z - low.z));
  Matter sum;
  float layers[2] = {0, 0};  // opacity of the two layers across the axis, times the weight of the layer
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner >> 2, dy = corner >> 1 & 1, dz = corner & 1;
    const Voxel* voxel = find(around(V3i(low.x + dx, low.y + dy, low.z + dz)));
    if (!voxel) continue;
    const float weight = (dx ? f.x : 1 - f.x) * (dy ? f.y : 1 - f.y) * (dz ? f.z : 1 - f.z);
    const float alpha = voxel->surface || voxel->solid <= 0 ? static_cast<float>(-std::expm1(-depth(*voxel, d))) : 0.0f;
    const float body = alpha * voxel->bounds;
    layers[(axis == 0 ? dx : axis == 1 ? dy : dz)] += weight * alpha;
    sum.sheet += weight * alpha * voxel->sheet;
    if (alpha > 0 && voxel->sheet > 0 && voxel->even < 0) sum.full += weight * voxel->sheet * std::max(static_cast<float>(sheet_along(voxel->opacity, d / V3d(voxel->within))) - alpha, 0.0f);
    sum.body += weight * body;
    sum.solid += weight * std::max(voxel->solid, body * (1 - voxel->behind));
  }
  for (int layer = 0; layer < 2; ++layer) {
    const float share = layer ? f[axis] : 1 - f[axis];
    if (layers[layer] > 0) sum.alpha -= share * std::log1p(-std::min(layers[layer] / share, 1 - 1e-6f));
  }
  return sum;
}

double TexelLevel::facets(const V3d& p, Facets* mean) const {
  const V3d q = p - V3d(0.5, 0.5, 0.5);
  const V3i low = floored(q);
  const V3d f(q.x - low.x, q.y - low.y, q.z - low.z);
  double total = 0, closed = 0, roughness = 0;
  Form s{0, 0, 0, 0, 0, 0};
  V3d m(0, 0, 0);
  V3f albedo(0.0f), ks(0.0f), ke(0.0f);
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner >> 2, dy = corner >> 1 & 1, dz = corner & 1;
    const V3i at = around(V3i(low.x + dx, low.y + dy, low.z + dz));
    const Voxel* voxel = find(at);
    if (!voxel || !voxel->known) continue;
    const double seen = voxel->even >= 0 ? -std::expm1(-static_cast<double>(voxel->even)) : static_cast<double>(voxel->opacity.alpha.x + voxel->opacity.alpha.y + voxel->opacity.alpha.z) / 3;
    const double opacity = std::max(seen, static_cast<double>(voxel->solid));
    const double weight = (dx ? f.x : 1 - f.x) * (dy ? f.y : 1 - f.y) * (dz ? f.z : 1 - f.z) * opacity;
    if (!(weight > 0)) continue;
    total += weight;
    if (voxel->solid > 0) closed += weight;
    const auto share = static_cast<float>(weight);
    albedo += albedo_.color(at, V3f(0.5f)) * share;
    ks += ks_.color(at, V3f(0.0f)) * share;
    ke += emission_.color(at, V3f(0.0f)) * share;
    roughness += weight * static_cast<double>(roughness_.value(at, 1));
    const V3d n(normal_.color(at, V3f(0.0f)));
    m += n * weight;
    const float *a = diagonal_.at(at), *b = off_.at(at);
    Form own;
    if (a && b) own = {static_cast<double>(a[0]), static_cast<double>(a[1]), static_cast<double>(a[2]), static_cast<double>(b[0]), static_cast<double>(b[1]), static_cast<double>(b[2])};
    else if (n.length() > 0.5) own = {n.x * n.x, n.y * n.y, n.z * n.z, n.x * n.y, n.x * n.z, n.y * n.z};
    s = {s.xx + weight * own.xx, s.yy + weight * own.yy, s.zz + weight * own.zz, s.xy + weight * own.xy, s.xz + weight * own.xz, s.yz + weight * own.yz};
  }
  if (!(total > 0)) return 0;
  const double one = 1 / total;
  const auto part = static_cast<float>(one);
  *mean = {{s.xx * one, s.yy * one, s.zz * one, s.xy * one, s.xz * one, s.yz * one}, m * one, closed > total / 2, {albedo * part, ks * part, ke * part, static_cast<float>(roughness * one)}};
  return total;
}

}  // namespace texel
