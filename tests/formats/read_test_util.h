#pragma once
// Shared by the reader tests: text in, scene out, and measures of a mesh.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "formats/error.h"
#include "formats/readers.h"

namespace texel {

// A folder of this test's own, removed at the end.
class TestFolder {
 public:
  TestFolder() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string("texel_") + info->test_suite_name() + "_" + info->name();
    std::replace(name.begin(), name.end(), '/', '_');
    path_ = std::filesystem::temp_directory_path() / name;
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TestFolder() {
    std::error_code ec;
    std::filesystem::remove_all(path_, ec);
  }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }
  std::string write(const std::string& name, const std::string& bytes) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return file(name);
  }

 private:
  std::filesystem::path path_;
};

inline const Issue* find_issue(const Report& report, const std::string& id) {
  for (const Issue& i : report.issues)
    if (i.id == id) return &i;
  return nullptr;
}

// What `call` throws, as "code: what"; empty when it doesn't.
template <class Call>
std::string error_of(Call call) {
  try {
    call();
  } catch (const Error& e) {
    return std::to_string(static_cast<int>(e.code)) + ": " + e.what();
  }
  return {};
}

struct Measures {
  Box3d box;
  double area = 0, volume = 0;
};

// Box of the triangles' corners; volume about the centre of the box, as the data's README has it.
inline Measures measure(const Mesh& mesh) {
  Measures m;
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t corner : t) m.box.extendBy(mesh.points[corner]);
  const V3d centre = m.box.center();
  for (const auto& t : mesh.triangles) {
    const V3d a = mesh.points[t[0]] - centre, b = mesh.points[t[1]] - centre, c = mesh.points[t[2]] - centre;
    m.area += (b - a).cross(c - a).length() / 2;
    m.volume += a.dot(b.cross(c)) / 6;
  }
  return m;
}

}  // namespace texel
