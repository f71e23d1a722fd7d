// SPDX-License-Identifier: Apache-2.0
#include "app/radiograph_setup.hpp"

#include <Eigen/Geometry>
#include <charconv>
#include <cmath>

#include <ecorche/values/error.hpp>
#include "app/unknown_name.hpp"
#include "app/usage_error.hpp"
#include "core/values/text.hpp"

namespace ecorche::app {
namespace {

using Eigen::Vector3d;
using runtime::RadiographTarget;

constexpr double kSid = 1000;  // mm; what tables and bucky stands are made for
constexpr double kGap = 10;    // mm between the body and the detector
const Vector3d kUp = Vector3d::UnitZ();

// `x,y,z`, where it is that.
std::optional<Vector3d> point_of(const std::string& text) {
  Vector3d out;
  const char *at = text.data(), *const end = at + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    const auto [next, error] = std::from_chars(at, end, out[axis]);
    if (error != std::errc() || !std::isfinite(out[axis])) return {};
    at = next;
    if (axis < 2 && (at == end || *at++ != ',')) return {};
  }
  return at == end ? std::optional(out) : std::nullopt;
}

struct Named {
  std::string name;
};

RadiographTarget target_of(const SetupChoice& choice, const Model& model, const runtime::PosedBody& body,
                           runtime::View view, const RigidTransform& root) {
  if (choice.target.empty() || choice.target == "body") return runtime::target_body(model, body, view);
  if (const auto point = point_of(choice.target))
    return runtime::target_point(model, body, view, root.inverse() * *point);
  const Skeleton& skeleton = model.rig.skeleton;
  if (const int row = skeleton.find_segment(choice.target); row >= 0)
    return runtime::target_segment(model, body, view, row);
  if (const int row = skeleton.find_joint(choice.target); row >= 0)
    return runtime::target_joint(model, body, view, row);
  std::vector<Named> known{{"body"}};
  for (const Segment& segment : skeleton.segments) {
    known.push_back({segment.name});
    known.push_back({segment.joint.name});
  }
  throw unknown_name("--target", choice.target, known);
}

Vector3d vector_at(const std::vector<double>& numbers, std::size_t at) {
  return {numbers[at], numbers[at + 1], numbers[at + 2]};
}

// A detector that faces the source, its columns down the body; where the beam runs along the body, down is to
// the back.
void face(runtime::XRaySetup& setup) {
  const Vector3d way = setup.detector.centre - setup.source;
  if (way.norm() < 1) usage_error("--source", "it lies in the detector", "move it away from there");
  const Vector3d beam = way.normalized();
  Vector3d down = -kUp + beam.dot(kUp) * beam;
  if (down.norm() < 1e-3) down = Vector3d::UnitY() - beam.dot(Vector3d::UnitY()) * beam;
  setup.detector.down = down.normalized();
  setup.detector.right = setup.detector.down.cross(beam);
}

runtime::Detector plate(const SetupChoice& choice) {
  runtime::Detector out;
  out.size_mm = {choice.size_mm[0], choice.size_mm[1]};
  out.pixels = {choice.pixels[0], choice.pixels[1]};
  return out;
}

runtime::XRaySetup explicit_setup(const SetupChoice& choice) {
  runtime::XRaySetup out;
  out.detector = plate(choice);
  out.source = vector_at(choice.source, 0);
  out.detector.centre = vector_at(choice.detector, 0);
  if (choice.detector.size() == 3) {
    face(out);
  } else {
    out.detector.right = vector_at(choice.detector, 3).normalized();
    out.detector.down = vector_at(choice.detector, 6).normalized();
  }
  return out;
}

void refuse_beside(bool given, const char* option, const char* other) {
  if (given) usage_error(option, std::string("it does nothing beside ") + other, "leave out one of them");
}

}  // namespace

void add_setup_options(CLI::App& command, SetupChoice& choice) {
  command
      .add_option(
          "--view", choice.view,
          "where the beam goes: ap (front to back), pa (back to front), lateral_left (the detector at "
          "the left side) or lateral_right; without it and --source: ap")
      ->check(CLI::IsMember({"ap", "pa", "lateral_left", "lateral_right"}));
  command.add_option(
      "--target", choice.target,
      "what the central ray meets: body (its middle), the name of a segment (its middle) or of "
      "a joint, or x,y,z in mm LPS; without it the body");
  command.add_option("--sid", choice.sid_mm, "of a view: source to detector, mm; without it 1000");
  command.add_option("--oid", choice.oid_mm,
                     "of a view: target to detector, mm; without it the detector stands 10 mm behind what "
                     "hangs on the target");
  command.add_option("--source", choice.source, "place of the source, x,y,z in mm LPS; instead of --view")
      ->delimiter(',')
      ->expected(3);
  command
      .add_option(
          "--detector", choice.detector,
          "middle of the detector, x,y,z in mm LPS: it faces the source, the head up; or nine numbers: "
          "the middle, the direction of its rows, that of its columns")
      ->delimiter(',')
      ->expected(3, 9);
  command.add_option("--size", choice.size_mm, "width and height of the detector, mm")
      ->delimiter(',')
      ->expected(2)
      ->default_str("430,430");
  command.add_option("--pixels", choice.pixels, "columns and rows of the detector")
      ->delimiter(',')
      ->expected(2)
      ->default_str("512,512");
}

void check_setup(const SetupChoice& choice) {
  const bool placed = !choice.source.empty() || !choice.detector.empty();
  if (placed) {
    if (choice.source.empty())
      usage_error("--detector", "where the source stands is not said", "add --source");
    if (choice.detector.empty())
      usage_error("--source", "where the detector stands is not said", "add --detector");
    refuse_beside(!choice.view.empty(), "--view", "--source");
    refuse_beside(!choice.target.empty(), "--target", "--source");
    refuse_beside(choice.sid_mm.has_value(), "--sid", "--source");
    refuse_beside(choice.oid_mm.has_value(), "--oid", "--source");
    if (choice.detector.size() != 3 && choice.detector.size() != 9)
      usage_error("--detector", std::to_string(choice.detector.size()) + " numbers",
                  "give three (its middle) or nine (with the directions of its rows and columns)");
    runtime::check(explicit_setup(choice));
    return;
  }
  // What no body is needed for.
  runtime::XRaySetup alone;
  alone.detector = plate(choice);
  alone.source = alone.detector.centre - 1000 * Vector3d::UnitY();
  runtime::check(alone);
  const double sid = choice.sid_mm.value_or(kSid), oid = choice.oid_mm.value_or(0);
  if (!(sid > 0 && sid <= 1e5))
    usage_error("--sid", text::number(sid, 6) + " mm", "more than 0, at most 1e5");
  if (!(oid >= 0 && oid < sid))
    usage_error("--oid", text::number(oid, 6) + " mm", "from 0 to less than the distance of the source");
}

ChosenSetup setup_of(const SetupChoice& choice, const Model& model, const runtime::PosedBody& body,
                     const RigidTransform& root) {
  ChosenSetup out;
  if (!choice.source.empty()) {
    out.here = explicit_setup(choice);
    out.still = out.here.moved(root.inverse());
    out.target = "source and detector as placed";
    const RadiographTarget middle = runtime::target_body(model, body, runtime::View::ap);
    out.source_to_target = (middle.centre - out.still.source).norm();
    return out;
  }
  const runtime::View view = choice.view.empty() ? runtime::View::ap : runtime::view_from_name(choice.view);
  const RadiographTarget target = target_of(choice, model, body, view, root);
  const double sid = choice.sid_mm.value_or(kSid), oid = choice.oid_mm.value_or(target.behind_mm + kGap);
  if (!(sid - oid >= 1)) {
    usage_error("--sid",
                "what hangs on the target reaches " + text::number(target.behind_mm, 4) +
                    " mm behind it: the source, " + text::number(sid, 5) +
                    " mm before the detector, would not stand before it",
                "give a greater --sid, or an --oid");
  }
  out.still = runtime::positioned(view, target, sid, oid, plate(choice));
  out.here = out.still.moved(root);
  out.view = view;
  out.target = choice.target.empty() ? "body" : choice.target;
  out.source_to_target = sid - oid;
  return out;
}

}  // namespace ecorche::app
