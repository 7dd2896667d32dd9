#include "formats/staging.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <vector>

#include "formats/error.h"

namespace texel {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& what, int cause) {
  const bool full = cause == ENOSPC || cause == EDQUOT;
  throw Error(full ? Code::kRunning : Code::kFile, path.string(), what + " (" + std::strerror(cause) + ")", full ? "free some space" : "");
}

std::string prefix_of(const fs::path& target) { return std::string(".").append(target.filename().string()).append(".texel-"); }

// The PID in a leftover's name; 0 where the name is not one of ours.
pid_t pid_in(const std::string& name, const std::string& prefix) {
  if (!name.starts_with(prefix)) return 0;
  const char* end = name.data() + name.size();
  pid_t pid = 0;
  unsigned number = 0;
  const auto first = std::from_chars(name.data() + prefix.size(), end, pid);
  if (first.ec != std::errc{} || first.ptr == end || *first.ptr != '-') return 0;
  const auto second = std::from_chars(first.ptr + 1, end, number);
  return second.ec == std::errc{} && second.ptr == end && pid > 0 ? pid : 0;
}

// A leftover's writer no longer runs and nobody holds its lock. A process number may have been given to another program since: then age tells.
bool abandoned(const fs::path& folder, pid_t pid) {
  const bool runs = pid == getpid() || kill(pid, 0) == 0 || errno == EPERM;
  if (runs) {
    std::error_code ec;
    const auto changed = fs::last_write_time(folder, ec);
    if (ec || fs::file_time_type::clock::now() - changed < std::chrono::minutes(1)) return false;
  }
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool free = flock(fd, LOCK_EX | LOCK_NB) == 0 || (!runs && errno != EWOULDBLOCK);
  close(fd);
  return free;
}

void remove_leftovers(const fs::path& target) {
  std::error_code ec;
  std::vector<fs::path> found;
  for (fs::directory_iterator it(target.parent_path(), ec), end; !ec && it != end; it.increment(ec))
    if (const pid_t pid = pid_in(it->path().filename().string(), prefix_of(target)); pid && abandoned(it->path(), pid)) found.push_back(it->path());
  for (const fs::path& path : found) fs::remove_all(path, ec);
}

// Makes the folders of `path` that are not there and lists them, outermost first. 0, or the error's number.
int make_folders(const fs::path& path, std::vector<fs::path>* made) {
  std::error_code ec;
  if (path.empty() || fs::is_directory(path, ec)) return 0;
  if (const int cause = path.has_relative_path() ? make_folders(path.parent_path(), made) : 0) return cause;
  if (mkdir(path.c_str(), 0777) == 0) made->push_back(path);
  else if (errno != EEXIST || !fs::is_directory(path, ec)) return errno == EEXIST ? ENOTDIR : errno;
  return 0;
}

// Innermost first; one that has got something in it stays, and with it those around it.
void remove_folders(const std::vector<fs::path>& made) {
  for (auto folder = made.rbegin(); folder != made.rend(); ++folder)
    if (rmdir(folder->c_str()) != 0) return;
}

void sync_folder(const fs::path& folder) {
  const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  fsync(fd);  // not every file system can; the rename is still one step
  close(fd);
}

}  // namespace

StagingFolder::StagingFolder(const fs::path& target) : target_(target) {
  if (target.filename().empty()) throw Error(Code::kFile, target.string(), "is not a place for a pack");
  if (const int cause = make_folders(target.parent_path(), &made_)) {
    remove_folders(made_);
    fail(target.parent_path(), "cannot be made", cause);
  }
  remove_leftovers(target);
  const std::string stem = prefix_of(target) + std::to_string(getpid()) + "-";
  for (unsigned n = 0;; ++n) {
    path_ = target.parent_path() / (stem + std::to_string(n));
    if (mkdir(path_.c_str(), 0777) == 0) break;
    if (const int cause = errno; cause != EEXIST) {
      remove_folders(made_);
      fail(target, "cannot be written", cause);
    }
  }
  lock_ = open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ >= 0) flock(lock_, LOCK_EX | LOCK_NB);
}

StagingFolder::~StagingFolder() {
  std::error_code ec;
  fs::remove_all(path_, ec);
  if (lock_ >= 0) close(lock_);
  remove_folders(made_);
}

void StagingFolder::commit(bool exchange) {
  sync_folder(path_);
  // Plain rename does it where there is nothing or an empty folder.
  if (rename(path_.c_str(), target_.c_str()) != 0) {
    if (errno != ENOTEMPTY && errno != EEXIST) fail(target_, "cannot be written", errno);
    const bool swapped = exchange && renameat2(AT_FDCWD, path_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) == 0;
    if (!swapped) {
      if (exchange && errno != EINVAL && errno != ENOSYS && errno != ENOTSUP) fail(target_, "cannot be replaced", errno);
      const fs::path old = path_.string() + "0";  // still a leftover's name
      if (rename(target_.c_str(), old.c_str()) != 0) fail(target_, "cannot be replaced", errno);
      if (rename(path_.c_str(), target_.c_str()) != 0) {
        const int cause = errno;
        (void)rename(old.c_str(), target_.c_str());
        fail(target_, "cannot be replaced", cause);
      }
      path_ = old;
    }
  }
  made_.clear();
  sync_folder(target_.parent_path());
}

}  // namespace texel
