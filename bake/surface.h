#pragma once
// Stage 2: Scene, Plan -> border voxels with exact moments of the surface in each
#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "bake/plan.h"
#include "bake/texture.h"
#include "formats/pack.h"

namespace texel {

// Adds weight·n nᵀ to the six sums of a Moments or a Symmetric.
template <class Sums>
void add_outer(Sums& sums, const V3d& n, double weight) {
  sums.xx += weight * n.x * n.x;
  sums.yy += weight * n.y * n.y;
  sums.zz += weight * n.z * n.z;
  sums.xy += weight * n.x * n.y;
  sums.xz += weight * n.x * n.z;
  sums.yz += weight * n.y * n.z;
}

// Sums over the surface clipped to a voxel; lengths in voxels of level 0, areas in their squares, at every level. All additive.

// How much there is, and its shadows along x, y and z.
struct Areas {
  double area = 0;          // before cut-outs
  double covered = 0;       // A: after cut-outs; the weight of all means
  V3d crossings{0, 0, 0};   // Σ A|n|, after cut-outs: the mean number of crossings of a ray, times the face
  V3d stopping{0, 0, 0};    // closed surface where a ray in +axis direction enters it, before cut-outs; open surface as above
  V3d outward{0, 0, 0};     // Σ A n of closed surface, before cut-outs: what the inside loses from the near to the far wall
  double lost = 0;          // of level 0, along z: Σ A n_z (1 − ζ) of closed surface at height ζ in the voxel; with the share f of the near wall
                            // that is inside, f − lost is the filled fraction (divergence theorem)

  Areas& operator+=(const Areas& o) {
    area += o.area; covered += o.covered; crossings += o.crossings; stopping += o.stopping; outward += o.outward; lost += o.lost;
    return *this;
  }
  void add(const Areas& o, double factor) {
    area += o.area * factor; covered += o.covered * factor; lost += o.lost * factor;
    for (int a = 0; a < 3; ++a) {
      crossings[a] += o.crossings[a] * factor;
      stopping[a] += o.stopping[a] * factor;
      outward[a] += o.outward[a] * factor;
    }
  }
};

// The most surface, as a mean number of crossings times the face, that can stop a ray along an axis or let it out of matter: cut-outs let light through surface, not through matter behind it.
// With the filled share of a voxel no ray is stopped by more. Where that share is not exactly known the bound is worth nothing, unless there is next to none.
inline constexpr double kThinMatter = 1e-3;
[[nodiscard]] inline double most_met(const Areas& a, int axis) { return std::max(a.crossings[axis], 2 * a.stopping[axis] + a.outward[axis]); }

// Which way it faces. All weighted by covered area.
struct Moments {
  double covered = 0;       // A
  V3d m{0, 0, 0};           // Σ A n, of one-sided surface only
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;  // Σ A n nᵀ

  void add(const V3d& n, double a, bool one_sided) {
    covered += a;
    if (one_sided) m += n * a;
    add_outer(*this, n, a);
  }
  void add(const Moments& o, double factor) {
    covered += o.covered * factor; m += o.m * factor;
    xx += o.xx * factor; yy += o.yy * factor; zz += o.zz * factor; xy += o.xy * factor; xz += o.xz * factor; yz += o.yz * factor;
  }
  Moments& operator+=(const Moments& o) {
    covered += o.covered; m += o.m;
    xx += o.xx; yy += o.yy; zz += o.zz; xy += o.xy; xz += o.xz; yz += o.yz;
    return *this;
  }
};

// Projected areas Σ A|n·ω| along fixed axes (bake/lobes.h).
inline constexpr int kShadowAxes = 25;
using Shadow = std::array<float, kShadowAxes>;

// What a voxel's two lobes are made of.
struct Lobes {
  Moments second;           // of the second group of normals, no more than half of the covered area; covered = 0: one lobe is as good. The first has the rest of Surface::moments
  Shadow shadow{};          // of all
};

// Lobes narrower than the sun's disc look alike: none counts for more than this, so that a speck of mirror does not polish a voxel.
inline constexpr double kLeastAlpha = 0.01;

// Material sums besides colour, each weighted by covered area. Means are these over Moments::covered.
struct MaterialSums {
  V3d ks{0, 0, 0}, emission{0, 0, 0};
  double sharpness = 0;     // of k/α, k the mean of ks: see mean_roughness
  double roughness2 = 0;    // of α²
  double transparency = 0;  // of 1 − opacity

  void add(const Material& material, double area) {
    const auto alpha = static_cast<double>(material.roughness);
    const V3d shine(material.ks);
    ks += shine * area;
    sharpness += (shine.x + shine.y + shine.z) / 3 / std::max(alpha, kLeastAlpha) * area;
    emission += V3d(material.ke) * area;
    roughness2 += alpha * alpha * area;
    transparency += (1 - static_cast<double>(material.opacity)) * area;
  }
  MaterialSums& operator+=(const MaterialSums& o) {
    ks += o.ks; emission += o.emission;
    sharpness += o.sharpness; roughness2 += o.roughness2; transparency += o.transparency;
    return *this;
  }
};

// α of the GGX lobe that stands for the mean of all the surface's lobes k·D(α): the harmonic mean Σ A k / Σ A k/α. What does not shine has no say in it; the fit of one lobe to the mean by
// least squares is hardly nearer, and is no sum (docs/accuracy.md, "Mean lobe"). Where nothing shines: the root of the mean α², as where all of it is narrower than kLeastAlpha.
[[nodiscard]] double mean_roughness(const MaterialSums& sums, double covered);

struct Surface {
  VoxelSet set;                         // voxels with surface in them
  std::vector<Areas> areas;             // per voxel of the set
  std::vector<Moments> moments;         // likewise; empty where no normals are wanted
  std::vector<Lobes> lobes;             // likewise; empty where one lobe is wanted
  std::vector<V3d> color;               // likewise: Σ A·albedo, linear; empty where no colour is wanted or there is only one
  std::optional<V3f> one_color;         // of all the surface there is
  std::vector<MaterialSums> material;   // likewise; empty where no material says more than a colour

  // Mean albedo of the voxel's surface, which must have some, and colours.
  [[nodiscard]] V3f mean_color(std::size_t i) const { return one_color ? *one_color : V3f(color[i] / areas[i].covered); }
};

struct SurfaceWant {
  bool color = true, normals = true, material = true;
  bool lobes = false;                   // a second one, which needs normals
  int finest_cut = 4;                   // coverage and colour of cut-outs are looked up at as many as its square places of each fan triangle of a piece
};

// Exact to rounding: Σ area over voxels is the area of the mesh within the box. A voxel's sums run in triangle order.
// Of the slab alone; a voxel's sums do not depend on it.
// Memory: 96–280 bytes a border voxel, with lobes 180 more, twice that for a moment; with lobes also 84 bytes a piece of the layers at work, a million pieces or 128 a voxel at most. Threads: one block layer (8 voxels along z) a task.
[[nodiscard]] Surface clip_surface(const Scene& scene, const Plan& plan, const TextureSet& textures, const SurfaceWant& want, Report& report, const Slab& slab = {});

// Surfaces of slabs, lowest first, as one. Each part's memory goes back as soon as it is copied.
[[nodiscard]] Surface join_surfaces(std::vector<Surface>& parts);

// Sums of eight children each: the surface one level up.
[[nodiscard]] Surface coarser(const Surface& fine);

}  // namespace texel
