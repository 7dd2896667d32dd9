#pragma once
// Stage 0b: Scene with height fields -> the same with closed triangles for them, cut by the bake's own grid
#include <array>

#include "bake/recipe.h"
#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// Where the field has surface and matter, world space. Cost: one look at every sample.
[[nodiscard]] Box3d height_bounds(const HeightField& field, const std::array<bool, 3>& cyclic);

// The scene with triangles instead of its height fields: the surface, walls at the borders of non-cyclic axes and around holes, and a
// bottom; closed, normals outward, on cyclic axes open where the field repeats and the same there bit for bit.
// The cells between samples are cut at the voxels' walls, and each piece is a fan of four triangles about its middle. A fan has the mean
// height of its bilinear piece and the same border, hence the same vector area: filled volume and Σ A n of every voxel column are those of
// the bilinear surface, to rounding. Pieces without twist are two triangles; where a whole row or column of cells has none, it is not cut.
// A function is sampled at every voxel's walls and between them, finer than its detail; its fans have the mean height of the function.
// The fields' bounds go into scene.bounds, so that plan_grid stays what it was.
// Throws Error{kUnsupported} where the mesh would have more than 2³² vertices, and as plan_grid. Memory: 24 bytes a vertex, 16 a triangle; about one vertex and two
// triangles a flat piece, twice that otherwise. The same triangles at any number of threads.
[[nodiscard]] Scene mesh_heights(Scene scene, const Recipe& recipe, Report& report);

}  // namespace texel
