// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/boundary.hpp"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>

#include "core/solve/mix.hpp"

namespace ecorche::mapping {
namespace {

// Nodes of a tet, ascending.
std::array<std::int32_t, 4> sorted(const Tets& tets, std::int64_t tet) {
  std::array<std::int32_t, 4> n{tets(tet, 0), tets(tet, 1), tets(tet, 2), tets(tet, 3)};
  const auto order = [&](std::size_t a, std::size_t b) {
    if (n[a] > n[b]) std::swap(n[a], n[b]);
  };
  order(0, 1), order(2, 3), order(0, 2), order(1, 3), order(1, 2);
  return n;
}

std::uint64_t edge(std::int32_t a, std::int32_t b) {
  return solve::mix(static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b));
}

// Nodes that are the lowest of a face which an odd number of tets have: at its lowest node a face adds the
// hash of its other two, modulo 2, so that those within the body, met twice, leave nothing.
std::vector<std::uint8_t> odd_nodes(std::int64_t nodes, const Tets& tets) {
  const auto count = static_cast<std::size_t>(nodes);
  tbb::enumerable_thread_specific<std::vector<std::uint64_t>> sums(
      [&] { return std::vector<std::uint64_t>(count, 0); });
  tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, tets.rows(), 4096), [&](const auto& range) {
    std::vector<std::uint64_t>& sum = sums.local();
    for (std::int64_t t = range.begin(); t < range.end(); ++t) {
      const auto n = sorted(tets, t);
      const std::uint64_t last = edge(n[2], n[3]);
      sum[static_cast<std::size_t>(n[0])] ^= edge(n[1], n[2]) ^ edge(n[1], n[3]) ^ last;
      sum[static_cast<std::size_t>(n[1])] ^= last;
    }
  });
  std::vector<std::uint8_t> odd(count);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 1 << 14), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      std::uint64_t all = 0;
      for (const std::vector<std::uint64_t>& sum : sums) all ^= sum[n];
      odd[n] = all != 0;
    }
  });
  return odd;
}

}  // namespace

std::vector<BoundaryFace> boundary_faces(std::int64_t nodes, const Tets& tets) {
  const std::vector<std::uint8_t> odd = odd_nodes(nodes, tets);
  constexpr std::int64_t kTets = 1 << 15;
  std::vector<std::vector<BoundaryFace>> found(static_cast<std::size_t>((tets.rows() + kTets - 1) / kTets));
  tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t part) {
    const std::int64_t first = static_cast<std::int64_t>(part) * kTets;
    for (std::int64_t t = first; t < std::min(first + kTets, std::int64_t{tets.rows()}); ++t) {
      const auto n = sorted(tets, t);
      const auto tet = static_cast<std::int32_t>(t);
      if (odd[static_cast<std::size_t>(n[0])] != 0) {
        found[part].push_back({{n[0], n[1], n[2]}, tet});
        found[part].push_back({{n[0], n[1], n[3]}, tet});
        found[part].push_back({{n[0], n[2], n[3]}, tet});
      }
      if (odd[static_cast<std::size_t>(n[1])] != 0) found[part].push_back({{n[1], n[2], n[3]}, tet});
    }
  });
  std::vector<BoundaryFace> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  tbb::parallel_sort(all.begin(), all.end(), [](const BoundaryFace& a, const BoundaryFace& b) {
    return a.node != b.node ? a.node < b.node : a.tet < b.tet;
  });
  std::size_t kept = 0;
  for (std::size_t i = 0, end = 0; i < all.size(); i = end) {
    end = i + 1;
    while (end < all.size() && all[end].node == all[i].node) ++end;
    if (end == i + 1) all[kept++] = all[i];
  }
  all.resize(kept);
  return all;
}

}  // namespace ecorche::mapping
