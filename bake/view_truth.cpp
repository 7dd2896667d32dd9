// Ground truth: the geometry itself, one ray per sample, surfaces met from front to back.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "bake/plan.h"
#include "bake/repeat.h"
#include "bake/repeat_functions.h"
#include "bake/shading.h"
#include "bake/view_density.h"
#include "formats/error.h"
#include "formats/instances.h"

namespace texel {

namespace {

constexpr int kMaxLayers = 256;        // surfaces one ray may pass; beyond it what is left counts as seen
constexpr float kSeen = 1.0f / 1024;   // transmittance below which a ray ends

// The plan of the bake, for which triangles it turns over, so that both pictures light the same side. Empty where the bake would refuse the scene.
Plan plan_of(const Scene& scene, const TextureSet& textures) {
  std::vector<bool> cutouts;
  for (std::uint32_t m = 0; m < scene.materials.size(); ++m) cutouts.push_back(textures.has_cutouts(m));
  Report unheard;
  try {
    return make_plan(scene, Recipe{}, cutouts, unheard);
  } catch (const Error&) {
    return {};
  }
}

struct Truth {
  const Scene& scene;
  const ViewOptions& options;
  Rays rays;
  double sample_share;                 // width of what one sample stands for, in pixels
  std::vector<Light> lights;
  V3f ambient;
  TextureSet textures;
  RayScene geometry;
  Plan plan;                           // turn −1: the triangle's other side is its front
  struct Piece { std::size_t point; std::uint32_t material; };
  std::vector<Piece> pieces;           // of fibres, as the rays number them
  std::vector<float> uv_scale;         // uv_per_world of each triangle, where its material is textured

  Truth(const Scene& s, const ViewOptions& o, Report& report)
      : scene(s), options(o), rays(make_rays(o.camera, o.width, o.height)), sample_share(1 / std::sqrt(static_cast<double>(o.samples))), lights(view_lights(o, rays)), ambient(ambient_of(lights)),
        textures(s, TextureSet::Need::kColor, report), geometry(s, &textures, {o.grid.box(), o.cyclic, 1}), plan(plan_of(s, textures)) {
    for (std::size_t k = 0; k < s.fibres.strands(); ++k)
      for (std::size_t i = s.fibres.first[k]; i + 1 < s.fibres.first[k + 1]; ++i) pieces.push_back({i, s.fibres.materials[k]});
    uv_scale.resize(s.mesh.triangles.size(), 0.0f);
    for (std::uint32_t t = 0; t < uv_scale.size(); ++t)
      if (textures.textured(material_of(s.mesh, t))) uv_scale[t] = uv_per_world(s.mesh, t);
  }

  [[nodiscard]] bool is_fibre(const RayScene::Hit& hit) const { return hit.instance == kNoIndex && hit.triangle >= scene.mesh.triangles.size(); }
  [[nodiscard]] const Mesh& mesh_of(const RayScene::Hit& hit) const { return hit.instance == kNoIndex ? scene.mesh : scene.shapes[scene.instances[hit.instance].shape]; }
  [[nodiscard]] std::uint32_t material_of(const Mesh& mesh, std::uint32_t triangle) const {
    return triangle < mesh.materials.size() && mesh.materials[triangle] < scene.materials.size() ? mesh.materials[triangle] : 0;
  }
  [[nodiscard]] std::uint32_t material(const RayScene::Hit& hit) const {
    return is_fibre(hit) ? pieces[hit.triangle - scene.mesh.triangles.size()].material : material_of(mesh_of(hit), hit.triangle);
  }
  // World, of a triangle.
  [[nodiscard]] V3d corner(const RayScene::Hit& hit, std::size_t i) const {
    const Mesh& mesh = mesh_of(hit);
    const V3d& p = mesh.points[mesh.triangles[hit.triangle][i]];
    return hit.instance == kNoIndex ? p : scene.instances[hit.instance].place * p;
  }
  [[nodiscard]] V3d point_of(const RayScene::Hit& hit) const {
    const double u = static_cast<double>(hit.u), v = static_cast<double>(hit.v);
    return corner(hit, 0) * (1 - u - v) + corner(hit, 1) * u + corner(hit, 2) * v;
  }
  [[nodiscard]] double uv_scale_of(const RayScene::Hit& hit) const;
  [[nodiscard]] bool is_turned(const RayScene::Hit& hit) const {
    const bool placed = hit.instance != kNoIndex;
    if (placed && plan.shapes.empty()) return false;
    const std::vector<std::int8_t>& turn = placed ? plan.shapes[scene.instances[hit.instance].shape].turn : plan.turn;
    return hit.triangle < turn.size() && turn[hit.triangle] < 0;
  }
  [[nodiscard]] bool faces_eye(const RayScene::Hit& hit) const { return hit.front != is_turned(hit); }
  [[nodiscard]] V3f light_from(const RayScene::Hit& hit, const Rays::Ray& ray, const V3f& albedo) const;
  [[nodiscard]] RayScene::Hit next_hit(const Rays::Ray& ray, double from) const;
  [[nodiscard]] bool clip_to_period(const Rays::Ray& ray, double* from, double* to) const;
  [[nodiscard]] V3f fibre_color(const RayScene::Hit& hit, const Rays::Ray& ray) const;
  void trace(const Rays::Ray& ray, V3f* color, float* alpha) const;
};

// Unit normal in double, robust for slivers; zero for a triangle without area.
V3d facet_normal(const V3d& p0, const V3d& p1, const V3d& p2) {
  const V3d a = p1 - p0, b = p2 - p0;
  const double scale = std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z), std::abs(b.x), std::abs(b.y), std::abs(b.z)});
  if (!(scale > 0) || !std::isfinite(scale)) return {0, 0, 0};
  const V3d n = (a / scale).cross(b / scale);
  const double length = std::sqrt(n.dot(n));
  return length > 0 ? n / length : V3d(0, 0, 0);
}

double Truth::uv_scale_of(const RayScene::Hit& hit) const {
  if (hit.instance == kNoIndex) return static_cast<double>(uv_scale[hit.triangle]);
  const Mesh& mesh = mesh_of(hit);
  if (!textures.textured(material(hit))) return 0;
  const auto& c = mesh.triangles[hit.triangle];
  const V3d p0 = corner(hit, 0);
  const double before = (mesh.points[c[1]] - mesh.points[c[0]]).cross(mesh.points[c[2]] - mesh.points[c[0]]).length(), after = (corner(hit, 1) - p0).cross(corner(hit, 2) - p0).length();
  return after > 0 ? static_cast<double>(uv_per_world(mesh, hit.triangle)) * std::sqrt(before / after) : 0;
}

V3f Truth::light_from(const RayScene::Hit& hit, const Rays::Ray& ray, const V3f& albedo) const {
  const std::uint32_t m = material(hit);
  const Material& stuff = scene.materials.empty() ? Material{} : scene.materials[m];
  const Look look{albedo, stuff.ks, stuff.ke, stuff.roughness};
  V3f sum = look.albedo * ambient + look.ke;
  V3d n = is_fibre(hit) ? hit.normal : facet_normal(corner(hit, 0), corner(hit, 1), corner(hit, 2));
  const bool mirrored = hit.instance != kNoIndex && scene.instances[hit.instance].place.determinant() < 0;
  if (!is_fibre(hit) && is_turned(hit) != mirrored) n = -n;
  const V3d v = -ray.direction;
  if (n.dot(v) < 0) {
    if (!textures.two_sided(m, options.two_sided)) return sum;  // its back: no light of its own gets there
    n = -n;
  }
  // On the triangle itself, in double: no self-shadowing from the ray's rounding.
  V3d point = ray.origin + ray.direction * hit.distance;
  if (!is_fibre(hit)) point = point_of(hit);
  for (const Light& light : lights) {
    V3d l;
    V3f color;
    if (!light_at(light, point, &l, &color) || !(n.dot(l) > 0)) continue;
    const float visible = options.shadows ? geometry.visibility(light, point, n) : 1.0f;
    if (visible > 0) sum += lit_facet(look, n, v, l, color) * visible;
  }
  return sum;
}

// Faces modelled twice, once for each side, lie at one distance but for rounding: the side that faces the eye is the one seen.
RayScene::Hit Truth::next_hit(const Rays::Ray& ray, double from) const {
  const double width = sample_share * rays.footprint(0), spread = sample_share * rays.footprint(1) - width;
  const RayScene::Hit hit = geometry.first_covered_hit(ray.origin, ray.direction, from, width, spread);
  if (hit.triangle == kNoIndex || faces_eye(hit) || textures.two_sided(material(hit), options.two_sided)) return hit;
  const RayScene::Hit other = geometry.first_covered_hit(ray.origin, ray.direction, hit.distance + geometry.skin() * 0.1, width, spread);
  const bool twin = other.triangle != kNoIndex && faces_eye(other) && other.distance - hit.distance < 2 * geometry.skin();
  return twin ? other : hit;
}

// The part of the ray within the period, a skin's width more on each side for what lies in its walls.
bool Truth::clip_to_period(const Rays::Ray& ray, double* from, double* to) const {
  const Box3d box = options.grid.box();
  for (int a = 0; a < 3; ++a) {
    if (!options.cyclic[static_cast<std::size_t>(a)]) continue;
    const double low = box.min[a] - geometry.skin() - ray.origin[a], high = box.max[a] + geometry.skin() - ray.origin[a], d = ray.direction[a];
    if (d == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    *from = std::max(*from, std::min(low / d, high / d));
    *to = std::min(*to, std::max(low / d, high / d));
  }
  return *from < *to;
}

V3f Truth::fibre_color(const RayScene::Hit& hit, const Rays::Ray& ray) const {
  const Piece& piece = pieces[hit.triangle - scene.mesh.triangles.size()];
  const Material& stuff = scene.materials[piece.material];
  V3f color = stuff.solid ? stuff.solid->color(ray.origin + ray.direction * hit.distance, hit.normal, sample_share * rays.footprint(hit.distance)) : stuff.kd;
  const std::vector<V3f>& colors = scene.fibres.colors;
  if (!colors.empty()) color *= colors[piece.point] * (1 - hit.u) + colors[piece.point + 1] * hit.u;
  return color;
}

void Truth::trace(const Rays::Ray& ray, V3f* color, float* alpha) const {
  float left = 1;
  double from = 0, to = std::numeric_limits<double>::infinity();
  if (!clip_to_period(ray, &from, &to)) return;
  for (int layer = 0; layer < kMaxLayers && left > kSeen; ++layer) {
    const RayScene::Hit hit = next_hit(ray, from);
    if (hit.triangle == kNoIndex || hit.distance > to) break;
    const std::uint32_t m = material(hit);
    const double b1 = static_cast<double>(hit.u), b2 = static_cast<double>(hit.v);
    SurfaceSample there{V3f(1, 1, 1), 1};
    if (is_fibre(hit)) {
      there.color = fibre_color(hit, ray);
    } else {
      const auto footprint = static_cast<float>(sample_share * rays.footprint(hit.distance) * uv_scale_of(hit));
      there = textures.sample(m, uv_at(mesh_of(hit), hit.triangle, b1, b2), footprint);
      there.color *= vertex_color_at(mesh_of(hit), hit.triangle, b1, b2);
    }
    if (const SolidTexture* solid = scene.materials.empty() || is_fibre(hit) ? nullptr : scene.materials[m].solid.get())
      there.color = solid->color(point_of(hit), facet_normal(corner(hit, 0), corner(hit, 1), corner(hit, 2)), sample_share * rays.footprint(hit.distance));
    const float opacity = there.coverage * (scene.materials.empty() ? 1.0f : std::clamp(scene.materials[m].opacity, 0.0f, 1.0f));
    if (opacity > 0) {
      *color += light_from(hit, ray, there.color) * (left * opacity);
      *alpha += left * opacity;
      left *= 1 - opacity;
    }
    from = hit.distance + 2 * geometry.skin();
  }
}

}  // namespace

Image view_truth(const Scene& given, const ViewOptions& options, Report& report) {
  if (options.samples < 1 || options.samples > 1 << 16) throw Error(Code::kCommandLine, "", "samples per pixel out of range (" + std::to_string(options.samples) + ")", "use 1 to 65536");
  const bool cyclic = options.cyclic[0] || options.cyclic[1] || options.cyclic[2];
  std::optional<Scene> patterns;
  if (cyclic && has_patterns(given)) {
    Recipe recipe;
    recipe.cyclic = options.cyclic;
    Report unheard;  // the bake has told
    patterns = repeat_patterns(given, options.grid, recipe, unheard);
  }
  std::optional<Scene> flat;
  if (cyclic && !given.instances.empty()) flat = flatten_instances(patterns ? *patterns : given);  // as the bake does
  const Scene& scene = flat ? *flat : patterns ? *patterns : given;
  if (scene.hypertexture) return view_density(scene, options, report);
  const StageTimer timer(report, "view truth");
  Scene repeated = cyclic ? repeat_scene(scene, options.grid, options.cyclic) : Scene{};
  if (cyclic && scene.fibres.strands() > 0) repeated.fibres = repeat_fibres(scene.fibres, options.grid, options.cyclic);
  const Truth truth(cyclic ? repeated : scene, options, report);
  return trace_pixels(truth.rays, options.samples, options.threads, "view truth", report,
                      [&truth](const Rays::Ray& ray, V3f* color, float* alpha) { truth.trace(ray, color, alpha); });
}

}  // namespace texel
