// SPDX-License-Identifier: Apache-2.0
#include "io/image/radiograph_dicom.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"

namespace ecorche::io {
namespace {

// A UID that needs no registration (PS3.5 B.2): `2.25.` and a UUID (version 8, of our own making) as a
// decimal number.
std::string uid_of(std::string_view seed) {
  const XXH128_hash_t digest = XXH3_128bits(seed.data(), seed.size());
  const std::uint64_t high = (digest.high64 & ~0xf000ULL) | 0x8000ULL;
  const std::uint64_t low = (digest.low64 & ~(3ULL << 62)) | (2ULL << 62);
  std::array<std::uint64_t, 4> parts{high >> 32, high & 0xffffffff, low >> 32, low & 0xffffffff};
  std::string digits;
  while (parts != std::array<std::uint64_t, 4>{}) {
    std::uint64_t rest = 0;
    for (std::uint64_t& part : parts) {
      const std::uint64_t whole = (rest << 32) + part;
      part = whole / 10;
      rest = whole % 10;
    }
    digits += static_cast<char>('0' + rest);
  }
  std::reverse(digits.begin(), digits.end());
  return "2.25." + digits;
}

// Attributes of one data set; the first that DCMTK refuses is thrown.
class Attributes {
 public:
  Attributes(DcmItem& item, const std::filesystem::path& path) : item_(item), path_(path) {}

  void text(const DcmTag& tag, const std::string& value) {
    check(item_.putAndInsertString(tag, value.c_str()));
  }
  void number(const DcmTag& tag, double value) { text(tag, ecorche::text::number(value, 8)); }
  void whole(const DcmTag& tag, std::uint16_t value) { check(item_.putAndInsertUint16(tag, value)); }
  void signed_whole(const DcmTag& tag, std::int16_t value) { check(item_.putAndInsertSint16(tag, value)); }
  void empty(const DcmTag& tag) { check(item_.insertEmptyElement(tag)); }
  void pixels(std::span<const std::uint16_t> grey) {
    check(item_.putAndInsertUint16Array(DCM_PixelData, grey.data(), grey.size()));
  }

 private:
  void check(const OFCondition& done) const {
    if (done.bad())
      throw Error(ErrorKind::internal, path_.string(), std::string("DCMTK: ") + done.text(), "report this");
  }
  DcmItem& item_;
  const std::filesystem::path& path_;
};

void patient_and_study(Attributes& a, const RadiographFacts& facts) {
  a.text(DCM_PatientName, "ECORCHE^MODEL");
  a.text(DCM_PatientID, facts.patient);
  a.empty(DCM_PatientBirthDate);
  a.empty(DCM_PatientSex);
  a.text(DCM_PatientIdentityRemoved, "YES");
  a.text(DCM_DeidentificationMethod, "Computed from a posed model");
  a.text(DCM_StudyInstanceUID, uid_of("study " + facts.patient));
  for (const DcmTagKey& key :
       {DCM_StudyDate, DCM_StudyTime, DCM_ReferringPhysicianName, DCM_StudyID, DCM_AccessionNumber})
    a.empty(DcmTag(key));
  a.text(DCM_Modality, "DX");
  a.text(DCM_PresentationIntentType, "FOR PRESENTATION");
  a.text(DCM_SeriesInstanceUID, uid_of("series " + facts.patient + " " + facts.series));
  a.text(DCM_SeriesNumber, "1");
  a.text(DCM_SeriesDescription, facts.series.substr(0, 64));
  a.text(DCM_Manufacturer, "ecorche");
  a.text(DCM_ManufacturerModelName, "ecorche radiograph");
  a.text(DCM_SoftwareVersions, facts.program);
}

void geometry(Attributes& a, const GreyPicture& picture, const RadiographFacts& facts) {
  // Rows first.
  const auto spacing = [&](double scale) {
    return text::number(picture.pixel_mm[1] * scale, 8) + "\\" + text::number(picture.pixel_mm[0] * scale, 8);
  };
  a.text(DCM_PatientOrientation, orientation_letters(facts.right) + "\\" + orientation_letters(facts.down));
  if (!facts.view.empty()) a.text(DCM_ViewPosition, facts.view);
  a.empty(DCM_AnatomicRegionSequence);
  a.text(DCM_ImageLaterality, "U");
  a.text(DCM_ImagerPixelSpacing, spacing(1));
  a.number(DCM_DistanceSourceToDetector, facts.source_to_detector);
  a.number(DCM_DistanceSourceToPatient, facts.source_to_patient);
  const double magnification = facts.source_to_detector / facts.source_to_patient;
  a.number(DCM_EstimatedRadiographicMagnificationFactor, magnification);
  a.text(DCM_PixelSpacing, spacing(1 / magnification));
  a.text(DCM_PixelSpacingCalibrationType, "GEOMETRY");
  a.text(DCM_PixelSpacingCalibrationDescription, "At the distance of what is pictured");
  a.empty(DCM_PositionerType);
  a.empty(DCM_DetectorType);
}

void image(Attributes& a, const GreyPicture& picture, const RadiographFacts& facts) {
  a.text(DCM_InstanceNumber, "1");
  a.text(DCM_ImageType, "DERIVED\\PRIMARY");
  a.text(DCM_DerivationDescription, facts.derivation.substr(0, 1024));
  a.empty(DCM_ContentDate);
  a.empty(DCM_ContentTime);
  a.empty(DCM_AcquisitionContextSequence);
  a.whole(DCM_SamplesPerPixel, 1);
  a.text(DCM_PhotometricInterpretation, "MONOCHROME2");
  a.whole(DCM_Rows, static_cast<std::uint16_t>(picture.height));
  a.whole(DCM_Columns, static_cast<std::uint16_t>(picture.width));
  a.whole(DCM_BitsAllocated, 16);
  a.whole(DCM_BitsStored, 16);
  a.whole(DCM_HighBit, 15);
  a.whole(DCM_PixelRepresentation, 0);
  a.text(DCM_PixelIntensityRelationship, facts.log ? "LOG" : "LIN");
  a.signed_whole(DCM_PixelIntensityRelationshipSign, -1);  // bright where few photons come through
  a.number(DCM_RescaleIntercept, 0);
  a.number(DCM_RescaleSlope, 1);
  a.text(DCM_RescaleType, "US");
  a.text(DCM_PresentationLUTShape, "IDENTITY");
  a.text(DCM_LossyImageCompression, "00");
  a.text(DCM_BurnedInAnnotation, "NO");
  a.number(DCM_WindowCenter, 32768);
  a.number(DCM_WindowWidth, 65536);
}

}  // namespace

std::string orientation_letters(const std::array<double, 3>& direction) {
  // What makes less than a twentieth of it, some 3 degrees, is not told.
  constexpr double least = 0.05;
  std::array<std::size_t, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::abs(direction[a]) > std::abs(direction[b]);
  });
  std::string out;
  for (const std::size_t axis : order) {
    if (std::abs(direction[axis]) >= least) out += direction[axis] > 0 ? "LPH"[axis] : "RAF"[axis];
  }
  return out;
}

void write_radiograph_dicom(const std::filesystem::path& path, const GreyPicture& picture,
                            const RadiographFacts& facts) {
  DcmFileFormat file;
  DcmDataset& data = *file.getDataset();
  Attributes attributes(data, path);
  attributes.text(DCM_SOPClassUID, UID_DigitalXRayImageStorageForPresentation);
  patient_and_study(attributes, facts);
  geometry(attributes, picture, facts);
  image(attributes, picture, facts);
  attributes.pixels(picture.grey);
  std::string seed = facts.patient + facts.series + facts.derivation + text::number(picture.pixel_mm[0], 8) +
                     orientation_letters(facts.right) + orientation_letters(facts.down);
  seed.append(reinterpret_cast<const char*>(picture.grey.data()), picture.grey.size_bytes());
  attributes.text(DCM_SOPInstanceUID, uid_of("image " + seed));

  files::AtomicFile target(path);
  const OFCondition done = file.saveFile(target.temporary().c_str(), EXS_LittleEndianExplicit);
  if (done.bad())
    throw Error(ErrorKind::io, path.string(), std::string("cannot write: ") + done.text(), "check the disk");
  target.commit();
}

}  // namespace ecorche::io
