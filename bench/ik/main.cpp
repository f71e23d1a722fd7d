// SPDX-License-Identifier: Apache-2.0
// Why inverse kinematics is damped least squares: against cyclic coordinate descent on a prepared body, both
// with the same limits, from rest to points that poses within the limits reach.
//
// usage: bench_ik MODEL.hdf
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <vector>

#include "core/kinematics/angles.hpp"
#include "core/kinematics/forward.hpp"
#include "core/kinematics/ik.hpp"
#include "core/model_file/model_file.hpp"

namespace {

using namespace ecorche;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// Cyclic coordinate descent (Wang and Chen 1991): joint by joint from the target's to the root's child, each
// turned so that the point comes nearest to its goal, then constrained. Several targets: a pass for each.
kinematics::IkResult ccd(const Rig& rig, const Pose& start, const kinematics::IkProblem& problem) {
  kinematics::IkResult out;
  out.pose = start;
  std::vector<ClampedJoint> clamped;
  clamped.reserve(rig.skeleton.segments.size());
  std::vector<RigidTransform> motion = kinematics::forward(rig, out.pose);
  const auto away = [&](const kinematics::IkTarget& t) {
    return (motion[t.segment] * t.point - t.goal).norm();
  };
  for (out.steps = 0; out.steps < 10 * problem.most_steps; ++out.steps) {
    out.reached = std::all_of(problem.targets.begin(), problem.targets.end(),
                              [&](const auto& t) { return away(t) <= problem.tolerance_mm; });
    if (out.reached) break;
    for (const kinematics::IkTarget& target : problem.targets) {
      for (int s = static_cast<int>(target.segment);
           rig.skeleton.segments[static_cast<std::size_t>(s)].parent >= 0;
           s = rig.skeleton.segments[static_cast<std::size_t>(s)].parent) {
        const auto j = static_cast<std::size_t>(s);
        const Joint& joint = rig.skeleton.segments[j].joint;
        const Vector3d center = motion[j] * joint.center;
        const Vector3d from = motion[target.segment] * target.point - center, to = target.goal - center;
        if (from.norm() < 1e-6 || to.norm() < 1e-6) continue;
        const Quaterniond turn = Quaterniond::FromTwoVectors(from, to);
        const Vector3d v = (motion[j].q.toRotationMatrix() * joint.axes).transpose() * turn.vec();
        out.pose.rotation[j] = out.pose.rotation[j] * Quaterniond(turn.w(), v.x(), v.y(), v.z());
        clamped.clear();
        kinematics::constrain(rig.skeleton, out.pose, clamped);
        kinematics::forward(rig, out.pose, motion);
      }
    }
  }
  for (const kinematics::IkTarget& target : problem.targets) out.away_mm.push_back(away(target));
  return out;
}

struct Tally {
  std::vector<double> micros, away;
  int reached = 0;
  void print(const char* name) {
    std::sort(micros.begin(), micros.end());
    std::sort(away.begin(), away.end());
    const auto at = [](const std::vector<double>& x, double share) {
      return x[static_cast<std::size_t>(share * static_cast<double>(x.size() - 1))];
    };
    std::printf("  %-22s %5.1f %%  %7.0f %7.0f %7.0f us   %7.2f %7.2f mm\n", name,
                100.0 * reached / static_cast<double>(micros.size()), at(micros, 0.5), at(micros, 0.99),
                micros.back(), at(away, 0.5), at(away, 0.99));
  }
};

template <class Solve>
void run(Tally& tally, const Rig& rig, const kinematics::IkProblem& problem, Solve&& solve) {
  const auto begin = std::chrono::steady_clock::now();
  const kinematics::IkResult result = solve(rig, Pose::rest(rig.skeleton.segments.size()), problem);
  tally.micros.push_back(
      std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  tally.away.push_back(*std::max_element(result.away_mm.begin(), result.away_mm.end()));
  tally.reached += result.reached ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: bench_ik MODEL.hdf\n");
    return 64;
  }
  const Rig rig = model_file::read(argv[1], Context{}).rig;
  const std::size_t joints = rig.skeleton.segments.size();
  // Leaves: what one drags.
  std::vector<std::size_t> ends;
  for (std::size_t s = 0; s < joints; ++s) {
    const bool leaf = std::none_of(rig.skeleton.segments.begin(), rig.skeleton.segments.end(),
                                   [&](const Segment& o) { return o.parent == static_cast<int>(s); });
    if (leaf) ends.push_back(s);
  }
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::printf("reached; time p50, p99, most; distance p50, p99 (%zu joints)\n", joints);
  for (const std::size_t targets : {std::size_t{1}, std::size_t{2}, std::size_t{4}}) {
    Tally least, descent;
    for (int round = 0; round < 300; ++round) {
      Pose pose = Pose::rest(joints);
      for (std::size_t j = 1; j < joints; ++j) {
        const Quaterniond any =
            Quaterniond(normal(random), normal(random), normal(random), normal(random)).normalized();
        pose.rotation[j] = Quaterniond::Identity().slerp(0.4, any);
      }
      std::vector<ClampedJoint> clamped;
      kinematics::constrain(rig.skeleton, pose, clamped);
      const auto motion = kinematics::forward(rig, pose);
      kinematics::IkProblem problem;
      std::shuffle(ends.begin(), ends.end(), random);
      for (std::size_t t = 0; t < std::min(targets, ends.size()); ++t) {
        const Vector3d point = rig.skeleton.segments[ends[t]].joint.center;
        problem.targets.push_back({ends[t], point, motion[ends[t]] * point, 1});
      }
      run(least, rig, problem, kinematics::solve_ik);
      run(descent, rig, problem, ccd);
    }
    std::printf("%zu target%s\n", targets, targets == 1 ? "" : "s");
    least.print("damped least squares");
    descent.print("coordinate descent");
  }
  return 0;
}
