#pragma once
// Errors place by place -> means with their confidence; a voxel's projected areas and principal axis from its grids
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bake/compare.h"
#include "bake/ndf.h"
#include "bake/view_voxels.h"

namespace texel {

// Places there are where a sample is drawn from a continuum.
inline constexpr std::int64_t kEndless = std::int64_t{1} << 62;

// Sums of what each place (voxel, column, picture) says. `of`: how many places there are; 0: as many as were added.
struct ErrorSums {
  std::int64_t count = 0;
  double sum = 0, square = 0, fourth = 0, most = 0;

  // An error with a sign; or, of many errors at one place, their mean, mean square and largest size.
  void add(double error) { add(error, error * error, std::abs(error)); }
  void add(double mean, double mean_square, double largest) {
    ++count;
    sum += mean;
    square += mean_square;
    fourth += mean_square * mean_square;
    most = most > largest ? most : largest;
  }
  // Mean error, root of the mean square, largest: with the normal approximation's interval of 95 % for places drawn without replacement
  // (Cochran, Sampling Techniques, §2.8); of the root, the roots of the ends.
  [[nodiscard]] Measure bias(const std::string& name, std::int64_t of = 0) const;
  [[nodiscard]] Measure rms(const std::string& name, std::int64_t of = 0) const;
  [[nodiscard]] Measure max(const std::string& name, std::int64_t of = 0) const;
};

// A figure of which everything was looked at.
[[nodiscard]] Measure exactly(const std::string& name, double value, std::int64_t count);
// The same with where it belongs.
[[nodiscard]] Measure at_level(Measure measure, int level, int axis = -1);

// n directions spread evenly over a half sphere (spherical Fibonacci; what is asked of them is the same for ω and −ω).
[[nodiscard]] std::vector<V3d> half_sphere(int n);

// A distribution of normals as a voxel stores it.
struct VoxelNdf {
  enum class Kind { kSggx, kRatib } kind = Kind::kSggx;
  Symmetric s;                 // kSggx: σ(ω) ∝ √(ωᵀSω); kRatib: density of normals n ∝ (nᵀSn)^(−1/2)
  Eigen3 axes;                 // of S
};
// From the stored axes e1/|e3|, e2/|e3|; nullopt where they are none.
[[nodiscard]] std::optional<VoxelNdf> ndf_from_axes(NdfKind kind, const V3f& axis_1, const V3f& axis_2);
[[nodiscard]] VoxelNdf ndf_from_sggx(const Symmetric& s);

// What a voxel's surface is seen by: one distribution or two with their shares of the covered area.
struct VoxelLobes {
  std::array<VoxelNdf, 2> ndf;
  std::array<double, 2> share{1, 0};
};

// σ(ω) of surface of `area`, any unit: the shadow of all of it, both sides counted once, so that the mean over all directions is area/2.
void projected_areas(const VoxelNdf& ndf, double area, std::span<const V3d> directions, std::span<double> sigma);
// Of two lobes: the sum of each one's for its share.
void projected_areas(const VoxelLobes& lobes, double area, std::span<const V3d> directions, std::span<double> sigma);
// Density of normals (both signs together, over the half sphere: integral 1) in the given directions.
void normal_density(const VoxelNdf& ndf, std::span<const V3d> directions, std::span<double> density);

// The axis that stands out: a sheet's normal, a fibre's direction. Of eigenvalues t1 >= t2 >= t3 of Σ A n nᵀ the one farther from t2, where it is so by a
// tenth of their sum at least; nullopt where none stands out.
struct PrincipalAxis { V3d axis; bool fibre = false; };
[[nodiscard]] std::optional<PrincipalAxis> principal_axis(const Symmetric& moments);
// The same of a stored distribution: by its own second moment of normals.
[[nodiscard]] std::optional<PrincipalAxis> principal_axis(const VoxelNdf& ndf);
// Degrees between two axes, 0…90.
[[nodiscard]] double axis_angle(const V3d& a, const V3d& b);

// A level's grids of normals: S or the stored axes, whichever there is.
class NdfField {
 public:
  NdfField(const Level& level, NdfKind kind);
  [[nodiscard]] bool present() const { return diagonal_.present() || axis_1_.present(); }
  [[nodiscard]] std::optional<VoxelNdf> at(const V3i& voxel) const;
  // Both lobes where the voxel has them, else what at() says.
  [[nodiscard]] std::optional<VoxelLobes> lobes(const V3i& voxel) const;

 private:
  NdfKind kind_;
  VoxelField diagonal_, off_, axis_1_, axis_2_;
  std::array<VoxelField, 2> lobe_diagonal_, lobe_off_;
  VoxelField share_;
};

}  // namespace texel
