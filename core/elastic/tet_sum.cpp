// SPDX-License-Identifier: Apache-2.0
#include "core/elastic/tet_sum.hpp"

namespace ecorche::elastic {

TetSum::TetSum(const TetPatch& patch) : patch_(patch), first_(patch.free + 1, 0) {
  const auto each_free_corner = [&](auto f) {
    for (std::size_t t = 0; t < patch.tets.size(); ++t)
      for (std::size_t a = 0; a < 4; ++a) {
        const auto n = static_cast<std::size_t>(patch.tets[t].node[a]);
        if (n < patch.free) f(n, static_cast<std::uint32_t>(4 * t + a));
      }
  };
  each_free_corner([&](std::size_t n, std::uint32_t) { ++first_[n + 1]; });
  for (std::size_t n = 0; n < patch.free; ++n) first_[n + 1] += first_[n];
  corner_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  each_free_corner([&](std::size_t n, std::uint32_t corner) { corner_[next[n]++] = corner; });
}

void TetSum::gather(const Scratch& scratch, std::span<double> gradient) const {
  each_block(patch_.free, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      Eigen::Vector3d all = Eigen::Vector3d::Zero();
      for (std::uint32_t i = first_[n]; i < first_[n + 1]; ++i)
        all += Eigen::Map<const Eigen::Vector3d>(&scratch.pull[corner_[i] / 4][3 * (corner_[i] % 4)]);
      std::copy(all.begin(), all.end(), gradient.data() + 3 * n);
    }
  });
}

}  // namespace ecorche::elastic
