#include "formats/error.h"
#include "formats/readers.h"
namespace texel {
Scene read_stl(const Input& input, Report&) { throw Error(Code::kUnsupported, input.path, "STL not there yet"); }
}
