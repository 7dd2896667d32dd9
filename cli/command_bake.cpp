// texel bake: inputs -> pack.
#include <tbb/global_control.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <optional>
#include <string>

#include "cli/bake_one.h"
#include "cli/commands.h"
#include "cli/input_scene.h"
#include "cli/interrupt.h"
#include "cli/print.h"
#include "formats/error.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

// The product is a folder: under a picture's or a mesh's name it would only be found out later, by the program that opens it.
void refuse_file_name(const std::string& output) {
  static constexpr const char* kPictures[] = {".png", ".exr", ".jpg", ".jpeg", ".tif", ".tiff", ".hdr", ".bmp", ".tga", ".gif", ".webp"};
  static constexpr const char* kOthers[] = {".obj", ".mtl", ".ply", ".stl", ".off", ".gltf", ".glb", ".fbx", ".vdb", ".nvdb", ".json"};
  fs::path path(output);
  if (path.filename().empty()) path = path.parent_path();  // "x.png/"
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto among = [&](const auto& list) { return std::find(std::begin(list), std::end(list), extension) != std::end(list); };
  const bool picture = among(kPictures);
  if (!picture && !among(kOthers)) return;
  const std::string pack = path.replace_extension(".texel").string();
  throw Error(Code::kCommandLine, "--output " + output, "a pack is a folder, not a " + extension + " file",
              "give -o " + pack + (picture ? ", then `texel view " + pack + " -o " + output + "` for a picture" : ""));
}

}  // namespace

int command_bake(const Settings& settings) {
  if (settings.inputs.empty() && !makes_scene(settings))
    throw Error(Code::kCommandLine, "INPUT", "missing", "name an .obj, .ply, .stl or .off file, a plant (.opf, .gwa, .ops, .lig), hair (.hair, .xml), a scene (.json), a picture of heights, --implicit, --perlin-field or --hypertexture, or --recipe with a pack");
  if (settings.output.empty() && !settings.plan) throw Error(Code::kCommandLine, "--output", "missing", "name the pack's folder, e.g. -o tree.texel");
  refuse_file_name(settings.output);
  for (const std::string& file : {settings.report_file, settings.depfile})
    if (!file.empty()) require_file_place(file);

  std::optional<tbb::global_control> limit;
  if (settings.recipe.threads > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(settings.recipe.threads));

  keep_freed_memory(true);
  Report report;
  ProgressBar bar(settings.progress);
  report.progress = [&bar](const std::string& stage, double done) {
    stop_if_interrupted();
    bar.update(stage, done);
  };
  static Outcome outcome;  // never destroyed (main.cpp)
  const double start = now_seconds();
  const auto finish = [&](const std::string& message) {
    report.progress = nullptr;
    bar.clear();
    print_warnings(report.issues);
    if (settings.verbose) print_stages(report);
    if (!outcome.closing.empty()) print_talk(outcome.closing);
    if (!settings.report_file.empty())
      write_text_file(settings.report_file,
                      report_json(outcome.status, report, outcome.pack ? &*outcome.pack : nullptr, now_seconds() - start, message));
  };
  try {
    bake_pack(settings, report, outcome);
    // Not in the pack: it depends on the machine.
    if (const auto cap = static_cast<double>(settings.recipe.memory); cap > 0 && peak_bytes() > cap)
      report.issue("memory-over", "the bake took " + bytes_text(peak_bytes()) + ", more than --memory: mesh, textures and finished grids are not bounded by it; lower the resolution or want less");
  } catch (const Error& error) {
    // The first error is the one to tell: a report that cannot be written either must not hide it.
    try {
      finish(error.what());
    } catch (const Error& second) {
      print_error(second.what());
    }
    throw;
  }
  finish("");
  return 0;
}

}  // namespace texel
