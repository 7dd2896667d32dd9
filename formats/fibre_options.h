#pragma once
// What the command line can say of lines that are to be fibres.

namespace texel {

struct FibreOptions {
  double radius = -1;  // of the lines of .obj files, in the file's unit; 0: lines are left out; below 0: 1/2000 of the lines' diagonal
  bool operator==(const FibreOptions&) const = default;
};

}  // namespace texel
