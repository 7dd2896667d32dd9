#pragma once
// A typed expression in x, y, z -> Field. Grammar and functions: docs/inputs.md.
#include <memory>
#include <string>
#include <string_view>

#include "formats/error.h"
#include "formats/field.h"
#include "formats/program.h"

namespace texel {

// Where a text came from, for messages: "WHERE:COLUMN: what is wrong", columns from 1.
struct ExpressionSource {
  std::string where = "--implicit";
  Code code = Code::kCommandLine;
};

// The function the text stands for. Its gradient is by forward differentiation, exact to rounding (0 for floor and sign; of min and max that
// of the operand taken); its range by interval arithmetic. Bounds are empty where intervals cannot prove any.
// Throws Error{source.code}. Bounded: 64 KiB of text, 200 levels of nesting, ProgramBuilder::kMostNodes operations.
[[nodiscard]] std::shared_ptr<const Field> read_expression(std::string_view text, const ExpressionSource& source = {});

// The same as a node of a larger program, of the point whose coordinates are the three nodes.
[[nodiscard]] ProgramBuilder::Node read_expression(std::string_view text, const ExpressionSource& source, ProgramBuilder& builder,
                                                   const ProgramBuilder::Node point[3]);

}  // namespace texel
