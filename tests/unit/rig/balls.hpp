// SPDX-License-Identifier: Apache-2.0
// Surfaces of a ball in a socket, from formulas.
#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include <ecorche/values/mesh.hpp>

namespace ecorche::test {

/// A sphere of rings; `noise`: standard deviation of every vertex along its normal, mm.
inline SurfaceMesh ball(const Eigen::Vector3d& center, double radius, int rings, double noise = 0,
                        bool inward = false) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, 1);
  SurfaceMesh mesh;
  const int around = 2 * rings;
  mesh.V.resize((rings - 1) * around + 2, 3);
  const auto place = [&](Eigen::Index row, const Eigen::Vector3d& unit) {
    mesh.V.row(row) = (center + (radius + noise * normal(random)) * unit).transpose();
  };
  place(0, Eigen::Vector3d::UnitZ());
  for (int i = 1; i < rings; ++i) {
    const double polar = std::numbers::pi * i / rings;
    for (int j = 0; j < around; ++j) {
      const double turn = 2 * std::numbers::pi * j / around;
      place(1 + (i - 1) * around + j,
            {std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)});
    }
  }
  const auto last = static_cast<std::int32_t>(mesh.V.rows() - 1);
  place(last, -Eigen::Vector3d::UnitZ());
  std::vector<Eigen::RowVector3i> faces;
  const auto at = [&](int i, int j) { return 1 + (i - 1) * around + (j + around) % around; };
  for (int j = 0; j < around; ++j) {
    faces.emplace_back(0, at(1, j), at(1, j + 1));
    faces.emplace_back(last, at(rings - 1, j + 1), at(rings - 1, j));
    for (int i = 1; i + 1 < rings; ++i) {
      faces.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      faces.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  mesh.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) mesh.F.row(static_cast<Eigen::Index>(f)) = faces[f];
  if (inward) mesh.F.col(1).swap(mesh.F.col(2));
  return mesh;
}

/// The vertices of `mesh` (and the faces between them) that `keep` accepts.
template <class Keep>
SurfaceMesh part_of(const SurfaceMesh& mesh, Keep&& keep) {
  SurfaceMesh part;
  std::vector<std::int32_t> row(static_cast<std::size_t>(mesh.V.rows()), -1);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
    if (!keep(Eigen::Vector3d(mesh.V.row(v).transpose()))) continue;
    row[static_cast<std::size_t>(v)] = static_cast<std::int32_t>(kept.size());
    kept.push_back(v);
  }
  part.V.resize(static_cast<Eigen::Index>(kept.size()), 3);
  for (std::size_t i = 0; i < kept.size(); ++i)
    part.V.row(static_cast<Eigen::Index>(i)) = mesh.V.row(kept[i]);
  std::vector<Eigen::RowVector3i> faces;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const Eigen::RowVector3i to(row[static_cast<std::size_t>(mesh.F(f, 0))],
                                row[static_cast<std::size_t>(mesh.F(f, 1))],
                                row[static_cast<std::size_t>(mesh.F(f, 2))]);
    if (to.minCoeff() >= 0) faces.push_back(to);
  }
  part.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) part.F.row(static_cast<Eigen::Index>(f)) = faces[f];
  return part;
}

/// Two surfaces as one mesh.
inline SurfaceMesh joined(const SurfaceMesh& a, const SurfaceMesh& b) {
  SurfaceMesh both;
  both.V.resize(a.V.rows() + b.V.rows(), 3);
  both.V << a.V, b.V;
  both.F.resize(a.F.rows() + b.F.rows(), 3);
  both.F << a.F, b.F.array() + static_cast<std::int32_t>(a.V.rows());
  return both;
}

}  // namespace ecorche::test
