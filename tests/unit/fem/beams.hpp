// SPDX-License-Identifier: Apache-2.0
// Bodies whose shape under load is known, solved as preprocess/fem solves a patient.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "preprocess/fem/follow.hpp"
#include "preprocess/weights/harmonic.hpp"
#include "tests/unit/weights/box_mesh.hpp"

namespace ecorche::fem {

using Where = std::function<bool(const Eigen::Vector3d&)>;
using Place = std::function<Eigen::Vector3d(const Eigen::Vector3d& X, double t)>;

/// A mesh, and what it becomes where its held nodes go along `place` from t = 0 to 1.
struct Solved {
  Mesh mesh;
  Points x, forces;  ///< at the end; forces hold the held nodes
  FollowResult follow;
};

inline Mesh mesh_of(Element element, const TetMesh& body, const Where& held_at) {
  std::vector<std::uint8_t> held(static_cast<std::size_t>(body.V.rows()));
  for (std::size_t n = 0; n < held.size(); ++n)
    held[n] = held_at(body.V.row(static_cast<Eigen::Index>(n)).transpose()) ? 1 : 0;
  std::vector<std::array<std::int32_t, 2>> edges;
  for (const auto& [a, b] : edges_of(body.T)) {
    const Eigen::Vector3d middle = (body.V.row(a) + body.V.row(b)).transpose() / 2;
    if (held[static_cast<std::size_t>(a)] != 0 && held[static_cast<std::size_t>(b)] != 0 && held_at(middle))
      edges.push_back({a, b});
  }
  return make_mesh(element, body.V, body.T, held, edges);
}

inline Solved solve(Mesh mesh, const Material& material, const Place& place, double first_step = 1,
                    double tolerance_mm = 1e-6) {
  Solved out;
  out.mesh = std::move(mesh);
  out.x = out.mesh.X;
  const Assembly assembly(out.mesh);
  const auto solver = weights::make_solver("auto");
  StepSolver steps(assembly, *solver);
  const auto held_at = [&](double t, Points& x) {
    for (std::size_t n = 0; n < out.mesh.free.size(); ++n) {
      const auto row = static_cast<Eigen::Index>(n);
      if (out.mesh.free[n] < 0) x.row(row) = place(out.mesh.X.row(row).transpose(), t).transpose();
    }
  };
  FollowOptions options;
  options.first_step = first_step;
  options.last.tolerance_mm = tolerance_mm;
  out.follow = follow(assembly, material, steps, held_at, options, out.x, {});
  solve::SparseMatrix H;
  assembly.derivatives(material, out.x, false, nullptr, out.forces, H);
  return out;
}

}  // namespace ecorche::fem
