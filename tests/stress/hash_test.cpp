// One number for every grid, level and slice of a fixed list of cases: the same from g++ and clang++, with sanitizers or without, on any number of threads.
#include <bit>
#include <cstring>

#include "formats/error.h"
#include "tests/stress/shapes.h"

namespace texel::stress {
namespace {

struct Hash {
  std::uint64_t value = 0xcbf29ce484222325u;  // FNV-1a
  void add(const void* data, std::size_t bytes) {
    const auto* p = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < bytes; ++i) value = (value ^ p[i]) * 0x100000001b3u;
  }
  void add(std::int64_t i) { add(&i, sizeof i); }
};

// Made by + − × ÷ and square roots alone, which IEEE 754 rounds in one way: no library's sin, cos or pow, whose last digits may differ. Numbers are drawn one
// statement at a time: compilers differ in the order of a call's arguments.
V3d draw(Random& random, double low, double high) {
  V3d p;
  for (int k = 0; k < 3; ++k) p[k] = random.uniform(low, high);
  return p;
}
Scene fixed_scene(std::uint64_t seed, int n) {
  Random random(seed * 314606869 + 67);
  Scene scene = test::empty_scene();
  scene.materials[0].kd = V3f(0.25f, 0.5f, 0.75f);
  scene.materials.push_back(scene.materials[0]);
  scene.materials[1].kd = V3f(1, 0.125f, 0);
  scene.materials[1].opacity = 0.5f;
  const int count = 1 + below(random, 5);
  for (int i = 0; i < count; ++i) {
    V3d p[4];
    for (V3d& q : p) q = draw(random, 0, n);
    const V3d way = draw(random, -1, 1), other = draw(random, -1, 1);
    const int kind = below(random, 4), open = below(random, 3), turned = below(random, 2);
    const auto material = static_cast<std::uint32_t>(below(random, 2));
    switch (kind) {
      case 0: add_tetrahedron(scene, p[0], p[1], p[2], p[3], turned == 0); break;
      case 1: test::add_box(scene, p[0] * 0.5, p[0] * 0.5 + V3d(n * 0.25) + p[1] * 0.2, turned == 0, open ? 63 : 31, material); break;
      case 2: test::add_triangle(scene, p[0], p[0] + way * n * 0.3, p[0] + other * n * 0.2, material); break;
      default: test::add_triangle(scene, p[0], p[0] + way * n * 0.5, p[0] + other * 1e-6); break;
    }
  }
  return scene;
}

// What goes through the C library's pow and log1p is apart.
std::uint64_t hash_of(const Pack& pack) {
  Hash hash;
  for (const Level& level : pack.levels)
    for (const Layer& layer : level.layers) {
      for (const Block& b : layer.set.blocks) {
        for (const std::int64_t i : {b.at.x, b.at.y, b.at.z}) hash.add(i);
        hash.add(b.mask.data(), sizeof b.mask);
      }
      for (const Channel& c : layer.channels) {
        hash.add(c.name.data(), c.name.size());
        const bool from_library = c.name == "density" || c.name.starts_with("S_") || c.name.starts_with("axis_");
        if (from_library) continue;  // below
        for (const auto* list : {&c.values, &c.tiles}) hash.add(list->data(), list->size() * sizeof(float));
      }
    }
  for (const SliceStack& s : pack.slices)
    for (int k = 0; k < s.count; ++k) {
      const Image image = s.image(k);
      hash.add(image.pixels.data(), image.pixels.size() * sizeof(float));
    }
  return hash.value;
}
std::uint64_t hash_of_library_values(const Pack& pack) {
  Hash hash;
  for (const Level& level : pack.levels)
    for (const Layer& layer : level.layers)
      for (const Channel& c : layer.channels)
        if (c.name == "density" || c.name.starts_with("S_") || c.name.starts_with("axis_"))
          for (const auto* list : {&c.values, &c.tiles}) hash.add(list->data(), list->size() * sizeof(float));
  return hash.value;
}

constexpr std::uint64_t kExpected = 0x5e4c435b97cf95ab, kExpectedLibrary = 0xd84538f33d73903c;

TEST(Hash, TheSameFromEveryCompilerAndThreadCount) {
  std::uint64_t first = 0, first_library = 0;
  for (const int threads : {2, 1, 5}) {
    std::uint64_t all = 0, library = 0;
    for (std::uint64_t i = 0; i < 200; ++i) {
      Random random(i + 31);
      const int n = 4 + below(random, 13);
      Recipe recipe = unit_recipe(V3i(n, 4 + below(random, 9), n));
      vary(recipe, random);
      recipe.lobes = 1;  // as when the number was taken
      recipe.threads = threads;
      try {
        const Pack pack = test::bake_quietly(fixed_scene(i + 1, n), recipe);
        all = std::rotl(all, 7) ^ hash_of(pack);
        library = std::rotl(library, 7) ^ hash_of_library_values(pack);
      } catch (const Error& e) {
        all = std::rotl(all, 7) ^ static_cast<std::uint64_t>(e.code);
      }
    }
    if (first == 0) {
      first = all;
      first_library = library;
    }
    EXPECT_EQ(all, first) << threads << " threads";
    EXPECT_EQ(library, first_library) << threads << " threads";
  }
  std::printf("stress hash of 200 packs: %#llx, of what pow and log make of them %#llx\n", static_cast<unsigned long long>(first), static_cast<unsigned long long>(first_library));
  EXPECT_EQ(first, kExpected) << "the bake has changed (or computes otherwise on this machine): see docs/stress.md";
  // Another C library may round pow and log1p otherwise in the last digit; a difference here alone says no more than that.
  if (first == kExpected && first_library != kExpectedLibrary) std::printf("stress hash: pow or log1p of this C library differ from those of Debian 12\n");
}

}  // namespace
}  // namespace texel::stress
