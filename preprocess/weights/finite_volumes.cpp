// SPDX-License-Identifier: Apache-2.0
// The Laplacian of Voronoi cells.
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <array>
#include <string>

#include "preprocess/weights/edge_terms.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::weights {
namespace {

/// With the circumcentre o of the tet: the bisector of an edge within the tet is two right triangles for each
/// of the faces f at that edge, between its middle, f's circumcentre and o. Their legs are l cot(angle
/// across) / 2 and the height of o over f, both signed.
EdgeTerms bisectors(const Points& V, const Tets& T, Eigen::Index t) {
  std::array<Eigen::Vector3d, 4> p;
  for (std::size_t c = 1; c < 4; ++c)
    p[c] = (V.row(T(t, static_cast<Eigen::Index>(c))) - V.row(T(t, 0))).transpose();
  p[0].setZero();
  const Eigen::Vector3d bc = p[1].cross(p[2]), cd = p[2].cross(p[3]), db = p[3].cross(p[1]);
  const double det = p[1].dot(cd);
  const Eigen::Vector3d o =
      (p[1].squaredNorm() * cd + p[2].squaredNorm() * db + p[3].squaredNorm() * bc) / (2 * det);
  EdgeTerms terms{};
  for (std::size_t across = 0; across < 4; ++across) {
    const std::array<std::size_t, 3> f{(across + 1) % 4, (across + 2) % 4, (across + 3) % 4};
    Eigen::Vector3d n = (p[f[1]] - p[f[0]]).cross(p[f[2]] - p[f[0]]);
    if (n.dot(p[across] - p[f[0]]) < 0) n = -n;
    const double height = n.dot(o - p[f[0]]) / n.squaredNorm();
    for (std::size_t apex = 0; apex < 3; ++apex) {
      const std::size_t a = f[(apex + 1) % 3], b = f[(apex + 2) % 3];
      terms[static_cast<std::size_t>(edge_of[a][b])] -=
          0.25 * height * (p[a] - p[f[apex]]).dot(p[b] - p[f[apex]]);
    }
  }
  return terms;
}

solve::RawVector<EdgeTerms> terms_of(const Tets& T, const auto& of_tet) {
  solve::RawVector<EdgeTerms> terms(static_cast<std::size_t>(T.rows()));
  tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, T.rows(), 4096), [&](const auto& range) {
    for (Eigen::Index t = range.begin(); t < range.end(); ++t) terms[static_cast<std::size_t>(t)] = of_tet(t);
  });
  return terms;
}

EdgeTerms six(double value) {
  return {value, value, value, value, value, value};
}

}  // namespace

solve::SparseMatrix finite_volumes(const Points& V, const Tets& T, const std::vector<double>& conductivity,
                                   double* positive_share) {
  solve::SparseMatrix L =
      assemble(V.rows(), T, terms_of(T, [&](Eigen::Index t) { return bisectors(V, T, t); }));
  if (!conductivity.empty()) {
    // Of one pattern, all three.
    const auto at = [&](Eigen::Index t) { return conductivity[static_cast<std::size_t>(t)]; };
    const solve::SparseMatrix sum =
        assemble(V.rows(), T, terms_of(T, [&](Eigen::Index t) { return six(at(t)); }));
    const solve::SparseMatrix tets = assemble(V.rows(), T, terms_of(T, [](Eigen::Index) { return six(1); }));
    for (Eigen::Index c = 0; c < L.outerSize(); ++c) L.valuePtr()[L.outerIndexPtr()[c]] = 0;
    for (Eigen::Index c = 0; c < L.outerSize(); ++c) {
      const Eigen::Index own = L.outerIndexPtr()[c];
      for (Eigen::Index n = own + 1; n < L.outerIndexPtr()[c + 1]; ++n) {
        L.valuePtr()[n] *= sum.valuePtr()[n] / tets.valuePtr()[n];
        L.valuePtr()[own] -= L.valuePtr()[n];
        L.valuePtr()[L.outerIndexPtr()[L.innerIndexPtr()[n]]] -= L.valuePtr()[n];
      }
    }
  }
  if (positive_share != nullptr) *positive_share = positive_offdiagonal_share(L);
  return L;
}

solve::SparseMatrix stiffness(const Points& V, const Tets& T, const std::vector<double>& conductivity,
                              double* positive_share) {
  double share = 0;
  solve::SparseMatrix L = laplacian(V, T, conductivity, &share);
  if (share > 0) {
    double of_volumes = 0;
    solve::SparseMatrix volumes = finite_volumes(V, T, conductivity, &of_volumes);
    if (of_volumes == 0) {
      L.swap(volumes);
      share = 0;
    }
  }
  if (positive_share != nullptr) *positive_share = share;
  return L;
}

}  // namespace ecorche::weights
