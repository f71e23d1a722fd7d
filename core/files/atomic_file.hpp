// SPDX-License-Identifier: Apache-2.0
// Files that appear whole or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace ecorche::files {

/// A temporary name beside `path` with the same extension. Write to `temporary()`, then `commit()`: flushed
/// to the disk and renamed over `path`. Destroyed without a commit (an error, a stop) it removes the
/// temporary and leaves whatever `path` held before. Throws Error{cannot_create} where the folder cannot be
/// written to, Error{io} when flushing fails, or when no 64 KiB more would fit behind the file: whoever wrote
/// it may not have told that the disk was full.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::filesystem::path& temporary() const { return temporary_; }
  const std::filesystem::path& path() const { return path_; }
  void commit();

 private:
  std::filesystem::path path_, temporary_;
  bool committed_ = false;
};

/// Writes `text` to `path`, atomically.
void write_text(const std::filesystem::path& path, std::string_view text);

/// The whole file. Throws Error{missing_input} when it cannot be opened, Error{io} when reading fails,
/// Error{data} above `limit` bytes.
std::string read_text(const std::filesystem::path& path, std::size_t limit = std::size_t{64} << 20);

/// Makes the folder and its parents. Throws Error{cannot_create}.
void make_folder(const std::filesystem::path& path);

}  // namespace ecorche::files
