// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "preprocess/scan/cut_bones.hpp"

namespace ecorche::scan {
namespace {

// Voxels by level, the highest first, those of a level in the order in which they came.
class Levels {
 public:
  void push(std::size_t level, std::size_t voxel) {
    if (level >= at_.size()) at_.resize(level + 1);
    at_[level].voxels.push_back(voxel);
    highest_ = std::max(highest_, level);
  }
  bool pop(std::size_t& level, std::size_t& voxel) {
    while (true) {
      if (at_.empty()) return false;
      Level& here = at_[highest_];
      if (here.next < here.voxels.size()) {
        level = highest_;
        voxel = here.voxels[here.next++];
        return true;
      }
      here = {};
      if (highest_ == 0) return false;
      --highest_;
    }
  }

 private:
  struct Level {
    std::vector<std::size_t> voxels;
    std::size_t next = 0;
  };
  std::vector<Level> at_;
  std::size_t highest_ = 0;
};

}  // namespace

void watershed(const std::vector<std::uint8_t>& mask, const std::vector<float>& depth,
               const std::array<std::int32_t, 3>& size, double step, std::vector<std::uint16_t>& of,
               const Context& context) {
  const auto nx = static_cast<std::ptrdiff_t>(size[0]), nxy = nx * static_cast<std::ptrdiff_t>(size[1]);
  const auto level_of = [&](std::size_t v) {
    return static_cast<std::size_t>(static_cast<double>(depth[v]) / step);
  };
  const auto neighbours = [&](std::size_t v, auto&& f) {
    const auto at = static_cast<std::ptrdiff_t>(v);
    const auto k = at / nxy, j = at % nxy / nx, i = at % nx;
    for (std::ptrdiff_t dk = k > 0 ? -1 : 0; dk <= (k + 1 < size[2] ? 1 : 0); ++dk) {
      for (std::ptrdiff_t dj = j > 0 ? -1 : 0; dj <= (j + 1 < size[1] ? 1 : 0); ++dj) {
        for (std::ptrdiff_t di = i > 0 ? -1 : 0; di <= (i + 1 < size[0] ? 1 : 0); ++di) {
          if (std::abs(di) + std::abs(dj) + std::abs(dk) > 2) continue;  // corners only
          f(static_cast<std::size_t>(at + di + nx * dj + nxy * dk));
        }
      }
    }
  };
  Levels levels;
  for (std::size_t v = 0; v < of.size(); ++v) {
    if (of[v] == 0) continue;
    bool rim = false;
    neighbours(v, [&](std::size_t n) { rim = rim || (mask[n] != 0 && of[n] == 0); });
    if (rim) levels.push(level_of(v), v);
  }
  std::size_t level = 0, voxel = 0;
  for (std::size_t done = 0; levels.pop(level, voxel); ++done) {
    if (done % 65536 == 0) context.check_stop();
    neighbours(voxel, [&](std::size_t n) {
      if (mask[n] == 0 || of[n] != 0) return;
      of[n] = of[voxel];
      levels.push(std::min(level, level_of(n)), n);
    });
  }
}

}  // namespace ecorche::scan
