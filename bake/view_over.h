#pragma once
// Pack, surface -> picture: the pack as a texel repeated over a surface (Kajiya & Kay 1989; Ratib 1997, chapter 4)
#include "bake/texel_shell.h"
#include "bake/view.h"

namespace texel {

struct OverOptions {
  TexelAxes axes;
  V3f ground{-1, -1, -1};  // linear albedo of the surface itself, matt and opaque; negative: it is not there
};

// Straight linear RGBA, as view_volume. Each texel is the pack's box bent into a prism over the surface: opacity follows what matter lies on the ray, so that what is stretched
// hides no less; normals go by the inverse transpose; shadows pass all other texels. Boxes lie side by side whether or not the pack was baked to repeat.
// Deterministic for any thread count. Throws as view_volume and TexelShell. Cost: pixels × steps in the shell; not the number of texels.
[[nodiscard]] Image view_over(const Pack& pack, const TexelSurface& surface, const OverOptions& over, const ViewOptions& options, Report& report);

}  // namespace texel
