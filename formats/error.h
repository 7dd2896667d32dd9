#pragma once
// What goes wrong and how it is said.
#include <stdexcept>
#include <string>
#include <utility>

namespace texel {

// The exit status of the program, and the kind of an Error. Stable: scripts rely on the numbers.
enum class Code {
  kOk = 0,
  kCommandLine = 1,   // wrong command line or recipe
  kFile = 2,          // a file can't be read or written
  kBadInput = 3,      // the input is malformed or holds nothing to bake
  kRunning = 4,       // out of memory, disk full, interrupted
  kUnsupported = 5,   // not supported in this build
  kSomeFailed = 6,    // batch: some items failed
  kDifference = 7,    // compare, check: more than allowed
};

// Thrown by readers, writers and option checks only; dirty geometry is an Issue in the Report instead.
// Printed as `texel: error: WHERE: MESSAGE; HINT` on one line.
struct Error : std::runtime_error {
  Error(Code c, std::string w, std::string m, std::string h = {})
      : std::runtime_error((w.empty() ? m : w + ": " + m) + (h.empty() ? "" : "; " + h)),
        code(c), where(std::move(w)), message(std::move(m)), hint(std::move(h)) {}
  Code code;
  std::string where;    // FILE, FILE:LINE or an option; may be empty
  std::string message;  // what is wrong, with the value found
  std::string hint;     // what to do; may be empty
};

}  // namespace texel
