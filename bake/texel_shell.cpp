#include "bake/texel_shell.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "formats/error.h"

namespace texel {

namespace {

constexpr std::size_t kMostTriangles = std::size_t{1} << 21;  // 1 GB of prisms

// The ends of a prism's three tetrahedra: two neighbours in it share a face, and each list is in order of the ends' numbers (point, its tip, next point, …).
constexpr std::array<std::array<int, 4>, 3> kParts{{{0, 1, 2, 5}, {0, 1, 4, 5}, {0, 3, 4, 5}}};

V3d on(const TexelAxes& axes, double u, double v, double up) {
  V3d p(0, 0, 0);
  p[axes.u] = u;
  p[axes.v] = v;
  p[axes.up] = up;
  return p;
}

bool finite(const V3d& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// For each point the first one at the same place.
std::vector<std::uint32_t> welded(const std::vector<V3d>& points) {
  std::vector<std::uint32_t> order(points.size()), first(points.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) { return std::array<double, 3>{points[i].x, points[i].y, points[i].z}; };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  for (std::size_t i = 0; i < order.size(); ++i) first[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
  return first;
}

// Normals of points: of the triangles about each, by their angles there; zero where they cancel.
std::vector<V3d> point_normals(const TexelSurface& surface) {
  std::vector<V3d> normals(surface.points.size(), V3d(0, 0, 0));
  for (const auto& t : surface.triangles) {
    const V3d &a = surface.points[t[0]], &b = surface.points[t[1]], &c = surface.points[t[2]];
    V3d n = (b - a).cross(c - a);
    const double length = n.length();
    if (!(length > 0)) continue;
    n /= length;
    for (std::size_t k = 0; k < 3; ++k) {
      const V3d &p = surface.points[t[k]], e = surface.points[t[(k + 1) % 3]] - p, f = surface.points[t[(k + 2) % 3]] - p;
      normals[t[k]] += n * std::atan2(e.cross(f).length(), e.dot(f));
    }
  }
  for (V3d& n : normals) {
    const double length = n.length();
    n = length > 1e-6 ? n / length : V3d(0, 0, 0);
  }
  return normals;
}

}  // namespace

TexelAxes texel_axes(int up) {
  if (up == 0) return {1, 2, 0, false};
  if (up == 1) return {0, 2, 1, true};
  return {0, 1, 2, false};
}

TexelSurface plane_surface(const Box3d& box, const TexelAxes& axes, int nu, int nv, double height) {
  const V3d size = box.size();
  TexelSurface s;
  for (int j = 0; j <= 1; ++j)
    for (int i = 0; i <= 1; ++i) {
      const double along = nv * size[axes.v] * j;
      V3d p = box.min + on(axes, nu * size[axes.u] * i, axes.v_back ? size[axes.v] - along : along, 0);
      s.points.push_back(p);
      s.tips.push_back(p + on(axes, 0, 0, height));
    }
  const std::array<std::array<double, 2>, 4> uv{{{0, 0}, {static_cast<double>(nu), 0}, {0, static_cast<double>(nv)}, {static_cast<double>(nu), static_cast<double>(nv)}}};
  for (const std::array<std::uint32_t, 3>& t : {std::array<std::uint32_t, 3>{0, 1, 3}, std::array<std::uint32_t, 3>{0, 3, 2}}) {
    s.triangles.push_back(t);
    s.uvs.push_back({uv[t[0]], uv[t[1]], uv[t[2]]});
  }
  return s;
}

TexelSurface sphere_surface(const Box3d& box, const TexelAxes& axes, int nu, int nv, double height) {
  const V3d size = box.size();
  const double radius = nu * size[axes.u] / (2 * std::numbers::pi);
  // About 128 pieces around and 64 from pole to pole, 2 a texel at least while there are few, a whole number of them in each, so that texels look alike.
  const auto pieces = [](int texels, int wanted) { return texels * std::max((wanted + texels - 1) / texels, texels <= 128 ? 2 : 1); };
  const int across = pieces(nu, 128), down = pieces(nv, 64);
  if (std::int64_t{2} * across * down > static_cast<std::int64_t>(kMostTriangles))
    throw Error(Code::kUnsupported, "--repeat", std::to_string(nu) + "," + std::to_string(nv) + " texels on a sphere need " + std::to_string(std::int64_t{2} * across * down) +
                " triangles, more than " + std::to_string(kMostTriangles), "use fewer");
  TexelSurface s;
  const double turn = axes.v_back ? -1 : 1;
  const auto add = [&](double east, double north) {
    const bool pole = std::abs(north) >= std::numbers::pi / 2;  // whose cosine is not 0 to the bit
    const V3d n = pole ? on(axes, 0, 0, north > 0 ? 1 : -1) : on(axes, std::cos(north) * std::cos(east), turn * std::cos(north) * std::sin(east), std::sin(north));
    s.points.push_back(n * radius);
    s.tips.push_back(n * (radius + height));
  };
  add(0, -std::numbers::pi / 2);
  for (int j = 1; j < down; ++j)
    for (int i = 0; i < across; ++i) add(2 * std::numbers::pi * i / across, std::numbers::pi * (static_cast<double>(j) / down - 0.5));
  add(0, std::numbers::pi / 2);
  const auto last = static_cast<std::uint32_t>(s.points.size() - 1);
  const auto at = [&](int i, int j) { return j == 0 ? 0u : j == down ? last : static_cast<std::uint32_t>(1 + (j - 1) * across + i % across); };
  const auto uv = [&](double i, int j) { return std::array<double, 2>{i * nu / across, static_cast<double>(j) * nv / down}; };
  for (int j = 0; j < down; ++j)
    for (int i = 0; i < across; ++i) {
      if (j == 0) {
        s.triangles.push_back({at(i, 0), at(i + 1, 1), at(i, 1)});
        s.uvs.push_back({uv(i + 0.5, 0), uv(i + 1, 1), uv(i, 1)});
      } else if (j + 1 == down) {
        s.triangles.push_back({at(i, j), at(i + 1, j), at(i, down)});
        s.uvs.push_back({uv(i, j), uv(i + 1, j), uv(i + 0.5, down)});
      } else {
        s.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
        s.uvs.push_back({uv(i, j), uv(i + 1, j), uv(i + 1, j + 1)});
        s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        s.uvs.push_back({uv(i, j), uv(i + 1, j + 1), uv(i, j + 1)});
      }
    }
  return s;
}

TexelSurface mesh_surface(const Scene& scene, const Scene* tips, const Box3d& box, const TexelAxes& axes, int nu, int nv, double height, const std::string& name, Report& report) {
  const Mesh& mesh = scene.mesh;
  if (mesh.triangles.empty()) throw Error(Code::kBadInput, name, "has no triangles to lay texels over", "use a mesh");
  if (mesh.triangles.size() > kMostTriangles)
    throw Error(Code::kUnsupported, name, std::to_string(mesh.triangles.size()) + " triangles to lay texels over, more than " + std::to_string(kMostTriangles), "use a coarser mesh");
  constexpr const char* kHint = "give it a (u,v) for every corner, as vt lines of an OBJ file do";
  if (mesh.uvs.empty() || mesh.uv_corners.size() != mesh.triangles.size()) throw Error(Code::kBadInput, name, "has no texture coordinates to lay texels by", kHint);
  if (tips && (tips->mesh.points.size() != mesh.points.size() || tips->mesh.triangles != mesh.triangles))
    throw Error(Code::kBadInput, "--tips", "is not the mesh of " + name + " with its points moved: " + std::to_string(tips->mesh.points.size()) + " points and " + std::to_string(tips->mesh.triangles.size()) +
                " triangles against " + std::to_string(mesh.points.size()) + " and " + std::to_string(mesh.triangles.size()), "save the same mesh with its points at the ends of the height vectors");
  TexelSurface s;
  s.points = mesh.points;
  const std::vector<std::uint32_t> same = welded(mesh.points);
  double area = 0, texture = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    std::array<std::array<double, 2>, 3> uv{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t c = mesh.uv_corners[i][k];
      if (c == kNoIndex || c >= mesh.uvs.size()) throw Error(Code::kBadInput, name, "triangle " + std::to_string(i + 1) + " has no texture coordinates to lay texels by", kHint);
      uv[k] = {static_cast<double>(mesh.uvs[c].x) * nu, static_cast<double>(mesh.uvs[c].y) * nv};
      if (!(std::abs(uv[k][0]) <= 1e7) || !(std::abs(uv[k][1]) <= 1e7))
        throw Error(Code::kBadInput, name, "triangle " + std::to_string(i + 1) + " asks for more than 1e7 texels in a row", "use a smaller --repeat, or other texture coordinates");
    }
    const std::array<std::uint32_t, 3> p{same[t[0]], same[t[1]], same[t[2]]};
    if (p[0] == p[1] || p[1] == p[2] || p[2] == p[0]) continue;
    const double a = (s.points[p[1]] - s.points[p[0]]).cross(s.points[p[2]] - s.points[p[0]]).length() / 2;
    if (!(a > 0)) continue;
    s.triangles.push_back(p);
    s.uvs.push_back(uv);
    area += a;
    texture += std::abs((uv[1][0] - uv[0][0]) * (uv[2][1] - uv[0][1]) - (uv[2][0] - uv[0][0]) * (uv[1][1] - uv[0][1])) / 2;
  }
  if (!(area > 0) || !(texture > 0)) throw Error(Code::kBadInput, name, "its texture coordinates cover no area", kHint);
  if (tips) {
    s.tips.resize(s.points.size());
    for (std::size_t i = 0; i < s.points.size(); ++i) s.tips[i] = tips->mesh.points[same[i]];
    return s;
  }
  const V3d size = box.size();
  if (!(height > 0)) height = std::sqrt(area / (texture * size[axes.u] * size[axes.v])) * size[axes.up];
  const std::vector<V3d> normals = point_normals(s);
  std::vector<bool> used(s.points.size(), false);
  for (const auto& t : s.triangles)
    for (const std::uint32_t p : t) used[p] = true;
  std::int64_t without = 0;
  s.tips.resize(s.points.size());
  for (std::size_t i = 0; i < s.points.size(); ++i) {
    s.tips[i] = s.points[i] + normals[i] * height;
    without += used[i] && normals[i].length2() == 0;
  }
  if (without > 0) report.issue("over-no-height", "the normals of triangles at a point cancel: it has no height vector, and texels beside it shrink to nothing", without, name);
  return s;
}

TexelShell::TexelShell(TexelSurface surface, const Box3d& box, const TexelAxes& axes, Report& report) : surface_(std::move(surface)), size_(box.size()), axes_(axes) {
  if (surface_.triangles.empty() || surface_.triangles.size() > kMostTriangles)
    throw Error(Code::kUnsupported, "", std::to_string(surface_.triangles.size()) + " triangles to lay texels over", "use 1 to " + std::to_string(kMostTriangles));
  for (const auto* list : {&surface_.points, &surface_.tips})
    for (const V3d& p : *list)
      if (!finite(p) || p.length() > 1e100) throw Error(Code::kBadInput, "", "the surface to lay texels over is not finite");
  // A prism is folded where its three tetrahedra do not all have the side that the surface's have.
  std::int64_t inward = 0, folded = 0;
  for (std::uint32_t t = 0; t < surface_.triangles.size(); ++t) {
    const Prism own = prism(t);
    int positive = 0;
    for (int part = 0; part < 3; ++part) {
      const auto& ends = kParts[static_cast<std::size_t>(part)];
      const auto volume = [&](const auto& of) {
        const V3d o = of(ends[0]);
        return (of(ends[1]) - o).dot((of(ends[2]) - o).cross(of(ends[3]) - o));
      };
      const double world = volume([&](int end) { return own.at[static_cast<std::size_t>(end)]; });
      // The same tetrahedron in a straight prism over (0,0), (1,0), (0,1).
      const double plain = volume([&](int end) {
        const int corner = own.corner[static_cast<std::size_t>(end % 3)];
        return V3d(corner == 1, corner == 2, end >= 3);
      });
      positive += world * plain > 0;
    }
    inward += positive == 0;
    folded += positive == 1 || positive == 2;
  }
  const auto count = static_cast<std::int64_t>(surface_.triangles.size());
  folded += std::min(inward, count - folded - inward);
  if (folded > 0) report.issue("over-folded", "height vectors cross where the surface curves in: texels fold over there and are drawn twice; use a smaller --texel-height", folded);
  build();
}

TexelShell::Prism TexelShell::prism(std::uint32_t triangle) const {
  const auto& t = surface_.triangles[triangle];
  Prism p;
  std::sort(p.corner.begin(), p.corner.end(), [&](int a, int b) { return t[static_cast<std::size_t>(a)] < t[static_cast<std::size_t>(b)]; });
  for (std::size_t k = 0; k < 3; ++k) {
    p.at[k] = surface_.points[t[static_cast<std::size_t>(p.corner[k])]];
    p.at[k + 3] = surface_.tips[t[static_cast<std::size_t>(p.corner[k])]];
  }
  return p;
}

V3d TexelShell::texel_place(std::uint32_t triangle, const Prism& prism, int end) const {
  const auto& uv = surface_.uvs[triangle][static_cast<std::size_t>(prism.corner[static_cast<std::size_t>(end % 3)])];
  const double v = uv[1] * size_[axes_.v];
  return on(axes_, uv[0] * size_[axes_.u], axes_.v_back ? size_[axes_.v] - v : v, end >= 3 ? size_[axes_.up] : 0);
}

V3d TexelShell::ground_normal(std::uint32_t triangle) const {
  const auto& t = surface_.triangles[triangle];
  const V3d n = (surface_.points[t[1]] - surface_.points[t[0]]).cross(surface_.points[t[2]] - surface_.points[t[0]]).normalized();
  const V3d up = surface_.tips[t[0]] - surface_.points[t[0]] + surface_.tips[t[1]] - surface_.points[t[1]] + surface_.tips[t[2]] - surface_.points[t[2]];
  return n.dot(up) < 0 ? -n : n;
}

TexelMap TexelShell::map(const ShellPiece& piece) const {
  const Prism& own = prisms_[place_of_[piece.triangle]];
  const auto& ends = kParts[piece.part];
  const auto at = [&](std::size_t k) { return own.at[static_cast<std::size_t>(ends[k])]; };
  const V3d o = at(0), a = at(1) - o, b = at(2) - o, d = at(3) - o;
  const auto texel = [&](std::size_t k) { return texel_place(piece.triangle, own, ends[k]); };
  const V3d t0 = texel(0), ta = texel(1) - t0, tb = texel(2) - t0, td = texel(3) - t0;
  const V3d ra = b.cross(d), rb = d.cross(a), rd = a.cross(b);  // det · the rows of the inverse of (a b d)
  const double one = 1 / a.dot(ra);
  TexelMap map;
  for (int k = 0; k < 3; ++k) map.rows[static_cast<std::size_t>(k)] = (ra * ta[k] + rb * tb[k] + rd * td[k]) * one;
  map.offset = t0 - map.direction(o);
  return map;
}

void TexelShell::build() {
  const std::size_t count = surface_.triangles.size();
  std::vector<Box3d> boxes(count);
  Box3d all;
  for (std::size_t i = 0; i < count; ++i) {
    for (const std::uint32_t p : surface_.triangles[i]) {
      boxes[i].extendBy(surface_.points[p]);
      boxes[i].extendBy(surface_.tips[p]);
    }
    all.extendBy(boxes[i]);
  }
  const V3d reach(std::max(std::abs(all.min.x), std::abs(all.max.x)), std::max(std::abs(all.min.y), std::abs(all.max.y)), std::max(std::abs(all.min.z), std::abs(all.max.z)));
  const double skin = 1e-12 * (reach.length() + all.size().length());  // what rounding may do to a ray's test against a box
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0u);
  struct Task { std::uint32_t first, count, parent; };  // a right child, whose place is known only when it is made
  constexpr std::uint32_t kRoot = kNoIndex;
  // Depth first, left child next to its parent.
  std::vector<Task> tasks{{0, static_cast<std::uint32_t>(count), kRoot}};
  nodes_.reserve(count);
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    if (task.parent != kRoot) nodes_[task.parent].first = static_cast<std::uint32_t>(nodes_.size());
    nodes_.emplace_back();
    std::uint32_t first = task.first, left = task.count;
    for (auto node = static_cast<std::uint32_t>(nodes_.size() - 1);; node = static_cast<std::uint32_t>(nodes_.size() - 1)) {
      Box3d box, middles;
      for (std::uint32_t i = first; i < first + left; ++i) {
        box.extendBy(boxes[order_[i]]);
        middles.extendBy(boxes[order_[i]].center());
      }
      nodes_[node].box = {box.min - V3d(skin), box.max + V3d(skin)};
      if (left == 1) {
        nodes_[node].first = first;
        nodes_[node].count = left;
        break;
      }
      const int axis = static_cast<int>(middles.majorAxis());
      const std::uint32_t half = left / 2;
      const auto by = [&](std::uint32_t a, std::uint32_t b) {
        const double x = boxes[a].center()[axis], y = boxes[b].center()[axis];
        return x != y ? x < y : a < b;
      };
      std::nth_element(order_.begin() + first, order_.begin() + first + half, order_.begin() + first + left, by);
      tasks.push_back({first + half, left - half, node});
      left = half;
      nodes_.emplace_back();
    }
  }
  prisms_.reserve(count);
  place_of_.resize(count);
  for (std::uint32_t k = 0; k < count; ++k) {
    prisms_.push_back(prism(order_[k]));
    place_of_[order_[k]] = k;
  }
  window_ = std::max(all.size().length() / 16, 1e-300);
}

bool TexelShell::reaches(std::uint32_t node, const V3d& origin, const V3d& direction, double* from, double* to) const {
  const Box3d& box = nodes_[node].box;
  for (int k = 0; k < 3; ++k) {
    if (direction[k] == 0) {
      if (origin[k] < box.min[k] || origin[k] > box.max[k]) return false;
      continue;
    }
    const double a = (box.min[k] - origin[k]) / direction[k], b = (box.max[k] - origin[k]) / direction[k];
    *from = std::max(*from, std::min(a, b));
    *to = std::min(*to, std::max(a, b));
  }
  return *from <= *to;
}

void TexelShell::pieces(const V3d& origin, const V3d& direction, double begin, double end, std::vector<ShellPiece>* out) const {
  out->clear();
  const V3d inverse(1 / direction.x, 1 / direction.y, 1 / direction.z);
  const auto meets = [&](const Box3d& box) {
    double from = begin, to = end;
    for (int k = 0; k < 3; ++k) {
      if (direction[k] == 0) {
        if (origin[k] < box.min[k] || origin[k] > box.max[k]) return false;
        continue;
      }
      const double a = (box.min[k] - origin[k]) * inverse[k], b = (box.max[k] - origin[k]) * inverse[k];
      from = std::max(from, std::min(a, b));
      to = std::min(to, std::max(a, b));
    }
    return from <= to * (1 + 1e-12);
  };
  // A face gives both its neighbours the same plane, to the bit: its ends are taken in order of their numbers.
  const auto clip = [&](const Prism& prism, std::uint32_t triangle, std::uint8_t part) {
    const auto& ends = kParts[part];
    const auto at = [&](std::size_t k) -> const V3d& { return prism.at[static_cast<std::size_t>(ends[k])]; };
    ShellPiece piece{0, 1e300, triangle, part, false, false};
    constexpr std::array<std::array<std::size_t, 3>, 4> kFaces{{{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}}};  // opposite each end
    for (std::size_t k = 0; k < 4; ++k) {
      const V3d& low = at(kFaces[k][0]);
      const V3d normal = (at(kFaces[k][1]) - low).cross(at(kFaces[k][2]) - low);
      const double inner = normal.dot(at(k) - low);
      if (inner == 0) return;  // flat: holds nothing
      const double speed = normal.dot(direction), away = normal.dot(origin - low);
      const bool ground = part == 0 && k == 3;
      if (speed == 0) {
        // Along the face. A ray in the face itself belongs to the side the normal points to.
        if (away == 0 ? inner < 0 : (away > 0) != (inner > 0)) return;
      } else if (const double t = -away / speed; (speed > 0) == (inner > 0)) {
        if (t > piece.from) {
          piece.from = t;
          piece.in_by_ground = ground;
        }
      } else if (t < piece.to) {
        piece.to = t;
        piece.out_by_ground = ground;
      }
      if (!(piece.from < piece.to) || piece.from >= end) return;
    }
    if (piece.from >= begin) out->push_back(piece);
  };
  std::array<std::uint32_t, 128> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t i = stack[--depth];
    const Node& node = nodes_[i];
    if (!meets(node.box)) continue;
    if (node.count == 0) {
      stack[depth++] = node.first;
      stack[depth++] = i + 1;
      continue;
    }
    for (std::uint8_t part = 0; part < 3; ++part) clip(prisms_[node.first], order_[node.first], part);
  }
  std::sort(out->begin(), out->end(), [](const ShellPiece& a, const ShellPiece& b) {
    return a.from != b.from ? a.from < b.from : a.triangle != b.triangle ? a.triangle < b.triangle : a.part < b.part;
  });
}

}  // namespace texel
