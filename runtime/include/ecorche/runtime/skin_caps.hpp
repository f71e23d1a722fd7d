// SPDX-License-Identifier: Apache-2.0
// Where a skin is cut flat by the border of its scan: caps, which are no skin.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// The plane of a border of the scan at which the skin ends.
struct SkinCap {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();    ///< LPS mm: the middle of the cap
  Eigen::Vector3d out = Eigen::Vector3d::UnitZ();  ///< unit, out of the scan
  double within_mm = 0;                            ///< the cap's vertices lie so near to the plane
  double cm2 = 0;                                  ///< its area
};

/// As the model's provenance has them under `skin_caps`, a line each; empty where no skin is cut, or where it
/// was made before caps were marked. What is no line of eight numbers is passed over.
std::vector<SkinCap> skin_caps(const Model& model);

/// 1 for each triangle of the skin at rest that is a cap's: its corners lie at the plane, and it looks out.
/// Empty where there is none.
std::vector<std::uint8_t> cap_faces(const Tissue& skin, const std::vector<SkinCap>& caps);

/// 1 for each tet that a corner of a cap's triangle is bound to; empty where there is none.
std::vector<std::uint8_t> cap_tets(const Model& model);

}  // namespace ecorche::runtime
