// SPDX-License-Identifier: Apache-2.0
#include "app/pose_warnings.hpp"
#include "core/kinematics/angle_limits.hpp"
#include "core/values/degrees.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include <ecorche/runtime/verdict.hpp>

namespace ecorche::app {
namespace {

using Eigen::Vector3d;
using nlohmann::json;
using runtime::Breach;
using runtime::Figure;

constexpr double kTurned = 1 / degrees_per_radian;  // a joint that turns by less is not to blame

double turn_of(const Pose& pose, std::size_t joint) {
  const Eigen::Quaterniond& q = pose.rotation[joint];
  return 2 * std::atan2(q.vec().norm(), std::abs(q.w()));
}

class Wording {
 public:
  Wording(const Model& model, const runtime::PosedBody& body, const runtime::PoseQuality& quality,
          std::span<const float> det_f, const HowPosed& how)
      : model_(model), body_(body), quality_(quality), det_f_(det_f), how_(how) {}

  json of(const Breach& breach) const {
    json out{{"value", breach.value}, {"threshold", breach.threshold}};
    switch (breach.figure) {
      case Figure::inverted_share:
        return at(quality_.places.inverted.at, "inverted_share",
                  fmt::format("{:.2f} % of the body is inverted, more than {:.2f} %", 100 * breach.value,
                              100 * breach.threshold),
                  std::move(out));
      case Figure::place_inverted:
        return at(quality_.places.inverted.at, "place_inverted",
                  fmt::format("{:.1f} % of a cube of {:.0f} mm is inverted, more than {:.0f} %",
                              100 * breach.value, quality_.places.edge_mm, 100 * breach.threshold),
                  std::move(out));
      case Figure::place_change:
        return at(quality_.places.changed.at, "place_change",
                  fmt::format("the tets of a cube of {:.0f} mm change their volume by {:.0f} %, more than "
                              "{:.0f} %",
                              quality_.places.edge_mm, 100 * breach.value, 100 * breach.threshold),
                  std::move(out));
      case Figure::volume_change:
        return at(quality_.places.changed.at, "volume_change",
                  fmt::format("the body's tets change their volume by {:.1f} %, more than {:.0f} %",
                              100 * breach.value, 100 * breach.threshold),
                  std::move(out));
      case Figure::tissue_change:
        return tissue(breach, std::move(out));
      case Figure::doubtful_joint:
        return joint(breach, std::move(out));
      case Figure::bone_overlap:
        return overlap(breach, std::move(out));
      case Figure::bone_rigidity:
        break;
    }
    out["kind"] = "bone_rigidity";
    out["what"] = fmt::format("a bone bends by {:.1e} mm, more than {:.1e}", breach.value, breach.threshold);
    out["mend"] = "ecorche verify the model";
    return out;
  }

 private:
  // What helps besides turning less: for one pose, and for all.
  std::string relax() const {
    if (how_.settled || !how_.by_tets) return {};
    const bool can_be_corrected = how_.skinning == runtime::Skinning::cor && !model_.corrected();
    return can_be_corrected ? "use --settle, or calibrate the model, or " : "use --settle, or ";
  }

  json tissue(const Breach& breach, json out) const {
    const runtime::TissueChange& change = quality_.tissues[breach.row];
    out["value"] = change.share;
    out["tissue"] = change.name;
    out["group"] = group_name(change.group);
    const auto row =
        static_cast<std::size_t>(std::find_if(model_.tissues.begin(), model_.tissues.end(),
                                              [&](const Tissue& t) { return t.name == change.name; }) -
                                 model_.tissues.begin());
    return at(place_of(model_.tissues[row], change.share < 0), "tissue_change",
              fmt::format("{} ({}) changes its volume by {:+.1f} %, more than {:.1f} %", change.name,
                          group_name(change.group), 100 * change.share, 100 * breach.threshold),
              std::move(out));
  }

  json joint(const Breach& breach, json out) const {
    const runtime::DoubtfulJoint& doubtful = quality_.doubtful[breach.row];
    const Joint& joint = model_.rig.skeleton.segments[static_cast<std::size_t>(doubtful.joint)].joint;
    out["value"] = doubtful.turned * degrees_per_radian;
    out["threshold"] = breach.threshold * degrees_per_radian;
    out["kind"] = "doubtful_joint";
    out["joint"] = joint.name;
    out["confidence"] = doubtful.confidence;
    out["at_mm"] = {joint.center.x(), joint.center.y(), joint.center.z()};
    out["what"] =
        fmt::format("{} turns by {:.0f} degrees though it was found with a confidence of only {:.2f}",
                    joint.name, doubtful.turned * degrees_per_radian, doubtful.confidence);
    out["mend"] = "ecorche rig CASE says how it was found; give its center and axes in the skeleton";
    return out;
  }

  json overlap(const Breach& breach, json out) const {
    const runtime::BoneOverlap& found = quality_.overlap;
    const Tissue &bone = model_.tissues[found.bone], &into = model_.tissues[found.into];
    const std::size_t between =
        joint_between(static_cast<std::size_t>(bone.segment), static_cast<std::size_t>(into.segment));
    const Joint& joint = model_.rig.skeleton.segments[between].joint;
    out["kind"] = "bone_overlap";
    out["joint"] = joint.name;
    out["at_mm"] = {found.at.x(), found.at.y(), found.at.z()};
    out["what"] = fmt::format("{} runs {:.1f} mm deeper into {} than in the scan, more than {:.0f} mm",
                              bone.name, breach.value, into.name, breach.threshold);
    out["mend"] =
        fmt::format("turn {} less, or look at its center and axes: ecorche rig CASE says how they were found",
                    model_.rig.skeleton.segments[set_by(between)].joint.name);
    return out;
  }

  // The joint that turns most of those between two segments.
  std::size_t joint_between(std::size_t a, std::size_t b) const {
    const auto& segments = model_.rig.skeleton.segments;
    std::vector<int> passed(segments.size(), 0);
    for (const std::size_t end : {a, b})
      for (int s = static_cast<int>(end); s >= 0; s = segments[static_cast<std::size_t>(s)].parent)
        ++passed[static_cast<std::size_t>(s)];
    std::size_t out = a;
    double most = -1;
    for (std::size_t s = 0; s < segments.size(); ++s) {
      if (passed[s] != 1 || turn_of(body_.pose, s) <= most) continue;
      most = turn_of(body_.pose, s);
      out = s;
    }
    return out;
  }

  json at(const Vector3d& place, const char* kind, const std::string& what, json out) const {
    const std::optional<std::size_t> joint = joint_to_blame(place);
    out["kind"] = kind;
    out["what"] = what;
    out["at_mm"] = {place.x(), place.y(), place.z()};
    if (!joint) {
      out["mend"] = relax() + (how_.settled ? "turn the joints around that place less"
                                            : "prepare the case again with --weights quasi-harmonic");
      return out;
    }
    out["joint"] = model_.rig.skeleton.segments[*joint].joint.name;
    const std::size_t set = set_by(*joint);
    out["mend"] = fmt::format("{}turn {} less than its {:.0f} degrees", relax(),
                              model_.rig.skeleton.segments[set].joint.name,
                              turn_of(body_.pose, set) * degrees_per_radian);
    return out;
  }

  // The joint that a pose sets: of one whose every turn follows, the one that it follows.
  std::size_t set_by(std::size_t joint) const {
    const Joint& own = model_.rig.skeleton.segments[joint].joint;
    const auto follows = [&](const AngleAxis& angle) {
      return std::any_of(own.coupled.begin(), own.coupled.end(),
                         [&](const Coupling& c) { return c.drives == angle.name; });
    };
    if (own.kind != JointKind::ball || !std::all_of(own.sequence.begin(), own.sequence.end(), follows))
      return joint;
    return static_cast<std::size_t>(model_.rig.skeleton.find_joint(own.coupled.front().joint));
  }

  // The joint that shears what lies there most: one that turns far, with about as much of the weights there
  // on its own side as on the other.
  std::optional<std::size_t> joint_to_blame(const Vector3d& place) const {
    const std::vector<double> moved = moved_by_joints(place);
    std::optional<std::size_t> out;
    double most = 0;
    for (std::size_t s = 1; s < moved.size(); ++s) {
      const double turn = turn_of(body_.pose, s), shear = turn * moved[s] * (1 - moved[s]);
      if (turn < kTurned || shear <= most) continue;
      most = shear;
      out = s;
    }
    return out;
  }

  // Of each joint, how much of the weights of the node nearest to the place it moves: its segment's, and
  // those of all segments that hang on it.
  std::vector<double> moved_by_joints(const Vector3d& place) const {
    const auto& segments = model_.rig.skeleton.segments;
    Eigen::Index nearest = 0;
    (model_.nodes.rowwise() - place.transpose().cast<float>()).rowwise().squaredNorm().minCoeff(&nearest);
    const auto node = static_cast<std::size_t>(nearest);
    std::vector<double> out(segments.size());
    for (std::uint64_t i = model_.weights.offsets[node]; i < model_.weights.offsets[node + 1]; ++i)
      for (int s = model_.weights.segment[i]; s >= 0; s = segments[static_cast<std::size_t>(s)].parent)
        out[static_cast<std::size_t>(s)] += static_cast<double>(model_.weights.weight[i]);
    return out;
  }

  // The middle of the tet that most volume is lost in, or won, of those that hold the tissue's vertices.
  Vector3d place_of(const Tissue& tissue, bool lost) const {
    double most = -std::numeric_limits<double>::infinity();
    Vector3d place = tissue.V.cast<double>().colwise().mean().transpose();
    for (const std::int32_t t : tissue.tet) {
      const auto corner = [&](int c) { return model_.nodes.row(model_.tets(t, c)); };
      const double changed = (static_cast<double>(det_f_[static_cast<std::size_t>(t)]) - 1) *
                             tet_det(corner(0), corner(1), corner(2), corner(3)) * (lost ? -1 : 1);
      if (changed <= most) continue;
      most = changed;
      place = (corner(0) + corner(1) + corner(2) + corner(3)).cast<double>().transpose() / 4;
    }
    return place;
  }

  const Model& model_;
  const runtime::PosedBody& body_;
  const runtime::PoseQuality& quality_;
  std::span<const float> det_f_;
  HowPosed how_;
};

}  // namespace

json warnings_json(const Model& model, const runtime::PosedBody& body, const runtime::PoseQuality& quality,
                   std::span<const float> det_f, const HowPosed& how) {
  const Wording wording(model, body, quality, det_f, how);
  json out = json::array();
  for (const Breach& breach : runtime::breaches(quality)) out.push_back(wording.of(breach));
  return out;
}

json clamped_json(const Skeleton& skeleton, const Pose& pose, std::span<const ClampedJoint> clamped) {
  constexpr double kAtLimit = 1e-6;  // radians
  json out = json::array();
  for (const ClampedJoint& c : clamped) {
    const auto row = static_cast<std::size_t>(c.joint);
    const Joint& joint = skeleton.segments[row].joint;
    json limits = json::array();
    if (joint.sequence.size() == 3) {
      const std::array<double, 3> angles = kinematics::angles_within_limits(joint, pose.rotation[row]);
      for (std::size_t i = 0; i < 3; ++i) {
        const AngleAxis& axis = joint.sequence[i];
        for (const double limit : {std::min(axis.min, axis.rest), std::max(axis.max, axis.rest)}) {
          // What has no limit is nowhere near it: the remainder is no number.
          if (axis.min == axis.max ||
              !(std::abs(std::remainder(angles[i] - limit, 2 * std::numbers::pi)) <= kAtLimit))
            continue;
          limits.push_back({{"angle", axis.name}, {"at_deg", limit * degrees_per_radian}});
        }
      }
    }
    out.push_back(
        {{"joint", joint.name}, {"removed_deg", c.removed * degrees_per_radian}, {"limits", limits}});
  }
  return out;
}

}  // namespace ecorche::app
