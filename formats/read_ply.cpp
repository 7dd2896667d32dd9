#include "formats/error.h"
#include "formats/readers.h"
namespace texel {
Scene read_ply(const Input& input, Report&) { throw Error(Code::kUnsupported, input.path, "PLY not there yet"); }
}
