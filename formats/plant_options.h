#pragma once
// What the command line can say of plant files.

namespace texel {

// How plant files are read.
struct PlantOptions {
  double unit = 0;       // metres that one unit of the file is; 0: the format's own, centimetres. The scene is in metres
  bool radians = false;  // angles of .ops rows; else degrees
  bool operator==(const PlantOptions&) const = default;
};

}  // namespace texel
