#pragma once
// File -> Scene. The reader is chosen by the extension, checked against the first bytes.
//
//   extension  points  uv  colour  material  texture  polygons     notes
//   .obj       x       x   x       x (.mtl)  x        any          ASCII; negative indices, continuation lines, CRLF
//   .ply       x       x   x                          any          ASCII and binary, both byte orders
//   .hair      fibres; x colour along them                                 Cem Yuksel's; .xml: curves of Embree scenes; .obj lines are fibres, too
//   .stl       x                                      triangles    ASCII and binary; equal vertices are welded
//   .off       x           x                          any          ASCII and binary; OFF, COFF, NOFF, STOFF
//   .gltf .glb x       x   x       x         x        triangles    glTF 2.0 (docs/inputs.md), also Draco and meshopt
//   .opf .gwa  x               x                      any          plants (docs/inputs.md), centimetres, in the scene metres
//   .ops       places .opf, .gwa and .lig files; .lig with its .dta or .dsp and .smb files: line trees; .smb: one symbol of theirs
//   pictures   a height field (docs/inputs.md): .png .tif .tiff .exr .jpg .jpeg .hdr .bmp .tga .pgm .ppm .pnm .pfm .webp .jp2
//   .json      x       x   x       x         x        triangles    texel-scene: any of these, placed (docs/scenes.md; Scene::instances)
//   .json                          x                               texel-shape: an implicit surface (Scene::implicits), as are the following
//   .vdb                                                           level set or density, through the module texel_vdb
//   .df3 .mhd .mha .inr .inr.gz                                    samples on a grid
#include <optional>
#include <span>
#include <string>

#include "formats/fibre_options.h"
#include "formats/height_field.h"
#include "formats/plant_options.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// The scene of one or several files, joined in the order given.
// Throws Error{kFile} (cannot be read), Error{kBadInput} (malformed, with FILE:LINE and the offending value; no triangle at all),
// Error{kUnsupported} (an extension this build cannot read; names it). Defects that can be lived with (missing .mtl or texture,
// non-finite vertices whose faces are dropped, …) become issues. Cost: OBJ about 200 MB/s and one copy of the geometry.
//
// `options.implicit` is a scene of its own, joined after the files: the solid of an expression, named "--implicit" in messages.
struct ReadOptions {
  std::string implicit;        // formats/expression.h; empty: none
  std::optional<double> iso;   // of all implicit surfaces; default: the input's own
  PlantOptions plants{};       // how plant files are read; a unit given there scales meshes, too
  FibreOptions fibres{};       // what the lines of .obj files are
  std::string texel{};         // which one of scene files; empty: the one there is
  int scene = -1;              // which one of glTF files; below 0: the file's own
  HeightOptions heights;       // how pictures are read; a noise field it asks for is a scene of its own, joined last
};
[[nodiscard]] Scene read_scene(std::span<const std::string> paths, const ReadOptions& options, Report& report);
[[nodiscard]] Scene read_scene(std::span<const std::string> paths, Report& report);
[[nodiscard]] Scene read_scene(const std::string& path, Report& report);

// Whether the file's extension is that of a picture.
[[nodiscard]] bool is_picture(const std::string& path);

}  // namespace texel
