#include "cli/print.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <string>
#include <fstream>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>

#include "formats/error.h"

namespace texel {
namespace {

using Json = nlohmann::ordered_json;

bool colored() {
  const char* no_color = std::getenv("NO_COLOR");
  return isatty(STDERR_FILENO) && !(no_color && no_color[0]);
}

// Control characters from file names and inputs would break the one line or steer the terminal.
std::string one_line(const std::string& text) {
  std::string out;
  for (const char c : text) out += static_cast<unsigned char>(c) < 32 || c == 127 ? '?' : c;
  return out;
}

void print_labelled(const char* label, const char* color, const std::string& text) {
  const bool paint = colored() && color[0];
  std::fprintf(stderr, "texel: %s%s%s%s\n", paint ? color : "", label, paint ? "\033[0m" : "", one_line(text).c_str());
}

// Closing is what tells of a full disk.
void finish(std::FILE* file, bool good, const std::string& where) {
  const bool written = good && std::fflush(file) == 0 && !std::ferror(file);
  const int cause = errno;
  if (written) return;
  throw Error(cause == ENOSPC || where.empty() ? Code::kRunning : Code::kFile, where.empty() ? "standard output" : where,
              std::string("cannot be written (") + std::strerror(cause) + ")");
}

// Figures travel as doubles; most of them count things.
bool is_count(double value) { return value == std::floor(value) && std::abs(value) < 0x1p53; }

std::string format(const char* pattern, double value) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, pattern, value);
  return buffer;
}

}  // namespace

// Of this program alone: what getrusage says survives exec, and begins with the parent's.
double peak_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::strtod(line.c_str() + 6, nullptr) * 1024;
  return 0;
}

void print_error(const std::string& text) { print_labelled("error: ", "\033[1;31m", text); }
void print_talk(const std::string& line) { print_labelled("", "", line); }

void print_warnings(const std::vector<Issue>& issues) {
  for (const Issue& issue : issues) {
    std::string tail;
    if (issue.count > 1) tail = grouped(issue.count) + " times";
    if (!issue.where.empty()) tail += (tail.empty() ? "" : ", ") + std::string(issue.count > 1 ? "first: " : "at ") + issue.where;
    print_labelled("warning: ", "\033[1;33m", "[" + issue.id + "] " + issue.text + (tail.empty() ? "" : " (" + tail + ")"));
  }
}

void print_stages(const Report& report) {
  for (const StageTime& time : report.times) {
    char line[256];
    std::snprintf(line, sizeof line, "%-24s %9.3f s %9.3f s cpu", time.stage.c_str(), time.seconds, time.cpu_seconds);
    print_talk(line);
  }
  for (const auto& [what, value] : report.counts)
    print_talk(what + ": " + (is_count(value) ? grouped(static_cast<std::int64_t>(value)) : number_text(value)));
  for (const Skip& skip : report.skipped) print_talk("skipped " + skip.what + ": " + skip.why);
  print_talk("peak memory: " + bytes_text(peak_bytes()));
}

void print_product(const std::string& text) {
  const bool good = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  finish(stdout, good, "");
}

void require_file_place(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ec;
  const fs::path folder = fs::path(path).has_parent_path() ? fs::path(path).parent_path() : fs::path(".");
  if (fs::is_directory(path, ec)) throw Error(Code::kFile, path, "is a folder", "give the name of a file");
  if (!fs::is_directory(folder, ec)) throw Error(Code::kFile, path, "cannot be written (there is no folder " + folder.string() + ")", "make it first");
  if (access(fs::exists(path, ec) ? path.c_str() : folder.c_str(), W_OK) != 0)
    throw Error(Code::kFile, path, std::string("cannot be written (") + std::strerror(errno) + ")", "check the folder and its permissions");
}

void write_text_file(const std::string& path, const std::string& text) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file) throw Error(Code::kFile, path, std::string("cannot be written (") + std::strerror(errno) + ")", "check the folder and its permissions");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> closer(file, &std::fclose);
  const bool good = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  finish(file, good, path);
}

std::string report_json(const std::string& status, const Report& report, const Pack* pack, double seconds, const std::string& message) {
  Json j;
  j["format"] = "texel-report";
  j["generator"] = std::string("texel ") + TEXEL_VERSION;
  j["status"] = status;
  if (!message.empty()) j["message"] = message;
  j["seconds"] = seconds;
  j["peak_memory"] = static_cast<std::int64_t>(peak_bytes());
  j["times"] = Json::array();
  for (const StageTime& t : report.times) j["times"].push_back({{"stage", t.stage}, {"seconds", t.seconds}, {"cpu_seconds", t.cpu_seconds}});
  j["counts"] = Json::object();
  for (const auto& [what, value] : report.counts) {
    if (is_count(value)) j["counts"][what] = static_cast<std::int64_t>(value);
    else j["counts"][what] = value;
  }
  j["skipped"] = Json::array();
  for (const Skip& s : report.skipped) j["skipped"].push_back({{"what", s.what}, {"why", s.why}});
  j["issues"] = Json::array();
  for (const Issue& i : report.issues) j["issues"].push_back({{"id", i.id}, {"text", i.text}, {"count", i.count}, {"where", i.where}});
  j["errors"] = Json::object();
  if (pack)
    for (const ErrorFigure& e : pack->errors) j["errors"][e.measure] = {{"value", e.value}, {"how", e.how}};
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string grouped(std::int64_t number) {
  std::string digits = std::to_string(number);
  for (std::ptrdiff_t at = std::ssize(digits) - 3; at > (number < 0 ? 1 : 0); at -= 3) digits.insert(static_cast<std::size_t>(at), " ");
  return digits;
}

std::string seconds_text(double seconds) {
  if (seconds < 10) return format("%.2f s", seconds);
  if (seconds < 120) return format("%.1f s", seconds);
  return format("%.0f min ", std::floor(seconds / 60)) + format("%02.0f s", std::floor(std::fmod(seconds, 60)));
}

std::string bytes_text(double bytes) {
  const char* const units[] = {"%.0f B", "%.1f KiB", "%.1f MiB", "%.1f GiB", "%.1f TiB"};
  std::size_t unit = 0;
  while (bytes >= 1024 && unit + 1 < std::size(units)) {
    bytes /= 1024;
    ++unit;
  }
  return format(units[unit], bytes);
}

struct ProgressBar::Impl {
  using Clock = std::chrono::steady_clock;
  std::mutex mutex;
  bool on = false, always = false, shown = false;
  Clock::time_point start = Clock::now(), stage_start = start, drawn{};
  std::string stage;

  void clear() {
    if (shown) std::fputs("\r\033[K", stderr);
    shown = false;
  }
};

ProgressBar::ProgressBar(Progress when) : impl_(std::make_unique<Impl>()) {
  impl_->always = when == Progress::kAlways;
  impl_->on = impl_->always || (when == Progress::kAuto && isatty(STDERR_FILENO));
}

ProgressBar::~ProgressBar() { clear(); }

void ProgressBar::clear() {
  const std::lock_guard lock(impl_->mutex);
  impl_->clear();
}

void ProgressBar::update(const std::string& stage, double done) {
  Impl& bar = *impl_;
  if (!bar.on) return;
  const std::unique_lock lock(bar.mutex, std::try_to_lock);
  if (!lock) return;  // another thread is drawing
  const auto now = Impl::Clock::now();
  const auto since = [&](Impl::Clock::time_point t) { return std::chrono::duration<double>(now - t).count(); };
  const bool fresh = stage != bar.stage;
  if (fresh) {
    bar.stage = stage;
    bar.stage_start = now;
  }
  constexpr double kPatience = 2, kRedraw = 0.1;  // seconds
  if (!bar.always && since(bar.start) < kPatience) return;
  if (!fresh && since(bar.drawn) < kRedraw) return;
  done = std::clamp(done, 0.0, 1.0);
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(std::lround(done * kWidth));
  std::string line = "[" + std::string(static_cast<std::size_t>(filled), '#') + std::string(static_cast<std::size_t>(kWidth - filled), '.') + "]" +
                     format(" %3.0f%% ", 100 * done) + stage;
  const double spent = since(bar.stage_start);
  if (done > 0.02 && spent > 0.5) line += ", " + seconds_text(spent * (1 - done) / done) + " left";
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
  bar.shown = true;
  bar.drawn = now;
}

}  // namespace texel
