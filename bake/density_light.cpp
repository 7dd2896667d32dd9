#include "bake/density_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/random.h"

namespace texel {
namespace {

constexpr int kMostCells = 64;
constexpr double kDark = 40;       // optical depth of which nothing is left, as of the pack's (compare_columns.cpp)
constexpr std::size_t kAtOnce = 32;  // places that are asked for together: few enough that little is asked for behind what is opaque

std::size_t place(const V3i& at, const V3i& n) {
  return (static_cast<std::size_t>(at.z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(at.y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(at.x);
}

// Places along a ray, in order.
struct Places {
  std::array<double, kAtOnce> x, y, z, d;
  std::size_t count = 0;

  // Σ −ln(1 − D); infinite where D is 1.
  double depth(const Field& density) {
    density.values(count, x.data(), y.data(), z.data(), d.data());
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i)
      if (!std::isnan(d[i])) sum -= std::log1p(-std::clamp(d[i], 0.0, 1.0));
    count = 0;
    return sum;
  }
};

}  // namespace

DensityLight make_density_light(const Field& density, double scale, const Grid& grid) {
  DensityLight light{&density, scale, grid, grid, {}};
  const int wide = (std::max({grid.n.x, grid.n.y, grid.n.z}) + kMostCells - 1) / kMostCells;
  light.cells.h = grid.h * wide;
  for (int k = 0; k < 3; ++k) light.cells.n[k] = (grid.n[k] + wide - 1) / wide;
  const V3i n = light.cells.n;
  light.kinds.resize(static_cast<std::size_t>(light.cells.voxels()));
  tbb::parallel_for(0, n.z, [&](int z) {
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        const V3d room(1e-6);  // cells: a place in a wall may be counted to either side by rounding
        const Interval range = density.range({light.cells.to_world(V3d(x, y, z) - room), light.cells.to_world(V3d(x + 1, y + 1, z + 1) + room)});
        light.kinds[place(V3i(x, y, z), n)] = range.high <= 0 ? DensityLight::Cell::kEmpty : range.low >= 1 ? DensityLight::Cell::kFull : DensityLight::Cell::kMixed;
      }
  });
  return light;
}

double light_passed(const DensityLight& light, const V3d& from, const V3d& to, std::uint64_t seed) {
  // What of it lies in the box: the outer voxels of coarse levels reach beyond, where the pack has nothing.
  const Box3d box = light.grid.box();
  const V3d along = to - from;
  double first = 0, last = 1;
  for (int k = 0; k < 3; ++k) {
    if (along[k] == 0) {
      if (from[k] < box.min[k] || from[k] > box.max[k]) return 1;
      continue;
    }
    const double a = (box.min[k] - from[k]) / along[k], b = (box.max[k] - from[k]) / along[k];
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  if (!(first < last)) return 1;
  const double length = along.length() * (last - first);
  const auto steps = static_cast<std::int64_t>(std::ceil(length / light.grid.h * kLightSteps));
  const double step = length / static_cast<double>(steps) * light.scale;
  RandomSequence random(seed);
  Places places;
  double depth = 0;
  for (std::int64_t s = 0; s < steps; ++s) {
    const V3d p = from + along * (first + (last - first) * (static_cast<double>(s) + random.next()) / static_cast<double>(steps));
    const V3d in = light.cells.to_voxel(p);
    V3i at;
    for (int k = 0; k < 3; ++k) at[k] = std::clamp(static_cast<int>(std::floor(in[k])), 0, light.cells.n[k] - 1);
    const DensityLight::Cell kind = light.kinds[place(at, light.cells.n)];
    if (kind == DensityLight::Cell::kEmpty) continue;
    if (kind == DensityLight::Cell::kFull) return 0;
    places.x[places.count] = p.x;
    places.y[places.count] = p.y;
    places.z[places.count] = p.z;
    if (++places.count < kAtOnce) continue;
    depth += places.depth(*light.density) * step;
    if (depth > kDark) return 0;
  }
  return std::exp(-(depth + places.depth(*light.density) * step));
}

FullVolume full_volume(const DensityLight& light, std::uint64_t seed) {
  constexpr int kEdge = 4;
  constexpr std::size_t kPlaces = kEdge * kEdge * kEdge;
  const V3i n = light.cells.n;
  const Box3d box = light.grid.box();
  std::vector<FullVolume> rows(static_cast<std::size_t>(n.z));
  tbb::parallel_for(0, n.z, [&](int z) {
    FullVolume& row = rows[static_cast<std::size_t>(z)];
    std::array<double, kPlaces> px, py, pz, d;
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        const std::size_t cell = place(V3i(x, y, z), n);
        if (light.kinds[cell] == DensityLight::Cell::kEmpty) continue;
        // The last cells may reach beyond the box.
        const V3d low = light.cells.to_world(V3d(x, y, z)), size(std::min(light.cells.h, box.max.x - low.x), std::min(light.cells.h, box.max.y - low.y), std::min(light.cells.h, box.max.z - low.z));
        const double volume = size.x * size.y * size.z;
        if (light.kinds[cell] == DensityLight::Cell::kFull) {
          row.value += volume;
          continue;
        }
        RandomSequence random(mix_bits(seed ^ mix_bits(cell)));
        for (std::size_t p = 0; p < kPlaces; ++p) {
          px[p] = low.x + size.x * (static_cast<double>(p % kEdge) + random.next()) / kEdge;
          py[p] = low.y + size.y * (static_cast<double>(p / kEdge % kEdge) + random.next()) / kEdge;
          pz[p] = low.z + size.z * (static_cast<double>(p / kEdge / kEdge) + random.next()) / kEdge;
        }
        light.density->values(kPlaces, px.data(), py.data(), pz.data(), d.data());
        int full = 0, unlike = 0;  // unlike: of pairs along x
        for (std::size_t p = 0; p < kPlaces; ++p) {
          full += d[p] >= 1;
          if (p % 2 == 1) unlike += (d[p] >= 1) != (d[p - 1] >= 1);
        }
        row.places += kPlaces;
        row.value += volume * full / kPlaces;
        row.error += volume / kPlaces * volume / kPlaces * unlike;  // its square, so far
      }
  });
  FullVolume sum;
  for (const FullVolume& row : rows) {
    sum.value += row.value;
    sum.error += row.error;
    sum.places += row.places;
  }
  sum.error = std::sqrt(sum.error);
  return sum;
}

}  // namespace texel
