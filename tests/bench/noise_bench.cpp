// Noise: samples a second of one core, values and gradients, one octave and six.
#include <benchmark/benchmark.h>

#include <random>
#include <vector>

#include "formats/noise.h"

namespace texel {
namespace {

struct Batch {
  std::vector<double> x, y, z, v, gx, gy, gz;
  explicit Batch(std::size_t n) : v(n), gx(n), gy(n), gz(n) {
    std::mt19937_64 random(1);
    const auto next = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 * 200 - 100; };
    for (std::size_t i = 0; i < n; ++i) { x.push_back(next()); y.push_back(next()); z.push_back(next()); }
  }
};

void count(benchmark::State& state, std::size_t n) {
  state.counters["samples/s"] = benchmark::Counter(static_cast<double>(n) * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

void noise_value(benchmark::State& state) {
  Batch b(4096);
  const Noise noise{1, state.range(0) ? V3i(8, 8, 8) : V3i(0, 0, 0)};
  for (auto _ : state) {
    noise_values(noise, b.x.size(), b.x.data(), b.y.data(), b.z.data(), b.v.data());
    benchmark::DoNotOptimize(b.v.data());
  }
  count(state, b.x.size());
}
BENCHMARK(noise_value)->ArgName("periodic")->Arg(0)->Arg(1);

void noise_gradient(benchmark::State& state) {
  Batch b(4096);
  for (auto _ : state) {
    noise_gradients({}, b.x.size(), b.x.data(), b.y.data(), b.z.data(), b.v.data(), b.gx.data(), b.gy.data(), b.gz.data());
    benchmark::DoNotOptimize(b.v.data());
  }
  count(state, b.x.size());
}
BENCHMARK(noise_gradient);

void turbulence_value(benchmark::State& state) {
  Batch b(4096);
  Octaves octaves;
  octaves.count = 6;
  octaves.turbulence = true;
  for (auto _ : state) {
    octave_values(octaves, b.x.size(), b.x.data(), b.y.data(), b.z.data(), b.v.data());
    benchmark::DoNotOptimize(b.v.data());
  }
  count(state, b.x.size());
}
BENCHMARK(turbulence_value);

}  // namespace
}  // namespace texel

BENCHMARK_MAIN();
