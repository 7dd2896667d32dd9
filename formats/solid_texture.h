#pragma once
// Colour as a function of position: solid textures.
#include <cstddef>
#include <memory>
#include <string>

#include "formats/grid.h"

namespace texel {

// Implementations are immutable and thread-safe.
class SolidTexture {
 public:
  virtual ~SolidTexture() = default;
  // Linear albedo at n points (world space, arrays of n), averaged over `width` (world units) as well as the texture can: detail it cannot
  // average is faded to its mean. `normal`: n unit or zero vectors, or null; only textures projected along the axes look at them.
  // Non-finite points get the texture's mean. The same bytes from every compiler.
  virtual void colors(std::size_t n, const double* x, const double* y, const double* z, const V3d* normal, double width, V3f* color) const = 0;

  // The same texture repeating with `period` (world units, per axis; 0: not along it). Its lengths change as little as that needs; `changed` says how, empty
  // where none did by more than kSamePeriod. Null: it cannot.
  [[nodiscard]] virtual std::shared_ptr<const SolidTexture> with_period([[maybe_unused]] const V3d& period, [[maybe_unused]] std::string* changed) const { return nullptr; }

  [[nodiscard]] V3f color(const V3d& point, const V3d& normal, double width) const {
    V3f c;
    colors(1, &point.x, &point.y, &point.z, &normal, width, &c);
    return c;
  }
};

}  // namespace texel
