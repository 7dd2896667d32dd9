#pragma once
// Stage 4: crossings -> slice records -> RGBA pictures, inside filled, colour running on
#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "bake/crossings.h"
#include "formats/pack.h"

namespace texel {

// Colours of slices: linear, lit where the recipe has lights.
struct SliceShader {
  // Where a sub-ray crosses the surface. (u, v): the ray, voxel space.
  std::function<V3f(const Bundle& bundle, const Crossing& crossing, double u, double v)> crossing;
  // Of a border voxel's surface as a whole, for surface that no ray along the stack meets (it runs along them). Red < 0: has none.
  std::function<V3f(const V3i& voxel, std::int64_t index)> voxel;
};

// A border voxel of a column: its place along the rays, and its index among the surface's voxels.
struct Cell { int k; std::int64_t index; };

// What the rays saw of one stack, sparse: pixels with surface in them, and runs of pixels inside.
struct SliceRecords {
  struct Pixel {
    std::uint32_t at;                 // row · width + column; row 0 is the lowest coordinate
    float r, g, b, a;                 // straight; r < 0: opaque or not, no surface was seen there, so no colour of its own
  };
  // A pixel in slices [first, last), where the solid covers `alpha` of it and no surface of its own gives it a colour.
  struct Run { std::uint32_t at; std::int32_t first, last; float alpha; };
  int axis = 2, count = 0, width = 0, height = 0;
  std::vector<std::size_t> first;     // per slice and one more, into pixels; sorted by `at` within a slice
  std::vector<Pixel> pixels;
  std::vector<Run> runs;
  // Which runs reach into slices [8g, 8g + 8), as bits: words [g · w, (g + 1) · w) with w = ceil(runs / 64). A run is as long as the
  // solid is deep, so a list per slice would be as large as the volume, and a look at every run for each slice as slow.
  std::vector<std::uint64_t> reaching;

  // call(run) for the runs through slice k, in order.
  template <class Call>
  void for_runs(int k, Call&& call) const {
    const std::size_t words = (runs.size() + 63) / 64, begin = static_cast<std::size_t>(k / kRunGroup) * words;
    for (std::size_t w = 0; w < words; ++w)
      for (std::uint64_t bits = reaching[begin + w]; bits != 0; bits &= bits - 1) {
        const Run& run = runs[w * 64 + static_cast<std::size_t>(std::countr_zero(bits))];
        if (k >= run.first && k < run.last) call(run);
      }
  }
  static constexpr int kRunGroup = 8;
};

// The first of `count` slices, of a stack of `voxels`, whose middle lies in this voxel or beyond.
[[nodiscard]] int first_slice_of(int voxel, int count, int voxels);

// Sub-rays of one pixel column -> its records. `scratch` holds per-slice sums between calls.
struct SliceScratch {
  struct Sum { double alpha = 0, weight = 0; V3d color{0, 0, 0}; };
  std::vector<Sum> sums;              // per slice
  std::vector<int> touched;           // slices of this column with surface
  std::vector<bool> is_touched;
  std::vector<std::int64_t> voxel;    // per slice: the border voxel at its middle, −1 none
  std::vector<int> inside_above;      // per touched slice: rays inside beyond it
};
struct SliceBand {                    // what one band makes, in its own slot
  struct Record { std::int32_t slice; SliceRecords::Pixel pixel; };
  std::vector<Record> records;
  std::vector<SliceRecords::Run> runs;
};
// Where slices are voxels thick they take the volume's opacity, so that both agree: `gain`, by border voxel, is it over the rays' plain
// mean; `missed` is the opacity itself where no ray met the surface, 0 elsewhere.
// Slices [first, last) of `count`.
struct SliceColumn { int column, row, count, first, last; std::span<const Cell> cells; std::span<const float> gain, missed; };
void slice_column(const Bundle& bundle, const Band& band, const SliceColumn& at, const SliceShader& shade, SliceScratch& scratch, SliceBand& out);

// Bands in order -> one stack's records.
[[nodiscard]] SliceRecords gather_slices(int axis, int width, int height, int count, std::vector<SliceBand>& bands);

// The picture of slice k: straight linear RGBA, top row = highest coordinate. Inside pixels take the colour of the nearest pixel of
// this slice that has one; outside, colour runs on for kBleed pixels, then is the mean of the slice's. Colour runs across the borders of
// axes that repeat.
inline constexpr int kBleed = 4;
[[nodiscard]] Image slice_image(const SliceRecords& records, const std::array<bool, 3>& cyclic, int k);

// A stack ready for the pack: level 0, or one level of its MIP (two slices into one, 2×2 pixels into one).
// The stack's image function shares `records`.
[[nodiscard]] SliceStack make_stack(std::shared_ptr<const SliceRecords> records, const Grid& grid, const std::array<bool, 3>& cyclic, int level);

// Least number of slices for which no gap shows up to `angle` degrees from the axis when the eye may look `depth` world units in:
// h·tan a ≤ d (Meyer & Neyret 1998 §3.1). And the angle that a thickness allows.
[[nodiscard]] int slices_for_angle(double length, double depth, double angle_degrees);
[[nodiscard]] double angle_for_slices(double thickness, double depth);

}  // namespace texel
