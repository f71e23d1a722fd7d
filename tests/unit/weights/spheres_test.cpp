// SPDX-License-Identifier: Apache-2.0
// Between two concentric spheres the harmonic function is known, a + b / r, and linear elements must come
// nearer to it at second order.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <vector>

#include "preprocess/weights/harmonic.hpp"

namespace ecorche::weights {
namespace {

constexpr double kInner = 1, kOuter = 2;

double exact(double r) {
  return (1 / r - 1 / kOuter) / (1 / kInner - 1 / kOuter);
}

/// The icosahedron, `level` times split into four, on the unit sphere.
void icosphere(int level, std::vector<Eigen::Vector3d>& V, std::vector<std::array<int, 3>>& F) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  V = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
       {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  F = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
       {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
       {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (auto& v : V) v.normalize();
  for (int l = 0; l < level; ++l) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<int>(V.size()));
      if (is_new) V.push_back((V[static_cast<std::size_t>(a)] + V[static_cast<std::size_t>(b)]).normalized());
      return at->second;
    };
    std::vector<std::array<int, 3>> next;
    for (const auto& f : F) {
      const int a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
      next.insert(next.end(), {{f[0], a, c}, {f[1], b, a}, {f[2], c, b}, {a, b, c}});
    }
    F = std::move(next);
  }
}

struct Shell {
  Points V;
  Tets T;
  int sphere_nodes = 0;
  int layers = 0;
};

/// Prisms over an icosphere, each cut into three tets along the diagonals of the lower corner.
Shell shell(int level, int layers) {
  std::vector<Eigen::Vector3d> sphere;
  std::vector<std::array<int, 3>> F;
  icosphere(level, sphere, F);
  Shell s;
  s.sphere_nodes = static_cast<int>(sphere.size());
  s.layers = layers;
  s.V.resize(static_cast<Eigen::Index>(sphere.size()) * (layers + 1), 3);
  for (int l = 0; l <= layers; ++l) {
    const double r = kInner + (kOuter - kInner) * l / layers;
    for (int n = 0; n < s.sphere_nodes; ++n)
      s.V.row(l * s.sphere_nodes + n) = r * sphere[static_cast<std::size_t>(n)];
  }
  s.T.resize(static_cast<Eigen::Index>(F.size()) * layers * 3, 4);
  Eigen::Index t = 0;
  for (int l = 0; l < layers; ++l) {
    for (auto f : F) {
      std::sort(f.begin(), f.end());  // one rule for both prisms at a side
      const int in = l * s.sphere_nodes, out = in + s.sphere_nodes;
      s.T.row(t++) << in + f[0], in + f[1], in + f[2], out + f[2];
      s.T.row(t++) << in + f[0], in + f[1], out + f[1], out + f[2];
      s.T.row(t++) << in + f[0], out + f[0], out + f[1], out + f[2];
    }
  }
  for (t = 0; t < s.T.rows(); ++t) {
    const auto p = [&](Eigen::Index k) { return s.V.row(s.T(t, k)); };
    if (tet_det(p(0), p(1), p(2), p(3)) < 0) std::swap(s.T(t, 0), s.T(t, 1));
  }
  return s;
}

/// L2 norm of the error of the piecewise linear function, by Keast's four-point rule (exact for quadratics).
double l2_error(const Shell& s, const Eigen::VectorXd& u) {
  constexpr double a = 0.5854101966249685, b = 0.1381966011250105;
  double sum = 0;
  for (Eigen::Index t = 0; t < s.T.rows(); ++t) {
    const auto p = [&](Eigen::Index k) { return s.V.row(s.T(t, k)); };
    const double volume = tet_det(p(0), p(1), p(2), p(3)) / 6;
    for (Eigen::Index q = 0; q < 4; ++q) {
      Eigen::RowVector3d x = Eigen::RowVector3d::Zero();
      double value = 0;
      for (Eigen::Index k = 0; k < 4; ++k) {
        const double w = k == q ? a : b;
        x += w * p(k);
        value += w * u(s.T(t, k));
      }
      sum += volume / 4 * std::pow(value - exact(x.norm()), 2);
    }
  }
  return std::sqrt(sum);
}

TEST(Spheres, TheErrorFallsAtSecondOrder) {
  std::printf("  level  layers  nodes    tets     L2 error   order\n");
  double before = 0;
  for (int level = 0; level <= 3; ++level) {
    const Shell s = shell(level + 1, 2 << level);
    const solve::SparseMatrix L = laplacian(s.V, s.T, nullptr);
    std::vector<std::uint8_t> fixed(static_cast<std::size_t>(s.V.rows()), 0);
    Eigen::MatrixXd boundary = Eigen::MatrixXd::Zero(s.V.rows(), 1);
    for (int n = 0; n < s.sphere_nodes; ++n) {
      fixed[static_cast<std::size_t>(n)] = 1;
      boundary(n, 0) = 1;
      fixed[fixed.size() - 1 - static_cast<std::size_t>(n)] = 1;
    }
    const auto solver = make_solver("auto");
    const double error = l2_error(s, solve_harmonic(L, fixed, boundary, *solver, {}).values.col(0));
    const double order = level == 0 ? 0 : std::log2(before / error);
    std::printf("  %5d  %6d  %7ld  %7ld  %.3e  %5.2f\n", level + 1, s.layers, static_cast<long>(s.V.rows()),
                static_cast<long>(s.T.rows()), error, order);
    if (level > 0) {
      EXPECT_GT(order, level > 1 ? 1.8 : 1.5);  // the coarsest pair has two layers only
    }
    before = error;
  }
}

}  // namespace
}  // namespace ecorche::weights
