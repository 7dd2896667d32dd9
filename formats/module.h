#pragma once
// Libraries that take long to load are wrapped in modules (texel_image.so: OpenImageIO, texel_vdb.so: OpenVDB) and opened on first use.
#include <string>

namespace texel {

// The address of `symbol` in the module `name` ("texel_image"). Looked for in $TEXEL_MODULE_DIR, beside the running program, in
// ../lib/texel from there and in the folder fixed at install time. Loaded once, never unloaded. Thread-safe.
// Throws Error{kUnsupported}, naming the places looked at and the loader's own message.
[[nodiscard]] void* module_symbol(const std::string& name, const std::string& symbol);

// Throws as module_symbol where the module's file is not there; opens nothing. Cheap: for finding out before the work is done.
void require_module(const std::string& name);

}  // namespace texel
