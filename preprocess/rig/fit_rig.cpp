// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/fit_rig.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <sstream>

#include <ecorche/kinematics/angles.hpp>
#include "core/values/degrees.hpp"
#include "preprocess/rig/body_frame.hpp"
#include "preprocess/rig/bridged_joints.hpp"
#include "preprocess/rig/exchanged_sides.hpp"
#include "preprocess/rig/generic_tree.hpp"
#include "preprocess/rig/joint_sources.hpp"
#include "preprocess/rig/lone_side.hpp"
#include "preprocess/rig/mirrored_joints.hpp"
#include "preprocess/rig/parted_bones.hpp"
#include "preprocess/rig/plausible.hpp"
#include "preprocess/rig/present_part.hpp"
#include "preprocess/rig/split_spine.hpp"

namespace ecorche::rig {
namespace {

constexpr double kBadResidual = 0.10;  // of the radius
constexpr double kFewInliers = 0.5;
constexpr double kRounding = 1e-9;  // radians
constexpr double kHalfSure = 10;    // degrees beyond a limit
constexpr double kExchanged = 0.4;  // the most that a joint of exchanged sides is sure: as what is mirrored

std::string percent(double share) {
  return std::to_string(static_cast<int>(std::lround(100 * share))) + " %";
}

void warn_sphere(const JointFit& fit, const Context& context) {
  if (fit.residual_mm > kBadResidual * fit.radius_mm) {
    std::ostringstream line;
    line << "joint " << fit.joint << ": its surfaces are no good sphere: rms residual " << fit.residual_mm
         << " mm at radius " << fit.radius_mm << " mm, above 10 %";
    context.warn(line.str());
  }
  if (fit.inlier_share < kFewInliers) {
    std::ostringstream line;
    line << "joint " << fit.joint << ": only " << fit.inlier_share * 100 << " % of " << fit.points
         << " facing vertices lie on its sphere";
    context.warn(line.str());
  }
}

void warn_rule(const JointFit& fit, double of_axes, const Context& context) {
  if (fit.rule == CenterRule::facing) {
    context.warn("joint " + fit.joint +
                 ": its rule cannot be followed in this case; it lies where its segment is nearest to the "
                 "parent's bones");
  } else if (fit.confidence < JointSources::least_confidence) {
    std::ostringstream line;
    line << "joint " << fit.joint << ": its centre by " << center_rule_name(fit.rule) << " has confidence "
         << percent(fit.confidence) << " (";
    if (fit.rule == CenterRule::centroid) {
      line << "the mean of " << fit.points << " vertices that lie " << fit.residual_mm << " mm about it)";
    } else {
      line << "rms residual " << fit.residual_mm << " mm, " << percent(fit.inlier_share) << " of "
           << fit.points << " vertices)";
    }
    context.warn(line.str());
  }
  if (of_axes < JointSources::least_confidence)
    context.warn("joint " + fit.joint + ": its axes have confidence " + percent(of_axes));
}

// How sure a joint's centre is, and its axes.
struct Sure {
  double center = 1, axes = 1;
};

bool has_bone(const Case& patient, const std::string& name) {
  return std::any_of(patient.bones.begin(), patient.bones.end(),
                     [&](const CaseBone& b) { return b.name == name; });
}

// A sphere between two bones that were named for it must be there: nothing stands in for it.
void need_sphere(const Case& patient, const Joint& joint, const FoundPoint& found) {
  for (const std::string& name : {joint.center_bone, joint.facing_bone}) {
    if (has_bone(patient, name)) continue;
    throw Error(ErrorKind::config, "joint " + joint.name,
                "its sphere fit names bone '" + name + "', which the case has not",
                "add the bone, or give the joint's center as [x, y, z]");
  }
  if (found.fit.rule == CenterRule::sphere_fit) return;
  throw Error(
      ErrorKind::data, "joint " + joint.name,
      "the vertices of " + joint.center_bone + " that face " + joint.facing_bone + " lie on no sphere",
      "give the joint's center as [x, y, z]");
}

void warn_beyond(const Joint& joint, const AngleAxis& angle, double limit, const Context& context) {
  std::ostringstream line;
  line << "joint " << joint.name << ": " << angle.name << " rests at "
       << std::lround(angle.rest * degrees_per_radian) << " degrees, outside its limits: widened from "
       << std::lround(limit * degrees_per_radian) << ", for the scanned pose is allowed";
  context.warn(line.str());
}

// The rest angles that lead from the parent's axes to the joint's. Limits that leave them out reach to them,
// and the joint is as much less sure: by half where that is 10 degrees. Turns that the joint does not make
// (those of a hinge about its second axis) have none.
void measure_rest(const Eigen::Matrix3d& parent, Joint& joint, JointFit& fit, Sure& sure,
                  const Context& context) {
  for (AngleAxis& angle : joint.sequence) angle.rest = 0;
  const std::array<double, 3> rest = kinematics::angles_from_rotation(
      joint, Eigen::Quaterniond(Eigen::Matrix3d(parent.transpose() * joint.axes)));
  for (std::size_t a = 0; a < 3; ++a) {
    AngleAxis& angle = joint.sequence[a];
    angle.rest = std::abs(rest[a]) < kRounding ? 0 : rest[a];
    if (angle.rest >= angle.min && angle.rest <= angle.max) continue;
    double& limit = angle.rest < angle.min ? angle.min : angle.max;
    warn_beyond(joint, angle, limit, context);
    const double beyond = (angle.rest - limit) * degrees_per_radian / kHalfSure;
    fit.confidence /= 1 + beyond * beyond;
    sure.axes /= 1 + beyond * beyond;
    limit = angle.rest;
  }
}

// What the joint leaves open costs a mean of vertices nothing: where along its axis a hinge lies, and about
// which point a root turns.
FoundPoint of_kind(const Joint& joint, const FoundPoint& found, const Eigen::Matrix3d& axes) {
  FoundPoint out = found;
  if (found.fit.rule != CenterRule::centroid) return out;
  if (joint.kind == JointKind::free) out.fit.confidence = 1;
  if (joint.kind != JointKind::hinge) return out;
  const Eigen::Vector3d axis = axes.col(joint.sequence[0].axis);
  out.fit.residual_mm = std::sqrt(std::max(0.0, found.scatter.trace() - axis.dot(found.scatter * axis)));
  out.fit.confidence = centroid_confidence(out.fit.residual_mm);
  return out;
}

Sure fit_joint(const Case& patient, JointSources& sources, std::size_t row, Rig& rig,
               const Context& context) {
  Joint& joint = rig.skeleton.segments[row].joint;
  const auto [axes, of_axes] = sources.axes(row);
  const FoundPoint found = of_kind(joint, sources.center(row), axes);
  const double off = far_off(sources, rig.skeleton, row, found.at, context);
  const double tilted = tilted_by(sources, rig.skeleton, row, context);
  const bool two_bones = joint.rule == CenterRule::sphere_fit && !joint.facing_bone.empty();
  if (two_bones) need_sphere(patient, joint, found);
  rig.fits.push_back(found.fit);
  for (const std::string& note : sources.notes(row)) context.warn("joint " + joint.name + ": " + note);
  if (two_bones) {
    warn_sphere(found.fit, context);
  } else {
    warn_rule(found.fit, of_axes, context);
  }
  const double most = is_parted(rig.skeleton) ? parted_confidence(joint.name) : 1;
  rig.fits.back().confidence = std::min(std::min(found.fit.confidence, of_axes) * off * tilted, most);
  // A hinge whose centre is off was fitted to no joint: its axis, too.
  return {std::min(found.fit.confidence * off, most), std::min(of_axes * off * tilted, most)};
}

void hold(double most, JointFit& fit, Sure& sure) {
  fit.confidence = std::min(fit.confidence, most);
  sure = {std::min(sure.center, most), std::min(sure.axes, most)};
}

// `outer`, whose warnings of joints end with what to do.
Context advising(const Context& outer) {
  Context context = outer;
  context.log = [&outer](LogLevel level, std::string_view line) {
    if (!outer.log) return;
    std::string said(line);
    if (level == LogLevel::warning && line.starts_with("joint "))
      said.append(" (").append(joint_advice) += ')';
    outer.log(level, said);
  };
  return context;
}

// The joints of a body that lies straight along LPS, or as its scan has it.
Rig fit_straight(const Case& patient, const std::set<std::string>& exchanged, const Context& context,
                 std::vector<JointEvidence>* evidence) {
  Rig rig;
  const Skeleton asked = patient.generic ? generic_tree(patient, context) : present_part(patient, context);
  rig.skeleton = asked;
  JointSources sources(patient, asked);
  sources.exchange(exchanged);
  take_other_sides(asked, sources, context);
  keep_rest_possible(asked, sources, context);
  if (!patient.generic) {
    keep_bridged_near(patient, asked, sources);
    keep_lone_in_middle(asked, sources, context);
  }
  std::vector<Sure> sure;
  const std::vector<bool> held = resting_on(patient, asked, exchanged);
  for (std::size_t row = 0; row < asked.segments.size(); ++row) {
    context.check_stop();
    sure.push_back(fit_joint(patient, sources, row, rig, context));
    context.report(static_cast<double>(row + 1) / static_cast<double>(asked.segments.size()));
  }
  for (std::size_t row = 0; row < asked.segments.size(); ++row) {
    const Segment& from = asked.segments[row];
    Joint& joint = rig.skeleton.segments[row].joint;
    joint.center = sources.center(row).at;
    joint.axes = sources.axes(row).first;
    joint.rule = rig.fits[row].rule;
    joint.how.reset();
    const bool measured = from.joint.how && from.joint.how->measured_rest && from.parent >= 0;
    if (measured) {
      const Eigen::Matrix3d parent = sources.axes(static_cast<std::size_t>(from.parent)).first;
      measure_rest(parent, joint, rig.fits[row], sure[row], context);
    }
    if (held[row]) hold(kExchanged, rig.fits[row], sure[row]);
    if (evidence != nullptr)
      evidence->push_back(evidence_of(sources.center(row), sure[row].center, sure[row].axes));
  }
  return rig;
}

// Back into the scan; what was given stays to the last digit.
void turn_back(const Skeleton& asked, const Eigen::Matrix3d& frame, Rig& rig,
               std::vector<JointEvidence>* evidence) {
  for (Segment& segment : rig.skeleton.segments) {
    const Joint& was = asked.segments[static_cast<std::size_t>(asked.find_joint(segment.joint.name))].joint;
    const bool given = !was.how && was.rule == CenterRule::given;
    segment.joint.center = given ? was.center : Eigen::Vector3d(frame * segment.joint.center);
    segment.joint.axes = given ? was.axes : Eigen::Matrix3d(frame * segment.joint.axes);
  }
  if (evidence == nullptr) return;
  for (JointEvidence& one : *evidence) {
    one.at = frame * one.at;
    one.axis = frame * one.axis;
    for (Eigen::Vector3d& vertex : one.vertices) vertex = frame * vertex;
  }
}

}  // namespace

Rig fit(const Case& patient, const Context& outer, std::vector<JointEvidence>* evidence) {
  const Context context = advising(outer);
  if (patient.whole_spine)
    return split_spine(patient, fit(with_whole_spine(patient), outer, evidence), context, evidence);
  const std::set<std::string> exchanged = exchanged_sides(patient);
  warn_exchanged(exchanged, context);
  // Exchanged girdles would turn the body about its length.
  const Eigen::Matrix3d frame =
      exchanged.contains("girdle_left") ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : body_frame(patient);
  Rig rig;
  if (frame.isIdentity(0)) {
    rig = fit_straight(patient, exchanged, context, evidence);
  } else {
    rig = fit_straight(turned(patient, frame.transpose()), exchanged, context, evidence);
    turn_back(patient.skeleton, frame, rig, evidence);
  }
  // Its poses and clips are those of the same joints.
  if (is_parted(patient.skeleton)) rig.skeleton.name = whole_of_parted;
  return rig;
}

}  // namespace ecorche::rig
