#pragma once
// The first contract: what a reader hands to the baker. Plain data in world space, as the file has it.
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/affine.h"
#include "formats/field.h"
#include "formats/grid.h"
#include "formats/height_field.h"
#include "formats/hypertexture.h"
#include "formats/image.h"
#include "formats/solid_texture.h"

namespace texel {

inline constexpr std::uint32_t kNoIndex = std::numeric_limits<std::uint32_t>::max();

// What lies beyond a picture's border, along u or v.
enum class Wrap { kRepeat, kClamp, kMirror };

// A texture used by a material: which picture, and how it lies: MTL's -s, -o, -clamp, glTF's samplers. uv' = uv·scale + offset; v = 0 is the bottom row.
struct TextureUse {
  int texture = -1;            // into Scene::textures; −1: none
  V2f scale{1, 1}, offset{0, 0};
  std::array<Wrap, 2> wrap{};  // along u and v
  bool alpha_channel = false;  // map_d only: read the mask from the alpha channel rather than the luminance
  [[nodiscard]] bool used() const { return texture >= 0; }
};

// Colours are linear light. Coverage (a hole cut in a leaf card) and transparency (glass) are different things:
// cut-outs come from map_kd's alpha channel and map_d; `opacity` is MTL's d, the same all over the material.
struct Material {
  std::string name;
  V3f kd{0.5f, 0.5f, 0.5f};    // diffuse albedo; multiplies map_kd
  V3f ks{0, 0, 0};             // specular
  V3f ke{0, 0, 0};             // emission
  float roughness = 1;         // GGX α² root: α = sqrt(2/(Ns+2)); 1 where there is no specular
  float opacity = 1;           // d, or 1 − Tr
  bool two_sided = false;      // lit from both sides where it is not the surface of a solid
  TextureUse map_kd, map_d;
  std::shared_ptr<const SolidTexture> solid;  // colour by position: instead of kd; null: none
};

struct Texture {
  std::string path;            // resolved, readable; readers report a missing file and leave the use out instead
  std::string name;            // as the input names it, for messages
  bool opaque = false;         // its alpha is left out
  float cutoff = -1;           // >= 0: alpha counts as 1 from this value on, as 0 below
  std::shared_ptr<const std::string> bytes = nullptr;  // the picture's file, where it is part of another (`path`); null: at `path`
};

// Triangle soup with shared vertices. Polygons are already triangulated: convex ones as a fan from their first corner,
// concave ones by ear clipping in their mean plane. Degenerate triangles are kept (they have no area and change nothing).
// All indices are valid and all coordinates finite: readers check both.
struct Mesh {
  std::vector<V3d> points;                              // world
  std::vector<V2f> uvs;                                 // may be empty
  std::vector<V3f> colors;                              // linear, per point; empty or points.size()
  std::vector<std::array<std::uint32_t, 3>> triangles;  // into points, counter-clockwise seen from outside
  std::vector<std::array<std::uint32_t, 3>> uv_corners; // into uvs; empty, or per triangle (kNoIndex where a corner has none)
  std::vector<std::uint32_t> materials;                 // into Scene::materials, per triangle

  // Set by polygonize only: the last `made` triangles stand for implicit surfaces: closed, turned outwards, each in one cell of the grid
  // they were made for. `normals`, of surfaces given by functions: their own at each point, unit; 0 where there is none. Empty, or points.size().
  std::size_t made = 0;
  std::vector<V3f> normals;
};

// Hair, wires, grass blades as lines with a thickness: each strand is a chain of frusta of cones from point to point, closed by a flat disc at
// either end. Strand s has the points first[s] … first[s + 1] − 1, at least two, no two neighbours equal. All coordinates and radii are finite,
// radii >= 0 and not all 0 in a strand: readers check (formats/fibres.h).
struct Fibres {
  std::vector<V3d> points;               // world
  std::vector<double> radii;             // world, per point
  std::vector<V3f> colors;               // linear, per point, multiply the material's kd; empty or points.size()
  std::vector<std::size_t> first{0};     // strands and one more
  std::vector<std::uint32_t> materials;  // into Scene::materials, per strand
  [[nodiscard]] std::size_t strands() const { return first.size() - 1; }
};

// A mesh of Scene::shapes as it stands in the scene once.
struct Instance {
  std::uint32_t shape = 0;     // into Scene::shapes
  Affine place;                // the shape's space -> world; finite. What it mirrors is turned so that outside stays outside
};

// A solid where field >= iso.
struct Implicit {
  std::shared_ptr<const Field> field;
  double iso = 0;
  Box3d box;                   // world, what is known of the solid's extent; empty: unknown, the recipe has to give a box
  std::uint32_t material = 0;  // into Scene::materials
  std::string name;            // for messages: file or option
};

struct SourceFile {
  std::string path;            // as opened
  std::string sha256;          // hex, of the bytes; filled by write_pack / up-to-date test
  std::int64_t bytes = 0;
  bool input = false;          // named by the user, rather than by another file
};

struct Scene {
  Mesh mesh;                            // all inputs joined
  Fibres fibres;                        // likewise; the bake makes triangles of those that are thick against a voxel (bake/fibre_tubes.h)
  std::vector<Mesh> shapes;             // meshes that are placed by instances, each in its own space; `made` is 0
  std::vector<Instance> instances;      // placements, in order; formats/instances.h makes triangles of them
  std::vector<Implicit> implicits;      // solids given by functions; bake/polygonize.h makes triangles of them
  std::vector<HeightField> heights;     // become part of the mesh once the grid is known (bake/height_mesh.h)
  Box3d bounds;                         // what the grid holds besides the mesh's own bounds; may be empty
  std::vector<Material> materials;      // at least one
  std::optional<Hypertexture> hypertexture;  // a density instead of the mesh, which is empty then; materials[0].solid colours it
  std::vector<Texture> textures;
  std::vector<SourceFile> sources;      // every file read or referred to: meshes, .mtl, textures (for hashes and --depfile)

  // Decodes textures[i]; called late, at most once per texture the bake needs. Throws as read_image. Set by read_scene.
  std::function<Image(int texture)> load_texture;
};

}  // namespace texel
