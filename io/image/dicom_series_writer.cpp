// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <ecorche/values/error.hpp>
#include "core/files/staged_folder.hpp"
#include "core/values/text.hpp"
#include "io/image/dicom_attributes.hpp"
#include "io/image/dicom_writer.hpp"

namespace ecorche::io {
namespace {

using dicom::Attributes;
using dicom::uid_of;
namespace fs = std::filesystem;

// How values become 16 bits.
struct Scale {
  double slope = 1, intercept = 0;
  bool is_signed = true;
};

template <class T>
Scale scale_of(std::span<const T> values) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double low = static_cast<double>(*least), high = static_cast<double>(*most);
  const bool whole = std::is_integral_v<T> || std::all_of(values.begin(), values.end(), [](T v) {
                       return static_cast<double>(v) == std::floor(static_cast<double>(v));
                     });
  if (whole && low >= -32768 && high <= 32767) return {};
  if (whole && high - low <= 65535) return {1, low, false};
  return {(high - low) / 65535, low, false};
}

template <class T>
void store(std::span<const T> values, const Scale& scale, std::vector<std::uint16_t>& out) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double stored = std::floor((static_cast<double>(values[i]) - scale.intercept) / scale.slope + 0.5);
    out[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(stored));
  }
}

// What all slices share.
void write_common(const Attributes& a, const ImageGrid& grid, const Scale& scale, const DicomFacts& facts) {
  for (const auto& [tag, value] : facts.origin.acquisition)
    a.text(DcmTag(static_cast<Uint16>(tag >> 16), static_cast<Uint16>(tag & 0xffff)), value);
  const bool has_kv = std::any_of(facts.origin.acquisition.begin(), facts.origin.acquisition.end(),
                                  [](const auto& one) { return one.first == 0x00180060; });
  if (!has_kv) a.empty({DCM_KVP});
  a.empty({DCM_PatientPosition, DCM_AcquisitionNumber, DCM_Laterality});
  a.text(DCM_ImageType, "DERIVED\\SECONDARY\\AXIAL");
  a.whole(DCM_SamplesPerPixel, 1);
  a.text(DCM_PhotometricInterpretation, "MONOCHROME2");
  a.whole(DCM_Rows, static_cast<std::uint16_t>(grid.size[1]));
  a.whole(DCM_Columns, static_cast<std::uint16_t>(grid.size[0]));
  a.whole(DCM_BitsAllocated, 16);
  a.whole(DCM_BitsStored, 16);
  a.whole(DCM_HighBit, 15);
  a.whole(DCM_PixelRepresentation, scale.is_signed ? 1 : 0);
  a.number(DCM_RescaleSlope, scale.slope);
  a.number(DCM_RescaleIntercept, scale.intercept);
  a.text(DCM_RescaleType, "HU");
  a.numbers(DCM_PixelSpacing, {grid.spacing[1], grid.spacing[0]});
  a.number(DCM_SliceThickness, grid.spacing[2]);
  const auto& d = grid.direction;
  a.numbers(DCM_ImageOrientationPatient, {d[0], d[3], d[6], d[1], d[4], d[7]});
}

}  // namespace

void write_dicom_series(const fs::path& folder, const Image& image, const std::string& name,
                        const DicomFacts& said, const files::ReadOptions& note) {
  DicomFacts facts = said;
  if (facts.pose.empty())  // told by what it looks like
    facts.pose = uid_of({reinterpret_cast<const char*>(image.bytes.data()), image.bytes.size()});
  const ImageGrid& grid = image.grid;
  if (image.components != 1)
    throw Error(ErrorKind::usage, folder.string(), "a CT has one value a voxel",
                "use .nrrd, .mha or .nii.gz");
  if (grid.size[0] > 65535 || grid.size[1] > 65535)
    throw Error(ErrorKind::usage, folder.string(), "a DICOM slice has 65535 rows and columns at most",
                "use .nrrd, .mha or .nii.gz");
  files::StagedFolder staged(folder, "IM0001.dcm");
  std::error_code ignored;
  if (fs::exists(staged.target(), ignored) && !files::files_within(staged.target()).empty())
    throw Error(ErrorKind::cannot_create, folder.string(), "is there already, and holds files",
                "name another folder");
  const std::size_t plane = static_cast<std::size_t>(grid.size[0]) * static_cast<std::size_t>(grid.size[1]);
  Scale scale;
  with_scalar_type(image.type, [&](auto zero) { scale = scale_of(image.scalars<decltype(zero)>()); });
  if (scale.slope != 1)
    note.say(folder.string() + ": its values need more than 16 bits: written in steps of " +
             text::number(scale.slope) + ", from " + text::number(scale.intercept, 7));
  DcmFileFormat file;
  const Attributes a(*file.getDataset(), folder);
  a.text(DCM_SOPClassUID, UID_CTImageStorage);
  dicom::write_origin(a, facts, "CT", name);
  dicom::write_derivation(a, facts);
  write_common(a, grid, scale, facts);
  std::vector<std::uint16_t> stored(plane);
  for (int k = 0; k < grid.size[2]; ++k) {
    with_scalar_type(image.type, [&](auto zero) {
      const auto values = image.scalars<decltype(zero)>().subspan(static_cast<std::size_t>(k) * plane, plane);
      store(values, scale, stored);
    });
    const std::string number = std::to_string(k + 1);
    std::string seed = "image " + facts.patient + facts.pose + name + number;
    seed.append(reinterpret_cast<const char*>(stored.data()), stored.size() * sizeof stored.front());
    a.text(DCM_SOPInstanceUID, uid_of(seed));
    a.text(DCM_InstanceNumber, number);
    const std::array<double, 3> at =
        facts.positions.empty() ? grid.point(0, 0, k) : facts.positions[static_cast<std::size_t>(k)];
    a.numbers(DCM_ImagePositionPatient, {at[0], at[1], at[2]});
    a.pixels(stored);
    std::array<char, 32> file_name{};
    std::snprintf(file_name.data(), file_name.size(), "IM%04d.dcm", k + 1);
    dicom::save(file, staged.stage() / file_name.data());
  }
  staged.commit();
}

}  // namespace ecorche::io
