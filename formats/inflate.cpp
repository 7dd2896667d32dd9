#include "formats/inflate.h"

#include <zlib.h>

#include <algorithm>

namespace texel {

Inflated inflate_bytes(std::span<const char> packed, std::size_t most, std::vector<char>& out) {
  constexpr std::size_t kPiece = std::size_t{1} << 20;  // memory grows with what comes, not with what a header promises
  out.clear();
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 32) != Z_OK) return Inflated::kDamaged;
  std::size_t used = 0;
  Inflated result = Inflated::kDamaged;
  for (;;) {
    if (stream.avail_in == 0) {
      const std::size_t piece = std::min(packed.size() - used, kPiece);
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data() + used));
      stream.avail_in = static_cast<uInt>(piece);
      used += piece;
    }
    const std::size_t had = out.size(), room = std::min(most + 1 - had, kPiece);
    out.resize(had + room);
    stream.next_out = reinterpret_cast<Bytef*>(out.data() + had);
    stream.avail_out = static_cast<uInt>(room);
    const int status = inflate(&stream, Z_NO_FLUSH);
    out.resize(had + room - stream.avail_out);
    if (out.size() > most) {
      out.resize(most);
      result = Inflated::kMore;
      break;
    }
    const bool over = stream.avail_in == 0 && used == packed.size();
    if (status == Z_STREAM_END) {
      if (over || inflateReset(&stream) != Z_OK) {
        result = Inflated::kAll;
        break;
      }
    } else if (status != Z_OK || (over && stream.avail_out > 0)) {
      break;
    }
  }
  inflateEnd(&stream);
  return result;
}

}  // namespace texel
