// Dispatch and exit status. Nothing heavy is loaded or set up before a command is known to be right.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <optional>
#include <stdexcept>

#include "cli/commands.h"
#include "cli/help.h"
#include "cli/interrupt.h"
#include "cli/print.h"
#include "cli/scene_settings.h"
#include "formats/error.h"

namespace texel {
namespace {

int run(Command command, const std::vector<std::string>& arguments) {
  Settings settings = parse_options(command, arguments);
  if (settings.help) {
    print_product(command_help(command));
    return 0;
  }
  catch_interrupts();
  if (command == kBake || command == kView || command == kBench) settings = with_scene_recipes(command, std::move(settings));
  switch (command) {
    case kBake: return command_bake(settings);
    case kBatch: return command_batch(settings);
    case kInfo: return command_info(settings);
    case kCheck: return command_check(settings);
    case kView: return command_view(settings);
    case kCompare: return command_compare(settings);
    case kBench: return command_bench(settings);
  }
  return 0;
}

std::optional<Command> command_of(const std::string& word) {
  if (word == "bake") return kBake;
  if (word == "batch") return kBatch;
  if (word == "info") return kInfo;
  if (word == "check") return kCheck;
  if (word == "view") return kView;
  if (word == "compare") return kCompare;
  if (word == "bench") return kBench;
  return std::nullopt;
}

int dispatch(const std::vector<std::string>& arguments) {
  if (arguments.empty()) {
    print_product(basics_text());
    return 0;
  }
  const std::string& word = arguments.front();
  const std::vector<std::string> rest(arguments.begin() + 1, arguments.end());
  if (word == "help" && rest.size() == 1 && command_of(rest.front())) return run(*command_of(rest.front()), {"--help"});
  if (const auto command = command_of(word)) return run(*command, rest);
  if (word == "--version" || word == "-V") print_product(version_text());
  else if (word == "--help" || word == "-h" || word == "help") print_product(program_help());
  else if (word == "--dump-docs") print_product(cli_document());
  else if (word == "bench-run") return command_bench_run(rest);
  else if (word == "convert")
    throw Error(Code::kUnsupported, word, "not supported in this version");
  else throw Error(Code::kCommandLine, word, "unknown command", "commands are bake, batch, bench, info, check, compare and view; see `texel --help`");
  return 0;
}

int fail(Code code, const std::string& text) {
  print_error(text);
  return static_cast<int>(code);
}

}  // namespace

const std::string& only_input(const Settings& settings, const char* what) {
  if (settings.inputs.size() != 1)
    throw Error(Code::kCommandLine, "", std::string("needs one ") + what + " (got " + std::to_string(settings.inputs.size()) + ")", "see --help");
  return settings.inputs.front();
}

}  // namespace texel

namespace texel {
namespace {

int guarded(int argc, char** argv) {
  try {
    return dispatch({argv + (argc > 0 ? 1 : 0), argv + argc});
  } catch (const Error& error) {
    return fail(error.code, error.what());
  } catch (const std::bad_alloc&) {
    return fail(Code::kRunning, "out of memory; lower the resolution or --samples");
  } catch (const std::length_error&) {  // a container asked for more than there can be
    return fail(Code::kRunning, "out of memory; lower the resolution or --samples");
  } catch (const std::exception& error) {
    return fail(Code::kRunning, std::string("unexpected: ") + error.what() + "; please report this");
  }
}

}  // namespace
}  // namespace texel

int main(int argc, char** argv) {
  const int status = texel::guarded(argc, argv);
  // All files are closed. Taking libraries and memory apart piece by piece, as returning would, is 5 % of a small bake's time.
  std::fflush(nullptr);
  std::_Exit(status);
}
