#pragma once
// Counted normals -> Ratib's ellipsoids as he builds them, and how far any stored distribution is from the counts: for `texel bench`
#include <optional>
#include <span>
#include <vector>

#include "bake/compare_sums.h"

namespace texel {

// 8 × 16 bins of equal area over the half sphere of axes: bands of equal height along z, cut evenly in longitude. (Ratib's n × n cells of θ and φ are smaller
// near the pole; method.md 3.2.)
inline constexpr int kNormalRows = 8, kNormalColumns = 16, kNormalBins = kNormalRows * kNormalColumns;
[[nodiscard]] int normal_bin(const V3d& normal);  // sign left out
[[nodiscard]] V3d bin_centre(int bin);

// The fullest bin, the fullest one within 20° of square to it, and their cross product; radii as the counts there, held within 1:100
// (Ratib 1997 §3.3.1). nullopt where nothing was counted.
[[nodiscard]] std::optional<StoredAxes> ratib_from_fullest(std::span<const double> bins);

// The quadric nᵀQn = 1 nearest, by least squares, to the points at the counts' distance along each bin that has any (§5.2.2.1); eigenvalues of Q
// that would make axes imaginary or longer than 100 times the shortest are held there.
[[nodiscard]] std::optional<StoredAxes> ratib_by_least_squares(std::span<const double> bins);

// ½ Σ |p − q| over the bins, 0…1, of the counts and the distribution's own share of each bin (4096 places). Counts must not all be 0.
[[nodiscard]] double total_variation(std::span<const double> bins, const VoxelNdf& ndf);

}  // namespace texel
