// SPDX-License-Identifier: Apache-2.0
// https://slicer.readthedocs.io/en/latest/developer_guide/modules/segmentations.html (terminology)
#include "io/image/terminology.hpp"

#include <array>

namespace ecorche::io {
namespace {

// Cuts the text before the next `end` off `rest`.
std::string_view cut(std::string_view& rest, char end) {
  const std::size_t at = rest.find(end);
  const std::string_view part = rest.substr(0, at);
  rest.remove_prefix(at == rest.npos ? rest.size() : at + 1);
  return part;
}

CodedName coded(std::string_view triple) {
  CodedName word;
  word.scheme = cut(triple, '^');
  word.value = cut(triple, '^');
  word.meaning = cut(triple, '^');
  return word;
}

}  // namespace

SegmentCodes parse_terminology(std::string_view entry) {
  // Context, category, type, its modifier, context of the region, region, its modifier.
  std::array<std::string_view, 7> part;
  for (std::string_view& p : part) p = cut(entry, '~');
  return {.label = {},
          .category = coded(part[1]),
          .type = coded(part[2]),
          .side = coded(part[3]),
          .region = coded(part[5]),
          .region_side = coded(part[6])};
}

std::string terminology_entry(const SegmentCodes& codes) {
  const auto triple = [](const CodedName& word) {
    return "~" + word.scheme + "^" + word.value + "^" + word.meaning;
  };
  return "Segmentation category and type - 3D Slicer General Anatomy list" + triple(codes.category) +
         triple(codes.type) + triple(codes.side) + "~Anatomic codes - DICOM master list" +
         triple(codes.region) + triple(codes.region_side);
}

}  // namespace ecorche::io
