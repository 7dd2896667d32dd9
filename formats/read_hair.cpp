// HAIR, the strands of Cem Yuksel's hair models (www.cemyuksel.com/research/hairmodels): a header of 128 bytes, then arrays, each there where its
// bit is set: segments of each strand (16 bits), points, thickness, transparency, colours (32-bit floats). All little-endian.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "formats/error.h"
#include "formats/fibres.h"
#include "formats/readers.h"

namespace texel {
namespace {

constexpr std::size_t kHead = 128;
constexpr std::uint32_t kSegments = 1, kPoints = 2, kThickness = 4, kTransparency = 8, kColors = 16;

template <class T>
T read_at(const char* at) {
  static_assert(std::endian::native == std::endian::little);
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

float float_at(const char* at, std::uint64_t index) { return read_at<float>(at + index * 4); }

// Stored colours are taken as sRGB, as those of meshes are.
bool color_at(const char* at, V3f& linear) {
  const double rgb[3] = {static_cast<double>(float_at(at, 0)), static_cast<double>(float_at(at, 1)), static_cast<double>(float_at(at, 2))};
  return decode_color(rgb, linear);
}

struct Arrays {
  const char *segments = nullptr, *points = nullptr, *thickness = nullptr, *transparency = nullptr, *colors = nullptr;
};

}  // namespace

Scene read_hair(const Input& input, Report& report) {
  const char* bytes = input.bytes.data();
  const std::size_t size = input.bytes.size();
  if (size < 4 || std::memcmp(bytes, "HAIR", 4) != 0) throw Error(Code::kBadInput, input.path, "is no HAIR file: it does not begin with HAIR");
  if (size < kHead) throw Error(Code::kBadInput, input.path, "ends within its header, after " + std::to_string(size) + " of 128 bytes", "write the file again");
  const auto strands = read_at<std::uint32_t>(bytes + 4), points = read_at<std::uint32_t>(bytes + 8), flags = read_at<std::uint32_t>(bytes + 12);
  const auto default_segments = read_at<std::uint32_t>(bytes + 16);
  if ((flags & kPoints) == 0) throw Error(Code::kBadInput, input.path, "has no array of points", "write the file again");

  Arrays arrays;
  std::uint64_t end = kHead;
  const auto take = [&](std::uint32_t bit, std::uint64_t length) -> const char* {
    if ((flags & bit) == 0) return nullptr;
    const std::uint64_t begin = end;
    end += length;
    return end <= size ? bytes + begin : nullptr;
  };
  arrays.segments = take(kSegments, std::uint64_t{strands} * 2);
  arrays.points = take(kPoints, std::uint64_t{points} * 12);
  arrays.thickness = take(kThickness, std::uint64_t{points} * 4);
  arrays.transparency = take(kTransparency, std::uint64_t{points} * 4);
  arrays.colors = take(kColors, std::uint64_t{points} * 12);
  if (end > size)
    throw Error(Code::kBadInput, input.path, "ends after " + std::to_string(size) + " bytes; " + std::to_string(strands) + " strands of " + std::to_string(points) + " points take " +
                                                 std::to_string(end), "write the file again");
  // Checked before anything is made of it: each strand takes one point more than it has segments.
  std::uint64_t needed = arrays.segments ? strands : std::uint64_t{strands} * (std::uint64_t{default_segments} + 1);
  for (std::uint64_t s = 0; s < strands && arrays.segments; ++s) needed += read_at<std::uint16_t>(arrays.segments + 2 * s);
  if (needed > points)
    throw Error(Code::kBadInput, input.path, "its " + std::to_string(strands) + " strands need " + std::to_string(needed) + " points, and it has " + std::to_string(points), "write the file again");
  if (needed < points) report.issue("hair-points", "points that belong to no strand; they were left out", static_cast<std::int64_t>(points - needed), input.path);
  if (end < size) report.issue("hair-trailing", "bytes behind the last array; they were not read", static_cast<std::int64_t>(size - end), input.path);

  Scene scene;
  Material material = plain_color("hair", V3f(1, 1, 1));
  std::int64_t bad_colors = 0;
  if (!arrays.colors && !color_at(bytes + 28, material.kd)) bad_colors = 1;
  double clear = static_cast<double>(float_at(bytes, 6));
  if (arrays.transparency) {  // a material has one: the mean
    double sum = 0;
    for (std::uint64_t i = 0; i < needed; ++i) {
      const auto t = static_cast<double>(float_at(arrays.transparency, i));
      sum += t > 0 ? std::min(t, 1.0) : 0;
    }
    clear = needed > 0 ? sum / static_cast<double>(needed) : 0;
    report.issue("hair-transparency", "transparency differs along the strands; its mean is used for all of them", 1, input.path);
  }
  material.opacity = static_cast<float>(1 - (clear > 0 ? std::min(clear, 1.0) : 0));
  scene.materials.push_back(material);
  const double default_radius = static_cast<double>(float_at(bytes, 5)) / 2;  // thickness is a diameter

  FibreBuilder builder(scene.fibres, arrays.colors != nullptr);
  std::vector<FibrePoint> strand;
  std::uint64_t at = 0;
  for (std::uint64_t s = 0; s < strands; ++s) {
    const std::uint64_t count = (arrays.segments ? read_at<std::uint16_t>(arrays.segments + 2 * s) : std::uint64_t{default_segments}) + 1;
    strand.clear();
    for (std::uint64_t i = at; i < at + count; ++i) {
      FibrePoint p;
      for (int a = 0; a < 3; ++a) p.at[a] = static_cast<double>(float_at(arrays.points, 3 * i + static_cast<std::uint64_t>(a)));
      p.radius = arrays.thickness ? static_cast<double>(float_at(arrays.thickness, i)) / 2 : default_radius;
      if (arrays.colors && !color_at(arrays.colors + 12 * i, p.color)) ++bad_colors;
      strand.push_back(p);
    }
    at += count;
    builder.strand(strand, 0);
  }
  builder.report_to(report, input.path);
  if (bad_colors) report.issue("non-finite-color", "colours that are not numbers: white used", bad_colors, input.path);
  if (scene.fibres.strands() == 0) throw Error(Code::kBadInput, input.path, builder.reason(), "give a file with strands");
  return scene;
}

}  // namespace texel
