// SPDX-License-Identifier: Apache-2.0
// The toy beam with a bone in each segment that fills its core up to the joints, where they meet.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/support/toy_model.hpp"

namespace ecorche::test {

/// Tets whose corners all go with one segment are its bone's; those of the core that reach into a blend are
/// contested, and belong to the nearer bone.
inline Model contested_toy() {
  Model model = toy_model();
  const auto count = static_cast<std::size_t>(model.tets.rows());
  std::array<std::vector<std::size_t>, 3> classes;
  std::vector<std::uint16_t> label(count, TetMesh::soft);
  for (std::size_t t = 0; t < count; ++t) {
    const auto row = static_cast<Eigen::Index>(t);
    float low = 1e9F, high = -1e9F;
    for (int c = 0; c < 4; ++c) {
      low = std::min(low, model.nodes(model.tets(row, c), 2));
      high = std::max(high, model.nodes(model.tets(row, c), 2));
    }
    const int bone = std::min(2, static_cast<int>((low + high) / 200));
    const bool pure = (bone == 0 || low >= static_cast<float>(100 * bone + 20)) &&
                      (bone == 2 || high <= static_cast<float>(100 * bone + 80));
    label[t] = static_cast<std::uint16_t>(bone + 1);
    classes[pure ? 0 : 1].push_back(t);
  }
  // Some soft tets behind them: the outermost of the last bone.
  std::vector<std::size_t>& pure = classes[0];
  while (classes[2].size() < 20) {
    classes[2].push_back(pure.back());
    pure.pop_back();
  }
  Model out = model;
  std::vector<std::int32_t> place(count);
  std::size_t at = 0;
  out.contested.clear();
  for (std::size_t c = 0; c < classes.size(); ++c) {
    for (const std::size_t t : classes[c]) {
      out.tets.row(static_cast<Eigen::Index>(at)) = model.tets.row(static_cast<Eigen::Index>(t));
      out.tet_label[at] = c == 0 ? label[t] : TetMesh::soft;
      if (c == 1) out.contested.push_back(label[t]);
      place[t] = static_cast<std::int32_t>(at++);
    }
  }
  for (Tissue& tissue : out.tissues)
    for (std::int32_t& t : tissue.tet) t = place[static_cast<std::size_t>(t)];
  return out;
}

}  // namespace ecorche::test
