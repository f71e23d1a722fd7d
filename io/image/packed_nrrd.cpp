// SPDX-License-Identifier: Apache-2.0
// RFC 1951, 1952; teem.sourceforge.net/nrrd/format.html
#include "io/image/packed_nrrd.hpp"

#include <tbb/parallel_for.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdio>
#include <fstream>
#include <new>
#include <span>
#include <string>
#include <vector>

#include <ecorche/values/error.hpp>

namespace ecorche::io {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 20, kWindow = 32768;
constexpr std::size_t kPiecesAtOnce = 32;  // memory that is packed and not yet written
constexpr int kLevel = 2;                  // grey values hardly pack better above it

const char* nrrd_type(ScalarType type) {
  switch (type) {
    case ScalarType::u8:
      return "unsigned char";
    case ScalarType::i8:
      return "signed char";
    case ScalarType::u16:
      return "unsigned short";
    case ScalarType::i16:
      return "short";
    case ScalarType::u32:
      return "unsigned int";
    case ScalarType::i32:
      return "int";
    case ScalarType::f32:
      return "float";
    case ScalarType::f64:
      break;
  }
  return "double";
}

std::string triple(double a, double b, double c) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "(%.17g,%.17g,%.17g)", a, b, c);
  return text.data();
}

std::string nrrd_header(const Image& image) {
  const ImageGrid& g = image.grid;
  std::string out =
      "NRRD0004\n# Complete NRRD file format specification at:\n"
      "# http://teem.sourceforge.net/nrrd/format.html\n";
  out += std::string("type: ") + nrrd_type(image.type) +
         "\ndimension: 3\nspace: left-posterior-superior\nsizes:";
  for (const int n : g.size) out += " " + std::to_string(n);
  out += "\nspace directions:";
  for (std::size_t a = 0; a < 3; ++a)
    out += " " + triple(g.spacing[a] * g.direction[a], g.spacing[a] * g.direction[3 + a],
                        g.spacing[a] * g.direction[6 + a]);
  out += "\nkinds: domain domain domain\n";
  if (scalar_bytes(image.type) > 1)
    out += std::endian::native == std::endian::little ? "endian: little\n" : "endian: big\n";
  return out + "encoding: gzip\nspace origin: " + triple(g.origin[0], g.origin[1], g.origin[2]) + "\n\n";
}

// A piece of the stream: raw deflate, up to a byte's end; what lies before it serves as its dictionary.
struct Packed {
  std::vector<unsigned char> bytes;
  uLong crc = 0;
  std::size_t length = 0;
  bool good = false;
};

Packed pack(std::span<const unsigned char> all, std::size_t begin, std::size_t end) {
  Packed out;
  out.length = end - begin;
  auto* const from = const_cast<unsigned char*>(all.data() + begin);
  out.crc = crc32_z(crc32_z(0, nullptr, 0), from, out.length);
  z_stream stream{};
  if (deflateInit2(&stream, kLevel, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY) != Z_OK) return out;
  const std::size_t before = std::min(begin, kWindow);
  if (before > 0) deflateSetDictionary(&stream, from - before, static_cast<uInt>(before));
  out.bytes.resize(deflateBound(&stream, static_cast<uLong>(out.length)) + 16);
  stream.next_in = from;
  stream.avail_in = static_cast<uInt>(out.length);
  stream.next_out = out.bytes.data();
  stream.avail_out = static_cast<uInt>(out.bytes.size());
  const bool last = end == all.size();
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

void write_packed_nrrd(const std::filesystem::path& path, const Image& image) {
  std::ofstream file(path, std::ios::binary);
  const std::string head = nrrd_header(image);
  file.write(head.data(), static_cast<std::streamsize>(head.size()));
  constexpr std::array<char, 10> kGzip{'\x1f', '\x8b', 8, 0, 0, 0, 0, 0, 0, 3};
  file.write(kGzip.data(), kGzip.size());
  const std::span<const unsigned char> all{reinterpret_cast<const unsigned char*>(image.bytes.data()),
                                           image.bytes.size()};
  const std::size_t count = (all.size() + kPiece - 1) / kPiece;
  uLong crc = crc32_z(0, nullptr, 0);
  for (std::size_t first = 0; file && first < count; first += kPiecesAtOnce) {
    std::vector<Packed> some(std::min(kPiecesAtOnce, count - first));
    tbb::parallel_for(std::size_t{0}, some.size(), [&](std::size_t p) {
      const std::size_t begin = (first + p) * kPiece;
      some[p] = pack(all, begin, std::min(all.size(), begin + kPiece));
    });
    for (const Packed& piece : some) {
      if (!piece.good) throw std::bad_alloc();  // zlib asks for nothing else
      file.write(reinterpret_cast<const char*>(piece.bytes.data()),
                 static_cast<std::streamsize>(piece.bytes.size()));
      crc = crc32_combine(crc, piece.crc, static_cast<z_off_t>(piece.length));
    }
  }
  put_little(file, crc);
  put_little(file, all.size());
  file.close();
  if (!file) throw Error(ErrorKind::io, path.string(), "writing failed", "check the disk's free space");
}

}  // namespace ecorche::io
