// SPDX-License-Identifier: Apache-2.0
// Where a recording lies while it runs.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <string_view>

#include <ecorche/values/error.hpp>
#include "core/platform/file.hpp"

namespace ecorche::server {

/// `NAME.ecrec.part` beside `NAME.ecrec`, until it is whole: what is appended stays, however the server ends.
/// It is made with the first bytes, so that what never had any leaves nothing. Used by one thread at a time;
/// expect() and expected() by any.
class RecordingFile {
 public:
  /// Of the whole recording's `path`.
  explicit RecordingFile(std::filesystem::path path);
  RecordingFile(const RecordingFile&) = delete;
  RecordingFile& operator=(const RecordingFile&) = delete;

  static std::filesystem::path part_of(const std::filesystem::path& path);
  const std::filesystem::path& path() const { return path_; }

  /// So many bytes are on their way to append().
  void expect(std::size_t bytes) { expected_ += bytes; }
  std::size_t expected() const { return expected_; }

  /// Appends. Throws nothing: what went wrong is told by commit(), and nothing is appended after it.
  void append(std::string_view bytes) noexcept;
  /// Flushed to the disk and renamed. already_exists where there is one of the name (the part stays), else
  /// what the system said first.
  Status commit() noexcept;

 private:
  void fail(const char* what, const std::error_code& error) noexcept;

  std::filesystem::path path_, part_;
  platform::File file_;
  Status status_;
  std::atomic<std::size_t> expected_ = 0;
};

}  // namespace ecorche::server
