#include "formats/read_pack.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "formats/error.h"
#include "formats/manifest.h"
#include "formats/read_parts.h"
#include "formats/vdb_module.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

bool same_voxels(const Layer& a, const Layer& b) {
  return a.set.count == b.set.count && a.tiles == b.tiles && a.set.blocks.size() == b.set.blocks.size() &&
         std::equal(a.set.blocks.begin(), a.set.blocks.end(), b.set.blocks.begin(),
                    [](const Block& p, const Block& q) { return p.at == q.at && p.mask == q.mask; });
}

// Whether a local coordinate of the block lies in [0, n) for every voxel set in `mask`. Used for one axis at a time.
bool inside(const Block& b, const V3i& n) {
  for (int x = 0; x < 8; ++x)
    for (std::uint64_t left = b.mask[static_cast<std::size_t>(x)]; left; left &= left - 1) {
      const int bit = __builtin_ctzll(left);
      if (b.at.x * 8 + x >= n.x || b.at.y * 8 + (bit >> 3) >= n.y || b.at.z * 8 + (bit & 7) >= n.z) return false;
    }
  return true;
}

bool in_range(const V3i& at, const V3i& n) {
  return at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x <= (n.x - 1) / 8 && at.y <= (n.y - 1) / 8 && at.z <= (n.z - 1) / 8;
}

Level read_level(const fs::path& folder, const LevelRecord& record) {
  const std::string path = (folder / record.file.file).string();
  const auto damaged = [&](const std::string& what) { throw Error(Code::kBadInput, path, what, "bake the pack again"); };
  // OpenVDB trusts the counts in its files; the hash makes sure that they are the ones written.
  std::int64_t bytes = 0;
  if (file_sha256(path, &bytes) != record.file.sha256 || bytes != record.file.bytes) damaged("is not the file the manifest describes");
  std::vector<VdbGrid> grids;
  if (const std::string why = vdb_functions().read(path, &grids); !why.empty()) damaged("cannot be read (" + why + ")");
  Level level;
  level.grid = record.grid;
  for (const GridRecord& wanted : record.grids) {
    const auto found = std::find_if(grids.begin(), grids.end(), [&](const VdbGrid& g) { return !g.layer.channels.empty() && g.layer.channels[0].name == wanted.name; });
    if (found == grids.end()) damaged("has no grid " + wanted.name);
    Layer& layer = found->layer;
    if (layer.channels[0].components != wanted.components) damaged("has a grid " + wanted.name + " of another type than the manifest says");
    if (!inside_grid(layer, record.grid.n)) damaged("has a grid " + wanted.name + " with voxels outside the box");
    const auto like = std::find_if(level.layers.begin(), level.layers.end(), [&](const Layer& l) { return same_voxels(l, layer); });
    if (like == level.layers.end()) {
      level.layers.push_back(std::move(layer));
    } else {
      like->channels.push_back(std::move(layer.channels[0]));
    }
    layer.channels.clear();
  }
  return level;
}

SliceStack slice_stack(const fs::path& folder, const StackRecord& r) {
  SliceStack stack{.axis = r.axis, .level = r.level, .count = r.count, .width = r.width, .height = r.height, .thickness = r.thickness, .max_angle = r.max_angle, .image = {}};
  stack.image = [folder, r](int k) {
    const std::string path = (folder / slice_file(r.axis, r.level, r.format, k)).string();
    if (k < 0 || k >= r.count) throw Error(Code::kBadInput, path, "slice is not one of the stack's " + std::to_string(r.count));
    Image image = read_image(path);
    if (image.width != r.width || image.height != r.height || image.channels != 4)
      throw Error(Code::kBadInput, path, "picture is not of the size the manifest says", "bake the pack again");
    return image;
  };
  return stack;
}

}  // namespace

bool inside_grid(const Layer& layer, const V3i& n) {
  return std::all_of(layer.set.blocks.begin(), layer.set.blocks.end(), [&](const Block& b) { return in_range(b.at, n) && inside(b, n); }) &&
         std::all_of(layer.tiles.begin(), layer.tiles.end(), [&](const V3i& t) { return in_range(t, n); });
}

std::string read_manifest(const std::string& folder) {
  const fs::path path = fs::path(folder) / "manifest.json";
  std::error_code ec;
  if (!fs::is_directory(folder, ec)) throw Error(Code::kFile, folder, "there is no pack here");
  if (!fs::is_regular_file(path, ec)) throw Error(Code::kFile, path.string(), "is missing", "the folder is not a texel pack");
  std::ifstream in(path, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in && !in.eof()) throw Error(Code::kFile, path.string(), "cannot be read");
  (void)parse_manifest(text, path.string());
  return text;
}

Pack read_pack(const std::string& folder) {
  const Manifest m = parse_manifest(read_manifest(folder), (fs::path(folder) / "manifest.json").string());
  std::error_code ec;
  const fs::path place = fs::absolute(folder, ec);  // slices are read later, perhaps from another working folder
  Pack pack;
  pack.grid = m.grid;
  pack.cyclic = m.cyclic;
  pack.statistics = m.statistics;
  pack.errors = m.errors;
  pack.cube = m.cube;
  pack.issues = m.issues;
  pack.skipped = m.skipped;
  pack.sources = m.sources;
  pack.recipe_json = m.recipe_json;
  const auto recipe = nlohmann::json::parse(m.recipe_json, nullptr, /*allow_exceptions=*/false);
  pack.density = recipe.is_object() && recipe.contains("hypertexture") && recipe["hypertexture"].is_string();
  pack.levels.resize(m.levels.size());
  tbb::parallel_for(std::size_t{0}, m.levels.size(), [&](std::size_t l) { pack.levels[l] = read_level(place, m.levels[l]); });
  for (const StackRecord& r : m.slices) pack.slices.push_back(slice_stack(place, r));
  if (m.preview) pack.preview = read_image((place / m.preview->file).string());
  return pack;
}

bool pack_up_to_date(const std::string& folder, const Scene& scene, const std::string& recipe_json, std::string* why) {
  const auto no = [&](const std::string& reason) { if (why) *why = reason; return false; };
  try {
    const Manifest m = parse_manifest(read_manifest(folder), folder);
    if (m.generator != generator()) return no("made by " + m.generator);
    const auto recipe = nlohmann::json::parse(recipe_json.empty() ? "{}" : recipe_json, nullptr, /*allow_exceptions=*/false);
    if (!recipe.is_object() || recipe != nlohmann::json::parse(m.recipe_json)) return no("the recipe differs");
    if (m.sources.size() != scene.sources.size()) return no("the list of sources differs");
    if (std::string missing = missing_file(m, folder); !missing.empty()) return no(missing + " is missing or of another size");
    for (std::size_t i = 0; i < m.sources.size(); ++i) {
      const SourceFile& s = scene.sources[i];
      if ((s.sha256.empty() ? file_sha256(s.path) : s.sha256) != m.sources[i].sha256) return no(s.path + " has changed");
    }
    return true;
  } catch (const std::exception& e) {
    return no(e.what());
  }
}

std::string missing_file(const Manifest& m, const fs::path& folder) {
  std::error_code ec;
  const auto size = [&](const std::string& name) {
    const auto bytes = fs::is_regular_file(folder / name, ec) ? fs::file_size(folder / name, ec) : 0;
    return ec ? std::int64_t{-1} : static_cast<std::int64_t>(bytes);
  };
  for (const LevelRecord& l : m.levels)
    if (size(l.file.file) != l.file.bytes) return l.file.file;
  for (const StackRecord& s : m.slices) {
    std::int64_t sum = 0;
    for (int k = 0; k < s.count; ++k) {
      const std::string name = slice_file(s.axis, s.level, s.format, k);
      const std::int64_t bytes = size(name);
      if (bytes <= 0) return name;
      sum += bytes;
    }
    if (sum != s.bytes) return slice_pattern(s.axis, s.level, s.format);
  }
  if (m.preview && size(m.preview->file) != m.preview->bytes) return m.preview->file;
  return {};
}

}  // namespace texel
