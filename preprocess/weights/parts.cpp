// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/parts.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <numeric>
#include <utility>

#include "core/geometry/nearest_point.hpp"

namespace ecorche::weights {

Parts connected_parts(Eigen::Index nodes, const Tets& T) {
  std::vector<std::int32_t> root(static_cast<std::size_t>(nodes));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](std::int32_t n) {
    while (root[static_cast<std::size_t>(n)] != n) {
      auto& up = root[static_cast<std::size_t>(n)];
      up = root[static_cast<std::size_t>(up)];
      n = up;
    }
    return n;
  };
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    for (Eigen::Index k = 1; k < 4; ++k) {
      const std::int32_t a = find(T(t, 0)), b = find(T(t, k));
      root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  Parts parts;
  parts.of_node.assign(static_cast<std::size_t>(nodes), -1);
  for (std::int32_t n = 0; n < static_cast<std::int32_t>(nodes); ++n) {
    std::int32_t& part = parts.of_node[static_cast<std::size_t>(find(n))];
    if (part < 0) part = parts.count++;  // a root is the lowest node of its part, so it comes first
    parts.of_node[static_cast<std::size_t>(n)] = part;
  }
  return parts;
}

std::vector<std::int32_t> attachments(const Points& V, const Parts& parts,
                                      const std::vector<std::uint8_t>& boned, const Context& context) {
  std::vector<std::int32_t> source(parts.of_node.size(), -1);
  if (std::find(boned.begin(), boned.end(), 0) == boned.end()) return source;

  std::vector<std::vector<std::int32_t>> nodes(static_cast<std::size_t>(parts.count));
  std::vector<std::int32_t> all_boned;
  for (std::size_t n = 0; n < source.size(); ++n) {
    const auto part = static_cast<std::size_t>(parts.of_node[n]);
    nodes[part].push_back(static_cast<std::int32_t>(n));
    if (boned[part]) all_boned.push_back(static_cast<std::int32_t>(n));
  }
  const geometry::NearestPoint anywhere(V, all_boned);
  for (std::size_t part = 0; part < nodes.size(); ++part) {
    if (boned[part]) continue;
    context.check_stop();
    std::pair<double, std::int32_t> best{std::numeric_limits<double>::infinity(), -1};
    for (const std::int32_t n : nodes[part]) {
      double d2 = 0;
      const std::int32_t near = anywhere.find(V.row(n), d2);
      best = std::min(best, {d2, near});
    }
    const geometry::NearestPoint there(
        V, nodes[static_cast<std::size_t>(parts.of_node[static_cast<std::size_t>(best.second)])]);
    tbb::parallel_for(std::size_t{0}, nodes[part].size(), [&](std::size_t i) {
      const std::int32_t n = nodes[part][i];
      double d2 = 0;
      source[static_cast<std::size_t>(n)] = there.find(V.row(n), d2);
    });
    const std::int32_t first = nodes[part].front();
    std::array<char, 280> line{};
    std::snprintf(line.data(), line.size(),
                  "a part of %zu nodes about (%.1f, %.1f, %.1f) touches no bone: it follows the part %.2f mm "
                  "from it (join "
                  "it to the body in the scan, or give it a bone, if that is not meant)",
                  nodes[part].size(), V(first, 0), V(first, 1), V(first, 2), std::sqrt(best.first));
    context.warn(line.data());
  }
  return source;
}

}  // namespace ecorche::weights
