#include "cli/batch_report.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/print.h"

namespace texel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

FileStamp stamp_in(const Json& j) { return {j.at("path").get<std::string>(), j.at("bytes").get<std::int64_t>(), j.at("modified").get<std::int64_t>()}; }

std::string padded(const std::string& text, std::size_t width) {
  // Letters of more than one byte count once.
  const auto letters = static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
  return text + std::string(letters < width ? width - letters : 0, ' ');
}

std::string generator() { return std::string("texel ") + TEXEL_VERSION; }

}  // namespace

FileStamp stamp_of(const std::string& path) {
  std::error_code ec;
  const auto bytes = fs::is_directory(path, ec) ? 0 : fs::file_size(path, ec);
  if (ec) return {path, -1, 0};
  const auto modified = fs::last_write_time(path, ec);
  if (ec) return {path, -1, 0};
  return {path, static_cast<std::int64_t>(bytes), std::chrono::duration_cast<std::chrono::nanoseconds>(modified.time_since_epoch()).count()};
}

std::vector<FileStamp> stamps_of_pack(const std::string& pack) {
  std::vector<std::string> names;
  std::error_code ec;
  for (fs::recursive_directory_iterator at(pack, ec), end; !ec && at != end; at.increment(ec))
    if (at.depth() == 0 || at->is_directory(ec)) names.push_back(at->path().string());
  std::sort(names.begin(), names.end());
  std::vector<FileStamp> stamps;
  for (const std::string& name : names) stamps.push_back(stamp_of(name));
  return stamps;
}

std::map<std::string, BatchResult> read_batch_report(const std::string& path, const std::string& recipe) {
  std::map<std::string, BatchResult> all;
  std::ifstream in(path, std::ios::binary);
  if (!in) return all;
  try {
    const Json report = Json::parse(in);
    if (report.at("format") != "texel-batch" || report.at("generator") != generator() || report.at("recipe") != Json::parse(recipe)) return all;
    for (const Json& j : report.at("items")) {
      BatchResult r;
      r.input = j.at("input").get<std::string>();
      r.output = j.at("pack").get<std::string>();
      if (j.contains("texel")) r.texel = j.at("texel").get<std::string>();
      r.status = j.at("status").get<std::string>();
      r.resolution = j.at("resolution").get<std::string>();
      for (const Json& f : j.at("files")) r.files.push_back(stamp_in(f));
      for (const Json& i : j.at("issues")) r.issues.push_back({i.at("id").get<std::string>(), i.at("text").get<std::string>(), i.at("count").get<std::int64_t>(), i.at("where").get<std::string>()});
      all[r.output] = std::move(r);
    }
  } catch (const nlohmann::json::exception&) {
    all.clear();  // a report that cannot be read says nothing: everything is looked at again
  }
  return all;
}

std::string batch_report_json(const std::vector<BatchResult>& results, const std::string& recipe, double seconds) {
  Json j;
  j["format"] = "texel-batch";
  j["generator"] = generator();
  j["recipe"] = Json::parse(recipe);
  j["seconds"] = seconds;
  Json& counts = j["counts"] = Json::object();
  for (const char* status : {"baked", "up to date", "failed", "not begun"})
    counts[status] = std::count_if(results.begin(), results.end(), [&](const BatchResult& r) { return r.status == status; });
  j["items"] = Json::array();
  for (const BatchResult& r : results) {
    Json item{{"input", r.input}, {"pack", r.output}, {"status", r.status}, {"exit_status", r.code}};
    if (!r.texel.empty()) item["texel"] = r.texel;
    if (!r.message.empty()) item["message"] = r.message;
    item["seconds"] = r.seconds;
    item["resolution"] = r.resolution;
    item["issues"] = Json::array();
    for (const Issue& i : r.issues) item["issues"].push_back({{"id", i.id}, {"text", i.text}, {"count", i.count}, {"where", i.where}});
    item["files"] = Json::array();
    for (const FileStamp& f : r.files) item["files"].push_back({{"path", f.path}, {"bytes", f.bytes}, {"modified", f.modified}});
    j["items"].push_back(std::move(item));
  }
  return j.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string batch_table(const std::vector<BatchResult>& results) {
  std::string good, bad;
  for (const BatchResult& r : results) {
    std::string note = r.message;
    if (note.empty()) {
      note = r.resolution;
      for (const Issue& i : r.issues) note += (&i == &r.issues.front() ? "  [" : " [") + i.id + "]";
    }
    const bool worked = r.status == "baked" || r.status == "up to date";
    (worked ? good : bad) += padded(r.status, 12) + padded(worked && r.status == "baked" ? seconds_text(r.seconds) : "", 10) + padded(r.texel.empty() ? r.input : r.input + " " + r.texel, 40) + "  " + note + "\n";
  }
  return good + bad;
}

bool untouched_since(const BatchResult& earlier, const std::string& input) {
  if (earlier.status != "baked" && earlier.status != "up to date") return false;
  if (earlier.input != input || earlier.files.empty()) return false;
  if (std::any_of(earlier.issues.begin(), earlier.issues.end(), [](const Issue& i) { return i.id.ends_with("missing"); })) return false;
  return std::all_of(earlier.files.begin(), earlier.files.end(), [](const FileStamp& f) { return f.bytes >= 0 && stamp_of(f.path) == f; });
}

}  // namespace texel
