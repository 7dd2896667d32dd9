#pragma once
// Stage 3: Plan -> sorted surface crossings of the axis-parallel sub-rays (fixed-point rasteriser)
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "bake/plan.h"
#include "bake/texture.h"

namespace texel {

// Where the sub-rays of a voxel column stand: `rows` rows of `per_row` rays, in fixed-point units of 2⁻¹⁶ voxel, the same in every column.
// kLattice: s² rows of one ray, a rank-1 lattice (u = g·r mod s², g coprime, of greatest least distance), so that an edge along
// either axis is met at s² places rather than s. kGrid: s rows of s rays, the plain grid.
struct RayPattern {
  int rows = 0, per_row = 0;
  bool sheared = false;         // the rays of a row stand anywhere in their equal parts of it, rather than in the middle
  std::vector<int> v;           // per row, ascending
  std::vector<int> u;           // rows · per_row
  [[nodiscard]] int rays() const { return rows * per_row; }
};
[[nodiscard]] RayPattern make_pattern(Pattern kind, int samples);

// Rows of as many rays, each row moved along against the one before by the golden ratio of their distance: an edge along the rows is met at `rows` places,
// one across them at all rows · per_row. Nearly the accuracy of a lattice where rows are several times per_row, for nearly the time of a grid.
[[nodiscard]] RayPattern make_sheared_pattern(int rows, int per_row);

inline constexpr int kFixedBits = 16;

// The axes of a bundle: rays run along w; (u, v) are the columns and rows of a slice's picture.
struct BundleAxes { int u, v, w; };
[[nodiscard]] constexpr BundleAxes bundle_axes(int axis) {
  return axis == 2 ? BundleAxes{0, 1, 2} : axis == 1 ? BundleAxes{0, 2, 1} : BundleAxes{1, 2, 0};
}

struct Crossing {
  double w;                     // depth, voxel space
  std::int32_t cell;            // voxel along w; surface in a wall: see docs/architecture.md; may lie outside [0, n)
  std::uint32_t triangle;       // page 0: of the mesh; from the mesh's triangles on: Plan::fibres[triangle − triangles]
  float coverage;               // of the sub-ray's footprint, after cut-outs
  std::int8_t enters;           // +1 the ray enters through the turned front, −1 it leaves through it
  std::int8_t winding;          // enters where the triangle takes part in the fill, else 0
  std::uint16_t page = 0;       // above 0: triangle number (page − 1)·2³² + triangle of all instances together (Placed::first)

  [[nodiscard]] std::uint64_t placed_number() const { return (std::uint64_t{page} - 1) << 32 | triangle; }
};

// What is in each band, whatever the pattern.
struct BundleLists {
  std::shared_ptr<const std::vector<std::int64_t>> points;  // fixed point (u, v) of each point
  std::vector<std::size_t> first;          // triangles by band: bins[first[b] … first[b+1]), ascending
  std::vector<std::uint32_t> bins;
  std::vector<std::size_t> fibre_first;    // the same of Plan::fibres; empty where there are none
  std::vector<std::uint32_t> fibre_bins;
  PlacedLayers placed;                     // instances by band
};

// Everything the bands of one axis share.
struct Bundle {
  const Scene* scene = nullptr;
  const Plan* plan = nullptr;
  const TextureSet* textures = nullptr;
  RayPattern pattern;
  int axis = 2;
  std::uint32_t triangles = kNoIndex;      // of the scene: crossings from this number on are fibres
  BundleAxes axes{0, 1, 2};
  int nu = 0, nv = 0, nw = 0;
  int band_rows = 8;                       // voxel rows a band covers
  int bands = 0;
  bool begins_inside = false;              // filled matter reaches below the box along the rays, so that some may enter it inside
  double end = std::numeric_limits<double>::infinity();  // voxels along w: surface wholly beyond is left out
  std::vector<char> used;                  // per row of rays: 0: not traced; empty: all are
  std::vector<char> columns;               // per voxel column, v · nu + u: 0: its rays are not traced; empty: all are
  std::shared_ptr<const BundleLists> lists;
};

// Of what a crossing is: the piece of a fibre, null where it is a triangle; else the triangle; the material of either.
[[nodiscard]] inline const FibreSegment* crossed_fibre(const Bundle& bundle, const Crossing& c) {
  return c.page > 0 || c.triangle < bundle.triangles ? nullptr : &bundle.plan->fibres[c.triangle - bundle.triangles];
}
[[nodiscard]] Face crossed_face(const Bundle& bundle, const Crossing& c);
[[nodiscard]] std::uint32_t crossed_material(const Bundle& bundle, const Crossing& c);

// `plan`, `scene` and `textures` are kept by reference. Cost: one pass over points and triangles.
[[nodiscard]] Bundle make_bundle(const Scene& scene, const Plan& plan, const TextureSet& textures, const Recipe& recipe, int axis);

// The same of some columns only (Bundle::columns), in bands of one voxel row: what lies over none of them is left out.
[[nodiscard]] Bundle narrow_bundle(const Bundle& all, std::vector<char> columns);

// The crossings of all rays of one band. Ray ids: ((voxel row in band · rows + row) · width + place of the column) · per_row + ray in row.
// Exactly one crossing where a ray meets the shared edge or corner of a closed surface, by the fill rule (top-left), so that
// winding numbers close on every ray. Sorted by depth, then cell, then page and triangle, within a ray.
struct Band {
  int v0 = 0, v1 = 0;                      // voxel rows [v0, v1)
  int width = 0;                           // columns traced: all, or those that Bundle::columns has in some row of the band
  std::vector<std::int32_t> before;        // per column and one more: how many traced ones lie before it; empty: all are traced
  [[nodiscard]] int place(int column) const { return before.empty() ? column : before[static_cast<std::size_t>(column)]; }
  [[nodiscard]] bool traced(int column) const { return traced(column, column); }
  // Some column of [first, last], which lie in the grid.
  [[nodiscard]] bool traced(int first_column, int last_column) const {
    return before.empty() || before[static_cast<std::size_t>(first_column)] < before[static_cast<std::size_t>(last_column) + 1];
  }
  std::vector<std::uint32_t> first;        // per ray and one more, into crossings
  std::vector<Crossing> crossings;         // at least first.back() of them
};
// Positions are exact to 2⁻¹⁷ voxel across the ray, depths to rounding. Cost: about 10 ns a triangle row, 20 ns a crossing.
// `scratch` is reused between calls.
struct BandScratch {
  struct Found { Crossing crossing; std::uint32_t ray; };
  std::vector<Found> found;
};
void trace_band(const Bundle& bundle, int band, Band& out, BandScratch& scratch);

// Where on a piece (0…1) a ray at (u, v) meets it. Voxel space.
[[nodiscard]] double fibre_place(const Bundle& bundle, const FibreSegment& fibre, double u, double v);

// The part of both that fibres take (fibre_rays.cpp). A ray meets a piece once, at its axis' depth, and only in the voxels that the axis passes, where
// clip_surface counts it; open surface.
void bin_fibres(const Bundle& bundle, BundleLists& lists);
void trace_fibres(const Bundle& bundle, int band, const Band& out, BandScratch& scratch);

// Barycentrics of corners 1 and 2 where a ray meets the plane of a triangle (u, v in voxel space).
struct Barycentrics { double b1, b2; };
[[nodiscard]] Barycentrics face_barycentrics(const BundleAxes& axes, const V3d& p0, const V3d& p1, const V3d& p2, double u, double v);

}  // namespace texel
