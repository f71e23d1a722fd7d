// SPDX-License-Identifier: Apache-2.0
// The corrections of a model (values/correction.hpp) as the kernels read them, and how much of each field a
// pose takes.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/aligned.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/pose.hpp>
#include "runtime/skin/node_clusters.hpp"

namespace ecorche::runtime {

/// Shares of a joint's samples at a turn of it. Of a hinge: linear between its samples and rest, the last
/// sample's beyond it. Of other joints: Hardy71's multiquadric sqrt(1 + r^2) over the rotation vectors, rest
/// among them; beyond the box about the samples, as at its border. Exactly zero at rest.
class SampleShares {
 public:
  static constexpr std::size_t most_samples = 256;
  /// Of 1 to most_samples samples.
  SampleShares(const JointCorrection& correction, JointKind kind);

  /// #samples, of a unit quaternion of the joint.
  void at(const Eigen::Quaterniond& turn, std::span<double> out) const;
  std::size_t samples() const { return static_cast<std::size_t>(turn_.rows()); }

 private:
  void on_line(double place, std::span<double> out) const;
  void radial(const Eigen::RowVector3d& place, std::span<double> out) const;

  JointCorrection::Turns turn_;
  bool line_ = false;
  Eigen::RowVector3d along_;                          // of a line
  std::vector<std::pair<double, std::size_t>> knot_;  // of a line, ascending: place, sample; rest is #samples
  Eigen::RowVector3d low_, high_;                     // of the box
  Eigen::MatrixXd cardinal_;                          // #samples by #samples + 1, rest last
  Eigen::VectorXd at_rest_;                           // #samples
};

/// How near a pose is to that of a PoseCorrection.
class Nearness {
 public:
  explicit Nearness(const PoseCorrection& correction);

  /// 1 at its own pose, falling to 0 at its reach.
  double at(const Pose& pose) const;

 private:
  struct Turned {
    std::size_t joint;
    Eigen::Quaterniond turn;
  };
  std::vector<Turned> joints_;
  double reach_;
};

class Corrections {
 public:
  /// What one joint, or one pose, adds to one cluster: `modes` fields of 64 x, 64 y, 64 z from `field` on.
  struct Part {
    std::uint32_t first, modes;  // of weigh's
    std::size_t field;
  };

  Corrections() = default;
  /// `model` has been checked (model_file's invariants).
  Corrections(const Model& model, const NodeClusters& clusters);

  /// Fields of all joints and poses together.
  std::size_t modes() const { return modes_; }
  /// How much of each field, in mm a step; all 0 at rest. `modes`: modes().
  void weigh(const Pose& pose, std::span<float> modes) const;

  std::span<const Part> of_joints(std::size_t cluster) const {
    return std::span(parts_).subspan(begin_[cluster].joints, begin_[cluster].poses - begin_[cluster].joints);
  }
  std::span<const Part> of_poses(std::size_t cluster) const {
    return std::span(parts_).subspan(begin_[cluster].poses,
                                     begin_[cluster + 1].joints - begin_[cluster].poses);
  }
  /// Whether `modes` moves anything of the cluster.
  bool moves(std::size_t cluster, std::span<const float> modes) const;
  const std::int16_t* field(const Part& part) const { return &field_[part.field]; }
  std::span<const std::int16_t> fields() const { return field_; }

 private:
  struct OfJoint {
    std::size_t joint;
    SampleShares shares;
    JointCorrection::Mix mix;
    std::vector<float> scale;
  };

  struct OfPose {
    Nearness nearness;
    float scale;
  };
  // Into parts_.
  struct Begin {
    std::uint32_t joints, poses;
  };
  using OfCluster = std::vector<std::vector<Part>>;

  void add(const NodeClusters& clusters, std::span<const std::uint32_t> node,
           std::span<const std::int16_t> field, OfCluster& out);

  std::size_t modes_ = 0;
  std::vector<OfJoint> joints_;
  std::vector<OfPose> poses_;
  std::vector<Begin> begin_;  // #clusters + 1
  std::vector<Part> parts_;
  Aligned<std::int16_t> field_;
};

}  // namespace ecorche::runtime
