// SPDX-License-Identifier: Apache-2.0
// A folder for what is needed on the way to something.
#pragma once

#include <filesystem>

namespace ecorche::files {

/// A new, empty, hidden folder beside `target`, on the same disk, which nobody else may look into; it goes
/// with all that is in it when this does. What killed runs for the same target left is swept first. Throws
/// Error{cannot_create}.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::filesystem::path& target);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace ecorche::files
