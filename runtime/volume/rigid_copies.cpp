// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/rigid_copies.hpp>

#include <algorithm>
#include <map>
#include <utility>

#include "core/linear/decompositions.hpp"

namespace ecorche::runtime {
namespace {

// Nodes that tell a segment's motion: their rounding, 6e-5 mm at a metre, is halved by as many.
constexpr std::size_t kTold = 64;

Eigen::Vector3d point(std::span<const float> points, std::size_t row) {
  return {static_cast<double>(points[3 * row]), static_cast<double>(points[3 * row + 1]),
          static_cast<double>(points[3 * row + 2])};
}

// Some of `nodes` (ascending): the farthest along each axis, and others that follow each other evenly.
std::vector<std::int32_t> spread(const std::vector<std::int32_t>& nodes, const PointsF& rest) {
  std::vector<std::int32_t> out;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto before = [&](std::int32_t a, std::int32_t b) { return rest(a, axis) < rest(b, axis); };
    const auto [low, high] = std::minmax_element(nodes.begin(), nodes.end(), before);
    out.push_back(*low);
    out.push_back(*high);
  }
  const std::size_t step = std::max<std::size_t>(1, nodes.size() / kTold);
  for (std::size_t i = 0; i < nodes.size(); i += step) out.push_back(nodes[i]);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace

RigidCopies::RigidCopies(const Model& model, std::span<const std::uint32_t> given)
    : RigidCopies(model.tets, model.nodes, model.tet_label, model.contested, model.bone_segment, given) {}

RigidCopies::RigidCopies(const Tets& tets, const PointsF& rest, std::span<const std::uint16_t> label,
                         std::span<const std::uint16_t> contested, std::span<const std::int32_t> segment,
                         std::span<const std::uint32_t> given) {
  if (contested.empty()) return;
  first_ = static_cast<std::size_t>(std::find(label.begin(), label.end(), TetMesh::soft) - label.begin());
  const auto segment_of = [&](std::uint16_t of) { return segment[of - 1U]; };
  // By segment: the nodes of its bones' tets, and those to be copied.
  std::map<std::int32_t, std::vector<std::int32_t>> own, copied;
  for (const std::uint16_t of : contested) own[segment_of(of)];
  for (std::size_t t = 0; t < first_; ++t) {
    const auto at = own.find(segment_of(label[t]));
    if (at == own.end()) continue;
    for (Eigen::Index c = 0; c < 4; ++c) at->second.push_back(tets(static_cast<Eigen::Index>(t), c));
  }
  const auto sort_once = [](std::vector<std::int32_t>& nodes) {
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  };
  for (auto& [of, nodes] : own) sort_once(nodes);
  for (std::size_t t = 0; t < contested.size(); ++t) {
    const std::int32_t of = segment_of(contested[t]);
    if (own.at(of).empty()) continue;
    copied_.push_back(static_cast<std::uint32_t>(first_ + t));
    label_.push_back(contested[t]);
    for (Eigen::Index c = 0; c < 4; ++c) copied[of].push_back(tets(static_cast<Eigen::Index>(first_ + t), c));
  }
  std::map<std::int32_t, std::size_t> follower;  // by segment
  for (auto& [of, nodes] : copied) {
    sort_once(nodes);
    Follower next;
    const std::vector<std::int32_t> told = spread(own.at(of), rest);
    next.told.resize(3, static_cast<Eigen::Index>(told.size()));
    for (std::size_t i = 0; i < told.size(); ++i) {
      const auto node = static_cast<std::size_t>(told[i]);
      next.row.push_back(given.empty() ? static_cast<std::uint32_t>(node) : given[node]);
      next.told.col(static_cast<Eigen::Index>(i)) = rest.row(told[i]).transpose().cast<double>();
    }
    next.middle = next.told.rowwise().mean();
    next.begin = rest_.size() / 3;
    for (const std::int32_t node : nodes)
      for (Eigen::Index axis = 0; axis < 3; ++axis) rest_.push_back(rest(node, axis));
    next.end = rest_.size() / 3;
    follower.emplace(of, followers_.size());
    followers_.push_back(std::move(next));
  }
  corners_.resize(static_cast<Eigen::Index>(copied_.size()), 4);
  for (std::size_t t = 0; t < copied_.size(); ++t) {
    const std::int32_t of = segment_of(label_[t]);
    const std::vector<std::int32_t>& nodes = copied.at(of);
    const std::size_t begin = followers_[follower.at(of)].begin;
    for (Eigen::Index c = 0; c < 4; ++c) {
      const auto at =
          std::lower_bound(nodes.begin(), nodes.end(), tets(static_cast<Eigen::Index>(copied_[t]), c));
      corners_(static_cast<Eigen::Index>(t), c) =
          static_cast<std::int32_t>(begin + static_cast<std::size_t>(at - nodes.begin()));
    }
  }
}

void RigidCopies::place(std::span<const float> nodes, std::span<float> out) const {
  for (const Follower& follower : followers_) place(follower, nodes, out);
}

void RigidCopies::place(const Follower& follower, std::span<const float> nodes, std::span<float> out) const {
  // Twice over the few nodes instead of a matrix of them: nothing is allocated.
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::uint32_t row : follower.row) middle += point(nodes, row);
  middle /= static_cast<double>(follower.row.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  bool moved = false;
  for (std::size_t i = 0; i < follower.row.size(); ++i) {
    const Eigen::Vector3d at = point(nodes, follower.row[i]);
    const Eigen::Vector3d was = follower.told.col(static_cast<Eigen::Index>(i)) - follower.middle;
    moved = moved || at != follower.told.col(static_cast<Eigen::Index>(i));
    covariance += (at - middle) * was.transpose();
  }
  const auto copy = [&](std::size_t from, std::size_t to) {
    std::copy(rest_.begin() + static_cast<std::ptrdiff_t>(3 * from),
              rest_.begin() + static_cast<std::ptrdiff_t>(3 * to),
              out.begin() + static_cast<std::ptrdiff_t>(3 * from));
  };
  if (!moved) return copy(follower.begin, follower.end);
  if (!covariance.allFinite()) covariance.setZero();  // the middle is no number then, nor is what comes of it
  const Eigen::Matrix3d turn = linear::nearest_turn(covariance);
  for (std::size_t n = follower.begin; n < follower.end; ++n) {
    const Eigen::Vector3d at = turn * (point(rest_, n) - follower.middle) + middle;
    for (std::size_t a = 0; a < 3; ++a) out[3 * n + a] = static_cast<float>(at[static_cast<Eigen::Index>(a)]);
  }
}

DrawnBody drawn_body(const Tets& tets, std::span<const float> rest, std::span<const float> posed,
                     const RigidCopies& copies) {
  const DrawnTets drawn(tets, copies, static_cast<std::int32_t>(rest.size() / 3));
  DrawnBody out;
  out.tets.resize(drawn.rows(), 4);
  for (Eigen::Index t = 0; t < drawn.rows(); ++t)
    for (Eigen::Index c = 0; c < 4; ++c) out.tets(t, c) = drawn(t, c);
  out.rest.assign(rest.begin(), rest.end());
  out.rest.insert(out.rest.end(), copies.rest().begin(), copies.rest().end());
  out.posed.assign(posed.begin(), posed.end());
  out.posed.resize(out.rest.size());
  copies.place(posed, std::span(out.posed).subspan(posed.size()));
  return out;
}

}  // namespace ecorche::runtime
