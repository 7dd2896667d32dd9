#pragma once
// Stage 2c: Field, a brick of 8 × 8 × 8 voxels -> its surface, opacity, and what passes it
#include <array>
#include <cstdint>
#include <vector>

#include "bake/hypertexture.h"

namespace texel {

inline constexpr int kBrick = 8;  // voxels along its edge

// What a brick leaves behind. `passing[axis]`: of level 1 (4³ voxels), 2 (2³), 3 (1) the share of the rays that pass; then of its 8 × 8 columns, by
// (v, u) of that axis.
struct Brick {
  enum class Kind : std::uint8_t { kEmpty, kFull, kMixed } kind = Kind::kEmpty;
  bool sampled = false;
  std::array<std::uint64_t, 8> border{}, inside{};
  std::vector<Moments> moments;
  std::vector<Areas> areas;
  std::vector<V3d> color;
  std::vector<MaterialSums> material;
  std::array<std::vector<float>, 3> alpha;
  std::vector<float> solid;
  struct Passing { std::array<float, 64> level1; std::array<float, 8> level2; float level3; std::array<float, 64> columns; };
  std::vector<Passing> passing;    // 3, or none
  double mass = 0;
  std::int64_t undefined = 0;
};

// Buffers of one task.
struct BrickWork {
  std::vector<double> d;                       // samples with one beyond each side
  std::vector<double> x, y, z;
  std::array<std::vector<double>, 3> pass;     // per axis, voxel column, w: rays
};

// What every brick of a bake is made from. References must outlive it.
struct BrickSource {
  const Field& density;
  const Hypertexture& texture;
  const SolidTexture* color;
  V3f plain;
  float glow;
  const Grid& grid;
  const Recipe& recipe;
  const DensityOptions& options;
  int s;                                       // samples a voxel edge
  double cap;                                  // of a ray's optical depth in a voxel
};

// Samples brick `b` (its place among the bricks) where the density's range leaves doubt. What neighbours need of each other is sampled at the very same places, so that
// sums telescope across bricks. `out` must be new. Thread-safe; `work` is one thread's.
// Cost: (8s + 2)³ values of the density, which are nearly all of it.
void bake_brick(const BrickSource& source, const V3i& b, BrickWork& work, Brick& out);

}  // namespace texel
