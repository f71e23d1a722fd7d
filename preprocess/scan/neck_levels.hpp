// SPDX-License-Identifier: Apache-2.0
// Where the vertebrae of a neck meet: its discs, and the joints of atlas and axis.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/context.hpp>
#include "preprocess/scan/neck_lattice.hpp"

namespace ecorche::scan {

/// A plane that parts two vertebrae at their bodies, or at a pair of lateral joints.
struct NeckLevel {
  double k = 0;     ///< layer of the lattice, in the middle of the body, or of the joint
  double tilt = 0;  ///< of a disc: radians, up towards the back; of a lateral joint: the slope, down outwards
  double contrast = 0;  ///< 0 to 1: how much darker than the brightest layer on either side
};

/// Lateral masses of the atlas lie between these, mm beside the middle.
inline constexpr int kDens = 9, kMass = 19;

struct NeckLevels {
  int middle = 0;                ///< i of the plane about which the neck is most alike
  std::vector<int> line;         ///< of each layer: j of the middle of the bodies
  std::vector<NeckLevel> discs;  ///< from the top, the first below the axis; empty: nothing was told apart
  double top = 0;                ///< layer of the tip of the dens
  std::optional<std::array<NeckLevel, 2>> beside;  ///< joints of atlas and axis, left and right
  std::string why;                                 ///< in words, where there is no disc

  int line_at(double k) const {
    return line[static_cast<std::size_t>(
        std::clamp(static_cast<int>(std::lround(k)), 0, static_cast<int>(line.size()) - 1))];
  }
  /// mm above the joint of atlas and axis.
  double over_joint(int i, int k) const {
    const NeckLevel& joint = (*beside)[i >= middle ? 0 : 1];
    return k - (joint.k - joint.tilt * (std::abs(i - middle) - 0.5 * (kDens + kMass)));
  }
  /// Which row from the top a sample lies at: 0 is the atlas, or where that did not come apart with the axis.
  int row_of(int i, int j, int k) const {
    int below = 0;
    for (const NeckLevel& disc : discs) {
      const double s = std::clamp(static_cast<double>(j - line_at(disc.k)), -15.0, 15.0);
      below += k < disc.k + std::tan(disc.tilt) * s ? 1 : 0;
    }
    if (!beside) return below;
    return below > 0 ? below + 1 : (over_joint(i, k) > 0 ? 0 : 1);
  }
};

/// As part_neck() says (part_vertebrae.hpp).
NeckLevels find_levels(const NeckLattice& lattice, const Context& context);

}  // namespace ecorche::scan
