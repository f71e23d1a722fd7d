// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/balls.hpp"

#include <tbb/parallel_for.h>

#include <cmath>
#include <string>

#include <ecorche/values/error.hpp>
#include "runtime/volume/grid_affine.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;
using RowMajor3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

constexpr double kSnap = 1e-9;

double snapped(double x) {
  const double whole = std::round(x);
  return std::abs(x - whole) < kSnap ? whole : x;
}

Vec3 snapped(const Vector3d& x) {
  return {snapped(x.x()), snapped(x.y()), snapped(x.z())};
}

[[noreturn]] void bad(const VolumetricSkeleton& skeleton, const std::string& what, const std::string& mend) {
  throw Error(ErrorKind::data, "volumetric skeleton '" + skeleton.name + "'", what, mend);
}

void check(const VolumetricSkeleton& skeleton) {
  const auto& spacing = skeleton.grid.spacing;
  for (const double s : spacing) {
    if (!(std::abs(s - spacing[0]) <= 1e-6 * spacing[0]))
      bad(skeleton, "its voxels are not cubic", "thin the volume again");
  }
  if (skeleton.distance.size() != skeleton.size()) {
    bad(skeleton,
        std::to_string(skeleton.size()) + " voxels, but " + std::to_string(skeleton.distance.size()) +
            " distances",
        "thin the volume again");
  }
}

}  // namespace

ImageGrid lattice_of(const VolumetricSkeleton& skeleton, double spacing) {
  ImageGrid lattice = skeleton.grid;
  if (spacing == skeleton.grid.spacing[0]) return lattice;
  for (std::size_t a = 0; a < 3; ++a) {
    lattice.size[a] = static_cast<std::int32_t>(
        std::floor((skeleton.grid.size[a] - 1) * skeleton.grid.spacing[a] / spacing + 1e-6) + 1);
    lattice.spacing[a] = spacing;
  }
  return lattice;
}

BallSet balls_at_rest(const VolumetricSkeleton& skeleton, const ImageGrid& lattice) {
  check(skeleton);
  BallSet set;
  set.lattice = lattice;
  set.back = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};
  set.balls.resize(skeleton.size());
  const Affine place = to_index(lattice) * to_space(skeleton.grid);
  const double scale = skeleton.grid.spacing[0] / lattice.spacing[0];
  // Of the same lattice, radii stay whole numbers.
  const double scale2 = std::abs(scale - 1) < kSnap ? 1 : scale * scale;
  const bool chamfer = skeleton.metric == DistanceMetric::chamfer345;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, skeleton.size(), 4096), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const auto& voxel = skeleton.voxel[i];
      const double distance = skeleton.distance[i];
      const double radius2 = scale2 * (chamfer ? distance * distance / 11 : distance);
      const Vec3 at = snapped(place * Vector3d(voxel[0], voxel[1], voxel[2]));
      set.balls[i] = {at, at, radius2, radius2, 0};
    }
  });
  return set;
}

void move_balls(const VolumetricSkeleton& skeleton, std::span<const RigidTransform> motions, BallSet& set) {
  move_balls(skeleton, skeleton.segment, motions, set);
}

void move_balls(const VolumetricSkeleton& skeleton, std::span<const std::int32_t> segment,
                std::span<const RigidTransform> motions, BallSet& set) {
  if (segment.size() != skeleton.size()) {
    bad(skeleton, "its voxels hang on no segments", "attach it to a rig");
  }
  const Affine index = to_index(set.lattice), space = to_space(set.lattice);
  std::vector<Affine> forth(motions.size());
  set.back.resize(motions.size());
  for (std::size_t s = 0; s < motions.size(); ++s) {
    const Affine motion{motions[s].q.normalized().toRotationMatrix(), motions[s].t};
    forth[s] = index * motion * space;
    Eigen::Map<RowMajor3d> back(set.back[s].data());
    // The lattice is cubic: a rotation there too, whose inverse is its transpose.
    back = forth[s].linear.transpose().unaryExpr([](double x) { return snapped(x); });
  }
  for (const std::int32_t s : segment) {
    if (s < 0) bad(skeleton, "some of its voxels hang on no segment", "attach it to a rig");
    if (static_cast<std::size_t>(s) >= motions.size()) {
      bad(skeleton, "segment " + std::to_string(s) + " of a rig of " + std::to_string(motions.size()),
          "attach it to this rig");
    }
  }
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, set.balls.size(), 4096), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      Ball& ball = set.balls[i];
      ball.motion = segment[i];
      const Affine& move = forth[static_cast<std::size_t>(ball.motion)];
      ball.centre = snapped(move * Vector3d(ball.rest[0], ball.rest[1], ball.rest[2]));
    }
  });
}

}  // namespace ecorche::runtime
