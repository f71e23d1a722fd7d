// SPDX-License-Identifier: Apache-2.0
// RFC 1951, 1952
#include "io/image/gzip_stream.hpp"

#include <tbb/parallel_for.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <new>
#include <vector>

namespace ecorche::io {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 20, kWindow = 32768;
constexpr std::size_t kPiecesAtOnce = 32;  // memory that is packed and not yet written
constexpr int kLevel = 2;                  // grey values hardly pack better above it

// A piece of the stream: raw deflate, up to a byte's end; what lies before it serves as its dictionary.
struct Packed {
  std::vector<unsigned char> bytes;
  uLong crc = 0;
  std::size_t length = 0;
  bool good = false;
};

Packed pack(const ByteSource& source, std::size_t begin, std::size_t end, bool last) {
  const std::size_t before = std::min(begin, kWindow);
  std::vector<unsigned char> plain(before + end - begin);
  source(begin - before, std::as_writable_bytes(std::span(plain)));
  Packed out;
  out.length = end - begin;
  unsigned char* const from = plain.data() + before;
  out.crc = crc32_z(crc32_z(0, nullptr, 0), from, out.length);
  z_stream stream{};
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) != Z_OK) return out;
  if (before > 0) deflateSetDictionary(&stream, plain.data(), static_cast<uInt>(before));
  out.bytes.resize(deflateBound(&stream, static_cast<uLong>(out.length)) + 16);
  stream.next_in = from;
  stream.avail_in = static_cast<uInt>(out.length);
  stream.next_out = out.bytes.data();
  stream.avail_out = static_cast<uInt>(out.bytes.size());
  const int code = deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
  out.good = code == (last ? Z_STREAM_END : Z_OK) && stream.avail_in == 0 && stream.avail_out > 0;
  out.bytes.resize(out.bytes.size() - stream.avail_out);
  deflateEnd(&stream);
  return out;
}

void put_little(std::ofstream& file, std::uint64_t value) {
  std::array<char, 4> bytes{};
  for (std::size_t b = 0; b < 4; ++b) bytes[b] = static_cast<char>(value >> (8 * b) & 0xff);
  file.write(bytes.data(), bytes.size());
}

}  // namespace

void write_gzip(std::ofstream& file, std::size_t size, const ByteSource& source) {
  constexpr std::array<char, 10> kHead{'\x1f', '\x8b', 8, 0, 0, 0, 0, 0, 0, 3};
  file.write(kHead.data(), kHead.size());
  const std::size_t count = (size + kPiece - 1) / kPiece;
  uLong crc = crc32_z(0, nullptr, 0);
  for (std::size_t first = 0; file && first < count; first += kPiecesAtOnce) {
    std::vector<Packed> some(std::min(kPiecesAtOnce, count - first));
    tbb::parallel_for(std::size_t{0}, some.size(), [&](std::size_t p) {
      const std::size_t begin = (first + p) * kPiece, end = std::min(size, begin + kPiece);
      some[p] = pack(source, begin, end, end == size);
    });
    for (const Packed& piece : some) {
      if (!piece.good) throw std::bad_alloc();  // zlib asks for nothing else
      file.write(reinterpret_cast<const char*>(piece.bytes.data()),
                 static_cast<std::streamsize>(piece.bytes.size()));
      crc = crc32_combine(crc, piece.crc, static_cast<z_off_t>(piece.length));
    }
  }
  put_little(file, crc);
  put_little(file, size);
}

}  // namespace ecorche::io
