#include "bake/repeat_functions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "formats/error.h"
#include "formats/repeated_field.h"

namespace texel {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kTouch = 1e-6;          // voxels: copies that reach no further into the grid are left out, as those that lie against the next period
constexpr double kShown = 1.0 / 256;     // of a density: what a picture of 8 bits shows
constexpr double kSlack = 1e-3;          // voxels a surface may be off at the border: periods given with six digits still are
constexpr int kMostAcross = 512;         // points along each side of a face that are compared

V3d periods(const Grid& grid, const Recipe& recipe) {
  V3d p(0, 0, 0);
  for (int a = 0; a < 3; ++a)
    if (recipe.cyclic[static_cast<std::size_t>(a)]) p[a] = grid.n[a] * grid.h;
  return p;
}

bool is_empty(const Field& field, const Box3d& box, double iso) { return field.range(box).high < iso; }  // false where nothing is known

// Where f >= iso can be, along each axis by itself; infinite ends where ranges do not prove any. Ends within a millionth of the grid.
Box3d axis_bounds(const Field& field, double iso, const Grid& grid) {
  const Box3d known = field.bounds(iso);
  if (!known.isEmpty() && std::isfinite(known.size().x + known.size().y + known.size().z)) return known;
  Box3d box(V3d(-kInfinity), V3d(kInfinity));
  const Box3d around = grid.box();
  const V3d middle = around.center(), size = around.size();
  const double longest = std::max({size.x, size.y, size.z});
  for (int a = 0; a < 3; ++a)
    for (const int side : {-1, 1}) {
      const auto empty_beyond = [&](double at) {
        Box3d half = box;
        (side > 0 ? half.min : half.max)[a] = middle[a] + side * at;
        return is_empty(field, half, iso);
      };
      double in = -longest / 2, out = 0;  // of the middle; a solid wholly on the other side of the grid ends there
      for (double at = longest / 1024; at <= longest * 0x1p20 && out == 0; at *= 2) {
        if (empty_beyond(at)) out = at;
        else in = at;
      }
      if (out == 0) continue;
      while (out - in > 1e-6 * longest) {
        const double between = (in + out) / 2;
        (empty_beyond(between) ? out : in) = between;
      }
      (side > 0 ? box.max : box.min)[a] = middle[a] + side * out;
    }
  return box;
}

bool ends(const Box3d& box, int axis) { return std::isfinite(box.min[axis]) && std::isfinite(box.max[axis]); }

// The moves by whole periods that bring some of `solid` into `region`; the first axis changes fastest. Empty where none but (0, 0, 0) is.
std::vector<V3d> shifts_into(const Box3d& region, const Box3d& solid, const V3d& period, const std::string& name) {
  V3d first(0, 0, 0), last(0, 0, 0);
  double count = 1;
  for (int a = 0; a < 3; ++a) {
    if (!(period[a] > 0) || !ends(solid, a)) continue;
    first[a] = std::ceil((region.min[a] - solid.max[a]) / period[a]);
    last[a] = std::floor((region.max[a] - solid.min[a]) / period[a]);
    first[a] = std::min(first[a], last[a]);  // a gap narrower than a copy: none reaches, and any does
    count *= last[a] - first[a] + 1;
  }
  if (!(count <= kMostCopies)) {
    char text[160];
    std::snprintf(text, sizeof text, "%.0f copies of the function meet one period, and the most are %d", count, kMostCopies);
    throw Error(Code::kCommandLine, "--cyclic", name.empty() ? text : name + ": " + text, "give a larger --box");
  }
  std::vector<V3d> shifts;
  for (double k = first.z; k <= last.z; ++k)
    for (double j = first.y; j <= last.y; ++j)
      for (double i = first.x; i <= last.x; ++i) shifts.push_back(V3d(i, j, k) * period);
  if (shifts.size() == 1 && shifts[0] == V3d(0, 0, 0)) shifts.clear();
  return shifts;
}

Box3d grown(Box3d box, double by) {
  box.min -= V3d(by);
  box.max += V3d(by);
  return box;
}

// Lattice points of a face of the grid whose opposites differ, of how many.
struct Seam { std::int64_t points = 0, of = 0; };

// Values at the lattice points of the walls across an axis, a row at a time.
class Face {
 public:
  Face(const Field& field, const Grid& grid, int axis) : field_(field), grid_(grid), axis_(axis), u_((axis + 1) % 3), v_((axis + 2) % 3) {
    step_u_ = 1 + grid.n[u_] / kMostAcross;
    step_v_ = 1 + grid.n[v_] / kMostAcross;
  }
  [[nodiscard]] int rows() const { return grid_.n[v_] / step_v_ + 1; }
  void row(int wall, int j, std::vector<double>& f) const {
    const auto count = static_cast<std::size_t>(grid_.n[u_] / step_u_ + 1);
    std::vector<double> p[3];
    for (auto& c : p) c.resize(count);
    f.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      V3d at;
      at[axis_] = wall;
      at[u_] = static_cast<double>(i) * step_u_;
      at[v_] = static_cast<double>(j) * step_v_;
      at = grid_.to_world(at);
      for (int a = 0; a < 3; ++a) p[a][i] = at[a];
    }
    field_.values(count, p[0].data(), p[1].data(), p[2].data(), f.data());
  }

 private:
  const Field& field_;
  const Grid& grid_;
  int axis_, u_, v_, step_u_ = 1, step_v_ = 1;
};

// Inside on one side only, and by more than a surface kSlack voxels off would explain.
Seam solid_seam(const Field& field, double iso, const Grid& grid, int axis) {
  const Face face(field, grid, axis);
  std::vector<double> low, next, high;
  double most = 0, change = 0;
  std::int64_t finite = 0;
  Seam seam;
  for (int j = 0; j < face.rows(); ++j) {
    face.row(0, j, low);
    face.row(1, j, next);
    for (std::size_t i = 0; i < low.size(); ++i) {
      if (!std::isfinite(low[i]) || !std::isfinite(next[i])) continue;
      most = std::max(most, std::abs(low[i] - iso));
      change += std::abs(next[i] - low[i]);
      ++finite;
    }
  }
  const double slack = 1e-9 * most + (finite > 0 ? kSlack * change / static_cast<double>(finite) : 0);
  for (int j = 0; j < face.rows(); ++j) {
    face.row(0, j, low);
    face.row(grid.n[axis], j, high);
    for (std::size_t i = 0; i < low.size(); ++i) {
      ++seam.of;
      const bool same = (low[i] >= iso) == (high[i] >= iso) || std::abs(low[i] - high[i]) <= slack;
      seam.points += !same;
    }
  }
  return seam;
}

Seam density_seam(const Field& density, const Grid& grid, int axis) {
  const Face face(density, grid, axis);
  std::vector<double> low, high;
  Seam seam;
  const auto held = [](double d) { return std::isnan(d) ? 0 : std::clamp(d, 0.0, 1.0); };
  for (int j = 0; j < face.rows(); ++j) {
    face.row(0, j, low);
    face.row(grid.n[axis], j, high);
    for (std::size_t i = 0; i < low.size(); ++i) {
      ++seam.of;
      seam.points += std::abs(held(low[i]) - held(high[i])) > kShown;
    }
  }
  return seam;
}

void report_seam(const Seam& seam, int axis, const char* what, const std::string& name, Report& report) {
  if (seam.points == 0) return;
  char text[240];
  std::snprintf(text, sizeof text, "the function does not repeat along %c: %s at %lld of %lld points on opposite faces of the box; the pattern has a seam there",
                "xyz"[axis], what, static_cast<long long>(seam.points), static_cast<long long>(seam.of));
  report.issue("cyclic-seam", text, seam.points, name);
}

void repeat_density(Hypertexture& texture, const Grid& grid, const V3d& period, Report& report) {
  constexpr double kLeast = std::numeric_limits<double>::denorm_min();
  const bool cube = texture.preset == HypertexturePreset::kOctaves;  // ½ everywhere: nothing but its colour has a period
  const std::string name = hypertexture_name(texture.preset);
  const Box3d infinite(V3d(-kInfinity), V3d(kInfinity));
  const Box3d box = cube ? infinite : axis_bounds(*make_density(texture, 0), kLeast, grid);
  for (int a = 0; a < 3; ++a)
    if (period[a] > 0 && !ends(box, a)) texture.period[a] = period[a];
  // Differences across the border look half a voxel beyond it at most.
  texture.copies.shifts = shifts_into(grown(grid.box(), grid.h / 2), box, period, name);
  if (!texture.copies.shifts.empty()) texture.copies.reach = grown(box, kTouch * grid.h);
  if (const std::string changed = hypertexture_fit(texture).changed; !changed.empty())
    report.issue("cyclic-frequency", "noise has to repeat with the period: " + changed, 1, name);
  if (cube) return;
  const std::shared_ptr<const Field> density = make_density(texture, 0);
  for (int a = 0; a < 3; ++a)
    if (texture.period[a] > 0) report_seam(density_seam(*density, grid, a), a, "it differs by more than 1/256", name, report);
}

}  // namespace

Implicit repeat_solid(Implicit solid, const Grid& grid, const Recipe& recipe, Report& report) {
  const V3d period = periods(grid, recipe);
  if (period == V3d(0, 0, 0)) return solid;
  const Box3d box = axis_bounds(*solid.field, solid.iso, grid);
  Copies copies;  // asked everywhere: of a copy beyond its end nothing but f < iso is known
  copies.shifts = shifts_into(grown(grid.box(), -kTouch * grid.h), box, period, solid.name);
  solid.field = repeat_field(solid.field, std::move(copies));
  for (int a = 0; a < 3; ++a)
    if (period[a] > 0 && !ends(box, a)) report_seam(solid_seam(*solid.field, solid.iso, grid, a), a, "it is inside on one side only", solid.name, report);
  return solid;
}

bool has_patterns(const Scene& scene) {
  return scene.hypertexture || std::any_of(scene.materials.begin(), scene.materials.end(), [](const Material& m) { return m.solid != nullptr; });
}

Scene repeat_patterns(Scene scene, const Grid& grid, const Recipe& recipe, Report& report) {
  const V3d period = periods(grid, recipe);
  if (period == V3d(0, 0, 0)) return scene;
  if (scene.hypertexture) repeat_density(*scene.hypertexture, grid, period, report);
  const SolidTexture* before = nullptr;
  std::shared_ptr<const SolidTexture> after;
  for (Material& material : scene.materials) {
    if (!material.solid) continue;
    if (material.solid.get() != before) {  // materials share it as a rule
      before = material.solid.get();
      std::string changed;
      after = material.solid->with_period(period, &changed);
      const std::string name = recipe.solid_texture.empty() ? material.name : recipe.solid_texture;
      if (!after) report.issue("cyclic-solid-texture", "the solid texture cannot repeat with the period; its colour has a seam at the box's borders", 1, name);
      else if (!changed.empty()) report.issue("cyclic-frequency", "the solid texture has to repeat with the period: " + changed, 1, name);
    }
    if (after) material.solid = after;
  }
  return scene;
}

}  // namespace texel
