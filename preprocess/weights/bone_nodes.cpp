// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "preprocess/geometry/face_tree.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::weights {
namespace {

struct Touch {
  std::int32_t node;
  std::int32_t bone;
  auto operator<=>(const Touch&) const = default;
};

/// Every pair of a node and a bone of whose tets it is a corner, by node, then bone.
std::vector<Touch> touches(const TetMesh& mesh, std::size_t bones) {
  std::vector<Touch> all;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    const std::uint16_t label = mesh.label[static_cast<std::size_t>(t)];
    if (label == TetMesh::soft) continue;
    if (label > bones) {
      throw Error(ErrorKind::internal, "weights",
                  "tet " + std::to_string(t) + " has the label " + std::to_string(label) + " of " +
                      std::to_string(bones) + " bones",
                  "report it");
    }
    for (Eigen::Index k = 0; k < 4; ++k) all.push_back({mesh.T(t, k), label - 1});
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

}  // namespace

std::vector<std::int32_t> bone_nodes(const TetMesh& mesh, const Case& patient,
                                     const std::vector<std::int32_t>& bone_segment) {
  const std::vector<Touch> all = touches(mesh, bone_segment.size());
  const auto segment = [&](const Touch& touch) { return bone_segment[static_cast<std::size_t>(touch.bone)]; };

  std::vector<std::int32_t> owner(static_cast<std::size_t>(mesh.V.rows()), -1);
  std::vector<std::pair<std::size_t, std::size_t>> contested;  // ranges of `all`
  std::map<std::int32_t, geometry::FaceTree> surfaces;
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    bool several = false;
    for (end = begin; end < all.size() && all[end].node == all[begin].node; ++end) {
      several = several || segment(all[end]) != segment(all[begin]);
    }
    owner[static_cast<std::size_t>(all[begin].node)] = segment(all[begin]);
    if (!several) continue;
    contested.emplace_back(begin, end);
    for (std::size_t i = begin; i < end; ++i) {
      surfaces.try_emplace(all[i].bone, patient.bones[static_cast<std::size_t>(all[i].bone)].surface);
    }
  }
  tbb::parallel_for(std::size_t{0}, contested.size(), [&](std::size_t c) {
    const auto [begin, end] = contested[c];
    const std::int32_t node = all[begin].node;
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t i = begin; i < end; ++i) {
      const double d = surfaces.at(all[i].bone).nearest(mesh.V.row(node)).squared;
      if (d >= best) continue;  // ties to the lower bone, which comes first
      best = d;
      owner[static_cast<std::size_t>(node)] = segment(all[i]);
    }
  });
  return owner;
}

}  // namespace ecorche::weights
