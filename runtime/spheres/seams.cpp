// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/seams.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/spheres/effects.hpp"
#include "runtime/spheres/owners.hpp"
#include "runtime/spheres/places.hpp"
#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostJoints = 2;
// Of seams over two joints, in radii of the body at a joint.
constexpr double kReach = 2;
// A ball that sticks out of a larger one by less adds nothing, voxels.
constexpr double kSlack = 0.5;
constexpr double kMostSteps = 64;
// Motions for every step of the ball that takes most: strides are whole numbers of them.
constexpr int kShares = 4;
// Two motions that differ by less are one: radians, and mm.
constexpr double kSame = 1e-9;

double distance2(const Vec3& a, const Vec3& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

// From `a` up to where the ways to the root meet, and down to `b`.
std::vector<std::int32_t> way_between(const std::vector<std::int32_t>& parent, std::int32_t a,
                                      std::int32_t b) {
  const auto up = [&](std::int32_t s) {
    std::vector<std::int32_t> out;
    for (; s >= 0; s = parent[static_cast<std::size_t>(s)]) out.push_back(s);
    return out;
  };
  std::vector<std::int32_t> from = up(a), to = up(b);
  std::int32_t meet = -1;
  while (!from.empty() && !to.empty() && from.back() == to.back()) {
    meet = from.back();
    from.pop_back();
    to.pop_back();
  }
  if (meet >= 0) from.push_back(meet);
  from.insert(from.end(), to.rbegin(), to.rend());
  return from;
}

// The joints along a way: each belongs to the child of the two.
std::vector<std::int32_t> joints_of(const std::vector<std::int32_t>& parent,
                                    const std::vector<std::int32_t>& way) {
  std::vector<std::int32_t> out;
  for (std::size_t i = 1; i < way.size(); ++i)
    out.push_back(parent[static_cast<std::size_t>(way[i])] == way[i - 1] ? way[i] : way[i - 1]);
  return out;
}

using Pair = std::pair<std::int32_t, std::int32_t>;

// Voxels of the lattice on both sides, by segments, the lower row first.
std::map<Pair, std::vector<Vec3>> touching(const BallSet& rest, const std::vector<std::int32_t>& segment,
                                           const Context& context) {
  const LatticeBox box = grown_box(rest);
  const ImageGrid grid = grid_of(rest.lattice, box);
  const std::vector<std::int32_t> owner = owners_of(rest, box, context);
  std::vector<std::uint8_t> taken(grid.voxels(), 0);
  std::map<Pair, std::vector<Vec3>> out;
  const std::array<std::size_t, 3> step{1, grid.offset(0, 1, 0), grid.offset(0, 0, 1)};
  for (std::int32_t k = 0; k < grid.size[2]; ++k) {
    for (std::int32_t j = 0; j < grid.size[1]; ++j) {
      for (std::int32_t i = 0; i < grid.size[0]; ++i) {
        const std::array<std::int32_t, 3> at{i, j, k};
        const std::size_t here = grid.offset(i, j, k);
        if (owner[here] < 0) continue;
        for (std::size_t a = 0; a < 3; ++a) {
          if (at[a] + 1 >= grid.size[a] || owner[here + step[a]] < 0) continue;
          const std::int32_t s = segment[static_cast<std::size_t>(owner[here])],
                             t = segment[static_cast<std::size_t>(owner[here + step[a]])];
          if (s == t) continue;
          auto& voxels = out[std::minmax(s, t)];
          for (const bool beyond : {false, true}) {
            Vec3 voxel;
            for (std::size_t b = 0; b < 3; ++b) voxel[b] = box.first[b] + at[b] + (beyond && a == b ? 1 : 0);
            voxels.push_back(voxel);
          }
        }
      }
    }
  }
  for (auto& [pair, voxels] : out) {
    std::sort(voxels.begin(), voxels.end());
    voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
  }
  return out;
}

// The radius of the largest ball around each voxel that one of the body's holds whole.
std::vector<double> radii_at(const std::vector<Vec3>& voxels, const BallSet& rest, const Places& centres) {
  double largest = 0;
  for (const Ball& ball : rest.balls) largest = std::max(largest, ball.radius2);
  std::vector<double> out(voxels.size(), 0);
  tbb::parallel_for(std::size_t{0}, voxels.size(), [&](std::size_t v) {
    centres.for_near(voxels[v], std::sqrt(largest), [&](std::size_t b) {
      const Ball& ball = rest.balls[b];
      const double far2 = distance2(ball.rest, voxels[v]);
      if (far2 < ball.radius2) out[v] = std::max(out[v], std::sqrt(ball.radius2) - std::sqrt(far2));
    });
  });
  return out;
}

std::vector<Seam::Sheet> sheet_of(const std::vector<Vec3>& voxels, const std::vector<double>& radius) {
  std::vector<std::size_t> order(voxels.size());
  for (std::size_t v = 0; v < order.size(); ++v) order[v] = v;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return radius[a] > radius[b]; });
  std::vector<Seam::Sheet> out;
  for (const std::size_t v : order) {
    const bool within = std::any_of(out.begin(), out.end(), [&](const Seam::Sheet& larger) {
      const double room = std::sqrt(larger.radius2) + kSlack - radius[v];
      return distance2(larger.voxel, voxels[v]) <= room * room;
    });
    if (!within) out.push_back({voxels[v], radius[v] * radius[v]});
  }
  return out;
}

}  // namespace

Seams seams_of(const BallSet& rest, const std::vector<std::int32_t>& segment, const Skeleton& rig,
               const Context& context) {
  Seams out;
  for (const Segment& s : rig.segments) {
    out.parent.push_back(s.parent);
    out.joint.push_back({s.joint.center.x(), s.joint.center.y(), s.joint.center.z()});
  }
  if (rest.balls.empty()) return out;
  std::vector<Vec3> centres;
  for (const Ball& ball : rest.balls) centres.push_back(ball.rest);
  const Places places(std::move(centres));
  const auto at_joint = radii_at_joints(rest, rig);
  for (auto& [pair, voxels] : touching(rest, segment, context)) {
    Seam seam{way_between(out.parent, pair.first, pair.second), {}};
    const auto joints = joints_of(out.parent, seam.way);
    if (joints.size() > kMostJoints) continue;
    if (joints.size() > 1) {
      std::erase_if(voxels, [&](const Vec3& voxel) {
        return std::none_of(joints.begin(), joints.end(), [&](std::int32_t j) {
          const auto s = static_cast<std::size_t>(j);
          const double reach = kReach * at_joint[s];
          return distance2(voxel, rest.lattice.index(out.joint[s])) <= reach * reach;
        });
      });
    }
    seam.sheet = sheet_of(voxels, radii_at(voxels, rest, places));
    if (!seam.sheet.empty()) out.seams.push_back(std::move(seam));
  }
  return out;
}

namespace {

// From the motion of a joint's parent to that of its child.
struct Turn {
  RigidTransform from, to;
  Vector3d joint;

  double angle() const { return from.q.angularDistance(to.q); }
  double shift() const { return (from * joint - to * joint).norm(); }
  RigidTransform at(double share) const {
    RigidTransform out;
    out.q = from.q.slerp(share, to.q).normalized();
    out.t = (1 - share) * (from * joint) + share * (to * joint) - out.q * joint;
    return out;
  }
};

// Balls of radius r that lie 2 w apart leave scallops of r - sqrt(r^2 - w^2): at most half a voxel where
// w^2 <= r - 1/4.
double apart(const Seam::Sheet& at) {
  return 2 * std::sqrt(std::max(std::sqrt(at.radius2) - 0.25, 0.5));
}

// How one ball of a sheet is swept: large ones near the joint in longer strides than small ones far out.
struct Sweep {
  Vector3d from, to;  // where the way begins and ends, voxels
  int steps = 1;      // along it
  int chords = 0;     // further ways, from inside the arc to the chord
};

std::vector<Sweep> sweeps_of(const Turn& turn, const std::vector<Seam::Sheet>& sheet,
                             const ImageGrid& lattice) {
  const Affine space = to_space(lattice), index = to_index(lattice);
  const auto forth = [&](double share) {
    const RigidTransform at = turn.at(share);
    return index * Affine{at.q.toRotationMatrix(), at.t} * space;
  };
  const Affine from = forth(0), middle = forth(0.5), to = forth(1);
  const Vec3 joint = lattice.index({turn.joint.x(), turn.joint.y(), turn.joint.z()});
  std::vector<Sweep> out;
  for (const Seam::Sheet& at : sheet) {
    const Vector3d voxel(at.voxel.data());
    Sweep sweep{from * voxel, to * voxel};
    const double way =
        turn.angle() * std::sqrt(distance2(at.voxel, joint)) + turn.shift() / lattice.spacing[0];
    const double bow = (middle * voxel - 0.5 * (sweep.from + sweep.to)).norm();
    sweep.steps = static_cast<int>(std::clamp(std::ceil(way / apart(at)), 1.0, kMostSteps));
    sweep.chords = static_cast<int>(std::min(bow / apart(at), kMostSteps));
    out.push_back(sweep);
  }
  return out;
}

}  // namespace

void bridge(const Seams& seams, std::span<const RigidTransform> motions, BallSet& set) {
  const Affine index = to_index(set.lattice), space = to_space(set.lattice);
  set.bridges_from = static_cast<std::int32_t>(set.balls.size());
  for (const Seam& seam : seams.seams) {
    for (const std::int32_t child : joints_of(seams.parent, seam.way)) {
      const auto s = static_cast<std::size_t>(child), p = static_cast<std::size_t>(seams.parent[s]);
      const Turn turn{motions[p], motions[s], Vector3d(seams.joint[s].data())};
      if (turn.angle() < kSame && turn.shift() < kSame) continue;
      const std::vector<Sweep> sweeps = sweeps_of(turn, seam.sheet, set.lattice);
      int most = 1;
      for (const Sweep& sweep : sweeps) most = std::max(most, sweep.steps);
      const int shares = kShares * most;
      for (int i = 0; i <= shares; ++i) {
        const double along = static_cast<double>(i) / shares;
        const RigidTransform share = turn.at(along);
        const Affine motion{share.q.toRotationMatrix(), share.t};
        const Affine forth = index * motion * space;
        const auto row = static_cast<std::int32_t>(set.back.size());
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(set.back.emplace_back().data()) =
            forth.linear.transpose();
        for (std::size_t b = 0; b < sweeps.size(); ++b) {
          const Sweep& sweep = sweeps[b];
          if (i < shares && i % (shares / sweep.steps) != 0) continue;
          const Seam::Sheet& at = seam.sheet[b];
          const Vector3d arc = forth * Vector3d(at.voxel.data());
          const Vector3d chord = (1 - along) * sweep.from + along * sweep.to;
          for (int c = 0; c <= sweep.chords; ++c) {
            const Vector3d to = sweep.chords == 0 ? arc : arc + (chord - arc) * c / sweep.chords;
            set.balls.push_back({at.voxel, {to.x(), to.y(), to.z()}, at.radius2, at.radius2, row});
          }
        }
      }
    }
  }
}

}  // namespace ecorche::runtime
