// SPDX-License-Identifier: Apache-2.0
// https://slicer.readthedocs.io/en/latest/developer_guide/modules/segmentations.html (Segmentation file)
#include "io/image/segmentation.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <set>
#include <tuple>

#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"
#include "io/image/dicom.hpp"
#include "io/image/dicom_segmentation.hpp"
#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"
#include "io/image/image_file.hpp"
#include "io/image/nifti_names.hpp"
#include "io/image/renumber.hpp"
#include "io/image/terminology.hpp"

namespace ecorche::io {
namespace {

using fields::refuse;
using Path = std::filesystem::path;

struct Segment {
  std::string name;
  std::int64_t value = 1;
  std::int64_t layer = 0;
  std::optional<SegmentCodes> code;
};

// `Segment0_Tags` holds `key:value|key:value|`; newer files may have the entry under a key of its own.
std::optional<SegmentCodes> code_of(const std::string* tags, const std::string* entry) {
  if (entry != nullptr) return parse_terminology(*entry);
  constexpr std::string_view key = "TerminologyEntry:";
  const std::size_t at = tags == nullptr ? std::string::npos : tags->find(key);
  if (at == std::string::npos) return std::nullopt;
  const std::string_view rest = std::string_view(*tags).substr(at + key.size());
  return parse_terminology(rest.substr(0, rest.find('|')));
}

// From `Segment<i>_Name`, `_ID`, `_LabelValue` and `_Layer`, in the order of i. Files older than layers have
// one component a segment and neither value nor layer.
std::vector<Segment> read_segments(const std::map<std::string, std::string>& keys, int layers,
                                   const Path& path) {
  std::vector<Segment> out;
  const auto value_of = [&](std::size_t i, const char* key) -> const std::string* {
    const auto found = keys.find("Segment" + std::to_string(i) + "_" + key);
    return found == keys.end() ? nullptr : &found->second;
  };
  for (std::size_t i = 0; value_of(i, "ID") != nullptr || value_of(i, "Name") != nullptr; ++i) {
    Segment segment;
    const std::string* name = value_of(i, "Name");
    segment.name = name != nullptr ? *name : *value_of(i, "ID");
    segment.code = code_of(value_of(i, "Tags"), value_of(i, "TerminologyEntry"));
    segment.layer = layers > 1 ? static_cast<std::int64_t>(i) : 0;
    const std::string at = "Segment" + std::to_string(i);
    constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
    if (const std::string* value = value_of(i, "LabelValue"))
      segment.value = fields::integer(*value, -most, most, at + "_LabelValue", path);
    if (const std::string* layer = value_of(i, "Layer"))
      segment.layer = fields::integer(*layer, 0, most, at + "_Layer", path);
    if (segment.layer >= layers)
      refuse(path, at + " lies in layer " + std::to_string(segment.layer) + " of " + std::to_string(layers));
    if (segment.value == 0) refuse(path, at + " has the label value 0, which is nothing");
    out.push_back(std::move(segment));
  }
  return out;
}

// Component `layer` of every voxel.
Image take_layer(const Image& image, int layer) {
  Image out(image.grid, image.type);
  const std::size_t size = scalar_bytes(image.type), step = size * static_cast<std::size_t>(image.components);
  const std::byte* from = image.bytes.data() + size * static_cast<std::size_t>(layer);
  for (std::size_t v = 0; v < out.grid.voxels(); ++v)
    std::memcpy(out.bytes.data() + v * size, from + v * step, size);
  return out;
}

// Layers side by side, in every voxel.
Image interleave(const std::vector<Image>& layers) {
  const Image& first = layers.front();
  Image out(first.grid, first.type, static_cast<int>(layers.size()));
  const std::size_t size = scalar_bytes(first.type), step = size * layers.size();
  for (std::size_t layer = 0; layer < layers.size(); ++layer) {
    if (!(layers[layer].grid == first.grid) || layers[layer].type != first.type ||
        layers[layer].components != 1)
      throw Error(ErrorKind::internal, "labels", "layers differ in grid or type", "report this");
    for (std::size_t v = 0; v < first.grid.voxels(); ++v)
      std::memcpy(out.bytes.data() + v * step + layer * size, layers[layer].bytes.data() + v * size, size);
  }
  return out;
}

bool holds(const Image& layer, std::int64_t id) {
  return with_scalar_type(layer.type, [&](auto zero) {
    const auto voxels = layer.scalars<decltype(zero)>();
    return std::any_of(voxels.begin(), voxels.end(),
                       [&](auto v) { return static_cast<std::int64_t>(v) == id; });
  });
}

}  // namespace

void write_segmentation(const Path& path, const Segmentation& segmentation) {
  if (!text::lower(path.filename().string()).ends_with(".seg.nrrd"))
    throw Error(ErrorKind::usage, path.string(), "segmentations are written as .seg.nrrd", "name it so");
  std::string keys;
  std::size_t count = 0;
  for (const auto& [id, name] : segmentation.names) {
    for (std::size_t layer = 0; layer < segmentation.layers.size(); ++layer) {
      if (!holds(segmentation.layers[layer], id)) continue;
      const std::string at = "Segment" + std::to_string(count++) + "_";
      keys += at + "ID:=" + name + "\n" + at + "Name:=" + name + "\n" + at +
              "LabelValue:=" + std::to_string(id) + "\n" + at + "Layer:=" + std::to_string(layer) + "\n";
      if (const auto codes = segmentation.codes.find(id); codes != segmentation.codes.end())
        keys += at + "Tags:=TerminologyEntry:" + terminology_entry(codes->second) + "|\n";
      break;
    }
  }
  const files::AtomicFile made(path);  // never committed: its bytes are completed first
  write_image(made.temporary(), interleave(segmentation.layers));
  std::string bytes = files::read_text(made.temporary(), static_cast<std::size_t>(largest_image_bytes) * 2);
  bytes.insert(bytes.find('\n') + 1, keys);
  // Slicer calls layers a list, ITK what it writes a vector.
  if (const std::size_t kind = bytes.substr(0, 4096 + keys.size()).find("kinds: vector"); kind != bytes.npos)
    bytes.replace(kind, 13, "kinds: list");
  files::write_text(path, bytes);
}

Segmentation read_segmentation(const Path& path, const files::ReadOptions& options,
                               const ImageChoice& choice) {
  if (is_dicom(path)) {
    if (std::optional<Segmentation> read = read_dicom_segmentation(path, options, choice))
      return std::move(*read);
  }
  return segmentation_of(read_label_image(path, options, choice), path);
}

Segmentation segmentation_of(Image image, const Path& path) {
  const std::vector<Segment> segments = read_segments(read_nrrd_keys(path), image.components, path);
  if (segments.empty() && image.components != 1) {
    refuse(path,
           "labels are " + std::string(scalar_name(image.type)) + " x " + std::to_string(image.components),
           image.components == 3 || image.components == 4
               ? "it is a picture in colours: save the label map itself, one whole number a voxel"
               : "labels are whole numbers, one a voxel");
  }
  std::map<std::int64_t, std::string> names;
  std::set<std::tuple<std::int64_t, std::int64_t>> seen;
  for (const Segment& segment : segments) {
    if (!seen.emplace(segment.layer, segment.value).second)
      refuse(path, "two segments of one layer have the label value " + std::to_string(segment.value));
    names.emplace(segment.value, segment.name);
  }
  Segmentation out;
  if (image.components == 1) {
    out.layers.push_back(std::move(image));
    if (segments.empty()) names = read_nifti_names(path);
    for (const Segment& segment : segments) {
      if (segment.code) out.codes.emplace(segment.value, *segment.code);
    }
    out.names = make_identifiers(names);
    return out;
  }
  // A header has a MiB at most, in which fewer than 2^16 segments find room.
  // As written where every value means one thing, else from 1.
  const bool unique = names.size() == segments.size() && names.begin()->first > 0 &&
                      names.rbegin()->first <= std::numeric_limits<std::uint16_t>::max();
  std::vector<std::map<std::int64_t, std::uint16_t>> ids(static_cast<std::size_t>(image.components));
  names.clear();
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const auto id = static_cast<std::uint16_t>(unique ? segments[i].value : static_cast<std::int64_t>(i) + 1);
    ids[static_cast<std::size_t>(segments[i].layer)].emplace(segments[i].value, id);
    names.emplace(id, segments[i].name);
    if (segments[i].code) out.codes.emplace(id, *segments[i].code);
  }
  for (int layer = 0; layer < image.components; ++layer)
    out.layers.push_back(renumber(take_layer(image, layer), ids[static_cast<std::size_t>(layer)]));
  out.names = make_identifiers(names);
  return out;
}

}  // namespace ecorche::io
