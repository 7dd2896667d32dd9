#include "bake/lobes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "bake/block_index.h"
#include "bake/ndf.h"

namespace texel {
namespace {

constexpr int kRounds = 16;
constexpr double kFlat = 1e-6;   // of the largest eigenvalue: normals of one direction, but for rounding
constexpr double kWorth = 0.9;   // of the error of one lobe

using Exact = std::array<double, kShadowAxes>;

Symmetric second_moment(const Moments& m) { return {m.xx, m.yy, m.zz, m.xy, m.xz, m.yz}; }

double form(const Moments& m, const V3d& a) { return a.x * (m.xx * a.x + 2 * (m.xy * a.y + m.xz * a.z)) + a.y * (m.yy * a.y + 2 * m.yz * a.z) + m.zz * a.z * a.z; }
double form(const Symmetric& m, const V3d& a) { return a.x * (m.xx * a.x + 2 * (m.xy * a.y + m.xz * a.z)) + a.y * (m.yy * a.y + 2 * m.yz * a.z) + m.zz * a.z * a.z; }

void add_lobe(const Moments& m, Exact& to) {
  const SggxLobe lobe = sggx_lobe(m);
  const auto& axes = shadow_axes();
  for (std::size_t k = 0; k < axes.size(); ++k) to[k] += lobe.scale * std::sqrt(std::max(0.0, form(lobe.s, axes[k])));
}

// Mean square error over the axes.
double error_of(const Exact& sigma, const Shadow& truth) {
  double sum = 0;
  for (std::size_t k = 0; k < sigma.size(); ++k) {
    const double e = sigma[k] - static_cast<double>(truth[k]);
    sum += shadow_weights()[k] * e * e;
  }
  return sum;
}

// Which way most of a piece faces, roughly: the longest column of its Σ A n nᵀ, for a flat piece its normal.
V3d rough_axis(const Moments& m) {
  V3d axis(m.xx, m.xy, m.xz);
  if (m.yy > m.xx && m.yy >= m.zz) axis = V3d(m.xy, m.yy, m.yz);
  else if (m.zz > m.xx) axis = V3d(m.xz, m.yz, m.zz);
  const double length = axis.length();
  return length > 0 ? axis / length : V3d(0, 0, 1);
}

// Flat: of one normal, but for rounding or a slight bend.
bool flat(const Moments& m, double spread) {
  const double trace = m.xx + m.yy + m.zz, squares = m.xx * m.xx + m.yy * m.yy + m.zz * m.zz + 2 * (m.xy * m.xy + m.xz * m.xz + m.yz * m.yz);
  return squares >= (1 - 2 * spread) * trace * trace;
}

// Groups about an axis each, or about a plane each: a piece goes to the axis that more of its normals lie near, or to the plane they are nearer to.
enum class About { kAxis, kPlane };

struct Groups {
  std::array<Moments, 2> sum;
  std::array<V3d, 2> axis;
};

bool regroup(std::span<const Moments> pieces, About about, Groups& groups, std::vector<char>& of) {
  bool changed = false;
  groups.sum = {};
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const double a = form(pieces[i], groups.axis[0]), b = form(pieces[i], groups.axis[1]);
    const char to = about == About::kAxis ? b > a : b < a;
    changed = changed || to != of[i];
    of[i] = to;
    groups.sum[static_cast<std::size_t>(to)] += pieces[i];
  }
  return changed;
}

Groups group(std::span<const Moments> pieces, About about, const std::array<V3d, 2>& start, std::vector<char>& of) {
  Groups groups;
  groups.axis = start;
  of.assign(pieces.size(), 2);
  for (int round = 0; round < kRounds && regroup(pieces, about, groups, of); ++round)
    for (std::size_t g = 0; g < 2; ++g) {
      if (!(groups.sum[g].covered > 0)) continue;
      const Eigen3 e = eigen(second_moment(groups.sum[g]));
      if (about == About::kPlane && !(e.value[1] > kFlat * e.value[0])) return groups;  // any plane along one normal would do, and a turned scene would get another
      groups.axis[g] = e.vector[about == About::kAxis ? 0 : 2];
    }
  return groups;
}

// The largest piece, and the one that has most off it.
std::array<V3d, 2> far_apart(std::span<const Moments> pieces) {
  std::size_t largest = 0, other = 0;
  for (std::size_t i = 1; i < pieces.size(); ++i)
    if (pieces[i].covered > pieces[largest].covered) largest = i;
  const V3d axis = rough_axis(pieces[largest]);
  double most = -1;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    if (const double off = pieces[i].covered - form(pieces[i], axis); off > most) {
      most = off;
      other = i;
    }
  return {axis, rough_axis(pieces[other])};
}

// Eight bands of the half sphere by sixteen longitudes, once for flat pieces and once for others.
std::uint32_t direction_bin(const Moments& m) {
  V3d n = rough_axis(m);
  if (n.z < 0) n = -n;
  const int row = std::clamp(static_cast<int>(n.z * 8), 0, 7), column = std::clamp(static_cast<int>((std::atan2(n.y, n.x) / M_PI + 1) * 8), 0, 15);
  return static_cast<std::uint32_t>((row * 16 + column) * 2 + (flat(m, 0.05) ? 1 : 0));
}

std::vector<std::uint32_t> sorted_order(const std::vector<std::uint32_t>& keys) {
  std::vector<std::uint32_t> order(keys.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  return order;
}

template <class T>
void permute(const std::vector<std::uint32_t>& order, std::vector<T>& values) {
  std::vector<T> out;
  out.reserve(values.size());
  for (const std::uint32_t i : order) out.push_back(values[i]);
  values = std::move(out);
}

}  // namespace

const std::array<V3d, kShadowAxes>& shadow_axes() {
  static const std::array<V3d, kShadowAxes> axes = [] {
    std::array<V3d, kShadowAxes> all;
    std::size_t n = 0;
    const auto add = [&](double x, double y, double z) { all[n++] = V3d(x, y, z) / std::sqrt(x * x + y * y + z * z); };
    for (int k = 0; k < 3; ++k) add(k == 0, k == 1, k == 2);
    for (const int s : {1, -1}) {
      add(1, s, 0);
      add(1, 0, s);
      add(0, 1, s);
    }
    for (int i = 0; i < 4; ++i) add(1, i & 1 ? -1 : 1, i & 2 ? -1 : 1);
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 4; ++i) {
        double v[3] = {1.0, i & 1 ? -1.0 : 1.0, i & 2 ? -1.0 : 1.0};
        v[k] *= 3;
        add(v[0], v[1], v[2]);
      }
    return all;
  }();
  return axes;
}

const std::array<double, kShadowAxes>& shadow_weights() {
  static const std::array<double, kShadowAxes> weights = [] {
    std::array<double, kShadowAxes> all;  // an axis is two points of the rule
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = 2 * (i < 3 ? 4.0 / 315 : i < 9 ? 64.0 / 2835 : i < 13 ? 27.0 / 1280 : 14641.0 / 725760);
    return all;
  }();
  return weights;
}

void add_shadow(const Moments& piece, Shadow& to) {
  if (!(piece.covered > 0)) return;
  const auto& axes = shadow_axes();
  if (flat(piece, 1e-9)) {
    const V3d n = rough_axis(piece);
    for (std::size_t k = 0; k < axes.size(); ++k) to[k] += static_cast<float>(piece.covered * std::abs(n.dot(axes[k])));
    return;
  }
  Exact sigma{};
  add_lobe(piece, sigma);
  for (std::size_t k = 0; k < axes.size(); ++k) to[k] += static_cast<float>(sigma[k]);
}

void LobePieces::clear() {
  voxels_.clear();
  pieces_.clear();
  limit_ = first_limit_;
}

void LobePieces::add(std::uint32_t voxel, const Moments& piece) {
  if (pieces_.size() >= limit_) {
    merge();
    limit_ = std::max(first_limit_, 2 * pieces_.size());
  }
  voxels_.push_back(voxel);
  pieces_.push_back(piece);
}

void LobePieces::sort() {
  const std::vector<std::uint32_t> order = sorted_order(voxels_);
  permute(order, voxels_);
  permute(order, pieces_);
}

void LobePieces::merge() {
  std::size_t kept = 0;
  std::vector<std::uint32_t> bins;
  sort();
  for (std::size_t i = 0, j = 0; i < voxels_.size(); i = j) {
    while (j < voxels_.size() && voxels_[j] == voxels_[i]) ++j;
    const std::uint32_t voxel = voxels_[i];
    if (j - i <= kMostPieces) {
      for (std::size_t k = i; k < j; ++k, ++kept) {
        voxels_[kept] = voxel;
        pieces_[kept] = pieces_[k];
      }
      continue;
    }
    // First met, first in the list.
    const std::size_t begin = kept;
    std::array<std::int32_t, 256> place;
    place.fill(-1);
    for (std::size_t k = i; k < j; ++k) {
      std::int32_t& at = place[direction_bin(pieces_[k])];
      if (at >= 0) {
        pieces_[begin + static_cast<std::size_t>(at)] += Moments(pieces_[k]);
        continue;
      }
      at = static_cast<std::int32_t>(kept - begin);
      voxels_[kept] = voxel;
      pieces_[kept] = pieces_[k];
      ++kept;
    }
  }
  voxels_.resize(kept);
  pieces_.resize(kept);
}

Moments first_group(const Moments& whole, const Moments& second) {
  Moments first = whole;
  if (second.covered > 0) first.add(second, -1);
  return first;
}

Moments second_group(const Moments& whole, std::span<const Moments> pieces, const Shadow& shadow) {
  if (pieces.size() < 2 || !(whole.covered > 0)) return {};
  Exact one{};
  add_lobe(whole, one);
  const double error = error_of(one, shadow), mean = whole.covered / 2;
  if (!(error > kSeen * kSeen * mean * mean)) return {};
  double least = kWorth * kWorth * error;
  Moments best;
  std::vector<char> of;
  const auto attempt = [&](About about, const std::array<V3d, 2>& start) {
    const Groups groups = group(pieces, about, start, of);
    const Moments& second = groups.sum[groups.sum[1].covered <= groups.sum[0].covered ? 1 : 0];
    if (!(second.covered >= kLeastShare * whole.covered)) return;
    Exact two{};
    add_lobe(first_group(whole, second), two);
    add_lobe(second, two);
    if (const double e = error_of(two, shadow); e < least) {
      least = e;
      best = second;
    }
  };
  attempt(About::kAxis, far_apart(pieces));
  if (pieces.size() > 2) {
    const Eigen3 e = eigen(second_moment(whole));
    attempt(About::kPlane, {(e.vector[2] + e.vector[1]) * M_SQRT1_2, (e.vector[2] - e.vector[1]) * M_SQRT1_2});
  }
  return best;
}

void coarser_lobes(const Surface& fine, Surface& coarse) {
  if (fine.lobes.empty()) return;
  coarse.lobes.resize(static_cast<std::size_t>(coarse.set.count));
  V3i top(0, 0, 0);
  for (const Block& b : fine.set.blocks) top = V3i(std::max(top.x, b.at.x), std::max(top.y, b.at.y), std::max(top.z, b.at.z));
  const BlockIndex children(fine.set, (top + V3i(1, 1, 1)) * 8);
  tbb::parallel_for(std::size_t{0}, coarse.set.blocks.size(), [&](std::size_t n) {
    const Block& block = coarse.set.blocks[n];
    std::vector<Moments> groups;
    std::int64_t index = block.first;
    for (int x = 0; x < 8; ++x)
      for (std::uint64_t word = block.mask[static_cast<std::size_t>(x)]; word; word &= word - 1, ++index) {
        const int bit = __builtin_ctzll(word);
        const V3i low = (block.at * 8 + V3i(x, bit >> 3, bit & 7)) * 2;
        const std::int32_t slot = children(V3i(low.x >> 3, low.y >> 3, low.z >> 3));
        if (slot < 0) continue;
        const Block& from = fine.set.blocks[static_cast<std::size_t>(slot)];
        Lobes& lobes = coarse.lobes[static_cast<std::size_t>(index)];
        groups.clear();
        for (int i = 0; i < 8; ++i) {
          const int cx = (low.x & 7) + (i >> 2), cy = (low.y & 7) + (i >> 1 & 1), cz = (low.z & 7) + (i & 1);
          if (!from.has(cx, cy, cz)) continue;
          const auto child = static_cast<std::size_t>(from.index(cx, cy, cz));
          const Lobes& its = fine.lobes[child];
          for (std::size_t k = 0; k < its.shadow.size(); ++k) lobes.shadow[k] += its.shadow[k];
          if (const Moments first = first_group(fine.moments[child], its.second); first.covered > 0) groups.push_back(first);
          if (its.second.covered > 0) groups.push_back(its.second);
        }
        lobes.second = second_group(coarse.moments[static_cast<std::size_t>(index)], groups, lobes.shadow);
      }
  });
}

}  // namespace texel
