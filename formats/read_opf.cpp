// OPF (Open Plant Format) and GWA (Geometry With Attributes), the XML files of AMAPstudio, Xplo, AMAPsim and ARCHIMED.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "formats/error.h"
#include "formats/plant.h"
#include "formats/readers.h"
#include "formats/triangulate.h"
#include "formats/xml.h"

namespace texel {
namespace {

// What an element is, by its name and by what it stands in. Everything else, with all that is in it, is kOther.
enum class At : unsigned char {
  kTop, kOther, kOpf, kGwa, kMeshes, kMesh, kPoints, kFaces, kFace, kColor, kMaterials, kMaterial, kEmission, kAmbient, kDiffuse, kSpecular,
  kShininess, kShapes, kShape, kMeshIndex, kMaterialIndex, kNode, kGeometry, kShapeIndex, kMatrix, kTip, kBase
};

struct Step {
  At parent;
  std::string_view name;
  At child;
};
constexpr Step kSteps[] = {
    {At::kNode, "geometry", At::kGeometry},         {At::kNode, "follow", At::kNode},              {At::kNode, "branch", At::kNode},
    {At::kNode, "decomp", At::kNode},               {At::kGeometry, "shapeIndex", At::kShapeIndex}, {At::kGeometry, "mat", At::kMatrix},
    {At::kGeometry, "dUp", At::kTip},               {At::kGeometry, "dDwn", At::kBase},            {At::kFaces, "face", At::kFace},
    {At::kMesh, "points", At::kPoints},             {At::kMesh, "faces", At::kFaces},              {At::kMesh, "Color", At::kColor},
    {At::kMeshes, "mesh", At::kMesh},               {At::kGwa, "mesh", At::kMesh},                 {At::kMaterials, "material", At::kMaterial},
    {At::kMaterial, "emission", At::kEmission},     {At::kMaterial, "ambient", At::kAmbient},      {At::kMaterial, "diffuse", At::kDiffuse},
    {At::kMaterial, "specular", At::kSpecular},     {At::kMaterial, "shininess", At::kShininess},  {At::kShapes, "shape", At::kShape},
    {At::kShape, "meshIndex", At::kMeshIndex},      {At::kShape, "materialIndex", At::kMaterialIndex}, {At::kOpf, "meshBDD", At::kMeshes},
    {At::kOpf, "materialBDD", At::kMaterials},      {At::kOpf, "shapeBDD", At::kShapes},           {At::kOpf, "topology", At::kNode},
    {At::kTop, "opf", At::kOpf},                    {At::kTop, "gwa", At::kGwa},
};

// Elements whose text is read word by word.
bool has_words(At at) {
  switch (at) {
    case At::kPoints: case At::kFaces: case At::kFace: case At::kColor: case At::kEmission: case At::kAmbient: case At::kDiffuse:
    case At::kSpecular: case At::kShininess: case At::kMeshIndex: case At::kMaterialIndex: case At::kShapeIndex: case At::kMatrix:
    case At::kTip: case At::kBase: return true;
    default: return false;
  }
}

bool is_space(char c) { return is_blank(c) || is_line_end(c); }

// How often a defect was met, and where first.
struct Tally {
  std::int64_t count = 0;
  std::uint64_t line = 0;
  void add(std::uint64_t at) {
    if (count++ == 0) line = at;
  }
};

class OpfReader : public XmlHandler {
 public:
  OpfReader(const Input& input, Report& report) : parser_(input), report_(report), path_(input.path) {}

  Plant read() {
    parser_.run(*this, report_);
    resolve();
    tell(bad_references_, "plant-reference", "organs whose shape or mesh the file does not define; left out");
    tell(bad_matrices_, "plant-matrix", "organs whose matrix is not twelve finite numbers; left out");
    tell(cut_points_, "plant-points", "point lists that are not triples; the rest was cut off");
    tell(bad_faces_, "bad-index", "faces with fewer than three corners or an index that is no point; left out");
    tell(bad_points_, "non-finite", "faces with a corner that is not a finite number; left out");
    tell(duplicates_, "plant-duplicate-id", "meshes, shapes or materials whose Id is there already; the last one counts");
    tell(no_material_, "material-missing", "shapes whose material the file does not define: neutral grey is used for them");
    tell(bad_colors_, "non-finite-color", "colours that are not three numbers; neutral grey instead");
    tell(alpha_, "plant-alpha", "materials whose diffuse colour has an alpha below 1; AMAP programs do not use it, and they are opaque");
    tell(odd_tapers_, "plant-taper", "tapered organs whose matrix scales across, too; both were applied");
    tell(not_simple_, "polygon-not-simple", "polygons that cross themselves were cut as fans");
    return std::move(plant_);
  }

  void start(const XmlParser&, std::string_view name, const XmlAttributes& attributes) override {
    flush();  // a word ends at a tag
    const At parent = stack_.back();
    At at = At::kOther;
    for (const Step& step : kSteps)
      if (step.parent == parent && step.name == name) at = step.child;
    if (parent == At::kTop && at == At::kOther) fail("is not a plant: its outermost element is <" + shown_name(name) + "> rather than <opf> or <gwa>");
    stack_.push_back(at);
    switch (at) {
      case At::kOpf: check_version(attributes, "2.0"); break;
      case At::kGwa: check_version(attributes, "1.0"); break;
      case At::kMesh: start_mesh(attributes); break;
      case At::kFace: end_faces(); break;  // what stood before it without a tag
      case At::kMaterial: material_ = {}; material_id_ = id_of(attributes, next_material_++); break;
      case At::kShape: shape_ = {}; shape_id_ = id_of(attributes, next_shape_++); break;
      case At::kNode: node_id_ = id_of(attributes, -1); break;
      case At::kGeometry: start_geometry(); break;
      default: break;
    }
  }

  void text(const XmlParser&, std::string_view piece) override {
    if (!has_words(stack_.back())) return;
    const char *at = piece.data(), *end = at + piece.size();
    while (at != end) {
      if (is_space(*at)) {
        flush();
        ++at;
        continue;
      }
      const char* first = at;
      while (at != end && !is_space(*at)) ++at;
      if (at != end && carried_.empty()) {
        word({first, static_cast<std::size_t>(at - first)});
      } else {  // may go on in the next piece
        carried_.append(first, at);
        if (carried_.size() > 4096) fail("a number of more than 4096 characters (" + shown_as(carried_) + ")");
      }
    }
  }

  void end(const XmlParser&) override {
    flush();
    const At at = stack_.back();
    stack_.pop_back();
    switch (at) {
      case At::kFace: end_face(); break;
      case At::kFaces: end_faces(); break;
      case At::kMesh: end_mesh(); break;
      case At::kMaterial: end_material(); break;
      case At::kShape: end_shape(); break;
      case At::kGeometry: end_geometry(); break;
      default: break;
    }
  }

 private:
  struct Color {
    double v[4] = {};
    int count = 0;
    void add(double value) {
      if (count < 4) v[count] = value;
      ++count;
    }
    [[nodiscard]] bool good() const { return count >= 3 && std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }
    [[nodiscard]] bool black() const { return v[0] <= 0 && v[1] <= 0 && v[2] <= 0; }
  };
  struct MaterialText {
    Color emission, ambient, diffuse, specular;
    double shininess = 0;
  };
  struct Shape {
    std::int64_t mesh = kNone, material = kNone;
    std::uint64_t line = 0;
  };
  struct Placed {  // an organ whose shape is not looked up yet
    std::int64_t shape;
    std::uint64_t line;
  };
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();

  [[noreturn]] void fail(const std::string& message) const { throw Error(Code::kBadInput, parser_.where(), message); }
  static std::string shown_name(std::string_view name) {
    const std::string quoted = shown_as(name);
    return quoted.substr(1, quoted.size() - 2);
  }
  void tell(const Tally& tally, const char* id, const char* text) {
    if (tally.count) report_.issue(id, text, tally.count, parser_.where(tally.line));
  }

  void check_version(const XmlAttributes& attributes, std::string_view known) {
    const char* version = attributes.find("version");
    if (version && version != known)
      report_.issue("plant-version", "version " + shown_as(version) + " of the format is not known; read as " + std::string(known), 1, parser_.where());
  }

  std::int64_t id_of(const XmlAttributes& attributes, std::int64_t otherwise) const {
    const char* text = attributes.find("Id");
    if (!text) text = attributes.find("id");
    if (!text) return otherwise;
    const std::string_view all(text);
    std::int64_t id = 0;
    const auto [stop, error] = std::from_chars(all.data(), all.data() + all.size(), id);
    if (error != std::errc{} || stop != all.data() + all.size()) {
      if (otherwise == -1) return -1;  // of a node nobody asks
      fail("an Id is not a whole number (" + shown_as(all) + ")");
    }
    return id;
  }

  void flush() {
    if (carried_.empty()) return;
    word(carried_);
    carried_.clear();
  }

  [[nodiscard]] double number(std::string_view word) const {
    double value = 0;
    const char* end = word.data() + word.size();
    if (parse_number(word.data(), end, value) != end) fail("is not a number (" + shown_as(word) + ")");
    return value;
  }

  void word(std::string_view word) {
    switch (stack_.back()) {
      case At::kPoints:
        point_[point_at_++] = number(word);
        if (point_at_ < 3) break;
        points_.emplace_back(point_[0], point_[1], point_[2]);
        point_at_ = 0;
        break;
      case At::kFaces:
      case At::kFace: indices_.push_back(index(word)); break;
      case At::kColor:
        if (word == "Color") break;
        fractions_ = fractions_ || word.find('.') != std::string_view::npos;
        color_.add(number(word));
        break;
      case At::kEmission: material_.emission.add(number(word)); break;
      case At::kAmbient: material_.ambient.add(number(word)); break;
      case At::kDiffuse: material_.diffuse.add(number(word)); break;
      case At::kSpecular: material_.specular.add(number(word)); break;
      case At::kShininess: material_.shininess = number(word); break;
      case At::kMeshIndex: shape_.mesh = key(word); break;
      case At::kMaterialIndex: shape_.material = key(word); break;
      case At::kShapeIndex: shape_index_ = key(word); break;
      case At::kMatrix:
        if (matrix_count_ < 12) organ_.matrix.m[matrix_count_] = number(word);
        ++matrix_count_;
        break;
      case At::kTip: organ_.tip = factor(word); break;
      case At::kBase: organ_.base = factor(word); break;
      default: break;
    }
  }

  [[nodiscard]] double factor(std::string_view word) const { return word == "NA" ? std::numeric_limits<double>::quiet_NaN() : number(word); }

  [[nodiscard]] std::int64_t key(std::string_view word) const {
    const double value = number(word);
    if (!(std::abs(value) < 9e15) || value != std::floor(value)) fail("an index is not a whole number (" + shown_as(word) + ")");
    return static_cast<std::int64_t>(value);
  }
  [[nodiscard]] std::uint32_t index(std::string_view word) const {
    const double value = number(word);
    return value >= 0 && value < kNoIndex && value == std::floor(value) ? static_cast<std::uint32_t>(value) : kNoIndex;
  }

  void start_mesh(const XmlAttributes& attributes) {
    mesh_id_ = id_of(attributes, next_mesh_++);
    std::string scaled;
    if (const char* given = attributes.find("enableScale")) scaled = std::string(given).substr(0, 8);
    std::transform(scaled.begin(), scaled.end(), scaled.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    tapers_ = scaled != "false" && scaled != "0";
    points_.clear();
    point_at_ = 0;
    indices_.clear();
    face_ends_.clear();
    face_start_ = 0;
    color_ = {};
    fractions_ = false;
    mesh_line_ = parser_.line();
  }

  void end_face() {
    if (indices_.size() > face_start_) face_ends_.push_back(indices_.size());
    else bad_faces_.add(parser_.line());
    face_start_ = indices_.size();
  }

  // Indices without <face> about them are triples.
  void end_faces() {
    while (indices_.size() - face_start_ >= 3) face_ends_.push_back(face_start_ += 3);
    if (indices_.size() > face_start_) {
      face_ends_.push_back(face_start_ = indices_.size());
      indices_.back() = kNoIndex;  // counted as a bad face
    }
  }

  void end_mesh() {
    if (point_at_) cut_points_.add(mesh_line_);
    PlantMesh mesh;
    mesh.tapers = tapers_;
    std::size_t first = 0;
    for (const std::size_t last : face_ends_) {
      add_face({indices_.data() + first, last - first}, mesh);
      first = last;
    }
    mesh.points.swap(points_);
    points_ = {};
    settle_points(mesh);
    const bool is_gwa = stack_.back() == At::kGwa;
    if (is_gwa && mesh.triangles.empty()) return;
    const auto slot = static_cast<std::uint32_t>(plant_.meshes.size());
    plant_.meshes.push_back(std::move(mesh));
    if (is_gwa) {
      plant_.meshes.back().tapers = false;
      PlantOrgan organ;
      organ.mesh = slot;
      organ.material = gwa_material();
      organ.id = mesh_id_;
      plant_.organs.push_back(organ);
    } else if (!mesh_of_.insert_or_assign(mesh_id_, slot).second) {
      duplicates_.add(mesh_line_);
    }
  }

  void add_face(std::span<const std::uint32_t> face, PlantMesh& mesh) {
    corners_.clear();
    if (face.size() < 3 || std::any_of(face.begin(), face.end(), [&](std::uint32_t i) { return i >= points_.size(); })) return bad_faces_.add(mesh_line_);
    for (const std::uint32_t i : face) {
      const V3d& p = points_[i];
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) return bad_points_.add(mesh_line_);
      corners_.push_back(p);
    }
    for (const auto& t : triangulator_(corners_)) mesh.triangles.push_back({face[t[0]], face[t[1]], face[t[2]]});
    if (triangulator_.was_not_simple()) not_simple_.add(mesh_line_);
  }

  std::uint32_t gwa_material() {
    if (color_.count == 0) return neutral();
    if (!color_.good()) {
      bad_colors_.add(mesh_line_);
      return neutral();
    }
    double rgb[3] = {color_.v[0], color_.v[1], color_.v[2]};
    const bool fractions = fractions_ && *std::max_element(rgb, rgb + 3) <= 1;
    std::uint32_t packed = 0;
    for (double& v : rgb) {
      v = std::clamp(fractions ? v : v / 255, 0.0, 1.0);
      packed = packed << 8 | static_cast<std::uint32_t>(std::lround(v * 255));
    }
    const auto [at, is_new] = colors_.try_emplace(packed, static_cast<std::uint32_t>(plant_.materials.size()));
    if (is_new) {
      std::string name = "color_";
      for (int shift = 20; shift >= 0; shift -= 4) name += "0123456789abcdef"[packed >> shift & 15];
      plant_.materials.push_back(plain_color(name, plant_color(rgb)));
    }
    return at->second;
  }

  void end_material() {
    const MaterialText& text = material_;
    Material m = plain_organ();
    m.name = "material_" + std::to_string(material_id_);
    const Color& albedo = text.diffuse.good() && text.diffuse.black() && text.ambient.good() ? text.ambient : text.diffuse;
    if (albedo.good()) m.kd = plant_color(albedo.v);
    else if (text.diffuse.count > 0) bad_colors_.add(parser_.line());
    if (text.diffuse.count > 3 && text.diffuse.v[3] < 1) alpha_.add(parser_.line());
    if (text.emission.good()) m.ke = plant_color(text.emission.v);
    if (text.specular.good() && !text.specular.black()) {
      m.ks = plant_color(text.specular.v);
      if (text.shininess >= 0) m.roughness = static_cast<float>(std::sqrt(2 / (text.shininess + 2)));
    }
    const auto slot = static_cast<std::uint32_t>(plant_.materials.size());
    plant_.materials.push_back(std::move(m));
    if (!material_of_.insert_or_assign(material_id_, slot).second) duplicates_.add(parser_.line());
  }

  void end_shape() {
    shape_.line = parser_.line();
    if (!shape_of_.insert_or_assign(shape_id_, shape_).second) duplicates_.add(shape_.line);
  }

  void start_geometry() {
    organ_ = {};
    organ_.id = node_id_;
    shape_index_ = kNone;
    matrix_count_ = 0;
  }

  void end_geometry() {
    if (shape_index_ == kNone) return;  // axes and individuals are not drawn
    const auto& m = organ_.matrix.m;
    const bool whole = matrix_count_ == 0 || matrix_count_ == 12 || matrix_count_ == 16;
    if (!whole || std::any_of(m.begin(), m.end(), [](double v) { return !(std::abs(v) <= 1e100); })) return bad_matrices_.add(parser_.line());
    plant_.organs.push_back(organ_);
    placed_.push_back({shape_index_, parser_.line()});
  }

  std::uint32_t neutral() {
    if (neutral_ == kNoIndex) {
      neutral_ = static_cast<std::uint32_t>(plant_.materials.size());
      plant_.materials.push_back(plain_organ());
    }
    return neutral_;
  }

  std::uint32_t material_of(const Shape& shape) {
    if (const auto at = material_of_.find(shape.material); at != material_of_.end()) return at->second;
    if (shape.material != kNone && !material_of_.empty()) no_material_.add(shape.line);
    return neutral();
  }

  // Keys -> places, once everything is known: the sections may come in any order.
  void resolve() {
    struct Found {
      std::uint32_t mesh, material;
    };
    std::map<std::int64_t, Found> found;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < placed_.size(); ++i) {  // a GWA's organs are placed already: it has no nodes
      auto at = found.find(placed_[i].shape);
      if (at == found.end()) {
        const auto shape = shape_of_.find(placed_[i].shape);
        const auto mesh = shape == shape_of_.end() ? mesh_of_.end() : mesh_of_.find(shape->second.mesh);
        if (mesh == mesh_of_.end()) {
          bad_references_.add(placed_[i].line);
          continue;
        }
        at = found.emplace(placed_[i].shape, Found{mesh->second, material_of(shape->second)}).first;
      }
      PlantOrgan organ = plant_.organs[i];
      organ.mesh = at->second.mesh;
      if (plant_.meshes[organ.mesh].triangles.empty()) continue;
      organ.material = at->second.material;
      if (plant_.meshes[organ.mesh].tapers && std::isfinite(organ.base) && std::isfinite(organ.tip) && scales_across(organ.matrix)) odd_tapers_.add(placed_[i].line);
      plant_.organs[kept++] = organ;
    }
    if (!placed_.empty()) plant_.organs.resize(kept);
    placed_ = {};
  }

  static bool scales_across(const Affine& a) {
    for (std::size_t c = 1; c < 3; ++c)
      if (std::abs(std::sqrt(a.m[c] * a.m[c] + a.m[4 + c] * a.m[4 + c] + a.m[8 + c] * a.m[8 + c]) - 1) > 1e-3) return true;
    return false;
  }

  XmlParser parser_;
  Report& report_;
  std::string path_;
  Plant plant_;
  std::vector<At> stack_{At::kTop};
  std::string carried_;  // a word cut by the end of a piece

  // The mesh being read.
  std::int64_t mesh_id_ = 0, next_mesh_ = 0;
  std::uint64_t mesh_line_ = 0;
  bool tapers_ = true, fractions_ = false;
  double point_[3] = {};
  int point_at_ = 0;
  std::vector<V3d> points_, corners_;
  std::vector<std::uint32_t> indices_;
  std::vector<std::size_t> face_ends_;
  std::size_t face_start_ = 0;
  Color color_;
  Triangulator triangulator_;

  // The material, shape or organ being read.
  MaterialText material_;
  std::int64_t material_id_ = 0, next_material_ = 0, shape_id_ = 0, next_shape_ = 0, node_id_ = -1, shape_index_ = kNone;
  Shape shape_;
  PlantOrgan organ_;
  std::size_t matrix_count_ = 0;

  std::map<std::int64_t, std::uint32_t> mesh_of_, material_of_;
  std::map<std::int64_t, Shape> shape_of_;
  std::map<std::uint32_t, std::uint32_t> colors_;
  std::vector<Placed> placed_;  // as plant_.organs
  std::uint32_t neutral_ = kNoIndex;
  Tally bad_references_, bad_matrices_, cut_points_, bad_faces_, bad_points_, duplicates_, no_material_, bad_colors_, alpha_, odd_tapers_, not_simple_;
};

}  // namespace

Plant read_opf(const Input& input, Report& report) { return OpfReader(input, report).read(); }

}  // namespace texel
