// SPDX-License-Identifier: Apache-2.0
// Where a mesh was cut, for surfaces that are to follow.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/model.hpp>
#include "core/geometry/face_tree.hpp"
#include "preprocess/parting/part_limbs.hpp"

namespace ecorche::parting {

/// Where cuts run, and the tets beside them, part by part.
class PartedTets {
 public:
  PartedTets(const Parting& parting, const PointsF& nodes);

  const Parting& parting() const { return parting_; }
  const PointsF& nodes() const { return nodes_; }
  /// The side of cubes of twelve tets, mm.
  double cube_mm() const { return cube_; }
  int part_of(std::int32_t tet) const { return parting_.part[static_cast<std::size_t>(tet)]; }

  /// The nearest opened face, and how far it is, mm.
  std::pair<const OpenFace*, double> nearest_cut(const Eigen::Vector3d& point) const;
  /// Whether between two parts no face stayed closed, or a cut is nearer than those.
  bool are_cut(int part, int other, const Eigen::Vector3d& point) const;
  /// Whether two parts hang together within 2 cubes, directly or both on the rest of the body.
  bool near_joined(int part, int other, const Eigen::Vector3d& point) const;
  /// True of all points within kReach cubes of a cut, and of some beyond.
  bool may_reach(const Eigen::Vector3d& point) const;
  static constexpr double kReach = 2.5;

  /// Where points of one part are bound, among its tets that touch a cut: the tet, and the shares of its
  /// corners (mapping::Binding). Among all such tets for a part that has none.
  struct Bound {
    std::vector<std::int32_t> tet;
    Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor> barycentric;
  };
  Bound bind(int part, const Points& points, const Context& context) const;

 private:
  struct Border {
    std::optional<geometry::FaceTree> open, closed;
  };

  const Parting& parting_;
  const PointsF& nodes_;
  double cube_ = 0;
  std::set<std::array<int, 3>> cells_;             // cubes with a side of kReach that may be reached
  std::optional<geometry::FaceTree> cuts_;         // of all opened faces
  std::map<std::pair<int, int>, Border> borders_;  // of two parts, the lower first
  std::vector<std::int32_t> touching_;             // tets with a corner on a cut
};

/// A vertex to be bound on one side of the cuts.
struct NewVertex {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  int part = -1;
};

/// Binds vertices of a tissue to one part's tets.
void bind_rows(Tissue& tissue, const std::vector<std::int32_t>& rows, int part, const PartedTets& tets,
               const Context& context);

/// Puts them behind the tissue's own, each bound on its side.
void append_vertices(Tissue& tissue, const std::vector<NewVertex>& added, const PartedTets& tets,
                     const Context& context);

}  // namespace ecorche::parting
