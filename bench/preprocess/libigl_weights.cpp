// SPDX-License-Identifier: Apache-2.0
#include "bench/preprocess/peers.hpp"

#ifdef BENCH_LIBIGL
#include <igl/harmonic.h>

#include <chrono>
#endif

namespace ecorche::bench {

#ifdef BENCH_LIBIGL
PeerRun libigl_harmonic(const Points& V, const Tets& T, const std::vector<std::int32_t>& fixed,
                        const Eigen::MatrixXd& values) {
  const Eigen::MatrixXd nodes = V;
  const Eigen::MatrixXi tets = T;
  const Eigen::VectorXi rows =
      Eigen::Map<const Eigen::VectorXi>(fixed.data(), static_cast<Eigen::Index>(fixed.size()));
  PeerRun run{"libigl"};
  Eigen::MatrixXd W;
  const auto start = std::chrono::steady_clock::now();
  const bool good = igl::harmonic(nodes, tets, rows, values, 1, W);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  run.did = good ? "weights in [" + std::to_string(W.minCoeff()) + ", " + std::to_string(W.maxCoeff()) + "]"
                 : "failed";
  return run;
}
#else
PeerRun libigl_harmonic(const Points&, const Tets&, const std::vector<std::int32_t>&,
                        const Eigen::MatrixXd&) {
  return {};
}
#endif

}  // namespace ecorche::bench
