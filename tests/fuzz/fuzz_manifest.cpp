// Any bytes as manifest.json: an Error or a manifest; what was read writes and reads back to the same text.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "formats/error.h"
#include "formats/manifest.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  texel::Manifest manifest;
  try {
    manifest = texel::parse_manifest(std::string(reinterpret_cast<const char*>(data), size), "manifest.json");
  } catch (const texel::Error&) {
    return 0;
  }
  const std::string text = texel::manifest_text(manifest);
  if (texel::manifest_text(texel::parse_manifest(text, "manifest.json")) != text) std::abort();
  return 0;
}
