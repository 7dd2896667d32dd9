#pragma once
// Random numbers that are the same everywhere: a function of a seed, a place and a sample.
#include <cstdint>

namespace texel {

// Mixes all bits: the finalizer of splitmix64 (Steele, Lea & Flood, Fast splittable pseudorandom number generators, OOPSLA 2014).
[[nodiscard]] constexpr std::uint64_t mix_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

// The upper 53 bits as a number in [0, 1).
[[nodiscard]] constexpr double unit_of(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

// splitmix64 as a sequence: next() is unit_of(mix_bits(seed + k·γ)), k = 0, 1, …
class RandomSequence {
 public:
  explicit constexpr RandomSequence(std::uint64_t seed) : state_(seed) {}
  constexpr double next() {
    const double value = unit_of(mix_bits(state_));
    state_ += 0x9e3779b97f4a7c15u;
    return value;
  }

 private:
  std::uint64_t state_;
};

}  // namespace texel
