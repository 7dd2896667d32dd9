#include "formats/repeated_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace texel {
namespace {

constexpr std::size_t kBatch = 64;
constexpr std::size_t kWorthARange = 8;  // points a range costs about as much as
using Row = std::array<double, kBatch>;

class Repeated : public Field {
 public:
  Repeated(std::shared_ptr<const Field> field, Copies copies) : field_(std::move(field)), copies_(std::move(copies)) {
    for (int a = 0; a < 3; ++a) density_ = density_ || std::isfinite(copies_.reach.min[a]) || std::isfinite(copies_.reach.max[a]);
  }

  void values(std::size_t n, const double* x, const double* y, const double* z, double* f) const override {
    for (std::size_t i = 0; i < n; i += kBatch) batch(std::min(kBatch, n - i), x + i, y + i, z + i, f + i, nullptr, nullptr, nullptr);
  }
  void gradients(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const override {
    for (std::size_t i = 0; i < n; i += kBatch) batch(std::min(kBatch, n - i), x + i, y + i, z + i, f + i, gx + i, gy + i, gz + i);
  }

  [[nodiscard]] Interval range(const Box3d& box) const override {
    Interval all{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
    bool any = false, known = true;
    const auto add = [&](const Interval& r) {
      // The greatest value is no less than any copy's; a copy of which nothing is known may be above all others.
      all.low = any ? std::max(all.low, r.low) : r.low;
      all.high = any ? std::max(all.high, r.high) : r.high;
      any = true;
    };
    bool outside = true;
    for (const V3d& shift : copies_.shifts) {
      const Box3d moved(box.min - shift, box.max - shift);
      if (!moved.intersects(copies_.reach)) continue;
      const Interval r = field_->range(moved);
      if (std::isnan(r.low) || std::isnan(r.high)) known = false;
      else add(r);
      outside = outside && !contains(copies_.reach, moved);
    }
    if (!known) return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
    if (outside) {  // some points may lie in no copy's reach
      if (!any) return {0, 0};
      all.low = std::min(all.low, 0.0);
      all.high = std::max(all.high, 0.0);
    }
    return all;
  }

  [[nodiscard]] Box3d bounds(double iso) const override {
    const Box3d one = field_->bounds(iso);
    if (one.isEmpty()) return one;
    Box3d all;
    for (const V3d& shift : copies_.shifts) all.extendBy(Box3d(one.min + shift, one.max + shift));
    return all;
  }

 private:
  static bool contains(const Box3d& outer, const Box3d& inner) { return outer.intersects(inner.min) && outer.intersects(inner.max); }

  void batch(std::size_t n, const double* x, const double* y, const double* z, double* f, double* gx, double* gy, double* gz) const {
    Row px, py, pz, v, dx, dy, dz, best, bx, by, bz;
    std::array<std::size_t, kBatch> of;
    std::array<bool, kBatch> reached{};
    best.fill(std::numeric_limits<double>::quiet_NaN());
    for (Row* g : {&bx, &by, &bz}) g->fill(std::numeric_limits<double>::quiet_NaN());
    for (const V3d& shift : copies_.shifts) {
      std::size_t count = 0;
      Box3d around;
      for (std::size_t i = 0; i < n; ++i) {
        if (density_ && best[i] >= 1) continue;  // nothing is denser, and of equal copies the first counts
        const V3d p(x[i] - shift.x, y[i] - shift.y, z[i] - shift.z);
        // Asked so that a point that is no number is within: the field says what it makes of it.
        const Box3d& r = copies_.reach;
        if (p.x < r.min.x || p.y < r.min.y || p.z < r.min.z || p.x > r.max.x || p.y > r.max.y || p.z > r.max.z) continue;
        around.extendBy(p);
        px[count] = p.x;
        py[count] = p.y;
        pz[count] = p.z;
        of[count++] = i;
      }
      if (count == 0) continue;
      if (density_ && count >= kWorthARange && field_->range(around).high <= 0) {  // the values it would give, however the points are cut into calls
        for (std::size_t k = 0; k < count; ++k) {
          const std::size_t i = of[k];
          reached[i] = true;
          if (std::isnan(best[i])) best[i] = bx[i] = by[i] = bz[i] = 0;
        }
        continue;
      }
      if (gx) field_->gradients(count, px.data(), py.data(), pz.data(), v.data(), dx.data(), dy.data(), dz.data());
      else field_->values(count, px.data(), py.data(), pz.data(), v.data());
      for (std::size_t k = 0; k < count; ++k) {
        const std::size_t i = of[k];
        reached[i] = true;
        if (std::isnan(v[k]) || best[i] >= v[k]) continue;
        best[i] = v[k];
        if (!gx) continue;
        bx[i] = dx[k];
        by[i] = dy[k];
        bz[i] = dz[k];
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      f[i] = reached[i] ? best[i] : 0;
      if (!gx) continue;
      gx[i] = reached[i] ? bx[i] : 0;
      gy[i] = reached[i] ? by[i] : 0;
      gz[i] = reached[i] ? bz[i] : 0;
    }
  }

  std::shared_ptr<const Field> field_;
  Copies copies_;
  bool density_ = false;
};

}  // namespace

std::shared_ptr<const Field> repeat_field(std::shared_ptr<const Field> field, Copies copies) {
  if (copies.shifts.empty()) return field;
  return std::make_shared<Repeated>(std::move(field), std::move(copies));
}

}  // namespace texel
