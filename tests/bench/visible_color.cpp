// visible_color MODEL RESOLUTION...: error of a voxel's colour, of all surface and of the visible alone, against what an eye outside the voxel sees of it, level by level: the figures of docs/accuracy.md.
//
// Truth: rays of random directions through random places of the voxel, the colour of what each meets first in it (Embree). Rays that begin inside matter see nothing. Voxels in which
// colours differ, drawn at random.
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "bake/bake.h"
#include "bake/compare_voxels.h"
#include "bake/light.h"
#include "bake/truth_voxels.h"
#include "formats/error.h"
#include "formats/random.h"
#include "formats/read.h"

namespace texel {
namespace {

constexpr int kVoxels = 400, kDirections = 1000, kPlaces = 4, kMostLayers = 32;
constexpr float kVaries = 0.05f;  // of some channel: voxels of one colour tell nothing

struct Seen {
  V3d color{0, 0, 0}, half[2]{V3d(0), V3d(0)};
  double weight = 0, weights[2]{0, 0};
  V3f low{1e9f, 1e9f, 1e9f}, high{-1e9f, -1e9f, -1e9f};  // of the colours of all that is there, hidden or not
  [[nodiscard]] bool varies() const { return high.x - low.x > kVaries || high.y - low.y > kVaries || high.z - low.z > kVaries; }
};

struct Eye {
  const TruthScene& truth;
  const RayScene& rays;

  Seen look(const V3i& voxel, int level) const {
    const Grid grid = truth.plan.grid.level(level);
    const double h = grid.h, width = h / 64;
    const V3d lo = truth.plan.grid.origin + V3d(voxel) * h, middle = lo + V3d(h / 2);
    RandomSequence random(static_cast<std::uint64_t>(voxel.x) + (static_cast<std::uint64_t>(voxel.y) << 16) + (static_cast<std::uint64_t>(voxel.z) << 32) + (static_cast<std::uint64_t>(level) << 48));
    Seen seen;
    for (int i = 0; i < kDirections; ++i) {
      const double z = 2 * random.next() - 1, phi = 2 * M_PI * random.next(), ring = std::sqrt(1 - z * z);
      const V3d d(ring * std::cos(phi), ring * std::sin(phi), z);
      V3d a = d.cross(std::abs(d.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0));
      a.normalize();
      const V3d b = d.cross(a);
      for (int k = 0; k < kPlaces; ++k) {
        const double r = std::sqrt(random.next()) * h * std::sqrt(3.0) / 2, turn = 2 * M_PI * random.next();
        const V3d p = middle + a * (r * std::cos(turn)) + b * (r * std::sin(turn)) - d * (h * 2);
        double enter = 0, leave = 4 * h;
        for (int x = 0; x < 3; ++x) {
          if (d[x] == 0) continue;
          const double t0 = (lo[x] - p[x]) / d[x], t1 = (lo[x] + h - p[x]) / d[x];
          enter = std::max(enter, std::min(t0, t1));
          leave = std::min(leave, std::max(t0, t1));
        }
        if (!(enter < leave)) continue;
        follow(p, d, enter, leave, width, i % 2, i < 100, seen);
      }
    }
    if (seen.weight > 0) seen.color /= seen.weight;
    for (int k = 0; k < 2; ++k)
      if (seen.weights[k] > 0) seen.half[k] /= seen.weights[k];
    return seen;
  }

  [[nodiscard]] const Mesh& mesh_of(const RayScene::Hit& hit) const { return hit.instance != kNoIndex ? truth.scene.shapes[truth.scene.instances[hit.instance].shape] : truth.scene.mesh; }
  // What a crossing adds along the ray: +1 into matter, −1 out of it, 0 open surface.
  [[nodiscard]] int winding_of(const RayScene::Hit& hit) const {
    const bool placed = hit.instance != kNoIndex;
    const std::uint32_t shape = placed ? truth.scene.instances[hit.instance].shape : 0;
    const int winding = placed ? truth.plan.shapes[shape].winding[hit.triangle] : truth.plan.winding[hit.triangle];
    const int turn = placed ? truth.plan.shapes[shape].turn[hit.triangle] : truth.plan.turn[hit.triangle];
    return hit.front == (turn > 0) ? winding : -winding;
  }
  // Beyond everything lies no matter: what is left of it on the way there began here.
  [[nodiscard]] bool in_matter(const V3d& p, const V3d& d, double from) const {
    int left = 0;
    for (int i = 0; i < 1000; ++i) {
      const RayScene::Hit hit = rays.first_hit(p, d, from);
      if (hit.triangle == kNoIndex) break;
      left -= winding_of(hit);
      from = hit.distance + rays.skin();
    }
    return left != 0;
  }

  void follow(const V3d& p, const V3d& d, double enter, double leave, double width, int half, bool through, Seen& seen) const {
    double open = 1;
    for (int layer = 0; layer < kMostLayers && (open > 1e-3 || through); ++layer) {
      const RayScene::Hit hit = rays.first_covered_hit(p, d, enter, width, 0);
      if (hit.triangle == kNoIndex || hit.distance > leave) return;
      const Scene& scene = truth.scene;
      const Mesh& mesh = mesh_of(hit);
      if (layer == 0 && truth.plan.fill && in_matter(p, d, enter)) open = 0;
      const std::uint32_t m = mesh.materials[hit.triangle];
      const Material& material = scene.materials[m];
      SurfaceSample s = surface_sample(truth.textures, mesh, hit.triangle, static_cast<double>(hit.u), static_cast<double>(hit.v), width);
      if (material.solid) s.color = material.solid->color(p + d * hit.distance, hit.normal, width);
      const double w = open * static_cast<double>(s.coverage);
      seen.color += V3d(s.color) * w;
      seen.weight += w;
      seen.half[half] += V3d(s.color) * w;
      seen.weights[half] += w;
      for (int c = 0; c < 3; ++c) {
        seen.low[c] = std::min(seen.low[c], s.color[c]);
        seen.high[c] = std::max(seen.high[c], s.color[c]);
      }
      open *= winding_of(hit) != 0 ? 0 : 1 - static_cast<double>(s.coverage) * static_cast<double>(material.opacity);
      enter = hit.distance + rays.skin();
    }
  }
};

int run(const char* file, int resolution) {
  Report report;
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.want = {.slices = false, .density = false, .color = true, .ndf = false, .visibility = false, .material = false, .normal = false, .levels = true, .preview = false};
  const Scene scene = read_scene(std::string(file), report);
  const Pack all = bake(scene, recipe, report);
  recipe.material = MaterialOf::kVisible;
  const Pack visible = bake(scene, recipe, report);
  const auto truth = make_truth_scene(scene, recipe, all.grid, report);
  const RayScene rays(truth->scene, &truth->textures);
  Surface surface = clip_surface(truth->scene, truth->plan, truth->textures, {.color = false, .normals = false, .material = false}, report);
  for (std::size_t l = 0; l < all.levels.size(); ++l) {
    if (l > 0) surface = coarser(surface);
    std::vector<V3i> voxels;
    for_each_voxel(surface.set, [&](const V3i& v, std::int64_t) { voxels.push_back(v); });
    voxels = sample_voxels(std::move(voxels), 4 * kVoxels, 1);
    const VoxelField of_all(all.levels[l], "Cd", 3), of_visible(visible.levels[l], "Cd", 3);
    std::vector<Seen> seen(voxels.size());
    const Eye eye{*truth, rays};
    tbb::parallel_for(std::size_t{0}, voxels.size(), [&](std::size_t i) { seen[i] = eye.look(voxels[i], static_cast<int>(l)); });
    double square[2] = {0, 0}, bias[2] = {0, 0}, noise = 0;
    int count = 0, better = 0, worse = 0;
    for (std::size_t i = 0; i < voxels.size() && count < kVoxels; ++i) {
      if (!seen[i].varies() || !(seen[i].weights[0] > 0) || !(seen[i].weights[1] > 0)) continue;
      const float *a = of_all.at(voxels[i]), *b = of_visible.at(voxels[i]);
      if (!a || !b) continue;
      ++count;
      double own[2] = {0, 0};
      for (int k = 0; k < 3; ++k) {
        const double ea = static_cast<double>(a[k]) - seen[i].color[k], eb = static_cast<double>(b[k]) - seen[i].color[k], n = (seen[i].half[0][k] - seen[i].half[1][k]) / 2;
        own[0] += ea * ea;
        own[1] += eb * eb;
        bias[0] += ea;
        bias[1] += eb;
        noise += n * n;
      }
      square[0] += own[0];
      square[1] += own[1];
      better += own[1] < own[0];
      worse += own[1] > own[0];
    }
    if (count == 0) continue;
    const double n = 3.0 * count;
    std::printf("%-28s %4d level %zu  voxels %4d  all %.4f  visible %.4f  truth's own %.4f  bias %+.4f %+.4f  better in %.0f %%, worse in %.0f %%\n", file + std::max<std::ptrdiff_t>(0, static_cast<std::ptrdiff_t>(std::string(file).rfind('/')) + 1),
                resolution, l, count, std::sqrt(square[0] / n), std::sqrt(square[1] / n), std::sqrt(noise / n), bias[0] / n, bias[1] / n, 100.0 * better / count, 100.0 * worse / count);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace texel

int main(int argc, char** argv) {
  try {
    for (int i = 2; i < argc; ++i) texel::run(argv[1], std::atoi(argv[i]));
  } catch (const texel::Error& e) {
    std::fprintf(stderr, "visible_color: %s\n", e.what());
    return 1;
  }
  return argc > 2 ? 0 : 2;
}
