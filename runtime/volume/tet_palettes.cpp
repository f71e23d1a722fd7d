// SPDX-License-Identifier: Apache-2.0
#include "runtime/volume/tet_palettes.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace ecorche::runtime {
namespace {

constexpr std::size_t kRunsPerTask = 4096;

}  // namespace

TetPalettes::TetPalettes(const DrawnTets& tets, std::span<const std::uint32_t> order, std::uint32_t stride) {
  const auto all = static_cast<std::size_t>(tets.rows());
  const std::size_t runs = (all + width - 1) / width, tasks = (runs + kRunsPerTask - 1) / kRunsPerTask;
  begin_.resize(runs + 1);
  count_.resize(runs);
  std::vector<std::vector<std::uint32_t>> of_task(tasks);
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    std::vector<std::uint32_t>& words = of_task[task];
    for (std::size_t r = kRunsPerTask * task; r < std::min(runs, kRunsPerTask * (task + 1)); ++r) {
      std::array<std::uint32_t, 4 * width> corner, palette;
      for (std::size_t i = 0; i < width; ++i) {
        const std::size_t place = std::min(all - 1, width * r + i), t = order.empty() ? place : order[place];
        for (std::size_t c = 0; c < 4; ++c) {
          corner[width * c + i] =
              static_cast<std::uint32_t>(tets(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(c)));
        }
      }
      palette = corner;
      std::sort(palette.begin(), palette.end());
      const auto end = std::unique(palette.begin(), palette.end());
      std::array<std::uint8_t, 4 * width> place;
      for (std::size_t i = 0; i < corner.size(); ++i) {
        place[i] =
            static_cast<std::uint8_t>(std::lower_bound(palette.begin(), end, corner[i]) - palette.begin());
      }
      count_[r] = static_cast<std::uint8_t>(end - palette.begin());
      const std::size_t first = words.size();
      words.resize(first + width);
      std::memcpy(&words[first], place.data(), place.size());
      for (auto node = palette.begin(); node != end; ++node) words.push_back(stride * *node);
      while ((words.size() - first) % fill != 0) words.push_back(words.back());
      begin_[r + 1] = static_cast<std::uint32_t>(words.size() - first);
    }
  });
  for (std::size_t r = 0; r < runs; ++r) begin_[r + 1] += begin_[r];
  word_.resize(begin_[runs]);
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    std::copy(of_task[task].begin(), of_task[task].end(),
              word_.begin() + static_cast<std::ptrdiff_t>(begin_[kRunsPerTask * task]));
  });
}

}  // namespace ecorche::runtime
