// SPDX-License-Identifier: Apache-2.0
// https://dicom.nema.org/medical/dicom/current/output/chtml/part05/chapter_G.html
// Ours: DCMTK 3.6.7's decoder reads beyond damaged segments.
#include <algorithm>
#include <array>

#include "io/image/dicom_pixels.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io::dicom {
namespace {

constexpr std::size_t kHead = 64;

unsigned byte_at(std::string_view bytes, std::size_t at) {
  return static_cast<unsigned char>(bytes[at]);
}

std::size_t little(std::string_view bytes, std::size_t at) {
  std::size_t out = 0;
  for (std::size_t i = 4; i-- > 0;) out = out << 8 | byte_at(bytes, at + i);
  return out;
}

// One segment into every `step`-th byte from `to` on; false where it holds too little.
bool unpack_segment(std::string_view packed, std::span<std::byte> out, std::size_t to, std::size_t step) {
  for (std::size_t at = 0; to < out.size() && at < packed.size();) {
    const unsigned code = byte_at(packed, at++);
    if (code == 128) continue;
    const bool copies = code < 128;
    const std::size_t count = copies ? code + 1 : 257 - code;
    if (packed.size() - at < (copies ? count : 1)) return false;
    for (std::size_t i = 0; i < count && to < out.size(); ++i, to += step)
      out[to] = static_cast<std::byte>(packed[copies ? at + i : at]);
    at += copies ? count : 1;
  }
  return to >= out.size();
}

}  // namespace

void unpack_rle(std::string_view packed, const StoredPixels& pixels, std::span<std::byte> out,
                const std::filesystem::path& path) {
  const auto width = static_cast<std::size_t>(pixels.allocated / 8);
  const auto broken = [&](const std::string& what) {
    fields::refuse(path, "its RLE pixels " + what, "copy it from the archive again");
  };
  if (packed.size() < kHead || little(packed, 0) != width)
    broken("are not in " + std::to_string(width) + " segments");
  // The first segment holds the most significant bytes.
  for (std::size_t s = 0; s < width; ++s) {
    const std::size_t begin = little(packed, 4 * (s + 1));
    const std::size_t end = s + 1 < width ? little(packed, 4 * (s + 2)) : packed.size();
    if (begin < kHead || begin > end || end > packed.size()) broken("have segments beyond their end");
    if (!unpack_segment(packed.substr(begin, end - begin), out, width - 1 - s, width))
      broken("end too early");
  }
}

}  // namespace ecorche::io::dicom
