// EXT_meshopt_compression through meshoptimizer.
#include <meshoptimizer.h>

#include <limits>

#include "formats/gltf_compression.h"

namespace texel {

std::string meshopt_fault(const MeshoptView& view, std::size_t bytes) {
  const bool attributes = view.mode == MeshoptMode::kAttributes;
  const bool filtered = view.filter != MeshoptFilter::kNone;
  if (attributes ? view.stride < 4 || view.stride > 256 || view.stride % 4 != 0 : view.stride != 2 && view.stride != 4)
    return "its byteStride is " + std::to_string(view.stride) + (attributes ? ", not a multiple of 4 up to 256" : ", not 2 or 4");
  if (view.count > std::numeric_limits<std::uint32_t>::max()) return "its count is " + std::to_string(view.count) + ", not below 2^32";
  if (view.mode == MeshoptMode::kTriangles && view.count % 3 != 0) return "its count is " + std::to_string(view.count) + ", no whole number of triangles";
  if (filtered && !attributes) return "its filter is for ATTRIBUTES only";
  if ((view.filter == MeshoptFilter::kOctahedral && view.stride != 4 && view.stride != 8) || (view.filter == MeshoptFilter::kQuaternion && view.stride != 8))
    return "its byteStride is " + std::to_string(view.stride) + ", which its filter does not have";
  if (view.count * view.stride > bytes * 64 + 4096)
    return "states " + std::to_string(view.count) + " elements of " + std::to_string(view.stride) + " bytes, more than " + std::to_string(bytes) + " compressed bytes hold";
  return {};
}

bool decode_meshopt(const MeshoptView& view, std::span<const char> bytes, std::string& to) {
  const auto* from = reinterpret_cast<const unsigned char*>(bytes.data());
  // Filters work on four elements at once.
  to.assign((view.count + 3) / 4 * 4 * view.stride, '\0');
  if (view.count == 0) return true;
  int status = 0;
  switch (view.mode) {
    case MeshoptMode::kAttributes: status = meshopt_decodeVertexBuffer(to.data(), view.count, view.stride, from, bytes.size()); break;
    case MeshoptMode::kTriangles: status = meshopt_decodeIndexBuffer(to.data(), view.count, view.stride, from, bytes.size()); break;
    case MeshoptMode::kIndices: status = meshopt_decodeIndexSequence(to.data(), view.count, view.stride, from, bytes.size()); break;
  }
  if (status != 0) return false;
  switch (view.filter) {
    case MeshoptFilter::kNone: break;
    case MeshoptFilter::kOctahedral: meshopt_decodeFilterOct(to.data(), view.count, view.stride); break;
    case MeshoptFilter::kQuaternion: meshopt_decodeFilterQuat(to.data(), view.count, view.stride); break;
    case MeshoptFilter::kExponential: meshopt_decodeFilterExp(to.data(), view.count, view.stride); break;
  }
  to.resize(view.count * view.stride);
  return true;
}

}  // namespace texel
