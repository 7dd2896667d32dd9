#include "cli/bench_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace texel {
namespace {

constexpr double kWidth = 800, kHeight = 500, kLeft = 78, kRight = 226, kTop = 44, kBottom = 58;
constexpr std::array<const char*, 8> kColors{"#0b62a4", "#d1495b", "#2e8b57", "#b8860b", "#7b4ea3", "#444444", "#00868b", "#c2571a"};

std::string number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", v);
  return text;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}

std::string text_at(double x, double y, const std::string& text, const char* more = "") {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" " + more + ">" + escaped(text) + "</text>\n";
}

std::string line(double x0, double y0, double x1, double y1, const char* style) {
  return "<line x1=\"" + number(x0) + "\" y1=\"" + number(y0) + "\" x2=\"" + number(x1) + "\" y2=\"" + number(y1) + "\" " + style + "/>\n";
}

std::string marker(std::size_t kind, double x, double y, const char* color) {
  const std::string fill = std::string("fill=\"") + color + "\"", at = number(x) + "," + number(y);
  const auto polygon = [&](std::initializer_list<std::pair<double, double>> corners) {
    std::string points;
    for (const auto& [dx, dy] : corners) points += (points.empty() ? "" : " ") + number(x + dx) + "," + number(y + dy);
    return "<polygon points=\"" + points + "\" " + fill + "/>\n";
  };
  switch (kind % 4) {
    case 0: return "<circle cx=\"" + number(x) + "\" cy=\"" + number(y) + "\" r=\"4\" " + fill + "/>\n";
    case 1: return polygon({{-3.7, -3.7}, {3.7, -3.7}, {3.7, 3.7}, {-3.7, 3.7}});
    case 2: return polygon({{0, -5}, {4.6, 3.6}, {-4.6, 3.6}});
    default: return polygon({{0, -5.2}, {5.2, 0}, {0, 5.2}, {-5.2, 0}});
  }
}

struct Axis {
  double low = 0, high = 1;    // log10
  double from = 0, to = 1;     // in the picture
  [[nodiscard]] double at(double value) const { return from + (std::log10(value) - low) / (high - low) * (to - from); }
};

Axis fit(std::vector<double> values, double from, double to) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  double low = std::log10(*least), high = std::log10(*most);
  const double room = std::max(0.06 * (high - low), 0.08);
  low -= room;
  high += room;
  if (high - low < 0.5) {      // less than half a decade would magnify noise
    const double middle = (low + high) / 2;
    low = middle - 0.25;
    high = middle + 0.25;
  }
  return {low, high, from, to};
}

std::string tick_text(double v) {
  char text[32];
  std::snprintf(text, sizeof text, v >= 1e-3 && v < 1e5 ? "%g" : "%.0e", v);
  return text;
}

// 1, 2, 5 of each decade; where there are many decades the ones alone.
std::vector<double> ticks(const Axis& axis) {
  std::vector<double> all;
  const bool many = axis.high - axis.low > 3;
  for (int decade = static_cast<int>(std::floor(axis.low)); decade <= static_cast<int>(std::ceil(axis.high)); ++decade)
    for (const double m : {1.0, 2.0, 5.0})
      if (const double v = m * std::pow(10.0, decade); (!many || m == 1) && std::log10(v) >= axis.low && std::log10(v) <= axis.high) all.push_back(v);
  return all;
}

bool shows(const PlotPoint& p) { return p.x > 0 && p.y > 0 && std::isfinite(p.x) && std::isfinite(p.y); }

}  // namespace

std::vector<bool> on_front(const std::vector<PlotPlace>& points, double slack) {
  std::vector<bool> on(points.size(), true);
  for (std::size_t i = 0; i < points.size(); ++i)
    for (const PlotPlace& other : points)
      if (other.x * (1 + slack) < points[i].x && other.y * (1 + slack) < points[i].y) on[i] = false;
  return on;
}

double log_slope(const std::vector<PlotPlace>& points) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const PlotPlace& p : points) {
    if (!(p.x > 0) || !(p.y > 0)) continue;
    const double x = std::log(p.x), y = std::log(p.y);
    ++n;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  const double spread = n * sxx - sx * sx;
  return n >= 2 && spread > 1e-12 ? (n * sxy - sx * sy) / spread : std::numeric_limits<double>::quiet_NaN();
}

std::string plot_svg(const Plot& plot) {
  std::vector<double> xs, ys;
  for (const PlotSeries& s : plot.series)
    for (const PlotPoint& p : s.points)
      if (shows(p)) {
        xs.push_back(p.x);
        ys.push_back(p.y);
      }
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(kWidth) + "\" height=\"" + number(kHeight) + "\" viewBox=\"0 0 " + number(kWidth) + " " + number(kHeight) +
                    "\" font-family=\"DejaVu Sans, Arial, sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n";
  svg += text_at(kLeft, 24, plot.title, "font-size=\"15\" font-weight=\"bold\"");
  if (xs.empty()) return svg + text_at(kLeft, 60, "nothing was measured") + "</svg>\n";
  if (plot.target > 0) ys.push_back(plot.target);
  const Axis x = fit(xs, kLeft, kWidth - kRight), y = fit(ys, kHeight - kBottom, kTop);
  for (const double v : ticks(x)) {
    svg += line(x.at(v), kTop, x.at(v), kHeight - kBottom, "stroke=\"#e4e4e4\"");
    svg += text_at(x.at(v), kHeight - kBottom + 17, tick_text(v), "text-anchor=\"middle\" fill=\"#333333\"");
  }
  for (const double v : ticks(y)) {
    svg += line(kLeft, y.at(v), kWidth - kRight, y.at(v), "stroke=\"#e4e4e4\"");
    svg += text_at(kLeft - 7, y.at(v) + 4, tick_text(v), "text-anchor=\"end\" fill=\"#333333\"");
  }
  svg += "<rect x=\"" + number(kLeft) + "\" y=\"" + number(kTop) + "\" width=\"" + number(kWidth - kRight - kLeft) + "\" height=\"" + number(kHeight - kBottom - kTop) + "\" fill=\"none\" stroke=\"#555555\"/>\n";
  svg += text_at((kLeft + kWidth - kRight) / 2, kHeight - 16, plot.x_label, "text-anchor=\"middle\"");
  svg += "<text transform=\"translate(18 " + number((kTop + kHeight - kBottom) / 2) + ") rotate(-90)\" text-anchor=\"middle\">" + escaped(plot.y_label) + "</text>\n";
  if (plot.target > 0) {
    svg += line(kLeft, y.at(plot.target), kWidth - kRight, y.at(plot.target), "stroke=\"#000000\" stroke-dasharray=\"6 4\"");
    svg += text_at(kWidth - kRight - 6, y.at(plot.target) - 5, plot.target_label, "text-anchor=\"end\"");
  }
  if (plot.front) {
    std::vector<PlotPlace> all;
    for (const PlotSeries& s : plot.series)
      for (const PlotPoint& p : s.points)
        if (shows(p)) all.push_back({p.x, p.y});
    const std::vector<bool> on = on_front(all, 0);
    std::vector<PlotPlace> front;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (on[i]) front.push_back(all[i]);
    std::sort(front.begin(), front.end(), [](const PlotPlace& a, const PlotPlace& b) { return a.x != b.x ? a.x < b.x : a.y > b.y; });
    if (front.size() == 1) front.push_back(front.front());  // a dot: round ends without length
    std::string points;
    for (const PlotPlace& p : front) points += (points.empty() ? "" : " ") + number(x.at(p.x)) + "," + number(y.at(p.y));
    svg += "<polyline points=\"" + points + "\" fill=\"none\" stroke=\"#ffd54a\" stroke-width=\"9\" stroke-linejoin=\"round\" stroke-linecap=\"round\" opacity=\"0.6\"/>\n";
  }
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const PlotSeries& s = plot.series[i];
    const char* color = kColors[i % kColors.size()];
    std::string points, marks;
    for (const PlotPoint& p : s.points) {
      if (!shows(p)) continue;
      const double px = x.at(p.x), py = y.at(p.y);
      points += (points.empty() ? "" : " ") + number(px) + "," + number(py);
      marks += marker(i, px, py, color);
      if (!p.label.empty()) marks += text_at(px + 7, py - 6, p.label, ("font-size=\"10\" fill=\"" + std::string(color) + "\"").c_str());
      if (p.is_default) marks += "<circle cx=\"" + number(px) + "\" cy=\"" + number(py) + "\" r=\"9\" fill=\"none\" stroke=\"#000000\" stroke-width=\"1.8\"/>\n";
    }
    if (points.empty()) continue;
    svg += "<polyline points=\"" + points + "\" fill=\"none\" stroke=\"" + color + "\" stroke-width=\"1.6\"/>\n" + marks;
  }
  double row = kTop + 10;
  const double left = kWidth - kRight + 14;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const bool any = std::any_of(plot.series[i].points.begin(), plot.series[i].points.end(), shows);
    if (!any) continue;
    svg += marker(i, left + 5, row, kColors[i % kColors.size()]) + text_at(left + 17, row + 4, plot.series[i].name);
    row += 20;
  }
  const bool ringed = std::any_of(plot.series.begin(), plot.series.end(), [](const PlotSeries& s) { return std::any_of(s.points.begin(), s.points.end(), [](const PlotPoint& p) { return p.is_default && shows(p); }); });
  if (ringed) {
    svg += "<circle cx=\"" + number(left + 5) + "\" cy=\"" + number(row) + "\" r=\"7\" fill=\"none\" stroke=\"#000000\" stroke-width=\"1.8\"/>\n" + text_at(left + 17, row + 4, "the default");
    row += 20;
  }
  if (plot.front) svg += line(left - 2, row, left + 12, row, "stroke=\"#ffd54a\" stroke-width=\"9\" opacity=\"0.6\"") + text_at(left + 17, row + 4, "front: none is both");
  if (plot.front) svg += text_at(left + 17, row + 18, "quicker and nearer");
  return svg + "</svg>\n";
}

}  // namespace texel
