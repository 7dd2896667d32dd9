// One ellipsoid of normals a voxel or two, as baked with --lobes 2: error of the projected area over directions against the surface itself (docs/accuracy.md, "A second lobe"), rms in units
// of its mean: with one, and as chosen for the pack; and the share of the voxels that have a second one.
//   lobe_bench [-r N] [MODEL …]   N³ (64) and all levels; without any model those of the shared data and the samples
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "bake/block_index.h"
#include "bake/compare_sums.h"
#include "bake/lobes.h"
#include "bake/ndf.h"
#include "bake/truth_voxels.h"
#include "formats/read.h"
#include "tests/bench/bench_util.h"

namespace texel {
namespace {

constexpr int kVoxels = 400, kDirections = 256;

void add_projected(const Moments& m, const std::vector<V3d>& directions, std::vector<double>& to) {
  if (!(m.covered > 0)) return;
  std::vector<double> sigma(directions.size());
  projected_areas(ndf_from_sggx(sggx(m)), m.covered, directions, sigma);
  for (std::size_t i = 0; i < sigma.size(); ++i) to[i] += sigma[i];
}

void measure(const std::string& path, int resolution) {
  Report report;
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  const Scene scene = read_scene(path, report);
  const auto truth = make_truth_scene(scene, recipe, plan_grid(scene, recipe), report);
  Surface surface = clip_surface(truth->scene, truth->plan, truth->textures, {.color = false, .normals = true, .material = false, .lobes = true}, report);
  const std::vector<V3d> directions = half_sphere(kDirections);
  for (int level = 0;; ++level) {
    const Grid grid = truth->plan.grid.level(level);
    std::vector<V3i> voxels;
    double shared = 0;
    for_each_voxel(surface.set, [&](const V3i& v, std::int64_t i) {
      voxels.push_back(v);
      shared += surface.lobes[static_cast<std::size_t>(i)].second.covered > 0 ? 1 : 0;
    });
    shared /= static_cast<double>(voxels.size());
    const auto found = true_voxels(*truth, level, sample_voxels(std::move(voxels), kVoxels, 0), {.rays = 0, .directions = directions, .color = false}, report);
    const BlockIndex index(surface.set, grid.n);
    double mean = 0, one = 0, chosen = 0;
    for (const VoxelTruth& v : found) {
      mean += v.moments.covered / 2 / static_cast<double>(found.size());
      const Block& block = surface.set.blocks[static_cast<std::size_t>(index(V3i(v.at.x >> 3, v.at.y >> 3, v.at.z >> 3)))];
      const auto i = static_cast<std::size_t>(block.index(v.at.x & 7, v.at.y & 7, v.at.z & 7));
      const double face = std::pow(4.0, level);
      std::vector<double> a(directions.size()), b(directions.size());
      add_projected(surface.moments[i], directions, a);
      add_projected(first_group(surface.moments[i], surface.lobes[i].second), directions, b);
      add_projected(surface.lobes[i].second, directions, b);
      for (std::size_t k = 0; k < directions.size(); ++k) {
        const double weight = 1 / static_cast<double>(found.size() * directions.size());
        one += weight * std::pow(a[k] / face - v.sigma[k], 2);
        chosen += weight * std::pow(b[k] / face - v.sigma[k], 2);
      }
    }
    std::printf("%s\t%d\t%zu\t%.4f\t%.4f\t%.3f\n", std::filesystem::path(path).stem().c_str(), level, found.size(), std::sqrt(one) / mean, std::sqrt(chosen) / mean, shared);
    std::fflush(stdout);
    if (std::max({grid.n.x, grid.n.y, grid.n.z}) == 1) return;
    surface = coarser(surface);
  }
}

int run(int argc, char** argv) {
  std::vector<std::string> models;
  int resolution = 64;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "-r") == 0 && i + 1 < argc) resolution = std::atoi(argv[++i]);
    else models.emplace_back(argv[i]);
  }
  if (models.empty()) {
    models = bench::usual_models();
    models.push_back(TEXEL_SAMPLES "/crossing_shells/crossing_shells.obj");
  }
  std::printf("model\tlevel\tvoxels\tone\tchosen\tshare\n");
  for (const std::string& model : models) measure(model, resolution);
  return 0;
}

}  // namespace
}  // namespace texel

int main(int argc, char** argv) { return texel::bench::guarded("lobe_bench", texel::run, argc, argv); }
