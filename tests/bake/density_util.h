#pragma once
// Densities for tests, and figures of their packs.
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include "bake/compare.h"
#include "formats/field.h"
#include "formats/random.h"
#include "tests/bake/bake_util.h"

namespace texel::test {

// D is the function itself, held to 0…1.
inline Scene fog(std::shared_ptr<const Field> field, double scale) {
  Scene scene = density_preset("fog");
  scene.hypertexture->base = std::move(field);
  scene.hypertexture->scale = scale;
  return scene;
}

inline void expect_same_figures(const Comparison& a, const Comparison& b) {
  ASSERT_EQ(a.measures.size(), b.measures.size());
  for (std::size_t i = 0; i < a.measures.size(); ++i) {
    EXPECT_EQ(a.measures[i].value, b.measures[i].value) << a.measures[i].name;
    EXPECT_EQ(a.measures[i].low, b.measures[i].low) << a.measures[i].name;
    EXPECT_EQ(a.measures[i].high, b.measures[i].high) << a.measures[i].name;
  }
}

inline V3d random_direction(RandomSequence& random) {
  const double z = 2 * random.next() - 1, phi = 2 * std::numbers::pi * random.next(), r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// Length of the chord of a line through `at` in a ball about the origin; 0 where it misses.
inline double chord(const V3d& at, const V3d& along, double radius) {
  const double b = at.dot(along), d = b * b - at.length2() + radius * radius;
  return d > 0 ? 2 * std::sqrt(d) : 0;
}

inline Measure measure_of(const Comparison& c, const std::string& name, int level, int axis = -1) {
  for (const Measure& m : c.measures)
    if (m.name == name && m.level == level && m.axis == axis) return m;
  ADD_FAILURE() << "no " << name << " on level " << level;
  Measure none;
  none.value = std::nan("");
  return none;
}
inline double figure(const Comparison& c, const std::string& name, int level, int axis = -1) { return measure_of(c, name, level, axis).value; }

}  // namespace texel::test
