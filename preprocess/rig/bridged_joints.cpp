// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/bridged_joints.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace ecorche::rig {
namespace {

constexpr double kNearOwn = 0.1;        // of the bones' length, as check::Place has it
constexpr double kEndShare = 0.03;      // of the bones' length: what is an end
constexpr double kLongBone = 2.5;       // times as long as wide
constexpr double kFewestVertices = 12;  // vertices of bones that say anything

// The parent that the whole skeleton gives it has no bone here.
bool bridged(const Case& patient, const Skeleton& asked, std::size_t row, JointSources& sources) {
  const Segment& own = asked.segments[row];
  if (own.parent < 0) return false;
  const Segment& parent = asked.segments[static_cast<std::size_t>(own.parent)];
  if (sources.bones(parent.name).V.rows() == 0) return false;  // it joins nothing
  const int at = patient.skeleton.find_segment(own.name);
  if (at < 0) return false;
  const int whole = patient.skeleton.segments[static_cast<std::size_t>(at)].parent;
  return whole >= 0 && patient.skeleton.segments[static_cast<std::size_t>(whole)].name != parent.name;
}

bool is_long(const Points& V) {
  Eigen::RowVector3d size = V.colwise().maxCoeff() - V.colwise().minCoeff();
  std::sort(size.data(), size.data() + 3);
  return size[2] > kLongBone * size[1];
}

// Of every vertex, its distance to the nearest of `others`.
Eigen::VectorXd distances_to(const Points& V, const Points& others) {
  Eigen::VectorXd out(V.rows());
  const Eigen::Index step = std::max<Eigen::Index>(1, others.rows() / 500);
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index o = 0; o < others.rows(); o += step)
      least = std::min(least, (V.row(v) - others.row(o)).squaredNorm());
    out[v] = std::sqrt(least);
  }
  return out;
}

// The mean of the vertices that `order` puts first, within `reach`. Nothing says that a joint is there.
FoundPoint end_of(const Points& V, const Eigen::VectorXd& order, double reach) {
  const double first = order.minCoeff();
  std::vector<Eigen::Index> rows;
  for (Eigen::Index v = 0; v < V.rows(); ++v) {
    if (order[v] <= first + reach) rows.push_back(v);
  }
  FoundPoint out;
  for (const Eigen::Index v : rows) out.at += V.row(v).transpose() / static_cast<double>(rows.size());
  double squared = 0;
  for (const Eigen::Index v : rows) squared += (V.row(v).transpose() - out.at).squaredNorm();
  out.fit.rule = CenterRule::centroid;
  out.fit.points = static_cast<std::int32_t>(rows.size());
  out.fit.residual_mm = std::sqrt(squared / static_cast<double>(rows.size()));
  out.fit.confidence = 0;
  return out;
}

bool says_center(const Joint& joint) {
  return (joint.how ? joint.how->center.rule : joint.rule) == CenterRule::given;
}

}  // namespace

void keep_bridged_near(const Case& patient, const Skeleton& asked, JointSources& sources) {
  for (std::size_t row = 0; row < asked.segments.size(); ++row) {
    if (says_center(asked.segments[row].joint) || !bridged(patient, asked, row, sources)) continue;
    const Points& V = sources.bones(asked.segments[row].name).V;
    if (V.rows() < kFewestVertices) continue;
    const double length = (V.colwise().maxCoeff() - V.colwise().minCoeff()).maxCoeff();
    const FoundPoint found = sources.center(row);
    const double away = std::sqrt((V.rowwise() - found.at.transpose()).rowwise().squaredNorm().minCoeff());
    if (away <= kNearOwn * length) continue;
    const Segment* child = nullptr;
    for (const Segment& segment : asked.segments) {
      if (segment.parent == static_cast<int>(row) && child == nullptr) child = &segment;
    }
    const Points* below = child == nullptr ? nullptr : &sources.bones(child->name).V;
    const bool away_from_child = below != nullptr && below->rows() > 0 && is_long(V);
    const auto parent = static_cast<std::size_t>(asked.segments[row].parent);
    const Eigen::VectorXd order = away_from_child
                                      ? Eigen::VectorXd(-distances_to(V, *below))
                                      : distances_to(V, sources.bones(asked.segments[parent].name).V);
    sources.settle(row, end_of(V, order, kEndShare * length));
  }
}

}  // namespace ecorche::rig
