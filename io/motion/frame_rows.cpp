// SPDX-License-Identifier: Apache-2.0
#include "io/motion/frame_rows.hpp"

#include <algorithm>

#include <ecorche/values/error.hpp>

namespace ecorche::io {
namespace {

constexpr std::size_t kBlock = 64;

}  // namespace

FrameRows::FrameRows(TextStream stream, std::size_t columns, Read read)
    : stream_(std::move(stream)), columns_(columns), read_(std::move(read)) {
  std::vector<double> values(columns_);
  for (;; ++frames_) {
    const TextStream::Mark here = stream_.mark();
    if (!read_(stream_, frames_, values)) break;
    if (frames_ % kBlock == 0) marks_.push_back(here);
  }
  if (frames_ == 0) stream_.fail("has no frame");
}

std::span<const double> FrameRows::row(std::size_t frame) {
  const std::size_t block = frame / kBlock;
  if (block != block_) {
    const std::size_t first = block * kBlock, past = std::min(first + kBlock, frames_);
    block_ = static_cast<std::size_t>(-1);
    values_.resize((past - first) * columns_);
    stream_.seek(marks_.at(block));
    for (std::size_t f = first; f < past; ++f) {
      if (!read_(stream_, f, std::span(values_).subspan((f - first) * columns_, columns_)))
        throw Error(ErrorKind::io, stream_.where(), "has fewer frames than when it was opened",
                    "leave the file as it is while it plays");
    }
    block_ = block;
  }
  return std::span<const double>(values_).subspan((frame - block * kBlock) * columns_, columns_);
}

}  // namespace ecorche::io
