#include "bake/view_zoom.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "formats/error.h"
#include "formats/solid_textures.h"

namespace texel {
namespace {

// Values of one channel at voxel centres, repeating.
struct Cube {
  V3i n;
  std::vector<float> values;

  [[nodiscard]] double at(const V3d& p) const {  // in periods
    int low[3], high[3];
    double t[3];
    for (int a = 0; a < 3; ++a) {
      const double x = (p[a] - std::floor(p[a])) * n[a] - 0.5, whole = std::floor(x);
      t[a] = x - whole;
      low[a] = (static_cast<int>(whole) + n[a]) % n[a];
      high[a] = (low[a] + 1) % n[a];
    }
    double sum = 0;
    for (int c = 0; c < 8; ++c) {
      const int x = c & 1 ? high[0] : low[0], y = c >> 1 & 1 ? high[1] : low[1], z = c >> 2 ? high[2] : low[2];
      const auto i = (static_cast<std::size_t>(z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(x);
      sum += (c & 1 ? t[0] : 1 - t[0]) * (c >> 1 & 1 ? t[1] : 1 - t[1]) * (c >> 2 ? t[2] : 1 - t[2]) * static_cast<double>(values[i]);
    }
    return sum;
  }
};

Cube read_cube(const Pack& pack) {
  const Layer* layer = nullptr;
  const Channel* c = pack.levels.empty() ? nullptr : pack.levels[0].find("Cd", &layer);
  if (!pack.cube || !c || c->components != 3 || layer->set.count != pack.grid.voxels())
    throw Error(Code::kBadInput, "--mode zoom", "the pack is no cube of solid texture", "bake one with --hypertexture octaves");
  Cube cube{pack.grid.n, std::vector<float>(static_cast<std::size_t>(pack.grid.voxels()))};
  for (const Block& b : layer->set.blocks) {
    std::int64_t i = b.first;
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y)
        for (int z = 0; z < 8; ++z) {
          if (!b.has(x, y, z)) continue;
          const V3i v = b.at * 8 + V3i(x, y, z);
          cube.values[(static_cast<std::size_t>(v.z) * static_cast<std::size_t>(cube.n.y) + static_cast<std::size_t>(v.y)) * static_cast<std::size_t>(cube.n.x) + static_cast<std::size_t>(v.x)] =
              c->values[static_cast<std::size_t>(i++) * 3];
        }
  }
  return cube;
}

}  // namespace

Image view_zoom(const Pack& pack, int size, int pictures) {
  const Cube cube = read_cube(pack);
  const double mean = pack.cube->mean.x, deviation = pack.cube->deviation.x;
  Image strip;
  strip.width = (pictures + 1) * size;
  strip.height = size;
  strip.channels = 3;
  strip.pixels.resize(static_cast<std::size_t>(strip.width) * static_cast<std::size_t>(size) * 3);
  tbb::parallel_for(0, size, [&](int y) {
    for (int k = 0; k <= pictures; ++k) {
      const double z = k == pictures ? 2.0 : std::exp2(static_cast<double>(k) / pictures);
      double square = 0;
      for (const double w : zoom_weights(std::log2(z) - std::floor(std::log2(z)))) square += w * w;
      const double spread = 6 * deviation * std::sqrt(square);
      for (int x = 0; x < size; ++x) {
        // A plane through the origin and along no axis, so that distance is a zoom about the picture's corner.
        const double u = (x + 0.5) / size, v = (y + 0.5) / size;
        const V3d p = V3d(2, 1, 2) * (u / 3) + V3d(-2, 2, 1) * (v / 3);
        const double value = zoom_value([&cube](const V3d& q) { return cube.at(q); }, p, z);
        const double grey = spread > 0 ? 0.5 + (value - mean) / spread : 0.5;
        float* out = strip.at(k * size + x, y);
        for (int c = 0; c < 3; ++c) out[c] = static_cast<float>(std::clamp(grey, 0.0, 1.0));
      }
    }
  });
  return strip;
}

}  // namespace texel
