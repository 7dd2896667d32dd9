#pragma once
// The plant formats of several files: line trees of the 1990s (.lig with its table and symbols) and scenes of plants (.ops).
// All throw Error{kBadInput}; bytes of any kind are safe.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/plant.h"

namespace texel {

// One symbol file: polygons in a space whose long axis is +x. Byte order is found by which one the file's length fits.
[[nodiscard]] PlantMesh read_smb(const Input& input, Report& report);

// A line of a line tree's table.
struct PlantSymbol {
  std::int64_t number = 0;
  std::string file;              // name of the .smb file
  Material material;
};
[[nodiscard]] std::vector<PlantSymbol> read_dta(const Input& input, Report& report);  // AMAP's table
[[nodiscard]] std::vector<PlantSymbol> read_dsp(const Input& input, Report& report);  // GreenLab's

// Finds and reads a symbol's file; false: it is not there.
using LoadSymbol = std::function<bool(const std::string& file, PlantMesh& mesh)>;

// A line tree, in either byte order. Each symbol is loaded once. Organs of symbols that are not in the table or have no file are left out
// (`plant-symbol`).
[[nodiscard]] Plant read_lig(const Input& input, const std::vector<PlantSymbol>& table, const LoadSymbol& load, Report& report);

// The same with its files looked for: tree12.dta or .dsp, then tree.dta or .dsp; symbols in the folder that the line `SYMBOLES = FOLDER` of a
// .cfg of the same names gives, else beside it. Every file read is appended to `files`. Throws Error{kFile} where there is no table.
[[nodiscard]] Plant open_line_tree(const Input& input, std::vector<std::string>& files, Report& report);

// A row of a scene.
struct OpsRow {
  std::string file;              // relative to the scene
  Affine placement;              // metres to metres
  std::string where;
};
// The rows that place something, of the first scene in the file only. Turned by twist about z, scaled, inclined about the horizontal axis
// (−sin azimuth, cos azimuth, 0), moved; a scale of 0 is 1. Rows of other kinds are skipped. Names that lead out of the scene's folder are refused.
[[nodiscard]] std::vector<OpsRow> read_ops_rows(const Input& input, const PlantOptions& options, Report& report);

// A mesh's own scene, in metres; none where the file is of another kind.
using ReadMesh = std::function<std::optional<Scene>(const std::string& path)>;

// The whole scene: each file is read once. What one row places becomes triangles of the mesh, what several rows place a mesh of Scene::shapes with an
// instance for each row. Rows that `read_mesh` knows nothing of, or whose mesh is not there, are left out (`plant-part`).
// Throws Error{kFile} where a plant is missing.
[[nodiscard]] Scene read_ops(const Input& input, const PlantOptions& options, const ReadMesh& read_mesh, Report& report);

}  // namespace texel
