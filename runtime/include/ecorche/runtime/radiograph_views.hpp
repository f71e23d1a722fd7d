// SPDX-License-Identifier: Apache-2.0
// Where source and detector stand for the usual views of a posed body.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string_view>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/radiograph.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// By where the beam goes. Hung as radiologists do: the head up; from front or back as if one stood before
/// the patient, whose right is on the picture's left; from a side as seen from the detector.
enum class View : std::uint8_t {
  ap,             ///< front to back: the detector at the back
  pa,             ///< back to front: the detector at the front
  lateral_left,   ///< right to left: the detector at the patient's left; the patient faces the picture's left
  lateral_right,  ///< left to right: the detector at the patient's right, who faces the picture's right
};

/// `ap`, `pa`, `lateral_left`, `lateral_right` and back; throws Error{usage} on another word.
std::string_view view_name(View view);
View view_from_name(std::string_view name);

/// A view, and how far the source goes round the body from there: radians about its long axis, from the front
/// to the left.
struct Beam {
  View view;
  double turn;

  /// `turned_by` in radians.
  Beam(View from = View::ap, double turned_by = 0) : view(from), turn(turned_by) {}
  /// Unit vector from source to detector, LPS of the body as scanned.
  Eigen::Vector3d way() const;
  /// Unit vector along the rows of the picture, likewise.
  Eigen::Vector3d right() const;
};

/// What the central ray meets, and how far the part of the body that is pictured reaches along the beam.
struct RadiographTarget {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< LPS mm
  double before_mm = 0;  ///< from the centre towards the source, to what is nearest there
  double behind_mm = 0;  ///< from the centre towards the detector
};

/// The middle of the box around the posed body, of its nodes.
RadiographTarget target_body(const Model& model, const PosedBody& body, const Beam& beam);
/// The middle of the box around the nodes that follow that segment most.
RadiographTarget target_segment(const Model& model, const PosedBody& body, const Beam& beam, int segment);
/// Where that segment's joint has gone, with the segments on both its sides about it.
RadiographTarget target_joint(const Model& model, const PosedBody& body, const Beam& beam, int segment);
/// A point, with the whole body about it.
RadiographTarget target_point(const Model& model, const PosedBody& body, const Beam& beam,
                              const Eigen::Vector3d& point);

/// Source, target and the detector's centre on one line, the detector `sid_mm` from the source and `oid_mm`
/// behind the target; its size and pixels are those of `detector`. Throws Error{usage} where the source does
/// not stand before the target.
XRaySetup positioned(const Beam& beam, const RadiographTarget& target, double sid_mm, double oid_mm,
                     const Detector& detector);

}  // namespace ecorche::runtime
