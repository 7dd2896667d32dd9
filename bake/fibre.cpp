#include "bake/fibre.h"

#include <algorithm>
#include <limits>

#include "bake/surface.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr double kWallSnap = 0x1p-30;         // voxels, as in plan.cpp
constexpr double kReach = 1;                  // voxels beyond the grid that repetitions must reach
constexpr std::size_t kMostRepeated = 100'000'000;

void add_disc(double radius, const V3d& out, bool one_sided, Areas& areas, Moments* moments) {
  const double area = M_PI * radius * radius;
  Areas disc;
  disc.area = disc.covered = 1;
  for (int k = 0; k < 3; ++k) {
    disc.crossings[k] = std::abs(out[k]);
    disc.stopping[k] = std::abs(out[k]) / 2;
  }
  areas.add(disc, area);
  if (moments) moments->add(out, area, one_sided);
}

}  // namespace

Box3d fibre_bounds(const Fibres& fibres) {
  Box3d box;
  for (std::size_t i = 0; i < fibres.points.size(); ++i) {
    const double r = fibres.radii[i] * kTubeReach;
    box.extendBy(fibres.points[i] - V3d(r, r, r));
    box.extendBy(fibres.points[i] + V3d(r, r, r));
  }
  return box;
}

double fibre_area(const Fibres& fibres) {
  double area = 0;
  for (std::size_t s = 0; s < fibres.strands(); ++s) {
    const std::size_t begin = fibres.first[s], end = fibres.first[s + 1];
    for (std::size_t i = begin; i + 1 < end; ++i) {
      const double length = (fibres.points[i + 1] - fibres.points[i]).length(), step = fibres.radii[i + 1] - fibres.radii[i];
      area += M_PI * (fibres.radii[i] + fibres.radii[i + 1]) * std::hypot(length, step);
    }
    area += M_PI * (fibres.radii[begin] * fibres.radii[begin] + fibres.radii[end - 1] * fibres.radii[end - 1]);
  }
  return area;
}

std::vector<FibreSegment> fibre_segments(const Scene& scene, const Grid& grid) {
  const Fibres& fibres = scene.fibres;
  if (fibres.points.size() + scene.mesh.triangles.size() >= kNoIndex) throw Error(Code::kUnsupported, "", "triangles and pieces of fibres are more than 2^32 together", "bake the scene in parts");
  std::vector<FibreSegment> segments;
  segments.reserve(fibres.points.size() - std::min(fibres.points.size(), fibres.strands()));
  const auto to_voxel = [&](const V3d& world) {
    V3d p = grid.to_voxel(world);
    for (int k = 0; k < 3; ++k)
      if (const double wall = std::nearbyint(p[k]); std::abs(p[k] - wall) < kWallSnap) p[k] = wall;
    return p;
  };
  for (std::size_t s = 0; s < fibres.strands(); ++s) {
    const std::size_t begin = fibres.first[s], last = fibres.first[s + 1] - 1;
    V3d a = to_voxel(fibres.points[begin]);
    for (std::size_t i = begin; i < last; ++i) {
      const V3d b = to_voxel(fibres.points[i + 1]);
      segments.push_back({a, b, fibres.radii[i] / grid.h, fibres.radii[i + 1] / grid.h, static_cast<std::uint32_t>(i), fibres.materials[s], i == begin, i + 1 == last});
      a = b;
    }
  }
  return segments;
}

FibreShape fibre_shape(const FibreSegment& f) {
  FibreShape s{};
  const V3d d = f.b - f.a;
  s.length = d.length();
  if (!(s.length > 0)) return s;  // so short that it is nothing in voxels: its discs remain
  s.t = d / s.length;
  s.taper = (f.ra - f.rb) / s.length;
  const double slant2 = 1 + s.taper * s.taper, slant = std::sqrt(slant2);
  s.area = 2 * M_PI * slant;
  s.slope = 2 * M_PI * s.taper;
  s.across = M_PI / slant;
  s.along = 2 * M_PI * s.taper * s.taper / slant;
  for (int k = 0; k < 3; ++k)
    s.shadow[k] = 2 * frustum_shadow(std::hypot(s.t[(k + 1) % 3], s.t[(k + 2) % 3]), std::abs(s.taper * s.t[k]));
  return s;
}

void add_fibre(const FibreSegment& f, const FibreShape& shape, double s0, double s1, bool one_sided, Areas& areas, Moments* moments) {
  const double middle = (s0 + s1) / 2, integral = (f.ra + (f.rb - f.ra) * middle) * (s1 - s0) * shape.length;  // ∫ r ds, exact
  const double area = shape.area * integral;
  areas.area += area;
  areas.covered += area;
  areas.stopping += shape.shadow * integral;
  areas.crossings += shape.shadow * (2 * integral);
  if (moments) {
    Moments m;
    m.covered = shape.area;
    if (one_sided) m.m = shape.t * shape.slope;
    m.xx = m.yy = m.zz = shape.across;
    add_outer(m, shape.t, shape.along - shape.across);
    moments->add(m, integral);
  }
  const V3d t = shape.length > 0 ? shape.t : V3d(0, 0, 1);
  if (f.begins && s0 == 0) add_disc(f.ra, -t, one_sided, areas, moments);
  if (f.ends && s1 == 1) add_disc(f.rb, t, one_sided, areas, moments);
}

FibreOutline fibre_outline(const FibreSegment& f, const FibreShape& shape, int axis, int u_axis, int v_axis) {
  FibreOutline o{};
  o.u = f.a[u_axis];
  o.v = f.a[v_axis];
  const double tu = shape.t[u_axis], tv = shape.t[v_axis], sine = std::hypot(tu, tv), cosine = std::abs(shape.t[axis]);
  o.du = sine > 0 ? tu / sine : 1;
  o.dv = sine > 0 ? tv / sine : 0;
  o.length = shape.length * sine;
  // A cone seen from nearly its tip shows as a ring, which is no strip along its axis: rays do not meet it, and the exact sums alone count it.
  const bool strip = std::abs(shape.taper) * cosine < sine;
  const double wider = strip ? shape.shadow[axis] / (2 * sine) : 1;
  if (!strip) o.length = 0;
  o.wa = f.ra * wider;
  o.wb = f.rb * wider;
  // Half a disc's shadow, π r² cos/2, as wide as the strip there.
  if (f.begins) o.before = M_PI / 4 * f.ra * cosine / wider;
  if (f.ends) o.behind = M_PI / 4 * f.rb * cosine / wider;
  return o;
}

Fibres repeat_fibres(const Fibres& fibres, const Grid& grid, const std::array<bool, 3>& cyclic) {
  Fibres all = fibres;
  for (std::size_t s = 0; s < fibres.strands(); ++s) {
    const std::size_t begin = fibres.first[s], end = fibres.first[s + 1];
    V3d low(0, 0, 0), high(0, 0, 0);
    double reach = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const V3d p = grid.to_voxel(fibres.points[i]);
      reach = std::max(reach, fibres.radii[i] / grid.h);
      for (int a = 0; a < 3; ++a) {
        low[a] = i == begin ? p[a] : std::min(low[a], p[a]);
        high[a] = i == begin ? p[a] : std::max(high[a], p[a]);
      }
    }
    double first[3] = {0, 0, 0}, last[3] = {0, 0, 0}, copies = 1;
    for (int a = 0; a < 3; ++a) {
      if (!cyclic[static_cast<std::size_t>(a)]) continue;
      const double n = grid.n[a];
      first[a] = std::ceil((-kReach - reach - high[a]) / n);
      last[a] = std::floor((n + kReach + reach - low[a]) / n);
      copies *= std::max(0.0, last[a] - first[a] + 1);
    }
    if (!(copies * static_cast<double>(end - begin) + static_cast<double>(all.points.size()) <= static_cast<double>(kMostRepeated)))
      throw Error(Code::kBadInput, "--cyclic", "the fibres reach so many periods far that over 100 million points would lie in one", "choose a larger --box");
    for (double z = first[2]; z <= last[2]; ++z)
      for (double y = first[1]; y <= last[1]; ++y)
        for (double x = first[0]; x <= last[0]; ++x) {
          if (x == 0 && y == 0 && z == 0) continue;
          const V3d moved = V3d(x, y, z) * V3d(grid.n) * grid.h;
          for (std::size_t i = begin; i < end; ++i) {
            all.points.push_back(fibres.points[i] + moved);
            all.radii.push_back(fibres.radii[i]);
            if (!fibres.colors.empty()) all.colors.push_back(fibres.colors[i]);
          }
          all.first.push_back(all.points.size());
          all.materials.push_back(fibres.materials[s]);
        }
  }
  return all;
}

}  // namespace texel
