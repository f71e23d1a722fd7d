// SPDX-License-Identifier: Apache-2.0
// Tissue vertices into tets (Sujar18 3.5, 4).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/values/context.hpp"
#include "core/values/mesh.hpp"

namespace ecorche::mapping {

struct Binding {
  std::vector<std::int32_t> tet;  ///< #P
  Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> barycentric;  ///< #P by 4, sum 1
  std::uint64_t outside = 0;      ///< points in no tet
  double max_outside_mm = 0;
};

/// The tet that holds each point; on shared faces the lowest index of those that hold it. A point outside gets the tet
/// behind the exact nearest boundary face, with signed barycentrics. The body is not convex: a walk that leaves it
/// restarts from the nearest boundary face, so that a point inside is never called outside. O(#P) walks, parallel.
class Locator {
 public:
  Locator(const PointsF& nodes, const Tets& tets);
  ~Locator();
  Locator(const Locator&) = delete;
  Locator& operator=(const Locator&) = delete;
  Binding bind(const Points& points, const Context& context) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ecorche::mapping
