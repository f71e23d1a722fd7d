// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/radiograph_views.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

#include <ecorche/values/error.hpp>
#include "core/values/text.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::string_view, 4> kNames{"ap", "pa", "lateral_left", "lateral_right"};

// About the long axis of the body, upwards.
Vector3d turned(const Vector3d& v, double angle) {
  return angle == 0 ? v : Vector3d(Eigen::AngleAxisd(angle, Vector3d::UnitZ()) * v);
}

// The segment that a node follows most.
int leader(const Weights& weights, std::size_t node) {
  int best = -1;
  float most = 0;
  for (std::uint64_t e = weights.offsets[node]; e < weights.offsets[node + 1]; ++e) {
    if (weights.weight[e] > most) {
      most = weights.weight[e];
      best = weights.segment[e];
    }
  }
  return best;
}

struct Extent {
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;

  void add(const Vector3d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  Vector3d middle() const { return (low + high) / 2; }
};

// Around the nodes for whose leading segment `wanted` says so.
template <class Wanted>
Extent extent_of(const Model& model, const PosedBody& body, Wanted&& wanted) {
  Extent out;
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    if (wanted(n)) out.add(Eigen::Map<const Eigen::Vector3f>(&body.nodes[3 * n]).cast<double>());
  }
  return out;
}

// How far the box reaches along the beam; oblique, to its farthest corner.
RadiographTarget about(const Vector3d& centre, const Extent& extent, const Beam& beam) {
  const Eigen::Array3d way = beam.way();
  const Eigen::Array3d low = way * (extent.low - centre).array(), high = way * (extent.high - centre).array();
  return {centre, std::max(0.0, -low.min(high).sum()), std::max(0.0, low.max(high).sum())};
}

Extent whole(const Model& model, const PosedBody& body) {
  return extent_of(model, body, [](std::size_t) { return true; });
}

}  // namespace

std::string_view view_name(View view) {
  return kNames[static_cast<std::size_t>(view)];
}

View view_from_name(std::string_view name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end())
    throw Error(ErrorKind::usage, "view", "there is no view '" + std::string(name) + "'",
                "one of " + text::joined(kNames));
  return static_cast<View>(found - kNames.begin());
}

Vector3d Beam::way() const {
  const auto along = [this]() -> Vector3d {
    switch (view) {
      case View::ap:
        return Vector3d::UnitY();
      case View::pa:
        return -Vector3d::UnitY();
      case View::lateral_left:
        return Vector3d::UnitX();
      case View::lateral_right:
        break;
    }
    return -Vector3d::UnitX();
  };
  return turned(along(), turn);
}

Vector3d Beam::right() const {
  const auto along = [this]() -> Vector3d {
    switch (view) {
      case View::ap:
      case View::pa:
        return Vector3d::UnitX();
      case View::lateral_left:  // the front on the left
        return Vector3d::UnitY();
      case View::lateral_right:
        break;
    }
    return -Vector3d::UnitY();
  };
  return turned(along(), turn);
}

RadiographTarget target_body(const Model& model, const PosedBody& body, const Beam& beam) {
  const Extent extent = whole(model, body);
  return about(extent.middle(), extent, beam);
}

RadiographTarget target_segment(const Model& model, const PosedBody& body, const Beam& beam, int segment) {
  const Extent extent =
      extent_of(model, body, [&](std::size_t n) { return leader(model.weights, n) == segment; });
  if (!extent.low.allFinite())  // it has no flesh of its own
    return target_joint(model, body, beam, segment);
  return about(extent.middle(), extent, beam);
}

RadiographTarget target_joint(const Model& model, const PosedBody& body, const Beam& beam, int segment) {
  const auto row = static_cast<std::size_t>(segment);
  const Vector3d centre = body.segments[row] * model.rig.skeleton.segments[row].joint.center;
  const int parent = model.rig.skeleton.segments[row].parent;
  Extent extent = extent_of(model, body, [&](std::size_t n) {
    const int leads = leader(model.weights, n);
    return leads == segment || leads == parent;
  });
  extent.add(centre);
  return about(centre, extent, beam);
}

RadiographTarget target_point(const Model& model, const PosedBody& body, const Beam& beam,
                              const Vector3d& point) {
  return about(point, whole(model, body), beam);
}

XRaySetup positioned(const Beam& beam, const RadiographTarget& target, double sid_mm, double oid_mm,
                     const Detector& detector) {
  // A negative distance would turn the picture round.
  if (!(oid_mm >= 0 && sid_mm - oid_mm >= 1)) {
    throw Error(ErrorKind::usage, "source",
                "it would stand behind what it pictures: " + text::number(sid_mm, 5) +
                    " mm before the detector, which is " + text::number(oid_mm, 5) + " mm behind the target",
                "give a greater distance of the source, or a smaller one of the detector");
  }
  XRaySetup out;
  out.detector = detector;
  out.detector.down = -Vector3d::UnitZ();
  out.detector.right = beam.right();
  const Vector3d way = beam.way();
  out.detector.centre = target.centre + oid_mm * way;
  out.source = out.detector.centre - sid_mm * way;
  return out;
}

}  // namespace ecorche::runtime
