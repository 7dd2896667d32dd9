#pragma once
// Samples on a regular grid -> Field: trilinear in between, exact ranges.
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "formats/field.h"
#include "formats/grid.h"

namespace texel {

// n.x × n.y × n.z samples in blocks of 8³, sparse: a block whose samples are all alike is one number.
struct SampleGrid {
  V3i n{0, 0, 0};                          // samples; each >= 1
  std::vector<std::int32_t> blocks;        // per block, x fastest: >= 0 which of `data`, else ~which of `constants`
  std::vector<float> data;                 // 512 a block, place x + 8·(y + 8·z); beyond n: `outside`
  std::vector<float> constants;
  float outside = 0;                       // of every sample beyond the grid
  V3d origin{0, 0, 0};                     // world position of sample (0,0,0)
  V3d step[3] = {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};  // world, from sample to sample along each index; independent of each other

  [[nodiscard]] V3i block_count() const { return {(n.x + 7) / 8, (n.y + 7) / 8, (n.z + 7) / 8}; }
};

inline constexpr std::int64_t kMostSamples = std::int64_t{1} << 34;

// From a function that writes rows: row(y, z, out) gives the n.x samples of a row. Values that are not finite are counted in `*bad` and
// become the least finite one, which is also `outside`.
[[nodiscard]] SampleGrid make_samples(const V3i& n, const std::function<void(int y, int z, float* out)>& row, std::int64_t* bad);

// Least and largest sample, `outside` left out.
[[nodiscard]] Interval sample_range(const SampleGrid& grid);

// sign·(trilinear interpolation of the samples); the gradient is that of the interpolation, which jumps between the samples' cells; the range
// is that of the samples around, exact for boxes of a few thousand samples and a little wider for larger ones. Bounds: the cells
// around samples where sign·sample >= iso. `sign`: 1 or −1.
[[nodiscard]] std::shared_ptr<const Field> make_grid_field(SampleGrid grid, double sign = 1);

}  // namespace texel
