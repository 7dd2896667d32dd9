// texel batch: many packs in one process.
#include <tbb/global_control.h>

#include <atomic>
#include <filesystem>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <thread>

#include "cli/bake_one.h"
#include "cli/batch_items.h"
#include "cli/batch_report.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/print.h"
#include "cli/recipe_file.h"
#include "cli/scene_settings.h"
#include "formats/error.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

constexpr int kMostJobs = 4;           // by default: each has the memory of a bake

std::string manifest_of(const std::string& pack) { return (fs::path(pack) / "manifest.json").string(); }

// One item from file to pack; whatever goes wrong is its result. `progress`: the share of it that is done.
BatchResult bake_item(const Settings& settings, const BatchItem& item, const std::function<void(double)>& progress) {
  BatchResult result;
  result.input = item.input;
  result.output = item.output;
  result.status = "failed";
  result.texel = item.texel;
  Report report;
  // Which stage an item is in nobody sees: half done once it is planned, as reading is about half of the time of most.
  report.progress = [&](const std::string& stage, double done) {
    stop_if_interrupted();
    progress(stage == "write" ? 0.9 + 0.1 * done : stage == "crossings" ? 0.5 + 0.4 * done : 0.4);
  };
  const double start = now_seconds();
  const auto failed = [&](Code code, const std::string& message) {
    result.code = static_cast<int>(code);
    result.message = message;
  };
  try {
    Settings own = item.recipes.empty() ? settings : parse_options(kBatch, settings.words, nullptr, beneath_all(item.recipes, item.input));
    own.inputs = {item.input};
    own.output = item.output;
    own.report_file.clear();
    own.recipe.threads = 0;            // the batch's own limit holds for all
    own.recipe.texel = item.texel;
    Outcome outcome;
    bake_pack(own, report, outcome);
    result.status = outcome.status;
    if (outcome.pack) {
      const V3i& n = outcome.pack->grid.n;
      result.resolution = std::to_string(n.x) + " x " + std::to_string(n.y) + " x " + std::to_string(n.z);
    }
    for (const SourceFile& source : outcome.sources) result.files.push_back(stamp_of(source.path));
    for (FileStamp& own_file : stamps_of_pack(item.output)) result.files.push_back(std::move(own_file));
  } catch (const Error& error) {
    if (interrupted()) result.status = "not begun";
    // A scene that cannot be baked, or an option that does not suit it, names no file by itself.
    const bool named = !error.where.empty() && !error.where.starts_with("--");
    failed(error.code, named ? error.what() : item.input + ": " + error.what());
  } catch (const std::bad_alloc&) {
    failed(Code::kRunning, item.input + ": out of memory; lower the resolution or --jobs");
  } catch (const std::length_error&) {  // a container asked for more than there can be
    failed(Code::kRunning, item.input + ": out of memory; lower the resolution or --jobs");
  } catch (const std::exception& error) {
    failed(Code::kRunning, item.input + ": unexpected: " + error.what() + "; please report this");
  }
  result.issues = report.issues;
  result.seconds = now_seconds() - start;
  return result;
}

}  // namespace

int command_batch(const Settings& settings) {
  if (settings.inputs.empty()) throw Error(Code::kCommandLine, "FILE|FOLDER|LIST", "missing", "name what is to be baked");
  if (settings.output.empty()) throw Error(Code::kCommandLine, "--output", "missing", "name the folder for the packs, e.g. -o packs");
  std::error_code ec;
  if (fs::exists(manifest_of(settings.output), ec)) throw Error(Code::kCommandLine, "--output " + settings.output, "is a pack", "name a folder to hold packs");
  const std::vector<BatchItem> items = batch_items(settings.inputs, settings.output);
  if (items.empty()) throw Error(Code::kBadInput, settings.inputs.front(), "holds no file that can be baked", "name files, or a folder with .obj, .gltf, .glb, .ply, .stl, .off, plants or volumes");
  fs::create_directories(settings.output, ec);
  if (ec) throw Error(Code::kFile, settings.output, "cannot be made (" + ec.message() + ")", "check the folder above it");
  const std::string report_file = settings.report_file.empty() ? (fs::path(settings.output) / "batch-report.json").string() : settings.report_file;
  require_file_place(report_file);

  std::optional<tbb::global_control> limit;
  const int threads = settings.recipe.threads > 0 ? settings.recipe.threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  const int jobs = std::min<int>(settings.jobs > 0 ? settings.jobs : std::min(threads, kMostJobs), static_cast<int>(items.size()));
  keep_freed_memory(jobs == 1);

  const std::string recipe = recipe_json(settings);
  const auto earlier = settings.force ? std::map<std::string, BatchResult>{} : read_batch_report(report_file, recipe);
  const double start = now_seconds();
  std::vector<BatchResult> results(items.size());
  std::atomic<std::size_t> next{0}, ended{0};
  std::mutex talk;
  ProgressBar bar(settings.progress);
  const auto work = [&] {
    for (std::size_t i = next++; i < items.size(); i = next++) {
      BatchResult& result = results[i];
      if (interrupted()) {
        result.input = items[i].input;
        result.texel = items[i].texel;
        result.output = items[i].output;
        result.status = "not begun";
        continue;
      }
      const auto progress = [&](double done) {
        // Time left goes by items: the stage's name stays, or the bar would start anew with each.
        bar.update("batch of " + std::to_string(items.size()), (static_cast<double>(ended) + done / 2) / static_cast<double>(items.size()));
      };
      if (const auto before = earlier.find(items[i].output); before != earlier.end() && untouched_since(before->second, items[i].input)) {
        result = before->second;
        result.status = "up to date";
        result.seconds = 0;
      } else {
        result = bake_item(settings, items[i], progress);
        // A pack found up to date keeps what the run that baked it had to say.
        if (result.status == "up to date" && before != earlier.end()) {
          result.resolution = before->second.resolution;
          if (result.issues.empty()) result.issues = before->second.issues;
        }
      }
      ++ended;
      progress(0);
      if (result.status == "failed") {
        const std::lock_guard lock(talk);
        bar.clear();
        print_error(result.message);
      }
    }
  };
  std::vector<std::thread> others;
  for (int j = 1; j < jobs; ++j) others.emplace_back(work);
  work();
  for (std::thread& other : others) other.join();
  bar.clear();

  const double seconds = now_seconds() - start;
  write_text_file(report_file, batch_report_json(results, recipe, seconds));
  print_product(batch_table(results));
  std::size_t baked = 0, fresh = 0, failed = 0;
  for (const BatchResult& r : results) {
    baked += r.status == "baked";
    fresh += r.status == "up to date";
    failed += r.status == "failed";
  }
  const auto part = [](std::size_t n, const char* what) { return n > 0 ? ", " + std::to_string(n) + " " + what : std::string(); };
  print_talk(std::to_string(items.size()) + (items.size() == 1 ? " item: " : " items: ") + std::to_string(baked) + " baked" + part(fresh, "up to date") + part(failed, "failed") +
             part(items.size() - baked - fresh - failed, "not begun") + ", " + seconds_text(seconds) + "; " + report_file);
  if (interrupted()) throw Error(Code::kRunning, "", "interrupted", "the same command goes on where it was");
  constexpr int kSomeFailed = 6;
  return failed > 0 ? kSomeFailed : 0;
}

}  // namespace texel
