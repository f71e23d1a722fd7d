// SPDX-License-Identifier: Apache-2.0
#include <tbb/parallel_for.h>
#include <tbb/parallel_for_each.h>

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "core/geometry/face_tree.hpp"
#include "preprocess/weights/harmonic.hpp"

namespace ecorche::weights {
namespace {

struct Touch {
  std::int32_t node;
  std::int32_t bone;
  auto operator<=>(const Touch&) const = default;
};

/// The bone whose tets alone have each node for a corner; kNone and kSeveral.
constexpr std::int32_t kNone = -1, kSeveral = -2;
std::vector<std::int32_t> only_bones(const TetMesh& mesh, std::size_t bones) {
  std::vector<std::int32_t> only(static_cast<std::size_t>(mesh.V.rows()), kNone);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    const std::uint16_t label = mesh.label[static_cast<std::size_t>(t)];
    if (label == TetMesh::soft) continue;
    if (label > bones) {
      throw Error(ErrorKind::internal, "weights",
                  "tet " + std::to_string(t) + " has the label " + std::to_string(label) + " of " +
                      std::to_string(bones) + " bones",
                  "report it");
    }
    for (Eigen::Index k = 0; k < 4; ++k) {
      std::int32_t& bone = only[static_cast<std::size_t>(mesh.T(t, k))];
      bone = bone == kNone || bone == label - 1 ? label - 1 : kSeveral;
    }
  }
  return only;
}

/// Every pair of a node of several bones and one of them, by node, then bone.
std::vector<Touch> touches(const TetMesh& mesh, const std::vector<std::int32_t>& only) {
  std::vector<Touch> all;
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    const std::uint16_t label = mesh.label[static_cast<std::size_t>(t)];
    if (label == TetMesh::soft) continue;
    for (Eigen::Index k = 0; k < 4; ++k) {
      if (only[static_cast<std::size_t>(mesh.T(t, k))] == kSeveral) all.push_back({mesh.T(t, k), label - 1});
    }
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

}  // namespace

std::vector<std::int32_t> bone_nodes(const TetMesh& mesh, const Case& patient,
                                     const std::vector<std::int32_t>& bone_segment) {
  const std::vector<std::int32_t> only = only_bones(mesh, bone_segment.size());
  const std::vector<Touch> all = touches(mesh, only);
  const auto segment = [&](const Touch& touch) { return bone_segment[static_cast<std::size_t>(touch.bone)]; };

  std::vector<std::int32_t> owner(static_cast<std::size_t>(mesh.V.rows()), -1);
  for (std::size_t n = 0; n < owner.size(); ++n) {
    if (only[n] >= 0) owner[n] = bone_segment[static_cast<std::size_t>(only[n])];
  }
  std::vector<std::pair<std::size_t, std::size_t>> contested;  // ranges of `all`
  std::map<std::int32_t, std::optional<geometry::FaceTree>> surfaces;
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    bool several = false;
    for (end = begin; end < all.size() && all[end].node == all[begin].node; ++end) {
      several = several || segment(all[end]) != segment(all[begin]);
    }
    owner[static_cast<std::size_t>(all[begin].node)] = segment(all[begin]);
    if (!several) continue;
    contested.emplace_back(begin, end);
    for (std::size_t i = begin; i < end; ++i) {
      surfaces.try_emplace(all[i].bone);
    }
  }
  tbb::parallel_for_each(surfaces, [&](auto& surface) {
    surface.second.emplace(patient.bones[static_cast<std::size_t>(surface.first)].surface);
  });
  tbb::parallel_for(std::size_t{0}, contested.size(), [&](std::size_t c) {
    const auto [begin, end] = contested[c];
    const std::int32_t node = all[begin].node;
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t i = begin; i < end; ++i) {
      const double d = surfaces.at(all[i].bone)->nearest(mesh.V.row(node)).squared;
      if (d >= best) continue;  // ties to the lower bone, which comes first
      best = d;
      owner[static_cast<std::size_t>(node)] = segment(all[i]);
    }
  });
  return owner;
}

}  // namespace ecorche::weights
