// Runs the tests, then waits for TBB's threads to end: one that is still ending when the leak checker scans its thread-local memory brings the
// checker down (seen with clang 14, once in some fifty runs of a test that writes volumes). TBB says that
// a thread has ended a little before the system has ended it: so the system is asked, too.
#include <gmock/gmock.h>
#include <tbb/global_control.h>

#include <chrono>
#include <filesystem>
#include <iterator>
#include <new>
#include <thread>

int main(int argc, char** argv) {
  ::testing::InitGoogleMock(&argc, argv);
  tbb::task_scheduler_handle workers{tbb::attach{}};
  const int result = RUN_ALL_TESTS();
  (void)tbb::finalize(workers, std::nothrow);
  const auto threads = [] { return std::distance(std::filesystem::directory_iterator("/proc/self/task"), std::filesystem::directory_iterator()); };
  for (int wait = 0; wait < 100 && threads() > 1; ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // others' threads may stay
  return result;
}
