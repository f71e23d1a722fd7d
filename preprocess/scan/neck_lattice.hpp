// SPDX-License-Identifier: Apache-2.0
// A neck sampled every millimetre along the patient's own axes.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <ecorche/values/image.hpp>

namespace ecorche::scan {

/// i to the left, j to the back, k up.
struct NeckLattice {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d low = Eigen::Vector3d::Zero();  ///< along `axes`, mm
  std::array<std::int32_t, 3> size{0, 0, 0};
  /// 0: flesh, 1: as the threshold of bone, up to 4; below 0: beyond the image.
  std::vector<float> bright;
  std::vector<std::uint8_t> neck;   ///< bone of the neck
  std::vector<std::uint8_t> other;  ///< other bones

  std::size_t offset(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size[0]) *
               (static_cast<std::size_t>(j) +
                static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k));
  }
  bool has(int i, int j, int k) const {
    return i >= 0 && j >= 0 && k >= 0 && i < size[0] && j < size[1] && k < size[2];
  }
  /// At most 1, however dense; below 0 where it is not known.
  double at(int i, int j, int k) const {
    return has(i, j, k) ? std::min(1.0, static_cast<double>(bright[offset(i, j, k)])) : -1;
  }
  /// f(point, LPS mm; offset) for each sample.
  template <class F>
  void each(F&& f) const {
    std::size_t n = 0;
    for (int k = 0; k < size[2]; ++k) {
      for (int j = 0; j < size[1]; ++j) {
        for (int i = 0; i < size[0]; ++i, ++n) f(axes * (low + Eigen::Vector3d(i, j, k)), n);
      }
    }
  }
  /// The nearest sample's numbers, which may lie beyond.
  Eigen::Vector3i cell(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = axes.transpose() * p - low;
    return {static_cast<int>(std::lround(q[0])), static_cast<int>(std::lround(q[1])),
            static_cast<int>(std::lround(q[2]))};
  }
};

/// Round all of `neck`, and a little more. Empty where that is empty, or larger than a neck may be.
NeckLattice neck_lattice(const Image& ct, const std::vector<std::uint8_t>& neck,
                         const std::vector<std::uint8_t>& other, const Eigen::Matrix3d& axes, double bone,
                         double skin);

}  // namespace ecorche::scan
