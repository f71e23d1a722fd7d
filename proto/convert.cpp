// SPDX-License-Identifier: Apache-2.0
#include <ecorche/wire/convert.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ecorche::wire {
namespace {

constexpr double kUnitTolerance = 1e-3;
// A kilometre: farther away float32 positions are no longer good to a tenth of a millimetre.
constexpr double kFarthest = 1e6;

Status invalid(std::string message) {
  return {StatusCode::invalid_argument, std::move(message)};
}

// NaN is not within reach either.
bool within_reach(const Eigen::Vector3d& v) {
  return v.array().abs().maxCoeff<Eigen::PropagateNaN>() <= kFarthest;
}

void joint_to_proto(const Joint& joint, v1::Joint& out) {
  out.set_name(joint.name);
  out.set_kind(static_cast<v1::JointKind>(static_cast<int>(joint.kind) + 1));
  to_proto(joint.center, *out.mutable_center());
  to_proto(joint.axes.col(0), *out.mutable_axis_x());
  to_proto(joint.axes.col(1), *out.mutable_axis_y());
  to_proto(joint.axes.col(2), *out.mutable_axis_z());
  for (const AngleAxis& angle : joint.sequence) {
    v1::AngleAxis& a = *out.add_sequence();
    a.set_name(angle.name);
    a.set_axis(static_cast<std::uint32_t>(angle.axis));
    a.set_negative(angle.sign < 0);
    a.set_rest(angle.rest);
    a.set_min(angle.min);
    a.set_max(angle.max);
  }
}

int find_angle(const Joint& joint, const std::string& name) {
  const auto found = std::find_if(joint.sequence.begin(), joint.sequence.end(),
                                  [&](const AngleAxis& a) { return a.name == name; });
  return found == joint.sequence.end() ? -1 : static_cast<int>(found - joint.sequence.begin());
}

// What names no joint or angle of the skeleton moves nothing, and is left out.
void couplings_to_proto(const Skeleton& skeleton, const Joint& joint, v1::Joint& out) {
  for (const Coupling& coupling : joint.coupled) {
    const int lead = skeleton.find_joint(coupling.joint);
    if (lead < 0) continue;
    const int angle = find_angle(skeleton.segments[static_cast<std::size_t>(lead)].joint, coupling.angle);
    const int driven = find_angle(joint, coupling.drives), slides = coupling.slides();
    if (angle < 0 || (slides < 0 && driven < 0)) continue;
    v1::JointCoupling& c = *out.add_coupled();
    c.set_joint(static_cast<std::uint32_t>(lead));
    c.set_angle(static_cast<std::uint32_t>(angle));
    if (slides < 0) {
      c.set_driven_angle(static_cast<std::uint32_t>(driven));
    } else {
      c.set_slide_axis(static_cast<std::uint32_t>(slides));
    }
    c.set_ratio(coupling.ratio);
  }
}
static_assert(static_cast<int>(JointKind::ball) + 1 == v1::JOINT_KIND_BALL);
static_assert(static_cast<int>(JointKind::free) + 1 == v1::JOINT_KIND_FREE);

Status joint_from_proto(const v1::Joint& joint, Joint& out) {
  if (joint.kind() < v1::JOINT_KIND_BALL || joint.kind() > v1::JOINT_KIND_FREE) {
    return invalid("skeleton: joint '" + joint.name() + "' is of unknown kind " +
                   std::to_string(joint.kind()) + " (use a newer client)");
  }
  out.name = joint.name();
  out.kind = static_cast<JointKind>(static_cast<int>(joint.kind()) - 1);
  out.center = from_proto(joint.center());
  out.axes << from_proto(joint.axis_x()), from_proto(joint.axis_y()), from_proto(joint.axis_z());
  for (const v1::AngleAxis& a : joint.sequence()) {
    if (a.axis() > 2)
      return invalid("skeleton: axis " + std::to_string(a.axis()) + " of joint '" + joint.name() +
                     "' (use 0, 1 or 2)");
    out.sequence.push_back({.name = a.name(),
                            .axis = static_cast<int>(a.axis()),
                            .sign = a.negative() ? -1.0 : 1.0,
                            .rest = a.rest(),
                            .min = a.min(),
                            .max = a.max()});
  }
  return {};
}

// After all joints, since a coupling may name a later one.
Status couplings_from_proto(const v1::Skeleton& skeleton, Rig& out) {
  for (std::size_t row = 0; row < out.skeleton.segments.size(); ++row) {
    Joint& joint = out.skeleton.segments[row].joint;
    for (const v1::JointCoupling& c : skeleton.segments(static_cast<int>(row)).joint().coupled()) {
      const bool known = c.joint() < out.skeleton.segments.size();
      const Joint* lead = known ? &out.skeleton.segments[c.joint()].joint : nullptr;
      const bool slides = c.drives_case() == v1::JointCoupling::kSlideAxis;
      if (!known || c.angle() >= lead->sequence.size() || (slides && c.slide_axis() > 2) ||
          (!slides && c.driven_angle() >= joint.sequence.size()))
        return invalid("skeleton: joint '" + joint.name + "' is coupled to what there is not");
      joint.coupled.push_back({.joint = lead->name,
                               .angle = lead->sequence[c.angle()].name,
                               .drives = slides
                                             ? std::string(1, static_cast<char>('x' + c.slide_axis())) + "_mm"
                                             : joint.sequence[c.driven_angle()].name,
                               .ratio = c.ratio()});
    }
  }
  return {};
}

}  // namespace

void to_proto(const Status& status, v1::Status& out) {
  out.set_code(static_cast<std::uint32_t>(status.code));
  out.set_message(status.message);
}

Status from_proto(const v1::Status& status) {
  const bool known = status.code() <= static_cast<std::uint32_t>(StatusCode::unauthenticated);
  return {known ? static_cast<StatusCode>(status.code()) : StatusCode::unknown, status.message()};
}

void to_proto(const Eigen::Vector3d& vector, v1::Vector3& out) {
  out.set_x(vector.x());
  out.set_y(vector.y());
  out.set_z(vector.z());
}

Eigen::Vector3d from_proto(const v1::Vector3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

void to_proto(const ImageGrid& grid, v1::Grid& out) {
  out.set_size_i(static_cast<std::uint32_t>(grid.size[0]));
  out.set_size_j(static_cast<std::uint32_t>(grid.size[1]));
  out.set_size_k(static_cast<std::uint32_t>(grid.size[2]));
  to_proto(Eigen::Vector3d(grid.origin.data()), *out.mutable_origin());
  to_proto(Eigen::Vector3d(grid.spacing.data()), *out.mutable_spacing());
  out.mutable_direction()->Assign(grid.direction.begin(), grid.direction.end());
}

Status from_proto(const v1::Grid& grid, ImageGrid& out) {
  constexpr auto largest = static_cast<std::uint32_t>(std::numeric_limits<std::int32_t>::max());
  if (grid.direction_size() != 9)
    return invalid("grid: " + std::to_string(grid.direction_size()) + " direction numbers (send 9)");
  if (grid.size_i() > largest || grid.size_j() > largest || grid.size_k() > largest)
    return invalid("grid: a size beyond 2^31");
  out.size = {static_cast<std::int32_t>(grid.size_i()), static_cast<std::int32_t>(grid.size_j()),
              static_cast<std::int32_t>(grid.size_k())};
  out.origin = {grid.origin().x(), grid.origin().y(), grid.origin().z()};
  out.spacing = {grid.spacing().x(), grid.spacing().y(), grid.spacing().z()};
  for (int i = 0; i < 9; ++i) out.direction[static_cast<std::size_t>(i)] = grid.direction(i);
  return {};
}

void to_proto(const Rig& rig, v1::Skeleton& out) {
  out.set_name(rig.skeleton.name);
  for (const Segment& segment : rig.skeleton.segments) {
    v1::Segment& s = *out.add_segments();
    s.set_name(segment.name);
    s.set_parent(segment.parent);
    joint_to_proto(segment.joint, *s.mutable_joint());
    couplings_to_proto(rig.skeleton, segment.joint, *s.mutable_joint());
    s.mutable_aliases()->Assign(segment.aliases.begin(), segment.aliases.end());
  }
}

Status from_proto(const v1::Skeleton& skeleton, Rig& out) {
  out = {};
  out.skeleton.name = skeleton.name();
  for (int i = 0; i < skeleton.segments_size(); ++i) {
    const v1::Segment& s = skeleton.segments(i);
    const bool root = i == 0;
    if (root ? s.parent() != -1 : s.parent() < 0 || s.parent() >= i) {
      return invalid("skeleton: segment '" + s.name() + "' has parent " + std::to_string(s.parent()) +
                     " (parents come first)");
    }
    Segment segment;
    segment.name = s.name();
    segment.parent = s.parent();
    segment.aliases.assign(s.aliases().begin(), s.aliases().end());
    if (Status status = joint_from_proto(s.joint(), segment.joint); !status.ok()) return status;
    out.skeleton.segments.push_back(std::move(segment));
  }
  return couplings_from_proto(skeleton, out);
}

namespace {

// A PoseUpdate or a PoseState.
template <class Message>
void fill(const Pose& pose, Message& out) {
  to_proto(pose.root_translation, *out.mutable_root_translation());
  out.clear_rotation();
  out.clear_translation();
  for (const Eigen::Quaterniond& q : pose.rotation) {
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) out.add_rotation(value);
  }
  for (std::size_t joint = 1; joint < pose.translation.size(); ++joint) {
    if (pose.translation[joint].isZero(0)) continue;
    v1::JointTranslation& translation = *out.add_translation();
    translation.set_joint(static_cast<std::uint32_t>(joint));
    to_proto(pose.translation[joint], *translation.mutable_offset());
  }
}

}  // namespace

void to_proto(const Pose& pose, v1::PoseUpdate& out) {
  fill(pose, out);
}

void to_proto(const Pose& pose, v1::PoseState& out) {
  fill(pose, out);
}

Status from_proto(const v1::PoseUpdate& update, std::size_t joints, Pose& out) {
  if (static_cast<std::size_t>(update.rotation_size()) != 4 * joints) {
    return invalid("pose: " + std::to_string(update.rotation_size()) +
                   " rotation numbers (send four per joint, " + std::to_string(4 * joints) + ")");
  }
  out = Pose::rest(joints);
  out.root_translation = from_proto(update.root_translation());
  if (!within_reach(out.root_translation))
    return invalid("pose: the root translation is no point within 1e6 mm (send finite numbers)");
  for (std::size_t joint = 0; joint < joints; ++joint) {
    const double* q = update.rotation().data() + 4 * joint;
    out.rotation[joint] = Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
    // Not finite fails it too.
    if (!(std::abs(out.rotation[joint].norm() - 1) <= kUnitTolerance)) {
      return invalid("pose: the rotation of joint " + std::to_string(joint) + " has length " +
                     std::to_string(out.rotation[joint].norm()) + " (send unit quaternions w, x, y, z)");
    }
  }
  for (const v1::JointTranslation& translation : update.translation()) {
    if (translation.joint() == 0 || translation.joint() >= joints) {
      return invalid("pose: a translation of joint " + std::to_string(translation.joint()) +
                     " (joints are 1 to " + std::to_string(joints - 1) + ")");
    }
    const Eigen::Vector3d offset = from_proto(translation.offset());
    if (!within_reach(offset)) {
      return invalid("pose: the translation of joint " + std::to_string(translation.joint()) +
                     " is no vector within 1e6 mm (send finite numbers)");
    }
    out.translation[translation.joint()] = offset;
  }
  return {};
}

}  // namespace ecorche::wire
