// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/ik.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/kinematics/angles.hpp"
#include "core/kinematics/forward.hpp"
#include "core/values/error.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Angles = std::array<double, 3>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLook = 200;         // mm: where a look's error is counted
constexpr double kLargestStep = 0.6;  // radians of one angle in one step
constexpr double kFirstDamping = 30;  // mm a radian
constexpr double kLeastDamping = 0.3, kMostDamping = 3e4;
constexpr double kRootUnit = 300;                  // mm of the root's way that count as a radian
constexpr int kPatience = 4;                       // steps that gain less than a hundredth
constexpr double kStarts[] = {0, 0.15, 0.5, 0.8};  // of the way to the middle of the ranges

// One number that the solver may change: an angle of a joint, or a turn (3 to 5: x, y, z of the room) or a
// way (6 to 8) of the root.
struct Freedom {
  std::size_t joint = 0;
  std::size_t kind = 0;
  double low = -kInfinity, high = kInfinity;
};

// An angle that follows another.
struct Follower {
  std::size_t joint, angle;
  std::size_t lead_joint, lead_angle;
  double ratio;
};

Quaterniond turn(const AngleAxis& a, double value) {
  return Quaterniond(Eigen::AngleAxisd(a.sign * value, Vector3d::Unit(a.axis)));
}

std::size_t angle_row(const Joint& joint, const std::string& name) {
  std::size_t i = 0;
  while (i < joint.sequence.size() && joint.sequence[i].name != name) ++i;
  return i;
}

// The ends of an angle's range as `clamp` has them.
std::pair<double, double> range(const Joint& joint, std::size_t i) {
  const bool limited = std::any_of(joint.sequence.begin(), joint.sequence.end(), [](const AngleAxis& a) {
    return std::isfinite(a.min) || std::isfinite(a.max);
  });
  const AngleAxis& a = joint.sequence[i];
  const bool several = joint.kind == JointKind::ball || joint.kind == JointKind::free;
  if (several && !limited) return {-kInfinity, kInfinity};
  const double open = i == 1 ? std::numbers::pi / 2 : std::numbers::pi;
  return {std::min(std::isfinite(a.min) ? a.min : -open, a.rest),
          std::max(std::isfinite(a.max) ? a.max : open, a.rest)};
}

class Solver {
 public:
  Solver(const Rig& rig, const IkProblem& problem)
      : rig_(rig), problem_(problem), segments_(rig.skeleton.segments), motion_(segments_.size()) {
    for (const IkTarget& target : problem.targets) add_chain(target.segment);
    for (const IkLook& look : problem.looks) add_chain(look.segment);
    find_freedoms();
  }

  IkResult solve(const Pose& start) {
    IkResult out;
    State best;
    double least = kInfinity;
    const State begin = state_of(start);
    for (const double share : kStarts) {
      State state = begin;
      to_the_middle(state, share);
      Eigen::VectorXd error = errors(state);
      out.steps += descend(state, error, problem_.most_steps);
      if (error.squaredNorm() < least) {
        least = error.squaredNorm();
        best = state;
        out.reached = within(error);
      }
      if (out.reached) break;
    }
    std::vector<ClampedJoint> ignored;
    constrain(rig_.skeleton, best.pose, ignored);
    forward(rig_, best.pose, motion_);
    for (const IkTarget& target : problem_.targets)
      out.away_mm.push_back((motion_[target.segment] * target.point - target.goal).norm());
    for (const IkLook& look : problem_.looks) out.off.push_back(off(look));
    out.pose = std::move(best.pose);
    return out;
  }

 private:
  struct State {
    Pose pose;
    std::vector<Angles> angle;  // of joints whose angles the solver changes
  };

  // Which joints move a goal's point: those from its segment up.
  void add_chain(std::size_t segment) {
    if (segment >= segments_.size())
      throw Error(ErrorKind::internal, "inverse kinematics", "no segment " + std::to_string(segment),
                  "name a segment of the rig");
    std::vector<char> chain(segments_.size(), 0);
    for (int s = static_cast<int>(segment); s >= 0; s = segments_[static_cast<std::size_t>(s)].parent)
      chain[static_cast<std::size_t>(s)] = 1;
    chains_.push_back(std::move(chain));
  }

  void find_freedoms() {
    std::vector<std::array<bool, 3>> driven(segments_.size(), {false, false, false});
    for (std::size_t j = 0; j < segments_.size(); ++j) {
      for (const Coupling& c : segments_[j].joint.coupled) {
        const int lead = rig_.skeleton.find_joint(c.joint);
        if (lead < 0) continue;  // `constrain` tells
        const auto l = static_cast<std::size_t>(lead);
        const std::size_t angle = angle_row(segments_[j].joint, c.drives),
                          leads = angle_row(segments_[l].joint, c.angle);
        if (angle > 2 || leads > 2) continue;
        driven[j][angle] = true;
        followers_.push_back({j, angle, l, leads, c.ratio});
      }
    }
    for (std::size_t j = 0; j < segments_.size(); ++j) {
      const Joint& joint = segments_[j].joint;
      if (segments_[j].parent < 0) {
        for (std::size_t k = 3; problem_.move_root && k < 9; ++k)
          free_.push_back({j, k, -kInfinity, kInfinity});
        continue;
      }
      const bool used = std::any_of(chains_.begin(), chains_.end(), [&](const auto& c) { return c[j] != 0; });
      const bool leads =
          std::any_of(followers_.begin(), followers_.end(), [&](const auto& f) { return f.lead_joint == j; });
      if (joint.kind == JointKind::fixed || (!used && !leads)) continue;
      const std::size_t count = joint.kind == JointKind::hinge       ? 1
                                : joint.kind == JointKind::universal ? 2
                                                                     : 3;
      for (std::size_t i = 0; i < count; ++i) {
        if (driven[j][i]) continue;
        const auto [low, high] = range(joint, i);
        free_.push_back({j, i, low, high});
      }
    }
  }

  // Angles of every joint; of the two triples of a rotation the one within the limits.
  State state_of(const Pose& start) const {
    State out{start, {}};
    std::vector<ClampedJoint> ignored;
    constrain(rig_.skeleton, out.pose, ignored);
    for (std::size_t j = 0; j < segments_.size(); ++j) {
      const Joint& joint = segments_[j].joint;
      Angles angles{0, 0, 0};
      if (segments_[j].parent >= 0 && joint.sequence.size() == 3) {
        angles = angles_from_rotation(joint, out.pose.rotation[j]);
        const double pi = std::numbers::pi;
        const Angles other{std::remainder(angles[0] + pi, 2 * pi),
                           std::remainder(joint.sequence[1].sign * pi - angles[1], 2 * pi),
                           std::remainder(angles[2] + pi, 2 * pi)};
        const auto outside = [&](Angles& a) {
          double sum = 0;
          for (std::size_t i = 0; i < 3; ++i) {
            const auto [low, high] = range(joint, i);
            while (a[i] > high && a[i] - 2 * pi >= low) a[i] -= 2 * pi;
            while (a[i] < low && a[i] + 2 * pi <= high) a[i] += 2 * pi;
            sum += std::max({a[i] - high, low - a[i], 0.0});
          }
          return sum;
        };
        Angles one = angles, two = other;
        angles = outside(two) < outside(one) - 1e-9 ? two : one;
      }
      out.angle.push_back(angles);
    }
    return out;
  }

  void to_the_middle(State& state, double share) const {
    if (share == 0) return;
    for (const Freedom& f : free_) {
      if (!std::isfinite(f.low) || !std::isfinite(f.high) || f.kind > 2) continue;
      double& a = state.angle[f.joint][f.kind];
      a += share * (0.5 * (f.low + f.high) - a);
    }
    place(state);
  }

  // Couplings, then rotations out of the angles of the joints that were changed.
  void place(State& state) const {
    std::vector<char> changed(segments_.size(), 0);
    for (const Freedom& f : free_) changed[f.joint] = f.kind < 3 ? 1 : changed[f.joint];
    std::vector<std::array<char, 3>> begun(segments_.size(), {0, 0, 0});
    for (const Follower& f : followers_) {
      const AngleAxis& lead = segments_[f.lead_joint].joint.sequence[f.lead_angle];
      const AngleAxis& own = segments_[f.joint].joint.sequence[f.angle];
      double& a = state.angle[f.joint][f.angle];
      if (begun[f.joint][f.angle] == 0) a = own.rest;
      begun[f.joint][f.angle] = 1;
      a += f.ratio * (state.angle[f.lead_joint][f.lead_angle] - lead.rest);
      changed[f.joint] = 1;
    }
    for (const Follower& f : followers_) {
      const auto [low, high] = range(segments_[f.joint].joint, f.angle);
      double& a = state.angle[f.joint][f.angle];
      a = std::clamp(a, low, high);
    }
    for (std::size_t j = 0; j < segments_.size(); ++j) {
      if (changed[j] != 0) state.pose.rotation[j] = rotation_from_angles(segments_[j].joint, state.angle[j]);
    }
    slide(rig_.skeleton, state.pose);  // millimetres: the slopes leave them out
  }

  // Levenberg and Marquardt's way down; returns the steps it took.
  int descend(State& state, Eigen::VectorXd& error, int most) {
    double damping = kFirstDamping;
    int slow = 0, steps = 0;
    while (steps < most && !within(error) && slow < kPatience && damping < kMostDamping) {
      ++steps;
      const double before = error.squaredNorm();
      State next = stepped(state, error, damping);
      Eigen::VectorXd after = errors(next);
      if (!(after.squaredNorm() < before)) {
        damping *= 4;
        errors(state);  // the motion belongs to `state`
        continue;
      }
      slow = after.squaredNorm() > 0.98 * before ? slow + 1 : 0;
      state = std::move(next);
      error = std::move(after);
      damping = std::max(0.3 * damping, kLeastDamping);
    }
    return steps;
  }

  double off(const IkLook& look) const {
    const Vector3d d = motion_[look.segment].q * look.direction.normalized();
    const Vector3d to = look.at - motion_[look.segment] * look.point;
    return std::atan2(d.cross(to).norm(), d.dot(to));
  }

  // Weighted, mm: three rows a target, three a look. Leaves `motion_` at the state.
  Eigen::VectorXd errors(const State& state) {
    forward(rig_, state.pose, motion_);
    Eigen::VectorXd out(static_cast<Eigen::Index>(3 * chains_.size()));
    Eigen::Index row = 0;
    for (const IkTarget& target : problem_.targets) {
      out.segment<3>(row) = target.weight * (target.goal - motion_[target.segment] * target.point);
      row += 3;
    }
    for (const IkLook& look : problem_.looks) {
      const Vector3d to = (look.at - motion_[look.segment] * look.point).normalized();
      out.segment<3>(row) =
          look.weight * kLook * (to - motion_[look.segment].q * look.direction.normalized());
      row += 3;
    }
    return out;
  }

  bool within(const Eigen::VectorXd& error) const {
    bool all = true;
    for (std::size_t g = 0; g < chains_.size(); ++g) {
      const std::size_t looks = g - std::min(g, problem_.targets.size());
      const double weight =
          g < problem_.targets.size() ? problem_.targets[g].weight : problem_.looks[looks].weight;
      all =
          all && error.segment<3>(static_cast<Eigen::Index>(3 * g)).norm() <= weight * problem_.tolerance_mm;
    }
    return all;
  }

  // The axis, in space, about which an angle turns: those before it in the sequence carry it.
  Vector3d axis_of(const State& state, std::size_t j, std::size_t i) const {
    const Joint& joint = segments_[j].joint;
    const auto& s = joint.sequence;
    Vector3d axis = s[i].sign * Vector3d::Unit(s[i].axis);
    for (std::size_t k = i; k-- > 0;) axis = turn(s[k], state.angle[j][k]) * axis;
    for (const AngleAxis& a : s) axis = turn(a, -a.rest) * axis;
    return motion_[static_cast<std::size_t>(segments_[j].parent)].q * (joint.axes * axis);
  }

  // How the goals' errors shrink as an angle of joint j about `axis` grows.
  void add_turn(std::size_t j, const Vector3d& axis, double times, Eigen::Ref<Eigen::VectorXd> column) const {
    const Vector3d center = motion_[j] * segments_[j].joint.center;
    for (std::size_t g = 0; g < chains_.size(); ++g) {
      if (chains_[g][j] == 0) continue;
      const auto row = static_cast<Eigen::Index>(3 * g);
      if (g < problem_.targets.size()) {
        const IkTarget& target = problem_.targets[g];
        column.segment<3>(row) +=
            times * target.weight * axis.cross(motion_[target.segment] * target.point - center);
      } else {
        const IkLook& look = problem_.looks[g - problem_.targets.size()];
        column.segment<3>(row) +=
            times * look.weight * kLook * axis.cross(motion_[look.segment].q * look.direction.normalized());
      }
    }
  }

  Eigen::MatrixXd slopes(const State& state) const {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * chains_.size()),
                                              static_cast<Eigen::Index>(free_.size()));
    for (std::size_t c = 0; c < free_.size(); ++c) {
      const Freedom& f = free_[c];
      auto column = J.col(static_cast<Eigen::Index>(c));
      if (f.kind > 5) {
        for (std::size_t g = 0; g < problem_.targets.size(); ++g)
          column[static_cast<Eigen::Index>(3 * g + f.kind - 6)] = problem_.targets[g].weight * kRootUnit;
      } else if (f.kind > 2) {
        add_turn(f.joint, Vector3d::Unit(static_cast<int>(f.kind) - 3), 1, column);
      } else {
        add_turn(f.joint, axis_of(state, f.joint, f.kind), 1, column);
        for (const Follower& o : followers_) {
          if (o.lead_joint == f.joint && o.lead_angle == f.kind)
            add_turn(o.joint, axis_of(state, o.joint, o.angle), o.ratio, column);
        }
      }
    }
    return J;
  }

  // One step: (J J' + d^2) y = e, changes J' y. What would pass its limit goes up to it, and the others are
  // asked again for what is left.
  State stepped(const State& state, const Eigen::VectorXd& error, double damping) const {
    Eigen::MatrixXd J = slopes(state);
    Eigen::VectorXd left = error, change = Eigen::VectorXd::Zero(J.cols());
    std::vector<char> fixed(free_.size(), 0);
    for (int round = 0; round < 4; ++round) {
      Eigen::MatrixXd A = J * J.transpose();
      A.diagonal().array() += damping * damping;
      const Eigen::VectorXd asked = J.transpose() * A.ldlt().solve(left);
      bool more = false;
      for (std::size_t c = 0; c < free_.size(); ++c) {
        if (fixed[c] != 0) continue;
        const auto k = static_cast<Eigen::Index>(c);
        change[k] = std::clamp(asked[k], -kLargestStep, kLargestStep);
        if (free_[c].kind > 2) continue;
        const double now = state.angle[free_[c].joint][free_[c].kind];
        const double inside = std::clamp(now + change[k], free_[c].low, free_[c].high) - now;
        if (inside == change[k]) continue;
        change[k] = inside;
        fixed[c] = 1;
        left -= J.col(k) * inside;
        J.col(k).setZero();
        more = true;
      }
      if (!more) break;
    }
    State next = state;
    Vector3d spin = Vector3d::Zero();
    for (std::size_t c = 0; c < free_.size(); ++c) {
      const double x = change[static_cast<Eigen::Index>(c)];
      const std::size_t kind = free_[c].kind;
      if (kind > 5) {
        next.pose.root_translation[static_cast<int>(kind) - 6] += kRootUnit * x;
      } else if (kind > 2) {
        spin[static_cast<int>(kind) - 3] += x;
      } else {
        next.angle[free_[c].joint][kind] += x;
      }
    }
    if (const double angle = spin.norm(); angle > 0) {
      // About the root's joint, in space; the pose keeps it in the joint's frame.
      const Vector3d v = segments_[0].joint.axes.transpose() * (spin / angle);
      next.pose.rotation[0] = (Quaterniond(Eigen::AngleAxisd(angle, v)) * next.pose.rotation[0]).normalized();
    }
    place(next);
    return next;
  }

  const Rig& rig_;
  const IkProblem& problem_;
  const std::vector<Segment>& segments_;
  std::vector<RigidTransform> motion_;
  std::vector<std::vector<char>> chains_;  // of targets, then of looks
  std::vector<Freedom> free_;
  std::vector<Follower> followers_;
};

}  // namespace

IkResult solve_ik(const Rig& rig, const Pose& start, const IkProblem& problem) {
  return Solver(rig, problem).solve(start);
}

}  // namespace ecorche::kinematics
