#include "formats/report.h"

#include <ctime>

namespace texel {
namespace {
double seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}
}  // namespace

StageTimer::StageTimer(Report& report, std::string stage)
    : report_(report), stage_(std::move(stage)),
      wall_(seconds(CLOCK_MONOTONIC)), cpu_(seconds(CLOCK_PROCESS_CPUTIME_ID)) {}

StageTimer::~StageTimer() {
  const double wall = seconds(CLOCK_MONOTONIC) - wall_, cpu = seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu_;
  for (StageTime& time : report_.times)
    if (time.stage == stage_) {
      time.seconds += wall;
      time.cpu_seconds += cpu;
      return;
    }
  report_.times.push_back({stage_, wall, cpu});
}

}  // namespace texel
