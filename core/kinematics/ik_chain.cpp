// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/ik_chain.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/values/error.hpp>
#include "core/kinematics/angle_limits.hpp"

namespace ecorche::kinematics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Angles = std::array<double, 3>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t angle_row(const Joint& joint, const std::string& name) {
  std::size_t i = 0;
  while (i < joint.sequence.size() && joint.sequence[i].name != name) ++i;
  return i;
}

std::size_t angles_of(const Joint& joint) {
  if (joint.kind == JointKind::fixed || joint.sequence.size() != 3) return 0;
  return joint.kind == JointKind::hinge ? 1 : joint.kind == JointKind::universal ? 2 : 3;
}

// q times a turn about axis k.
Quaterniond turned(const Quaterniond& q, int k, double angle) {
  Vector3d v = Vector3d::Zero();
  v[k] = std::sin(0.5 * angle);
  return q * Quaterniond(std::cos(0.5 * angle), v.x(), v.y(), v.z());
}

}  // namespace

IkChain::IkChain(const Rig& rig, const IkProblem& problem, const Pose& start)
    : rig_(rig),
      problem_(problem),
      segments_(rig.skeleton.segments),
      link_of_(segments_.size(), -1),
      turn_(segments_.size(), Quaterniond::Identity()),
      center_(segments_.size(), Vector3d::Zero()),
      axis_(segments_.size()) {
  find_goals();
  find_followers();
  find_links(start);
}

void IkChain::find_goals() {
  const auto arm = [&](std::size_t segment, const Vector3d& point) -> Vector3d {
    if (segment >= segments_.size())
      throw Error(ErrorKind::internal, "inverse kinematics", "no segment " + std::to_string(segment),
                  "name a segment of the rig");
    return point - segments_[segment].joint.center;
  };
  const Vector3d zero = Vector3d::Zero();
  for (const IkTarget& t : problem_.targets)
    goals_.push_back({t.segment, arm(t.segment, t.point), zero, t.goal, t.weight, false, zero, zero, zero});
  for (const IkLook& l : problem_.looks)
    goals_.push_back({l.segment, arm(l.segment, l.point), l.direction.normalized(), l.at, l.weight, true,
                      zero, zero, zero});
  for (const Goal& goal : goals_) {
    for (int s = static_cast<int>(goal.segment); s >= 0; s = segments_[static_cast<std::size_t>(s)].parent)
      link_of_[static_cast<std::size_t>(s)] = 0;  // numbered in find_links
  }
}

// Couplings of joints that are evaluated, those that lead them before them, then the freedoms.
void IkChain::find_followers() {
  std::vector<std::array<bool, 3>> wanted(segments_.size(), {false, false, false}), driven = wanted;
  for (std::size_t j = segments_.size(); j-- > 0;) {
    for (std::size_t i = 0; i < angles_of(segments_[j].joint); ++i) wanted[j][i] |= link_of_[j] >= 0;
    std::vector<Follower> own;
    for (const Coupling& c : segments_[j].joint.coupled) {
      const int lead = rig_.skeleton.find_joint(c.joint);
      if (lead < 0) continue;  // `constrain` tells
      const auto l = static_cast<std::size_t>(lead);
      const std::size_t leads = angle_row(segments_[l].joint, c.angle);
      const bool slides = c.slides() >= 0;
      const std::size_t kind =
          slides ? 3 + static_cast<std::size_t>(c.slides()) : angle_row(segments_[j].joint, c.drives);
      if (leads > 2 || (!slides && kind > 2)) continue;
      if (slides ? link_of_[j] < 0 || segments_[j].joint.kind == JointKind::free
                 : link_of_[j] < 0 && !wanted[j][kind])
        continue;
      wanted[l][leads] = true;
      auto found = std::find_if(own.begin(), own.end(), [&](const Follower& f) { return f.kind == kind; });
      if (found == own.end()) {
        found = own.insert(own.end(), {j, kind, 0, -kInfinity, kInfinity, {}, {}});
        if (!slides) {
          driven[j][kind] = true;
          found->rest = segments_[j].joint.sequence[kind].rest;
          std::tie(found->low, found->high) = angle_range(segments_[j].joint, kind);
        }
      }
      found->leads.push_back({l, leads, c.ratio});
    }
    followers_.insert(followers_.begin(), own.begin(), own.end());
  }
  // Slides see every angle set, as `constrain` has it.
  std::stable_partition(followers_.begin(), followers_.end(), [](const Follower& f) { return f.kind < 3; });
  for (std::size_t j = 0; j < segments_.size(); ++j) {
    if (segments_[j].parent < 0) {
      for (std::size_t k = 3; problem_.move_root && k < 9; ++k)
        free_.push_back({j, k, -kInfinity, kInfinity});
      continue;
    }
    for (std::size_t i = 0; i < angles_of(segments_[j].joint); ++i) {
      if (!wanted[j][i] || driven[j][i]) continue;
      const auto [low, high] = angle_range(segments_[j].joint, i);
      free_.push_back({j, i, low, high});
    }
  }
  const auto slopes_of = [&](std::size_t joint, std::size_t angle) {
    std::vector<std::pair<std::size_t, double>> out;
    for (std::size_t c = 0; c < free_.size(); ++c) {
      if (free_[c].joint == joint && free_[c].kind == angle) out.emplace_back(c, 1.0);
    }
    for (const Follower& f : followers_) {
      if (f.joint == joint && f.kind == angle) out = f.by;
    }
    return out;
  };
  for (Follower& f : followers_) {
    for (const Follower::Lead& lead : f.leads) {
      for (const auto& [c, ratio] : slopes_of(lead.joint, lead.angle))
        f.by.emplace_back(c, lead.ratio * ratio);
    }
  }
}

void IkChain::find_links(const Pose& start) {
  start_.angle.assign(segments_.size(), {0, 0, 0});
  for (std::size_t j = 0; j < segments_.size(); ++j) {
    const Joint& joint = segments_[j].joint;
    if (segments_[j].parent >= 0) start_.angle[j] = angles_within_limits(joint, start.rotation[j]);
    if (link_of_[j] < 0) continue;
    link_of_[j] = static_cast<int>(links_.size());
    Link link;
    link.joint = j;
    link.parent = segments_[j].parent;
    link.turns = link.parent >= 0 && angles_of(joint) > 0;
    const Quaterniond frame(joint.axes);
    link.in = frame;
    for (std::size_t i = 3; link.turns && i-- > 0;)
      link.in = turned(link.in, joint.sequence[i].axis, -joint.sequence[i].sign * joint.sequence[i].rest);
    link.still = frame * start.rotation[j] * frame.conjugate();
    link.slide.setZero();
    link.bone = joint.center;
    if (link.parent >= 0) {
      link.bone -= segments_[static_cast<std::size_t>(link.parent)].joint.center;
      if (joint.kind == JointKind::free) link.bone += joint.axes * start.translation[j];
    } else {
      start_.turn = link.still;
      start_.way = start.root_translation;
    }
    for (std::size_t g = 0; g < goals_.size(); ++g) {
      int s = static_cast<int>(goals_[g].segment);
      while (s >= 0 && s != static_cast<int>(j)) s = segments_[static_cast<std::size_t>(s)].parent;
      if (s >= 0) link.goals.push_back(g);
    }
    links_.push_back(std::move(link));
  }
}

// Couplings, then turns and places of every link.
void IkChain::place(IkState& state) {
  for (Follower& f : followers_) {
    double value = f.rest;
    for (const Follower::Lead& lead : f.leads)
      value += lead.ratio *
               (state.angle[lead.joint][lead.angle] - segments_[lead.joint].joint.sequence[lead.angle].rest);
    f.held = value < f.low || value > f.high;
    value = std::clamp(value, f.low, f.high);
    if (f.kind < 3) {
      state.angle[f.joint][f.kind] = value;
    } else {
      links_[static_cast<std::size_t>(link_of_[f.joint])].slide[static_cast<int>(f.kind) - 3] = value;
    }
  }
  for (const Link& link : links_) {
    const Joint& joint = segments_[link.joint].joint;
    if (link.parent < 0) {
      turn_[link.joint] = state.turn;
      center_[link.joint] = link.bone + state.way;
      continue;
    }
    const auto parent = static_cast<std::size_t>(link.parent);
    center_[link.joint] = center_[parent] + turn_[parent] * (link.bone + joint.axes * link.slide);
    if (!link.turns) {
      turn_[link.joint] = turn_[parent] * link.still;
      continue;
    }
    Quaterniond q = turn_[parent] * link.in;
    for (std::size_t i = 0; i < 3; ++i) {
      const AngleAxis& a = joint.sequence[i];
      axis_[link.joint][i] = q * (a.sign * Vector3d::Unit(a.axis));
      q = turned(q, a.axis, a.sign * state.angle[link.joint][i]);
    }
    turn_[link.joint] = q * Quaterniond(joint.axes).conjugate();
  }
}

void IkChain::errors(IkState& state, std::vector<double>& out) {
  place(state);
  out.resize(rows());
  for (std::size_t g = 0; g < goals_.size(); ++g) {
    Goal& goal = goals_[g];
    goal.point = center_[goal.segment] + turn_[goal.segment] * goal.arm;
    goal.to = goal.at - goal.point;
    Vector3d error = goal.weight * goal.to;
    if (goal.look) {
      goal.sight = turn_[goal.segment] * goal.direction;
      error = goal.weight * kLook * (goal.to.normalized() - goal.sight);
    }
    for (std::size_t k = 0; k < 3; ++k) out[3 * g + k] = error[static_cast<int>(k)];
  }
}

bool IkChain::within(const std::vector<double>& errors) const {
  for (std::size_t g = 0; g < goals_.size(); ++g) {
    const double most = goals_[g].weight * problem_.tolerance_mm;
    if (!(Vector3d(errors[3 * g], errors[3 * g + 1], errors[3 * g + 2]).norm() <= most)) return false;
  }
  return true;
}

void IkChain::add_turn(const Link& link, const Vector3d& axis, double times, std::span<double> column) const {
  for (const std::size_t g : link.goals) {
    const Goal& goal = goals_[g];
    Vector3d by = axis.cross(goal.look ? goal.sight : Vector3d(goal.point - center_[link.joint]));
    by *= times * goal.weight * (goal.look ? kLook : 1);
    for (std::size_t k = 0; k < 3; ++k) column[3 * g + k] += by[static_cast<int>(k)];
  }
}

void IkChain::add_way(const Link& link, const Vector3d& way, std::span<double> column) const {
  for (const std::size_t g : link.goals) {
    if (goals_[g].look) continue;  // where the eyes are matters little beside where they point
    for (std::size_t k = 0; k < 3; ++k) column[3 * g + k] += goals_[g].weight * way[static_cast<int>(k)];
  }
}

void IkChain::slopes(DampedSteps& steps) const {
  steps.clear();
  for (std::size_t c = 0; c < free_.size(); ++c) {
    const Freedom& f = free_[c];
    if (link_of_[f.joint] < 0) continue;
    const Link& link = links_[static_cast<std::size_t>(link_of_[f.joint])];
    if (f.kind < 3) {
      add_turn(link, axis_[f.joint][f.kind], 1, steps.column(c));
    } else if (f.kind < 6) {
      add_turn(link, Vector3d::Unit(static_cast<int>(f.kind) - 3), 1, steps.column(c));
    } else {
      add_way(link, kRootUnit * Vector3d::Unit(static_cast<int>(f.kind) - 6), steps.column(c));
    }
  }
  for (const Follower& f : followers_) {
    if (f.held || link_of_[f.joint] < 0) continue;
    const Link& link = links_[static_cast<std::size_t>(link_of_[f.joint])];
    for (const auto& [c, ratio] : f.by) {
      if (f.kind < 3) {
        add_turn(link, axis_[f.joint][f.kind], ratio, steps.column(c));
      } else {
        const Vector3d along = segments_[f.joint].joint.axes.col(static_cast<int>(f.kind) - 3);
        add_way(link, ratio * (turn_[static_cast<std::size_t>(link.parent)] * along), steps.column(c));
      }
    }
  }
}

void IkChain::add(const std::vector<double>& change, IkState& state) const {
  Vector3d spin = Vector3d::Zero();
  for (std::size_t c = 0; c < free_.size(); ++c) {
    const std::size_t kind = free_[c].kind;
    if (kind > 5) {
      state.way[static_cast<int>(kind) - 6] += kRootUnit * change[c];
    } else if (kind > 2) {
      spin[static_cast<int>(kind) - 3] += change[c];
    } else {
      state.angle[free_[c].joint][kind] += change[c];
    }
  }
  if (const double angle = spin.norm(); angle > 0)
    state.turn = (Quaterniond(Eigen::AngleAxisd(angle, spin / angle)) * state.turn).normalized();
}

void IkChain::write(const IkState& state, Pose& pose) const {
  for (const Freedom& f : free_) {
    if (f.kind < 3)
      pose.rotation[f.joint] = rotation_from_angles(segments_[f.joint].joint, state.angle[f.joint]);
  }
  if (!problem_.move_root) return;
  const Quaterniond frame(segments_[0].joint.axes);
  pose.rotation[0] = (frame.conjugate() * state.turn * frame).normalized();
  pose.root_translation = state.way;
}

}  // namespace ecorche::kinematics
