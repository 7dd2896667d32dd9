#pragma once
// Stage 6: moments -> normal distribution: SGGX, Neyret's and Ratib's ellipsoids
#include <array>

#include "bake/surface.h"

namespace texel {

// Symmetric 3×3 matrix.
struct Symmetric {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
};

// Eigenvalues in descending order with unit, mutually orthogonal eigenvectors.
struct Eigen3 {
  std::array<double, 3> value;
  std::array<V3d, 3> vector;
};

// Cyclic Jacobi in double: residual about 1e-15 of the largest eigenvalue even for needles and sheets, where the closed form fails
// (Golub & Van Loan §8.5; measured in docs/accuracy.md). NaN input gives NaN. Cost: about 0.3 µs.
[[nodiscard]] Eigen3 eigen(const Symmetric& m);

// The SGGX matrix of the surface, scaled so that its largest eigenvalue is 1; zero where there is no surface.
// Closed form: eigenvectors of M, s_i ∝ t_i^1.3 with t the eigenvalues of M/A. Exact for a sheet, a full cylinder and a sphere;
// rms error of the projected area 3–7 % of its mean for a few random facets, 0.6 % for true SGGX input (docs/accuracy.md).
// Source: Heitz et al. 2015 for the model; the exponent is ours, measured.
[[nodiscard]] Symmetric sggx(const Moments& moments);

// Factor c (voxel areas of level 0) for which c·sqrt(ωᵀSω), S = sggx(moments), has the mean over all directions A/2 (Cauchy):
// c = A / (2 R_G(s)), R_G Carlson's symmetric elliptic integral of the second kind.
[[nodiscard]] double sggx_scale(const Moments& moments);

// Mean of √(ωᵀSω) over all directions: 1/2 for a sheet, π/4 for a cylinder, 1 for a sphere, whose largest eigenvalue is 1. Eigenvalues below 0 count as 0.
[[nodiscard]] double mean_shadow(const Symmetric& s);

// Both at once.
struct SggxLobe {
  Symmetric s;
  double scale = 0;
};
[[nodiscard]] SggxLobe sggx_lobe(const Moments& moments);

// The two stored axes e1/|e3|, e2/|e3| of an ellipsoid whose third is their cross product's direction.
struct StoredAxes { V3f axis_1, axis_2; };
// Ellipsoid whose own surface has the distribution: semi-axes e_i = sqrt(σ_j σ_k / σ_i). Ratios are held within 1:100 (a sheet's would be 0).
[[nodiscard]] StoredAxes neyret_axes(const Symmetric& s);
// Ellipsoid whose radius is the density of normals: e_i ∝ σ_i⁴ (on-axis densities of the SGGX lobe), ratios held within 1:100.
[[nodiscard]] StoredAxes ratib_axes(const Symmetric& s);

}  // namespace texel
