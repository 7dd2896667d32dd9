#include "formats/read_volume.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "formats/error.h"
#include "formats/inflate.h"
#include "formats/readers.h"
#include "formats/vdb_module.h"

namespace texel {
namespace {

enum class Kind { kUnsigned, kSigned, kFloat };

// How one number is stored.
struct Type {
  Kind kind = Kind::kUnsigned;
  int bytes = 1;
  bool big_endian = false;
};

float decode(const char* at, const Type& type) {
  std::uint64_t bits = 0;
  for (int i = 0; i < type.bytes; ++i) bits = bits << 8 | static_cast<unsigned char>(at[type.big_endian ? i : type.bytes - 1 - i]);
  if (type.kind == Kind::kFloat) return type.bytes == 4 ? std::bit_cast<float>(static_cast<std::uint32_t>(bits)) : static_cast<float>(std::bit_cast<double>(bits));
  if (type.kind == Kind::kUnsigned) return static_cast<float>(bits);
  const int unused = 64 - 8 * type.bytes;
  return static_cast<float>(static_cast<std::int64_t>(bits << unused) >> unused);
}

[[noreturn]] void fail(const std::string& where, const std::string& what, const std::string& hint = "write the file again") {
  throw Error(Code::kBadInput, where, what, hint);
}

std::string size_text(const V3i& n) { return std::to_string(n.x) + " x " + std::to_string(n.y) + " x " + std::to_string(n.z); }

void check_size(const V3i& n, const std::string& path) {
  for (int a = 0; a < 3; ++a)
    if (n[a] < 1) fail(path, "the size is " + size_text(n) + " samples", "each must be 1 or more");
  if (static_cast<double>(n.x) * n.y * n.z > static_cast<double>(kMostSamples))
    throw Error(Code::kUnsupported, path, "holds " + size_text(n) + " samples, more than " + std::to_string(kMostSamples), "make it coarser");
}

std::size_t bytes_of(const V3i& n, const Type& type) {
  return static_cast<std::size_t>(n.x) * static_cast<std::size_t>(n.y) * static_cast<std::size_t>(n.z) * static_cast<std::size_t>(type.bytes);
}

SampleGrid samples_of(std::span<const char> bytes, const V3i& n, const Type& type, float scale, const std::string& path, Report& report) {
  if (bytes.size() < bytes_of(n, type))
    fail(path, "ends after " + std::to_string(bytes.size()) + " bytes of samples; " + size_text(n) + " of them take " + std::to_string(bytes_of(n, type)));
  if (bytes.size() > bytes_of(n, type))
    report.issue("volume-trailing-bytes", "bytes after the last sample; they are not used", static_cast<std::int64_t>(bytes.size() - bytes_of(n, type)), path);
  std::int64_t bad = 0;
  SampleGrid grid = make_samples(n, [&](int y, int z, float* out) {
    const char* from = bytes.data() + ((static_cast<std::size_t>(z) * static_cast<std::size_t>(n.y) + static_cast<std::size_t>(y)) * static_cast<std::size_t>(n.x)) * static_cast<std::size_t>(type.bytes);
    for (int x = 0; x < n.x; ++x) out[x] = decode(from + static_cast<std::size_t>(x) * static_cast<std::size_t>(type.bytes), type) * scale;
  }, &bad);
  if (bad > 0) report.issue("volume-non-finite", "samples are not finite numbers; the least value stands for them", bad, path);
  return grid;
}

// KEY = VALUE lines.
struct Header {
  std::string path;
  struct Line {
    std::string key, value;
    int number;
  };
  std::vector<Line> lines;

  [[nodiscard]] const Line* find(std::initializer_list<const char*> keys) const {
    for (const Line& l : lines)
      for (const char* key : keys)
        if (l.key == key) return &l;
    return nullptr;
  }
  [[noreturn]] void bad(const Line& l, const std::string& hint) const {
    fail(path + ":" + std::to_string(l.number), l.key + " is \"" + l.value.substr(0, 60) + "\"", hint);
  }
  // All numbers of the value; count 0: any.
  [[nodiscard]] std::vector<double> numbers(const Line& l, std::size_t count) const {
    std::vector<double> v;
    const char *at = l.value.data(), *end = at + l.value.size();
    while (at != end && v.size() < 64) {
      if (is_blank(*at)) {
        ++at;
        continue;
      }
      double number = 0;
      const char* next = parse_number(at, end, number);
      if (!next || !std::isfinite(number)) break;
      v.push_back(number);
      at = next;
    }
    if (at != end || v.size() != count) bad(l, "expected " + std::to_string(count) + (count == 1 ? " number" : " numbers"));
    return v;
  }
  [[nodiscard]] int whole(const Line& l, double most = 1e9) const {
    const double v = numbers(l, 1)[0];
    if (v != std::floor(v) || std::abs(v) > most) bad(l, "expected a whole number");
    return static_cast<int>(v);
  }
};

std::string_view trimmed(std::string_view s) {
  while (!s.empty() && (is_blank(s.front()) || is_line_end(s.front()))) s.remove_prefix(1);
  while (!s.empty() && (is_blank(s.back()) || is_line_end(s.back()))) s.remove_suffix(1);
  return s;
}

void add_line(Header& header, std::string_view line, int number) {
  const std::size_t at = line.find('=');
  if (at == std::string_view::npos) return;
  header.lines.push_back({std::string(trimmed(line.substr(0, at))), std::string(trimmed(line.substr(at + 1))), number});
}

void set_spacing(SampleGrid& grid, const V3d& spacing, const std::string& where) {
  for (int a = 0; a < 3; ++a) {
    if (!(std::abs(spacing[a]) > 1e-30 && std::abs(spacing[a]) < 1e30)) fail(where, "the spacing of samples is " + std::to_string(spacing[a]), "give numbers other than 0");
    grid.step[a] = V3d(0, 0, 0);
    grid.step[a][a] = std::abs(spacing[a]);
  }
}

void set_origin(SampleGrid& grid, const V3d& origin, const std::string& where) {
  for (int a = 0; a < 3; ++a)
    if (!(std::abs(origin[a]) < 1e30)) fail(where, "the first sample lies at " + std::to_string(origin[a]), "give numbers below 1e30");
  grid.origin = origin;
}

}  // namespace

Volume read_df3(const Input& input, Report& report) {
  if (input.bytes.size() < 6) fail(input.path, "is too short for a density file (" + std::to_string(input.bytes.size()) + " bytes)");
  V3i n;
  for (int a = 0; a < 3; ++a) n[a] = static_cast<int>(decode(input.bytes.data() + 2 * a, {Kind::kUnsigned, 2, true}));
  check_size(n, input.path);
  const std::size_t samples = bytes_of(n, {}), left = input.bytes.size() - 6;
  Type type{Kind::kUnsigned, left >= 4 * samples ? 4 : left >= 2 * samples ? 2 : 1, true};  // the header does not say: POV-Ray goes by the length too
  Volume v;
  v.grid = samples_of(input.bytes.subspan(6), n, type, static_cast<float>(1 / (std::exp2(8 * type.bytes) - 1)), input.path, report);
  set_spacing(v.grid, V3d(1.0 / n.x, 1.0 / n.y, 1.0 / n.z), input.path);
  v.grid.origin = V3d(0.5 / n.x, 0.5 / n.y, 0.5 / n.z);
  v.iso = 0.5;
  return v;
}

Volume read_inr(const Input& input, Report& report) {
  constexpr std::size_t kStep = 256, kMostHeader = 65536;
  const bool packed = input.bytes.size() > 2 && static_cast<unsigned char>(input.bytes[0]) == 0x1f && static_cast<unsigned char>(input.bytes[1]) == 0x8b;
  std::vector<char> unpacked;
  const auto head = [&]() -> std::string_view {
    if (!packed) return {input.bytes.data(), std::min(input.bytes.size(), kMostHeader)};
    if (inflate_bytes(input.bytes, kMostHeader, unpacked) == Inflated::kDamaged && unpacked.empty()) fail(input.path, "is damaged: gzip cannot unpack it");
    return {unpacked.data(), unpacked.size()};
  }();
  if (!head.starts_with("#INRIMAGE-4#{")) fail(input.path, "does not begin with #INRIMAGE-4#{", "only INRIMAGE-4 is read");
  std::size_t size = kStep;
  while (size <= head.size() && head.substr(0, size).find("##}") == std::string_view::npos) size += kStep;
  if (size > head.size()) fail(input.path, "has no end of its header (##})");
  Header header{input.path, {}};
  int number = 1;
  for (std::string_view rest = head.substr(0, size); !rest.empty(); ++number) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    add_line(header, rest.substr(0, end), number);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  V3i n;
  V3d spacing(1, 1, 1), origin(0, 0, 0);
  constexpr const char *kSize[] = {"XDIM", "YDIM", "ZDIM"}, *kSpacing[] = {"VX", "VY", "VZ"}, *kOrigin[] = {"TX", "TY", "TZ"};
  for (int a = 0; a < 3; ++a) {
    const Header::Line* l = header.find({kSize[a]});
    if (!l) fail(input.path, std::string("has no ") + kSize[a]);
    n[a] = header.whole(*l);
    if ((l = header.find({kSpacing[a]}))) spacing[a] = header.numbers(*l, 1)[0];
    if ((l = header.find({kOrigin[a]}))) origin[a] = header.numbers(*l, 1)[0];
  }
  if (const Header::Line* l = header.find({"VDIM"}); l && header.whole(*l) != 1) header.bad(*l, "only one value a sample is read");
  Type type;
  const Header::Line* l = header.find({"TYPE"});
  if (!l) fail(input.path, "has no TYPE");
  if (l->value == "unsigned fixed") type.kind = Kind::kUnsigned;
  else if (l->value == "signed fixed") type.kind = Kind::kSigned;
  else if (l->value == "float") type.kind = Kind::kFloat;
  else header.bad(*l, "known: unsigned fixed, signed fixed, float");
  l = header.find({"PIXSIZE"});
  if (!l) fail(input.path, "has no PIXSIZE");
  type.bytes = 0;
  for (const int bytes : {1, 2, 4, 8})
    if (l->value == std::to_string(8 * bytes) + " bits" || l->value == std::to_string(8 * bytes)) type.bytes = bytes;
  if (type.bytes == 0 || (type.kind == Kind::kFloat && type.bytes < 4)) header.bad(*l, "known: 8, 16, 32, 64 bits; float: 32, 64");
  l = header.find({"CPU"});
  type.big_endian = l && (l->value == "sun" || l->value == "sgi");
  if (l && !type.big_endian && l->value != "decm" && l->value != "pc" && l->value != "alpha") header.bad(*l, "known: decm, alpha, pc, sun, sgi");
  check_size(n, input.path);
  std::span<const char> samples;
  if (packed) {
    const std::size_t wanted = size + bytes_of(n, type);
    const Inflated how = inflate_bytes(input.bytes, wanted, unpacked);
    if (how == Inflated::kDamaged) fail(input.path, "is damaged: gzip unpacks " + std::to_string(unpacked.size()) + " of " + std::to_string(wanted) + " bytes");
    if (how == Inflated::kMore) report.issue("volume-trailing-bytes", "bytes after the last sample; they are not used", 1, input.path);
    samples = std::span<const char>(unpacked).subspan(std::min(size, unpacked.size()));
  } else {
    samples = input.bytes.subspan(size);
  }
  Volume v;
  v.grid = samples_of(samples, n, type, 1, input.path, report);
  set_spacing(v.grid, spacing, input.path);
  set_origin(v.grid, origin, input.path);
  return v;
}

Volume read_mhd(const Input& input, const LoadBytes& load, Report& report) {
  constexpr std::size_t kMostHeader = 65536;
  Header header{input.path, {}};
  const std::string_view text(input.bytes.data(), input.bytes.size());
  std::size_t at = 0;
  int number = 1;
  for (; at < text.size() && at < kMostHeader; ++number) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    add_line(header, text.substr(at, std::min<std::size_t>(end - at, 4096)), number);
    at = std::min(end + 1, text.size());
    if (!header.lines.empty() && header.lines.back().key == "ElementDataFile") break;  // the last key by definition; LOCAL data follow
  }
  const auto need = [&](const char* key) -> const Header::Line& {
    const Header::Line* l = header.find({key});
    if (!l) fail(input.path, std::string("has no ") + key, "a MetaImage header has NDims, DimSize, ElementType, ElementDataFile");
    return *l;
  };
  const auto flag = [&](std::initializer_list<const char*> keys) {
    const Header::Line* l = header.find(keys);
    return l && (l->value == "True" || l->value == "true" || l->value == "1");
  };
  if (header.whole(need("NDims")) != 3) header.bad(need("NDims"), "only volumes, of 3 dimensions, are read");
  V3i n;
  V3d spacing(1, 1, 1), origin(0, 0, 0);
  const std::vector<double> sizes = header.numbers(need("DimSize"), 3);
  for (int a = 0; a < 3; ++a) {
    const double s = sizes[static_cast<std::size_t>(a)];
    if (!(s >= 1 && s <= 1e6 && s == std::floor(s))) header.bad(need("DimSize"), "expected three whole numbers from 1 to 1000000");
    n[a] = static_cast<int>(s);
  }
  if (const Header::Line* l = header.find({"ElementSpacing", "ElementSize"})) {
    const std::vector<double> v = header.numbers(*l, 3);
    spacing = V3d(v[0], v[1], v[2]);
  }
  if (const Header::Line* l = header.find({"Offset", "Position", "Origin"})) {
    const std::vector<double> v = header.numbers(*l, 3);
    origin = V3d(v[0], v[1], v[2]);
  }
  if (const Header::Line* l = header.find({"ElementNumberOfChannels"}); l && header.whole(*l) != 1) header.bad(*l, "only one value a sample is read");
  constexpr std::pair<const char*, Type> kTypes[] = {
      {"MET_UCHAR", {Kind::kUnsigned, 1}}, {"MET_CHAR", {Kind::kSigned, 1}},      {"MET_USHORT", {Kind::kUnsigned, 2}},     {"MET_SHORT", {Kind::kSigned, 2}},
      {"MET_UINT", {Kind::kUnsigned, 4}},  {"MET_INT", {Kind::kSigned, 4}},       {"MET_ULONG_LONG", {Kind::kUnsigned, 8}}, {"MET_LONG_LONG", {Kind::kSigned, 8}},
      {"MET_FLOAT", {Kind::kFloat, 4}},    {"MET_DOUBLE", {Kind::kFloat, 8}}};
  const Header::Line& type_line = need("ElementType");
  const auto* known = std::find_if(std::begin(kTypes), std::end(kTypes), [&](const auto& t) { return type_line.value == t.first; });
  if (known == std::end(kTypes)) header.bad(type_line, "known: MET_UCHAR, MET_CHAR, MET_USHORT, MET_SHORT, MET_UINT, MET_INT, MET_FLOAT, MET_DOUBLE");
  Type type = known->second;
  type.big_endian = flag({"ElementByteOrderMSB", "BinaryDataByteOrderMSB"});
  check_size(n, input.path);

  Volume v;
  const Header::Line& file = need("ElementDataFile");
  std::span<const char> bytes;
  if (file.value == "LOCAL") {
    bytes = input.bytes.subspan(at);
  } else {
    if (file.value.empty() || file.value == "LIST" || file.value.find('%') != std::string::npos) header.bad(file, "one data file, or LOCAL, is read");
    bytes = load(file.value);
    v.further_files.push_back(file.value);
  }
  if (const Header::Line* l = header.find({"HeaderSize"})) {
    const int skip = header.whole(*l);
    if (skip == -1 && bytes.size() >= bytes_of(n, type)) bytes = bytes.last(bytes_of(n, type));
    else if (skip >= 0 && static_cast<std::size_t>(skip) <= bytes.size()) bytes = bytes.subspan(static_cast<std::size_t>(skip));
    else header.bad(*l, "it is not within the data");
  }
  std::vector<char> unpacked;
  if (flag({"CompressedData"})) {
    if (inflate_bytes(bytes, bytes_of(n, type), unpacked) == Inflated::kDamaged)
      fail(input.path, "its data are damaged: they unpack to " + std::to_string(unpacked.size()) + " of " + std::to_string(bytes_of(n, type)) + " bytes");
    bytes = unpacked;
  }
  v.grid = samples_of(bytes, n, type, 1, input.path, report);
  set_spacing(v.grid, spacing, input.path);
  set_origin(v.grid, origin, input.path);
  if (const Header::Line* l = header.find({"TransformMatrix", "Rotation", "Orientation"})) {  // rows: the world directions of the indices
    const std::vector<double> m = header.numbers(*l, 9);
    for (std::size_t a = 0; a < 3; ++a) {
      const V3d direction(m[3 * a], m[3 * a + 1], m[3 * a + 2]);
      if (std::abs(direction.length() - 1) > 1e-3) header.bad(*l, "its rows are not of length 1");
      v.grid.step[a] = direction * v.grid.step[a].length();
    }
    const double turn = v.grid.step[0].dot(v.grid.step[1].cross(v.grid.step[2])) / (v.grid.step[0].length() * v.grid.step[1].length() * v.grid.step[2].length());
    if (std::abs(turn) < 1e-3) header.bad(*l, "its rows lie in a plane");
  }
  return v;
}

Volume read_vdb(const std::string& path, Report& report) {
  VdbVolume from;
  if (const std::string fault = vdb_functions().read_volume(path, &from); !fault.empty())
    throw Error(from.unsupported ? Code::kUnsupported : Code::kBadInput, path, fault, from.unsupported ? "give a level set or a fog volume" : "write the file again");
  if (from.others > 0)
    report.issue("vdb-several-grids", "further grids in the file; only \"" + from.name + "\" was read", from.others, path);
  if (from.bad > 0) report.issue("volume-non-finite", "samples are not finite numbers; the background stands for them", from.bad, path);
  Volume v;
  v.grid = std::move(from.grid);
  v.sign = from.level_set ? -1 : 1;
  v.iso = from.level_set ? 0 : 0.5;
  return v;
}

Scene volume_scene(Volume volume, std::optional<double> iso, const std::string& path) {
  const auto text = [](double v) {
    char buffer[32];
    std::snprintf(buffer, sizeof buffer, "%.6g", v);
    return std::string(buffer);
  };
  Interval values = sample_range(volume.grid);
  if (volume.sign < 0) values = {-values.high, -values.low};
  const std::string range = text(values.low) + " to " + text(values.high);
  if (!iso) iso = volume.iso;
  if (!iso) throw Error(Code::kCommandLine, "--iso", "missing: " + path + " holds values from " + range + " and does not say where its surface is", "give --iso V");
  if (!(values.high >= *iso)) throw Error(Code::kBadInput, path, "no value is >= " + text(*iso) + " (they run from " + range + ")", "change --iso");
  if (!(std::min(values.low, volume.sign * static_cast<double>(volume.grid.outside)) < *iso))
    throw Error(Code::kBadInput, path, "every value is >= " + text(*iso) + " (they run from " + range + ")", "change --iso");
  return implicit_scene(make_grid_field(std::move(volume.grid), volume.sign), *iso, path);
}

}  // namespace texel
