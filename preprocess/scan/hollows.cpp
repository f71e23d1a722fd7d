// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/cut_bones.hpp"

namespace ecorche::scan {
namespace {

constexpr std::uint16_t kSeen = 65535;  // marks what was looked at

}  // namespace

void fill_hollows(std::vector<std::uint16_t>& of, const ImageGrid& grid,
                  const std::vector<double>& most_mm2) {
  const int nx = grid.size[0], ny = grid.size[1];
  const std::size_t layer = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  const double voxel_mm2 = grid.spacing[0] * grid.spacing[1];
  std::vector<std::int32_t> hollow;
  for (int k = 0; k < grid.size[2]; ++k) {
    std::uint16_t* slice = of.data() + layer * static_cast<std::size_t>(k);
    for (std::size_t start = 0; start < layer; ++start) {
      if (slice[start] != 0) continue;
      hollow.assign(1, static_cast<std::int32_t>(start));
      slice[start] = kSeen;
      std::uint16_t around = 0;
      bool closed = true;
      for (std::size_t next = 0; next < hollow.size(); ++next) {
        const int i = hollow[next] % nx, j = hollow[next] / nx;
        closed = closed && i > 0 && j > 0 && i + 1 < nx && j + 1 < ny;
        const auto look = [&](int x, int y) {
          if (x < 0 || y < 0 || x >= nx || y >= ny) return;
          const std::int32_t to = y * nx + x;
          std::uint16_t& id = slice[to];
          if (id == 0) {
            id = kSeen;
            hollow.push_back(to);
          } else if (id != kSeen) {
            closed = closed && (around == 0 || around == id);
            around = id;
          }
        };
        look(i - 1, j), look(i + 1, j), look(i, j - 1), look(i, j + 1);
      }
      if (!closed || around == 0 || voxel_mm2 * static_cast<double>(hollow.size()) > most_mm2[around - 1U])
        continue;
      for (const std::int32_t v : hollow) slice[v] = around;
    }
    for (std::size_t v = 0; v < layer; ++v) {
      if (slice[v] == kSeen) slice[v] = 0;
    }
  }
}

}  // namespace ecorche::scan
