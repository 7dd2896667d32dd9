// Expressions: what they mean, their gradients, their ranges, their bounds, and what is said about bad ones.
#include "formats/expression.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "formats/interval.h"
#include "tests/bake/bake_util.h"

namespace texel::test {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

double value_of(const Field& field, const V3d& p) {
  double f = 0;
  field.values(1, &p.x, &p.y, &p.z, &f);
  return f;
}
double value_of(const std::string& text, const V3d& p = V3d(0.3, -1.25, 2.5)) { return value_of(*read_expression(text), p); }

TEST(Expression, Values) {
  const double x = 0.3, y = -1.25, z = 2.5;
  const auto mod = [](double a, double b) { return a - b * std::floor(a / b); };
  const std::vector<std::pair<const char*, double>> cases = {
      {"1", 1},
      {"x", x},
      {"x + y*z", x + y * z},
      {"x - y - z", x - y - z},
      {"z/y/x", z / y / x},
      {"-x^2", -(x * x)},
      {"(-x)^2", x * x},
      {"2^3^2", 512},
      {"z^-2", 1 / (z * z)},
      {"z^0.5", std::sqrt(z)},
      {"z^x", std::pow(z, x)},
      {"pow(y, 3)", y * y * y},
      {"--x", x},
      {"+x", x},
      {"1.5e1 + .5", 15.5},
      {"sin(x) + cos(y) + tan(z)", std::sin(x) + std::cos(y) + std::tan(z)},
      {"asin(x) + acos(x) + atan(z)", std::asin(x) + std::acos(x) + std::atan(z)},
      {"atan2(y, x)", std::atan2(y, x)},
      {"exp(x) + log(z) + sqrt(z)", std::exp(x) + std::log(z) + std::sqrt(z)},
      {"abs(y) + sign(y) + floor(y) + ceil(y)", 1.25 - 1 - 2 - 1},
      {"fract(y)", 0.75},
      {"mod(y, 0.5)", mod(y, 0.5)},
      {"mod(z, -0.4)", mod(z, -0.4)},
      {"min(x, y, z) + max(x, y)", y + x},
      {"clamp(z, 0, 1)", 1},
      {"mix(x, y, 0.25)", x + (y - x) * 0.25},
      {"step(0.3, x) + 10*step(x, 0.29)", 1},
      {"smoothstep(0, 1, x)", x * x * (3 - 2 * x)},
      {"smoothstep(0, 1, y) + smoothstep(0, 1, z)", 1},
      {"length(x, y) + hypot(x, y, z)", std::sqrt(x * x + y * y) + std::sqrt(x * x + y * y + z * z)},
      {"pi + e", std::numbers::pi + std::numbers::e},
      {"r = length(x, y, z); s = r*r; s - r", x * x + y * y + z * z - std::sqrt(x * x + y * y + z * z)},
      {"noise(1, 2, 3)", 0},  // 0 at lattice points
  };
  // Roundings of at most some ten operations.
  for (const auto& [text, expected] : cases) EXPECT_NEAR(value_of(text), expected, 4e-15 * (1 + std::abs(expected))) << text;
  EXPECT_NE(value_of("noise(x, y, z)"), value_of("noise(x, y, z, 7)"));
  for (const char* text : {"sqrt(y)", "log(y)", "asin(z)", "y^0.3", "0/0*x", "min(sqrt(y), 1)", "max(1, sqrt(y))", "clamp(sqrt(y), 0, 1)", "smoothstep(0, 1, sqrt(y))"})
    EXPECT_TRUE(std::isnan(value_of(text))) << text;
}

TEST(Expression, ManyPointsAreEachOnItsOwn) {
  const auto field = read_expression("sin(3*x) * exp(y) - noise(x, y, z) / (1.1 + cos(z))");
  Random random(1);
  const std::size_t n = 1000;  // more than a batch, not a multiple of it
  std::vector<double> x(n), y(n), z(n), f(n), g(n), gx(n), gy(n), gz(n);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = random.uniform(-2, 2);
    y[i] = random.uniform(-2, 2);
    z[i] = random.uniform(-2, 2);
  }
  field->values(n, x.data(), y.data(), z.data(), f.data());
  field->gradients(n, x.data(), y.data(), z.data(), g.data(), gx.data(), gy.data(), gz.data());
  EXPECT_EQ(f, g);
  for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(f[i], value_of(*field, V3d(x[i], y[i], z[i])));
}

TEST(Expression, GradientsAgainstDifferences) {
  const char* texts[] = {"x*y + y*z*z",   "x/(2 + y)",          "sqrt(4 + x*y)",         "sin(x*y) - cos(z*x)", "tan(0.3*x)",      "asin(0.4*x) + acos(0.3*y)", "atan(x*y) + atan2(y + 3, x)",
                         "exp(x*z)",      "log(3 + x*y)",       "abs(x - 5)",            "x^3 - y^5 + z^-2",    "(2 + x*x)^(y*z)", "smoothstep(-2, 2, x*y)",    "mod(x, 7) + fract(0.01*y)",
                         "min(x, y + 9)", "max(x*x, y*y - 40)", "length(x - 7, y, z)",   "clamp(x, -3, 3)*z",   "mix(x, y, z)",    "noise(x, 0.7*y, z)",        "a = x*y; b = sin(a); a*b + b*b"};
  Random random(2);
  for (const char* text : texts) {
    const auto field = read_expression(text);
    for (int i = 0; i < 50; ++i) {
      const V3d p(random.uniform(0.2, 1.4), random.uniform(0.2, 1.4), random.uniform(0.2, 1.4));
      double f = 0;
      V3d g;
      field->gradients(1, &p.x, &p.y, &p.z, &f, &g.x, &g.y, &g.z);
      for (int a = 0; a < 3; ++a) {
        V3d up = p, down = p;
        constexpr double h = 1e-5;  // central differences: h² times a third derivative, and rounding/h: some 1e-9 each
        up[a] += h;
        down[a] -= h;
        const double slope = (value_of(*field, up) - value_of(*field, down)) / (2 * h);
        EXPECT_NEAR(g[a], slope, 2e-8 * (1 + std::abs(slope))) << text << " at " << p;
      }
    }
  }
}

// A random expression of every operation there is.
std::string random_expression(Random& random, int depth) {
  const auto sub = [&] { return random_expression(random, depth - 1); };
  if (depth == 0) {
    const char* leaves[] = {"x", "y", "z", "1", "0", "-2", "0.5", "3", "pi"};
    return leaves[random.bits() % 9];
  }
  const char* one[] = {"sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sqrt", "abs", "floor", "ceil", "fract", "sign"};
  const char* two[] = {"atan2", "min", "max", "mod", "pow", "step", "length"};
  const char* infix[] = {"+", "-", "*", "/"};
  switch (random.bits() % 8) {
    case 0: return std::string(one[random.bits() % 14]) + "(" + sub() + ")";
    case 1: return std::string(two[random.bits() % 7]) + "(" + sub() + ", " + sub() + ")";
    case 2: return "(" + sub() + ")^" + std::to_string(static_cast<int>(random.bits() % 7) - 2);
    case 3: return "noise(" + sub() + ", " + sub() + ", " + sub() + ")";
    case 4: return "smoothstep(" + sub() + ", " + sub() + ", " + sub() + ")";
    default: return "(" + sub() + " " + infix[random.bits() % 4] + " " + sub() + ")";
  }
}

// Whatever is computed at a point of a box lies in the range over the box; NaN only where the range says that nothing is known.
TEST(Expression, RangesHoldEveryValue) {
  Random random(3);
  std::int64_t checked = 0, known = 0, boxes = 0;
  for (int i = 0; i < 6000; ++i) {
    const std::string text = random_expression(random, 1 + static_cast<int>(random.bits() % 4));
    const auto field = read_expression(text);
    for (int b = 0; b < 4; ++b) {
      Box3d box;
      const double size = std::pow(10.0, random.uniform(-6, 1.5));
      for (int a = 0; a < 3; ++a) {
        const double from = random.bits() % 4 == 0 ? 0 : random.uniform(-5, 5);
        box.min[a] = random.bits() % 2 ? from : from - size;
        box.max[a] = box.min[a] + size;
      }
      const Interval range = field->range(box);
      ++boxes;
      if (std::isnan(range.low) || std::isnan(range.high)) continue;
      ++known;
      ASSERT_LE(range.low, range.high) << text;
      for (int k = 0; k < 30; ++k) {
        V3d p;
        for (int a = 0; a < 3; ++a) p[a] = k < 8 ? ((k >> a) & 1 ? box.max[a] : box.min[a]) : std::clamp(random.uniform(box.min[a], box.max[a]), box.min[a], box.max[a]);
        const double f = value_of(*field, p);
        ++checked;
        ASSERT_TRUE(f >= range.low && f <= range.high) << text << " is " << f << " at " << p << ", outside [" << range.low << ", " << range.high << "]";
      }
    }
  }
  EXPECT_GT(known, boxes / 3);
  std::printf("%lld values in %lld known of %lld ranges\n", static_cast<long long>(checked), static_cast<long long>(known), static_cast<long long>(boxes));
}

TEST(Expression, RangesOfUndefinedParts) {
  const auto range = [](const char* text, double low, double high) { return read_expression(text)->range(Box3d(V3d(low, 1, 1), V3d(high, 2, 2))); };
  for (const char* text : {"1/x", "x/x", "sqrt(x)", "log(x)", "x^0.5", "x^-1", "tan(2*x)", "sqrt(x) - sqrt(x) + 1", "max(sqrt(x), 5)", "exp(800 + x)", "acos(3*x)"})
    EXPECT_TRUE(std::isnan(range(text, -1, 1).low)) << text;
  EXPECT_FALSE(std::isnan(range("1/x", 0.5, 1).low));
  const Interval square = range("x*x", -2, 1);  // one factor, not two
  EXPECT_EQ(square.low, 0);
  EXPECT_NEAR(square.high, 4, 1e-15 * 16);
  const Interval root = range("sqrt(x*x + y*y)", 0, 1);
  EXPECT_NEAR(root.low, 1, 1e-14);
}

TEST(Expression, BoundsOfWhatIsBounded) {
  const auto bounds = [](const char* text, double iso = 0) { return read_expression(text)->bounds(iso); };
  const Box3d ball = bounds("1 - x*x - (y - 3)^2 - z*z");
  for (int a = 0; a < 3; ++a) {
    // Never smaller than the ball; found by halving to 1e-12 of the distance.
    EXPECT_LE(ball.min[a], (a == 1 ? 2 : -1) + 1e-15);
    EXPECT_GE(ball.max[a], (a == 1 ? 4 : 1) - 1e-15);
    EXPECT_NEAR(ball.min[a], a == 1 ? 2 : -1, 1e-10);
    EXPECT_NEAR(ball.max[a], a == 1 ? 4 : 1, 1e-10);
  }
  const Box3d far = bounds("1e-3 - length(x + 1000, y, z)");
  EXPECT_NEAR(far.min.x, -1000.001, 1e-6);
  EXPECT_NEAR(far.max.x, -999.999, 1e-6);
  const Box3d torus = bounds("0.25 - length(length(x, y) - 0.75, z)");
  EXPECT_NEAR(torus.max.x, 1, 0.01);
  EXPECT_NEAR(torus.max.z, 0.25, 0.01);
  EXPECT_GE(torus.max.z, 0.25);
  for (const char* text : {"x", "1 - x*x - y*y", "sin(x) + sin(y) + sin(z)", "1", "1/x", "-1"}) EXPECT_TRUE(bounds(text).isEmpty()) << text;
}

std::string fault(const std::string& text) {
  try {
    (void)read_expression(text);
  } catch (const Error& e) {
    EXPECT_EQ(e.code, Code::kCommandLine);
    return e.what();
  }
  return "no error";
}

TEST(Expression, SaysWhatIsWrongAndWhere) {
  EXPECT_EQ(fault(""), "--implicit:1: ends too early; expected a number, a name or \"(\"");
  EXPECT_EQ(fault("1 +"), "--implicit:4: ends too early; expected a number, a name or \"(\"");
  EXPECT_EQ(fault("1 + * 2"), "--implicit:5: unexpected \"*\"; expected a number, a name or \"(\"");
  EXPECT_EQ(fault("(x + 1"), "--implicit:1: this \"(\" is never closed; add \")\"");
  EXPECT_EQ(fault("x + 1)"), "--implicit:6: unexpected \")\"; expected an operator or the end");
  EXPECT_EQ(fault("2x"), "--implicit:2: unexpected \"x\"; expected an operator: 2x is written 2*x");
  EXPECT_EQ(fault("x ** 2"), "--implicit:3: unexpected \"**\"; write ^ for powers");
  EXPECT_EQ(fault("x + foo"), "--implicit:5: unknown name \"foo\"; known: x, y, z, pi, e, the functions and what is set before by NAME = ...;");
  EXPECT_TRUE(fault("sinn(x)").starts_with("--implicit:1: unknown function \"sinn\"; known: sin, cos, "));
  EXPECT_EQ(fault("sin x"), "--implicit:5: unexpected \"x\"; expected \"(\" after \"sin\"");
  EXPECT_EQ(fault("sin()"), "--implicit:5: unexpected \")\"; expected a number, a name or \"(\"");
  EXPECT_EQ(fault("sin(x, y)"), "--implicit:1: sin has 2 arguments; it takes 1");
  EXPECT_EQ(fault("length(x)"), "--implicit:1: length has 1 argument; it takes 2 to 3");
  EXPECT_EQ(fault("noise(x, y, z, x)"), "--implicit:16: the seed is not a whole number from 0 to 4294967295; give a plain number");
  EXPECT_EQ(fault("1e999"), "--implicit:1: number out of range (1e999); the largest is about 1.8e308");
  EXPECT_EQ(fault("x < 1"), "--implicit:3: unexpected \"<\"; expected an operator or the end");
  EXPECT_EQ(fault("x\x01"), "--implicit:2: unexpected byte 0x01; expected an operator or the end");
  EXPECT_EQ(fault("a = 1"), "--implicit:6: ends too early; expected \";\" after the value of \"a\"");
  EXPECT_EQ(fault("x = 1; x"), "--implicit:1: \"x\" has a meaning already; choose another name");
  EXPECT_EQ(fault(std::string(1000, '(') + "x"), "--implicit:201: is nested more than 200 deep; take it apart with names: a = ...; ...");
  std::string tower = "x";
  for (int i = 0; i < 1000; ++i) tower += "^x";
  EXPECT_EQ(fault(tower), "--implicit:400: is nested more than 200 deep; take it apart with names: a = ...; ...");
  EXPECT_EQ(fault(std::string(1000, '-') + "x"), "no error");
  EXPECT_EQ(fault(std::string(70000, ' ')), "--implicit:1: is longer than 65536 characters; shorten it");
}

}  // namespace
}  // namespace texel::test
