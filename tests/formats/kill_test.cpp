// kill -9 at random moments: the folder always holds one whole pack, the old or the new one.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <random>
#include <thread>

#include "formats/read_pack.h"
#include "tests/formats/write_test_util.h"

namespace texel::test {
namespace {

Pack small_pack() { return ball_pack({.n = 12, .levels = 2, .color = V3f(0.2f, 0.4f, 0.6f)}); }
Pack large_pack() { return ball_pack({.n = 20, .levels = 3}); }

std::string findings_text(const std::string& folder) {
  std::string text;
  for (const CheckFinding& f : check_pack(folder)) text += "[" + f.id + "] " + f.file + ": " + f.text + "\n";
  return text;
}

// This program started anew writes two packs by turns until it is killed. Not a mere fork: the parent's threads would be missing.
TEST(KillHelper, WritesByTurns) {
  const char* target = std::getenv("TEXEL_KILL_TARGET");
  if (!target) GTEST_SKIP() << "the process that Kill.LeavesTheOldPackOrTheNewOne starts and kills";
  const Pack packs[] = {small_pack(), large_pack()};
  save(packs[1], std::string(target) + ".first");  // loads what is loaded on first use
  put_bytes(std::string(target) + ".ready", "");
  for (int i = 0;; ++i) save(packs[i % 2], target);
}

pid_t start_writer(const std::string& target) {
  const pid_t pid = fork();
  if (pid != 0) return pid;
  setenv("TEXEL_KILL_TARGET", target.c_str(), 1);
  execl("/proc/self/exe", "formats_kill_test", "--gtest_filter=KillHelper.*", "--gtest_brief=1", static_cast<char*>(nullptr));
  _exit(127);
}

TEST(Kill, LeavesTheOldPackOrTheNewOne) {
  const TempFolder folder;
  const std::string target = folder / "ball.texel";
  save(small_pack(), target);
  const auto small = contents(target);
  save(large_pack(), folder / "large");
  const auto large = contents(folder / "large");
  fs::remove_all(folder / "large");
  std::mt19937 random(20260101);
  // Moments spread over three rounds of both packs, as long as a round takes on this machine just now.
  const auto start = std::chrono::steady_clock::now();
  save(large_pack(), folder / "large");
  save(small_pack(), folder / "large");
  const auto round = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start).count();
  fs::remove_all(folder / "large");
  std::uniform_int_distribution<std::int64_t> moment(0, 3 * round);
  int half = 0, were_small = 0, were_large = 0, killed_midway = 0;
  for (int i = 0; i < 50; ++i) {
    const pid_t pid = start_writer(target);
    ASSERT_GT(pid, 0);
    for (int wait = 0; wait < 6000 && !fs::exists(target + ".ready"); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    std::this_thread::sleep_for(std::chrono::microseconds(moment(random)));
    kill(pid, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(pid, &status, 0), pid);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the writer stopped by itself with status " << WEXITSTATUS(status);
    fs::remove(target + ".ready");
    fs::remove_all(target + ".first");
    const std::string findings = findings_text(target);
    EXPECT_EQ(findings, "") << "after kill " << i;
    half += !findings.empty();
    const auto found = contents(target);
    EXPECT_TRUE(found == small || found == large) << "after kill " << i;
    were_small += found == small;
    were_large += found == large;
    killed_midway += std::distance(fs::directory_iterator(folder.path()), {}) > 1;
  }
  EXPECT_EQ(half, 0);
  RecordProperty("small", were_small);
  RecordProperty("large", were_large);
  RecordProperty("killed_midway", killed_midway);
  std::printf("50 kills: %d small, %d large, %d half packs; %d kills left a temporary folder\n", were_small, were_large, half, killed_midway);
  // The test is one only if both packs and some unfinished writes were met.
  EXPECT_GT(were_small, 0);
  EXPECT_GT(were_large, 0);
  EXPECT_GT(killed_midway, 5);
  save(small_pack(), target);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1) << "a leftover is still there";
}

}  // namespace
}  // namespace texel::test
