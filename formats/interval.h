#pragma once
// Outward-rounded interval arithmetic: what a Field's range is computed with. Internal to formats/.
//
// Every result holds both the exact real result and what the same operation gives in doubles, for all operands in the intervals. An
// operation that may be undefined somewhere (root of a negative, 0/0) gives NaN for both ends, and so does everything computed from it.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "formats/field.h"

namespace texel::interval {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
inline constexpr double kTiny = std::numeric_limits<double>::denorm_min();

inline Interval unknown() { return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()}; }
inline bool is_unknown(const Interval& a) { return std::isnan(a.low) || std::isnan(a.high); }
inline bool holds(const Interval& a, double v) { return a.low <= v && v <= a.high; }

// At least `ulps` units in the last place further out: |x|·2⁻⁵² is one to two of them. Correctly rounded operations need one, glibc's
// elementary functions (stated below 1 to 2) four.
inline double down(double x, double ulps = 1) { return x - (std::abs(x) * (ulps * kEpsilon) + ulps * kTiny); }
inline double up(double x, double ulps = 1) { return x + (std::abs(x) * (ulps * kEpsilon) + ulps * kTiny); }
inline constexpr double kLibraryUlps = 4;

inline Interval widened(double low, double high, double ulps = 1) { return {down(low, ulps), up(high, ulps)}; }

// The sum and product of numbers that are not negative are not negative: kept, for the roots taken of them.
inline Interval add(const Interval& a, const Interval& b) {
  Interval r = widened(a.low + b.low, a.high + b.high);
  if (a.low >= 0 && b.low >= 0) r.low = std::max(r.low, 0.0);
  if (a.high <= 0 && b.high <= 0) r.high = std::min(r.high, 0.0);
  return r;
}
inline Interval negate(const Interval& a) { return {-a.high, -a.low}; }
inline Interval subtract(const Interval& a, const Interval& b) { return add(a, negate(b)); }

// 0·∞ is 0: an infinite end stands for all finite numbers.
inline double product(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; }
inline Interval multiply(const Interval& a, const Interval& b) {
  if (is_unknown(a) || is_unknown(b)) return unknown();
  const double p[4] = {product(a.low, b.low), product(a.low, b.high), product(a.high, b.low), product(a.high, b.high)};
  Interval r{*std::min_element(p, p + 4), *std::max_element(p, p + 4)};
  r.low = r.low == 0 ? 0 : r.low > 0 ? std::max(0.0, down(r.low)) : down(r.low);
  r.high = r.high == 0 ? 0 : r.high < 0 ? std::min(0.0, up(r.high)) : up(r.high);
  // A product that underflowed to 0 may be the other side of it.
  if (r.low == 0 && !(a.low >= 0 && b.low >= 0) && !(a.high <= 0 && b.high <= 0)) r.low = -kTiny;
  if (r.high == 0 && (a.low != 0 || a.high != 0) && (b.low != 0 || b.high != 0)) r.high = kTiny;
  return r;
}
inline Interval square(const Interval& a) {
  if (is_unknown(a)) return unknown();
  const double l = std::abs(a.low), h = std::abs(a.high);
  const double low = a.low <= 0 && a.high >= 0 ? 0 : std::min(l, h), high = std::max(l, h);
  return {std::max(0.0, down(low * low)), high == 0 ? 0 : up(high * high)};
}
inline Interval divide(const Interval& a, const Interval& b) {
  if (is_unknown(a) || is_unknown(b)) return unknown();
  if (holds(b, 0)) return holds(a, 0) ? unknown() : Interval{-kInfinity, kInfinity};
  if (std::isinf(b.low) || std::isinf(b.high)) {  // the reciprocal first: ∞/∞ says nothing
    const Interval inverse = b.low > 0 ? Interval{0, up(1 / b.low)} : Interval{down(1 / b.high), 0};
    return multiply(a, inverse);
  }
  const double p[4] = {a.low / b.low, a.low / b.high, a.high / b.low, a.high / b.high};
  Interval r = widened(*std::min_element(p, p + 4), *std::max_element(p, p + 4));
  const bool positive = b.low > 0;
  if (positive ? a.low >= 0 : a.high <= 0) r.low = std::max(r.low, 0.0);
  if (positive ? a.high <= 0 : a.low >= 0) r.high = std::min(r.high, 0.0);
  return r;
}
inline Interval root(const Interval& a) {
  if (!(a.low >= 0)) return unknown();
  return {std::max(0.0, down(std::sqrt(a.low))), up(std::sqrt(a.high))};
}
inline Interval absolute(const Interval& a) {
  if (is_unknown(a)) return unknown();
  if (holds(a, 0)) return {0, std::max(-a.low, a.high)};
  return a.low > 0 ? a : negate(a);
}
inline Interval least(const Interval& a, const Interval& b) {
  if (is_unknown(a) || is_unknown(b)) return unknown();
  return {std::min(a.low, b.low), std::min(a.high, b.high)};
}
inline Interval greatest(const Interval& a, const Interval& b) {
  if (is_unknown(a) || is_unknown(b)) return unknown();
  return {std::max(a.low, b.low), std::max(a.high, b.high)};
}
inline Interval floored(const Interval& a) { return {std::floor(a.low), std::floor(a.high)}; }

// Whether offset + k·period lies in a for some whole k; in doubt, yes.
inline bool holds_multiple(const Interval& a, double offset, double period) {
  const double slack = 1e-12 * (1 + std::max(std::abs(a.low), std::abs(a.high)));
  return std::floor((a.high + slack - offset) / period) > std::floor((a.low - slack - offset) / period);
}
inline constexpr double kFar = 1e9;  // beyond it periods are not told apart
inline bool is_far(const Interval& a) { return !(a.low > -kFar && a.high < kFar); }

inline Interval sine(const Interval& a) {
  if (is_unknown(a)) return unknown();
  if (is_far(a)) return {-1, 1};
  const double pi = std::numbers::pi;
  const double l = std::sin(a.low), h = std::sin(a.high);
  const double low = holds_multiple(a, -pi / 2, 2 * pi) ? -1 : std::max(-1.0, down(std::min(l, h), kLibraryUlps));
  const double high = holds_multiple(a, pi / 2, 2 * pi) ? 1 : std::min(1.0, up(std::max(l, h), kLibraryUlps));
  return {low, high};
}
inline Interval cosine(const Interval& a) {
  if (is_unknown(a)) return unknown();
  if (is_far(a)) return {-1, 1};
  const double pi = std::numbers::pi;
  const double l = std::cos(a.low), h = std::cos(a.high);
  const double low = holds_multiple(a, pi, 2 * pi) ? -1 : std::max(-1.0, down(std::min(l, h), kLibraryUlps));
  const double high = holds_multiple(a, 0, 2 * pi) ? 1 : std::min(1.0, up(std::max(l, h), kLibraryUlps));
  return {low, high};
}
inline Interval tangent(const Interval& a) {
  if (is_unknown(a)) return unknown();
  if (is_far(a) || holds_multiple(a, std::numbers::pi / 2, std::numbers::pi)) return {-kInfinity, kInfinity};
  return widened(std::tan(a.low), std::tan(a.high), kLibraryUlps);
}
// f not decreasing.
template <class F>
Interval rising(const Interval& a, F f) {
  return widened(f(a.low), f(a.high), kLibraryUlps);
}
inline Interval logarithm(const Interval& a) {
  if (!(a.low >= 0)) return unknown();
  return rising(a, [](double v) { return std::log(v); });
}
inline Interval exponential(const Interval& a) {
  Interval r = rising(a, [](double v) { return std::exp(v); });
  if (r.low < 0) r.low = 0;
  return r;
}
inline Interval arc_sine(const Interval& a) { return a.low >= -1 && a.high <= 1 ? rising(a, [](double v) { return std::asin(v); }) : unknown(); }
inline Interval arc_cosine(const Interval& a) {
  if (!(a.low >= -1 && a.high <= 1)) return unknown();
  return {std::max(0.0, down(std::acos(a.high), kLibraryUlps)), up(std::acos(a.low), kLibraryUlps)};
}
inline Interval arc_tangent(const Interval& a) { return is_unknown(a) ? unknown() : rising(a, [](double v) { return std::atan(v); }); }
inline Interval arc_tangent2(const Interval& y, const Interval& x) {
  if (is_unknown(y) || is_unknown(x)) return unknown();
  const bool cut = x.low <= 0 && holds(y, 0);  // the origin, or the jump along the negative axis
  if (cut || std::isinf(x.low) || std::isinf(x.high) || std::isinf(y.low) || std::isinf(y.high)) return widened(-std::numbers::pi, std::numbers::pi, kLibraryUlps);
  const double p[4] = {std::atan2(y.low, x.low), std::atan2(y.low, x.high), std::atan2(y.high, x.low), std::atan2(y.high, x.high)};
  return widened(*std::min_element(p, p + 4), *std::max_element(p, p + 4), kLibraryUlps);
}

inline double whole_power(double v, int n) {  // n >= 0, by squaring; not decreasing in v >= 0, rounding included
  double r = 1;
  for (; n > 0; n >>= 1) {
    if (n & 1) r *= v;
    v *= v;
  }
  return r;
}
inline Interval raise(const Interval& a, int n) {
  if (is_unknown(a)) return unknown();
  if (n < 0) return divide({1, 1}, raise(a, -n));
  const double ulps = 2.0 * n + 1;
  const auto end = [n](double v) { return v < 0 && (n & 1) ? -whole_power(-v, n) : whole_power(std::abs(v), n); };
  if (n & 1) return widened(end(a.low), end(a.high), ulps);
  const Interval m = absolute(a);
  return {std::max(0.0, down(end(m.low), ulps)), up(end(m.high), ulps)};
}
inline Interval power(const Interval& a, const Interval& b) {
  if (is_unknown(a) || is_unknown(b) || !(a.low >= 0) || std::isinf(a.high) || std::isinf(b.low) || std::isinf(b.high)) return unknown();
  if (a.low == 0 && !(b.low > 0)) return unknown();
  const double p[4] = {std::pow(a.low, b.low), std::pow(a.low, b.high), std::pow(a.high, b.low), std::pow(a.high, b.high)};
  Interval r = widened(*std::min_element(p, p + 4), *std::max_element(p, p + 4), kLibraryUlps);
  r.low = std::max(r.low, 0.0);
  return r;
}
// a − b·floor(a/b).
inline Interval modulo(const Interval& a, const Interval& b) {
  if (is_unknown(a) || is_unknown(b) || holds(b, 0)) return unknown();
  const Interval times = floored(divide(a, b));
  if (times.low == times.high) return subtract(a, multiply(b, times));
  const double slack = 4 * kEpsilon * std::max(std::abs(a.low), std::abs(a.high));  // the floor's quotient was rounded
  return b.low > 0 ? Interval{-slack, up(b.high) + slack} : Interval{down(b.low) - slack, slack};
}

}  // namespace texel::interval
