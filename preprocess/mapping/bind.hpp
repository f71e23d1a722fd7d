// SPDX-License-Identifier: Apache-2.0
// Tissue vertices into tets (Sujar18 3.5, 4).
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::mapping {

struct Binding {
  std::vector<std::int32_t> tet;  ///< #P
  /// #P by 4, sum 1; signed outside. Rounded so that x0 + b1 (x1-x0) + b2 (x2-x0) + b3 (x3-x0) in float32
  /// gives the point back to 1e-3 mm within 2 m of the origin.
  Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> barycentric;
  std::vector<float> outside_mm;  ///< #P, distance to the nearest boundary face; 0 inside
  std::uint64_t outside = 0;      ///< points in no tet
  double max_outside_mm = 0;
};

/// The tet that holds each point; on shared faces the lowest index of those that hold it. A point outside
/// gets the tet behind the exact nearest boundary face, with signed barycentrics. Nothing is assumed of the
/// body's shape: a point is outside only when no tet at all holds it. Parallel, the same for any number of
/// threads; all tets are gone through once a call, so that points are best bound all together. Keeps
/// references: `nodes` and `tets` must outlive the locator. Throws Error{data} for a mesh without tets.
class Locator {
 public:
  Locator(const PointsF& nodes, const Tets& tets);
  ~Locator();
  Locator(const Locator&) = delete;
  Locator& operator=(const Locator&) = delete;
  /// Throws Error{interrupted}, and Error{data} for a point that is not finite.
  Binding bind(const Points& points, const Context& context) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ecorche::mapping
