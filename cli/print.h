#pragma once
// Report -> text or JSON; the progress bar. Talk goes to stderr, products to stdout.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "cli/options.h"
#include "formats/pack.h"
#include "formats/report.h"

namespace texel {

// `texel: error: TEXT` on one line, whatever TEXT holds.
void print_error(const std::string& text);
// One line per issue: `texel: warning: [id] TEXT (N times, first: WHERE)`.
void print_warnings(const std::vector<Issue>& issues);
// Times, counts and what was skipped, for -v.
void print_stages(const Report& report);
void print_talk(const std::string& line);  // `texel: LINE`

// Throws Error{kRunning} where the text cannot be written (disk full, closed).
void print_product(const std::string& text);
// Throws Error{kFile} where no such file could be written: before the work, not after it. Makes nothing.
void require_file_place(const std::string& path);
// Throws Error{kFile}, Error{kRunning} (disk full).
void write_text_file(const std::string& path, const std::string& text);

// What --report writes. `status`: "baked", "up to date", "planned" or "failed". `pack` may be null.
[[nodiscard]] std::string report_json(const std::string& status, const Report& report, const Pack* pack, double seconds, const std::string& message);

[[nodiscard]] std::string grouped(std::int64_t number);  // 1 234 567
[[nodiscard]] std::string seconds_text(double seconds);  // 0.25 s, 12.3 s, 4 min 05 s
[[nodiscard]] double peak_bytes();                      // most memory the process has held so far
[[nodiscard]] std::string bytes_text(double bytes);      // 1.2 MiB

// The bar on stderr; takes it away when destroyed. `update` may be called from several threads at once.
class ProgressBar {
 public:
  explicit ProgressBar(Progress when);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void update(const std::string& stage, double done);
  void clear();  // before other talk

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace texel
