// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/corrections.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace ecorche::runtime {
namespace {

// Poses are weighed without allocating.
constexpr std::size_t kMostSamples = SampleShares::most_samples;

Eigen::RowVector3d rotation_vector(const Eigen::Quaterniond& turn) {
  const double sine = turn.vec().norm();
  if (!(sine > 0)) return Eigen::RowVector3d::Zero();
  const double sign = turn.w() < 0 ? -1 : 1;
  return (sign * 2 * std::atan2(sine, std::abs(turn.w())) / sine) * turn.vec().transpose();
}

double multiquadric(const Eigen::RowVector3d& a, const Eigen::RowVector3d& b) {
  return std::sqrt(1 + (a - b).squaredNorm());
}

}  // namespace

SampleShares::SampleShares(const JointCorrection& correction, JointKind kind)
    : turn_(correction.turn), line_(kind == JointKind::hinge) {
  const Eigen::Index count = turn_.rows();
  if (line_) {
    along_ = turn_.row(0).normalized();
    knot_.emplace_back(0, samples());
    for (Eigen::Index s = 0; s < count; ++s)
      knot_.emplace_back(turn_.row(s).dot(along_), static_cast<std::size_t>(s));
    std::sort(knot_.begin(), knot_.end());
    return;
  }
  low_ = turn_.colwise().minCoeff().cwiseMin(0);
  high_ = turn_.colwise().maxCoeff().cwiseMax(0);
  JointCorrection::Turns centres(count + 1, 3);
  centres << turn_, Eigen::RowVector3d::Zero();
  Eigen::MatrixXd kernel(count + 1, count + 1);
  for (Eigen::Index a = 0; a <= count; ++a)
    for (Eigen::Index b = 0; b <= count; ++b) kernel(a, b) = multiquadric(centres.row(a), centres.row(b));
  cardinal_ = kernel.fullPivLu().inverse().topRows(count);
  at_rest_ = Eigen::VectorXd::Zero(count);
  std::vector<double> rest(samples());
  radial(Eigen::RowVector3d::Zero(), rest);
  at_rest_ = Eigen::Map<const Eigen::VectorXd>(rest.data(), count);
}

void SampleShares::at(const Eigen::Quaterniond& turn, std::span<double> out) const {
  const Eigen::RowVector3d place = rotation_vector(turn);
  if (line_) {
    on_line(place.dot(along_), out);
  } else {
    radial(place.cwiseMax(low_).cwiseMin(high_), out);
  }
}

void SampleShares::on_line(double place, std::span<double> out) const {
  std::fill(out.begin(), out.end(), 0.0);
  const auto give = [&](std::size_t sample, double share) {
    if (sample < out.size()) out[sample] = share;  // rest has no field
  };
  const auto above = std::lower_bound(knot_.begin(), knot_.end(), place,
                                      [](const auto& knot, double value) { return knot.first < value; });
  if (above == knot_.end()) return give(knot_.back().second, 1);
  if (above == knot_.begin() || above->first == place) return give(above->second, 1);
  const auto below = above - 1;
  const double part = (place - below->first) / (above->first - below->first);
  give(below->second, 1 - part);
  give(above->second, part);
}

void SampleShares::radial(const Eigen::RowVector3d& place, std::span<double> out) const {
  const Eigen::Index count = turn_.rows();
  std::array<double, kMostSamples + 1> value;
  for (Eigen::Index s = 0; s < count; ++s)
    value[static_cast<std::size_t>(s)] = multiquadric(place, turn_.row(s));
  value[samples()] = multiquadric(place, Eigen::RowVector3d::Zero());
  for (Eigen::Index s = 0; s < count; ++s) {
    double sum = 0;
    for (Eigen::Index b = 0; b <= count; ++b) sum += cardinal_(s, b) * value[static_cast<std::size_t>(b)];
    out[static_cast<std::size_t>(s)] = sum - at_rest_[s];
  }
}

Nearness::Nearness(const PoseCorrection& correction) : reach_(correction.reach) {
  for (std::size_t j = 0; j < correction.joint.size(); ++j) {
    const Eigen::RowVector3d turn = correction.turn.row(static_cast<Eigen::Index>(j));
    joints_.push_back(
        {static_cast<std::size_t>(correction.joint[j]),
         Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.stableNormalized().transpose()))});
  }
}

double Nearness::at(const Pose& pose) const {
  double squared = 0;
  for (const Turned& one : joints_)
    squared += rotation_vector(one.turn.conjugate() * pose.rotation[one.joint]).squaredNorm();
  const double left = 1 - squared / (reach_ * reach_);
  return left > 0 ? left * left : 0;
}

Corrections::Corrections(const Model& model, const NodeClusters& clusters) {
  OfCluster joints(clusters.clusters()), poses(clusters.clusters());
  for (const JointCorrection& correction : model.corrections) {
    const auto joint = static_cast<std::size_t>(correction.joint);
    joints_.push_back({joint, SampleShares(correction, model.rig.skeleton.segments[joint].joint.kind),
                       correction.mix, correction.scale});
    add(clusters, correction.node, correction.field, joints);
  }
  for (const PoseCorrection& correction : model.pose_corrections) {
    poses_.push_back({Nearness(correction), correction.scale});
    add(clusters, correction.node, correction.field, poses);
  }
  for (std::size_t c = 0; c <= clusters.clusters(); ++c) {
    const auto first = static_cast<std::uint32_t>(parts_.size());
    if (c < clusters.clusters()) parts_.insert(parts_.end(), joints[c].begin(), joints[c].end());
    begin_.push_back({first, static_cast<std::uint32_t>(parts_.size())});
    if (c < clusters.clusters()) parts_.insert(parts_.end(), poses[c].begin(), poses[c].end());
  }
}

void Corrections::add(const NodeClusters& clusters, std::span<const std::uint32_t> node,
                      std::span<const std::int16_t> field, OfCluster& out) {
  const std::size_t rows = node.size(), modes = rows == 0 ? 0 : field.size() / (3 * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t lane = clusters.lane[node[row]], cluster = lane / NodeClusters::size;
    std::vector<Part>& parts = out[cluster];
    if (parts.empty() || parts.back().first != modes_) {
      parts.push_back({static_cast<std::uint32_t>(modes_), static_cast<std::uint32_t>(modes), field_.size()});
      field_.resize(field_.size() + 3 * NodeClusters::size * modes);
    }
    for (std::size_t m = 0; m < modes; ++m)
      for (std::size_t c = 0; c < 3; ++c)
        field_[parts.back().field + NodeClusters::size * (3 * m + c) + lane % NodeClusters::size] =
            field[3 * (rows * m + row) + c];
  }
  modes_ += modes;
}

void Corrections::weigh(const Pose& pose, std::span<float> modes) const {
  std::array<double, kMostSamples> shares;
  std::size_t next = 0;
  for (const OfJoint& joint : joints_) {
    const std::span<double> of_samples = std::span(shares).first(joint.shares.samples());
    joint.shares.at(pose.rotation[joint.joint], of_samples);
    for (std::size_t m = 0; m < joint.scale.size(); ++m) {
      double sum = 0;
      for (std::size_t s = 0; s < of_samples.size(); ++s)
        sum += of_samples[s] *
               static_cast<double>(joint.mix(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(m)));
      modes[next++] = static_cast<float>(sum * static_cast<double>(joint.scale[m]));
    }
  }
  for (const OfPose& one : poses_)
    modes[next++] = static_cast<float>(one.nearness.at(pose) * static_cast<double>(one.scale));
}

bool Corrections::moves(std::size_t cluster, std::span<const float> modes) const {
  const auto first = parts_.begin() + begin_[cluster].joints,
             end = parts_.begin() + begin_[cluster + 1].joints;
  return std::any_of(first, end, [&](const Part& part) {
    const auto of_part = modes.subspan(part.first, part.modes);
    return std::any_of(of_part.begin(), of_part.end(), [](float mode) { return mode != 0; });
  });
}

}  // namespace ecorche::runtime
