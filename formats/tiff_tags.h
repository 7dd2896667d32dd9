#pragma once
// The tags of a TIFF file that say what its heights mean, which the image library keeps to itself.
#include <optional>
#include <span>

#include "formats/height_field.h"

namespace texel {

struct TiffTags {
  std::optional<double> no_data;  // GDAL_NODATA (42113); may be NaN
  V2d pixel_scale{0, 0};          // ModelPixelScaleTag (33550) of GeoTIFF: world units a pixel; 0: not stated
};

// The tags of the first picture; none where the bytes are no TIFF, or a damaged one: the image library says so. Classic and BigTIFF,
// either byte order. Any bytes are safe.
[[nodiscard]] TiffTags read_tiff_tags(std::span<const char> bytes);

}  // namespace texel
