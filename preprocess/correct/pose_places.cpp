// SPDX-License-Identifier: Apache-2.0
#include "preprocess/correct/pose_places.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include <ecorche/kinematics/forward.hpp>
#include "preprocess/correct/compress.hpp"
#include "preprocess/correct/samples.hpp"
#include "preprocess/correct/skinned_node.hpp"

namespace ecorche::correct {
namespace {

constexpr std::int32_t kNoPlace = -1;
constexpr double kLeastWeight = 0.02;  // of a segment that moves a node

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

// Sets of nodes; a set is named by one of its nodes.
class Sets {
 public:
  explicit Sets(std::size_t nodes) : parent_(nodes) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::int32_t of(std::int32_t node) {
    while (parent(node) != node) node = parent(node) = parent(parent(node));
    return node;
  }
  void join(std::int32_t a, std::int32_t b) { parent(of(a)) = of(b); }

 private:
  std::int32_t& parent(std::int32_t node) { return parent_[static_cast<std::size_t>(node)]; }
  std::vector<std::int32_t> parent_;
};

// Of each node: its place, or none. Places are what hangs together of nodes that move by more than core_mm,
// and what hangs on them of those that move by more than least_mm.
std::vector<std::int32_t> places_of(const Model& model, const Points& left, const PlaceOptions& options) {
  const Eigen::VectorXd far = left.rowwise().norm();
  const auto core = [&](std::int32_t node) { return far[node] > options.core_mm; };
  Sets sets(model.node_count());
  for (Eigen::Index t = 0; t < model.tets.rows(); ++t)
    for (Eigen::Index c = 1; c < 4; ++c)
      for (Eigen::Index before = 0; before < c; ++before)
        if (core(model.tets(t, c)) && core(model.tets(t, before)))
          sets.join(model.tets(t, c), model.tets(t, before));
  std::vector<std::int32_t> place(model.node_count(), kNoPlace);
  for (std::int32_t n = 0; n < static_cast<std::int32_t>(place.size()); ++n)
    if (core(n)) place[static_cast<std::size_t>(n)] = sets.of(n);
  // A layer of tets at a time.
  for (bool grows = true; grows;) {
    grows = false;
    const std::vector<std::int32_t> before = place;
    for (Eigen::Index t = 0; t < model.tets.rows(); ++t) {
      std::int32_t beside = kNoPlace;
      for (Eigen::Index c = 0; c < 4; ++c)
        beside = std::max(beside, before[static_cast<std::size_t>(model.tets(t, c))]);
      for (Eigen::Index c = 0; c < 4 && beside != kNoPlace; ++c) {
        std::int32_t& own = place[static_cast<std::size_t>(model.tets(t, c))];
        if (own != kNoPlace || !(far[model.tets(t, c)] > options.least_mm)) continue;
        own = beside;
        grows = true;
      }
    }
  }
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
ByJoints gathered(const ByJoints& all, std::size_t few) {
  ByJoints out;
  for (const auto& [joints, nodes] : all)
    if (nodes.size() >= few) out[joints] = nodes;
  for (const auto& [joints, nodes] : all) {
    if (nodes.size() >= few) continue;
    const Joints* best = &joints;
    for (const auto& [others, theirs] : out) {
      const bool has_all = std::includes(others.begin(), others.end(), joints.begin(), joints.end());
      if (has_all && (best == &joints || others.size() < best->size())) best = &others;
    }
    std::vector<std::uint32_t>& into = out[*best];
    into.insert(into.end(), nodes.begin(), nodes.end());
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
  return gathered(out, options.few);
}

}  // namespace

std::vector<PoseCorrection> pose_places(const Model& model, const WholePose& whole,
                                        std::span<const WholePose> all, std::span<const float> skinned,
                                        std::span<const float> settled, const PlaceOptions& options) {
  const Points left = left_of(model, whole.pose, skinned, settled);
  const Pose rest = Pose::rest(whole.pose.rotation.size());
  std::vector<PoseCorrection> out;
  for (const auto& [joints, nodes] : by_joints(model, left, options)) {
    PoseCorrection made{whole.name, joints, turns_of(whole.pose, joints), 0, 0, nodes, {}};
    made.reach = std::min(options.reach, made.turn.norm());
    if (joints.empty() || distance(whole.pose, rest, joints) < options.alike) continue;
    for (const WholePose& other : all)
      if (const double far = distance(whole.pose, other.pose, joints); far >= options.alike)
        made.reach = std::min(made.reach, far);
    std::vector<float> moved;
    moved.reserve(3 * nodes.size());
    for (const std::uint32_t n : nodes)
      for (Eigen::Index c = 0; c < 3; ++c)
        moved.push_back(static_cast<float>(left(static_cast<Eigen::Index>(n), c)));
    made.scale = quantise(moved, options.rounding_mm, made.field);
    out.push_back(std::move(made));
  }
  return out;
}

}  // namespace ecorche::correct
