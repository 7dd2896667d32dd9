// KHR_draco_mesh_compression through Google's Draco.
#include <draco/compression/decode.h>

#include <exception>

#include "formats/gltf_compression.h"

namespace texel {
namespace {

// Draco sizes its arrays by the counts in the data's head, before it reads what follows: they are looked at first.
// Head: "DRACO", version, type, method, flags; optional metadata would come between, and glTF has no use for them.
bool counts_of(std::span<const char> bytes, std::uint64_t* counts) {
  constexpr std::size_t kHead = 11;
  if (bytes.size() < kHead + 2) return false;
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
  const int version = at(5) * 256 + at(6);
  const bool metadata = (at(9) | at(10) << 8) & 0x8000;
  if (version < 0x202 || metadata) return false;
  const bool edgebreaker = at(8) == 1;
  std::size_t i = kHead + (edgebreaker ? 1 : 0);
  for (int k = 0; k < 2; ++k) {
    counts[k] = 0;
    for (int shift = 0;; shift += 7) {
      if (i >= bytes.size() || shift > 28) return false;
      const unsigned byte = at(i++);
      counts[k] |= static_cast<std::uint64_t>(byte & 127) << shift;
      if (byte < 128) break;
    }
  }
  if (edgebreaker) std::swap(counts[0], counts[1]);  // vertices, faces; the sequential method has faces, points
  return true;
}

bool copy_values(const draco::Mesh& from, const draco::PointAttribute& attribute, DracoMesh::Values& to) {
  const int n = attribute.num_components();
  if (n < 1 || n > 4) return false;
  to.components = n;
  to.plain_integers = !attribute.normalized() && attribute.data_type() != draco::DT_FLOAT32 && attribute.data_type() != draco::DT_FLOAT64;
  to.values.resize(static_cast<std::size_t>(from.num_points()) * static_cast<std::size_t>(n));
  for (std::uint32_t i = 0; i < from.num_points(); ++i) {
    const draco::AttributeValueIndex index = attribute.mapped_index(draco::PointIndex(i));
    if (index.value() >= attribute.size()) return false;
    if (!attribute.ConvertValue<float>(index, static_cast<std::int8_t>(n), &to.values[std::size_t{i} * static_cast<std::size_t>(n)])) return false;
  }
  return true;
}

}  // namespace

bool decode_draco(std::span<const char> bytes, std::span<const std::uint32_t> ids, std::size_t most_points, std::size_t most_triangles, DracoMesh& mesh,
                  std::string& message) try {
  std::uint64_t counts[2] = {0, 0};  // faces; points, or vertices before they are split
  message = "its Draco data is damaged";
  if (!counts_of(bytes, counts)) {
    message = "its Draco data is damaged, or older than version 2.2";
    return false;
  }
  if (counts[0] > most_triangles || counts[1] > most_points) {
    message = "its Draco data states " + std::to_string(counts[0]) + " triangles and " + std::to_string(counts[1]) + " vertices, more than its accessors";
    return false;
  }
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) {
    message += " (" + decoded.status().error_msg_string() + ")";
    return false;
  }
  const std::unique_ptr<draco::Mesh> from = std::move(decoded).value();
  mesh.points = from->num_points();
  if (mesh.points > most_points) {
    message = "its Draco data holds " + std::to_string(mesh.points) + " vertices, more than its accessors";
    return false;
  }
  mesh.triangles.resize(from->num_faces());
  for (std::uint32_t i = 0; i < from->num_faces(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t corner = from->face(draco::FaceIndex(i))[k].value();
      if (corner >= mesh.points) return false;
      mesh.triangles[i][k] = corner;
    }
  for (const std::uint32_t id : ids) {
    const draco::PointAttribute* attribute = from->GetAttributeByUniqueId(id);
    if (!attribute) {
      message = "its Draco data has no attribute " + std::to_string(id);
      return false;
    }
    if (!copy_values(*from, *attribute, mesh.attributes.emplace_back())) return false;
  }
  return true;
} catch (const std::exception& e) {
  message = std::string("its Draco data is damaged (") + e.what() + ")";
  return false;
}

}  // namespace texel
