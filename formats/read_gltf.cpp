// glTF 2.0 specification (Khronos, 2.0.1), section 3.5 and 3.7; EXT_mesh_gpu_instancing, KHR_draco_mesh_compression, KHR_node_visibility.
// Each mesh is read once, in its own space; nodes and instances are transforms of it. What is shown often stays one shape.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "formats/affine.h"
#include "formats/error.h"
#include "formats/gltf_compression.h"
#include "formats/gltf_file.h"
#include "formats/gltf_material.h"
#include "formats/instances.h"
#include "formats/readers.h"

namespace texel {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr std::int64_t kMostCopied = std::int64_t{1} << 22;  // triangles of a mesh's copies: 0.4 GB while they are baked
constexpr double kFarthest = 1e100;                          // as drop_unusable

// A primitive, in its mesh's space. No vertex is unused.
struct Part {
  std::vector<V3d> points;
  std::vector<V3f> colors;              // empty or points.size()
  std::vector<V2f> uvs;                 // empty or points.size(); the scene's, v = 0 at the bottom
  std::vector<Triangle> triangles;
  std::uint32_t material = 0;
  std::uint32_t first_uv = kNoIndex;    // in the scene, once they are there
};

struct ReadMesh {
  bool read = false;
  std::int64_t triangles = -1;          // as the file states, before it is read
  std::int64_t places = 0;              // nodes that show it, times their instances
  std::size_t uses = 0;                 // nodes to come
  std::vector<Part> parts;
  bool shared = false;                  // becomes a shape
  std::uint32_t shape = kNoIndex;       // into Scene::shapes; none: it has no triangle
  double reach = 0;                     // of the shape
};

// A node that shows a mesh.
struct Placed {
  std::size_t mesh;
  Affine matrix;                        // world
  std::optional<GltfValue> instancing;  // EXT_mesh_gpu_instancing
};

Affine from_matrix(const double* m) {  // column-major, the last row taken as 0 0 0 1
  return {{m[0], m[4], m[8], m[12], m[1], m[5], m[9], m[13], m[2], m[6], m[10], m[14]}};
}

// Translation · rotation · scale; the quaternion (x, y, z, w) need not be unit. False where it has no length.
bool from_trs(const double* t, const double* q, const double* s, Affine& to) {
  const double length = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(length > 1e-30)) return false;
  const double k = 2 / length, x = q[0], y = q[1], z = q[2], w = q[3];
  to.m = {(1 - k * (y * y + z * z)) * s[0], k * (x * y - z * w) * s[1], k * (x * z + y * w) * s[2], t[0],
          k * (x * y + z * w) * s[0], (1 - k * (x * x + z * z)) * s[1], k * (y * z - x * w) * s[2], t[1],
          k * (x * z - y * w) * s[0], k * (y * z + x * w) * s[1], (1 - k * (x * x + y * y)) * s[2], t[2]};
  return true;
}

// Renumbers the corners so that no vertex is unused. Returns the vertices' old numbers, ascending. Time and memory go with the
// triangles, not with the vertices: thousands of primitives may share one accessor.
std::vector<std::uint32_t> drop_unused(std::vector<Triangle>& triangles, std::size_t vertices) {
  std::vector<std::uint32_t> kept;
  if (vertices / 16 <= triangles.size() + 64) {
    std::vector<std::uint32_t> number(vertices, kNoIndex);
    for (const Triangle& t : triangles)
      for (const std::uint32_t corner : t) number[corner] = 0;
    for (std::uint32_t i = 0; i < vertices; ++i) {
      if (number[i] == kNoIndex) continue;
      number[i] = static_cast<std::uint32_t>(kept.size());
      kept.push_back(i);
    }
    for (Triangle& t : triangles)
      for (std::uint32_t& corner : t) corner = number[corner];
    return kept;
  }
  for (const Triangle& t : triangles) kept.insert(kept.end(), t.begin(), t.end());
  std::sort(kept.begin(), kept.end());
  kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
  for (Triangle& t : triangles)
    for (std::uint32_t& corner : t) corner = static_cast<std::uint32_t>(std::lower_bound(kept.begin(), kept.end(), corner) - kept.begin());
  return kept;
}

class GltfReader {
 public:
  GltfReader(const Input& input, const GltfOptions& options, Report& report)
      : file_(input, report), report_(report), options_(options), materials_(file_, scene_, report), meshes_(file_.count("meshes")) {}

  Scene read() {
    find_nodes();
    bound_triangles();
    for (const Placed& node : placed_) read_mesh(node.mesh);
    reserve();
    for (const Placed& node : placed_) {
      ReadMesh& mesh = meshes_[node.mesh];
      for_each_instance(node, [&](const Affine& matrix) {
        if (!mesh.shared) copy(mesh, matrix, has_colors_, has_uvs_, scene_.mesh);
        else if (mesh.shape != kNoIndex) instance(mesh, matrix);
      });
      if (--mesh.uses == 0) mesh.parts = {};
    }
    for (const Instance& flat : flat_) place_shape(scene_.shapes[flat.shape], flat.place, scene_.mesh);
    tell();
    for (const std::string& name : file_.files) add_source(scene_, name);
    if (scene_.mesh.triangles.empty() && scene_.instances.empty() && unusable_.triangles > 0)
      throw Error(Code::kBadInput, file_.path(), scene_.shapes.empty() ? "every face has a vertex that is not a finite number" : "every instance stands where coordinates are no finite numbers or beyond 1e100", "export the mesh again");
    if (placed_.empty() && file_.count("scenes") > 1)
      throw Error(Code::kBadInput, file_.path(), "shows nothing: no node of this scene has a mesh", "choose by --scene among " + scene_names());
    finish_mesh(scene_, report_, file_.path(), "shows no triangle: no node of its scene has a mesh of triangles");
    return std::move(scene_);
  }

 private:
  // --- nodes ---

  std::vector<std::size_t> roots() {
    const GltfValue root = file_.root();
    const std::size_t scenes = file_.count("scenes"), nodes = file_.count("nodes");
    std::vector<std::size_t> result;
    if (scenes > 0) {
      const auto asked = static_cast<std::size_t>(std::max(options_.scene, 0));
      if (asked >= scenes) throw Error(Code::kBadInput, file_.path(), "has no scene " + std::to_string(asked), "it has " + scene_names());
      const std::size_t chosen = options_.scene >= 0 ? asked : file_.reference(root, "scene", "scenes").value_or(0);
      const GltfValue scene = file_.item("scenes", chosen);
      if (scenes > 1 && options_.scene < 0)
        report_.issue("gltf-scenes", "only scene " + std::to_string(chosen) + " is read, of " + scene_names() + " (--scene N chooses)", static_cast<std::int64_t>(scenes) - 1, file_.path());
      if (scene.has("nodes")) add_nodes(scene["nodes"], result);
      return result;
    }
    // A library of parts: all that is in it.
    if (options_.scene >= 0) throw Error(Code::kBadInput, file_.path(), "has no scene " + std::to_string(options_.scene) + ": its nodes are in none", "leave --scene out");
    std::vector<bool> is_child(nodes, false);
    for (std::size_t i = 0; i < nodes; ++i) {
      const GltfValue node = file_.item("nodes", i);
      std::vector<std::size_t> children;
      if (node.has("children")) add_nodes(node["children"], children);
      for (const std::size_t c : children) is_child[c] = true;
    }
    for (std::size_t i = 0; i < nodes; ++i)
      if (!is_child[i]) result.push_back(i);
    return result;
  }

  // 0 "a", 1 "b", ...
  std::string scene_names() const {
    std::string names;
    for (std::size_t i = 0, n = file_.count("scenes"); i < n; ++i) {
      if (names.size() > 200) return names + ", ... " + std::to_string(n - 1);
      const GltfValue scene = file_.item("scenes", i);
      if (i > 0) names += ", ";
      names += std::to_string(i);
      if (scene.has("name")) names.append(" ").append(shown_as(scene["name"].text()));
    }
    return names;
  }

  void add_nodes(const GltfValue& list, std::vector<std::size_t>& to) const {
    const std::size_t nodes = file_.count("nodes");
    for (std::size_t k = 0, n = list.size(); k < n; ++k) {
      const GltfValue value = list[k];
      const std::uint64_t i = value.whole();
      if (i >= nodes) value.fail("is " + std::to_string(i) + " where the file has " + std::to_string(nodes) + " nodes");
      to.push_back(i);
    }
  }

  // Depth first, in the file's order, without recursion. A node that is met twice has two parents or is its own ancestor.
  void find_nodes() {
    struct Waiting {
      std::size_t node;
      Affine parent;
    };
    std::vector<Waiting> stack;
    std::vector<bool> met(file_.count("nodes"), false);
    const std::vector<std::size_t> first = roots();
    for (auto at = first.rbegin(); at != first.rend(); ++at) stack.push_back({*at, {}});
    std::vector<std::size_t> children;
    while (!stack.empty()) {
      const Waiting now = stack.back();
      stack.pop_back();
      const GltfValue node = file_.item("nodes", now.node);
      if (met[now.node]) node.fail("is met twice: it has two parents or is its own ancestor", "export the file again");
      met[now.node] = true;
      if (const auto seen = node.extension("KHR_node_visibility"); seen && !seen->boolean_or("visible", true)) {
        report_.skip(file_.path() + ": " + node.path(), "not visible");
        continue;
      }
      const Affine matrix = now.parent * local_matrix(node);
      if (const auto mesh = file_.reference(node, "mesh", "meshes")) {
        if (node.has("skin")) ++posed_;
        placed_.push_back({*mesh, matrix, node.extension("EXT_mesh_gpu_instancing")});
        ++meshes_[*mesh].uses;
      }
      children.clear();
      if (node.has("children")) add_nodes(node["children"], children);
      for (auto at = children.rbegin(); at != children.rend(); ++at) stack.push_back({*at, matrix});
    }
  }

  static Affine local_matrix(const GltfValue& node) {
    double m[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
    if (node.has("matrix")) {
      node.numbers("matrix", 16, m);
      return from_matrix(m);
    }
    node.numbers("translation", 3, t);
    node.numbers("rotation", 4, q);
    node.numbers("scale", 3, s);
    Affine result;
    if (!from_trs(t, q, s, result)) node["rotation"].fail("is a quaternion of length 0");
    return result;
  }

  // --- instances ---

  std::optional<std::size_t> instance_accessor(const Placed& node, const char* key) const {
    return file_.reference((*node.instancing)["attributes"], key, "accessors");
  }

  std::int64_t instances(const Placed& node) const {
    if (!node.instancing) return 1;
    std::optional<std::size_t> count;
    for (const char* key : {"TRANSLATION", "ROTATION", "SCALE"})
      if (const auto accessor = instance_accessor(node, key)) {
        const std::size_t n = file_.accessor_count(*accessor);
        if (count && n != *count) node.instancing->fail("its accessors have " + std::to_string(*count) + " and " + std::to_string(n) + " elements");
        count = n;
      }
    return static_cast<std::int64_t>(count.value_or(1));
  }

  // The one place that says where copies of a mesh lie: calls place(matrix) for each, in the file's order.
  template <class Place>
  void for_each_instance(const Placed& node, Place place) {
    if (!node.instancing) return place(node.matrix);
    std::optional<GltfAccessor> moved, turned, scaled;
    if (const auto i = instance_accessor(node, "TRANSLATION")) moved = file_.accessor(*i, {3});
    if (const auto i = instance_accessor(node, "ROTATION")) turned = file_.accessor(*i, {4});
    if (const auto i = instance_accessor(node, "SCALE")) scaled = file_.accessor(*i, {3});
    const auto count = static_cast<std::size_t>(instances(node));
    for (std::size_t i = 0; i < count; ++i) {
      double t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
      if (moved) moved->read(i, t);
      if (turned) turned->read(i, q);
      if (scaled) scaled->read(i, s);
      Affine matrix;
      if (!from_trs(t, q, s, matrix)) node.instancing->fail("the rotation of instance " + std::to_string(i) + " is a quaternion of length 0 or no number");
      place(node.matrix * matrix);
    }
  }

  // How much there will be, by the file's own counts: nothing is allocated before. Says which meshes become shapes.
  void bound_triangles() {
    for (const Placed& node : placed_) {
      ReadMesh& mesh = meshes_[node.mesh];
      if (mesh.triangles < 0) mesh.triangles = stated_triangles(node.mesh);
      const std::int64_t places = instances(node);  // below 2^32
      if (places > options_.most_instances - placements_)
        throw Error(Code::kUnsupported, file_.path(), "its meshes have more than " + std::to_string(options_.most_instances) + " instances together", "bake parts of it by themselves");
      placements_ += places;
      mesh.places += places;
    }
    for (ReadMesh& mesh : meshes_) {
      if (mesh.places == 0) continue;
      // A copy of a mesh without triangles takes time, too. Factors may be 2^53 and 2^24: divided, not multiplied.
      const std::int64_t each = std::max<std::int64_t>(mesh.triangles, 1);
      mesh.shared = mesh.places > options_.most_copies || (mesh.places > 1 && mesh.places > kMostCopied / each);
      add_triangles(mesh.shared ? 1 : mesh.places, each);
    }
  }

  void add_triangles(std::int64_t times, std::int64_t each) {
    if (times > (options_.most_triangles - triangles_) / each)
      throw Error(Code::kUnsupported, file_.path(), "its meshes and their copies have more than " + std::to_string(options_.most_triangles) + " triangles together", "bake parts of it by themselves");
    triangles_ += times * each;
  }

  std::int64_t stated_triangles(std::size_t mesh) const {
    const GltfValue primitives = file_.item("meshes", mesh)["primitives"];
    std::int64_t total = 0;
    for (std::size_t i = 0, n = primitives.size(); i < n; ++i) {
      const GltfValue p = primitives[i];
      const std::uint64_t mode = p.whole_or("mode", 4);
      if (mode > 6) p["mode"].fail("is " + p["mode"].shown() + ", not 0 to 6");
      const auto position = file_.reference(p["attributes"], "POSITION", "accessors");
      if (mode < 4 || !position) continue;
      const auto indices = file_.reference(p, "indices", "accessors");
      const auto corners = static_cast<std::int64_t>(file_.accessor_count(indices ? *indices : *position));
      total += mode == 4 ? corners / 3 : std::max<std::int64_t>(corners - 2, 0);
    }
    return total;
  }

  // --- meshes ---

  void read_mesh(std::size_t index) {
    ReadMesh& mesh = meshes_[index];
    if (mesh.read) return;
    mesh.read = true;
    const GltfValue primitives = file_.item("meshes", index)["primitives"];
    for (std::size_t i = 0, n = primitives.size(); i < n; ++i) {
      Part part;
      if (read_primitive(primitives[i], part)) mesh.parts.push_back(std::move(part));
    }
    if (mesh.shared) make_shape(mesh);
  }

  void make_shape(ReadMesh& read) {
    Mesh shape;
    bool colors = false, uvs = false;
    for (const Part& part : read.parts) {
      colors = colors || !part.colors.empty();
      uvs = uvs || !part.uvs.empty();
    }
    copy(read, {}, colors, uvs, shape);
    read.parts = {};
    const Unusable found = drop_unusable(shape);
    unusable_.points += found.points;
    unusable_.triangles += found.triangles;
    if (shape.triangles.empty()) return;
    read.reach = mesh_reach(shape);
    read.shape = static_cast<std::uint32_t>(scene_.shapes.size());
    scene_.shapes.push_back(std::move(shape));
  }

  bool read_primitive(const GltfValue& p, Part& part) {
    const std::uint64_t mode = p.whole_or("mode", 4);
    if (mode < 4) {
      lines_.add(p);
      return false;
    }
    const GltfValue attributes = p["attributes"];
    if (!attributes.has("POSITION")) {
      no_positions_.add(p);
      return false;
    }
    const GltfMaterial material = materials_.of(p);
    if (!material.drawn) return false;
    if (p.has("targets")) ++posed_;
    std::optional<DracoMesh> draco;
    if (const auto extension = p.extension("KHR_draco_mesh_compression")) draco = decompress(p, *extension);
    const GltfAccessor points = attribute(p, draco, "POSITION", {3});
    if (draco) part.triangles = std::move(draco->triangles);
    else read_triangles(p, mode, points.count, part.triangles);
    if (part.triangles.empty()) return false;
    part.material = material.material;
    const std::vector<std::uint32_t> kept = drop_unused(part.triangles, points.count);
    part.points.resize(kept.size());
    for (std::size_t i = 0; i < kept.size(); ++i) {
      double v[3];
      points.read(kept[i], v);
      part.points[i] = {v[0], v[1], v[2]};
    }
    if (attributes.has("COLOR_0")) read_colors(p, attribute(p, draco, "COLOR_0", {4, 3}), points.count, kept, material.alpha, part);
    if (material.uv_set) {
      const std::string key = "TEXCOORD_" + std::to_string(*material.uv_set);
      if (attributes.has(key.c_str())) read_uvs(p, attribute(p, draco, key.c_str(), {2}), points.count, kept, material, part);
      else no_uv_.add(p);
    }
    return true;
  }

  void read_triangles(const GltfValue& p, std::uint64_t mode, std::size_t vertices, std::vector<Triangle>& triangles) {
    std::optional<GltfAccessor> indices;
    if (const auto i = file_.reference(p, "indices", "accessors")) {
      indices = file_.accessor(*i, {1});
      if (indices->component != GltfComponent::kUnsignedByte && indices->component != GltfComponent::kUnsignedShort && indices->component != GltfComponent::kUnsignedInt)
        p["indices"].fail("its accessor's componentType is " + std::to_string(static_cast<int>(indices->component)) + ", not 5121, 5123 or 5125");
    }
    const std::size_t corners = indices ? indices->count : vertices;
    const auto corner = [&](std::size_t i) {
      if (!indices) return static_cast<std::uint32_t>(i);
      const std::uint32_t index = indices->index(i);
      if (index >= vertices) p["indices"].fail("index " + std::to_string(i) + " is " + std::to_string(index) + " where there are " + std::to_string(vertices) + " vertices");
      return index;
    };
    if (mode == 4) {
      if (corners % 3 != 0) incomplete_.add(p);
      triangles.resize(corners / 3);
      for (std::size_t i = 0; i < triangles.size(); ++i) triangles[i] = {corner(3 * i), corner(3 * i + 1), corner(3 * i + 2)};
    } else if (corners < 3) {
      incomplete_.add(p);
    } else if (mode == 5) {
      triangles.resize(corners - 2);
      for (std::size_t i = 0; i < triangles.size(); ++i) triangles[i] = {corner(i), corner(i + 1 + i % 2), corner(i + 2 - i % 2)};
    } else {
      triangles.resize(corners - 2);
      for (std::size_t i = 0; i < triangles.size(); ++i) triangles[i] = {corner(i + 1), corner(i + 2), corner(0)};
    }
  }

  // The accessor of an attribute, or what Draco has of it.
  GltfAccessor attribute(const GltfValue& p, const std::optional<DracoMesh>& draco, const char* name, std::initializer_list<int> components) {
    const GltfValue attributes = p["attributes"];
    const auto index = file_.reference(attributes, name, "accessors");
    const auto in_draco = std::find(draco_names_.begin(), draco_names_.end(), name);
    if (!draco || in_draco == draco_names_.end()) {
      GltfAccessor a = file_.accessor(*index, components);
      if (a.component == GltfComponent::kUnsignedInt) attributes[name].fail("its accessor's componentType is 5125, which is for indices");
      if (draco && a.count != draco->points) attributes[name].fail("has " + std::to_string(a.count) + " elements where Draco has " + std::to_string(draco->points));
      return a;
    }
    const DracoMesh::Values& values = draco->attributes[static_cast<std::size_t>(in_draco - draco_names_.begin())];
    if (std::find(components.begin(), components.end(), values.components) == components.end())
      attributes[name].fail("has " + std::to_string(values.components) + " values each in Draco's data");
    GltfAccessor a;
    a.count = draco->points;
    a.components = values.components;
    a.stride = sizeof(float) * static_cast<std::size_t>(a.components);
    a.owned = std::make_shared<const std::string>(reinterpret_cast<const char*>(values.values.data()), values.values.size() * sizeof(float));
    a.data = a.owned->data();
    return a;
  }

  DracoMesh decompress(const GltfValue& p, const GltfValue& extension) {
    const GltfValue attributes = p["attributes"], ids = extension["attributes"];
    const auto view = file_.reference(extension, "bufferView", "bufferViews");
    if (!view) extension.fail("has no \"bufferView\"");
    draco_names_.clear();
    std::vector<std::uint32_t> wanted;
    for (const auto& [name, value] : ids.json().items()) {
      if (name != "POSITION" && name != "COLOR_0" && !name.starts_with("TEXCOORD_")) continue;
      if (!attributes.has(name.c_str())) ids[name.c_str()].fail("is an attribute the primitive does not have");
      wanted.push_back(static_cast<std::uint32_t>(std::min<std::uint64_t>(ids[name.c_str()].whole(), 0xffffffff)));
      draco_names_.push_back(name);
    }
    if (std::find(draco_names_.begin(), draco_names_.end(), "POSITION") == draco_names_.end()) ids.fail("has no \"POSITION\"");
    const std::size_t points = file_.accessor_count(*file_.reference(attributes, "POSITION", "accessors"));
    const auto indices = file_.reference(p, "indices", "accessors");
    const std::size_t most = indices ? file_.accessor_count(*indices) : points;
    // What it unpacks to, at least: positions and corners.
    file_.charge(points * 12 + most * 4, extension);
    DracoMesh mesh;
    std::string message;
    if (!decode_draco(file_.view(*view), wanted, points, most, mesh, message)) extension.fail(message, "export the file again, without Draco");
    if (mesh.points != points) extension.fail("has " + std::to_string(mesh.points) + " vertices where the accessor states " + std::to_string(points));
    if (indices && p.whole_or("mode", 4) == 4 && mesh.triangles.size() * 3 != most)
      extension.fail("has " + std::to_string(mesh.triangles.size()) + " triangles where the accessor states " + std::to_string(most) + " indices");
    for (std::size_t i = 0; i < wanted.size(); ++i) scale_integers(attributes[draco_names_[i].c_str()], draco_names_[i] == "COLOR_0", mesh.attributes[i]);
    return mesh;
  }

  // Draco keeps integers as they are where its own flag is not set; glTF's accessor says what they mean.
  void scale_integers(const GltfValue& attribute, bool always, DracoMesh::Values& values) const {
    if (!values.plain_integers) return;
    const GltfValue accessor = file_.item("accessors", attribute.whole());
    if (!always && !accessor.boolean_or("normalized", false)) return;
    const std::uint64_t kind = accessor["componentType"].whole();
    const float most = kind == 5120 ? 127.0f : kind == 5121 ? 255.0f : kind == 5122 ? 32767.0f : kind == 5123 ? 65535.0f : 1.0f;
    for (float& v : values.values) v = std::max(v / most, -1.0f);
  }

  void check_count(const GltfValue& p, const char* name, std::size_t count, std::size_t vertices) const {
    if (count != vertices) p["attributes"][name].fail("has " + std::to_string(count) + " elements where there are " + std::to_string(vertices) + " vertices");
  }

  void read_colors(const GltfValue& p, GltfAccessor from, std::size_t vertices, const std::vector<std::uint32_t>& kept, bool alpha, Part& part) {
    check_count(p, "COLOR_0", from.count, vertices);
    from.normalized = true;  // integers are never meant otherwise, and some writers forget to say so
    part.colors.resize(kept.size());
    bool see_through = false, bad = false;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      double c[4] = {1, 1, 1, 1};
      from.read(kept[i], c);
      if (!std::isfinite(c[0]) || !std::isfinite(c[1]) || !std::isfinite(c[2])) {
        c[0] = c[1] = c[2] = 1;
        bad = true;
      }
      for (int k = 0; k < 3; ++k) part.colors[i][k] = static_cast<float>(std::clamp(c[k], 0.0, 1.0));
      see_through = see_through || c[3] < 1;
    }
    if (bad) bad_colors_.add(p);
    if (see_through && alpha) vertex_alpha_.add(p);
  }

  void read_uvs(const GltfValue& p, const GltfAccessor& from, std::size_t vertices, const std::vector<std::uint32_t>& kept, const GltfMaterial& material, Part& part) {
    check_count(p, ("TEXCOORD_" + std::to_string(*material.uv_set)).c_str(), from.count, vertices);
    part.uvs.resize(kept.size());
    bool bad = false;
    const double* m = material.uv;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      double uv[2];
      from.read(kept[i], uv);
      const double u = m[0] * uv[0] + m[1] * uv[1] + m[2], v = m[3] * uv[0] + m[4] * uv[1] + m[5];
      const bool good = std::abs(u) < 1e30 && std::abs(v) < 1e30;
      part.uvs[i] = good ? V2f(static_cast<float>(u), static_cast<float>(v)) : V2f(0, 0);
      bad = bad || !good;
    }
    if (bad) bad_uvs_.add(p);
  }

  // --- the scene ---

  void reserve() {
    std::size_t points = 0, triangles = 0, uvs = 0;
    std::size_t placed = 0;
    for (const Placed& node : placed_) {
      const auto copies = static_cast<std::size_t>(instances(node));
      if (meshes_[node.mesh].shared) placed += copies;
      for (const Part& part : meshes_[node.mesh].parts) {
        points += copies * part.points.size();
        triangles += copies * part.triangles.size();
        has_colors_ = has_colors_ || !part.colors.empty();
        has_uvs_ = has_uvs_ || !part.uvs.empty();
      }
    }
    for (const ReadMesh& mesh : meshes_)
      for (const Part& part : mesh.parts) uvs += part.uvs.size();
    if (points >= kNoIndex || uvs >= kNoIndex) throw Error(Code::kUnsupported, file_.path(), "has more than 2^32 vertices", "bake parts of it by themselves");
    scene_.instances.reserve(placed);
    Mesh& mesh = scene_.mesh;
    mesh.points.reserve(points);
    mesh.triangles.reserve(triangles);
    mesh.materials.reserve(triangles);
    mesh.uvs.reserve(uvs);
    if (has_colors_) mesh.colors.reserve(points);
    if (has_uvs_) mesh.uv_corners.reserve(triangles);
  }

  // Where a shape stands. What a matrix makes flat has no inside and cannot be turned back: it is copied; what it makes a line has no surface.
  void instance(const ReadMesh& read, const Affine& matrix) {
    const Instance one{read.shape, matrix};
    const Mesh& shape = scene_.shapes[read.shape];
    const bool finite = std::all_of(matrix.m.begin(), matrix.m.end(), [](double v) { return std::isfinite(v); });
    if (!finite || !(matrix.reach(read.reach) <= kFarthest)) {
      unusable_.points += static_cast<std::int64_t>(shape.points.size());
      unusable_.triangles += static_cast<std::int64_t>(shape.triangles.size());
    } else if (matrix.invertible()) {
      scene_.instances.push_back(one);
    } else if (has_area(matrix)) {
      add_triangles(1, static_cast<std::int64_t>(shape.triangles.size()));
      flat_.push_back(one);
    } else {
      ++vanished_;
    }
  }

  // Whether two of its columns span a plane.
  static bool has_area(const Affine& a) {
    const V3d x(a.m[0], a.m[4], a.m[8]), y(a.m[1], a.m[5], a.m[9]), z(a.m[2], a.m[6], a.m[10]);
    return x.cross(y).length2() > 0 || y.cross(z).length2() > 0 || z.cross(x).length2() > 0;
  }

  // Appends the mesh. `has_colors`, `has_uvs`: whether any that comes to stand in `mesh` has some.
  static void copy(ReadMesh& read, const Affine& matrix, bool has_colors, bool has_uvs, Mesh& mesh) {
    const bool mirrored = matrix.determinant() < 0;
    for (Part& part : read.parts) {
      const auto first = static_cast<std::uint32_t>(mesh.points.size());
      for (const V3d& p : part.points) mesh.points.push_back(matrix * p);
      if (has_colors) {
        mesh.colors.insert(mesh.colors.end(), part.colors.begin(), part.colors.end());
        mesh.colors.resize(mesh.points.size(), V3f(1, 1, 1));
      }
      if (!part.uvs.empty() && part.first_uv == kNoIndex) {
        part.first_uv = static_cast<std::uint32_t>(mesh.uvs.size());
        mesh.uvs.insert(mesh.uvs.end(), part.uvs.begin(), part.uvs.end());
      }
      for (const Triangle& t : part.triangles) {
        const std::uint32_t a = t[0], b = t[mirrored ? 2 : 1], c = t[mirrored ? 1 : 2], uv = part.first_uv;
        mesh.triangles.push_back({first + a, first + b, first + c});
        if (!has_uvs) continue;
        if (uv == kNoIndex) mesh.uv_corners.push_back({kNoIndex, kNoIndex, kNoIndex});
        else mesh.uv_corners.push_back({uv + a, uv + b, uv + c});
      }
      mesh.materials.resize(mesh.triangles.size(), part.material);
    }
  }

  struct Tally {
    std::int64_t count = 0;
    std::string first;
    void add(const GltfValue& at) {
      if (count++ == 0) first = at.path();
    }
  };

  void tell() {
    const auto say = [&](const Tally& tally, const char* id, const char* text) {
      if (tally.count) report_.issue(id, text, tally.count, file_.path() + ": " + tally.first);
    };
    say(lines_, "gltf-lines", "primitives of points or lines were skipped");
    say(no_positions_, "gltf-no-positions", "primitives without POSITION were skipped");
    say(incomplete_, "gltf-incomplete", "primitives whose last triangle lacks corners: it was left out");
    say(no_uv_, "gltf-no-uv", "primitives lack the texture coordinates of their picture: its lower left corner is used");
    say(bad_uvs_, "bad-uv", "texture coordinates that are not numbers: 0 0 used");
    say(bad_colors_, "non-finite-color", "vertex colours that are not numbers: white used");
    say(vertex_alpha_, "gltf-vertex-alpha", "alpha of vertex colours is not used");
    const auto animations = static_cast<std::int64_t>(file_.count("animations"));
    if (posed_ + animations > 0)
      report_.issue("gltf-rest-pose", "skins, morph targets or animations: the shape at rest is baked, as the meshes have it", posed_ + animations, file_.path());
    report_unusable(unusable_, report_, file_.path());
    if (vanished_) report_.skip(file_.path() + ": " + std::to_string(vanished_) + (vanished_ == 1 ? " instance" : " instances"), "scaled to nothing");
    report_.count("meshes placed", static_cast<double>(placements_));
  }

  GltfFile file_;
  Report& report_;
  GltfOptions options_;
  Scene scene_;
  GltfMaterials materials_;
  std::vector<ReadMesh> meshes_;
  std::vector<Placed> placed_;
  std::vector<std::string> draco_names_;  // of the primitive being read, as its DracoMesh's attributes
  std::vector<Instance> flat_;            // to be copied
  Unusable unusable_;                     // of shapes and instances
  std::int64_t placements_ = 0, triangles_ = 0, vanished_ = 0, posed_ = 0;
  bool has_colors_ = false, has_uvs_ = false;
  Tally lines_, no_positions_, incomplete_, no_uv_, bad_uvs_, bad_colors_, vertex_alpha_;
};

}  // namespace

Scene read_gltf(const Input& input, const GltfOptions& options, Report& report) { return GltfReader(input, options, report).read(); }

}  // namespace texel
