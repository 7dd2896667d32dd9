#pragma once
// Every option of a bake: default, unit, range. The option table in cli/options.cpp is the only other place that lists them.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/fibre_options.h"
#include "formats/grid.h"
#include "formats/height_field.h"
#include "formats/plant_options.h"
#include "formats/solid_textures.h"
#include "formats/write.h"

namespace texel {

enum class Fill { kAuto, kOn, kOff };            // auto: closed components; on: as auto, and it is an error if none is closed
enum class NdfKind { kSggx, kNeyret, kRatib };
enum class Normals { kAll, kVisible };
enum class MaterialOf { kAll, kVisible };        // whose colour and material a voxel has: all surface's, or what is seen of it from outside
enum class LevelMode { kRecompute, kFilter };
enum class Sidedness { kAuto, kAlways, kNever }; // auto: materials with cut-outs are two-sided
enum class Pattern { kLattice, kGrid };          // kLattice: rank-1 lattice, one ray in each of s² rows and columns; kGrid: s × s

struct Want {
  bool slices = true, density = true, color = true, ndf = true, visibility = true, material = true, normal = true, levels = true, preview = true;
  [[nodiscard]] bool volume() const { return density || color || ndf || visibility || material || normal; }
};

struct Light {
  enum class Kind { kAmbient, kSun, kPoint } kind = Kind::kAmbient;
  V3d vector{0, 0, 0};   // sun: direction the light travels, world; point: position, world
  V3f color{1, 1, 1};    // linear; ambient: irradiance/π; sun: irradiance/π on a facing surface; point: the same at distance 1
};

// A density instead of a mesh (formats/hypertexture.h). Values of 0, of amount below 0: the preset's own.
struct HypertextureOptions {
  std::string preset;                     // empty: none
  double frequency = 0, amount = -1, softness = 0, bias = 0, gain = 0, scale = 0;
  int octaves = 0;
  int seed = 0;
  bool operator==(const HypertextureOptions&) const = default;
};

struct Recipe {
  std::string implicit;                   // expression in x, y, z that stands beside the inputs (formats/expression.h); empty: none
  std::optional<double> iso;              // of every implicit input; default: the input's own (0; 0.5 of densities)
  V3i resolution{128, 0, 0};              // .x voxels along the longest side when y = z = 0, else NX,NY,NZ; 1…4096
  double voxel_size = 0;                  // world units; 0: from the resolution
  std::optional<Box3d> box;               // world; default: bounds and margin
  int margin = 1;                         // voxels around the bounds, 0…64
  std::array<bool, 3> cyclic{false, false, false};
  Want want;
  std::array<bool, 3> slice_axes{true, true, true};
  int slice_count = 0;                    // 0: the voxel count; −1: auto by the grazing criterion; else 1…4096
  int slice_levels = 0;                   // MIP levels of the stacks written beside level 0
  double max_angle = 54.74;               // degrees, for slice_count auto
  double see_in = 0.5;                    // share of the object's width the eye may look in, (0, 0.5]
  Fill fill = Fill::kAuto;
  std::vector<Light> lights;              // empty: unlit albedo. Lights colour the slices; the volume's Cd stays albedo
  bool shadows = false;
  NdfKind ndf = NdfKind::kSggx;
  int lobes = 1;                          // of the distribution of normals, 1 or 2 (bake/lobes.h); 2 only with kSggx and kAll
  Normals normals = Normals::kAll;
  MaterialOf material = MaterialOf::kAll;
  Sidedness two_sided = Sidedness::kAuto;
  int levels = -1;                        // −1: down to one voxel; else how many levels in all, 1…
  LevelMode level_mode = LevelMode::kRecompute;
  double prune = 0;                       // tolerance of bake/prune.h, 0…0.25; 0: nothing is left out
  double quantize = 0;                    // error of bake/round_values.h, 0…1/16; 0: values are not rounded
  int samples = 0;                        // sub-rays per voxel edge and axis: samples² rays through each voxel column, 1…64; 0: 4, or 6 where
                                          // textures cut holes or thin fibres lie, whose many layers need more rays for the same error (docs/accuracy.md)
  double max_error = 0;                   // choose the samples for this error of alpha; 0: as given by samples
  Pattern pattern = Pattern::kGrid;
  double max_depth = 9.21034037197618;    // cap of a voxel's optical depth: −ln(1e-4)
  int up = -1;                            // 0 x, 1 y, 2 z points up in the preview; −1: by the input's format
  HypertextureOptions hypertexture;
  std::string solid_texture;              // marble, wood, granite, or one or three pictures' names, comma between; empty: none
  double solid_size = 0;                  // world units one repetition takes; 0: half the scene's longest side
  PlaneBlend solid_blend = PlaneBlend::kNormal;
  int threads = 0;                        // 0: all
  std::int64_t memory = 0;                // bytes; 0: no cap
  HeightOptions heights;                  // how pictures are read; used by read_scene
  FibreOptions fibres;                    // what lines of .obj files are; used by read_scene
  PlantOptions plants;                    // how plants are read, and the unit of meshes; used by read_scene
  std::string texel;                      // which texel of a scene file; empty: the one there is
  int scene = -1;                         // which scene of a glTF file; below 0: the file's own
  WriteOptions write;                     // slice format, codec, full float
};

}  // namespace texel
