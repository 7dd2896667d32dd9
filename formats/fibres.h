#pragma once
// What the readers of lines and curves share: strands made sound, curves cut into straight pieces.
#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "formats/report.h"
#include "formats/scene.h"

namespace texel {

// One point of a strand.
struct FibrePoint {
  V3d at;
  double radius;
  V3f color{1, 1, 1};  // linear
};

// Gathers strands for a Scene; what cannot be used is left out and counted.
class FibreBuilder {
 public:
  // `colored`: points bring colours; otherwise theirs are not kept.
  FibreBuilder(Fibres& fibres, bool colored) : fibres_(fibres), colored_(colored) {}
  // Points whose coordinates or radius are no usable numbers (|x| <= 1e100, radius in [0, 1e100]) are dropped; of neighbours in one place the
  // first is kept. A strand with fewer than two points left, or without thickness, is dropped.
  void strand(std::span<const FibrePoint> points, std::uint32_t material);
  // The strands of others, moved: those of Fibres are kept unless the move makes points coincide or leave what is usable. They stay round: their radii
  // grow by the cube root of what volumes grow by. `first_material` is added to their materials.
  void moved(const Fibres& from, const Affine& place, std::uint32_t first_material);
  // Issues `non-finite`, `fibre-degenerate` and `fibre-no-radius`, as far as there is something to tell.
  void report_to(Report& report, const std::string& where) const;
  // What is left when everything was dropped.
  [[nodiscard]] std::string reason() const;

 private:
  Fibres& fibres_;
  bool colored_;
  std::int64_t bad_points_ = 0, short_ = 0, thin_ = 0;
};

// Appends the points of a cubic Bezier curve behind its first: as many equal steps of the parameter as keep chords and radii within `tolerance`
// of the curve, at most 256. Four control points; position and radius are interpolated alike.
// Bound: a step of 1/n is off by at most |second difference|·6/(8n²) (Wang; Sederberg, CAGD notes §10.6).
void add_bezier(const std::array<FibrePoint, 4>& control, double tolerance, std::vector<FibrePoint>& to);

// The same scene with the fibres of `from` behind its own.
void join_fibres(Fibres& to, Fibres&& from, std::uint32_t first_material);

}  // namespace texel
