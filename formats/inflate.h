#pragma once
// Compressed bytes, gzip or zlib -> bytes. The only file that knows zlib.
#include <cstddef>
#include <span>
#include <vector>

namespace texel {

enum class Inflated { kAll, kMore, kDamaged };

// At most `most` bytes of what `packed` holds, into `out`. kMore: there is more than that; kDamaged: cut short or not compressed data, with
// what could be read in `out`. Several gzip members one after the other are one stream.
[[nodiscard]] Inflated inflate_bytes(std::span<const char> packed, std::size_t most, std::vector<char>& out);

}  // namespace texel
