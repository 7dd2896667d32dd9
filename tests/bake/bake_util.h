#pragma once
// What the baker's tests share. Test code only.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "bake/bake.h"
#include "bake/plan.h"
#include "bake/surface.h"
#include "bake/texture.h"
#include "bake/visibility.h"
#include "formats/read.h"
#include "tests/bake/made_scene.h"

namespace texel::test {

// splitmix64: the same numbers everywhere, unlike the standard distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits() {
    std::uint64_t x = state_ += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  V3d direction() {
    for (;;) {
      const V3d d(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
      if (const double l = d.length(); l > 1e-3 && l <= 1) return d / l;
    }
  }

 private:
  std::uint64_t state_;
};

// A rotation as its three columns.
struct Rotation {
  V3d x, y, z;
  V3d operator()(const V3d& p) const { return x * p.x + y * p.y + z * p.z; }
};
inline Rotation random_rotation(Random& random) {
  const V3d x = random.direction();
  V3d y = random.direction();
  y = y - x * x.dot(y);
  while (y.length() < 0.1) { y = random.direction(); y = y - x * x.dot(y); }
  y.normalize();
  return {x, y, x.cross(y)};
}

inline Scene transformed(Scene scene, const std::function<V3d(const V3d&)>& map) {
  for (V3d& p : scene.mesh.points) p = map(p);
  return scene;
}

inline void add_triangle(Scene& scene, const V3d& a, const V3d& b, const V3d& c, std::uint32_t material = 0) {
  const auto p = static_cast<std::uint32_t>(scene.mesh.points.size());
  for (const V3d& v : {a, b, c}) scene.mesh.points.push_back(v);
  scene.mesh.triangles.push_back({p, p + 1, p + 2});
  scene.mesh.uv_corners.push_back({kNoIndex, kNoIndex, kNoIndex});
  scene.mesh.materials.push_back(material);
}

// Six quads, normals outward, or inward where `inside_out`. Faces in the order −x +x −y +y −z +z; those not in `faces` are left out.
inline void add_box(Scene& scene, const V3d& lo, const V3d& hi, bool inside_out = false, unsigned faces = 63, std::uint32_t material = 0) {
  const V3d s = hi - lo;
  const V3d x(s.x, 0, 0), y(0, s.y, 0), z(0, 0, s.z);
  const std::array<std::array<V3d, 3>, 6> quads{{{lo, z, y}, {lo + x, y, z}, {lo, x, z}, {lo + y, z, x}, {lo, y, x}, {lo + z, x, y}}};
  for (unsigned i = 0; i < 6; ++i) {
    if (!((faces >> i) & 1u)) continue;
    if (inside_out) add_quad(scene, quads[i][0], quads[i][2], quads[i][1], material);
    else add_quad(scene, quads[i][0], quads[i][1], quads[i][2], material);
  }
}

inline void turn_faces(Scene& scene, std::size_t from, std::size_t to) {
  for (std::size_t t = from; t < to; ++t) {
    std::swap(scene.mesh.triangles[t][1], scene.mesh.triangles[t][2]);
    if (!scene.mesh.uv_corners.empty()) std::swap(scene.mesh.uv_corners[t][1], scene.mesh.uv_corners[t][2]);
  }
}

inline double mesh_area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles)
    sum += (mesh.points[t[1]] - mesh.points[t[0]]).cross(mesh.points[t[2]] - mesh.points[t[0]]).length() / 2;
  return sum;
}
// Signed, about the first point, so that an offset costs no digits.
inline double mesh_volume(const Mesh& mesh) {
  double sum = 0;
  const V3d o = mesh.points[mesh.triangles[0][0]];
  for (const auto& t : mesh.triangles) sum += (mesh.points[t[0]] - o).dot((mesh.points[t[1]] - o).cross(mesh.points[t[2]] - o)) / 6;
  return sum;
}

inline Recipe volume_recipe(int resolution) {
  Recipe recipe;
  recipe.resolution = V3i(resolution, 0, 0);
  recipe.want.slices = false;
  recipe.want.preview = false;
  return recipe;
}

inline Pack bake_quietly(const Scene& scene, const Recipe& recipe) {
  Report report;
  return bake(scene, recipe, report);
}
inline bool has_issue(const Pack& pack, const std::string& id) {
  for (const Issue& i : pack.issues)
    if (i.id == id) return true;
  return false;
}

// A channel as a dense array over the grid, 0 where it is not active; small grids only.
struct Dense {
  V3i n{0, 0, 0};
  int components = 0;
  std::vector<float> values;
  std::vector<char> active;   // 0 not, 1 voxel, 2 tile
  [[nodiscard]] std::size_t place(const V3i& v) const { return (static_cast<std::size_t>(v.z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(v.y)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(v.x); }
  [[nodiscard]] bool holds(const V3i& v) const { return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x < n.x && v.y < n.y && v.z < n.z; }
  [[nodiscard]] float at(const V3i& v, int c = 0) const { return values[place(v) * static_cast<std::size_t>(components) + static_cast<std::size_t>(c)]; }
  [[nodiscard]] V3f at3(const V3i& v) const { return {at(v, 0), at(v, 1), at(v, 2)}; }
  [[nodiscard]] int state(const V3i& v) const { return holds(v) ? active[place(v)] : 0; }
};
inline Dense dense(const Level& level, const std::string& name) {
  Dense d;
  const Layer* layer = nullptr;
  const Channel* channel = level.find(name, &layer);
  if (!channel) { ADD_FAILURE() << "no grid " << name; return d; }
  d.n = level.grid.n;
  d.components = channel->components;
  const auto c = static_cast<std::size_t>(channel->components);
  const std::size_t count = static_cast<std::size_t>(level.grid.voxels());
  d.values.assign(count * c, 0);
  d.active.assign(count, 0);
  const auto put = [&](const V3i& v, const float* from, char state) {
    if (!d.holds(v)) { ADD_FAILURE() << name << ": voxel outside the grid"; return; }
    EXPECT_EQ(d.active[d.place(v)], 0) << name << ": a voxel twice";
    d.active[d.place(v)] = state;
    std::copy(from, from + c, d.values.begin() + static_cast<std::ptrdiff_t>(d.place(v) * c));
  };
  for_each_voxel(layer->set, [&](const V3i& v, std::int64_t i) { put(v, channel->values.data() + static_cast<std::size_t>(i) * c, 1); });
  for (std::size_t t = 0; t < layer->tiles.size(); ++t)
    for (int i = 0; i < 512; ++i) put(layer->tiles[t] * 8 + V3i(i >> 6, i >> 3 & 7, i & 7), channel->tiles.data() + t * c, 2);
  return d;
}
template <class Call>
void for_each_cell(const V3i& n, Call&& call) {
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) call(V3i(x, y, z));
}

// Σ of a scalar channel over voxels and tiles (512 voxels each).
inline double sum_of(const Level& level, const std::string& name) {
  const Layer* layer = nullptr;
  const Channel* channel = level.find(name, &layer);
  if (!channel) { ADD_FAILURE() << "no grid " << name; return 0; }
  double sum = 0;
  for (const float v : channel->values) sum += static_cast<double>(v);
  for (const float v : channel->tiles) sum += 512 * static_cast<double>(v);
  return sum;
}
inline double filled_volume(const Pack& pack) {
  return sum_of(pack.levels[0], "solid") * std::pow(pack.grid.h, 3);
}

// All that must hold of any pack whatever the input. Returns the number of values looked at.
inline std::int64_t check_invariants(const Pack& pack) {
  std::int64_t values = 0;
  for (const Level& level : pack.levels)
    for (const Layer& layer : level.layers) {
      std::int64_t running = 0;
      for (const Block& b : layer.set.blocks) {
        EXPECT_EQ(b.first, running);
        for (const std::uint64_t w : b.mask) running += __builtin_popcountll(w);
      }
      EXPECT_EQ(layer.set.count, running);
      for (const Channel& c : layer.channels) {
        EXPECT_EQ(c.values.size(), static_cast<std::size_t>(layer.set.count * c.components)) << c.name;
        EXPECT_EQ(c.tiles.size(), layer.tiles.size() * static_cast<std::size_t>(c.components)) << c.name;
        const bool share = c.name == "alpha" || c.name == "solid" || c.name == "coverage" || c.name == "share_1";
        const bool is_signed = c.name == "normal" || c.name.ends_with("_off") || c.name.starts_with("axis_");
        std::int64_t bad = 0;
        for (const auto* list : {&c.values, &c.tiles})
          for (const float v : *list) bad += !std::isfinite(v) || (!is_signed && v < 0) || (share && v > 1) || (c.name == "normal" && std::abs(v) > 1.000001f);
        EXPECT_EQ(bad, 0) << c.name << " at h " << level.grid.h;
        values += static_cast<std::int64_t>(c.values.size() + c.tiles.size());
      }
    }
  for (const SliceStack& s : pack.slices)
    for (int k = 0; k < s.count; ++k) {
      const Image image = s.image(k);
      EXPECT_EQ(image.width, s.width);
      EXPECT_EQ(image.height, s.height);
      std::int64_t bad = 0;
      for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const float v = image.pixels[i];
        bad += !std::isfinite(v) || v < 0 || (i % 4 == 3 && v > 1);
      }
      EXPECT_EQ(bad, 0) << "slice " << k << " along axis " << s.axis;
      values += static_cast<std::int64_t>(image.pixels.size());
    }
  return values;
}

// Stages 1 to 4 by themselves, for what the pack no longer holds.
struct Stages {
  Scene scene;
  Recipe recipe;
  Report report;
  std::unique_ptr<TextureSet> textures;
  Plan plan;
  std::vector<Surface> surfaces;
  VisibilityResult seen;
  SlabSums sums;
};
inline std::unique_ptr<Stages> run_stages(Scene scene, const Recipe& recipe, bool rays = true, int levels = 64) {
  auto s = std::make_unique<Stages>();
  s->scene = std::move(scene);
  s->recipe = recipe;
  s->textures = std::make_unique<TextureSet>(s->scene, TextureSet::Need::kColor, s->report);
  std::vector<bool> cutouts;
  for (std::uint32_t m = 0; m < s->scene.materials.size(); ++m) cutouts.push_back(s->textures->has_cutouts(m));
  s->plan = make_plan(s->scene, recipe, cutouts, s->report);
  s->surfaces.push_back(clip_surface(s->scene, s->plan, *s->textures, {}, s->report));
  for (Grid g = s->plan.grid; static_cast<int>(s->surfaces.size()) < levels && (g.n.x > 1 || g.n.y > 1 || g.n.z > 1); g = g.level(1))
    s->surfaces.push_back(coarser(s->surfaces.back()));
  if (!rays) return s;
  VisibilityOptions options;
  options.recompute = recipe.level_mode == LevelMode::kRecompute;
  options.slice_axes = {false, false, false};
  s->seen = see_voxels(s->scene, s->plan, *s->textures, s->surfaces, recipe, options, SliceShader{}, s->sums, s->report);
  return s;
}

inline std::string model_path(const std::string& name) { return std::string(TEXEL_SHARED_DATA) + "/models/" + name; }
// The scene of a model of ../shared/data; false, with the reason for GTEST_SKIP, where the folder is absent.
inline bool load_model(const std::string& name, Scene& scene, std::string& reason) {
  const std::string path = model_path(name);
  if (!std::filesystem::exists(path)) { reason = "not there: " + path; return false; }
  Report report;
  scene = read_scene(path, report);
  return true;
}
// A closed mesh with an unambiguous inside: one part, no crossings (data/models/README.md).
inline const std::vector<std::string>& closed_models() {
  static const std::vector<std::string> names{"spot/spot_triangulated.obj", "bunny_closed.off", "armadillo.off", "hedge/hedgeTextured.obj", "fuze/fuze.obj",
                                              "fixed_top.ply", "quadknot.obj", "sphere.off"};
  return names;
}

}  // namespace texel::test
