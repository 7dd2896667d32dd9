#include "formats/tiff_tags.h"

#include <bit>
#include <cmath>
#include <cstdint>

#include "formats/text_scanner.h"

namespace texel {
namespace {

class Tiff {
 public:
  explicit Tiff(std::span<const char> bytes) : bytes_(bytes) {
    if (bytes.size() < 8 || bytes[0] != bytes[1] || (bytes[0] != 'I' && bytes[0] != 'M')) return;
    big_endian_ = bytes[0] == 'M';
    const std::uint64_t version = number(2, 2);
    if (version == 42) first_ = number(4, 4);
    if (version == 43 && bytes.size() >= 16) {
      wide_ = true;
      first_ = number(8, 8);
    }
  }

  // Unsigned integer of 1…8 bytes at a place known to lie inside.
  [[nodiscard]] std::uint64_t number(std::uint64_t at, std::size_t size) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t place = static_cast<std::size_t>(at) + (big_endian_ ? i : size - 1 - i);
      value = value << 8 | static_cast<unsigned char>(bytes_[place]);
    }
    return value;
  }
  [[nodiscard]] bool holds(std::uint64_t at, std::uint64_t size) const { return at <= bytes_.size() && size <= bytes_.size() - at; }

  // The bytes of a tag's `count` values of `size` bytes; empty where the tag is of another type, has fewer, or leads out of the file.
  [[nodiscard]] std::span<const char> values(std::uint64_t tag, std::uint64_t type, std::uint64_t size, std::uint64_t least, std::uint64_t most) const {
    const std::size_t head = wide_ ? 8 : 2, entry = wide_ ? 20 : 12, word = wide_ ? 8 : 4;
    if (first_ == 0 || !holds(first_, head)) return {};
    const std::uint64_t entries = number(first_, head);
    for (std::uint64_t i = 0; i < entries && i < 65536; ++i) {
      const std::uint64_t at = first_ + head + i * entry;
      if (!holds(at, entry)) return {};
      if (number(at, 2) != tag) continue;
      const std::uint64_t count = number(at + 4, word);
      if (number(at + 2, 2) != type || count < least || count > most) return {};
      const std::uint64_t length = count * size, place = length <= word ? at + 4 + word : number(at + 4 + word, word);
      if (!holds(place, length)) return {};
      return bytes_.subspan(static_cast<std::size_t>(place), static_cast<std::size_t>(length));
    }
    return {};
  }
  [[nodiscard]] double real(std::span<const char> value) const {
    return std::bit_cast<double>(number(static_cast<std::uint64_t>(value.data() - bytes_.data()), 8));
  }

 private:
  std::span<const char> bytes_;
  bool big_endian_ = false, wide_ = false;
  std::uint64_t first_ = 0;
};

}  // namespace

TiffTags read_tiff_tags(std::span<const char> bytes) {
  constexpr std::uint64_t kAscii = 2, kDouble = 12, kNoData = 42113, kPixelScale = 33550;
  const Tiff tiff(bytes);
  TiffTags tags;
  if (std::span<const char> text = tiff.values(kNoData, kAscii, 1, 1, 256); !text.empty()) {
    while (!text.empty() && is_blank(text.front())) text = text.subspan(1);
    double value = 0;
    if (parse_number(text.data(), text.data() + text.size(), value)) tags.no_data = value;
  }
  if (const auto scale = tiff.values(kPixelScale, kDouble, 8, 2, 16); !scale.empty()) {
    const V2d size(tiff.real(scale), tiff.real(scale.subspan(8)));
    if (size.x > 0 && size.y > 0 && size.x < 1e30 && size.y < 1e30) tags.pixel_scale = size;
  }
  return tags;
}

}  // namespace texel
