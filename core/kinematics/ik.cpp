// SPDX-License-Identifier: Apache-2.0
#include <ecorche/kinematics/ik.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include "core/kinematics/damped_steps.hpp"
#include "core/kinematics/ik_chain.hpp"

namespace ecorche::kinematics {
namespace {

constexpr double kLargestStep = 0.6;  // radians of one angle in one step
constexpr double kFirstDamping = 30;  // mm a radian
constexpr double kLeastDamping = 0.3, kMostDamping = 3e4;
constexpr int kPatience = 4;                       // steps that gain less than a hundredth
constexpr double kStarts[] = {0, 0.15, 0.5, 0.8};  // of the way to the middle of the ranges
constexpr double kWorthIt = 0.75;  // of the error: what another start must come to, lest a drag should jump

double squares(const std::vector<double>& x) {
  double sum = 0;
  for (const double v : x) sum += v * v;
  return sum;
}

class Solver {
 public:
  Solver(const Rig& rig, const IkProblem& problem, const Pose& start)
      : chain_(rig, problem, start),
        steps_(chain_.rows(), chain_.freedoms().size()),
        bounds_(chain_.freedoms().size()),
        change_(chain_.freedoms().size()) {}

  IkState solve(int most, int& steps, bool& reached) {
    IkState best = chain_.start();
    double least = std::numeric_limits<double>::infinity();
    for (const double share : kStarts) {
      IkState state = chain_.start();
      to_the_middle(state, share);
      steps += descend(state, most);
      const double left = std::sqrt(squares(error_));
      reached = chain_.within(error_);
      if (reached || left < kWorthIt * least) {
        least = left;
        best = state;
      }
      if (reached) break;
    }
    return best;
  }

  const IkChain& chain() const { return chain_; }

 private:
  void to_the_middle(IkState& state, double share) const {
    if (share == 0) return;
    for (const Freedom& f : chain_.freedoms()) {
      if (!std::isfinite(f.low) || !std::isfinite(f.high)) continue;
      double& a = state.angle[f.joint][f.kind];
      a += share * (0.5 * (f.low + f.high) - a);
    }
  }

  // Levenberg and Marquardt's way down; returns the steps it took, leaves `error_` at the state.
  int descend(IkState& state, int most) {
    chain_.errors(state, error_);
    double before = squares(error_), damping = kFirstDamping;
    int slow = 0, steps = 0;
    bool moved = true;
    while (steps < most && !chain_.within(error_) && slow < kPatience && damping < kMostDamping) {
      ++steps;
      if (moved) look_around(state);
      steps_.solve(error_, damping, bounds_, change_);
      next_ = state;
      chain_.add(change_, next_);
      chain_.errors(next_, after_);
      const double now = squares(after_);
      moved = now < before;
      if (!moved) {
        damping *= 4;
        continue;
      }
      slow = now > 0.98 * before ? slow + 1 : 0;
      before = now;
      std::swap(state, next_);
      std::swap(error_, after_);
      damping = std::max(0.3 * damping, kLeastDamping);
    }
    return steps;
  }

  // Slopes, and how far each angle may go.
  void look_around(const IkState& state) {
    chain_.slopes(steps_);
    steps_.gather();
    for (std::size_t c = 0; c < bounds_.size(); ++c) {
      const Freedom& f = chain_.freedoms()[c];
      bounds_[c] = {-kLargestStep, kLargestStep};
      if (f.kind > 2) continue;
      const double now = state.angle[f.joint][f.kind];
      bounds_[c].low = std::clamp(f.low - now, -kLargestStep, 0.0);
      bounds_[c].high = std::clamp(f.high - now, 0.0, kLargestStep);
    }
  }

  IkChain chain_;
  DampedSteps steps_;
  std::vector<StepBounds> bounds_;
  std::vector<double> change_, error_, after_;
  IkState next_;
};

double off(const RigidTransform& motion, const IkLook& look) {
  const Eigen::Vector3d d = motion.q * look.direction.normalized();
  const Eigen::Vector3d to = look.at - motion * look.point;
  return std::atan2(d.cross(to).norm(), d.dot(to));
}

}  // namespace

IkResult solve_ik(const Rig& rig, const Pose& start, const IkProblem& problem) {
  IkResult out;
  out.pose = start;
  std::vector<ClampedJoint> ignored;
  constrain(rig.skeleton, out.pose, ignored);
  Solver solver(rig, problem, out.pose);
  const IkState found = solver.solve(problem.most_steps, out.steps, out.reached);
  solver.chain().write(found, out.pose);
  constrain(rig.skeleton, out.pose, ignored);
  const std::vector<RigidTransform> motion = forward(rig, out.pose);
  for (const IkTarget& target : problem.targets)
    out.away_mm.push_back((motion[target.segment] * target.point - target.goal).norm());
  for (const IkLook& look : problem.looks) out.off.push_back(off(motion[look.segment], look));
  return out;
}

}  // namespace ecorche::kinematics
