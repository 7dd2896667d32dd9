#pragma once
// Stage 2: pieces of surface in a voxel -> a second group of their normals, where two lobes are nearer to its projected area than one
#include <cstdint>
#include <span>
#include <vector>

#include "bake/surface.h"

namespace texel {

// Axes along which projected areas are kept, and their weights (sum 1): a Lebedev rule, which all turns of the cube map to itself, so that a turned scene has turned lobes.
// Exact for polynomials of degree 11. Source: Lebedev 1976, 50 points.
[[nodiscard]] const std::array<V3d, kShadowAxes>& shadow_axes();
[[nodiscard]] const std::array<double, kShadowAxes>& shadow_weights();

// Adds a piece's Σ A|n·ω|. Exact for flat ones; of others (fibres, bent surface) by their own SGGX, exact for a cylinder.
void add_shadow(const Moments& piece, Shadow& to);

// Pieces of a layer of blocks, kept until their voxels are complete. A voxel with more than kMostPieces of them may have those of about one direction added up first: bounded
// memory for less sure a choice of groups; sums do not change.
class LobePieces {
 public:
  static constexpr std::size_t kMostPieces = 128, kFirstLimit = std::size_t{1} << 20;
  explicit LobePieces(std::size_t limit = kFirstLimit) : first_limit_(limit), limit_(limit) {}
  void clear();
  void add(std::uint32_t voxel, const Moments& piece);
  // call(voxel, its pieces in the order in which they came) for each voxel with pieces, ascending.
  template <class Call>
  void for_each(Call&& call) {
    sort();
    for (std::size_t i = 0, j = 0; i < voxels_.size(); i = j) {
      while (j < voxels_.size() && voxels_[j] == voxels_[i]) ++j;
      call(voxels_[i], std::span<const Moments>(pieces_.data() + i, j - i));
    }
  }

 private:
  void sort();
  void merge();
  std::size_t first_limit_, limit_;
  std::vector<std::uint32_t> voxels_;
  std::vector<Moments> pieces_;
};

// The group of `pieces` that a second lobe should have, the smaller of two by covered area; covered = 0 where one lobe is as good. `whole`: their sum; the first group is the rest.
// `shadow`: whole's own, the truth to judge by: two lobes have to take a tenth at least off the error of one, which has to be kSeen of the mean at least.
// k-means, of axes (a group about a common normal) and of planes (a group about a common tangent), in bounded rounds. Deterministic. Cost: some µs.
inline constexpr double kSeen = 1.0 / 256, kLeastShare = 1.0 / 256;
[[nodiscard]] Moments second_group(const Moments& whole, std::span<const Moments> pieces, const Shadow& shadow);

// What the first group has: whole without second. Exact to rounding, as the second is no larger.
[[nodiscard]] Moments first_group(const Moments& whole, const Moments& second);

// Lobes of the voxels of `coarse` (moments known): sums of the shadows of up to eight children, and groups of their lobes.
void coarser_lobes(const Surface& fine, Surface& coarse);

}  // namespace texel
