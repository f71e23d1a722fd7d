// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/runs.hpp"

#include <algorithm>

namespace ecorche::thin {

Runs::Runs(const Mask& mask, Boundary boundary, const Context& context) {
  const std::ptrdiff_t nx = mask.grid.size[0], ny = mask.grid.size[1], nz = mask.grid.size[2];
  first_.reserve(static_cast<std::size_t>(ny * nz) + 1);
  for (std::ptrdiff_t row = 0; row < ny * nz; ++row) {
    if (row % ny == 0) context.check_stop();
    first_.push_back(runs_.size());
    const std::uint8_t* const inside = mask.inside.data() + row * nx;
    for (std::ptrdiff_t i = 0; i < nx;) {
      const std::uint8_t* const begin = std::find(inside + i, inside + nx, std::uint8_t{1});
      const std::uint8_t* const end = std::find(begin, inside + nx, std::uint8_t{0});
      i = end - inside;
      if (begin < end) runs_.push_back({row * nx + (begin - inside), row * nx + i});
    }
  }
  first_.push_back(runs_.size());
  parent_.resize(runs_.size());
  for (std::size_t r = 0; r < parent_.size(); ++r) parent_[r] = r;

  // Dual to the boundary: see Boundary.
  const bool corners = boundary == Boundary::faces_6;
  for (std::ptrdiff_t k = 0; k < nz; ++k) {
    context.check_stop();
    for (std::ptrdiff_t j = 0; j < ny; ++j) {
      const auto row = static_cast<std::size_t>(k * ny + j);
      const auto slice = static_cast<std::size_t>(ny);
      const std::ptrdiff_t reach = corners ? 1 : 0;
      if (j > 0) join_rows(row, row - 1, nx, reach);
      if (k == 0) continue;
      join_rows(row, row - slice, nx, reach);
      if (corners && j > 0) join_rows(row, row - slice - 1, nx, reach);
      if (corners && j + 1 < ny) join_rows(row, row - slice + 1, nx, reach);
    }
  }
  // A parent is an earlier run, so one way through suffices.
  for (std::size_t& parent : parent_) parent = parent_[parent];
}

// Joins the runs of two rows that overlap once one is made `reach` longer at both ends.
void Runs::join_rows(std::size_t row, std::size_t other, std::ptrdiff_t nx, std::ptrdiff_t reach) {
  const std::ptrdiff_t shift = (static_cast<std::ptrdiff_t>(row) - static_cast<std::ptrdiff_t>(other)) * nx;
  std::size_t a = first_[row], b = first_[other];
  while (a < first_[row + 1] && b < first_[other + 1]) {
    const std::ptrdiff_t begin = runs_[b].begin + shift, end = runs_[b].end + shift;
    if (begin < runs_[a].end + reach && runs_[a].begin < end + reach) join(a, b);
    if (end < runs_[a].end) {
      ++b;
    } else {
      ++a;
    }
  }
}

void Runs::join(std::size_t a, std::size_t b) {
  const auto root = [&](std::size_t r) {
    while (parent_[r] != r) r = parent_[r] = parent_[parent_[r]];  // halves the way for the next
    return r;
  };
  a = root(a);
  b = root(b);
  parent_[std::max(a, b)] = std::min(a, b);
}

std::vector<std::size_t> Runs::piece_voxels() const {
  std::vector<std::size_t> voxels(runs_.size(), 0);
  for (std::size_t r = 0; r < runs_.size(); ++r)
    voxels[piece(r)] += static_cast<std::size_t>(runs_[r].end - runs_[r].begin);
  return voxels;
}

}  // namespace ecorche::thin
