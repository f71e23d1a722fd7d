// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/skin_point.hpp"

#include <cmath>

#include "runtime/skin/skin_clusters.hpp"

namespace ecorche::runtime {
namespace {

constexpr double kWhole = 65535;

Eigen::Matrix3d cofactor(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d out;
  for (Eigen::Index c = 0; c < 3; ++c) out.col(c) = m.col((c + 1) % 3).cross(m.col((c + 2) % 3));
  return out;
}

}  // namespace

PointSkinner::PointSkinner(std::span<const RigidTransform> segments, Skinning method, const QuantiseBox& box)
    : method_(method), box_(box) {
  for (const RigidTransform& segment : segments) {
    const Eigen::Quaterniond dual =
        Eigen::Quaterniond(0, segment.t.x() / 2, segment.t.y() / 2, segment.t.z() / 2) * segment.q;
    motions_.push_back({segment.q.toRotationMatrix(), segment.t, segment.q.coeffs(), dual.coeffs()});
  }
}

Eigen::Vector3d PointSkinner::rest(const std::array<std::uint16_t, 3>& numbers) const {
  Eigen::Vector3d out;
  for (std::size_t c = 0; c < 3; ++c)
    out[static_cast<Eigen::Index>(c)] =
        static_cast<double>(box_.low[c]) + static_cast<double>(box_.step) * numbers[c];
  return out;
}

SkinnedPoint PointSkinner::place(const SkinPoint& point, const Eigen::Vector3d& normal) const {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  Eigen::Vector4d real = Eigen::Vector4d::Zero(), dual = real;
  for (std::size_t k = 0; k < SkinPoint::most && point.weight[k] != 0; ++k) {
    const Motion& motion = motions_[point.segment[k]];
    const double w = point.weight[k] / kWhole;
    turn += w * motion.turn;
    shift += w * motion.shift;
    real += w * motion.real;
    dual += w * motion.dual;
  }
  const Eigen::Vector3d x = rest(point.rest);
  if (method_ == Skinning::lbs) return {turn * x + shift, cofactor(turn) * normal};
  double length = real.norm();
  if (length < static_cast<double>(vanished_blend)) {
    real = motions_[point.segment[0]].real;
    dual = motions_[point.segment[0]].dual;
    length = 1;
  }
  const Eigen::Quaterniond q(Eigen::Vector4d(real / length));
  if (method_ == Skinning::cor) {
    const Eigen::Vector3d c = rest(point.centre);
    return {turn * c + shift + q * (x - c), q * normal};
  }
  const Eigen::Vector4d d = dual / length;
  return {q * x + 2 * (q.w() * d.head<3>() - d.w() * q.vec() + q.vec().cross(d.head<3>())), q * normal};
}

SkinnedPoint PointSkinner::place(const HungVertex& vertex, std::span<const SkinPoint> nodes,
                                 const Eigen::Vector3d& normal) const {
  std::array<Eigen::Vector3d, 4> at, still;
  SkinnedPoint out{Eigen::Vector3d::Zero()};
  for (std::size_t k = 0; k < 4; ++k) {
    const SkinPoint& node = nodes[vertex.node[k]];
    at[k] = place(node).at;
    still[k] = rest(node.rest);
    out.at += static_cast<double>(vertex.share[k]) * at[k];
  }
  const Eigen::Vector3d e1 = at[1] - at[0], e2 = at[2] - at[0], e3 = at[3] - at[0];
  out.normal = normal.dot(still[1] - still[0]) * e2.cross(e3) +
               normal.dot(still[2] - still[0]) * e3.cross(e1) +
               normal.dot(still[3] - still[0]) * e1.cross(e2);
  return out;
}

}  // namespace ecorche::runtime
