// SPDX-License-Identifier: Apache-2.0
// What a user gives for a scan: images and segmentations in the forms in which programs write them.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/context.hpp>
#include "io/image/segmentation.hpp"

namespace ecorche::app {

/// What a label was guessed to be.
struct LabelGuess {
  std::string how;  ///< for a reader
  double confidence = 1;
};

/// A label map, and where its names came from.
struct ScanLabels {
  std::filesystem::path path;
  io::Segmentation map;
  std::string names_from;  ///< for a reader: `its header`; empty where it has no names
  std::map<std::int64_t, LabelGuess> guesses = {};  ///< by id, where its names were guessed
};

/// An image of grey values.
struct ScanImage {
  std::filesystem::path path;
  Image image;
  bool ct = false;          ///< in Hounsfield units, as its least values tell, or taken as a CT
  double background = 0;    ///< what is outside of the patient
  bool own_values = false;  ///< a CT whose values are no HU

  /// `226 HU`, for a reader.
  std::string value(double v) const;
};

struct Scan {
  std::vector<ScanLabels> labels;
  std::vector<ScanImage> images;
  std::vector<std::string> notes;  ///< what a user should know, a line each
};

/// Reads all of `paths`: images, label maps, folders of masks or of label maps, DICOM series and DICOM SEG,
/// and tables of names, which go with the label map of their name or with the only one that lacks names.
/// Which is which, the files tell; `choice` says which of several series a DICOM folder is read for. Throws
/// Error{usage}, Error{missing_input} or Error{data}.
Scan read_scan(const std::vector<std::filesystem::path>& paths, const files::ReadOptions& options,
               const io::ImageChoice& choice, const Context& context);

}  // namespace ecorche::app
