#include "bake/slice_shader.h"

#include <memory>

#include "bake/block_index.h"
#include "bake/crossings.h"

namespace texel {
namespace {

// Colour of a fibre where a sub-ray meets it, lit where lights are given. It is round, and a stack is seen from both sides: light counts as the mean over its
// wall, (sin θ)/π of what a facing surface gets, θ between fibre and light.
V3f fibre_color(const Scene& scene, const Plan& plan, std::span<const Light> lights, const RayScene* rays, const FibreSegment& fibre, double s, V3f color) {
  const std::vector<V3f>& colors = scene.fibres.colors;
  if (!colors.empty()) color *= colors[fibre.point] * static_cast<float>(1 - s) + colors[fibre.point + 1] * static_cast<float>(s);
  if (lights.empty()) return color;
  const V3d t = (fibre.b - fibre.a).normalized(), axis = plan.grid.to_world(fibre.a + (fibre.b - fibre.a) * s);
  const double radius = (fibre.ra + (fibre.rb - fibre.ra) * s) * plan.grid.h;
  return color * fibre_irradiance(lights, rays, axis, t, radius);
}

}  // namespace

SliceShader make_shader(const Job& job, const Surface& surface, const RayScene* rays) {
  const Scene& scene = job.scene();
  const Plan& plan = job.plan;
  const TextureSet& textures = *job.textures;
  const Recipe& recipe = job.recipe;
  const auto width = static_cast<float>(plan.grid.h / recipe.samples);
  const auto light = [&plan, &recipe, rays](V3f color, const V3d& voxel_point, const V3d& normal, bool two_sided) {
    if (recipe.lights.empty()) return color;
    const V3d point = plan.grid.to_world(voxel_point);
    return color * irradiance(recipe.lights, rays, point, normal, two_sided);
  };
  // A solid texture's colours are known already, averaged over each voxel: as much as a slice can show, at no cost a ray.
  std::shared_ptr<const BlockIndex> blocks;
  for (const Material& material : scene.materials)
    if (material.solid && !blocks && !surface.color.empty()) blocks = std::make_shared<const BlockIndex>(surface.set, plan.grid.n);
  const auto solid_color = [&surface, blocks](const Bundle& bundle, const Crossing& c, double u, double v, V3f* color) {
    V3i voxel;
    voxel[bundle.axes.u] = static_cast<int>(u);
    voxel[bundle.axes.v] = static_cast<int>(v);
    voxel[bundle.axes.w] = c.cell;
    if (c.cell < 0) return;
    const std::int32_t slot = (*blocks)(V3i(voxel.x >> 3, voxel.y >> 3, voxel.z >> 3));
    if (slot < 0) return;
    const Block& block = surface.set.blocks[static_cast<std::size_t>(slot)];
    if (!block.has(voxel.x & 7, voxel.y & 7, voxel.z & 7)) return;
    const auto i = static_cast<std::size_t>(block.index(voxel.x & 7, voxel.y & 7, voxel.z & 7));
    if (surface.areas[i].covered > 0) *color = surface.mean_color(i);
  };
  SliceShader shader;
  shader.crossing = [blocks, solid_color, &scene, &plan, &textures, &recipe, width, light, rays](const Bundle& bundle, const Crossing& c, double u, double v) {
    if (const FibreSegment* fibre = crossed_fibre(bundle, c)) {
      V3f color = scene.materials[fibre->material].kd;
      if (blocks && scene.materials[fibre->material].solid) solid_color(bundle, c, u, v, &color);
      return fibre_color(scene, plan, recipe.lights, rays, *fibre, fibre_place(bundle, *fibre, u, v), color);
    }
    if (recipe.lights.empty() && c.page == 0 && scene.mesh.colors.empty() && !textures.textured(scene.mesh.materials[c.triangle]) && !scene.materials[scene.mesh.materials[c.triangle]].solid)
      return scene.materials[scene.mesh.materials[c.triangle]].kd;  // most surface: nothing to look up
    const Face face = crossed_face(bundle, c);
    const std::uint32_t material = face.material;
    V3f color = scene.materials[material].kd;
    const auto& [p0, p1, p2] = face.p;
    if (blocks && scene.materials[material].solid) solid_color(bundle, c, u, v, &color);
    else if (textures.textured(material) || !face.mesh->colors.empty()) {
      const Barycentrics b = face_barycentrics(bundle.axes, p0, p1, p2, u, v);
      color = footprint_sample(textures, *face.mesh, face.triangle, b.b1, b.b2, face.uv_width * width).color;
    }
    if (recipe.lights.empty()) return color;
    // On the triangle's own plane: the crossing's depth belongs to the fixed-point outline, and where the surface is steep along the
    // ray that is far enough off to lie in its own shadow.
    const Barycentrics b = face_barycentrics(bundle.axes, p0, p1, p2, u, v);
    const V3d point = p0 + (p1 - p0) * b.b1 + (p2 - p0) * b.b2;
    const V3d normal = triangle_normal(p0, p1, p2) * static_cast<double>(face.turn);
    return light(color, point, normal, plan.is_two_sided(face.winding, material));
  };
  shader.voxel = [&surface, light](const V3i& voxel, std::int64_t index) {
    const auto i = static_cast<std::size_t>(index);
    if (!(surface.areas[i].covered > 0)) return V3f(-1, -1, -1);
    const V3f color = surface.mean_color(i);
    if (surface.moments.empty()) return color;  // unlit
    const Moments& m = surface.moments[i];
    const double length = m.m.length();
    const V3d normal = length > 0 ? m.m / length : V3d(0, 0, 1);
    // Half a voxel's diagonal off its middle, so that the voxel's own surface casts no shadow on it.
    return light(color, V3d(voxel.x + 0.5, voxel.y + 0.5, voxel.z + 0.5) + normal * 0.87, normal, !(length > 0));
  };
  return shader;
}

}  // namespace texel
