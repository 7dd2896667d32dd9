#pragma once
// A plant as its file has it: a few shapes, and organs that are those shapes, thinned or thickened and moved. Not yet triangles of a scene.
#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "formats/affine.h"
#include "formats/plant_options.h"
#include "formats/report.h"
#include "formats/scene.h"
#include "formats/text_scanner.h"

namespace texel {

// A shape in its own space: the long axis is +x.
struct PlantMesh {
  std::vector<V3d> points;                              // finite
  std::vector<std::array<std::uint32_t, 3>> triangles;  // into points
  double low = 0, high = 0;                             // the points' range in x
  bool tapers = true;                                   // organs' taper counts
};

// Last step of reading a shape: sets its range from the points that are finite, and puts the others, which no triangle may use, at 0.
void settle_points(PlantMesh& mesh);

// One organ: y and z of the shape times w = base + (tip − base)·(x − low)/(high − low), then `matrix`, which is absolute.
struct PlantOrgan {
  std::uint32_t mesh = 0, material = 0;  // into Plant
  double base = std::numeric_limits<double>::quiet_NaN(), tip = base;  // one of them not finite: no taper
  Affine matrix;
  std::int64_t id = -1;                  // the file's own number of it
};

struct Plant {
  std::vector<PlantMesh> meshes;
  std::vector<Material> materials;
  std::vector<PlantOrgan> organs;        // in the file's order; each has a triangle at least, so that scenes of them are bounded by their triangles
  double unit = 0.01;                    // metres, by the format; 0: none
};

// Appends the organs as triangles, in order, moved by `placement` from the plant's units to world. Where the matrix mirrors (common in line
// trees) the triangles' corners are turned round. `first_material`: where the plant's materials are in scene.materials.
// Throws Error{kUnsupported} at `where` when the scene would have more than 2^27 triangles or points.
void place_plant(const Plant& plant, const Affine& placement, std::uint32_t first_material, Scene& scene, Report& report, const std::string& where);

// The scene of one plant alone: placed, its own materials, finish_mesh. Throws Error{kBadInput} when nothing is drawn.
[[nodiscard]] Scene plant_scene(const Plant& plant, const PlantOptions& options, Report& report, const std::string& where);

// The neutral material of organs without one.
[[nodiscard]] Material plain_organ();

// Albedo and the rest from a file's sRGB values; in range whatever they are.
[[nodiscard]] V3f plant_color(const double* rgb);

// XML plants. Throw Error{kBadInput} with FILE:LINE; what can be lived with is an issue (docs/issues.md).
// An Open Plant Format file (root <opf>) or a Geometry With Attributes file (root <gwa>): the root decides.
[[nodiscard]] Plant read_opf(const Input& input, Report& report);

}  // namespace texel
