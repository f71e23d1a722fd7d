// SPDX-License-Identifier: Apache-2.0
// https://dicom.nema.org/medical/dicom/current/output/chtml/part03/sect_C.7.6.2.html (Image Plane),
// sect_C.7.6.16.html (functional groups of files with several frames)
#include <algorithm>
#include <cmath>

#include "core/values/text.hpp"
#include "io/image/dicom_slice.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io::dicom {
namespace {

using fields::refuse;

constexpr Tag kImageType = 0x00080008, kSamples = 0x00280002, kPhotometric = 0x00280004, kRows = 0x00280010,
              kColumns = 0x00280011, kAllocated = 0x00280100, kStored = 0x00280101, kHigh = 0x00280102,
              kRepresentation = 0x00280103, kPadding = 0x00280120, kIntercept = 0x00281052,
              kSlope = 0x00281053, kLookup = 0x00283000, kTransformation = 0x00289145,
              kFrameContent = 0x00209111, kTemporalIndex = 0x00209128, kTemporal = 0x00200100,
              kAcquisition = 0x00200012, kTrigger = 0x00181060, kAcquisitionTime = 0x00080032,
              kNumber = 0x00200013, kStackId = 0x00209056, kEcho = 0x00180086;
constexpr std::uint32_t kMostFrames = 1 << 20;
constexpr double kUnit = 1e-3;  // how far written directions are from length 1 and right angles

Vector scaled(Vector v, double factor) {
  for (double& x : v) x *= factor;
  return v;
}

// Of one frame: its own groups, else those that all share, else the data set itself.
class Groups {
 public:
  Groups(const DataSet& set, const Item* own)
      : top_(set.top), shared_(set.top.only(kSharedGroups)), own_(own) {}

  const Item* find(Tag sequence, Tag tag) const {
    for (const Item* group : {own_, shared_}) {
      if (group == nullptr) continue;
      const Item* item = group->only(sequence);
      if (item != nullptr && item->find(tag) != nullptr) return item;
    }
    return top_.find(tag) != nullptr ? &top_ : nullptr;
  }
  std::optional<double> number(Tag sequence, Tag tag) const {
    const Item* item = find(sequence, tag);
    return item == nullptr ? std::nullopt : item->number(tag);
  }
  template <std::size_t N>
  std::optional<std::array<double, N>> numbers(Tag sequence, Tag tag) const {
    const Item* item = find(sequence, tag);
    return item == nullptr ? std::nullopt : item->numbers<N>(tag);
  }

 private:
  const Item& top_;
  const Item *shared_, *own_;
};

void set_directions(Slice& slice, const std::array<double, 6>& written) {
  slice.right = {written[0], written[1], written[2]};
  slice.down = {written[3], written[4], written[5]};
  const double a = std::sqrt(dot(slice.right, slice.right)), b = std::sqrt(dot(slice.down, slice.down));
  if (!(std::abs(a - 1) < kUnit && std::abs(b - 1) < kUnit) ||
      std::abs(dot(slice.right, slice.down)) > kUnit) {
    refuse(slice.file->path, "its rows and columns are not at right angles (Image Orientation)",
           "export it again");
  }
  // As written to six digits: made orthonormal, the row's way kept.
  slice.right = scaled(slice.right, 1 / a);
  const double along = dot(slice.right, slice.down);
  for (std::size_t k = 0; k < 3; ++k) slice.down[k] -= along * slice.right[k];
  slice.down = scaled(slice.down, 1 / std::sqrt(dot(slice.down, slice.down)));
}

void set_when(Slice& slice, const Groups& groups, const Item& top, std::uint32_t frame) {
  const auto number = [&](Tag sequence, Tag tag) { return groups.number(sequence, tag).value_or(0); };
  double temporal = number(0, kTemporal);
  if (const Item* content = groups.find(kFrameContent, kTemporalIndex))
    temporal = content->whole(kTemporalIndex).value_or(0);
  slice.when = {temporal, number(0, kAcquisition), number(0, kTrigger),
                top.number(kAcquisitionTime).value_or(0), number(0, kNumber) + frame};
}

Slice slice_of(const DataSet& set, std::shared_ptr<const SliceFile> file, std::uint32_t frame,
               const Item* own) {
  const Groups groups(set, own);
  Slice out;
  out.file = std::move(file);
  out.frame = frame;
  const auto position = groups.numbers<3>(kPlanePosition, kPosition);
  const auto orientation = groups.numbers<6>(kPlaneOrientation, kOrientation);
  const auto spacing = groups.numbers<2>(kMeasures, kPixelSpacing);
  if (!position || !orientation || !spacing) {
    const std::string lacks = !position      ? "Image Position"
                              : !orientation ? "Image Orientation"
                                             : "Pixel Spacing";
    refuse(set.path, out.name() + " does not say where it lies: it lacks " + lacks,
           "take it out of the folder, or export the series again as CT or MR");
  }
  out.position = *position;
  set_directions(out, *orientation);
  out.spacing = {(*spacing)[1], (*spacing)[0]};  // rows first
  for (const double s : out.spacing) {
    if (!(s > 0 && s < 1e4)) refuse(set.path, "its Pixel Spacing is " + text::number(s), "export it again");
  }
  for (const double p : out.position) {
    if (!(std::abs(p) < 1e6)) refuse(set.path, "its Image Position is " + text::number(p), "export it again");
  }
  out.thickness = groups.number(kMeasures, kThickness).value_or(0);
  out.slope = groups.number(kTransformation, kSlope).value_or(1);
  out.intercept = groups.number(kTransformation, kIntercept).value_or(0);
  for (const double x : {out.slope, out.intercept}) {
    if (out.slope == 0 || !(std::abs(x) < 1e12))
      refuse(set.path, "its Rescale Slope or Intercept is " + text::number(x), "export it again");
  }
  set_when(out, groups, set.top, frame);
  if (const Item* content = groups.find(kFrameContent, kStackId)) out.stack = content->text(kStackId);
  out.stack += set.top.text(kEcho);
  return out;
}

}  // namespace

Vector Slice::normal() const {
  return {right[1] * down[2] - right[2] * down[1], right[2] * down[0] - right[0] * down[2],
          right[0] * down[1] - right[1] * down[0]};
}

std::string Slice::name() const {
  const std::string name = file->path.filename().string();
  return file->pixels.frames > 1 ? name + " frame " + std::to_string(frame + 1) : name;
}

StoredPixels stored_pixels(const DataSet& set) {
  const Item& top = set.top;
  StoredPixels out;
  out.syntax = set.syntax;
  out.at = set.pixels_at;
  out.bytes = set.pixels_bytes;
  const auto whole = [&](Tag tag, std::uint32_t otherwise) { return top.whole(tag).value_or(otherwise); };
  out.rows = whole(kRows, 0);
  out.columns = whole(kColumns, 0);
  const std::uint32_t allocated = whole(kAllocated, 16), stored = whole(kStored, allocated),
                      high = whole(kHigh, stored - 1);
  if (out.rows == 0 || out.columns == 0 || out.rows > 65535 || out.columns > 65535)
    refuse(set.path, "has " + std::to_string(out.columns) + " x " + std::to_string(out.rows) + " pixels",
           "export it again");
  if ((allocated != 1 && allocated != 8 && allocated != 16 && allocated != 32) || stored == 0 ||
      stored > allocated || high >= allocated || high + 1 < stored) {
    refuse(set.path,
           "stores " + std::to_string(stored) + " bits up to bit " + std::to_string(high) + " of " +
               std::to_string(allocated),
           "export it again");
  }
  out.allocated = static_cast<int>(allocated);
  out.stored = static_cast<int>(stored);
  out.high = static_cast<int>(high);
  out.is_signed = whole(kRepresentation, 0) == 1;
  const double frames = top.number(kFrames).value_or(1);
  if (!(frames >= 1 && frames <= kMostFrames))
    refuse(set.path, "says that it has " + text::number(frames, 9) + " frames", "export it again");
  out.frames = static_cast<std::uint32_t>(frames);
  return out;
}

std::vector<Slice> framed_slices(const DataSet& set) {
  const Item& top = set.top;
  auto file = std::make_shared<SliceFile>();
  file->path = set.path;
  file->bytes = set.file_bytes;
  file->series = top.text(kSeries);
  file->description = top.text(kSeriesDescription);
  file->modality = top.text(kModality);
  file->object = top.text(kObject);
  file->frame_of_reference = top.text(kFrameOfReference);
  file->pixels = stored_pixels(set);
  const std::string type = text::lower(top.text(kImageType));
  file->localizer = type.find("localizer") != type.npos;
  file->monochrome1 = top.text(kPhotometric) == "MONOCHROME1";
  if (const auto padding = top.whole(kPadding)) {
    const auto stored = static_cast<std::uint16_t>(*padding);
    file->padding = file->pixels.is_signed ? static_cast<std::int16_t>(stored) : stored;
  }
  const Element* own = top.find(kFrameGroups);
  const std::string frames = std::to_string(file->pixels.frames);
  if (own == nullptr && file->pixels.frames > 1) {
    refuse(set.path, "has " + frames + " frames and does not say where each lies",
           "export the series as single slices, or as Enhanced CT or MR");
  }
  if (own != nullptr && own->items.size() < file->pixels.frames) {
    refuse(set.path, "describes " + std::to_string(own->items.size()) + " of its " + frames + " frames",
           "export it again");
  }
  std::vector<Slice> out;
  for (std::uint32_t f = 0; f < file->pixels.frames; ++f)
    out.push_back(slice_of(set, file, f, own == nullptr ? nullptr : &own->items[f]));
  return out;
}

bool shows_slices(const DataSet& set) {
  const Item& top = set.top;
  if (set.pixels_at == 0 || top.text(kClass).starts_with(kSegmentationClass.substr(0, 26))) return false;
  // Screenshots and dose reports lie with their series; nothing says where.
  return top.find(kPosition) != nullptr || top.find(kSharedGroups) != nullptr ||
         top.find(kFrameGroups) != nullptr;
}

std::vector<Slice> slices_of(const DataSet& set) {
  const Item& top = set.top;
  if (!shows_slices(set)) return {};
  const std::string colours = top.text(kPhotometric);
  if (top.whole(kSamples).value_or(1) != 1 || colours.starts_with("RGB") || colours.starts_with("YBR") ||
      colours.starts_with("PALETTE")) {
    refuse(set.path, "is a picture in colours (" + colours + ")",
           "choose the series of grey values that it was made from");
  }
  if (top.only(kLookup) != nullptr || stored_pixels(set).allocated == 1)
    refuse(set.path, "its values lie behind a table (Modality LUT), or are single bits", "export it as CT");
  return framed_slices(set);
}

}  // namespace ecorche::io::dicom
