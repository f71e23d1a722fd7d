// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/radiograph_choice.hpp>

#include <Eigen/Geometry>
#include <cmath>

#include <ecorche/values/error.hpp>
#include "core/values/text.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

constexpr double kGap = 10;          // mm between the body and the detector
constexpr double kSurelyAir = -500;  // darker than any tissue: a volume in it is one of Hounsfield units

RadiographTarget target_of(const SetupChoice& choice, const Model& model, const PosedBody& body,
                           const RigidTransform& root) {
  if (choice.point) return target_point(model, body, choice.beam, root.inverse() * *choice.point);
  if (choice.target.empty() || choice.target == "body") return target_body(model, body, choice.beam);
  const Skeleton& skeleton = model.rig.skeleton;
  if (const int row = skeleton.find_segment(choice.target); row >= 0)
    return target_segment(model, body, choice.beam, row);
  if (const int row = skeleton.find_joint(choice.target); row >= 0)
    return target_joint(model, body, choice.beam, row);
  throw Error(ErrorKind::usage, "target", "the model has no '" + choice.target + "'",
              "name a segment or a joint of its skeleton");
}

// A detector that faces the source.
void face(XRaySetup& setup) {
  const Vector3d up = Vector3d::UnitZ(), back = Vector3d::UnitY();
  const Vector3d way = setup.detector.centre - setup.source;
  if (!(way.norm() >= 1)) throw Error(ErrorKind::usage, "source", "it lies in the detector", "move it away");
  const Vector3d beam = way.normalized();
  Vector3d down = -up + beam.dot(up) * beam;
  if (down.norm() < 1e-3) down = back - beam.dot(back) * beam;
  setup.detector.down = down.normalized();
  setup.detector.right = setup.detector.down.cross(beam);
}

XRaySetup setup_of(const PlacedXRay& placed, const Detector& plate) {
  XRaySetup out;
  out.detector = plate;
  out.source = placed.source;
  out.detector.centre = placed.detector;
  if (placed.axes) {
    out.detector.right = placed.axes->right.normalized();
    out.detector.down = placed.axes->down.normalized();
  } else {
    face(out);
  }
  return out;
}

}  // namespace

void check(const SetupChoice& choice) {
  if (choice.placed) return check(setup_of(*choice.placed, choice.plate));
  XRaySetup alone;
  alone.detector = choice.plate;
  alone.source = alone.detector.centre - 1000 * Vector3d::UnitY();
  check(alone);
  const double sid = choice.sid_mm, oid = choice.oid_mm.value_or(0);
  if (!(sid > 0 && sid <= 1e5))
    throw Error(ErrorKind::usage, "sid", text::number(sid, 6) + " mm", "more than 0, at most 1e5");
  if (!(oid >= 0 && oid < sid))
    throw Error(ErrorKind::usage, "oid", text::number(oid, 6) + " mm",
                "from 0 to less than the distance of the source");
  if (!std::isfinite(choice.beam.turn))
    throw Error(ErrorKind::usage, "turn", "it is no number", "give an angle");
  if (choice.point && !(choice.point->cwiseAbs().maxCoeff() <= 1e9))
    throw Error(ErrorKind::usage, "target", "a point beyond 1e9 mm", "give x, y, z in mm");
}

ChosenSetup setup_of(const SetupChoice& choice, const Model& model, const PosedBody& body,
                     const RigidTransform& root) {
  ChosenSetup out;
  if (choice.placed) {
    out.here = setup_of(*choice.placed, choice.plate);
    out.still = out.here.moved(root.inverse());
    out.target = "source and detector as placed";
    out.source_to_target = (target_body(model, body, View::ap).centre - out.still.source).norm();
    return out;
  }
  const RadiographTarget target = target_of(choice, model, body, root);
  const double sid = choice.sid_mm, oid = choice.oid_mm.value_or(target.behind_mm + kGap);
  if (!(sid - oid >= 1)) {
    throw Error(ErrorKind::usage, "sid",
                "what hangs on the target reaches " + text::number(target.behind_mm, 4) +
                    " mm behind it: the source, " + text::number(sid, 5) +
                    " mm before the detector, would not stand before it",
                "give a greater sid, or an oid");
  }
  out.still = positioned(choice.beam, target, sid, oid, choice.plate);
  out.here = out.still.moved(root);
  out.beam = choice.beam;
  out.target = choice.point ? "point" : choice.target.empty() ? "body" : choice.target;
  out.source_to_target = sid - oid;
  return out;
}

const ModelVolume* scan_of(const Model& model) {
  for (const ModelVolume& volume : model.volumes) {
    if (!volume.labels && volume.image.components == 1 && volume.background <= kSurelyAir) return &volume;
  }
  return nullptr;
}

}  // namespace ecorche::runtime
