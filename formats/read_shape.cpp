// texel-shape files: JSON -> one program over x, y, z. The schema is in docs/inputs.md.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "formats/error.h"
#include "formats/expression.h"
#include "formats/json_reader.h"
#include "formats/program.h"
#include "formats/readers.h"

namespace texel {
namespace {

using Node = ProgramBuilder::Node;

constexpr std::size_t kMostBytes = 16u << 20;
constexpr int kMostDepth = 64;

struct Point {
  Node at[3];
};

class ShapeReader : private JsonReader {
 public:
  explicit ShapeReader(const std::string& path) : JsonReader(path, "docs/inputs.md") {}

  Scene read(const Json& root, std::optional<double> iso) {
    if (!root.is_object() || !root.contains("format") || root.at("format") != "texel-shape")
      fail("", "is not a shape: its \"format\" is not \"texel-shape\"", "a recipe is given by --recipe");
    check_keys(root, "", {"format", "version", "iso", "box", "material", "shape"});
    if (root.contains("version") && root.at("version") != 1) fail("/version", "is " + shown(root.at("version")), "this program reads version 1");
    if (!root.contains("shape")) fail("", "has no \"shape\"", "see docs/inputs.md");
    const Point point{{build_.coordinate(0), build_.coordinate(1), build_.coordinate(2)}};
    const Node shape = node(root.at("shape"), "/shape", point, 0);
    if (root.contains("iso") && !iso) iso = number(root.at("iso"), "/iso");
    const std::shared_ptr<const Field> field = build_.build(shape);
    Scene scene;
    if (root.contains("box")) {  // stated: nothing to search for
      const std::vector<double> b = numbers(root.at("box"), "/box", 6);
      const Box3d box(V3d(b[0], b[1], b[2]), V3d(b[3], b[4], b[5]));
      if (!(b[0] < b[3] && b[1] < b[4] && b[2] < b[5])) fail("/box", "has no volume", "give [X0, Y0, Z0, X1, Y1, Z1] with each X1 > X0");
      scene.materials.push_back(plain_color("default", Material().kd));
      scene.implicits.push_back({field, iso.value_or(0), box, 0, file()});
    } else {
      scene = implicit_scene(field, iso.value_or(0), file());
    }
    if (root.contains("material")) scene.materials[0] = material(root.at("material"), "/material");
    return scene;
  }

 private:
  Material material(const Json& v, const std::string& path) const {
    check_keys(v, path, {"name", "kd", "ks", "ke", "roughness", "opacity"});
    Material m;
    m.name = "shape";
    if (v.contains("name")) {
      if (!v.at("name").is_string()) fail(path + "/name", "is " + shown(v.at("name")), "expected text");
      m.name = v.at("name").get<std::string>();
    }
    if (v.contains("kd")) m.kd = color(v.at("kd"), path + "/kd");
    if (v.contains("ks")) m.ks = color(v.at("ks"), path + "/ks");
    if (v.contains("ke")) m.ke = color(v.at("ke"), path + "/ke", 10000);
    if (v.contains("roughness")) m.roughness = share(v.at("roughness"), path + "/roughness");
    if (v.contains("opacity")) m.opacity = share(v.at("opacity"), path + "/opacity");
    return m;
  }

  // --- arithmetic on nodes ---
  Node c(double v) { return build_.constant(v); }
  Node add(Node a, Node b) { return build_.binary(Op::kAdd, a, b); }
  Node sub(Node a, Node b) { return build_.binary(Op::kSubtract, a, b); }
  Node mul(Node a, Node b) { return build_.binary(Op::kMultiply, a, b); }
  Node div(Node a, Node b) { return build_.binary(Op::kDivide, a, b); }
  Node min(Node a, Node b) { return build_.binary(Op::kMin, a, b); }
  Node max(Node a, Node b) { return build_.binary(Op::kMax, a, b); }
  Node neg(Node a) { return build_.unary(Op::kNegate, a); }
  Node square(Node a) { return build_.unary(Op::kSquare, a); }
  Node root(Node a) { return build_.unary(Op::kSqrt, a); }
  Point offset(const Point& p, const V3d& by) { return {{sub(p.at[0], c(by.x)), sub(p.at[1], c(by.y)), sub(p.at[2], c(by.z))}}; }
  Node dot(const Point& p, const V3d& d) {
    Node sum = c(0);
    for (int a = 0; a < 3; ++a)
      if (d[a] != 0) sum = add(sum, mul(p.at[a], c(d[a])));
    return sum;
  }
  Node length2(const Point& p) { return add(add(square(p.at[0]), square(p.at[1])), square(p.at[2])); }

  // --- shapes: positive inside, distances where they are primitives ---
  Node node(const Json& v, const std::string& path, const Point& given, int depth) {
    if (depth > kMostDepth) fail(path, "is nested more than " + std::to_string(kMostDepth) + " deep", "make it flatter");
    if (build_.is_full()) fail(path, "is one part too many for the program", "take the shape apart");
    if (!v.is_object()) fail(path, "is " + shown(v), "expected an object with one shape in it");
    std::string kind;
    for (const auto& [key, value] : v.items()) {
      if (key == "transform" || key == "smooth") continue;
      if (std::none_of(std::begin(kKinds), std::end(kKinds), [&, &k = key](const char* name) { return k == name; })) {
        std::string names;
        for (const char* name : kKinds) names += (names.empty() ? "" : ", ") + std::string(name);
        fail(path + "/" + Json(key).dump(-1, ' ', false, Json::error_handler_t::replace), "is an unknown key", "known: " + names + "; transform, smooth");
      }
      if (!kind.empty()) fail(path, "has both \"" + kind + "\" and \"" + key + "\"", "join shapes by union, intersection or difference");
      kind = key;
    }
    if (kind.empty()) fail(path, "has no shape in it", "see docs/inputs.md");
    const bool combines = kind == "union" || kind == "intersection" || kind == "difference";
    double smooth = 0;
    if (v.contains("smooth")) {
      if (!combines) fail(path + "/smooth", "belongs to union, intersection and difference", "leave it out");
      smooth = positive(v.at("smooth"), path + "/smooth");
    }
    double scale = 1;
    const Point p = v.contains("transform") ? placed(v.at("transform"), path + "/transform", given, &scale) : given;
    const Json& body = v.at(kind);
    const std::string at = path + "/" + kind;
    const Node value = combines               ? combination(kind, body, at, p, smooth, depth)
                       : kind == "blobs"      ? blobs(body, at, p)
                       : kind == "expression" ? expression(body, at, p)
                                              : primitive(kind, body, at, p);
    return mul(value, c(scale));  // distances grow with the shape
  }
  static constexpr const char* kKinds[] = {"sphere", "box", "torus", "cylinder", "capsule", "plane", "expression", "blobs", "union", "intersection", "difference"};

  // Scaled, turned about x, then y, then z, and moved: the point goes the way back.
  Point placed(const Json& v, const std::string& path, const Point& p, double* scale) {
    check_keys(v, path, {"scale", "rotate", "translate"});
    if (v.contains("scale")) *scale = positive(v.at("scale"), path + "/scale");
    const V3d turn = vector_or(v, "rotate", path, V3d(0, 0, 0)), move = vector_or(v, "translate", path, V3d(0, 0, 0));
    V3d axes[3] = {V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};  // where the shape's own axes point
    for (int a = 0; a < 3; ++a) {
      const double angle = turn[a] * std::numbers::pi / 180, s = std::sin(angle), co = std::cos(angle);
      const int b = (a + 1) % 3, d = (a + 2) % 3;
      for (V3d& axis : axes) {
        const double u = axis[b], w = axis[d];
        axis[b] = co * u - s * w;
        axis[d] = s * u + co * w;
      }
    }
    const Point moved = offset(p, move);
    if (turn == V3d(0, 0, 0)) return {{mul(moved.at[0], c(1 / *scale)), mul(moved.at[1], c(1 / *scale)), mul(moved.at[2], c(1 / *scale))}};
    return {{dot(moved, axes[0] / *scale), dot(moved, axes[1] / *scale), dot(moved, axes[2] / *scale)}};
  }

  Node combination(const std::string& kind, const Json& list, const std::string& path, const Point& p, double smooth, int depth) {
    if (!list.is_array() || list.empty()) fail(path, "is " + shown(list), "expected a list of shapes");
    Node result = 0;
    for (std::size_t i = 0; i < list.size(); ++i) {
      Node part = node(list[i], path + "/" + std::to_string(i), p, depth + 1);
      if (i == 0) {
        result = part;
        continue;
      }
      if (kind == "difference") part = neg(part);
      const bool join = kind == "union";
      Node rounding = c(0);
      if (smooth > 0) rounding = mul(square(max(sub(c(1), mul(build_.unary(Op::kAbs, sub(result, part)), c(1 / smooth))), c(0))), c(smooth / 4));
      result = join ? add(max(result, part), rounding) : sub(min(result, part), rounding);
    }
    return result;
  }

  Node primitive(const std::string& kind, const Json& v, const std::string& path, const Point& p) {
    const auto size = [&](const char* key) { return positive(need(v, key, path), path + "/" + key); };
    if (kind == "sphere") {
      check_keys(v, path, {"center", "radius"});
      const double radius = size("radius");
      return sub(c(radius), root(length2(offset(p, vector_or(v, "center", path, V3d(0, 0, 0))))));
    }
    if (kind == "plane") {  // the half-space behind it
      check_keys(v, path, {"point", "normal"});
      const V3d normal = direction(need(v, "normal", path), path + "/normal");
      return neg(dot(offset(p, vector_or(v, "point", path, V3d(0, 0, 0))), normal));
    }
    if (kind == "torus") {
      check_keys(v, path, {"center", "axis", "major", "minor"});
      const V3d axis = v.contains("axis") ? direction(v.at("axis"), path + "/axis") : V3d(0, 0, 1);
      const double major = size("major"), minor = size("minor");
      const Point q = offset(p, vector_or(v, "center", path, V3d(0, 0, 0)));
      const Node along = dot(q, axis), across = root(across2(q, axis, along));
      return sub(c(minor), root(add(square(sub(across, c(major))), square(along))));
    }
    if (kind == "box") {
      check_keys(v, path, {"min", "max", "rounding"});
      const V3d low = vector(need(v, "min", path), path + "/min"), high = vector(need(v, "max", path), path + "/max");
      const double rounding = rounding_of(v, path);
      const Point q = offset(p, (low + high) / 2.0);
      Node beyond = c(0), most = 0;
      for (int a = 0; a < 3; ++a) {
        const double half = (high[a] - low[a]) / 2;
        if (!(half > 0)) fail(path, "has no volume", "give \"min\" below \"max\" along every axis");
        if (rounding > half) fail(path + "/rounding", "is larger than half the box", "make it smaller");
        const Node d = sub(build_.unary(Op::kAbs, q.at[a]), c(half - rounding));
        beyond = add(beyond, square(max(d, c(0))));
        most = a == 0 ? d : max(most, d);
      }
      return sub(c(rounding), add(root(beyond), min(most, c(0))));
    }
    // cylinder and capsule
    const bool round = kind == "capsule";
    if (round) check_keys(v, path, {"from", "to", "radius"});
    else check_keys(v, path, {"from", "to", "radius", "rounding"});
    const V3d from = vector(need(v, "from", path), path + "/from"), to = vector(need(v, "to", path), path + "/to");
    const double radius = size("radius"), length = (to - from).length();
    if (!(length > 0)) fail(path, "\"from\" and \"to\" are the same point", "a ball is a sphere");
    if (round) return sub(c(radius), root(segment2(p, from, to)));
    const double rounding = rounding_of(v, path);
    if (rounding > radius || rounding > length / 2) fail(path + "/rounding", "is larger than the cylinder", "make it smaller");
    const V3d axis = (to - from) / length;
    const Point q = offset(p, (from + to) / 2.0);
    const Node along = dot(q, axis);
    const Node side = sub(root(across2(q, axis, along)), c(radius - rounding)), end = sub(build_.unary(Op::kAbs, along), c(length / 2 - rounding));
    return sub(c(rounding), add(root(add(square(max(side, c(0))), square(max(end, c(0))))), min(max(side, end), c(0))));
  }
  double rounding_of(const Json& v, const std::string& path) const {
    if (!v.contains("rounding")) return 0;
    const double r = number(v.at("rounding"), path + "/rounding");
    if (!(r >= 0)) fail(path + "/rounding", "is " + shown(v.at("rounding")), "expected a number >= 0");
    return r;
  }
  // Squared distance from the axis through the origin. As a sum of squares, not as a difference, so that it is not negative.
  Node across2(const Point& p, const V3d& axis, Node along) {
    Node sum = c(0);
    for (int a = 0; a < 3; ++a) {
      if (std::abs(axis[a]) == 1) continue;
      sum = add(sum, square(axis[a] == 0 ? p.at[a] : sub(p.at[a], mul(along, c(axis[a])))));
    }
    return sum;
  }
  // Squared distance from a segment; `share` receives how far along it the nearest point is.
  Node segment2(const Point& p, const V3d& from, const V3d& to, Node* share = nullptr) {
    const V3d d = to - from;
    const Point q = offset(p, from);
    const Node t = min(max(dot(q, d / d.length2()), c(0)), c(1));
    if (share) *share = t;
    Node sum = c(0);
    for (int a = 0; a < 3; ++a) sum = add(sum, square(d[a] == 0 ? q.at[a] : sub(q.at[a], mul(t, c(d[a])))));
    return sum;
  }

  Node expression(const Json& v, const std::string& path, const Point& p) {
    if (!v.is_string()) fail(path, "is " + shown(v), "expected text");
    return read_expression(v.get<std::string>(), {file() + ": " + path, Code::kBadInput}, build_, p.at);
  }

  // Σ weight·falloff(distance/radius) − threshold over points and segments.
  Node blobs(const Json& v, const std::string& path, const Point& p) {
    check_keys(v, path, {"threshold", "falloff", "items"});
    const double threshold = v.contains("threshold") ? positive(v.at("threshold"), path + "/threshold") : 0.5;
    const Json falloff = v.contains("falloff") ? v.at("falloff") : Json("wyvill");
    const bool wyvill = falloff == "wyvill";
    if (!wyvill && falloff != "cubic") fail(path + "/falloff", "is " + shown(falloff), "known: wyvill, cubic");
    const Json& items = need(v, "items", path);
    if (!items.is_array() || items.empty()) fail(path + "/items", "is " + shown(items), "expected a list of points and segments");
    Node sum = c(0);
    for (std::size_t i = 0; i < items.size(); ++i) {
      const std::string at = path + "/items/" + std::to_string(i);
      if (build_.is_full()) fail(at, "is one part too many for the program", "take the shape apart");
      const Json& item = items[i];
      check_keys(item, at, {"point", "segment", "radius", "weight"});
      if (item.contains("point") == item.contains("segment")) fail(at, "needs a point or a segment", "give one of them");
      const double weight = item.contains("weight") ? number(item.at("weight"), at + "/weight") : 1;
      const Json& size = need(item, "radius", at);
      Node squared = 0, radius = 0;
      if (item.contains("point")) {
        squared = length2(offset(p, vector(item.at("point"), at + "/point")));
        radius = c(positive(size, at + "/radius"));
      } else {
        const Json& ends = item.at("segment");
        if (!ends.is_array() || ends.size() != 2) fail(at + "/segment", "is " + shown(ends), "expected two points");
        const V3d from = vector(ends[0], at + "/segment/0"), to = vector(ends[1], at + "/segment/1");
        if (!((to - from).length2() > 0)) fail(at + "/segment", "has no length", "give a point");
        Node share = 0;
        squared = segment2(p, from, to, &share);
        if (size.is_array()) {
          if (size.size() != 2) fail(at + "/radius", "is " + shown(size), "expected a number or two");
          const double r0 = positive(size[0], at + "/radius/0"), r1 = positive(size[1], at + "/radius/1");
          radius = add(c(r0), mul(share, c(r1 - r0)));
        } else {
          radius = c(positive(size, at + "/radius"));
        }
      }
      Node value = 0;
      if (wyvill) {  // (1 − r²)³
        const Node inside = max(sub(c(1), div(squared, square(radius))), c(0));
        value = build_.whole_power(inside, 3);
      } else {  // 1 − 3r² + 2r³
        value = sub(c(1), build_.unary(Op::kFade, div(root(squared), radius)));
      }
      sum = add(sum, mul(value, c(weight)));
    }
    return sub(sum, c(threshold));
  }

  ProgramBuilder build_;
};

}  // namespace

Scene read_shape(const Input& input, std::optional<double> iso, Report&) {
  const Json root = parse_json(input, kMostBytes, "shape", "{\"format\": \"texel-shape\", \"shape\": {...}}");
  return ShapeReader(input.path).read(root, iso);
}

}  // namespace texel
