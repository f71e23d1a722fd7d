// SPDX-License-Identifier: Apache-2.0
#include "preprocess/weights/rigid_bones.hpp"

#include <array>
#include <cstdio>
#include <span>
#include <utility>

#include "preprocess/weights/harmonic.hpp"

namespace ecorche::weights {
namespace {

/// Who owns the nodes, and what every bone keeps by it.
class Owners {
 public:
  Owners(const TetMesh& mesh, const std::vector<std::int32_t>& bone_segment, std::vector<std::int32_t> owner)
      : mesh_(mesh),
        bone_segment_(bone_segment),
        owner_(std::move(owner)),
        settled_(owner_.size(), 0),
        tets_(bone_segment.size()),
        volume_(bone_segment.size(), 0) {
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
      const std::uint16_t label = mesh.label[static_cast<std::size_t>(t)];
      if (label == TetMesh::soft) continue;
      tets_[label - 1U].push_back(static_cast<std::int32_t>(t));
      volume_[label - 1U] += volume(t);
    }
  }

  bool contested(Eigen::Index t) const {
    const std::uint16_t label = mesh_.label[static_cast<std::size_t>(t)];
    if (label == TetMesh::soft) return false;
    for (Eigen::Index c = 0; c < 4; ++c) {
      if (owner_[static_cast<std::size_t>(mesh_.T(t, c))] != bone_segment_[label - 1U]) return true;
    }
    return false;
  }

  /// Share of its volume that a bone keeps; 1 of one without tets.
  double kept(std::size_t bone) const {
    if (tets_[bone].empty()) return 1;
    double kept = 0;
    for (const std::int32_t t : tets_[bone]) kept += contested(t) ? 0 : volume(t);
    return kept / volume_[bone];
  }

  /// All corners of the bone's tets, but for those that were given to another before.
  void give(std::size_t bone) {
    for (const std::int32_t t : tets_[bone]) {
      for (Eigen::Index c = 0; c < 4; ++c) {
        const auto node = static_cast<std::size_t>(mesh_.T(t, c));
        if (settled_[node] != 0) continue;
        settled_[node] = 1;
        owner_[node] = bone_segment_[bone];
      }
    }
  }

 private:
  double volume(Eigen::Index t) const {
    const auto corner = [&](int c) { return mesh_.V.row(mesh_.T(t, c)); };
    return tet_det(corner(0), corner(1), corner(2), corner(3)) / 6;
  }

  const TetMesh& mesh_;
  const std::vector<std::int32_t>& bone_segment_;
  std::vector<std::int32_t> owner_;              // #nodes, a segment or -1
  std::vector<std::uint8_t> settled_;            // #nodes
  std::vector<std::vector<std::int32_t>> tets_;  // of each bone
  std::vector<double> volume_;                   // mm3
};

/// Each bone at most once, the one that keeps least first.
void keep_bones(Owners& owners, std::size_t bones) {
  std::vector<std::uint8_t> given(bones, 0);
  for (;;) {
    std::size_t least = bones;
    double share = kKeptBone;
    for (std::size_t b = 0; b < bones; ++b) {
      if (given[b] != 0) continue;
      const double kept = owners.kept(b);
      if (kept >= share) continue;
      share = kept;
      least = b;
    }
    if (least == bones) return;
    owners.give(least);
    given[least] = 1;
  }
}

void warn_of_lost_bones(const Owners& owners, const Case& patient, const Context& context) {
  for (std::size_t b = 0; b < patient.bones.size(); ++b) {
    const double kept = owners.kept(b);
    if (kept >= kKeptBone) continue;
    std::array<char, 240> line{};
    std::snprintf(
        line.data(), line.size(),
        "bone '%s' keeps %.0f %% of its volume in tets of its own, the rest touches other segments' "
        "bones: more tets by --max-tets part them",
        patient.bones[b].name.c_str(), 100 * kept);
    context.warn(line.data());
  }
}

/// The rows `order` of the tets.
void reorder(TetMesh& mesh, const std::vector<std::int32_t>& order) {
  Tets T(mesh.T.rows(), 4);
  std::vector<std::uint16_t> label(mesh.label.size());
  for (std::size_t t = 0; t < order.size(); ++t) {
    T.row(static_cast<Eigen::Index>(t)) = mesh.T.row(order[t]);
    label[t] = mesh.label[static_cast<std::size_t>(order[t])];
  }
  mesh.T.swap(T);
  mesh.label.swap(label);
}

}  // namespace

RigidBones rigid_bones(TetMesh mesh, const Case& patient, const std::vector<std::int32_t>& bone_segment,
                       const Context& context) {
  Owners owners(mesh, bone_segment, bone_nodes(mesh, patient, bone_segment));
  keep_bones(owners, bone_segment.size());
  warn_of_lost_bones(owners, patient, context);

  std::array<std::vector<std::int32_t>, 3> classes;  // of a bone, contested, soft
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
    const bool soft = mesh.label[static_cast<std::size_t>(t)] == TetMesh::soft;
    classes[soft ? 2 : owners.contested(t) ? 1 : 0].push_back(static_cast<std::int32_t>(t));
  }
  RigidBones out;
  for (const std::int32_t t : classes[1]) {
    out.contested.push_back(std::exchange(mesh.label[static_cast<std::size_t>(t)], TetMesh::soft));
  }
  std::vector<std::int32_t>& order = classes[0];
  for (const std::size_t rest : {1U, 2U})
    order.insert(order.end(), classes[rest].begin(), classes[rest].end());
  reorder(mesh, order);
  out.mesh = std::move(mesh);
  return out;
}

}  // namespace ecorche::weights
