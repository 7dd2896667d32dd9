#include "bake/samples.h"

#include <algorithm>
#include <cmath>

#include "bake/axis_rays.h"
#include "formats/random.h"

namespace texel {
namespace {

constexpr int kFirst = 2;            // rays of the look around
constexpr int kDraws = 48, kBatches = 8;  // columns drawn at a time, and how often at the most, per axis
constexpr double kAim = 0.85;        // of the error asked for: what is chosen by some columns is seldom as good on others
constexpr int kLadder[] = {2, 3, 4, 6, 8, 12, 16, 24, 32};  // rays along a voxel's edge
constexpr std::size_t kTried = 4;    // of these, at first
constexpr double kFiner = 1.5;       // the truths' rays along an edge, of the most tried
constexpr double kColumnCost = 6;    // of a column, in rays
constexpr double kConfidence = 1.645;  // one-sided, 95 %
constexpr double kShared = 1.25;     // squared error of the first rays over half the squared difference of the two looks: what both overlook. Measured: 1.0 to 1.3
constexpr double kSharedSpread = 0.15;  // of that factor
constexpr double kUnseen = 0.5;      // share of the draws that goes by what the first rays may have overlooked

// Level 0 of one axis, opacity alone.
struct Look {
  const Scene& scene;
  const Plan& plan;
  const TextureSet& textures;
  const Surface& surface;
  const Recipe& recipe;
  VisibilityOptions options;
  const SlabSums& below;

  std::vector<float> alpha(const Bundle& bundle, bool plain, std::vector<float>* doubt) const {
    VisibilityResult result;
    result.levels.resize(1);
    SlabSums sums;
    sums.begins_inside = below.begins_inside;
    sums.inside = below.inside;
    see_axis({.bundles = {&bundle, 1}, .surfaces = {&surface, 1}, .options = options, .shade = {}, .plain = plain}, {.result = result, .slabs = sums, .doubt = doubt}, [](double) {});
    return std::move(result.levels[0].alpha[static_cast<std::size_t>(bundle.axis)]);
  }
};

struct Draw {
  std::size_t column;
  double probability;                // of one draw
  std::array<double, std::size(kLadder)> square{};  // error, squared, summed over the column's voxels: per number of rays that was tried
};

// Sum of the squared errors over all voxels, estimated, and that estimate's variance.
struct Estimate {
  double square = 0, variance = 0;
  [[nodiscard]] double upper(double spreads) const { return square + spreads * std::sqrt(variance); }
};

struct AxisChooser {
  int tiles_u = 0, nu = 0;
  bool cutouts = false;
  std::size_t tried = kTried;        // of kLadder
  std::vector<double> doubt;         // per tile, what its columns were drawn by
  double all = 0;                    // sum of these
  std::vector<double> apart;         // per tile, over all its columns: squared error of the first rays by the second look
  std::array<double, std::size(kLadder)> left{1};  // of the squared error of the first rays, per number of rays
  std::vector<Draw> draws;

  [[nodiscard]] std::size_t tile_of(std::size_t column) const {
    const std::size_t u = column % static_cast<std::size_t>(nu), v = column / static_cast<std::size_t>(nu);
    return (v >> 3) * static_cast<std::size_t>(tiles_u) + (u >> 3);
  }

  // Of tiles with these places in the ladder, by the draws from `first` on.
  [[nodiscard]] Estimate estimate(std::span<const std::uint8_t> of_tile, std::size_t first) const {
    double sum = 0, sum2 = 0;
    for (std::size_t k = first; k < draws.size(); ++k) {
      const double x = draws[k].square[of_tile[tile_of(draws[k].column)]] / draws[k].probability;
      sum += x;
      sum2 += x * x;
    }
    const auto n = static_cast<double>(draws.size() - first);
    return {std::max(0.0, sum / n), std::max(0.0, sum2 / n - (sum / n) * (sum / n)) / (n - 1)};
  }

  // The same by the two looks at all columns: few voxels that err much are in no draw, mostly, but they are in these. What more rays leave of it, the draws tell
  // more surely than how much it is; never less than theory has it, the number along an edge to −3, nor, up to 4 of them, than what closed solids were measured
  // to leave, to −1.5 (docs/accuracy.md, "Opacity").
  [[nodiscard]] Estimate estimate_by_looks(std::span<const std::uint8_t> of_tile) const {
    double looks = 0;
    for (std::size_t t = 0; t < of_tile.size(); ++t) looks += apart[t] * left[of_tile[t]];
    return {looks, kSharedSpread * kSharedSpread * looks * looks};
  }

  // By the draws so far, which have all numbers tried.
  void find_left() {
    std::array<double, std::size(kLadder)> error{};
    for (std::size_t s = 0; s < tried; ++s)
      for (const Draw& d : draws) error[s] += std::max(0.0, d.square[s] / d.probability);
    for (std::size_t s = 0; s < std::size(kLadder); ++s) {
      const double edge = kLadder[s], theory = cutouts ? std::pow(kFirst / edge, 3) : std::pow(kFirst / std::min(edge, 4.0), 1.5) * std::pow(4 / std::max(edge, 4.0), 3);
      left[s] = s < tried && error[0] > 0 ? std::clamp(error[s] / error[0], theory, 1.0) : theory;
    }
  }

  // Every tile takes what is cheapest for it: its share of the error at that number of rays, and the rays at their price. Places in the ladder.
  [[nodiscard]] std::vector<std::uint8_t> at_price(double price) const {
    std::array<double, std::size(kLadder)> error{};  // per doubt
    for (std::size_t s = 0; s < tried; ++s) {
      for (const Draw& d : draws) error[s] += d.square[s] / d.probability;
      error[s] = std::max(0.0, error[s]) / (static_cast<double>(draws.size()) * all);
    }
    std::vector<std::uint8_t> of_tile(doubt.size(), 0);
    for (std::size_t t = 0; t < doubt.size(); ++t) {
      double least = 0;
      for (std::size_t s = 0; s < tried; ++s) {
        const double cost = error[s] * doubt[t] + price * 64 * (kLadder[s] * kLadder[s] + kColumnCost);
        if (s > 0 && !(cost < least)) continue;
        least = cost;
        of_tile[t] = static_cast<std::uint8_t>(s);
      }
    }
    return of_tile;
  }

  // The fewest rays for an error `wanted` by all draws so far; none where the most that were tried are too few.
  [[nodiscard]] std::vector<std::uint8_t> choose(double wanted, double voxels) const {
    for (double price = 1; price > 1e-12; price *= 0.6) {
      std::vector<std::uint8_t> of_tile = at_price(price * all / voxels);
      if (std::max(estimate(of_tile, 0).upper(1), estimate_by_looks(of_tile).upper(1)) <= wanted) return of_tile;
    }
    return {};
  }
};

// The columns of one axis that were drawn together. Whatever is traced is kept by voxel, so that more numbers of rays and finer truths can follow.
struct Batch {
  std::vector<std::uint32_t> voxels;         // over the columns, level 0
  std::vector<std::size_t> column_of;        // of these
  std::size_t first = 0;                     // its first draw
  std::vector<char> mask;                    // per column
  Bundle bundle;
  int finest = 0;                            // rays of the truths along a voxel's edge
  std::vector<float> truth, other;
  std::array<std::vector<float>, std::size(kLadder)> alpha;
};

struct Batches {
  const Look& look;
  const Bundle& bundle;
  AxisChooser& chooser;
  std::span<const std::uint32_t> column_of;  // per voxel
  std::span<const double> passed;            // doubt of all columns before, per column and one more
  double max_error;
  bool cutouts;
  std::vector<Batch> all{};

  // Columns by their doubt, one in each of kDraws equal parts of it.
  void draw() {
    Batch& b = all.emplace_back();
    b.first = chooser.draws.size();
    b.mask.assign(passed.size() - 1, 0);
    const std::size_t number = static_cast<std::size_t>(bundle.axis) * kBatches + all.size() - 1;
    for (int k = 0; k < kDraws; ++k) {
      const double at = (k + unit_of(mix_bits(number * kDraws + static_cast<std::size_t>(k)))) / kDraws * passed.back();
      const auto above = std::upper_bound(passed.begin() + 1, passed.end() - 1, at);
      const auto column = static_cast<std::size_t>(above - passed.begin()) - 1;
      b.mask[column] = 1;
      chooser.draws.push_back({column, (passed[column + 1] - passed[column]) / passed.back(), {}});
    }
    b.bundle = narrow_bundle(bundle, b.mask);
    for (std::uint32_t i = 0; i < column_of.size(); ++i) {
      if (b.mask[column_of[i]] == 0) continue;
      b.voxels.push_back(i);
      b.column_of.push_back(column_of[i]);
    }
  }

  [[nodiscard]] std::vector<float> trace(Batch& b, RayPattern pattern, bool plain) const {
    b.bundle.pattern = std::move(pattern);
    const std::vector<float> alpha = look.alpha(b.bundle, plain, nullptr);
    std::vector<float> of_batch;
    of_batch.reserve(b.voxels.size());
    for (const std::uint32_t i : b.voxels) of_batch.push_back(alpha[i]);
    return of_batch;
  }

  // Two truths: their own errors have nothing to do with each other, so the product of the differences from both has the error's square as its mean, however
  // rough they are; that of one difference would add the truth's. More rays keep it from scattering. Neither rows nor places in a row in common, since the
  // errors of plain grids do have to do with each other wherever edges lie along the axes.
  void find_truths(Batch& b) {
    const int samples = std::clamp(static_cast<int>(std::ceil(std::max(kFiner * kLadder[chooser.tried - 1], (cutouts ? 0.1 : 0.05) / max_error))), 8, 40);
    if (samples <= b.finest) return;
    b.finest = samples;
    b.truth = trace(b, make_sheared_pattern(2 * samples, (samples + 1) / 2), cutouts);
    b.other = trace(b, make_sheared_pattern(2 * samples + 1, samples / 2 + 1), cutouts);
  }

  // The next batch's errors where each tile has these rays. `of_tile` empty: those of each number of rays tried.
  void trace_next(std::span<const std::uint8_t> of_tile) {
    draw();
    Batch& b = all.back();
    find_truths(b);
    if (of_tile.empty()) {
      compare(b);
      return chooser.find_left();
    }
    // Each column by its own number alone: if they confirm the choice, the others are never asked for.
    const std::vector<char> whole = b.mask;
    std::vector<double> square(whole.size(), 0.0);
    for (std::size_t s = 0; s < chooser.tried; ++s) {
      bool any = false;
      for (std::size_t c = 0; c < whole.size(); ++c) any = (b.bundle.columns[c] = static_cast<char>(whole[c] != 0 && of_tile[chooser.tile_of(c)] == s)) != 0 || any;
      if (!any) continue;
      const std::vector<float> alpha = trace(b, make_pattern(look.recipe.pattern, kLadder[s]), false);
      for (std::size_t i = 0; i < alpha.size(); ++i)
        if (b.bundle.columns[b.column_of[i]] != 0) square[b.column_of[i]] += error2(b, i, alpha[i]);
    }
    b.bundle.columns = whole;
    for (std::size_t k = b.first; k < chooser.draws.size(); ++k) chooser.draws[k].square[of_tile[chooser.tile_of(chooser.draws[k].column)]] = square[chooser.draws[k].column];
  }

  // Every batch's errors of every number of rays tried.
  void compare_all() {
    for (Batch& b : all) compare(b);
    chooser.find_left();
  }

 private:
  static double error2(const Batch& b, std::size_t i, float alpha) {
    const auto x = static_cast<double>(alpha);
    return (x - static_cast<double>(b.truth[i])) * (x - static_cast<double>(b.other[i]));
  }

  void compare(Batch& b) {
    find_truths(b);
    const std::size_t end = &b == &all.back() ? chooser.draws.size() : (&b + 1)->first;
    std::vector<double> square(b.mask.size());
    for (std::size_t s = 0; s < chooser.tried; ++s) {
      if (b.alpha[s].empty()) b.alpha[s] = trace(b, make_pattern(look.recipe.pattern, kLadder[s]), false);
      for (const std::size_t c : b.column_of) square[c] = 0;
      for (std::size_t i = 0; i < b.voxels.size(); ++i) square[b.column_of[i]] += error2(b, i, b.alpha[s][i]);
      for (std::size_t k = b.first; k < end; ++k) chooser.draws[k].square[s] = square[chooser.draws[k].column];
    }
  }
};

}  // namespace

SampleChoice choose_samples(const Scene& scene, const Plan& plan, const TextureSet& textures, const Surface& surface, const Recipe& recipe, const VisibilityOptions& options, const SlabSums& below,
                            bool cutouts, Report& report) {
  SampleChoice choice;
  const auto count = static_cast<std::size_t>(surface.set.count);
  choice.voxels = static_cast<double>(count);
  Look look{scene, plan, textures, surface, recipe, options, below};
  look.options.slice_axes = {false, false, false};
  look.options.volume_axes = {true, true, true};
  look.options.visible_normals = false;
  look.options.seen_material = {};
  look.options.chosen = nullptr;
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    const BundleAxes axes = bundle_axes(axis);
    const int nu = plan.grid.n[axes.u], nv = plan.grid.n[axes.v], tiles_u = (nu + 7) / 8;
    const auto tiles = static_cast<std::size_t>(tiles_u) * static_cast<std::size_t>((nv + 7) / 8);
    choice.chosen.samples[a].assign(tiles, kFirst);
    if (count == 0 || (!options.volume_axes[a] && !options.slice_axes[a])) continue;
    const auto tell = [&](double done) { if (report.progress) report.progress("choosing rays", (axis + done) / 3); };
    tell(0);

    // Where the first rays leave doubt.
    Recipe first = recipe;
    first.samples = kFirst;
    Bundle bundle = make_bundles(scene, plan, textures, first, look.options, axis)[0];
    std::vector<float> doubts(count, 0.0f);
    const std::vector<float> grid = look.alpha(bundle, false, &doubts);
    // And where as many rays at other places see something else.
    std::vector<double> apart(count);
    {
      std::vector<float> doubts_there(count, 0.0f);
      Bundle other = bundle;
      other.pattern = make_sheared_pattern(kFirst * kFirst, 1);
      const std::vector<float> there = look.alpha(other, false, &doubts_there);
      for (std::size_t i = 0; i < count; ++i) {
        const double difference = static_cast<double>(grid[i]) - static_cast<double>(there[i]);
        apart[i] = difference * difference;
        doubts[i] = std::max(doubts[i], doubts_there[i]) + static_cast<float>(2 * apart[i]);
      }
    }
    // Where surface faces both ways along the rays, or is open, some of it may lie behind some other between them, too.
    const auto unseen = [&](std::size_t i) {
      const Areas& p = surface.areas[i];
      const double behind = std::clamp(p.crossings[axis] - std::abs(p.outward[axis]), 0.0, 1.0);
      // And what is said of the edges of cut-outs is not exact. The rest is for solids that overlap where no ray has seen it.
      const double there = p.area > 0 ? std::clamp(p.covered / p.area, 0.0, 1.0) : 1;
      return behind + 4 * there * (1 - there) + 0.2 * std::min(1.0, p.crossings[axis]);
    };
    double seen = 0, all_unseen = 1e-12;
    for (std::size_t i = 0; i < count; ++i) {
      seen += static_cast<double>(doubts[i]);
      all_unseen += unseen(i);
    }
    const double weight = std::max(1e-3, kUnseen / (1 - kUnseen) * seen / all_unseen);
    AxisChooser chooser;
    chooser.tiles_u = tiles_u;
    chooser.nu = nu;
    chooser.cutouts = cutouts;
    chooser.doubt.assign(tiles, 0.0);
    chooser.apart.assign(tiles, 0.0);
    std::vector<double> by_column(static_cast<std::size_t>(nu) * static_cast<std::size_t>(nv), 0.0);
    std::vector<std::uint32_t> column_of(count);
    std::vector<char> met(tiles, 0);
    for_each_voxel(surface.set, [&](const V3i& v, std::int64_t i) {
      const std::size_t column = static_cast<std::size_t>(v[axes.v]) * static_cast<std::size_t>(nu) + static_cast<std::size_t>(v[axes.u]);
      const double d = static_cast<double>(doubts[static_cast<std::size_t>(i)]) + weight * unseen(static_cast<std::size_t>(i)) + 1e-9;
      column_of[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(column);
      by_column[column] += d;
      const std::size_t tile = chooser.tile_of(column);
      chooser.doubt[tile] += d;
      chooser.apart[tile] += kShared / 2 * apart[static_cast<std::size_t>(i)];
      met[tile] = 1;
    });
    // Columns by their doubt, some tens at a time, one in each of as many equal parts of it; more of them while the error is not known well enough.
    std::vector<double> passed(by_column.size() + 1, 0.0);
    for (std::size_t c = 0; c < by_column.size(); ++c) passed[c + 1] = passed[c] + by_column[c];
    chooser.all = passed.back();
    Batches batches{look, bundle, chooser, column_of, passed, recipe.max_error, cutouts};
    const double wanted = recipe.max_error * recipe.max_error * static_cast<double>(count);
    std::vector<std::uint8_t> of_tile;
    Estimate seen_by_others;                   // columns that had no part in the choice
    bool found = false;
    const double aim = kAim * kAim * wanted;
    const auto confirm = [&] {
      const std::size_t others = chooser.draws.size();
      batches.trace_next(of_tile);
      const Estimate drawn = chooser.estimate(of_tile, others), looked = chooser.estimate_by_looks(of_tile);
      seen_by_others = drawn.square > looked.square ? drawn : looked;
      found = std::max(drawn.upper(kConfidence), looked.upper(kConfidence)) <= wanted;
      if (!found) batches.compare_all();
      tell(0.3 + 0.7 * static_cast<double>(batches.all.size()) / kBatches);
    };
    // The first rays may do; else columns have to be drawn before there is a choice.
    of_tile.assign(tiles, 0);
    if (chooser.estimate_by_looks(of_tile).upper(1) <= aim) confirm();
    else batches.trace_next({});
    while (!found && batches.all.size() < kBatches) {
      of_tile = chooser.choose(aim, static_cast<double>(count));
      while (of_tile.empty() && chooser.tried < std::size(kLadder)) {
        ++chooser.tried;
        batches.compare_all();
        of_tile = chooser.choose(aim, static_cast<double>(count));
      }
      if (of_tile.empty()) of_tile.assign(tiles, static_cast<std::uint8_t>(std::size(kLadder) - 1));
      confirm();
    }
    choice.met = choice.met && found;
    choice.square[a] = seen_by_others.square;
    choice.variance[a] = seen_by_others.variance;
    double rays = 0, with_surface = 0;
    for (std::size_t t = 0; t < tiles; ++t) {
      const int s = kLadder[of_tile[t]];
      choice.chosen.samples[a][t] = static_cast<std::uint8_t>(s);
      if (met[t] == 0) continue;
      rays += s * s;
      with_surface += 1;
    }
    choice.rays[a] = rays / std::max(1.0, with_surface);
    tell(1);
  }
  return choice;
}

int coarse_rays_for(double max_error, bool beyond) {
  const int wanted = static_cast<int>(std::clamp(std::ceil(0.4 / max_error), 16.0, 128.0));
  return beyond ? wanted : std::min(wanted, 16);
}

int finest_cut_for(double max_error) { return static_cast<int>(std::clamp(std::ceil(0.06 / max_error), 4.0, 24.0)); }

}  // namespace texel
