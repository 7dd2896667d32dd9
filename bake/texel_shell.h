#pragma once
// The layer over a surface that is filled with texels: a prism over each triangle, three tetrahedra in each prism (Kajiya & Kay 1989; Ratib 1997, chapter 4)
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// A surface with height vectors. Texels are counted by (u, v): from n to n + 1 is one texel.
struct TexelSurface {
  std::vector<V3d> points, tips;                          // world: the surface, and the other ends of its height vectors
  std::vector<std::array<std::uint32_t, 3>> triangles;    // into points; counter-clockwise seen from the tips
  std::vector<std::array<std::array<double, 2>, 3>> uvs;  // per triangle and corner
};

// How a pack's box lies in a texel: `u`, `v`, `up`: axes of the box; v runs backwards where that keeps u, v, up right-handed.
struct TexelAxes {
  int u = 0, v = 1, up = 2;
  bool v_back = false;
};
[[nodiscard]] TexelAxes texel_axes(int up);

// nu × nv boxes beside each other at the pack's own place and size, `height` high; the first is where the pack is.
[[nodiscard]] TexelSurface plane_surface(const Box3d& box, const TexelAxes& axes, int nu, int nv, double height);
// A ball about the origin with nu texels along its equator, each as long there as the box, and nv from pole to pole (+up), `height` high; u runs to the east.
[[nodiscard]] TexelSurface sphere_surface(const Box3d& box, const TexelAxes& axes, int nu, int nv, double height);
// A mesh with its own (u, v), times nu and nv. Height vectors: normals, the mean of the triangles' weighted by their angles, times `height` (0: as high as a texel would be that is as long
// as they are on average); or, with `tips`, up to the points of that mesh, which must have the same triangles. Points at one place are one point.
// Throws Error{kBadInput} with `name` for a mesh without (u, v), one that is empty or does not fit its tips; Error{kUnsupported} for more than 2^23 triangles.
// Issue `over-no-height`: points whose normals cancel: nothing is drawn beside them.
[[nodiscard]] TexelSurface mesh_surface(const Scene& scene, const Scene* tips, const Box3d& box, const TexelAxes& axes, int nu, int nv, double height, const std::string& name, Report& report);

// A stretch of a ray within one tetrahedron.
struct ShellPiece {
  double from = 0, to = 0;      // along the ray, world
  std::uint32_t triangle = 0;
  std::uint8_t part = 0;        // which tetrahedron of its prism
  bool in_by_ground = false, out_by_ground = false;  // enters or leaves through the surface itself
};

// World -> box of the pack, from its lowest corner, texels side by side without end.
struct TexelMap {
  std::array<V3d, 3> rows;      // linear part
  V3d offset{0, 0, 0};
  [[nodiscard]] V3d direction(const V3d& d) const { return {rows[0].dot(d), rows[1].dot(d), rows[2].dot(d)}; }
  [[nodiscard]] V3d point(const V3d& p) const { return direction(p) + offset; }
  [[nodiscard]] double determinant() const { return rows[0].dot(rows[1].cross(rows[2])); }
};

class TexelShell {
 public:
  // Issue `over-folded`: prisms whose height vectors cross (the surface curves in more sharply than they are long).
  TexelShell(TexelSurface surface, const Box3d& box, const TexelAxes& axes, Report& report);

  // The stretches of the ray in the shell that begin at distances `begin` <= t < `end` (those it begins in, at 0), nearest first. Pieces of neighbours meet in the same number: no gap, no
  // overlap. Thread-safe.
  void pieces(const V3d& origin, const V3d& direction, double begin, double end, std::vector<ShellPiece>* out) const;
  // The same for the whole ray up to `end`, some way at a time, so that what lies behind opaque matter costs nothing: call(piece) -> whether to go on. `buffer` is for reuse.
  template <class Call>
  void along(const V3d& origin, const V3d& direction, double end, std::vector<ShellPiece>* buffer, Call&& call) const {
    double from = 0, to = end;
    if (!reaches(0, origin, direction, &from, &to)) return;
    const double window = std::max(window_, to * 1e-9);  // a far camera's numbers are coarse
    for (double begin = from > 0 ? from * (1 - 1e-9) : 0; begin <= to; begin += window) {
      pieces(origin, direction, begin, std::min(begin + window, end), buffer);
      for (const ShellPiece& piece : *buffer)
        if (!call(piece)) return;
    }
  }
  // The affine map within a tetrahedron. Continuous across faces between texels of one surface.
  [[nodiscard]] TexelMap map(const ShellPiece& piece) const;
  // Unit normal of the triangle, on the side of its tips.
  [[nodiscard]] V3d ground_normal(std::uint32_t triangle) const;
  [[nodiscard]] const TexelSurface& surface() const { return surface_; }

 private:
  struct Node {
    Box3d box;
    std::uint32_t first = 0, count = 0;  // count 0: an inner node; its children are the next node and `first`
  };
  // A triangle's three corners in order of their points' numbers, then their tips: neighbours cut the wall between them along the same diagonal.
  struct Prism {
    std::array<V3d, 6> at;
    std::array<int, 3> corner{0, 1, 2};  // which of the triangle's
  };
  [[nodiscard]] Prism prism(std::uint32_t triangle) const;
  [[nodiscard]] V3d texel_place(std::uint32_t triangle, const Prism& prism, int end) const;
  // Cuts [from, to] down to what the ray has in the node's box; false: nothing.
  [[nodiscard]] bool reaches(std::uint32_t node, const V3d& origin, const V3d& direction, double* from, double* to) const;
  void build();

  TexelSurface surface_;
  std::vector<Prism> prisms_;            // in the order of `order_`
  std::vector<std::uint32_t> place_of_;  // per triangle: its prism
  double window_ = 1;
  V3d size_;
  TexelAxes axes_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace texel
