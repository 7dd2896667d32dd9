// STL, ASCII and binary. Corners with the same coordinates become one vertex; facet normals are not read.
#include <bit>
#include <cstring>

#include "formats/error.h"
#include "formats/readers.h"

namespace texel {
namespace {

// Gives equal points one number. An open-addressing table of numbers: 4 bytes per place, at most half full.
class Welder {
 public:
  explicit Welder(std::vector<V3d>& points) : points_(points), table_(1024, kNoIndex) {}

  std::uint32_t number(V3d p) {
    p += V3d(0, 0, 0);  // −0 becomes 0, which it equals
    if (points_.size() * 2 >= table_.size()) grow();
    std::size_t place = hash(p) & (table_.size() - 1);
    for (; table_[place] != kNoIndex; place = (place + 1) & (table_.size() - 1))
      if (std::memcmp(&points_[table_[place]], &p, sizeof p) == 0) return table_[place];
    table_[place] = static_cast<std::uint32_t>(points_.size());
    points_.push_back(p);
    return table_[place];
  }

 private:
  static std::size_t hash(const V3d& p) {
    std::uint64_t h = 0;
    for (const double v : {p.x, p.y, p.z}) {
      h = (h ^ std::bit_cast<std::uint64_t>(v)) * 0x9e3779b97f4a7c15u;
      h ^= h >> 32;
    }
    return h;
  }
  void grow() {
    table_.assign(table_.size() * 4, kNoIndex);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      std::size_t place = hash(points_[i]) & (table_.size() - 1);
      while (table_[place] != kNoIndex) place = (place + 1) & (table_.size() - 1);
      table_[place] = static_cast<std::uint32_t>(i);
    }
  }
  std::vector<V3d>& points_;
  std::vector<std::uint32_t> table_;
};

constexpr std::size_t kHead = 84, kFacet = 50;

std::uint32_t little_word(const char* at) {
  std::uint32_t word = 0;
  std::memcpy(&word, at, 4);
  return std::endian::native == std::endian::little ? word : __builtin_bswap32(word);
}

Scene read_binary(const Input& input, Report& report) {
  if (input.bytes.size() < kHead)
    throw Error(Code::kBadInput, input.path, "is no STL file: neither ASCII nor long enough for binary (" + std::to_string(input.bytes.size()) + " bytes)");
  const std::size_t stated = little_word(input.bytes.data() + 80);
  const std::size_t held = (input.bytes.size() - kHead) / kFacet;
  if (stated > held)
    throw Error(Code::kBadInput, input.path, "states " + std::to_string(stated) + " facets and holds " + std::to_string(held), "copy or export the file again");
  if (input.bytes.size() - kHead > stated * kFacet)
    report.issue("stl-trailing-bytes", "bytes after the last facet were ignored", static_cast<std::int64_t>(input.bytes.size() - kHead - stated * kFacet), input.path);
  Scene scene;
  Mesh& mesh = scene.mesh;
  mesh.triangles.reserve(stated);
  Welder weld(mesh.points);
  for (std::size_t i = 0; i < stated; ++i) {
    const char* at = input.bytes.data() + kHead + i * kFacet + 12;  // behind the normal
    std::array<std::uint32_t, 3> triangle{};
    for (std::uint32_t& corner : triangle) {
      double v[3];
      for (double& value : v) {
        value = std::bit_cast<float>(little_word(at));
        at += 4;
      }
      corner = weld.number({v[0], v[1], v[2]});
    }
    mesh.triangles.push_back(triangle);
  }
  mesh.materials.assign(mesh.triangles.size(), 0);
  finish_mesh(scene, report, input.path, "holds no facet");
  return scene;
}

bool same_word(std::string_view word, std::string_view lower) {
  if (word.size() != lower.size()) return false;
  for (std::size_t i = 0; i < word.size(); ++i)
    if ((word[i] | 32) != lower[i]) return false;
  return true;
}

// Only the vertices matter: each three of them are a facet, whatever solids and loops are around them. A loop of another length is
// no STL; its facet is dropped.
Scene read_ascii(const Input& input, Report& report) {
  Scene scene;
  Mesh& mesh = scene.mesh;
  Welder weld(mesh.points);
  TextScanner text(input);
  std::vector<V3d> loop;
  const char *facet = nullptr, *first_bad = nullptr;
  std::int64_t bad = 0;
  bool ended = true;
  const auto close_facet = [&] {
    if (loop.size() == 3) {
      mesh.triangles.push_back({weld.number(loop[0]), weld.number(loop[1]), weld.number(loop[2])});
    } else if (bad++ == 0) {
      first_bad = facet ? facet : text.position();
    }
    loop.clear();
  };
  for (;;) {
    text.skip_space('\0');
    if (text.at_end()) break;
    const char* at = text.position();
    const std::string_view word = text.word();
    if (same_word(word, "solid") || same_word(word, "endsolid")) {
      text.next_line();  // its name may hold any words
      ended = same_word(word, "endsolid");
    } else if (same_word(word, "facet")) {
      facet = at;
      loop.clear();
    } else if (same_word(word, "endfacet")) {
      close_facet();
    } else if (same_word(word, "vertex")) {
      double v[3];
      for (double& value : v) {
        text.skip_space('\0');
        if (!text.number(value))
          throw Error(Code::kBadInput, text.where(), text.at_end() ? "ends in the middle of a vertex"
                                                                   : "vertex coordinate is not a number (" + shown_as(text.peek_word()) + ")");
      }
      if (loop.size() < 4) loop.emplace_back(v[0], v[1], v[2]);
    }
  }
  mesh.materials.assign(mesh.triangles.size(), 0);
  if (bad > 0) report.issue("bad-index", "facets of other than three vertices were dropped", bad, text.where(first_bad));
  if (!ended && !mesh.triangles.empty()) report.issue("stl-no-end", "ends without endsolid: it may be cut off", 1, text.where());
  finish_mesh(scene, report, bad > 0 ? text.where(first_bad) : input.path, bad > 0 ? "no facet has three vertices" : "holds no facet");
  return scene;
}

// Binary files may begin with "solid" too: their size tells, then whether the text goes on like STL.
bool is_ascii(std::span<const char> bytes) {
  if (bytes.size() >= kHead && kHead + kFacet * little_word(bytes.data() + 80) == bytes.size()) return false;
  std::string_view head(bytes.data(), std::min<std::size_t>(bytes.size(), 1024));
  while (!head.empty() && (is_blank(head.front()) || is_line_end(head.front()))) head.remove_prefix(1);
  if (head.find('\0') != std::string_view::npos) return false;
  return head.size() >= 5 && same_word(head.substr(0, 5), "solid");
}

}  // namespace

Scene read_stl(const Input& input, Report& report) { return is_ascii(input.bytes) ? read_ascii(input, report) : read_binary(input, report); }

}  // namespace texel
