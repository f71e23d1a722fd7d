// SPDX-License-Identifier: Apache-2.0
#include "bench/ik/peers.hpp"

#include <Eigen/SVD>
#include <algorithm>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>

namespace ecorche::bench {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using kinematics::IkProblem;
using kinematics::IkResult;
using kinematics::IkTarget;

constexpr int kRounds = 400;
constexpr double kStill = 1e-3;  // mm that a round must gain, or it ends

// A pose that is turned joint by joint.
struct Figure {
  const Rig& rig;
  Pose pose;
  std::vector<RigidTransform> motion;
  std::vector<ClampedJoint> clamped;

  Figure(const Rig& rig_, const Pose& start) : rig(rig_), pose(start), motion(start.rotation.size()) {
    clamped.reserve(motion.size());
    settle();
  }
  void settle() {
    clamped.clear();
    kinematics::constrain(rig.skeleton, pose, clamped);
    kinematics::forward(rig, pose, motion);
  }
  Vector3d center(std::size_t j) const { return motion[j] * rig.skeleton.segments[j].joint.center; }
  // A turn in space about the joint's centre.
  void turn(std::size_t j, const Quaterniond& by) {
    const Vector3d v =
        (motion[j].q.toRotationMatrix() * rig.skeleton.segments[j].joint.axes).transpose() * by.vec();
    pose.rotation[j] = pose.rotation[j] * Quaterniond(by.w(), v.x(), v.y(), v.z());
  }
  double away(const IkTarget& t) const { return (motion[t.segment] * t.point - t.goal).norm(); }
  double farthest(const IkProblem& problem) const {
    double most = 0;
    for (const IkTarget& t : problem.targets) most = std::max(most, away(t));
    return most;
  }
};

template <class Round>
IkResult rounds(const Rig& rig, const Pose& start, const IkProblem& problem, Round&& round) {
  Figure figure(rig, start);
  IkResult out;
  double best = figure.farthest(problem), before = best;
  out.pose = figure.pose;
  int slow = 0;
  for (out.steps = 0; out.steps < kRounds && best > problem.tolerance_mm && slow < 20; ++out.steps) {
    round(figure);
    const double now = figure.farthest(problem);
    slow = now > before - kStill ? slow + 1 : 0;
    before = now;
    if (now >= best) continue;
    best = now;
    out.pose = figure.pose;
  }
  out.reached = best <= problem.tolerance_mm;
  figure.pose = out.pose;
  figure.settle();
  for (const IkTarget& t : problem.targets) out.away_mm.push_back(figure.away(t));
  return out;
}

// The turn that brings the first points nearest to the second (Kabsch 1976); one pair: the least turn.
Quaterniond onto(const std::vector<Vector3d>& from, const std::vector<Vector3d>& to) {
  if (from.size() == 1) return Quaterniond::FromTwoVectors(from[0], to[0]);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) sum += to[i] * from[i].transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d flip = Eigen::Matrix3d::Identity();
  flip(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return Quaterniond(Eigen::Matrix3d(svd.matrixU() * flip * svd.matrixV().transpose()));
}

// What a segment's point is pulled to.
struct Pull {
  Vector3d on_body, to;
};

class Reaching {
 public:
  Reaching(const Rig& rig, const IkProblem& problem)
      : rig_(rig), problem_(problem), on_way_(rig.skeleton.segments.size(), 0) {
    for (const IkTarget& t : problem.targets) {
      for (int s = static_cast<int>(t.segment); s >= 0;
           s = rig.skeleton.segments[static_cast<std::size_t>(s)].parent)
        on_way_[static_cast<std::size_t>(s)] = 1;
    }
  }

  void operator()(Figure& figure) {
    const auto& segments = rig_.skeleton.segments;
    pulls_.assign(segments.size(), {});
    for (const IkTarget& t : problem_.targets) pulls_[t.segment].push_back({t.point, t.goal});
    for (std::size_t s = segments.size(); s-- > 1;) {  // inwards
      if (on_way_[s] == 0) continue;
      const Vector3d center = figure.center(s);
      Vector3d mean = Vector3d::Zero();
      for (const Pull& pull : pulls_[s]) {
        const double length = (figure.motion[s] * pull.on_body - center).norm();
        const Vector3d way = center - pull.to;
        mean +=
            pull.to + (way.norm() > 1e-9 ? Vector3d(length * way.normalized()) : Vector3d(Vector3d::Zero()));
      }
      mean /= static_cast<double>(pulls_[s].size());
      pulls_[static_cast<std::size_t>(segments[s].parent)].push_back({segments[s].joint.center, mean});
    }
    for (std::size_t s = 1; s < segments.size(); ++s) {  // outwards
      if (on_way_[s] == 0) continue;
      const Vector3d center = figure.center(s);
      std::vector<Vector3d> from, to;
      for (const Pull& pull : pulls_[s]) {
        from.emplace_back(figure.motion[s] * pull.on_body - center);
        to.emplace_back(pull.to - center);
        if (from.back().norm() < 1e-6 || to.back().norm() < 1e-6) {
          from.pop_back();
          to.pop_back();
        }
      }
      if (from.empty()) continue;
      figure.turn(s, onto(from, to));
      figure.settle();
    }
  }

 private:
  const Rig& rig_;
  const IkProblem& problem_;
  std::vector<char> on_way_;
  std::vector<std::vector<Pull>> pulls_;
};

}  // namespace

IkResult coordinate_descent(const Rig& rig, const Pose& start, const IkProblem& problem) {
  return rounds(rig, start, problem, [&](Figure& figure) {
    for (const IkTarget& target : problem.targets) {
      for (int s = static_cast<int>(target.segment);
           rig.skeleton.segments[static_cast<std::size_t>(s)].parent >= 0;
           s = rig.skeleton.segments[static_cast<std::size_t>(s)].parent) {
        const auto j = static_cast<std::size_t>(s);
        const Vector3d center = figure.center(j);
        const Vector3d from = figure.motion[target.segment] * target.point - center,
                       to = target.goal - center;
        if (from.norm() < 1e-6 || to.norm() < 1e-6) continue;
        figure.turn(j, Quaterniond::FromTwoVectors(from, to));
        figure.settle();
      }
    }
  });
}

IkResult fabrik(const Rig& rig, const Pose& start, const IkProblem& problem) {
  return rounds(rig, start, problem, Reaching(rig, problem));
}

}  // namespace ecorche::bench
