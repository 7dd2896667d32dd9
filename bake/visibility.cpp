#include "bake/visibility.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "bake/axis_rays.h"
#include "bake/block_index.h"

namespace texel {
namespace {

// Level-0 inside runs along z -> sets of voxels and whole blocks.
void collect_inside(const std::vector<std::vector<InsideRun>>& runs, const Surface& surface, const Grid& grid, Visibility& out) {
  const BlockIndex border(surface.set, grid.n);
  VoxelSet all;
  std::vector<std::int32_t> slot(border.slots.size(), -1);
  for (const auto& band : runs)
    for (const InsideRun& run : band)
      for (int bz = run.first >> 3; bz <= (run.last - 1) >> 3; ++bz) {
        const V3i at(run.u >> 3, run.v >> 3, bz);
        // A block without surface is all inside or all outside: one of its columns speaks for it.
        const bool uniform = border(at) < 0 && at.x * 8 + 8 <= grid.n.x && at.y * 8 + 8 <= grid.n.y && bz * 8 + 8 <= grid.n.z;
        if (uniform && ((run.u & 7) != 0 || (run.v & 7) != 0)) continue;
        std::int32_t& s = slot[border.place(at)];
        if (s < 0) {
          s = static_cast<std::int32_t>(all.blocks.size());
          all.blocks.emplace_back().at = at;
        }
        if (uniform) {
          all.blocks[static_cast<std::size_t>(s)].mask.fill(~std::uint64_t{0});
          continue;
        }
        const int z0 = std::max(run.first - bz * 8, 0), z1 = std::min(run.last - bz * 8, 8);
        const std::uint64_t bits = ((std::uint64_t{1} << (z1 - z0)) - 1) << z0;
        all.blocks[static_cast<std::size_t>(s)].mask[static_cast<std::size_t>(run.u & 7)] |= bits << ((run.v & 7) << 3);
      }
  for (std::size_t place = 0; place < slot.size(); ++place) {
    if (slot[place] < 0) continue;
    const Block& block = all.blocks[static_cast<std::size_t>(slot[place])];
    add_inside(block.at, block.mask, out);
  }
}

// Filled fraction of each border voxel; adds them up in `filled`. Where `exact` does not know it: chords along an axis are exact for surface that
// faces it, while surface beside the rays is met in whole sub-ray rows, so each axis counts as much as the surface in the voxel faces it.
void fill_fractions(const Surface& surface, const std::array<std::vector<float>, 3>& lengths, std::span<const double> exact, Visibility& to, double& filled) {
  const auto count = static_cast<std::size_t>(surface.set.count);
  to.solid.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    double share = exact[i];
    if (share < 0) {
      double length = 0, weight = 0, plain = 0;
      int axes = 0;
      for (int a = 0; a < 3; ++a) {
        const std::vector<float>& of_axis = lengths[static_cast<std::size_t>(a)];
        if (of_axis.empty()) continue;
        const double facing = surface.areas[i].crossings[a];
        length += facing * static_cast<double>(of_axis[i]);
        weight += facing;
        plain += static_cast<double>(of_axis[i]);
        ++axes;
      }
      share = std::min(1.0, weight > 0 ? length / weight : plain / std::max(1, axes));
    }
    filled += share;
    to.solid[i] = static_cast<float>(share);
    // A ray that is stopped meets surface in the voxel or passes within matter from wall to wall: what is known of both may be less than one ray. Too little matter for a float is none.
    if (!(exact[i] >= 0) && share > kThinMatter) continue;  // an estimate itself
    for (int a = 0; a < 3; ++a)
      if (auto& alpha = to.alpha[static_cast<std::size_t>(a)]; !alpha.empty())
        alpha[i] = std::min(alpha[i], static_cast<float>(to.solid[i] > 0 ? most_met(surface.areas[i], a) + share : surface.areas[i].crossings[a]));
  }
}

}  // namespace

std::vector<Bundle> make_bundles(const Scene& scene, const Plan& plan, const TextureSet& textures, const Recipe& recipe, const VisibilityOptions& options, int axis) {
  const ChosenSamples* chosen = options.first_level == 0 ? options.chosen : nullptr;
  const auto a = static_cast<std::size_t>(axis);
  Recipe densest = recipe;
  if (chosen) densest.samples = *std::max_element(chosen->samples[a].begin(), chosen->samples[a].end());
  std::vector<Bundle> bundles{make_bundle(scene, plan, textures, densest, axis)};
  Bundle& first = bundles[0];
  // One voxel more than the rule of walls can ask for; slices need not end where the slab does.
  if (axis == 2 && options.slab.z1 < plan.grid.n.z) first.end = options.slab.z1 + 1 + (options.slice_axes[2] ? plan.grid.n.z / options.slice_counts[2] : 0);
  // Levels beyond the tiles: as many places along the edge of the finest of them, in either direction, as rays are wanted there, one ray a row.
  // An odd number: coarser levels take every 2nd, 4th or 8th row, which of an even one would all be the same places of a voxel.
  if (options.first_level > 0 && options.coarse_rays > 0) {
    const int voxels = 1 << options.first_level;
    first.pattern = make_sheared_pattern(((options.coarse_rays + voxels - 1) / voxels) | 1, 1);
  }
  if (!chosen) return bundles;
  const std::vector<std::uint8_t>& samples = chosen->samples[a];
  const auto tiles = static_cast<std::size_t>((first.nu + 7) / 8);
  const Bundle all = std::move(first);
  bundles.clear();
  for (int s = densest.samples; s > 0; --s) {
    if (std::find(samples.begin(), samples.end(), s) == samples.end()) continue;
    Bundle& b = bundles.emplace_back(all);
    b.pattern = make_pattern(recipe.pattern, s);
    b.columns.resize(static_cast<std::size_t>(b.nu) * static_cast<std::size_t>(b.nv));
    for (std::size_t v = 0, i = 0; v < static_cast<std::size_t>(b.nv); ++v)
      for (std::size_t u = 0; u < static_cast<std::size_t>(b.nu); ++u, ++i) b.columns[i] = samples[(v >> 3) * tiles + (u >> 3)] == s;
  }
  if (bundles.size() == 1) bundles[0].columns.clear();
  return bundles;
}

VisibilityResult see_voxels(const Scene& scene, const Plan& plan, const TextureSet& textures, std::span<const Surface> surfaces,
                            const Recipe& recipe, const VisibilityOptions& options, const SliceShader& shade, SlabSums& sums, Report& report) {
  VisibilityResult result;
  result.levels.resize(surfaces.size());
  const auto count = static_cast<std::size_t>(surfaces[0].set.count);
  const bool finest = options.first_level == 0;
  if (options.seen_material.any())
    for (std::size_t l = static_cast<std::size_t>(options.first_level); l < (options.recompute ? surfaces.size() : 1); ++l) result.levels[l].seen_material.resize(static_cast<std::size_t>(surfaces[l].set.count));
  if (options.visible_normals && finest) result.levels[0].visible.resize(count);
  std::vector<std::vector<InsideRun>> runs;
  std::array<std::vector<float>, 3> lengths;
  // Without filled matter it is known: 0.
  std::vector<double> exact_solid(count, plan.fill ? -1 : 0);
  bool chords = plan.fill && finest;
  int begun = 0;
  // z first: it finds the filled fractions that are exactly known, and where all are, no chord is asked for any more.
  for (const int axis : {2, 0, 1}) {
    const auto a = static_cast<std::size_t>(axis);
    if (!options.volume_axes[a] && !options.slice_axes[a]) continue;
    std::vector<Bundle> bundles = make_bundles(scene, plan, textures, recipe, options, axis);
    if (!finest)
      for (Bundle& b : bundles) {
        b.used = used_rows(b, options.first_level, static_cast<int>(surfaces.size()), options.coarse_rays);
        if (!options.seen_material.any()) continue;
        const std::vector<char> more = used_rows(b, options.first_level, static_cast<int>(surfaces.size()), kSeenRays);
        for (std::size_t r = 0; r < more.size(); ++r) b.used[r] = b.used[r] != 0 || more[r] != 0;
      }
    if (chords) lengths[a].assign(count, 0);
    const auto progress = [&](double done) { if (report.progress) report.progress("crossings", (begun + done) / 3); };
    const AxisFound found{.result = result, .slabs = sums, .lengths = chords ? &lengths[a] : nullptr, .exact_solid = &exact_solid, .runs = &runs};
    const std::int64_t met = see_axis({.bundles = bundles, .surfaces = surfaces, .options = options, .shade = shade}, found, progress);
    if (finest) sums.met[a] = std::max(sums.met[a], std::int64_t{0}) + met;
    ++begun;
    chords = chords && std::any_of(exact_solid.begin(), exact_solid.end(), [](double e) { return e < 0; });
  }
  if (begun == 0 || !finest) return result;
  fill_fractions(surfaces[0], lengths, exact_solid, result.levels[0], sums.volume);
  if (plan.fill && !runs.empty()) collect_inside(runs, surfaces[0], plan.grid, result.levels[0]);
  sums.inside_count += result.levels[0].inside_count;
  return result;
}

std::array<SliceRecords, 3> gather_stacks(const Grid& grid, const VisibilityOptions& options, SlabSums& sums) {
  std::array<SliceRecords, 3> stacks;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!options.slice_axes[a]) continue;
    const BundleAxes axes = bundle_axes(static_cast<int>(a));
    stacks[a] = gather_slices(static_cast<int>(a), grid.n[axes.u], grid.n[axes.v], options.slice_counts[a], sums.slices[a]);
  }
  return stacks;
}

Visibility join_visibility(std::vector<Visibility>& parts) {
  if (parts.size() == 1) return std::move(parts[0]);
  Visibility all;
  const auto append = [](auto& to, auto& from) {
    to.insert(to.end(), from.begin(), from.end());
    from = {};
  };
  for (Visibility& part : parts) {
    for (std::size_t a = 0; a < 3; ++a) append(all.alpha[a], part.alpha[a]);
    append(all.visible, part.visible);
    append(all.seen_material, part.seen_material);
    append(all.solid, part.solid);
    append(all.inside_blocks, part.inside_blocks);
    for (const Block& block : part.inside.blocks) all.inside.add(block.at, block.mask);
    all.inside_count += part.inside_count;
    for (const Block& block : part.edge.blocks) all.edge.add(block.at, block.mask);
    append(all.edges, part.edges);
  }
  return all;
}

V3d measure_thickness(const Scene& scene, const Plan& plan, const TextureSet& textures) {
  constexpr double kOpen = 2;
  V3d thickness(kOpen, kOpen, kOpen);
  if (!plan.fill) return thickness;
  Recipe one;
  one.samples = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const Bundle bundle = make_bundle(scene, plan, textures, one, axis);
    std::vector<std::vector<float>> found(static_cast<std::size_t>(bundle.bands));
    tbb::parallel_for(0, bundle.bands, [&](int b) {
      Band band;
      BandScratch scratch;
      trace_band(bundle, b, band, scratch);
      for (std::size_t r = 0; r + 1 < band.first.size(); ++r) {
        int winding = 0;
        double from = 0;
        for (std::size_t i = band.first[r]; i < band.first[r + 1]; ++i) {
          const Crossing& c = band.crossings[i];
          const int before = winding;
          winding += c.winding;
          if (before == 0 && winding != 0) from = c.w;
          if (before != 0 && winding == 0) found[static_cast<std::size_t>(b)].push_back(static_cast<float>(c.w - from));
        }
      }
    });
    std::vector<float> chords;
    for (const auto& f : found) chords.insert(chords.end(), f.begin(), f.end());
    if (chords.empty()) continue;
    const auto fifth = chords.begin() + static_cast<std::ptrdiff_t>(chords.size() / 20);
    std::nth_element(chords.begin(), fifth, chords.end());
    thickness[axis] = std::max(kOpen, static_cast<double>(*fifth));
  }
  return thickness;
}

}  // namespace texel
