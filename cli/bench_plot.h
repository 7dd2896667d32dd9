#pragma once
// Points -> a log-log plot as SVG text
#include <string>
#include <vector>

namespace texel {

struct PlotPoint {
  double x = 0, y = 0;         // > 0, or the point is left out
  std::string label;
  bool is_default = false;     // ringed
};

struct PlotSeries {
  std::string name;
  std::vector<PlotPoint> points;  // joined in their order
};

struct Plot {
  std::string title, x_label, y_label;
  std::vector<PlotSeries> series;
  double target = 0;           // a level line at this y; 0: none
  std::string target_label;
  bool front = true;           // a band under the points that none other beats in both
};

// Deterministic text. Eight colours, each with a marker of its own, so that a grey print can be read.
[[nodiscard]] std::string plot_svg(const Plot& plot);

// Which of the points no other beats by more than `slack` (a share) in both coordinates.
struct PlotPlace { double x, y; };
[[nodiscard]] std::vector<bool> on_front(const std::vector<PlotPlace>& points, double slack);

// Slope of log y over log x by least squares; NaN with fewer than two different points.
[[nodiscard]] double log_slope(const std::vector<PlotPlace>& points);

}  // namespace texel
