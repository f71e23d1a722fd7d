// SPDX-License-Identifier: Apache-2.0
// A radiograph as DICOM's Digital X-Ray Image, for presentation (PS3.3 A.26): synthetic, and of nobody.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "io/image/grey_picture.hpp"

namespace ecorche::io {

/// What the file says beside its pixels. No times: the same picture is the same file.
struct RadiographFacts {
  std::string patient;                                   ///< stands for the body: identifier of the model
  std::string series;                                    ///< what was pictured, in words
  std::string derivation;                                ///< how, in words
  std::string program;                                   ///< version
  std::string view;                                      ///< `AP`, `PA`, `LL`, `RL`; empty: none of them
  std::array<double, 3> right{1, 0, 0}, down{0, 0, -1};  ///< of the picture, in the patient's LPS axes
  double source_to_detector = 0, source_to_patient = 0;  ///< mm; the latter to what is pictured
  bool log = true;  ///< grey grows with the line integral, else with the share of photons held back
};

/// The letters of DICOM's Patient Orientation (PS3.3 C.7.6.1.1.1) for a direction: `L`, `FR`, ...
std::string orientation_letters(const std::array<double, 3>& direction);

/// Writes the file, atomically; dense is bright (MONOCHROME2). Its UIDs are made from the model, the words
/// and the pixels. Throws Error{cannot_create, io}.
void write_radiograph_dicom(const std::filesystem::path& path, const GreyPicture& picture,
                            const RadiographFacts& facts);

}  // namespace ecorche::io
