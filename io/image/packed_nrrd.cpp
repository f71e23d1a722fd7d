// SPDX-License-Identifier: Apache-2.0
// teem.sourceforge.net/nrrd/format.html
#include "io/image/packed_nrrd.hpp"

#include <array>
#include <bit>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <string>

#include <ecorche/values/error.hpp>

#include "io/image/gzip_stream.hpp"

namespace ecorche::io {
namespace {

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
  const bool many = image.components > 1;
  std::string out =
      "NRRD0004\n# Complete NRRD file format specification at:\n"
      "# http://teem.sourceforge.net/nrrd/format.html\n";
  out += std::string("type: ") + nrrd_type(image.type) + (many ? "\ndimension: 4" : "\ndimension: 3") +
         "\nspace: left-posterior-superior\nsizes:";
  if (many) out += " " + std::to_string(image.components);
  for (const int n : g.size) out += " " + std::to_string(n);
  out += many ? "\nspace directions: none" : "\nspace directions:";
  for (std::size_t a = 0; a < 3; ++a)
    out += " " + triple(g.spacing[a] * g.direction[a], g.spacing[a] * g.direction[3 + a],
                        g.spacing[a] * g.direction[6 + a]);
  out += many ? "\nkinds: vector domain domain domain\n" : "\nkinds: domain domain domain\n";
  if (scalar_bytes(image.type) > 1)
    out += std::endian::native == std::endian::little ? "endian: little\n" : "endian: big\n";
  return out + "encoding: gzip\nspace origin: " + triple(g.origin[0], g.origin[1], g.origin[2]) + "\n\n";
}

}  // namespace

void write_packed_nrrd(const std::filesystem::path& path, const Image& image) {
  std::ofstream file(path, std::ios::binary);
  const std::string head = nrrd_header(image);
  file.write(head.data(), static_cast<std::streamsize>(head.size()));
  write_gzip(file, image.bytes.size(), [&](std::size_t begin, std::span<std::byte> out) {
    std::memcpy(out.data(), image.bytes.data() + begin, out.size());
  });
  file.close();
  if (!file) throw Error(ErrorKind::io, path.string(), "writing failed", "check the disk's free space");
}

}  // namespace ecorche::io
