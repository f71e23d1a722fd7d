// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/conductivity.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

namespace ecorche::weights {

std::vector<double> quasi_harmonic_conductivity(const Tets& T, const solve::Block& values) {
  std::vector<double> out(static_cast<std::size_t>(T.rows()));
  tbb::parallel_for(tbb::blocked_range<Eigen::Index>(0, T.rows(), 4096), [&](const auto& range) {
    Eigen::RowVectorXd mean(values.cols());
    for (Eigen::Index t = range.begin(); t < range.end(); ++t) {
      mean = 0.25 * (values.row(T(t, 0)) + values.row(T(t, 1)) + values.row(T(t, 2)) + values.row(T(t, 3)));
      // Rounding may take it a little below 0.
      out[static_cast<std::size_t>(t)] = 1 / (kConductivityFloor + std::max(0.0, 1 - mean.squaredNorm()));
    }
  });
  return out;
}

}  // namespace ecorche::weights
