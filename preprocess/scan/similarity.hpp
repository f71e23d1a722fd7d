// SPDX-License-Identifier: Apache-2.0
// Turn, size and place at once, and the one that carries points nearest to others.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "core/linear/decompositions.hpp"

namespace ecorche::scan {

/// x -> scale * rotation * x + shift.
struct Similarity {
  double scale = 1;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator()(const Eigen::Vector3d& p) const { return scale * (rotation * p) + shift; }
  Eigen::Vector3d back(const Eigen::Vector3d& p) const { return rotation.transpose() * (p - shift) / scale; }
  /// First `other`, then this.
  Similarity after(const Similarity& other) const {
    return {scale * other.scale, rotation * other.rotation, (*this)(other.shift)};
  }
};

inline Similarity inverse(const Similarity& s) {
  return {1 / s.scale, s.rotation.transpose(), -(s.rotation.transpose() * s.shift) / s.scale};
}

/// Sums over weighted pairs of points, from which the best similarity follows (weighted least squares).
class SimilarityFit {
 public:
  void add(const Eigen::Vector3d& from, const Eigen::Vector3d& to, double weight) {
    weight_ += weight;
    from_ += weight * from;
    to_ += weight * to;
    cross_ += weight * to * from.transpose();
    square_ += weight * from.squaredNorm();
  }
  double weight() const { return weight_; }

  /// Its scale within `least` and `most`. Some weight must have been added.
  Similarity solve(double least, double most) const {
    const Eigen::Vector3d from = from_ / weight_, to = to_ / weight_;
    const Eigen::Matrix3d cross = cross_ / weight_ - to * from.transpose();
    const double spread = std::max(1e-9, square_ / weight_ - from.squaredNorm());
    Similarity out;
    out.rotation = linear::nearest_turn(cross);
    // The trace of R' M over the spread (Umeyama91).
    out.scale = std::clamp(out.rotation.cwiseProduct(cross).sum() / spread, least, most);
    out.shift = to - out.scale * (out.rotation * from);
    return out;
  }

 private:
  double weight_ = 0, square_ = 0;
  Eigen::Vector3d from_ = Eigen::Vector3d::Zero(), to_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d cross_ = Eigen::Matrix3d::Zero();
};

}  // namespace ecorche::scan
