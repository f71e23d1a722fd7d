// SPDX-License-Identifier: Apache-2.0
// How much of a face lies in the body: where it is bridged only, parting costs nothing.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/image.hpp>

namespace ecorche::parting {

/// Looks faces up in the voxels of the body, and in the scan's own labels where these name skin: a sheet of
/// it deep in the body is where two limbs touch. Refers to both images.
class SolidFaces {
 public:
  /// `voxels` as voxel::voxelize makes them; labels whose name has the word skin are skin.
  SolidFaces(const Image& voxels, const std::optional<CaseLabels>& labels);

  /// 0 to 1: the share of the triangle in the body, by voxels at seven points.
  double share(const std::array<Eigen::Vector3d, 3>& corners) const;
  /// The same; what lies in skin counts kSkin.
  double price(const std::array<Eigen::Vector3d, 3>& corners) const;

  static constexpr double kSkin = 0.05;

 private:
  bool solid_at(const Eigen::Vector3d& point) const;
  bool skin_at(const Eigen::Vector3d& point) const;

  const Image& voxels_;
  const Image* labels_ = nullptr;
  std::vector<std::int64_t> skin_;  // ascending
};

}  // namespace ecorche::parting
