#include "cli/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "cli/recipe_file.h"
#include "formats/error.h"

namespace texel {
namespace {

const char* command_name(Command command) {
  switch (command) {
    case kBake: return "bake";
    case kInfo: return "info";
    case kCheck: return "check";
    case kView: return "view";
    case kBatch: return "batch";
    case kCompare: return "compare";
    case kBench: return "bench";
  }
  return "";
}

std::string see_help(Command command) { return std::string("see `texel ") + command_name(command) + " --help`"; }

// Letters to insert, delete or exchange between the two words.
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

Error unknown_option(Command command, const std::string& word, const std::vector<OptionRow>& rows) {
  const std::string bare = word.substr(0, std::min(word.find('='), word.size()));
  if (bare.empty() || bare[0] != '-')
    return Error(Code::kCommandLine, word, "one argument too many", see_help(command));
  std::string near;
  for (const OptionRow& row : rows)
    if (bare.size() > 3 && row.flag().starts_with(bare)) return Error(Code::kCommandLine, bare, "unknown option", "did you mean " + row.flag() + "?");
  std::size_t best = 3;  // more than two letters off is no misspelling
  for (const OptionRow& row : rows) {
    const std::size_t d = bare.size() < 100 ? distance(bare, row.flag()) : best;
    if (d < best) {
      best = d;
      near = row.flag();
    }
  }
  return Error(Code::kCommandLine, bare, "unknown option", near.empty() ? see_help(command) : "did you mean " + near + "?");
}

// Pairs that say the same thing in two ways.
constexpr const char* kClashes[][2] = {
    {"resolution", "voxel-size"}, {"samples", "max-error"}, {"box", "margin"}, {"mode", "truth"}, {"force", "plan"}};

}  // namespace

Settings parse_options(Command command, const std::vector<std::string>& arguments, std::set<std::string>* given, const std::function<void(Settings&)>& beneath) {
  std::vector<OptionRow> rows = option_table();
  std::erase_if(rows, [&](const OptionRow& row) { return (row.commands & command) == 0; });

  Settings settings;
  settings.words = arguments;
  CLI::App app;
  app.set_help_flag();
  std::vector<std::vector<std::string>> values(rows.size());
  std::vector<CLI::Option*> options(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const OptionRow& row = rows[i];
    const std::string names = (row.letter ? std::string("-") + row.letter + "," : "") + row.flag() + (command == kBench && std::string(row.name) == "output" ? ",--out" : "");
    options[i] = row.is_switch() ? app.add_flag(names) : app.add_option(names, values[i])->allow_extra_args(false);
  }
  app.add_option("INPUT", settings.inputs);
  try {
    app.allow_extras();
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::ArgumentMismatch& error) {
    const std::string text = error.what();  // "--name: 1 required TEXT missing"
    throw Error(Code::kCommandLine, text.substr(0, std::min(text.find(':'), text.size())), "needs a value", see_help(command));
  } catch (const CLI::ParseError& error) {
    throw Error(Code::kCommandLine, "", error.what(), see_help(command));
  }
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (std::string(rows[i].name) == "help" && options[i]->count() > 0) {
      settings.help = true;
      return settings;
    }
  if (const auto rest = app.remaining(); !rest.empty()) throw unknown_option(command, rest.front(), rows);
  for (const std::string& input : settings.inputs)
    if (input.empty()) throw Error(Code::kCommandLine, "INPUT", "is an empty name", see_help(command));

  std::set<std::string> names;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (options[i]->count() > 0) names.insert(rows[i].name);
  for (const auto& [a, b] : kClashes)
    if (names.contains(a) && names.contains(b))
      throw Error(Code::kCommandLine, std::string("--") + a + " and --" + b, "cannot be combined", "give one of them");

  const auto apply = [&](const OptionRow& row, const std::string& value) {
    if (!row.set(settings, value))
      throw Error(Code::kCommandLine, row.flag(), "bad value \"" + value + "\"",
                  row.accepts.empty() ? see_help(command) : "accepted: " + row.accepts);
  };
  if (beneath) beneath(settings);
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (std::string(rows[i].name) == "recipe" && names.contains("recipe")) {
      apply(rows[i], values[i].back());
      read_recipe_file(settings.recipe_file, settings);
    }
  if (names.contains("samples")) settings.recipe.max_error = 0;  // beats the recipe's
  if (names.contains("light")) settings.recipe.lights.clear();  // the command line's lights replace the recipe's
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (options[i]->count() == 0) continue;
    if (rows[i].is_switch()) apply(rows[i], options[i]->as<bool>() ? "true" : "false");
    else if (rows[i].repeatable) for (const std::string& value : values[i]) apply(rows[i], value);
    else apply(rows[i], values[i].back());
  }
  if (given) *given = std::move(names);
  return settings;
}

}  // namespace texel
