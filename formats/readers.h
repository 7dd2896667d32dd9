#pragma once
// The readers behind read_scene, one per format, and what they share. Each returns one input's own Scene: its mesh, at least one
// material, textures, and the further files it referred to in `sources` (the input itself is added by the caller).
// All of them throw Error{kBadInput} and report issues as read.h says; bytes of any kind are safe.
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/fibre_options.h"
#include "formats/report.h"
#include "formats/scene.h"
#include "formats/text_scanner.h"
#include "formats/tiff_tags.h"

namespace texel {

[[nodiscard]] Scene read_obj(const Input& input, const FibreOptions& lines, Report& report);
[[nodiscard]] Scene read_ply(const Input& input, Report& report);
[[nodiscard]] Scene read_stl(const Input& input, Report& report);
[[nodiscard]] Scene read_off(const Input& input, Report& report);

struct GltfOptions {
  int scene = -1;                                       // which of the file's scenes; below 0: its own choice, else its first
  std::int64_t most_triangles = std::int64_t{1} << 27;  // of the mesh, copies included
  std::int64_t most_instances = std::int64_t{1} << 24;
  // Up to so many times a mesh is copied: what is shown a few times may be a part that its copies complete (half a car, mirrored; a quarter of a vase),
  // which only copies can make one solid. Beyond it is a plant or a stone, and copies would cost memory for nothing.
  std::int64_t most_copies = 16;
};

// A glTF 2.0 file, JSON or binary; the scene is in its metres, y up. A mesh that is shown more often than `most_copies`, or whose copies would have more than
// 2^22 triangles, becomes a shape with instances; others are copied for each node, so that halves that meet stay one solid.
// Throws Error{kUnsupported} where there is more than `options` allows, before any is made, and for extensions that are required and not known;
// Error{kFile} where a file it needs is not there.
[[nodiscard]] Scene read_gltf(const Input& input, const GltfOptions& options, Report& report);

// Fibres alone: Cem Yuksel's HAIR files, and the curves of an Embree XML scene, cut into pieces off by at most 1/16384 of the diagonal of their
// control points.
[[nodiscard]] Scene read_hair(const Input& input, Report& report);
[[nodiscard]] Scene read_curves(const Input& input, Report& report);

// A picture as a height field, and the cyclic noise that options.perlin asks for. Beyond what read.h says they throw
// Error{kCommandLine} where options.base is above the lowest height.
[[nodiscard]] Scene read_height(const std::string& path, const HeightOptions& options, Report& report);
[[nodiscard]] Scene make_perlin_field(const HeightOptions& options);
// The field that stored samples mean; no material. What has no data: samples that are NaN, options.no_data or tags.no_data.
[[nodiscard]] HeightField make_height_field(Samples samples, const HeightOptions& options, const TiffTags& tags, const std::string& path, Report& report);

// A texel-shape file (docs/inputs.md): blobs, primitives and their combinations as one implicit surface. `iso` beats the file's own.
// Keys it does not know are refused, with their path in the file.
[[nodiscard]] Scene read_shape(const Input& input, std::optional<double> iso, Report& report);

// A map line of an .mtl file: the name as written and the options that matter here.
struct MtlMap {
  std::string name;              // empty: no such line
  TextureUse use;                // its texture is set by add_mtl_material
  bool channel_chosen = false;   // -imfchan given
  std::string where;             // FILE:LINE
};

struct MtlMaterial {
  Material material;
  MtlMap map_kd, map_d;
  bool kd_left_out = false;      // no Kd line: the picture alone gives the colour, where it is found
  std::string where;             // FILE:LINE of newmtl
  std::string path;              // of the .mtl file
};

// The materials of an .mtl file in its order. `Ka`, `Ni`, `illum`, bump maps and unknown words are skipped.
// Colours are linear; they and d are limited to [0,1] (Ke: >= 0). Unreadable values keep their defaults and become issues.
[[nodiscard]] std::vector<MtlMaterial> read_mtl(const Input& input, Report& report);

// Appends the material with its textures found and entered; returns its index. A picture that is not there is an issue
// `texture-missing` and the material's colour is used. A mask read by luminance gets a texture entry of its own, decoded raw.
std::uint32_t add_mtl_material(const MtlMaterial& mtl, Scene& scene, Report& report);

// The file `name` (as an OBJ or MTL file writes it: backslashes allowed) means, seen from the file `from`: as written, then the
// last part of the name beside `from`, then the same with letters' case ignored. Empty: none of them is a file.
[[nodiscard]] std::string find_beside(const std::string& from, const std::string& name);

// Enters `path` into scene.sources once.
void add_source(Scene& scene, const std::string& path);

// Which textures are masks read by luminance, and so decoded raw.
[[nodiscard]] std::vector<bool> raw_textures(const Scene& scene);

// Drops triangles with a non-finite or absurdly large corner and puts such points onto a finite one. How many points, how many triangles.
struct Unusable {
  std::int64_t points = 0, triangles = 0;
};
Unusable drop_unusable(Mesh& mesh);
void report_unusable(const Unusable& found, Report& report, const std::string& where);  // issue `non-finite`, if any

// Last step of each reader: drop_unusable, gives the scene a default material, and throws Error{kBadInput} when neither triangle nor fibre nor instance
// is left, with `reason` at `where`.
void finish_mesh(Scene& scene, Report& report, const std::string& where, const std::string& reason);

// Linear colour from three stored sRGB values in [0,1]; values that are not numbers give white and false.
[[nodiscard]] bool decode_color(const double* rgb, V3f& linear);

// Appends the other scene: its indices moved on, textures and sources that are there already shared. Throws Error{kUnsupported} for more than 2^32
// vertices of the two meshes.
void join_scenes(Scene& to, Scene&& from);

// Moves the mesh. Where the map mirrors, corners are turned round, so that outside stays outside.
void move_mesh(Mesh& mesh, const Affine& place);

// Moves mesh, fibres and instances. Fibres stay round: their radii grow by the cube root of what volumes grow by.
void move_scene(Scene& scene, const Affine& place);

// The largest coordinate of the mesh's points; 0 where there is none.
[[nodiscard]] double mesh_reach(const Mesh& mesh);
// No coordinate of mesh, fibres and instances is larger.
[[nodiscard]] double scene_reach(const Scene& scene);

// Makes the scene's mesh, if it has triangles, a shape; what stands in the scene are its instances then, which are taken out and handed over.
[[nodiscard]] std::vector<Instance> take_instances(Scene& scene);

// A scene of one solid, field >= iso, of the default material, in the field's own bounds.
[[nodiscard]] Scene implicit_scene(std::shared_ptr<const Field> field, double iso, const std::string& name);

// A material of this name and diffuse colour, else as materials are by default.
[[nodiscard]] Material plain_color(std::string name, const V3f& kd);

// Materials from colours per face: one per different colour, while there are few enough of them.
class FaceColors {
 public:
  // The material of the next face, entered into scene.materials when new; past 4096 colours the last ones share a grey one.
  [[nodiscard]] std::uint32_t material(Scene& scene, const double* rgb);
  // Reports what happened, if anything.
  void report_to(Report& report, const std::string& path) const;

 private:
  std::vector<std::pair<std::uint32_t, std::uint32_t>> known_;  // packed 8-bit colour, material; sorted by colour
  std::int64_t overflow_ = 0, unreadable_ = 0;
};

}  // namespace texel
