// SPDX-License-Identifier: Apache-2.0
#include "io/image/radiograph_dicom.hpp"

#include <algorithm>
#include <cmath>

#include "core/values/text.hpp"
#include "io/image/dicom_attributes.hpp"

namespace ecorche::io {
namespace {

using dicom::Attributes;
using dicom::uid_of;

void patient_and_study(const Attributes& a, const RadiographFacts& facts) {
  a.text(DCM_PatientName, "ECORCHE^MODEL");
  a.text(DCM_PatientID, facts.patient);
  a.empty({DCM_PatientBirthDate, DCM_PatientSex});
  a.text(DCM_PatientIdentityRemoved, "YES");
  a.text(DCM_DeidentificationMethod, "Computed from a posed model");
  a.text(DCM_StudyInstanceUID, uid_of("study " + facts.patient));
  a.empty({DCM_StudyDate, DCM_StudyTime, DCM_ReferringPhysicianName, DCM_StudyID, DCM_AccessionNumber});
  a.text(DCM_Modality, "DX");
  a.text(DCM_PresentationIntentType, "FOR PRESENTATION");
  a.text(DCM_SeriesInstanceUID, uid_of("series " + facts.patient + " " + facts.series));
  a.text(DCM_SeriesNumber, "1");
  a.text(DCM_SeriesDescription, facts.series.substr(0, 64));
  a.text(DCM_Manufacturer, "ecorche");
  a.text(DCM_ManufacturerModelName, "ecorche radiograph");
  a.text(DCM_SoftwareVersions, facts.program);
}

void geometry(const Attributes& a, const GreyPicture& picture, const RadiographFacts& facts) {
  // Rows first.
  const auto spacing = [&](double scale) {
    return text::number(picture.pixel_mm[1] * scale, 8) + "\\" + text::number(picture.pixel_mm[0] * scale, 8);
  };
  a.text(DCM_PatientOrientation, orientation_letters(facts.right) + "\\" + orientation_letters(facts.down));
  if (!facts.view.empty()) a.text(DCM_ViewPosition, facts.view);
  a.empty({DCM_AnatomicRegionSequence});
  a.text(DCM_ImageLaterality, "U");
  a.text(DCM_ImagerPixelSpacing, spacing(1));
  a.number(DCM_DistanceSourceToDetector, facts.source_to_detector);
  a.number(DCM_DistanceSourceToPatient, facts.source_to_patient);
  const double magnification = facts.source_to_detector / facts.source_to_patient;
  a.number(DCM_EstimatedRadiographicMagnificationFactor, magnification);
  a.text(DCM_PixelSpacing, spacing(1 / magnification));
  a.text(DCM_PixelSpacingCalibrationType, "GEOMETRY");
  a.text(DCM_PixelSpacingCalibrationDescription, "At the distance of what is pictured");
  a.empty({DCM_PositionerType});
  a.empty({DCM_DetectorType});
}

void image(const Attributes& a, const GreyPicture& picture, const RadiographFacts& facts) {
  a.text(DCM_InstanceNumber, "1");
  a.text(DCM_ImageType, "DERIVED\\PRIMARY");
  a.text(DCM_DerivationDescription, facts.derivation.substr(0, 1024));
  a.empty({DCM_ContentDate});
  a.empty({DCM_ContentTime});
  a.empty({DCM_AcquisitionContextSequence});
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
  const Attributes attributes(data, path);
  attributes.text(DCM_SOPClassUID, UID_DigitalXRayImageStorageForPresentation);
  patient_and_study(attributes, facts);
  geometry(attributes, picture, facts);
  image(attributes, picture, facts);
  attributes.pixels(picture.grey);
  std::string seed = facts.patient + facts.series + facts.derivation + text::number(picture.pixel_mm[0], 8) +
                     orientation_letters(facts.right) + orientation_letters(facts.down);
  seed.append(reinterpret_cast<const char*>(picture.grey.data()), picture.grey.size_bytes());
  attributes.text(DCM_SOPInstanceUID, uid_of("image " + seed));

  dicom::save(file, path);
}

}  // namespace ecorche::io
