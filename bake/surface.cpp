#include "bake/surface.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>

#include "bake/block_index.h"
#include "bake/clip.h"
#include "bake/lobes.h"
#include "bake/prefetch.h"
#include "bake/shape_sums.h"

namespace texel {
namespace {

// What is constant over a triangle.
struct Facet {
  const Mesh* mesh;
  std::uint32_t triangle;  // of *mesh
  std::uint32_t material;
  V3d normal;          // turned, unit, voxel space = world directions
  V3d origin, g1, g2;  // barycentrics of corners 1 and 2 at p: (p − origin)·g1, (p − origin)·g2
  Moments facing;      // of a unit of covered area
  bool one_sided, sampled, closed;
  Areas whole, covered;  // what a unit of area adds; of it what goes by covered area, where that is sampled
  float uv_width;      // uv per world length
  float texels;        // per unit of uv, where there are holes to be found between them; else 0
  V3f color;
  const SolidTexture* solid;  // null: none
};

// A block under construction: 512 of each sum that is wanted; those of a voxel are set to 0 when it is first met.
struct DenseBlock {
  std::array<std::uint64_t, 8> mask{};
  std::vector<Areas> areas;
  std::vector<Moments> moments;
  std::vector<Lobes> lobes;
  std::vector<V3d> color;
  std::vector<MaterialSums> material;
};

// One layer of blocks under construction. A thread makes one after the other in the same memory.
struct Layer8 {
  std::vector<std::int32_t> slot;       // per (by, bx), into blocks; −1: none yet
  std::vector<DenseBlock> blocks;
  std::size_t used = 0;                 // of blocks
  LobePieces pieces;                    // by slot·512 + place in the block; none where one lobe is wanted

  DenseBlock& block(std::size_t column, const SurfaceWant& want) {
    if (const std::int32_t s = slot[column]; s >= 0) return blocks[static_cast<std::size_t>(s)];
    slot[column] = static_cast<std::int32_t>(used);
    if (used == blocks.size()) {
      DenseBlock& b = blocks.emplace_back();
      b.areas.resize(512);
      if (want.normals) b.moments.resize(512);
      if (want.lobes) b.lobes.resize(512);
      if (want.color) b.color.resize(512);
      if (want.material) b.material.resize(512);
    }
    blocks[used].mask.fill(0);
    return blocks[used++];
  }
};

// Moments of a unit of area of a triangle with the surface's own normals at its corners, which know how the surface bends within it. Where
// they belong together they are interpolated, and the integral is exact; over an edge of the surface each counts for a third.
bool bent_moments(const Mesh& mesh, const std::array<std::uint32_t, 3>& corner, bool one_sided, Moments* bent) {
  constexpr double kTogether = 0.5;  // cosine
  if (mesh.normals.empty()) return false;
  const V3d n[3] = {V3d(mesh.normals[corner[0]]), V3d(mesh.normals[corner[1]]), V3d(mesh.normals[corner[2]])};
  for (const V3d& v : n)
    if (!(v.length2() > 0)) return false;
  const V3d sum = n[0] + n[1] + n[2];
  Moments m;
  for (const V3d& v : n) add_outer(m, v, 1);
  const bool together = n[0].dot(n[1]) > kTogether && n[1].dot(n[2]) > kTogether && n[2].dot(n[0]) > kTogether;
  if (together) add_outer(m, sum, 1);
  // Interpolated normals are a little shorter than 1 in between: everything is scaled so that the trace is that of unit normals.
  const double trace = m.xx + m.yy + m.zz;
  bent->add(m, 1 / trace);
  bent->covered = 1;
  if (one_sided) bent->m = sum / (3 * std::sqrt(trace / (together ? 12 : 3)));
  return true;
}

struct Clipper {
  const Scene& scene;
  const Plan& plan;
  const TextureSet& textures;
  SurfaceWant want;
  V3i blocks;

  bool make_facet(const Face& face, Facet& facet, Polygon& corners) const {
    const auto& [a, b, c] = face.p;
    const V3d cross = (b - a).cross(c - a);
    const double square = cross.length2();
    if (!(square > 0) || !std::isfinite(square)) return false;
    facet.mesh = face.mesh;
    facet.triangle = face.triangle;
    facet.normal = cross / std::sqrt(square) * static_cast<double>(face.turn);
    facet.origin = a;
    facet.g1 = (c - a).cross(cross) / square;
    facet.g2 = cross.cross(b - a) / square;
    const std::uint32_t material = face.material;
    facet.material = material;
    facet.one_sided = !plan.is_two_sided(face.winding, material);
    facet.closed = face.winding != 0;
    facet.facing = {};
    if (!bent_moments(*face.mesh, face.mesh->triangles[face.triangle], facet.one_sided, &facet.facing)) facet.facing.add(facet.normal, 1, facet.one_sided);
    facet.sampled = textures.has_cutouts(material) || (want.color && (textures.textured(material) || !face.mesh->colors.empty() || scene.materials[material].solid));
    facet.solid = want.color ? scene.materials[material].solid.get() : nullptr;
    Areas open;  // what goes by covered area
    open.covered = 1;
    Areas all;
    all.area = 1;
    for (int i = 0; i < 3; ++i) {
      const double across = std::abs(facet.normal[i]);
      open.crossings[i] = across;
      if (!facet.closed) open.stopping[i] = across;
      if (facet.closed) all.stopping[i] = std::max(0.0, -facet.normal[i]);
      if (facet.closed) all.outward[i] = facet.normal[i];
    }
    if (!facet.sampled) all += open;
    facet.whole = all;
    facet.covered = open;
    facet.uv_width = face.uv_width;
    facet.texels = textures.has_cutouts(material) ? textures.texels_per_uv(material) : 0;
    facet.color = scene.materials[material].kd;
    corners.n = 3;
    corners.v[0] = a;
    corners.v[1] = b;
    corners.v[2] = c;
    return true;
  }

  // Colour and coverage integrated over the piece: a fan, each triangle cut into n² alike, each of those sampled at its centroid with its own
  // width. A footprint is a square about the centroid: where the outline of a cut-out passes, what it has of the square's corners is not what it has of the
  // triangle's, so the smaller the better, down to a texel.
  SurfaceSample integrate(const Facet& facet, const Polygon& piece, double area) const {
    V3d color(0, 0, 0);
    double coverage = 0, total = 0;
    for (int i = 1; i + 1 < piece.n; ++i) {
      const V3d &a = piece.v[0], &b = piece.v[static_cast<std::size_t>(i)], &c = piece.v[static_cast<std::size_t>(i + 1)];
      const double part = (b - a).cross(c - a).length() / 2;
      if (!(part > 1e-9 * area)) continue;
      const float width = facet.uv_width * static_cast<float>(std::sqrt(part) * plan.grid.h);
      const int n = static_cast<int>(std::clamp(std::ceil(width * facet.texels), 1.0f, static_cast<float>(want.finest_cut)));
      const double piece_of_it = part / (n * n);
      const auto add_sample = [&](double s, double t) {
        const V3d q = a + (b - a) * s + (c - a) * t, p = q - facet.origin;
        SurfaceSample here = footprint_sample(textures, *facet.mesh, facet.triangle, p.dot(facet.g1), p.dot(facet.g2), width / static_cast<float>(n));
        if (facet.solid) here.color = facet.solid->color(plan.grid.to_world(q), facet.normal, std::sqrt(part) * plan.grid.h);
        color += V3d(here.color) * (static_cast<double>(here.coverage) * piece_of_it);
        coverage += static_cast<double>(here.coverage) * piece_of_it;
      };
      for (int row = 0; row < n; ++row)
        for (int column = 0; column < n - row; ++column) {
          add_sample((column + 1.0 / 3) / n, (row + 1.0 / 3) / n);
          if (column < n - row - 1) add_sample((column + 2.0 / 3) / n, (row + 2.0 / 3) / n);
        }
      total += part;
    }
    if (!(total > 0)) return {facet.color, 1};
    return {coverage > 0 ? V3f(color / coverage) : V3f(0, 0, 0), static_cast<float>(coverage / total)};
  }

  // The block of a cell and the cell's place in it, with its sums at 0 when first met.
  DenseBlock& meet(Layer8& layer, const V3i& cell, std::size_t& at) const {
    const std::size_t column = static_cast<std::size_t>(cell.y / 8) * static_cast<std::size_t>(blocks.x) + static_cast<std::size_t>(cell.x / 8);
    DenseBlock& block = layer.block(column, want);
    const auto x = static_cast<std::size_t>(cell.x & 7), in_word = static_cast<std::size_t>((cell.y & 7) << 3 | (cell.z & 7));
    at = x << 6 | in_word;
    if (std::uint64_t& word = block.mask[x]; (word >> in_word & 1u) == 0) {
      word |= std::uint64_t{1} << in_word;
      block.areas[at] = {};
      if (want.normals) block.moments[at] = {};
      if (want.lobes) block.lobes[at] = {};
      if (want.color) block.color[at] = V3d(0, 0, 0);
      if (want.material) block.material[at] = {};
    }
    return block;
  }

  // A piece of the surface in the voxel `at` of a block, for its lobes.
  static void add_piece(Layer8& layer, DenseBlock& block, std::size_t at, const Moments& piece) {
    if (!(piece.covered > 0)) return;
    add_shadow(piece, block.lobes[at].shadow);
    layer.pieces.add(static_cast<std::uint32_t>(static_cast<std::size_t>(&block - layer.blocks.data()) << 9 | at), piece);
  }

  void add(Layer8& layer, const Facet& facet, const V3i& cell, const Polygon& piece) const {
    double height = 0;
    const double area = polygon_area(piece, facet.normal, facet.closed ? &height : nullptr);
    if (!(area > 0)) return;
    std::size_t at = 0;
    DenseBlock& block = meet(layer, cell, at);
    Areas& sums = block.areas[at];
    sums.add(facet.whole, area);
    if (facet.closed) sums.lost += facet.normal.z * area * (cell.z + 1 - height);
    SurfaceSample s{facet.color, 1};
    if (facet.sampled) {
      s = integrate(facet, piece, area);
      sums.add(facet.covered, area * static_cast<double>(s.coverage));
    }
    const double w = area * static_cast<double>(s.coverage);
    if (want.normals) block.moments[at].add(facet.facing, w);
    if (want.lobes) {
      Moments piece_of_it;
      piece_of_it.add(facet.facing, w);
      add_piece(layer, block, at, piece_of_it);
    }
    if (want.color) block.color[at] += V3d(s.color) * w;
    if (want.material) block.material[at].add(scene.materials[facet.material], w);
  }

  void clip_fibre(Layer8& layer, const FibreSegment& fibre, int z0, int z1) const {
    const FibreShape shape = fibre_shape(fibre);
    const bool one_sided = !plan.two_sided[fibre.material];
    const Material& material = scene.materials[fibre.material];
    const std::vector<V3f>& colors = scene.fibres.colors;
    walk_fibre(fibre, V3i(0, 0, z0), V3i(plan.grid.n.x, plan.grid.n.y, z1), [&](const V3i& cell, double s0, double s1) {
      std::size_t at = 0;
      DenseBlock& block = meet(layer, cell, at);
      Areas& sums = block.areas[at];
      const double before = sums.covered;
      add_fibre(fibre, shape, s0, s1, one_sided, sums, want.normals ? &block.moments[at] : nullptr);
      if (want.lobes) {
        Areas again;
        Moments piece;
        add_fibre(fibre, shape, s0, s1, one_sided, again, &piece);
        add_piece(layer, block, at, piece);
      }
      const double w = sums.covered - before, middle = (s0 + s1) / 2;
      if (want.color) {
        V3f color = material.kd;
        if (material.solid) color = material.solid->color(plan.grid.to_world(fibre.a + (fibre.b - fibre.a) * middle), V3d(0, 0, 1), plan.grid.h * (s1 - s0) * shape.length);
        if (!colors.empty()) color *= colors[fibre.point] * static_cast<float>(1 - middle) + colors[fibre.point + 1] * static_cast<float>(middle);
        block.color[at] += V3d(color) * w;
      }
      if (want.material) block.material[at].add(material, w);
    });
  }

  // What lies wholly in a voxel is added as a whole.
  void add_gathered(Layer8& layer, const Placed& placed, const ShapeSums& sums, const ShapeSums::Node& node, const V3i& cell) const {
    std::size_t at = 0;
    DenseBlock& block = meet(layer, cell, at);
    add_shadows(sums, node, placed, block.areas[at]);
    if (want.lobes) for_each_vector(sums, node, placed, [&](const V3d& vector) {
      // Flat, with the vector's length as its area.
      if (const double area = vector.length(); area > 0) {
        Moments piece;
        piece.add(vector / area, area, false);
        add_piece(layer, block, at, piece);
      }
    });
    for (std::uint32_t g = node.group; g < node.group + node.groups; ++g) {
      const ShapeSums::Group& group = sums.groups[g];
      double w = 0;
      V3d color;
      add_group(group, placed, !plan.is_two_sided(group.closed ? 1 : 0, group.material), cell.z, block.areas[at], want.normals ? &block.moments[at] : nullptr, w, color);
      if (want.color) block.color[at] += color;
      if (want.material) block.material[at].add(scene.materials[group.material], w);
    }
  }

  void clip_placed(Layer8& layer, const Placed& placed, const ShapeSums& sums, int z0, int z1) const {
    const ShapeTree& tree = plan.shapes[placed.shape];
    const Box3d reach(V3d(-1, -1, z0 - 1), V3d(plan.grid.n.x + 1, plan.grid.n.y + 1, z1 + 1));  // one cell more than the rule of walls can ask for
    walk_shape(tree, [&](const ShapeNode& node) {
      const Box3d box = placed_box(placed, node.box);
      if (!box.intersects(reach)) return false;
      const ShapeSums::Node& own = sums.nodes[static_cast<std::size_t>(&node - tree.nodes.data())];
      if (own.groups == 0 || !(placed.scale > 0)) return true;
      V3i cell;
      for (int a = 0; a < 3; ++a) {
        cell[a] = static_cast<int>(std::floor(box.min[a]));
        if (!(box.max[a] < cell[a] + 1)) return true;
      }
      if (cell.x >= 0 && cell.y >= 0 && cell.x < plan.grid.n.x && cell.y < plan.grid.n.y && cell.z >= z0 && cell.z < z1) add_gathered(layer, placed, sums, own, cell);
      return false;
    }, [&](std::uint32_t t, const std::array<V3d, 3>& corners) { clip_face(layer, placed_face(scene, plan, placed, t, corners), z0, z1); });
  }

  void clip_face(Layer8& layer, const Face& face, int z0, int z1) const {
    Facet facet;
    Polygon corners;
    if (!make_facet(face, facet, corners)) return;
    const V3i& n = plan.grid.n;
    const V3d side = facet.closed ? facet.normal : -facet.normal;  // away from the cell that surface in a wall belongs to
    split_cells(corners, 2, side.z, z0, z1, [&](int z, const Polygon& sheet) {
      split_cells(sheet, 1, side.y, 0, n.y, [&](int y, const Polygon& row) {
        split_cells(row, 0, side.x, 0, n.x, [&](int x, const Polygon& piece) { add(layer, facet, V3i(x, y, z), piece); });
      });
    });
  }
};

// Triangles that meet each layer of blocks, in ascending order: bins[first[l] … first[l+1]).
// Only those of a slab, layers [from, to), have any.
void bin_triangles(const Scene& scene, const Plan& plan, int from, int to, int layers, std::vector<std::size_t>& first, std::vector<std::uint32_t>& bins) {
  const auto range = [&](std::uint32_t t, int& l0, int& l1) {
    const auto& tri = scene.mesh.triangles[t];
    const double a = plan.points[tri[0]].z, b = plan.points[tri[1]].z, c = plan.points[tri[2]].z;
    const double lo = std::min({a, b, c}), hi = std::max({a, b, c});
    if (hi < -1 || lo > plan.grid.n.z + 1) return false;
    // One cell more below than the rule of walls can ask for: a layer that gets nothing of a triangle loses a few nanoseconds.
    l0 = std::max(from, (static_cast<int>(std::floor(std::max(lo, -8.0))) - 1) >> 3);
    l1 = std::min(to - 1, static_cast<int>(std::min(std::ceil(hi), static_cast<double>(plan.grid.n.z))) >> 3);
    return l0 <= l1;
  };
  first.assign(static_cast<std::size_t>(layers) + 1, 0);
  const auto count = static_cast<std::uint32_t>(scene.mesh.triangles.size());
  int l0 = 0, l1 = 0;
  for (std::uint32_t t = 0; t < count; ++t)
    if (range(t, l0, l1))
      for (int l = l0; l <= l1; ++l) ++first[static_cast<std::size_t>(l) + 1];
  for (std::size_t l = 0; l < static_cast<std::size_t>(layers); ++l) first[l + 1] += first[l];
  bins.resize(first.back());
  std::vector<std::size_t> at(first.begin(), first.end() - 1);
  for (std::uint32_t t = 0; t < count; ++t)
    if (range(t, l0, l1))
      for (int l = l0; l <= l1; ++l) bins[at[static_cast<std::size_t>(l)]++] = t;
}

// Pieces of fibres that meet each layer of blocks, likewise.
void bin_fibres(const Plan& plan, int layers, std::vector<std::size_t>& first, std::vector<std::uint32_t>& bins) {
  const auto for_each_layer = [&](auto&& call) {
    for (std::uint32_t f = 0; f < plan.fibres.size(); ++f) {
      const double a = plan.fibres[f].a.z, b = plan.fibres[f].b.z, n = plan.grid.n.z;
      const double lo = std::clamp(std::min(a, b), -1.0, n), hi = std::clamp(std::max(a, b), -1.0, n);
      for (int l = std::max(0, static_cast<int>(lo)) >> 3; l <= static_cast<int>(hi) >> 3 && l < layers && hi >= 0; ++l) call(static_cast<std::size_t>(l), f);
    }
  };
  first.assign(static_cast<std::size_t>(layers) + 1, 0);
  for_each_layer([&](std::size_t l, std::uint32_t) { ++first[l + 1]; });
  for (std::size_t l = 0; l < static_cast<std::size_t>(layers); ++l) first[l + 1] += first[l];
  bins.resize(first.back());
  std::vector<std::size_t> at(first.begin(), first.end() - 1);
  for_each_layer([&](std::size_t l, std::uint32_t f) { bins[at[l]++] = f; });
}

// The values of a layer's voxels in the order of the set.
template <class T>
std::vector<T> packed(const Layer8& layer, std::span<const std::int32_t> order, std::size_t count, std::vector<T> DenseBlock::* values) {
  std::vector<T> out;
  out.reserve(count);
  for (const std::int32_t s : order) {
    const DenseBlock& from = layer.blocks[static_cast<std::size_t>(s)];
    for (std::size_t x = 0; x < 8; ++x)
      for (std::uint64_t word = from.mask[x]; word; word &= word - 1) out.push_back((from.*values)[x << 6 | static_cast<std::size_t>(__builtin_ctzll(word))]);
  }
  return out;
}

// Once all pieces of a layer are there.
void choose_lobes(Layer8& layer) {
  layer.pieces.for_each([&](std::uint32_t voxel, std::span<const Moments> pieces) {
    DenseBlock& block = layer.blocks[voxel >> 9];
    const std::size_t at = voxel & 511;
    block.lobes[at].second = second_group(block.moments[at], pieces, block.lobes[at].shadow);
  });
}

Surface pack_layer(const Layer8& layer, const V3i& blocks, int bz, const SurfaceWant& want) {
  Surface part;
  std::vector<std::int32_t> order;
  for (int by = 0; by < blocks.y; ++by)
    for (int bx = 0; bx < blocks.x; ++bx) {
      const std::int32_t slot = layer.slot[static_cast<std::size_t>(by) * static_cast<std::size_t>(blocks.x) + static_cast<std::size_t>(bx)];
      if (slot < 0) continue;
      order.push_back(slot);
      part.set.add(V3i(bx, by, bz), layer.blocks[static_cast<std::size_t>(slot)].mask);
    }
  const auto count = static_cast<std::size_t>(part.set.count);
  part.areas = packed(layer, order, count, &DenseBlock::areas);
  if (want.normals) part.moments = packed(layer, order, count, &DenseBlock::moments);
  if (want.lobes) part.lobes = packed(layer, order, count, &DenseBlock::lobes);
  if (want.color) part.color = packed(layer, order, count, &DenseBlock::color);
  if (want.material) part.material = packed(layer, order, count, &DenseBlock::material);
  return part;
}

// Layers, lowest first -> one surface. Each part's memory goes back as soon as it is copied.
Surface join(std::vector<Surface>& parts) {
  if (parts.size() == 1) return std::move(parts[0]);
  Surface surface;
  std::vector<std::int64_t> first;
  for (const Surface& part : parts) {
    first.push_back(surface.set.count);
    for (Block block : part.set.blocks) {
      block.first += surface.set.count;
      surface.set.blocks.push_back(block);
    }
    surface.set.count += part.set.count;
  }
  const auto gather = [&](auto member) {
    auto& to = surface.*member;
    const bool wanted = std::any_of(parts.begin(), parts.end(), [&](const Surface& part) { return !(part.*member).empty(); });
    if (!wanted) return;
    to.resize(static_cast<std::size_t>(surface.set.count));
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) {
      auto& from = parts[p].*member;
      std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(first[p]));
      from = {};
    });
  };
  gather(&Surface::areas);
  gather(&Surface::moments);
  gather(&Surface::lobes);
  gather(&Surface::color);
  gather(&Surface::material);
  return surface;
}

}  // namespace

double mean_roughness(const MaterialSums& sums, double covered) {
  if (!(covered > 0)) return 0;
  const double plain = std::sqrt(sums.roughness2 / covered), shine = (sums.ks.x + sums.ks.y + sums.ks.z) / 3;
  if (!(shine > 0) || !(sums.sharpness > 0) || plain < kLeastAlpha) return plain;
  return std::clamp(shine / sums.sharpness, kLeastAlpha, 1.0);
}

Surface join_surfaces(std::vector<Surface>& parts) {
  const std::optional<V3f> one_color = parts.empty() ? std::nullopt : parts.front().one_color;
  Surface surface = join(parts);
  surface.one_color = one_color;
  return surface;
}

Surface clip_surface(const Scene& scene, const Plan& plan, const TextureSet& textures, const SurfaceWant& want, Report& report, const Slab& slab) {
  const V3i blocks((plan.grid.n.x + 7) / 8, (plan.grid.n.y + 7) / 8, (plan.grid.n.z + 7) / 8);
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> bins;
  const int from = slab.z0 / 8, to = (std::min(slab.z1, plan.grid.n.z) + 7) / 8;
  bin_triangles(scene, plan, from, to, blocks.z, first, bins);
  std::vector<std::size_t> fibre_first;
  std::vector<std::uint32_t> fibre_bins;
  if (!plan.fibres.empty()) bin_fibres(plan, blocks.z, fibre_first, fibre_bins);

  const PlacedLayers placed = layer_placed(plan, 2, 8, blocks.z);
  const std::vector<ShapeSums> sums = sum_shapes(scene, plan, textures, want.color);
  const Clipper clipper{scene, plan, textures, want, blocks};
  std::vector<Surface> parts(static_cast<std::size_t>(to - from));
  tbb::enumerable_thread_specific<Layer8> layers;
  std::atomic<int> done{0};
  tbb::parallel_for(from, to, [&](int bz) {
    Layer8& layer = layers.local();
    layer.slot.assign(static_cast<std::size_t>(blocks.x) * static_cast<std::size_t>(blocks.y), -1);
    layer.used = 0;
    layer.pieces.clear();
    const int z0 = bz * 8, z1 = std::min(plan.grid.n.z, z0 + 8);
    const auto touch = [&](std::uint32_t t) {
      for (const std::uint32_t v : scene.mesh.triangles[t]) prefetch_lines(&plan.points[v]);
    };
    visit_triangles(bins.data(), first[static_cast<std::size_t>(bz)], first[static_cast<std::size_t>(bz) + 1], scene.mesh.triangles.data(), touch,
                    [&](std::uint32_t t) { clipper.clip_face(layer, mesh_face(scene, plan, t), z0, z1); });
    for (std::size_t f = fibre_first.empty() ? 0 : fibre_first[static_cast<std::size_t>(bz)]; !fibre_first.empty() && f < fibre_first[static_cast<std::size_t>(bz) + 1]; ++f)
      clipper.clip_fibre(layer, plan.fibres[fibre_bins[f]], z0, z1);
    for (const std::uint32_t i : placed.of(bz)) clipper.clip_placed(layer, plan.placed[i], sums[plan.placed[i].shape], z0, z1);
    if (want.lobes) choose_lobes(layer);
    parts[static_cast<std::size_t>(bz - from)] = pack_layer(layer, blocks, bz, want);
    if (report.progress) report.progress("surface", static_cast<double>(++done) / (to - from));
  });
  layers.clear();
  return join(parts);
}

Surface coarser(const Surface& fine) {
  // Children's blocks are sorted by (z, y, x); parents come out of a map from parent block to its voxels, then in order again.
  Surface result;
  if (fine.set.blocks.empty()) return result;
  V3i top(0, 0, 0);
  for (const Block& b : fine.set.blocks) top = V3i(std::max(top.x, b.at.x), std::max(top.y, b.at.y), std::max(top.z, b.at.z));
  const V3i n(top.x / 2 + 1, top.y / 2 + 1, top.z / 2 + 1);
  std::vector<Block> parents(static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z));
  const auto parent_of = [&](const V3i& at) {
    return (static_cast<std::size_t>(at.z / 2) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(at.y / 2)) * static_cast<std::size_t>(n.x) + static_cast<std::size_t>(at.x / 2);
  };
  const auto for_each_voxel = [](const Block& b, auto&& call) {
    std::int64_t index = b.first;
    for (int x = 0; x < 8; ++x)
      for (std::uint64_t word = b.mask[static_cast<std::size_t>(x)]; word; word &= word - 1) {
        const int bit = __builtin_ctzll(word);
        call(x, bit >> 3, bit & 7, index++);
      }
  };
  for (const Block& b : fine.set.blocks) {
    Block& parent = parents[parent_of(b.at)];
    for_each_voxel(b, [&](int x, int y, int z, std::int64_t) {
      const int px = (b.at.x & 1) * 4 + x / 2, py = (b.at.y & 1) * 4 + y / 2, pz = (b.at.z & 1) * 4 + z / 2;
      parent.mask[static_cast<std::size_t>(px)] |= std::uint64_t{1} << (py << 3 | pz);
    });
  }
  for (int z = 0; z < n.z; ++z)
    for (int y = 0; y < n.y; ++y)
      for (int x = 0; x < n.x; ++x) {
        Block& b = parents[parent_of(V3i(2 * x, 2 * y, 2 * z))];
        if (count_voxels(b.mask) == 0) continue;
        b.first = result.set.count;
        result.set.add(V3i(x, y, z), b.mask);
      }
  result.one_color = fine.one_color;
  result.areas.resize(static_cast<std::size_t>(result.set.count));
  if (!fine.moments.empty()) result.moments.resize(static_cast<std::size_t>(result.set.count));
  if (!fine.color.empty()) result.color.resize(static_cast<std::size_t>(result.set.count), V3d(0, 0, 0));
  if (!fine.material.empty()) result.material.resize(static_cast<std::size_t>(result.set.count));
  for (const Block& b : fine.set.blocks) {
    const Block& parent = parents[parent_of(b.at)];
    for_each_voxel(b, [&](int x, int y, int z, std::int64_t index) {
      const int px = (b.at.x & 1) * 4 + x / 2, py = (b.at.y & 1) * 4 + y / 2, pz = (b.at.z & 1) * 4 + z / 2;
      const auto to = static_cast<std::size_t>(parent.index(px, py, pz));
      result.areas[to] += fine.areas[static_cast<std::size_t>(index)];
      if (!fine.moments.empty()) result.moments[to] += fine.moments[static_cast<std::size_t>(index)];
      if (!fine.color.empty()) result.color[to] += fine.color[static_cast<std::size_t>(index)];
      if (!fine.material.empty()) result.material[to] += fine.material[static_cast<std::size_t>(index)];
    });
  }
  coarser_lobes(fine, result);
  return result;
}

}  // namespace texel
