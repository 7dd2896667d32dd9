#pragma once
// The two ways a glTF file compresses geometry. Bytes of any kind are safe.
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace texel {

// EXT_meshopt_compression.
enum class MeshoptMode { kAttributes, kTriangles, kIndices };
enum class MeshoptFilter { kNone, kOctahedral, kQuaternion, kExponential };
struct MeshoptView {
  MeshoptMode mode = MeshoptMode::kAttributes;
  MeshoptFilter filter = MeshoptFilter::kNone;
  std::size_t count = 0, stride = 0;  // elements, bytes of one
};
// What is wrong with such a view by the extension's rules; empty: nothing. Says, too, where `bytes` cannot hold as many elements:
// the codec stores 64 bytes in one at best.
[[nodiscard]] std::string meshopt_fault(const MeshoptView& view, std::size_t bytes);
// count·stride bytes; the view is without fault. False: damaged.
[[nodiscard]] bool decode_meshopt(const MeshoptView& view, std::span<const char> bytes, std::string& to);

// KHR_draco_mesh_compression.
struct DracoMesh {
  std::size_t points = 0;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // into points
  struct Values {
    int components = 0;          // 1 … 4
    bool plain_integers = false; // whole numbers that Draco's data do not call normalized
    std::vector<float> values;   // points·components; normalized integers scaled
  };
  std::vector<Values> attributes;  // as asked for
};
// `ids`: the attributes wanted, by Draco's unique id. `most_points`, `most_triangles`: the mesh may have no more. False, with what is
// wrong, where it is damaged or an attribute is not there.
[[nodiscard]] bool decode_draco(std::span<const char> bytes, std::span<const std::uint32_t> ids, std::size_t most_points, std::size_t most_triangles,
                                DracoMesh& mesh, std::string& message);

}  // namespace texel
