// SPDX-License-Identifier: Apache-2.0
// The frames of a text file, read as they are needed.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "io/motion/text_stream.hpp"

namespace ecorche::io {

/// One pass over the file checks every frame and keeps where each 64th begins; later a frame is read again
/// with the 64 of its block. So memory is one block, and 1/4 byte a frame, whatever the clip's length.
class FrameRows {
 public:
  /// Reads frame number `frame` of the file, all of `values`; false where the file has no more.
  using Read = std::function<bool(TextStream&, std::size_t frame, std::span<double> values)>;

  /// `stream` stands at the first frame. Throws what `read` throws, and Error{data} for a file without
  /// frames.
  FrameRows(TextStream stream, std::size_t columns, Read read);

  std::size_t frames() const { return frames_; }
  /// Throws Error{data} at the file.
  [[noreturn]] void fail(std::string what) const { stream_.fail(std::move(what)); }
  /// `columns` values of a frame below `frames()`; good until the next call. Throws Error{io} when the file
  /// has changed since.
  std::span<const double> row(std::size_t frame);

 private:
  TextStream stream_;
  std::size_t columns_;
  Read read_;
  std::vector<TextStream::Mark> marks_;
  std::size_t frames_ = 0;
  std::size_t block_ = static_cast<std::size_t>(-1);
  std::vector<double> values_;
};

}  // namespace ecorche::io
