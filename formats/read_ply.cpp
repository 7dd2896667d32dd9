// PLY, Greg Turk's polygon file format (1994): ASCII, binary of both byte orders, properties of any type in any order.
#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/error.h"
#include "formats/readers.h"
#include "formats/triangulate.h"

namespace texel {
namespace {

enum class Type : std::uint8_t { kNone, kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

Type type_named(std::string_view name) {
  constexpr std::pair<std::string_view, Type> kNames[] = {
      {"char", Type::kInt8},   {"int8", Type::kInt8},    {"uchar", Type::kUint8},   {"uint8", Type::kUint8},
      {"short", Type::kInt16}, {"int16", Type::kInt16},  {"ushort", Type::kUint16}, {"uint16", Type::kUint16},
      {"int", Type::kInt32},   {"int32", Type::kInt32},  {"uint", Type::kUint32},   {"uint32", Type::kUint32},
      {"float", Type::kFloat}, {"float32", Type::kFloat}, {"double", Type::kDouble}, {"float64", Type::kDouble}};
  for (const auto& [known, type] : kNames)
    if (name == known) return type;
  return Type::kNone;
}

std::size_t size_of(Type type) {
  constexpr std::size_t kSizes[] = {0, 1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

// What a property means to us; the first eight are also places in a vertex's row of values.
enum Role : std::uint8_t { kX, kY, kZ, kRed, kGreen, kBlue, kU, kV, kIndices, kTexcoords, kIgnored };

struct Property {
  Type type = Type::kNone, count_type = Type::kNone;  // a list when count_type is set
  Role role = kIgnored;
  [[nodiscard]] bool list() const { return count_type != Type::kNone; }
};

struct Element {
  std::string name;
  std::int64_t count = 0;
  std::vector<Property> properties;

  [[nodiscard]] bool has(Role role) const {
    return std::any_of(properties.begin(), properties.end(), [role](const Property& p) { return p.role == role; });
  }
  // Bytes a row takes at least.
  [[nodiscard]] std::size_t least_size(bool ascii) const {
    std::size_t size = 0;
    for (const Property& p : properties) size += ascii ? 2 : p.list() ? size_of(p.count_type) : size_of(p.type);
    return size;
  }
};

Role role_named(const std::string& element, std::string_view name, bool list) {
  if (list) {
    if (element != "face") return kIgnored;
    if (name == "vertex_indices" || name == "vertex_index") return kIndices;
    return name == "texcoord" ? kTexcoords : kIgnored;
  }
  if (element == "vertex") {
    constexpr std::pair<std::string_view, Role> kNames[] = {{"x", kX}, {"y", kY}, {"z", kZ}, {"s", kU}, {"t", kV}, {"u", kU}, {"v", kV},
                                                            {"texture_u", kU}, {"texture_v", kV}, {"texture_s", kU}, {"texture_t", kV}};
    for (const auto& [known, role] : kNames)
      if (name == known) return role;
  }
  if (element == "vertex" || element == "face") {
    if (name == "red" || name == "r" || name == "diffuse_red") return kRed;
    if (name == "green" || name == "g" || name == "diffuse_green") return kGreen;
    if (name == "blue" || name == "b" || name == "diffuse_blue") return kBlue;
  }
  return kIgnored;
}

class PlyReader {
 public:
  PlyReader(const Input& input, Report& report) : input_(input), text_(input), report_(report) {}

  Scene read() {
    read_header();
    check_elements();
    make_materials();
    for (const Element& element : elements_) {
      if (element.properties.empty()) continue;
      if (element.name == "vertex") read_vertices(element);
      else if (element.name == "face") read_faces(element);
      else skip(element);
    }
    finish();
    return std::move(scene_);
  }

 private:
  [[noreturn]] void fail(const std::string& message, const std::string& hint = {}) { throw Error(Code::kBadInput, here(), message, hint); }
  [[nodiscard]] std::string here() const { return where(text_.position()); }
  [[nodiscard]] std::string where(const char* at) const {
    return ascii_ ? text_.where(at) : input_.path + ": byte " + std::to_string(at - input_.bytes.data());
  }

  void read_header() {
    if (text_.word() != "ply") fail("is not a PLY file");
    bool has_format = false;
    for (;;) {
      text_.next_line();
      if (text_.at_end()) fail("ends within its header");
      const std::string_view word = text_.word();
      if (word == "end_header") break;
      if (word == "format") {
        const std::string_view format = text_.word();
        ascii_after_header_ = format == "ascii";
        big_ = format == "binary_big_endian";
        if (!ascii_after_header_ && !big_ && format != "binary_little_endian") fail("format " + shown_as(format) + " is unknown");
        has_format = true;
      } else if (word == "comment") {
        if (text_.word() == "TextureFile") texture_ = text_.rest_of_line();
      } else if (word == "element") {
        read_element();
      } else if (word == "property") {
        read_property();
      } else if (!word.empty() && word != "obj_info") {
        fail("header line " + shown_as(word) + " is unknown");
      }
    }
    if (!has_format) fail("header has no format line");
    text_.next_line();
    ascii_ = ascii_after_header_;
  }

  void read_element() {
    if (elements_.size() == 64) fail("header has more than 64 elements");
    Element& element = elements_.emplace_back();
    element.name = std::string(text_.word());
    double count = 0;
    if (!text_.number(count) || !(count >= 0) || count > 1e15 || count != std::floor(count)) fail("element count is not a whole number (" + shown_as(text_.peek_word()) + ")");
    element.count = static_cast<std::int64_t>(count);
  }

  void read_property() {
    if (elements_.empty()) fail("property before the first element");
    Element& element = elements_.back();
    if (element.properties.size() == 1024) fail("element " + shown_as(element.name) + " has more than 1024 properties");
    Property p;
    std::string_view word = text_.word();
    if (word == "list") {
      p.count_type = type_named(text_.word());
      if (p.count_type == Type::kNone || p.count_type == Type::kFloat || p.count_type == Type::kDouble) fail("list count is of no integer type");
      word = text_.word();
    }
    p.type = type_named(word);
    if (p.type == Type::kNone) fail("property type " + shown_as(word) + " is unknown");
    p.role = role_named(element.name, text_.word(), p.list());
    element.properties.push_back(p);
  }

  void check_elements() {
    bool vertices = false, faces = false;
    std::size_t left = text_.left();
    for (const Element& e : elements_) {
      if (e.name == "tristrips") throw Error(Code::kUnsupported, input_.path, "PLY triangle strips (tristrips) can't be read", "export faces");
      const std::size_t size = e.least_size(ascii_);
      // An ASCII row may lack its last line end.
      if (size > 0 && static_cast<std::uint64_t>(e.count) > (left + 1) / size)
        fail("states " + std::to_string(e.count) + " of element " + shown_as(e.name) + ", more than the rest of the file holds", "copy or export the file again");
      left -= std::min(left, static_cast<std::size_t>(e.count) * size);
      if (e.name == "vertex") {
        if (vertices) fail("has two vertex elements");
        if (!e.has(kX) || !e.has(kY) || !e.has(kZ)) fail("vertices have no x, y and z");
        if (e.count >= kNoIndex) throw Error(Code::kUnsupported, input_.path, "more than 2^32 vertices");
        vertices = true;
        points_ = e.count;
        colored_ = e.has(kRed) && e.has(kGreen) && e.has(kBlue);
        textured_ = e.has(kU) && e.has(kV);
      } else if (e.name == "face") {
        if (faces) fail("has two face elements");
        faces = true;
        corner_textured_ = e.has(kTexcoords);
        // One of the two is enough; vertices' colours are the finer ones.
        face_colored_ = !colored_ && e.has(kRed) && e.has(kGreen) && e.has(kBlue);
      }
    }
    if (!vertices) fail("has no vertex element");
    if (!faces) fail("has no face element: points alone can't be baked");
  }

  void make_materials() {
    MtlMaterial mtl;
    mtl.path = input_.path;
    mtl.where = input_.path;
    mtl.material = plain_color("default", colored_ ? V3f(1, 1, 1) : Material().kd);
    mtl.map_kd.name = textured_ || corner_textured_ ? texture_ : "";
    mtl.kd_left_out = !colored_;
    if (!mtl.map_kd.name.empty()) face_colored_ = false;  // the picture is the finer colour
    if (!face_colored_) (void)add_mtl_material(mtl, scene_, report_);
  }

  // The next value, whatever its coding.
  double value(Type type) {
    if (ascii_) {
      text_.skip_space('\0');
      double read = 0;
      if (!text_.number(read)) {
        if (text_.at_end()) fail("ends in the middle of the data");
        fail("value is not a number (" + shown_as(text_.peek_word()) + ")");
      }
      return read;
    }
    const std::size_t size = size_of(type);
    if (text_.left() < size) fail("ends in the middle of the data");
    std::uint64_t word = 0;
    for (std::size_t i = 0; i < size; ++i)
      word |= std::uint64_t{static_cast<unsigned char>(text_.position()[i])} << 8 * (big_ ? size - 1 - i : i);
    text_.move_to(text_.position() + size);
    switch (type) {
      case Type::kInt8: return static_cast<std::int8_t>(word);
      case Type::kInt16: return static_cast<std::int16_t>(word);
      case Type::kInt32: return static_cast<std::int32_t>(word);
      case Type::kFloat: return std::bit_cast<float>(static_cast<std::uint32_t>(word));
      case Type::kDouble: return std::bit_cast<double>(word);
      default: return static_cast<double>(word);
    }
  }

  std::int64_t list_count(const Property& p) {
    const double count = value(p.count_type);
    const auto most = static_cast<double>(text_.left()) / (ascii_ ? 2.0 : static_cast<double>(size_of(p.type))) + 1;
    if (!(count >= 0) || count > most || count != std::floor(count)) fail("list of " + std::to_string(count) + " values is impossible");
    return static_cast<std::int64_t>(count);
  }

  // Integer colours are shares of their type's largest value; an ASCII file keeps the types.
  static double color_scale(Type type) {
    if (type == Type::kUint16) return 65535;
    return type == Type::kFloat || type == Type::kDouble ? 1 : 255;
  }

  void read_scalar(const Property& p, double* row) {
    double v = value(p.type);
    if (p.role >= kRed && p.role <= kBlue) v /= color_scale(p.type);
    if (p.role < kIndices) row[p.role] = v;
  }

  void skip_list(const Property& p) {
    for (std::int64_t n = list_count(p); n > 0; --n) (void)value(p.type);
  }

  void skip(const Element& element) {
    for (std::int64_t i = 0; i < element.count; ++i)
      for (const Property& p : element.properties)
        if (p.list()) skip_list(p);
        else (void)value(p.type);
  }

  void read_vertices(const Element& element) {
    Mesh& mesh = scene_.mesh;
    mesh.points.reserve(static_cast<std::size_t>(element.count));
    if (colored_) mesh.colors.reserve(static_cast<std::size_t>(element.count));
    if (textured_ && !corner_textured_) mesh.uvs.reserve(static_cast<std::size_t>(element.count));
    double row[kIndices] = {};
    for (std::int64_t i = 0; i < element.count; ++i) {
      for (const Property& p : element.properties)
        if (p.list()) skip_list(p);
        else read_scalar(p, row);
      mesh.points.emplace_back(row[kX], row[kY], row[kZ]);
      if (colored_) {
        V3f linear;
        if (!decode_color(row + kRed, linear)) ++bad_colors_;
        mesh.colors.push_back(linear);
      }
      if (textured_ && !corner_textured_) mesh.uvs.push_back(usable_uv(row[kU], row[kV]));
    }
  }

  V2f usable_uv(double u, double v) {
    if (std::abs(u) < 1e30 && std::abs(v) < 1e30) return {static_cast<float>(u), static_cast<float>(v)};
    ++bad_uvs_;
    return {0, 0};
  }

  void read_faces(const Element& element) {
    if (scene_.mesh.points.empty() && points_ > 0) fail("has its faces before its vertices");
    scene_.mesh.triangles.reserve(static_cast<std::size_t>(element.count));
    scene_.mesh.materials.reserve(static_cast<std::size_t>(element.count));
    double row[kIndices] = {};
    for (std::int64_t i = 0; i < element.count; ++i) {
      if (ascii_) text_.skip_space('\0');
      const char* at = text_.position();
      indices_.clear();
      texcoords_.clear();
      for (const Property& p : element.properties) {
        if (!p.list()) {
          read_scalar(p, row);
          continue;
        }
        if (p.role == kIgnored) {
          skip_list(p);
          continue;
        }
        std::vector<double>& values = p.role == kIndices ? indices_ : texcoords_;
        for (std::int64_t n = list_count(p); n > 0; --n) values.push_back(value(p.type));
      }
      add_face(at, row);
    }
  }

  void drop(const char* at, const std::string& reason) {
    if (bad_faces_++ > 0) return;
    bad_reason_ = reason;
    bad_at_ = at;
  }

  void add_face(const char* at, const double* row) {
    Mesh& mesh = scene_.mesh;
    if (indices_.size() < 3) return drop(at, "a face has " + std::to_string(indices_.size()) + " corners");
    corners_.clear();
    for (const double index : indices_) {
      if (!(index >= 0) || !(index < static_cast<double>(mesh.points.size())) || index != std::floor(index))
        return drop(at, "a vertex index is " + std::to_string(static_cast<std::int64_t>(std::isfinite(index) ? std::clamp(index, -9e15, 9e15) : -1)) + " of " +
                            std::to_string(mesh.points.size()) + " vertices");
      corners_.push_back(mesh.points[static_cast<std::size_t>(index)]);
    }
    if (mesh.uvs.size() + indices_.size() >= kNoIndex) throw Error(Code::kUnsupported, here(), "more than 2^32 texture coordinates");
    const bool own_uvs = corner_textured_ && texcoords_.size() == 2 * indices_.size();
    const auto first_uv = static_cast<std::uint32_t>(mesh.uvs.size());
    if (own_uvs)
      for (std::size_t i = 0; i < texcoords_.size(); i += 2) mesh.uvs.push_back(usable_uv(texcoords_[i], texcoords_[i + 1]));
    const std::uint32_t material = face_colored_ ? face_colors_.material(scene_, row + kRed) : 0;
    for (const auto& t : triangulator_(corners_)) {
      std::array<std::uint32_t, 3> points{}, uvs{kNoIndex, kNoIndex, kNoIndex};
      for (std::size_t c = 0; c < 3; ++c) {
        points[c] = static_cast<std::uint32_t>(indices_[t[c]]);
        if (own_uvs) uvs[c] = first_uv + t[c];
        else if (textured_ && !corner_textured_) uvs[c] = points[c];
      }
      mesh.triangles.push_back(points);
      mesh.materials.push_back(material);
      if (textured_ || corner_textured_) mesh.uv_corners.push_back(uvs);
    }
    if (triangulator_.was_not_simple() && not_simple_++ == 0) not_simple_at_ = at;
  }

  void finish() {
    face_colors_.report_to(report_, input_.path);
    if (bad_colors_) report_.issue("non-finite-color", "vertex colours that are not numbers: white used", bad_colors_, input_.path);
    if (bad_uvs_) report_.issue("bad-uv", "texture coordinates that are not numbers: 0 0 used", bad_uvs_, input_.path);
    if (bad_faces_) report_.issue("bad-index", "faces that can't be read were dropped; of the first, " + bad_reason_, bad_faces_, where(bad_at_));
    if (not_simple_) report_.issue("polygon-not-simple", "polygons that cross themselves were cut as fans", not_simple_, where(not_simple_at_));
    if (bad_faces_) finish_mesh(scene_, report_, where(bad_at_), "no face can be used: " + bad_reason_);
    else finish_mesh(scene_, report_, input_.path, "holds no face");
  }

  const Input& input_;
  TextScanner text_;
  Report& report_;
  Scene scene_;
  std::vector<Element> elements_;
  std::string texture_;
  bool ascii_ = true, ascii_after_header_ = true, big_ = false;  // the header is always text
  bool colored_ = false, textured_ = false, corner_textured_ = false, face_colored_ = false;
  std::int64_t points_ = 0;
  std::vector<double> indices_, texcoords_;
  std::vector<V3d> corners_;
  Triangulator triangulator_;
  FaceColors face_colors_;
  std::int64_t bad_faces_ = 0, not_simple_ = 0, bad_colors_ = 0, bad_uvs_ = 0;
  const char *bad_at_ = nullptr, *not_simple_at_ = nullptr;
  std::string bad_reason_;
};

}  // namespace

Scene read_ply(const Input& input, Report& report) { return PlyReader(input, report).read(); }

}  // namespace texel
