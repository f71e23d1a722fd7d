// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/segment_motion.hpp>

#include <algorithm>

namespace ecorche::runtime {
namespace {

std::array<float, 9> turn_less_identity(const Eigen::Quaterniond& q) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> turn =
      q.toRotationMatrix() - Eigen::Matrix3d::Identity();
  std::array<float, 9> out{};
  for (std::size_t i = 0; i < 9; ++i) out[i] = static_cast<float>(turn.data()[i]);
  return out;
}

std::array<float, 4> narrowed(const Eigen::Quaterniond& q) {
  return {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
          static_cast<float>(q.z())};
}

// How far the motion takes the origin.
Eigen::Vector3d shift_of(const RigidTransform& motion, const Eigen::Vector3d& origin) {
  return motion * origin - origin;
}

}  // namespace

Vec3f middle_of(std::span<const float> nodes) {
  Vec3f middle{0, 0, 0};
  for (std::size_t c = 0; c < 3 && !nodes.empty(); ++c) {
    float low = nodes[c], high = nodes[c];
    for (std::size_t i = c; i < nodes.size(); i += 3) {
      low = std::min(low, nodes[i]);
      high = std::max(high, nodes[i]);
    }
    middle[c] = low + (high - low) / 2;
  }
  return middle;
}

RootMotion make_motions(std::span<const RigidTransform> segments, const Vec3f& origin,
                        std::span<SegmentMotion> out) {
  const Eigen::Vector3d o(static_cast<double>(origin[0]), static_cast<double>(origin[1]),
                          static_cast<double>(origin[2]));
  const Eigen::Vector3d way = shift_of(segments[0], o);
  for (std::size_t s = 0; s < out.size(); ++s) {
    const Eigen::Quaterniond& q = segments[s].q;
    const Eigen::Vector3d u = shift_of(segments[s], o) - way;
    const Eigen::Quaterniond dual = Eigen::Quaterniond(0, u.x() / 2, u.y() / 2, u.z() / 2) * q;
    out[s] = {turn_less_identity(q),
              {static_cast<float>(u.x()), static_cast<float>(u.y()), static_cast<float>(u.z())},
              narrowed(q),
              narrowed(dual)};
  }
  return {origin, turn_less_identity(segments[0].q), {way.x(), way.y(), way.z()}};
}

}  // namespace ecorche::runtime
