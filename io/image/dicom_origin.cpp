// SPDX-License-Identifier: Apache-2.0
#include "io/image/dicom_origin.hpp"

#include <algorithm>

#include "io/image/dicom_image.hpp"
#include "io/image/dicom_segmentation.hpp"
#include "io/image/dicom_stack.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

using namespace dicom;

// Patient's name, identifier and its issuer, birth date, sex, age, size, weight; study's UID, date, time,
// accession number, referring physician, identifier, description.
constexpr std::array<Tag, 15> kIdentity{0x00100010, 0x00100020, 0x00100021, 0x00100030, 0x00100040,
                                        0x00101010, 0x00101020, 0x00101030, 0x0020000d, 0x00080020,
                                        0x00080030, 0x00080050, 0x00080090, 0x00200010, 0x00081030};
// Body part, kV, exposure time, tube current, exposure, filter, kernel, window centre and width, and whether
// it was packed with loss.
constexpr std::array<Tag, 10> kAcquisitionTags{0x00180015, 0x00180060, 0x00181150, 0x00181151, 0x00181152,
                                               0x00181160, 0x00181210, 0x00281050, 0x00281051, 0x00282110};

template <std::size_t N>
DicomOrigin::Values values(const Item& top, const std::array<Tag, N>& tags) {
  DicomOrigin::Values out;
  for (const Tag tag : tags) {
    const std::string value = top.text(tag);
    if (!value.empty()) out.emplace_back(tag, value);
  }
  return out;
}

}  // namespace

DicomOrigin read_dicom_origin(const std::filesystem::path& path, const files::ReadOptions& options,
                              const ImageChoice& choice) {
  std::vector<Slice> slices;
  bool segments = false;
  for (const std::filesystem::path& file : dicom_files(path)) {
    const DataSet set = read_data_set(file, options);
    segments = segments || set.top.text(kClass) == kSegmentationClass;
    std::vector<Slice> more = slices_of(set);
    std::move(more.begin(), more.end(), std::back_inserter(slices));
  }
  if (slices.empty())
    fields::refuse(path, "holds no slices of an image", "name the folder of the series that was scanned");
  const Stack stack = chosen_stack(stacks_of(std::move(slices), path), choice.series, path);
  const SliceFile& first = *stack.slices.front().file;
  if (first.modality != "CT")
    fields::refuse(path, "is a series of " + first.modality,
                   "posed volumes are written as CT: name a CT series");
  const DataSet set = read_data_set(first.path, options);
  DicomOrigin out{
      values(set.top, kIdentity), values(set.top, kAcquisitionTags), set.top.text(kClass), {}, {}};
  for (const Slice& slice : stack.slices) {
    if (slice.frame == 0) out.objects.push_back(slice.file->object);
  }
  std::sort(out.objects.begin(), out.objects.end());
  if (!segments) return out;
  if (const auto read = read_dicom_segmentation(path, {options.limits, {}}, {})) {
    for (const auto& [id, name] : read->names) out.codes.emplace(name, read->codes.at(id));
  }
  return out;
}

}  // namespace ecorche::io
