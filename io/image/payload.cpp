// SPDX-License-Identifier: Apache-2.0
#include <zlib.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <optional>
#include <vector>

#include "core/files/look.hpp"
#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

using fields::refuse;
using Path = std::filesystem::path;

constexpr std::size_t kBlock = std::size_t{1} << 18;

// Inflates a zlib or gzip stream (or several in a row), at most `limit` + one block.
class Inflater {
 public:
  Inflater() { good_ = inflateInit2(&stream_, 15 + 32) == Z_OK; }  // 32: either kind of header
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  // False when the bytes are damaged. `take` gets the inflated bytes, piece by piece.
  template <class F>
  bool feed(std::vector<unsigned char>& in, std::size_t bytes, std::uint64_t limit, F&& take) {
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
      const std::size_t some = out_.size() - stream_.avail_out;
      take(count_, out_.data(), some);
      count_ += some;
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

std::uint64_t length_of(const Path& file) {
  std::error_code error;
  const std::uint64_t length = std::filesystem::file_size(file, error);
  return error ? 0 : length;
}

// What lies behind `data_offset`.
std::uint64_t present(const ImageHeader& header) {
  const std::uint64_t length = length_of(header.data_file);
  return length - std::min(header.data_offset, length);
}

// The bytes from `data_offset` on, but for the first `skip`.
class DataFile {
 public:
  explicit DataFile(const ImageHeader& header, std::uint64_t skip = 0)
      : name_(header.data_file.string()), file_(header.data_file, std::ios::binary) {
    file_.seekg(static_cast<std::streamoff>(header.data_offset + skip));
  }
  void read(void* to, std::uint64_t bytes) {
    file_.read(static_cast<char*>(to), static_cast<std::streamsize>(bytes));
    if (static_cast<std::uint64_t>(file_.gcount()) != bytes)
      throw Error(ErrorKind::io, name_, "reading failed", "check the disk");
  }

 private:
  std::string name_;
  std::ifstream file_;
};

// Inflates what the header declares, one byte more where there is more. Returns how much that was, nothing
// where the stream ends early.
template <class F>
std::optional<std::uint64_t> inflate_all(const ImageHeader& header, const Path& path, F&& take) {
  DataFile file(header);
  const std::uint64_t expected = header.stream_offset + header.all_bytes();
  Inflater inflater;
  std::vector<unsigned char> block(kBlock);
  for (std::uint64_t left = header.packed_bytes.value_or(present(header));
       left > 0 && inflater.count() <= expected;) {
    const std::uint64_t some = std::min<std::uint64_t>(left, block.size());
    file.read(block.data(), some);
    if (!inflater.feed(block, some, expected, take)) refuse(path, "its compressed voxels are damaged");
    left -= some;
  }
  if (!inflater.ended() && inflater.count() == expected) return std::nullopt;
  return inflater.count();
}

// As stored, in the order of this machine, and as what they mean.
void spend(const ImageHeader& header, std::uint64_t file_bytes, const Path& path,
           const files::ReadLimits& limits) {
  files::Budget budget = files::Budget::of_image(file_bytes, limits, path.string());
  budget.spend(header.voxel_bytes(), 1 + (header.planar ? 1 : 0));
  if (header.scaled || header.wide) budget.spend(header.voxel_bytes() / header.stored_bytes(), 8);
}

}  // namespace

std::uint64_t ImageHeader::voxel_bytes() const {
  return static_cast<std::uint64_t>(size[0]) * static_cast<std::uint64_t>(size[1]) *
         static_cast<std::uint64_t>(size[2]) * static_cast<std::uint64_t>(components) * stored_bytes();
}

std::string inflate_head(std::string_view packed, std::size_t limit, const Path& path) {
  if (packed.empty()) refuse(path, "is empty: it has no bytes", "copy it again");
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

void place_data(ImageHeader& header) {
  if (header.at_end) {
    const std::uint64_t length = length_of(header.data_file);
    header.data_offset = length - std::min(length, header.all_bytes());
    return;
  }
  if (header.skipped_lines > 0) {
    std::ifstream file(header.data_file, std::ios::binary);
    file.seekg(static_cast<std::streamoff>(header.data_offset));
    for (std::uint64_t line = 0; file && line < header.skipped_lines; ++line) {
      file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
      header.data_offset += static_cast<std::uint64_t>(file.gcount());
    }
  }
  header.data_offset += header.skipped_bytes;
}

void check_payload(const ImageHeader& header, const Path& path, const files::ReadLimits& limits) {
  if (!files::is_file(header.data_file)) {
    throw Error(ErrorKind::missing_input, header.data_file.string(), "cannot be opened",
                "the header " + path.string() + " names it");
  }
  const std::uint64_t there = present(header), expected = header.all_bytes();
  if (!header.gzip) {
    if (there != expected) {
      refuse(path,
             "declares " + std::to_string(expected) + " bytes of voxels, but has " + std::to_string(there));
    }
    return spend(header, there, path, limits);
  }
  const std::uint64_t packed = header.packed_bytes.value_or(there);
  if (packed > there) {
    refuse(path,
           "declares " + std::to_string(packed) + " compressed bytes, but has " + std::to_string(there));
  }
  if (expected / largest_inflation > packed) {
    refuse(path, "declares " + std::to_string(expected) + " bytes of voxels, but its " +
                     std::to_string(packed) + " compressed bytes cannot hold them");
  }
  spend(header, packed, path, limits);
}

std::vector<std::byte> stored_voxels(const ImageHeader& header, const Path& path) {
  std::vector<std::byte> out;
  if (!header.gzip) {
    out.resize(header.voxel_bytes());
    DataFile(header, header.bytes_before).read(out.data(), out.size());
    return out;
  }
  // Room is set aside, but only what comes is written there: a header that lies costs no memory.
  out.reserve(header.voxel_bytes());
  const std::uint64_t expected = header.stream_offset + header.all_bytes();
  const std::uint64_t first = header.stream_offset + header.bytes_before, past = first + header.voxel_bytes();
  const auto count =
      inflate_all(header, path, [&](std::uint64_t at, const unsigned char* from, std::size_t some) {
        const std::uint64_t begin = std::max(at, first), end = std::min(at + some, past);
        if (begin >= end) return;
        const auto* bytes = reinterpret_cast<const std::byte*>(from);
        out.insert(out.end(), bytes + (begin - at), bytes + (end - at));
      });
  if (!count)
    refuse(path, "its gzip stream is cut off behind the voxels: its checksum is missing", "copy it again");
  if (count != expected)
    refuse(path, "declares " + std::to_string(expected) + " bytes of voxels, but its compressed data hold " +
                     (*count > expected ? "more" : std::to_string(*count)));
  return out;
}

}  // namespace ecorche::io
