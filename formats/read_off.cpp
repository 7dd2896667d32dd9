// OFF, Geomview's object file format: [ST][C][N]OFF, ASCII or big-endian binary.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "formats/error.h"
#include "formats/readers.h"
#include "formats/triangulate.h"

namespace texel {
namespace {

struct Header {
  bool texture = false, color = false, normal = false, binary = false;
};

class OffReader {
 public:
  OffReader(const Input& input, Report& report) : input_(input), text_(input), report_(report) {}

  Scene read() {
    read_header();
    read_counts();
    if (header_.binary) {
      for (std::int64_t i = 0; i < vertices_; ++i) binary_vertex();
      for (std::int64_t i = 0; i < faces_; ++i) binary_face();
    } else {
      for (std::int64_t i = 0; i < vertices_; ++i) vertex();
      for (std::int64_t i = 0; i < faces_; ++i) face();
    }
    face_colors_.report_to(report_, input_.path);
    if (bad_colors_) report_.issue("non-finite-color", "vertex colours that are not numbers: white used", bad_colors_, input_.path);
    if (bad_faces_) report_.issue("bad-index", "faces dropped because " + bad_reason_, bad_faces_, bad_where_);
    if (not_simple_)
      report_.issue("polygon-not-simple", "polygons that cross themselves were cut as fans", not_simple_, not_simple_where_);
    if (!bad_where_.empty()) finish_mesh(scene_, report_, bad_where_, "no face can be used: " + bad_reason_);
    else finish_mesh(scene_, report_, input_.path, "holds no face");
    return std::move(scene_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) { throw Error(Code::kBadInput, here(), message); }
  [[nodiscard]] std::string here() const {
    if (!header_.binary) return text_.where();
    return input_.path + ": byte " + std::to_string(text_.position() - input_.bytes.data());
  }

  void read_header() {
    text_.skip_space('#');
    const char* start = text_.position();
    std::string_view word = text_.word();
    std::string_view rest = word;
    const auto take = [&rest](std::string_view prefix) {
      if (!rest.starts_with(prefix)) return false;
      rest.remove_prefix(prefix.size());
      return true;
    };
    header_.texture = take("ST");
    header_.color = take("C");
    header_.normal = take("N");
    const bool four = take("4"), many = take("n");
    if (!take("OFF")) {  // the keyword may be left out: the counts come first then
      header_ = {};
      text_.move_to(start);
      if (word.empty() || !is_digit(word.front())) fail("is not an OFF file: begins with " + shown_as(word));
      return;
    }
    if (four || many) throw Error(Code::kUnsupported, text_.where(), "OFF of other than three dimensions (" + std::string(word) + ")");
    if (!rest.empty()) text_.move_to(word.data() + word.size() - rest.size());
    if (text_.peek_word() == "BINARY") {
      (void)text_.word();
      text_.next_line();
      header_.binary = true;
    }
  }

  void read_counts() {
    if (header_.binary) {
      vertices_ = binary_integer();
      faces_ = binary_integer();
      (void)binary_integer();
    } else {
      vertices_ = integer("vertex count");
      faces_ = integer("face count");
      double edges = 0;
      (void)text_.number(edges);  // always there, never used, sometimes missing
    }
    // The shortest vertex is three digits and three blanks, the shortest face a digit and a blank (binary: 12 and 8 bytes).
    const auto left = static_cast<std::int64_t>(text_.left()) + 1;
    if (vertices_ < 0 || faces_ < 0 || vertices_ > left / (header_.binary ? 12 : 6) + 1 || faces_ > left / (header_.binary ? 8 : 2) + 1)
      fail("states " + std::to_string(vertices_) + " vertices and " + std::to_string(faces_) + " faces, more than the file can hold");
    scene_.mesh.points.reserve(static_cast<std::size_t>(vertices_));
    scene_.mesh.triangles.reserve(static_cast<std::size_t>(faces_));
    scene_.mesh.materials.reserve(static_cast<std::size_t>(faces_));
  }

  double number(const char* what) {
    text_.skip_space('#');
    double value = 0;
    if (!text_.number(value)) {
      if (text_.at_end()) fail(std::string("ends where a ") + what + " is expected");
      fail(std::string(what) + " is not a number (" + shown_as(text_.peek_word()) + ")");
    }
    return value;
  }

  std::int64_t integer(const char* what) {
    const double value = number(what);
    if (!(std::abs(value) < 9e15) || value != std::floor(value)) fail(std::string(what) + " is not a whole number");
    return static_cast<std::int64_t>(value);
  }

  // The colour on the rest of the line: 3 or 4 numbers, whole ones of 0-255 or fractions of 0-1. How many were read.
  int line_numbers(double* values, bool& whole, int most) {
    int count = 0;
    whole = true;
    while (count < most && !text_.line_is_over() && text_.peek() != '#') {
      const std::string_view word = text_.peek_word();
      if (!text_.number(values[count])) break;
      whole = whole && word.find_first_of(".eE") == std::string_view::npos;
      ++count;
    }
    return count;
  }

  void vertex() {
    const double x = number("coordinate"), y = number("coordinate"), z = number("coordinate");
    scene_.mesh.points.emplace_back(x, y, z);
    if (header_.normal)
      for (int i = 0; i < 3; ++i) (void)number("normal");
    double rest[6];
    bool whole = true;
    const int color_numbers = header_.color ? line_numbers(rest, whole, header_.texture ? 6 : 4) : 0;
    int used = color_numbers;
    if (header_.texture && header_.color) used = color_numbers - 2;  // the last two are the texture coordinates
    if (header_.color) {
      if (used < 3) fail("vertex colour of fewer than three numbers");
      add_vertex_color(rest, whole && used == color_numbers ? 255.0 : scale_of(rest, used));
    }
    if (header_.texture) {
      double u = 0, v = 0;
      if (header_.color) {
        u = rest[used];
        v = rest[used + 1];
      } else {
        u = number("texture coordinate");
        v = number("texture coordinate");
      }
      add_uv(u, v);
    }
  }

  // Beside texture coordinates the spelling can't be told apart per column: anything over 1 means 0-255.
  static double scale_of(const double* values, int count) {
    return std::any_of(values, values + count, [](double v) { return v > 1; }) ? 255.0 : 1.0;
  }

  void add_vertex_color(const double* values, double scale) {
    const double rgb[3] = {values[0] / scale, values[1] / scale, values[2] / scale};
    V3f linear;
    if (!decode_color(rgb, linear)) ++bad_colors_;
    scene_.mesh.colors.push_back(linear);
  }

  void add_uv(double u, double v) {
    const bool usable = std::abs(u) < 1e30 && std::abs(v) < 1e30;
    scene_.mesh.uvs.push_back(usable ? V2f(static_cast<float>(u), static_cast<float>(v)) : V2f(0, 0));
  }

  void face() {
    const std::int64_t corners = integer("corner count");
    if (corners < 0 || corners > static_cast<std::int64_t>(text_.left())) fail("corner count " + std::to_string(corners) + " is impossible");
    const char* start = text_.position();
    indices_.clear();
    for (std::int64_t i = 0; i < corners; ++i) indices_.push_back(integer("vertex index"));
    double rest[4];
    bool whole = true;
    const int count = line_numbers(rest, whole, 4);
    text_.next_line();
    if (count >= 3)
      for (int i = 0; i < 3; ++i) rest[i] /= whole ? 255.0 : 1.0;
    add_face(start, count >= 3 ? rest : nullptr);
  }

  void binary_vertex() {
    double v[12] = {};
    const int numbers = 3 + (header_.normal ? 3 : 0) + (header_.color ? 4 : 0) + (header_.texture ? 2 : 0);
    for (int i = 0; i < numbers; ++i) v[i] = std::bit_cast<float>(binary_word());
    scene_.mesh.points.emplace_back(v[0], v[1], v[2]);
    const double* at = v + (header_.normal ? 6 : 3);
    if (header_.color) {
      add_vertex_color(at, 1);
      at += 4;
    }
    if (header_.texture) add_uv(at[0], at[1]);
  }

  void binary_face() {
    const std::int64_t corners = binary_integer();
    if (corners < 0 || corners > static_cast<std::int64_t>(text_.left() / 4)) fail("corner count " + std::to_string(corners) + " is impossible");
    const char* start = text_.position();
    indices_.clear();
    for (std::int64_t i = 0; i < corners; ++i) indices_.push_back(binary_integer());
    const std::int64_t count = binary_integer();
    if (count < 0 || count > 4) fail("face colour of " + std::to_string(count) + " numbers");
    double rgb[4] = {};
    for (std::int64_t i = 0; i < count; ++i) rgb[i] = std::bit_cast<float>(binary_word());
    add_face(start, count >= 3 ? rgb : nullptr);
  }

  std::uint32_t binary_word() {
    if (text_.left() < 4) fail("ends in the middle of the data");
    std::uint32_t word = 0;
    std::memcpy(&word, text_.position(), 4);
    text_.move_to(text_.position() + 4);
    return std::endian::native == std::endian::little ? __builtin_bswap32(word) : word;
  }
  std::int64_t binary_integer() { return static_cast<std::int32_t>(binary_word()); }

  void drop(const char* start, const std::string& reason) {
    if (bad_faces_++ > 0) return;
    bad_reason_ = reason;
    bad_where_ = header_.binary ? here() : text_.where(start);
  }

  void add_face(const char* start, const double* rgb) {
    if (indices_.size() < 3) return drop(start, "a face has " + std::to_string(indices_.size()) + " corners");
    corners_.clear();
    for (const std::int64_t index : indices_) {
      if (index < 0 || index >= vertices_)
        return drop(start, "a vertex index is " + std::to_string(index) + " of " + std::to_string(vertices_) + " vertices");
      corners_.push_back(scene_.mesh.points[static_cast<std::size_t>(index)]);
    }
    const std::uint32_t material = rgb ? face_colors_.material(scene_, rgb) : plain_material();
    Mesh& mesh = scene_.mesh;
    for (const auto& t : triangulator_(corners_)) {
      mesh.triangles.push_back({static_cast<std::uint32_t>(indices_[t[0]]), static_cast<std::uint32_t>(indices_[t[1]]),
                                static_cast<std::uint32_t>(indices_[t[2]])});
      mesh.materials.push_back(material);
      if (header_.texture) mesh.uv_corners.push_back(mesh.triangles.back());
    }
    if (triangulator_.was_not_simple() && not_simple_++ == 0) not_simple_where_ = header_.binary ? here() : text_.where(start);
  }

  std::uint32_t plain_material() {
    if (plain_ == kNoIndex) {
      plain_ = static_cast<std::uint32_t>(scene_.materials.size());
      scene_.materials.push_back(plain_color("default", header_.color ? V3f(1, 1, 1) : Material().kd));
    }
    return plain_;
  }

  const Input& input_;
  TextScanner text_;
  Report& report_;
  Header header_;
  Scene scene_;
  std::int64_t vertices_ = 0, faces_ = 0;
  std::vector<std::int64_t> indices_;
  std::vector<V3d> corners_;
  Triangulator triangulator_;
  FaceColors face_colors_;
  std::uint32_t plain_ = kNoIndex;
  std::int64_t bad_faces_ = 0, not_simple_ = 0, bad_colors_ = 0;
  std::string bad_where_, bad_reason_, not_simple_where_;
};

}  // namespace

Scene read_off(const Input& input, Report& report) { return OffReader(input, report).read(); }

}  // namespace texel
