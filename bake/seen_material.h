#pragma once
// Stage 5b: crossings -> colour and material of what is seen of a voxel from outside it
#include <span>
#include <vector>

#include "bake/crossings.h"
#include "bake/surface.h"

namespace texel {

// Sums over crossings, each by the area it stands for: a ray's share of a face over |nx| + |ny| + |nz|, the rays that surface gets from the three bundles together.
struct ShadeSums {
  double area = 0;              // faces of the voxel's own level
  V3d color{0, 0, 0};
  MaterialSums material;

  ShadeSums& operator+=(const ShadeSums& o) {
    area += o.area; color += o.color; material += o.material;
    return *this;
  }
};

// Of a voxel: what rays met in it, and of this what an eye outside it sees, looking along the rays both ways. Where one layer lies in it, all of it open or all of it a solid's, the means of
// both are the same, to the bit.
struct SeenMaterial {
  ShadeSums seen, met;

  SeenMaterial& operator+=(const SeenMaterial& o) {
    seen += o.seen; met += o.met;
    return *this;
  }
};

struct SeenWant {
  bool color = false, material = false;
  [[nodiscard]] bool any() const { return color || material; }
};

// A ray through a voxel. `list`: its crossings there; `winding`: where it enters; (u, v): its place, voxel space; `width`: from ray to ray, voxels; `rays`: through the voxel.
struct SeenRay {
  std::span<const Crossing> list;
  int winding = 0;
  double u = 0, v = 0, width = 0, rays = 1;
};

// Adds what the ray meets and half of what is seen from each of its ends: open surface that stands alone is seen from both, a solid's from one, nothing from within matter. Cut-outs hide what
// they do in alpha; a material's own transparency lets the eye pass, but takes nothing from the surface that has it. Cost: a colour look-up a crossing.
void add_seen(const Bundle& bundle, const SeenRay& ray, const SeenWant& want, SeenMaterial& to);

// A surface's sums as if it had been all like what is seen of it: its exact means, moved by the rays' difference between what is seen and what is met (a control variate: the mean of what
// is seen alone would have the rays' error also where nothing hides anything). Where no ray meets anything the means stand. Times the covered area, as Surface's own; empty where not wanted.
struct SeenSurface {
  std::vector<V3d> color;
  std::vector<MaterialSums> material;
};
[[nodiscard]] SeenSurface seen_surface(const Surface& surface, const std::vector<SeenMaterial>& seen, const SeenWant& want);

}  // namespace texel
