#include "bake/random_rays.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "bake/ndf_fits.h"
#include "formats/random.h"

namespace texel {
namespace {

struct Tracer {
  const Scene& scene;
  const Plan& plan;
  const RayScene& rays;
  const Grid grid;             // of the level
  const RandomRays& options;
  std::vector<std::size_t> placed_of{};  // per instance, into Plan::placed, which leaves out those without triangles

  void number_instances() {
    std::size_t next = 0;
    for (const Instance& instance : scene.instances) placed_of.push_back(plan.shapes[instance.shape].nodes.empty() ? next : next++);
  }
  [[nodiscard]] Face face_of(const RayScene::Hit& hit) const {
    if (hit.instance == kNoIndex) return mesh_face(scene, plan, hit.triangle);
    return placed_face(scene, plan, plan.placed[placed_of[hit.instance]], hit.triangle);
  }
  [[nodiscard]] bool is_fibre(const RayScene::Hit& hit) const { return hit.instance == kNoIndex && hit.triangle >= scene.mesh.triangles.size(); }
  [[nodiscard]] V3d normal_of(const RayScene::Hit& hit) const {
    if (is_fibre(hit)) return hit.normal;
    const Face f = face_of(hit);
    return triangle_normal(f.p[0], f.p[1], f.p[2]);
  }
  // Whether the place is inside filled matter: what lies ahead first, of what is filled at all, is met from behind.
  [[nodiscard]] bool inside(const V3d& from, const V3d& along) const {
    V3d at = from;
    for (int surfaces = 0; surfaces < 64; ++surfaces) {
      const RayScene::Hit hit = rays.first_hit(at, along);
      if (hit.triangle == kNoIndex) return false;
      if (!is_fibre(hit))
        if (const Face f = face_of(hit); f.winding != 0) {
          const V3d n = triangle_normal(f.p[0], f.p[1], f.p[2]) * static_cast<double>(f.turn);
          return n.dot(along) > 0;
        }
      at += along * (hit.distance + rays.skin());
    }
    return false;
  }

  void voxel(const V3i& v, std::int64_t index, int level, RandomRaysLevel& out) const {
    const auto i = static_cast<std::size_t>(index);
    const std::uint64_t base = mix_bits(options.seed ^ mix_bits(static_cast<std::uint64_t>(level) << 60 ^ static_cast<std::uint64_t>(v.x) << 40 ^ static_cast<std::uint64_t>(v.y) << 20 ^ static_cast<std::uint64_t>(v.z)));
    for (int axis = 0; axis < 3; ++axis) {
      const int a = (axis + 1) % 3, b = (axis + 2) % 3;
      V3d along(0, 0, 0);
      along[axis] = 1;
      double stopped = 0;
      for (int k = 0; k < options.rays; ++k) {
        const std::uint64_t bits = mix_bits(base + static_cast<std::uint64_t>(axis) * 0x100000000u + static_cast<std::uint64_t>(k));
        V3d start(v);
        start[a] += unit_of(bits);
        start[b] += unit_of(mix_bits(bits));
        const V3d from = grid.to_world(start), to = grid.to_world(start + along);
        if (options.normals) {
          const RayScene::Hit first = rays.first_covered_hit(from, along, 0, 0, 0);
          if (first.triangle != kNoIndex && first.distance < grid.h) {
            stopped += 1;
            out.bins[i][static_cast<std::size_t>(normal_bin(normal_of(first)))] += 1;
            const RayScene::Hit last = rays.first_covered_hit(to, -along, 0, 0, 0);
            if (last.triangle != kNoIndex && last.distance < grid.h) out.bins[i][static_cast<std::size_t>(normal_bin(normal_of(last)))] += 1;
            continue;
          }
        } else if (const float share = rays.blocked(from, to); share > 0) {
          stopped += static_cast<double>(share);
          continue;
        }
        if (plan.fill && inside(from, along)) stopped += 1;
      }
      out.alpha[static_cast<std::size_t>(axis)][i] = static_cast<float>(stopped / options.rays);
    }
  }
};

}  // namespace

RandomRaysLevel trace_random_rays(const Scene& scene, const Plan& plan, const RayScene& rays, const VoxelSet& set, int level, const RandomRays& options) {
  RandomRaysLevel out;
  for (auto& alpha : out.alpha) alpha.resize(static_cast<std::size_t>(set.count));
  if (options.normals) out.bins.resize(static_cast<std::size_t>(set.count));
  Tracer tracer{scene, plan, rays, plan.grid.level(level), options};
  tracer.number_instances();
  tbb::parallel_for(std::size_t{0}, set.blocks.size(), [&](std::size_t b) {
    VoxelSet one;
    one.blocks.push_back(set.blocks[b]);
    for_each_voxel(one, [&](const V3i& v, std::int64_t index) { tracer.voxel(v, index, level, out); });
  });
  return out;
}

}  // namespace texel
