#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>
#include <set>
#include <tuple>

#include "formats/error.h"
#include "formats/read_pack.h"
#include "formats/read_parts.h"
#include "formats/vdb_module.h"
#include "formats/write_parts.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

// Largest relative error of a number rounded to half or float, and the absolute error below the normal halves.
constexpr double kHalfStep = 0x1p-11, kFloatStep = 0x1p-24, kHalfFloor = 0x1p-25;

double step_of(const Channel& c) { return c.full_float ? kFloatStep : kHalfStep; }

using Findings = std::vector<CheckFinding>;

// How far values may be off beyond their storage: what the recipe's --prune and --quantize allow (docs/accuracy.md).
struct Allowed {
  double prune = 0, quantize = 0;
};

// Counts what is wrong with a grid and keeps the first case, so that a bad grid makes one line and not a million.
class Tally {
 public:
  Tally(Findings& findings, std::string id, std::string file, std::string what) : findings_(findings), id_(std::move(id)), file_(std::move(file)), what_(std::move(what)) {}
  ~Tally() {
    if (count_ > 0) findings_.push_back({id_, file_, what_ + " in " + std::to_string(count_) + (count_ == 1 ? " voxel" : " voxels") + ", first " + first_});
  }
  Tally(const Tally&) = delete;
  Tally& operator=(const Tally&) = delete;
  void add(const V3i& voxel, double value) {
    if (count_++ == 0)
      first_ = std::string("(").append(std::to_string(voxel.x)) + ", " + std::to_string(voxel.y) + ", " + std::to_string(voxel.z) + ") with " + std::to_string(value);
  }

 private:
  Findings& findings_;
  std::string id_, file_, what_, first_;
  std::int64_t count_ = 0;
};

bool block_before(const V3i& a, const V3i& b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); }

// One channel with its voxels: look-ups by voxel and a walk over the active ones.
struct Field {
  const Layer* layer = nullptr;
  const Channel* channel = nullptr;

  // Values at a voxel; nullptr where it is not active.
  [[nodiscard]] const float* at(const V3i& v) const {
    const V3i block(v.x >> 3, v.y >> 3, v.z >> 3);
    const auto components = static_cast<std::size_t>(channel->components);
    const auto b = std::lower_bound(layer->set.blocks.begin(), layer->set.blocks.end(), block, [](const Block& p, const V3i& q) { return block_before(p.at, q); });
    if (b != layer->set.blocks.end() && b->at == block)
      return b->has(v.x & 7, v.y & 7, v.z & 7) ? &channel->values[static_cast<std::size_t>(b->index(v.x & 7, v.y & 7, v.z & 7)) * components] : nullptr;
    const auto t = std::lower_bound(layer->tiles.begin(), layer->tiles.end(), block, block_before);
    if (t != layer->tiles.end() && *t == block) return &channel->tiles[static_cast<std::size_t>(t - layer->tiles.begin()) * components];
    return nullptr;
  }

  // f(voxel, values, how many voxels this stands for): a tile comes once.
  template <class F>
  void each(F&& f) const {
    const auto components = static_cast<std::size_t>(channel->components);
    const float* value = channel->values.data();
    for (const Block& b : layer->set.blocks)
      for (int x = 0; x < 8; ++x)
        for (std::uint64_t left = b.mask[static_cast<std::size_t>(x)]; left; left &= left - 1, value += components) {
          const int bit = __builtin_ctzll(left);
          f(V3i(b.at.x * 8 + x, b.at.y * 8 + (bit >> 3), b.at.z * 8 + (bit & 7)), value, 1);
        }
    for (std::size_t t = 0; t < layer->tiles.size(); ++t) f(layer->tiles[t] * 8, &channel->tiles[t * components], 512);
  }
};

std::optional<Field> field(const Level& level, const std::string& name, int components) {
  Field f;
  f.channel = level.find(name, &f.layer);
  if (!f.channel || f.channel->components != components) return std::nullopt;
  return f;
}

// The ranges docs/pack-format.md states; half a storage step more is rounding.
struct Range {
  const char* name;
  double low, high;
};
constexpr double kAny = std::numeric_limits<double>::infinity();
constexpr Range kRanges[] = {
    {"density", 0, kAny}, {"Cd", 0, kAny},    {"alpha", 0, 1}, {"solid", 0, 1},     {"area", 0, kAny},       {"coverage", 0, 1},
    {"crossings", 0, kAny}, {"kd", 0, kAny},  {"ks", 0, kAny}, {"roughness", 0, 1}, {"transparency", 0, 1},  {"emission", 0, kAny},
    {"normal", -1, 1},    {"S_diag", 0, 1},   {"S_off", -1, 1}, {"axis_1", -100, 100},  {"axis_2", -100, 100},
    {"S1_diag", 0, 1},    {"S1_off", -1, 1},  {"S2_diag", 0, 1}, {"S2_off", -1, 1}, {"share_1", 0.5, 1},
};

void check_ranges(const Field& f, const Allowed& allowed, const std::string& file, Findings& findings) {
  const Channel& c = *f.channel;
  const auto* range = std::find_if(std::begin(kRanges), std::end(kRanges), [&](const Range& r) { return c.name == r.name; });
  const bool known = range != std::end(kRanges);
  // A diagonal of S is raised to stay positive.
  const double slack = step_of(c) + (c.name.ends_with("_diag") ? allowed.quantize : 0);
  Tally nonfinite(findings, "pack-value-nonfinite", file, "grid " + c.name + " is not finite");
  Tally outside(findings, "pack-value-range", file, "grid " + c.name + " is out of its range");
  f.each([&](const V3i& v, const float* value, int) {
    for (int k = 0; k < c.components; ++k) {
      const double x = value[k];
      if (!std::isfinite(x)) nonfinite.add(v, x);
      else if (known && (x < range->low - (range->low < 0 ? slack : 0) || x > range->high + slack)) outside.add(v, x);
    }
  });
}

void check_normals(const Level& level, const std::string& file, Findings& findings) {
  const auto normal = field(level, "normal", 3);
  if (!normal) return;
  Tally long_ones(findings, "pack-normal-length", file, "normal is longer than 1");
  // Each component is off by half a step of itself at most, so the length is off by half a step of the length.
  const double most = 1 + step_of(*normal->channel) + 1e-6;
  normal->each([&](const V3i& v, const float* n, int) {
    const double length = V3d(n[0], n[1], n[2]).length();
    if (length > most) long_ones.add(v, length);
  });
}

// Eigenvalues of a symmetric matrix, descending (Smith 1961).
std::array<double, 3> eigenvalues(const V3d& d, const V3d& o) {
  const double q = (d.x + d.y + d.z) / 3;
  const V3d e = d - V3d(q);
  const double p = std::sqrt((e.dot(e) + 2 * o.dot(o)) / 6);
  if (!(p > 1e-12)) return {q, q, q};
  const double det = e.x * (e.y * e.z - o.z * o.z) - o.x * (o.x * e.z - o.z * o.y) + o.y * (o.x * o.z - e.y * o.y);
  const double angle = std::acos(std::clamp(det / (2 * p * p * p), -1.0, 1.0)) / 3;
  const double first = q + 2 * p * std::cos(angle), last = q + 2 * p * std::cos(angle + 2 * std::numbers::pi / 3);
  return {first, 3 * q - first - last, last};
}

// `name`: S, or S1 or S2 of two lobes. The second is 0 where the first has all.
void check_sggx(const Level& level, const std::string& name, const Allowed& allowed, const std::string& file, Findings& findings) {
  const auto diag = field(level, name + "_diag", 3), off = field(level, name + "_off", 3), coverage = field(level, "coverage", 1);
  const auto share = name == "S2" ? field(level, "share_1", 1) : std::nullopt;
  if (!diag || !off) return;
  Tally bad(findings, "pack-sggx-range", file, name + " has an eigenvalue outside [0, 1] or none that is 1");
  // Rounding moves S by at most a half step of each entry; the entries' squares sum to at most 3 (eigenvalues up to 1).
  const double slack = std::numbers::sqrt3 * std::max(step_of(*diag->channel), step_of(*off->channel)) + 1e-6;
  const double largest = slack + 1.5 * allowed.quantize;
  diag->each([&](const V3i& v, const float* d, int) {
    const float* o = off->at(v);
    // Surface that is all cut away has no normals.
    if (const float* c = coverage ? coverage->at(v) : nullptr; c && c[0] <= 0 && d[0] == 0 && d[1] == 0 && d[2] == 0) return;
    if (const float* s = share ? share->at(v) : nullptr; s && s[0] == 1) {
      if (d[0] != 0 || d[1] != 0 || d[2] != 0) bad.add(v, std::max({d[0], d[1], d[2]}));
      return;
    }
    const auto e = eigenvalues(V3d(d[0], d[1], d[2]), o ? V3d(o[0], o[1], o[2]) : V3d(0));
    if (std::abs(e[0] - 1) > largest) bad.add(v, e[0]);
    else if (e[2] < -slack) bad.add(v, e[2]);
  });
}

// A ray is stopped by surface it crosses or by filled matter it is in: alpha_k <= crossings_k, but for voxels with matter.
void check_alpha(const Level& level, int number, const Allowed& allowed, const std::string& file, Findings& findings) {
  const auto alpha = field(level, "alpha", 3), crossings = field(level, "crossings", 3), solid = field(level, "solid", 1);
  if (!alpha || !crossings) return;
  Tally bad(findings, "pack-alpha-crossings", file, "alpha is more than the crossings can stop");
  const double step = step_of(*alpha->channel), other = step_of(*crossings->channel);
  // Halves' steps of alpha and crossings; and of matter too little to be stored, which a ray along a wall may meet in each voxel of level 0 one after the other.
  const double floor = (2 + std::ldexp(1.0, number)) * kHalfFloor;
  const double scale = 1 - step - allowed.prune;  // a tile's alpha is off in parts of it
  alpha->each([&](const V3i& v, const float* a, int) {
    const float* s = solid ? solid->at(v) : nullptr;
    if (s && s[0] > 0) return;
    const float* c = crossings->at(v);
    for (int k = 0; k < 3; ++k)
      if (const double most = c ? c[k] : 0; a[k] * scale - allowed.quantize * std::min(1.0, 4.0 * a[k]) > most * (1 + other) + std::max(1.0, most) * allowed.quantize + floor) return bad.add(v, a[k]);
  });
}

struct Sum {
  double value = 0, slack = 0;  // world units²; half a storage step of every voxel
  double largest = 0;           // of one voxel
};

std::optional<Sum> area_of(const Level& level) {
  const auto area = field(level, "area", 1);
  if (!area) return std::nullopt;
  Sum sum;
  const double face = level.grid.h * level.grid.h, step = step_of(*area->channel), floor = area->channel->full_float ? 0 : kHalfFloor;
  area->each([&](const V3i&, const float* a, int voxels) {
    sum.value += a[0] * face * voxels;
    sum.largest = std::max(sum.largest, a[0] * face);
    sum.slack += std::max(std::abs(a[0]) * step, floor) * face * voxels;
  });
  return sum;
}

void check_area(const Level& fine, const Level& coarse, const Allowed& allowed, const std::string& file, Findings& findings) {
  const auto a = area_of(fine), b = area_of(coarse);
  if (!a || !b) return;
  // Rounding leaves a level's sum off by half a step of one voxel; pruning takes a share of it.
  const auto off = [&](const Level& level, const Sum& sum) { return sum.slack + allowed.quantize * std::max(sum.largest, level.grid.h * level.grid.h) + allowed.prune * sum.value / (1 - allowed.prune); };
  if (std::abs(a->value - b->value) <= off(fine, *a) + off(coarse, *b) + 1e-6 * a->value) return;
  findings.push_back({"pack-levels-area", file, "surface area is " + std::to_string(b->value) + ", " + std::to_string(a->value) + " on the finest level"});
}

void check_cover(const Level& fine, const Level& coarse, const std::string& file, Findings& findings) {
  for (const Layer& layer : fine.layers)
    for (const Channel& c : layer.channels) {
      const auto parent = field(coarse, c.name, c.components);
      if (!parent) {
        findings.push_back({"pack-levels-grids", file, "has no grid " + c.name + ", which the finer level has"});
        continue;
      }
      Tally bare(findings, "pack-levels-cover", file, "grid " + c.name + " is not active above an active voxel of the finer level");
      Field{&layer, &c}.each([&](const V3i& v, const float*, int voxels) {
        const int side = voxels == 1 ? 1 : 4;  // a tile has 4³ parents
        for (int k = 0; k < side * side * side; ++k) {
          const V3i up((v.x >> 1) + k % side, (v.y >> 1) + k / side % side, (v.z >> 1) + k / side / side);
          const V3i n = coarse.grid.n;  // tiles may reach beyond the box
          if (up.x < n.x && up.y < n.y && up.z < n.z && !parent->at(up)) return bare.add(up, 0);
        }
      });
    }
}

void check_levels(const std::vector<Level>& levels, const Allowed& allowed, Findings& findings) {
  for (std::size_t l = 0; l < levels.size(); ++l) {
    const std::string file = level_file(static_cast<int>(l));
    for (const Layer& layer : levels[l].layers)
      for (const Channel& c : layer.channels) check_ranges({&layer, &c}, allowed, file, findings);
    check_normals(levels[l], file, findings);
    for (const char* name : {"S", "S1", "S2"}) check_sggx(levels[l], name, allowed, file, findings);
    check_alpha(levels[l], static_cast<int>(l), allowed, file, findings);
    if (l == 0) continue;
    check_area(levels[0], levels[l], allowed, file, findings);
    check_cover(levels[l - 1], levels[l], file, findings);
  }
}

bool differs(double a, double b, double scale) { return !(std::abs(a - b) <= 1e-9 * scale); }

void check_grid(const VdbGrid& g, const GridRecord& record, const LevelRecord& level, Findings& findings) {
  const std::string& file = level.file.file;
  const auto find = [&](const char* id, const std::string& text) { findings.push_back({id, file, "grid " + record.name + " " + text}); };
  const Channel& c = g.layer.channels[0];
  if (c.components != record.components || c.full_float == record.half) find("pack-grid-type", "is not stored in the type the manifest states");
  if (g.grid_class != "fog volume") find("pack-grid-class", "is of class " + g.grid_class + " instead of fog volume");
  const std::string type = record.components == 1 ? "" : record.name == "normal" ? "covariant normalize" : "invariant";
  if (g.vector_type != type) find("pack-grid-class", "has vector type " + g.vector_type + " instead of " + type);
  const double scale = std::max({level.grid.h, std::abs(level.grid.origin.x), std::abs(level.grid.origin.y), std::abs(level.grid.origin.z)});
  bool off = !g.linear || differs(g.h, level.grid.h, level.grid.h);
  for (int k = 0; k < 3; ++k) off = off || differs(g.origin[k], level.grid.origin[k], scale);
  if (off) find("pack-grid-transform", "is not where box and voxel_size put it");
  const std::int64_t active = g.layer.set.count + 512 * static_cast<std::int64_t>(g.layer.tiles.size());
  if (active != record.active) find("pack-grid-count", "has " + std::to_string(active) + " active voxels, the manifest says " + std::to_string(record.active));
  if (!inside_grid(g.layer, level.grid.n)) find("pack-grid-outside", "has active voxels outside the box");
}

// The level as far as it can be read.
Level check_volume(const fs::path& folder, const LevelRecord& record, Findings& findings) {
  Level level;
  level.grid = record.grid;
  std::vector<VdbGrid> grids;
  if (const std::string why = vdb_functions().read((folder / record.file.file).string(), &grids); !why.empty()) {
    findings.push_back({"pack-grid-damaged", record.file.file, "cannot be read (" + why + ")"});
    return level;
  }
  std::set<std::string> wanted;
  for (const GridRecord& r : record.grids) {
    wanted.insert(r.name);
    const auto g = std::find_if(grids.begin(), grids.end(), [&](const VdbGrid& candidate) { return candidate.layer.channels[0].name == r.name; });
    if (g == grids.end()) findings.push_back({"pack-grid-missing", record.file.file, "has no grid " + r.name});
    else check_grid(*g, r, record, findings);
  }
  for (VdbGrid& g : grids) {
    if (!wanted.contains(g.layer.channels[0].name)) findings.push_back({"pack-grid-extra", record.file.file, "has a grid " + g.layer.channels[0].name + " that the manifest does not list"});
    else level.layers.push_back(std::move(g.layer));
  }
  if (const std::int64_t active = active_voxels(level); active != record.active)
    findings.push_back({"pack-grid-count", record.file.file, "has " + std::to_string(active) + " active voxels, the manifest says " + std::to_string(record.active)});
  return level;
}

// Whether the file is as the manifest states.
bool check_file(const fs::path& folder, const FileRecord& record, Findings& findings) {
  std::error_code ec;
  if (!fs::is_regular_file(folder / record.file, ec)) {
    findings.push_back({"pack-file-missing", record.file, "is missing"});
    return false;
  }
  const FileRecord found = record_file(folder, record.file);
  if (found.bytes != record.bytes)
    findings.push_back({"pack-file-size", record.file, "has " + std::to_string(found.bytes) + " bytes, the manifest says " + std::to_string(record.bytes)});
  else if (found.sha256 != record.sha256)
    findings.push_back({"pack-file-hash", record.file, "has other bytes than the manifest's SHA-256"});
  else
    return true;
  return false;
}

void check_stack(const fs::path& folder, StackRecord stack, Findings& findings) {
  bool whole = true;
  for (int k = 0; k < stack.count; ++k) {
    const std::string name = slice_file(stack.axis, stack.level, stack.format, k);
    std::error_code ec;
    if (fs::is_regular_file(folder / name, ec)) continue;
    findings.push_back({"pack-file-missing", name, "is missing"});
    whole = false;
  }
  if (!whole) return;
  const std::string sha256 = stack.sha256, pattern = slice_pattern(stack.axis, stack.level, stack.format);
  const std::int64_t bytes = stack.bytes;
  sum_stack(stack, folder);
  if (stack.bytes != bytes)
    findings.push_back({"pack-file-size", pattern, "are " + std::to_string(stack.bytes) + " bytes together, the manifest says " + std::to_string(bytes)});
  else if (stack.sha256 != sha256)
    findings.push_back({"pack-file-hash", pattern, "have other bytes than the manifest's SHA-256"});
}

void check_extra_files(const fs::path& folder, const Manifest& m, Findings& findings) {
  std::set<std::string> known{"manifest.json"}, extra;
  for (const LevelRecord& l : m.levels) known.insert(l.file.file);
  for (const StackRecord& s : m.slices)
    for (int k = 0; k < s.count; ++k) known.insert(slice_file(s.axis, s.level, s.format, k));
  if (m.preview) known.insert(m.preview->file);
  std::error_code ec;
  for (fs::recursive_directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec))
    if (const std::string name = it->path().lexically_relative(folder).generic_string(); !it->is_directory(ec) && !known.contains(name)) extra.insert(name);
  for (const std::string& name : extra) findings.push_back({"pack-file-extra", name, "is not part of the pack"});
}

}  // namespace

std::vector<CheckFinding> check_pack(const std::string& folder) {
  Findings findings;
  Manifest m;
  try {
    const fs::path manifest = fs::path(folder) / "manifest.json";
    m = parse_manifest(read_manifest(folder), manifest.string());
  } catch (const Error& e) {
    if (e.code != Code::kBadInput) throw;
    return {{"pack-manifest", "manifest.json", e.message}};
  }
  const fs::path place = folder;
  std::vector<Level> levels;
  bool whole = true;
  for (std::size_t l = 0; l < m.levels.size(); ++l) {
    const Grid expected = m.grid.level(static_cast<int>(l));
    if (m.levels[l].grid.n != expected.n || differs(m.levels[l].grid.h, expected.h, expected.h))
      findings.push_back({"pack-levels-size", m.levels[l].file.file, "is not the finest level's grid halved " + std::to_string(l) + " times"});
    // OpenVDB trusts the counts in its files: only a file whose hash is right is opened.
    const bool same = check_file(place, m.levels[l].file, findings);
    whole = whole && same;
    if (same) levels.push_back(check_volume(place, m.levels[l], findings));
  }
  if (whole) check_levels(levels, {m.prune, m.quantize}, findings);
  for (const StackRecord& s : m.slices) check_stack(place, s, findings);
  if (m.preview) check_file(place, *m.preview, findings);
  check_extra_files(place, m, findings);
  return findings;
}

}  // namespace texel
