// Runs the tests, then waits for TBB's threads to end: one that is still ending when the leak checker scans its thread-local memory brings the
// checker down (seen with clang 14, once in some fifty runs of a test that writes volumes).
#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <new>

int main(int argc, char** argv) {
  ::testing::InitGoogleMock(&argc, argv);
  tbb::task_scheduler_handle workers{tbb::attach{}};
  const int result = RUN_ALL_TESTS();
  (void)tbb::finalize(workers, std::nothrow);
  return result;
}
