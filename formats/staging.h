#pragma once
// A folder that is written under another name and appears whole or not at all. Internal to formats/.
#include <filesystem>
#include <string>
#include <vector>

namespace texel {

// Makes `.NAME.texel-PID-N` beside the target, and the target's parent folders. The destructor removes whatever is left under that name: what was
// being written, or, after commit, the folder that was replaced; without commit also the parents it made, where nothing else is in them by then.
class StagingFolder {
 public:
  // Removes what killed writers of the same target left behind. Throws Error{kFile}.
  explicit StagingFolder(const std::filesystem::path& target);
  ~StagingFolder();
  StagingFolder(const StagingFolder&) = delete;
  StagingFolder& operator=(const StagingFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

  // Puts the folder in the target's place by one rename; where something is already there, the two names are exchanged in one step.
  // On file systems that cannot exchange names (or with `exchange` false) the old folder is renamed away first: between the two renames the
  // target is missing. Throws Error{kFile}.
  void commit(bool exchange = true);

 private:
  std::filesystem::path target_, path_;
  std::vector<std::filesystem::path> made_;  // parents that were not there, outermost first; empty once the target is in place
  int lock_ = -1;  // held as long as the folder is being written, so that another writer can tell it from a leftover
};

}  // namespace texel
