// Curves in the XML scenes of Embree's tutorials: <Curves basis="linear|bezier|bspline|hermite|catmull_rom">, <BezierCurves>, <BSplineCurves>,
// <LineSegments>, <RoundLineSegments>, <ConeSegments> and their flat relatives, under any <Group> and <Transform>; and <FurBall>, which says only how
// large a ball of hair is. Names and arrays: Embree, tutorials/common/scenegraph/xml_loader.cpp.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>

#include "formats/error.h"
#include "formats/fibres.h"
#include "formats/plant.h"
#include "formats/random.h"
#include "formats/readers.h"
#include "formats/xml.h"

namespace texel {
namespace {

constexpr double kChordError = 1.0 / 16384;               // of the diagonal of an element's control points: a sixteenth of a voxel at 1024
constexpr std::size_t kMostPoints = std::size_t{1} << 26;  // of curves cut into pieces: an index of two bytes may ask for 256 of them
constexpr std::size_t kMostDepth = 4096;                   // of transforms within each other

enum class At : unsigned char { kOther, kTransform, kSpace, kCurves, kFurBall, kPositions, kTangents, kIndices, kMaterial, kParameters, kKd, kAssign };
enum class Basis { kLinear, kBezier, kBspline, kHermite, kCatmullRom };

struct Kind {
  std::string_view name;
  Basis basis;
  bool flat;
  std::size_t stride;  // numbers an entry of <indices> has; the first counts
};
constexpr Kind kKinds[] = {
    {"BezierCurves", Basis::kBezier, false, 2}, {"BezierHair", Basis::kBezier, true, 2},   {"Hair", Basis::kBezier, true, 2},
    {"BSplineCurves", Basis::kBspline, false, 1}, {"BSplineHair", Basis::kBspline, true, 1}, {"LineSegments", Basis::kLinear, true, 1},
    {"RoundLineSegments", Basis::kLinear, false, 1}, {"ConeSegments", Basis::kLinear, false, 1},
};
constexpr std::pair<std::string_view, Basis> kBases[] = {
    {"linear", Basis::kLinear}, {"bezier", Basis::kBezier}, {"bspline", Basis::kBspline}, {"hermite", Basis::kHermite}, {"catmull_rom", Basis::kCatmullRom},
};

class CurveReader : public XmlHandler {
 public:
  CurveReader(const Input& input, Report& report) : parser_(input), report_(report), path_(input.path), builder_(scene_.fibres, false) {}

  Scene read() {
    parser_.run(*this, report_);
    builder_.report_to(report_, path_);
    if (bad_indices_) report_.issue("bad-index", "curves whose index is no control point; left out", bad_indices_, path_);
    if (flat_) report_.issue("curves-flat", "flat curves; they were read as round ones of the same width", flat_, path_);
    if (ignored_) report_.issue("xml-ignored", "meshes, lights and other elements that are no curves; they were not read", ignored_, path_);
    if (fur_balls_)
      report_.issue("furball-made", "FurBall elements, which hold a radius and no curves: " + std::to_string(kFurHairs) + " curved hairs were made for each", fur_balls_, path_);
    if (scene_.fibres.strands() == 0) throw Error(Code::kBadInput, path_, builder_.reason(), "give a file with curves");
    return std::move(scene_);
  }

  void start(const XmlParser&, std::string_view name, const XmlAttributes& attributes) override {
    flush();
    if (stack_.empty() && name != "scene") throw Error(Code::kBadInput, parser_.where(), "is no scene of curves: its outermost element is <" + plain(name) + "> rather than <scene>");
    At at = At::kOther;
    const bool in_curves = !stack_.empty() && (stack_.back() == At::kCurves || stack_.back() == At::kFurBall);
    if (name == "Transform") {
      at = At::kTransform;
      if (spaces_.size() >= kMostDepth) throw Error(Code::kUnsupported, parser_.where(), "transforms are nested more than " + std::to_string(kMostDepth) + " deep");
      spaces_.push_back(spaces_.empty() ? Affine{} : spaces_.back());
    } else if (name == "AffineSpace" && !stack_.empty() && stack_.back() == At::kTransform) {
      at = At::kSpace;
    } else if (const Kind kind = kind_of(name, attributes); !kind.name.empty()) {
      at = At::kCurves;
      begin_curves(kind);
    } else if (name == "FurBall") {
      at = At::kFurBall;
      begin_curves({});
      const char* radius = attributes.find("radius");
      if (!radius || parse_number(radius, radius + std::strlen(radius), fur_radius_) != radius + std::strlen(radius) || !(fur_radius_ > 0) || !(fur_radius_ <= 1e100))
        throw Error(Code::kBadInput, parser_.where(), "a FurBall without a radius above 0");
    } else if (in_curves && (name == "positions" || name == "tangents" || name == "indices") && attributes.find("ofs")) {
      throw Error(Code::kUnsupported, parser_.where(), "the numbers of <" + plain(name) + "> are in a .bin file, which is not read", "write the scene with its numbers in the XML");
    } else if (name == "positions" && in_curves) {
      at = At::kPositions;
    } else if (name == "tangents" && in_curves) {
      at = At::kTangents;
    } else if (name == "indices" && in_curves) {
      at = At::kIndices;
    } else if (name == "assign") {
      at = At::kAssign;
      const char* id = attributes.find("id");
      assigned_ = id ? id : "";
    } else if (name == "material" && !stack_.empty()) {
      at = At::kMaterial;
      const char* id = attributes.find("id");
      material_id_ = id ? id : stack_.back() == At::kAssign ? assigned_ : "";
      kd_.clear();
    } else if (name == "parameters" && !stack_.empty() && stack_.back() == At::kMaterial) {
      at = At::kParameters;
    } else if (!stack_.empty() && stack_.back() == At::kParameters) {
      const char* parameter = attributes.find("name");
      if (parameter && (std::strcmp(parameter, "Kd") == 0 || std::strcmp(parameter, "reflectance") == 0 || std::strcmp(parameter, "Kr") == 0)) at = At::kKd;
    } else if (stack_.size() >= 1 && (name.ends_with("Mesh") || name.ends_with("Light") || name == "obj" || name == "extern" || name == "ref")) {
      ++ignored_;
    }
    stack_.push_back(at);
  }

  void text(const XmlParser&, std::string_view piece) override {
    if (!numbers_of(stack_.empty() ? At::kOther : stack_.back())) return;
    for (const char c : piece) {
      if (is_blank(c) || is_line_end(c)) flush();
      else if (word_.size() < 4096) word_.push_back(c);
      else throw Error(Code::kBadInput, parser_.where(), "a number of more than 4096 characters (" + shown_as(word_) + ")");
    }
  }

  void end(const XmlParser&) override {
    flush();
    const At at = stack_.back();
    stack_.pop_back();
    if (at == At::kTransform) spaces_.pop_back();
    else if (at == At::kSpace) end_space();
    else if (at == At::kMaterial) end_material();
    else if (at == At::kCurves) end_curves();
    else if (at == At::kFurBall) end_fur_ball();
  }

 private:
  static constexpr int kFurHairs = 400;

  static std::string plain(std::string_view name) {
    const std::string quoted = shown_as(name);
    return quoted.substr(1, quoted.size() - 2);
  }

  Kind kind_of(std::string_view name, const XmlAttributes& attributes) {
    for (const Kind& kind : kKinds)
      if (kind.name == name) return kind;
    if (name != "Curves") return {};
    const char *basis = attributes.find("basis"), *type = attributes.find("type");
    Kind kind{"Curves", Basis::kLinear, type && std::strcmp(type, "round") != 0 && std::strcmp(type, "surface") != 0, 1};
    const std::string_view b = basis ? basis : "";
    const auto* known = std::find_if(std::begin(kBases), std::end(kBases), [&](const auto& row) { return row.first == b; });
    if (known == std::end(kBases)) throw Error(Code::kUnsupported, parser_.where(), "curves of the basis " + shown_as(b) + " are not read", "use linear, bezier, bspline, hermite or catmull_rom");
    kind.basis = known->second;
    return kind;
  }

  std::vector<double>* numbers_of(At at) {
    switch (at) {
      case At::kSpace: return &space_;
      case At::kPositions: return &positions_;
      case At::kTangents: return &tangents_;
      case At::kIndices: return &indices_;
      case At::kKd: return &kd_;
      default: return nullptr;
    }
  }

  void flush() {
    if (word_.empty()) return;
    double value = 0;
    if (parse_number(word_.data(), word_.data() + word_.size(), value) != word_.data() + word_.size())
      throw Error(Code::kBadInput, parser_.where(), "not a number (" + shown_as(word_) + ")");
    if (std::vector<double>* to = numbers_of(stack_.back())) to->push_back(value);
    word_.clear();
  }

  void end_space() {
    Affine given;
    bool good = space_.size() == 12;
    for (std::size_t i = 0; good && i < 12; ++i) {
      good = std::isfinite(space_[i]);
      given.m[i] = space_[i];
    }
    if (!good) throw Error(Code::kBadInput, parser_.where(), "an AffineSpace is not twelve finite numbers");
    space_.clear();
    spaces_.back() = spaces_.back() * given;
  }

  void end_material() {
    const std::string id = material_id_;
    material_id_.clear();
    if (kd_.size() >= 3 && std::isfinite(kd_[0]) && std::isfinite(kd_[1]) && std::isfinite(kd_[2])) {
      V3f color;  // Embree's are linear
      for (int i = 0; i < 3; ++i) color[i] = static_cast<float>(std::clamp(kd_[static_cast<std::size_t>(i)], 0.0, 1.0));
      material_ = enter(color);
      if (!id.empty()) by_id_[id] = material_;
    } else if (const auto found = by_id_.find(id); found != by_id_.end()) {
      material_ = found->second;
    }
    kd_.clear();
  }

  std::uint32_t enter(const V3f& color) {
    const std::array<float, 3> key{color.x, color.y, color.z};
    const auto [at, is_new] = by_color_.try_emplace(key, static_cast<std::uint32_t>(scene_.materials.size()));
    if (is_new) scene_.materials.push_back(plain_color("curves_" + std::to_string(at->second + 1), color));
    return at->second;
  }

  void begin_curves(const Kind& kind) {
    kind_ = kind;
    positions_.clear();
    tangents_.clear();
    indices_.clear();
    material_ = kNoIndex;
    flat_ += kind.flat;
  }

  // Element i of positions or tangents: a place and a radius, or how they change with the curve's parameter.
  [[nodiscard]] static FibrePoint point(const std::vector<double>& of, std::size_t i) { return {V3d(of[4 * i], of[4 * i + 1], of[4 * i + 2]), of[4 * i + 3]}; }

  // Lengths change under the transform as the cube root of volumes does: radii of a plain scale are scaled, those of a turn kept.
  void add(std::vector<FibrePoint>& strand) {
    if (strand.empty()) return;
    if (scene_.fibres.points.size() + strand.size() > kMostPoints) throw Error(Code::kUnsupported, parser_.where(), "curves of more than 2^26 points", "split the file");
    if (!spaces_.empty()) {
      const Affine& space = spaces_.back();
      const double scale = std::cbrt(std::abs(space.determinant()));
      for (FibrePoint& p : strand) {
        p.at = space * p.at;
        p.radius *= scale;
      }
    }
    if (material_ == kNoIndex) material_ = enter(Material().kd);
    builder_.strand(strand, material_);
    strand.clear();
  }

  void end_curves() {
    const std::size_t points = positions_.size() / 4, reach = kind_.basis == Basis::kLinear || kind_.basis == Basis::kHermite ? 1 : 3;
    if (positions_.size() % 4 != 0) throw Error(Code::kBadInput, parser_.where(), "its " + std::to_string(positions_.size()) + " positions are not x y z radius each");
    if (kind_.basis == Basis::kHermite && tangents_.size() != positions_.size())
      throw Error(Code::kBadInput, parser_.where(), "curves of the basis \"hermite\" with " + std::to_string(positions_.size()) + " numbers for positions and " + std::to_string(tangents_.size()) + " for tangents", "give a tangent x y z radius for each position");
    Box3d box;
    for (std::size_t i = 0; i < points; ++i)
      if (const V3d p = point(positions_, i).at; std::isfinite(p.x + p.y + p.z)) box.extendBy(p);
    const double tolerance = box.isEmpty() ? 1 : box.size().length() * kChordError;
    std::vector<FibrePoint> strand;
    double expected = -1;  // the index that goes on from the strand's end
    for (std::size_t k = 0; k + kind_.stride <= indices_.size(); k += kind_.stride) {
      const double index = indices_[k];
      if (!(index >= 0) || index != std::floor(index) || !(index + static_cast<double>(reach) < static_cast<double>(points))) {
        ++bad_indices_;
        continue;
      }
      if (index != expected) add(strand);
      const auto i = static_cast<std::size_t>(index);
      expected = index + static_cast<double>(kind_.basis == Basis::kBezier ? 3 : 1);
      if (kind_.basis == Basis::kLinear) {
        if (strand.empty()) strand.push_back(point(positions_, i));
        strand.push_back(point(positions_, i + 1));
        continue;
      }
      const std::array<FibrePoint, 4> c = bezier_at(i);
      if (strand.empty()) strand.push_back(c[0]);
      add_bezier(c, tolerance, strand);
      if (strand.size() > kMostPoints) throw Error(Code::kUnsupported, parser_.where(), "curves of more than 2^26 points", "split the file");
    }
    add(strand);
  }

  // The cubic that begins at index i as a Bezier curve: the same points for the same parameter, as all are cubics.
  [[nodiscard]] std::array<FibrePoint, 4> bezier_at(std::size_t i) const {
    const FibrePoint p0 = point(positions_, i), p1 = point(positions_, i + 1);
    const auto mix = [](const FibrePoint& a, double wa, const FibrePoint& b, double wb, const FibrePoint& c, double wc) {
      return FibrePoint{a.at * wa + b.at * wb + c.at * wc, a.radius * wa + b.radius * wb + c.radius * wc};
    };
    constexpr double kThird = 1.0 / 3, kSixth = 1.0 / 6;
    if (kind_.basis == Basis::kHermite) {
      // From p0 to p1 with the derivatives t0 and t1: p0, p0 + t0/3, p1 − t1/3, p1 (a Bezier curve's derivative at its ends is 3(b1 − b0) and 3(b3 − b2);
      // Embree, kernels/subdiv/hermite_curve.h).
      const FibrePoint t0 = point(tangents_, i), t1 = point(tangents_, i + 1);
      return {p0, mix(p0, 1, t0, kThird, t0, 0), mix(p1, 1, t1, -kThird, t1, 0), p1};
    }
    const FibrePoint p2 = point(positions_, i + 2), p3 = point(positions_, i + 3);
    switch (kind_.basis) {
      case Basis::kBspline:  // uniform
        return {mix(p0, kSixth, p1, 4 * kSixth, p2, kSixth), mix(p0, 0, p1, 2 * kThird, p2, kThird), mix(p0, 0, p1, kThird, p2, 2 * kThird),
                mix(p1, kSixth, p2, 4 * kSixth, p3, kSixth)};
      case Basis::kCatmullRom:
        // From p1 to p2 with the derivatives (p2 − p0)/2 and (p3 − p1)/2 (Catmull and Rom 1974, uniform; Embree, kernels/subdiv/catmullrom_curve.h).
        return {p1, mix(p0, -kSixth, p1, 1, p2, kSixth), mix(p1, kSixth, p2, 1, p3, -kSixth), p2};
      default: return {p0, p1, p2, p3};
    }
  }

  // Roots evenly over a sphere of 0.6 radius (Fibonacci's lattice), tips at its radius, bent by up to a fifth of it, 1/50 of it thick at the root.
  void end_fur_ball() {
    RandomSequence random(static_cast<std::uint64_t>(fur_balls_++) + 1);
    std::vector<FibrePoint> strand;
    for (int i = 0; i < kFurHairs; ++i) {
      const double z = 1 - (2 * i + 1.0) / kFurHairs, turn = i * std::numbers::pi * (3 - std::sqrt(5.0)), r = std::sqrt(1 - z * z);
      const V3d out(r * std::cos(turn), r * std::sin(turn), z);
      const V3d bend = V3d(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5) * 0.4;
      std::array<FibrePoint, 4> c;
      for (std::size_t k = 0; k < 4; ++k) {
        const double t = static_cast<double>(k) / 3;
        c[k] = {(out * (0.6 + 0.4 * t) + bend * (t * t)) * fur_radius_, 0.01 * fur_radius_ * (1 - 0.8 * t)};
      }
      strand.push_back(c[0]);
      add_bezier(c, fur_radius_ * 2e-4, strand);
      add(strand);
    }
  }

  XmlParser parser_;
  Report& report_;
  std::string path_;
  Scene scene_;
  FibreBuilder builder_;
  std::vector<At> stack_;
  std::vector<Affine> spaces_;
  std::vector<double> space_, positions_, tangents_, indices_, kd_;
  std::string word_, material_id_, assigned_;
  Kind kind_{};
  double fur_radius_ = 0;
  std::uint32_t material_ = kNoIndex;
  std::map<std::string, std::uint32_t> by_id_;
  std::map<std::array<float, 3>, std::uint32_t> by_color_;
  std::int64_t bad_indices_ = 0, flat_ = 0, ignored_ = 0, fur_balls_ = 0;
};

}  // namespace

Scene read_curves(const Input& input, Report& report) { return CurveReader(input, report).read(); }

}  // namespace texel
