// SPDX-License-Identifier: Apache-2.0
// What `ecorche unpose` says of what it brought back.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/surfaces_back.hpp"

namespace ecorche::app {

/// Surfaces whose way is not known: by the tets about them.
struct DrawnTrip {
  std::uint64_t vertices = 0, outside = 0, folded = 0;
  double max_outside_mm = 0;
};

/// An image, as runtime::VoxelTrip says.
struct ImageTrip {
  std::filesystem::path file, mask;
  std::uint64_t voxels = 0, elsewhere = 0;
  double mean_mm = 0, mean_voxels = 0, max_mm = 0;
  nlohmann::json against_scan;  ///< of held_against; null without --model
};

struct UnposeReport {
  std::vector<std::filesystem::path> files;
  std::vector<SurfaceTrip> surfaces;
  DrawnTrip drawn;
  std::vector<ImageTrip> images;
};

std::string text_of(const UnposeReport& report);
nlohmann::json json_of(const UnposeReport& report);

}  // namespace ecorche::app
