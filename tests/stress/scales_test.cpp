// Offsets to 1e9, sizes 1e-20 to 1e20. Scaled by a power of two, the pack is the same to the bit.
#include "tests/stress/shapes.h"

namespace texel::stress {
namespace {

Case scaled(std::uint64_t seed) {
  Random random(seed * 198491317 + 47);
  Case made;
  made.scene = test::empty_scene();
  vary(made.recipe, random);
  made.recipe.resolution = V3i(2 + below(random, 24), 0, 0);
  made.recipe.want.preview = false;
  const double size = decade(random, -20, 20);
  // Double has at least 1e-4 of a voxel left: that is what an offset may take.
  const double most = std::min(9.0, std::log10(size) + 9);
  const V3d offset = random.direction() * decade(random, most - 12, most);
  if (below(random, 2)) {
    made.what = "a ball, scaled and moved";
    add_lump(made.scene, V3d(0), size, 4 + below(random, 8), [&](const V3d& p) { return p + offset; });
  } else {
    made.what = "a turned box, scaled and moved";
    const test::Rotation turn = test::random_rotation(random);
    test::add_box(made.scene, V3d(-0.5, -0.3, -0.2) * size, V3d(0.4, 0.3, 0.5) * size);
    for (V3d& p : made.scene.mesh.points) p = turn(p) + offset;
  }
  made.solid = made.scene.mesh;
  made.disjoint = true;
  return made;
}
TEST(Scales, SizesAndOffsets) { run_family("scales", 700, scaled); }

}  // namespace
}  // namespace texel::stress
