#include "formats/read.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "formats/error.h"
#include "formats/expression.h"
#include "formats/fibres.h"
#include "formats/plant.h"
#include "formats/plant_files.h"
#include "formats/read_scene_file.h"
#include "formats/read_volume.h"
#include "formats/readers.h"
#include "formats/xml.h"

namespace texel {
namespace {

enum class Format { kUnknown, kObj, kPly, kStl, kOff, kGltf, kGlb, kOpf, kGwa, kOps, kLig, kSmb, kShape, kVdb, kDf3, kMhd, kMha, kInr, kInrGz, kHair, kXml };

constexpr const char* kNames[] = {"", ".obj", ".ply", ".stl", ".off", ".gltf", ".glb", ".opf", ".gwa", ".ops", ".lig", ".smb", ".json", ".vdb", ".df3", ".mhd", ".mha", ".inr", ".inr.gz", ".hair", ".xml"};
constexpr const char* kReadable = ".obj, .ply, .stl, .off, .gltf, .glb, .opf, .gwa, .ops, .lig, .smb, .json, .vdb, .df3, .mhd, .mha, .inr, .inr.gz, .hair or .xml (curves), or a picture of heights (.png, .tif, .exr)";

std::string small_extension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return extension;
}

Format by_extension(const std::string& path) {
  const std::string extension = small_extension(path);
  for (int f = 1; f < static_cast<int>(std::size(kNames)); ++f)
    if (extension == kNames[f]) return static_cast<Format>(f);
  if (extension == ".gz" && small_extension(path.substr(0, path.size() - 3)) == ".inr") return Format::kInrGz;
  return Format::kUnknown;
}

std::uint32_t little_word(const char* at) {
  std::uint32_t value = 0;
  for (int i = 3; i >= 0; --i) value = value << 8 | static_cast<unsigned char>(at[i]);
  return value;
}

// What the first bytes say, where they are unambiguous.
Format by_content(std::span<const char> bytes) {
  const std::string_view text(bytes.data(), bytes.size());
  if (text.starts_with("HAIR")) return Format::kHair;
  if (text.starts_with("glTF")) return Format::kGlb;
  if (text.starts_with("ply\n") || text.starts_with("ply\r")) return Format::kPly;
  if (bytes.size() >= 84 && 84 + 50ull * little_word(bytes.data() + 80) == bytes.size()) return Format::kStl;
  if (const std::string_view root = xml_root(text); root == "opf") return Format::kOpf;
  else if (root == "gwa") return Format::kGwa;
  std::string_view head = text.substr(0, 1024);
  while (!head.empty() && (is_blank(head.front()) || is_line_end(head.front()))) head.remove_prefix(1);
  const std::string_view word = head.substr(0, head.find_first_of(" \t\r\n"));
  for (const char* name : {"OFF", "COFF", "NOFF", "CNOFF", "STOFF", "STCOFF", "STNOFF", "STCNOFF"})
    if (word == name) return Format::kOff;
  if (word == "solid" && head.find("facet normal") != std::string_view::npos) return Format::kStl;
  if (head.starts_with('{') && head.find("\"asset\"") != std::string_view::npos) return Format::kGltf;
  for (const char* name : {"mtllib", "usemtl", "vn", "vt", "v"})
    if (word == name) return Format::kObj;
  return Format::kUnknown;
}

Scene read_mhd_scene(const Input& input, std::optional<double> iso, Report& report) {
  std::vector<std::unique_ptr<FileBytes>> open;
  std::vector<std::string> files;
  const auto load = [&](const std::string& name) {
    const std::string found = find_beside(input.path, name);
    if (found.empty()) throw Error(Code::kFile, name, "named by " + input.path + ", is not there", "put it beside the header");
    files.push_back(found);
    return open.emplace_back(std::make_unique<FileBytes>(found))->bytes();
  };
  Scene scene = volume_scene(read_mhd(input, load, report), iso, input.path);
  for (const std::string& file : files) add_source(scene, file);
  return scene;
}

Scene read_line_tree(const Input& input, const PlantOptions& options, Report& report) {
  std::vector<std::string> files;
  Scene scene = plant_scene(open_line_tree(input, files, report), options, report, input.path);
  for (const std::string& file : files) add_source(scene, file);
  return scene;
}

// A symbol by itself has no unit: its length is a factor.
Scene symbol_scene(const Input& input, const PlantOptions& options, Report& report) {
  Plant plant;
  plant.unit = 0;
  plant.meshes.push_back(read_smb(input, report));
  plant.materials.push_back(plain_organ());
  plant.organs.emplace_back();
  return plant_scene(plant, options, report, input.path);
}

// Plant files that hold no surfaces, or not by themselves: what is the matter, and what to do.
struct Refused {
  const char *extension, *message, *hint;
};
constexpr Refused kRefused[] = {
    {".mtg", "holds a plant's topology and measurements, no surfaces", "export the plant as .opf or .obj from the program that draws it"},
    {".bgeom", "is a binary PlantGL scene of parametric shapes, which are not tessellated here", "export it as .obj or .ply from PlantGL"},
    {".geom", "is a PlantGL scene of parametric shapes, which are not tessellated here", "export it as .obj or .ply from PlantGL"},
    {".scn", "is a PlantGL scene of parametric shapes, which are not tessellated here", "export it as .obj or .ply from PlantGL"},
    {".dta", "is the table of a line tree, not a plant", "give the .lig file beside it"},
    {".dsp", "is the table of a line tree, not a plant", "give the .lig file beside it"},
};

// The scenes that are being read within one another, and how many inputs they have had read.
struct Nest {
  std::vector<std::string> open;  // as the file system knows them
  int inputs = 0;
};
constexpr std::size_t kMostNested = 16;
constexpr int kMostInputs = 10000;

Scene read_one(const std::string& path, const ReadOptions& options, Report& report, Nest& nest);

// A texel scene; what it names is read as if it had been given itself.
Scene read_nested(const Input& input, const ReadOptions& options, Report& report, Nest& nest) {
  std::error_code ec;
  const std::filesystem::path real = std::filesystem::weakly_canonical(input.path, ec);
  const std::string name = ec ? input.path : real.string();
  if (std::find(nest.open.begin(), nest.open.end(), name) != nest.open.end())
    throw Error(Code::kBadInput, input.path, "is an input of itself, through " + (nest.open.back() == name ? "its own name" : nest.open.back()), "a scene may not hold itself");
  if (nest.open.size() >= kMostNested) throw Error(Code::kBadInput, input.path, "is nested " + std::to_string(kMostNested) + " scenes deep", "make it flatter");
  nest.open.push_back(name);
  SceneFiles files;
  files.is_file = [](const std::string& file) {
    std::error_code none;
    return std::filesystem::is_regular_file(file, none);
  };
  files.open = [](const std::string& file, const std::function<void(const Input&)>& use) {
    const FileBytes bytes(file);
    use({bytes.bytes(), file});
  };
  files.read = [&](const SceneInput& one) {
    if (++nest.inputs > kMostInputs) throw Error(Code::kUnsupported, one.path, "is one input too many", "scenes may have " + std::to_string(kMostInputs) + " inputs, those of their scenes included");
    ReadOptions own = options;
    own.texel = one.texel;
    const bool is_scene = by_extension(one.path) == Format::kShape && is_scene_file(FileBytes(one.path).bytes());
    if (!one.texel.empty() && !is_scene) throw Error(Code::kBadInput, one.path, "is no scene and has no texels", "leave \"texel\" out");
    if (one.scene >= 0) {
      if (const Format format = by_extension(one.path); format != Format::kGltf && format != Format::kGlb)
        throw Error(Code::kBadInput, one.path, "is no glTF file and has no scenes by number", "leave \"scene\" out");
      own.scene = one.scene;
    }
    if (!is_scene) {
      if (one.unit > 0) own.plants.unit = one.unit;
      return read_one(one.path, own, report, nest);
    }
    Scene part = read_one(one.path, own, report, nest);
    if (one.unit > 0 && part.implicits.empty() && part.heights.empty()) {
      for (V3d& p : part.mesh.points) p *= one.unit;
      for (V3d& p : part.fibres.points) p *= one.unit;
      for (double& r : part.fibres.radii) r *= one.unit;
      for (Instance& instance : part.instances) instance.place = Affine::scale(one.unit) * instance.place;
    }
    return part;
  };
  Scene scene = read_scene_file(input, options.texel, files, report);
  nest.open.pop_back();
  return scene;
}

Scene read_one(const std::string& path, const ReadOptions& options, Report& report, Nest& nest) {
  if (std::error_code ec; is_picture(path) && !std::filesystem::is_directory(path, ec)) return read_height(path, options.heights, report);
  Format format = by_extension(path);
  if (format == Format::kUnknown) {
    const std::string extension = std::filesystem::path(path).extension().string();
    if (std::error_code ec; std::filesystem::is_directory(path, ec)) {
      if (std::filesystem::exists(std::filesystem::path(path) / "manifest.json", ec))
        throw Error(Code::kBadInput, path, "is a pack, not a mesh", "bake it again with --recipe " + path);
      throw Error(Code::kBadInput, path, "is a folder", std::string("give a file: ") + kReadable);
    }
    for (const Refused& kind : kRefused)
      if (small_extension(path) == kind.extension) throw Error(Code::kUnsupported, path, kind.message, kind.hint);
    throw Error(Code::kUnsupported, path, "files of this kind can't be read (" + (extension.empty() ? "no extension" : extension) + ")",
                std::string("give ") + kReadable);
  }
  const auto with_source = [&](Scene scene, std::size_t bytes) {
    scene.sources.insert(scene.sources.begin(), {path, {}, static_cast<std::int64_t>(bytes)});
    return scene;
  };
  if (format == Format::kVdb) {
    const std::size_t bytes = FileBytes(path).bytes().size();  // says so where the file cannot be read at all
    return with_source(volume_scene(read_vdb(path, report), options.iso, path), bytes);
  }
  const FileBytes file(path);
  const Input input{file.bytes(), path};
  const Format content = format > Format::kGwa && format < Format::kHair ? Format::kUnknown : by_content(input.bytes);
  if (content != Format::kUnknown && content != format) {
    report.issue("wrong-extension", std::string("is a ") + kNames[static_cast<int>(content)] + " file by its first bytes, and was read as such", 1, path);
    format = content;
  }
  // Meshes that a scene of plants places.
  const auto read_mesh = [&](const std::string& name) {
    const Format kind = by_extension(name);
    return kind > Format::kUnknown && kind < Format::kOpf ? std::optional(read_one(name, options, report, nest)) : std::nullopt;
  };
  const auto read = [&]() -> Scene {
    switch (format) {
      case Format::kObj: return read_obj(input, options.fibres, report);
      case Format::kHair: return read_hair(input, report);
      case Format::kXml: return read_curves(input, report);
      case Format::kPly: return read_ply(input, report);
      case Format::kStl: return read_stl(input, report);
      case Format::kGltf:
      case Format::kGlb: return read_gltf(input, {.scene = options.scene}, report);
      case Format::kOpf:
      case Format::kGwa: return plant_scene(read_opf(input, report), options.plants, report, path);
      case Format::kOps: return read_ops(input, options.plants, read_mesh, report);
      case Format::kLig: return read_line_tree(input, options.plants, report);
      case Format::kSmb: return symbol_scene(input, options.plants, report);
      case Format::kShape: return is_scene_file(input.bytes) ? read_nested(input, options, report, nest) : read_shape(input, options.iso, report);
      case Format::kDf3: return volume_scene(read_df3(input, report), options.iso, path);
      case Format::kMhd:
      case Format::kMha: return read_mhd_scene(input, options.iso, report);
      case Format::kInr:
      case Format::kInrGz: return volume_scene(read_inr(input, report), options.iso, path);
      default: return read_off(input, report);
    }
  };
  Scene scene = read();
  if (options.plants.unit > 0 && (format <= Format::kGlb || format >= Format::kHair)) {
    for (V3d& p : scene.mesh.points) p *= options.plants.unit;
    for (V3d& p : scene.fibres.points) p *= options.plants.unit;
    for (double& r : scene.fibres.radii) r *= options.plants.unit;
    for (Instance& instance : scene.instances) instance.place = Affine::scale(options.plants.unit) * instance.place;
  }
  return with_source(std::move(scene), input.bytes.size());
}

template <class T>
void append(std::vector<T>& to, std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
  std::vector<T>().swap(from);  // its memory is needed
}

void join_textures(Scene& to, Scene& from) {
  const std::vector<bool> to_raw = raw_textures(to), from_raw = raw_textures(from);
  std::vector<int> number;
  for (std::size_t i = 0; i < from.textures.size(); ++i) {
    std::size_t at = 0;
    const auto same = [&](const Texture& a, const Texture& b) { return a.path == b.path && a.opaque == b.opaque && a.cutoff == b.cutoff && a.bytes == b.bytes; };
    while (at < to_raw.size() && !(same(to.textures[at], from.textures[i]) && to_raw[at] == from_raw[i])) ++at;
    if (at == to_raw.size()) {
      at = to.textures.size();
      to.textures.push_back(from.textures[i]);
    }
    number.push_back(static_cast<int>(at));
  }
  for (Material& m : from.materials)
    for (TextureUse* use : {&m.map_kd, &m.map_d})
      if (use->used()) use->texture = number[static_cast<std::size_t>(use->texture)];
}

}  // namespace

void join_scenes(Scene& to, Scene&& from) {
  for (HeightField& field : from.heights) {
    field.material += static_cast<std::uint32_t>(to.materials.size());
    to.heights.push_back(std::move(field));
  }
  Mesh &a = to.mesh, &b = from.mesh;
  if (a.points.size() + b.points.size() >= kNoIndex || a.uvs.size() + b.uvs.size() >= kNoIndex)
    throw Error(Code::kUnsupported, from.sources.empty() ? "" : from.sources.front().path, "the inputs together have more than 2^32 vertices");
  join_textures(to, from);
  const auto points = static_cast<std::uint32_t>(a.points.size()), uvs = static_cast<std::uint32_t>(a.uvs.size());
  const auto materials = static_cast<std::uint32_t>(to.materials.size());
  for (auto& t : b.triangles)
    for (std::uint32_t& corner : t) corner += points;
  for (auto& t : b.uv_corners)
    for (std::uint32_t& corner : t) corner = corner == kNoIndex ? kNoIndex : corner + uvs;
  for (std::uint32_t& material : b.materials) material += materials;
  // An input without vertex colours multiplies by white, one without texture coordinates has none.
  if (a.colors.empty() != b.colors.empty()) {
    a.colors.resize(a.points.size(), V3f(1, 1, 1));
    b.colors.resize(b.points.size(), V3f(1, 1, 1));
  }
  constexpr std::array<std::uint32_t, 3> kNone = {kNoIndex, kNoIndex, kNoIndex};
  if (a.uv_corners.empty() != b.uv_corners.empty()) {
    a.uv_corners.resize(a.triangles.size(), kNone);
    b.uv_corners.resize(b.triangles.size(), kNone);
  }
  append(a.points, b.points);
  append(a.uvs, b.uvs);
  append(a.colors, b.colors);
  append(a.triangles, b.triangles);
  append(a.uv_corners, b.uv_corners);
  append(a.materials, b.materials);
  join_fibres(to.fibres, std::move(from.fibres), materials);
  const auto shapes = static_cast<std::uint32_t>(to.shapes.size());
  for (Mesh& shape : from.shapes) {
    for (std::uint32_t& material : shape.materials) material += materials;
    to.shapes.push_back(std::move(shape));
  }
  for (const Instance& instance : from.instances) to.instances.push_back({instance.shape + shapes, instance.place});
  for (Implicit& solid : from.implicits) {
    solid.material += materials;
    to.implicits.push_back(std::move(solid));
  }
  append(to.materials, from.materials);
  for (SourceFile& source : from.sources)
    if (std::none_of(to.sources.begin(), to.sources.end(), [&](const SourceFile& s) { return s.path == source.path; }))
      to.sources.push_back(std::move(source));
}

namespace {

void drop_alpha(Image& image) {
  if (!image.has_alpha()) return;
  const int colors = image.channels - 1;
  std::size_t to = 0;
  for (std::size_t i = 0; i < image.pixels.size(); i += static_cast<std::size_t>(image.channels))
    for (int c = 0; c < colors; ++c) image.pixels[to++] = image.pixels[i + static_cast<std::size_t>(c)];
  image.pixels.resize(to);
  image.channels = colors;
}

bool usable(const V3d& p) {
  constexpr double kMost = 1e100;  // beyond it areas and volumes overflow
  return std::abs(p.x) <= kMost && std::abs(p.y) <= kMost && std::abs(p.z) <= kMost;
}

// Drops the triangles with an unusable corner, keeping the order of the others.
std::int64_t drop_triangles(Mesh& mesh) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    if (!usable(mesh.points[t[0]]) || !usable(mesh.points[t[1]]) || !usable(mesh.points[t[2]])) continue;
    mesh.triangles[kept] = t;
    mesh.materials[kept] = mesh.materials[i];
    if (!mesh.uv_corners.empty()) mesh.uv_corners[kept] = mesh.uv_corners[i];
    ++kept;
  }
  const auto dropped = static_cast<std::int64_t>(mesh.triangles.size() - kept);
  mesh.triangles.resize(kept);
  mesh.materials.resize(kept);
  if (!mesh.uv_corners.empty()) mesh.uv_corners.resize(kept);
  return dropped;
}

}  // namespace

void move_mesh(Mesh& mesh, const Affine& place) {
  for (V3d& p : mesh.points) p = place * p;
  if (place.determinant() >= 0) return;
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  for (auto& t : mesh.uv_corners) std::swap(t[1], t[2]);
}

double mesh_reach(const Mesh& mesh) {
  double most = 0;
  for (const V3d& p : mesh.points) most = std::max({most, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  return most;
}

void move_scene(Scene& scene, const Affine& place) {
  move_mesh(scene.mesh, place);
  for (V3d& p : scene.fibres.points) p = place * p;
  const double thicker = std::cbrt(std::abs(place.determinant()));
  for (double& r : scene.fibres.radii) r *= thicker;
  for (Instance& instance : scene.instances) instance.place = place * instance.place;
}

double scene_reach(const Scene& scene) {
  double most = mesh_reach(scene.mesh);
  for (const V3d& p : scene.fibres.points) most = std::max({most, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  std::vector<double> shapes;
  for (const Mesh& shape : scene.shapes) shapes.push_back(mesh_reach(shape));
  for (const Instance& i : scene.instances) most = std::max(most, i.place.reach(shapes[i.shape]));
  return most;
}

std::vector<Instance> take_instances(Scene& scene) {
  std::vector<Instance> parts = std::move(scene.instances);
  scene.instances.clear();
  if (!scene.mesh.triangles.empty()) {
    parts.push_back({static_cast<std::uint32_t>(scene.shapes.size()), Affine()});
    scene.shapes.push_back(std::move(scene.mesh));
  }
  scene.mesh = Mesh();
  return parts;
}

void add_source(Scene& scene, const std::string& path) {
  for (const SourceFile& s : scene.sources)
    if (s.path == path) return;
  std::error_code ec;
  const auto size = std::filesystem::file_size(path, ec);
  scene.sources.push_back({path, {}, ec ? 0 : static_cast<std::int64_t>(size)});
}

std::vector<bool> raw_textures(const Scene& scene) {
  std::vector<bool> raw(scene.textures.size(), false);
  for (const Material& m : scene.materials)
    if (m.map_d.used() && !m.map_d.alpha_channel) raw[static_cast<std::size_t>(m.map_d.texture)] = true;
  return raw;
}

Unusable drop_unusable(Mesh& mesh) {
  Unusable found;
  found.points = std::count_if(mesh.points.begin(), mesh.points.end(), [](const V3d& p) { return !usable(p); });
  if (found.points == 0) return found;
  found.triangles = drop_triangles(mesh);
  const auto good = std::find_if(mesh.points.begin(), mesh.points.end(), usable);
  const V3d stand_in = mesh.triangles.empty() ? (good == mesh.points.end() ? V3d(0, 0, 0) : *good) : mesh.points[mesh.triangles[0][0]];
  for (V3d& p : mesh.points)
    if (!usable(p)) p = stand_in;
  return found;
}

void report_unusable(const Unusable& found, Report& report, const std::string& where) {
  if (found.points > 0)
    report.issue("non-finite", "vertices that are not finite numbers or too large to compute with; " + std::to_string(found.triangles) + " triangles that use them were dropped", found.points, where);
}

void finish_mesh(Scene& scene, Report& report, const std::string& where, const std::string& reason) {
  const bool had_triangles = !scene.mesh.triangles.empty();
  report_unusable(drop_unusable(scene.mesh), report, where);
  if (scene.mesh.triangles.empty() && scene.fibres.strands() == 0 && scene.instances.empty()) {
    if (had_triangles) throw Error(Code::kBadInput, where, "every face has a vertex that is not a finite number", "export the mesh again");
    throw Error(Code::kBadInput, where, reason, "give a file with faces");
  }
  if (scene.materials.empty()) scene.materials.push_back(plain_color("default", Material().kd));
}

bool decode_color(const double* rgb, V3f& linear) {
  linear = V3f(1, 1, 1);
  if (!std::isfinite(rgb[0]) || !std::isfinite(rgb[1]) || !std::isfinite(rgb[2])) return false;
  const auto decode = [](double v) { return srgb_to_linear(static_cast<float>(std::clamp(v, 0.0, 1.0))); };
  linear = V3f(decode(rgb[0]), decode(rgb[1]), decode(rgb[2]));
  return true;
}

Scene implicit_scene(std::shared_ptr<const Field> field, double iso, const std::string& name) {
  Scene scene;
  scene.materials.push_back(plain_color("default", Material().kd));
  Box3d box = field->bounds(iso);
  if (!box.isEmpty()) {
    // Found by halving: what is off a short number by less than any voxel is put on it.
    const V3d size = box.size();
    const double step = std::exp2(std::ceil(std::log2(std::max({size.x, size.y, size.z}))) - 24);
    for (int a = 0; a < 3; ++a) {
      box.min[a] = std::nearbyint(box.min[a] / step) * step;
      box.max[a] = std::nearbyint(box.max[a] / step) * step;
    }
  }
  scene.implicits.push_back({std::move(field), iso, box, 0, name});
  return scene;
}

Material plain_color(std::string name, const V3f& kd) {
  Material m;
  m.name = std::move(name);
  m.kd = kd;
  return m;
}

std::uint32_t FaceColors::material(Scene& scene, const double* rgb) {
  constexpr std::size_t kMost = 4096;
  V3f linear;
  const bool readable = decode_color(rgb, linear);
  if (!readable) ++unreadable_;
  std::uint32_t key = 0xffffff;
  if (readable) {
    key = 0;
    for (int i = 0; i < 3; ++i) key = key << 8 | static_cast<std::uint32_t>(std::lround(std::clamp(rgb[i], 0.0, 1.0) * 255));
  }
  auto at = std::lower_bound(known_.begin(), known_.end(), std::pair(key, 0u));
  if (at != known_.end() && at->first == key) return at->second;
  std::string name = "color_";
  if (known_.size() >= kMost) {
    ++overflow_;
    if (!known_.empty() && known_.back().first == 0x1000000) return known_.back().second;
    key = 0x1000000;
    linear = V3f(0.5f, 0.5f, 0.5f);
    name += "other";
    at = known_.end();
  } else {
    for (int shift = 20; shift >= 0; shift -= 4) name += "0123456789abcdef"[key >> shift & 15];
  }
  const auto index = static_cast<std::uint32_t>(scene.materials.size());
  scene.materials.push_back(plain_color(name, linear));
  known_.insert(at, {key, index});
  return index;
}

void FaceColors::report_to(Report& report, const std::string& path) const {
  if (unreadable_) report.issue("non-finite-color", "face colours that are not numbers: white used", unreadable_, path);
  if (overflow_) report.issue("face-colors-many", "faces past the first 4096 different face colours are grey", overflow_, path);
}

bool is_picture(const std::string& path) {
  const std::string extension = small_extension(path);
  for (const char* known : {".png", ".tif", ".tiff", ".exr", ".jpg", ".jpeg", ".hdr", ".bmp", ".tga", ".pgm", ".ppm", ".pnm", ".pfm", ".webp", ".jp2"})
    if (extension == known) return true;
  return false;
}

Scene read_scene(std::span<const std::string> paths, const ReadOptions& options, Report& report) {
  if (paths.empty() && options.implicit.empty() && options.heights.perlin.period == 0) throw Error(Code::kCommandLine, "", "no input given");
  std::optional<Scene> all;
  const auto take = [&](Scene&& scene) {
    if (all) join_scenes(*all, std::move(scene));
    else all = std::move(scene);
  };
  for (const std::string& path : paths) {
    Nest nest;
    Scene read = read_one(path, options, report, nest);
    if (!read.sources.empty()) read.sources.front().input = true;
    take(std::move(read));
  }
  if (!options.implicit.empty()) take(implicit_scene(read_expression(options.implicit), options.iso.value_or(0), "--implicit"));
  if (options.heights.perlin.period > 0) take(make_perlin_field(options.heights));
  Scene& scene = *all;
  if (!scene.instances.empty()) report.count("instances", static_cast<double>(scene.instances.size()));
  std::vector<Texture> files = scene.textures;
  scene.load_texture = [files = std::move(files), raw = raw_textures(scene)](int texture) {
    const auto i = static_cast<std::size_t>(texture);
    const Texture& file = files.at(i);
    Image image = file.bytes ? read_image(*file.bytes, file.name, raw.at(i)) : read_image(file.path, raw.at(i));
    if (file.opaque) drop_alpha(image);
    if (file.cutoff >= 0) threshold_alpha(image, file.cutoff);
    return image;
  };
  return std::move(scene);
}

Scene read_scene(std::span<const std::string> paths, Report& report) { return read_scene(paths, ReadOptions{}, report); }

Scene read_scene(const std::string& path, Report& report) { return read_scene(std::span(&path, 1), report); }

}  // namespace texel
