#include "formats/write.h"

#include <fcntl.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "formats/error.h"
#include "formats/hash.h"
#include "formats/module.h"
#include "formats/staging.h"
#include "formats/vdb_module.h"
#include "formats/write_parts.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

constexpr float kLargestHalf = 65504;

[[noreturn]] void fail_writing(const std::string& path, bool full, const std::string& why) {
  throw Error(full ? Code::kRunning : Code::kFile, path, "cannot be written (" + why + ")", full ? "free some space" : "");
}

// The target with links resolved, so that a link to a pack stays a link.
fs::path resolved(const std::string& folder) {
  if (folder.empty()) throw Error(Code::kFile, "", "no folder given for the pack");
  std::error_code ec;
  fs::path path = fs::weakly_canonical(fs::absolute(folder, ec), ec);
  if (ec) throw Error(Code::kFile, folder, "is not a place for a pack (" + ec.message() + ")");
  if (path.filename().empty()) path = path.parent_path();
  return path;
}

bool says_pack(const fs::path& manifest) {
  std::ifstream in(manifest, std::ios::binary);
  const auto json = nlohmann::json::parse(in, nullptr, /*allow_exceptions=*/false);
  return json.is_object() && json.contains("format") && json["format"] == "texel-pack";
}

void refuse_strangers(const fs::path& target) {
  std::error_code ec;
  if (fs::is_symlink(target, ec) && !fs::exists(target, ec)) throw Error(Code::kFile, target.string(), "is a link to nothing", "remove it or make what it points to");
  if (!fs::exists(target, ec)) return;
  if (!fs::is_directory(target, ec)) throw Error(Code::kFile, target.string(), "is a file", "give the name of a folder");
  if (fs::is_empty(target, ec) || says_pack(target / "manifest.json")) return;
  throw Error(Code::kFile, target.string(), "is a folder that holds something else than a pack", "choose another name or empty it");
}

// A pack whose arrays do not fit its voxel sets is a mistake of the baker; say so before anything is written.
void check_channels(const Pack& pack) {
  for (const Level& level : pack.levels)
    for (const Layer& layer : level.layers)
      for (const Channel& c : layer.channels) {
        const auto components = static_cast<std::size_t>(c.components);
        if ((c.components == 1 || c.components == 3) && c.values.size() == static_cast<std::size_t>(layer.set.count) * components &&
            c.tiles.size() == layer.tiles.size() * components)
          continue;
        throw Error(Code::kRunning, c.name, "grid has " + std::to_string(c.values.size()) + " values and " + std::to_string(c.tiles.size()) +
                                                " in tiles, which is not what its voxels ask for");
      }
}

bool stored_as_half(const Channel& channel, const WriteOptions& options) {
  if (options.full_float || channel.full_float) return false;
  const auto fits = [](float v) { return std::abs(v) <= kLargestHalf; };
  return std::all_of(channel.values.begin(), channel.values.end(), fits) && std::all_of(channel.tiles.begin(), channel.tiles.end(), fits);
}

// Slices and volumes are written side by side: the bar shows how far the slices are, and whoever writes asks often whether to go on.
class Progress {
 public:
  explicit Progress(const Report& report) : report_(report) {}
  void tell(double share) {
    share_ = share;
    tell();
  }
  void tell() const {
    if (report_.progress) report_.progress("write", share_);
  }

 private:
  const Report& report_;
  std::atomic<double> share_{0};
};

// OpenVDB stamps every file with a random number. In its place goes the hash of everything else.
void replace_uuid(const std::string& path, const Progress& progress) {
  constexpr std::size_t kHead = kVdbUuidOffset + kVdbUuidLength;
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  std::string head(kHead, '\0');
  file.read(head.data(), kHead);
  if (!file) throw Error(Code::kRunning, path, "is shorter than a volume file's header");
  Sha256 sum;
  sum.add(head.data(), kVdbUuidOffset);
  std::vector<char> buffer(std::size_t{1} << 18);
  while (file) {
    file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    sum.add(buffer.data(), static_cast<std::size_t>(file.gcount()));
    progress.tell();
  }
  const std::string hex = sum.hex();
  const std::string uuid = hex.substr(0, 8) + "-" + hex.substr(8, 4) + "-" + hex.substr(12, 4) + "-" + hex.substr(16, 4) + "-" + hex.substr(20, 12);
  file.clear();
  file.seekp(kVdbUuidOffset);
  file.write(uuid.data(), kVdbUuidLength);
  file.close();
  if (!file) fail_writing(path, errno == ENOSPC, std::strerror(errno));
}

LevelRecord write_level(const Level& level, int number, const fs::path& folder, const WriteOptions& options, const Progress& progress) {
  LevelRecord record;
  record.grid = level.grid;
  VdbWriteJob job{.path = (folder / level_file(number)).string(), .level = &level, .number = number, .half = {}, .codec = options.codec, .go_on = {}};
  std::exception_ptr stopped;  // may not pass through the module
  job.go_on = [&] {
    try {
      progress.tell();
    } catch (...) {
      stopped = std::current_exception();
    }
    return !stopped;
  };
  for (const Layer& layer : level.layers)
    for (const Channel& c : layer.channels) {
      const std::int64_t active = layer.set.count + 512 * static_cast<std::int64_t>(layer.tiles.size());
      record.grids.push_back({c.name, c.components, stored_as_half(c, options), active});
      job.half.push_back(record.grids.back().half);
    }
  const VdbFunctions& vdb = vdb_functions();
  tbb::task_group counting;  // beside the last, largest grid's compression, which one thread does
  counting.run([&] { record.active = active_voxels(level); });
  bool full = false;
  const std::string why = vdb.write(job, &full);
  counting.wait();
  if (stopped) std::rethrow_exception(stopped);
  if (!why.empty()) fail_writing(job.path, full, why);
  replace_uuid(job.path, progress);
  record.file = record_file(folder, level_file(number));
  return record;
}

// One line for all of them, however many slices.
void report_clipped(const PixelCount& pixels, Report& report) {
  if (pixels.clipped == 0) return;
  const double share = 100.0 * static_cast<double>(pixels.clipped) / static_cast<double>(pixels.seen);
  char text[16];
  std::snprintf(text, sizeof text, share < 0.01 ? "below %.2f" : "%.3g", std::max(share, 0.01));
  report.issue("slices-clipped", std::string(text) + " % of the slices' pixels are brighter than PNG can hold and were stored as 1; use --slice-format exr or less --light", pixels.clipped);
}

// Relative where pack and source share more than the root: a way up to the root and down again would be an absolute path in disguise.
std::string source_path(const std::string& source, const fs::path& target) {
  std::error_code ec;
  const fs::path path = fs::weakly_canonical(fs::absolute(source, ec), ec);
  const fs::path relative = path.lexically_relative(target);
  const fs::path from_root = path.relative_path(), target_from_root = target.relative_path();  // without the leading "/"
  const bool shared = !from_root.empty() && !target_from_root.empty() && *from_root.begin() == *target_from_root.begin();
  return ec || relative.empty() || !shared ? fs::path(source).filename().generic_string() : relative.generic_string();
}

std::vector<SourceFile> hashed_sources(const std::vector<SourceFile>& sources, const fs::path& target, const Progress& progress) {
  std::vector<SourceFile> result = sources;
  tbb::parallel_for(std::size_t{0}, result.size(), [&](std::size_t i) {
    SourceFile& s = result[i];
    if (s.sha256.empty()) s.sha256 = file_sha256(s.path, &s.bytes);
    s.path = source_path(s.path, target);
    progress.tell();
  });
  return result;
}

// Only told, not kept: where a pack lies is no property of it.
void report_bare_names(const std::vector<SourceFile>& read, const std::vector<SourceFile>& kept, Report& report) {
  for (std::size_t i = 0; i < read.size(); ++i) {
    if (kept[i].path.find('/') != std::string::npos) continue;
    report.skip("the way from the pack to " + read[i].path,
                "they share no folder but the root, so the pack keeps the name alone; name the mesh again for view --truth and --recipe");
    return;  // one stands for all: what a mesh names lies beside it
  }
}

void write_synced(const std::string& path, const std::string& text) {
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) fail_writing(path, errno == ENOSPC, std::strerror(errno));
  std::size_t done = 0;
  int cause = 0;
  while (done < text.size() && !cause) {
    const ssize_t put = ::write(fd, text.data() + done, text.size() - done);
    if (put >= 0) done += static_cast<std::size_t>(put);
    else if (errno != EINTR) cause = errno;
  }
  if (!cause && fsync(fd) != 0 && errno != EINVAL) cause = errno;
  if (close(fd) != 0 && !cause) cause = errno;
  if (cause) fail_writing(path, cause == ENOSPC || cause == EDQUOT || cause == EFBIG, std::strerror(cause));
}

void write_parts(const Pack& pack, const fs::path& target, const StagingFolder& staging, const WriteOptions& options, Report& report) {
  Manifest m;
  m.generator = generator();
  m.recipe_json = pack.recipe_json;
  m.grid = pack.grid;
  m.cyclic = pack.cyclic;
  m.statistics = pack.statistics;
  m.errors = pack.errors;
  m.cube = pack.cube;
  const bool volume = std::any_of(pack.levels.begin(), pack.levels.end(), [](const Level& level) {
    return std::any_of(level.layers.begin(), level.layers.end(), [](const Layer& layer) { return !layer.channels.empty(); });
  });
  if (volume) m.levels.resize(pack.levels.size());
  PixelCount pixels;
  Progress progress(report);
  Report slices;
  slices.progress = [&progress](const std::string&, double share) { progress.tell(share); };
  // Compressing a volume keeps one thread busy; the slices take the others.
  tbb::task_group group;
  for (std::size_t l = 0; l < m.levels.size(); ++l)
    group.run([&, l] { m.levels[l] = write_level(pack.levels[l], static_cast<int>(l), staging.path(), options, progress); });
  group.run([&] { m.slices = write_slices(pack.slices, staging.path(), options.slice_format, slices, &pixels); });
  group.run([&] { m.sources = hashed_sources(pack.sources, target, progress); });
  group.wait();
  Report found;  // goes into the manifest too
  report_clipped(pixels, found);
  m.issues = pack.issues;
  m.issues.insert(m.issues.end(), found.issues.begin(), found.issues.end());
  m.skipped = pack.skipped;
  for (const Issue& issue : found.issues) report.issue(issue.id, issue.text, issue.count, issue.where);
  report_bare_names(pack.sources, m.sources, report);
  if (!pack.preview.empty()) {
    write_png(pack.preview, staging.file("preview.png"));
    m.preview = record_file(staging.path(), "preview.png");
  }
  write_synced(staging.file("manifest.json"), manifest_text(m));
  progress.tell(1);  // the last moment at which nothing is changed yet
}

}  // namespace

FileRecord record_file(const fs::path& folder, const std::string& name) {
  FileRecord record{.file = name, .sha256 = {}};
  record.sha256 = file_sha256((folder / name).string(), &record.bytes);
  return record;
}

std::int64_t active_voxels(const Level& level) {
  // Block coordinates (z, y, x) -> union of the masks.
  std::map<std::tuple<int, int, int>, std::array<std::uint64_t, 8>> blocks;
  for (const Layer& layer : level.layers) {
    if (layer.channels.empty()) continue;
    for (const Block& b : layer.set.blocks) {
      auto& mask = blocks[{b.at.z, b.at.y, b.at.x}];
      for (std::size_t w = 0; w < 8; ++w) mask[w] |= b.mask[w];
    }
    for (const V3i& t : layer.tiles) blocks[{t.z, t.y, t.x}].fill(~std::uint64_t{0});
  }
  std::int64_t count = 0;
  for (const auto& entry : blocks)
    count += count_voxels(entry.second);
  return count;
}

void write_pack(const Pack& pack, const std::string& folder, const WriteOptions& options, Report& report) {
  const StageTimer timer(report, "write");
  const fs::path target = resolved(folder);
  refuse_strangers(target);
  check_channels(pack);
  StagingFolder staging(target);
  tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
  arena.execute([&] { write_parts(pack, target, staging, options, report); });
  staging.commit();
}

void require_place(const std::string& folder) {
  const fs::path target = resolved(folder);
  refuse_strangers(target);
  std::error_code ec;
  fs::path there = target.parent_path();
  while (!fs::exists(there, ec) && there.has_relative_path()) there = there.parent_path();
  if (!fs::is_directory(there, ec)) throw Error(Code::kFile, target.string(), "cannot be made (" + there.string() + " is no folder)", "choose another place");
  if (access(there.c_str(), W_OK | X_OK) != 0) throw Error(Code::kFile, target.string(), std::string("cannot be written (") + std::strerror(errno) + ")", "choose another place");
}

void require_slice_writer(SliceFormat format) {
  if (format == SliceFormat::kExr) require_module("texel_image");
}

std::future<void> open_volume_writer() {
  require_module("texel_vdb");
  // While the linker opens a library no other can be opened and no thread begun. TBB does both when it is first used, and would wait until this one is open.
  tbb::parallel_for(0, 2 * tbb::this_task_arena::max_concurrency(), [](int) {}, tbb::simple_partitioner());
  return std::async(std::launch::async, [] {
    try {
      (void)module_symbol("texel_vdb", kVdbSymbol);
    } catch (const Error&) {  // it is there but cannot be loaded: write_pack will say why
    }
  });
}

}  // namespace texel
