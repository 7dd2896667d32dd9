#pragma once
// A function of x, y, z as a list of operations: built node by node, then run over many points, with gradients, or over a box.
#include <cstdint>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "formats/field.h"

namespace texel {

enum class Op : std::uint8_t {
  kX, kY, kZ, kConstant,
  // one operand
  kNegate, kAbs, kSqrt, kSquare, kSin, kCos, kTan, kAsin, kAcos, kAtan, kExp, kLog, kFloor, kSign,
  kFade,        // 3t² − 2t³ of t limited to [0, 1]
  kWholePower,  // to the power `number`, a whole one
  // two
  kAdd, kSubtract, kMultiply, kDivide, kPower, kAtan2, kMin, kMax,
  kModulo,      // a − b·floor(a/b)
  // three
  kNoise,       // formats/noise.h with the seed `number`
};

// Nodes are numbers; equal ones are one. What needs no coordinate is computed at once.
class ProgramBuilder {
 public:
  using Node = std::uint32_t;
  static constexpr std::size_t kMostNodes = 200000;

  [[nodiscard]] Node coordinate(int axis) { return add({static_cast<Op>(axis), 0, 0, 0, 0}); }
  [[nodiscard]] Node constant(double value) { return add({Op::kConstant, 0, 0, 0, value}); }
  [[nodiscard]] Node unary(Op op, Node a) { return simplified({op, a, 0, 0, 0}); }
  [[nodiscard]] Node binary(Op op, Node a, Node b);
  [[nodiscard]] Node whole_power(Node a, int n) { return simplified({Op::kWholePower, a, 0, 0, static_cast<double>(n)}); }
  [[nodiscard]] Node noise(Node a, Node b, Node c, std::uint32_t seed) { return add({Op::kNoise, a, b, c, static_cast<double>(seed)}); }

  [[nodiscard]] bool is_constant(Node a) const { return nodes_[a].op == Op::kConstant; }
  [[nodiscard]] double value(Node a) const { return nodes_[a].number; }
  [[nodiscard]] bool is_full() const { return nodes_.size() >= kMostNodes; }

  // The function whose value is `root`. Its bounds are searched for by interval arithmetic when asked for.
  [[nodiscard]] std::shared_ptr<const Field> build(Node root) const;

  struct Entry {
    Op op;
    Node a, b, c;
    double number;
  };

 private:
  Node add(const Entry& entry);
  Node simplified(const Entry& entry);

  std::vector<Entry> nodes_;
  std::map<std::tuple<Op, Node, Node, Node, std::uint64_t>, Node> known_;
};

// Where range() cannot prove f < iso: half-spaces first, then ever finer boxes. Empty: not bounded, as far as intervals tell.
[[nodiscard]] Box3d search_bounds(const Field& field, double iso);

}  // namespace texel
