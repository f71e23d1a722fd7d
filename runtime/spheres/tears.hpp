// SPDX-License-Identifier: Apache-2.0
// Frames with visible errors (Gagvani01 7): where a posed body is torn.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <ecorche/values/context.hpp>
#include "runtime/spheres/owners.hpp"

namespace ecorche::runtime {

/// What is wrong with one posed body.
struct Tears {
  std::size_t uncovered = 0;  ///< voxels two deep at rest whose own posed place is in no ball
  std::size_t links = 0;  ///< neighbours two deep at rest between whose posed places lies a voxel in no ball
  /// Pieces of at least `least_part` voxels with more than one empty voxel around: a narrower gap opens in a
  /// thin neck whenever the lattice falls otherwise.
  std::size_t parts = 0;
  std::size_t rest_parts = 0;
  /// Segments between which most links are torn, the lower row first; -1 without any.
  std::array<std::int32_t, 2> between{-1, -1};

  bool errs() const { return uncovered > 0 || links > least_links || parts > rest_parts; }
  /// A tear is an opening that can be seen: fewer torn links than the faces of a 3 x 3 patch are none.
  static constexpr std::size_t least_links = 9;
  static constexpr std::size_t least_part = 27;
};

/// Knows a body at rest: which voxels lie two deep (a step of two voxels along any axis stays within the
/// body), which segment moves each, and the neighbours that different segments move.
class TearDetector {
 public:
  /// `rest`: before any motion; `segment`: of every ball.
  TearDetector(const BallSet& rest, const std::vector<std::int32_t>& segment, const Context& context = {});

  /// `posed`: the same balls, moved. O(voxels of the posed box).
  Tears look(const BallSet& posed, const Context& context = {}) const;

  std::size_t deep_voxels() const { return deep_.size(); }
  std::size_t deep_links() const { return links_.size(); }

 private:
  struct Deep {
    std::array<std::int32_t, 3> voxel;
    std::int32_t ball;  // that owns it
  };
  struct Link {
    std::uint32_t a, b;  // rows of deep_
  };
  std::vector<Deep> deep_;
  std::vector<Link> links_;
  std::size_t rest_parts_ = 0;
};

}  // namespace ecorche::runtime
