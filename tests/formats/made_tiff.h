#pragma once
// TIFF files with one strip, made by hand: sample types and tags that no writer at hand has. Test code only.
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace texel {

struct MadeTiff {
  int width = 1, height = 1, channels = 1;
  int bits = 32;
  int kind = 3;                       // 1 unsigned, 2 signed, 3 floating point
  std::string samples;                // bytes in the file's order
  std::string no_data{};              // GDAL_NODATA; empty: none
  double scale_x = 0, scale_y = 0;    // ModelPixelScaleTag; 0: none
  bool big_endian = false, wide = false;
};

class TiffBytes {
 public:
  explicit TiffBytes(const MadeTiff& tiff) : tiff_(tiff) {}

  [[nodiscard]] std::string made() {
    text_ = tiff_.big_endian ? "MM" : "II";
    add(tiff_.wide ? 43 : 42, 2);
    if (tiff_.wide) {
      add(8, 2);
      add(0, 2);
    }
    const std::size_t head = tiff_.wide ? 16 : 8;
    add(head + tiff_.samples.size(), tiff_.wide ? 8 : 4);
    text_ += tiff_.samples;

    std::vector<Entry> entries{{256, 3, whole(tiff_.width)}, {257, 3, whole(tiff_.height)}, {258, 3, bits()}, {259, 3, whole(1)},
                               {262, 3, whole(tiff_.channels >= 3 ? 2 : 1)}, {273, 4, number(head, 4)}, {277, 3, whole(tiff_.channels)},
                               {278, 3, whole(tiff_.height)}, {279, 4, number(tiff_.samples.size(), 4)}, {339, 3, kinds()}};
    if (tiff_.scale_x > 0) entries.push_back({33550, 12, real(tiff_.scale_x) + real(tiff_.scale_y) + real(0)});
    if (!tiff_.no_data.empty()) entries.push_back({42113, 2, tiff_.no_data + std::string(1, '\0')});
    const std::size_t word = tiff_.wide ? 8 : 4, entry = tiff_.wide ? 20 : 12;
    std::size_t after = text_.size() + (tiff_.wide ? 8 : 2) + entries.size() * entry + word;
    add(entries.size(), tiff_.wide ? 8 : 2);
    std::string behind;
    for (const Entry& e : entries) {
      const std::size_t size = e.type == 3 ? 2 : e.type == 4 ? 4 : e.type == 12 ? 8 : 1;
      add(e.tag, 2);
      add(e.type, 2);
      add(e.value.size() / size, word);
      if (e.value.size() <= word) {
        text_ += e.value + std::string(word - e.value.size(), '\0');
      } else {
        add(after + behind.size(), word);
        behind += e.value;
      }
    }
    add(0, word);
    return text_ + behind;
  }
  [[nodiscard]] std::string number(std::uint64_t value, std::size_t size) const {
    std::string text;
    for (std::size_t i = 0; i < size; ++i) text += static_cast<char>(value >> 8 * (tiff_.big_endian ? size - 1 - i : i));
    return text;
  }

 private:
  struct Entry { std::uint64_t tag, type; std::string value; };
  void add(std::uint64_t value, std::size_t size) { text_ += number(value, size); }
  [[nodiscard]] std::string whole(int value) const { return number(static_cast<std::uint64_t>(value), 2); }
  [[nodiscard]] std::string real(double value) const { return number(std::bit_cast<std::uint64_t>(value), 8); }
  [[nodiscard]] std::string bits() const {
    std::string text;
    for (int c = 0; c < tiff_.channels; ++c) text += whole(tiff_.bits);
    return text;
  }
  [[nodiscard]] std::string kinds() const {
    std::string text;
    for (int c = 0; c < tiff_.channels; ++c) text += whole(tiff_.kind);
    return text;
  }
  const MadeTiff tiff_;
  std::string text_;
};

// Samples in the file's byte order.
template <class T>
std::string stored(const std::vector<T>& values, bool big_endian = false) {
  std::string text;
  for (const T& value : values) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (std::size_t i = 0; i < sizeof(T); ++i) text += bytes[big_endian ? sizeof(T) - 1 - i : i];
  }
  return text;
}

inline std::string tiff_bytes(const MadeTiff& tiff) { return TiffBytes(tiff).made(); }

}  // namespace texel
