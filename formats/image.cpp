#include "formats/image.h"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "formats/deflate.h"
#include "formats/error.h"
#include "formats/image_module.h"
#include "formats/module.h"

namespace texel {
namespace {

const ImageModule& image_module() {
  const auto& module = *static_cast<const ImageModule*>(module_symbol("texel_image", "texel_image_module"));
  if (module.version != kImageModuleVersion)
    throw Error(Code::kUnsupported, "texel_image.so", "is of another version (" + std::to_string(module.version) + ")", "reinstall texel");
  return module;
}

// Puts values from 8- or 16-bit files exactly on their steps, which the image library misses by a rounding, and decodes the colour
// channels unless `raw`. There are few enough different values for a table.
void decode_steps(Image& image, int integer_bits, bool raw) {
  std::vector<float> table(std::size_t{1} << integer_bits);
  const float most = static_cast<float>(table.size() - 1);
  for (std::size_t i = 0; i < table.size(); ++i) table[i] = raw ? static_cast<float>(i) / most : srgb_to_linear(static_cast<float>(i) / most);
  const auto channels = static_cast<std::size_t>(image.channels);
  const std::size_t colors = image.has_alpha() ? channels - 1 : channels;
  for (std::size_t i = 0; i < image.pixels.size(); i += channels)
    for (std::size_t c = 0; c < channels; ++c) {
      float& value = image.pixels[i + c];
      // A picture with multiplied alpha has left the stored steps when it arrives here.
      const float scaled = value * most;
      const float step = std::round(scaled);
      const bool stored = std::abs(scaled - step) < 1e-3f && step >= 0 && step <= most;
      if (c >= colors) value = stored ? step / most : value;
      else if (stored) value = table[static_cast<std::size_t>(step)];
      else if (!raw) value = srgb_to_linear(value);
    }
}

template <class Read>
Image finished_image(const std::string& name, bool raw, Read read) {
  Image image;
  int integer_bits = 0;
  std::string message;
  if (!read(image, integer_bits, message)) throw Error(Code::kFile, name, message, "save the picture again as PNG");
  for (float& value : image.pixels)
    if (!std::isfinite(value)) value = 0;  // float pictures only; sums over a texture must stay finite
  if (integer_bits > 0) decode_steps(image, integer_bits, raw);
  return image;
}

void check_shape(const Image& image, const std::string& path) {
  const bool shaped = image.width > 0 && image.height > 0 && image.channels >= 1 && image.channels <= 4;
  const auto values = static_cast<std::size_t>(std::max(image.width, 0)) * static_cast<std::size_t>(std::max(image.height, 0)) *
                      static_cast<std::size_t>(std::max(image.channels, 0));
  if (!shaped || image.pixels.size() != values) throw Error(Code::kFile, path, "an empty picture can't be written");
}

struct File {
  explicit File(const std::string& path) : handle(std::fopen(path.c_str(), "wb")) {}
  ~File() {
    if (handle) std::fclose(handle);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  bool close() {
    std::FILE* last = handle;
    handle = nullptr;
    return std::fclose(last) == 0;
  }
  std::FILE* handle;
};

// Silent, unlike libpng's own.
[[noreturn]] void png_failed(png_structp png, png_const_charp) { png_longjmp(png, 1); }
void png_warned(png_structp, png_const_charp) {}

// libpng reports errors by a jump: nothing with a destructor may be made in here. `stream`: the rows, each after its filter byte, as a
// zlib stream; libpng would make that itself, slower (deflate.cpp).
bool write_chunks(std::FILE* file, const Image& image, const std::vector<std::uint8_t>& stream) {
  static constexpr int kTypes[4] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA};
  static constexpr std::size_t kMostInChunk = std::size_t{1} << 30;
  static constexpr png_byte kData[] = {'I', 'D', 'A', 'T'}, kEnd[] = {'I', 'E', 'N', 'D'};
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, png_failed, png_warned);
  if (!png) return false;
  png_infop info = png_create_info_struct(png);
  if (!info || setjmp(png_jmpbuf(png))) {
    png_destroy_write_struct(&png, &info);
    return false;
  }
  png_init_io(png, file);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image.width), static_cast<png_uint_32>(image.height), 8, kTypes[image.channels - 1],
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_write_info(png, info);
  for (std::size_t at = 0; at < stream.size(); at += kMostInChunk) png_write_chunk(png, kData, stream.data() + at, std::min(kMostInChunk, stream.size() - at));
  png_write_chunk(png, kEnd, nullptr, 0);
  png_destroy_write_struct(&png, &info);
  return true;
}

// The linear value half-way between the encoded steps k and k+1, for each k: 8-bit encoding by comparison, exact and without pow.
class ByteEncoder {
 public:
  ByteEncoder() {
    for (std::size_t k = 0; k < 255; ++k) bounds_[k] = srgb_to_linear((static_cast<float>(k) + 0.5f) / 255.0f);
    std::size_t k = 0;
    for (std::size_t i = 0; i < kCells; ++i) {
      while (k < 255 && bounds_[k] <= static_cast<float>(i) / kCells) ++k;
      start_[i] = static_cast<std::uint8_t>(k);
    }
  }
  [[nodiscard]] std::uint8_t color(float linear) const {
    if (!(linear > 0)) return 0;  // also NaN
    if (linear >= 1) return 255;
    std::size_t k = start_[static_cast<std::size_t>(linear * kCells)];
    while (k < 255 && bounds_[k] <= linear) ++k;
    return static_cast<std::uint8_t>(k);
  }
  [[nodiscard]] static std::uint8_t alpha(float value) {
    return static_cast<std::uint8_t>(value > 0 ? std::min(value, 1.0f) * 255.0f + 0.5f : 0.0f);
  }

 private:
  static constexpr std::size_t kCells = 1024;
  std::uint8_t start_[kCells]{};
  float bounds_[255]{};
};

// One row; the number of channels is a constant, so that comparing and copying a pixel take an instruction or two.
template <std::size_t kChannels>
PixelCount encode_row(const float* from, std::size_t width, std::uint8_t* to) {
  static const ByteEncoder encoder;
  static const float most = srgb_to_linear(255.5f / 255.0f);  // above it the nearest step would not be the last
  PixelCount total, one;                                      // of all pixels; of the one before
  constexpr std::size_t kColors = kChannels % 2 == 0 ? kChannels - 1 : kChannels;
  for (std::size_t i = 0; i < width * kChannels; i += kChannels) {
    const float* pixel = from + i;
    std::uint8_t* out = to + i;
    // Most of a slice is one colour: a pixel like the last one has its bytes.
    if (i > 0 && std::memcmp(pixel, pixel - kChannels, kChannels * sizeof(float)) == 0) {
      std::memcpy(out, out - kChannels, kChannels);
      total.seen += one.seen;
      total.clipped += one.clipped;
      continue;
    }
    for (std::size_t c = 0; c < kColors; ++c) out[c] = encoder.color(pixel[c]);
    if constexpr (kColors < kChannels) out[kColors] = ByteEncoder::alpha(pixel[kColors]);
    one = {1, 0};
    if constexpr (kColors < kChannels) one.seen = out[kColors] > 0;
    if (one.seen)
      for (std::size_t c = 0; c < kColors; ++c)
        if (pixel[c] > most) one.clipped = 1;
    total.seen += one.seen;
    total.clipped += one.clipped;
  }
  return total;
}

// PNG's rows: each after the byte of its filter, which is none. A filter turns the plain areas that most of a slice is into the zeros
// they compress to anyway, and only breaks up what repeats along an outline.
std::vector<std::uint8_t> encoded(const Image& image, PixelCount* count) {
  constexpr PixelCount (*kEncode[4])(const float*, std::size_t, std::uint8_t*) = {encode_row<1>, encode_row<2>, encode_row<3>, encode_row<4>};
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  const std::size_t row = width * static_cast<std::size_t>(image.channels);
  std::vector<std::uint8_t> bytes((row + 1) * height);
  PixelCount one;
  *count = {};
  for (std::size_t y = 0; y < height; ++y) {
    const float* from = image.pixels.data() + y * row;
    std::uint8_t* to = bytes.data() + y * (row + 1) + 1;
    // Above and below what a slice shows all rows are alike.
    if (y > 0 && std::memcmp(from, from - row, row * sizeof(float)) == 0) std::memcpy(to, to - (row + 1), row);
    else one = kEncode[image.channels - 1](from, width, to);
    count->seen += one.seen;
    count->clipped += one.clipped;
  }
  return bytes;
}

}  // namespace

float srgb_to_linear(float encoded) {
  const double v = encoded;
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

float linear_to_srgb(float linear) {
  if (!(linear > 0)) return 0;
  const double v = std::min(linear, 1.0f);
  return static_cast<float>(v <= 0.0031308 ? v * 12.92 : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
}

Image read_image(const std::string& path, bool raw) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) throw Error(Code::kFile, path, "picture not found");
  return finished_image(path, raw, [&](Image& image, int& bits, std::string& message) { return image_module().read(path.c_str(), image, bits, message); });
}

Image read_image(const std::string& bytes, const std::string& name, bool raw) {
  return finished_image(name, raw, [&](Image& image, int& bits, std::string& message) { return image_module().read_memory(bytes.data(), bytes.size(), image, bits, message); });
}

void threshold_alpha(Image& image, float cutoff) {
  if (!image.has_alpha()) return;
  const int n = image.channels, w = image.width, h = image.height;
  std::vector<float> alpha(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  for (std::size_t i = 0; i < alpha.size(); ++i) alpha[i] = image.pixels[i * static_cast<std::size_t>(n) + static_cast<std::size_t>(n) - 1];
  const auto at = [&](int x, int y) { return alpha[static_cast<std::size_t>(std::clamp(y, 0, h - 1)) * static_cast<std::size_t>(w) + static_cast<std::size_t>(std::clamp(x, 0, w - 1))]; };
  constexpr int kPlaces = 4;  // a side
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      float a[3][3], low = 2, high = -1;
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
          a[j][i] = at(x + i - 1, y + j - 1);
          low = std::min(low, a[j][i]);
          high = std::max(high, a[j][i]);
        }
      int there = high < cutoff ? 0 : kPlaces * kPlaces;
      if (low < cutoff && high >= cutoff) {
        there = 0;
        for (int j = 0; j < kPlaces; ++j)
          for (int i = 0; i < kPlaces; ++i) {
            // From the texel's middle, −½ … ½: between it and its neighbour on that side.
            const float dx = (static_cast<float>(i) + 0.5f) / kPlaces - 0.5f, dy = (static_cast<float>(j) + 0.5f) / kPlaces - 0.5f;
            const int sx = dx < 0 ? 0 : 2, sy = dy < 0 ? 0 : 2;
            const float fx = std::abs(dx), fy = std::abs(dy);
            const float value = (a[1][1] * (1 - fx) + a[1][sx] * fx) * (1 - fy) + (a[sy][1] * (1 - fx) + a[sy][sx] * fx) * fy;
            there += value >= cutoff;
          }
      }
      image.at(x, y)[n - 1] = static_cast<float>(there) / (kPlaces * kPlaces);
    }
}

Samples read_samples(const std::string& path) {
  std::error_code ec;
  if (!std::filesystem::is_regular_file(path, ec)) throw Error(Code::kFile, path, "picture not found");
  Samples samples;
  std::string message;
  if (!image_module().read_samples(path.c_str(), samples, message)) throw Error(Code::kFile, path, message, "save the picture again, as 16-bit PNG or 32-bit float TIFF");
  return samples;
}

void write_png(const Image& image, const std::string& path, PixelCount* count) {
  check_shape(image, path);
  PixelCount unasked;
  const std::vector<std::uint8_t> stream = deflate_bytes(encoded(image, count ? count : &unasked));
  File file(path);
  if (!file.handle) throw Error(Code::kFile, path, "cannot be written", "check that the folder is there and may be written to");
  if (!write_chunks(file.handle, image, stream) || !file.close()) throw Error(Code::kFile, path, "cannot be written", "check the space left");
}

void write_exr(const Image& image, const std::string& path) {
  check_shape(image, path);
  Image stored = image;
  const auto channels = static_cast<std::size_t>(image.channels);
  if (image.has_alpha())
    for (std::size_t i = 0; i < stored.pixels.size(); i += channels)
      for (std::size_t c = 0; c + 1 < channels; ++c) stored.pixels[i + c] *= stored.pixels[i + channels - 1];
  std::string message;
  if (!image_module().write_exr(path.c_str(), stored, message)) throw Error(Code::kFile, path, message);
}

}  // namespace texel
