// SPDX-License-Identifier: Apache-2.0
// Where source and detector stand, as somebody asks for it: by a view of a part of the body, or by places.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/radiograph.hpp>
#include <ecorche/runtime/radiograph_views.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::runtime {

/// Source and detector where somebody put them, in the space of the posed body.
struct PlacedXRay {
  Eigen::Vector3d source = Eigen::Vector3d::Zero();    ///< LPS mm
  Eigen::Vector3d detector = Eigen::Vector3d::Zero();  ///< its middle, LPS mm
  /// Directions of its rows and columns; without them it faces the source, its columns down the body, or to
  /// the back where the beam runs along the body.
  struct Axes {
    Eigen::Vector3d right, down;
  };
  std::optional<Axes> axes;
};

/// Either `placed`, or a view and its distances.
struct SetupChoice {
  Detector plate;  ///< only its size and its pixels
  std::optional<PlacedXRay> placed;
  Beam beam;
  std::string target;                    ///< `body` or nothing: its middle; or a segment's name, or a joint's
  std::optional<Eigen::Vector3d> point;  ///< instead of a target, LPS mm where the body is posed
  double sid_mm = 1000;                  ///< source to detector; what tables and bucky stands are made for
  std::optional<double> oid_mm;          ///< target to detector; else 10 mm behind what hangs on the target
};

/// Throws Error{usage} for what no body is needed to refuse; as check(XRaySetup).
void check(const SetupChoice& choice);

/// What was chosen, in millimetres of LPS.
struct ChosenSetup {
  XRaySetup here;   ///< where the body stands as posed
  XRaySetup still;  ///< the same about the body with its root as scanned
  std::optional<Beam> beam;
  std::string target;           ///< in words
  double source_to_target = 0;  ///< mm; without a target to the middle of the body
};

/// `body` stands still (Root::still); `root` is where the pose takes its root. Views are about the body: they
/// turn with its root. Throws Error{usage}; a name that the model does not have is refused as `target`.
ChosenSetup setup_of(const SetupChoice& choice, const Model& model, const PosedBody& body,
                     const RigidTransform& root);

/// The volume that is looked through where none is named: the first of Hounsfield units, around which lies
/// air. Null: the model has none.
const ModelVolume* scan_of(const Model& model);

}  // namespace ecorche::runtime
