#pragma once
// Hints for loops that visit memory in an order the processor cannot guess: a list of indices.
#include <cstddef>

namespace texel {

// Asks for every cache line of *object.
template <class T>
void prefetch_lines(const T* object) {
  constexpr std::size_t kLine = 64;
  const auto* bytes = reinterpret_cast<const char*>(object);
  for (std::size_t at = 0; at < sizeof(T); at += kLine) __builtin_prefetch(bytes + at);
  __builtin_prefetch(bytes + sizeof(T) - 1);
}

// Calls visit(indices[i]) for i in [from, to). touch(index) has been called for an index well before its visit, `triangles` of it asked for
// before that: a triangle's corners can only be asked for once the triangle itself is there.
template <class Index, class Triangle, class Touch, class Visit>
void visit_triangles(const Index* indices, std::size_t from, std::size_t to, const Triangle* triangles, Touch&& touch, Visit&& visit) {
  constexpr std::size_t kFar = 16, kNear = 6;
  for (std::size_t i = from; i < to; ++i) {
    if (i + kFar < to) __builtin_prefetch(&triangles[indices[i + kFar]]);
    if (i + kNear < to) touch(indices[i + kNear]);
    visit(indices[i]);
  }
}

}  // namespace texel
