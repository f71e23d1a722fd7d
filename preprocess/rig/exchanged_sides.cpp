// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/exchanged_sides.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>

#include "preprocess/rig/other_side.hpp"
#include "preprocess/rig/parted_bones.hpp"

namespace ecorche::rig {
namespace {

using Eigen::Vector3d;

constexpr double kShown = 0.02;      // of the body's length: less does not tell its front from its back
constexpr double kAgainst = -0.5;    // cosine of a pair to the body's left, from which on it lies against it
constexpr double kUpright = 0.8;     // cosine of a body's up to the scan's, whose left is then the body's
constexpr double kNearer = 1.5;      // times as far from its own side as from the other
constexpr Eigen::Index kMost = 200;  // vertices of a bone that distances are measured by

// Pairs by their place in the body, and those that hang on others and may cross.
constexpr std::array<const char*, 3> kRooted{"girdle", "upper_arm", "thigh"};
constexpr std::array<std::array<const char*, 2>, 5> kHanging{
    {{"forearm", "upper_arm"}, {"hand", "forearm"}, {"shank", "thigh"}, {"foot", "shank"}, {"toes", "foot"}}};

// Vertices of all bones that a test accepts.
class Body {
 public:
  explicit Body(const Case& patient) : patient_(patient) {}

  template <class Accept>
  std::optional<Vector3d> middle(Accept&& accept) const {
    Vector3d sum = Vector3d::Zero();
    Eigen::Index count = 0;
    for (const CaseBone& bone : patient_.bones) {
      if (!accept(bone)) continue;
      sum += bone.surface.V.colwise().sum().transpose();
      count += bone.surface.V.rows();
    }
    if (count == 0) return std::nullopt;
    return Vector3d(sum / static_cast<double>(count));
  }

  std::optional<Vector3d> of(const std::string& segment) const {
    return middle([&](const CaseBone& bone) { return bone.segment == segment; });
  }

  // Of a segment without a side, or midway between those of both.
  std::optional<Vector3d> amid(const std::string& name) const {
    if (auto one = of(name)) return one;
    const auto left = of(name + "_left"), right = of(name + "_right");
    if (!left || !right) return std::nullopt;
    return Vector3d(0.5 * (*left + *right));
  }

  std::optional<Vector3d> named(std::initializer_list<const char*> words) const {
    return middle([&](const CaseBone& bone) {
      return std::any_of(words.begin(), words.end(),
                         [&](const char* word) { return bone.name.find(word) != std::string::npos; });
    });
  }

  double distance(const std::string& a, const std::string& b) const {
    const Points from = some(a), to = some(b);
    double least = std::numeric_limits<double>::infinity();
    for (Eigen::Index v = 0; v < from.rows() && to.rows() > 0; ++v)
      least = std::min(least, (to.rowwise() - from.row(v)).rowwise().squaredNorm().minCoeff());
    return std::sqrt(least);
  }

 private:
  Points some(const std::string& segment) const {
    Points all(0, 3);
    for (const CaseBone& bone : patient_.bones) {
      if (bone.segment != segment) continue;
      all.conservativeResize(all.rows() + bone.surface.V.rows(), 3);
      all.bottomRows(bone.surface.V.rows()) = bone.surface.V;
    }
    const Eigen::Index count = std::min(kMost, all.rows());
    Points out(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) out.row(i) = all.row(i * all.rows() / count);
    return out;
  }

  const Case& patient_;
};

// From the lowest to the highest of what is there; the trunk before the legs, which may be bent.
Vector3d up_along(const Body& body) {
  const std::vector<std::vector<const char*>> ways{{"pelvis", "lumbar", "thorax", "neck", "head"},
                                                   {"foot", "shank", "thigh", "pelvis"}};
  for (const auto& way : ways) {
    std::vector<Vector3d> there;
    for (const char* name : way) {
      if (const auto at = body.amid(name)) there.push_back(*at);
    }
    if (there.size() > 1) return there.back() - there.front();
  }
  return Vector3d::Zero();
}

// To the back, across `up`: what lies behind less what lies before it.
Vector3d back_across(const Body& body, const Vector3d& up) {
  const std::array<std::array<std::optional<Vector3d>, 2>, 4> pairs{
      {{body.amid("toes"), body.amid("foot")},
       {body.of("jaw"), body.of("head")},
       {body.named({"sternum", "manubrium"}), body.named({"vertebra", "spine"})},
       {body.named({"hip_", "hipbone", "innominate"}), body.named({"sacrum"})}}};
  Vector3d sum = Vector3d::Zero();
  for (const auto& [before, behind] : pairs) {
    if (before && behind) sum += *behind - *before;
  }
  return sum - up * up.dot(sum);
}

// Unit; zero where nothing says it.
Vector3d left_of(const Body& body) {
  const Vector3d along = up_along(body);
  const double length = along.norm();
  if (!(length > 0)) return Vector3d::Zero();
  const Vector3d up = along / length, back = back_across(body, up);
  if (back.norm() > kShown * length) return back.cross(up).normalized();
  if (up.z() > kUpright) return Vector3d::UnitX();
  return Vector3d::Zero();
}

// Whether the left one of a pair lies to the right.
bool lies_against(const Body& body, const std::string& name, const Vector3d& left) {
  const auto one = body.of(name + "_left"), other = body.of(name + "_right");
  if (!one || !other) return false;
  const Vector3d apart = *one - *other;
  return apart.dot(left) < kAgainst * apart.norm();
}

// Whether each of a pair is nearer to the other side's parent; nothing where one of the four is absent.
std::optional<bool> crosses(const Body& body, const std::string& name, const std::string& parent) {
  const std::array<std::string, 2> own{name + "_left", name + "_right"},
      above{parent + "_left", parent + "_right"};
  for (const std::string& segment : {own[0], own[1], above[0], above[1]}) {
    if (!body.of(segment)) return std::nullopt;
  }
  const double straight = body.distance(own[0], above[0]) + body.distance(own[1], above[1]);
  const double across = body.distance(own[0], above[1]) + body.distance(own[1], above[0]);
  return straight > kNearer * across;
}

// Segments and joints that a rule asks for.
struct Asked {
  std::set<std::string> segments, joints;
};

class Rests {
 public:
  Rests(const Case& patient, const Skeleton& skeleton, const std::set<std::string>& exchanged)
      : patient_(patient), skeleton_(skeleton), exchanged_(exchanged) {}

  // Whether a joint's own centre or axes come from exchanged bones.
  bool own(std::size_t row) {
    const auto [entry, fresh] = known_.try_emplace(row, false);  // a circle ends there
    if (!fresh) return entry->second;
    const Segment& segment = skeleton_.segments[row];
    Asked asked;
    asked.segments.insert(segment.name);
    if (segment.joint.how) {
      ask(segment.joint.how->center, asked);
      for (const auto& [axis, source] : segment.joint.how->axes) ask(source, asked);
    }
    bool rests = std::any_of(asked.segments.begin(), asked.segments.end(),
                             [&](const std::string& name) { return exchanged_.contains(name); });
    for (const std::string& joint : asked.joints) {
      const int other = skeleton_.find_joint(joint);
      rests = rests || (other >= 0 && own(static_cast<std::size_t>(other)));
    }
    return known_[row] = rests;
  }

 private:
  void ask(const RegionUse& on, Asked& asked) const {
    asked.segments.insert({on.segment, on.facing_segment});
    for (const Region& region : patient_.regions) {
      if (region.name == on.region) asked.segments.insert({region.segment, region.near});
    }
    for (const CaseBone& bone : patient_.bones) {
      if (bone.name == on.bone || bone.name == on.facing) asked.segments.insert(bone.segment);
    }
  }
  void ask(const PointSource& source, Asked& asked) const {
    ask(source.on, asked);
    if (!source.joint.empty()) asked.joints.insert(source.joint);
    for (const PointSource& part : source.parts) ask(part, asked);
  }
  void ask(const DirectionSource& source, Asked& asked) const {
    ask(source.from, asked);
    ask(source.to, asked);
    if (!source.joint.empty()) asked.joints.insert(source.joint);
    for (const DirectionSource& choice : source.choices) ask(choice, asked);
  }

  const Case& patient_;
  const Skeleton& skeleton_;
  const std::set<std::string>& exchanged_;
  std::map<std::size_t, bool> known_;
};

}  // namespace

std::set<std::string> exchanged_sides(const Case& patient) {
  if (patient.generic || (patient.skeleton.name != "human" && !is_parted(patient.skeleton))) return {};
  const Body body(patient);
  const Vector3d left = left_of(body);
  if (left.isZero()) return {};
  std::map<std::string, bool> against;
  for (const char* name : kRooted) against[name] = lies_against(body, name, left);
  for (const auto& [name, parent] : kHanging) {
    const auto by_parent = crosses(body, name, parent);
    against[name] = by_parent ? *by_parent != against[parent] : lies_against(body, name, left);
  }
  std::set<std::string> out;
  for (const auto& [name, is] : against) {
    if (is) out.insert({name + "_left", name + "_right"});
  }
  return out;
}

void warn_exchanged(const std::set<std::string>& exchanged, const Context& context) {
  if (exchanged.empty()) return;
  std::string names;
  for (const std::string& name : exchanged) {
    if (name.ends_with("_left")) names += (names.empty() ? "" : ", ") + name;
  }
  context.warn("sides: the bones of " + names +
               " lie on the right of the body, and those of the other side on its left: joints that rest on "
               "them have a confidence of 40 % at most (exchange left and right in the names of these bones "
               "or of their labels; where it is all of them, the image may be mirrored: mend its axes)");
}

std::vector<bool> resting_on(const Case& patient, const Skeleton& skeleton,
                             const std::set<std::string>& exchanged) {
  std::vector<bool> out(skeleton.segments.size());
  if (exchanged.empty()) return out;
  Rests rests(patient, skeleton, exchanged);
  for (std::size_t row = 0; row < out.size(); ++row) {
    const Segment& segment = skeleton.segments[row];
    const bool measured = segment.parent >= 0 && segment.joint.how && segment.joint.how->measured_rest;
    out[row] = rests.own(row) || (measured && rests.own(static_cast<std::size_t>(segment.parent)));
  }
  return out;
}

}  // namespace ecorche::rig
