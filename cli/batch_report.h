#pragma once
// What a batch has done: batch-report.json, from which the next run learns what it need not look at again
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// A file as it was: enough to see that it has not been touched since.
struct FileStamp {
  std::string path;
  std::int64_t bytes = -1;             // −1: not there; of a folder 0: its time tells of files that came or went
  std::int64_t modified = 0;           // nanoseconds of the file clock
  bool operator==(const FileStamp&) const = default;
};
[[nodiscard]] FileStamp stamp_of(const std::string& path);
// A pack's own: its manifest, volumes and preview, and its folders.
[[nodiscard]] std::vector<FileStamp> stamps_of_pack(const std::string& pack);

struct BatchResult {
  std::string input, output;
  std::string texel;                   // of a scene file; may be empty
  std::string status;                  // "baked", "up to date", "failed", "not begun"
  int code = 0;                        // exit status `texel bake` would have ended with
  std::string message;                 // of a failure
  double seconds = 0;
  std::string resolution;              // "128 x 96 x 128"
  std::vector<Issue> issues;
  std::vector<FileStamp> files;        // every file read, and the pack's own
};

// The items of an earlier run of this version with the same recipe (recipe_file.h), by their packs; empty where there is none.
[[nodiscard]] std::map<std::string, BatchResult> read_batch_report(const std::string& path, const std::string& recipe);
[[nodiscard]] std::string batch_report_json(const std::vector<BatchResult>& results, const std::string& recipe, double seconds);
// The table for people: one line an item, what failed last.
[[nodiscard]] std::string batch_table(const std::vector<BatchResult>& results);

// Whether the pack was made and neither a file read for it nor the pack has been touched since. Where a file was missing (it may be there by now)
// the answer is no, and bake_pack looks for itself.
[[nodiscard]] bool untouched_since(const BatchResult& earlier, const std::string& input);

}  // namespace texel
