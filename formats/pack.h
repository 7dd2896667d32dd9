#pragma once
// The second contract: what a bake makes and a writer stores. See docs/pack-format.md for the files.
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/grid.h"
#include "formats/image.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// 8×8×8 voxels. Bit (x<<6 | y<<3 | z) of the mask (OpenVDB's leaf order) says whether local voxel (x,y,z) is in the set.
struct Block {
  V3i at;                              // in units of 8 voxels
  std::array<std::uint64_t, 8> mask{}; // word x, bit y<<3 | z
  std::int64_t first = 0;              // index of this block's first voxel among the set's values

  [[nodiscard]] bool has(int x, int y, int z) const { return (mask[static_cast<std::size_t>(x)] >> (y << 3 | z)) & 1u; }
  // Index of local voxel (x,y,z) among the set's values: set bits before it. Meaningful only when has(x,y,z).
  [[nodiscard]] std::int64_t index(int x, int y, int z) const {
    std::int64_t at_word = first;
    for (int w = 0; w < x; ++w) at_word += __builtin_popcountll(mask[static_cast<std::size_t>(w)]);
    const std::uint64_t below = (std::uint64_t{1} << (y << 3 | z)) - 1;
    return at_word + __builtin_popcountll(mask[static_cast<std::size_t>(x)] & below);
  }
};

// Voxels in a block's mask.
[[nodiscard]] inline int count_voxels(const std::array<std::uint64_t, 8>& mask) {
  int count = 0;
  for (const std::uint64_t word : mask) count += __builtin_popcountll(word);
  return count;
}

// A sparse set of voxels. Blocks are sorted by (z, y, x) of `at`, each at most once, none empty; `first` is the running count.
struct VoxelSet {
  std::vector<Block> blocks;
  std::int64_t count = 0;

  // Appends a block that comes after all there are and is not empty.
  void add(const V3i& at, const std::array<std::uint64_t, 8>& mask) {
    blocks.push_back({at, mask, count});
    count += count_voxels(mask);
  }
};

// call(voxel, index) for the voxels of a set, in the order of its values.
template <class Call>
void for_each_voxel(const VoxelSet& set, Call&& call) {
  for (const Block& b : set.blocks) {
    std::int64_t index = b.first;
    for (int x = 0; x < 8; ++x)
      for (std::uint64_t word = b.mask[static_cast<std::size_t>(x)]; word; word &= word - 1) {
        const int bit = __builtin_ctzll(word);
        call(V3i(b.at.x * 8 + x, b.at.y * 8 + (bit >> 3), b.at.z * 8 + (bit & 7)), index++);
      }
  }
}

// Values of one output grid on a layer's voxels, then on its tiles.
struct Channel {
  std::string name;            // grid name in the pack: "density", "Cd", …
  int components = 1;          // 1 or 3
  std::vector<float> values;   // set.count · components, block by block, mask order within a block
  std::vector<float> tiles;    // tiles.size() · components
  bool full_float = false;     // half cannot hold it (values beyond 65504 or below 6e-5 where that matters): store as float
};

// Grids that are active on the same voxels. A tile is a whole 8³ block of one value.
struct Layer {
  VoxelSet set;
  std::vector<V3i> tiles;      // block coordinates, sorted by (z, y, x), disjoint from set.blocks
  std::vector<Channel> channels;
};

// One level of the octree: "matter" (density, alpha, solid), "surface" (area, normal, S_…, crossings, materials), "colour" (Cd, two
// voxels beyond the matter). Layers without channels are left out.
struct Level {
  Grid grid;
  std::vector<Layer> layers;
  [[nodiscard]] const Channel* find(const std::string& name, const Layer** layer = nullptr) const {
    for (const Layer& l : layers)
      for (const Channel& c : l.channels)
        if (c.name == name) { if (layer) *layer = &l; return &c; }
    return nullptr;
  }
};

// One stack of RGBA slices. Slice k is the slab [k, k+1]·thickness above the box's lowest side along `axis`.
struct SliceStack {
  int axis = 2;                // 0 x, 1 y, 2 z
  int level = 0;               // MIP along the stack: 1 has half the slices and half the pixels
  int count = 0, width = 0, height = 0;
  double thickness = 0;        // world units; = spacing
  double max_angle = 0;        // degrees from the axis up to which no gap shows (grazing criterion); 0: unknown
  // Slice k: straight linear RGBA, width·height, top row = highest coordinate, colour running on under alpha 0. Thread-safe.
  std::function<Image(int k)> image;
};

struct Statistics {
  std::int64_t triangles = 0, degenerate = 0, components = 0, closed = 0;
  double area = 0;             // world units², before cut-outs
  double covered_area = 0;     // after cut-outs
  double volume = 0;           // world units³, of the closed components that are filled
  V3f mean_color{0, 0, 0};     // area-weighted linear albedo
  std::int64_t border_voxels = 0, inside_voxels = 0;
};

struct ErrorFigure {
  std::string measure;         // "axis_alpha_rms", …
  double value = 0;
  std::string how;             // how it was measured or why it is a bound
};

// What a renderer needs to know of a cube of solid texture that repeats on all three axes and is to be zoomed through as a sum of octaves
// (formats/solid_textures.h).
struct SolidCube {
  int octaves = 0;             // summed by the renderer, each at twice the frequency of the one before
  int cells = 0;               // lattice cells of noise a period
  std::vector<double> weights_start, weights_end;  // at either end of the zoom cycle
  V3d mean{0, 0, 0}, deviation{0, 0, 0};           // of the grid Cd, level 0
};

struct Pack {
  Grid grid;                   // level 0
  std::array<bool, 3> cyclic{false, false, false};
  std::vector<Level> levels;   // finest first; may be empty when only slices are wanted
  std::vector<SliceStack> slices;
  Statistics statistics;
  bool density = false;        // baked from a density: its surface is that of all thresholds, and no sheet
  std::optional<SolidCube> cube;
  std::vector<ErrorFigure> errors;
  std::vector<Issue> issues;
  std::vector<Skip> skipped;
  std::vector<SourceFile> sources;
  std::string recipe_json;     // every option as resolved: a JSON object, canonical text
  Image preview;               // empty: none wanted
};

}  // namespace texel
