#pragma once
// Stage 1: Scene -> Plan: grid, components, orientation, what takes part in the fill
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "bake/fibre.h"
#include "bake/placed.h"
#include "bake/recipe.h"
#include "formats/pack.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// Layers of the grid that are baked together: voxels [z0, z1) of level 0. z0 is a multiple of 8, z1 too unless the grid ends there.
struct Slab {
  int z0 = 0, z1 = std::numeric_limits<int>::max();
};

// What the later stages need to know of a scene, in voxel space.
struct Plan {
  Grid grid;
  std::vector<V3d> points;          // voxel space; within 2⁻³⁰ of a wall: on it
  std::vector<std::int8_t> turn;    // per triangle: −1 where its component was inside out and its normal is turned, else +1
  std::vector<std::int8_t> winding; // per triangle: what a crossing along its turned normal's negative adds: 1, or 0: open, takes no part
  std::vector<bool> two_sided;      // per material: lit from both sides
  std::vector<bool> two_sided_open; // per material: where it is not the surface of a solid
  std::vector<float> uv_width;      // per triangle: width in uv of a world length; empty where nothing is textured
  std::vector<FibreSegment> fibres; // the pieces of Scene::fibres; crossings number them behind the triangles
  std::vector<ShapeTree> shapes;    // of Scene::shapes
  std::vector<Placed> placed;       // of Scene::instances, those without triangles left out; ascending by `first`
  std::uint64_t placed_triangles = 0;  // of all of them together
  bool fill = false;                // some triangle has winding ≠ 0
  // Of scenes that repeat: the filled components, and each triangle's (kNoIndex: none). repeat.h needs them.
  struct Body {
    Box3d box;                      // voxel space, of the component as given
    int bounded = 2;                // an axis along which it ends
  };
  std::vector<Body> bodies;
  std::vector<std::uint32_t> body;
  std::size_t curtains = 0;         // the last triangles: set up by repeat_scene outside the grid, only rays meet them
  Statistics statistics;            // triangles … volume; colour and voxel counts come later

  // Of a triangle with this winding and material.
  [[nodiscard]] bool is_two_sided(std::int8_t winds, std::uint32_t material) const {
    return two_sided[material] || (two_sided_open[material] && winds == 0);
  }
};

// Throws Error{kBadInput} when neither triangle nor fibre has an area or the voxel edge is not within 1e-30 … 1e30 units (density, depth/h, is a float),
// Error{kCommandLine} for a box or resolution that cannot be.
// Cost: O(t log t) for the components of t triangles, skipped when the recipe fills nothing.
[[nodiscard]] Plan make_plan(const Scene& scene, const Recipe& recipe, const std::vector<bool>& has_cutouts, Report& report);

// A point of the scene in voxel space: on a wall that is nearer than 2⁻³⁰.
[[nodiscard]] V3d plan_point(const Grid& grid, const V3d& world);

// The solids of one shape, in its own space: what it adds to components, closed and volume. Fills `turn` and `winding`.
[[nodiscard]] Statistics find_shape_solids(const Mesh& shape, const std::vector<Material>& materials, const Recipe& recipe, std::vector<std::int8_t>& turn, std::vector<std::int8_t>& winding, Report& report);

// Unit normal of a triangle given in any space; (0,0,0) where it has no area. `area`, when not null, receives its area.
[[nodiscard]] V3d triangle_normal(const V3d& a, const V3d& b, const V3d& c, double* area = nullptr);

}  // namespace texel
