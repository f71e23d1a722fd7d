// SPDX-License-Identifier: Apache-2.0
// The joints between the root and the goals of inverse kinematics: where angles take the goals' points, and
// how those move as an angle grows.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include <ecorche/kinematics/ik.hpp>
#include "core/kinematics/damped_steps.hpp"

namespace ecorche::kinematics {

/// One number that the solver may change: angle 0 to 2 of a joint, or of the root a turn (3 to 5: about x, y,
/// z of the room) or a way (6 to 8).
struct Freedom {
  std::size_t joint = 0, kind = 0;
  double low = 0, high = 0;  ///< radians; infinite where nothing holds it
};

/// What the solver changes: everything else of a pose stays.
struct IkState {
  std::vector<std::array<double, 3>> angle;                  ///< #segments
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  ///< of the root, in space
  Eigen::Vector3d way = Eigen::Vector3d::Zero();             ///< of the root, mm
};

/// Joints on no way from the root to a goal are left out, unless an angle of theirs leads one that is on it.
class IkChain {
 public:
  static constexpr double kLook = 200;      ///< mm: where a look's error is counted
  static constexpr double kRootUnit = 300;  ///< mm of the root's way that count as a radian

  /// Both must outlive it; `start` is within limits and couplings. Throws Error{internal} for a segment that
  /// is not there.
  IkChain(const Rig& rig, const IkProblem& problem, const Pose& start);

  const std::vector<Freedom>& freedoms() const { return free_; }
  std::size_t rows() const { return 3 * goals_.size(); }
  /// The angles of `start`; of the two triples that give one rotation those within the limits.
  const IkState& start() const { return start_; }

  /// Weighted, mm, three a target, then three a look.
  void errors(IkState& state, std::vector<double>& out);
  /// Whether every target and look is within the tolerance.
  bool within(const std::vector<double>& errors) const;
  /// J at the state that `errors` saw last: how the errors shrink.
  void slopes(DampedSteps& steps) const;
  /// Adds one number a freedom, of `free_`'s units.
  void add(const std::vector<double>& change, IkState& state) const;
  /// Into a pose; not constrained.
  void write(const IkState& state, Pose& pose) const;

 private:
  struct Goal {
    std::size_t segment;
    Eigen::Vector3d arm;        // from the segment's joint to the point, on the scanned body
    Eigen::Vector3d direction;  // of a look, unit
    Eigen::Vector3d at;         // where point or look shall be
    double weight;
    bool look;
    Eigen::Vector3d point, sight, to;  // now; `to` is the way from point to `at`, `sight` the direction
  };
  // An angle (0 to 2) or a slide along an axis (3 to 5) that follows others.
  struct Follower {
    struct Lead {
      std::size_t joint, angle;
      double ratio;
    };
    std::size_t joint, kind;
    double rest, low, high;
    std::vector<Lead> leads;
    std::vector<std::pair<std::size_t, double>> by;  // of freedoms: its slope
    bool held = false;                               // at its limit
  };
  // A joint that is evaluated.
  struct Link {
    std::size_t joint;
    int parent;
    bool turns;                    // by its angles; else `still`
    Eigen::Quaterniond in, still;  // joint frame at rest in space, angles taken out; a fixed turn in space
    Eigen::Vector3d bone;          // from the parent's joint, at rest, with what a free joint is moved by
    Eigen::Vector3d slide;         // now, mm along the joint's axes
    std::vector<std::size_t> goals;
  };

  void find_goals();
  void find_followers();
  void find_links(const Pose& start);
  void place(IkState& state);
  void add_turn(const Link& link, const Eigen::Vector3d& axis, double times, std::span<double> column) const;
  void add_way(const Link& link, const Eigen::Vector3d& way, std::span<double> column) const;

  const Rig& rig_;
  const IkProblem& problem_;
  const std::vector<Segment>& segments_;
  std::vector<Goal> goals_;
  std::vector<Freedom> free_;
  std::vector<Follower> followers_;
  std::vector<Link> links_;
  std::vector<int> link_of_;  // #segments, -1 where it is not evaluated
  IkState start_;
  std::vector<Eigen::Quaterniond> turn_;              // #segments, from the scan
  std::vector<Eigen::Vector3d> center_;               // #segments
  std::vector<std::array<Eigen::Vector3d, 3>> axis_;  // #segments, of its angles, in space
};

}  // namespace ecorche::kinematics
