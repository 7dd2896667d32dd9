// --max-error on models of ../shared/data, six of them and three errors, 64 voxels; skipped where they are not there.
#include <gtest/gtest.h>

#include "tests/bake/bake_util.h"
#include "tests/bake/max_error.h"

namespace texel::test {
namespace {

TEST(MaxErrorModels, AreAllKept) {
  int seen = 0;
  for (const char* name : {"bunny_closed.off", "armadillo.off", "hedge/hedgeTextured.obj", "fruit_bowl/bowlWithFruits.obj", "spot/spot_triangulated.obj", "fuze/fuze.obj"}) {
    Scene scene;
    std::string reason;
    if (!load_model(name, scene, reason)) GTEST_SKIP() << reason;
    for (const double error : {0.02, 0.01, 0.005}) {
      const Reached r = reach(scene, opacity_recipe(64), error, 64);
      std::printf("%s, %.3f asked for: says %.4f %.4f %.4f, is %.4f, coarser levels %.4f; %.1f rays a column\n", name, error, r.says[0], r.says[1], r.says[2], r.worst, r.coarse, r.rays);
      EXPECT_TRUE(r.met) << name << ' ' << error;
      EXPECT_LE(r.worst, error) << name;
      ++seen;
    }
  }
  EXPECT_EQ(seen, 18);
}

}  // namespace
}  // namespace texel::test
