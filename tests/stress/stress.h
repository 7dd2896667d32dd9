#pragma once
// Cases that are hard on numbers, and what runs them. Test code only.
//
// A family is a function seed -> Case. Environment: TEXEL_STRESS, how many times the usual number of cases (default 1; with sanitizers 0.1);
// TEXEL_STRESS_SEED, the first seed (default 1); TEXEL_STRESS_ONLY, run this seed alone and print what it is.
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "tests/bake/bake_util.h"

namespace texel::stress {

using test::Random;

struct Case {
  std::string what;              // for messages: "two boxes, touching"
  Scene scene;
  Recipe recipe;
  std::optional<Mesh> solid;     // the matter's surface, outward, matter where its winding number is not 0; none: not known to the generator
  bool disjoint = false;         // matter nowhere counts twice, so that its volume is known exactly
  bool may_be_refused = false;   // an Error of a documented kind is an answer, too
  std::string expects_issue;     // an issue id that must be there
};

// What the cases of one family came to.
struct Tally {
  std::int64_t cases = 0, refused = 0, voxels = 0, asked_inside = 0, packs_written = 0;
};

// How many cases: `usual` times TEXEL_STRESS, at least 1.
[[nodiscard]] int case_count(int usual);

// Makes and examines the cases, on two threads; prints their number and seconds. A case that fails is named with its seed; after five the family stops.
void run_family(const std::string& name, int usual, const std::function<Case(std::uint64_t seed)>& make);

// A recipe of a box from the origin with walls at the whole numbers: voxel space is the world.
[[nodiscard]] Recipe unit_recipe(const V3i& voxels);

// Turns options that change what is computed but nothing that must hold: sub-rays and their pattern, levels, normals, slices.
void vary(Recipe& recipe, Random& random);

}  // namespace texel::stress
