#include "bake/height_mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "bake/bake.h"
#include "formats/error.h"

namespace texel {
namespace {

constexpr double kSame = 0x1p-30;      // voxels: lines closer than that are one, as for the plan's walls
constexpr double kFlat = 0x1p-30;      // voxels: a twist that moves no volume or normal that can be stored
constexpr double kNoData = std::numeric_limits<double>::quiet_NaN();

// Where the surface is cut along one axis: every sample, and every voxel wall that passes through twisted cells.
struct Lines {
  std::vector<double> at;              // world
  std::vector<int> sample;             // the sample at or before it
  std::vector<double> part;            // how far on towards the next one, [0, 1)
  [[nodiscard]] int count() const { return static_cast<int>(at.size()); }
};

struct Axis {
  int samples = 0;
  bool cyclic = false;
  double size = 1;
  double origin = 0, h = 1;            // of the grid
  int n = 1;
  [[nodiscard]] int cells() const { return cyclic ? samples : samples - 1; }
};

void add_line(Lines& lines, double at, int sample, double part) {
  lines.at.push_back(at);
  lines.sample.push_back(sample);
  lines.part.push_back(part);
}

Lines sample_lines(const Axis& axis, const std::vector<char>& twisted, int parts) {
  Lines lines;
  std::vector<double> inner;
  for (int c = 0; c < axis.cells(); ++c) {
    const double from = axis.size * c / axis.cells(), to = axis.size * (c + 1) / axis.cells();
    add_line(lines, from, c, 0);
    if (!twisted[static_cast<std::size_t>(c)]) continue;
    inner.clear();
    for (int p = 1; p < parts; ++p) inner.push_back(from + (to - from) * p / parts);
    const int first = static_cast<int>(std::clamp(std::floor((from - axis.origin) / axis.h), -1.0, axis.n + 1.0));
    for (int k = std::max(first, 0); k <= axis.n; ++k) {
      const double wall = axis.origin + axis.h * k;
      if (wall > to) break;
      inner.push_back(wall);
    }
    std::sort(inner.begin(), inner.end());
    for (const double at : inner)
      if (at - lines.at.back() > kSame * axis.h && to - at > kSame * axis.h) add_line(lines, at, c, (at - from) / (to - from));
  }
  add_line(lines, axis.size, axis.cyclic ? 0 : axis.samples - 1, 0);
  return lines;
}

// For a function: the box's voxel walls, each voxel in `parts`, and the field's own ends.
Lines wall_lines(const Axis& axis, int parts) {
  Lines lines;
  add_line(lines, 0, 0, 0);
  for (int k = 0; k <= axis.n * parts; ++k) {
    const double at = axis.origin + axis.h * (static_cast<double>(k) / parts);
    if (at - lines.at.back() > kSame * axis.h && axis.size - at > kSame * axis.h) add_line(lines, at, 0, 0);
  }
  add_line(lines, axis.size, 0, 0);
  return lines;
}

using Triangle = std::array<std::uint32_t, 3>;

class Tessellation {
 public:
  Tessellation(const HeightField& field, const Grid& grid, const std::array<bool, 3>& cyclic) : field_(field), grid_(grid) {
    axes_[0] = {field.width, cyclic[0], field.size.x, grid.origin.x, grid.h, grid.n.x};
    axes_[1] = {field.height, cyclic[1], field.size.y, grid.origin.y, grid.h, grid.n.y};
    if (field.function) {
      constexpr double kPerFeature = 8;
      const int parts = std::clamp(static_cast<int>(std::ceil(kPerFeature * grid.h / field.detail)), kFunctionParts, 64);
      for (std::size_t a = 0; a < 2; ++a) lines_[a] = wall_lines(axes_[a], parts);
    } else {
      holes_ = std::any_of(field.z.begin(), field.z.end(), [](double z) { return std::isnan(z); });
      find_twists();
      for (std::size_t a = 0; a < 2; ++a) lines_[a] = sample_lines(axes_[a], twisted_[a], 1);
    }
  }

  [[nodiscard]] int nx() const { return lines_[0].count(); }
  [[nodiscard]] int ny() const { return lines_[1].count(); }
  [[nodiscard]] bool holes() const { return holes_; }

  // Sample, counted from the near left corner.
  [[nodiscard]] double sample(int x, int y) const {
    if (axes_[0].cyclic && x == field_.width) x = 0;
    if (axes_[1].cyclic && y == field_.height) y = 0;
    return field_.z[static_cast<std::size_t>(field_.height - 1 - y) * static_cast<std::size_t>(field_.width) + static_cast<std::size_t>(x)];
  }
  [[nodiscard]] bool cell_exists(int x, int y) const {
    return !holes_ || !std::isnan(sample(x, y) + sample(x + 1, y) + sample(x, y + 1) + sample(x + 1, y + 1));
  }
  // Piece (i, j) between lines i, i + 1 and j, j + 1. One beyond the border is the one at the other end on a cyclic axis, else none.
  [[nodiscard]] bool exists(int i, int j) const {
    if (i < 0 || i >= nx() - 1) {
      if (!axes_[0].cyclic) return false;
      i = i < 0 ? nx() - 2 : 0;
    }
    if (j < 0 || j >= ny() - 1) {
      if (!axes_[1].cyclic) return false;
      j = j < 0 ? ny() - 2 : 0;
    }
    return field_.function || cell_exists(lines_[0].sample[static_cast<std::size_t>(i)], lines_[1].sample[static_cast<std::size_t>(j)]);
  }
  [[nodiscard]] bool corner_used(int i, int j) const {
    if (!holes_) return true;
    const auto there = [&](int a, int b) { return a >= 0 && b >= 0 && a < nx() - 1 && b < ny() - 1 && exists(a, b); };
    return there(i, j) || there(i - 1, j) || there(i, j - 1) || there(i - 1, j - 1);
  }

  // Heights along line j. NaN where there is no data on every side.
  void heights(int j, std::vector<double>& z) const {
    const auto n = static_cast<std::size_t>(nx()), row = static_cast<std::size_t>(j);
    z.resize(n);
    if (field_.function) {
      const std::vector<double> y(n, lines_[1].at[row]);
      field_.function(n, lines_[0].at.data(), y.data(), z.data(), nullptr, nullptr);
      return;
    }
    const int sy = lines_[1].sample[row];
    const double ty = lines_[1].part[row];
    for (std::size_t i = 0; i < n; ++i) {
      const int sx = lines_[0].sample[i];
      const double tx = lines_[0].part[i];
      // On a line of samples only those on it count: beside it there may be none.
      const auto along = [&](int y) { return tx > 0 ? mixed(sample(sx, y), sample(sx + 1, y), tx) : sample(sx, y); };
      z[i] = ty > 0 ? mixed(along(sy), along(sy + 1), ty) : along(sy);
    }
  }

  // Calls corner(i, id) for the corners used along line j, in order, from `id` on; returns the next id.
  template <class Call>
  std::size_t corners(int j, std::size_t id, Call&& call) const {
    for (int i = 0; i < nx(); ++i)
      if (corner_used(i, j)) call(i, id++);
    return id;
  }

  // The pieces between lines j and j + 1. sink.corner(i, row), sink.centre(V3d), sink.triangle(a, b, c), sink.below(id, i, j).
  template <class Sink>
  void pieces(int j, Sink& sink) const {
    std::vector<double> z0, z1, mean;
    heights(j, z0);
    heights(j + 1, z1);
    if (field_.function) means(j, mean);
    const std::vector<double>& x = lines_[0].at;
    const double y0 = lines_[1].at[static_cast<std::size_t>(j)], y1 = lines_[1].at[static_cast<std::size_t>(j) + 1];
    for (int i = 0; i + 1 < nx(); ++i) {
      if (!exists(i, j)) continue;
      const auto s = static_cast<std::size_t>(i);
      const double z[4] = {z0[s], z0[s + 1], z1[s + 1], z1[s]};  // counter-clockwise from the near left one
      const double twist = z[0] - z[1] + z[2] - z[3], sum = z[0] + z[1] + z[2] + z[3];
      const std::uint32_t c[4] = {sink.corner(i, 0), sink.corner(i + 1, 0), sink.corner(i + 1, 1), sink.corner(i, 1)};
      if (holes_) {
        std::uint32_t b[4];
        for (std::size_t k = 0; k < 4; ++k) b[k] = sink.below(c[k], k == 1 || k == 2 ? i + 1 : i, k >= 2 ? j + 1 : j);
        sink.triangle(b[0], b[2], b[1]);
        sink.triangle(b[0], b[3], b[2]);
      }
      const double dx = x[s + 1] - x[s], dy = y1 - y0;
      if (!field_.function && std::abs(twist) <= kFlat * grid_.h) {
        sink.triangle(c[0], c[1], c[2]);
        sink.triangle(c[0], c[2], c[3]);
      } else {
        // A fan's mean is a sixth of the corners' sum and a third of its middle.
        const double middle = field_.function ? 3 * mean[s] - sum / 2 : sum / 4;
        const std::uint32_t m = sink.centre(V3d(x[s] + dx / 2, y0 + dy / 2, middle));
        for (std::size_t k = 0; k < 4; ++k) sink.triangle(c[k], c[(k + 1) % 4], m);
      }
      const bool open[4] = {!exists(i, j - 1), !exists(i + 1, j), !exists(i, j + 1), !exists(i - 1, j)};
      const int ci[4] = {i, i + 1, i + 1, i}, cj[4] = {j, j, j + 1, j + 1};
      for (std::size_t k = 0; k < 4; ++k) {
        if (!open[k]) continue;
        const std::size_t l = (k + 1) % 4;
        const std::uint32_t a = sink.below(c[k], ci[k], cj[k]), b = sink.below(c[l], ci[l], cj[l]);
        if (z[l] > field_.base) sink.triangle(a, b, c[l]);  // else without area: the field lies on its base there
        if (z[k] > field_.base) sink.triangle(a, c[l], c[k]);
      }
    }
  }

  // The border of the bottom, counter-clockwise seen from above, each corner once.
  [[nodiscard]] std::size_t loop_length() const { return 2 * (static_cast<std::size_t>(nx()) + static_cast<std::size_t>(ny())) - 4; }
  [[nodiscard]] std::size_t loop_place(int i, int j) const {
    const std::size_t mx = static_cast<std::size_t>(nx()) - 1, my = static_cast<std::size_t>(ny()) - 1, x = static_cast<std::size_t>(i), y = static_cast<std::size_t>(j);
    if (y == 0) return x;
    if (x == mx) return mx + y;
    if (y == my) return mx + my + (mx - x);
    return 2 * mx + my + (my - y);
  }

  [[nodiscard]] V3d corner_point(int i, int j, double z) const { return {lines_[0].at[static_cast<std::size_t>(i)], lines_[1].at[static_cast<std::size_t>(j)], z}; }
  // Place in the picture, pixel on pixel: sample k of n is the middle of pixel k.
  [[nodiscard]] V2f uv(const V3d& p) const {
    if (field_.function) return {static_cast<float>(p.x / field_.size.x), static_cast<float>(p.y / field_.size.y)};
    const double u = (p.x / field_.size.x * axes_[0].cells() + 0.5) / field_.width, v = (p.y / field_.size.y * axes_[1].cells() + 0.5) / field_.height;
    return {static_cast<float>(u), static_cast<float>(v)};
  }

 private:
  static double mixed(double a, double b, double t) { return a + (b - a) * t; }

  // Which columns and rows of cells have some twist; only those need cutting.
  void find_twists() {
    const int cx = axes_[0].cells(), cy = axes_[1].cells();
    twisted_[0].assign(static_cast<std::size_t>(cx), 0);
    twisted_[1].assign(static_cast<std::size_t>(cy), 0);
    for (int y = 0; y < cy; ++y)
      for (int x = 0; x < cx; ++x) {
        const double twist = sample(x, y) - sample(x + 1, y) + sample(x + 1, y + 1) - sample(x, y + 1);
        if (std::abs(twist) > kFlat * grid_.h) twisted_[0][static_cast<std::size_t>(x)] = twisted_[1][static_cast<std::size_t>(y)] = 1;
      }
  }

  // Mean heights of a function over the pieces between lines j and j + 1, by 3 × 3 Gauss points: exact for a biquintic.
  void means(int j, std::vector<double>& mean) const {
    constexpr double kAt[3] = {0.5 - 0.3872983346207417, 0.5, 0.5 + 0.3872983346207417}, kWeight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    const auto n = static_cast<std::size_t>(nx()) - 1, row = static_cast<std::size_t>(j);
    const double y0 = lines_[1].at[row], dy = lines_[1].at[row + 1] - y0;
    std::vector<double> x(n * 3), y(n * 3), z(n * 3);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < 3; ++k) x[i * 3 + k] = lines_[0].at[i] + (lines_[0].at[i + 1] - lines_[0].at[i]) * kAt[k];
    mean.assign(n, 0);
    for (std::size_t l = 0; l < 3; ++l) {
      std::fill(y.begin(), y.end(), y0 + dy * kAt[l]);
      field_.function(n * 3, x.data(), y.data(), z.data(), nullptr, nullptr);
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < 3; ++k) mean[i] += kWeight[l] * kWeight[k] * z[i * 3 + k];
    }
  }

  static constexpr int kFunctionParts = 2;
  const HeightField& field_;
  Grid grid_;
  Axis axes_[2];
  Lines lines_[2];
  std::vector<char> twisted_[2];
  bool holes_ = false;
};

// What a row of pieces adds: counted first and stored then, by the same code.
struct Counter {
  std::size_t centres = 0, triangles = 0;
  std::uint32_t corner(int, int) { return 0; }
  std::uint32_t centre(const V3d&) { ++centres; return 0; }
  std::uint32_t below(std::uint32_t, int, int) { return 0; }
  void triangle(std::uint32_t, std::uint32_t, std::uint32_t) { ++triangles; }
};

// Where the parts of a field's mesh lie. Points: all corners row by row, all middles, the bottom. Triangles: the bottom first, since a ray
// that meets it and the surface at one height, where the field lies on its base, enters before it leaves.
struct Layout {
  std::vector<std::size_t> corners, centres, triangles;  // of each row, from the field's own first; one more at the end
  std::size_t bottom = 0, points = 0, faces = 0;
};

void add_up(std::vector<std::size_t>& counts, std::size_t from) {
  for (std::size_t& count : counts) {
    const std::size_t next = from + count;
    count = from;
    from = next;
  }
}

Layout make_layout(const Tessellation& t) {
  const auto rows = static_cast<std::size_t>(t.ny());
  Layout layout;
  layout.corners.assign(rows + 1, 0);
  layout.centres.assign(rows, 0);
  layout.triangles.assign(rows, 0);
  tbb::parallel_for(0, t.ny(), [&](int j) {
    const auto row = static_cast<std::size_t>(j);
    layout.corners[row] = t.corners(j, 0, [](int, std::size_t) {});
    if (j + 1 == t.ny()) return;
    Counter counter;
    t.pieces(j, counter);
    layout.centres[row] = counter.centres;
    layout.triangles[row] = counter.triangles;
  });
  add_up(layout.corners, 0);
  add_up(layout.centres, layout.corners.back());
  add_up(layout.triangles, t.holes() ? 0 : t.loop_length());
  layout.bottom = layout.centres.back();
  layout.points = layout.bottom + (t.holes() ? layout.corners.back() : t.loop_length() + 1);
  layout.faces = layout.triangles.back();
  return layout;
}

struct Storer {
  const Tessellation& t;
  const Layout& layout;
  Mesh& mesh;
  std::size_t first_point;
  std::size_t at_centre, at_triangle;
  std::vector<std::uint32_t> ids[2];   // of the corners along the two lines

  std::uint32_t corner(int i, int row) const { return ids[row][static_cast<std::size_t>(i)]; }
  std::uint32_t centre(const V3d& p) {
    mesh.points[at_centre] = p;
    return static_cast<std::uint32_t>(at_centre++);
  }
  std::uint32_t below(std::uint32_t id, int i, int j) const {
    return static_cast<std::uint32_t>(t.holes() ? id + layout.bottom : first_point + layout.bottom + t.loop_place(i, j));
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh.triangles[at_triangle++] = {a, b, c}; }
};

void store_rows(const HeightField& field, const Tessellation& t, const Layout& layout, std::size_t first_point, std::size_t first_triangle, Mesh& mesh) {
  tbb::parallel_for(0, t.ny(), [&](int j) {
    const auto row = static_cast<std::size_t>(j);
    std::vector<double> z;
    t.heights(j, z);
    t.corners(j, first_point + layout.corners[row], [&](int i, std::size_t id) {
      mesh.points[id] = t.corner_point(i, j, z[static_cast<std::size_t>(i)]);
      if (t.holes()) mesh.points[id + layout.bottom] = t.corner_point(i, j, field.base);
    });
    if (j + 1 == t.ny()) return;
    Storer storer{t, layout, mesh, first_point, first_point + layout.centres[row], first_triangle + layout.triangles[row], {}};
    for (int k = 0; k < 2; ++k) {
      storer.ids[k].assign(static_cast<std::size_t>(t.nx()), kNoIndex);
      t.corners(j + k, first_point + layout.corners[row + static_cast<std::size_t>(k)],
                [&](int i, std::size_t id) { storer.ids[k][static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(id); });
    }
    t.pieces(j, storer);
  });
}

// One rectangle, as a fan about its middle to every corner of the walls: nothing on it needs smaller pieces.
void store_bottom(const HeightField& field, const Tessellation& t, const Layout& layout, std::size_t first_point, std::size_t first_triangle, Mesh& mesh) {
  const std::size_t first = first_point + layout.bottom, length = t.loop_length(), middle = first + length;
  for (int i = 0; i < t.nx(); ++i)
    for (const int j : {0, t.ny() - 1}) mesh.points[first + t.loop_place(i, j)] = t.corner_point(i, j, field.base);
  for (int j = 0; j < t.ny(); ++j)
    for (const int i : {0, t.nx() - 1}) mesh.points[first + t.loop_place(i, j)] = t.corner_point(i, j, field.base);
  mesh.points[middle] = V3d(field.size.x / 2, field.size.y / 2, field.base);
  for (std::size_t k = 0; k < length; ++k)
    mesh.triangles[first_triangle + k] = {static_cast<std::uint32_t>(first + (k + 1) % length), static_cast<std::uint32_t>(first + k), static_cast<std::uint32_t>(middle)};
}

// A function's own normals, at the corners and middles of its surface. Walls and bottom have points of their own that have none.
void store_normals(const HeightField& field, const Layout& layout, std::size_t first_point, Mesh& mesh) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, layout.bottom, 4096), [&](const tbb::blocked_range<std::size_t>& range) {
    std::vector<double> x, y, z(range.size()), dx(range.size()), dy(range.size());
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      x.push_back(mesh.points[first_point + i].x);
      y.push_back(mesh.points[first_point + i].y);
    }
    field.function(range.size(), x.data(), y.data(), z.data(), dx.data(), dy.data());
    for (std::size_t i = 0; i < range.size(); ++i) mesh.normals[first_point + range.begin() + i] = V3f(V3d(-dx[i], -dy[i], 1).normalized());
  });
}

void add_field(const HeightField& field, const Grid& grid, const std::array<bool, 3>& cyclic, Scene& scene, Report& report) {
  const Tessellation t(field, grid, cyclic);
  const Layout layout = make_layout(t);
  Mesh& mesh = scene.mesh;
  const std::size_t first_point = mesh.points.size(), first_triangle = mesh.triangles.size(), first_uv = mesh.uvs.size();
  if (first_point + layout.points >= kNoIndex || first_triangle + layout.faces >= kNoIndex || first_uv + layout.points >= kNoIndex)
    throw Error(Code::kUnsupported, field.name, "its surface takes more than 2^32 vertices or triangles", "scale the picture down");
  mesh.points.resize(first_point + layout.points);
  mesh.triangles.resize(first_triangle + layout.faces);
  mesh.materials.resize(first_triangle + layout.faces, field.material);
  if (!mesh.colors.empty()) mesh.colors.resize(mesh.points.size(), V3f(1, 1, 1));
  store_rows(field, t, layout, first_point, first_triangle, mesh);
  if (!t.holes()) store_bottom(field, t, layout, first_point, first_triangle, mesh);

  if (field.function || !mesh.normals.empty()) mesh.normals.resize(mesh.points.size(), V3f(0, 0, 0));
  if (field.function) store_normals(field, layout, first_point, mesh);
  if (field.textured || !mesh.uv_corners.empty()) mesh.uv_corners.resize(mesh.triangles.size(), {kNoIndex, kNoIndex, kNoIndex});
  if (field.textured) {
    mesh.uvs.resize(first_uv + layout.points);
    tbb::parallel_for(std::size_t{0}, layout.points, [&](std::size_t i) { mesh.uvs[first_uv + i] = t.uv(mesh.points[first_point + i]); });
    const auto shift = static_cast<std::uint32_t>(first_uv - first_point);  // wraps around where there are fewer uvs than points before
    tbb::parallel_for(std::size_t{0}, layout.faces, [&](std::size_t i) {
      const Triangle& corners = mesh.triangles[first_triangle + i];
      mesh.uv_corners[first_triangle + i] = {corners[0] + shift, corners[1] + shift, corners[2] + shift};
    });
    if (cyclic[0] && cyclic[1]) scene.materials[field.material].map_kd.wrap.fill(Wrap::kRepeat);
  }
  report.count("triangles of height fields", static_cast<double>(layout.faces));
}

}  // namespace

Box3d height_bounds(const HeightField& field, const std::array<bool, 3>& cyclic) {
  Box3d box;
  box.extendBy(V3d(0, 0, std::min(field.base, field.low)));
  box.extendBy(V3d(field.size.x, field.size.y, field.high));
  if (std::none_of(field.z.begin(), field.z.end(), [](double z) { return std::isnan(z); })) return box;
  // Holes may reach the border. The mesh's own bounds in x and y are those of the cells there are.
  const int w = field.width, h = field.height, cx = cyclic[0] ? w : w - 1, cy = cyclic[1] ? h : h - 1;
  const auto at = [&](int x, int y) { return field.z[static_cast<std::size_t>(h - 1 - y % h) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x % w)]; };
  int x0 = cx, x1 = 0, y0 = cy, y1 = 0;
  for (int y = 0; y < cy; ++y)
    for (int x = 0; x < cx; ++x) {
      if (std::isnan(at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1))) continue;
      x0 = std::min(x0, x);
      x1 = std::max(x1, x + 1);
      y0 = std::min(y0, y);
      y1 = std::max(y1, y + 1);
    }
  box.min.x = field.size.x * x0 / cx;
  box.max.x = field.size.x * x1 / cx;
  box.min.y = field.size.y * y0 / cy;
  box.max.y = field.size.y * y1 / cy;
  return box;
}

Scene mesh_heights(Scene scene, const Recipe& recipe, Report& report) {
  if (scene.heights.empty()) return scene;
  const StageTimer timer(report, "height fields");
  const Grid grid = plan_grid(scene, recipe);
  for (const HeightField& field : scene.heights) {
    scene.bounds.extendBy(height_bounds(field, recipe.cyclic));
    add_field(field, grid, recipe.cyclic, scene, report);
  }
  scene.heights.clear();
  scene.heights.shrink_to_fit();
  return scene;
}

}  // namespace texel
