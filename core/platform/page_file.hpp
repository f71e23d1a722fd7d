// SPDX-License-Identifier: Apache-2.0
// A file in memory whose pages stand in the memory of several processes: each has them once for all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <system_error>

namespace ecorche::platform {

/// Bytes of a page, a power of two.
std::size_t page_bytes() noexcept;

/// Why what is put into `folder` may not be believed: it is not this user's own, others may write into it
/// (permission_denied), or it is on a disk (not_supported). No error where it may.
std::error_code cannot_keep_pages_in(const std::filesystem::path& folder) noexcept;

/// Makes a folder that only this user may enter, below one that is there. No error where something of that
/// name is there already.
std::error_code make_own_folder(const std::filesystem::path& folder) noexcept;

/// Gives a file another name in its folder; file_exists where something has that name.
std::error_code rename_to_new(const std::filesystem::path& from, const std::filesystem::path& to) noexcept;

/// Open, and closed when it is destroyed. No child process inherits it.
class PageFile {
 public:
  PageFile() = default;
  ~PageFile();
  PageFile(PageFile&& other) noexcept;
  PageFile& operator=(PageFile&& other) noexcept;

  /// A new file, empty, that only this user may write; fails where anything has that name.
  static PageFile make(const std::filesystem::path& path, std::error_code& error) noexcept;
  /// What is there, to be read. permission_denied for all but a regular file of this user's that no other may
  /// write: no link is followed.
  static PageFile open(const std::filesystem::path& path, std::error_code& error) noexcept;

  bool is_open() const { return descriptor_ >= 0; }
  /// 0 where that cannot be known.
  std::uint64_t size() const noexcept;
  /// Holds it with others; false where somebody has it alone. To hold and to have alone end with the file,
  /// and with the process.
  bool hold() noexcept;
  /// Has it alone, also in place of holding it; false where others hold it.
  bool take_alone() noexcept;
  /// Whether the file still has a name.
  bool has_name() const noexcept;
  /// Whether `path` is a name of this very file.
  bool is_at(const std::filesystem::path& path) const noexcept;
  /// Whether nobody may open it to write.
  bool is_sealed() const noexcept;

  /// With zeros at its end where it gets longer.
  std::error_code resize(std::uint64_t bytes) noexcept;
  /// Writes all of `bytes` from `offset` on.
  std::error_code write_at(std::uint64_t offset, std::span<const std::byte> bytes) noexcept;
  /// From here on nobody may open it to write; who has it open still may. This user could undo it.
  std::error_code seal() noexcept;
  /// Fills `out`; an error where the file ends before.
  std::error_code read_at(std::uint64_t offset, std::span<std::byte> out) const noexcept;

  /// The file's pages from `offset` on come to stand at `pages` in place of those that this process has
  /// there, which must hold the same bytes: who reads there sees no difference. Who writes there has a copy
  /// of its own from then on. Whole pages, all of them within the file.
  std::error_code stand_at(std::uint64_t offset, std::span<const std::byte> pages) const noexcept;

 private:
  explicit PageFile(int descriptor) : descriptor_(descriptor) {}
  int descriptor_ = -1;
};

}  // namespace ecorche::platform
