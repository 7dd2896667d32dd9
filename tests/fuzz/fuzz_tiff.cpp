// Any bytes as TIFF: tags that can be used or none.
#include "formats/tiff_tags.h"
#include "tests/fuzz/check_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const char* data, std::size_t size) {
  const texel::TiffTags tags = texel::read_tiff_tags({data, size});
  texel::demand(tags.pixel_scale.x >= 0 && tags.pixel_scale.x < 1e30 && tags.pixel_scale.y >= 0 && tags.pixel_scale.y < 1e30);
  return 0;
}
