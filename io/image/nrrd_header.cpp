// SPDX-License-Identifier: Apache-2.0
// https://teem.sourceforge.net/nrrd/format.html
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "core/values/text.hpp"
#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

using fields::refuse;
using fields::set_wide;
using Path = std::filesystem::path;

// Field names without spaces, in lower case: teem takes `data file` and `datafile` for the same.
using NrrdFields = std::map<std::string, std::string>;

void set_nrrd_type(ImageHeader& header, const std::string& name, const Path& path) {
  static const std::map<std::string, ScalarType, std::less<>> types{{"signed char", ScalarType::i8},
                                                                    {"int8", ScalarType::i8},
                                                                    {"int8_t", ScalarType::i8},
                                                                    {"uchar", ScalarType::u8},
                                                                    {"unsigned char", ScalarType::u8},
                                                                    {"uint8", ScalarType::u8},
                                                                    {"uint8_t", ScalarType::u8},
                                                                    {"short", ScalarType::i16},
                                                                    {"short int", ScalarType::i16},
                                                                    {"signed short", ScalarType::i16},
                                                                    {"signed short int", ScalarType::i16},
                                                                    {"int16", ScalarType::i16},
                                                                    {"int16_t", ScalarType::i16},
                                                                    {"ushort", ScalarType::u16},
                                                                    {"unsigned short", ScalarType::u16},
                                                                    {"unsigned short int", ScalarType::u16},
                                                                    {"uint16", ScalarType::u16},
                                                                    {"uint16_t", ScalarType::u16},
                                                                    {"int", ScalarType::i32},
                                                                    {"signed int", ScalarType::i32},
                                                                    {"int32", ScalarType::i32},
                                                                    {"int32_t", ScalarType::i32},
                                                                    {"uint", ScalarType::u32},
                                                                    {"unsigned int", ScalarType::u32},
                                                                    {"uint32", ScalarType::u32},
                                                                    {"uint32_t", ScalarType::u32},
                                                                    {"float", ScalarType::f32},
                                                                    {"double", ScalarType::f64}};
  for (const std::string_view sign : {"", "signed ", "unsigned "}) {
    for (const std::string_view word : {"long long", "long long int"}) {
      if (name == std::string(sign) + std::string(word)) return set_wide(header, sign == "unsigned ");
    }
  }
  if (name == "int64" || name == "int64_t" || name == "longlong") return set_wide(header, false);
  if (name == "uint64" || name == "uint64_t" || name == "ulonglong") return set_wide(header, true);
  const auto found = types.find(name);
  if (found == types.end()) {
    refuse(path, "voxels of type '" + name + "' cannot be read",
           "convert them to 8, 16, 32 or 64-bit integers, float or double");
  }
  header.type = found->second;
}

// Reads the lines up to the empty one; `offset` becomes the byte after it.
NrrdFields read_nrrd_fields(std::string_view head, const Path& path, std::uint64_t& offset,
                            NrrdFields* free_keys = nullptr) {
  NrrdFields fields;
  std::size_t at = 0;
  bool ended = false;
  for (int line = 1; at < head.size(); ++line) {
    const std::size_t end = head.find('\n', at);
    if (end == head.npos && line > 1) break;  // what is no NRRD may have no line at all
    std::string_view text = head.substr(at, end - at);
    at = end + 1;
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    if (line == 1) {
      if (text.size() != 8 || text.substr(0, 7) != "NRRD000" || text[7] < '1' || text[7] > '5') {
        refuse(path, "is no NRRD: its first line is not NRRD0001 to NRRD0005");
      }
      continue;
    }
    if (text.empty()) {
      ended = true;
      break;
    }
    if (text.front() == '#') continue;
    if (const std::size_t free = text.find(":="); free != text.npos) {
      if (free_keys != nullptr) free_keys->emplace(text.substr(0, free), text::trim(text.substr(free + 2)));
      continue;
    }
    const std::size_t colon = text.find(": ");
    if (colon == text.npos) {
      refuse(path, "line " + std::to_string(line) + " of its header is no field: '" +
                       std::string(text.substr(0, 60)) + "'");
    }
    std::string key = text::lower(text.substr(0, colon));
    std::erase(key, ' ');
    if (!fields.emplace(key, text::trim(text.substr(colon + 2))).second) {
      refuse(path, "its header gives '" + key + "' twice");
    }
  }
  const bool detached = fields.contains("datafile");
  if (!ended && !detached) refuse(path, "its header does not end");
  offset = at;
  return fields;
}

std::string needed(const NrrdFields& fields, const char* key, const Path& path) {
  const auto found = fields.find(key);
  if (found == fields.end()) refuse(path, "its header lacks '" + std::string(key) + "'");
  return found->second;
}

// Which of four axes has no direction in space: the first, components of a voxel, or the last, volumes in
// time.
bool last_is_none(const NrrdFields& fields, const Path& path) {
  const auto found = fields.find("spacedirections");
  const std::vector<std::string_view> axes =
      found == fields.end() ? std::vector<std::string_view>() : text::words(found->second);
  const auto is_none = [](std::string_view axis) { return axis == "none"; };
  if (axes.empty() || is_none(axes.front()) == is_none(axes.back()) ||
      std::count_if(axes.begin(), axes.end(), is_none) != 1) {
    refuse(path, "has 4 axes, and neither the first nor the last is the only one with space direction 'none'",
           "save one 3-D image; components of a voxel come first, volumes in time last");
  }
  return is_none(axes.back());
}

// `count` volumes or components, on the first axis or the last.
void set_fourth_axis(const NrrdFields& fields, std::int64_t count, bool last, ImageHeader& header,
                     const Path& path) {
  if (last) {
    header.volumes = fields::volumes_of(count, path);
    return;
  }
  header.components = static_cast<int>(count);
  const auto kinds = fields.find("kinds");
  const auto words = kinds == fields.end() ? std::vector<std::string_view>() : text::words(kinds->second);
  const std::string kind = words.empty() ? "" : text::lower(words.front());
  header.may_be_volumes = kind == "list";
  if (kind != "time") return;
  header.volumes = fields::volumes_of(count, path);
  header.volumes_first = true;
}

void check_unit(const NrrdFields& fields, const Path& path) {
  const auto found = fields.find("spaceunits");
  if (found == fields.end()) return;
  for (const std::string_view unit : text::words(found->second)) {
    if (unit != "\"mm\"" && unit != "\"\"" && unit != "mm") {
      refuse(path, "its space units are " + found->second, "write it in mm");
    }
  }
}

// Lines go first; bytes are those of the voxels, so that of a stream they are inflated ones; -1: all but the
// voxels.
void read_skips(const NrrdFields& fields, ImageHeader& header, const Path& path) {
  const auto number = [&](const char* key, std::int64_t least) {
    const auto found = fields.find(key);
    return found == fields.end() ? 0
                                 : fields::integer(found->second, least, std::int64_t{1} << 40, key, path);
  };
  header.skipped_lines = static_cast<std::uint64_t>(number("lineskip", 0));
  const std::int64_t bytes = number("byteskip", header.gzip ? 0 : -1);
  header.at_end = bytes < 0;
  if (bytes > 0)
    (header.gzip ? header.stream_offset : header.skipped_bytes) = static_cast<std::uint64_t>(bytes);
}

// Vectors such as "(1,0,0) (0, 1, 0) none": those in parentheses.
std::vector<std::array<double, 3>> vectors(const NrrdFields& fields, const char* key) {
  std::vector<std::array<double, 3>> out;
  const auto found = fields.find(key);
  std::string_view rest = found == fields.end() ? std::string_view() : std::string_view(found->second);
  for (std::size_t open = rest.find('('); open != rest.npos; open = rest.find('(')) {
    const std::size_t close = std::min(rest.find(')', open), rest.size());
    std::string inside(rest.substr(open + 1, close - open - 1));
    std::replace(inside.begin(), inside.end(), ',', ' ');
    const auto numbers = text::words(inside);
    std::array<double, 3> v{};
    v.fill(std::nan(""));
    for (std::size_t i = 0; i < 3 && numbers.size() == 3; ++i) {
      const auto [end, error] =
          std::from_chars(numbers[i].data(), numbers[i].data() + numbers[i].size(), v[i]);
      if (error != std::errc() || end != numbers[i].data() + numbers[i].size()) v[i] = std::nan("");
    }
    out.push_back(v);
    rest.remove_prefix(std::min(close + 1, rest.size()));
  }
  return out;
}

// The grid in LPS of an image that says its space and directions.
std::optional<ImageGrid> grid_of(const NrrdFields& fields, const ImageHeader& header, const Path& path) {
  static const std::map<std::string, std::array<double, 3>, std::less<>> spaces{
      {"left-posterior-superior", {1, 1, 1}},   {"lps", {1, 1, 1}},
      {"right-anterior-superior", {-1, -1, 1}}, {"ras", {-1, -1, 1}},
      {"left-anterior-superior", {1, -1, 1}},   {"las", {1, -1, 1}}};
  const auto said = fields.find("space");
  if (said == fields.end()) return std::nullopt;
  std::string name = text::lower(said->second);
  std::replace(name.begin(), name.end(), ' ', '-');
  const auto space = spaces.find(name);
  if (space == spaces.end()) {
    refuse(path,
           "its space is '" + said->second.substr(0, 40) + "', which does not say where the patient lies",
           "write it as left-posterior-superior");
  }
  const auto axes = vectors(fields, "spacedirections"), origin = vectors(fields, "spaceorigin");
  if (axes.size() != 3 || origin.size() > 1) return std::nullopt;  // teem's to refuse
  ImageGrid grid;
  grid.size = header.size;
  for (std::size_t a = 0; a < 3; ++a) {
    grid.spacing[a] = std::hypot(axes[a][0], axes[a][1], axes[a][2]);
    for (std::size_t row = 0; row < 3; ++row)
      grid.direction[3 * row + a] = space->second[row] * axes[a][row] / grid.spacing[a];
    grid.origin[a] = origin.empty() ? 0 : space->second[a] * origin[0][a];
  }
  return grid;
}

}  // namespace

std::map<std::string, std::string> read_nrrd_keys(const Path& path) {
  NrrdFields keys;
  const std::string head = read_head(path);
  std::uint64_t offset = 0;
  if (head.starts_with("NRRD000")) read_nrrd_fields(head, path, offset, &keys);
  return keys;
}

ImageHeader parse_nrrd_header(std::string_view head, const Path& path) {
  ImageHeader header;
  const NrrdFields fields = read_nrrd_fields(head, path, header.data_offset);
  const std::int64_t dimension = fields::integer(needed(fields, "dimension", path), 0, 16, "dimension", path);
  if (dimension != 3 && dimension != 4) {
    refuse(path, "has " + std::to_string(dimension) + " axes", "save a 3-D image");
  }
  const bool last = dimension == 4 && last_is_none(fields, path);
  check_unit(fields, path);
  const std::string sizes = needed(fields, "sizes", path);
  const auto counts = text::words(sizes);
  if (counts.size() != static_cast<std::size_t>(dimension)) refuse(path, "its sizes are '" + sizes + "'");
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::int64_t count =
        fields::integer(counts[i], 1, std::numeric_limits<std::int32_t>::max(), "sizes", path);
    if (dimension == 4 && i == (last ? 3U : 0U)) {
      set_fourth_axis(fields, count, last, header, path);
    } else {
      header.size[last ? i : i - (counts.size() - 3)] = static_cast<std::int32_t>(count);
    }
  }
  set_nrrd_type(header, text::lower(needed(fields, "type", path)), path);
  fields::check_size(header, path);
  const std::string encoding = text::lower(needed(fields, "encoding", path));
  header.gzip = encoding == "gzip" || encoding == "gz";
  if (!header.gzip && encoding != "raw") {
    refuse(path, "its encoding is '" + encoding + "'", "save it as raw or gzip");
  }
  header.data_file = path;
  if (const auto detached = fields.find("datafile"); detached != fields.end()) {
    header.data_file = fields::beside(path, detached->second);
    header.data_offset = 0;
  }
  read_skips(fields, header, path);
  const auto endian = fields.find("endian");
  header.swapped =
      header.stored_bytes() > 1 && endian != fields.end() && text::lower(endian->second) == "big";
  header.grid = grid_of(fields, header, path);
  return header;
}

}  // namespace ecorche::io
