#include "formats/period_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace texel {

PeriodFit fit_period(const V3d& frequency, const V3d& period, const std::string& what) {
  constexpr double kMost = 1 << 20;  // octaves double it, and it stays an int
  PeriodFit fit{frequency, {0, 0, 0}, {}};
  for (int a = 0; a < 3; ++a) {
    if (!(period[a] > 0)) continue;
    const double wanted = frequency[a] * period[a], count = std::clamp(std::nearbyint(wanted), 1.0, kMost);
    fit.count[a] = static_cast<int>(count);
    fit.frequency[a] = count / period[a];
    if (std::abs(wanted - count) <= kSamePeriod * count) continue;
    char text[80];
    std::snprintf(text, sizeof text, "%salong %c %d ", fit.changed.empty() ? "" : ", ", "xyz"[a], fit.count[a]);
    fit.changed += text + what;
    std::snprintf(text, sizeof text, " a period instead of %.4g", wanted);
    fit.changed += text;
  }
  return fit;
}

}  // namespace texel
