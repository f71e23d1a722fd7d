// SPDX-License-Identifier: Apache-2.0
// Files as the system keeps them, where the streams of the standard library do not reach: made by nobody
// else, with room on the disk, flushed to it. What fails says so in a std::error_code.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <system_error>

namespace ecorche::platform {

/// No child process inherits the file, however it is opened.
enum class Open : std::uint8_t {
  read,            ///< at once: a pipe's writer is not waited for
  write,           ///< what is there
  write_or_make,   ///< what is there, or a new file
  make,            ///< a new file: fails where anything has that name, a link too
  make_to_append,  ///< as `make`, written at its end; others may read it, never write
};

/// An open file, closed when it is destroyed.
class File {
 public:
  File() = default;
  File(const std::filesystem::path& path, Open how, std::error_code& error) noexcept;
  ~File();
  File(File&& other) noexcept;
  File& operator=(File&& other) noexcept;

  bool is_open() const { return descriptor_ >= 0; }
  /// Neither a folder nor a pipe nor a device.
  bool is_regular() const noexcept;
  std::uint64_t size(std::error_code& error) const noexcept;
  /// Whether `descriptor`, of another library, is of this very file.
  bool is_same(int descriptor) const noexcept;

  /// As many bytes as one call reads; 0 at the end, and where it fails.
  std::size_t read_at(std::uint64_t offset, std::span<std::byte> out, std::error_code& error) const noexcept;
  /// Writes all of it.
  void write(std::string_view bytes, std::error_code& error) noexcept;
  /// Has the disk keep room for `bytes` from `offset`; a shorter file gets longer.
  std::error_code reserve(std::uint64_t offset, std::uint64_t bytes) noexcept;
  std::error_code resize(std::uint64_t bytes) noexcept;
  /// To the disk.
  std::error_code flush() noexcept;
  /// Has the disk begin with these bytes, for which a later flush() then need not wait; where the system
  /// knows no such thing, nothing.
  void begin_flush(std::uint64_t offset, std::uint64_t bytes) noexcept;

 private:
  int descriptor_ = -1;
};

/// Has the disk hold the file, or the names in the folder, of that path.
std::error_code flush(const std::filesystem::path& path) noexcept;

/// Whether the disk, the file's limit or the user's share of the disk is full.
bool is_full(const std::error_code& error) noexcept;

/// Why nothing can be made in `folder`; no error where it can.
std::error_code cannot_make_in(const std::filesystem::path& folder) noexcept;

}  // namespace ecorche::platform
