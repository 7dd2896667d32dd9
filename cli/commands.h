#pragma once
// One function per command; each returns the exit status or throws Error.
#include <set>
#include <string>

#include "cli/options.h"

namespace texel {

[[nodiscard]] int command_bake(const Settings& settings);
[[nodiscard]] int command_batch(const Settings& settings);
[[nodiscard]] int command_info(const Settings& settings);
[[nodiscard]] int command_check(const Settings& settings);
[[nodiscard]] int command_view(const Settings& settings);
[[nodiscard]] int command_compare(const Settings& settings);

// The one input of a command that takes one. Throws Error{kCommandLine}.
[[nodiscard]] const std::string& only_input(const Settings& settings, const char* what);

}  // namespace texel
