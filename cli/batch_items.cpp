#include "cli/batch_items.h"

#include <glob.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "formats/error.h"
#include "formats/text_scanner.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

// Without pictures, which in folders of models are textures, and without .json, of which only scenes are taken.
constexpr const char* kTaken[] = {".obj", ".ply", ".stl", ".off", ".gltf", ".glb", ".opf", ".gwa", ".ops", ".lig", ".vdb", ".df3", ".mhd", ".mha", ".inr", ".inr.gz", ".hair"};

std::string small(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool is_taken(const fs::path& path) {
  const std::string name = small(path.filename().string());
  return std::any_of(std::begin(kTaken), std::end(kTaken), [&](const char* end) { return name.ends_with(end); });
}

bool is_json(const fs::path& path) { return small(path.extension().string()) == ".json"; }

// Whether a file of a folder is a scene; of .json files only those that say so with their first word are looked at.
bool is_scene(const fs::path& path) {
  try {
    return is_json(path) && is_scene_file(FileBytes(path.string()).bytes(), true);
  } catch (const Error&) {
    return false;
  }
}

// Found files and the folder, below the output, where each one's pack goes.
class Collector {
 public:
  void add(const std::string& word) {
    std::error_code ec;
    if (fs::is_directory(word, ec)) add_folder(word);
    else if (small(fs::path(word).extension().string()) == ".txt") add_list(word);
    else if (!fs::exists(word, ec) && word.find_first_of("*?[") != std::string::npos) add_pattern(word);
    else add_file(word, "");
  }

  [[nodiscard]] std::vector<BatchItem> items(const std::string& output) const {
    std::map<std::string, int> packs;
    for (const Found& found : found_) ++packs[pack_of(found, false)];
    std::vector<BatchItem> all;
    for (const Found& found : found_) {
      const bool alone = packs[pack_of(found, false)] == 1;
      all.push_back({found.file, (fs::path(output) / pack_of(found, !alone)).string(), found.texel.name, found.texel.recipes});
    }
    return all;
  }

 private:
  struct Found {
    std::string file, place;
    SceneTexel texel;
  };

  static std::string pack_of(const Found& found, bool whole_name) {
    const auto& [file, place, texel] = found;
    fs::path name = fs::path(file).filename();
    if (!texel.name.empty()) return (fs::path(place) / (whole_name ? name.string() + "." + texel.name : texel.name)).string() + ".texel";
    if (!whole_name && small(name.string()).ends_with(".inr.gz")) name = name.stem();
    return (fs::path(place) / (whole_name ? name : name.stem())).string() + ".texel";
  }

  void add_file(const std::string& file, const std::string& place) {
    std::error_code ec;
    const fs::path real = fs::weakly_canonical(file, ec);
    if (!seen_.insert(ec ? file : real.string()).second) return;
    for (const SceneTexel& texel : texels_of(file)) found_.push_back({file, place, texel});
  }

  // One without a name for all that is no scene. A scene that cannot be read is an item that says so.
  static std::vector<SceneTexel> texels_of(const std::string& file) {
    std::vector<SceneTexel> texels;
    std::error_code ec;
    try {
      if (is_json(file) && fs::is_regular_file(file, ec)) texels = list_texels(file);
    } catch (const Error&) {
    }
    return texels.empty() ? std::vector<SceneTexel>(1) : texels;
  }

  void add_folder(const std::string& folder) {
    std::vector<fs::path> files;
    std::error_code ec;
    fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, ec), end;
    if (ec) throw Error(Code::kFile, folder, "cannot be read (" + ec.message() + ")", "check its permissions");
    for (; at != end; at.increment(ec)) {
      if (ec) throw Error(Code::kFile, folder, "cannot be read (" + ec.message() + ")", "check its permissions");
      const bool hidden = at->path().filename().string().starts_with(".");
      if (at->is_directory(ec)) {
        if (hidden || fs::exists(at->path() / "manifest.json", ec)) at.disable_recursion_pending();
      } else if (!hidden && at->is_regular_file(ec) && (is_taken(at->path()) || is_scene(at->path()))) {
        files.push_back(at->path());
      }
    }
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) add_file(file.string(), file.lexically_relative(folder).parent_path().string());
  }

  void add_list(const std::string& list) {
    std::ifstream in(list);
    if (!in) throw Error(Code::kFile, list, "cannot be read", "name a list of files, one a line");
    if (++depth_ > 16) throw Error(Code::kBadInput, list, "lists name lists 16 deep", "a list may not name itself");
    for (std::string line; std::getline(in, line);) {
      while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back()))) line.pop_back();
      line.erase(0, line.find_first_not_of(" \t"));
      if (line.empty() || line[0] == '#') continue;
      add(fs::path(line).is_absolute() ? line : (fs::path(list).parent_path() / line).string());
    }
    --depth_;
  }

  void add_pattern(const std::string& pattern) {
    glob_t matches{};
    const int status = glob(pattern.c_str(), 0, nullptr, &matches);
    std::vector<std::string> names;
    for (std::size_t i = 0; status == 0 && i < matches.gl_pathc; ++i) names.emplace_back(matches.gl_pathv[i]);
    globfree(&matches);
    if (names.empty()) throw Error(Code::kCommandLine, pattern, "fits no file", "check the pattern");
    for (const std::string& name : names) {
      std::error_code ec;
      if (fs::is_directory(name, ec)) add_folder(name);
      else add_file(name, "");
    }
  }

  std::vector<Found> found_;
  std::set<std::string> seen_;
  int depth_ = 0;
};

}  // namespace

std::vector<BatchItem> batch_items(const std::vector<std::string>& given, const std::string& output) {
  Collector collector;
  for (const std::string& word : given) collector.add(word);
  return collector.items(output);
}

}  // namespace texel
