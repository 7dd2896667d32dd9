// Any bytes as a raw volume; the first byte chooses the format: an Error, or samples whose function keeps to its ranges.
#include <cstdint>

#include "formats/read_volume.h"
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  using namespace texel;
  if (size < 1) return 0;
  const Input input{{data + 1, size - 1}, "nowhere/input"};
  Report report;
  try {
    // A MetaImage's further file is the same bytes again.
    const Volume v = data[0] == 'd' ? read_df3(input, report) : data[0] == 'i' ? read_inr(input, report) : read_mhd(input, [&](const std::string&) { return input.bytes; }, report);
    const Interval all = sample_range(v.grid);
    demand(all.low <= all.high);
    const auto field = make_grid_field(v.grid, v.sign);
    const V3d from = v.grid.origin, to = from + v.grid.step[0] * 1.5 + v.grid.step[1] * 0.5 + v.grid.step[2] * 2.5;
    Box3d box;
    box.extendBy(from);
    box.extendBy(to);
    const Interval range = field->range(box);
    for (const V3d& p : {from, to, (from + to) / 2.0}) {
      double f = 0;
      field->values(1, &p.x, &p.y, &p.z, &f);
      demand(f >= range.low && f <= range.high);
    }
    (void)field->bounds((all.low + all.high) / 2);
  } catch (const Error& e) {
    demand((e.code == Code::kBadInput || e.code == Code::kUnsupported) && !e.where.empty() && !e.message.empty());
  }
  return 0;
}
