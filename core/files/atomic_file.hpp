// SPDX-License-Identifier: Apache-2.0
// Files that appear whole or not at all.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace ecorche::files {

/// A temporary beside `path` with the same extension, empty, made anew under a name that nobody can guess:
/// whoever may write to the folder can neither have put a file or a link there before, nor read what a file
/// of theirs would get. Write to `temporary()`, then `commit()`: flushed to the disk and renamed over `path`.
/// Destroyed without a commit (an error, a stop) it removes the temporary and leaves whatever `path` held
/// before. Throws Error{cannot_create} where the folder cannot be written to, Error{io} when flushing fails,
/// or when no 64 KiB more would fit behind the file: whoever wrote it may not have told that the disk was
/// full.
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
  friend void commit_together(std::span<AtomicFile* const> files);

  void finish() const;  // what may fail is tried before anything is renamed

  std::filesystem::path path_, temporary_;
  bool committed_ = false;
};

/// Commits files of which none means anything without the others. Where one cannot be renamed, none is, and
/// what their names held before stands there again; a process that is killed in between leaves some of the
/// new ones, never old and new side by side. Throws as `commit`.
void commit_together(std::span<AtomicFile* const> files);

/// Writes `text` to `path`, atomically.
void write_text(const std::filesystem::path& path, std::string_view text);

/// Writes `text` to the temporary of `file`. Throws Error{cannot_create, io}.
void write_text(const AtomicFile& file, std::string_view text);

/// The whole file. Throws Error{missing_input} when it cannot be opened, Error{io} when reading fails,
/// Error{data} above `limit` bytes.
std::string read_text(const std::filesystem::path& path, std::size_t limit = std::size_t{64} << 20);

/// Makes the folder and its parents. Throws Error{cannot_create}.
void make_folder(const std::filesystem::path& path);

}  // namespace ecorche::files
