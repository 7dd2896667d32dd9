#pragma once
// What a run has to say besides its product. Stages fill it, only the program prints it.
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace texel {

// A defect of the input that did not stop the bake. `id` is stable ("mesh-open"); the list is in docs/issues.md.
struct Issue {
  std::string id;
  std::string text;       // one sentence: what was found and what was done about it
  std::int64_t count = 1; // how many times
  std::string where;      // the first place: FILE:LINE, component or material; may be empty
};

struct Skip {             // work the scene or the recipe did not need
  std::string what;       // "fill", "texture leaf.png", "interior blocks"
  std::string why;
};

struct StageTime {
  std::string stage;
  double seconds = 0;     // wall clock
  double cpu_seconds = 0; // all threads of the process
};

struct Report {
  std::vector<Issue> issues;
  std::vector<Skip> skipped;
  std::vector<StageTime> times;
  std::vector<std::pair<std::string, double>> counts;  // "crossings", "border voxels", …

  // Called now and then, possibly from several threads at once, with the share done of the named stage in [0,1]. May be empty.
  std::function<void(const std::string& stage, double done)> progress;

  void issue(std::string id, std::string text, std::int64_t count = 1, std::string where = {}) {
    for (Issue& i : issues)
      if (i.id == id && i.text == text) { i.count += count; return; }
    issues.push_back({std::move(id), std::move(text), count, std::move(where)});
  }
  void skip(std::string what, std::string why) { skipped.push_back({std::move(what), std::move(why)}); }
  void count(std::string what, double value) { counts.emplace_back(std::move(what), value); }
};

// Adds the wall and CPU time between construction and destruction to the stage's in report.times.
class StageTimer {
 public:
  StageTimer(Report& report, std::string stage);
  ~StageTimer();
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  Report& report_;
  std::string stage_;
  double wall_, cpu_;
};

}  // namespace texel
