// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/boundary.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

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

// Every face is met at its lowest node. Of a tet's four faces three have its lowest node and one its second
// lowest: each tet is listed at those two.
struct TetsOfNodes {
  std::vector<std::int32_t> begin, tet;

  TetsOfNodes(std::int64_t nodes, const Tets& tets)
      : begin(static_cast<std::size_t>(nodes) + 1), tet(static_cast<std::size_t>(2 * tets.rows())) {
    // Every part of the tets counts for itself, so that it knows where its own begin.
    constexpr std::int64_t kParts = 4;
    std::array<std::vector<std::int32_t>, kParts> next;
    const auto for_tets = [&](std::int64_t part, auto&& f) {
      std::vector<std::int32_t>& own = next[static_cast<std::size_t>(part)];
      for (std::int64_t t = tets.rows() * part / kParts; t < tets.rows() * (part + 1) / kParts; ++t) {
        const auto n = sorted(tets, t);
        f(t, own[static_cast<std::size_t>(n[0])]);
        f(t, own[static_cast<std::size_t>(n[1])]);
      }
    };
    tbb::parallel_for(std::int64_t{0}, kParts, [&](std::int64_t part) {
      next[static_cast<std::size_t>(part)].assign(static_cast<std::size_t>(nodes), 0);
      for_tets(part, [](std::int64_t, std::int32_t& count) { ++count; });
    });
    std::int32_t at = 0;
    for (std::size_t n = 0; n + 1 < begin.size(); ++n) {
      for (auto& counts : next) {
        const std::int32_t count = counts[n];
        counts[n] = at;
        at += count;
      }
      begin[n + 1] = at;
    }
    tbb::parallel_for(std::int64_t{0}, kParts, [&](std::int64_t part) {
      for_tets(part, [&](std::int64_t t, std::int32_t& place) {
        tet[static_cast<std::size_t>(place++)] = static_cast<std::int32_t>(t);
      });
    });
  }
};

// Faces whose lowest node is `node` and that occur once among the tets around it.
void faces_from(std::int32_t node, const TetsOfNodes& around, const Tets& tets,
                std::vector<BoundaryFace>& scratch, std::vector<BoundaryFace>& out) {
  scratch.clear();
  const auto at = static_cast<std::size_t>(node);
  for (std::int32_t i = around.begin[at]; i < around.begin[at + 1]; ++i) {
    const std::int32_t tet = around.tet[static_cast<std::size_t>(i)];
    const auto n = sorted(tets, tet);
    if (n[0] == node) {
      scratch.push_back({{n[0], n[1], n[2]}, tet});
      scratch.push_back({{n[0], n[1], n[3]}, tet});
      scratch.push_back({{n[0], n[2], n[3]}, tet});
    } else {
      scratch.push_back({{n[1], n[2], n[3]}, tet});
    }
  }
  std::sort(scratch.begin(), scratch.end(), [](const auto& x, const auto& y) { return x.node < y.node; });
  for (std::size_t i = 0; i < scratch.size();) {
    std::size_t j = i + 1;
    while (j < scratch.size() && scratch[j].node == scratch[i].node) ++j;
    if (j == i + 1) out.push_back(scratch[i]);
    i = j;
  }
}

}  // namespace

std::vector<BoundaryFace> boundary_faces(std::int64_t nodes, const Tets& tets) {
  const TetsOfNodes around(nodes, tets);
  constexpr std::int64_t kChunk = 4096;  // fixed, so that the order does not depend on the threads
  std::vector<std::vector<BoundaryFace>> found(static_cast<std::size_t>((nodes + kChunk - 1) / kChunk));
  tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t chunk) {
    std::vector<BoundaryFace> scratch;
    const std::int64_t first = static_cast<std::int64_t>(chunk) * kChunk;
    for (std::int64_t n = first; n < std::min(first + kChunk, nodes); ++n) {
      faces_from(static_cast<std::int32_t>(n), around, tets, scratch, found[chunk]);
    }
  });
  std::vector<BoundaryFace> all;
  for (const auto& part : found) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace ecorche::mapping
