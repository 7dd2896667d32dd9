#pragma once
// Scene -> the truth about some voxels: triangles clipped one by one, rays of their own in double (docs/compare.md)
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bake/plan.h"
#include "bake/seen_material.h"
#include "bake/surface.h"
#include "bake/texture.h"

namespace texel {

// A scene made ready as the bake does it, up to where the bake's own approximations begin: fibres, heights and functions are triangles of
// the pack's own lattice, copies of what repeats are there.
struct TruthScene {
  Scene scene;
  TextureSet textures;
  Plan plan;
  bool whole = false;          // all of the scene lies within the grid: plan.statistics hold its area and volume
};

// Throws as bake; Error{kBadInput} where the scene does not fit the grid's repetition, Error{kUnsupported} for densities.
[[nodiscard]] std::unique_ptr<TruthScene> make_truth_scene(const Scene& scene, const Recipe& baked, const Grid& grid, Report& report);

// At most `most` of the voxels, those of the least hashes: the same ones whatever order they come in.
[[nodiscard]] std::vector<V3i> sample_voxels(std::vector<V3i> voxels, std::int64_t most, std::uint32_t seed);

struct TruthOptions {
  int rays = 64;               // a voxel edge and axis; 0: none are traced, alpha, solid and visible stay 0
  std::span<const V3d> directions;   // in which projected areas are wanted
  bool bins = false;           // whether normals are counted (ndf_fits.h)
  bool color = true;
  bool visible_material = false;     // `seen` is wanted, which needs rays
  std::uint32_t seed = 0;
};

// Areas in faces of the voxel's own level.
struct VoxelTruth {
  V3i at;
  double area = 0;             // before cut-outs
  Moments moments;             // after them
  V3d color{0, 0, 0};          // mean albedo, 0 without covered area
  std::array<double, 3> alpha{}, noise{};  // noise: variance of alpha's own rays, estimated from pairs of neighbouring ones (an overestimate: Cochran §5A.12)
  double solid = 0;            // by the chords along z
  MaterialSums material;       // times moments.covered
  ShadeSums seen;              // colour and material of what is seen of the voxel from outside along the three axes, as --material visible
  Moments visible;             // of the surface seen from outside the voxel along the three axes, as --normals visible
  std::vector<double> sigma;   // Σ A|n·ω|, per direction
  std::vector<double> bins, visible_bins;  // area per bin, where asked for
};

// In the order of `voxels` (cells of `level`). Thin fibres have their area where their axis is, as in the bake, and hide what they really hide.
// Visits more triangles than kMostVisits: empty, and report.skipped says so. Cost: about 2 ms a voxel at 64 rays. Deterministic.
[[nodiscard]] std::vector<VoxelTruth> true_voxels(const TruthScene& truth, int level, std::span<const V3i> voxels, const TruthOptions& options, Report& report);

}  // namespace texel
