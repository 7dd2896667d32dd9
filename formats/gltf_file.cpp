// glTF 2.0 specification (Khronos, 2.0.1), sections 3.4 to 3.6 and 4; EXT_meshopt_compression.
#include "formats/gltf_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "formats/error.h"
#include "formats/gltf_compression.h"

namespace texel {
namespace {

using Json = nlohmann::json;

constexpr std::uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinChunk = 0x004e4942;

// Extensions a file may require: used, or about things that are not baked. Of the latter those that change the look are named when met.
constexpr const char* kKnown[] = {
    "KHR_mesh_quantization", "KHR_texture_transform", "KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing",
    "KHR_materials_unlit", "KHR_materials_ior", "KHR_materials_specular", "KHR_materials_emissive_strength", "KHR_materials_pbrSpecularGlossiness",
    "EXT_texture_webp", "KHR_texture_basisu", "MSFT_texture_dds", "EXT_texture_avif", "KHR_node_visibility", "KHR_lights_punctual", "KHR_materials_variants",
    "KHR_animation_pointer", "KHR_xmp", "KHR_xmp_json_ld", "KHR_materials_clearcoat", "KHR_materials_transmission", "KHR_materials_volume",
    "KHR_materials_sheen", "KHR_materials_iridescence", "KHR_materials_anisotropy", "KHR_materials_dispersion", "KHR_materials_diffuse_transmission"};

template <class T>
T load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  if constexpr (std::endian::native == std::endian::big && sizeof(T) > 1) {
    auto* bytes = reinterpret_cast<unsigned char*>(&value);
    std::reverse(bytes, bytes + sizeof value);
  }
  return value;
}

std::size_t size_of(GltfComponent c) {
  switch (c) {
    case GltfComponent::kByte:
    case GltfComponent::kUnsignedByte: return 1;
    case GltfComponent::kShort:
    case GltfComponent::kUnsignedShort: return 2;
    default: return 4;
  }
}

template <class T>
void read_values(const char* at, int n, bool normalized, double* values) {
  for (int i = 0; i < n; ++i) {
    const auto v = static_cast<double>(load<T>(at + static_cast<std::size_t>(i) * sizeof(T)));
    values[i] = normalized ? std::max(v / static_cast<double>(std::numeric_limits<T>::max()), -1.0) : v;
  }
}

// "accessors" -> "accessor".
std::string one_of(const char* list) {
  const std::string name = list;
  return name == "meshes" ? "mesh" : name.substr(0, name.size() - 1);
}

int hex(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string percent_decoded(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] == '%' && i + 2 < uri.size() && hex(uri[i + 1]) >= 0 && hex(uri[i + 2]) >= 0) {
      text += static_cast<char>(hex(uri[i + 1]) * 16 + hex(uri[i + 2]));
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

// Whether a relative reference has a scheme ("https:", "file:", "C:").
bool has_scheme(const std::string& uri) {
  const std::size_t colon = uri.find(':');
  return colon != std::string::npos && uri.find_first_of("/\\") > colon;
}

bool leads_out(std::string path) {
  std::replace(path.begin(), path.end(), '\\', '/');
  if (path.starts_with('/')) return true;
  for (std::size_t i = 0; i <= path.size();) {
    const std::size_t end = std::min(path.find('/', i), path.size());
    if (path.compare(i, end - i, "..") == 0 && end - i == 2) return true;
    i = end + 1;
  }
  return false;
}

bool is_file(const std::filesystem::path& path) {
  std::error_code ec;
  return std::filesystem::is_regular_file(path, ec);
}

}  // namespace

// --- values ---

std::string GltfValue::shown() const {
  if (value_->is_object()) return "an object";
  if (value_->is_array()) return "a list";
  if (value_->is_string()) return shown_as(value_->get_ref<const std::string&>());
  return value_->dump();
}

void GltfValue::fail(const std::string& what, const std::string& hint) const {
  throw Error(Code::kBadInput, *file_, path_.empty() ? what : path_ + ": " + what, hint);
}

bool GltfValue::has(const char* key) const {
  if (!value_->is_object()) fail("is " + shown() + ", not an object");
  return value_->contains(key);
}

GltfValue GltfValue::operator[](const char* key) const {
  if (!has(key)) fail(std::string("has no \"") + key + "\"");
  return {*value_->find(key), path_.empty() ? std::string(key) : path_ + "." + key, *file_};
}

GltfValue GltfValue::operator[](std::size_t i) const { return {value_->at(i), path_ + "[" + std::to_string(i) + "]", *file_}; }

std::size_t GltfValue::size() const {
  if (!value_->is_array()) fail("is " + shown() + ", not a list");
  return value_->size();
}

double GltfValue::number() const {
  if (!value_->is_number()) fail("is " + shown() + ", not a number");
  const double v = value_->get<double>();
  if (!(std::abs(v) <= 1e100)) fail("is " + shown() + ", too large to compute with");
  return v;
}

std::uint64_t GltfValue::whole() const {
  const double v = number();
  if (!(v >= 0 && v <= 0x1p53 && v == std::floor(v))) fail("is " + shown() + ", not a whole number from 0");
  return static_cast<std::uint64_t>(v);
}

bool GltfValue::boolean() const {
  if (!value_->is_boolean()) fail("is " + shown() + ", not true or false");
  return value_->get<bool>();
}

const std::string& GltfValue::text() const {
  if (!value_->is_string()) fail("is " + shown() + ", not text");
  return value_->get_ref<const std::string&>();
}

void GltfValue::numbers(const char* key, std::size_t count, double* to) const {
  if (!has(key)) return;
  const GltfValue list = (*this)[key];
  if (list.size() != count) list.fail("has " + std::to_string(list.size()) + " numbers, not " + std::to_string(count));
  for (std::size_t i = 0; i < count; ++i) to[i] = list[i].number();
}

std::optional<GltfValue> GltfValue::extension(const char* name) const {
  if (!has("extensions")) return {};
  const GltfValue all = (*this)["extensions"];
  if (!all.has(name)) return {};
  return all[name];
}

// --- elements ---

void GltfAccessor::read(std::size_t i, double* values) const {
  const char* at = data + i * stride;
  switch (component) {
    case GltfComponent::kByte: return read_values<std::int8_t>(at, components, normalized, values);
    case GltfComponent::kUnsignedByte: return read_values<std::uint8_t>(at, components, normalized, values);
    case GltfComponent::kShort: return read_values<std::int16_t>(at, components, normalized, values);
    case GltfComponent::kUnsignedShort: return read_values<std::uint16_t>(at, components, normalized, values);
    case GltfComponent::kUnsignedInt: return read_values<std::uint32_t>(at, components, normalized, values);
    case GltfComponent::kFloat: return read_values<float>(at, components, false, values);
  }
}

std::uint32_t GltfAccessor::index(std::size_t i) const {
  const char* at = data + i * stride;
  switch (component) {
    case GltfComponent::kUnsignedByte: return load<std::uint8_t>(at);
    case GltfComponent::kUnsignedShort: return load<std::uint16_t>(at);
    default: return load<std::uint32_t>(at);
  }
}

// --- the file ---

GltfFile::GltfFile(const Input& input, Report& report) : path_(input.path), held_(input.bytes.size()) {
  if (input.bytes.size() >= 4 && load<std::uint32_t>(input.bytes.data()) == kMagic) split_glb(input, report);
  else json_bytes_ = input.bytes;
  parse(json_bytes_);
  check_version_and_extensions(report);
  buffers_.resize(count("buffers"));
  unpacked_.resize(count("bufferViews"));
}

void GltfFile::split_glb(const Input& input, Report& report) {
  const std::span<const char> all = input.bytes;
  const auto fail = [&](const std::string& what, Code code = Code::kBadInput) { throw Error(code, path_, what, code == Code::kBadInput ? "copy or export the file again" : "export it as glTF 2.0"); };
  if (all.size() < 20) fail("is cut off: " + std::to_string(all.size()) + " bytes, less than the header of a GLB");
  const std::uint32_t version = load<std::uint32_t>(all.data() + 4), length = load<std::uint32_t>(all.data() + 8);
  if (version != 2) fail("is GLB version " + std::to_string(version) + ", not 2", Code::kUnsupported);
  if (length > all.size()) fail("is cut off: states " + std::to_string(length) + " bytes and has " + std::to_string(all.size()));
  if (length < 20) fail("states a length of " + std::to_string(length) + " bytes, less than its header");
  if (length < all.size()) report.issue("gltf-trailing-bytes", "bytes after the stated end were ignored", static_cast<std::int64_t>(all.size() - length), path_);
  is_glb_ = true;
  bool has_json = false, has_bin = false;
  for (std::size_t at = 12; at < length;) {
    if (length - at < 8) fail("ends within the header of a chunk, at byte " + std::to_string(at));
    const std::uint32_t bytes = load<std::uint32_t>(all.data() + at), kind = load<std::uint32_t>(all.data() + at + 4);
    if (bytes > length - at - 8)
      fail("a chunk at byte " + std::to_string(at) + " states " + std::to_string(bytes) + " bytes where " + std::to_string(length - at - 8) + " are left");
    const std::span<const char> chunk = all.subspan(at + 8, bytes);
    if (!has_json && kind != kJsonChunk) fail("its first chunk is not JSON");
    if (!has_json) json_bytes_ = chunk;
    else if (kind == kBinChunk && !has_bin) {
      glb_bytes_ = chunk;
      has_bin = true;
    }
    has_json = true;
    at += 8 + bytes;
  }
}

void GltfFile::parse(std::span<const char> json) {
  if (json.size() >= 3 && std::memcmp(json.data(), "\xEF\xBB\xBF", 3) == 0) json = json.subspan(3);
  while (!json.empty() && json.back() == '\0') json = json.first(json.size() - 1);  // some writers pad with zeros
  try {
    json_ = Json::parse(json.begin(), json.end());
  } catch (const Json::parse_error& e) {
    const std::size_t at = std::min<std::size_t>(e.byte, json.size());
    const auto line = 1 + std::count(json.begin(), json.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    throw Error(Code::kBadInput, path_ + (is_glb_ ? "" : ":" + std::to_string(line)), "is not JSON at byte " + std::to_string(at), "copy or export the file again");
  } catch (const Json::exception&) {  // a number beyond the range of doubles
    throw Error(Code::kBadInput, path_, "holds a number that is too large", "export the file again");
  }
  if (!json_.is_object()) throw Error(Code::kBadInput, path_, "is no glTF file: its JSON is not an object");
}

void GltfFile::check_version_and_extensions(Report& report) {
  const GltfValue all = root();
  if (!all.has("asset")) all.fail("is no glTF 2.0 file: it has no \"asset\"");
  const std::string version = all["asset"]["version"].text();
  if (!version.starts_with("2."))
    throw Error(Code::kUnsupported, path_, "is glTF " + shown_as(version) + ", not 2.0", "export it as glTF 2.0");
  if (all["asset"].has("minVersion") && all["asset"]["minVersion"].text() != "2.0")
    throw Error(Code::kUnsupported, path_, "needs glTF " + shown_as(all["asset"]["minVersion"].text()), "export it as glTF 2.0");
  if (version != "2.0") report.issue("gltf-version", "version " + shown_as(version) + " is read as 2.0", 1, path_);
  if (!all.has("extensionsRequired")) return;
  const GltfValue required = all["extensionsRequired"];
  for (std::size_t i = 0; i < required.size(); ++i) {
    const std::string& name = required[i].text();
    if (std::none_of(std::begin(kKnown), std::end(kKnown), [&](const char* known) { return name == known; }))
      throw Error(Code::kUnsupported, path_, "requires the extension " + shown_as(name) + ", which is not read", "export it without the extension");
  }
}

std::size_t GltfFile::count(const char* list) const {
  const GltfValue all = root();
  return all.has(list) ? all[list].size() : 0;
}

GltfValue GltfFile::item(const char* list, std::size_t i) const { return root()[list][i]; }

std::optional<std::size_t> GltfFile::reference(const GltfValue& object, const char* key, const char* list) const {
  if (!object.has(key)) return {};
  const GltfValue value = object[key];
  const std::uint64_t i = value.whole();
  if (const std::size_t n = count(list); i >= n)
    value.fail("is " + std::to_string(i) + " where the file has " + std::to_string(n) + " " + (n == 1 ? one_of(list) : list));
  return i;
}

void GltfFile::charge(std::uint64_t bytes, const GltfValue& at) {
  constexpr std::uint64_t kTimes = 64, kFree = std::uint64_t{64} << 20;
  charged_ += std::min(bytes, std::uint64_t{1} << 60);
  if (charged_ > kTimes * held_ + kFree)
    throw Error(Code::kUnsupported, path_, at.path() + ": unpacks to " + std::to_string(charged_) + " bytes together with those before, out of proportion to the file's " + std::to_string(held_),
                "export the file again, without sparse or compressed data");
}

std::string GltfFile::data_uri(const GltfValue& uri) const {
  const std::string& text = uri.text();
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos || !std::string_view(text).substr(0, comma).ends_with(";base64")) uri.fail("is a data URI without \";base64,\"");
  std::string bytes;
  bytes.reserve((text.size() - comma) / 4 * 3);
  std::uint32_t bits = 0;
  int held = 0;
  std::size_t end = text.size();
  while (end > comma + 1 && text[end - 1] == '=') --end;
  for (std::size_t i = comma + 1; i < end; ++i) {
    const char c = text[i];
    const int value = c >= 'A' && c <= 'Z' ? c - 'A' : c >= 'a' && c <= 'z' ? c - 'a' + 26 : c >= '0' && c <= '9' ? c - '0' + 52
                    : c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
    if (value < 0) uri.fail("holds a character that is not base64, at " + std::to_string(i));
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes += static_cast<char>(bits >> held & 255);
  }
  return bytes;
}

std::string GltfFile::find_file(const std::string& uri, std::string& why) const {
  const std::string name = percent_decoded(uri);
  if (uri.empty() || name.find('\0') != std::string::npos) why = "names no file";
  else if (has_scheme(uri) || has_scheme(name)) why = "is not beside the file, and nothing is fetched";
  else if (leads_out(name)) why = "leads out of the file's folder, where nothing is read";
  else {
    const std::filesystem::path folder = std::filesystem::path(path_).parent_path();
    for (const std::string& written : {name, uri})
      if (!leads_out(written) && is_file(folder / written)) return (folder / written).string();
    why = "is not there";
  }
  return {};
}

std::span<const char> GltfFile::buffer(std::size_t i) {
  Buffer& buffer = buffers_[i];
  if (buffer.loaded) return buffer.bytes;
  const GltfValue at = item("buffers", i);
  const std::uint64_t stated = at["byteLength"].whole();
  if (!at.has("uri")) {
    if (!is_glb_ || i != 0) at.fail("has no \"uri\"", is_glb_ ? "only the first buffer is the GLB's own" : "give the .bin file's name");
    buffer.bytes = glb_bytes_;
  } else if (const GltfValue uri = at["uri"]; uri.text().starts_with("data:")) {
    buffer.decoded = data_uri(uri);
    buffer.bytes = {buffer.decoded.data(), buffer.decoded.size()};
  } else {
    std::string why;
    const std::string found = find_file(uri.text(), why);
    if (found.empty())
      throw Error(why == "is not there" ? Code::kFile : Code::kBadInput, path_, uri.path() + ": " + shown_as(uri.text()) + " " + why, "put the file beside it");
    files.push_back(found);
    buffer.bytes = open_.emplace_back(std::make_unique<FileBytes>(found))->bytes();
    held_ += buffer.bytes.size();
  }
  if (buffer.bytes.size() < stated)
    at["byteLength"].fail("states " + std::to_string(stated) + " bytes where there are " + std::to_string(buffer.bytes.size()), "copy or export the file again");
  buffer.bytes = buffer.bytes.first(stated);
  buffer.loaded = true;
  return buffer.bytes;
}

std::span<const char> GltfFile::part_of_buffer(const GltfValue& at) {
  const auto index = reference(at, "buffer", "buffers");
  if (!index) at.fail("has no \"buffer\"");
  const std::uint64_t offset = at.whole_or("byteOffset", 0), length = at["byteLength"].whole();
  const std::span<const char> bytes = buffer(*index);
  if (offset > bytes.size() || length > bytes.size() - offset)
    at.fail("ends at byte " + std::to_string(offset + length) + " of buffers[" + std::to_string(*index) + "], which has " + std::to_string(bytes.size()));
  return bytes.subspan(offset, length);
}

std::span<const char> GltfFile::view(std::size_t i) {
  const GltfValue at = item("bufferViews", i);
  if (const auto compressed = at.extension("EXT_meshopt_compression")) return unpacked_view(i, *compressed, at["byteLength"].whole());
  return part_of_buffer(at);
}

std::span<const char> GltfFile::unpacked_view(std::size_t i, const GltfValue& compressed, std::uint64_t length) {
  if (!unpacked_[i]) {
    MeshoptView view;
    view.count = compressed["count"].whole();
    view.stride = compressed["byteStride"].whole();
    const std::string& mode = compressed["mode"].text();
    if (mode == "ATTRIBUTES") view.mode = MeshoptMode::kAttributes;
    else if (mode == "TRIANGLES") view.mode = MeshoptMode::kTriangles;
    else if (mode == "INDICES") view.mode = MeshoptMode::kIndices;
    else compressed["mode"].fail("is " + shown_as(mode) + ", not ATTRIBUTES, TRIANGLES or INDICES");
    if (compressed.has("filter")) {
      const std::string& filter = compressed["filter"].text();
      if (filter == "OCTAHEDRAL") view.filter = MeshoptFilter::kOctahedral;
      else if (filter == "QUATERNION") view.filter = MeshoptFilter::kQuaternion;
      else if (filter == "EXPONENTIAL") view.filter = MeshoptFilter::kExponential;
      else if (filter != "NONE") compressed["filter"].fail("is " + shown_as(filter) + ", not NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL");
    }
    const std::span<const char> bytes = part_of_buffer(compressed);
    if (const std::string fault = meshopt_fault(view, bytes.size()); !fault.empty()) compressed.fail(fault);
    charge(view.count * view.stride, compressed);
    auto data = std::make_unique<std::string>();
    if (!decode_meshopt(view, bytes, *data)) compressed.fail("its compressed data is damaged", "export the file again");
    unpacked_[i] = std::move(data);
  }
  if (length > unpacked_[i]->size())
    compressed.fail("holds " + std::to_string(unpacked_[i]->size()) + " bytes, fewer than the view's " + std::to_string(length));
  return std::span<const char>(*unpacked_[i]).first(length);
}

std::size_t GltfFile::accessor_count(std::size_t i) const {
  const GltfValue value = item("accessors", i)["count"];
  const std::uint64_t n = value.whole();
  if (n < 1 || n > 0xffffffff) value.fail("is " + value.shown() + ", not from 1 to 2^32 − 1");
  return n;
}

GltfAccessor GltfFile::accessor(std::size_t i, std::initializer_list<int> components) {
  static constexpr const char* kTypes[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  const GltfValue at = item("accessors", i);
  GltfAccessor a;
  a.count = accessor_count(i);
  a.normalized = at.boolean_or("normalized", false);
  const std::string& type = at["type"].text();
  a.components = 0;
  for (const int n : components)
    if (type == kTypes[n - 1]) a.components = n;
  if (a.components == 0) at["type"].fail("is " + shown_as(type) + ", which does not fit its use", "expected " + std::string(kTypes[*components.begin() - 1]));
  const std::uint64_t kind = at["componentType"].whole();
  if (kind < 5120 || kind > 5126 || kind == 5124) at["componentType"].fail("is " + std::to_string(kind) + ", not 5120 to 5123, 5125 or 5126");
  a.component = static_cast<GltfComponent>(kind);
  const std::size_t element = size_of(a.component) * static_cast<std::size_t>(a.components);
  a.stride = element;
  if (const auto view_index = reference(at, "bufferView", "bufferViews")) {
    const GltfValue view_at = item("bufferViews", *view_index);
    const std::span<const char> bytes = view(*view_index);
    const std::uint64_t offset = at.whole_or("byteOffset", 0);
    a.stride = view_at.whole_or("byteStride", element);
    if (a.stride < element || a.stride > 252) view_at["byteStride"].fail("is " + std::to_string(a.stride) + " where an element has " + std::to_string(element) + " bytes", "expected up to 252");
    // Neither product nor sum can overflow: count < 2^32, stride < 2^8, offset <= 2^53.
    if (const std::uint64_t end = offset + (a.count - 1) * a.stride + element; end > bytes.size())
      at.fail("ends at byte " + std::to_string(end) + " of bufferViews[" + std::to_string(*view_index) + "], which has " + std::to_string(bytes.size()));
    a.data = bytes.data() + offset;
    if (!at.has("sparse")) return a;
  }
  charge(a.count * element, at);
  std::string bytes(a.count * element, '\0');
  for (std::size_t k = 0; a.data && k < a.count; ++k) std::memcpy(bytes.data() + k * element, a.data + k * a.stride, element);
  if (at.has("sparse")) apply_sparse(at["sparse"], a, element, bytes);
  a.owned = std::make_shared<const std::string>(std::move(bytes));
  a.data = a.owned->data();
  a.stride = element;
  return a;
}

void GltfFile::apply_sparse(const GltfValue& sparse, GltfAccessor& a, std::size_t element, std::string& bytes) {
  const std::uint64_t n = sparse["count"].whole();
  if (n < 1 || n > a.count) sparse["count"].fail("is " + std::to_string(n) + " where the accessor has " + std::to_string(a.count) + " elements");
  const GltfValue indices = sparse["indices"], values = sparse["values"];
  const std::uint64_t kind = indices["componentType"].whole();
  if (kind != 5121 && kind != 5123 && kind != 5125) indices["componentType"].fail("is " + std::to_string(kind) + ", not 5121, 5123 or 5125");
  GltfAccessor index;
  index.component = static_cast<GltfComponent>(kind);
  index.stride = size_of(index.component);
  const auto part = [&](const GltfValue& at, std::size_t size) {
    const auto view_index = reference(at, "bufferView", "bufferViews");
    if (!view_index) at.fail("has no \"bufferView\"");
    const std::span<const char> all = view(*view_index);
    const std::uint64_t offset = at.whole_or("byteOffset", 0);
    if (offset + n * size > all.size())
      at.fail("ends at byte " + std::to_string(offset + n * size) + " of bufferViews[" + std::to_string(*view_index) + "], which has " + std::to_string(all.size()));
    return all.data() + offset;
  };
  index.data = part(indices, index.stride);
  const char* from = part(values, element);
  std::uint32_t last = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const std::uint32_t to = index.index(k);
    if (to >= a.count) indices.fail("element " + std::to_string(k) + " is " + std::to_string(to) + " where the accessor has " + std::to_string(a.count) + " elements");
    if (k > 0 && to <= last) indices.fail("element " + std::to_string(k) + " is " + std::to_string(to) + " after " + std::to_string(last) + ", not ascending");
    last = to;
    std::memcpy(bytes.data() + to * element, from + k * element, element);
  }
}

}  // namespace texel
