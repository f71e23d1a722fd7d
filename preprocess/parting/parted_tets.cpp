// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/parted_tets.hpp"

#include <algorithm>
#include <cmath>

#include "preprocess/check/touching_limbs.hpp"
#include "preprocess/mapping/bind.hpp"

namespace ecorche::parting {
namespace {

using Eigen::Vector3d;
using geometry::FaceTree;

constexpr double kNearJoined = 2;  // cubes

FaceTree::Corners corners_of(const Points& V, const std::array<std::int32_t, 3>& face) {
  FaceTree::Corners out;
  for (std::size_t c = 0; c < 3; ++c) out[c] = V.row(face[c]).transpose();
  return out;
}

using Cell = std::array<int, 3>;

Cell cell_of(const Vector3d& point, double side) {
  const auto at = [&](int axis) { return static_cast<int>(std::floor(point[axis] / side)); };
  return {at(0), at(1), at(2)};
}

template <class Visit>
void around(const Cell& cell, const Visit& visit) {
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) visit(Cell{cell[0] + x, cell[1] + y, cell[2] + z});
    }
  }
}

}  // namespace

PartedTets::PartedTets(const Parting& parting, const PointsF& nodes)
    : parting_(parting), nodes_(nodes), cube_(check::cube_mm(nodes, parting.T)) {
  std::vector<std::uint8_t> on(static_cast<std::size_t>(nodes.rows()), 0);
  std::vector<FaceTree::Corners> all;
  std::map<std::pair<int, int>, std::array<std::vector<FaceTree::Corners>, 2>> faces;
  for (const OpenFace& face : parting.faces) {
    for (const std::int32_t n : face.inner) on[static_cast<std::size_t>(n)] = 1;
    for (const std::int32_t n : face.outer) on[static_cast<std::size_t>(n)] = 1;
    all.push_back(corners_of(parting.V, face.inner));
    for (const Vector3d& p : all.back())
      around(cell_of(p, kReach * cube_), [&](const Cell& cell) { cells_.insert(cell); });
    const Contact& contact = parting.contacts[static_cast<std::size_t>(face.contact)];
    faces[std::minmax(contact.limb, contact.other_limb)][0].push_back(all.back());
  }
  for (const JoinedFace& face : parting.joined)
    faces[std::minmax<int>(face.part, face.other)][1].push_back(corners_of(parting.V, face.nodes));
  cuts_.emplace(all);
  for (const auto& [pair, both] : faces) {
    Border& border = borders_[pair];
    if (!both[0].empty()) border.open.emplace(both[0]);
    if (!both[1].empty()) border.closed.emplace(both[1]);
  }
  for (std::int32_t t = 0; t < static_cast<std::int32_t>(parting.T.rows()); ++t) {
    for (int c = 0; c < 4; ++c) {
      if (on[static_cast<std::size_t>(parting.T(t, c))] == 0) continue;
      touching_.push_back(t);
      break;
    }
  }
}

std::pair<const OpenFace*, double> PartedTets::nearest_cut(const Vector3d& point) const {
  const FaceTree::Hit hit = cuts_->nearest(point);
  return {&parting_.faces[static_cast<std::size_t>(hit.face)], std::sqrt(hit.squared)};
}

bool PartedTets::are_cut(int part, int other, const Vector3d& point) const {
  const auto border = borders_.find(std::minmax(part, other));
  if (border == borders_.end() || !border->second.closed) return true;
  return border->second.open &&
         border->second.open->nearest(point).squared <= border->second.closed->nearest(point).squared;
}

bool PartedTets::near_joined(int part, int other, const Vector3d& point) const {
  const double most = kNearJoined * cube_;
  const auto near = [&](int a, int b) {
    const auto border = borders_.find(std::minmax(a, b));
    return border != borders_.end() && border->second.closed &&
           border->second.closed->nearest(point).squared <= most * most;
  };
  // Two thighs hang together by the trunk alone.
  return near(part, other) || (near(part, -1) && near(other, -1));
}

bool PartedTets::may_reach(const Vector3d& point) const {
  return cells_.count(cell_of(point, kReach * cube_)) != 0;
}

PartedTets::Bound PartedTets::bind(int part, const Points& points, const Context& context) const {
  Bound out;
  std::vector<std::int32_t> own;
  for (const std::int32_t t : touching_) {
    if (part_of(t) == part) own.push_back(t);
  }
  if (own.empty()) own = touching_;
  Tets T(static_cast<Eigen::Index>(own.size()), 4);
  for (std::size_t t = 0; t < own.size(); ++t) T.row(static_cast<Eigen::Index>(t)) = parting_.T.row(own[t]);
  const mapping::Binding binding = mapping::Locator(nodes_, T).bind(points, context.quiet());
  for (const std::int32_t t : binding.tet) out.tet.push_back(own[static_cast<std::size_t>(t)]);
  out.barycentric = binding.barycentric;
  return out;
}

void bind_rows(Tissue& tissue, const std::vector<std::int32_t>& rows, int part, const PartedTets& tets,
               const Context& context) {
  Points points(static_cast<Eigen::Index>(rows.size()), 3);
  for (std::size_t i = 0; i < rows.size(); ++i)
    points.row(static_cast<Eigen::Index>(i)) = tissue.V.row(rows[i]).cast<double>();  // as it is stored
  const PartedTets::Bound bound = tets.bind(part, points, context);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    tissue.tet[static_cast<std::size_t>(rows[i])] = bound.tet[i];
    tissue.barycentric.row(rows[i]) = bound.barycentric.row(static_cast<Eigen::Index>(i));
  }
}

void append_vertices(Tissue& tissue, const std::vector<NewVertex>& added, const PartedTets& tets,
                     const Context& context) {
  auto row = static_cast<std::int32_t>(tissue.V.rows());
  const Eigen::Index count = tissue.V.rows() + static_cast<Eigen::Index>(added.size());
  tissue.V.conservativeResize(count, 3);
  tissue.barycentric.conservativeResize(count, 4);
  tissue.tet.resize(static_cast<std::size_t>(count));
  std::map<int, std::vector<std::int32_t>> by_part;
  for (const NewVertex& vertex : added) {
    tissue.V.row(row) = vertex.at.cast<float>().transpose();
    by_part[vertex.part].push_back(row++);
  }
  for (const auto& [part, rows] : by_part) bind_rows(tissue, rows, part, tets, context);
}

}  // namespace ecorche::parting
