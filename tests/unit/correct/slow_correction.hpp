// SPDX-License-Identifier: Apache-2.0
// The correction as its header says it: sample by sample, node by node, double precision. The oracle of
// runtime/skin.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <ecorche/values/model.hpp>
#include <ecorche/values/pose.hpp>
#include "tests/unit/runtime/reference_skinning.hpp"

namespace ecorche::test {

inline Eigen::RowVector3d slow_turn(const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd around(q);
  double angle = around.angle();
  if (angle > EIGEN_PI) angle -= 2 * EIGEN_PI;
  return angle * around.axis().transpose();
}

/// Of every sample, at a turn of a hinge: between the two nearest ones around it, rest being one of them.
inline Eigen::VectorXd slow_shares_of_hinge(const JointCorrection& c, const Eigen::RowVector3d& turn) {
  const Eigen::RowVector3d along = c.turn.row(0).normalized();
  const auto place = [&](Eigen::Index s) { return s < c.turn.rows() ? c.turn.row(s).dot(along) : 0.0; };
  const double at = turn.dot(along);
  Eigen::Index below = -1, above = -1;
  for (Eigen::Index s = 0; s <= c.turn.rows(); ++s) {
    if (place(s) <= at && (below < 0 || place(s) > place(below))) below = s;
    if (place(s) >= at && (above < 0 || place(s) < place(above))) above = s;
  }
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(c.turn.rows() + 1);
  if (below < 0) below = above;
  if (above < 0) above = below;
  const double part = above == below ? 0 : (at - place(below)) / (place(above) - place(below));
  shares[below] += 1 - part;
  shares[above] += part;
  return shares.head(c.turn.rows());
}

/// Coefficients of multiquadrics that are 1 at sample s and 0 at the others and rest, solved for each.
inline Eigen::VectorXd slow_shares_of_ball(const JointCorrection& c, Eigen::RowVector3d turn) {
  const Eigen::Index n = c.turn.rows();
  Eigen::MatrixXd at(n + 1, 3);
  at << c.turn, Eigen::RowVector3d::Zero();
  turn = turn.cwiseMax(at.colwise().minCoeff()).cwiseMin(at.colwise().maxCoeff());
  Eigen::MatrixXd kernel(n + 1, n + 1);
  Eigen::VectorXd here(n + 1);
  for (Eigen::Index a = 0; a <= n; ++a) {
    here[a] = std::hypot(1.0, (at.row(a) - turn).norm());
    for (Eigen::Index b = 0; b <= n; ++b) kernel(a, b) = std::hypot(1.0, (at.row(a) - at.row(b)).norm());
  }
  return kernel.colPivHouseholderQr().solve(here).head(n);
}

/// What turns with a node.
inline Eigen::Quaterniond slow_frame(const Model& model, std::size_t node,
                                     const std::vector<RigidTransform>& segments) {
  Eigen::Quaterniond blend(0, 0, 0, 0);
  for (const auto& [s, w] : reference_weights(model, node, 1e-4))
    blend.coeffs() += w * segments[s].q.coeffs();
  return blend.normalized();
}

/// What several joints move a node by together.
inline Eigen::Vector3d slow_together(const std::vector<Eigen::Vector3d>& moved) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::vector<double> length;
  for (const Eigen::Vector3d& u : moved) {
    sum += u;
    length.push_back(u.norm());
  }
  std::sort(length.rbegin(), length.rend());
  const double others = std::accumulate(length.begin() + (length.empty() ? 0 : 1), length.end(), 0.0);
  if (others == 0) return sum;
  const double faded = others / (1 + std::pow(others / 8, 4));
  return sum * (length[0] + faded) / (length[0] + others);
}

/// All nodes of a model, skinned by centres of rotation and corrected.
inline std::vector<Eigen::Vector3d> slow_corrected_nodes(const Model& model, const Pose& pose,
                                                         const std::vector<RigidTransform>& segments) {
  std::vector<Eigen::Vector3d> out = reference_nodes(model, segments, runtime::Skinning::cor, 1e-4);
  std::vector<std::vector<Eigen::Vector3d>> moved(out.size());
  for (const JointCorrection& c : model.corrections) {
    const auto joint = static_cast<std::size_t>(c.joint);
    const Eigen::RowVector3d turn = slow_turn(pose.rotation[joint]);
    const Eigen::VectorXd shares = model.rig.skeleton.segments[joint].joint.kind == JointKind::hinge
                                       ? slow_shares_of_hinge(c, turn)
                                       : slow_shares_of_ball(c, turn);
    for (std::size_t row = 0; row < c.node.size(); ++row) {
      Eigen::Vector3d u = Eigen::Vector3d::Zero();
      for (std::size_t m = 0; m < c.scale.size(); ++m) {
        const double mode = shares.dot(c.mix.col(static_cast<Eigen::Index>(m)).cast<double>()) * c.scale[m];
        for (std::size_t k = 0; k < 3; ++k)
          u[static_cast<Eigen::Index>(k)] += mode * c.field[3 * (m * c.node.size() + row) + k];
      }
      moved[c.node[row]].push_back(slow_frame(model, c.node[row], segments) * u);
    }
  }
  for (std::size_t n = 0; n < out.size(); ++n) out[n] += slow_together(moved[n]);
  for (const PoseCorrection& c : model.pose_corrections) {
    double squared = 0;
    for (std::size_t j = 0; j < c.joint.size(); ++j) {
      const Eigen::Vector3d turn = c.turn.row(static_cast<Eigen::Index>(j)).transpose();
      const Eigen::AngleAxisd there(turn.norm(), turn.normalized());
      squared += std::pow(
          Eigen::Quaterniond(there).angularDistance(pose.rotation[static_cast<std::size_t>(c.joint[j])]), 2);
    }
    const double share = squared < c.reach * c.reach ? std::pow(1 - squared / (c.reach * c.reach), 2) : 0;
    for (std::size_t row = 0; row < c.node.size(); ++row) {
      const Eigen::Vector3d u =
          share * c.scale *
          Eigen::Map<const Eigen::Matrix<std::int16_t, 3, 1>>(&c.field[3 * row]).cast<double>();
      out[c.node[row]] += slow_frame(model, c.node[row], segments) * u;
    }
  }
  return out;
}

}  // namespace ecorche::test
