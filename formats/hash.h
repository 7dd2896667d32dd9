#pragma once
// SHA-256 of what comes in pieces. Internal to formats/; others use file_sha256 (write.h).
#include <cstdint>
#include <memory>
#include <string>

namespace texel {

class Sha256 {
 public:
  Sha256();
  ~Sha256();
  Sha256(const Sha256&) = delete;
  Sha256& operator=(const Sha256&) = delete;

  void add(const void* data, std::size_t bytes);
  // Appends a file's bytes; how many there were. Throws Error{kFile}.
  std::int64_t add_file(const std::string& path);
  // 64 hex digits. Once.
  [[nodiscard]] std::string hex();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace texel
