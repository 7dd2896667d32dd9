#include "bake/light.h"

#include <embree3/rtcore.h>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "bake/fibre.h"
#include "formats/error.h"
#include "formats/instances.h"

namespace texel {

namespace {

constexpr double kSkin = 2e-6;         // of the scene's size: some float steps at unit scale
constexpr unsigned kTriangles = 0, kFibres = 1, kInstances = 2;  // Embree's geometries; from kInstances on one an instance
constexpr float kThere = 1.0f / 512;   // coverage below it is none

// Embree wants denormals flushed; our own double code does not. So the mode lasts as long as one ray.
class FlushDenormals {
 public:
#if defined(__SSE__)
  FlushDenormals() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040u); }
  ~FlushDenormals() { _mm_setcsr(saved_); }
#else
  FlushDenormals() = default;
#endif
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

#if defined(__SSE__)
 private:
  unsigned saved_;
#endif
};

struct DeviceRelease { void operator()(RTCDevice d) const { rtcReleaseDevice(d); } };
struct SceneRelease { void operator()(RTCScene s) const { rtcReleaseScene(s); } };
template <class T, class D> using Handle = std::unique_ptr<std::remove_pointer_t<T>, D>;

[[noreturn]] void fail(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  throw Error(Code::kRunning, "", error == RTC_ERROR_OUT_OF_MEMORY ? "out of memory while building the ray tree" : "the ray tree cannot be built (Embree error " + std::to_string(static_cast<int>(error)) + ")");
}

}  // namespace

// Surface met by a ray. Numbers: triangles of the mesh, then pieces of fibres; of an instance those of its shape.
struct Met {
  std::uint32_t instance = kNoIndex, number = kNoIndex;
  [[nodiscard]] bool operator<(const Met& o) const { return instance != o.instance ? instance + 1 < o.instance + 1 : number < o.number; }  // the mesh first
};

// A shape as Embree sees it: centred and scaled by itself, so that floats hold it as well as the scene.
struct ShapeRays {
  V3d centre{0, 0, 0};
  double scale = 1;
  std::vector<std::uint32_t> materials;
  Mesh cut;                             // uv, only where something is cut out
  std::vector<float> uv_scale;          // per triangle and length of the shape
};

struct RayScene::Impl {
  // World -> unit: (p − centre)·scale, in double.
  V3d centre{0, 0, 0};
  double scale = 1;
  double radius = 0;                    // of the unit-scale scene about the origin
  bool empty = true;
  bool filtered = false;                // some triangle lets light through
  Mesh cut;                             // uv of the scene, only where something is cut out
  std::uint32_t triangles = 0;
  std::vector<std::uint32_t> materials; // per triangle, then per piece of a fibre
  std::vector<float> uv_scale;          // uv_per_world, per triangle, where something is cut out
  std::vector<float> opacity;           // per material
  ScenePeriod period;
  Box3d box;                            // of the triangles, world
  std::optional<TextureSet> own;
  const TextureSet* textures = nullptr;
  Handle<RTCDevice, DeviceRelease> device;
  Handle<RTCScene, SceneRelease> scene;
  std::vector<Handle<RTCScene, SceneRelease>> shape_scenes;
  std::vector<ShapeRays> shapes;
  struct Stand { std::uint32_t shape; float scale; };  // what its lengths grow by
  std::vector<Stand> instances;

  [[nodiscard]] V3d to_unit(const V3d& p) const { return (p - centre) * scale; }
  [[nodiscard]] Met met(const RTCHit& hit) const {
    if (hit.instID[0] != RTC_INVALID_GEOMETRY_ID) return {hit.instID[0] - kInstances, hit.primID};
    return {kNoIndex, hit.geomID == kFibres ? triangles + hit.primID : hit.primID};
  }
  [[nodiscard]] std::uint32_t material(const Met& met) const {
    const std::vector<std::uint32_t>& all = met.instance == kNoIndex ? materials : shapes[instances[met.instance].shape].materials;
    return met.number < all.size() ? all[met.number] : 0;
  }
  [[nodiscard]] float coverage(const Met& met, float u, float v, float width_world) const {
    const std::uint32_t m = material(met);
    const bool placed = met.instance != kNoIndex;
    if ((!placed && met.number >= triangles) || !textures->has_cutouts(m)) return 1;
    const Mesh& mesh = placed ? shapes[instances[met.instance].shape].cut : cut;
    const float per_world = placed ? shapes[instances[met.instance].shape].uv_scale[met.number] / instances[met.instance].scale : uv_scale[met.number];
    return textures->coverage(m, uv_at(mesh, met.number, static_cast<double>(u), static_cast<double>(v)), width_world * per_world);
  }
};

namespace {

// Carried by each ray through Embree to the filters.
struct RayContext {
  RTCIntersectContext base;
  const RayScene::Impl* scene;
  float width = 0;            // footprint, world, at the ray's start
  float spread = 0;           // its growth per unit of the ray's distance, world
  float transmittance = 1;    // shadow rays
  float best_distance = std::numeric_limits<float>::infinity();
  Met best;
  bool best_front = false;
  bool see_holes = false;     // pass through what is cut out
};

bool is_front(const RTCRay& ray, const RTCHit& hit) { return hit.Ng_x * ray.dir_x + hit.Ng_y * ray.dir_y + hit.Ng_z * ray.dir_z < 0; }

void filter_first(const RTCFilterFunctionNArguments* args) {
  auto& context = *reinterpret_cast<RayContext*>(args->context);
  const auto& ray = *reinterpret_cast<const RTCRay*>(args->ray);
  const auto& hit = *reinterpret_cast<const RTCHit*>(args->hit);
  const bool front = is_front(ray, hit);
  const Met met = context.scene->met(hit);
  if (ray.tfar == context.best_distance && context.best.number != kNoIndex) {
    const bool better = front != context.best_front ? front : met < context.best;
    if (!better) {
      args->valid[0] = 0;
      return;
    }
  }
  if (context.see_holes && context.scene->coverage(met, hit.u, hit.v, context.width + context.spread * ray.tfar) < kThere) {
    args->valid[0] = 0;
    return;
  }
  context.best_distance = ray.tfar;
  context.best = met;
  context.best_front = front;
}

void filter_shadow(const RTCFilterFunctionNArguments* args) {
  auto& context = *reinterpret_cast<RayContext*>(args->context);
  const auto& hit = *reinterpret_cast<const RTCHit*>(args->hit);
  const RayScene::Impl& scene = *context.scene;
  const Met met = scene.met(hit);
  const float opacity = scene.opacity[scene.material(met)] * scene.coverage(met, hit.u, hit.v, context.width);
  context.transmittance *= 1 - opacity;
  if (context.transmittance > 1e-3f) args->valid[0] = 0;  // goes on
  else context.transmittance = 0;
}

RTCRay make_ray(const V3d& origin, const V3d& direction, double near, double far) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x);
  ray.org_y = static_cast<float>(origin.y);
  ray.org_z = static_cast<float>(origin.z);
  ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  ray.tnear = static_cast<float>(near);
  ray.tfar = static_cast<float>(far);
  ray.mask = 0xffffffffu;
  return ray;
}

bool finite(const V3d& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// v/|v| without leaving the range of a double; false for zero and non-finite vectors.
bool to_unit_length(V3d* v, double* length = nullptr) {
  const double most = std::max({std::abs(v->x), std::abs(v->y), std::abs(v->z)});
  if (!(most > 0) || !std::isfinite(most)) return false;
  *v /= most;
  const double rest = std::sqrt(v->dot(*v));
  *v /= rest;
  if (length) *length = most * rest;
  return true;
}

// Part of the line origin + t·direction (unit) within the ball of the scene, with some room. Far eyes lose no digits this way.
bool clip_to_ball(const V3d& origin, const V3d& direction, double radius, double* low, double* high) {
  const double middle = -origin.dot(direction);
  const V3d nearest = origin + direction * middle;
  const double r = radius * 1.001 + 1e-5, rest = r * r - nearest.dot(nearest);
  if (!(rest >= 0)) return false;
  const double half = std::sqrt(rest);
  *low = std::max(*low, middle - half);
  *high = std::min(*high, middle + half);
  return *low < *high;
}

void put_point(const V3d& unit, float* to) {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(std::clamp(unit[k], -4.0, 4.0));  // unused points may lie anywhere
}

// All: false where there is no memory.
bool attach_triangles(RTCDevice device, RTCScene scene, const Mesh& mesh, const V3d& centre, double scale) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.points.size()));
  auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
  if (points && corners) {
    for (std::size_t i = 0; i < mesh.points.size(); ++i) put_point((mesh.points[i] - centre) * scale, points + 3 * i);
    for (const auto& t : mesh.triangles)
      for (const std::uint32_t i : t) *corners++ = i;
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, kTriangles);
  }
  rtcReleaseGeometry(geometry);
  return points && corners;
}

bool attach_fibres(RayScene::Impl& s, const Fibres& fibres) {
  const RTCGeometry geometry = rtcNewGeometry(s.device.get(), RTC_GEOMETRY_TYPE_ROUND_LINEAR_CURVE);
  const std::size_t pieces = fibres.points.size() - fibres.strands();
  auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 4 * sizeof(float), fibres.points.size()));
  auto* starts = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT, sizeof(unsigned), pieces));
  auto* flags = static_cast<unsigned char*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_FLAGS, 0, RTC_FORMAT_UCHAR, 1, pieces));
  if (points && starts && flags) {
    for (std::size_t i = 0; i < fibres.points.size(); ++i) {
      put_point(s.to_unit(fibres.points[i]), points + 4 * i);
      points[4 * i + 3] = static_cast<float>(fibres.radii[i] * s.scale);
    }
    for (std::size_t k = 0; k < fibres.strands(); ++k)
      for (std::size_t i = fibres.first[k]; i + 1 < fibres.first[k + 1]; ++i) {
        *starts++ = static_cast<unsigned>(i);
        *flags++ = static_cast<unsigned char>((i > fibres.first[k] ? RTC_CURVE_FLAG_NEIGHBOR_LEFT : 0) | (i + 2 < fibres.first[k + 1] ? RTC_CURVE_FLAG_NEIGHBOR_RIGHT : 0));
      }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(s.scene.get(), geometry, kFibres);
  }
  rtcReleaseGeometry(geometry);
  return points && starts && flags;
}

void start_scene(RTCScene scene) {
  rtcSetSceneFlags(scene, static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
  rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
}

// Each shape once, and where its instances stand.
bool attach_instances(RayScene::Impl& s, const Scene& scene) {
  for (std::size_t k = 0; k < scene.shapes.size(); ++k) {
    const Mesh& mesh = scene.shapes[k];
    ShapeRays& shape = s.shapes.emplace_back();
    s.shape_scenes.emplace_back(rtcNewScene(s.device.get()));
    if (!s.shape_scenes.back()) return false;
    Box3d box;
    for (const auto& t : mesh.triangles)
      for (const std::uint32_t i : t) box.extendBy(mesh.points[i]);
    if (box.isEmpty()) continue;
    shape.centre = (box.min + box.max) / 2.0;
    const V3d size = box.size();
    const double most = std::max({size.x, size.y, size.z});
    shape.scale = most > 0 && std::isfinite(1 / most) ? 1 / most : 1;
    shape.materials = mesh.materials;
    for (std::uint32_t& m : shape.materials)
      if (m >= s.opacity.size()) m = 0;
    if (s.textures->any_cutouts()) {
      shape.cut.uvs = mesh.uvs;
      shape.cut.uv_corners = mesh.uv_corners;
      for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) shape.uv_scale.push_back(uv_per_world(mesh, t));
    }
    start_scene(s.shape_scenes.back().get());
    if (!attach_triangles(s.device.get(), s.shape_scenes.back().get(), mesh, shape.centre, shape.scale)) return false;
    const FlushDenormals flush;
    rtcCommitScene(s.shape_scenes.back().get());
  }
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const ShapeRays& shape = s.shapes[instance.shape];
    s.instances.push_back({instance.shape, static_cast<float>(std::cbrt(std::abs(instance.place.determinant())))});
    if (shape.materials.empty()) continue;
    const RTCGeometry geometry = rtcNewGeometry(s.device.get(), RTC_GEOMETRY_TYPE_INSTANCE);
    if (!geometry) return false;
    rtcSetGeometryInstancedScene(geometry, s.shape_scenes[instance.shape].get());
    // Unit of the shape -> its space -> world -> unit of the scene.
    const V3d origin = s.to_unit(instance.place * shape.centre);
    const double grow = s.scale / shape.scale;
    float rows[12];
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c) rows[4 * r + c] = static_cast<float>(instance.place.m[4 * r + c] * grow);
      rows[4 * r + 3] = static_cast<float>(origin[static_cast<int>(r)]);
    }
    rtcSetGeometryTransform(geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, rows);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(s.scene.get(), geometry, kInstances + static_cast<unsigned>(i));
    rtcReleaseGeometry(geometry);
  }
  return true;
}

}  // namespace

RayScene::RayScene(const Scene& scene, const TextureSet* textures, const ScenePeriod& period) : impl_(std::make_unique<Impl>()) {
  Impl& s = *impl_;
  s.period = period;
  const Mesh& mesh = scene.mesh;
  Box3d box = surface_bounds(scene);
  if (scene.fibres.strands() > 0) box.extendBy(fibre_bounds(scene.fibres));
  s.box = box;
  s.triangles = static_cast<std::uint32_t>(mesh.triangles.size());
  s.materials = mesh.materials;
  s.materials.resize(mesh.triangles.size(), 0);
  for (std::size_t k = 0; k < scene.fibres.strands(); ++k) s.materials.insert(s.materials.end(), scene.fibres.first[k + 1] - scene.fibres.first[k] - 1, scene.fibres.materials[k]);
  for (const Material& m : scene.materials) s.opacity.push_back(std::clamp(m.opacity, 0.0f, 1.0f));
  if (s.opacity.empty()) s.opacity.push_back(1);
  for (std::uint32_t& m : s.materials)
    if (m >= s.opacity.size()) m = 0;
  if (textures) {
    s.textures = textures;
  } else {
    Report unheard;  // whoever wants to hear of bad textures passes them
    s.own.emplace(scene, TextureSet::Need::kCoverage, unheard);
    s.textures = &*s.own;
  }
  if (box.isEmpty()) return;
  const V3d half(box.max.x / 2 - box.min.x / 2, box.max.y / 2 - box.min.y / 2, box.max.z / 2 - box.min.z / 2);
  s.centre = V3d(box.max.x / 2 + box.min.x / 2, box.max.y / 2 + box.min.y / 2, box.max.z / 2 + box.min.z / 2);
  const double most = std::max({half.x, half.y, half.z});
  s.scale = most > 0 && std::isfinite(0.5 / most) ? 0.5 / most : 1;
  const V3d unit_half = half * s.scale;
  s.radius = std::sqrt(unit_half.dot(unit_half));
  const bool see_through = std::any_of(s.opacity.begin(), s.opacity.end(), [](float o) { return o < 1; });
  s.filtered = see_through || s.textures->any_cutouts();
  if (s.textures->any_cutouts()) {
    s.cut.uvs = mesh.uvs;
    s.cut.uv_corners = mesh.uv_corners;
    s.uv_scale.resize(mesh.triangles.size());
    for (std::size_t t = 0; t < s.uv_scale.size(); ++t) s.uv_scale[t] = uv_per_world(mesh, static_cast<std::uint32_t>(t));
  }

  s.device.reset(rtcNewDevice(nullptr));
  if (!s.device) fail(nullptr);
  s.scene.reset(rtcNewScene(s.device.get()));
  if (!s.scene) fail(s.device.get());
  start_scene(s.scene.get());
  if (!mesh.triangles.empty() && !attach_triangles(s.device.get(), s.scene.get(), mesh, s.centre, s.scale)) fail(s.device.get());
  if (!scene.instances.empty() && !attach_instances(s, scene)) fail(s.device.get());
  if (scene.fibres.strands() > 0 && !attach_fibres(s, scene.fibres)) fail(s.device.get());
  {
    const FlushDenormals flush;
    rtcCommitScene(s.scene.get());
  }
  if (rtcGetDeviceError(s.device.get()) != RTC_ERROR_NONE) fail(s.device.get());
  s.empty = false;
}

RayScene::~RayScene() = default;

double RayScene::skin() const { return kSkin / impl_->scale; }

RayScene::Hit RayScene::first_hit(const V3d& origin, const V3d& direction, double from) const { return first_covered_hit(origin, direction, from, -1, 0); }

RayScene::Hit RayScene::first_covered_hit(const V3d& origin, const V3d& direction, double from, double width, double spread) const {
  const Impl& s = *impl_;
  V3d d = direction;
  const V3d o = s.to_unit(origin);
  double stretch = 1;  // the direction's length
  if (s.empty || !finite(o) || !to_unit_length(&d, &stretch)) return {};
  double low = std::max(from * stretch * s.scale, 0.0), high = std::numeric_limits<double>::infinity();
  if (!clip_to_ball(o, d, s.radius, &low, &high)) return {};

  // The ray starts at the ball, so that its distances are as exact as the scene itself.
  RayContext context;
  rtcInitIntersectContext(&context.base);
  context.base.filter = filter_first;
  context.scene = &s;
  context.see_holes = width >= 0 && s.textures->any_cutouts();
  context.width = static_cast<float>(std::max(width + spread * low / (s.scale * stretch), 0.0));
  context.spread = static_cast<float>(std::max(spread / (s.scale * stretch), 0.0));
  RTCRayHit query{};
  query.ray = make_ray(o + d * low, d, 0, high - low);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  {
    const FlushDenormals flush;
    rtcIntersect1(s.scene.get(), &context.base, &query);
  }
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return {};
  const Met met = s.met(query.hit);
  const bool placed = met.instance != kNoIndex;  // the hit's normal is in the shape's space then, as the ray was for the filter
  Hit hit{met.number, (low + static_cast<double>(query.ray.tfar)) / (s.scale * stretch), query.hit.u, query.hit.v, placed ? context.best_front : is_front(query.ray, query.hit), V3d(0, 0, 0), met.instance};
  if (!placed && query.hit.geomID == kFibres) {
    hit.normal = V3d(static_cast<double>(query.hit.Ng_x), static_cast<double>(query.hit.Ng_y), static_cast<double>(query.hit.Ng_z)).normalized();
    if (!hit.front) hit.normal = -hit.normal;
    hit.front = true;  // whoever stands within a fibre sees its wall from the other side
  }
  return hit;
}

float RayScene::blocked(const V3d& from, const V3d& to) const {
  const Impl& s = *impl_;
  const V3d a = s.to_unit(from);
  V3d d = s.to_unit(to) - a;
  double length = 0;
  if (s.empty || !finite(a) || !to_unit_length(&d, &length)) return 0;
  double low = kSkin, high = length - kSkin;
  if (!(low < high) || !clip_to_ball(a, d, s.radius, &low, &high)) return 0;
  RayContext context;
  rtcInitIntersectContext(&context.base);
  if (s.filtered) context.base.filter = filter_shadow;
  context.scene = &s;
  RTCRay ray = make_ray(a + d * low, d, 0, high - low);
  {
    const FlushDenormals flush;
    rtcOccluded1(s.scene.get(), &context.base, &ray);
  }
  const bool stopped = ray.tfar < 0;
  return stopped ? 1.0f : 1 - context.transmittance;
}

float RayScene::visibility(const Light& light, const V3d& point, const V3d& normal) const {
  const Impl& s = *impl_;
  V3d direction;
  V3f unused;
  if (s.empty || !light_at(light, point, &direction, &unused)) return 1;
  // Off the surface on the lit side, so that grazing rays do not meet the triangle they start on.
  const V3d start = point + normal * (2 * skin());
  const auto& axes = s.period.axes;
  if (axes[0] || axes[1] || axes[2]) return through_periods(start, direction, light.kind == Light::Kind::kPoint ? (light.vector - start).length() : std::numeric_limits<double>::infinity());
  const V3d end = light.kind == Light::Kind::kPoint ? light.vector : start + direction * (4 / s.scale + (start - s.centre).length());
  return 1 - blocked(start, end);
}

float RayScene::through_periods(const V3d& start, const V3d& direction, double length) const {
  const Impl& s = *impl_;
  const auto repeats = [&](int a) { return s.period.axes[static_cast<std::size_t>(a)]; };
  const auto wall_ahead = [&](const Box3d& box, const V3d& at, int a) {
    return direction[a] == 0 ? std::numeric_limits<double>::infinity() : std::max(0.0, ((direction[a] > 0 ? box.max[a] : box.min[a]) - at[a]) / direction[a]);
  };
  V3d at = start;
  for (int a = 0; a < 3; ++a) {
    if (repeats(a)) at[a] -= std::floor((at[a] - s.period.box.min[a]) / s.period.box.size()[a]) * s.period.box.size()[a];
    else length = std::min(length, wall_ahead(s.box, start, a) + 2 * skin());  // nothing lies beyond
  }
  float through = 1;
  double back = 0;
  for (int k = 0; k < s.period.most && through > 0; ++k) {
    int wall = -1;
    double exit = length;
    for (int a = 0; a < 3; ++a)
      if (const double d = repeats(a) ? wall_ahead(s.period.box, at, a) : exit; repeats(a) && d < exit) {
        exit = d;
        wall = a;
      }
    if (!std::isfinite(exit)) break;
    // Pieces reach a little into each other: what lies in the wall itself is not to slip between them.
    through *= 1 - blocked(at - direction * back, at + direction * (wall >= 0 ? exit + 2 * skin() : exit));
    if (wall < 0) break;
    at += direction * exit;
    at[wall] = direction[wall] > 0 ? s.period.box.min[wall] : s.period.box.max[wall];
    length -= exit;
    back = 2 * skin();
  }
  return through;
}

bool light_at(const Light& light, const V3d& point, V3d* direction, V3f* color) {
  if (light.kind == Light::Kind::kAmbient) return false;
  V3d d = light.kind == Light::Kind::kSun ? -light.vector : light.vector - point;
  double distance = 1;
  if (!to_unit_length(&d, &distance)) return false;
  *direction = d;
  *color = light.color;
  if (light.kind == Light::Kind::kPoint) {
    const double fall_off = 1 / (distance * distance);
    *color *= static_cast<float>(std::min(fall_off, 1e30));
  }
  return true;
}

V3f irradiance(std::span<const Light> lights, const RayScene* rays, const V3d& point, const V3d& normal, bool two_sided) {
  V3f sum(0, 0, 0);
  for (const Light& light : lights) {
    V3d direction;
    V3f color;
    if (light.kind == Light::Kind::kAmbient) {
      sum += light.color;
      continue;
    }
    if (!light_at(light, point, &direction, &color)) continue;
    const double cosine = normal.dot(direction);
    if (cosine == 0 || (cosine < 0 && !two_sided)) continue;
    const V3d lit_side = cosine < 0 ? -normal : normal;
    const float visible = rays ? rays->visibility(light, point, lit_side) : 1.0f;
    sum += color * (static_cast<float>(std::abs(cosine)) * visible);
  }
  return sum;
}

V3f fibre_irradiance(std::span<const Light> lights, const RayScene* rays, const V3d& axis, const V3d& t, double radius) {
  V3f sum(0, 0, 0);
  for (const Light& light : lights) {
    V3d direction;
    V3f color;
    if (light.kind == Light::Kind::kAmbient) {
      sum += light.color;
      continue;
    }
    if (!light_at(light, axis, &direction, &color)) continue;
    V3d side = direction - t * direction.dot(t);
    double sine = 0;
    if (!to_unit_length(&side, &sine)) continue;
    const float visible = rays ? rays->visibility(light, axis + side * radius, side) : 1.0f;
    sum += color * (static_cast<float>(std::min(sine, 1.0) / M_PI) * visible);
  }
  return sum;
}

}  // namespace texel
