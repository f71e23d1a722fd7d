// SPDX-License-Identifier: Apache-2.0
// One copy of what several processes of a machine hold alike, in place of one each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <system_error>
#include <vector>

#include "core/platform/page_file.hpp"

namespace ecorche::files {

/// A folder in memory with a file for each content that somebody shares, named by its hash. Whoever has
/// arrays of that content has the file's pages stand in their place. Nothing in the folder is believed: a
/// file is taken only where it is this user's own, sealed, and equal to what this process has made for
/// itself, byte for byte. Any number of threads and processes may share at once.
///
///   process a: arrays --.                       .-- compared, then in their place --> a
///                        +--> HASH.pages, once --+
///   process b: arrays --'                       '-- compared, then in their place --> b
class PageStore {
 public:
  /// Arrays that do not change any more. Who changes one nevertheless gets a copy of his own of its pages.
  using Arrays = std::vector<std::span<const std::byte>>;
  /// Of an array: a smaller one is not shared.
  static constexpr std::size_t least_bytes = std::size_t{1} << 16;
  /// Arrays of one share(), the largest: each takes up to three of the kernel's 65530 mappings of a process.
  static constexpr std::size_t most_arrays = 1024;

  /// What is shared stays to be found by others until this ends, here and in every process that has it; then
  /// its file is removed. The arrays themselves stay as they are, and may end before or after.
  class Copy {
   public:
    Copy() = default;
    ~Copy();
    Copy(Copy&& other) noexcept = default;
    Copy& operator=(Copy&& other) noexcept;

    std::uint64_t bytes = 0;  ///< that stand in the arrays' place
    bool made = false;        ///< by this process; else it was there
    std::error_code error;    ///< why not all of them do

   private:
    friend class PageStore;
    platform::PageFile file_;
    std::filesystem::path path_;
  };

  /// Makes `folder` for this user where it is missing. Throws Error{cannot_create}; Error{refused} where it
  /// is on a disk, another user's, or others may write into it.
  explicit PageStore(std::filesystem::path folder);

  /// Whole pages of `arrays` come from the folder, where they are put unless they are there; where that fails
  /// the arrays stay this process' own, and so does one that lies at another place of a page than where it
  /// came from: arrays of 256 KiB and more do so seldom (use_tidy_heap). Removes what nobody has any more.
  /// Throws bad_alloc.
  Copy share(const Arrays& arrays) const;

 private:
  std::error_code take(const Arrays& arrays, Copy& copy) const;
  std::error_code make(const Arrays& arrays, Copy& copy) const;
  void sweep() const;

  std::filesystem::path folder_;
};

}  // namespace ecorche::files
