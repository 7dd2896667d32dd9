// Inside-out, nested, touching, crossing, non-manifold, flipped and open solids: what is inside is known from how they were made.
#include "tests/stress/shapes.h"

namespace texel::stress {
namespace {

void append(Mesh& to, const Mesh& from) {
  const auto first = static_cast<std::uint32_t>(to.points.size());
  to.points.insert(to.points.end(), from.points.begin(), from.points.end());
  for (auto t : from.triangles) {
    for (std::uint32_t& v : t) v += first;
    to.triangles.push_back(t);
    to.uv_corners.push_back({kNoIndex, kNoIndex, kNoIndex});
    to.materials.push_back(0);
  }
}

// Nested shells, outermost first, each turned as it should be or all inside out, faces flipped here and there.
Case nested(std::uint64_t seed) {
  Random random(seed * 32452843 + 23);
  Case made;
  made.what = "nested shells";
  made.scene = test::empty_scene();
  const int n = 6 + below(random, 14);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  Scene right = test::empty_scene();
  const int shells = 1 + below(random, 4);
  const V3d middle = V3d(n * 0.5) + random.direction() * 0.3;
  double radius = n * 0.42;
  const bool all_turned = below(random, 2), flips = below(random, 3) == 0;
  for (int s = 0; s < shells; ++s) {
    Scene shell = test::empty_scene();
    const test::Rotation turn = below(random, 2) ? test::random_rotation(random) : test::Rotation{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};
    if (below(random, 2)) test::add_ball(shell, radius, 4 + below(random, 5));
    else test::add_box(shell, V3d(-radius / std::sqrt(3.0)), V3d(radius / std::sqrt(3.0)));
    for (V3d& p : shell.mesh.points) p = turn(p) + middle;
    if (s % 2 == 1) test::turn_faces(shell, 0, shell.mesh.triangles.size());  // a cavity
    append(right.mesh, shell.mesh);
    if (all_turned) test::turn_faces(shell, 0, shell.mesh.triangles.size());
    std::size_t flipped = 0;  // fewer than half: most faces say which way round a shell is
    for (std::size_t t = 0; flips && t < shell.mesh.triangles.size(); ++t)
      if (below(random, 5) == 0 && 2 * (flipped + 1) < shell.mesh.triangles.size()) {
        test::turn_faces(shell, t, t + 1);
        ++flipped;
      }
    append(made.scene.mesh, shell.mesh);
    radius *= random.uniform(0.35, 0.55);
  }
  made.scene.mesh.uvs.clear();
  made.scene.mesh.uv_corners.clear();
  made.solid = right.mesh;
  made.disjoint = true;
  return made;
}
TEST(Topology, Nested) { run_family("nested", 700, nested); }

// Solids that touch by faces, edges and corners, or cross. All outward, so that matter is where any of them is.
Case together(std::uint64_t seed) {
  Random random(seed * 67867967 + 29);
  Case made;
  made.what = "touching and crossing solids";
  made.scene = test::empty_scene();
  const int n = 4 + below(random, 12);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  const int bits = below(random, 4), count = 2 + below(random, 6);
  Scene right = test::empty_scene();
  for (int i = 0; i < count; ++i) {
    Scene one = test::empty_scene();
    if (below(random, 3)) {
      V3d lo, hi;
      for (int k = 0; k < 3; ++k) {
        do { lo[k] = on_lattice(random, n, bits); hi[k] = on_lattice(random, n, bits); } while (lo[k] == hi[k]);
        if (lo[k] > hi[k]) std::swap(lo[k], hi[k]);
      }
      test::add_box(one, lo, hi);
    } else {
      const V3d a = point_in(random, V3d(n));
      add_tetrahedron(one, a, point_in(random, V3d(n)), point_in(random, V3d(n)), point_in(random, V3d(n)));
    }
    append(right.mesh, one.mesh);
    append(made.scene.mesh, one.mesh);
  }
  made.scene.mesh.uv_corners.clear();
  made.solid = right.mesh;
  return made;
}
TEST(Topology, TouchingAndCrossing) { run_family("touching", 900, together); }

// Cells of a lattice, each filled or not: faces between a filled and an empty one, so that edges and corners are met by up to eight faces.
Case lattice_solids(std::uint64_t seed) {
  Random random(seed * 122949823 + 31);
  Case made;
  made.what = "a non-manifold solid of cells";
  made.scene = test::empty_scene();
  const int n = 4 + below(random, 12), cells = 2 + below(random, 3);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  std::vector<char> filled(static_cast<std::size_t>((cells + 2) * (cells + 2) * (cells + 2)), 0);
  const auto at = [&](const V3i& c) -> char& { return filled[static_cast<std::size_t>(((c.z + 1) * (cells + 2) + c.y + 1) * (cells + 2) + c.x + 1)]; };
  test::for_each_cell(V3i(cells), [&](const V3i& c) { at(c) = static_cast<char>(below(random, 2)); });
  if (at(V3i(0)) == 0) at(V3i(0)) = 1;
  // Corners of cells are the same everywhere, and not on walls half of the time.
  const double step = below(random, 2) ? static_cast<double>(n) / cells : n * random.uniform(0.5, 0.98) / cells;
  const V3d origin = below(random, 2) ? V3d(0) : V3d(0.01, 0.002, 0.0003) * n;
  const auto corner = [&](const V3i& c) { return origin + V3d(c) * step; };
  const test::Rotation turn = below(random, 3) ? test::Rotation{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)} : test::random_rotation(random);
  const auto place = [&](const V3d& p) { return turn(p - V3d(n * 0.5)) * (turn.x.x == 1 ? 1.0 : 0.57) + V3d(n * 0.5); };
  test::for_each_cell(V3i(cells), [&](const V3i& c) {
    if (!at(c)) return;
    for (int a = 0; a < 3; ++a)
      for (const int side : {0, 1}) {
        V3i next = c;
        next[a] += side ? 1 : -1;
        if (at(next)) continue;
        V3i o = c, u(0), v(0);
        o[a] += side;
        u[(a + 1) % 3] = v[(a + 2) % 3] = 1;
        const V3d p[4] = {place(corner(o)), place(corner(o + u)), place(corner(o + u + v)), place(corner(o + v))};
        if (side) { test::add_triangle(made.scene, p[0], p[1], p[2]); test::add_triangle(made.scene, p[0], p[2], p[3]); }
        else { test::add_triangle(made.scene, p[0], p[2], p[1]); test::add_triangle(made.scene, p[0], p[3], p[2]); }
      }
  });
  made.solid = made.scene.mesh;
  made.disjoint = true;
  return made;
}
TEST(Topology, NonManifold) { run_family("non-manifold", 700, lattice_solids); }

// With a face missing there is no inside, and a warning says so.
Case open_solids(std::uint64_t seed) {
  Random random(seed * 141650939 + 37);
  Case made;
  made.what = "open solids";
  made.scene = test::empty_scene();
  const int n = 2 + below(random, 14);
  made.recipe = unit_recipe(V3i(n));
  vary(made.recipe, random);
  add_lump(made.scene, V3d(n * 0.5), n * 0.4, 3 + below(random, 6), [&](const V3d& p) { return p; });
  std::vector<std::size_t> with_area;  // at the poles are some without
  for (std::size_t t = 0; t < made.scene.mesh.triangles.size(); ++t) {
    const auto& c = made.scene.mesh.triangles[t];
    if ((made.scene.mesh.points[c[1]] - made.scene.mesh.points[c[0]]).cross(made.scene.mesh.points[c[2]] - made.scene.mesh.points[c[0]]).length() > 1e-6) with_area.push_back(t);
  }
  const auto gone = static_cast<std::ptrdiff_t>(with_area[static_cast<std::size_t>(below(random, static_cast<int>(with_area.size())))]);
  Mesh& mesh = made.scene.mesh;
  mesh.triangles.erase(mesh.triangles.begin() + gone);
  mesh.uv_corners.erase(mesh.uv_corners.begin() + gone);
  mesh.materials.erase(mesh.materials.begin() + gone);
  made.solid = Mesh{};  // nothing is inside
  made.expects_issue = "mesh-open";
  return made;
}
TEST(Topology, Open) { run_family("open", 400, open_solids); }

}  // namespace
}  // namespace texel::stress
