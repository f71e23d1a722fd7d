// SPDX-License-Identifier: Apache-2.0
// Folders that appear whole or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ecorche::files {

/// A hidden folder to write into, which becomes `target` by `commit()`; destroyed without one (an error, a
/// stop) it leaves nothing. Where `target` is not there yet, it appears at once, by one rename. One that is
/// there may be a mount or somebody's working folder and cannot be exchanged: its `seal`, the file that says
/// that the folder is whole, goes first and comes last. What killed runs left is swept. Throws
/// Error{cannot_create} for a target that is no folder or cannot be written to.
class StagedFolder {
 public:
  StagedFolder(const std::filesystem::path& target, std::string seal);
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  const std::filesystem::path& target() const { return target_; }
  const std::filesystem::path& stage() const { return stage_; }

  /// `old`: files of `target`, relative to it, that give way; others stay. Throws Error{io}.
  void commit(const std::vector<std::filesystem::path>& old = {});

 private:
  void move_into_target(const std::vector<std::filesystem::path>& old);

  std::filesystem::path target_, stage_;
  std::string seal_;
  bool within_ = false;  // whether the stage lies in the target, which was there
};

/// Everything in `folder` that is no folder, relative to it, sorted; folders are gone through, links not.
/// Throws Error{io}.
std::vector<std::filesystem::path> files_within(const std::filesystem::path& folder);

}  // namespace ecorche::files
