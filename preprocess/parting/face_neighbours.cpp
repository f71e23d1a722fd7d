// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/face_neighbours.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/solve/counting_sort.hpp"

namespace ecorche::parting {
namespace {

struct Entry {
  std::int32_t middle, high;  // nodes of the face beside its lowest
  std::int32_t face;          // 4 tet + corner
};

std::array<std::int32_t, 3> sorted_nodes(const Tets& T, const Face& face) {
  std::array<std::int32_t, 3> n{node_of(T, face, 0), node_of(T, face, 1), node_of(T, face, 2)};
  std::sort(n.begin(), n.end());
  return n;
}

}  // namespace

FaceNeighbours::FaceNeighbours(const Tets& T, Eigen::Index nodes)
    : across_(4 * static_cast<std::size_t>(T.rows()), -1) {
  const auto face_at = [](std::size_t at) {
    return Face{static_cast<std::int32_t>(at / 4), static_cast<int>(at % 4)};
  };
  solve::CountingSort<std::uint32_t> sort(static_cast<std::size_t>(nodes), across_.size(),
                                          [&](std::size_t at, const auto& add) {
                                            add(static_cast<std::size_t>(sorted_nodes(T, face_at(at))[0]));
                                          });
  std::vector<Entry> entries(sort.places());
  sort.fill([&](std::size_t at, const auto& take) {
    const auto n = sorted_nodes(T, face_at(at));
    entries[take(static_cast<std::size_t>(n[0]))] = {n[1], n[2], static_cast<std::int32_t>(at)};
  });
  const auto offsets = sort.take_offsets();
  tbb::parallel_for(std::size_t{0}, static_cast<std::size_t>(nodes), [&](std::size_t node) {
    const auto begin = entries.begin() + offsets[node], end = entries.begin() + offsets[node + 1];
    std::sort(begin, end, [](const Entry& a, const Entry& b) {
      return std::array{a.middle, a.high, a.face} < std::array{b.middle, b.high, b.face};
    });
    for (auto e = begin; e != end; ++e) {
      const auto next = e + 1;
      if (next == end || next->middle != e->middle || next->high != e->high) continue;
      across_[static_cast<std::size_t>(e->face)] = next->face;
      across_[static_cast<std::size_t>(next->face)] = e->face;
    }
  });
}

}  // namespace ecorche::parting
