// SPDX-License-Identifier: Apache-2.0
// How much memory a file of others may cost.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include <ecorche/values/error.hpp>

namespace ecorche::files {

/// What the decoding of one file may take. A file that lists its geometry takes at most about 50 times its
/// own bytes in any format read here (a PLY whose faces are bytes); one that shares, repeats or packs it may
/// say any number.
struct ReadLimits {
  std::uint64_t base = std::uint64_t{256} << 20;  ///< bytes, for any file however small
  /// The same for images: gzip packs an empty label map 1000 to 1.
  std::uint64_t image_base = std::uint64_t{2} << 30;
  std::uint64_t per_byte = 64;  ///< bytes more for each byte of the file

  /// Of `base` bytes for whatever is read.
  static ReadLimits of(std::uint64_t base) { return {base, base, 64}; }
};

/// Counts what a decoder takes before it takes it.
class Budget {
 public:
  /// For a file of `file_bytes`, which `where` names in messages.
  Budget(std::uint64_t file_bytes, const ReadLimits& limits, std::string where)
      : Budget(limits.base, limits.per_byte, file_bytes, std::move(where)) {}
  /// The same for the voxels of an image.
  static Budget of_image(std::uint64_t file_bytes, const ReadLimits& limits, std::string where) {
    return {limits.image_base, limits.per_byte, file_bytes, std::move(where)};
  }

  /// The file that is read.
  const std::string& where() const { return where_; }
  /// Bytes that may still be taken.
  std::uint64_t left() const { return left_; }

  /// Takes `count` times `bytes`. Throws Error{data} where that is more than is left.
  void spend(std::uint64_t count, std::uint64_t bytes = 1) {
    if (bytes > 0 && count > left_ / bytes) refuse();
    left_ -= count * bytes;
  }
  /// Points of a mesh: as they are read, merged and handed on.
  void spend_points(std::uint64_t count) { spend(count, 120); }
  /// Triangles of a mesh: three corners, twice, and room to grow.
  void spend_triangles(std::uint64_t count) { spend(count, 48); }

  /// Another file of `bytes` belongs to it.
  void add_file(std::uint64_t bytes) { left_ += std::min(bytes, most_ / per_byte_) * per_byte_; }

  /// Throws Error{data}: the file says more than it may take.
  [[noreturn]] void refuse() const {
    throw Error(ErrorKind::data, where_,
                "takes more memory than its " + std::to_string(file_bytes_) + " bytes stand for: over " +
                    std::to_string(whole_ >> 20) + " MiB",
                "if it is what you mean to read, allow more by --read-budget MIB");
  }

 private:
  Budget(std::uint64_t base, std::uint64_t per_byte, std::uint64_t file_bytes, std::string where)
      : where_(std::move(where)), file_bytes_(file_bytes), per_byte_(std::max<std::uint64_t>(per_byte, 1)) {
    left_ = std::min(base, most_);
    add_file(file_bytes);
    whole_ = left_;
  }

  // Of each term: sums of a few stay far from overflow.
  static constexpr std::uint64_t most_ = std::uint64_t{1} << 60;

  std::string where_;
  std::uint64_t file_bytes_, per_byte_, left_ = 0, whole_ = 0;
};

}  // namespace ecorche::files
