// OBJ after the "Object Files" appendix of Wavefront's Advanced Visualizer manual (1993), with vertex colours as MeshLab and others
// write them. Polygons, and lines as fibres; curves, surfaces and points are skipped. Normals are not read: geometry's own are used.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>

#include "formats/error.h"
#include "formats/fibres.h"
#include "formats/readers.h"
#include "formats/triangulate.h"

namespace texel {
namespace {

// One corner as resolved: 0-based, kNoIndex where there is none. Positive vertex numbers may point forward; they are checked at the end.
struct Corner {
  std::uint32_t point = kNoIndex, uv = kNoIndex;
};

// How often something happened and where first.
struct Tally {
  std::int64_t count = 0;
  const char* first = nullptr;
  void add(const char* at) {
    if (count++ == 0) first = at;
  }
};

class ObjReader {
 public:
  ObjReader(const Input& input, const FibreOptions& lines, Report& report) : input_(input), text_(input), line_options_(lines), report_(report) {}

  Scene read() {
    reserve();
    if (input_.bytes.size() >= 3 && std::memcmp(input_.bytes.data(), "\xEF\xBB\xBF", 3) == 0) text_.move_to(text_.position() + 3);
    for (; !text_.at_end(); text_.next_line()) line();
    for (const Waiting& face : waiting_) add_waiting(face);
    finish_colors();
    finish_uvs();
    resolve_materials();
    add_fibres();
    report_issues();
    if (bad_.count > 0) finish_mesh(scene_, report_, text_.where(bad_.first), "no face can be used: " + bad_reason_);
    else if (lines_.count > 0) finish_mesh(scene_, report_, text_.where(lines_.first), "holds only points, curves or lines that are left out, no face");
    else finish_mesh(scene_, report_, input_.path, "holds no face");
    return std::move(scene_);
  }

 private:
  struct Waiting {  // a face that comes before its vertices
    const char* at;
    std::uint32_t material;
    std::vector<Corner> corners;
  };

  // One pass over the line starts spares the copies of growing arrays. Only a hint: at most 12 times the file's size.
  void reserve() {
    std::size_t points = 0, uvs = 0, faces = 0;
    const char* p = input_.bytes.data();
    const char* end = p + input_.bytes.size();
    while (p && end - p > 1) {
      if (p[0] == 'v') {
        if (p[1] == ' ') ++points;
        else if (p[1] == 't') ++uvs;
      } else if (p[0] == 'f') {
        ++faces;
      }
      p = static_cast<const char*>(std::memchr(p, '\n', static_cast<std::size_t>(end - p)));
      if (p) ++p;
    }
    scene_.mesh.points.reserve(points);
    scene_.mesh.uvs.reserve(uvs);
    scene_.mesh.triangles.reserve(faces);
    scene_.mesh.materials.reserve(faces);
    if (uvs > 0) scene_.mesh.uv_corners.reserve(faces);
  }

  void line() {
    text_.skip_blanks();
    const char* at = text_.position();
    const std::size_t left = text_.left();
    if (left < 2) return;
    if (at[0] == 'v') {
      if (is_blank(at[1])) return vertex(at);
      if (at[1] == 't' && left > 2 && is_blank(at[2])) return uv(at);
      return;
    }
    if (at[0] == 'f' && is_blank(at[1])) return face(at);
    if (at[0] == '#' || at[0] == 'g' || at[0] == 'o' || at[0] == 's') return;
    keyword(at);
  }

  void keyword(const char* at) {
    const std::string_view word = text_.word();
    if (word == "usemtl") {
      use_material(text_.rest_of_line(), at);
    } else if (word == "mtllib") {
      read_library(text_.rest_of_line(), at);
    } else if (word == "fo") {
      face(at);  // the first OBJ writers' name for f
    } else if (word == "l" && line_options_.radius != 0) {
      polyline(at);
    } else if (word == "l" || word == "p" || word == "curv" || word == "curv2" || word == "surf") {
      lines_.add(at);
    }
  }

  [[noreturn]] void bad_number(const char* what) {
    if (text_.line_is_over()) throw Error(Code::kBadInput, text_.where(), std::string(what) + " has too few numbers");
    throw Error(Code::kBadInput, text_.where(), std::string(what) + " is not a number (" + shown_as(text_.peek_word()) + ")");
  }

  void vertex(const char* at) {
    text_.move_to(at + 1);
    double v[8];
    for (int i = 0; i < 3; ++i)
      if (!text_.number(v[i])) bad_number("vertex coordinate");
    Mesh& mesh = scene_.mesh;
    mesh.points.emplace_back(v[0], v[1], v[2]);
    if (is_line_end(text_.peek())) return;
    int more = 0;
    while (more < 5 && text_.number(v[3 + more])) ++more;
    if (more < 3) return;  // one number is a weight w, which polygons don't use
    colored_.resize(mesh.points.size() - 1, V3f(1, 1, 1));
    double rgb[3] = {v[3], v[4], v[5]};
    if (!std::isfinite(rgb[0]) || !std::isfinite(rgb[1]) || !std::isfinite(rgb[2])) {
      bad_colors_.add(at);
      rgb[0] = rgb[1] = rgb[2] = -1;  // white, once the file's scale is known
    }
    largest_color_ = std::max({largest_color_, rgb[0], rgb[1], rgb[2]});
    colored_.emplace_back(static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2]));
    ++colors_;
  }

  void uv(const char* at) {
    text_.move_to(at + 2);
    double u = 0, v = 0;
    const bool read = text_.number(u) && (text_.line_is_over() || text_.number(v));
    if (!read || !(std::abs(u) < 1e30) || !(std::abs(v) < 1e30)) {
      bad_uvs_.add(at);
      u = v = 0;
    }
    scene_.mesh.uvs.emplace_back(static_cast<float>(u), static_cast<float>(v));
  }

  // A whole number at the scanner's place, saturated. False where there is none.
  bool integer(std::int64_t& value) {
    const char* p = text_.position();
    const char* end = text_.end();
    const bool negative = p != end && *p == '-';
    if (p != end && (*p == '-' || *p == '+')) ++p;
    const char* first = p;
    std::int64_t read = 0;
    for (; p != end && is_digit(*p); ++p) read = std::min<std::int64_t>(read * 10 + (*p - '0'), std::int64_t{1} << 48);
    if (p == first) return false;
    value = negative ? -read : read;
    text_.move_to(p);
    return true;
  }

  bool slash() {
    if (text_.peek() != '/') return false;
    text_.move_to(text_.position() + 1);
    return true;
  }

  bool corner(const char* at) {
    std::int64_t point = 0, uv = 0, normal = 0;
    bool has_uv = false;
    if (!integer(point)) return drop(at, "a corner is not a number (" + shown_as(text_.peek_word()) + ")");
    if (slash()) {
      has_uv = integer(uv);
      if (slash()) (void)integer(normal);
    }
    const char next = text_.peek();
    if (!is_blank(next) && !is_line_end(next) && next != '\\') return drop(at, "a corner is not a number (" + shown_as(text_.peek_word()) + ")");
    const auto points = static_cast<std::int64_t>(scene_.mesh.points.size());
    const auto uvs = static_cast<std::int64_t>(scene_.mesh.uvs.size());
    Corner c;
    if (point == 0) return drop(at, "a vertex index is 0, and indices begin at 1");
    if (point < -points) return drop(at, "a vertex index is " + std::to_string(point) + " after " + std::to_string(points) + " vertices");
    if (point >= kNoIndex) return drop(at, "a vertex index is " + std::to_string(point));
    c.point = static_cast<std::uint32_t>(point > 0 ? point - 1 : points + point);
    forward_ = forward_ || point > points;
    if (has_uv) {
      if (uv == 0 || uv < -uvs || uv >= kNoIndex) bad_uv_indices_.add(at);
      else c.uv = static_cast<std::uint32_t>(uv > 0 ? uv - 1 : uvs + uv);
    }
    corners_.push_back(c);
    return true;
  }

  bool drop(const char* at, const std::string& reason) {
    bad_.add(at);
    if (bad_.count == 1) bad_reason_ = reason;
    return false;
  }

  void face(const char* at) {
    text_.move_to(at);
    (void)text_.word();
    corners_.clear();
    forward_ = false;
    while (!text_.line_is_over() && text_.peek() != '#')
      if (!corner(at)) return;
    if (corners_.size() < 3) {
      (void)drop(at, "a face has " + std::to_string(corners_.size()) + " corners");
      return;
    }
    if (scene_.mesh.points.size() >= kNoIndex) throw Error(Code::kUnsupported, text_.where(at), "more than 2^32 vertices");
    if (forward_) waiting_.push_back({at, current_material(), corners_});
    else add_face(at, corners_, current_material());
  }

  // Kept until the radius is known, which may depend on all of them.
  void polyline(const char* at) {
    corners_.clear();
    forward_ = false;
    while (!text_.line_is_over() && text_.peek() != '#')
      if (!corner(at)) return;
    if (corners_.size() < 2) {
      (void)drop(at, "a line has " + std::to_string(corners_.size()) + " points");
      return;
    }
    line_starts_.push_back({at, line_points_.size(), current_material()});
    for (const Corner& c : corners_) line_points_.push_back(c.point);
  }

  // The lines' own points say how thick they are where nobody does.
  double line_radius() {
    if (line_options_.radius > 0) return line_options_.radius;
    Box3d box;
    const auto finite = [](const V3d& p) { return std::abs(p.x) <= 1e100 && std::abs(p.y) <= 1e100 && std::abs(p.z) <= 1e100; };
    for (const std::uint32_t p : line_points_)
      if (p < scene_.mesh.points.size() && finite(scene_.mesh.points[p])) box.extendBy(scene_.mesh.points[p]);
    const double radius = box.isEmpty() ? 0 : box.size().length() / 2000;
    char text[128];
    std::snprintf(text, sizeof text, "lines have no radius: %.4g, 1/2000 of their diagonal, is used (--fibre-radius R; 0 leaves lines out)", radius);
    report_.issue("line-radius", text, static_cast<std::int64_t>(line_starts_.size()), text_.where(line_starts_.front().at));
    return radius;
  }

  void add_fibres() {
    if (line_starts_.empty()) return;
    const double radius = line_radius();
    const Mesh& mesh = scene_.mesh;
    FibreBuilder builder(scene_.fibres, !mesh.colors.empty());
    std::vector<FibrePoint> strand;
    for (std::size_t l = 0; l < line_starts_.size(); ++l) {
      strand.clear();
      const std::size_t end = l + 1 < line_starts_.size() ? line_starts_[l + 1].first : line_points_.size();
      bool good = true;
      for (std::size_t i = line_starts_[l].first; i < end && good; ++i) {
        const std::uint32_t p = line_points_[i];
        good = p < mesh.points.size() || drop(line_starts_[l].at, "a vertex index is " + std::to_string(std::uint64_t{p} + 1) + " of " + std::to_string(mesh.points.size()) + " vertices");
        if (good) strand.push_back({mesh.points[p], radius, mesh.colors.empty() ? V3f(1, 1, 1) : mesh.colors[p]});
      }
      if (good) builder.strand(strand, line_starts_[l].material);
    }
    builder.report_to(report_, text_.where(line_starts_.front().at));
    if (bad_.count == 0 && scene_.fibres.strands() == 0 && mesh.triangles.empty()) throw Error(Code::kBadInput, text_.where(line_starts_.front().at), builder.reason());
  }

  void add_waiting(const Waiting& face) {
    for (const Corner& c : face.corners)
      if (c.point >= scene_.mesh.points.size()) {
        (void)drop(face.at, "a vertex index is " + std::to_string(std::uint64_t{c.point} + 1) + " of " +
                                std::to_string(scene_.mesh.points.size()) + " vertices");
        return;
      }
    add_face(face.at, face.corners, face.material);
  }

  void add_face(const char* at, const std::vector<Corner>& corners, std::uint32_t material) {
    if (corners.size() == 3) return add_triangle(corners[0], corners[1], corners[2], material);
    polygon_.clear();
    for (const Corner& c : corners) polygon_.push_back(scene_.mesh.points[c.point]);
    for (const auto& t : triangulator_(polygon_)) add_triangle(corners[t[0]], corners[t[1]], corners[t[2]], material);
    if (triangulator_.was_not_simple()) not_simple_.add(at);
  }

  void add_triangle(const Corner& a, const Corner& b, const Corner& c, std::uint32_t material) {
    Mesh& mesh = scene_.mesh;
    const bool has_uv = (a.uv & b.uv & c.uv) != kNoIndex;
    if (has_uv && mesh.uv_corners.size() < mesh.triangles.size()) mesh.uv_corners.resize(mesh.triangles.size(), {kNoIndex, kNoIndex, kNoIndex});
    mesh.triangles.push_back({a.point, b.point, c.point});
    mesh.materials.push_back(material);
    if (has_uv || !mesh.uv_corners.empty()) mesh.uv_corners.push_back({a.uv, b.uv, c.uv});
  }

  // Materials are numbered by first use; what they are is looked up at the end, for a library may be named after its use.
  void use_material(const std::string& name, const char* at) {
    const auto found = material_numbers_.try_emplace(name, static_cast<std::uint32_t>(used_.size()));
    if (found.second) used_.push_back({name, at});
    material_ = found.first->second;
  }

  std::uint32_t current_material() {
    if (material_ == kNoIndex) use_material("", nullptr);
    return material_;
  }

  void read_library(const std::string& names, const char* at) {
    if (missing_libraries_ > kMostLibraries || read_one_library(names)) return;
    // Not one name with blanks: several names.
    std::size_t i = 0;
    while (i < names.size() && missing_libraries_ <= kMostLibraries) {
      const std::size_t end = std::min(names.find_first_of(" \t", i), names.size());
      const std::string name = names.substr(i, end - i);
      i = names.find_first_not_of(" \t", end);
      if (read_one_library(name) || ++missing_libraries_ > kMostLibraries) continue;
      report_.issue("mtl-missing", "material library " + shown_as(name) + " is not there", 1, text_.where(at));
    }
  }

  bool read_one_library(const std::string& name) {
    const std::string path = find_beside(input_.path, name);
    if (path.empty()) return false;
    for (const SourceFile& s : scene_.sources)
      if (s.path == path) return true;  // some exporters name it before each object
    const FileBytes file(path);
    for (MtlMaterial& m : read_mtl({file.bytes(), path}, report_)) library_.try_emplace(m.material.name, std::move(m));
    add_source(scene_, path);
    return true;
  }

  void resolve_materials() {
    for (const auto& [name, at] : used_) {
      const auto found = library_.find(name);
      if (found != library_.end()) {
        (void)add_mtl_material(found->second, scene_, report_);
        continue;
      }
      Material m;
      m.name = name.empty() ? "default" : name;
      // Vertex colours are multiplied with kd: alone they are the colour.
      if (!scene_.mesh.colors.empty()) m.kd = V3f(1, 1, 1);
      scene_.materials.push_back(m);
      if (!name.empty())
        report_.issue("material-missing", "materials that no library defines: " + std::string(scene_.mesh.colors.empty() ? "grey 0.5" : "white") +
                      " is used for them", 1, text_.where(at));
    }
  }

  // Stored sRGB becomes linear only now that the scale is known: 0-1 as MeshLab writes, or 0-255.
  void finish_colors() {
    if (colors_ == 0) return;
    const bool bytes = largest_color_ > 1.5;
    if (bytes) report_.issue("vertex-colors-255", "vertex colours above 1 are taken as 0-255", 1, input_.path);
    colored_.resize(scene_.mesh.points.size(), V3f(1, 1, 1));
    const float scale = bytes ? 255.0f : 1.0f;
    for (V3f& c : colored_) {
      if (c.x == -1 && c.y == -1 && c.z == -1) c = V3f(scale, scale, scale);
      const double rgb[3] = {c.x / scale, c.y / scale, c.z / scale};
      (void)decode_color(rgb, c);
    }
    scene_.mesh.colors = std::move(colored_);
  }

  // uv indices may point forward too.
  void finish_uvs() {
    const auto uvs = static_cast<std::uint32_t>(scene_.mesh.uvs.size());
    for (auto& t : scene_.mesh.uv_corners)
      for (std::uint32_t& c : t)
        if (c != kNoIndex && c >= uvs) {
          c = kNoIndex;
          ++late_bad_uvs_;
        }
  }

  void report_issues() {
    const auto say = [this](const Tally& t, const char* id, const std::string& what) {
      if (t.count > 0) report_.issue(id, what, t.count, text_.where(t.first));
    };
    say(bad_, "bad-index", std::string(line_starts_.empty() ? "faces" : "faces or lines") + " that can't be read were dropped; of the first, " + bad_reason_);
    say(lines_, "obj-lines-ignored", "point, curve and surface elements, and lines where --fibre-radius is 0, were skipped");
    say(bad_colors_, "non-finite-color", "vertex colours that are not numbers: white used");
    say(bad_uvs_, "bad-uv", "texture coordinates that are not numbers: 0 0 used");
    say(bad_uv_indices_, "bad-uv-index", "texture coordinate indices that mean nothing: the corner has none");
    if (late_bad_uvs_) report_.issue("bad-uv-index", "texture coordinate indices past the last one: the corner has none", late_bad_uvs_, input_.path);
    say(not_simple_, "polygon-not-simple", "polygons that cross themselves were cut as fans");
  }

  // Looking for files takes time: a damaged file must not make us look for millions.
  static constexpr int kMostLibraries = 64;

  const Input& input_;
  TextScanner text_;
  const FibreOptions line_options_;
  Report& report_;
  Scene scene_;
  struct Line { const char* at; std::size_t first; std::uint32_t material; };
  std::vector<Line> line_starts_;
  std::vector<std::uint32_t> line_points_;  // 0-based; checked once all vertices are read
  int missing_libraries_ = 0;
  std::vector<V3f> colored_;  // as stored, until the scale is known
  double largest_color_ = 0;
  std::int64_t colors_ = 0, late_bad_uvs_ = 0;
  std::vector<Corner> corners_;
  bool forward_ = false;  // the face at hand has a vertex that is still to come
  std::vector<Waiting> waiting_;
  std::vector<V3d> polygon_;
  Triangulator triangulator_;
  std::uint32_t material_ = kNoIndex;
  std::vector<std::pair<std::string, const char*>> used_;
  std::map<std::string, std::uint32_t> material_numbers_;
  std::map<std::string, MtlMaterial> library_;
  Tally bad_, lines_, bad_colors_, bad_uvs_, bad_uv_indices_, not_simple_;
  std::string bad_reason_;
};

}  // namespace

Scene read_obj(const Input& input, const FibreOptions& lines, Report& report) { return ObjReader(input, lines, report).read(); }

}  // namespace texel
