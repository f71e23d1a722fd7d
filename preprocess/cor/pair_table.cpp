// SPDX-License-Identifier: Apache-2.0
#include "preprocess/cor/pair_table.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "preprocess/cor/stencil.hpp"

namespace ecorche::cor {
namespace {

/// Bins per 1/sigma, and the most that a table may have: below sigma = 0.01 the figures of centres.hpp
/// fade.
constexpr double kBinsTimesSigma = 5;
constexpr int kMostBins = 512;

/// A pair with less than this part of the body's volume moves no centre: see kNothing in centres.cpp.
constexpr double kNoMass = 1e-15;

/// {1, c} V w_j w_k of every tet of both segments, dropped on the fine grid over (w_j, w_k) in linear shares.
/// Returns the total.
Eigen::Vector4d drop_tets(int fine, const TetLists& lists, const std::vector<float>& weight_j,
                          std::span<const TetLists::Entry> list_k, std::vector<double>& histogram) {
  const auto side = static_cast<std::size_t>(fine) + 1;
  histogram.assign(side * side * 4, 0);
  const auto scale = static_cast<float>(fine);
  Eigen::Vector4d total = Eigen::Vector4d::Zero();
  for (const TetLists::Entry& e : list_k) {
    const float wj = weight_j[static_cast<std::size_t>(e.tet)];
    if (wj == 0) continue;
    const TetLists::Moment& m = lists.moments[static_cast<std::size_t>(e.tet)];
    const double mass = static_cast<double>(m.volume) * wj * e.weight;
    const Eigen::Vector4d value(mass, mass * m.centroid[0], mass * m.centroid[1], mass * m.centroid[2]);
    total += value;
    const float u = std::min(wj * scale, scale), v = std::min(e.weight * scale, scale);
    const int i = std::min(static_cast<int>(u), fine - 1), l = std::min(static_cast<int>(v), fine - 1);
    const double fu = u - static_cast<float>(i), fv = v - static_cast<float>(l);
    double* cell = histogram.data() + 4 * (static_cast<std::size_t>(i) * side + static_cast<std::size_t>(l));
    const auto add = [&](double* to, double share) { Eigen::Map<Eigen::Vector4d>{to} += share * value; };
    add(cell, (1 - fu) * (1 - fv));
    add(cell + 4, (1 - fu) * fv);
    add(cell + 4 * side, fu * (1 - fv));
    add(cell + 4 * side + 4, fu * fv);
  }
  return total;
}

/// Spreads the points of a fine grid (`from`, `fine` + 1 blocks of `width` floats) over a coarse one (`to`).
void coarsen(const float* from, int fine, float* to, int bins, std::size_t width) {
  std::fill_n(to, (static_cast<std::size_t>(bins) + 1) * width, 0.0F);
  const float step = static_cast<float>(bins) / static_cast<float>(fine);
  for (int i = 0; i <= fine; ++i) {
    const CubicStencil stencil(static_cast<float>(i) * step, bins);
    const float* source = from + static_cast<std::size_t>(i) * width;
    for (int s = 0; s < 4; ++s) {
      const float w = stencil.w[static_cast<std::size_t>(s)];
      if (w == 0) continue;
      float* target = to + static_cast<std::size_t>(stencil.first + s) * width;
      for (std::size_t c = 0; c < width; ++c) target[c] += w * source[c];
    }
  }
}

}  // namespace

KernelGrid::KernelGrid(double sigma)
    : bins_(std::clamp(static_cast<int>(std::ceil(kBinsTimesSigma / sigma)), 32, kMostBins)),
      angles_(static_cast<int>(std::ceil(bins_ * std::numbers::pi / 2))),
      kernel_(bins_ + 1, bins_ + 1) {
  for (int r = 0; r <= bins_; ++r) {
    for (int u = 0; u <= bins_; ++u) {
      const double x = static_cast<double>(r) * u / (static_cast<double>(bins_) * bins_ * sigma);
      kernel_(u, r) = static_cast<float>(std::exp(-x * x));
    }
  }
}

PairTable make_pair_table(const KernelGrid& grid, const TetLists& lists, const std::vector<float>& weight_j,
                          std::span<const TetLists::Entry> list_k, PairScratch& scratch) {
  PairTable pair;
  const Eigen::Vector4d total = drop_tets(grid.fine(), lists, weight_j, list_k, scratch.histogram);
  if (!(total[0] > kNoMass * lists.volume)) return pair;
  pair.mass = total[0];
  pair.mean = total.tail<3>() / total[0];

  // The coarse histogram: along w_k row by row, then along w_j all at once; about the mean, in shares of the
  // mass.
  const auto bins = static_cast<std::size_t>(grid.bins()), fine = static_cast<std::size_t>(grid.fine());
  const std::size_t width = (bins + 1) * 4;
  scratch.row.resize((fine + 1) * 4);
  scratch.rows.resize((fine + 1) * width);
  for (std::size_t i = 0; i <= fine; ++i) {
    const double* source = scratch.histogram.data() + i * (fine + 1) * 4;
    for (std::size_t l = 0; l <= fine; ++l) {
      const double mass = source[4 * l] / pair.mass;
      scratch.row[4 * l] = static_cast<float>(mass);
      for (std::size_t c = 0; c < 3; ++c) {
        scratch.row[4 * l + 1 + c] = static_cast<float>(source[4 * l + 1 + c] / pair.mass -
                                                        mass * pair.mean[static_cast<Eigen::Index>(c)]);
      }
    }
    coarsen(scratch.row.data(), grid.fine(), scratch.rows.data() + i * width, grid.bins(), 4);
  }
  std::vector<float>& coarse = scratch.cells;
  coarse.resize((bins + 1) * width);
  coarsen(scratch.rows.data(), grid.fine(), coarse.data(), grid.bins(), width);

  // Projected on u for each angle.
  struct Cell {
    float j, k;
    std::array<float, 4> value;
  };
  std::vector<Cell> cells;
  const auto step = 1.0F / static_cast<float>(bins);
  for (std::size_t i = 0; i <= bins; ++i) {
    for (std::size_t l = 0; l <= bins; ++l) {
      const float* v = coarse.data() + i * width + 4 * l;
      if (v[0] == 0 && v[1] == 0 && v[2] == 0 && v[3] == 0) continue;
      cells.push_back({static_cast<float>(i) * step, static_cast<float>(l) * step, {v[0], v[1], v[2], v[3]}});
    }
  }
  const int fine_u = KernelGrid::kFineBins * grid.bins();
  const auto angles = static_cast<std::size_t>(grid.angles());
  scratch.projection.resize((static_cast<std::size_t>(fine_u) + 2) * 4);
  scratch.row.resize((bins + 1) * 4);
  scratch.projected.resize(static_cast<Eigen::Index>(4 * (angles + 1)), static_cast<Eigen::Index>(bins + 1));
  for (std::size_t q = 0; q <= angles; ++q) {
    const double phi = std::numbers::pi / 2 * static_cast<double>(q) / static_cast<double>(angles);
    const auto c = static_cast<float>(std::cos(phi) * fine_u), s = static_cast<float>(std::sin(phi) * fine_u);
    std::fill(scratch.projection.begin(), scratch.projection.end(), 0.0F);
    for (const Cell& cell : cells) {
      const float u = std::min(std::abs(cell.k * c - cell.j * s), static_cast<float>(fine_u));
      const int b = static_cast<int>(u);
      const float f = u - static_cast<float>(b);
      float* bin = scratch.projection.data() + 4 * static_cast<std::size_t>(b);
      for (std::size_t x = 0; x < 4; ++x) {
        bin[x] += (1 - f) * cell.value[x];
        bin[4 + x] += f * cell.value[x];
      }
    }
    coarsen(scratch.projection.data(), fine_u, scratch.row.data(), grid.bins(), 4);
    for (std::size_t b = 0; b <= bins; ++b) {
      for (std::size_t x = 0; x < 4; ++x) {
        scratch.projected(static_cast<Eigen::Index>(4 * q + x), static_cast<Eigen::Index>(b)) =
            scratch.row[4 * b + x];
      }
    }
  }
  pair.table.noalias() = scratch.projected * grid.kernel();
  return pair;
}

Eigen::Vector4f PairTable::at(const KernelGrid& grid, float x, float y) const {
  const float r = std::min(std::sqrt(x * x + y * y), 1.0F) * static_cast<float>(grid.bins());
  const float phi =
      std::atan2(y, x) * static_cast<float>(2 / std::numbers::pi) * static_cast<float>(grid.angles());
  const CubicStencil along_r(r, grid.bins()), along_phi(phi, grid.angles());
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  for (int i = 0; i < 4; ++i) {
    const float* column =
        table.data() + static_cast<Eigen::Index>(along_r.first + i) * table.rows() + 4 * along_phi.first;
    Eigen::Vector4f part = Eigen::Vector4f::Zero();
    for (int q = 0; q < 4; ++q) {
      part += along_phi.w[static_cast<std::size_t>(q)] * Eigen::Map<const Eigen::Vector4f>(column + 4 * q);
    }
    sum += along_r.w[static_cast<std::size_t>(i)] * part;
  }
  return sum;
}

}  // namespace ecorche::cor
