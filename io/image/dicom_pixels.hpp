// SPDX-License-Identifier: Apache-2.0
// The pixels of a file, frame by frame, as they are stored.
#pragma once

#include <cstddef>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include "io/image/dicom_slice.hpp"

namespace ecorche::io::dicom {

/// Holds the file open, and where the packed stream of each frame lies.
class PixelFile {
 public:
  /// `bytes` is the file's size. Throws Error{data} where it does not hold all its frames, Error{io}.
  PixelFile(const std::filesystem::path& path, std::uint64_t bytes, const StoredPixels& pixels);

  /// Bytes of one frame in memory; whole ones, also of single bits.
  std::size_t frame_bytes() const { return frame_bytes_; }

  /// Fills `out`, of `frame_bytes()`: rows one after the other, each number in the byte order of this
  /// machine. Throws Error{data} where it cannot be unpacked, or unpacks to something else; Error{io}.
  void read(std::uint32_t frame, std::span<std::byte> out);

  /// Raw bytes of the pixels from `from` on, of single bits that run on from frame to frame.
  void read_raw(std::uint64_t from, std::span<std::byte> out);

 private:
  struct Fragment {
    std::uint64_t at = 0, bytes = 0;
  };
  void find_fragments();
  void share_out(const std::vector<std::uint32_t>& offsets, const std::vector<Fragment>& fragments);
  std::string packed(std::uint32_t frame);
  void read_at(std::uint64_t at, std::span<std::byte> out);

  std::filesystem::path path_;
  std::uint64_t file_bytes_;
  StoredPixels pixels_;
  std::size_t frame_bytes_ = 0;
  std::ifstream file_;
  std::vector<Fragment> fragments_;
  std::vector<std::size_t> first_;  ///< fragment of each frame, and one past the last
};

/// Unpacks one frame of grey values into `out`, which its size fits. What the stream itself says of its size
/// must be what `pixels` says, or nothing is allocated. Throws Error{data}.
void unpack(std::string_view packed, const StoredPixels& pixels, std::span<std::byte> out,
            const std::filesystem::path& path);

/// The same of RLE alone.
void unpack_rle(std::string_view packed, const StoredPixels& pixels, std::span<std::byte> out,
                const std::filesystem::path& path);

}  // namespace ecorche::io::dicom
