// SPDX-License-Identifier: Apache-2.0
// A sum over tets of what each costs at its deformation gradient, and its derivative in the free nodes.
#pragma once

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace ecorche::elastic {

/// Tets in rows of their own nodes; the first `free` nodes may move, the others are held.
struct TetPatch {
  struct Tet {
    std::array<std::int32_t, 4> node;
    std::array<std::array<double, 3>, 4> gradient;  ///< of the barycentrics at rest, 1/mm
    double weight = 1;                              ///< of its cost
  };
  std::vector<Tet> tets;  ///< each has a free node
  std::size_t free = 0;
  std::vector<double> x;  ///< 3 * #nodes, mm

  /// Of the map from rest to `at`, 3 * #nodes.
  static Eigen::Matrix3d deformation(const Tet& tet, std::span<const double> at) {
    Eigen::Matrix3d F = Eigen::Matrix3d::Zero();
    for (std::size_t a = 0; a < 4; ++a) {
      F += Eigen::Map<const Eigen::Vector3d>(&at[3 * static_cast<std::size_t>(tet.node[a])]) *
           Eigen::Map<const Eigen::Vector3d>(tet.gradient[a].data()).transpose();
    }
    return F;
  }
};

/// d det F / d F.
inline Eigen::Matrix3d cofactors(const Eigen::Matrix3d& F) {
  Eigen::Matrix3d K;
  K.col(0) = F.col(1).cross(F.col(2));
  K.col(1) = F.col(2).cross(F.col(0));
  K.col(2) = F.col(0).cross(F.col(1));
  return K;
}

/// Which tets meet at the free nodes of a patch, which must outlive it. The same bits for any number of
/// threads.
class TetSum {
 public:
  struct Scratch {
    std::vector<std::array<double, 12>> pull;
    std::vector<double> cost;
  };

  explicit TetSum(const TetPatch& patch);

  /// The sum of weight * cost(F, P) at the nodes `x`, where P takes the derivative by F. `gradient` (3 *
  /// free, or empty) takes that of the sum.
  template <class Cost>
  double operator()(std::span<const double> x, const Cost& cost, std::span<double> gradient,
                    Scratch& scratch) const {
    scratch.pull.resize(patch_.tets.size());
    scratch.cost.resize(patch_.tets.size());
    each_block(patch_.tets.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        const TetPatch::Tet& tet = patch_.tets[t];
        Eigen::Matrix3d P;
        scratch.cost[t] = tet.weight * cost(TetPatch::deformation(tet, x), P);
        if (gradient.empty()) continue;
        for (std::size_t a = 0; a < 4; ++a) {
          const Eigen::Vector3d pull =
              tet.weight * (P * Eigen::Map<const Eigen::Vector3d>(tet.gradient[a].data()));
          std::copy(pull.begin(), pull.end(), scratch.pull[t].data() + 3 * a);
        }
      }
    });
    double sum = 0;
    for (const double one : scratch.cost) sum += one;
    if (!gradient.empty()) gather(scratch, gradient);
    return sum;
  }

  template <class F>
  static void each_block(std::size_t count, F f) {
    constexpr std::size_t kBlock = 1024;
    tbb::parallel_for(std::size_t{0}, (count + kBlock - 1) / kBlock,
                      [&](std::size_t b) { f(b * kBlock, std::min(count, (b + 1) * kBlock)); });
  }

 private:
  void gather(const Scratch& scratch, std::span<double> gradient) const;

  const TetPatch& patch_;
  std::vector<std::uint32_t> first_, corner_;  // per free node: its corners, 4 * tet + corner
};

}  // namespace ecorche::elastic
