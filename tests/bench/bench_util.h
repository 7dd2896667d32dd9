#pragma once
// What the benchmark programs share.
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

namespace texel::bench {

// run(argc, argv), with an error as one line and exit status 1.
inline int guarded(const char* program, int (*run)(int, char**), int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
    return 1;
  }
}

// Bodies, plants, cards, rods and hair: what a figure over models is taken over where none is named.
inline std::vector<std::string> usual_models() {
  const std::string models = TEXEL_SHARED_DATA "/models/", samples = TEXEL_SAMPLES "/";
  return {models + "bunny_closed.off", models + "dragon.obj", models + "fruit_bowl/bowlWithFruits.obj", models + "hedge/hedgeTextured.obj", models + "bonsai/bonsai-tree.obj",
          models + "lily_vase/calla_lily_with_roses.obj", models + "bicycle/bicycle.obj", TEXEL_SHARED_DATA "/amap/scenes/coffee.opf", samples + "plant/plant.opf"};
}

}  // namespace texel::bench
