// SPDX-License-Identifier: Apache-2.0
// Why inverse kinematics is damped least squares: against coordinate descent and FABRIK on prepared bodies,
// all within the same limits and couplings.
//
// usage: bench_ik MODEL.hdf...
//
// far:  from the scan to where random poses within the limits take random points of 1, 2 or 4 ends.
// drag: a random point of a random segment drawn along a closed curve, 5 mm a frame, through and out of its
//       reach; each frame starts at the last one's pose.
// free: as far, on the same skeleton with every joint a ball without limits or couplings: what the methods
// were
//       made for.
// pull: the same of a hand or the head, feet pinned by two points each, the head looking at what is pulled,
// the root
//       free to go. Only ours does that.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <ecorche/model_file/model_file.hpp>
#include "bench/ik/peers.hpp"
#include "bench/table.hpp"

namespace {

using namespace ecorche;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using kinematics::IkProblem;
using kinematics::IkResult;

using Solve = std::function<IkResult(const Rig&, const Pose&, const IkProblem&)>;
struct Method {
  const char* name;
  Solve solve;
};
const Method kMethods[] = {{"damped least squares", kinematics::solve_ik},
                           {"coordinate descent", bench::coordinate_descent},
                           {"FABRIK", bench::fabrik}};

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr int kFar = 300, kCurves = 20, kFrames = 240;
constexpr double kWay = 5;  // mm a frame

struct Tally {
  std::vector<double> micros, away, jump;
  int reached = 0;
  double removed = 0;

  static double at(std::vector<double>& x, double share) {
    if (x.empty()) return 0;
    std::sort(x.begin(), x.end());
    return x[static_cast<std::size_t>(share * static_cast<double>(x.size() - 1))];
  }
  void print(const bench::Table& table, const std::string& problem, const char* name) {
    using bench::fixed;
    table.row({problem, name, fixed(100.0 * reached / static_cast<double>(micros.size()), 1),
               fixed(at(micros, 0.5), 0), fixed(at(micros, 0.99), 0), fixed(at(micros, 1), 0),
               fixed(at(away, 0.5), 2), fixed(at(away, 0.99), 2), fixed(at(jump, 0.99), 1),
               fixed(at(jump, 1), 1), bench::exponent(removed, 0)});
  }

  Pose step(const Rig& rig, const Pose& start, const IkProblem& problem, const Solve& solve, bool follows) {
    const auto begin = std::chrono::steady_clock::now();
    IkResult result = solve(rig, start, problem);
    micros.push_back(
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
    away.push_back(*std::max_element(result.away_mm.begin(), result.away_mm.end()));
    reached += result.reached ? 1 : 0;
    double most = 0;
    for (std::size_t j = 0; j < start.rotation.size(); ++j)
      most = std::max(most, result.pose.rotation[j].angularDistance(start.rotation[j]) * kDegrees);
    if (follows) jump.push_back(most);
    Pose again = result.pose;
    std::vector<ClampedJoint> clamped;
    kinematics::constrain(rig.skeleton, again, clamped);
    for (const ClampedJoint& c : clamped) removed = std::max(removed, c.removed * kDegrees);
    return result.pose;
  }
};

std::vector<std::size_t> ends_of(const Skeleton& skeleton) {
  std::vector<std::size_t> out;
  for (std::size_t s = 0; s < skeleton.segments.size(); ++s) {
    if (std::none_of(skeleton.segments.begin(), skeleton.segments.end(),
                     [&](const Segment& o) { return o.parent == static_cast<int>(s); }))
      out.push_back(s);
  }
  return out;
}

Rig without_limits(Rig rig) {
  for (Segment& segment : rig.skeleton.segments) {
    segment.joint.coupled.clear();
    if (segment.parent >= 0) segment.joint.kind = JointKind::ball;
    for (AngleAxis& angle : segment.joint.sequence) {
      angle.min = -std::numeric_limits<double>::infinity();
      angle.max = -angle.min;
    }
  }
  return rig;
}

class Bench {
 public:
  Bench(const Rig& rig, const bench::Table& table)
      : rig_(rig), table_(table), joints_(rig.skeleton.segments.size()) {}

  void far(std::size_t targets, const char* name = "far") {
    std::vector<std::size_t> ends = ends_of(rig_.skeleton);
    Tally tally[3];
    for (int round = 0; round < kFar; ++round) {
      const auto motion = kinematics::forward(rig_, any_pose());
      IkProblem problem;
      std::shuffle(ends.begin(), ends.end(), random_);
      for (std::size_t t = 0; t < std::min(targets, ends.size()); ++t) {
        const Vector3d point = rig_.skeleton.segments[ends[t]].joint.center + 60 * any_point();
        problem.targets.push_back({ends[t], point, motion[ends[t]] * point, 1});
      }
      for (std::size_t m = 0; m < 3; ++m)
        tally[m].step(rig_, Pose::rest(joints_), problem, kMethods[m].solve, false);
    }
    print(name, targets, tally);
  }

  void drag(std::size_t targets) {
    Tally tally[3];
    for (int curve = 0; curve < kCurves; ++curve) {
      IkProblem problem;
      std::vector<Curve> curves;
      for (std::size_t t = 0; t < targets; ++t) {
        const std::size_t segment = 1 + random_() % (joints_ - 1);
        const Vector3d point = rig_.skeleton.segments[segment].joint.center + 100 * any_point();
        problem.targets.push_back({segment, point, point, 1});
        curves.push_back(any_curve(point));
      }
      for (std::size_t m = 0; m < 3; ++m) along(tally[m], problem, curves, kMethods[m].solve);
    }
    print("drag", targets, tally);
  }

  void pull() {
    const auto row = [&](const char* name) { return rig_.skeleton.find_segment(name); };
    const int feet[] = {row("foot_left"), row("foot_right")}, head = row("head");
    const int hands[] = {row("hand_left"), row("hand_right"), head};
    if (std::min({feet[0], feet[1], hands[0], hands[1], head}) < 0) return;
    Tally tally;
    for (int curve = 0; curve < kCurves; ++curve) {
      const auto pulled = static_cast<std::size_t>(hands[curve % 3]);
      const Vector3d point = rig_.skeleton.segments[pulled].joint.center + 60 * any_point();
      IkProblem problem;
      problem.move_root = true;
      problem.targets.push_back({pulled, point, point, 1});
      for (const int foot : feet) {
        const auto f = static_cast<std::size_t>(foot);
        const Vector3d ankle = rig_.skeleton.segments[f].joint.center;
        for (const Vector3d& by : {Vector3d(0, 0, 0), Vector3d(0, -120, -50)})
          problem.targets.push_back({f, ankle + by, ankle + by, 3});
      }
      const auto h = static_cast<std::size_t>(head);
      if (pulled != h)
        problem.looks.push_back({h, rig_.skeleton.segments[h].joint.center + Vector3d(0, -80, 60),
                                 -Vector3d::UnitY(), point, 0.2});
      along(tally, problem, {any_curve(point)}, kMethods[0].solve);
    }
    tally.print(table_, "pull, feet pinned, the head looks", kMethods[0].name);
  }

 private:
  void print(const std::string& what, std::size_t targets, Tally* tally) const {
    for (std::size_t m = 0; m < 3; ++m)
      tally[m].print(table_, what + ", " + std::to_string(targets) + (targets == 1 ? " target" : " targets"),
                     kMethods[m].name);
  }

  // From where the point is, around and back.
  struct Curve {
    Vector3d begin, a, b;
    Vector3d at(int frame) const {
      const double turn = 2 * std::numbers::pi * frame / kFrames;
      return begin + (1 - std::cos(turn)) * a + std::sin(turn) * b;
    }
  };

  Vector3d any_point() { return {normal_(random_), normal_(random_), normal_(random_)}; }

  Curve any_curve(const Vector3d& begin) {
    const double radius = kWay * kFrames / (2 * std::numbers::pi);
    const Vector3d a = any_point().normalized();
    return {begin, radius * a, radius * a.cross(any_point()).normalized()};
  }

  Pose any_pose() {
    Pose pose = Pose::rest(joints_);
    for (std::size_t j = 1; j < joints_; ++j) {
      const Quaterniond any =
          Quaterniond(normal_(random_), normal_(random_), normal_(random_), normal_(random_)).normalized();
      pose.rotation[j] = Quaterniond::Identity().slerp(0.4, any);
    }
    std::vector<ClampedJoint> clamped;
    kinematics::constrain(rig_.skeleton, pose, clamped);
    return pose;
  }

  void along(Tally& tally, IkProblem problem, const std::vector<Curve>& curves, const Solve& solve) const {
    Pose pose = Pose::rest(joints_);
    for (int frame = 0; frame <= kFrames; ++frame) {
      for (std::size_t c = 0; c < curves.size(); ++c) problem.targets[c].goal = curves[c].at(frame);
      for (kinematics::IkLook& look : problem.looks) look.at = problem.targets[0].goal;
      pose = tally.step(rig_, pose, problem, solve, true);
    }
  }

  const Rig& rig_;
  const bench::Table& table_;
  std::size_t joints_;
  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: bench_ik MODEL.hdf...\n");
    return 64;
  }
  for (int i = 1; i < argc; ++i) {
    const Rig rig = model_file::read(argv[i], Context{}).rig;
    std::printf(
        "\n%s: %zu joints; microseconds, mm away from the goal, degrees that a joint turns from a frame to "
        "the next\n",
        argv[i], rig.skeleton.segments.size());
    const bench::Table table({{"problem", 34},
                              {"method", -21},
                              {"reached %"},
                              {"us p50"},
                              {"p99"},
                              {"most"},
                              {"mm p50"},
                              {"p99"},
                              {"deg p99"},
                              {"most"},
                              {"deg beyond limits"}});
    Bench bench(rig, table);
    for (const std::size_t targets : {std::size_t{1}, std::size_t{2}, std::size_t{4}}) bench.far(targets);
    for (const std::size_t targets : {std::size_t{1}, std::size_t{3}}) bench.drag(targets);
    bench.pull();
    const Rig free = without_limits(rig);
    Bench(free, table).far(2, "free");
  }
  return 0;
}
