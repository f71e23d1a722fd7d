// SPDX-License-Identifier: Apache-2.0
#include "preprocess/mapping/boundary.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace ecorche::mapping {
namespace {

// Every tet, listed at each of its four nodes.
struct TetsOfNodes {
  std::vector<std::int32_t> begin, tet;

  TetsOfNodes(std::int64_t nodes, const Tets& tets)
      : begin(static_cast<std::size_t>(nodes) + 1), tet(static_cast<std::size_t>(tets.size())) {
    const std::int32_t* corner = tets.data();
    for (std::int64_t i = 0; i < tets.size(); ++i) ++begin[static_cast<std::size_t>(corner[i]) + 1];
    for (std::size_t n = 1; n < begin.size(); ++n) begin[n] += begin[n - 1];
    std::vector<std::int32_t> next(begin.begin(), begin.end() - 1);
    for (std::int64_t i = 0; i < tets.size(); ++i) {
      tet[static_cast<std::size_t>(next[static_cast<std::size_t>(corner[i])]++)] =
          static_cast<std::int32_t>(i / 4);
    }
  }
};

// Faces whose smallest node is `node` and that occur once among the tets around it.
void faces_from(std::int32_t node, const TetsOfNodes& around, const Tets& tets,
                std::vector<BoundaryFace>& scratch, std::vector<BoundaryFace>& out) {
  scratch.clear();
  for (auto i = around.begin[static_cast<std::size_t>(node)];
       i < around.begin[static_cast<std::size_t>(node) + 1]; ++i) {
    const std::int32_t tet = around.tet[static_cast<std::size_t>(i)];
    std::array<std::int32_t, 3> others;
    std::size_t count = 0;
    for (int c = 0; c < 4; ++c) {
      if (tets(tet, c) > node) {
        for (std::size_t at = count++;; --at) {  // insertion: at most three
          if (at == 0 || others[at - 1] < tets(tet, c)) {
            others[at] = tets(tet, c);
            break;
          }
          others[at] = others[at - 1];
        }
      }
    }
    for (std::size_t a = 0; a + 1 < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) scratch.push_back({{node, others[a], others[b]}, tet});
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
