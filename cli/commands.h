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
[[nodiscard]] int command_bench(const Settings& settings);
// One run of a bench, in a process of its own (cli/bench_run.h).
[[nodiscard]] int command_bench_run(const std::vector<std::string>& arguments);

// The one input of a command that takes one. Throws Error{kCommandLine}.
[[nodiscard]] const std::string& only_input(const Settings& settings, const char* what);

}  // namespace texel
