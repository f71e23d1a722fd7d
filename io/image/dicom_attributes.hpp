// SPDX-License-Identifier: Apache-2.0
// What all DICOM files that are written share. DCMTK writes them: it knows each attribute's type.
#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include "io/image/dicom_origin.hpp"
#include "io/image/segment_codes.hpp"

namespace ecorche::io::dicom {

/// A UID that needs no registration (PS3.5 B.2): `2.25.` and a UUID (version 8, of our own making) as a
/// decimal number. The same seed gives the same.
std::string uid_of(std::string_view seed);

/// As many digits as a Decimal String holds: 16 letters.
std::string decimal(double value);

/// Attributes of one data set or item; the first that DCMTK refuses is thrown.
class Attributes {
 public:
  Attributes(DcmItem& item, const std::filesystem::path& path) : item_(item), path_(path) {}

  void text(const DcmTag& tag, const std::string& value) const;
  void number(const DcmTag& tag, double value) const;
  /// Several numbers of one attribute.
  void numbers(const DcmTag& tag, std::initializer_list<double> values) const;
  void whole(const DcmTag& tag, std::uint16_t value) const;
  void wholes(const DcmTag& tag, std::span<const std::uint32_t> values) const;
  void pointer(const DcmTag& tag, const DcmTagKey& to) const;
  void signed_whole(const DcmTag& tag, std::int16_t value) const;
  void empty(std::initializer_list<DcmTagKey> tags) const;
  void pixels(std::span<const std::uint16_t> grey) const;
  /// Single bits, packed.
  void pixels(std::span<const std::uint8_t> bits) const;
  /// A new item behind those that the sequence has.
  Attributes add(const DcmTag& sequence) const;
  void code(const DcmTag& sequence, const CodedName& code) const;

 private:
  void check(const OFCondition& done) const;

  DcmItem& item_;
  const std::filesystem::path& path_;
};

/// Patient, study, equipment and frame of reference of what was made from a posed body; `modality` of the
/// series. Identity only where `facts` keep it.
void write_origin(const Attributes& a, const DicomFacts& facts, const std::string& modality,
                  const std::string& series);

/// How it was derived and, where identity is kept, from which images.
void write_derivation(const Attributes& a, const DicomFacts& facts);

/// Explicit little endian, atomically. Throws Error{cannot_create, io}.
void save(DcmFileFormat& file, const std::filesystem::path& path);

}  // namespace ecorche::io::dicom
