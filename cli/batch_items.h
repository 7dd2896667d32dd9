#pragma once
// Files, folders, patterns and lists -> the items of a batch
#include <string>
#include <vector>

#include "formats/read_scene_file.h"

namespace texel {

struct BatchItem {
  std::string input;    // a file, as given or found; where nothing is there the name itself, so that the item fails by name
  std::string output;   // the pack's folder
  std::string texel;    // of a scene file; empty: the one there is
  std::vector<SceneTexel::Recipe> recipes;  // what the scene says of it
};

// What `texel batch` was given, in order, folders sorted by name; each file once. Packs go to folders below `output` that mirror those below the
// folder given; files named by themselves go to `output` itself. Where two files would make one pack all of them keep their extension
// (stone.obj.texel). A scene file is an item for each of its texels, whose pack has the texel's name (where two are alike, grove.json.NAME.texel). Folders that are packs and names that begin with a dot are passed over, symbolic links to folders not followed.
// Throws Error{kFile} for a list or folder that cannot be read, Error{kCommandLine} for a pattern that fits nothing.
[[nodiscard]] std::vector<BatchItem> batch_items(const std::vector<std::string>& given, const std::string& output);

}  // namespace texel
