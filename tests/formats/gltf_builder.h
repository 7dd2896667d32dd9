#pragma once
// Makes glTF files for tests, piece by piece.
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace texel {

using Json = nlohmann::json;

inline std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k <= bytes.size() ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

template <class T>
std::string raw_bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

inline std::string little_word(std::size_t value) {
  const auto v = static_cast<std::uint32_t>(value);
  return raw_bytes(std::vector<std::uint32_t>{v});
}

inline std::string glb_of(const Json& json, std::string bin) {
  std::string text = json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  bin.resize((bin.size() + 3) / 4 * 4, '\0');
  std::string body = little_word(text.size()) + "JSON" + text;
  if (!bin.empty()) body += little_word(bin.size()) + std::string("BIN\0", 4) + bin;
  return "glTF" + little_word(2) + little_word(12 + body.size()) + body;
}

struct GltfBuilder {
  Json json = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", Json::array()}}}}};
  std::string bin;

  std::size_t add(const char* list, Json item) {
    json[list].push_back(std::move(item));
    return json[list].size() - 1;
  }
  std::size_t view(const std::string& bytes, std::size_t stride = 0) {
    bin.resize((bin.size() + 3) / 4 * 4, '\0');
    Json v = {{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", bytes.size()}};
    if (stride) v["byteStride"] = stride;
    bin += bytes;
    return add("bufferViews", v);
  }
  // `kind`: componentType; `type`: "VEC3".
  template <class T>
  std::size_t accessor(const std::vector<T>& values, int kind, const std::string& type, bool normalized = false) {
    const std::size_t n = type == "SCALAR" ? 1 : static_cast<std::size_t>(type[3] - '0');
    Json a = {{"bufferView", view(raw_bytes(values))}, {"componentType", kind}, {"count", values.size() / n}, {"type", type}};
    if (normalized) a["normalized"] = true;
    return add("accessors", a);
  }
  std::size_t floats(const std::vector<float>& values, const std::string& type) { return accessor(values, 5126, type); }
  std::size_t indices(const std::vector<std::uint16_t>& values) { return accessor(values, 5123, "SCALAR"); }
  // A mesh of one primitive, shown by a node at the scene's top. Returns the primitive.
  Json& show(Json primitive, Json node = Json::object()) {
    node["mesh"] = add("meshes", {{"primitives", {std::move(primitive)}}});
    root(add("nodes", node));
    return json["meshes"].back()["primitives"][0];
  }
  void root(std::size_t node) { json["scenes"][0]["nodes"].push_back(node); }
  // The unit square in z = 0, counter-clockwise seen from +z, as two triangles; uv as the picture lies, v down.
  Json square() {
    return {{"attributes", {{"POSITION", floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, "VEC3")}, {"TEXCOORD_0", floats({0, 1, 1, 1, 1, 0, 0, 0}, "VEC2")}}},
            {"indices", indices({0, 1, 2, 0, 2, 3})}};
  }
  Json cube() {
    return {{"attributes", {{"POSITION", floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1}, "VEC3")}}},
            {"indices", indices({0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 3, 7, 6, 3, 6, 2, 0, 4, 7, 0, 7, 3, 1, 2, 6, 1, 6, 5})}};
  }

  [[nodiscard]] std::string glb() const {
    Json all = json;
    if (!bin.empty()) all["buffers"] = {{{"byteLength", bin.size()}}};
    return glb_of(all, bin);
  }
  [[nodiscard]] std::string gltf(const std::string& uri = {}) const {
    Json all = json;
    if (!bin.empty()) all["buffers"] = {{{"byteLength", bin.size()}, {"uri", uri.empty() ? "data:application/octet-stream;base64," + base64(bin) : uri}}};
    return all.dump();
  }
};

}  // namespace texel
