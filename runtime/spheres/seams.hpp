// SPDX-License-Identifier: Apache-2.0
// What opens between two segments that turn against each other, and the balls that fill it: past Gagvani01,
// whose remedy for "visible errors" (7) is a bulge.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/skeleton.hpp>
#include <ecorche/values/transform.hpp>
#include "runtime/spheres/balls.hpp"

namespace ecorche::runtime {

/// A sheet of a body at rest where voxels of two segments lie beside each other.
struct Seam {
  std::vector<std::int32_t> way;  ///< segments from the one to the other, each beside the next in the rig
  struct Sheet {
    Vec3 voxel;      ///< index of the lattice
    double radius2;  ///< squared, voxels: of the largest ball around it within one of the body's
  };
  std::vector<Sheet> sheet;
};

/// All of a body. Needs no pose.
struct Seams {
  std::vector<Seam> seams;
  std::vector<std::int32_t> parent;  ///< of every segment of the rig
  std::vector<Vec3> joint;           ///< mm LPS, of every segment
};

/// `rest`: before any motion or effect; `segment`: of every ball, a row of `rig`. Segments that are one joint
/// apart, or two (flesh of the armpit that hangs on the chest and on the arm); the latter only within twice
/// the body's radius of a joint between them, since what touches farther off (the thighs) parts for good. Of
/// the voxels of a seam those stay whose ball sticks out of every larger one by half a voxel. O(voxels of the
/// grown box + voxels of seams x balls near them).
Seams seams_of(const BallSet& rest, const std::vector<std::int32_t>& segment, const Skeleton& rig,
               const Context& context = {});

/// Adds the balls of every seam, swept from the motion of one of its segments to that of the other along the
/// joints between them: turned about each joint's centre by shares of its rotation, so many that the bodies
/// of neighbouring balls leave no scallop deeper than half a voxel, and, where that arc bows out so far that
/// the straight way lies outside the balls on it, along ways between the arc and its chord too: a sheet that
/// does not reach to the axis sweeps a shell, with nothing inside it. What they show turns likewise, halfway
/// between the segments. They own only what no ball before them holds: what the body shows of itself, it
/// shows as without them. Nothing is added where nothing turns. Once a pose. `motions`: as move_balls has
/// them.
void bridge(const Seams& seams, std::span<const RigidTransform> motions, BallSet& set);

}  // namespace ecorche::runtime
