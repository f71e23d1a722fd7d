// SPDX-License-Identifier: Apache-2.0
// https://itk.org/Wiki/ITK/MetaIO/Documentation
#include <charconv>
#include <initializer_list>
#include <map>
#include <vector>

#include "core/values/text.hpp"
#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

using fields::refuse;
using fields::set_wide;
using Path = std::filesystem::path;
using MetaFields = std::map<std::string, std::string, std::less<>>;

void set_meta_type(ImageHeader& header, const std::string& name, const Path& path) {
  static const std::map<std::string, ScalarType, std::less<>> types{
      {"MET_CHAR", ScalarType::i8},    {"MET_UCHAR", ScalarType::u8},  {"MET_SHORT", ScalarType::i16},
      {"MET_USHORT", ScalarType::u16}, {"MET_INT", ScalarType::i32},   {"MET_UINT", ScalarType::u32},
      {"MET_FLOAT", ScalarType::f32},  {"MET_DOUBLE", ScalarType::f64}};
  if (name == "MET_LONG_LONG") return set_wide(header, false);
  if (name == "MET_ULONG_LONG") return set_wide(header, true);
  const auto found = types.find(name);
  if (found == types.end()) {
    refuse(path, "voxels of type '" + name + "' cannot be read",
           "convert them to 8, 16, 32 or 64-bit integers, float or double");
  }
  header.type = found->second;
}

// Reads the lines up to ElementDataFile, which ends the header; `offset` becomes the byte after it.
MetaFields read_meta_fields(std::string_view head, const Path& path, std::uint64_t& offset) {
  MetaFields fields;
  std::size_t at = 0;
  for (int line = 1; at < head.size(); ++line) {
    const std::size_t end = head.find('\n', at);
    if (end == head.npos) break;
    const std::string_view text = head.substr(at, end - at);
    at = end + 1;
    const std::size_t equals = text.find('=');
    const std::string key(text::trim(text.substr(0, std::min(equals, text.size()))));
    const bool named =
        equals != text.npos && !key.empty() &&
        key.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") == key.npos;
    if (!named) {
      refuse(path,
             "line " + std::to_string(line) + " of its header is no 'Key = value': '" +
                 std::string(text.substr(0, 60)) + "'",
             "it must be a MetaImage");
    }
    if (!fields.emplace(key, text::trim(text.substr(equals + 1))).second) {
      refuse(path, "its header gives '" + key + "' twice");
    }
    if (key == "ElementDataFile") {
      offset = at;
      return fields;
    }
  }
  refuse(path, "its header has no line 'ElementDataFile = ...'", "it must be a MetaImage");
}

std::string value_of(const MetaFields& fields, std::string_view key, const std::string& otherwise) {
  const auto found = fields.find(key);
  return found == fields.end() ? otherwise : found->second;
}

std::string needed(const MetaFields& fields, std::string_view key, const Path& path) {
  const auto found = fields.find(key);
  if (found == fields.end()) refuse(path, "its header lacks '" + std::string(key) + "'");
  return found->second;
}

bool truth(const MetaFields& fields, std::string_view key, bool otherwise) {
  const std::string value = value_of(fields, key, otherwise ? "True" : "False");
  return value == "True" || value == "true" || value == "1";
}

// `count` numbers of the first of `keys` that is there; `otherwise` where none is.
std::vector<double> numbers_of(const MetaFields& fields, std::initializer_list<std::string_view> keys,
                               std::size_t count, std::vector<double> otherwise, const Path& path) {
  for (const std::string_view key : keys) {
    const auto found = fields.find(key);
    if (found == fields.end()) continue;
    std::vector<double> out;
    for (const std::string_view word : text::words(found->second)) {
      double value = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (error == std::errc() && end == word.data() + word.size()) out.push_back(value);
    }
    if (out.size() != count || text::words(found->second).size() != count)
      refuse(path, "its " + std::string(key) + " is not " + std::to_string(count) + " numbers");
    return out;
  }
  return otherwise;
}

// Of an image in time, which ITK's reader takes for one of four dimensions in space. The rows of the matrix
// are the axes; the fourth must be time alone.
ImageGrid grid_in_time(const MetaFields& fields, const ImageHeader& header, const Path& path) {
  const std::vector<double> unit{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const auto axes = numbers_of(fields, {"TransformMatrix", "Rotation", "Orientation"}, 16, unit, path);
  const auto origin = numbers_of(fields, {"Offset", "Position", "Origin"}, 4, {0, 0, 0, 0}, path);
  const auto spacing = numbers_of(fields, {"ElementSpacing", "ElementSize"}, 4, {1, 1, 1, 1}, path);
  ImageGrid grid;
  grid.size = header.size;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axes[4 * axis + 3] != 0 || axes[12 + axis] != 0)
      refuse(path, "its TransformMatrix mixes space and time", "save one 3-D image");
    for (std::size_t row = 0; row < 3; ++row) grid.direction[3 * row + axis] = axes[4 * axis + row];
    grid.origin[axis] = origin[axis];
    grid.spacing[axis] = spacing[axis];
  }
  return grid;
}

}  // namespace

ImageHeader parse_meta_header(std::string_view head, const Path& path) {
  ImageHeader header;
  const MetaFields fields = read_meta_fields(head, path, header.data_offset);
  if (value_of(fields, "ObjectType", "Image") != "Image") {
    refuse(path, "holds a '" + fields.at("ObjectType") + "'", "it must be an image");
  }
  const std::string axes = needed(fields, "NDims", path);
  if (axes != "3" && axes != "4") refuse(path, "has " + axes + " axes", "save a 3-D image");
  const std::string sizes = needed(fields, "DimSize", path);
  const auto counts = text::words(sizes);
  if (counts.size() != (axes == "3" ? 3U : 4U)) refuse(path, "its DimSize is '" + sizes + "'");
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::int64_t count =
        fields::integer(counts[i], 1, std::numeric_limits<std::int32_t>::max(), "DimSize", path);
    if (i < 3) header.size[i] = static_cast<std::int32_t>(count);
    if (i == 3) header.volumes = fields::volumes_of(count, path);
  }
  if (axes == "4") header.grid = grid_in_time(fields, header, path);
  header.components = static_cast<int>(fields::integer(value_of(fields, "ElementNumberOfChannels", "1"), 1,
                                                       1 << 16, "ElementNumberOfChannels", path));
  set_meta_type(header, needed(fields, "ElementType", path), path);
  fields::check_size(header, path);
  if (!truth(fields, "BinaryData", false)) refuse(path, "its voxels are text", "save it as binary");
  header.gzip = truth(fields, "CompressedData", false);
  if (header.gzip && fields.contains("CompressedDataSize")) {
    header.packed_bytes = static_cast<std::uint64_t>(fields::integer(fields.at("CompressedDataSize"), 0,
                                                                     std::numeric_limits<std::int64_t>::max(),
                                                                     "CompressedDataSize", path));
  }
  header.swapped = header.stored_bytes() > 1 && (truth(fields, "BinaryDataByteOrderMSB", false) ||
                                                 truth(fields, "ElementByteOrderMSB", false));
  const std::string data = needed(fields, "ElementDataFile", path);
  const std::int64_t skip = fields::integer(value_of(fields, "HeaderSize", "0"), -1,
                                            std::numeric_limits<std::int64_t>::max(), "HeaderSize", path);
  header.data_file = path;
  if (data != "LOCAL" && data != "Local" && data != "local") {
    header.data_file = fields::beside(path, data);
    header.data_offset = static_cast<std::uint64_t>(std::max<std::int64_t>(skip, 0));
    header.at_end = skip < 0 && !header.gzip;
  } else if (skip != 0) {
    refuse(path, "its header asks to skip " + fields.at("HeaderSize") + " bytes of its own file",
           "write it without HeaderSize");
  }
  return header;
}

}  // namespace ecorche::io
