// SPDX-License-Identifier: Apache-2.0
// What a written DICOM file says of where it comes from. DCMTK stays out of here.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/files/read_options.hpp"
#include "io/image/image_choice.hpp"
#include "io/image/segment_codes.hpp"

namespace ecorche::io {

/// What is taken over from the series that was scanned.
struct DicomOrigin {
  using Values = std::vector<std::pair<std::uint32_t, std::string>>;  ///< tag `0xGGGGEEEE`, value
  Values identity;                                                    ///< of patient and study
  Values acquisition;  ///< what is still true of a posed image, and names nobody: kV, mAs, kernel, window
  std::string object_class;
  std::vector<std::string> objects;           ///< UIDs of its slices
  std::map<std::string, SegmentCodes> codes;  ///< of a DICOM SEG beside it, by the segment's name
};

struct DicomFacts {
  std::string patient;     ///< stands for the body, where its identity is dropped: identifier of the model
  std::string pose;        ///< stands for the pose: the same body, posed so, lies in the same space.
                           ///< Empty: told by the voxels
  std::string words;       ///< of the pose, for Series Description
  std::string derivation;  ///< how it was made, in words
  std::string program;     ///< version
  DicomOrigin origin;
  bool keep_identity = false;
  /// Of each slice's first pixel, LPS mm, where they are not those of the image's grid.
  std::vector<std::array<double, 3>> positions = {};
};

/// Of the CT series in `path`, and of a DICOM SEG that lies there too. Throws as `read_dicom`, and
/// Error{data} for what is no CT.
DicomOrigin read_dicom_origin(const std::filesystem::path& path, const files::ReadOptions& options,
                              const ImageChoice& choice);

}  // namespace ecorche::io
