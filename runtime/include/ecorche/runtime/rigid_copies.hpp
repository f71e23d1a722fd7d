// SPDX-License-Identifier: Apache-2.0
// Contested tets (Model::contested) once more, at the rigid places of their bones: what is drawn over the
// soft tets there, so that a posed volume's bone is whole.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/runtime/held_arrays.hpp>
#include <ecorche/values/mesh.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// Made once per mesh; immutable. The motion of a segment is read off the posed nodes of its bones' own tets,
/// which move rigidly by construction: nothing but posed nodes is asked for. Contested tets of a segment
/// whose bones have no tets of their own are not copied.
///
/// Tets are *drawn* in this order: those of bones, the copies, then all others, contested ones among them as
/// they bend with the soft tissue. Where posed tets overlap the lowest drawn index wins: a bone's own tets
/// before any copy, a copy before what is soft.
class RigidCopies {
 public:
  RigidCopies() = default;  ///< no copies
  /// `given`: #nodes, the row at which place() is given a node; empty: its own.
  explicit RigidCopies(const Model& model, std::span<const std::uint32_t> given = {});
  /// The same of a mesh and its bones: `label` and `contested` as of Model, `segment` one of each bone.
  RigidCopies(const Tets& tets, const PointsF& rest, std::span<const std::uint16_t> label,
              std::span<const std::uint16_t> contested, std::span<const std::int32_t> segment,
              std::span<const std::uint32_t> given = {});

  /// How many are copied.
  std::size_t tets() const { return static_cast<std::size_t>(corners_.rows()); }
  /// Nodes of the copies.
  std::size_t nodes() const { return rest_.size() / 3; }
  /// tets() by 4, rows of the copied nodes.
  const Tets& corners() const { return corners_; }
  /// 3 * nodes(), LPS mm.
  std::span<const float> rest() const { return rest_; }

  /// Where the copied nodes go: 3 * nodes() of `out`, LPS mm. `nodes`: the posed ones, 3 each. At rest they
  /// are rest() exactly. Allocates nothing; O(nodes()) and a small fit a segment.
  void place(std::span<const float> nodes, std::span<float> out) const;

  /// Of a drawn tet: whether it is a copy, the mesh's own index, and what it is labelled.
  bool is_copy(std::size_t drawn) const { return drawn >= first_ && drawn < first_ + tets(); }
  /// Index in the mesh.
  std::size_t own(std::size_t drawn) const {
    return is_copy(drawn) ? copied_[drawn - first_] : drawn < first_ ? drawn : drawn - tets();
  }
  /// Of a copy its bone's, else the mesh's own.
  std::uint16_t label(std::size_t drawn, std::span<const std::uint16_t> of_tets) const {
    return is_copy(drawn) ? label_[drawn - first_] : of_tets[own(drawn)];
  }
  /// The first copy's drawn index.
  std::size_t first() const { return first_; }

  /// Of all copies.
  void add_arrays(HeldArrays& out) const {
    add_array(corners_, out);
    add_array(rest_, out);
  }

 private:
  // Nodes of one segment's bones that tell its motion, and the copies that follow it.
  struct Follower {
    std::vector<std::uint32_t> row;  // at which place() is given them
    Eigen::Matrix3Xd told;           // at rest
    Eigen::Vector3d middle;          // of these
    std::size_t begin = 0, end = 0;  // of the copied nodes
  };
  void place(const Follower& follower, std::span<const float> nodes, std::span<float> out) const;

  std::size_t first_ = 0;
  Tets corners_;                       // #copies by 4
  std::vector<std::uint32_t> copied_;  // #copies, the mesh's tet
  std::vector<std::uint16_t> label_;   // #copies
  std::vector<float> rest_;
  std::vector<Follower> followers_;
};

/// Corners of drawn tets without a copy of the mesh: a node of it by its own row, a copied one from `base`
/// on. Refers to both.
class DrawnTets {
 public:
  /// The mesh alone.
  DrawnTets(const Tets& tets) : tets_(tets) {}  // NOLINT(google-explicit-constructor): a mesh without copies
  /// With copies, whose nodes begin at `base`.
  DrawnTets(const Tets& tets, const RigidCopies& copies, std::int32_t base)
      : tets_(tets),
        copies_(&copies),
        first_(static_cast<Eigen::Index>(copies.first())),
        end_(first_ + copies.corners().rows()),
        base_(base) {}

  /// Drawn tets.
  Eigen::Index rows() const { return tets_.rows() + end_ - first_; }
  /// The node at a corner of a drawn tet.
  std::int32_t operator()(Eigen::Index tet, Eigen::Index corner) const {
    if (tet < first_) return tets_(tet, corner);
    if (tet >= end_) return tets_(tet - (end_ - first_), corner);
    return base_ + copies_->corners()(tet - first_, corner);
  }

 private:
  const Tets& tets_;
  const RigidCopies* copies_ = nullptr;
  Eigen::Index first_ = 0, end_ = 0;
  std::int32_t base_ = 0;
};

/// All drawn tets and nodes in memory, for what is not in a hurry.
struct DrawnBody {
  Tets tets;                       ///< #drawn by 4
  std::vector<float> rest, posed;  ///< 3 a node: the mesh's, then the copied ones
};
DrawnBody drawn_body(const Tets& tets, std::span<const float> rest, std::span<const float> posed,
                     const RigidCopies& copies);

}  // namespace ecorche::runtime
