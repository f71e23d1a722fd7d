// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/worst_place.hpp>

#include <cmath>
#include <vector>

#include <ecorche/runtime/pose_quality.hpp>

namespace ecorche::runtime {
namespace {

constexpr double kCubes = 1000;  // a body's volume in cubes
constexpr double kLeastFilled = 0.25;

struct Cube {
  Eigen::Vector3d middles = Eigen::Vector3d::Zero();
  double tets = 0, rest = 0, inverted = 0, changed = 0;  // determinants
};

// Rows of cubes along x, then y, then z, about the body's box.
struct Lattice {
  Eigen::Vector3d low;
  double edge = 0;
  Eigen::Vector3i size;

  std::size_t of(const Eigen::Vector3d& p) const {
    const Eigen::Vector3i i =
        ((p - low) / edge).cast<int>().cwiseMax(0).cwiseMin(size - Eigen::Vector3i::Ones());
    return static_cast<std::size_t>(i.x()) +
           static_cast<std::size_t>(size.x()) *
               (static_cast<std::size_t>(i.y()) +
                static_cast<std::size_t>(size.y()) * static_cast<std::size_t>(i.z()));
  }
};

Lattice lattice_of(const Model& model, double volume) {
  Lattice out;
  out.low = model.nodes.colwise().minCoeff().transpose().cast<double>();
  const Eigen::Vector3d high = model.nodes.colwise().maxCoeff().transpose().cast<double>();
  out.edge = std::cbrt(volume / kCubes);
  // A body thin as a wire would have more cubes than memory.
  out.edge = std::max(out.edge, (high - out.low).maxCoeff() / 500);
  out.size = ((high - out.low) / out.edge).cast<int>() + Eigen::Vector3i::Ones();
  return out;
}

}  // namespace

WorstPlaces worst_places(const Model& model, std::span<const float> nodes,
                         std::span<const std::uint8_t> left_out) {
  WorstPlaces out;
  const std::vector<float> det_f = tet_det_f(model, nodes);
  std::vector<double> rest(det_f.size());
  double volume = 0;
  const auto corner = [&](std::size_t t, int c) {
    return model.nodes.row(model.tets(static_cast<Eigen::Index>(t), c));
  };
  for (std::size_t t = 0; t < det_f.size(); ++t) {
    rest[t] = tet_det(corner(t, 0), corner(t, 1), corner(t, 2), corner(t, 3));
    volume += rest[t] / 6;
  }
  if (!(volume > 0)) return out;
  const Lattice lattice = lattice_of(model, volume);
  out.edge_mm = lattice.edge;
  std::vector<Cube> cubes(static_cast<std::size_t>(lattice.size.x()) *
                          static_cast<std::size_t>(lattice.size.y()) *
                          static_cast<std::size_t>(lattice.size.z()));
  for (std::size_t t = 0; t < det_f.size(); ++t) {
    if (!left_out.empty() && left_out[t] != 0) continue;
    const Eigen::Vector3d middle =
        (corner(t, 0) + corner(t, 1) + corner(t, 2) + corner(t, 3)).cast<double>().transpose() / 4;
    Cube& cube = cubes[lattice.of(middle)];
    cube.middles += middle;
    ++cube.tets;
    cube.rest += rest[t];
    if (det_f[t] <= 0) cube.inverted += rest[t];
    cube.changed += rest[t] * std::abs(static_cast<double>(det_f[t]) - 1);
  }
  const auto hold = [](const Cube& cube, double part, Place& worst) {
    if (part <= worst.share * cube.rest) return;
    worst = {cube.middles / cube.tets, part / cube.rest};
  };
  const double least = 6 * kLeastFilled * std::pow(lattice.edge, 3);
  for (const Cube& cube : cubes) {
    if (cube.rest < least) continue;
    hold(cube, cube.inverted, out.inverted);
    hold(cube, cube.changed, out.changed);
  }
  return out;
}

}  // namespace ecorche::runtime
