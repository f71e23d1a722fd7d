// SPDX-License-Identifier: Apache-2.0
#include "app/posed_dicom.hpp"

#include <ecorche/version.hpp>
#include "app/cli.hpp"
#include "app/read_budget.hpp"
#include "app/usage_error.hpp"

namespace ecorche::app {

void add_dicom_options(CLI::App& command, DicomSettings& settings) {
  command.add_option(
      "--dicom-source", settings.source,
      "folder of the series that was scanned: what DICOM files say of its acquisition, and of a "
      "segmentation that lies there its codes, is taken over");
  command.add_option("--dicom-series", settings.series,
                     "which series of --dicom-source, by UID or description, where it holds several");
  command.add_flag(
      "--keep-identity", settings.keep_identity,
      "DICOM files name the patient and the study of --dicom-source; without it they name nobody");
}

void check_dicom_options(const DicomSettings& settings, bool writes_dicom, const std::string& how_to_write) {
  if (!writes_dicom && (!settings.source.empty() || settings.keep_identity))
    usage_error(settings.source.empty() ? "--keep-identity" : "--dicom-source", "no DICOM is written",
                how_to_write);
  if (settings.keep_identity && settings.source.empty())
    usage_error("--keep-identity", "a model does not know who was scanned",
                "name the scan: --dicom-source DIR");
  if (!settings.series.empty() && settings.source.empty())
    usage_error("--dicom-series", "there is no --dicom-source", "name the folder of the scan");
}

io::DicomFacts dicom_facts(const Program& program, const DicomSettings& settings, const std::string& patient,
                           const std::string& derivation) {
  io::DicomFacts facts;
  facts.patient = patient;
  facts.derivation = derivation;
  facts.program = ECORCHE_VERSION;
  facts.keep_identity = settings.keep_identity;
  if (!settings.source.empty())
    facts.origin = io::read_dicom_origin(settings.source, reading(program, {}), {.series = settings.series});
  return facts;
}

void PosedDicom::add(const ModelVolume& volume, Image posed) {
  if (!volume.labels) {
    io::write_dicom_series(next_(volume.name + ".dicom"), posed, volume.name, facts_, reading(program_, {}));
    return;
  }
  labels_.layers.push_back(std::move(posed));
  for (const auto& [id, name] : volume.table) {
    labels_.names.emplace(id, name);
    const auto coded = facts_.origin.codes.find(name);
    if (coded != facts_.origin.codes.end()) labels_.codes.emplace(id, coded->second);
  }
}

void PosedDicom::write_mask(const std::string& name, const Image& mask) {
  io::write_dicom_segmentation(next_(name + ".dcm"), {{mask}, {{1, "scanned"}}, {}}, name, facts_);
}

void PosedDicom::finish() {
  if (!labels_.layers.empty()) io::write_dicom_segmentation(next_("labels.dcm"), labels_, "labels", facts_);
}

}  // namespace ecorche::app
