// SPDX-License-Identifier: Apache-2.0
// What a scanner would see of the phantom.
#pragma once

#include <cstdint>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include "phantom/body.hpp"

namespace ecorche::phantom {

struct Scan {
  CaseVolume ct;        ///< i16 Hounsfield units, edges smoothed over one voxel; background -1024
  CaseVolume ct_noisy;  ///< the same with bell-shaped noise of 15 HU
  CaseLabels labels;    ///< u8: 1 soft, then 2 + row of `parts`; 0 outside
};

/// Samples skin and parts on cubic voxels of `voxel` mm over `bounds` and one voxel more all round. A voxel
/// carries the label of the last part that holds its centre. Same bytes for any number of threads. At most
/// 253 parts.
Scan make_scan(const Part& skin, const std::vector<Part>& parts, const Box& bounds, double voxel,
               std::uint64_t seed, const Context& context);

}  // namespace ecorche::phantom
