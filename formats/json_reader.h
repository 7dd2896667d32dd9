#pragma once
// Strict reading of JSON inputs: whatever is wrong is named by its path in the file. For readers only: it brings the JSON library along.
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "formats/grid.h"
#include "formats/scene.h"
#include "formats/text_scanner.h"

namespace texel {

using Json = nlohmann::json;

// The input as JSON. Throws Error{kUnsupported} above `most_bytes` (`kind` says for what), Error{kBadInput} with FILE:LINE where it is not JSON
// (`example` says what it should look like), is nested more than 500 deep, or holds numbers beyond a double.
[[nodiscard]] Json parse_json(const Input& input, std::size_t most_bytes, const std::string& kind, const std::string& example);

// Takes values out of such a file; each function throws Error{kBadInput} that names `path`, the value found and what was expected.
// All numbers are finite and below 1e100.
class JsonReader {
 public:
  JsonReader(std::string file, std::string manual) : file_(std::move(file)), manual_(std::move(manual)) {}

  [[noreturn]] void fail(const std::string& path, const std::string& what, const std::string& hint) const;
  [[nodiscard]] static std::string shown(const Json& value);                      // at most 60 bytes
  [[nodiscard]] static std::string member(const std::string& path, const std::string& key);  // the path of a key that may have any letters
  void check_keys(const Json& object, const std::string& path, std::span<const char* const> known) const;
  void check_keys(const Json& object, const std::string& path, std::initializer_list<const char*> known) const { check_keys(object, path, std::span(known.begin(), known.size())); }
  [[nodiscard]] double number(const Json& v, const std::string& path) const;
  [[nodiscard]] double positive(const Json& v, const std::string& path) const;
  [[nodiscard]] std::vector<double> numbers(const Json& v, const std::string& path, std::size_t count) const;
  [[nodiscard]] V3d vector(const Json& v, const std::string& path) const;
  [[nodiscard]] V3d direction(const Json& v, const std::string& path) const;      // unit
  [[nodiscard]] std::string text(const Json& v, const std::string& path) const;   // not empty, without a zero byte
  [[nodiscard]] const Json& need(const Json& object, const char* key, const std::string& path) const;
  [[nodiscard]] V3d vector_or(const Json& object, const char* key, const std::string& path, const V3d& otherwise) const;
  [[nodiscard]] float share(const Json& v, const std::string& path, double most = 1) const;  // 0…most
  [[nodiscard]] V3f color(const Json& v, const std::string& path, double most = 1) const;    // linear: three numbers 0…most
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  std::string file_, manual_;
};

}  // namespace texel
