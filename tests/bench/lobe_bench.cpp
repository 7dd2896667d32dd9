// One ellipsoid of normals a voxel or two: error of the projected area over directions (docs/accuracy.md, "A second lobe"). Two are fitted to normals counted in bins, which are then
// the truth for both; the first column is one ellipsoid against the surface itself.
//   lobe_bench [MODEL …]   64³ and all levels; without any, models of the shared data and the samples
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "bake/compare_sums.h"
#include "bake/levels.h"
#include "bake/ndf.h"
#include "bake/ndf_fits.h"
#include "bake/truth_voxels.h"
#include "formats/read.h"
#include "tests/bench/bench_util.h"

namespace texel {
namespace {

constexpr int kVoxels = 300, kDirections = 256, kRounds = 20;

using Bins = std::vector<double>;

Moments moments_of(const Bins& bins) {
  Moments m;
  for (int i = 0; i < kNormalBins; ++i)
    if (bins[static_cast<std::size_t>(i)] > 0) m.add(bin_centre(i), bins[static_cast<std::size_t>(i)], false);
  return m;
}

Symmetric second(const Moments& m) { return {m.xx, m.yy, m.zz, m.xy, m.xz, m.yz}; }

// Two groups of normals, each about an axis of its own (k-means of axes: the mean of a group is the main eigenvector of Σ A n nᵀ).
std::array<Bins, 2> split(const Bins& bins) {
  std::array<V3d, 2> axis;
  int fullest = 0;
  for (int i = 1; i < kNormalBins; ++i)
    if (bins[static_cast<std::size_t>(i)] > bins[static_cast<std::size_t>(fullest)]) fullest = i;
  axis[0] = bin_centre(fullest);
  double most = -1;
  for (int i = 0; i < kNormalBins; ++i) {
    const double c = axis[0].dot(bin_centre(i)), apart = bins[static_cast<std::size_t>(i)] * (1 - c * c);
    if (apart > most) {
      most = apart;
      axis[1] = bin_centre(i);
    }
  }
  std::array<Bins, 2> groups;
  for (int round = 0; round < kRounds; ++round) {
    groups = {Bins(bins.size()), Bins(bins.size())};
    for (int i = 0; i < kNormalBins; ++i) {
      const V3d n = bin_centre(i);
      groups[std::abs(n.dot(axis[1])) > std::abs(n.dot(axis[0])) ? 1 : 0][static_cast<std::size_t>(i)] = bins[static_cast<std::size_t>(i)];
    }
    for (std::size_t g = 0; g < 2; ++g)
      if (const Moments m = moments_of(groups[g]); m.covered > 0) axis[g] = eigen(second(m)).vector[0];
  }
  return groups;
}

void add_projected(const Moments& m, const std::vector<V3d>& directions, std::vector<double>& to) {
  if (!(m.covered > 0)) return;
  std::vector<double> sigma(directions.size());
  projected_areas(ndf_from_sggx(sggx(m)), m.covered, directions, sigma);
  for (std::size_t i = 0; i < sigma.size(); ++i) to[i] += sigma[i];
}

void measure(const std::string& path) {
  Report report;
  Recipe recipe;
  recipe.resolution = V3i(64, 0, 0);
  const Scene scene = read_scene(path, report);
  const auto truth = make_truth_scene(scene, recipe, plan_grid(scene, recipe), report);
  std::vector<Surface> surfaces;
  surfaces.push_back(clip_surface(truth->scene, truth->plan, truth->textures, {.color = false, .normals = false, .material = false}, report));
  const std::vector<V3d> directions = half_sphere(kDirections);
  for (int level = 0;; ++level) {
    const Grid grid = truth->plan.grid.level(level);
    std::vector<V3i> voxels;
    for_each_voxel(surfaces.back().set, [&](const V3i& v, std::int64_t) { voxels.push_back(v); });
    const auto found = true_voxels(*truth, level, sample_voxels(std::move(voxels), kVoxels, 0), {.rays = 0, .directions = directions, .bins = true, .color = false}, report);
    double mean = 0, one = 0, binned = 0, two = 0;
    for (const VoxelTruth& v : found) {
      mean += v.moments.covered / 2 / static_cast<double>(found.size());
      std::vector<double> a(directions.size()), b(directions.size()), c(directions.size()), counted(directions.size());
      for (std::size_t i = 0; i < directions.size(); ++i)
        for (int bin = 0; bin < kNormalBins; ++bin) counted[i] += v.bins[static_cast<std::size_t>(bin)] * std::abs(bin_centre(bin).dot(directions[i]));
      add_projected(v.moments, directions, a);
      add_projected(moments_of(v.bins), directions, b);
      for (const Bins& group : split(v.bins)) add_projected(moments_of(group), directions, c);
      for (std::size_t i = 0; i < directions.size(); ++i) {
        const double weight = 1 / static_cast<double>(found.size() * directions.size());
        one += weight * std::pow(a[i] - v.sigma[i], 2);
        binned += weight * std::pow(b[i] - counted[i], 2);
        two += weight * std::pow(c[i] - counted[i], 2);
      }
    }
    std::printf("%s\t%d\t%zu\t%.4f\t%.4f\t%.4f\n", std::filesystem::path(path).stem().c_str(), level, found.size(), std::sqrt(one) / mean, std::sqrt(binned) / mean, std::sqrt(two) / mean);
    std::fflush(stdout);
    if (std::max({grid.n.x, grid.n.y, grid.n.z}) == 1) return;
    surfaces.push_back(coarser(surfaces.back()));
    surfaces.erase(surfaces.begin());
  }
}

int run(int argc, char** argv) {
  std::vector<std::string> models(argv + 1, argv + argc);
  if (models.empty()) {
    models = bench::usual_models();
    models.push_back(TEXEL_SAMPLES "/crossing_shells/crossing_shells.obj");
  }
  std::printf("model\tlevel\tvoxels\tone\tone, of counted normals\ttwo\n");
  for (const std::string& model : models) measure(model);
  return 0;
}

}  // namespace
}  // namespace texel

int main(int argc, char** argv) { return texel::bench::guarded("lobe_bench", texel::run, argc, argv); }
