#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <tuple>

#include "formats/error.h"
#include "formats/hash.h"
#include "formats/write_parts.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

// The slices of all stacks as one list, so that short stacks do not leave threads idle.
struct Task {
  std::size_t stack;
  int k;
};

std::vector<const SliceStack*> in_order(const std::vector<SliceStack>& stacks) {
  std::vector<const SliceStack*> sorted;
  for (const SliceStack& s : stacks) sorted.push_back(&s);
  std::stable_sort(sorted.begin(), sorted.end(), [](const SliceStack* a, const SliceStack* b) { return std::tie(a->axis, a->level) < std::tie(b->axis, b->level); });
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const SliceStack& s = *sorted[i];
    const bool follows = i > 0 && sorted[i - 1]->axis == s.axis;
    if (s.axis < 0 || s.axis > 2 || s.level != (follows ? sorted[i - 1]->level + 1 : 0) || s.count < 1 || s.width < 1 || s.height < 1 || !s.image)
      throw Error(Code::kRunning, "slices", "stack " + std::to_string(i) + " is not complete");
  }
  return sorted;
}

PixelCount write_slice(const SliceStack& s, int k, const std::string& path, SliceFormat format) {
  const Image image = s.image(k);
  const std::size_t pixels = static_cast<std::size_t>(s.width) * static_cast<std::size_t>(s.height);
  if (image.width != s.width || image.height != s.height || image.channels != 4 || image.pixels.size() != pixels * 4)
    throw Error(Code::kRunning, path, "slice is " + std::to_string(image.width) + "x" + std::to_string(image.height) + " with " +
                                          std::to_string(image.channels) + " channels instead of " + std::to_string(s.width) + "x" + std::to_string(s.height) + " with 4");
  PixelCount count;
  if (format == SliceFormat::kPng) write_png(image, path, &count);
  else write_exr(image, path);
  return count;
}

}  // namespace

std::vector<StackRecord> write_slices(const std::vector<SliceStack>& stacks, const fs::path& folder, SliceFormat format, const Report& report, PixelCount* pixels) {
  const std::vector<const SliceStack*> sorted = in_order(stacks);
  std::vector<StackRecord> records;
  std::vector<Task> tasks;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const SliceStack& s = *sorted[i];
    StackRecord r{.axis = s.axis, .level = s.level, .count = s.count, .width = s.width, .height = s.height, .thickness = s.thickness, .max_angle = s.max_angle, .format = format, .sha256 = {}};
    std::error_code ec;
    const fs::path place = (folder / slice_file(s.axis, s.level, format, 0)).parent_path();
    fs::create_directories(place, ec);
    if (ec) throw Error(ec == std::errc::no_space_on_device ? Code::kRunning : Code::kFile, place.string(), "cannot be made (" + ec.message() + ")");
    records.push_back(std::move(r));
    for (int k = 0; k < s.count; ++k) tasks.push_back({i, k});
  }
  std::atomic<std::size_t> done{0};
  std::atomic<std::int64_t> seen{0}, clipped{0};
  tbb::parallel_for(std::size_t{0}, tasks.size(), [&](std::size_t t) {
    const SliceStack& s = *sorted[tasks[t].stack];
    const PixelCount count = write_slice(s, tasks[t].k, (folder / slice_file(s.axis, s.level, format, tasks[t].k)).string(), format);
    seen += count.seen;
    clipped += count.clipped;
    if (report.progress) report.progress("write", static_cast<double>(++done) / static_cast<double>(tasks.size()));
  });
  *pixels = {seen, clipped};
  tbb::parallel_for(std::size_t{0}, records.size(), [&](std::size_t i) { sum_stack(records[i], folder, &report); });
  return records;
}

void sum_stack(StackRecord& record, const fs::path& folder, const Report* report) {
  Sha256 sum;
  record.bytes = 0;
  for (int k = 0; k < record.count; ++k) {
    record.bytes += sum.add_file((folder / slice_file(record.axis, record.level, record.format, k)).string());
    if (report && report->progress) report->progress("write", 1);
  }
  record.sha256 = sum.hex();
}

}  // namespace texel
