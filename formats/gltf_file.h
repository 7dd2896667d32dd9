#pragma once
// A glTF 2.0 file below its meanings: JSON values that know their place, buffers, views and accessors, all of them checked.
// For the glTF reader's own files only.
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/report.h"
#include "formats/text_scanner.h"

namespace texel {

// One value of the JSON and its path in the file ("accessors[3].byteOffset"). What does not fit throws Error{kBadInput}, naming both.
class GltfValue {
 public:
  using Json = nlohmann::json;
  GltfValue(const Json& value, std::string path, const std::string& file) : value_(&value), file_(&file), path_(std::move(path)) {}

  [[nodiscard]] bool has(const char* key) const;                  // throws where this is no object
  [[nodiscard]] GltfValue operator[](const char* key) const;      // throws where it is not there
  [[nodiscard]] GltfValue operator[](std::size_t i) const;
  [[nodiscard]] std::size_t size() const;                         // of an array
  [[nodiscard]] double number() const;                            // finite, at most 1e100
  [[nodiscard]] std::uint64_t whole() const;                      // 0 … 2^53
  [[nodiscard]] bool boolean() const;
  [[nodiscard]] const std::string& text() const;
  [[nodiscard]] double number_or(const char* key, double otherwise) const { return has(key) ? (*this)[key].number() : otherwise; }
  [[nodiscard]] std::uint64_t whole_or(const char* key, std::uint64_t otherwise) const { return has(key) ? (*this)[key].whole() : otherwise; }
  [[nodiscard]] bool boolean_or(const char* key, bool otherwise) const { return has(key) ? (*this)[key].boolean() : otherwise; }
  // The array's numbers; throws unless there are `count`. Leaves `to` where the key is not there.
  void numbers(const char* key, std::size_t count, double* to) const;
  [[nodiscard]] std::optional<GltfValue> extension(const char* name) const;
  [[nodiscard]] const Json& json() const { return *value_; }

  [[nodiscard]] const std::string& path() const { return path_; }
  [[noreturn]] void fail(const std::string& what, const std::string& hint = {}) const;
  [[nodiscard]] std::string shown() const;                        // short, for messages

 private:
  const Json* value_;
  const std::string* file_;
  std::string path_;
};

enum class GltfComponent { kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126 };

// Elements of an accessor, all of them within bytes that are there.
struct GltfAccessor {
  const char* data = nullptr;
  std::size_t count = 0, stride = 0;
  int components = 1;                              // 1 … 4: SCALAR … VEC4
  GltfComponent component = GltfComponent::kFloat;
  bool normalized = false;
  std::shared_ptr<const std::string> owned;        // what had to be put together: sparse and decompressed elements

  // The element's `components` values; integers scaled to [0,1] or [−1,1] where normalized. Floats may be anything.
  void read(std::size_t i, double* values) const;
  // The same of an index.
  [[nodiscard]] std::uint32_t index(std::size_t i) const;
};

class GltfFile {
 public:
  // Parses .gltf or .glb, told apart by the first bytes. Throws Error{kBadInput}; Error{kUnsupported} for glTF 1 and for extensions
  // the file requires that are not known. Keeps `input`'s bytes by reference.
  GltfFile(const Input& input, Report& report);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] GltfValue root() const { return {json_, "", path_}; }
  // How many items a list at the top ("nodes") has; 0 where it is not there.
  [[nodiscard]] std::size_t count(const char* list) const;
  [[nodiscard]] GltfValue item(const char* list, std::size_t i) const;
  // object[key] as an index into a list at the top; none where there is no such key. Throws where it points past the list.
  [[nodiscard]] std::optional<std::size_t> reference(const GltfValue& object, const char* key, const char* list) const;

  // The elements of accessors[i]; `components`: how many values one may have. Throws where any element lies outside its view.
  [[nodiscard]] GltfAccessor accessor(std::size_t i, std::initializer_list<int> components);
  // Their number alone, checked against nothing but 2^32.
  [[nodiscard]] std::size_t accessor_count(std::size_t i) const;
  // The bytes of a view, decompressed where it is compressed.
  [[nodiscard]] std::span<const char> view(std::size_t i);
  // The bytes a data: URI holds. Throws where it is not base64.
  [[nodiscard]] std::string data_uri(const GltfValue& uri) const;
  // The file beside this one that a URI names; empty, with `why`, where it is remote, absolute, leads out of the folder or is not there.
  [[nodiscard]] std::string find_file(const std::string& uri, std::string& why) const;

  // Counts `bytes` that the file makes us hold beyond its own, by repetition or decompression. Throws Error{kUnsupported} when they
  // are out of proportion to the file's size.
  void charge(std::uint64_t bytes, const GltfValue& at);

  std::vector<std::string> files;  // read besides the file itself

 private:
  struct Buffer {
    bool loaded = false;
    std::span<const char> bytes;
    std::string decoded;
  };
  void parse(std::span<const char> json);
  void split_glb(const Input& input, Report& report);
  void check_version_and_extensions(Report& report);
  [[nodiscard]] std::span<const char> buffer(std::size_t i);
  [[nodiscard]] std::span<const char> part_of_buffer(const GltfValue& at);
  [[nodiscard]] std::span<const char> unpacked_view(std::size_t i, const GltfValue& compressed, std::uint64_t length);
  void apply_sparse(const GltfValue& sparse, GltfAccessor& accessor, std::size_t element, std::string& bytes);

  std::string path_;
  nlohmann::json json_;
  std::span<const char> json_bytes_, glb_bytes_;
  bool is_glb_ = false;
  std::vector<Buffer> buffers_;
  std::vector<std::unique_ptr<std::string>> unpacked_;      // per view, of compressed ones
  std::vector<std::unique_ptr<FileBytes>> open_;
  std::uint64_t held_ = 0, charged_ = 0;                    // bytes of all files; bytes beyond them
};

}  // namespace texel
