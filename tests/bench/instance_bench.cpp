// Instances: time and memory of a bake by how many bushes stand in it, and how far it is from the same triangles copied.
//   bin/instance_bench [most instances, 100000] [leaves a bush, 12500] [resolution, 256]
#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "formats/instances.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

// Leaves of two triangles, of all directions, in a ball of radius 1.
Mesh bush(int leaves) {
  Scene scene = empty_scene();
  Random random(1);
  for (int i = 0; i < leaves; ++i) {
    const V3d at = random.direction() * std::cbrt(random.uniform());
    const Rotation turn = random_rotation(random);
    add_quad(scene, at, turn.x * 0.03, turn.y * 0.06);
  }
  return scene.mesh;
}

// On ground of side 1, each as wide as its share of the ground.
Scene meadow(const Mesh& shape, int count) {
  Scene scene = empty_scene();
  scene.shapes.push_back(shape);
  Random random(2);
  const double size = 0.6 / std::sqrt(static_cast<double>(count));
  for (int i = 0; i < count; ++i) {
    const double angle = random.uniform(0, 2 * M_PI), s = size * random.uniform(0.5, 1), c = s * std::cos(angle), d = s * std::sin(angle);
    Instance one;
    one.place.m = {c, -d, 0, random.uniform(), d, c, 0, random.uniform(), 0, 0, s, s};
    scene.instances.push_back(one);
  }
  return scene;
}

struct Run { double seconds = 0, surface = 0, crossings = 0, cpu = 0; Pack pack; };

Run timed(const Scene& scene, int resolution) {
  Recipe recipe = volume_recipe(resolution);
  Report report;
  Run run;
  run.pack = bake(scene, recipe, report);
  for (const StageTime& t : report.times) {
    run.seconds += t.seconds;
    run.cpu += t.cpu_seconds;
    if (t.stage == "surface") run.surface = t.cpu_seconds;
    if (t.stage == "crossings") run.crossings = t.cpu_seconds;
  }
  return run;
}

double rms_alpha(const Pack& a, const Pack& b) {
  const Channel *x = a.levels[0].find("alpha"), *y = b.levels[0].find("alpha");
  if (!x || !y || x->values.size() != y->values.size()) return std::nan("");
  double sum = 0;
  for (std::size_t i = 0; i < x->values.size(); ++i) sum += std::pow(static_cast<double>(x->values[i]) - static_cast<double>(y->values[i]), 2);
  return std::sqrt(sum / static_cast<double>(x->values.size()));
}

int run(int most, int leaves, int resolution) {
  const Mesh shape = bush(leaves);
  std::printf("%zu triangles a bush, %d voxels a side, all grids and levels, no slices\n", shape.triangles.size(), resolution);
  std::printf("| instances | triangles | border voxels | wall s | CPU s | surface CPU s | crossings CPU s | peak MB | copied: CPU s | rms alpha |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (int count = 1; count <= most; count *= 10) {
    const Scene scene = meadow(shape, count);
    const Run placed = timed(scene, resolution);
    rusage use{};
    getrusage(RUSAGE_SELF, &use);  // the peak so far: copies come after it and count for the next row's, so they stop at 100
    std::string copied = "- | -";
    if (count <= 100) {
      const Run flat = timed(flatten_instances(scene), resolution);
      char text[64];
      std::snprintf(text, sizeof text, "%.2f | %.1e", flat.cpu, rms_alpha(placed.pack, flat.pack));
      copied = text;
    }
    std::printf("| %d | %llu | %lld | %.2f | %.2f | %.2f | %.2f | %.0f | %s |\n", count, static_cast<unsigned long long>(count_triangles(scene)), static_cast<long long>(placed.pack.statistics.border_voxels), placed.seconds, placed.cpu, placed.surface, placed.crossings,
                static_cast<double>(use.ru_maxrss) / 1024, copied.c_str());
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace texel::test

int main(int argc, char** argv) {
  const auto number = [&](int i, int usual) { return argc > i ? std::atoi(argv[i]) : usual; };
  return texel::test::run(number(1, 100000), number(2, 12500), number(3, 256));
}
