// SPDX-License-Identifier: Apache-2.0
// `phantom --scan`: the patient as hospitals have one, a CT and what a program segmented in it.
#pragma once

#include <filesystem>
#include <string>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>

namespace ecorche::app {

/// The forms: `totalsegmentator` (folders of masks), `totalsegmentator_ml` (label maps with names in the
/// header), `moose` (label maps with organ_indices.json), `slicer` (.seg.nrrd), `dicom` (a CT series, and a
/// DICOM SEG).
inline constexpr const char* scan_forms[] = {"totalsegmentator", "totalsegmentator_ml", "moose", "slicer",
                                             "dicom"};

/// Writes the CT and the segmentation of `patient`, the phantom, into `folder`.
void write_phantom_scan(const std::filesystem::path& folder, const std::string& form, const Case& patient,
                        const Context& context);

}  // namespace ecorche::app
