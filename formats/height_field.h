#pragma once
// Height fields: surfaces z(x, y) over a rectangle, solid below down to a plane. What the command line can say of them and what comes of it.
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/grid.h"

namespace texel {

using Imath::V2d;

// A cyclic field of gradient noise (noise.h): a plane through the noise in space, its first octave `period` lattice cells a side.
struct PerlinField {
  int period = 0;               // 1…64; 0: no such field
  int octaves = 4;              // 1…12, each of half the size and half the weight of the one before
  std::uint32_t seed = 0;
};

// How pictures become height fields.
struct HeightOptions {
  double height = 0;            // world height of value 1: of an integer type's largest value, of a float's 1.0; 0: a quarter of the longer
                                // side, or, where the file states its pixels' size, one of the file's own units
  V2d extent{0, 0};             // world size from the first to the last sample, on a cyclic axis of one period; 0: longer side 1, or the
                                // size the file states
  std::optional<double> base;   // world z of the bottom; none: 1/32 of the longer side below the lowest height
  std::optional<double> no_data;// stored value that means no data, beside those the file itself names
  std::string color;            // picture of the surface's colour; empty: none
  PerlinField perlin;
};

// A field over [0, size.x] × [0, size.y]. Either samples or a function.
struct HeightField {
  std::string name;             // the file, for messages
  int width = 0, height = 0;    // samples along x and y; 0: a function
  std::vector<double> z;        // world; row 0 is the far one, at greatest y; NaN: no data. Every cell between four samples is bilinear,
                                // and is there only where all four are
  V2d size{1, 1};
  double base = 0;              // world z of the bottom, never above the lowest height
  double low = 0, high = 0;     // of the heights there are; of a function: what encloses them
  std::uint32_t material = 0;   // into Scene::materials
  bool textured = false;        // its material has a picture, sample on sample
  // z at n points, world space, and where `dx` is not null the gradient; periodic in `size`, bit for bit. Thread-safe. Empty where there are
  // samples.
  std::function<void(std::size_t n, const double* x, const double* y, double* z, double* dx, double* dy)> function;
  double detail = 0;            // of a function: how far apart its finest features are, world units
};

}  // namespace texel
