// OBJ reading against the least that can be done with the same bytes: mmap and std::from_chars over every number.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <charconv>
#include <chrono>
#include <filesystem>
#include <fstream>

#include "formats/read.h"
#include "formats/text_scanner.h"
#include "tests/bench/sphere_obj.h"

namespace texel {
namespace {

constexpr int kLevel = 8;  // 1.31 million triangles

// The file, written once per run and removed at the end.
class BenchFile {
 public:
  BenchFile() : path_((std::filesystem::temp_directory_path() / "texel_read_bench.obj").string()) {
    std::ofstream(path_, std::ios::binary) << sphere_obj(kLevel);
  }
  ~BenchFile() { std::filesystem::remove(path_); }
  BenchFile(const BenchFile&) = delete;
  BenchFile& operator=(const BenchFile&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// Every number of the file, words skipped byte by byte.
double bare_numbers(const std::string& path) {
  const FileBytes file(path);
  const char* p = file.bytes().data();
  const char* end = p + file.bytes().size();
  double sum = 0;
  while (p != end) {
    double value = 0;
    const auto result = std::from_chars(p, end, value);
    if (result.ec == std::errc() && result.ptr != p) {
      sum += value;
      p = result.ptr;
    } else {
      ++p;
    }
  }
  return sum;
}

double seconds(const std::chrono::steady_clock::time_point& since) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
}

void bench_bare(benchmark::State& state, const std::string& path) {
  for (auto _ : state) benchmark::DoNotOptimize(bare_numbers(path));
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(std::filesystem::file_size(path)));
}

void bench_reader(benchmark::State& state, const std::string& path) {
  for (auto _ : state) {
    Report report;
    benchmark::DoNotOptimize(read_scene(path, report));
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(std::filesystem::file_size(path)));
}

// Both in turn, so that other load on the machine hits both alike.
void bench_ratio(benchmark::State& state, const std::string& path) {
  double bare = 0, reader = 0;
  for (auto _ : state) {
    auto start = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(bare_numbers(path));
    bare += seconds(start);
    start = std::chrono::steady_clock::now();
    Report report;
    const Scene scene = read_scene(path, report);
    reader += seconds(start);
    state.counters["triangles"] = static_cast<double>(scene.mesh.triangles.size());
  }
  state.counters["reader_over_bare"] = reader / bare;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["peak_MB_with_generator"] = static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace
}  // namespace texel

int main(int argc, char** argv) {
  const texel::BenchFile file;
  benchmark::RegisterBenchmark("bare_numbers", texel::bench_bare, file.path())->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("read_obj", texel::bench_reader, file.path())->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("read_obj_over_bare", texel::bench_ratio, file.path())->Unit(benchmark::kMillisecond)->Iterations(5);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
