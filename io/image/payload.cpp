// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <vector>

#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

using fields::refuse;
using Path = std::filesystem::path;

constexpr std::size_t kBlock = std::size_t{1} << 18;

// Counts what a zlib or gzip stream (or several in a row) inflates to, at most `limit` + one block.
class Inflater {
 public:
  Inflater() { good_ = inflateInit2(&stream_, 15 + 32) == Z_OK; }  // 32: either kind of header
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  // False when the bytes are damaged.
  bool feed(std::vector<unsigned char>& in, std::size_t bytes, std::uint64_t limit) {
    stream_.next_in = in.data();
    stream_.avail_in = static_cast<uInt>(bytes);
    while (good_ && stream_.avail_in > 0 && count_ <= limit) {
      if (ended_) {
        if (count_ == limit) return true;  // whatever follows a whole stream
        good_ = inflateReset(&stream_) == Z_OK;
        ended_ = false;
      }
      stream_.next_out = out_.data();
      stream_.avail_out = static_cast<uInt>(out_.size());
      const int code = inflate(&stream_, Z_NO_FLUSH);
      count_ += out_.size() - stream_.avail_out;
      ended_ = code == Z_STREAM_END;
      good_ =
          good_ && (code == Z_OK || code == Z_STREAM_END || (code == Z_BUF_ERROR && stream_.avail_in == 0));
    }
    return good_;
  }
  std::uint64_t count() const { return count_; }
  bool ended() const { return ended_; }

 private:
  z_stream stream_{};
  bool good_ = false, ended_ = false;
  std::uint64_t count_ = 0;
  std::vector<unsigned char> out_ = std::vector<unsigned char>(kBlock);
};

void check_stream(const ImageHeader& header, std::uint64_t packed, const Path& path) {
  std::ifstream file(header.data_file, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(header.data_offset));
  const std::uint64_t expected = header.stream_offset + header.voxel_bytes();
  Inflater inflater;
  std::vector<unsigned char> block(kBlock);
  for (std::uint64_t left = packed; left > 0 && inflater.count() <= expected;) {
    const std::uint64_t some = std::min<std::uint64_t>(left, block.size());
    file.read(reinterpret_cast<char*>(block.data()), static_cast<std::streamsize>(some));
    if (static_cast<std::uint64_t>(file.gcount()) != some) {
      throw Error(ErrorKind::io, header.data_file.string(), "reading failed", "check the disk");
    }
    if (!inflater.feed(block, some, expected)) refuse(path, "its compressed voxels are damaged");
    left -= some;
  }
  if (inflater.count() != expected || !inflater.ended()) {
    refuse(path, "declares " + std::to_string(expected) + " bytes of voxels, but its compressed data hold " +
                     (inflater.count() > expected ? "more" : std::to_string(inflater.count())));
  }
}

}  // namespace

std::uint64_t ImageHeader::voxel_bytes() const {
  return static_cast<std::uint64_t>(size[0]) * static_cast<std::uint64_t>(size[1]) *
         static_cast<std::uint64_t>(size[2]) * static_cast<std::uint64_t>(components) * scalar_bytes(type);
}

std::string inflate_head(std::string_view packed, std::size_t limit, const Path& path) {
  z_stream stream{};
  if (!packed.starts_with("\x1f\x8b") || inflateInit2(&stream, 15 + 16) != Z_OK)
    refuse(path, "is not packed by gzip");
  std::string out(limit, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(limit);
  const int code = inflate(&stream, Z_SYNC_FLUSH);
  out.resize(limit - stream.avail_out);
  inflateEnd(&stream);
  if (code != Z_OK && code != Z_STREAM_END && code != Z_BUF_ERROR) refuse(path, "its gzip stream is damaged");
  return out;
}

void check_payload(const ImageHeader& header, const Path& path) {
  std::error_code error;
  const std::uint64_t length = std::filesystem::file_size(header.data_file, error);
  if (error || !std::filesystem::is_regular_file(header.data_file)) {
    throw Error(ErrorKind::missing_input, header.data_file.string(), "cannot be opened",
                "the header " + path.string() + " names it");
  }
  const std::uint64_t present = length - std::min<std::uint64_t>(header.data_offset, length);
  const std::uint64_t expected = header.voxel_bytes();
  if (!header.gzip) {
    if (present != expected) {
      refuse(path,
             "declares " + std::to_string(expected) + " bytes of voxels, but has " + std::to_string(present));
    }
    return;
  }
  const std::uint64_t packed = header.packed_bytes.value_or(present);
  if (packed > present) {
    refuse(path,
           "declares " + std::to_string(packed) + " compressed bytes, but has " + std::to_string(present));
  }
  if (expected / largest_inflation > packed) {
    refuse(path, "declares " + std::to_string(expected) + " bytes of voxels, but its " +
                     std::to_string(packed) + " compressed bytes cannot hold them");
  }
  check_stream(header, packed, path);
}

}  // namespace ecorche::io
