#include "cli/option_kinds.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "formats/noise.h"

namespace texel {
namespace {

constexpr const char* kFiles = "Input and output";
constexpr const char* kHeights = "Height fields";
constexpr const char* kGridGroup = "Grid";
constexpr const char* kVolume = "Volume";
constexpr const char* kNoise = "Hypertextures and solid textures";
constexpr const char* kSlices = "Slices";
constexpr const char* kLevels = "Levels";
constexpr const char* kAccuracy = "Accuracy";
constexpr const char* kRunning = "Running";
constexpr const char* kCamera = "Camera";
constexpr const char* kPicture = "Picture";
constexpr const char* kMeasuring = "Measuring";

constexpr unsigned kAll = kBake | kInfo | kCheck | kView | kBatch | kCompare | kBench;
constexpr unsigned kBakes = kBake | kBatch;

}  // namespace

std::string OptionRow::key() const {
  std::string k = name;
  std::replace(k.begin(), k.end(), '-', '_');
  return k;
}

std::string number_text(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

bool read_number(const std::string& text, double* value) {
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (begin != end && *begin == '+') ++begin;
  const auto [stop, error] = std::from_chars(begin, end, *value);
  return error == std::errc{} && stop == end && std::isfinite(*value);
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == at) parts.emplace_back();
    else parts.back() += c;
  }
  return parts;
}

std::vector<OptionRow> option_rows() {
  const double far = std::numeric_limits<double>::max();
  const std::vector<std::pair<const char*, Progress>> progress = {
      {"auto", Progress::kAuto}, {"always", Progress::kAlways}, {"never", Progress::kNever}};
  return {
      // Input and output
      text({.name = "output", .letter = 'o', .metavar = "PACK", .group = kFiles, .commands = kBake,
            .help = "the pack's folder, by convention NAME.texel; missing folders above it are made"},
           [](auto& s) -> auto& { return s.output; }),
      text({.name = "output", .letter = 'o', .metavar = "FOLDER", .group = kFiles, .commands = kBatch,
            .help = "where the packs go, one NAME.texel an item, in folders like those given"},
           [](auto& s) -> auto& { return s.output; }),
      text({.name = "output", .letter = 'o', .metavar = "IMAGE", .group = kFiles, .commands = kView, .help = "the picture: NAME.png or NAME.exr"},
           [](auto& s) -> auto& { return s.output; }),
      text({.name = "output", .letter = 'o', .metavar = "FOLDER", .group = kFiles, .commands = kBench, .help = "where bench.json and the plots go; also --out"},
           [](auto& s) -> auto& { return s.output; }),
      text({.name = "implicit", .metavar = "EXPR", .group = kFiles, .commands = kBake | kView | kBench,
            .help = "the solid where this function of x, y, z is >= --iso, as an INPUT or beside others (docs/inputs.md)", .in_recipe = true,
            .literal = true, .shown_default = "none", .accepts = "an expression"},
           [](auto& s) -> auto& { return s.recipe.implicit; }),
      maybe_number({.name = "iso", .metavar = "V", .group = kFiles, .commands = kBakes | kView | kBench, .help = "implicit surfaces lie where their function has this value",
                    .in_recipe = true, .shown_default = "the input's own, for --implicit 0"},
                   [](auto& s) -> auto& { return s.recipe.iso; }),
      text({.name = "recipe", .metavar = "FILE", .group = kFiles, .commands = kBakes,
            .help = "options from a JSON file, or from a pack or its manifest to rebake it; the command line beats it"},
           [](auto& s) -> auto& { return s.recipe_file; }),
      text({.name = "depfile", .metavar = "FILE", .group = kFiles, .commands = kBake,
            .help = "write a make-style list of everything read"},
           [](auto& s) -> auto& { return s.depfile; }),
      text({.name = "report", .metavar = "FILE", .group = kFiles, .commands = kBake,
            .help = "write JSON: counts, times per stage, peak memory, skipped and why, issues, errors"},
           [](auto& s) -> auto& { return s.report_file; }),
      text({.name = "report", .metavar = "FILE", .group = kFiles, .commands = kBatch,
            .help = "where the report of all items goes", .shown_default = "batch-report.json in FOLDER"},
           [](auto& s) -> auto& { return s.report_file; }),
      toggle({.name = "force", .group = kFiles, .commands = kBakes, .help = "bake though the pack is up to date"},
             [](auto& s) -> auto& { return s.force; }),
      toggle({.name = "plan", .group = kFiles, .commands = kBake, .help = "say what would be done, and stop"},
             [](auto& s) -> auto& { return s.plan; }),
      toggle({.name = "json", .group = kFiles, .commands = kInfo | kCheck | kCompare, .help = "print JSON"},
             [](auto& s) -> auto& { return s.json; }),

      text({.name = "texel", .metavar = "NAME", .group = kFiles, .commands = kBake | kView | kBench,
            .help = "which texel of a scene file with several (docs/scenes.md)", .in_recipe = true, .literal = true, .shown_default = "the one there is"},
           [](auto& s) -> auto& { return s.recipe.texel; }),
      [] {
        OptionRow row = integer({.name = "scene", .metavar = "N|auto", .group = kFiles, .commands = kBakes | kView | kBench, .help = "which scene of glTF files with several, from 0 on",
                                 .in_recipe = true, .shown_default = "the file's own choice"},
                                [](auto& s) -> auto& { return s.recipe.scene; }, 0, 1 << 30, "auto", -1);
        row.get = [](const Settings& s) { return s.recipe.scene >= 0 ? std::to_string(s.recipe.scene) : std::string(); };
        return row;
      }(),
      choice({.name = "unit", .metavar = "UNIT", .group = kFiles, .commands = kBakes | kView | kBench,
              .help = "unit of the mesh and plant files; the scene is then in metres. auto: cm for .opf, .gwa and .lig, others stay as they are", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.plants.unit; }, std::vector<std::pair<const char*, double>>{{"auto", 0}, {"mm", 0.001}, {"cm", 0.01}, {"m", 1}}),
      choice({.name = "angles", .metavar = "UNIT", .group = kFiles, .commands = kBakes | kView | kBench,
              .help = "unit of the angles in .ops files, degrees or radians", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.plants.radians; }, std::vector<std::pair<const char*, bool>>{{"deg", false}, {"rad", true}}),

      number({.name = "fibre-radius", .metavar = "R", .group = kFiles, .commands = kBakes | kView | kBench,
              .help = "radius of the lines in .obj files, in the file's unit; 0 leaves lines out", .in_recipe = true,
              .shown_default = "1/2000 of their diagonal"},
             [](auto& s) -> auto& { return s.recipe.fibres.radius; }, {0, 1e30, false, true}),

      // Height fields
      number({.name = "height", .metavar = "H", .group = kHeights, .commands = kBakes | kView | kBench,
              .help = "world height of value 1: an integer picture's full scale, a float picture's 1.0", .in_recipe = true,
              .shown_default = "a quarter of the longer side; a GeoTIFF's own units"},
             [](auto& s) -> auto& { return s.recipe.heights.height; }, {0, 1e30, true, true}),
      extent({.name = "extent", .metavar = "W,D", .group = kHeights, .commands = kBakes | kView | kBench,
              .help = "world size in x and y, from the first sample to the last; of a cyclic axis, one period", .in_recipe = true,
              .shown_default = "longer side 1; a GeoTIFF's own"}),
      maybe_number({.name = "base", .metavar = "Z", .group = kHeights, .commands = kBakes | kView | kBench,
                    .help = "world height of the plane the field is solid down to", .in_recipe = true,
                    .shown_default = "1/32 of the longer side below the lowest height"},
                   [](auto& s) -> auto& { return s.recipe.heights.base; }),
      maybe_number({.name = "no-data", .metavar = "V", .group = kHeights, .commands = kBakes | kView | kBench,
                    .help = "value, as stored in the picture, that means no data: holes, as where alpha is 0 or the file says so",
                    .in_recipe = true, .shown_default = "the file's own"},
                   [](auto& s) -> auto& { return s.recipe.heights.no_data; }),
      height_color({.name = "height-color", .metavar = "FILE", .group = kHeights, .commands = kBakes | kView | kBench,
                    .help = "picture of the surface's colour, or of its light", .in_recipe = true, .shown_default = "grey"}),
      perlin_field({.name = "perlin-field", .metavar = "PERIOD,OCTAVES,SEED", .group = kHeights, .commands = kBake | kView | kBench,
                    .help = "a cyclic field of gradient noise, as an input of its own", .in_recipe = true, .shown_default = "none"}),

      // Grid
      resolution({.name = "resolution", .letter = 'r', .metavar = "N|NX,NY,NZ", .group = kGridGroup, .commands = kBakes,
                  .help = "voxels along the longest side, or along x, y and z", .in_recipe = true}),
      number({.name = "voxel-size", .metavar = "S", .group = kGridGroup, .commands = kBakes,
              .help = "voxel edge in world units, instead of a resolution", .in_recipe = true, .shown_default = "from the resolution"},
             [](auto& s) -> auto& { return s.recipe.voxel_size; }, {0, far, true, true}),
      box({.name = "box", .metavar = "X0,Y0,Z0,X1,Y1,Z1", .group = kGridGroup, .commands = kBakes | kView | kBench, .help = "region to bake, or to make triangles of an implicit surface in, world units",
           .in_recipe = true, .shown_default = "the scene's bounds and --margin"}),
      integer({.name = "margin", .metavar = "N", .group = kGridGroup, .commands = kBakes | kBench, .help = "voxels around the scene's bounds",
               .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.margin; }, 0, 64),
      axes({.name = "cyclic", .metavar = "AXES", .group = kGridGroup, .commands = kBakes | kBench, .help = "axes along which the scene repeats; the box is one period, a whole number of voxels, without margin",
            .in_recipe = true, .shown_default = "none"},
           [](auto& s) -> auto& { return s.recipe.cyclic; }),

      // Volume
      want({.name = "want", .metavar = "LIST", .group = kVolume, .commands = kBakes,
            .help = "what the pack shall hold; what is not wanted costs nothing", .in_recipe = true, .shown_default = "renderer,slices"}),
      choice({.name = "fill", .metavar = "WHEN", .group = kVolume, .commands = kBakes | kBench,
              .help = "fill the inside: of closed components; on: an error where none is closed", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.fill; },
             std::vector<std::pair<const char*, Fill>>{{"auto", Fill::kAuto}, {"on", Fill::kOn}, {"off", Fill::kOff}}),
      choice({.name = "ndf", .metavar = "KIND", .group = kVolume, .commands = kBakes, .help = "what stands for the normals of a voxel",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.ndf; },
             std::vector<std::pair<const char*, NdfKind>>{{"sggx", NdfKind::kSggx}, {"neyret", NdfKind::kNeyret}, {"ratib", NdfKind::kRatib}}),
      [] {
        OptionRow row = integer({.name = "lobes", .metavar = "N", .group = kVolume, .commands = kBakes,
                                 .help = "distributions of normals a voxel; 2: also two lobes of SGGX with their shares, where they are nearer to its surface than one: crossing leaves, rods, edges", .in_recipe = true},
                                [](auto& s) -> auto& { return s.recipe.lobes; }, 1, 2);
        row.unsaid = true;
        return row;
      }(),
      choice({.name = "normals", .metavar = "WHICH", .group = kVolume, .commands = kBakes,
              .help = "whose normals count: of all surface, or of what is seen from outside the voxel", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.normals; },
             std::vector<std::pair<const char*, Normals>>{{"all", Normals::kAll}, {"visible", Normals::kVisible}}),
      choice({.name = "material", .metavar = "WHICH", .group = kVolume, .commands = kBakes,
              .help = "whose colour and material count: of all surface, or of what is seen from outside the voxel, for packs seen from afar whose leaves hide branches; slower", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.material; },
             std::vector<std::pair<const char*, MaterialOf>>{{"all", MaterialOf::kAll}, {"visible", MaterialOf::kVisible}}),
      choice({.name = "two-sided", .metavar = "WHEN", .group = kVolume, .commands = kBakes | kBench,
              .help = "surface lit from both sides; auto: materials with cut-outs, and where it is no solid those that say so themselves", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.two_sided; },
             std::vector<std::pair<const char*, Sidedness>>{
                 {"auto", Sidedness::kAuto}, {"always", Sidedness::kAlways}, {"never", Sidedness::kNever}}),
      number({.name = "max-depth", .metavar = "D", .group = kVolume, .commands = kBakes, .help = "cap of a voxel's optical depth; 9.21 is opacity 0.9999",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.max_depth; }, {0, 1000, true}),

      // Hypertexture
      choice({.name = "hypertexture", .metavar = "PRESET", .group = kNoise, .commands = kBakes | kView,
              .help = "bake a density: the input shape's, or a ball's, soft surface modulated by noise; fog: the input's values as they are; octaves: a periodic cube of noise to zoom through", .in_recipe = true,
              .shown_default = "none"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.preset; },
             std::vector<std::pair<const char*, std::string>>{{"eroded", "eroded"}, {"fire", "fire"}, {"fog", "fog"}, {"fur", "fur"}, {"marble", "marble"}, {"octaves", "octaves"}}),
      number({.name = "frequency", .metavar = "F", .group = kNoise, .commands = kBakes | kView, .help = "noise cells, hairs or veins a world unit", .in_recipe = true,
              .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.frequency; }, {0, 1e9, true, true}),
      [] {
        OptionRow row = integer({.name = "octaves", .metavar = "N", .group = kNoise, .commands = kBakes | kView,
                                 .help = "octaves of noise, each of half the size and half the weight of the one before", .in_recipe = true, .shown_default = "the preset's"},
                                [](auto& s) -> auto& { return s.recipe.hypertexture.octaves; }, 1, kMostOctaves);
        row.get = [](const Settings& s) { return s.recipe.hypertexture.octaves > 0 ? std::to_string(s.recipe.hypertexture.octaves) : std::string(); };
        return row;
      }(),
      [] {
        OptionRow row = number({.name = "amount", .metavar = "A", .group = kNoise, .commands = kBakes | kView,
                                .help = "how far noise moves the surface, world units; marble: bends veins, in veins; fur: hair length", .in_recipe = true,
                                .shown_default = "the preset's"},
                               [](auto& s) -> auto& { return s.recipe.hypertexture.amount; }, {0, 1e9});
        row.get = [](const Settings& s) { return s.recipe.hypertexture.amount >= 0 ? number_text(s.recipe.hypertexture.amount) : std::string(); };
        return row;
      }(),
      number({.name = "softness", .metavar = "W", .group = kNoise, .commands = kBakes | kView, .help = "width of the soft region, world units; fur: of a hair's side, in noise",
              .in_recipe = true, .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.softness; }, {0, 1e9, true, true}),
      number({.name = "bias", .metavar = "B", .group = kNoise, .commands = kBakes | kView, .help = "density that the middle of the soft region gets", .in_recipe = true,
              .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.bias; }, {0, 0.999, true, true}),
      number({.name = "gain", .metavar = "G", .group = kNoise, .commands = kBakes | kView, .help = "contrast of the soft region; 0.5 changes nothing", .in_recipe = true,
              .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.gain; }, {0, 0.999, true, true}),
      number({.name = "density-scale", .metavar = "C", .group = kNoise, .commands = kBakes | kView,
              .help = "c of opacity 1-(1-D)^(c*length), per world unit", .in_recipe = true, .shown_default = "the preset's"},
             [](auto& s) -> auto& { return s.recipe.hypertexture.scale; }, {0, 1e12, true, true}),
      integer({.name = "seed", .metavar = "N", .group = kNoise, .commands = kBakes | kView, .help = "another noise of the same kind", .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.hypertexture.seed; }, 0, std::numeric_limits<int>::max()),

      text({.name = "solid-texture", .metavar = "NAME", .group = kNoise, .commands = kBakes | kView,
            .help = "colour by position instead of the materials' own: marble, wood, granite, or a picture for all planes or three for x, y, z, with commas",
            .in_recipe = true, .shown_default = "none"},
           [](auto& s) -> auto& { return s.recipe.solid_texture; }),
      number({.name = "solid-size", .metavar = "S", .group = kNoise, .commands = kBakes | kView, .help = "world units a picture, a vein, ten rings or ten grains take",
              .in_recipe = true, .shown_default = "half the scene's longest side"},
             [](auto& s) -> auto& { return s.recipe.solid_size; }, {0, 1e12, true, true}),
      choice({.name = "solid-blend", .metavar = "HOW", .group = kNoise, .commands = kBakes | kView,
              .help = "pictures on three planes: the plane the surface faces, or the sum of all three", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.solid_blend; },
             std::vector<std::pair<const char*, PlaneBlend>>{{"normal", PlaneBlend::kNormal}, {"sum", PlaneBlend::kSum}}),

      // Slices
      axes({.name = "slices", .metavar = "AXES", .group = kSlices, .commands = kBakes, .help = "axes along which to slice", .in_recipe = true},
           [](auto& s) -> auto& { return s.recipe.slice_axes; }),
      [] {
        OptionRow row = integer({.name = "slice-count", .metavar = "N|auto", .group = kSlices, .commands = kBakes,
                                 .help = "slices per axis; auto: as few as show no gap (--max-angle, --see-in)", .in_recipe = true,
                                 .shown_default = "the voxel count"},
                                [](auto& s) -> auto& { return s.recipe.slice_count; }, 1, kMostVoxels, "auto", -1);
        row.get = [](const Settings& s) -> std::string {
          const int n = s.recipe.slice_count;
          return n == 0 ? "" : n < 0 ? "auto" : std::to_string(n);
        };
        return row;
      }(),
      number({.name = "max-angle", .metavar = "DEG", .group = kSlices, .commands = kBakes,
              .help = "for --slice-count auto: largest angle between sight and axis, degrees", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.max_angle; }, {1, 89}),
      number({.name = "see-in", .metavar = "D", .group = kSlices, .commands = kBakes,
              .help = "for --slice-count auto: share of the width one can look into the object", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.see_in; }, {0, 0.5, true}),
      choice({.name = "slice-format", .metavar = "FORMAT", .group = kSlices, .commands = kBakes,
              .help = "png: 8 bit, sRGB, straight alpha; exr: half, linear, premultiplied", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.write.slice_format; },
             std::vector<std::pair<const char*, SliceFormat>>{{"png", SliceFormat::kPng}, {"exr", SliceFormat::kExr}}),
      integer({.name = "slice-levels", .metavar = "N", .group = kSlices, .commands = kBakes, .help = "coarser stacks beside the full one",
               .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.slice_levels; }, 0, 12),
      light({.name = "light", .metavar = "SPEC", .group = kSlices, .commands = kBakes,
             .help = "light to bake into the slices' colour; may be repeated", .in_recipe = true, .shown_default = "none"}),
      toggle({.name = "shadows", .group = kSlices, .commands = kBakes, .help = "lights cast shadows", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.shadows; }),

      // Levels
      integer({.name = "levels", .metavar = "all|N", .group = kLevels, .commands = kBakes, .help = "octree levels in all; all: down to one voxel",
               .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.levels; }, 1, 13, "all", -1),
      choice({.name = "level-mode", .metavar = "MODE", .group = kLevels, .commands = kBakes,
              .help = "opacity of coarser levels: from the geometry again, or from the finer level; the rest is always filtered",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.level_mode; },
             std::vector<std::pair<const char*, LevelMode>>{{"recompute", LevelMode::kRecompute}, {"filter", LevelMode::kFilter}}),
      number({.name = "prune", .metavar = "TOL", .group = kLevels, .commands = kBakes, .help = "leave out faint voxels, and make blocks of one value one value, where that changes less than this; 0: no",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.prune; }, {0, 0.25}),

      // Accuracy
      integer({.name = "samples", .metavar = "S|auto", .group = kAccuracy, .commands = kBakes,
               .help = "sub-rays per voxel edge and axis: S*S rays through each voxel column; auto: 4, or 6 where textures cut holes or fibres lie. Of a density: S*S*S points a voxel; auto: 2", .in_recipe = true},
              [](auto& s) -> auto& { return s.recipe.samples; }, 1, 64, "auto", 0),
      number({.name = "max-error", .metavar = "E", .group = kAccuracy, .commands = kBakes,
              .help = "instead of --samples: as few rays (of a density: points) as leave alpha with this rms error, more of them where it is uncertain; says what it reached", .in_recipe = true, .shown_default = "none"},
             [](auto& s) -> auto& { return s.recipe.max_error; }, {0, 1, true, true}),
      choice({.name = "pattern", .metavar = "KIND", .group = kAccuracy, .commands = kBakes,
              .help = "places of the sub-rays: rank-1 lattice or square grid", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.pattern; },
             std::vector<std::pair<const char*, Pattern>>{{"lattice", Pattern::kLattice}, {"grid", Pattern::kGrid}}),
      toggle({.name = "full-float", .group = kAccuracy, .commands = kBakes, .help = "store grids as 32-bit floats rather than halves",
              .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.write.full_float; }),
      choice({.name = "codec", .metavar = "CODEC", .group = kAccuracy, .commands = kBakes,
              .help = "how volumes are compressed, without loss: blosc is quicker, zip a tenth to a quarter smaller", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.write.codec; },
             std::vector<std::pair<const char*, VolumeCodec>>{{"blosc", VolumeCodec::kBlosc}, {"zip", VolumeCodec::kZip}}),
      number({.name = "quantize", .metavar = "E", .group = kAccuracy, .commands = kBakes,
              .help = "round the volumes' values to steps that leave them within E, so that --codec zip makes files smaller again, by a sixth at 0.004; 0: no", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.quantize; }, {0, 0.0625}),

      // Compare
      allow({.name = "allow", .metavar = "MEASURE=VALUE", .group = kMeasuring, .commands = kCompare,
             .help = "exit status 7 if a figure of this measure is larger, at any level and axis (of psnr and ssim: smaller); may be repeated", .shown_default = "anything"}),
      integer({.name = "level", .metavar = "N|all", .group = kMeasuring, .commands = kCompare, .help = "this level only"},
              [](auto& s) -> auto& { return s.view.level; }, 0, 12, "all", -1),
      integer({.name = "voxels", .metavar = "N|all", .group = kMeasuring, .commands = kCompare, .help = "voxels of each level held against the geometry"},
              [](auto& s) -> auto& { return s.compare.voxels; }, 1, 65536, "all", std::numeric_limits<int>::max()),
      integer({.name = "columns", .metavar = "N", .group = kMeasuring, .commands = kCompare, .help = "columns of each level and axis, and beams in random directions"},
              [](auto& s) -> auto& { return s.compare.columns; }, 1, 65536),
      integer({.name = "seed", .metavar = "N", .group = kMeasuring, .commands = kCompare | kBench, .help = "another sample of the same size"},
              [](auto& s) -> auto& { return s.compare.seed; }, 0, std::numeric_limits<int>::max()),
      toggle({.name = "truth", .group = kPicture, .commands = kCompare, .help = "pictures of the pack against pictures of its geometry, too"},
             [](auto& s) -> auto& { return s.view.truth; }),
      integer({.name = "views", .metavar = "N", .group = kPicture, .commands = kCompare, .help = "cameras all around"},
              [](auto& s) -> auto& { return s.compare.views; }, 1, 10000),
      integer({.name = "recede", .metavar = "D", .group = kPicture, .commands = kCompare, .help = "times one camera doubles its distance; 0: not at all"},
              [](auto& s) -> auto& { return s.compare.doublings; }, 0, 30),
      picture_size({.name = "size", .metavar = "WxH", .group = kPicture, .commands = kCompare, .help = "pixels of the pictures", .shown_default = "256x256"}),

      // Bench
      integers({.name = "resolution", .letter = 'r', .metavar = "N[,N...]", .group = kMeasuring, .commands = kBench, .help = "voxels along the longest side, one sweep each"}, 1, 1024,
               [](auto& s) -> auto& { return s.bench.resolutions; }),
      integers({.name = "samples", .metavar = "S[,S...]", .group = kMeasuring, .commands = kBench, .help = "sub-rays per voxel edge of the bundles"}, 1, 64,
               [](auto& s) -> auto& { return s.bench.samples; }),
      integers({.name = "rays", .metavar = "N[,N...]", .group = kMeasuring, .commands = kBench, .help = "random rays a voxel and axis of the baseline"}, 1, 1 << 20,
               [](auto& s) -> auto& { return s.bench.rays; }),
      numbers({.name = "errors", .metavar = "E[,E...]", .group = kMeasuring, .commands = kBench, .help = "rms errors of alpha to ask for, as --max-error of a bake"}, {0, 1, true},
              [](auto& s) -> auto& { return s.bench.errors; }),
      integer({.name = "voxels", .metavar = "N", .group = kMeasuring, .commands = kBench, .help = "voxels of each level that errors are measured in"},
              [](auto& s) -> auto& { return s.bench.voxels; }, 1, 65536),
      integer({.name = "repeat", .metavar = "N", .group = kMeasuring, .commands = kBench, .help = "times each run is done; the quickest counts"},
              [](auto& s) -> auto& { return s.bench.repeats; }, 1, 100),
      number({.name = "time-limit", .metavar = "SECONDS", .group = kMeasuring, .commands = kBench, .help = "runs that would take more CPU time, as those before them tell, are left out"},
             [](auto& s) -> auto& { return s.bench.time_limit; }, {0, 1e6, true}),

      // View
      choice({.name = "up", .metavar = "AXIS", .group = kCamera, .commands = kBakes | kView,
              .help = "axis that points up in pictures; auto: y for .obj, .ply and .off, else z", .in_recipe = true},
             [](auto& s) -> auto& { return s.recipe.up; },
             std::vector<std::pair<const char*, int>>{{"auto", -1}, {"x", 0}, {"y", 1}, {"z", 2}}),
      number({.name = "azimuth", .metavar = "DEG", .group = kCamera, .commands = kView, .help = "camera about the up axis; -90: from the front (-Y where Z is up, else +Z, -Z)"},
             [](auto& s) -> auto& { return s.view.azimuth; }, {-360, 360}),
      number({.name = "elevation", .metavar = "DEG", .group = kCamera, .commands = kView, .help = "camera above the horizon"},
             [](auto& s) -> auto& { return s.view.elevation; }, {-90, 90}),
      number({.name = "fov", .metavar = "DEG", .group = kCamera, .commands = kView, .help = "vertical field of view"},
             [](auto& s) -> auto& { return s.view.fov; }, {1, 120}),
      picture_size({.name = "size", .metavar = "WxH", .group = kPicture, .commands = kView, .help = "pixels"}),
      choice({.name = "mode", .metavar = "MODE", .group = kPicture, .commands = kView,
              .help = "reference renderer, slices laid over each other, the true geometry, or one zoom cycle of a cube of octaves", .shown_default = "volume; truth for a mesh"},
             [](auto& s) -> auto& { return s.view.mode; },
             std::vector<std::pair<const char*, std::string>>{{"volume", "volume"}, {"slices", "slices"}, {"truth", "truth"}, {"zoom", "zoom"}}),
      toggle({.name = "truth", .group = kPicture, .commands = kView, .help = "the same as --mode truth; of a pack: its source meshes, or those named after it"},
             [](auto& s) -> auto& { return s.view.truth; }),
      integer({.name = "samples", .metavar = "S", .group = kPicture, .commands = kView, .help = "rays per pixel"},
              [](auto& s) -> auto& { return s.view.samples; }, 1, 1024),
      integer({.name = "level", .metavar = "N|auto", .group = kPicture, .commands = kView, .help = "this level only; auto: as the pixel's size asks"},
              [](auto& s) -> auto& { return s.view.level; }, 0, 12, "auto", -1),
      choice({.name = "axis", .metavar = "AXIS", .group = kPicture, .commands = kView, .help = "slices of this axis; auto: by the camera"},
             [](auto& s) -> auto& { return s.view.axis; },
             std::vector<std::pair<const char*, int>>{{"auto", -1}, {"x", 0}, {"y", 1}, {"z", 2}}),
      light({.name = "light", .metavar = "SPEC", .group = kPicture, .commands = kView | kCompare,
             .help = "light to view with; may be repeated", .shown_default = "a sun over the left shoulder and ambient light"}),
      toggle({.name = "no-shadows", .group = kPicture, .commands = kView | kCompare, .help = "lights cast no shadows"},
             [](auto& s) -> auto& { return s.view.no_shadows; }),
      background({.name = "background", .metavar = "R,G,B", .group = kPicture, .commands = kView, .help = "plain background",
                  .shown_default = "none: the picture has alpha"}),

      // Running
      integer({.name = "threads", .metavar = "N", .group = kRunning, .commands = kBakes | kView | kCompare | kBench,
               .help = "the product has the same bytes for every N"},
              [](auto& s) -> auto& { return s.recipe.threads; }, 1, 1024, "all", 0),
      integer({.name = "jobs", .letter = 'j', .metavar = "N", .group = kRunning, .commands = kBatch,
               .help = "items at once, which share the threads; auto: as many as threads, at most 4"},
              [](auto& s) -> auto& { return s.jobs; }, 1, 256, "auto", 0),
      memory({.name = "memory", .metavar = "SIZE", .group = kRunning, .commands = kBakes, .help = "the bake is cut into slabs to keep within it; mesh, textures and finished grids are not bounded, and the pack is the same", .shown_default = "3G"}),
      choice({.name = "progress", .metavar = "WHEN", .group = kRunning, .commands = kBakes | kView | kCompare | kBench,
              .help = "a bar on stderr; auto: on a terminal, after two seconds"},
             [](auto& s) -> auto& { return s.progress; }, progress),
      toggle({.name = "verbose", .letter = 'v', .group = kRunning, .commands = kBakes | kView, .help = "times and counts of each stage"},
             [](auto& s) -> auto& { return s.verbose; }),
      toggle({.name = "verbose", .letter = 'v', .group = kRunning, .commands = kCompare, .help = "every figure with its interval, unit and norm"},
             [](auto& s) -> auto& { return s.verbose; }),
      toggle({.name = "verbose", .letter = 'v', .group = kFiles, .commands = kInfo, .help = "how each error figure was found, too"},
             [](auto& s) -> auto& { return s.verbose; }),
      toggle({.name = "help", .letter = 'h', .group = kRunning, .commands = kAll, .help = "this text"},
             [](auto& s) -> auto& { return s.help; }),
  };
}

}  // namespace texel
