#include "bake/hypertexture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "bake/density_brick.h"
#include "bake/density_levels.h"
#include "bake/density_slices.h"
#include "bake/light.h"
#include "formats/error.h"

namespace texel {
namespace {

// Bricks in order -> one level-0 surface and what is seen of it.
void join(std::vector<Brick>& bricks, const V3i& n, Surface& surface, Visibility& seen) {
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        Brick& brick = bricks[(static_cast<std::size_t>(z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(x)];
        add_inside(V3i(x, y, z), brick.inside, seen);
        if (count_voxels(brick.border) == 0) continue;
        surface.set.add(V3i(x, y, z), brick.border);
        const auto append = [](auto& to, auto& from) {
          to.insert(to.end(), from.begin(), from.end());
          from = {};
        };
        append(surface.moments, brick.moments);
        append(surface.areas, brick.areas);
        append(surface.color, brick.color);
        append(surface.material, brick.material);
        append(seen.solid, brick.solid);
        for (std::size_t a = 0; a < 3; ++a) append(seen.alpha[a], brick.alpha[a]);
      }
}

}  // namespace

double mean_depth(double u, double v) {
  if (u >= 1 && v >= 1) return 0;
  if (!(u > 0) && !(v > 0)) return std::numeric_limits<double>::infinity();
  const double d = u - v, m = (u + v) / 2;
  // Series about the middle where the closed form would cancel: the next term is d⁴/(80 m⁴) < 2e-14.
  if (std::abs(d) < 1e-3 * m) return -std::log(m) + d * d / (24 * m * m);
  const double a = u > 0 ? u * std::log(u) : 0, b = v > 0 ? v * std::log(v) : 0;
  return std::max(0.0, 1 - (a - b) / d);
}

double ray_depth(const double* d, std::size_t stride, int points) {
  double sum = 0, here = 1 - d[0];
  const double before = 1 - *(d - stride);
  sum += mean_depth((before + here) / 2, here) / 2;
  for (int k = 1; k < points; ++k) {
    const double next = 1 - d[static_cast<std::size_t>(k) * stride];
    sum += mean_depth(here, next);
    here = next;
  }
  const double after = 1 - d[static_cast<std::size_t>(points) * stride];
  return sum + mean_depth(here, (here + after) / 2) / 2;
}

Box3d density_bounds(const Field& density) {
  const Box3d all = density.bounds(0);
  for (int a = 0; a < 3; ++a)
    if (all.isEmpty() || !std::isfinite(all.min[a]) || !std::isfinite(all.max[a]))
      throw Error(Code::kCommandLine, "--box", "missing: the base shape does not say where it ends", "give the region to bake");
  constexpr int kCells = 64;
  const V3d cell = all.size() / kCells;
  Box3d found;
  // From large cells to small; what lies within what was found already adds nothing.
  const auto visit = [&](auto&& self, const V3i& at, int size) -> void {
    const Box3d box(all.min + cell * V3d(at), all.min + cell * V3d(at + V3i(size)));
    if (!found.isEmpty() && found.intersects(box.min) && found.intersects(box.max)) return;
    if (density.range(box).high <= 0) return;
    if (size == 1) {
      found.extendBy(box);
      return;
    }
    for (int c = 0; c < 8; ++c) self(self, at + V3i(c & 1, c >> 1 & 1, c >> 2) * (size / 2), size / 2);
  };
  visit(visit, V3i(0, 0, 0), kCells);
  if (found.isEmpty()) throw Error(Code::kBadInput, "--hypertexture", "the density is 0 everywhere", "change the shape, its iso value or the amount of noise");
  return found;
}

DensityBake bake_density(const Scene& scene, const Grid& grid, const Recipe& recipe, const DensityOptions& options, Report& report) {
  const Hypertexture& texture = *scene.hypertexture;
  // D as it is: were finer octaves faded to their means first, opacity would be that of the mean density, which is not the mean opacity (docs/accuracy.md).
  const std::shared_ptr<const Field> density = make_density(texture, 0);
  const Material& material = scene.materials.front();
  const bool own = material.solid == nullptr;
  const std::shared_ptr<const SolidTexture> color = own ? hypertexture_color(texture) : material.solid;
  const int samples = std::max(1, recipe.samples);
  const BrickSource source{*density, texture, color.get(), material.kd, own ? hypertexture_glow(texture) : 0, grid, recipe, options, samples, std::max(1.0, recipe.max_depth)};

  const V3i n((grid.n.x + 7) / 8, (grid.n.y + 7) / 8, (grid.n.z + 7) / 8);
  std::vector<Brick> bricks(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z));
  std::atomic<int> done{0};
  tbb::parallel_for(0, n.z * n.y, [&](int row) {
    BrickWork work;
    for (int x = 0; x < n.x; ++x) bake_brick(source, V3i(x, row % n.y, row / n.y), work, bricks[static_cast<std::size_t>(row) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(x)]);
    if (report.progress) report.progress("density", static_cast<double>(++done) / (n.z * n.y));
  });

  DensityBake result;
  std::int64_t sampled = 0, undefined = 0;
  for (const Brick& b : bricks) {
    sampled += b.sampled;
    undefined += b.undefined;
    result.mass += b.mass;
  }
  report.count("bricks", static_cast<double>(bricks.size()));
  report.count("bricks sampled", static_cast<double>(sampled));
  if (const auto skipped = static_cast<std::int64_t>(bricks.size()) - sampled; skipped > 0)
    report.skip("sampling of " + std::to_string(skipped) + " of " + std::to_string(bricks.size()) + " bricks of 8x8x8 voxels", "all empty or all full by the density's range");
  if (undefined > 0) report.issue("field-undefined", "samples of the density have no value; they count as empty", undefined);

  result.surfaces.resize(1);
  result.seen.levels.resize(1);
  join(bricks, n, result.surfaces[0], result.seen.levels[0]);
  if (result.surfaces[0].set.count == 0 && result.seen.levels[0].inside_count == 0)
    throw Error(Code::kBadInput, "--hypertexture", "none of the samples met matter in the box", "raise --resolution or --samples, or choose a --box that meets the density");
  while (static_cast<int>(result.surfaces.size()) < options.levels) {
    result.surfaces.push_back(coarser(result.surfaces.back()));
    result.seen.levels.emplace_back();
  }
  if (options.opacity && options.recompute) coarse_opacity(bricks, n, result.surfaces, result.seen.levels);
  bricks.clear();

  const double edge = grid.h;
  for (const Areas& a : result.surfaces[0].areas) result.area += a.area * edge * edge;
  result.mass *= edge * edge * edge;
  for (const float f : result.seen.levels[0].solid) result.filled += static_cast<double>(f);

  const Surface& surface = result.surfaces[0];
  const auto shade = [&](const V3i& voxel, std::int64_t index) {
    const Moments& m = surface.moments[static_cast<std::size_t>(index)];
    if (!(m.covered > 0)) return V3f(-1, -1, -1);
    const V3f albedo(surface.color[static_cast<std::size_t>(index)] / m.covered);
    const V3f own_light = surface.material.empty() ? V3f(0, 0, 0) : V3f(surface.material[static_cast<std::size_t>(index)].emission / m.covered);
    if (recipe.lights.empty()) return albedo + own_light;
    const double length = m.m.length();
    return own_light + albedo * irradiance(recipe.lights, nullptr, grid.centre(voxel), length > 0 ? m.m / length : V3d(0, 0, 1), !(length > 0));
  };
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    if (options.slice_axes[a]) result.stacks[a] = density_slices(surface, result.seen.levels[0], grid, axis, options.slice_counts[a], shade);
  }
  return result;
}

}  // namespace texel
