// Opacity's error against time over the number of sub-rays, both patterns: tab-separated, for alpha_plot.py.
//   alpha_curve [MODEL.obj …]   (bunny, armadillo and bonsai of the shared data where none is given)
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <string>
#include <vector>

#include "bake/bake.h"
#include "formats/error.h"
#include "formats/read.h"
#include "tests/bench/bench_util.h"

namespace texel {
namespace {

constexpr int kResolution = 64, kTruthSamples = 64, kRepeats = 3;

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Recipe recipe_of(int samples, Pattern pattern) {
  Recipe recipe;
  recipe.resolution = V3i(kResolution, 0, 0);
  recipe.want = {.slices = false, .density = false, .color = false, .ndf = false, .visibility = true, .material = false, .normal = false, .levels = false, .preview = false};
  recipe.samples = samples;
  recipe.pattern = pattern;
  return recipe;
}

struct Figures { double rms = 0, bias = 0, worst = 0; };

// Both packs have the same border voxels: those do not depend on the rays. Inside voxels are 1 in both.
Figures compare(const Pack& pack, const Pack& truth) {
  const Channel* a = pack.levels[0].find("alpha");
  const Layer* layer = nullptr;
  const Channel* b = truth.levels[0].find("alpha", &layer);
  if (!a || !b || a->values.size() != b->values.size()) throw Error(Code::kRunning, "alpha", "the packs do not have the same voxels");
  Figures f;
  double sum = 0, square = 0;
  std::int64_t border = 0;
  for (std::size_t i = 0; i < a->values.size(); ++i) {
    if (b->values[i] == 1.0f && a->values[i] == 1.0f) continue;  // mostly inside: agreement there tells nothing
    const double e = static_cast<double>(a->values[i]) - static_cast<double>(b->values[i]);
    sum += e;
    square += e * e;
    f.worst = std::max(f.worst, std::abs(e));
    ++border;
  }
  const auto n = static_cast<double>(std::max<std::int64_t>(border, 1));
  f.rms = std::sqrt(square / n);
  f.bias = sum / n;
  return f;
}

void curve(const std::string& path) {
  Report report;
  const Scene scene = read_scene(path, report);
  const Pack truth = bake(scene, recipe_of(kTruthSamples, Pattern::kGrid), report);
  for (const Pattern pattern : {Pattern::kLattice, Pattern::kGrid})
    for (const int samples : {1, 2, 3, 4, 5, 6, 8, 10, 12, 16}) {
      double least = 1e30;
      Figures f;
      for (int i = 0; i < kRepeats; ++i) {
        const double start = cpu_seconds();
        const Pack pack = bake(scene, recipe_of(samples, pattern), report);
        least = std::min(least, cpu_seconds() - start);
        f = compare(pack, truth);
      }
      std::printf("%s\t%s\t%d\t%.4f\t%.6f\t%+.6f\t%.4f\n", std::filesystem::path(path).stem().c_str(), pattern == Pattern::kLattice ? "lattice" : "grid", samples, least, f.rms,
                  f.bias, f.worst);
      std::fflush(stdout);
    }
}

int run(int argc, char** argv) {
  std::vector<std::string> paths(argv + 1, argv + argc);
  if (paths.empty())
    for (const char* name : {"bunny_closed.off", "armadillo.off", "bonsai/bonsai-tree.obj"}) paths.push_back(std::string(TEXEL_SHARED_DATA "/models/") + name);
  std::printf("model\tpattern\tsamples\tcpu_s\trms\tbias\tworst\n");
  for (const std::string& path : paths) curve(path);
  return 0;
}

}  // namespace
}  // namespace texel

int main(int argc, char** argv) { return texel::bench::guarded("alpha_curve", texel::run, argc, argv); }
