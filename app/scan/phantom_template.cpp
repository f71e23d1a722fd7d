// SPDX-License-Identifier: Apache-2.0
#include "app/scan/phantom_template.hpp"

#include <cmath>

#include "phantom/body.hpp"

namespace ecorche::app {
namespace {

constexpr double kSpacing = 9, kShell = 6;  // mm

Points shell_points(const phantom::Shape& shape) {
  const phantom::Box& box = shape.box();
  std::vector<Eigen::Vector3d> found;
  const auto first = [&](int a) { return static_cast<int>(std::ceil(box.lo[a] / kSpacing)); };
  const auto last = [&](int a) { return static_cast<int>(std::floor(box.hi[a] / kSpacing)); };
  for (int k = first(2); k <= last(2); ++k) {
    for (int j = first(1); j <= last(1); ++j) {
      for (int i = first(0); i <= last(0); ++i) {
        const double x = kSpacing * i, y = kSpacing * j, z = kSpacing * k;
        const double d = shape.distance({x, y, z});
        if (d < 0 && d > -kShell) found.emplace_back(x, y, z);
      }
    }
  }
  Points out(static_cast<Eigen::Index>(found.size()), 3);
  for (std::size_t p = 0; p < found.size(); ++p) out.row(static_cast<Eigen::Index>(p)) = found[p].transpose();
  return out;
}

// Marrow is no denser than flesh; canals and the skull's inside stay open.
double hollow_of(const std::string& segment) {
  if (segment == "pelvis") return 400;
  return segment.ends_with("_left") || segment.ends_with("_right") ? 1500 : 150;
}

}  // namespace

scan::BodyTemplate phantom_template() {
  const phantom::Landmarks at = phantom::make_landmarks(1);
  const Skeleton skeleton = phantom::make_skeleton(at, false);
  scan::BodyTemplate out;
  for (const Segment& segment : skeleton.segments)
    out.segments.push_back({segment.name, segment.parent, segment.joint.center});
  const int head = skeleton.find_segment("head");
  for (const phantom::Part& part : phantom::make_bones(at)) {
    int segment = skeleton.find_segment(part.segment);
    Points points = shell_points(part.shape);
    if (part.name == "mandible") {
      // The phantom's own skeleton has no jaw: it turns about the line through the condyles.
      const double top = points.col(2).maxCoeff() - 2 * kSpacing;
      Eigen::Vector3d joint = Eigen::Vector3d::Zero();
      double count = 0;
      for (Eigen::Index p = 0; p < points.rows(); ++p) {
        if (points(p, 2) < top) continue;
        joint += points.row(p).transpose();
        count += 1;
      }
      segment = static_cast<int>(out.segments.size());
      out.segments.push_back({"jaw", head, joint / count});
    }
    out.bones.push_back({part.name, segment, std::move(points), hollow_of(part.segment)});
  }
  return out;
}

}  // namespace ecorche::app
