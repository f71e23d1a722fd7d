// SPDX-License-Identifier: Apache-2.0
// `--resample`: on whose voxels posed volumes are written.
#pragma once

#include <optional>

#include "app/pose_plan.hpp"
#include "io/image/scan_slices.hpp"

namespace ecorche::app {

/// The slices of the scan that the settings name, where volumes are to be written on them. Throws
/// Error{usage} where no scan is named, or only DICOM can say where its slices lie; and as read_scan_slices.
std::optional<io::ScanSlices> chosen_slices(const PoseSettings& settings);

}  // namespace ecorche::app
