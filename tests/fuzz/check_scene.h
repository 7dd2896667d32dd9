#pragma once
// What every reader promises about its scene, checked by stopping the program.
#include <cmath>
#include <cstdlib>

#include "formats/error.h"
#include "formats/readers.h"

namespace texel {

inline void demand(bool holds) {
  if (!holds) std::abort();
}

inline bool in_range(const V3f& c, float most) { return c.x >= 0 && c.y >= 0 && c.z >= 0 && c.x <= most && c.y <= most && c.z <= most; }

inline void check_materials(const Scene& scene) {
  for (const Material& m : scene.materials) {
    demand(in_range(m.kd, 1) && in_range(m.ks, 1) && in_range(m.ke, 1e4f));
    demand(m.roughness >= 0 && m.roughness <= 1 && m.opacity >= 0 && m.opacity <= 1);
    for (const TextureUse* use : {&m.map_kd, &m.map_d}) {
      demand(use->texture < static_cast<int>(scene.textures.size()));
      demand(std::isfinite(use->scale.x) && std::isfinite(use->scale.y) && std::isfinite(use->offset.x) && std::isfinite(use->offset.y));
    }
  }
}

inline void check_mesh(const Mesh& mesh, const Scene& scene) {
  demand(mesh.materials.size() == mesh.triangles.size());
  demand(mesh.uv_corners.empty() || mesh.uv_corners.size() == mesh.triangles.size());
  demand(mesh.colors.empty() || mesh.colors.size() == mesh.points.size());
  for (const V3d& p : mesh.points) demand(std::abs(p.x) <= 1e100 && std::abs(p.y) <= 1e100 && std::abs(p.z) <= 1e100);
  for (const V2f& uv : mesh.uvs) demand(std::isfinite(uv.x) && std::isfinite(uv.y));
  for (const V3f& c : mesh.colors) demand(in_range(c, 1));
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t corner : t) demand(corner < mesh.points.size());
  for (const auto& t : mesh.uv_corners)
    for (const std::uint32_t corner : t) demand(corner == kNoIndex || corner < mesh.uvs.size());
  for (const std::uint32_t m : mesh.materials) demand(m < scene.materials.size());
}

inline void check_fibres(const Fibres& fibres, const Scene& scene) {
  demand(fibres.first.front() == 0 && fibres.first.back() == fibres.points.size() && fibres.radii.size() == fibres.points.size());
  demand(fibres.materials.size() == fibres.strands() && (fibres.colors.empty() || fibres.colors.size() == fibres.points.size()));
  for (std::size_t s = 0; s < fibres.strands(); ++s) {
    demand(fibres.first[s + 1] >= fibres.first[s] + 2 && fibres.materials[s] < scene.materials.size());
    for (std::size_t i = fibres.first[s]; i < fibres.first[s + 1]; ++i) {
      const V3d& p = fibres.points[i];
      demand(std::abs(p.x) <= 1e100 && std::abs(p.y) <= 1e100 && std::abs(p.z) <= 1e100 && fibres.radii[i] >= 0 && fibres.radii[i] <= 1e100);
      demand(i == fibres.first[s] || p != fibres.points[i - 1]);
    }
  }
}

inline void check_scene(const Scene& scene) {
  demand((!scene.mesh.triangles.empty() || scene.fibres.strands() > 0 || !scene.instances.empty()) && !scene.materials.empty());
  check_mesh(scene.mesh, scene);
  check_fibres(scene.fibres, scene);
  std::vector<double> reach;
  for (const Mesh& shape : scene.shapes) {
    demand(shape.made == 0);
    check_mesh(shape, scene);
    reach.push_back(mesh_reach(shape));
  }
  for (const Instance& i : scene.instances) {
    for (const double v : i.place.m) demand(std::isfinite(v));
    demand(i.shape < scene.shapes.size() && i.place.reach(reach[i.shape]) <= 1e101);
  }
  check_materials(scene);
}

template <class Reader>
void check_reader(Reader reader, std::span<const char> bytes, const char* path) {
  Report report;
  try {
    check_scene(reader({bytes, path}, report));
  } catch (const Error& e) {
    demand((e.code == Code::kBadInput || e.code == Code::kUnsupported) && !e.where.empty() && !e.message.empty());
  }
}

}  // namespace texel
