// SPDX-License-Identifier: Apache-2.0
// What commands that write images as DICOM let their user say, and how posed volumes become files.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include <ecorche/values/model.hpp>
#include "app/cli_fwd.hpp"
#include "app/program.hpp"
#include "core/files/read_options.hpp"
#include "io/image/dicom_writer.hpp"

namespace ecorche::app {

struct DicomSettings {
  std::filesystem::path source;  ///< the scan, of which tags are taken over
  std::string series;
  bool keep_identity = false;
};

/// `--dicom-source`, `--dicom-series`, `--keep-identity`.
void add_dicom_options(CLI::App& command, DicomSettings& settings);

/// Refuses these options where no DICOM is written, and an identity of nobody. Throws Error{usage}.
void check_dicom_options(const DicomSettings& settings, bool writes_dicom, const std::string& how_to_write);

/// What all files of one run say. `patient` and `derivation` as in io::DicomFacts.
io::DicomFacts dicom_facts(const Program& program, const DicomSettings& settings, const std::string& patient,
                           const std::string& derivation);

/// The volumes of one posed body: each picture a folder NAME.dicom, all layers of labels one labels.dcm.
class PosedDicom {
 public:
  /// `next` gives the path of a file to write by its name.
  using Next = std::function<std::filesystem::path(const std::string& name)>;
  PosedDicom(const Program& program, io::DicomFacts facts, Next next)
      : program_(program), facts_(std::move(facts)), next_(std::move(next)) {}

  void add(const ModelVolume& volume, Image posed);
  /// A DICOM SEG of one segment, `scanned`.
  void write_mask(const std::string& name, const Image& mask);
  /// Writes the labels.
  void finish();

 private:
  const Program& program_;
  io::DicomFacts facts_;
  Next next_;
  io::Segmentation labels_;
};

}  // namespace ecorche::app
