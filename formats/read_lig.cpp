// Line trees, the plants of AMAP in the 1990s, of AMAPmod and GreenLab: instances (.lig), table (.dta or .dsp), symbols (.smb).
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>

#include "formats/error.h"
#include "formats/plant_files.h"
#include "formats/readers.h"
#include "formats/triangulate.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

// Numbers out of bytes in either order. The caller checks that they are there.
class Words {
 public:
  Words(std::span<const char> bytes, bool big) : bytes_(bytes), swap_(big == (std::endian::native == std::endian::little)) {}
  [[nodiscard]] std::uint32_t word(std::size_t at) const {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes_.data() + at, 4);
    return swap_ ? __builtin_bswap32(value) : value;
  }
  [[nodiscard]] double real(std::size_t at) const { return std::bit_cast<float>(word(at)); }

 private:
  std::span<const char> bytes_;
  bool swap_;
};

constexpr std::size_t kFaceHead = 8, kCorner = 10, kPoint = 36;

// Whether a symbol's counts, in this order of bytes, lead exactly to the file's end.
bool symbol_fits(std::span<const char> bytes, bool big) {
  if (bytes.size() < 8) return false;
  const Words words(bytes, big);
  const std::size_t faces = words.word(0), points = words.word(4);
  std::size_t at = 8;
  for (std::size_t f = 0; f < faces; ++f) {
    if (bytes.size() - at < kFaceHead) return false;
    const std::size_t corners = words.word(at);
    at += kFaceHead;
    if (corners > (bytes.size() - at) / kCorner) return false;
    at += corners * kCorner;
  }
  return points == (bytes.size() - at) / kPoint && points * kPoint == bytes.size() - at;
}

constexpr std::size_t kHeader = 80, kRecord = 76;
constexpr std::uint32_t kSymbols = 4096;  // numbers below, as AMAP has them

// Records, of the first thousand, that can be so in this order of bytes.
std::size_t good_records(std::span<const char> bytes, bool big) {
  const Words words(bytes, big);
  std::size_t good = 0;
  for (std::size_t at = kHeader; at < std::min(bytes.size(), kHeader + 1000 * kRecord); at += kRecord) {
    bool fits = words.word(at) < kSymbols;
    for (std::size_t i = 0; i < 14; ++i) fits = fits && std::abs(words.real(at + 16 + 4 * i)) < 1e12;
    good += fits;
  }
  return good;
}

std::string small(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

class DtaReader {
 public:
  DtaReader(const Input& input, Report& report) : text_(input), report_(report), path_(input.path) {}

  std::vector<PlantSymbol> read() {
    const double count = number("number of symbols");
    if (!(count >= 0) || count != std::floor(count) || count > static_cast<double>(text_.left())) fail("states an impossible number of symbols");
    text_.next_line();
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      text_.skip_space('\0');
      if (text_.at_end()) fail("ends after " + std::to_string(i) + " of " + std::to_string(static_cast<std::size_t>(count)) + " symbols");
      (void)text_.word();  // its name
      PlantSymbol symbol;
      const double key = number("symbol's number");
      if (!(std::abs(key) < 1e9) || key != std::floor(key)) fail("a symbol's number is not a whole number");
      symbol.number = static_cast<std::int64_t>(key);
      std::string_view file = text_.word();
      if (file.empty()) fail("a symbol has no file");
      file = file.substr(0, file.find("_T_"));
      symbol.file = std::string(file) + (small(file).ends_with(".smb") ? "" : ".smb");
      symbol.material = plain_organ();
      symbol.material.name = "symbol_" + std::to_string(symbol.number);
      by_number_.emplace(key, symbols_.size());
      symbols_.push_back(std::move(symbol));
      text_.next_line();
    }
    blocks();
    return std::move(symbols_);
  }

 private:
  struct Colors {
    double diffuse[3] = {0.8, 0.8, 0.8}, specular[3] = {}, emission[3] = {}, shininess = 0;
  };

  [[noreturn]] void fail(const std::string& message) const { throw Error(Code::kBadInput, text_.where(), message); }

  double number(const char* what) {
    text_.skip_space('\0');
    double value = 0;
    if (!text_.number(value)) {
      if (text_.at_end()) fail(std::string("ends where a ") + what + " is expected");
      fail(std::string(what) + " is not a number (" + shown_as(text_.peek_word()) + ")");
    }
    return value;
  }

  void blocks() {
    PlantSymbol* symbol = nullptr;
    Colors sets[2];
    int set = 0;
    double share = 100;
    const auto close = [&] {
      if (!symbol) return;
      Colors& c = sets[0];
      if (set == 1)
        for (int i = 0; i < 3; ++i) c.diffuse[i] = (c.diffuse[i] * share + sets[1].diffuse[i] * (100 - share)) / 100;
      symbol->material.kd = plant_color(c.diffuse);
      symbol->material.ke = plant_color(c.emission);
      if (c.specular[0] > 0 || c.specular[1] > 0 || c.specular[2] > 0) {
        symbol->material.ks = plant_color(c.specular);
        if (c.shininess >= 0) symbol->material.roughness = static_cast<float>(std::sqrt(2 / (c.shininess + 2)));
      }
    };
    bool diffuse_seen = false;
    for (text_.skip_space('\0'); !text_.at_end(); text_.skip_space('\0')) {
      const std::string key = small(text_.word());
      double* rgb = key == "diffuse" ? sets[set].diffuse : key == "specular" ? sets[set].specular : key == "emission" ? sets[set].emission : ambient_;
      if (key == "symbole") {
        close();
        symbol = find(finite("symbol's number"));
        sets[0] = sets[1] = {};
        set = 0;
        diffuse_seen = false;
      } else if (key == "interpolation") {
        share = finite("share");
      } else if (key == "shininess") {
        sets[set].shininess = finite("shininess");
      } else if (key == "diffuse" || key == "specular" || key == "emission" || key == "ambient") {
        // The keys of a second set begin anew; diffuse, which both have, tells where.
        if (key == "diffuse" && diffuse_seen && set == 0) {
          set = 1;
          rgb = sets[1].diffuse;
        }
        diffuse_seen = diffuse_seen || key == "diffuse";
        for (int i = 0; i < 3; ++i) rgb[i] = finite("colour");
      } else {
        text_.next_line();  // unknown words say nothing of colour
      }
    }
    close();
  }

  double finite(const char* what) {
    const double value = number(what);
    if (!std::isfinite(value)) fail(std::string(what) + " is not finite");
    return value;
  }

  // By its number, else by its place in the table.
  PlantSymbol* find(double key) {
    if (const auto at = by_number_.find(key); at != by_number_.end()) return &symbols_[at->second];
    if (key >= 1 && key <= static_cast<double>(symbols_.size()) && key == std::floor(key)) return &symbols_[static_cast<std::size_t>(key) - 1];
    report_.issue("plant-symbol", "colours of symbols that the table does not have; not used", 1, text_.where());
    return nullptr;
  }

  TextScanner text_;
  Report& report_;
  std::string path_;
  std::vector<PlantSymbol> symbols_;
  std::map<double, std::size_t> by_number_;
  double ambient_[3] = {};
};

// "tree12" -> "tree12", "tree".
std::vector<std::string> stems_of(const std::string& path) {
  const std::string stem = fs::path(path).stem().string();
  std::string bare = stem;
  while (!bare.empty() && is_digit(bare.back())) bare.pop_back();
  std::vector<std::string> stems{stem};
  if (bare != stem && !bare.empty()) stems.push_back(bare);
  return stems;
}

// The folder that `SYMBOLES = FOLDER` names; empty: none.
std::string symbol_folder(const Input& config) {
  TextScanner text(config);
  for (; !text.at_end(); text.next_line()) {
    const std::string line = text.rest_of_line();
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos) continue;
    std::string key = small(line.substr(0, equals)), value = line.substr(equals + 1);
    while (!key.empty() && is_blank(key.back())) key.pop_back();
    value.erase(0, std::min(value.size(), value.find_first_not_of(" \t")));
    if (key == "symboles") return value;
  }
  return {};
}

}  // namespace

PlantMesh read_smb(const Input& input, Report& report) {
  const std::span<const char> bytes = input.bytes;
  const bool big = symbol_fits(bytes, true);
  if (!big && !symbol_fits(bytes, false))
    throw Error(Code::kBadInput, input.path, "is not an AMAP symbol: its counts do not lead to its end of " + std::to_string(bytes.size()) + " bytes in either byte order",
                "symbols older than the line trees of the 1990s have another layout");
  const Words words(bytes, big);
  const std::size_t faces = words.word(0), points = words.word(4), first_point = bytes.size() - points * kPoint;
  PlantMesh mesh;
  for (std::size_t i = 0; i < points; ++i) {
    const std::size_t at = first_point + i * kPoint + 12;
    mesh.points.emplace_back(words.real(at), words.real(at + 4), words.real(at + 8));
  }
  std::vector<std::uint32_t> face;
  std::vector<V3d> corners;
  Triangulator triangulator;
  std::int64_t bad = 0, not_finite = 0, not_simple = 0;
  for (std::size_t f = 0, at = 8; f < faces; ++f) {
    const std::size_t count = words.word(at);
    at += kFaceHead;
    face.clear();
    corners.clear();
    bool good = count >= 3, finite = true;
    for (std::size_t c = 0; c < count; ++c, at += kCorner) {
      const std::uint32_t point = words.word(at + 4);
      if (point >= points) {
        good = false;
        continue;
      }
      const V3d& p = mesh.points[point];
      finite = finite && std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
      face.push_back(point);
      corners.push_back(p);
    }
    bad += !good;
    not_finite += good && !finite;
    if (!good || !finite) continue;
    for (const auto& t : triangulator(corners)) mesh.triangles.push_back({face[t[0]], face[t[1]], face[t[2]]});
    not_simple += triangulator.was_not_simple();
  }
  if (bad) report.issue("bad-index", "faces with fewer than three corners or an index that is no point; left out", bad, input.path);
  if (not_finite) report.issue("non-finite", "faces with a corner that is not a finite number; left out", not_finite, input.path);
  if (not_simple) report.issue("polygon-not-simple", "polygons that cross themselves were cut as fans", not_simple, input.path);
  settle_points(mesh);
  return mesh;
}

std::vector<PlantSymbol> read_dta(const Input& input, Report& report) { return DtaReader(input, report).read(); }

std::vector<PlantSymbol> read_dsp(const Input& input, Report&) {
  std::vector<PlantSymbol> symbols;
  TextScanner text(input);
  for (text.skip_space('#'); !text.at_end(); text.next_line(), text.skip_space('#')) {
    const auto fail = [&](const std::string& message) { throw Error(Code::kBadInput, text.where(), message, "its lines are `organtype NUMBER IS_BRANCH FILE R G B`"); };
    (void)text.word();  // the kind of organ
    double number = 0, branch = 0, rgb[3] = {};
    if (!text.number(number) || !(std::abs(number) < 1e9) || number != std::floor(number)) fail("a symbol's number is not a whole number (" + shown_as(text.peek_word()) + ")");
    if (!text.number(branch)) (void)text.word();
    PlantSymbol symbol;
    symbol.number = static_cast<std::int64_t>(number);
    symbol.file = std::string(text.word());
    if (symbol.file.empty()) fail("a symbol has no file");
    if (!small(symbol.file).ends_with(".smb")) symbol.file += ".smb";
    for (double& v : rgb)
      if (!text.number(v) || !std::isfinite(v)) fail("a colour is not three numbers");
    symbol.material = plain_color("symbol_" + std::to_string(symbol.number), plant_color(rgb));
    symbols.push_back(std::move(symbol));
  }
  return symbols;
}

Plant read_lig(const Input& input, const std::vector<PlantSymbol>& table, const LoadSymbol& load, Report& report) {
  const std::span<const char> bytes = input.bytes;
  if (bytes.size() < kHeader + kRecord || (bytes.size() - kHeader) % kRecord != 0)
    throw Error(Code::kBadInput, input.path, "is not a line tree: " + std::to_string(bytes.size()) + " bytes are no header of 80 and records of 76");
  const std::size_t big_good = good_records(bytes, true), little_good = good_records(bytes, false);
  if (big_good == 0 && little_good == 0) throw Error(Code::kBadInput, input.path, "is not a line tree: in neither byte order do records have a symbol's number and a finite matrix");
  const Words words(bytes, big_good >= little_good);

  Plant plant;
  struct Slot {
    std::uint32_t mesh, material;  // kNoIndex: none
  };
  std::map<std::uint32_t, Slot> slots;
  std::map<std::string, std::uint32_t> loaded;
  std::map<std::int64_t, const PlantSymbol*> symbols;
  for (const PlantSymbol& symbol : table) symbols.emplace(symbol.number, &symbol);
  std::int64_t no_symbol = 0, bad_matrices = 0;
  std::string missing;
  const auto slot_of = [&](std::uint32_t number) {
    const auto at = slots.find(number);
    if (at != slots.end()) return at->second;
    Slot slot{kNoIndex, kNoIndex};
    const auto symbol = number < kSymbols ? symbols.find(number) : symbols.end();
    if (symbol != symbols.end()) {
      const std::string& file = symbol->second->file;
      auto mesh = loaded.find(file);
      if (PlantMesh read; mesh == loaded.end() && load(file, read)) {
        mesh = loaded.emplace(file, static_cast<std::uint32_t>(plant.meshes.size())).first;
        plant.meshes.push_back(std::move(read));
      }
      if (mesh != loaded.end()) {
        slot = {mesh->second, static_cast<std::uint32_t>(plant.materials.size())};
        plant.materials.push_back(symbol->second->material);
      }
    }
    if (slot.mesh == kNoIndex && missing.empty())
      missing = symbol == symbols.end() ? "number " + std::to_string(number) + " is not in the table" : shown_as(symbol->second->file) + " is not there";
    slots.emplace(number, slot);
    return slot;
  };
  for (std::size_t at = kHeader; at < bytes.size(); at += kRecord) {
    PlantOrgan organ;
    bool finite = true;
    for (std::size_t i = 0; i < 12; ++i) {
      organ.matrix.m[i] = words.real(at + 16 + 4 * i);
      finite = finite && std::isfinite(organ.matrix.m[i]);
    }
    if (!finite) {
      ++bad_matrices;
      continue;
    }
    organ.base = words.real(at + 64);
    organ.tip = words.real(at + 68);
    organ.id = static_cast<std::int32_t>(words.word(at + 72));
    const Slot slot = slot_of(words.word(at));
    organ.mesh = slot.mesh;
    organ.material = slot.material;
    if (slot.mesh == kNoIndex) ++no_symbol;
    else if (!plant.meshes[slot.mesh].triangles.empty()) plant.organs.push_back(organ);
    if (report.progress && plant.organs.size() % 65536 == 1) report.progress("read", static_cast<double>(at) / static_cast<double>(bytes.size()));
  }
  if (bad_matrices) report.issue("plant-matrix", "organs whose matrix is not twelve finite numbers; left out", bad_matrices, input.path);
  if (no_symbol) report.issue("plant-symbol", "organs whose symbol " + missing + "; left out", no_symbol, input.path);
  return plant;
}

Plant open_line_tree(const Input& input, std::vector<std::string>& files, Report& report) {
  std::vector<PlantSymbol> table;
  std::string folder, found_table;
  for (const std::string& stem : stems_of(input.path)) {
    for (const char* extension : {".dta", ".dsp"}) {
      if (!found_table.empty()) break;
      const std::string found = find_beside(input.path, stem + extension);
      if (found.empty()) continue;
      found_table = found;
      const FileBytes file(found);
      table = std::string_view(extension) == ".dta" ? read_dta({file.bytes(), found}, report) : read_dsp({file.bytes(), found}, report);
      files.push_back(found);
    }
    if (const std::string config = find_beside(input.path, stem + ".cfg"); folder.empty() && !config.empty()) {
      const FileBytes file(config);
      folder = symbol_folder({file.bytes(), config});
      files.push_back(config);
    }
  }
  if (found_table.empty()) throw Error(Code::kFile, input.path, "has no table of symbols: " + stems_of(input.path).front() + ".dta or .dsp", "put it beside the line tree");
  return read_lig(input, table, [&](const std::string& name, PlantMesh& mesh) {
    std::string found;
    if (!folder.empty()) found = find_beside(input.path, (fs::path(folder) / name).string());
    if (found.empty()) found = find_beside(input.path, name);
    if (found.empty()) return false;
    const FileBytes file(found);
    mesh = read_smb({file.bytes(), found}, report);
    files.push_back(found);
    return true;
  }, report);
}

}  // namespace texel
