// SPDX-License-Identifier: Apache-2.0
#include "io/image/dicom_attributes.hpp"

#include <xxhash.h>

#include <algorithm>
#include <array>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"

namespace ecorche::io::dicom {

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

std::string decimal(double value) {
  constexpr std::size_t longest = 16;
  for (int digits = 17; digits > 1; --digits) {
    std::string out = text::number(value, digits);
    if (out.size() <= longest) return out;
  }
  return text::number(value, 1);
}

void Attributes::check(const OFCondition& done) const {
  if (done.bad())
    throw Error(ErrorKind::internal, path_.string(), std::string("DCMTK: ") + done.text(), "report this");
}

void Attributes::text(const DcmTag& tag, const std::string& value) const {
  check(item_.putAndInsertString(tag, value.c_str()));
}

void Attributes::number(const DcmTag& tag, double value) const {
  text(tag, decimal(value));
}

void Attributes::numbers(const DcmTag& tag, std::initializer_list<double> values) const {
  std::string all;
  for (const double value : values) all += (all.empty() ? "" : "\\") + decimal(value);
  text(tag, all);
}

void Attributes::whole(const DcmTag& tag, std::uint16_t value) const {
  check(item_.putAndInsertUint16(tag, value));
}

void Attributes::wholes(const DcmTag& tag, std::span<const std::uint32_t> values) const {
  check(item_.putAndInsertUint32Array(tag, values.data(), static_cast<unsigned long>(values.size())));
}

void Attributes::pointer(const DcmTag& tag, const DcmTagKey& to) const {
  check(item_.putAndInsertTagKey(tag, to));
}

void Attributes::signed_whole(const DcmTag& tag, std::int16_t value) const {
  check(item_.putAndInsertSint16(tag, value));
}

void Attributes::empty(std::initializer_list<DcmTagKey> tags) const {
  for (const DcmTagKey& tag : tags) check(item_.insertEmptyElement(DcmTag(tag)));
}

void Attributes::pixels(std::span<const std::uint16_t> grey) const {
  check(item_.putAndInsertUint16Array(DCM_PixelData, grey.data(), static_cast<unsigned long>(grey.size())));
}

void Attributes::pixels(std::span<const std::uint8_t> bits) const {
  check(item_.putAndInsertUint8Array(DcmTag(DCM_PixelData, EVR_OB), bits.data(),
                                     static_cast<unsigned long>(bits.size())));
}

Attributes Attributes::add(const DcmTag& sequence) const {
  DcmItem* made = nullptr;
  check(item_.findOrCreateSequenceItem(sequence, made, -2));  // -2: a new one at the end
  return {*made, path_};
}

void Attributes::code(const DcmTag& sequence, const CodedName& code) const {
  const Attributes item = add(sequence);
  item.text(code.value.size() > 16 ? DCM_LongCodeValue : DCM_CodeValue, code.value);
  item.text(DCM_CodingSchemeDesignator, code.scheme);
  item.text(DCM_CodeMeaning, code.meaning.substr(0, 64));
}

void write_origin(const Attributes& a, const DicomFacts& facts, const std::string& modality,
                  const std::string& series) {
  const DicomOrigin& from = facts.origin;
  a.text(DCM_SpecificCharacterSet, "ISO_IR 192");
  a.empty({DCM_PatientBirthDate, DCM_PatientSex, DCM_StudyDate, DCM_StudyTime, DCM_ReferringPhysicianName,
           DCM_StudyID, DCM_AccessionNumber});
  if (facts.keep_identity) {
    for (const auto& [tag, value] : from.identity)
      a.text(DcmTag(static_cast<Uint16>(tag >> 16), static_cast<Uint16>(tag & 0xffff)), value);
  } else {
    a.text(DCM_PatientName, "ECORCHE^MODEL");
    a.text(DCM_PatientID, facts.patient);
    a.text(DCM_PatientIdentityRemoved, "YES");
    a.text(DCM_DeidentificationMethod, "Computed from a posed model");
    a.text(DCM_StudyInstanceUID, uid_of("study " + facts.patient));
  }
  a.text(DCM_Modality, modality);
  a.text(DCM_SeriesInstanceUID, uid_of("series " + facts.patient + facts.pose + series));
  a.text(DCM_SeriesNumber, modality == "SEG" ? "9002" : "9001");
  a.text(DCM_SeriesDescription, (series + ", " + facts.words).substr(0, 64));
  // Posed, the body is in a space of its own.
  a.text(DCM_FrameOfReferenceUID, uid_of("frame " + facts.patient + facts.pose));
  a.empty({DCM_PositionReferenceIndicator});
  a.text(DCM_Manufacturer, "ecorche");
  a.text(DCM_ManufacturerModelName, "ecorche");
  a.text(DCM_DeviceSerialNumber, "0");
  a.text(DCM_SoftwareVersions, facts.program);
}

void write_derivation(const Attributes& a, const DicomFacts& facts) {
  a.text(DCM_DerivationDescription, facts.derivation.substr(0, 1024));
  if (!facts.keep_identity) return;
  for (const std::string& object : facts.origin.objects) {
    const Attributes item = a.add(DCM_SourceImageSequence);
    item.text(DCM_ReferencedSOPClassUID, facts.origin.object_class);
    item.text(DCM_ReferencedSOPInstanceUID, object);
  }
}

void save(DcmFileFormat& file, const std::filesystem::path& path) {
  files::AtomicFile target(path);
  const OFCondition done = file.saveFile(target.temporary().c_str(), EXS_LittleEndianExplicit);
  if (done.bad())
    throw Error(ErrorKind::io, path.string(), std::string("cannot write: ") + done.text(), "check the disk");
  target.commit();
}

}  // namespace ecorche::io::dicom
