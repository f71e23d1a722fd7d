// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/joints.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>

#include <ecorche/values/error.hpp>
#include "core/values/degrees.hpp"
#include "core/values/text.hpp"
#include "preprocess/check/frames.hpp"
#include "preprocess/check/joint_places.hpp"
#include "preprocess/check/lost_segments.hpp"
#include "preprocess/check/skin_fault.hpp"
#include "preprocess/rig/fit_rig.hpp"

namespace ecorche::check {
namespace {

using Eigen::Vector3d;

constexpr double kOutside = 0.02;  // of the longer bone: surfaces of skin and bones are no truer
// Hinges of limbs stand across the shafts of both bones: condyles 80 to 96 degrees to the femur (Paley 2002),
// an elbow's axis 75 to 100 to the humerus (London 1981) and, by the carrying angle of up to 28 (Zampagni et
// al. 2008), 62 to the forearm. Nothing flexes beyond 45 degrees of square.
constexpr double kAcross = 45;
constexpr double kLostSkin = 3;      // bones longer than so many skins are in no such skin
constexpr double kAlone = 0.5;       // of a bone's length: the middle of any lies nearer
constexpr double kExchanged = 0.25;  // of the shorter bone's length; and what may be left of the distances

std::string millimetres(double x) {
  return x < 1000 ? text::number(x) + " mm" : std::to_string(std::llround(x)) + " mm";
}

std::string place(const Vector3d& p) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "[%.1f, %.1f, %.1f]", p.x(), p.y(), p.z());
  return text.data();
}

bool flexes(const Joint& joint) {
  if (joint.kind != JointKind::hinge || joint.sequence.empty()) return false;
  const std::string& name = joint.sequence[0].name;
  return name.find("flexion") != std::string::npos || name.find("extension") != std::string::npos;
}

// A change of the skeleton's coordinates that somebody may have forgotten.
struct Change {
  std::function<Vector3d(const Vector3d&)> apply;
  std::string mend;
};

std::vector<Change> changes() {
  std::vector<Change> out;
  const auto scaled = [&](double factor, const std::string& how) {
    out.push_back({[factor](const Vector3d& p) -> Vector3d { return factor * p; },
                   how + " it would lie at its bones: the skeleton's centers are in another unit than the "
                         "meshes (unit: stands at the case and at each entry)"});
  };
  scaled(0.001, "made 1000 times smaller");
  scaled(1000, "made 1000 times larger");
  scaled(0.1, "made 10 times smaller");
  scaled(10, "made 10 times larger");
  scaled(0.01, "made 100 times smaller");
  scaled(100, "made 100 times larger");
  const auto turned = [&](const std::string& how, auto&& turn) {
    out.push_back({turn, how + " it would lie at its bones: the skeleton's centers are in another frame than "
                               "the meshes (frame: stands at the case and at each entry)"});
  };
  turned("with x and y negated", [](const Vector3d& p) -> Vector3d { return {-p.x(), -p.y(), p.z()}; });
  turned("with x negated", [](const Vector3d& p) -> Vector3d { return {-p.x(), p.y(), p.z()}; });
  turned("with y negated", [](const Vector3d& p) -> Vector3d { return {p.x(), -p.y(), p.z()}; });
  turned("with y and z exchanged", [](const Vector3d& p) -> Vector3d { return {p.x(), -p.z(), p.y()}; });
  return out;
}

class Joints {
 public:
  Joints(const Case& patient, const Rig& rig, const Inside& in_skin)
      : patient_(patient),
        in_skin_(in_skin),
        skeleton_(rig.skeleton),
        bones_(bones_of(patient, rig.skeleton)),
        in_bones_(bones_.size()) {}

  std::vector<Finding> run(const Context& context) {
    for (std::size_t row = 0; row < skeleton_.segments.size(); ++row) {
      context.check_stop();
      check_exchange(row);
    }
    for (std::size_t row = 0; row < skeleton_.segments.size(); ++row) {
      context.check_stop();
      if (skeleton_.segments[row].boneless) continue;
      check_center(row);
      check_axis(row);
    }
    return std::move(findings_);
  }

 private:
  const Joint& joint(std::size_t row) const { return skeleton_.segments[row].joint; }
  const std::string& segment(std::size_t row) const { return skeleton_.segments[row].name; }
  bool is_root(std::size_t row) const { return skeleton_.segments[row].parent < 0; }
  std::size_t parent(std::size_t row) const {
    return static_cast<std::size_t>(skeleton_.segments[row].parent);
  }

  void add_finding(std::size_t row, std::string what, std::string mend) {
    findings_.push_back({patient_.generic ? Severity::warning : Severity::error, "joint " + joint(row).name,
                         std::move(what), joint(row).center, std::move(mend)});
  }

  // Whether its centre was said, not found.
  bool is_given(std::size_t row) const {
    const int at = patient_.skeleton.find_joint(joint(row).name);
    if (at < 0 || patient_.generic) return false;
    const Joint& asked = patient_.skeleton.segments[static_cast<std::size_t>(at)].joint;
    return asked.how ? asked.how->center.rule == CenterRule::given : asked.rule == CenterRule::given;
  }

  double beyond_skin(const Vector3d& p) const {
    if (patient_.skin.F.rows() == 0) return 0;
    if (in_skin_(p)) return 0;
    if (!skin_) skin_ = std::make_unique<geometry::FaceTree>(patient_.skin);
    return std::sqrt(skin_->nearest(p).squared);
  }

  // A root joins nothing: it may lie between the feet, or beyond where a scan ends, but not in another unit.
  bool possible(std::size_t row, const Vector3d& at) const {
    const Place is = place_of(skeleton_, bones_, row, at);
    if (is_root(row)) return !std::isfinite(is.own) || is.own <= 2 * body_length(patient_);
    // One bone alone: its joint joins nothing, and is the middle of the bone (of a skull, in its hollow).
    if (!bones_[parent(row)].tree && !is_given(row)) return is.own <= kAlone * is.length;
    const auto near = [&] {
      if (is.nearest() <= is.near()) return true;
      const auto gap = gap_between(bones_[row], bones_[parent(row)]);
      return gap && is.nearest() <= is.near() + gap->mm;
    };
    const double some = kOutside * is.length;
    return (near() && (is.nearest() <= some || beyond_skin(at) <= some)) || in_bones(row, at) ||
           in_bones(parent(row), at);
  }

  // A femoral head's middle is right, though it lies deep in the bone and the scan's skin may end below it.
  bool in_bones(std::size_t row, const Vector3d& p) const {
    if (!bones_[row].tree || !bones_[row].box.contains(p)) return false;
    std::unique_ptr<Inside>& inside = in_bones_[row];
    if (!inside) inside = std::make_unique<Inside>(bones_[row].surface);
    return (*inside)(p);
  }

  // A joint right at its bones lies outside because the skin does not enclose them: its fault, told once.
  bool blame_skin(std::size_t row) {
    const Vector3d& at = joint(row).center;
    const Place is = place_of(skeleton_, bones_, row, at);
    const double out = beyond_skin(at);
    if (is_root(row) || out == 0 || is.nearest() > is.near()) return false;
    if (!fault_) fault_ = skin_fault(patient_.skin);
    if (!*fault_) return false;
    if (!blamed_)
      findings_.push_back({patient_.generic ? Severity::warning : Severity::error, patient_.skin_name,
                           (*fault_)->what + ", so that the " + joint(row).name + ", " +
                               millimetres(is.nearest()) + " from its bones, lies " + millimetres(out) +
                               " outside of what it encloses",
                           at, (*fault_)->mend});
    blamed_ = true;
    return true;
  }

  void check_center(std::size_t row) {
    const Vector3d& at = joint(row).center;
    if (possible(row, at) || blame_skin(row)) return;
    const Place is = place_of(skeleton_, bones_, row, at);
    std::string what = "its center " + place(at) + " lies ";
    const double out = beyond_skin(at);
    if (out > 0) what += millimetres(out) + " outside the skin, ";
    what += millimetres(is.own) + " from the bones of '" + segment(row) + "'";
    if (!is_root(row) && std::isfinite(is.parent))
      what += " and " + millimetres(is.parent) + " from those of '" + segment(parent(row)) + "'";
    add_finding(row, what, advice(row));
  }

  std::string advice(std::size_t row) const {
    if (is_given(row)) {
      for (const Change& change : changes()) {
        bool mends = possible(row, change.apply(joint(row).center)), joined = false;
        for (std::size_t other = 0; other < skeleton_.segments.size() && mends; ++other) {
          if (!is_given(other) || is_root(other)) continue;
          mends = possible(other, change.apply(joint(other).center));
          joined = true;
        }
        // A root alone is near anything: another joint must say so too.
        if (mends && joined) return change.mend;
      }
    }
    const auto gap = is_root(row) ? std::nullopt : gap_between(bones_[row], bones_[parent(row)]);
    const std::string meet = gap ? "the bones come nearest to each other at " + place(gap->amid) : "";
    if (is_given(row) && gap) return meet + ": say its center there, or give it a rule that finds it";
    if (gap) return meet + ": mend the segments of these bones, or say its center";
    return "say where it is: its center as [x, y, z], in the case's frame and unit";
  }

  // What the joints of both, and of all that hangs on them, are off their bones; as it is, and exchanged.
  std::pair<double, double> apart(std::size_t a, std::size_t b) const {
    double now = 0, then = 0;
    const auto add = [&](std::size_t row, std::size_t bones, std::size_t others) {
      const double is = bones_[bones].distance(joint(row).center),
                   would = bones_[others].distance(joint(row).center);
      now += is;
      then += would;
    };
    if (joint(a).kind != JointKind::free) add(a, a, b);
    for (std::size_t row = 0; row < skeleton_.segments.size(); ++row) {
      if (is_root(row) || row == b) continue;
      if (parent(row) == a) add(row, a, b);
      if (parent(row) == b) add(row, b, a);
    }
    return {now, then};
  }

  void check_exchange(std::size_t row) {
    if (is_root(row)) return;
    const std::size_t a = parent(row), b = row;
    if (!bones_[a].tree || !bones_[b].tree) return;
    const auto [now, then] = apart(a, b);
    if (now - then <= kExchanged * std::min(bones_[a].length(), bones_[b].length()) ||
        then > kExchanged * now)
      return;
    add_finding(row,
                "the joints of '" + segment(a) + "' and '" + segment(b) + "' lie " + millimetres(now) +
                    " from their bones, and " + millimetres(then) + " were those bones exchanged",
                "exchange the segments of their bones");
  }

  void check_axis(std::size_t row) {
    if (!flexes(joint(row)) || is_root(row)) return;
    const Vector3d axis = joint(row).axes.col(joint(row).sequence[0].axis);
    for (const std::size_t of : {row, parent(row)}) {
      if (!bones_[of].shaft) continue;
      // A hand's or a foot's bones side by side have no shaft, though they are wide: the joint lies at its
      // end.
      const Vector3d from = bones_[of].middle() - joint(row).center;
      if (std::abs(bones_[of].shaft->dot(from)) < 0.9 * from.norm()) continue;
      const double angle =
          std::acos(std::min(1.0, std::abs(axis.dot(*bones_[of].shaft)))) * degrees_per_radian;
      if (angle >= 90 - kAcross) continue;
      add_finding(row,
                  "its axis stands " + text::number(angle) + " degrees to the shaft of '" + segment(of) +
                      "': no hinge that flexes turns a bone about its own shaft",
                  "give it axes that stand across both bones");
      return;
    }
  }

  const Case& patient_;
  const Inside& in_skin_;
  const Skeleton& skeleton_;
  std::vector<SegmentBones> bones_;
  // Made when first asked for: most joints need none.
  mutable std::vector<std::unique_ptr<Inside>> in_bones_;
  mutable std::unique_ptr<geometry::FaceTree> skin_;
  std::vector<Finding> findings_;
  std::optional<std::optional<SkinFault>> fault_;  // of the skin, looked for where it matters
  bool blamed_ = false;                            // it has been told
};

}  // namespace

double body_length(const Case& patient) {
  Eigen::AlignedBox3d box;
  const auto add = [&](const SurfaceMesh& mesh) {
    for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) box.extend(Vector3d(mesh.V.row(v).transpose()));
  };
  add(patient.skin);
  if (box.isEmpty()) {
    for (const CaseBone& bone : patient.bones) add(bone.surface);
  }
  return box.isEmpty() ? 0 : box.sizes().maxCoeff();
}

// A skin that would be lost in its bones is in another unit than they.
std::optional<Finding> lost_skin(const Case& patient) {
  Eigen::AlignedBox3d all, skin;
  for (const CaseBone& bone : patient.bones) {
    for (Eigen::Index v = 0; v < bone.surface.V.rows(); ++v) all.extend(bone.surface.V.row(v).transpose());
  }
  for (Eigen::Index v = 0; v < patient.skin.V.rows(); ++v) skin.extend(patient.skin.V.row(v).transpose());
  if (all.isEmpty() || skin.isEmpty()) return std::nullopt;
  const double bones = all.sizes().maxCoeff(), own = skin.sizes().maxCoeff();
  if (!(bones > kLostSkin * own)) return std::nullopt;
  const double factor = unit_factor(own, bones, kLostSkin * bones);
  return Finding{Severity::error,
                 patient.skin_name,
                 "is " + millimetres(own) + " long, the bones " + millimetres(bones),
                 {},
                 factor > 0 ? "mend its unit: made " + text::number(factor, 6) +
                                  " times larger it would be " + millimetres(factor * own)
                            : "give the skin of these bones, in their unit"};
}

// Against the bounds that the skeleton's file gives.
std::vector<Finding> wrong_size(const Case& patient) {
  const double length = body_length(patient);
  if (!patient.size || length == 0) return {};
  const BodySize& size = *patient.size;
  const auto& segments = patient.skeleton.segments;
  const auto without =
      std::count_if(segments.begin(), segments.end(), [](const Segment& s) { return s.boneless; });
  const auto owned = static_cast<std::size_t>(
      without + std::count_if(segments.begin(), segments.end(), [&](const Segment& s) {
        return std::any_of(patient.bones.begin(), patient.bones.end(),
                           [&](const CaseBone& bone) { return bone.segment == s.name; });
      }));
  const bool whole = 4 * owned >= 3 * segments.size();
  const double least = whole ? size.whole : size.least;
  if (length >= least && length <= size.most) return {};
  Finding out{Severity::error, "size", "", {}, "mend the unit of the case and its files"};
  out.what = "the body is " + millimetres(length) + " long, one for the skeleton '" + patient.skeleton.name +
             "' is " + millimetres(least) + " to " + millimetres(size.most);
  constexpr std::pair<double, const char*> kUnits[] = {{1000, "m"}, {10, "cm"}, {25.4, "in"}, {1e-3, "um"}};
  for (const auto& [factor, unit] : kUnits) {
    if (!(factor * length >= size.whole && factor * length <= size.most)) continue;
    out.mend =
        std::string("with unit: ") + unit + " in place of mm it would be " + millimetres(factor * length);
    return {out};
  }
  for (const double factor : {1e-3, 1e-2, 1e-1, 1 / 25.4}) {
    if (!(factor * length >= size.whole && factor * length <= size.most)) continue;
    out.mend = "made " + text::number(1 / factor) + " times smaller it would be " +
               millimetres(factor * length) + ": mend unit: of the case, or of its files";
    break;
  }
  return {out};
}

std::vector<Finding> size_findings(const Case& patient) {
  std::vector<Finding> out = wrong_size(patient);
  if (!out.empty()) return out;
  if (std::optional<Finding> lost = lost_skin(patient)) out.push_back(std::move(*lost));
  return out;
}

std::vector<Finding> joint_findings(const Case& patient, const Rig& rig, const Inside& in_skin,
                                    const Context& context) {
  return Joints(patient, rig, in_skin).run(context);
}

void inspect_joints(const Case& patient, const Context& context, Report& report) {
  std::vector<Finding> found = size_findings(patient);
  report.findings.insert(report.findings.end(), found.begin(), found.end());
  if (!report.possible()) return;
  Context inner = context;
  inner.log = [&](LogLevel level, std::string_view line) {
    if (level != LogLevel::warning || line.starts_with("segment ")) return;  // `inspect` names those itself
    const std::string advice = " (" + std::string(rig::joint_advice) + ")";
    if (line.ends_with(advice)) line.remove_suffix(advice.size());
    const std::size_t colon = line.find(": ");
    report.findings.push_back(
        {Severity::warning,
         std::string(line.substr(0, colon)),
         std::string(colon == std::string_view::npos ? line : line.substr(colon + 2)),
         {},
         std::string(rig::joint_advice) + "; ecorche rig says how well each was found"});
  };
  try {
    const Rig rig = rig::fit(patient, inner);
    const Inside in_skin(patient.skin);
    found = joint_findings(patient, rig, in_skin, context);
    for (Finding& lost : lost_segments(patient, in_skin)) found.push_back(std::move(lost));
    report.findings.insert(report.findings.end(), found.begin(), found.end());
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::config && error.kind() != ErrorKind::data) throw;
    report.findings.push_back({Severity::error, error.where(), error.problem(), {}, error.mend()});
  }
}

void refuse(const std::vector<Finding>& findings) {
  const auto is_error = [](const Finding& f) { return f.severity == Severity::error; };
  const auto first = std::find_if(findings.begin(), findings.end(), is_error);
  if (first == findings.end()) return;
  const auto more = std::count_if(first + 1, findings.end(), is_error);
  throw Error(ErrorKind::data, first->where, first->what,
              first->mend + (more > 0 ? "; ecorche check names " + std::to_string(more) + " more" : ""));
}

}  // namespace ecorche::check
