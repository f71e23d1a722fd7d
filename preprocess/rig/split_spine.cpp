// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/split_spine.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "core/values/spine.hpp"
#include "core/values/text.hpp"
#include "preprocess/rig/joint_sources.hpp"
#include "preprocess/rig/parted_bones.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::set<std::string> segments_of(const Case& patient) {
  std::set<std::string> out;
  for (const CaseBone& bone : patient.bones) out.insert(bone.segment);
  return out;
}

PointSource plane_of(const std::string& segment, const std::string& facing, const Vector3d& looks) {
  PointSource out;
  out.rule = CenterRule::plane_fit;
  out.on.segment = segment;
  out.on.facing_segment = facing;
  out.on.looks = looks;
  return out;
}

// The middle of the disc: amid the end plates, which look at each other; else of all that faces.
std::shared_ptr<const JointRule> amid(const std::string& above, const std::string& below,
                                      const Vector3d& up) {
  PointSource plates;
  plates.rule = CenterRule::between;
  plates.parts = {plane_of(above, below, -up), plane_of(below, above, up)};
  PointSource facing;
  facing.rule = CenterRule::between;
  facing.parts = {plane_of(above, below, Vector3d::Zero()), plane_of(below, above, Vector3d::Zero())};
  for (PointSource& part : facing.parts) part.rule = CenterRule::centroid;
  auto rule = std::make_shared<JointRule>();
  rule->center.rule = CenterRule::first_good;
  rule->center.parts = {plates, facing};
  return rule;
}

// Along z, with x as near to `x` as that leaves it.
Matrix3d axes_along(const Vector3d& z, const Vector3d& x) {
  Matrix3d out;
  out.col(2) = z.normalized();
  out.col(0) = (x - x.dot(out.col(2)) * out.col(2)).normalized();
  out.col(1) = out.col(2).cross(out.col(0));
  return out;
}

constexpr std::string_view kHead = "head", kThorax = "thorax";

// Ribs face each other, too, and would draw the joints of their vertebrae forward.
Case without_ribs(const Case& patient) {
  Case out;
  out.name = patient.name;
  out.skeleton = patient.skeleton;
  for (const CaseBone& bone : patient.bones) {
    if (!patient.ribs.contains(bone.name)) out.bones.push_back({bone.name, bone.segment, bone.surface});
  }
  return out;
}

Vector3d middle_of(const Case& patient, const std::string& segment) {
  Vector3d sum = Vector3d::Zero();
  double count = 0;
  for (const CaseBone& bone : patient.bones) {
    if (bone.segment != segment || patient.ribs.contains(bone.name)) continue;
    sum += bone.surface.V.colwise().sum().transpose();
    count += static_cast<double>(bone.surface.V.rows());
  }
  return count > 0 ? Vector3d(sum / count) : Vector3d::Zero();
}

Vector3d nearest_to(const Vector3d& point, const Case& patient, const std::string& segment) {
  Vector3d out = point;
  double least = std::numeric_limits<double>::infinity();
  for (const CaseBone& bone : patient.bones) {
    if (bone.segment != segment || bone.surface.V.rows() == 0) continue;
    Eigen::Index row = 0;
    const double squared =
        (bone.surface.V.rowwise() - point.transpose()).rowwise().squaredNorm().minCoeff(&row);
    if (squared >= least) continue;
    least = squared;
    out = bone.surface.V.row(row);
  }
  return out;
}

class Spine {
 public:
  Spine(const Case& patient, const Rig& whole, const std::vector<JointEvidence>* seen)
      : patient_(patient), whole_(whole), seen_(seen) {
    rig_.skeleton = spine::split(whole.skeleton, segments_of(patient),
                                 patient.ribs_apart ? spine::Ribs::vertebrae : spine::Ribs::cage);
    rig_.fits.resize(segments().size());
    evidence_.resize(segments().size());
  }

  void run(const Context& context) {
    const Skeleton asked = with_rules();
    const Case vertebrae = without_ribs(patient_);
    JointSources sources(vertebrae, asked);
    const std::vector<int> same = joints_of_whole();
    for (std::size_t row = 0; row < segments().size(); ++row) {
      context.check_stop();
      if (segments()[row].name == kThorax && segments()[row].joint.kind == JointKind::fixed) {
        ride(row);
      } else if (asked.segments[row].joint.how) {
        const FoundPoint& found = sources.center(row);
        const bool surer = same[row] < 0 || found.fit.confidence > sure_in_whole(same[row]);
        surer ? find(row, found) : take(row, same[row]);
      } else {
        take(row, same[row]);
      }
      rig_.fits[row].joint = segments()[row].joint.name;
      segments()[row].joint.rule = rig_.fits[row].rule;
    }
    for (std::size_t row = 0; row < segments().size(); ++row) {
      if (spine::find_level(segments()[row].name) != nullptr) turn(row);
    }
    tell_absent(context);
    tell_unsure(context);
  }

  Rig rig() { return std::move(rig_); }
  std::vector<JointEvidence> evidence() { return std::move(evidence_); }

 private:
  std::vector<Segment>& segments() { return rig_.skeleton.segments; }

  // Between two levels the joint is looked for; elsewhere it is that of `whole`.
  Skeleton with_rules() {
    Skeleton out = rig_.skeleton;
    for (Segment& segment : out.segments) {
      if (spine::find_level(segment.name) == nullptr || segment.parent < 0) continue;
      const std::string& below = segments()[static_cast<std::size_t>(segment.parent)].name;
      if (spine::find_level(below) == nullptr) continue;
      const Vector3d up = middle_of(patient_, segment.name) - middle_of(patient_, below);
      segment.joint.how = amid(segment.name, below, up.normalized());
    }
    return out;
  }

  // The row in `whole` of the joint that a segment turns about: its own, or that of the part of the spine
  // whose lowest bone it is; -1 of all other levels, and of a thorax that rides on one.
  std::vector<int> joints_of_whole() {
    std::vector<int> out;
    std::set<std::string> begun;
    for (const Segment& segment : segments()) {
      const bool own = whole_.skeleton.find_joint(segment.joint.name) >= 0;
      const bool first = !own && segment.joint.kind != JointKind::fixed &&
                         begun.insert(spine::whole_segment(segment.name)).second;
      out.push_back(own     ? whole_.skeleton.find_joint(segment.joint.name)
                    : first ? whole_.skeleton.find_segment(spine::whole_segment(segment.name))
                            : -1);
    }
    return out;
  }

  double sure_in_whole(int row) const { return whole_.fits[static_cast<std::size_t>(row)].confidence; }

  void take(std::size_t row, int of_whole) {
    const auto from = static_cast<std::size_t>(of_whole);
    Joint& joint = segments()[row].joint;
    joint.center = whole_.skeleton.segments[from].joint.center;
    joint.axes = whole_.skeleton.segments[from].joint.axes;
    rig_.fits[row] = whole_.fits[from];
    if (seen_ != nullptr) evidence_[row] = (*seen_)[from];
  }

  // Fixed, where the thorax is nearest to the vertebra that carries it: as sure as that one's own.
  void ride(std::size_t row) {
    const auto on = static_cast<std::size_t>(segments()[row].parent);
    const Vector3d at = nearest_to(middle_of(patient_, segments()[on].name), patient_, segments()[row].name);
    segments()[row].joint.center = at;
    segments()[row].joint.axes = segments()[on].joint.axes;
    rig_.fits[row] = rig_.fits[on];
    rig_.fits[row].rule = CenterRule::facing;
    evidence_[row] = evidence_[on];
    evidence_[row].at = at;
  }

  void find(std::size_t row, const FoundPoint& found) {
    segments()[row].joint.center = found.at;
    rig_.fits[row] = found.fit;
    double& sure = rig_.fits[row].confidence;
    if (is_parted(*patient_.whole_spine))
      sure = std::min(sure, parted_confidence(segments()[row].joint.name));
    evidence_[row] = evidence_of(found, sure, sure);
  }

  // About an axis towards the joint above, and to the left as the joint that leads has it. The head keeps
  // that of `human`.
  void turn(std::size_t row) {
    const Joint& own = segments()[row].joint;
    for (std::size_t above = row + 1; above < segments().size(); ++above) {
      if (segments()[above].parent != static_cast<int>(row) ||
          spine::find_level(segments()[above].name) == nullptr)
        continue;
      const int leads = whole_.skeleton.find_joint(own.coupled.at(0).joint);
      segments()[row].joint.axes =
          axes_along(segments()[above].joint.center - own.center,
                     whole_.skeleton.segments[static_cast<std::size_t>(leads)].joint.axes.col(0));
      return;
    }
    if (segments()[row].name != kHead)
      segments()[row].joint.axes = segments()[static_cast<std::size_t>(segments()[row].parent)].joint.axes;
  }

  void tell_absent(const Context& context) {
    std::vector<std::string> absent;
    for (const spine::Level& level : spine::levels()) {
      if (whole_.skeleton.find_segment(level.part) > 0 && rig_.skeleton.find_segment(level.segment) < 0)
        absent.emplace_back(level.segment);
    }
    if (absent.empty()) return;
    context.warn("spine: " + text::joined(absent) +
                 " have no bone of their own: their turns go to the next level above, else below (label them "
                 "one by one, if they are in the scan)");
  }

  // Those that the whole spine has are told there.
  void tell_unsure(const Context& context) {
    std::vector<std::string> unsure;
    for (std::size_t row = 0; row < segments().size(); ++row) {
      const JointFit& fit = rig_.fits[row];
      if (spine::find_level(segments()[row].name) == nullptr ||
          fit.confidence >= JointSources::least_confidence)
        continue;
      unsure.push_back(fit.joint + " (" + text::number(fit.confidence, 2) + ")");
    }
    if (unsure.empty()) return;
    context.warn("spine: the centres of " + text::joined(unsure) +
                 " have a low confidence: their vertebrae show each other no plain end plates (give " +
                 "vertebrae that are segmented apart, or leave out spine: vertebrae)");
  }

  const Case& patient_;
  const Rig& whole_;
  const std::vector<JointEvidence>* seen_;
  Rig rig_;
  std::vector<JointEvidence> evidence_;
};

}  // namespace

Case with_whole_spine(const Case& patient) {
  Case out;
  out.name = patient.name;
  out.skeleton = *patient.whole_spine;
  out.regions = patient.regions;
  for (const CaseBone& bone : patient.bones)
    out.bones.push_back({bone.name, spine::whole_segment(bone.segment), bone.surface});
  return out;
}

Rig split_spine(const Case& patient, const Rig& whole, const Context& context,
                std::vector<JointEvidence>* evidence) {
  Spine found(patient, whole, evidence);
  found.run(context);
  if (evidence != nullptr) *evidence = found.evidence();
  return found.rig();
}

}  // namespace ecorche::rig
