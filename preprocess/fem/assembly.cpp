// SPDX-License-Identifier: Apache-2.0
#include "preprocess/fem/assembly.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bitset>
#include <numeric>

#include "preprocess/fem/tet_energy.hpp"

namespace ecorche::fem {
namespace {

constexpr std::size_t kColours = 256;  // what is left over goes one by one
constexpr std::size_t kAtOnce = 256;   // tets of one sum
constexpr std::size_t kGrain = 16;     // tets that a thread takes

/// The lowest colour that no tet of the same nodes has, tet by tet.
std::vector<std::uint16_t> colours(const Mesh& mesh) {
  const auto nodes = static_cast<std::size_t>(mesh.rule().nodes);
  std::vector<std::bitset<kColours>> taken(static_cast<std::size_t>(mesh.X.rows()));
  std::vector<std::uint16_t> out(mesh.tets());
  for (std::size_t t = 0; t < mesh.tets(); ++t) {
    std::bitset<kColours> any;
    const std::int32_t* corner = &mesh.corner[t * nodes];
    for (std::size_t a = 0; a < nodes; ++a) any |= taken[static_cast<std::size_t>(corner[a])];
    std::size_t c = 0;
    while (c < kColours - 1 && any[c]) ++c;
    out[t] = static_cast<std::uint16_t>(c);
    for (std::size_t a = 0; a < nodes; ++a) taken[static_cast<std::size_t>(corner[a])].set(c);
  }
  return out;
}

}  // namespace

Assembly::Assembly(const Mesh& mesh) : mesh_(mesh) {
  const auto nodes = static_cast<std::size_t>(mesh.rule().nodes);
  // Pairs of free nodes that share a tet, the lower one first.
  std::vector<std::uint64_t> pairs;
  pairs.reserve(mesh.tets() * nodes * (nodes + 1) / 2);
  for (std::size_t t = 0; t < mesh.tets(); ++t) {
    for (std::size_t a = 0; a < nodes; ++a) {
      for (std::size_t b = 0; b <= a; ++b) {
        const std::int32_t i = mesh.free[static_cast<std::size_t>(mesh.corner[t * nodes + a])];
        const std::int32_t j = mesh.free[static_cast<std::size_t>(mesh.corner[t * nodes + b])];
        if (i < 0 || j < 0) continue;
        pairs.push_back(static_cast<std::uint64_t>(std::min(i, j)) << 32U |
                        static_cast<std::uint64_t>(std::max(i, j)));
      }
    }
  }
  tbb::parallel_sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  first_.assign(mesh.free_nodes + 1, 0);
  neighbour_.reserve(pairs.size());
  for (const std::uint64_t pair : pairs) {
    ++first_[(pair >> 32U) + 1];
    neighbour_.push_back(static_cast<std::int32_t>(pair & 0xffffffffU));
  }
  std::partial_sum(first_.begin(), first_.end(), first_.begin());

  const auto unknowns = static_cast<Eigen::Index>(3 * mesh.free_nodes);
  pattern_.resize(unknowns, unknowns);
  // A node's own block holds its lower triangle alone: columns of 3, 2 and 1 entries.
  pattern_.resizeNonZeros(static_cast<Eigen::Index>(9 * neighbour_.size() - 3 * mesh.free_nodes));
  std::int32_t at = 0;
  for (std::size_t n = 0; n < mesh.free_nodes; ++n) {
    for (int c = 0; c < 3; ++c) {
      pattern_.outerIndexPtr()[3 * n + static_cast<std::size_t>(c)] = at;
      for (std::int32_t k = first_[n]; k < first_[n + 1]; ++k)
        for (int r = k == first_[n] ? c : 0; r < 3; ++r)
          pattern_.innerIndexPtr()[at++] = 3 * neighbour_[static_cast<std::size_t>(k)] + r;
    }
  }
  pattern_.outerIndexPtr()[unknowns] = at;
  std::fill_n(pattern_.valuePtr(), at, 0.0);

  const std::vector<std::uint16_t> colour = colours(mesh);
  order_.resize(mesh.tets());
  std::iota(order_.begin(), order_.end(), 0U);
  std::stable_sort(order_.begin(), order_.end(), [&](auto a, auto b) { return colour[a] < colour[b]; });
  for (std::size_t i = 0; i < order_.size(); ++i)
    if (i == 0 || colour[order_[i]] != colour[order_[i - 1]]) colour_.push_back(i);
  colour_.push_back(order_.size());
  overflow_ = !order_.empty() && colour[order_.back()] == kColours - 1;
}

Total Assembly::total(const Material& material, const Points& x) const {
  Total out;
  out.inverted.resize(mesh_.tets());
  const std::size_t parts = (mesh_.tets() + kAtOnce - 1) / kAtOnce;
  std::vector<double> energy(parts, 0), volume(parts, 0);
  std::vector<std::size_t> crushed(parts, 0);
  tbb::parallel_for(std::size_t{0}, parts, [&](std::size_t part) {
    for (std::size_t t = part * kAtOnce; t < std::min((part + 1) * kAtOnce, mesh_.tets()); ++t) {
      const TetEnergy of = tet_energy(mesh_, material, t, x);
      energy[part] += of.energy;
      volume[part] += of.mean_j * mesh_.rest[t].volume;
      out.inverted[t] = of.least_j > 0 ? 0 : 1;
      crushed[part] += of.least_j < elastic::StableNeoHookean::kCrushed ? 1 : 0;
    }
  });
  out.energy = std::accumulate(energy.begin(), energy.end(), 0.0);
  out.volume = std::accumulate(volume.begin(), volume.end(), 0.0);
  out.crushed_tets = std::accumulate(crushed.begin(), crushed.end(), std::size_t{0});
  out.inverted_tets = static_cast<std::size_t>(std::count(out.inverted.begin(), out.inverted.end(), 1));
  return out;
}

template <class F>
void Assembly::for_colours(F&& of_tet) const {
  for (std::size_t c = 0; c + 1 < colour_.size(); ++c) {
    const bool one_by_one = overflow_ && c + 2 == colour_.size();
    const std::size_t begin = colour_[c], end = colour_[c + 1];
    if (one_by_one) {
      for (std::size_t i = begin; i < end; ++i) of_tet(order_[i]);
      continue;
    }
    tbb::parallel_for(tbb::blocked_range<std::size_t>(begin, end, kGrain), [&](const auto& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i) of_tet(order_[i]);
    });
  }
}

void Assembly::add_hessian(const std::int32_t* corner, const double* of_tet, double* value) const {
  const int nodes = mesh_.rule().nodes, size = 3 * nodes;
  const std::int32_t* column = pattern_.outerIndexPtr();
  for (int b = 0; b < nodes; ++b) {
    const std::int32_t j = mesh_.free[static_cast<std::size_t>(corner[b])];
    if (j < 0) continue;
    const auto begin = neighbour_.begin() + first_[static_cast<std::size_t>(j)];
    const auto end = neighbour_.begin() + first_[static_cast<std::size_t>(j) + 1];
    for (int a = 0; a < nodes; ++a) {
      const std::int32_t i = mesh_.free[static_cast<std::size_t>(corner[a])];
      if (i < j) continue;
      const auto k = static_cast<std::int32_t>(std::lower_bound(begin, end, i) - begin);
      for (int c = 0; c < 3; ++c) {
        // The own block's column c begins at its row c.
        double* to = value + column[3 * j + c] + (k == 0 ? 0 : 3 * k - c);
        for (int r = k == 0 ? c : 0; r < 3; ++r) *to++ += of_tet[(3 * b + c) * size + 3 * a + r];
      }
    }
  }
}

void Assembly::derivatives(const Material& material, const Points& x, bool filtered, const Points* increment,
                           Points& gradient, solve::SparseMatrix& hessian) const {
  const int nodes = mesh_.rule().nodes;
  gradient.setZero(x.rows(), 3);
  hessian = pattern_;
  double* value = hessian.valuePtr();
  for_colours([&](std::size_t t) {
    const std::int32_t* corner = &mesh_.corner[t * static_cast<std::size_t>(nodes)];
    TetDerivatives of = tet_derivatives(mesh_, material, t, x, filtered);
    if (increment != nullptr) {
      Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 30, 1> move(3 * nodes);
      for (int a = 0; a < nodes; ++a) move.segment<3>(3 * a) = increment->row(corner[a]).transpose();
      of.gradient += of.hessian * move;
    }
    for (int a = 0; a < nodes; ++a) gradient.row(corner[a]) += of.gradient.segment<3>(3 * a).transpose();
    add_hessian(corner, of.hessian.data(), value);
  });
}

}  // namespace ecorche::fem
