#include "tests/stress/stress.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <mutex>
#include <sstream>
#include <thread>

#include "formats/error.h"
#include "tests/stress/invariants.h"

namespace texel::stress {
namespace {

double number_from(const char* variable, double otherwise) {
  const char* text = std::getenv(variable);
  return text && *text ? std::strtod(text, nullptr) : otherwise;
}

// Empty: nothing is wrong.
std::string examine(const Case& made, std::uint64_t seed, Tally& tally) {
  std::vector<std::string> faults;
  try {
    Report report;
    const Pack pack = bake(made.scene, made.recipe, report);
    faults = faults_of(made, pack, tally);
    // Files cost more than the rest: one in sixteen.
    if (faults.empty() && seed % 16 == 0) {
      faults = faults_of_files(pack, made.recipe, ::testing::TempDir() + "texel_stress_" + std::to_string(::getpid()) + "_" + std::to_string(seed) + ".texel");
      ++tally.packs_written;
    }
  } catch (const Error& e) {
    const std::string text = e.what();
    ++tally.refused;
    if (!made.may_be_refused) faults.push_back("refused: " + text);
    else if (e.code != Code::kBadInput && e.code != Code::kCommandLine) faults.push_back("refused with status " + std::to_string(static_cast<int>(e.code)) + ": " + text);
    else if (text.empty() || text.find('\n') != std::string::npos) faults.push_back("refused, but not in one line: " + text);
  } catch (const std::exception& e) {
    faults.push_back(std::string("an exception that is no Error: ") + e.what());
  }
  std::string all;
  for (const std::string& f : faults) all += "\n  " + f;
  return all;
}

}  // namespace

#ifndef TEXEL_STRESS_USUAL
#define TEXEL_STRESS_USUAL 1
#endif
int case_count(int usual) { return std::max(1, static_cast<int>(std::lround(usual * number_from("TEXEL_STRESS", TEXEL_STRESS_USUAL)))); }

void run_family(const std::string& name, int usual, const std::function<Case(std::uint64_t seed)>& make) {
  const double only = number_from("TEXEL_STRESS_ONLY", -1);
  const auto first = static_cast<std::uint64_t>(only >= 0 ? only : number_from("TEXEL_STRESS_SEED", 1));
  const int count = only >= 0 ? 1 : case_count(usual);
  const auto begin = std::chrono::steady_clock::now();
  std::atomic<int> next{0}, failed{0};
  std::mutex guard;
  Tally all;
  const auto work = [&] {
    Tally tally;
    for (int i; (i = next++) < count && failed < 5;) {
      const std::uint64_t seed = first + static_cast<std::uint64_t>(i);
      const Case made = make(seed);
      ++tally.cases;
      if (const std::string faults = examine(made, seed, tally); !faults.empty()) {
        ++failed;
        const std::lock_guard lock(guard);
        ADD_FAILURE() << name << " seed " << seed << " (" << made.what << ", " << made.scene.mesh.triangles.size() << " triangles)" << faults;
      }
      if (only >= 0) {
        std::printf("%s seed %.0f: %s, resolution %d %d %d, samples %d, pattern %d\n", name.c_str(), only, made.what.c_str(), made.recipe.resolution.x, made.recipe.resolution.y, made.recipe.resolution.z,
                    made.recipe.samples, static_cast<int>(made.recipe.pattern));
        for (const auto& t : made.scene.mesh.triangles)
          for (const std::uint32_t v : t) std::printf("%s%.17g %.17g %.17g", v == t[0] ? "\n" : ", ", made.scene.mesh.points[v].x, made.scene.mesh.points[v].y, made.scene.mesh.points[v].z);
        std::printf("\n");
      }
    }
    const std::lock_guard lock(guard);
    all.cases += tally.cases;
    all.refused += tally.refused;
    all.voxels += tally.voxels;
    all.asked_inside += tally.asked_inside;
    all.packs_written += tally.packs_written;
  };
  std::thread second(work);
  work();
  second.join();
  std::printf("stress %-14s %6lld cases, %lld refused, %lld voxels, %lld inside flags asked, %lld packs written and read, %.1f s\n", name.c_str(), static_cast<long long>(all.cases),
              static_cast<long long>(all.refused), static_cast<long long>(all.voxels), static_cast<long long>(all.asked_inside), static_cast<long long>(all.packs_written),
              std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
}

Recipe unit_recipe(const V3i& voxels) {
  Recipe recipe;
  recipe.box = Box3d(V3d(0), V3d(voxels));
  recipe.resolution = voxels;
  recipe.want.preview = false;
  return recipe;
}

void vary(Recipe& recipe, Random& random) {
  const auto one_in = [&](int n) { return random.bits() % static_cast<unsigned>(n) == 0; };
  if (one_in(2)) recipe.samples = static_cast<int>(random.bits() % 7);
  if (one_in(4)) recipe.pattern = Pattern::kLattice;
  if (one_in(6)) recipe.level_mode = LevelMode::kFilter;
  if (one_in(6)) {
    recipe.normals = Normals::kVisible;
    recipe.material = MaterialOf::kVisible;
  }
  if (one_in(8)) recipe.ndf = one_in(2) ? NdfKind::kNeyret : NdfKind::kRatib;
  if (one_in(8)) recipe.two_sided = Sidedness::kAlways;
  recipe.want.slices = one_in(3);
  if (one_in(3)) recipe.slice_count = 1 + static_cast<int>(random.bits() % 40);
  if (one_in(4)) recipe.slice_levels = 2;
  // Not drawn, so that what is drawn stays what it was.
  if (recipe.ndf == NdfKind::kSggx && recipe.normals == Normals::kAll && recipe.samples % 2 == 0) recipe.lobes = 2;
}

}  // namespace texel::stress
