#include "tests/stress/invariants.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "bake/ndf.h"
#include "formats/read_pack.h"
#include "tests/stress/truth.h"

namespace texel::stress {
namespace {

constexpr double kFloat = 0x1p-24;  // half a unit in the last place of a stored float, relative
constexpr std::size_t kMost = 12;   // faults that are told

struct Faults {
  std::vector<std::string> list;

  template <class... Parts>
  void add(const Parts&... parts) {
    if (list.size() >= kMost) return;
    std::ostringstream text;
    text.precision(17);
    (text << ... << parts);
    list.push_back(text.str());
  }
};

struct Printed { const V3i& v; };
std::ostream& operator<<(std::ostream& out, const Printed& p) { return out << "(" << p.v.x << " " << p.v.y << " " << p.v.z << ")"; }

// A channel as a dense array; empty where the level has none of the name.
struct Field {
  V3i n{0, 0, 0};
  std::size_t components = 0;
  std::vector<float> values;
  std::vector<char> state;  // 0 not active, 1 voxel, 2 tile

  Field(const Level& level, const std::string& name, Faults& faults) {
    const Layer* layer = nullptr;
    const Channel* channel = level.find(name, &layer);
    if (!channel) return;
    n = level.grid.n;
    components = static_cast<std::size_t>(channel->components);
    values.assign(static_cast<std::size_t>(level.grid.voxels()) * components, 0);
    state.assign(static_cast<std::size_t>(level.grid.voxels()), 0);
    const auto put = [&](const V3i& v, const float* from, char as) {
      if (v.x < 0 || v.y < 0 || v.z < 0 || v.x >= n.x || v.y >= n.y || v.z >= n.z) return faults.add(name, " ", Printed{v}, ": outside the grid");
      if (state[place(v)]) faults.add(name, " ", Printed{v}, ": active twice");
      state[place(v)] = as;
      std::copy(from, from + components, values.begin() + static_cast<std::ptrdiff_t>(place(v) * components));
    };
    for_each_voxel(layer->set, [&](const V3i& v, std::int64_t i) { put(v, channel->values.data() + static_cast<std::size_t>(i) * components, 1); });
    for (std::size_t t = 0; t < layer->tiles.size(); ++t)
      for (int i = 0; i < 512; ++i) put(layer->tiles[t] * 8 + V3i(i >> 6, i >> 3 & 7, i & 7), channel->tiles.data() + t * components, 2);
  }
  [[nodiscard]] bool there() const { return components > 0; }
  [[nodiscard]] std::size_t place(const V3i& v) const {
    return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(v.y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(v.x);
  }
  [[nodiscard]] double at(const V3i& v, int c = 0) const { return static_cast<double>(values[place(v) * components + static_cast<std::size_t>(c)]); }
  [[nodiscard]] bool active(const V3i& v) const { return there() && state[place(v)] != 0; }
};

// Finite, and within what the grid's name promises. Sets and tiles are well formed.
void look_through(const Level& level, Faults& faults) {
  for (const Layer& layer : level.layers) {
    std::int64_t running = 0;
    for (const Block& b : layer.set.blocks) {
      if (b.first != running) faults.add("block ", Printed{b.at}, " begins at ", b.first, ", not at ", running);
      running += count_voxels(b.mask);
    }
    if (layer.set.count != running) faults.add("a set counts ", layer.set.count, " of ", running, " voxels");
    for (const Channel& c : layer.channels) {
      const auto size = static_cast<std::size_t>(layer.set.count) * static_cast<std::size_t>(c.components);
      if (c.values.size() != size || c.tiles.size() != layer.tiles.size() * static_cast<std::size_t>(c.components)) {
        faults.add(c.name, ": ", c.values.size(), " values for ", size);
        continue;
      }
      const bool share = c.name == "alpha" || c.name == "solid" || c.name == "coverage" || c.name == "transparency" || c.name == "roughness" || c.name == "share_1";
      const bool is_signed = c.name == "normal" || c.name.ends_with("_off") || c.name.starts_with("axis_");
      for (const auto* list : {&c.values, &c.tiles})
        for (std::size_t i = 0; i < list->size(); ++i) {
          const float v = (*list)[i];
          if (!std::isfinite(v)) faults.add(c.name, " edge ", level.grid.h, " value ", i, ": ", v);
          else if ((!is_signed && v < 0) || (share && v > 1)) faults.add(c.name, " edge ", level.grid.h, " value ", i, " out of its range: ", v);
        }
    }
  }
}

// Two lobes: the shares' mean of their second moments of normals is that of S, from which S comes (t ∝ s^(1/1.3), ndf.h).
void check_lobes(const Level& level, int l, Faults& faults) {
  const Field share(level, "share_1", faults);
  if (!share.there()) return;
  const Field d0(level, "S_diag", faults), o0(level, "S_off", faults), d1(level, "S1_diag", faults), o1(level, "S1_off", faults), d2(level, "S2_diag", faults), o2(level, "S2_off", faults);
  const auto add_moment = [](const Field& d, const Field& o, const V3i& v, double weight, Symmetric& to) {
    const Eigen3 e = eigen({d.at(v, 0), d.at(v, 1), d.at(v, 2), o.at(v, 0), o.at(v, 1), o.at(v, 2)});
    double t[3], sum = 0;
    for (std::size_t i = 0; i < 3; ++i) sum += t[i] = std::pow(std::max(0.0, e.value[i]), 1 / 1.3);
    for (std::size_t i = 0; i < 3 && sum > 0; ++i) add_outer(to, e.vector[i], weight * t[i] / sum);
  };
  test::for_each_cell(level.grid.n, [&](const V3i& v) {
    if (!share.active(v)) return;
    const double p = share.at(v);
    if (!(p >= 0.5)) faults.add("level ", l, " share_1 ", Printed{v}, " ", p, ": the first lobe is the smaller");
    if (p == 1 && d2.at(v, 0) + d2.at(v, 1) + d2.at(v, 2) != 0) faults.add("level ", l, " S2 ", Printed{v}, " though the first lobe has all");
    Symmetric whole, lobes;
    add_moment(d0, o0, v, 1, whole);
    add_moment(d1, o1, v, p, lobes);
    if (p < 1) add_moment(d2, o2, v, 1 - p, lobes);
    // A float's rounding of an s that is 0 becomes (2⁻²⁴)^(1/1.3) = 3e-6 of t; some entries of those.
    for (const auto member : {&Symmetric::xx, &Symmetric::yy, &Symmetric::zz, &Symmetric::xy, &Symmetric::xz, &Symmetric::yz})
      if (!(std::abs(whole.*member - lobes.*member) <= 2e-5)) faults.add("level ", l, " lobes ", Printed{v}, " add up to ", lobes.*member, ", not ", whole.*member);
  });
}

void check_surface(const Level& level, int l, const V3i& finest, const Recipe& recipe, Faults& faults) {
  const Field area(level, "area", faults), crossings(level, "crossings", faults), normal(level, "normal", faults), diagonal(level, "S_diag", faults), off(level, "S_off", faults);
  const Field alpha(level, "alpha", faults), solid(level, "solid", faults), density(level, "density", faults), coverage(level, "coverage", faults);
  test::for_each_cell(level.grid.n, [&](const V3i& v) {
    if (area.active(v) && crossings.there()) {
      const double a = area.at(v), sum = crossings.at(v, 0) + crossings.at(v, 1) + crossings.at(v, 2);
      // A|n_k| of unit normals: between A and √3 A together, each at most A. Three floats, and a normal good to a few units of doubles. Cut-outs only take away.
      if (sum > a * std::sqrt(3.0) * (1 + 8 * kFloat) + 1e-37 || (!coverage.there() && sum < a * (1 - 8 * kFloat) - 1e-37)) faults.add("level ", l, " crossings ", Printed{v}, " sum ", sum, " area ", a);
      for (int k = 0; k < 3; ++k)
        if (crossings.at(v, k) > a * (1 + 4 * kFloat) + 1e-37) faults.add("level ", l, " crossings ", Printed{v}, "[", k, "] ", crossings.at(v, k), " above the area ", a);
    }
    if (normal.active(v)) {
      const V3d n(normal.at(v, 0), normal.at(v, 1), normal.at(v, 2));
      if (!(n.length() <= 1 + 4 * kFloat)) faults.add("level ", l, " normal ", Printed{v}, " length ", n.length());
    }
    if (diagonal.active(v)) {
      const Eigen3 e = eigen({diagonal.at(v, 0), diagonal.at(v, 1), diagonal.at(v, 2), off.at(v, 0), off.at(v, 1), off.at(v, 2)});
      // Each entry is rounded to a float: the matrix moves by at most √3·2⁻²⁴ of its norm, and so does each eigenvalue (Weyl). Eigenvectors are good to 1e-15.
      const double slack = 2 * kFloat;
      const bool cut_away = coverage.there() && coverage.at(v) <= 0;
      if (!cut_away && (!(std::abs(e.value[0] - 1) <= slack) || !(e.value[2] >= -slack))) faults.add("level ", l, " S ", Printed{v}, " eigenvalues ", e.value[0], " ", e.value[1], " ", e.value[2], " area ", area.there() ? area.at(v) : -1);
    }
    if (alpha.active(v)) {
      const bool surface = crossings.active(v);
      bool juts = false;  // out of the finest level's box: matter ends there
      for (int k = 0; k < 3; ++k) juts = juts || (v[k] + 1) << l > finest[k];
      for (int k = 0; k < 3; ++k) {
        const double most = surface ? crossings.at(v, k) : 0, a = alpha.at(v, k);
        if (solid.at(v) <= 0 && a > most * (1 + 4 * kFloat) + 1e-37) faults.add("level ", l, " alpha ", Printed{v}, "[", k, "] ", a, " above crossings ", most, " without matter");
        // Matter that fills the voxel stops every ray.
        if (!surface && !juts && a != 1) faults.add("level ", l, " alpha ", Printed{v}, "[", k, "] ", a, " where all is inside");
      }
      if (!surface && !juts && solid.at(v) != 1) faults.add("level ", l, " solid ", Printed{v}, " ", solid.at(v), " without surface");
    }
    if (density.active(v) && density.at(v) * level.grid.h > recipe.max_depth * (1 + 4 * kFloat)) faults.add("level ", l, " density ", Printed{v}, " deeper than the cap: ", density.at(v) * level.grid.h);
  });
}

// A parent is the sum of its eight children.
void check_parents(const Case& made, const Level& fine, const Level& coarse, int l, Faults& faults) {
  const Recipe& recipe = made.recipe;
  for (const char* name : {"area", "crossings", "solid", "normal", "alpha"}) {
    const Field children(fine, name, faults), parents(coarse, name, faults);
    if (!children.there() || !parents.there()) continue;
    const std::string grid = name;
    const Field area(fine, "area", faults), own(coarse, "area", faults), cut(fine, "coverage", faults), filled(fine, "solid", faults), met(fine, "crossings", faults);
    if (grid == "normal" && (!area.there() || cut.there() || recipe.normals == Normals::kVisible)) continue;
    test::for_each_cell(parents.n, [&](const V3i& p) {
      bool any = false;
      double sum[3] = {0, 0, 0}, size[3] = {0, 0, 0}, least[3] = {0, 0, 0}, most[3] = {0, 0, 0};
      double column_least[3][4] = {}, column_most[3][4] = {};
      bool sharp = made.disjoint;  // all children full or empty
      for (int i = 0; i < 8; ++i) {
        const V3i v = p * 2 + V3i(i & 1, i >> 1 & 1, i >> 2);
        if (v.x >= children.n.x || v.y >= children.n.y || v.z >= children.n.z || !children.active(v)) continue;
        any = true;
        sharp = sharp && filled.there() && (filled.at(v) == 1 || (filled.at(v) == 0 && met.active(v) && met.at(v, 0) + met.at(v, 1) + met.at(v, 2) == 0));
        for (int k = 0; k < static_cast<int>(children.components); ++k) {
          const double weight = grid == "normal" ? area.at(v) / 4 : grid == "solid" ? 1.0 / 8 : 0.25;
          sum[k] += children.at(v, k) * weight;
          size[k] += std::abs(children.at(v, k)) * weight;
          if (grid != "alpha") continue;
          const int column = k == 0 ? i >> 1 : k == 1 ? (i & 1) | (i >> 2) << 1 : i & 3;
          column_least[k][column] = std::max(column_least[k][column], children.at(v, k));
          column_most[k][column] = std::min(1.0, column_most[k][column] + children.at(v, k));
        }
      }
      if (any && !parents.active(p)) return faults.add("level ", l, " ", name, " ", Printed{p}, " is not active, a child is");
      // Whole inside blocks need not be in the same layers, but surface comes from surface.
      if (!any && parents.active(p)) return faults.add("level ", l, " ", name, " ", Printed{p}, " is active, no child is");
      if (!any) return;
      for (int k = 0; k < static_cast<int>(children.components); ++k) {
        const double value = parents.at(p, k) * (grid == "normal" ? own.at(p) : 1);
        if (grid == "alpha") {
          for (int c = 0; c < 4; ++c) {
            least[k] += column_least[k][c] / 4;
            most[k] += column_most[k][c] / 4;
          }
          // A ray is stopped in the parent where one of two children stops it. Where children are full or empty, the parent is exact, unless matter enters the box along the
          // axis in a column that has surface in all its voxels: what of it is inside there only the rays tell, off by a row of them at an edge (at least 2·samples of them
          // along a parent's edge). Else all are estimates from rays, and of a few of them only.
          const bool enters = made.solid && std::any_of(made.solid->points.begin(), made.solid->points.end(), [&](const V3d& q) { return q[k] < fine.grid.origin[k]; });
          const double slack = sharp && !enters ? 1e-4 : sharp ? 0.5 / (recipe.samples > 0 ? recipe.samples : 4) + 1e-4 : recipe.samples >= 4 || recipe.samples == 0 ? 0.5 : 1;
          if (value >= least[k] - slack && value <= most[k] + slack) continue;
          std::string of;
          for (int i = 0; i < 8; ++i)
            if (const V3i v = p * 2 + V3i(i & 1, i >> 1 & 1, i >> 2); v.x < children.n.x && v.y < children.n.y && v.z < children.n.z && children.active(v))
              of.append(" ").append(std::to_string(children.at(v, k))).append(" (solid ").append(std::to_string(filled.at(v))).append(")");
          faults.add("level ", l, " alpha ", Printed{p}, "[", k, "] ", value, " not within ", least[k], " … ", most[k], ", of children", of);
          continue;
        }
        // Nine roundings to floats.
        if (std::abs(value - sum[k]) > 12 * kFloat * std::max(size[k], grid == "normal" ? own.at(p) : 0.0) + 1e-37) faults.add("level ", l, " ", name, " ", Printed{p}, "[", k, "] ", value, ", children's sum ", sum[k]);
      }
    });
  }
}

void check_area(const Case& made, const Pack& pack, Faults& faults) {
  if (!made.scene.instances.empty() || made.scene.fibres.strands() > 0 || pack.levels.empty()) return;
  const AreaTruth truth = area_within(made.scene.mesh, pack.grid);
  for (std::size_t l = 0; l < pack.levels.size(); ++l) {
    const Level& level = pack.levels[l];
    const Channel* channel = level.find("area");
    if (!channel) return;
    long double sum = 0;
    for (const float v : channel->values) sum += static_cast<long double>(v);
    const long double face = static_cast<long double>(level.grid.h) * level.grid.h, area = sum * face;
    // Floats: half a step of each value; below 1e-38 their steps stay 1.4e-45.
    const long double slack = truth.slack + 2 * kFloat * area + static_cast<long double>(channel->values.size()) * 1e-44L * face;
    if (!(area >= truth.least - slack && area <= truth.most + slack))
      faults.add("level ", l, " sum of areas ", static_cast<double>(area), ", of the mesh ", static_cast<double>(truth.least), " … ", static_cast<double>(truth.most), " give or take ", static_cast<double>(slack));
  }
}

// Voxels without surface are inside or outside as a whole, so their centres say which. The filled volume is exact where matter does not overlap.
void check_solid(const Case& made, const Pack& pack, Tally& tally, Faults& faults) {
  if (!made.solid || pack.levels.empty() || made.recipe.fill == Fill::kOff) return;
  const Level& level = pack.levels[0];
  const Field solid(level, "solid", faults), area(level, "area", faults);
  if (!solid.there() || !area.there()) return;
  double filled = 0;
  int asked = 0;
  test::for_each_cell(level.grid.n, [&](const V3i& v) {
    filled += solid.at(v);
    if (area.active(v) || ++asked > 4000) return;
    // Far from rounding: no surface is in this voxel, so the nearest is half an edge away; its plane may be nearer.
    const std::optional<int> winding = winding_at(*made.solid, level.grid.centre(v), 1e-9 * level.grid.h);
    if (!winding) return;
    ++tally.asked_inside;
    if ((*winding != 0) != (solid.at(v) == 1)) faults.add("voxel ", Printed{v}, " has winding number ", *winding, " but solid ", solid.at(v));
  });
  if (!made.disjoint) return;
  const Box3d box = pack.grid.box();
  for (const auto& t : made.solid->triangles)
    for (const std::uint32_t v : t)
      if (!box.intersects(made.solid->points[v])) return;  // a part of it is known to the bake alone
  const double truth = static_cast<double>(volume_of(*made.solid) / (static_cast<long double>(level.grid.h) * level.grid.h * level.grid.h));
  // Each border voxel's share is exact to rounding of its coordinates and stored as a float; a fill that is not exactly known falls back on chords.
  const double slack = 1e-6 * static_cast<double>(solid.values.size()) + 1e-6 * truth;
  if (std::abs(filled - truth) > slack) faults.add("filled volume ", filled, " voxels, of the solid ", truth, " give or take ", slack);
}

void check_slices(const Pack& pack, const Recipe& recipe, Faults& faults) {
  for (const SliceStack& s : pack.slices) {
    const BundleAxes axes = bundle_axes(s.axis);
    const bool same = s.level == 0 && s.count == pack.grid.n[s.axis] && !pack.levels.empty();
    std::optional<Field> alpha, clear;
    if (same) {
      alpha.emplace(pack.levels[0], "alpha", faults);
      clear.emplace(pack.levels[0], "transparency", faults);
    }
    const double rays = std::pow(recipe.samples > 0 ? recipe.samples : 4, 2);
    for (int k = 0; k < s.count; ++k) {
      const Image image = s.image(k);
      if (image.width != s.width || image.height != s.height) return faults.add("slice ", k, " axis ", s.axis, " is ", image.width, " x ", image.height);
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
          const float* p = image.at(x, y);
          for (int c = 0; c < 4; ++c)
            if (!std::isfinite(p[c]) || p[c] < 0 || (c == 3 && p[c] > 1)) faults.add("slice ", k, " axis ", s.axis, " pixel ", x, " ", y, " channel ", c, ": ", p[c]);
          if (!same || !alpha->there() || clear->there()) continue;
          V3i v;
          v[axes.u] = x;
          v[axes.v] = s.height - 1 - y;
          v[s.axis] = k;
          const double volume = alpha->at(v, s.axis), picture = static_cast<double>(p[3]);
          // The picture has the volume's alpha, to a float's rounding; where rays and clipped surface put a crossing on either side of a wall, a few rays.
          if (std::abs(volume - picture) > 1e-5 + 4 / rays) faults.add("slice ", k, " axis ", s.axis, " pixel ", x, " ", y, " alpha ", picture, ", of the volume ", volume);
        }
    }
  }
}

}  // namespace

std::vector<std::string> faults_of(const Case& made, const Pack& pack, Tally& tally) {
  Faults faults;
  for (std::size_t l = 0; l < pack.levels.size(); ++l) {
    const std::size_t before = faults.list.size();
    look_through(pack.levels[l], faults);
    if (faults.list.size() > before) return faults.list;  // not to be computed with
    check_surface(pack.levels[l], static_cast<int>(l), pack.grid.n, made.recipe, faults);
    check_lobes(pack.levels[l], static_cast<int>(l), faults);
    if (l > 0) check_parents(made, pack.levels[l - 1], pack.levels[l], static_cast<int>(l), faults);
    for (const Layer& layer : pack.levels[l].layers) tally.voxels += layer.set.count;
  }
  check_area(made, pack, faults);
  check_solid(made, pack, tally, faults);
  check_slices(pack, made.recipe, faults);
  const Statistics& s = pack.statistics;
  for (const double v : {s.area, s.covered_area, s.volume})
    if (!std::isfinite(v)) faults.add("a figure of the statistics is not finite");
  if (!made.expects_issue.empty() && !test::has_issue(pack, made.expects_issue)) faults.add("no issue ", made.expects_issue);
  return faults.list;
}

std::vector<std::string> faults_of_files(const Pack& pack, const Recipe& recipe, const std::string& folder) {
  Faults faults;
  Report report;
  write_pack(pack, folder, recipe.write, report);
  for (const CheckFinding& f : check_pack(folder)) faults.add("check: ", f.id, " ", f.file, " ", f.text);
  const Pack read = read_pack(folder);
  for (const Level& level : read.levels) look_through(level, faults);
  for (const SliceStack& s : read.slices)
    for (int k = 0; k < s.count; ++k)
      for (const float v : s.image(k).pixels)
        if (!std::isfinite(v)) faults.add("slice file ", k, " axis ", s.axis, " holds ", v);
  std::filesystem::remove_all(folder);
  return faults.list;
}

}  // namespace texel::stress
