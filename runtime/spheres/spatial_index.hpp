// SPDX-License-Identifier: Apache-2.0
// The skeleton as a spatial index (Gagvani01 7): ways through the body, and bodies that meet.
#pragma once

#include <optional>
#include <vector>

#include "runtime/spheres/balls.hpp"

namespace ecorche::runtime {

/// Rows of the skeletal voxels from the one nearest to `from` to the one nearest to `to`, LPS mm at rest,
/// along the tree: a way through the body that keeps to its middle. Throws Error{data} where there is no
/// tree, or none that joins the two.
std::vector<std::size_t> path_between(const VolumetricSkeleton& skeleton, const Vec3& from, const Vec3& to);

/// Where two posed bodies meet.
struct Contact {
  std::size_t pairs = 0;     ///< of balls that overlap
  std::size_t a = 0, b = 0;  ///< rows of the pair that overlaps most, the lowest of those as deep
  double depth_mm = 0;       ///< sum of their radii less the distance of their centres
  Vec3 place{};              ///< LPS mm, midway in the overlap
};

/// Nothing where no ball of one overlaps a ball of the other.
std::optional<Contact> contact(const BallSet& a, const BallSet& b);

}  // namespace ecorche::runtime
