#include "formats/expression.h"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <vector>

namespace texel {
namespace {

constexpr std::size_t kMostText = 65536;
constexpr int kMostDepth = 200;

using Node = ProgramBuilder::Node;

struct Function {
  const char* name;
  int least, most;  // arguments
};
constexpr Function kFunctions[] = {
    {"sin", 1, 1},   {"cos", 1, 1},  {"tan", 1, 1},   {"asin", 1, 1},  {"acos", 1, 1},  {"atan", 1, 1},       {"atan2", 2, 2},
    {"exp", 1, 1},   {"log", 1, 1},  {"sqrt", 1, 1},  {"abs", 1, 1},   {"floor", 1, 1}, {"ceil", 1, 1},       {"fract", 1, 1},
    {"sign", 1, 1},  {"min", 2, 16}, {"max", 2, 16},  {"mod", 2, 2},   {"pow", 2, 2},   {"clamp", 3, 3},      {"mix", 3, 3},
    {"step", 2, 2},  {"smoothstep", 3, 3},            {"length", 2, 3}, {"hypot", 2, 3}, {"noise", 3, 4},
};

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

class Parser {
 public:
  Parser(std::string_view text, const ExpressionSource& source, ProgramBuilder& builder, const Node point[3])
      : text_(text), source_(source), build_(builder), point_{point[0], point[1], point[2]} {}

  // [NAME = sum ;]… sum
  Node parse() {
    if (text_.size() > kMostText) fail(0, "is longer than " + std::to_string(kMostText) + " characters", "shorten it");
    for (;;) {
      skip_space();
      const std::size_t start = at_;
      std::string name = word();
      skip_space();
      if (name.empty() || peek() != '=') {
        at_ = start;
        break;
      }
      if (known(name)) fail(start, "\"" + name + "\" has a meaning already", "choose another name");
      ++at_;
      const Node value = sum();
      skip_space();
      if (peek() != ';') fail_here("\";\" after the value of \"" + name + "\"");
      ++at_;
      names_.emplace_back(std::move(name), value);
    }
    const Node result = sum();
    skip_space();
    if (at_ < text_.size()) fail_here("an operator or the end");
    return result;
  }

 private:
  [[noreturn]] void fail(std::size_t at, const std::string& what, const std::string& hint) const {
    throw Error(source_.code, source_.where + ":" + std::to_string(at + 1), what, hint);
  }
  [[noreturn]] void fail_here(const std::string& wanted) const {
    if (at_ >= text_.size()) fail(at_, "ends too early", "expected " + wanted);
    const char c = text_[at_];
    const bool plain = c > ' ' && c < 0x7f;
    char code[8];
    std::snprintf(code, sizeof code, "0x%02x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    fail(at_, std::string("unexpected ") + (plain ? "\"" + std::string(1, c) + "\"" : "byte " + std::string(code)), "expected " + wanted);
  }

  void skip_space() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  }
  [[nodiscard]] char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  std::string word() {
    const std::size_t start = at_;
    if (is_letter(peek()))
      while (is_letter(peek()) || is_digit(peek())) ++at_;
    return std::string(text_.substr(start, at_ - start));
  }
  [[nodiscard]] bool known(const std::string& name) const {
    for (const Function& f : kFunctions)
      if (name == f.name) return true;
    for (const auto& [known_name, node] : names_)
      if (name == known_name) return true;
    return name == "x" || name == "y" || name == "z" || name == "pi" || name == "e";
  }

  struct Deeper {
    explicit Deeper(Parser& p) : parser(p) {
      if (++parser.depth_ > kMostDepth) parser.fail(parser.at_, "is nested more than " + std::to_string(kMostDepth) + " deep", "take it apart with names: a = ...; ...");
      if (parser.build_.is_full()) parser.fail(parser.at_, "has too many operations", "shorten it");
    }
    ~Deeper() { --parser.depth_; }
    Deeper(const Deeper&) = delete;
    Deeper& operator=(const Deeper&) = delete;
    Parser& parser;
  };

  Node sum() {
    const Deeper deeper(*this);
    Node left = product();
    for (;;) {
      skip_space();
      const char c = peek();
      if (c != '+' && c != '-') return left;
      ++at_;
      left = build_.binary(c == '+' ? Op::kAdd : Op::kSubtract, left, product());
    }
  }
  Node product() {
    Node left = signed_power();
    for (;;) {
      skip_space();
      const char c = peek();
      if (c != '*' && c != '/') return left;
      if (text_.substr(at_, 2) == "**") fail(at_, "unexpected \"**\"", "write ^ for powers");
      ++at_;
      const Node right = signed_power();
      left = build_.binary(c == '*' ? Op::kMultiply : Op::kDivide, left, right);
    }
  }
  // −x^2 is −(x²), as in mathematics; x^−2 and x^y^z = x^(y^z) work too.
  Node signed_power() {
    bool negative = false;
    for (skip_space(); peek() == '-' || peek() == '+'; skip_space()) negative = negative != (text_[at_++] == '-');
    Node value = primary();
    skip_space();
    if (peek() == '^') {
      const Deeper deeper(*this);
      ++at_;
      value = build_.binary(Op::kPower, value, signed_power());
    }
    return negative ? build_.unary(Op::kNegate, value) : value;
  }
  Node primary() {
    skip_space();
    const char c = peek();
    if (is_digit(c) || c == '.') return number();
    if (c == '(') {
      const std::size_t open = at_++;
      const Node value = sum();
      skip_space();
      if (peek() != ')') at_ >= text_.size() ? fail(open, "this \"(\" is never closed", "add \")\"") : fail_here("an operator or \")\"");
      ++at_;
      return value;
    }
    if (is_letter(c)) return named();
    fail_here("a number, a name or \"(\"");
  }
  Node number() {
    double value = 0;
    const char* start = text_.data() + at_;
    const auto [stop, error] = std::from_chars(start, text_.data() + text_.size(), value);
    const std::string shown(start, static_cast<std::size_t>(stop - start));
    if (error == std::errc::result_out_of_range) fail(at_, "number out of range (" + shown + ")", "the largest is about 1.8e308");
    if (error != std::errc{}) fail_here("a number");
    at_ += static_cast<std::size_t>(stop - start);
    if (is_letter(peek())) fail_here("an operator: 2x is written 2*x");
    return build_.constant(value);
  }
  Node named() {
    const std::size_t start = at_;
    const std::string name = word();
    skip_space();
    for (const Function& f : kFunctions)
      if (name == f.name) return call(f, start);
    if (peek() == '(') fail(start, "unknown function \"" + name + "\"", "known: " + function_names());
    if (name.size() == 1 && name[0] >= 'x' && name[0] <= 'z') return point_[static_cast<std::size_t>(name[0] - 'x')];
    if (name == "pi") return build_.constant(std::numbers::pi);
    if (name == "e") return build_.constant(std::numbers::e);
    for (const auto& [known_name, node] : names_)
      if (name == known_name) return node;
    fail(start, "unknown name \"" + name + "\"", "known: x, y, z, pi, e, the functions and what is set before by NAME = ...;");
  }
  static std::string function_names() {
    std::string names;
    for (const Function& f : kFunctions) names += (names.empty() ? "" : ", ") + std::string(f.name);
    return names;
  }

  Node call(const Function& f, std::size_t start) {
    if (peek() != '(') fail_here("\"(\" after \"" + std::string(f.name) + "\"");
    const std::size_t open = at_++;
    std::vector<Node> a;
    std::vector<std::size_t> places;
    for (;;) {
      skip_space();
      places.push_back(at_);
      a.push_back(sum());
      skip_space();
      if (peek() == ',') {
        ++at_;
        continue;
      }
      if (peek() == ')') break;
      at_ >= text_.size() ? fail(open, "this \"(\" is never closed", "add \")\"") : fail_here("\",\" or \")\"");
    }
    ++at_;
    const int n = static_cast<int>(a.size());
    if (n < f.least || n > f.most)
      fail(start, std::string(f.name) + " has " + std::to_string(n) + (n == 1 ? " argument" : " arguments"),
           "it takes " + std::to_string(f.least) + (f.most > f.least ? " to " + std::to_string(f.most) : ""));
    return apply(f.name, a, places);
  }

  Node apply(std::string_view name, const std::vector<Node>& a, const std::vector<std::size_t>& places) {
    constexpr std::pair<const char*, Op> kUnary[] = {{"sin", Op::kSin},   {"cos", Op::kCos},   {"tan", Op::kTan}, {"asin", Op::kAsin}, {"acos", Op::kAcos},   {"atan", Op::kAtan},
                                                     {"exp", Op::kExp},   {"log", Op::kLog},   {"sqrt", Op::kSqrt}, {"abs", Op::kAbs}, {"floor", Op::kFloor}, {"sign", Op::kSign}};
    for (const auto& [word, op] : kUnary)
      if (name == word) return build_.unary(op, a[0]);
    constexpr std::pair<const char*, Op> kBinary[] = {{"atan2", Op::kAtan2}, {"mod", Op::kModulo}, {"pow", Op::kPower}};
    for (const auto& [word, op] : kBinary)
      if (name == word) return build_.binary(op, a[0], a[1]);
    if (name == "min" || name == "max") {
      Node r = a[0];
      for (std::size_t i = 1; i < a.size(); ++i) r = build_.binary(name == "min" ? Op::kMin : Op::kMax, r, a[i]);
      return r;
    }
    const auto minus = [&](Node v, Node w) { return build_.binary(Op::kSubtract, v, w); };
    if (name == "ceil") return build_.unary(Op::kNegate, build_.unary(Op::kFloor, build_.unary(Op::kNegate, a[0])));
    if (name == "fract") return build_.binary(Op::kModulo, a[0], build_.constant(1));
    if (name == "clamp") return build_.binary(Op::kMin, build_.binary(Op::kMax, a[0], a[1]), a[2]);
    if (name == "mix") return build_.binary(Op::kAdd, a[0], build_.binary(Op::kMultiply, minus(a[1], a[0]), a[2]));
    if (name == "step") {  // 0 below the edge a[0], 1 from it on
      const Node one = build_.constant(1);
      const Node below = build_.unary(Op::kSign, build_.binary(Op::kMax, minus(a[0], a[1]), build_.constant(0)));
      return minus(one, below);
    }
    if (name == "smoothstep") return build_.unary(Op::kFade, build_.binary(Op::kDivide, minus(a[2], a[0]), minus(a[1], a[0])));
    if (name == "length" || name == "hypot") {
      Node r = build_.unary(Op::kSquare, a[0]);
      for (std::size_t i = 1; i < a.size(); ++i) r = build_.binary(Op::kAdd, r, build_.unary(Op::kSquare, a[i]));
      return build_.unary(Op::kSqrt, r);
    }
    std::uint32_t seed = 0;  // noise
    if (a.size() == 4) {
      const double value = build_.is_constant(a[3]) ? build_.value(a[3]) : -1;
      if (!(value >= 0 && value <= 4294967295.0 && value == std::floor(value))) fail(places[3], "the seed is not a whole number from 0 to 4294967295", "give a plain number");
      seed = static_cast<std::uint32_t>(value);
    }
    return build_.noise(a[0], a[1], a[2], seed);
  }

  std::string_view text_;
  const ExpressionSource& source_;
  ProgramBuilder& build_;
  std::array<Node, 3> point_;
  std::vector<std::pair<std::string, Node>> names_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

Node read_expression(std::string_view text, const ExpressionSource& source, ProgramBuilder& builder, const Node point[3]) {
  return Parser(text, source, builder, point).parse();
}

std::shared_ptr<const Field> read_expression(std::string_view text, const ExpressionSource& source) {
  ProgramBuilder builder;
  const Node point[3] = {builder.coordinate(0), builder.coordinate(1), builder.coordinate(2)};
  return builder.build(read_expression(text, source, builder, point));
}

}  // namespace texel
