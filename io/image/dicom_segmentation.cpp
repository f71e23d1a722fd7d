// SPDX-License-Identifier: Apache-2.0
#include "io/image/dicom_segmentation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/values/text.hpp"
#include "io/image/dicom_image.hpp"
#include "io/image/dicom_pixels.hpp"
#include "io/image/dicom_planes.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

using namespace dicom;
using fields::refuse;
namespace fs = std::filesystem;

constexpr std::string_view kLabelMapClass = "1.2.840.10008.5.1.4.1.1.66.7";
constexpr Tag kKind = 0x00620001, kSegments = 0x00620002, kCategory = 0x00620003, kSegmentNumber = 0x00620004,
              kLabel = 0x00620005, kMostFractional = 0x0062000e, kType = 0x0062000f, kModifier = 0x00620011,
              kCode = 0x00080100, kScheme = 0x00080102, kMeaning = 0x00080104, kLongCode = 0x00080119;

bool is_segmentation(const DataSet& set) {
  const std::string kind = set.top.text(kClass);
  return kind == kSegmentationClass || kind == kLabelMapClass;
}

CodedName code_of(const Item& item, Tag sequence) {
  const Item* code = item.only(sequence);
  if (code == nullptr) return {};
  const std::string value = code->text(kCode);
  return {code->text(kScheme), value.empty() ? code->text(kLongCode) : value, code->text(kMeaning)};
}

struct Described {
  std::map<std::int64_t, std::string> names;
  std::map<std::int64_t, SegmentCodes> codes;
};

Described described(const DataSet& set) {
  Described out;
  const Element* segments = set.top.find(kSegments);
  if (segments == nullptr || segments->items.empty())
    refuse(set.path, "is a segmentation that describes no segment", "export it again");
  for (const Item& item : segments->items) {
    const auto number = item.whole(kSegmentNumber);
    if (!number || *number > std::numeric_limits<std::uint16_t>::max())
      refuse(set.path, "has a segment without a number", "export it again");
    if (*number == 0) continue;  // the background of a label map
    SegmentCodes codes{item.text(kLabel), code_of(item, kCategory), code_of(item, kType), {}, {}, {}};
    if (const Item* type = item.only(kType)) codes.side = code_of(*type, kModifier);
    if (codes.side.empty()) codes.side = code_of(item, kModifier);
    std::string name = codes.label.empty() ? codes.type.meaning : codes.label;
    const std::string side = text::lower(codes.side.meaning);
    if ((side == "right" || side == "left") && text::lower(name).find(side) == std::string::npos)
      name += " " + side;
    if (!out.names.emplace(*number, name).second)
      refuse(set.path, "has two segments of number " + std::to_string(*number), "export it again");
    out.codes.emplace(*number, std::move(codes));
  }
  return out;
}

// One bit a voxel, of all frames of one segment.
struct Mask {
  std::vector<std::int32_t> plane;  // of each frame
  std::vector<std::vector<std::uint8_t>> bits;
};

// Calls `f` with the pixel of each bit that is set.
template <class F>
void each_bit(const std::vector<std::uint8_t>& bits, std::size_t pixels, F&& f) {
  for (std::size_t b = 0; b < bits.size(); ++b) {
    for (unsigned rest = bits[b]; rest != 0; rest &= rest - 1) {
      const std::size_t pixel = 8 * b + static_cast<std::size_t>(std::countr_zero(rest));
      if (pixel < pixels) f(pixel);
    }
  }
}

// Puts segment after segment where it has room.
template <class T>
class Layers {
 public:
  Layers(const ImageGrid& grid, files::Budget& budget, Segmentation& out)
      : grid_(grid),
        budget_(budget),
        out_(out),
        counts_(std::size_t{std::numeric_limits<std::uint16_t>::max()} + 1) {}

  void add(std::int64_t id, const Mask& mask) {
    std::size_t layer = 0;
    for (; layer < out_.layers.size(); ++layer) {
      if (!count_overlap(id, mask, layer)) break;
    }
    // Whoever lies behind the layer that has room may still be overlapped.
    for (std::size_t behind = layer + 1; behind < out_.layers.size(); ++behind)
      count_overlap(id, mask, behind);
    if (layer == out_.layers.size()) {
      budget_.spend(grid_.voxels(), sizeof(T));
      out_.layers.emplace_back(grid_, scalar_type_of<T>);
    }
    const std::span<T> voxels = out_.layers[layer].template scalars<T>();
    walk(mask, [&](std::size_t voxel) { voxels[voxel] = static_cast<T>(id); });
  }

 private:
  template <class F>
  void walk(const Mask& mask, F&& f) const {
    const std::size_t plane = grid_.voxels() / static_cast<std::size_t>(grid_.size[2]);
    for (std::size_t i = 0; i < mask.bits.size(); ++i) {
      const std::size_t base = static_cast<std::size_t>(mask.plane[i]) * plane;
      each_bit(mask.bits[i], plane, [&](std::size_t pixel) { f(base + pixel); });
    }
  }

  bool count_overlap(std::int64_t id, const Mask& mask, std::size_t layer) {
    const std::span<const T> voxels = std::as_const(out_.layers[layer]).template scalars<T>();
    std::vector<T> met;
    walk(mask, [&](std::size_t voxel) {
      const T other = voxels[voxel];
      if (other != 0 && counts_[other]++ == 0) met.push_back(other);
    });
    for (const T other : met) {
      const std::int64_t with = other;
      out_.overlaps.push_back({std::min(id, with), std::max(id, with), counts_[other]});
      counts_[other] = 0;
    }
    return !met.empty();
  }

  const ImageGrid& grid_;
  files::Budget& budget_;
  Segmentation& out_;
  std::vector<std::uint64_t> counts_;
};

class Reader {
 public:
  Reader(const DataSet& set, const files::ReadOptions& options)
      : set_(set),
        described_(described(set)),
        planes_(planes_of(set)),
        pixels_(stored_pixels(set)),
        file_(set.path, set.file_bytes, pixels_),
        budget_(files::Budget::of_image(set.file_bytes, options.limits, set.path.string())) {
    const std::string kind = set.top.text(kKind);
    label_map_ = kind == "LABELMAP";
    if (pixels_.allocated == 1 && pixels_.syntax.packing != Packing::none)
      refuse(set.path, "packs single bits", "unpack it: gdcmconv --raw IN OUT");
    if (pixels_.allocated > 16) refuse(set.path, "has segments of 32 bits", "export it as binary");
    if (kind != "FRACTIONAL") return;
    most_ = set.top.whole(kMostFractional).value_or(255);
    options.say(set.path.string() +
                ": is fractional: a voxel belongs to a segment from half of the largest value on");
  }

  Segmentation read() {
    Segmentation out;
    const bool wide = described_.names.rbegin()->first > 255;
    wide ? fill<std::uint16_t>(out) : fill<std::uint8_t>(out);
    out.names = make_identifiers(described_.names);
    out.codes = std::move(described_.codes);
    std::sort(out.overlaps.begin(), out.overlaps.end(), [](const LabelOverlap& a, const LabelOverlap& b) {
      return std::pair(a.first, a.second) < std::pair(b.first, b.second);
    });
    return out;
  }

 private:
  std::size_t plane_pixels() const { return std::size_t{pixels_.rows} * pixels_.columns; }

  template <class T>
  void fill(Segmentation& out) {
    if (planes_.grid.voxels() * sizeof(T) > largest_image_bytes)
      refuse(set_.path, "its planes span more than 2^33 bytes of voxels", "export a part of it");
    budget_.spend(planes_.grid.voxels(), sizeof(T));
    out.layers.emplace_back(planes_.grid, scalar_type_of<T>);
    if (label_map_) return fill_label_map(out.layers.front().scalars<T>());
    std::map<std::int64_t, std::vector<std::size_t>> frames;
    for (std::size_t f = 0; f < planes_.frames.size(); ++f) {
      const std::int64_t id = planes_.frames[f].segment;
      if (!described_.names.contains(id))
        refuse(set_.path,
               "frame " + std::to_string(f + 1) + " shows segment " + std::to_string(id) +
                   ", which is not described",
               "export it again");
      frames[id].push_back(f);
    }
    Layers<T> layers(planes_.grid, budget_, out);
    for (const auto& [id, own] : frames) {
      Mask mask;
      budget_.spend(own.size(), plane_pixels() / 8 + 64);
      for (const std::size_t f : own) {
        mask.plane.push_back(planes_.frames[f].plane);
        mask.bits.push_back(bits_of(f));
      }
      layers.add(id, mask);
    }
  }

  template <class T>
  void fill_label_map(std::span<T> voxels) {
    std::vector<std::byte> bytes(file_.frame_bytes());
    for (std::size_t f = 0; f < planes_.frames.size(); ++f) {
      file_.read(static_cast<std::uint32_t>(f), bytes);
      const std::size_t base = static_cast<std::size_t>(planes_.frames[f].plane) * plane_pixels();
      for (std::size_t i = 0; i < plane_pixels(); ++i) {
        const std::int64_t id = value(bytes, i);
        if (id != 0 && !described_.names.contains(id))
          refuse(set_.path, "holds segment " + std::to_string(id) + ", which is not described",
                 "export it again");
        voxels[base + i] = static_cast<T>(id);
      }
    }
  }

  std::uint32_t value(const std::vector<std::byte>& bytes, std::size_t i) const {
    if (pixels_.allocated == 8) return std::to_integer<std::uint32_t>(bytes[i]);
    return std::to_integer<std::uint32_t>(bytes[2 * i]) | std::to_integer<std::uint32_t>(bytes[2 * i + 1])
                                                              << 8;
  }

  std::vector<std::uint8_t> bits_of(std::size_t frame) {
    const std::size_t pixels = plane_pixels();
    std::vector<std::uint8_t> out((pixels + 7) / 8);
    if (pixels_.allocated != 1) {
      std::vector<std::byte> bytes(file_.frame_bytes());
      file_.read(static_cast<std::uint32_t>(frame), bytes);
      const std::uint32_t least = std::max<std::uint32_t>((most_ + 1) / 2, 1);
      for (std::size_t i = 0; i < pixels; ++i) {
        if (value(bytes, i) >= least) out[i / 8] = static_cast<std::uint8_t>(out[i / 8] | 1U << i % 8);
      }
      return out;
    }
    // Bits run on from frame to frame.
    const std::uint64_t from = std::uint64_t{frame} * pixels;
    const auto shift = static_cast<unsigned>(from % 8);
    std::vector<std::byte> bytes(static_cast<std::size_t>((shift + pixels + 7) / 8));
    file_.read_raw(from / 8, bytes);
    for (std::size_t i = 0; i < out.size(); ++i) {
      unsigned both = std::to_integer<unsigned>(bytes[i]);
      if (i + 1 < bytes.size()) both |= std::to_integer<unsigned>(bytes[i + 1]) << 8;
      out[i] = static_cast<std::uint8_t>(both >> shift);
    }
    return out;
  }

  const DataSet& set_;
  Described described_;
  SegmentPlanes planes_;
  StoredPixels pixels_;
  PixelFile file_;
  files::Budget budget_;
  std::uint32_t most_ = 1;
  bool label_map_ = false;
};

std::string told(const DataSet& set) {
  const std::string description = set.top.text(kSeriesDescription);
  return set.top.text(kSeries) + (description.empty() ? "" : " '" + description.substr(0, 64) + "'");
}

}  // namespace

std::optional<Segmentation> read_dicom_segmentation(const fs::path& path, const files::ReadOptions& options,
                                                    const ImageChoice& choice) {
  std::vector<DataSet> found;
  for (const fs::path& file : dicom_files(path)) {
    DataSet set = read_data_set(file, options);
    if (!is_segmentation(set)) continue;
    const std::string series = set.top.text(kSeries);
    const bool meant = choice.series.empty() || series == choice.series ||
                       series.ends_with("." + choice.series) ||
                       set.top.text(kSeriesDescription) == choice.series;
    if (meant) found.push_back(std::move(set));
  }
  if (found.empty()) return std::nullopt;
  if (found.size() > 1) {
    std::string all;
    for (std::size_t i = 0; i < std::min<std::size_t>(found.size(), 12); ++i)
      all += (i > 0 ? "; " : "") + told(found[i]);
    refuse(path, "holds " + std::to_string(found.size()) + " segmentations: " + all,
           "name one of the files, or take one by series: with its UID or description");
  }
  if (found.front().pixels_at == 0) refuse(found.front().path, "has no pixels", "export it again");
  return Reader(found.front(), options).read();
}

}  // namespace ecorche::io
