// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/plausible.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "core/values/degrees.hpp"

namespace ecorche::rig {
namespace {

using Kind = DirectionSource::Kind;

constexpr double kNearOwnBones = 0.12, kHalfOff = 0.08;  // of the size of the segment's bones
constexpr double kUsualSlope = 8, kHalfTilt = 8;         // degrees
constexpr double kToldBelow = 0.5;
// A point of less confidence does not say how the body lies; the neck's, at the end of a long trunk, may be
// off by more.
constexpr double kBelieved = 0.5, kNeckBelieved = 0.2;

double falling(double beyond, double half) {
  return beyond <= 0 ? 1 : 1 / (1 + (beyond / half) * (beyond / half));
}

// Whether `source` looks along the scan's axes.
bool looks(const PointSource& source) {
  if (source.on.looks.squaredNorm() > 0) return true;
  return std::any_of(source.parts.begin(), source.parts.end(), looks);
}

bool by_scan(const Skeleton& skeleton, const DirectionSource& source, int axis, int depth);

// Whether one axis of a joint is that of the scan, or was found along it.
bool axis_by_scan(const Skeleton& skeleton, int row, int axis, int depth) {
  const Joint& joint = skeleton.segments[static_cast<std::size_t>(row)].joint;
  if (!joint.how || joint.how->axes.empty()) return true;
  for (const auto& [own, source] : joint.how->axes) {
    if (own == axis) return by_scan(skeleton, source, axis, depth);
  }
  return std::any_of(joint.how->axes.begin(), joint.how->axes.end(),
                     [&](const auto& one) { return by_scan(skeleton, one.second, one.first, depth); });
}

bool by_scan(const Skeleton& skeleton, const DirectionSource& source, int axis, int depth) {
  switch (source.kind) {
    case Kind::given:
      return true;
    case Kind::fit:
      return looks(source.from);
    case Kind::axis_of: {
      const int row = skeleton.find_joint(source.joint);
      return row >= 0 && depth > 0 && axis_by_scan(skeleton, row, axis, depth - 1);
    }
    case Kind::first_good:  // its last resorts have a confidence of their own
      return !source.choices.empty() && by_scan(skeleton, source.choices.front(), axis, depth);
    case Kind::towards:
      break;
  }
  return false;
}

bool ruled(const Joint& joint) {
  return joint.how && joint.how->center.rule != CenterRule::given;
}

// A point of the body, where it is there.
struct Place {
  bool there = false;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
};

Place place_of(JointSources& sources, const Skeleton& skeleton, const char* joint, double least) {
  const int row = skeleton.find_joint(joint);
  if (row < 0 || !ruled(skeleton.segments[static_cast<std::size_t>(row)].joint)) return {};
  const FoundPoint& found = sources.center(static_cast<std::size_t>(row));
  return {found.fit.confidence >= least, found.at};
}

Place amid(const Place& one, const Place& other) {
  return {one.there && other.there, 0.5 * (one.at + other.at)};
}

// Up, as the body lies: from the hips to the neck, else along the thighs, else along the shanks; zero where
// none of them is known. A hip at the edge of the image is none.
Eigen::Vector3d up_of(JointSources& sources, const Skeleton& skeleton) {
  const auto both = [&](const char* left, const char* right) {
    return amid(place_of(sources, skeleton, left, kBelieved), place_of(sources, skeleton, right, kBelieved));
  };
  const Place hips = both("hip_left", "hip_right"), knees = both("knee_left", "knee_right");
  const Place neck = place_of(sources, skeleton, "cervicothoracic", kNeckBelieved);
  const Place ankles = both("ankle_left", "ankle_right");
  for (const auto& [from, to] : {std::pair(hips, neck), std::pair(knees, hips), std::pair(ankles, knees)}) {
    const Eigen::Vector3d along = to.at - from.at;
    if (from.there && to.there && along.norm() > 1e-6) return along.normalized();
  }
  return Eigen::Vector3d::Zero();
}

}  // namespace

double far_off(JointSources& sources, const Skeleton& skeleton, std::size_t row,
               const Eigen::Vector3d& center, const Context& context) {
  const Segment& segment = skeleton.segments[row];
  if (segment.parent < 0 || !ruled(segment.joint) || !sources.lacks_shaft(row)) return 1;
  const Points& V = sources.bones(segment.name).V;
  if (V.rows() < 4) return 1;
  const double size = (V.colwise().maxCoeff() - V.colwise().minCoeff()).norm();
  const double away = std::sqrt((V.rowwise() - center.transpose()).rowwise().squaredNorm().minCoeff());
  const double sure = falling(away - kNearOwnBones * size, kHalfOff * size);
  if (sure < kToldBelow) {
    std::ostringstream line;
    line << "joint " << segment.joint.name << ": its centre lies " << std::lround(away)
         << " mm from the bones of " << segment.name << ": the bone that it was found on may be cut";
    context.warn(line.str());
  }
  return sure;
}

double tilted_by(JointSources& sources, const Skeleton& skeleton, std::size_t row, const Context& context) {
  const Joint& joint = skeleton.segments[row].joint;
  if (!ruled(joint)) return 1;
  bool of_scan = joint.how->axes.empty();
  for (const auto& [axis, source] : joint.how->axes)
    of_scan = of_scan || by_scan(skeleton, source, axis, static_cast<int>(skeleton.segments.size()));
  if (!of_scan) return 1;
  const Eigen::Vector3d up = up_of(sources, skeleton);
  if (up.isZero()) return 1;
  const double slope = std::acos(std::clamp(up[2], -1.0, 1.0)) * degrees_per_radian;
  const double sure = falling(slope - kUsualSlope, kHalfTilt);
  if (sure < kToldBelow) {
    std::ostringstream line;
    line << "joint " << joint.name << ": its axes are the scan's, in which the body lies askew by "
         << std::lround(slope) << " degrees";
    context.warn(line.str());
  }
  return sure;
}

}  // namespace ecorche::rig
