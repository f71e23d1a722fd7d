// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/pose_places.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <ecorche/kinematics/forward.hpp>
#include "preprocess/correct/samples.hpp"
#include "preprocess/correct/skinned_node.hpp"

namespace ecorche::correct {
namespace {

constexpr std::int32_t kNoPlace = -1;
constexpr double kLeastWeight = 0.02;  // of a segment that moves a node
constexpr float kLargest = 32767;

using Joints = std::vector<std::int32_t>;

// #nodes by 3, mm, in the frames that skinning turns.
Points left_of(const Model& model, const Pose& pose, std::span<const float> skinned,
               std::span<const float> settled) {
  Pose still = pose;
  still.rotation[0].setIdentity();
  still.root_translation.setZero();
  const std::vector<RigidTransform> segments = kinematics::forward(model.rig, still);
  Points out = Points::Zero(static_cast<Eigen::Index>(model.node_count()), 3);
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    const auto at = [&](std::span<const float> nodes) -> Eigen::Vector3d {
      return Eigen::Map<const Eigen::Vector3f>(&nodes[3 * n]).cast<double>();
    };
    const Eigen::Vector3d moved = at(settled) - at(skinned);
    if (moved.isZero(0)) continue;
    out.row(static_cast<Eigen::Index>(n)) =
        (skin_node(model, n, segments).turn.conjugate() * moved).transpose();
  }
  return out;
}

// Of each node: its place, or none. Places are what hangs together of nodes that move by more than core_mm,
// and what hangs on them of those that move by more than least_mm.
std::vector<std::int32_t> places_of(const Model& model, const Points& left, const PlaceOptions& options) {
  const Eigen::VectorXd far = left.rowwise().norm();
  std::vector<std::int32_t> place(model.node_count(), kNoPlace);
  for (std::size_t n = 0; n < place.size(); ++n)
    if (far[static_cast<Eigen::Index>(n)] > options.core_mm) place[n] = static_cast<std::int32_t>(n);
  // The least of a tet's places goes to its corners until nothing changes: first among cores, then beyond.
  const auto spread = [&](bool cores) {
    for (bool changed = true; changed;) {
      changed = false;
      for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
        std::int32_t least = kNoPlace;
        for (Eigen::Index c = 0; c < 4; ++c) {
          const std::int32_t own = place[static_cast<std::size_t>(model.tets(t, c))];
          if (own != kNoPlace && (least == kNoPlace || own < least)) least = own;
        }
        for (Eigen::Index c = 0; c < 4 && least != kNoPlace; ++c) {
          std::int32_t& own = place[static_cast<std::size_t>(model.tets(t, c))];
          const bool takes =
              cores ? own > least : own == kNoPlace && far[model.tets(t, c)] > options.least_mm;
          if (!takes) continue;
          own = least;
          changed = true;
        }
      }
    }
  };
  spread(true);
  spread(false);
  return place;
}

// Those between the segments that move a place: of each segment below which some of them are, but not all.
Joints joints_between(const Skeleton& skeleton, const std::set<std::size_t>& segments) {
  std::vector<std::size_t> below(skeleton.segments.size(), 0);
  for (std::size_t s : segments)
    for (std::int32_t at = static_cast<std::int32_t>(s); at >= 0;
         at = skeleton.segments[static_cast<std::size_t>(at)].parent)
      ++below[static_cast<std::size_t>(at)];
  Joints out;
  for (std::size_t s = 1; s < below.size(); ++s)
    if (below[s] > 0 && below[s] < segments.size() && skeleton.segments[s].joint.kind != JointKind::fixed)
      out.push_back(static_cast<std::int32_t>(s));
  return out;
}

JointCorrection::Turns turns_of(const Pose& pose, const Joints& joints) {
  JointCorrection::Turns out(static_cast<Eigen::Index>(joints.size()), 3);
  for (std::size_t j = 0; j < joints.size(); ++j)
    out.row(static_cast<Eigen::Index>(j)) =
        rotation_vector(pose.rotation[static_cast<std::size_t>(joints[j])]);
  return out;
}

double distance(const Pose& a, const Pose& b, const Joints& joints) {
  double squared = 0;
  for (const std::int32_t joint : joints) {
    const auto j = static_cast<std::size_t>(joint);
    squared += std::pow(a.rotation[j].angularDistance(b.rotation[j]), 2);
  }
  return std::sqrt(squared);
}

using ByJoints = std::map<Joints, std::vector<std::uint32_t>>;

// A few nodes go to the place of fewest joints that has all of theirs.
ByJoints gathered(ByJoints all, std::size_t few) {
  ByJoints out;
  std::erase_if(all, [&](auto& place) {
    if (place.second.size() < few) return false;
    out.insert(place);
    return true;
  });
  for (auto& [joints, nodes] : all) {
    const auto has_all = [&, own = std::cref(joints)](const auto& place) {
      return std::includes(place.first.begin(), place.first.end(), own.get().begin(), own.get().end());
    };
    auto best = out.end();
    for (auto at = out.begin(); at != out.end(); ++at)
      if (has_all(*at) && (best == out.end() || at->first.size() < best->first.size())) best = at;
    if (best == out.end()) best = out.emplace(joints, std::vector<std::uint32_t>()).first;
    best->second.insert(best->second.end(), nodes.begin(), nodes.end());
  }
  for (auto& [joints, nodes] : out) std::sort(nodes.begin(), nodes.end());
  return out;
}

// Nodes by the joints about their places, ascending.
ByJoints by_joints(const Model& model, const Points& left, const PlaceOptions& options) {
  const std::vector<std::int32_t> place = places_of(model, left, options);
  std::map<std::int32_t, std::set<std::size_t>> segments;
  for (std::size_t n = 0; n < place.size(); ++n) {
    if (place[n] == kNoPlace || !(left.row(static_cast<Eigen::Index>(n)).norm() > options.core_mm)) continue;
    for (std::uint64_t w = model.weights.offsets[n]; w < model.weights.offsets[n + 1]; ++w)
      if (static_cast<double>(model.weights.weight[w]) > kLeastWeight)
        segments[place[n]].insert(model.weights.segment[w]);
  }
  std::map<std::int32_t, Joints> about;
  for (const auto& [row, moving] : segments) about[row] = joints_between(model.rig.skeleton, moving);
  ByJoints out;
  for (std::size_t n = 0; n < place.size(); ++n)
    if (place[n] != kNoPlace) out[about[place[n]]].push_back(static_cast<std::uint32_t>(n));
  return gathered(std::move(out), options.few);
}

}  // namespace

std::vector<PoseCorrection> pose_places(const Model& model, const WholePose& whole,
                                        std::span<const WholePose> others, std::span<const float> skinned,
                                        std::span<const float> settled, const PlaceOptions& options) {
  const Points left = left_of(model, whole.pose, skinned, settled);
  const Pose rest = Pose::rest(whole.pose.rotation.size());
  std::vector<PoseCorrection> out;
  for (const auto& [joints, nodes] : by_joints(model, left, options)) {
    PoseCorrection made{whole.name, joints, turns_of(whole.pose, joints), 0, 0, nodes, {}};
    made.reach = std::min(options.reach, made.turn.norm());
    if (joints.empty() || distance(whole.pose, rest, joints) < options.alike) continue;
    for (const WholePose& other : others)
      if (const double far = distance(whole.pose, other.pose, joints); far >= options.alike)
        made.reach = std::min(made.reach, far);
    float most = 0;
    for (const std::uint32_t n : nodes)
      most = std::max(most, static_cast<float>(left.row(static_cast<Eigen::Index>(n)).cwiseAbs().maxCoeff()));
    made.scale = most / kLargest;
    for (const std::uint32_t n : nodes)
      for (Eigen::Index c = 0; c < 3; ++c)
        made.field.push_back(static_cast<std::int16_t>(
            std::lround(left(static_cast<Eigen::Index>(n), c) / static_cast<double>(made.scale))));
    out.push_back(std::move(made));
  }
  return out;
}

}  // namespace ecorche::correct
