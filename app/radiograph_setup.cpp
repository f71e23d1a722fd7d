// SPDX-License-Identifier: Apache-2.0
#include "app/radiograph_setup.hpp"

#include <charconv>
#include <cmath>

#include <ecorche/values/error.hpp>
#include "app/cli.hpp"
#include "app/unknown_name.hpp"
#include "app/usage_error.hpp"
#include "core/values/degrees.hpp"

namespace ecorche::app {
namespace {

using Eigen::Vector3d;

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

std::vector<Named> targets(const Skeleton& skeleton) {
  std::vector<Named> known{{"body"}};
  for (const Segment& segment : skeleton.segments) {
    known.push_back({segment.name});
    known.push_back({segment.joint.name});
  }
  return known;
}

Vector3d vector_at(const std::vector<double>& numbers, std::size_t at) {
  return {numbers[at], numbers[at + 1], numbers[at + 2]};
}

void refuse_beside(bool given, const char* option, const char* other) {
  if (given) usage_error(option, std::string("it does nothing beside ") + other, "leave out one of them");
}

runtime::PlacedXRay placed(const SetupOptions& options) {
  if (options.source.empty())
    usage_error("--detector", "where the source stands is not said", "add --source");
  if (options.detector.empty())
    usage_error("--source", "where the detector stands is not said", "add --detector");
  refuse_beside(!options.view.empty(), "--view", "--source");
  refuse_beside(options.turn_deg.has_value(), "--turn", "--source");
  refuse_beside(!options.target.empty(), "--target", "--source");
  refuse_beside(options.sid_mm.has_value(), "--sid", "--source");
  refuse_beside(options.oid_mm.has_value(), "--oid", "--source");
  if (options.detector.size() != 3 && options.detector.size() != 9)
    usage_error("--detector", std::to_string(options.detector.size()) + " numbers",
                "give three (its middle) or nine (with the directions of its rows and columns)");
  runtime::PlacedXRay out{vector_at(options.source, 0), vector_at(options.detector, 0), {}};
  if (options.detector.size() == 9)
    out.axes = {vector_at(options.detector, 3), vector_at(options.detector, 6)};
  return out;
}

// What the library calls `sid` the command line calls `--sid`.
template <class Call>
auto naming_options(Call&& call) {
  try {
    return std::forward<Call>(call)();
  } catch (const Error& error) {
    for (const char* name : {"sid", "oid", "turn", "target", "source", "detector"}) {
      if (error.where() == name) usage_error("--" + error.where(), error.problem(), error.mend());
    }
    throw;
  }
}

}  // namespace

void add_setup_options(CLI::App& command, SetupOptions& options) {
  command
      .add_option(
          "--view", options.view,
          "where the beam goes: ap (front to back), pa (back to front), lateral_left (the detector at "
          "the left side) or lateral_right; without it and --source: ap")
      ->check(CLI::IsMember({"ap", "pa", "lateral_left", "lateral_right"}));
  command.add_option(
      "--turn", options.turn_deg,
      "of a view: degrees that the source goes round the body's long axis from there, from the "
      "front to the left: an oblique view");
  command.add_option(
      "--target", options.target,
      "what the central ray meets: body (its middle), the name of a segment (its middle) or of "
      "a joint, or x,y,z in mm LPS; without it the body");
  command.add_option("--sid", options.sid_mm, "of a view: source to detector, mm; without it 1000");
  command.add_option("--oid", options.oid_mm,
                     "of a view: target to detector, mm; without it the detector stands 10 mm behind what "
                     "hangs on the target");
  command.add_option("--source", options.source, "place of the source, x,y,z in mm LPS; instead of --view")
      ->delimiter(',')
      ->expected(3);
  command
      .add_option(
          "--detector", options.detector,
          "middle of the detector, x,y,z in mm LPS: it faces the source, the head up; or nine numbers: "
          "the middle, the direction of its rows, that of its columns")
      ->delimiter(',')
      ->expected(3, 9);
  command.add_option("--size", options.size_mm, "width and height of the detector, mm")
      ->delimiter(',')
      ->expected(2)
      ->default_str("430,430");
  command.add_option("--pixels", options.pixels, "columns and rows of the detector")
      ->delimiter(',')
      ->expected(2)
      ->default_str("512,512");
}

runtime::SetupChoice choice_of(const SetupOptions& options) {
  runtime::SetupChoice out;
  out.plate.size_mm = {options.size_mm[0], options.size_mm[1]};
  out.plate.pixels = {options.pixels[0], options.pixels[1]};
  if (!options.source.empty() || !options.detector.empty()) {
    out.placed = placed(options);
  } else {
    if (!options.view.empty()) out.beam.view = runtime::view_from_name(options.view);
    out.beam.turn = options.turn_deg.value_or(0) / degrees_per_radian;
    out.point = point_of(options.target);
    if (!out.point) out.target = options.target;
    out.sid_mm = options.sid_mm.value_or(out.sid_mm);
    out.oid_mm = options.oid_mm;
  }
  naming_options([&] { runtime::check(out); });
  return out;
}

runtime::ChosenSetup chosen_setup(const runtime::SetupChoice& choice, const Model& model,
                                  const runtime::PosedBody& body, const RigidTransform& root) {
  const Skeleton& skeleton = model.rig.skeleton;
  const std::string& target = choice.target;
  if (!target.empty() && target != "body" && skeleton.find_segment(target) < 0 &&
      skeleton.find_joint(target) < 0)
    throw unknown_name("--target", target, targets(skeleton));
  return naming_options([&] { return runtime::setup_of(choice, model, body, root); });
}

}  // namespace ecorche::app
