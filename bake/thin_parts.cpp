#include "bake/thin_parts.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace texel {
namespace {

constexpr int kSteps[3] = {1, kBrickSide, kBrickSide * kBrickSide};  // from a point to the next along each axis
constexpr int kClimbs = 4;          // Newton's steps; the first is right for distances
constexpr double kBeyond = 0.02;    // of a cell: a step's length beyond where f should be iso, to get inside rather than onto the surface

bool has(const BrickBits& bits, std::size_t i) { return (bits[i >> 6] >> (i & 63)) & 1; }

// Bits of the points moved down by n < 64.
BrickBits down(const BrickBits& b, int n) { return {b[0] >> n | b[1] << (64 - n), b[1] >> n}; }
BrickBits both(const BrickBits& a, const BrickBits& b) { return {a[0] & b[0], a[1] & b[1]}; }

// Cells by their lowest points: those whose eight corners are set.
BrickBits whole_cells(const BrickBits& points) {
  static constexpr BrickBits kLowest = [] {
    BrickBits bits{};
    for (int k = 0; k < kBrickCells; ++k)
      for (int j = 0; j < kBrickCells; ++j)
        for (int i = 0; i < kBrickCells; ++i) {
          const auto p = static_cast<std::size_t>(k * kSteps[2] + j * kSteps[1] + i);
          bits[p >> 6] |= std::uint64_t{1} << (p & 63);
        }
    return bits;
  }();
  BrickBits cells = points;
  for (const int step : kSteps) cells = both(cells, down(cells, step));
  return both(cells, kLowest);
}

}  // namespace

std::int64_t ThinParts::count(const BrickValues& brick) {
  const BrickBits cells = whole_cells(brick.outside);
  if ((cells[0] | cells[1]) == 0) return 0;
  find_candidates(brick, cells);
  BrickBits found{};
  for (int climb = 0; climb < kClimbs && !climbers_.empty(); ++climb) {
    find_gradients();
    std::size_t kept = 0;
    for (Climber c : climbers_) {
      const double length = c.slope.length();
      if (!(length > 0) || !std::isfinite(length)) continue;
      c.at += c.slope * ((iso_ - c.f) / (length * length) + kBeyond * brick.h / length);
      // Where it leads to is the cell that counts; beyond the brick, or in a cell that has a corner inside, nothing is missed.
      const V3d place = (c.at - brick.low) / brick.h;
      if (!(std::min({place.x, place.y, place.z}) >= 0 && std::max({place.x, place.y, place.z}) < kBrickCells)) continue;
      const auto cell = static_cast<std::size_t>(static_cast<int>(place.z) * kSteps[2] + static_cast<int>(place.y) * kSteps[1] + static_cast<int>(place.x));
      if (!has(cells, cell) || has(found, cell)) continue;
      field_.values(1, &c.at.x, &c.at.y, &c.at.z, &c.f);
      if (!(c.f >= iso_)) climbers_[kept++] = c;
      else if (is_thin(c, brick.h)) found[cell >> 6] |= std::uint64_t{1} << (cell & 63);
    }
    climbers_.resize(kept);
  }
  climbers_.clear();
  return std::popcount(found[0]) + std::popcount(found[1]);
}

// Cells that f, going on in straight lines from behind the cell's highest corner, could reach iso in. Beside an ordinary surface f rises out of
// such cells rather than into them.
void ThinParts::find_candidates(const BrickValues& brick, const BrickBits& cells) {
  climbers_.clear();
  BrickBits taken{};
  for (std::size_t word = 0; word < 2; ++word)
    for (std::uint64_t bits = cells[word]; bits != 0; bits &= bits - 1) {
      const std::size_t cell = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      std::size_t best = cell;
      int corner = 0;
      for (int c = 1; c < 8; ++c) {
        const std::size_t p = cell + static_cast<std::size_t>((c & 1) * kSteps[0] + (c >> 1 & 1) * kSteps[1] + (c >> 2) * kSteps[2]);
        if (brick.f[p] > brick.f[best]) {
          best = p;
          corner = c;
        }
      }
      const double top = brick.f[best];
      double reach = 0;
      for (int a = 0; a < 3; ++a) {
        const bool upper = corner >> a & 1;
        const int place = static_cast<int>(best) / kSteps[a] % kBrickSide, step = upper ? -kSteps[a] : kSteps[a];
        const auto at = [&](int n) { return brick.f[static_cast<int>(best) + n * step]; };
        // The point behind may be in the next brick: then by the line from beyond the cell, as far as that is above the corner.
        reach += (upper ? place + 1 < kBrickSide : place > 0) ? std::max(top - at(-1), 0.0) : std::max(at(1) + (at(1) - at(2)) - top, 0.0);
      }
      if (!(iso_ - top <= reach) || has(taken, best)) continue;
      taken[best >> 6] |= std::uint64_t{1} << (best & 63);
      const V3d place(static_cast<int>(best) % kBrickSide, static_cast<int>(best) / kSteps[1] % kBrickSide, static_cast<int>(best) / kSteps[2]);
      climbers_.push_back({brick.low + place * brick.h, top, {}});
    }
}

void ThinParts::find_gradients() {
  const std::size_t n = climbers_.size();
  for (auto* list : {&x_, &y_, &z_, &f_, &gx_, &gy_, &gz_}) list->resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    x_[i] = climbers_[i].at.x;
    y_[i] = climbers_[i].at.y;
    z_[i] = climbers_[i].at.z;
  }
  field_.gradients(n, x_.data(), y_.data(), z_.data(), f_.data(), gx_.data(), gy_.data(), gz_.data());
  for (std::size_t i = 0; i < n; ++i) climbers_[i].slope = V3d(gx_[i], gy_[i], gz_[i]);
}

// Whether f < iso again within the next cell's length in the direction in which f rose, and nothing thicker is near: the edges of thick parts end
// thinly too. Thicker than a cell is what is deeper than half of one, by the slope here.
bool ThinParts::is_thin(const Climber& c, double h) {
  const double length = c.slope.length();
  std::array<double, 52> x, y, z, f;
  std::size_t n = 0;
  const auto add = [&](const V3d& from_here) {
    x[n] = c.at.x + from_here.x;
    y[n] = c.at.y + from_here.y;
    z[n] = c.at.z + from_here.z;
    ++n;
  };
  for (int i = 1; i <= 4; ++i) add(c.slope * (h * i / (4 * length)));
  field_.values(n, x.data(), y.data(), z.data(), f.data());
  if (!(*std::min_element(f.data(), f.data() + n) < iso_)) return false;
  n = 0;
  for (int i = 0; i < 27; ++i)
    if (const V3d way(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1); way.length2() > 0)
      for (const double cells : {1.0, 2.0}) add(way * (cells * h / way.length()));
  field_.values(n, x.data(), y.data(), z.data(), f.data());
  return !(*std::max_element(f.data(), f.data() + n) >= iso_ + length * h / 2);
}

}  // namespace texel
