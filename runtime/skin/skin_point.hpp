// SPDX-License-Identifier: Apache-2.0
// The plain way to skin the points of vertex_skinning.hpp: what the shaders of clients/ do, in double
// precision.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/values/transform.hpp>
#include "runtime/skin/vertex_skinning.hpp"

namespace ecorche::runtime {

struct SkinnedPoint {
  Eigen::Vector3d at;                                ///< mm
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of any length
};

/// One pose by one method.
class PointSkinner {
 public:
  PointSkinner(std::span<const RigidTransform> segments, Skinning method, const QuantiseBox& box);

  SkinnedPoint place(const SkinPoint& point, const Eigen::Vector3d& normal = Eigen::Vector3d::Zero()) const;
  /// By the affine map of its tet; the normal by its cofactor.
  SkinnedPoint place(const HungVertex& vertex, std::span<const SkinPoint> nodes,
                     const Eigen::Vector3d& normal) const;

 private:
  struct Motion {
    Eigen::Matrix3d turn;
    Eigen::Vector3d shift;
    Eigen::Vector4d real, dual;  // x, y, z, w
  };

  Eigen::Vector3d rest(const std::array<std::uint16_t, 3>& numbers) const;

  std::vector<Motion> motions_;
  Skinning method_;
  QuantiseBox box_;
};

}  // namespace ecorche::runtime
