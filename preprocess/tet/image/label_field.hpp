// SPDX-License-Identifier: Apache-2.0
// A label image as a function of space, with rounded steps.
#pragma once

#include <cmath>
#include <span>

#include <ecorche/values/image.hpp>

namespace ecorche::tet {

/// The label with the largest trilinear weight among the eight voxels around a point; of equal ones the
/// higher, so that bones win. A plate one voxel thick keeps its thickness. 0 beyond the image.
class LabelField {
 public:
  explicit LabelField(const Image& labels) : grid_(labels.grid), voxels_(labels.scalars<std::uint16_t>()) {}

  std::uint16_t operator()(double x, double y, double z) const {
    const double p[3] = {x, y, z};
    int low[3];
    double part[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double index = (p[axis] - grid_.origin[axis]) / grid_.spacing[axis];
      const double floor = std::floor(index);
      if (!(floor >= 0 && floor < grid_.size[axis] - 1)) return 0;
      low[axis] = static_cast<int>(floor);
      part[axis] = index - floor;
    }
    std::uint16_t seen[8];
    const std::size_t row = static_cast<std::size_t>(grid_.size[0]);
    const std::size_t layer = row * static_cast<std::size_t>(grid_.size[1]);
    const std::uint16_t* v = &voxels_[grid_.offset(low[0], low[1], low[2])];
    for (std::size_t n = 0; n < 8; ++n) seen[n] = v[(n & 1) + (n >> 1 & 1) * row + (n >> 2) * layer];
    bool alike = true;
    for (const std::uint16_t label : seen) alike = alike && label == seen[0];
    return alike ? seen[0] : vote(seen, part);
  }

 private:
  static std::uint16_t vote(const std::uint16_t (&seen)[8], const double (&part)[3]) {
    double weight[8];
    for (std::size_t n = 0; n < 8; ++n)
      weight[n] = ((n & 1) != 0 ? part[0] : 1 - part[0]) * ((n & 2) != 0 ? part[1] : 1 - part[1]) *
                  ((n & 4) != 0 ? part[2] : 1 - part[2]);
    double most = -1;
    std::uint16_t winner = 0;
    for (std::size_t n = 0; n < 8; ++n) {
      double sum = 0;
      for (std::size_t m = 0; m < 8; ++m) sum += seen[m] == seen[n] ? weight[m] : 0;
      if (sum > most || (sum == most && seen[n] > winner)) {
        most = sum;
        winner = seen[n];
      }
    }
    return winner;
  }

  const ImageGrid& grid_;
  std::span<const std::uint16_t> voxels_;
};

}  // namespace ecorche::tet
