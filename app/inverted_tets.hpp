// SPDX-License-Identifier: Apache-2.0
// Where a posed body folds into itself.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>

namespace ecorche::app {

struct InvertedNear {
  std::string joint;  ///< the nearest one, at rest
  std::uint64_t tets = 0;
  double rest_mm3 = 0;
};

struct InvertedTets {
  std::vector<InvertedNear> near;  ///< largest volume first; joints without any are left out
  std::uint64_t in_tissues = 0;    ///< those that a vertex of a soft tissue besides the skin hangs on
};

/// `det_f`: of every tet (runtime::tet_det_f); inverted are those of zero or less. As all figures of the tets
/// over runtime::TetKind::body alone.
InvertedTets inverted_tets(const Model& model, std::span<const float> det_f);

}  // namespace ecorche::app
