#pragma once
// What the program says about itself; the option lists come from the table (options.h).
#include <string>

#include "cli/options.h"

namespace texel {

[[nodiscard]] std::string basics_text();                // `texel` without arguments
[[nodiscard]] std::string program_help();               // `texel --help`
[[nodiscard]] std::string command_help(Command command);
[[nodiscard]] std::string version_text();
[[nodiscard]] std::string cli_document();               // docs/cli.md

}  // namespace texel
