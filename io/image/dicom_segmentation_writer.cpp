// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <numeric>

#include <ecorche/values/error.hpp>
#include "core/values/text.hpp"
#include "io/image/dicom_attributes.hpp"
#include "io/image/dicom_writer.hpp"

namespace ecorche::io {
namespace {

using dicom::Attributes;
using dicom::uid_of;

// A segment, and the planes in which it has voxels.
struct Held {
  std::int64_t id = 0;
  std::uint16_t number = 0;
  std::size_t layer = 0;
  std::vector<std::int32_t> planes;
};

// Ascending by id. An id that lies in several layers is one segment for each.
std::vector<Held> held_segments(const Segmentation& segmentation) {
  std::vector<Held> out;
  for (std::size_t layer = 0; layer < segmentation.layers.size(); ++layer) {
    const Image& image = segmentation.layers[layer];
    std::map<std::int64_t, std::vector<std::int32_t>> planes;
    with_scalar_type(image.type, [&](auto zero) {
      using T = decltype(zero);
      const auto voxels = image.scalars<T>();
      const std::size_t plane = image.grid.voxels() / static_cast<std::size_t>(image.grid.size[2]);
      for (std::int32_t k = 0; k < image.grid.size[2]; ++k) {
        T last{};
        std::vector<std::int32_t>* into = nullptr;  // neighbours are mostly alike
        for (const T v : voxels.subspan(static_cast<std::size_t>(k) * plane, plane)) {
          if (v == T{}) continue;
          if (into == nullptr || v != last) into = &planes[static_cast<std::int64_t>(v)];
          last = v;
          if (into->empty() || into->back() != k) into->push_back(k);
        }
      }
    });
    for (auto& [id, in] : planes) out.push_back({id, 0, layer, std::move(in)});
  }
  std::stable_sort(out.begin(), out.end(), [](const Held& a, const Held& b) { return a.id < b.id; });
  // One after the other, as the standard wants it.
  for (std::size_t i = 0; i < out.size(); ++i) out[i].number = static_cast<std::uint16_t>(i + 1);
  return out;
}

// From the name alone: a code of our own, and the side.
SegmentCodes own_codes(const std::string& name) {
  SegmentCodes out{name, {"SCT", "123037004", "Anatomical Structure"}, {"99ECORCHE", name, name}, {}, {}, {}};
  if (name.ends_with("_right")) out.side = {"SCT", "24028007", "Right"};
  if (name.ends_with("_left")) out.side = {"SCT", "7771000", "Left"};
  return out;
}

void write_segment(const Attributes& segment, const Held& held, const std::string& name,
                   const SegmentCodes* known) {
  const SegmentCodes own = own_codes(name);
  const SegmentCodes& codes = known == nullptr ? own : *known;
  segment.code(DCM_SegmentedPropertyCategoryCodeSequence,
               codes.category.empty() ? own.category : codes.category);
  segment.whole(DCM_SegmentNumber, held.number);
  segment.text(DCM_SegmentLabel, (codes.label.empty() ? name : codes.label).substr(0, 64));
  segment.text(DCM_SegmentAlgorithmType, "SEMIAUTOMATIC");
  segment.text(DCM_SegmentAlgorithmName, "ecorche pose");
  const Attributes type = segment.add(DCM_SegmentedPropertyTypeCodeSequence);
  const CodedName& coded = codes.type.empty() ? own.type : codes.type;
  type.text(coded.value.size() > 16 ? DCM_LongCodeValue : DCM_CodeValue, coded.value);
  type.text(DCM_CodingSchemeDesignator, coded.scheme);
  type.text(DCM_CodeMeaning, coded.meaning.substr(0, 64));
  if (!codes.side.empty()) type.code(DCM_SegmentedPropertyTypeModifierCodeSequence, codes.side);
}

void write_dimensions(const Attributes& a, const std::string& uid) {
  a.add(DCM_DimensionOrganizationSequence).text(DCM_DimensionOrganizationUID, uid);
  const auto index = [&](const DcmTagKey& value, const DcmTagKey& group, const char* label) {
    const Attributes item = a.add(DCM_DimensionIndexSequence);
    item.text(DCM_DimensionOrganizationUID, uid);
    item.pointer(DCM_DimensionIndexPointer, value);
    item.pointer(DCM_FunctionalGroupPointer, group);
    item.text(DCM_DimensionDescriptionLabel, label);
  };
  index(DCM_ReferencedSegmentNumber, DCM_SegmentIdentificationSequence, "ReferencedSegmentNumber");
  index(DCM_ImagePositionPatient, DCM_PlanePositionSequence, "ImagePositionPatient");
}

void write_shared(const Attributes& a, const ImageGrid& grid, bool even) {
  const Attributes shared = a.add(DCM_SharedFunctionalGroupsSequence);
  const auto& d = grid.direction;
  shared.add(DCM_PlaneOrientationSequence)
      .numbers(DCM_ImageOrientationPatient, {d[0], d[3], d[6], d[1], d[4], d[7]});
  const Attributes measures = shared.add(DCM_PixelMeasuresSequence);
  measures.number(DCM_SliceThickness, grid.spacing[2]);
  if (even) measures.number(DCM_SpacingBetweenSlices, grid.spacing[2]);
  measures.numbers(DCM_PixelSpacing, {grid.spacing[1], grid.spacing[0]});
}

void write_image_head(const Attributes& a, const Segmentation& segmentation, const std::string& name,
                      const DicomFacts& facts, std::size_t frames) {
  const ImageGrid& grid = segmentation.layers.front().grid;
  a.text(DCM_SOPClassUID, UID_SegmentationStorage);
  dicom::write_origin(a, facts, "SEG", name);
  dicom::write_derivation(a, facts);
  a.text(DCM_ImageType, "DERIVED\\PRIMARY");
  a.text(DCM_InstanceNumber, "1");
  // No times: the same body in the same pose is the same file. They must not be empty here.
  a.text(DCM_ContentDate, "19700101");
  a.text(DCM_ContentTime, "000000");
  a.text(DCM_ContentLabel, "LABELS");
  a.text(DCM_ContentDescription, name.substr(0, 64));
  a.empty({DCM_ContentCreatorName});
  a.whole(DCM_SamplesPerPixel, 1);
  a.text(DCM_PhotometricInterpretation, "MONOCHROME2");
  a.text(DCM_NumberOfFrames, std::to_string(frames));
  a.whole(DCM_Rows, static_cast<std::uint16_t>(grid.size[1]));
  a.whole(DCM_Columns, static_cast<std::uint16_t>(grid.size[0]));
  a.whole(DCM_BitsAllocated, 1);
  a.whole(DCM_BitsStored, 1);
  a.whole(DCM_HighBit, 0);
  a.whole(DCM_PixelRepresentation, 0);
  a.text(DCM_LossyImageCompression, "00");
  a.text(DCM_SegmentationType, "BINARY");
}

// Bit after bit, on from frame to frame.
void set_bits(const Image& image, const Held& held, std::int32_t k, std::size_t from,
              std::vector<std::uint8_t>& bits) {
  with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    const std::size_t plane = image.grid.voxels() / static_cast<std::size_t>(image.grid.size[2]);
    const auto voxels = image.scalars<T>().subspan(static_cast<std::size_t>(k) * plane, plane);
    for (std::size_t i = 0; i < plane; ++i) {
      if (static_cast<std::int64_t>(voxels[i]) == held.id)
        bits[(from + i) / 8] = static_cast<std::uint8_t>(bits[(from + i) / 8] | 1U << (from + i) % 8);
    }
  });
}

}  // namespace

void write_dicom_segmentation(const std::filesystem::path& path, const Segmentation& segmentation,
                              const std::string& name, const DicomFacts& facts) {
  const std::vector<Held> all = held_segments(segmentation);
  const std::size_t frames =
      std::accumulate(all.begin(), all.end(), std::size_t{0},
                      [](std::size_t sum, const Held& one) { return sum + one.planes.size(); });
  if (all.size() > 65535)
    throw Error(ErrorKind::data, path.string(), "a DICOM SEG has 65535 segments at most", "use .nrrd");
  if (frames == 0)
    throw Error(ErrorKind::data, path.string(), "no voxel is labelled, and a DICOM SEG has one at least",
                "write the labels as .nrrd");
  const ImageGrid& grid = segmentation.layers.front().grid;
  if (grid.size[0] > 65535 || grid.size[1] > 65535)
    throw Error(ErrorKind::usage, path.string(), "a DICOM SEG has 65535 rows and columns at most",
                "use .nrrd, .mha or .nii.gz");
  DcmFileFormat file;
  const Attributes a(*file.getDataset(), path);
  write_image_head(a, segmentation, name, facts, frames);
  write_dimensions(a, uid_of("dimensions " + facts.patient + facts.pose + name));
  write_shared(a, grid, facts.positions.empty());
  const std::size_t plane = static_cast<std::size_t>(grid.size[0]) * static_cast<std::size_t>(grid.size[1]);
  std::vector<std::uint8_t> bits((frames * plane + 7) / 8 + 1);
  bits.resize(bits.size() / 2 * 2);  // even
  std::size_t frame = 0;
  for (const Held& held : all) {
    const auto named = segmentation.names.find(held.id);
    const auto coded = segmentation.codes.find(held.id);
    write_segment(a.add(DCM_SegmentSequence), held,
                  named == segmentation.names.end() ? "label_" + std::to_string(held.id) : named->second,
                  coded == segmentation.codes.end() ? nullptr : &coded->second);
    for (const std::int32_t k : held.planes) {
      const Attributes group = a.add(DCM_PerFrameFunctionalGroupsSequence);
      const std::array<std::uint32_t, 2> index{held.number, static_cast<std::uint32_t>(k) + 1};
      group.add(DCM_FrameContentSequence).wholes(DCM_DimensionIndexValues, index);
      const std::array<double, 3> at =
          facts.positions.empty() ? grid.point(0, 0, k) : facts.positions[static_cast<std::size_t>(k)];
      group.add(DCM_PlanePositionSequence).numbers(DCM_ImagePositionPatient, {at[0], at[1], at[2]});
      group.add(DCM_SegmentIdentificationSequence).whole(DCM_ReferencedSegmentNumber, held.number);
      set_bits(segmentation.layers[held.layer], held, k, frame++ * plane, bits);
    }
  }
  std::string seed = "segmentation " + facts.patient + facts.pose + name;
  seed.append(reinterpret_cast<const char*>(bits.data()), bits.size());
  a.text(DCM_SOPInstanceUID, uid_of(seed));
  a.pixels(bits);
  dicom::save(file, path);
}

}  // namespace ecorche::io
