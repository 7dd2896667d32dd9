#include "cli/help.h"

#include <array>
#include <cctype>

namespace texel {
namespace {

struct CommandText {
  Command command;
  const char* name;
  const char* usage;
  const char* does;
  const char* more;      // the terms it uses, in a few lines
  const char* examples;
};

constexpr std::array<CommandText, 7> kCommands = {{
    {kBake, "bake", "texel bake INPUT... -o PACK [options]", "one pack from one scene (several inputs: one scene)",
     "INPUT is an .obj (with its .mtl and textures), .gltf, .glb, .ply, .stl or .off file, a plant (.opf, .gwa, .ops, .lig), hair (.hair, .xml), or a picture of heights; --implicit and --perlin-field stand for one.\n"
     "A scene file (.json, docs/scenes.md) places inputs, once or a million times; of several texels in it --texel chooses one.\n"
     "A pack is a folder: manifest.json, volume.vdb with its coarser levels, stacks of RGBA slices and preview.png.\n"
     "A pack made by this version from the same bytes with the same recipe is left alone (--force bakes it anyway).\n",
     "  texel bake tree.obj -o tree.texel                        128 voxels along the longest side, all there is\n"
     "  texel bake tree.obj -o tree.texel -r 64 --want slices    slices only; no volume is made or stored\n"
     "  texel bake rock.ply -o rock.texel --light sun:1,0,-1,0.8,0.8,0.7 --light ambient:0.2,0.2,0.25 --shadows\n"
     "                                                           light baked into the slices\n"
     "  texel bake --recipe tree.texel -o again.texel -r 256     a pack baked again, finer\n"
     "  texel bake crater.png -o crater.texel --extent 4,3 --height 1\n"
     "                                                           a height field\n"
     "  texel bake a.obj b.obj -o ab.texel --plan                what would be done, and the memory it takes\n"},
    {kBatch, "batch", "texel batch FILE|FOLDER|LIST... -o FOLDER [options]", "many packs, one of each file",
     "FILE is an input of `texel bake`, or a pattern in quotes ('plants/*.obj'); of a FOLDER all meshes and volumes in it and below are taken (pictures are\n"
     "not: most are textures; of .json files scenes are, an item for each texel); a LIST is a .txt file with a file, folder or pattern a line, relative to itself, # before remarks.\n"
     "A bad item is named and the rest goes on. What is up to date is skipped, what failed is tried again, so an interrupted batch goes on where it\n"
     "was. A table and batch-report.json name every item. Options are those of `texel bake` and hold for all items.\n"
     "Exit status 6 if items failed.\n",
     "  texel batch models -o packs -r 256                       packs/.../NAME.texel for each file in models and below\n"
     "  texel batch 'trees/*.obj' rocks.txt -o packs --want renderer\n"},
    {kInfo, "info", "texel info PACK [--json]", "what is in a pack", "",
     "  texel info tree.texel                                    a table\n"
     "  texel info tree.texel --json                             the manifest, for scripts\n"},
    {kCheck, "check", "texel check PACK [--json]", "is a pack whole and self-consistent",
     "Files, sizes and hashes, grids and their values, and that levels agree. Exit status 7 if something was found.\n",
     "  texel check tree.texel && echo whole\n"},
    {kCompare, "compare", "texel compare PACK [PACK|INPUT...] [options]", "how far a pack is from another, or from its geometry",
     "Two packs have to have the same grid. Alone, or with INPUT, a pack is held against the geometry it was baked from: exact clipping, 64 x 64 rays a voxel and axis,\n"
     "light through whole columns; with --truth in pictures, too. The measures and their norms: docs/compare.md. What is sampled has an interval of 95 %.\n"
     "Exit status 7 if a figure is beyond what --allow gives.\n",
     "  texel compare tree.texel                                 against the meshes it was made from\n"
     "  texel compare tree.texel moved/tree.obj --truth          the same, from another place, in pictures too\n"
     "  texel compare new.texel old.texel --allow alpha_rms=0.001 --allow color_max=0\n"
     "                                                           as a test: is it still the same\n"},
    {kBench, "bench", "texel bench INPUT... -o FOLDER [options]", "run time against error on your own data",
     "Sweeps the bake's methods over samples and resolutions: exact clipping, bundles of rays, random rays a voxel (Ratib 1997) as the baseline, filtered and recomputed\n"
     "levels, SGGX and the ellipsoids of Neyret and Ratib. Each run is a process of its own. A table on stdout; bench.json and plots of error against seconds (SVG, with\n"
     "the front marked and the default ringed) in FOLDER. What is measured and how: docs/bench.md.\n",
     "  texel bench tree.obj -o bench                            three resolutions, all methods\n"
     "  texel bench tree.obj -o bench -r 64 --samples 2,4,8 --rays 64,1024 --repeat 1\n"},
    {kView, "view", "texel view PACK|INPUT -o IMAGE [options]", "a picture of a pack or of the true geometry",
     "The same camera and lights give pictures that can be laid side by side.\n",
     "  texel view tree.texel -o tree.png                        the volume by the reference renderer\n"
     "  texel view tree.texel -o slices.png --mode slices        the slices laid over each other\n"
     "  texel view tree.texel -o truth.png --truth               the meshes the pack was made from\n"
     "  texel view tree.obj -o tree.exr --azimuth 30 --size 800x600\n"},
}};

constexpr const char* kStatus =
    "Exit status: 0 good, 1 wrong command line or recipe, 2 a file can't be read or written, 3 bad input,\n"
    "4 failed while running (memory, disk full, interrupted), 5 not supported, 6 items of a batch failed, 7 check found something, compare more than allowed.\n";

const CommandText& text_of(Command command) {
  for (const CommandText& text : kCommands)
    if (text.command == command) return text;
  return kCommands.front();
}

std::string sentence(std::string text) {
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text + ".\n";
}

std::string shown_default(const OptionRow& row) {
  return row.shown_default ? row.shown_default : row.get(Settings{});
}

// "[default; range]", without what there is not.
std::string brackets(const OptionRow& row) {
  if (row.is_switch()) return {};
  const std::string value = shown_default(row);
  const std::string inside = value + (value.empty() || row.accepts.empty() ? "" : "; ") + row.accepts;
  return inside.empty() ? "" : " [" + inside + "]";
}

std::string option_lines(Command command) {
  std::string text, group;
  for (const OptionRow& row : option_table()) {
    if ((row.commands & command) == 0) continue;
    if (group != row.group) {
      group = row.group;
      text += "\n" + group + "\n";
    }
    std::string left = std::string("  ") + (row.letter ? std::string("-") + row.letter + ", " : "") + row.flag();
    if (!row.is_switch()) left += std::string(" ") + row.metavar;
    constexpr std::size_t kColumn = 32;
    left += left.size() < kColumn ? std::string(kColumn - left.size(), ' ') : "\n" + std::string(kColumn, ' ');
    text += left + row.help + brackets(row) + "\n";
  }
  return text;
}

// Bars would end a cell of the table.
std::string cell(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '|' ? "\\|" : std::string(1, c);
  return out;
}

std::string option_rows(Command command) {
  std::string text, group;
  for (const OptionRow& row : option_table()) {
    if ((row.commands & command) == 0) continue;
    if (group != row.group) {
      group = row.group;
      text += "\n### " + group + "\n| option | default | accepted | recipe key | meaning |\n|---|---|---|---|---|\n";
    }
    const std::string letter = row.letter ? std::string("`-") + row.letter + "`, " : "";
    text += "| " + letter + "`" + row.flag() + (row.is_switch() ? "" : " " + cell(row.metavar)) + "` | " +
            (row.is_switch() ? "" : cell(shown_default(row))) + " | " + (row.is_switch() ? "" : cell(row.accepts)) + " | " +
            (row.in_recipe ? "`" + row.key() + "`" : "") + " | " + cell(row.help) + (row.repeatable ? " (repeatable)" : "") + " |\n";
  }
  return text;
}

}  // namespace

std::string version_text() { return std::string("texel ") + TEXEL_VERSION + "\n"; }

std::string basics_text() {
  return "texel bakes meshes into texels: prefiltered multiscale volumes and slices.\n"
         "  texel bake tree.obj -o tree.texel          make a pack (-r N: voxels along the longest side)\n"
         "  texel view tree.texel -o tree.png          look at it\n"
         "  texel batch models -o packs                many packs\n"
         "  texel info tree.texel                      what is in it\n"
         "  texel check tree.texel                     is it whole\n"
         "  texel compare tree.texel                   how far it is from its meshes\n"
         "More: texel --help, texel bake --help\n";
}

std::string program_help() {
  std::string text = std::string("texel ") + TEXEL_VERSION +
                     ": bakes meshes into texels, prefiltered multiscale volumes for OpenVDB renderers, and RGBA slices.\n\n"
                     "Usage: texel COMMAND [options]\n\nCommands (texel COMMAND --help for its options)\n";
  for (const CommandText& command : kCommands) {
    std::string usage = std::string("  ") + command.usage;
    text += usage + std::string(usage.size() < 46 ? 46 - usage.size() : 1, ' ') + command.does + "\n";
  }
  text += "  texel --version | --help\n\nExamples\n";
  text += "  texel bake tree.obj -o tree.texel -r 128                 a pack of at most 128 voxels along a side\n"
          "  texel info tree.texel                                    box, levels, grids, slices, issues\n"
          "  texel view tree.texel -o tree.png                        a picture of the volume\n"
          "  texel view tree.texel -o truth.png --truth               the meshes it was made from, same camera\n\n";
  return text + kStatus;
}

std::string command_help(Command command) {
  const CommandText& c = text_of(command);
  std::string text = std::string("Usage: ") + c.usage + "\n\n" + sentence(c.does) + c.more;
  text += option_lines(command);
  text += std::string("\nExamples\n") + c.examples + "\n";
  if (command == kBake)
    text += "Options with a recipe key in docs/cli.md can stand in a recipe: {\"resolution\": 64, \"want\": [\"slices\"]}\n";
  return text + kStatus;
}

std::string cli_document() {
  std::string text =
      "# Command line\n\n"
      "Made by `texel --dump-docs` from the option table in `cli/option_table.cpp` and `cli/over_options.cpp`; a test compares them.\n\n"
      "The product goes to files or stdout, talk to stderr. Errors are one line, `texel: error: FILE[:LINE]: what is wrong; what to do`.\n"
      "Warnings have stable ids, `texel: warning: [mesh-open] ...`, and are printed once with their count.\n"
      "`NO_COLOR` turns colour off. SIGINT and SIGTERM end a bake with status 4 and leave the old pack or none; a second one ends at once.\n\n";
  text += std::string(kStatus) +
          "\nA recipe (`--recipe`) is a JSON object of the keys below; `null` leaves an option as it is, lists may be arrays or text.\n"
          "Every pack's manifest holds the recipe it was made by under `recipe`, so a pack, or its manifest, is a recipe too; without\n"
          "INPUT its source meshes are baked. The command line beats the recipe.\n"
          "\nWith `--depfile` a pack that is up to date gets a new time stamp, so that make and ninja see that it has been looked at.\n";
  for (const CommandText& command : kCommands) {
    text += std::string("\n## texel ") + command.name + "\n\n    " + command.usage + "\n\n" + sentence(command.does) + command.more;
    text += std::string("\n```\n") + command.examples + "```\n" + option_rows(command.command);
  }
  return text;
}

}  // namespace texel
