#include "bake/density_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "bake/crossings.h"
#include "formats/random.h"

namespace texel {
namespace {

constexpr int kBrick = 8;
constexpr int kLadder[] = {1, 2, 3, 4, 5, 6, 8, 10, 12, kMostDensitySamples};
constexpr int kDraws = 96;           // voxels at a time
constexpr int kJudgements = 4;       // of one number, by more voxels each time, before the next is tried, which costs as much more
constexpr double kAim = 0.85;        // of the error asked for: what is chosen by some voxels is seldom as good on others
constexpr double kConfidence = 2.326;  // one-sided, 99 %: of many bakes none should be beyond
constexpr double kUnseen = 0.5;      // share of the draws that goes by how the density varies, rather than by what the looks around differ in
constexpr double kFlat = 0.05;       // of the density: what may lie between the points of these
constexpr int kFewBlocks = 64;       // with fewer, smaller blocks are shared out

double held(double d) { return std::isnan(d) ? 0 : std::clamp(d, 0.0, 1.0); }

struct Candidate {
  V3i voxel;
  double apart, varies;              // squared difference of the opacities by 1 and by 2 points an edge, of all axes; difference of the density to the next voxels'
};

// Buffers of one task.
struct Points {
  std::vector<double> x, y, z, d;
  void add(const V3d& p) {
    x.push_back(p.x);
    y.push_back(p.y);
    z.push_back(p.z);
  }
  void ask(const Field& density) {
    d.resize(x.size());
    density.values(x.size(), x.data(), y.data(), z.data(), d.data());
    for (double& v : d) v = held(v);
  }
  void clear() { x.clear(), y.clear(), z.clear(); }
};

// The density of a brick at samples³ points a voxel, and one beyond on each side.
struct Block {
  int samples, side;
  Points points;
  Block(const Field& density, const Grid& grid, const V3i& first, int s) : samples(s), side(kBrick * s + 2), points() {
    for (int z = -1; z < side - 1; ++z)
      for (int y = -1; y < side - 1; ++y)
        for (int x = -1; x < side - 1; ++x) points.add(grid.to_world(V3d(first) + (V3d(x, y, z) + V3d(0.5)) / s));
    points.ask(density);
  }
  [[nodiscard]] const double* at(int x, int y, int z) const { return points.d.data() + ((static_cast<std::ptrdiff_t>(z) + 1) * side + y + 1) * side + x + 1; }
  [[nodiscard]] std::array<double, 3> opacity(const V3i& voxel, double depth) const {
    std::array<double, 3> alpha{};
    const std::array<std::ptrdiff_t, 3> stride{1, side, std::ptrdiff_t{side} * side};
    const double* first = at(voxel.x * samples, voxel.y * samples, voxel.z * samples);
    for (std::size_t a = 0; a < 3; ++a) {
      double pass = 0;
      for (int v = 0; v < samples; ++v)
        for (int u = 0; u < samples; ++u)
          pass += std::exp(-depth / samples * ray_depth(first + u * stride[(a + 1) % 3] + v * stride[(a + 2) % 3], static_cast<std::size_t>(stride[a]), samples));
      alpha[a] = 1 - pass / (samples * samples);
    }
    return alpha;
  }
};

// Of one brick: voxels in which, or next to which, the density is not known to be 0 or 1 throughout.
void look_around(const Field& density, const Grid& grid, double scale, const V3i& brick, std::vector<Candidate>& out) {
  const V3i first = brick * kBrick;
  V3i n;
  for (int a = 0; a < 3; ++a) n[a] = std::min(kBrick, grid.n[a] - first[a]);
  const Interval range = density.range({grid.to_world(V3d(first) - V3d(1)), grid.to_world(V3d(first + n) + V3d(1))});
  if (range.high <= 0 || range.low >= 1) return;
  const Block once(density, grid, first, 1), twice(density, grid, first, 2);
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        const double here = *once.at(x, y, z);
        Candidate c{first + V3i(x, y, z), 0, kFlat};
        for (const double d : {*once.at(x - 1, y, z), *once.at(x + 1, y, z), *once.at(x, y - 1, z), *once.at(x, y + 1, z), *once.at(x, y, z - 1), *once.at(x, y, z + 1)})
          c.varies = std::max(c.varies, std::abs(d - here) + kFlat);
        const auto rough = once.opacity(V3i(x, y, z), scale * grid.h), fine = twice.opacity(V3i(x, y, z), scale * grid.h);
        for (std::size_t a = 0; a < 3; ++a) c.apart += (rough[a] - fine[a]) * (rough[a] - fine[a]);
        out.push_back(c);
      }
}

struct Shot {
  std::array<double, 3> square{0, 0, 0};  // squared error, per axis
  double border = 0;                      // 1: a voxel with matter that is not all of it; else 0
};

struct Shooter {
  const Field& density;
  const Grid& grid;
  double scale;

  // Opacity along one axis by these rays, `steps` points a voxel along each. `zeros`, `ones`: whether all points, those next to the voxel too, are.
  double opacity(const V3i& voxel, int axis, const RayPattern& pattern, int steps, Points& points, bool* zeros, bool* ones) const {
    const BundleAxes axes = bundle_axes(axis);
    points.clear();
    for (int r = 0; r < pattern.rows; ++r)
      for (int j = 0; j < pattern.per_row; ++j)
        for (int k = -1; k <= steps; ++k) {
          V3d p(voxel);
          p[axes.u] += pattern.u[static_cast<std::size_t>(r * pattern.per_row + j)] * 0x1p-16;
          p[axes.v] += pattern.v[static_cast<std::size_t>(r)] * 0x1p-16;
          p[axes.w] += (k + 0.5) / steps;
          points.add(grid.to_world(p));
        }
    points.ask(density);
    for (const double d : points.d) {
      *zeros = *zeros && d <= 0;
      *ones = *ones && d >= 1;
    }
    double pass = 0;
    for (std::size_t ray = 0; ray < static_cast<std::size_t>(pattern.rays()); ++ray)
      pass += std::exp(-scale * grid.h / steps * ray_depth(points.d.data() + ray * (static_cast<std::size_t>(steps) + 2) + 1, 1, steps));
    return 1 - pass / pattern.rays();
  }

  // The product of the differences from two truths whose own errors have nothing to do with each other has the error's square as its mean.
  [[nodiscard]] Shot shoot(const V3i& voxel, int samples) const {
    Points points;
    Shot shot;
    bool zeros = true, ones = true, of_truth = true;
    const int finer = (3 * samples + 1) / 2;
    for (int axis = 0; axis < 3; ++axis) {
      const double alpha = opacity(voxel, axis, make_pattern(Pattern::kGrid, samples), samples, points, &zeros, &ones);
      const double one = opacity(voxel, axis, make_sheared_pattern(2 * finer, (finer + 1) / 2), 4 * samples, points, &of_truth, &of_truth);
      const double other = opacity(voxel, axis, make_sheared_pattern(2 * finer + 1, finer / 2 + 1), 4 * samples + 1, points, &of_truth, &of_truth);
      shot.square[static_cast<std::size_t>(axis)] = (alpha - one) * (alpha - other);
    }
    shot.border = zeros || ones ? 0 : 1;
    return shot;
  }
};

// Sums over all voxels, estimated from draws: of the squared errors with that estimate's variance, and of the border voxels.
struct Judged {
  std::array<double, 3> square{0, 0, 0}, variance{0, 0, 0};
  double border = 0;
  [[nodiscard]] bool within(double error, double spreads) const {
    for (std::size_t a = 0; a < 3; ++a)
      if (square[a] + spreads * std::sqrt(variance[a]) > error * error * border) return false;
    return true;
  }
};

// Half of the candidates.
struct Half {
  std::vector<V3i> voxels;
  std::vector<double> passed{0};     // weight of those before, one more than voxels
  void add(const V3i& voxel, double weight) {
    voxels.push_back(voxel);
    passed.push_back(passed.back() + weight);
  }

  struct Drawn { V3i voxel; double probability; };
  // One voxel in each of kDraws equal parts of the weight; `number` of the drawing.
  void draw(std::uint64_t number, std::vector<Drawn>& to) const {
    for (std::uint64_t k = 0; k < kDraws; ++k) {
      const double at = (static_cast<double>(k) + unit_of(mix_bits(number * kDraws + k))) / kDraws * passed.back();
      const auto i = static_cast<std::size_t>(std::upper_bound(passed.begin() + 1, passed.end() - 1, at) - passed.begin()) - 1;
      to.push_back({voxels[i], (passed[i + 1] - passed[i]) / passed.back()});
    }
  }
};

// `whole`: the weight of all candidates over that of the half.
Judged judge(const Shooter& shooter, std::span<const Half::Drawn> drawn, int samples, double whole) {
  std::vector<Shot> shots(drawn.size());
  tbb::parallel_for(std::size_t{0}, drawn.size(), [&](std::size_t i) { shots[i] = shooter.shoot(drawn[i].voxel, samples); });
  Judged sums;
  const auto n = static_cast<double>(drawn.size());
  for (std::size_t i = 0; i < drawn.size(); ++i) sums.border += shots[i].border * whole / drawn[i].probability / n;
  for (std::size_t a = 0; a < 3; ++a) {
    double sum = 0, sum2 = 0;
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      const double x = shots[i].square[a] * whole / drawn[i].probability;
      sum += x;
      sum2 += x * x;
    }
    sums.square[a] = std::max(0.0, sum / n);
    sums.variance[a] = std::max(0.0, sum2 / n - (sum / n) * (sum / n)) / (n - 1);
  }
  return sums;
}

}  // namespace

DensityChoice choose_density_samples(const Field& density, const Grid& grid, const Recipe& recipe, double scale, Report& report) {
  const auto tell = [&](double done) { if (report.progress) report.progress("choosing points", done); };
  tell(0);
  const V3i n((grid.n.x + kBrick - 1) / kBrick, (grid.n.y + kBrick - 1) / kBrick, (grid.n.z + kBrick - 1) / kBrick);
  std::vector<std::vector<Candidate>> rows(static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z));
  tbb::parallel_for(0, n.y * n.z, [&](int row) {
    for (int x = 0; x < n.x; ++x) look_around(density, grid, scale, V3i(x, row % n.y, row / n.y), rows[static_cast<std::size_t>(row)]);
  });
  std::size_t candidates = 0;
  double apart = 1e-300, varies = 1e-300;
  for (const auto& row : rows) {
    candidates += row.size();
    for (const Candidate& c : row) {
      apart += c.apart;
      varies += c.varies;
    }
  }
  // Blocks of 8³ voxels, or of 2³ where there are few.
  const int shift = candidates < std::size_t{kFewBlocks} * kBrick * kBrick * kBrick ? 1 : 3;
  std::array<Half, 2> halves;        // that choose; that judge
  double all = 0;
  for (const auto& row : rows)
    for (const Candidate& c : row) {
      const auto place = static_cast<std::uint64_t>(c.voxel.x >> shift) | static_cast<std::uint64_t>(c.voxel.y >> shift) << 20 | static_cast<std::uint64_t>(c.voxel.z >> shift) << 40;
      const double weight = (1 - kUnseen) * c.apart / apart + kUnseen * c.varies / varies;
      halves[mix_bits(place) & 1].add(c.voxel, weight);
      all += weight;
    }
  DensityChoice choice;
  if (halves[0].voxels.empty() || halves[1].voxels.empty()) {  // a handful of voxels: they cost nothing
    choice.samples = candidates == 0 ? 1 : kMostDensitySamples;
    return choice;
  }
  const Shooter shooter{density, grid, scale};
  std::vector<Half::Drawn> choosing, judging;
  halves[0].draw(0, choosing);
  std::uint64_t drawings = 1;
  bool found = false;
  for (std::size_t s = 0; s < std::size(kLadder) && !found; ++s) {
    const int samples = choice.samples = kLadder[s];
    const bool last = s + 1 == std::size(kLadder);
    tell(static_cast<double>(s) / static_cast<double>(std::size(kLadder)));
    if (!last && !judge(shooter, choosing, samples, all / halves[0].passed.back()).within(kAim * recipe.max_error, 0)) continue;
    judging.clear();
    for (int again = 0; again < kJudgements && !found; ++again) {
      halves[1].draw(drawings++, judging);
      const Judged judged = judge(shooter, judging, samples, all / halves[1].passed.back());
      choice.square = judged.square;
      choice.variance = judged.variance;
      found = judged.within(recipe.max_error, kConfidence);
      if (!judged.within(recipe.max_error, 0)) break;  // more draws would not help
    }
  }
  choice.met = found;
  tell(1);
  return choice;
}

}  // namespace texel
