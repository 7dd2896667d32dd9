#include "formats/error.h"
#include "formats/module.h"
#include "formats/vdb_module.h"

namespace texel {

const VdbFunctions& vdb_functions() {
  const auto* table = static_cast<const VdbFunctions*>(module_symbol("texel_vdb", kVdbSymbol));
  if (table->version != kVdbModuleVersion)
    throw Error(Code::kUnsupported, "texel_vdb.so", "is of version " + std::to_string(table->version) + ", not " + std::to_string(kVdbModuleVersion), "reinstall texel");
  return *table;
}

}  // namespace texel
