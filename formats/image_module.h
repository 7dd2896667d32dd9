#pragma once
// What texel_image.so exports, for image.cpp and image_module.cpp only.
#include <cstddef>
#include <string>

#include "formats/image.h"

namespace texel {

// The module never throws: false, with a message, means that the file can't be read or written.
struct ImageModule {
  int version;
  // Pixels as stored: integers scaled to [0,1], colour straight. `integer_bits` is 8 or 16 for such integers, 0 for anything else.
  bool (*read)(const char* path, Image& image, int& integer_bits, std::string& message);
  // The same of a file in memory whose format its first bytes tell.
  bool (*read_memory)(const void* bytes, std::size_t count, Image& image, int& integer_bits, std::string& message);
  // Samples as image.h says.
  bool (*read_samples)(const char* path, Samples& samples, std::string& message);
  // `image` goes into the file as it is, as half floats.
  bool (*write_exr)(const char* path, const Image& image, std::string& message);
};

inline constexpr int kImageModuleVersion = 3;

}  // namespace texel
