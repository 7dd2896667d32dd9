#include "formats/program.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/interval.h"
#include "formats/noise.h"

namespace texel {
namespace {

constexpr std::size_t kBatch = 128;  // points a pass: a slot is one kilobyte, so that some thirty of them stay in the first-level cache

int operands(Op op) { return op < Op::kNegate ? 0 : op < Op::kAdd ? 1 : op < Op::kNoise ? 2 : 3; }

double fade(double t) {
  t = !(t > 0) ? (std::isnan(t) ? t : 0) : t > 1 ? 1 : t;
  return t * t * (3 - 2 * t);
}
double power_of(double v, int n) {
  const double magnitude = interval::whole_power(std::abs(v), std::abs(n));
  const double signed_value = v < 0 && (n & 1) ? -magnitude : magnitude;
  return n < 0 ? 1 / signed_value : signed_value;
}
double sign_of(double v) { return v > 0 ? 1 : v < 0 ? -1 : v; }
double modulo_of(double a, double b) { return a - b * std::floor(a / b); }
// Not a number in either operand is not a number.
double least_of(double a, double b) { return a < b || std::isnan(a) ? a : b; }
double greatest_of(double a, double b) { return a > b || std::isnan(a) ? a : b; }

double compute(Op op, double number, double a, double b) {
  switch (op) {
    case Op::kNegate: return -a;
    case Op::kAbs: return std::abs(a);
    case Op::kSqrt: return std::sqrt(a);
    case Op::kSquare: return a * a;
    case Op::kSin: return std::sin(a);
    case Op::kCos: return std::cos(a);
    case Op::kTan: return std::tan(a);
    case Op::kAsin: return std::asin(a);
    case Op::kAcos: return std::acos(a);
    case Op::kAtan: return std::atan(a);
    case Op::kExp: return std::exp(a);
    case Op::kLog: return std::log(a);
    case Op::kFloor: return std::floor(a);
    case Op::kSign: return sign_of(a);
    case Op::kFade: return fade(a);
    case Op::kWholePower: return power_of(a, static_cast<int>(number));
    case Op::kAdd: return a + b;
    case Op::kSubtract: return a - b;
    case Op::kMultiply: return a * b;
    case Op::kDivide: return a / b;
    case Op::kPower: return std::pow(a, b);
    case Op::kAtan2: return std::atan2(a, b);
    case Op::kMin: return least_of(a, b);
    case Op::kMax: return greatest_of(a, b);
    case Op::kModulo: return modulo_of(a, b);
    default: return number;
  }
}

struct Step {
  Op op;
  std::uint32_t to, a, b, c;  // slots; 0, 1, 2 are x, y, z
  double number;
};

template <class F>
void each(std::size_t n, const double* a, double* __restrict out, F f) {
  for (std::size_t i = 0; i < n; ++i) out[i] = f(a[i]);
}
template <class F>
void each(std::size_t n, const double* a, const double* b, double* __restrict out, F f) {
  for (std::size_t i = 0; i < n; ++i) out[i] = f(a[i], b[i]);
}

void run_step(const Step& s, std::size_t n, const double* a, const double* b, const double* c, double* out) {
  switch (s.op) {
    case Op::kConstant: std::fill_n(out, n, s.number); break;
    case Op::kNegate: each(n, a, out, [](double v) { return -v; }); break;
    case Op::kAbs: each(n, a, out, [](double v) { return std::abs(v); }); break;
    case Op::kSqrt: each(n, a, out, [](double v) { return std::sqrt(v); }); break;
    case Op::kSquare: each(n, a, out, [](double v) { return v * v; }); break;
    case Op::kFloor: each(n, a, out, [](double v) { return std::floor(v); }); break;
    case Op::kFade: each(n, a, out, fade); break;
    case Op::kAdd: each(n, a, b, out, [](double v, double w) { return v + w; }); break;
    case Op::kSubtract: each(n, a, b, out, [](double v, double w) { return v - w; }); break;
    case Op::kMultiply: each(n, a, b, out, [](double v, double w) { return v * w; }); break;
    case Op::kDivide: each(n, a, b, out, [](double v, double w) { return v / w; }); break;
    case Op::kMin: each(n, a, b, out, least_of); break;
    case Op::kMax: each(n, a, b, out, greatest_of); break;
    case Op::kNoise: noise_values(Noise{static_cast<std::uint32_t>(s.number), V3i(0, 0, 0)}, n, a, b, c, out); break;
    default:
      if (operands(s.op) == 1) each(n, a, out, [&](double v) { return compute(s.op, s.number, v, 0); });
      else each(n, a, b, out, [&](double v, double w) { return compute(s.op, s.number, v, w); });
  }
}

// ∂/∂a and ∂/∂b of an operation with the value v.
void derive(Op op, double number, double a, double b, double v, double* da, double* db) {
  *db = 0;
  switch (op) {
    case Op::kNegate: *da = -1; break;
    case Op::kAbs: *da = a < 0 ? -1 : 1; break;
    case Op::kSqrt: *da = 0.5 / v; break;
    case Op::kSquare: *da = 2 * a; break;
    case Op::kSin: *da = std::cos(a); break;
    case Op::kCos: *da = -std::sin(a); break;
    case Op::kTan: *da = 1 + v * v; break;
    case Op::kAsin: *da = 1 / std::sqrt(1 - a * a); break;
    case Op::kAcos: *da = -1 / std::sqrt(1 - a * a); break;
    case Op::kAtan: *da = 1 / (1 + a * a); break;
    case Op::kExp: *da = v; break;
    case Op::kLog: *da = 1 / a; break;
    case Op::kFade: *da = a > 0 && a < 1 ? 6 * a * (1 - a) : 0; break;
    case Op::kWholePower: *da = number == 0 ? 0 : number * power_of(a, static_cast<int>(number) - 1); break;
    case Op::kAdd: *da = *db = 1; break;
    case Op::kSubtract: *da = 1; *db = -1; break;
    case Op::kMultiply: *da = b; *db = a; break;
    case Op::kDivide: *da = 1 / b; *db = -v / b; break;
    case Op::kPower: *da = b == 0 ? 0 : b * std::pow(a, b - 1); *db = a > 0 ? v * std::log(a) : 0; break;
    case Op::kAtan2: { const double square = a * a + b * b; *da = b / square; *db = -a / square; break; }
    case Op::kMin: *da = a < b ? 1 : 0; *db = 1 - *da; break;
    case Op::kMax: *da = a > b ? 1 : 0; *db = 1 - *da; break;
    case Op::kModulo: *da = 1; *db = -std::floor(a / b); break;
    default: *da = 0; break;  // floor and sign have steps and no slopes
  }
}

Interval noise_over(std::uint32_t seed, const Interval& a, const Interval& b, const Interval& c) {
  if (interval::is_unknown(a) || interval::is_unknown(b) || interval::is_unknown(c)) return interval::unknown();
  const auto far = [](const Interval& v) { return !(v.low > -1e15 && v.high < 1e15); };
  if (far(a) || far(b) || far(c)) return {-kNoiseBound, kNoiseBound};
  return noise_range(Noise{seed, V3i(0, 0, 0)}, Box3d(V3d(a.low, b.low, c.low), V3d(a.high, b.high, c.high)));
}

Interval run_range(const Step& s, const Interval& a, const Interval& b, const Interval& c) {
  using namespace interval;
  switch (s.op) {
    case Op::kConstant: return {s.number, s.number};
    case Op::kNegate: return negate(a);
    case Op::kAbs: return absolute(a);
    case Op::kSqrt: return root(a);
    case Op::kSquare: return square(a);
    case Op::kSin: return sine(a);
    case Op::kCos: return cosine(a);
    case Op::kTan: return tangent(a);
    case Op::kAsin: return arc_sine(a);
    case Op::kAcos: return arc_cosine(a);
    case Op::kAtan: return arc_tangent(a);
    case Op::kExp: return exponential(a);
    case Op::kLog: return logarithm(a);
    case Op::kFloor: return floored(a);
    case Op::kSign: return is_unknown(a) ? a : Interval{sign_of(a.low), sign_of(a.high)};
    case Op::kFade: return is_unknown(a) ? a : rising(a, fade);
    case Op::kWholePower: return raise(a, static_cast<int>(s.number));
    case Op::kAdd: return add(a, b);
    case Op::kSubtract: return subtract(a, b);
    case Op::kMultiply: return multiply(a, b);
    case Op::kDivide: return divide(a, b);
    case Op::kPower: return power(a, b);
    case Op::kAtan2: return arc_tangent2(a, b);
    case Op::kMin: return least(a, b);
    case Op::kMax: return greatest(a, b);
    case Op::kModulo: return modulo(a, b);
    case Op::kNoise: return noise_over(static_cast<std::uint32_t>(s.number), a, b, c);
    default: return unknown();
  }
}

class ProgramField final : public Field {
 public:
  ProgramField(const std::vector<ProgramBuilder::Entry>& nodes, ProgramBuilder::Node root) { compile(nodes, root); }

  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override {
    const std::unique_ptr<double[]> memory(new double[slots_ * kBatch]);
    for (std::size_t from = 0; from < n; from += kBatch) {
      const std::size_t count = std::min(kBatch, n - from);
      const double* in[3] = {x + from, y + from, z + from};
      const auto slot = [&](std::uint32_t s) { return s < 3 ? in[s] : memory.get() + (s - 3) * kBatch; };
      for (const Step& s : steps_) run_step(s, count, slot(s.a), slot(s.b), slot(s.c), memory.get() + (s.to - 3) * kBatch);
      std::copy_n(slot(result_), count, f + from);
    }
  }

  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    constexpr std::size_t kWide = 4 * kBatch;  // value and three derivatives side by side
    const std::unique_ptr<double[]> memory(new double[(slots_ + 3) * kWide]);
    for (std::size_t from = 0; from < n; from += kBatch) {
      const std::size_t count = std::min(kBatch, n - from);
      const double* in[3] = {x + from, y + from, z + from};
      const auto slot = [&](std::uint32_t s) { return memory.get() + s * kWide; };
      for (std::uint32_t axis = 0; axis < 3; ++axis) {
        std::copy_n(in[axis], count, slot(axis));
        for (std::uint32_t k = 0; k < 3; ++k) std::fill_n(slot(axis) + (k + 1) * kBatch, count, k == axis ? 1.0 : 0.0);
      }
      for (const Step& s : steps_) run_gradients(s, count, slot(s.a), slot(s.b), slot(s.c), slot(s.to));
      const double* r = slot(result_);
      double* out[4] = {f, gx, gy, gz};
      for (std::size_t k = 0; k < 4; ++k) std::copy_n(r + k * kBatch, count, out[k] + from);
    }
  }

  [[nodiscard]] Interval range(const Box3d& box) const override {
    const bool finite = std::isfinite(box.min.x + box.min.y + box.min.z) && std::isfinite(box.max.x + box.max.y + box.max.z);
    std::vector<Interval> slot(slots_ + 3);
    for (int a = 0; a < 3; ++a) slot[static_cast<std::size_t>(a)] = {box.min[a], box.max[a]};
    for (const Step& s : steps_) {
      const Interval r = run_range(s, slot[s.a], slot[s.b], slot[s.c]);
      // In a finite box an infinite end may be an overflow, whose further way (∞ − ∞) intervals of numbers do not tell.
      if (finite && !(std::isfinite(r.low) && std::isfinite(r.high))) return interval::unknown();
      slot[s.to] = r;
    }
    return slot[result_];
  }

  [[nodiscard]] Box3d bounds(double iso) const override { return search_bounds(*this, iso); }

 private:
  static void run_gradients(const Step& s, std::size_t n, const double* a, const double* b, const double* c, double* out) {
    if (s.op == Op::kConstant) {
      run_step(s, n, a, b, c, out);
      for (std::size_t k = 1; k < 4; ++k) std::fill_n(out + k * kBatch, n, 0.0);
      return;
    }
    if (s.op == Op::kNoise) {
      double g[3][kBatch];
      noise_gradients(Noise{static_cast<std::uint32_t>(s.number), V3i(0, 0, 0)}, n, a, b, c, out, g[0], g[1], g[2]);
      for (std::size_t k = 1; k < 4; ++k)
        for (std::size_t i = 0; i < n; ++i)
          out[k * kBatch + i] = g[0][i] * a[k * kBatch + i] + g[1][i] * b[k * kBatch + i] + g[2][i] * c[k * kBatch + i];
      return;
    }
    run_step(s, n, a, b, c, out);
    double da[kBatch], db[kBatch];
    for (std::size_t i = 0; i < n; ++i) derive(s.op, s.number, a[i], b[i], out[i], da + i, db + i);
    for (std::size_t k = kBatch; k < 4 * kBatch; k += kBatch)
      for (std::size_t i = 0; i < n; ++i) {
        // 0 times an infinite slope of the other side is nothing.
        out[k + i] = (a[k + i] == 0 ? 0 : da[i] * a[k + i]) + (db[i] == 0 || b[k + i] == 0 ? 0 : db[i] * b[k + i]);
      }
  }

  // Steps in the order of the nodes, each value in a slot that is used again after its last reader.
  void compile(const std::vector<ProgramBuilder::Entry>& nodes, ProgramBuilder::Node root) {
    std::vector<std::uint32_t> last(nodes.size(), 0);  // last reader + 1; 0: not needed
    last[root] = static_cast<std::uint32_t>(nodes.size()) + 1;
    const auto inputs = [&](const ProgramBuilder::Entry& e) { return std::array<ProgramBuilder::Node, 3>{e.a, e.b, e.c}; };
    for (std::uint32_t i = root + 1; i-- > 0;) {
      if (last[i] == 0) continue;
      for (int k = 0; k < operands(nodes[i].op); ++k) {
        const auto in = inputs(nodes[i])[static_cast<std::size_t>(k)];
        last[in] = std::max(last[in], i + 1);
      }
    }
    std::vector<std::uint32_t> place(nodes.size(), 0), unused;
    for (std::uint32_t i = 0; i <= root; ++i) {
      const ProgramBuilder::Entry& e = nodes[i];
      if (last[i] == 0) continue;
      if (e.op <= Op::kZ) {
        place[i] = static_cast<std::uint32_t>(e.op);
        continue;
      }
      // A slot of its own, never that of an operand: loops that may write where they read are not vectorised.
      if (unused.empty()) unused.push_back(static_cast<std::uint32_t>(3 + slots_++));
      place[i] = unused.back();
      unused.pop_back();
      Step step{e.op, place[i], 0, 0, 0, e.number};
      std::uint32_t* to[3] = {&step.a, &step.b, &step.c};
      for (int k = 0; k < operands(e.op); ++k) {
        const auto in = inputs(e)[static_cast<std::size_t>(k)];
        *to[k] = place[in];
        if (last[in] == i + 1 && place[in] >= 3) {
          unused.push_back(place[in]);
          last[in] = static_cast<std::uint32_t>(nodes.size()) + 2;  // given back once, though it may be both operands
        }
      }
      steps_.push_back(step);
    }
    result_ = place[root];
  }

  std::vector<Step> steps_;
  std::size_t slots_ = 0;
  std::uint32_t result_ = 0;
};

}  // namespace

ProgramBuilder::Node ProgramBuilder::add(const Entry& e) {
  const auto key = std::make_tuple(e.op, e.a, e.b, e.c, std::bit_cast<std::uint64_t>(e.number));
  const auto [at, is_new] = known_.try_emplace(key, static_cast<Node>(nodes_.size()));
  if (is_new) nodes_.push_back(e);
  return at->second;
}

ProgramBuilder::Node ProgramBuilder::simplified(const Entry& e) {
  const int count = operands(e.op);
  if (is_constant(e.a) && (count < 2 || is_constant(e.b))) return constant(compute(e.op, e.number, value(e.a), count > 1 ? value(e.b) : 0));
  return add(e);
}

ProgramBuilder::Node ProgramBuilder::binary(Op op, Node a, Node b) {
  // Squares and whole powers have ranges of their own, tighter than products of unrelated factors.
  if (op == Op::kMultiply && a == b) return unary(Op::kSquare, a);
  if (op == Op::kPower && is_constant(b)) {
    const double n = value(b);
    if (n == 2) return unary(Op::kSquare, a);
    if (n == 1) return a;
    if (n == 0.5) return unary(Op::kSqrt, a);
    if (n == std::floor(n) && std::abs(n) <= 64) return whole_power(a, static_cast<int>(n));
  }
  if (op == Op::kMultiply && is_constant(a) && value(a) == 1) return b;
  if (op == Op::kMultiply && is_constant(b) && value(b) == 1) return a;
  if (op == Op::kAdd && is_constant(a) && value(a) == 0) return b;
  if ((op == Op::kAdd || op == Op::kSubtract) && is_constant(b) && value(b) == 0) return a;
  return simplified({op, a, b, 0, 0});
}

std::shared_ptr<const Field> ProgramBuilder::build(Node root) const { return std::make_shared<ProgramField>(nodes_, root); }

namespace {

bool proved_empty(const Field& field, const Box3d& box, double iso) { return field.range(box).high < iso; }

// The box of those of 32³ parts that cannot be proved empty, by halving along all axes five times.
Box3d shrunk(const Field& field, const Box3d& box, double iso) {
  std::vector<Box3d> parts{box};
  for (int depth = 0; depth < 5; ++depth) {
    std::vector<Box3d> finer;
    for (const Box3d& part : parts) {
      const V3d middle = part.min + (part.max - part.min) / 2;
      for (int i = 0; i < 8; ++i) {
        Box3d child;
        for (int a = 0; a < 3; ++a) {
          child.min[a] = (i >> a) & 1 ? middle[a] : part.min[a];
          child.max[a] = (i >> a) & 1 ? part.max[a] : middle[a];
        }
        if (!proved_empty(field, child, iso)) finer.push_back(child);
      }
    }
    parts = std::move(finer);
  }
  Box3d result;
  for (const Box3d& part : parts) result.extendBy(part);
  return result;
}

}  // namespace

Box3d search_bounds(const Field& field, double iso) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  Box3d box(V3d(-inf), V3d(inf));
  // Powers of four outwards until the half-space beyond is proved empty, then halving towards the last that was not.
  for (int a = 0; a < 3; ++a)
    for (const int side : {-1, 1}) {
      const auto empty_beyond = [&](double at) {
        Box3d half = box;
        if (side > 0) half.min[a] = at;
        else half.max[a] = -at;
        return proved_empty(field, half, iso);
      };
      double out = 0;
      for (double at = 0x1p-20; at <= 0x1p60 && out == 0; at *= 4)
        if (empty_beyond(at)) out = at;
      if (out == 0) return {};
      double in = out > 0x1p-20 ? out / 4 : -out;
      if (in < 0)  // the solid may lie wholly on the other side
        while (empty_beyond(in) && in > -0x1p60) { out = in; in *= 4; }
      for (int i = 0; i < 40 && std::abs(out - in) > 1e-12 * std::abs(out); ++i) {
        const double middle = in + (out - in) / 2;
        (empty_beyond(middle) ? out : in) = middle;
      }
      (side > 0 ? box.max : box.min)[a] = side * out;
    }
  for (int a = 0; a < 3; ++a)
    if (!(box.min[a] < box.max[a])) return {};
  for (int round = 0; round < 3; ++round) {
    const Box3d finer = shrunk(field, box, iso);
    if (finer.isEmpty()) break;
    box = finer;
  }
  return box;
}

}  // namespace texel
